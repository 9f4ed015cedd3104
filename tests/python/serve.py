"""`hivtac serve` as a program, for tests in Python."""

import json
import os
import signal
import subprocess
import tempfile
import time
from pathlib import Path

from rig import PATIENCE

# The exit code after Ctrl-C.
INTERRUPTED = 130


def command(*options):
    return [os.environ["HIVTAC_TOOL"], "serve", *options]


class Serve:
    """`hivtac serve` (`HIVTAC_TOOL`), until it is left. `ready` is its first line."""

    def __init__(self, *options, env=None):
        self._errors = tempfile.NamedTemporaryFile()
        self._process = subprocess.Popen(
            command("--json", *options),
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
            env=env,
        )
        line = self._process.stdout.readline()
        if not line:
            raise AssertionError(self.end())
        self.ready = json.loads(line)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.end()
        self._errors.close()

    def errors(self):
        """Its standard error until now."""
        return Path(self._errors.name).read_text()

    def end(self):
        """Ends it as Ctrl-C does; returns its standard error."""
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGINT)
        self._process.communicate(timeout=20)
        self.code = self._process.returncode
        return self.errors()


def refused(*options, env=None):
    """`hivtac serve` with options that it refuses, after its end."""
    return subprocess.run(
        command(*options), env=env, capture_output=True, text=True, timeout=30
    )


def until(condition, patience=PATIENCE):
    """The condition's value once it is true."""
    end = time.monotonic() + patience
    while time.monotonic() < end:
        if value := condition():
            return value
        time.sleep(0.02)
    raise AssertionError(f"not within {patience} s")
