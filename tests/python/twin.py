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


class Twin:
    """A twin (`HIVTAC_TOOL`) at a TCP port of its own, with a scene by its name or its text."""

    def __init__(self, scene="rest", camera="ov7725"):
        self._folder = tempfile.TemporaryDirectory()
        folder = Path(self._folder.name)
        self._truth_file = folder / "truth"
        if "\n" in scene:
            (folder / "scene.toml").write_text(scene)
            scene = folder / "scene.toml"
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
        """What is true of each frame until now, by its number."""
        lines = self._truth_file.read_text().splitlines()
        whole = [json.loads(line) for line in lines if line.endswith("}")]
        return {line["frame"]: line for line in whole}
