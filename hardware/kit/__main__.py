"""Writes STL, STEP, drawings and pictures of all parts: `python -m kit OUT`, in `hardware/`."""

import argparse
import sys
from dataclasses import fields, replace
from pathlib import Path

from build123d import Compound, Part, Pos, export_step, export_stl

from kit import drawing, jigs, lamp, parts
from kit.assembly import assembled
from kit.dimensions import Bought, Kit, Unsuitable
from kit.mesh import Mesh
from kit.picture import draw, view

# The lamp's resistors, ohms.
LAMP = lamp.Lamp(220)
# How far the parts stand apart in the picture, mm, from the stand upwards.
APART = {
    "stand": -40,
    "camera": -26,
    "plate": -12,
    "stop": 14,
    "perfboard": 26,
    "leds": 26,
    "diffuser": 34,
    "cover": 40,
    "post": 46,
    "shell": 0,
    "film": 62,
    "frame": 72,
}


def colour(name: str) -> tuple[int, int, int]:
    """The part's colour in drawings."""
    code = drawing.COLOURS[name.split()[0]]
    return tuple(int(code[i : i + 2], 16) for i in (1, 3, 5))


def exploded(placed: dict[str, Part]):
    """A picture of the parts in the order in which they are put together; the shell beside."""
    shown = []
    for name, part in placed.items():
        shift = (0, 0, APART[name.split()[0]])
        if name == "shell":
            shift = (62, 36, 0)
        shown.append((Mesh.of(Pos(*shift) * part, 0.02), colour(name)))
    return draw(shown, view(-60, 22), 4.6)


def sheet(printed: dict[str, Part]):
    """A picture of parts in rows, as they lie on the bed."""
    shown, x, y, deepest = [], 0.0, 0.0, 0.0
    for number, (name, part) in enumerate(printed.items()):
        size = part.bounding_box().size
        if number % 4 == 0 and number:
            x, y, deepest = 0.0, y - deepest - 20, 0.0
        box = part.bounding_box()
        moved = Pos(x - box.min.X, y - box.max.Y, 0) * part
        shown.append((Mesh.of(moved, 0.02), (150, 170, 200)))
        x, deepest = x + size.X + 8, max(deepest, size.Y)
    return draw(shown, view(-75, 40), 3.2)


def pictures(kit: Kit, placed: dict[str, Part], folder: Path) -> None:
    """The pictures of the guide."""
    few = 48
    for name, image in {
        "kit-exploded": exploded(placed),
        "kit-jigs": sheet(printed(kit, jigs.PRINTED)),
    }.items():
        image.quantize(few).save(folder / f"{name}.png", optimize=True)
    (folder / "kit-section.svg").write_text(drawing.sections(kit, placed))
    (folder / "lamp-schematic.svg").write_text(lamp.schematic(LAMP))
    board = lamp.perfboard(kit.perfboard_half, kit.perfboard_corner, kit.perfboard_hole)
    (folder / "lamp-perfboard.svg").write_text(board)


def printed(kit: Kit, of: dict) -> dict[str, Part]:
    """Parts by name, as they lie on the bed."""
    return {name: parts.as_printed(name, make(kit)) for name, (make, _) in of.items()}


def write(kit: Kit, out: Path) -> None:
    """All files."""
    for name in ("stl", "step", "drawings", "pictures"):
        (out / name).mkdir(parents=True, exist_ok=True)
    for name, part in printed(kit, {**parts.PRINTED, **jigs.PRINTED}).items():
        export_stl(part, out / "stl" / f"{name}.stl", tolerance=0.02, angular_tolerance=0.2)
        export_step(part, out / "step" / f"{name}.step")
        (out / "drawings" / f"{name}.svg").write_text(drawing.views(part, name))
    placed = assembled(kit)
    for name, part in placed.items():
        part.label = name
    export_step(Compound(label="sensor", children=list(placed.values())), out / "step/sensor.step")
    pictures(kit, placed, out / "pictures")
    copies = {name: count for name, (_, count) in {**parts.PRINTED, **jigs.PRINTED}.items()}
    print(f"{out}: stl/, step/, drawings/ and pictures/ of {len(copies)} printed parts")
    print("once each, but four posts")
    print(f"posts {kit.post_length:.2f} mm long; countersunk screws M3 × {kit.screw_length}")
    print(f"the pin reaches {jigs.pin_length(kit):.1f} mm out of the carrier")


def options() -> tuple[Path, Bought]:
    """The command line: where to, and what bought parts measure."""
    parser = argparse.ArgumentParser(prog="kit", description=__doc__)
    parser.add_argument("out", type=Path, help="folder to write to")
    lengths = [field for field in fields(Bought) if field.type in (float, "float")]
    for field in lengths:
        flag = f"--{field.name.replace('_', '-')}-mm"
        parser.add_argument(flag, type=float, default=field.default, dest=field.name)
    given = vars(parser.parse_args())
    out = given.pop("out")
    wrong = [name for name, length in given.items() if not 0 < length < 100]
    if wrong:
        parser.error(f"{', '.join(wrong)}: a length in mm, more than 0 and less than 100")
    return out, replace(Bought(), **given)


def main() -> int:
    out, bought = options()
    try:
        write(Kit(bought), out)
    except (Unsuitable, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
