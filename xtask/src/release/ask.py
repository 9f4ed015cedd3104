"""Asks an installed program: forces of a simulated sensor, and firmware for both boards.

ask.py PROGRAM FIRMWARE VERSION, with the folder of the firmware.
"""

import glob
import json
import subprocess
import sys

import hivtac

program, firmware, version = sys.argv[1:]
assert len(glob.glob(f"{firmware}/hivtac-firmware-{version}-*.bin")) == 2, firmware
command = [program, "twin", "--json", "--scene", "static"]
twin = subprocess.Popen(command, stdout=subprocess.PIPE)
try:
    with hivtac.open(json.loads(twin.stdout.readline())["port"]) as sensor:
        forces = sum(next(sensor).force is not None for _ in range(200))
finally:
    twin.kill()
assert forces > 150, forces
print(f"{program}: {forces} of 200 samples have a force")
