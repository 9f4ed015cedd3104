"""`python -m hivtac.rerun` on the simulated sensor and on a recording, read by Rerun's own reader.

    HIVTAC_TOOL=… python tests/python/test_rerun.py

`cargo xtask test --all rerun` builds the tool, and installs Rerun and the package first.
"""

# /// script
# requires-python = ">=3.11"
# dependencies = ["maturin>=1.9,<2", "rerun-sdk>=0.41"]
# ///
# It takes 0.9 GB.

import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import hivtac
import numpy as np
import rerun as rr
from hivtac.rerun import MM_PER_N
from rerun.chunk import RrdReader
from rig import true_force
from twin import PRESSED, Twin

TOOL = os.environ["HIVTAC_TOOL"]


def log(*words, seconds=None, program=(sys.executable, "-m", "hivtac.rerun")):
    """Runs the command into a file, for this long or to its end; returns the file's content."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "log.rrd"
        command = [*program, *words, "--save", file]
        # Without its own handling of Ctrl-C a background process would ignore it.
        process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        if seconds is not None:
            time.sleep(seconds)
            process.send_signal(signal.SIGINT)
        said = process.communicate(timeout=60)[1]
        if process.returncode != 0:
            raise AssertionError(said)
        return Content(file)


class Content:
    """The contents of a file, by entity and component."""

    def __init__(self, file):
        self.chunks = [chunk.to_record_batch() for chunk in RrdReader(file).stream()]
        self.paths = [chunk.entity_path for chunk in RrdReader(file).stream()]

    def by_frame(self, entity, component):
        """The component's values, by the frame's number."""
        found = {}
        for path, batch in zip(self.paths, self.chunks, strict=True):
            names = batch.schema.names
            wanted = [name for name in names if name.split(":")[-1] == component]
            if path == entity and wanted and "frame" in names:
                columns = (batch.column("frame"), batch.column(wanted[0]))
                rows = zip(*(column.to_pylist() for column in columns), strict=True)
                found |= {frame: value for frame, value in rows if value is not None}
        return found


class Logged(unittest.TestCase):
    def test_forces_of_a_sensor_are_true_and_pictures_have_mask_and_markers(self):
        with Twin(PRESSED) as twin:
            twin.run("settings", "set", "contact", "needle")
            # The tool looks for Python in its own folder, then along the path.
            path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
            served = ("env", f"PATH={path}", TOOL, "serve", "--rerun", "--port", twin.port)
            content = log("--", seconds=8, program=served)
            true = twin.truth()
        forces = content.by_frame("/hivtac/force", "scalars")
        known = [frame for frame, force in forces.items() if np.isfinite(force).all()]
        self.assertGreater(len(known), 50)
        sizes = content.by_frame("/hivtac/size", "scalars")
        tips = content.by_frame("/hivtac/film/force", "origins")
        arrows = content.by_frame("/hivtac/film/force", "vectors")
        for frame in known[5:]:
            wanted = true_force(true[frame])
            np.testing.assert_allclose(forces[frame], wanted, atol=5e-3)
            low, size, high = sizes[frame]
            self.assertTrue(0 < low < size < high < 0.2)
            np.testing.assert_allclose(arrows[frame][0], np.array(wanted) * MM_PER_N, atol=0.5)
            tip = np.add(tips[frame][0], arrows[frame][0])
            place = [true[frame]["place_x_mm"], true[frame]["place_y_mm"], 0]
            np.testing.assert_allclose(tip, place, atol=0.2)
        self.check_picture(content)

    def check_picture(self, content):
        pictures = content.by_frame("/hivtac/picture", "buffer")
        masks = content.by_frame("/hivtac/picture/mask", "buffer")
        markers = content.by_frame("/hivtac/picture/markers", "positions")
        self.assertTrue(pictures)
        self.assertEqual(set(pictures), set(masks))
        frame = max(frame for frame, found in markers.items() if len(found) == 4)
        picture = pixels(pictures[frame]).reshape(240, 320, 3)
        mask = pixels(masks[frame]).reshape(240, 320)
        for column, row in np.round(markers[frame]).astype(int):
            red, green, _ = picture[row, column].astype(int)
            self.assertGreater(red, 1.5 * green)
            self.assertEqual(mask[row, column], 1)
        self.assertEqual(mask[120, 5], 0)
        self.assertEqual(set(np.unique(mask)), {0, 1, 2})

    def test_a_recording_has_each_of_its_samples(self):
        with tempfile.TemporaryDirectory() as folder, Twin() as twin:
            file = Path(folder) / "press.mcap"
            twin.run("record", file, "--seconds", "2")
            samples = {sample.frame: sample for sample in hivtac.recording(file)}
            content = log(file)
        self.assertEqual(set(content.by_frame("/hivtac/force", "scalars")), set(samples))
        status = content.by_frame("/hivtac/status", "text")
        for frame, sample in samples.items():
            self.assertEqual(status[frame][0].split(), list(sample.status))

    def test_a_program_logs_samples_and_pictures_by_one_function(self):
        with tempfile.TemporaryDirectory() as folder, Twin() as twin:
            file = Path(folder) / "own.rrd"
            with rr.RecordingStream("own") as stream, hivtac.open(twin.port) as sensor:
                stream.save(file)
                sample, picture = next(sensor), sensor.look()
                hivtac.log_rerun(sample, "thumb")
                hivtac.log_rerun(picture, "thumb")
                stream.flush()
            content = Content(file)
        self.assertEqual(set(content.by_frame("/thumb/force", "scalars")), {sample.frame})
        self.assertEqual(set(content.by_frame("/thumb/picture", "buffer")), {picture.frame})

    def test_failures_are_reported(self):
        with self.assertRaisesRegex(AssertionError, "hivtac: .*no-such"):
            log("no-such.mcap")
        with self.assertRaisesRegex(AssertionError, "not both"):
            log("press.mcap", "--port", "tcp:127.0.0.1:1")


def pixels(buffer):
    """Bytes, however the reader gives a list of one buffer."""
    return np.array(buffer, np.uint8).ravel()


if __name__ == "__main__":
    runner = unittest.TextTestRunner(stream=sys.stdout, verbosity=2)
    unittest.main(testRunner=runner)
