"""The printed parts of the sensor, in the places where they are assembled."""

from build123d import (
    Align,
    Axis,
    Box,
    Cone,
    Cylinder,
    GeomType,
    Part,
    Polygon,
    Pos,
    Rot,
    extrude,
    fillet,
)

from kit.dimensions import Kit

UP = (Align.CENTER, Align.CENTER, Align.MIN)


def block(half_x: float, half_y: float, bottom: float, top: float) -> Part:
    """A box around the axis."""
    return Pos(0, 0, bottom) * Box(2 * half_x, 2 * half_y, top - bottom, align=UP)


def rod(radius: float, bottom: float, top: float, at: tuple[float, float] = (0, 0)) -> Part:
    """A cylinder along the axis."""
    return Pos(*at, bottom) * Cylinder(radius, top - bottom, align=UP)


def cone(lower: float, upper: float, bottom: float, top: float, at=(0, 0)) -> Part:
    """A cone along the axis; one of its radii may be 0."""
    return Pos(*at, bottom) * Cone(lower, upper, top - bottom, align=UP)


def octagon(half: float, corner: float, bottom: float, top: float) -> Part:
    """A square prism whose corners are cut off at 45 degrees, `corner` from each side."""
    inner = half - corner
    points = [(half, inner), (inner, half), (-inner, half), (-half, inner)]
    points += [(-x, -y) for x, y in points]
    return Pos(0, 0, bottom) * extrude(Polygon(*points, align=None), top - bottom)


def plate(kit: Kit) -> Part:
    """The base plate: everything is screwed to it. The camera board hangs below it."""
    bought = kit.bought
    part = block(kit.plate_half, kit.plate_half, -kit.plate_thickness, 0)
    for side in (-1, 1):
        part += rod(3.5, kit.board_front, -kit.plate_thickness, (side * bought.board_holes / 2, 0))
    for side in (-1, 1):
        # M2.5 for plastic.
        at = (side * bought.board_holes / 2, 0)
        part -= rod(1.05, kit.board_front, -2, at)
    part -= rod(bought.holder_neck / 2 + 0.5, -kit.plate_thickness, 0)
    for at in kit.corners(kit.post_at):
        part -= rod(kit.screw / 2, -kit.plate_thickness, 0, at)
        # The head of a countersunk screw, flush.
        head = cone(3.3, kit.screw / 2, -kit.plate_thickness, -kit.plate_thickness + 1.6, at)
        part -= head
    for at in kit.corners(3.5 * 2.54):
        # M2 for plastic: they hold the ring of LEDs.
        part -= rod(0.8, -kit.plate_thickness, 0, at)
    for at in kit.corners(kit.stand_screw_at):
        part -= rod(1.4, -kit.plate_thickness, 0, at)
    # The LEDs' wires.
    part -= rod(1.1, -kit.plate_thickness, 0, (0, 16.1))
    return part


def post(kit: Kit, at: tuple[float, float] = (0, 0)) -> Part:
    """A post; its shoulder holds the lamp cover down, its rounded end the film."""
    radius, end = kit.post_radius, kit.clamp_radius
    top = kit.post_length
    tip = rod(end, 0, top)
    rims = tip.edges().filter_by(GeomType.CIRCLE).sort_by(Axis.Z)
    part = fillet(rims[-1], kit.clamp_round)
    part += rod(radius, 0, top - 3) + cone(radius, end, top - 3, top - 3 + radius - end)
    # The shoulder grows out at 45 degrees, and sits in the cover's hole.
    shoulder = kit.cover_top + 0.75
    part += cone(radius, radius + 1, shoulder - 1, shoulder)
    part += rod(radius + 1, shoulder, shoulder + 0.6)
    part += cone(radius + 1, radius, shoulder + 0.6, shoulder + 1.6)
    part -= rod(kit.screw / 2, 0, kit.post_length)
    return Pos(*at, 0) * part


def stop(kit: Kit) -> Part:
    """A tube around the lens: it keeps the LEDs' light off, its teeth stop a pressed film."""
    inner, outer = kit.tube_inner, kit.tube_outer
    # The tube is higher than the lens only below its teeth.
    top = kit.stop_top
    foot = outer + 2
    part = rod(outer, 0, top) + cone(foot, outer, 0, 2)
    part -= rod(inner, 0, top)
    for axis in (0, 1):
        begin, end = kit.tooth_from_axis(axis), (inner + outer) / 2
        for side in (-1, 1):
            middle, half = side * (begin + end) / 2, (end - begin) / 2
            size = (half, kit.tooth_width / 2) if axis == 0 else (kit.tooth_width / 2, half)
            at = (middle, 0) if axis == 0 else (0, middle)
            part += Pos(*at, 0) * block(*size, top - kit.tooth_thickness, top)
    return part


def cover(kit: Kit) -> Part:
    """The lamp's cover: four windows, none towards a dot's mirror image, with a diffuser below."""
    top, wall = kit.cover_top, kit.wall
    part = octagon(kit.cover_half, kit.cover_corner, 0, top)
    part -= octagon(kit.cover_half - wall, kit.cover_corner - 0.6 * wall, 0, top - 1.2)
    part -= rod(kit.tube_outer + 0.25, 0, top)
    for at in kit.corners(kit.post_at):
        part -= rod(kit.post_radius + 0.3, 0, top, at)
    for turn in range(4):
        window = Pos(12.8, 0, top - 1.2) * Box(5.2, 13, 1.2, align=UP)
        part -= Rot(0, 0, 90 * turn) * window
    return part


