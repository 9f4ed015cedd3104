"""Reads a recording with PyPI's `mcap` and `mcap-ros2-support`, and prints what is in it as JSON:
how many messages of each type and topic, the last wrench, the summaries, and how many messages are
read of the file cut at some places.

    python3 read_mcap.py FOLDER FILE

FOLDER gets a virtual environment with the two packages when it has none.
"""

import io
import json
import subprocess
import sys
import venv
from collections import Counter
from pathlib import Path

PACKAGES = ["mcap", "mcap-ros2-support"]


def environment(folder):
    python = folder / "bin/python"
    if not python.exists():
        venv.create(folder, with_pip=True, clear=True)
        quiet = ["--quiet", "--disable-pip-version-check"]
        install = [python, "-m", "pip", "install", *quiet, *PACKAGES]
        subprocess.run(install, check=True, stdout=sys.stderr)
    return python


def read(file):
    from mcap.reader import NonSeekingReader, make_reader
    from mcap_ros2.decoder import DecoderFactory

    data = Path(file).read_bytes()
    reader = make_reader(io.BytesIO(data), decoder_factories=[DecoderFactory()])
    counts, topics, last = Counter(), Counter(), {}
    for schema, channel, _, message in reader.iter_decoded_messages():
        counts[schema.name] += 1
        topics[channel.topic] += 1
        last[channel.topic.rsplit("/", 1)[1]] = message
    cut = []
    for part in range(1, 20):
        stream = io.BytesIO(data[: len(data) * part // 20])
        messages = NonSeekingReader(stream, decoder_factories=[DecoderFactory()])
        count = 0
        try:
            for _ in messages.iter_decoded_messages(log_time_order=False):
                count += 1
        except Exception:
            pass
        cut.append(count)
    force = last["wrench"].wrench.force
    summary = {entry.name: entry.metadata for entry in reader.iter_metadata()}
    return {
        "profile": reader.get_header().profile,
        "counts": counts,
        "force_n": [force.x, force.y, force.z],
        "frame_id": last["wrench"].header.frame_id,
        "markers": len(last["markers"].polygon.points) if "markers" in last else 0,
        "topics": topics,
        "summary": summary.get("hivtac"),
        "summaries": summary,
        "cut": cut,
    }


if __name__ == "__main__":
    if len(sys.argv) == 3:
        python = environment(Path(sys.argv[1]).absolute())
        sys.exit(subprocess.run([python, __file__, sys.argv[2]]).returncode)
    print(json.dumps(read(sys.argv[1])))
