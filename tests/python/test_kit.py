"""The kit's solids: closed, printable, without collisions, and out of the camera's sight.

    HIVTAC_TOOL=… python tests/python/test_kit.py

`cargo xtask test --all kit` builds the tool and installs build123d first.
"""

# /// script
# requires-python = ">=3.10"
# dependencies = ["build123d>=0.13,<0.14"]
# ///
# It takes 1 GB, and needs a solid modeller for this computer.

import io
import os
import re
import subprocess
import sys
import tempfile
import unittest
from contextlib import redirect_stdout
from dataclasses import replace
from functools import cache
from math import cos, hypot, radians, sin
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "hardware"))

import numpy as np
from build123d import import_step

from kit import assembly, jigs, lamp, parts
from kit.__main__ import LAMP, write
from kit.dimensions import SCENE, Bought, Kit, Unsuitable
from kit.mesh import Mesh

KIT = Kit()
# Two lines of a nozzle of 0.4 mm, and the stop's teeth.
THINNEST = 0.75
# What is printed over air, mm from what it hangs on: the stand's slot, as a bridge of 17 mm.
BRIDGE = 8.6
# The side of a small printer's bed, mm.
BED = 120


@cache
def meshes() -> dict[str, Mesh]:
    """All printed parts as they lie on the bed."""
    makers = {**parts.PRINTED, **jigs.PRINTED}
    return {name: Mesh.of(parts.as_printed(name, make(KIT))) for name, (make, _) in makers.items()}


@cache
def placed() -> dict:
    return assembly.assembled(KIT)


@cache
def placed_meshes() -> dict[str, Mesh]:
    return {name: Mesh.of(part) for name, part in placed().items()}


def circles(svg: str, kind: str) -> list[list[float]]:
    """Centre and radius of a template's circles of a class."""
    found = re.findall(rf'class="{kind}" cx="(\S+)" cy="(\S+)" r="(\S+)"', svg)
    return [[float(number) for number in circle] for circle in found]


def holes(part, at: tuple[float, float], height: float) -> float:
    """The diameter of the hole around a place, looked for outwards from it."""
    mesh = Mesh.of(part, 0.005)
    turns = np.linspace(0, 2 * np.pi, 24, endpoint=False) + 0.01
    ways = np.column_stack([np.cos(turns), np.sin(turns), np.zeros(24)])
    begins = np.tile([*at, height], (24, 1))
    far = mesh.first_hits(begins, ways)[0]
    assert far.max() - far.min() < 0.1, f"no round hole around {at}: {far}"
    return 2 * float(far.mean())


class Printable(unittest.TestCase):
    def test_every_solid_is_one_and_closed(self):
        for name, (make, _) in {**parts.PRINTED, **jigs.PRINTED}.items():
            with self.subTest(name):
                part, mesh = make(KIT), meshes()[name]
                self.assertEqual(len(part.solids()), 1)
                self.assertTrue(part.is_valid)
                self.assertTrue(mesh.is_closed())
                self.assertAlmostEqual(mesh.volume() / part.volume, 1, delta=0.02)

    def test_walls_are_thick_enough_and_nothing_hangs(self):
        for name, mesh in meshes().items():
            with self.subTest(name):
                wall, where = mesh.thinnest_wall(2.0)
                self.assertGreater(wall, THINNEST, f"at {where.round(1)}")
                for area, far in mesh.overhangs():
                    self.assertLess(far, BRIDGE, f"{area:.1f} mm² over air")
                self.assertLess(np.ptp(mesh.corners, axis=0).max(), BED)

    def test_the_checks_can_fail(self):
        roof = parts.block(10, 10, 8, 9) + parts.block(10, 1, 0, 8)
        self.assertGreater(max(far for _, far in Mesh.of(roof).overhangs()), BRIDGE)
        sheet = Mesh.of(parts.block(10, 10, 0, 0.5))
        self.assertAlmostEqual(sheet.thinnest_wall()[0], 0.5, places=3)
        self.assertFalse(replace(sheet, triangles=sheet.triangles[1:]).is_closed())
        both = {"one": parts.block(5, 5, 0, 5), "other": parts.block(5, 5, 4.9, 6)}
        self.assertEqual(assembly.collisions(both), ["one and other share 10.00 mm³"])


