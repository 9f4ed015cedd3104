"""The rig with the firmware, as a program, for tests in Python."""

import json
import os
import subprocess
import tempfile
from pathlib import Path

# The emulator runs at about a tenth of real time, and tests share the processors.
PATIENCE = 60.0


class Rig:
    """The rig (`HIVTAC_RIG`) with the firmware (`HIVTAC_ELF`), at a TCP port of its own."""

    def __init__(self, scene="demo", *options, tcp="0"):
        self._folder = tempfile.TemporaryDirectory()
        self.truth_file = Path(self._folder.name) / "truth"
        self._process = subprocess.Popen(
            [
                os.environ["HIVTAC_RIG"],
                "--tcp",
                tcp,
                "--truth",
                self.truth_file,
                "--scene",
                scene,
                *options,
                os.environ["HIVTAC_ELF"],
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        said = self._process.stdout.readline()
        self.port = "tcp:" + said.strip().split("tcp=", 1)[1]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.kill()
        self._process.stdout.close()
        self._folder.cleanup()

    def set_needle(self):
        """Tells the firmware that a needle presses, as it does in the scenes."""
        subprocess.run(
            [
                os.environ["HIVTAC_TOOL"],
                *"settings set contact needle --timeout".split(),
                str(PATIENCE),
                "--port",
                self.port,
            ],
            check=True,
            stdout=subprocess.DEVNULL,
        )

    def kill(self):
        self._process.kill()
        self._process.wait()

    def truth(self):
        """The truth of each frame, by its number."""
        lines = self.truth_file.read_text().splitlines()
        whole = [json.loads(line) for line in lines if line.endswith("}")]
        return {line["frame"]: line for line in whole}


def true_force(true):
    """N, of a line of the rig's truth."""
    return [true["x_n"], true["y_n"], true["z_n"]]