def shell(kit: Kit) -> Part:
    """The light-tight shell: it stands on the plate and ends in the frame's lip."""
    part = block(kit.outer_half, kit.outer_half, -2, kit.frame_bottom - 0.3)
    part -= block(kit.shell_half, kit.shell_half, 0, kit.frame_top)
    return part - block(kit.plate_half + 0.2, kit.plate_half + 0.2, -2, 0)


def frame(kit: Kit) -> Part:
    """The film's clamp in one part, so that no washer turns on the film, and the outer rim."""
    bottom, top = kit.frame_bottom, kit.frame_top
    part = block(kit.outer_half, kit.outer_half, bottom, top)
    lip = kit.shell_half - 0.2
    part += block(lip, lip, bottom - 1.5, bottom) - block(lip - 1, lip - 1, bottom - 1.5, bottom)
    part -= rod(kit.opening_radius, bottom, top)
    for at in kit.corners(kit.post_at):
        boss = rod(kit.clamp_radius, kit.film_top, bottom + 0.5)
        rims = boss.edges().filter_by(GeomType.CIRCLE).sort_by(Axis.Z)
        part += Pos(*at, 0) * fillet(rims[0], kit.clamp_round)
    for at in kit.corners(kit.post_at):
        part -= rod(kit.screw / 2, kit.film_top, top, at)
    return part


def stand(kit: Kit) -> Part:
    """The lower half: room for the camera board and its cable."""
    top = -kit.plate_thickness
    floor = top - kit.stand_height
    part = block(kit.outer_half, kit.outer_half, floor, -2.2)
    part -= block(kit.shell_half, kit.shell_half, floor + 2, -2.2)
    part -= block(kit.plate_half + 0.2, kit.plate_half + 0.2, top, -2.2)
    for x, y in kit.corners(kit.stand_screw_at):
        column = Pos(x, y, 0) * block(3.6, 3.6, floor, top)
        part += column & block(kit.outer_half, kit.outer_half, floor, top)
    for at in kit.corners(kit.stand_screw_at):
        # M2.5 for plastic.
        part -= rod(1.05, top - 10, top, at)
    # The camera's flat cable and the LEDs' wires.
    slot = Pos(0, kit.outer_half, floor + 7) * Box(17, 10, 2.5)
    return part - slot


def film(kit: Kit) -> Part:
    """The film at rest, not printed."""
    half = kit.film_side / 2
    part = block(half, half, kit.film, kit.film_top)
    for at in kit.corners(kit.post_at):
        part -= rod(kit.film_hole / 2, kit.film, kit.film_top, at)
    return part


def perfboard(kit: Kit) -> Part:
    """The perfboard of the LEDs, with its hole, on the stop's foot."""
    bottom = kit.tube_outer + 2 - kit.perfboard_hole
    part = octagon(kit.perfboard_half, kit.perfboard_corner, bottom, bottom + 1.6)
    return part - rod(kit.perfboard_hole, bottom, bottom + 1.6)


def leds(kit: Kit) -> Part:
    """The eight LEDs, of 2.8 x 3.5 mm."""
    board = kit.tube_outer + 2 - kit.perfboard_hole + 1.6
    part = Part()
    for turn in range(4):
        for side in (-1, 1):
            led = Pos(12.7, side * 3.81, board) * Box(3.5, 2.8, 0.8, align=UP)
            part += Rot(0, 0, 90 * turn) * led
    return part


def diffuser(kit: Kit) -> Part:
    """The diffuser: a sheet of 1 mm below the cover's top."""
    top = kit.cover_top - 1.2
    part = octagon(kit.cover_half - kit.wall - 0.3, 10.7, top - 1, top)
    return part - rod(kit.tube_outer + 0.3, top - 1, top)


def camera(kit: Kit) -> Part:
    """The camera: its board, the lens holder and the lens."""
    bought = kit.bought
    half_x, half_y = (side / 2 for side in bought.board)
    straight_x, straight_y = (side / 2 for side in bought.board_straight)
    points = [(half_x, straight_y), (straight_x, half_y), (-straight_x, half_y)]
    points += [(-half_x, straight_y)]
    points += [(-x, -y) for x, y in points]
    back = kit.board_front - bought.board_thickness
    part = Pos(0, 0, back) * extrude(Polygon(*points, align=None), bought.board_thickness)
    for side in (-1, 1):
        part -= rod(1.5, back, kit.board_front, (side * bought.board_holes / 2, 0))
    foot_x, foot_y = (side / 2 for side in bought.holder_foot)
    foot_top = kit.board_front + bought.holder_foot_height
    part += block(foot_x, foot_y, kit.board_front, foot_top)
    part += rod(bought.holder_neck / 2, foot_top, 0.5)
    part += rod(bought.lens_diameter / 2, 0.5, kit.lens_front)
    # The flat cable's connector.
    return part + Pos(0, 8.5, 0) * block(8.3, 3, back - 2.4, back)


# Each part's name, its function and how often it is printed.
PRINTED = {
    "plate": (plate, 1),
    "post": (post, 4),
    "stop": (stop, 1),
    "cover": (cover, 1),
    "shell": (shell, 1),
    "frame": (frame, 1),
    "stand": (stand, 1),
}

# Parts that lie on the bed with their upper side when they are printed.
UPSIDE_DOWN = {"plate", "stop", "cover", "shell", "frame"}
UPSIDE_DOWN |= {"punch_guide", "dot_guide", "tip_guide", "tilt_guide", "carrier"}


def as_printed(name: str, part: Part) -> Part:
    """The part as it lies on the printer's bed, its lowest side at z = 0."""
    turned = Rot(180, 0, 0) * part if name in UPSIDE_DOWN else part
    box = turned.bounding_box()
    return Pos(0, 0, -box.min.Z) * turned
