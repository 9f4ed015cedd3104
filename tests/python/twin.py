"""`hivtac twin` as a program: the simulated sensor in real time, for tests in Python."""

import json
import os
import subprocess
import tempfile
from pathlib import Path

# A press that stays, at a place and with a tilt.
PRESSED = """
[film]
offset_mm = [1.5, -1.0]
[load]
motion = "press"
[load.press]
force_n = 0.12
alpha_deg = 5.0
beta_deg = -4.0
start_s = 0.0
rise_s = 0.05
hold_s = 600.0
"""


# Two needles that stay, as a course: the sum, and each with its force and place.
PAIR = """time_s,x_n,y_n,z_n,\
contact1_x_n,contact1_y_n,contact1_z_n,contact1_place_x_mm,contact1_place_y_mm,\
contact2_x_n,contact2_y_n,contact2_z_n,contact2_place_x_mm,contact2_place_y_mm
0,0,0,-0.11,0,0,-0.05,-2.5,1.0,0,0,-0.06,1.5,-0.5
"""


class Twin:
    """A twin (`HIVTAC_TOOL`) at a TCP port of its own, with a scene by its name or its text, and
    other options of the tool. The text of a course goes into a file, too."""

    def __init__(self, scene="rest", camera="ov7725", course=None, options=()):
        self._folder = tempfile.TemporaryDirectory()
        folder = Path(self._folder.name)
        self._truth_file = folder / "truth"
        if "\n" in scene:
            (folder / "scene.toml").write_text(scene)
            scene = folder / "scene.toml"
        if course:
            (folder / "course.csv").write_text(course)
            options = [*options, "--course", folder / "course.csv"]
        self.process = subprocess.Popen(
            [
                os.environ["HIVTAC_TOOL"],
                "twin",
                "--json",
                "--scene",
                scene,
                "--camera",
                camera,
                "--truth",
                self._truth_file,
                *options,
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self.port = json.loads(self.process.stdout.readline())["port"]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()
        self._folder.cleanup()

    def run(self, *words):
        """Runs a command of the tool on it."""
        command = [os.environ["HIVTAC_TOOL"], *words, "--port", self.port]
        subprocess.run(
            [*command, "--timeout", "20"], check=True, stdout=subprocess.DEVNULL
        )

    def truth(self):
        """The truth of each frame until now, by its number."""
        lines = self._truth_file.read_text().splitlines()
        whole = [json.loads(line) for line in lines if line.endswith("}")]
        return {line["frame"]: line for line in whole}
