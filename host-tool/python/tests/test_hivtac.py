"""Tests `hivtac` on the firmware in the rig, over TCP, and on recordings of the tool.

    HIVTAC_RIG=… HIVTAC_ELF=… HIVTAC_TOOL=… python host-tool/python/tests/test_hivtac.py

`cargo xtask test --all python` builds these programs and installs the package first.
"""

# /// script
# requires-python = ">=3.9"
# dependencies = ["maturin>=1.9,<2", "mypy", "numpy"]
# ///

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

import numpy as np

import hivtac

sys.path.append(str(Path(__file__).parents[3] / "tests/python"))
from rig import PATIENCE, Rig, true_force  # noqa: E402
from twin import PRESSED, Twin  # noqa: E402


class OnTwoTwins(unittest.TestCase):
    def test_a_grip_is_that_of_both_presses(self):
        other_scene = '[camera]\npreset = "mt9v034"\n' + PRESSED
        with Twin(PRESSED) as one, Twin(other_scene, camera="mt9v034") as other:
            with (
                hivtac.open(one.port, timeout=PATIENCE) as thumb,
                hivtac.open(other.port, timeout=PATIENCE) as index,
            ):
                grips = hivtac.grip(thumb, index)
                known = [grip for grip, _ in zip(grips, range(60)) if grip.cause is None]
        self.assertGreater(len(known), 20)
        self.assertTrue(all(a.time < b.time for a, b in zip(known, known[1:])))
        last = known[-1]
        self.assertLess(abs(last.time - time.time()), 60)
        self.assertTrue(last.contact)
        alpha, beta = np.radians([5.0, -4.0])
        x, z = 0.12 * np.sin(alpha) * np.cos(beta), -0.12 * np.cos(alpha) * np.cos(beta)
        self.assertLess(abs(last.force + z), 4 * last.force_sigma)
        off = np.abs(last.common - [2 * x, 0, 0])
        self.assertTrue((off < 4 * last.common_sigma).all(), (last.common, last.common_sigma))
        pull = np.hypot(x, 0.12 * np.sin(beta))
        self.assertLess(abs(last.margin + 0.5 * z + pull), 4 * last.margin_sigma)
        self.assertEqual((last.torque.shape, last.torque_sigma.shape), ((3,), (3,)))

    def test_a_file_that_is_no_geometry_is_refused(self):
        with Twin() as one, Twin(camera="mt9v034") as other, tempfile.TemporaryDirectory() as it:
            poses = Path(it) / "poses.json"
            poses.write_text("{}")
            with hivtac.open(one.port) as thumb, hivtac.open(other.port) as index:
                with self.assertRaisesRegex(hivtac.Error, "missing field `fingers`"):
                    hivtac.grip(thumb, index, poses=poses)


