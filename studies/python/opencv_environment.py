"""Prints the path of a Python with OpenCV in its own virtual environment, which is made if missing.

    python3 opencv_environment.py FOLDER
"""

import subprocess
import sys
import venv
from pathlib import Path

PACKAGES = ["opencv-python-headless", "numpy"]


def works(python):
    if not python.exists():
        return False
    imports = [python, "-c", "import cv2, numpy"]
    return subprocess.run(imports, capture_output=True).returncode == 0


def main(folder):
    python = folder / "bin/python"
    if not works(python):
        venv.create(folder, with_pip=True, clear=True)
        quiet = ["--quiet", "--disable-pip-version-check"]
        install = [python, "-m", "pip", "install", *quiet, *PACKAGES]
        subprocess.run(install, check=True, stdout=sys.stderr)
        if not works(python):
            sys.exit(f"{' and '.join(PACKAGES)} are installed in {folder} and cannot be imported")
    print(python)


if __name__ == "__main__":
    try:
        main(Path(sys.argv[1]).absolute())
    except (subprocess.CalledProcessError, OSError) as error:
        sys.exit(f"{' and '.join(PACKAGES)} cannot be installed in {sys.argv[1]}: {error}")