class Assembled(unittest.TestCase):
    def test_parts_do_not_collide(self):
        self.assertEqual(assembly.collisions(placed()), [])

    def test_the_film_is_ten_millimetres_from_the_pupil(self):
        box = placed()["film"].bounding_box()
        self.assertAlmostEqual(box.min.Z - KIT.pupil, SCENE["film_distance_mm"])
        self.assertAlmostEqual(KIT.post_length, placed()["post 0"].bounding_box().max.Z)
        longer = Kit(replace(Bought(), pupil=1.6, lens_front=21))
        self.assertAlmostEqual(longer.post_length - KIT.post_length, 1 + 0.4)

    def test_the_camera_sees_the_dots_and_nothing_else(self):
        seen = assembly.intruders(KIT, placed_meshes())
        for picture in assembly.Picture.all():
            with self.subTest(picture.preset):
                self.assertGreater(picture.inside(KIT, assembly.dots(KIT)).min(), 30)
                others = {name: far for name, far in seen[picture.preset].items()}
                # The lens itself, and its holder.
                del others["camera"]
                # A post's end may touch the picture's corner.
                for name, far in others.items():
                    self.assertLess(far, 3 if name.startswith("post") else -5, name)

    def test_the_pressed_film_stays_clear_of_stop_and_lens(self):
        for name, least in {"stop": 0.4, "camera": 1.4, "cover": 1, "shell": 1}.items():
            with self.subTest(name):
                self.assertGreater(assembly.film_clearance(KIT, placed_meshes()[name]), least)
        # The stop comes before the glass.
        self.assertGreater(KIT.stop_top - KIT.lens_front, 1)
        # At 0.2 N two millimetres are free.
        travel = dict(SCENE["travel_mm"])[0.2]
        self.assertGreater(KIT.film - travel - KIT.lens_front, 1.95)
        with self.assertRaisesRegex(Unsuitable, "pupil is 4.00 mm .* at most 2.18 mm"):
            Kit(replace(Bought(), pupil=4))
        with self.assertRaisesRegex(Unsuitable, "must be 13.50 mm or more"):
            Kit(replace(Bought(), lens_front=12))

    def test_no_light_comes_straight_and_no_dot_mirrors_a_window(self):
        self.assertEqual(assembly.direct_light(KIT, placed_meshes()), [])
        without = {**placed_meshes(), "stop": placed_meshes()["film"]}
        self.assertRegex(assembly.direct_light(KIT, without)[0], "^lens: ")
        self.assertGreater(assembly.mirrored(KIT, placed_meshes()), 1)

    def test_the_lamp_gives_enough_light_and_little_heat(self):
        lux = assembly.illuminance(KIT, LAMP.lumens)
        self.assertGreater(min(lux), 2_000)
        low, high = LAMP.currents_ma
        self.assertTrue(5 < low < LAMP.current_ma() < high < 20)
        whole, resistor = LAMP.heat_mw
        self.assertTrue(LAMP.total_ma < 100 and whole < 500 and resistor < 125 / 2)


class SharedDimensions(unittest.TestCase):
    def test_template_and_jigs_have_the_same_places(self):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "template.svg"
            template = [os.environ["HIVTAC_TOOL"], "template", file]
            subprocess.run(template, check=True, stdout=subprocess.DEVNULL)
            svg = file.read_text()
        left, top, side = re.search(
            r'class="film" x="(\S+)" y="(\S+)" width="(\S+)"', svg
        ).groups()
        self.assertEqual(float(side), KIT.film_side)
        middle = [float(edge) + float(side) / 2 for edge in (left, top)]
        kinds = {"post": (jigs.punch_guide, 4), "marker": (jigs.dot_guide, 3)}
        for kind, (make, height) in kinds.items():
            found = circles(svg, kind)
            self.assertEqual(len(found), 4)
            for x, y, _ in found:
                # A jig's upper side is the camera's: the template's right is its right.
                holes(make(KIT), (x - middle[0], y - middle[1]), height)
        self.assertEqual(2 * circles(svg, "post")[0][2], KIT.film_hole)
        self.assertEqual(2 * circles(svg, "marker")[0][2], KIT.bought.pin)

    def test_bores_are_where_the_guide_loads_a_unit(self):
        guide = (ROOT / "docs/calibration.md").read_text()
        poses = guide.split("alpha,beta,x,y\n")[1].split("```")[0].split()
        rows = [[float(part) for part in row.split(",")] for row in poses]
        self.assertEqual(len(rows), 10)
        for alpha, beta, x, y in rows:
            if alpha == beta == 0:
                self.assertIn((x, y), KIT.places)
                wide = holes(jigs.tip_guide(KIT), (x, y), KIT.frame_top + 1.5)
                self.assertAlmostEqual(wide, KIT.bought.pin + 0.3, delta=0.02)
            else:
                self.assertEqual(hypot(alpha, beta), KIT.tilt_deg)
        # The tilted bore leads to the film's middle.
        tilted = jigs.tilt_guide(KIT)
        height = KIT.frame_top + 1.5
        aside = (height - KIT.film_top) * sin(radians(KIT.tilt_deg)) / cos(radians(KIT.tilt_deg))
        holes(tilted, (aside, 0), height)
        # The carrier's foot meets the guide before the film meets the stop.
        deepest = KIT.frame_top + 3 - jigs.pin_length(KIT)
        self.assertTrue(KIT.stop_top < deepest < KIT.film_top - KIT.travel)


class Written(unittest.TestCase):
    def test_all_files_are_written_and_those_of_the_guide_are_current(self):
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder)
            # The runner's line ends in the test's result.
            with redirect_stdout(io.StringIO()):
                write(KIT, out)
            for name, (make, _) in {**parts.PRINTED, **jigs.PRINTED}.items():
                again = import_step(out / "step" / f"{name}.step")
                self.assertAlmostEqual(again.volume / make(KIT).volume, 1, places=4)
                self.assertGreater((out / "stl" / f"{name}.stl").stat().st_size, 1000)
                self.assertIn("</svg>", (out / "drawings" / f"{name}.svg").read_text())
            for picture in (out / "pictures").iterdir():
                kept = ROOT / "docs/pictures" / picture.name
                self.assertTrue(kept.is_file(), kept)
                if picture.name.startswith("lamp"):
                    self.assertEqual(picture.read_text(), kept.read_text(), "cargo xtask kit")
        self.assertIn(f"{LAMP.ohms:g} Ω", lamp.schematic(LAMP))


if __name__ == "__main__":
    runner = unittest.TextTestRunner(stream=sys.stdout, verbosity=2)
    unittest.main(testRunner=runner)
