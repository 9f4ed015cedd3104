"""The printed jigs: for the film's holes, for its dots, and for a calibration."""

from build123d import Align, Box, Cylinder, Part, Pos, Rot

from kit.dimensions import SCENE, Kit
from kit.parts import UP, block, rod

HALF = 23.0
LIP = 1.6


def film_bed(kit: Kit) -> Part:
    """The bed on which the film is cut, punched and stamped; screws hold film and guides."""
    part = block(HALF, HALF, 0, 5)
    for at in kit.corners(kit.post_at):
        part -= rod(kit.film_hole / 2, 0, 5, at)
    # Lines along which the film is cut: grooves of a knife's width.
    half = kit.film_side / 2
    for turn in range(4):
        groove = Pos(half, 0, 4.5) * Box(0.8, 2 * HALF, 0.5, align=UP)
        part -= Rot(0, 0, 90 * turn) * groove
    return part


def hooked(kit: Kit, top: float) -> Part:
    """A guide over the film on its bed: it rests on the film, its lip reaches around the bed."""
    outer = HALF + 0.2 + LIP
    part = block(outer, outer, -3, top)
    return part - block(HALF + 0.2, HALF + 0.2, -3, 0)


def punch_guide(kit: Kit) -> Part:
    """Guides a biopsy punch through the film, at the posts' places."""
    part = hooked(kit, 8)
    for at in kit.corners(kit.post_at):
        part -= rod(kit.bought.punch_outer / 2 + 0.05, 0, 8, at)
    return part


def dot_guide(kit: Kit) -> Part:
    """Guides a pin that stamps the dots, at the scene's places; it touches the film at its edge."""
    part = hooked(kit, 6)
    # Paint must not creep between guide and film.
    inner = kit.post_at - 4
    part -= block(inner, inner, 0, 1)
    for at in kit.corners(kit.post_at):
        part -= rod(kit.film_hole / 2, 0, 6, at)
    for at in SCENE["marker_centres_mm"]:
        part -= rod(kit.bought.pin / 2 + 0.05, 0, 6, tuple(at))
    return part


def over_frame(kit: Kit) -> Part:
    """A plate on the frame, around its edge, with holes for the posts' nuts."""
    outer = kit.outer_half + 0.2 + LIP
    top = kit.frame_top
    part = block(outer, outer, top - 3, top + 3)
    part -= block(kit.outer_half + 0.2, kit.outer_half + 0.2, top - 3, top)
    for at in kit.corners(kit.post_at):
        part -= rod(4.5, top, top + 3, at)
    return part


def tip_guide(kit: Kit) -> Part:
    """Bores at the places of a calibration's loads, for a tip that moves freely in them."""
    part = over_frame(kit)
    for at in kit.places:
        part -= rod(kit.bought.pin / 2 + 0.15, kit.frame_top, kit.frame_top + 3, at)
    return part


def tilt_guide(kit: Kit) -> Part:
    """One bore towards the film's middle, tilted as the stand on its wedge; turn it by quarters."""
    part = over_frame(kit)
    bore = Cylinder(kit.bought.pin / 2 + 0.15, 60)
    part -= Pos(0, 0, kit.film_top) * Rot(0, kit.tilt_deg, 0) * bore
    # An arrow's notch where the bore leans to.
    notch = Rot(0, 0, 45) * Box(3, 3, 2)
    return part - Pos(kit.outer_half + 0.2 + LIP, 0, kit.frame_top + 2.5) * notch


def carrier(kit: Kit) -> Part:
    """Carries weights on the pin; its foot meets the guide before the film meets the stop."""
    part = rod(4, 0, 6) + rod(13, 6, 8)
    return part - rod(kit.bought.pin / 2, 0, 8)


def pin_length(kit: Kit) -> float:
    """How far the pin reaches out of the carrier."""
    return kit.frame_top + 3 - (kit.film_top - kit.travel - kit.stop_margin / 2)


def wedge(kit: Kit) -> Part:
    """Tilts the stand by the angle of a calibration's loads."""
    half = kit.outer_half + 4
    part = block(half, half, 0, 26)
    tilt = Pos(0, 0, 9) * Rot(kit.tilt_deg, 0, 0)
    room = kit.outer_half + 0.4
    part -= tilt * Box(2 * room, 2 * room, 40, align=UP)
    over = Box(6 * half, 6 * half, 40, align=(Align.CENTER, Align.CENTER, Align.MIN))
    return part - Pos(0, 0, 11) * Rot(kit.tilt_deg, 0, 0) * over


PRINTED = {
    "film_bed": (film_bed, 1),
    "punch_guide": (punch_guide, 1),
    "dot_guide": (dot_guide, 1),
    "tip_guide": (tip_guide, 1),
    "tilt_guide": (tilt_guide, 1),
    "carrier": (carrier, 1),
    "wedge": (wedge, 1),
}