class OnTheRig(unittest.TestCase):
    def test_samples_are_those_of_the_scene(self):
        with Rig() as rig, hivtac.open(rig.port, timeout=PATIENCE) as sensor:
            sensor.set_contact("needle")
            samples = []
            for sample in sensor:
                samples.append(sample)
                if len(samples) >= 40 and sample.contact or len(samples) == 400:
                    break
            truth = rig.truth()
        self.assertEqual((sensor.device.width, sensor.device.height), (320, 240))
        self.assertEqual(len(sensor.device.serial), 24)
        first = samples[0].sequence
        self.assertEqual(
            [sample.sequence for sample in samples],
            list(range(first, first + len(samples))),
        )
        # 156 frames a second by the device's clock.
        seconds = samples[-1].time - samples[0].time
        frames = samples[-1].frame - samples[0].frame
        self.assertAlmostEqual(frames / seconds, 156.1, delta=0.5)
        last = samples[-1]
        self.assertTrue(last.contact)
        self.assertIn("not_calibrated", last.status)
        true = truth[last.frame]
        np.testing.assert_allclose(last.force, true_force(true), atol=5e-3)
        direction = [
            np.sin(last.alpha) * np.cos(last.beta),
            np.sin(last.beta),
            -np.cos(last.alpha) * np.cos(last.beta),
        ]
        np.testing.assert_allclose(
            last.force, last.magnitude * np.array(direction), atol=1e-5
        )
        self.assertGreater(last.magnitude_sigma, 0)
        self.assertEqual((last.place.shape, last.markers.shape), ((2,), (4, 2)))
        self.assertLess(np.abs(last.place).max(), 5e-3)
        self.assertLess(abs(last.host_time - time.time()), 60)
        self.assertTrue(0 < last.host_time - last.exposed < 10)

    def test_a_slow_program_gets_arrival_times_and_the_newest_sample(self):
        with Rig() as rig, hivtac.open(rig.port, timeout=PATIENCE) as sensor:
            next(sensor)
            # Whatever the rig's speed, samples wait here at last.
            waited = time.time()
            while waited - (second := next(sensor)).host_time < 0.05:
                time.sleep(0.2)
                waited = time.time()
            newest = sensor.newest()
            self.assertGreater(newest.sequence, second.sequence)
            self.assertEqual(
                sensor.missed, newest.sequence - second.sequence - 1
            )
            self.assertGreater(sensor.newest(PATIENCE).sequence, newest.sequence)
            # Until the next sample there is none, whatever the rig's speed.
            while sensor.newest(timeout=0) is not None:
                pass

    def test_samples_come_while_another_thread_waits_for_a_picture(self):
        with Rig("rest") as rig, hivtac.open(rig.port, timeout=PATIENCE) as sensor:
            first = next(sensor)
            pictures = []
            thread = threading.Thread(target=lambda: pictures.append(sensor.snapshot()))
            thread.start()
            while thread.is_alive():
                sample = next(sensor)
            thread.join()
        self.assertEqual(pictures[0].shape, (240, 320, 3))
        # A snapshot lasts 0.14 s of the device's time.
        self.assertGreater(sample.sequence, first.sequence + 10)

    def test_a_tare_and_a_picture_between_samples(self):
        with Rig("rest") as rig, hivtac.open(rig.port, timeout=PATIENCE) as sensor:
            before = next(sensor)
            tare = sensor.tare(frames=4)
            again = sensor.tare(frames=4)
            rest = sensor.rest()
            picture = sensor.snapshot()
            look = sensor.look()
            after = next(sensor)
            with self.assertRaisesRegex(hivtac.RefusedError, "outside its range"):
                sensor.tare(frames=0)
            with self.assertRaisesRegex(hivtac.Error, "0.25 to 4 mm"):
                sensor.set_contact("flat:5")
            sensor.set_contact("flat:2")
        self.assertEqual(after.sequence, before.sequence + 1)
        self.assertEqual(tare.markers.shape, (4, 2))
        self.assertLess(tare.spread, 0.5)
        self.assertIsNone(tare.moved)
        moved = again.moved
        self.assertEqual(moved.shift.shape, (2,))
        self.assertLess(max(moved.farthest, moved.beside, *np.abs(moved.shift)), 0.1)
        self.assertLess(max(abs(moved.turn), abs(moved.larger)), 1e-3)
        self.assertEqual(rest, hivtac.Rest(True, False, 0.0, None, None))
        self.assertEqual((picture.shape, picture.dtype), ((240, 320, 3), np.uint8))
        red, green = picture[..., 0].astype(int), picture[..., 1].astype(int)
        for column, row in tare.markers.round().astype(int):
            self.assertGreater(red[row, column], 1.5 * green[row, column])
        self.assertLess(red[120, 160], 1.5 * green[120, 160])
        self.assertEqual((look.pixels.shape, look.mask.shape), ((240, 320, 3), (240, 320)))
        np.testing.assert_allclose(look.markers, tare.markers, atol=0.5)
        for column, row in look.markers.round().astype(int):
            self.assertEqual(look.mask[row, column], 255)
        self.assertEqual(look.mask[120, 160], 0)
        with self.assertRaisesRegex(hivtac.Error, "closed"):
            sensor.tare()
        self.assertEqual(list(sensor), [])

    def test_a_lost_connection_is_reported_and_ends_the_wait(self):
        with Rig() as rig, hivtac.open(rig.port, timeout=PATIENCE) as sensor:
            next(sensor)
            rig.kill()
            with self.assertRaisesRegex(hivtac.LostError, "connection to .* lost"):
                for _ in sensor:
                    pass

    def test_a_recording_has_what_the_tool_counted(self):
        with tempfile.TemporaryDirectory() as folder, Rig() as rig:
            file = Path(folder) / "press.mcap"
            tool = [os.environ["HIVTAC_TOOL"], "record", file, "--port", rig.port]
            options = ["--seconds", "4", "--timeout", str(PATIENCE), "--json"]
            said = subprocess.run(
                [*tool, *options], check=True, capture_output=True, text=True
            )
            recording = hivtac.recording(file)
            samples = list(recording)
            self.assertEqual(len(samples), json.loads(said.stdout)["samples"])
            self.assertFalse(recording.is_cut)
            self.assertEqual(samples[-1].markers.shape, (4, 2))
            cut = file.with_name("cut.mcap")
            cut.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
            part = hivtac.recording(cut)
            self.assertLess(0, len(list(part)))
            self.assertTrue(part.is_cut)
            with self.assertRaisesRegex(hivtac.Error, "no sensor with the name"):
                hivtac.recording(file, device="thumb")


