"""The simulated sensor in a program's own time, alone and inside a simulation of MuJoCo.

    python tests/python/test_twin.py

`cargo xtask test --all mujoco` installs MuJoCo and the package first.
"""

# /// script
# requires-python = ">=3.10"
# dependencies = ["maturin>=1.9,<2", "mujoco>=3.3"]
# ///

import sys
import unittest
from pathlib import Path

import hivtac
import mujoco
import numpy as np
from hivtac.twin import Twin, contact_on

MODELS = Path(__file__).parents[2] / "calibration/models"

# A ball of 8 g falls onto a film that looks up, off its middle: z of the film is the world's, y
# the world's backwards.
BALL = """
<mujoco>
  <option timestep="0.001"/>
  <worldbody>
    <body name="finger" pos="0.1 0 0.05">
      <geom name="film" type="box" size="0.014 0.014 0.0005" pos="0 0 -0.0005"/>
      <site name="middle" euler="0 0 0"/>
    </body>
    <body name="ball" pos="0.102 -0.001 0.0545">
      <joint type="slide" axis="0 0 1" damping="0.05"/>
      <geom type="sphere" size="0.004" mass="0.008"/>
    </body>
  </worldbody>
</mujoco>
"""


class Alone(unittest.TestCase):
    def test_samples_have_the_press_in_the_programs_time(self):
        twin = Twin()
        rest = twin.advance(0.1)
        # 156 frames a second.
        self.assertIn(len(rest), (15, 16))
        self.assertTrue(all(0 < sample.time <= 0.1 for sample in rest))
        self.assertFalse(any(sample.contact for sample in rest))
        self.assertNotIn("tare_missing", rest[-1].status)
        force, place = np.array([0.004, -0.006, -0.09]), np.array([0.0015, -0.001])
        twin.press(force, place)
        pressed = twin.advance(0.2)
        self.assertEqual(pressed[0].sequence, rest[-1].sequence + 1)
        # A press begins while the rows of its first frame are exposed. Until the markers are steady
        # again, the direction is uncertain.
        for sample in pressed[3:]:
            np.testing.assert_allclose(sample.force, force, atol=2e-3)
            np.testing.assert_allclose(sample.place, place, atol=1e-4)
            self.assertTrue(sample.contact)
        self.assertEqual(twin.advance(0.2), [])
        twin.release()
        self.assertFalse(twin.advance(0.4)[-1].contact)

    def test_the_same_presses_give_the_same_samples(self):
        runs = []
        for seed in (1, 1, 2):
            twin = Twin("mt9v034", seed=seed)
            twin.press([0, 0, -0.1], [0, 0])
            samples = twin.advance(0.05)
            self.assertIn(len(samples), (11, 12, 13))
            runs.append([sample.markers.tolist() for sample in samples])
        self.assertEqual(runs[0], runs[1])
        self.assertNotEqual(runs[0], runs[2])

    def test_a_unit_is_another_one_and_goes_by_the_model_it_is_given(self):
        forces = []
        for options in ({}, {"unit": 7}, {"unit": 7, "model": MODELS / "yuv422/default.hvtm"}):
            twin = Twin(**options)
            twin.press([0, 0, -0.1], [0.001, 0])
            last = twin.advance(0.1)[-1]
            self.assertTrue(last.contact)
            forces.append(last.force)
        self.assertGreater(np.abs(forces[0] - forces[1]).max(), 1e-3)
        self.assertFalse((forces[1] == forces[2]).all())

    def test_a_calibrated_unit_says_what_its_model_knows(self):
        twin = Twin(unit=MODELS / "default.hvtm")
        self.assertFalse(twin.advance(0.1)[-1].contact)
        force, place = np.array([0.004, -0.006, -0.09]), np.array([0.0015, -0.001])
        twin.press(force, place)
        for sample in twin.advance(0.2)[3:]:
            np.testing.assert_allclose(sample.force, force, atol=1e-3)
            np.testing.assert_allclose(sample.place, place, atol=5e-5)
            self.assertTrue(sample.contact)

    def test_eight_dots_show_that_nothing_turns(self):
        twin = Twin(contact="unknown", unit=MODELS / "8v/default.hvtm")
        twin.press([0.004, -0.006, -0.09], [0.0015, -0.001])
        last = twin.advance(0.2)[-1]
        self.assertEqual(last.markers.shape, (8, 2))
        # N·m: of the order of 0.003 N·mm.
        self.assertTrue(0 < last.torque_sigma < 2e-5)
        self.assertLess(abs(last.torque_z), 4 * last.torque_sigma)
        self.assertEqual(last.contacts[0].torque_z, last.torque_z)
        of_four = Twin(contact="unknown")
        of_four.press([0, 0, -0.1], [0, 0])
        self.assertIsNone(of_four.advance(0.1)[-1].torque_z)

    def test_what_cannot_be_is_refused_and_the_press_before_stays(self):
        for words, options in [
            ("from 1 to 1000000", {"unit": 0}),
            ("no-such.hvtm", {"model": "no-such.hvtm"}),
            ("no-such.hvtm", {"unit": "no-such.hvtm"}),
            ("leave model out", {"unit": __file__, "model": __file__}),
            ("test_twin.py", {"model": __file__}),
            ("another camera than ov7725", {"model": MODELS / "mt9v034/default.hvtm"}),
        ]:
            with self.assertRaisesRegex(hivtac.Error, words):
                Twin(**options)
        with self.assertRaisesRegex(hivtac.Error, "ov7725, ov5640 or mt9v034"):
            Twin("webcam")
        with self.assertRaisesRegex(hivtac.Error, "0.25 to 4 mm"):
            Twin(contact="flat:9")
        twin = Twin()
        twin.press([0, 0, -0.1], [0, 0])
        wrong = [
            ([0, 0, -0.3], [0, 0]),
            ([0, 0, -0.1], [0.005, 0]),
            ([0.1, 0, -0.1], [0, 0]),
            ([0, 0, 0.1], [0, 0]),
            ([0, 0, float("nan")], [0, 0]),
        ]
        for force, place in wrong:
            with self.assertRaisesRegex(hivtac.Error, "out of the sensor's range"):
                twin.press(force, place)
        with self.assertRaisesRegex(hivtac.Error, "is no time"):
            twin.advance(float("nan"))
        self.assertTrue(twin.advance(0.1)[-1].contact)


class InMujoco(unittest.TestCase):
    def test_a_ball_that_lies_on_the_film_is_felt_with_its_weight(self):
        model = mujoco.MjModel.from_xml_string(BALL)
        data = mujoco.MjData(model)
        film, middle = model.geom("film").id, model.site("middle").id
        twin, samples = Twin(contact="unknown"), []
        while data.time < 1.0:
            mujoco.mj_step(model, data)
            force, place = contact_on(model, data, film, middle)
            if 0 < np.linalg.norm(force) < 0.25:
                twin.press(force, place)
            elif not force.any():
                twin.release()
            samples += twin.advance(data.time)
        self.assertIn(len(samples), (155, 156, 157))
        self.assertFalse(samples[0].contact)
        last = samples[-1]
        np.testing.assert_allclose(last.force, [0, 0, -0.008 * 9.81], atol=6e-3)
        self.assertLess(abs(last.force[2] + 0.008 * 9.81), 3 * last.magnitude_sigma)
        np.testing.assert_allclose(last.place, [0.002, -0.001], atol=2e-4)


if __name__ == "__main__":
    runner = unittest.TextTestRunner(stream=sys.stdout, verbosity=2)
    unittest.main(testRunner=runner)