class WithoutASensor(unittest.TestCase):
    def test_a_package_of_another_system_says_what_to_do(self):
        with tempfile.TemporaryDirectory() as folder:
            package = Path(folder) / "hivtac"
            shutil.copytree(Path(hivtac.__file__).parent, package)
            [compiled] = package.glob("_hivtac*.so")
            compiled.write_bytes(b"compiled for another system")
            run = subprocess.run(
                [sys.executable, "-c", "import hivtac"],
                cwd=folder,
                capture_output=True,
                text=True,
            )
        self.assertEqual(run.returncode, 1)
        self.assertRegex(run.stderr, r"does not load here \(.*_hivtac.*\): it was installed for")
        self.assertIn("pip install --force-reinstall", run.stderr)

    def test_errors_have_the_tools_text(self):
        with silent() as port:
            with self.assertRaisesRegex(hivtac.NoDeviceError, "no hello from"):
                hivtac.open(port, timeout=0.3)
        for port in ["/dev/no-such-port", "tcp:127.0.0.1:1"]:
            with self.assertRaisesRegex(hivtac.NoDeviceError, port.removeprefix("tcp:")):
                hivtac.open(port)
        with self.assertRaisesRegex(hivtac.NoDeviceError, "thumb"):
            hivtac.open(device="thumb")
        with self.assertRaisesRegex(hivtac.Error, "not both"):
            hivtac.open("tcp:127.0.0.1:1", device="thumb")
        with self.assertRaisesRegex(hivtac.Error, "no time to wait"):
            hivtac.open("tcp:127.0.0.1:1", timeout=-1)
        with self.assertRaisesRegex(hivtac.Error, "no recording"):
            hivtac.recording(__file__)
        with self.assertRaisesRegex(hivtac.Error, "cannot read"):
            hivtac.recording("no-such-file.mcap")

    def test_other_threads_run_while_one_waits(self):
        begun, ended = threading.Event(), threading.Event()

        def wait(port):
            begun.set()
            with self.assertRaises(hivtac.NoDeviceError):
                hivtac.open(port, timeout=2)
            ended.set()

        with silent() as port:
            thread = threading.Thread(target=wait, args=[port])
            thread.start()
            begun.wait()
            turns = 0
            while not ended.is_set():
                time.sleep(0.01)
                turns += 1
            thread.join()
        self.assertGreater(turns, 50)

    def test_ctrl_c_ends_a_wait(self):
        # A process in a shell's background ignores SIGINT, as do its children.
        program = (
            "import signal, sys, hivtac\n"
            "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
            "print(flush=True)\n"
            "hivtac.open(sys.argv[1], timeout=60)\n"
        )
        with silent() as port:
            process = subprocess.Popen(
                [sys.executable, "-c", program, port],
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
            process.stdout.readline()
            time.sleep(0.5)
            process.send_signal(signal.SIGINT)
            _, said = process.communicate(timeout=20)
        self.assertIn("KeyboardInterrupt", said)
        self.assertEqual(process.returncode, -signal.SIGINT)


class silent:
    """A TCP port that accepts every connection, and sends nothing."""

    def __enter__(self):
        self._listener = socket.create_server(("127.0.0.1", 0))
        return "tcp:127.0.0.1:%d" % self._listener.getsockname()[1]

    def __exit__(self, *_):
        self._listener.close()


if __name__ == "__main__":
    runner = unittest.TextTestRunner(stream=sys.stdout, verbosity=2)
    unittest.main(testRunner=runner)
