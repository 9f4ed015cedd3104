"""Every length of the kit: of the simulated sensor, of bought parts, and derived ones."""

import json
import math
from dataclasses import dataclass, field
from pathlib import Path

# The lengths that the simulated sensor and the template share with the kit. A test compares the
# file with what `hivtac-studies scene dimensions` prints.
SCENE = json.loads(Path(__file__).with_name("dimensions.json").read_text())


class Unsuitable(Exception):
    """A bought part does not fit, with the reason and what would."""


@dataclass(frozen=True)
class Bought:
    """What the bought parts measure, mm: measure yours, and give what differs."""

    # The lens in focus: from the camera board's front to the middle of its front glass.
    lens_front: float = 20.0
    # From the middle of the front glass back to the entrance pupil.
    pupil: float = 2.0
    # The lens's head.
    lens_diameter: float = 14.0
    # The lens holder: the part that passes the base plate, and its foot with the screws' ears.
    holder_neck: float = 15.0
    holder_foot: tuple[float, float] = (26.0, 17.0)
    holder_foot_height: float = 6.0
    # WeAct's OV7725 camera board: outline, straight parts of its sides, holes.
    board: tuple[float, float] = (43.0, 28.83)
    board_straight: tuple[float, float] = (20.9, 6.7)
    board_holes: float = 35.0
    board_thickness: float = 1.6
    # The straight steel tube of a 3 mm biopsy punch, outside.
    punch_outer: float = 3.5
    # The pin that stamps dots and presses in a calibration.
    pin: float = 1.0


@dataclass(frozen=True)
class Kit:
    """The kit for these bought parts, in mm; the plate's top is z = 0, the film is above."""

    bought: Bought = field(default_factory=Bought)

    # The simulated sensor's.
    film_distance: float = SCENE["film_distance_mm"]
    film_thickness: float = SCENE["film_thickness_mm"]
    post_at: float = SCENE["post_mm"]
    dot_diameter: float = SCENE["marker_diameter_mm"]
    film_side: float = 40.0
    film_hole: float = 3.2

    # Printed walls.
    plate_thickness: float = 4.0
    plate_half: float = 23.2
    outer_half: float = 25.0
    shell_half: float = 22.0
    screw: float = 3.2
    post_radius: float = 3.0
    clamp_radius: float = 2.5
    clamp_round: float = 0.7
    boss: float = 2.0
    frame_thickness: float = 2.0
    opening_radius: float = 13.0
    board_gap: float = 6.5
    tube_wall: float = 1.2
    # Free way between the film, pressed by the largest force, and the stop.
    stop_margin: float = 0.4
    # Least way between the lens's glass and the stop's teeth, and their least thickness.
    glass_gap: float = 0.3
    tooth_least: float = 0.6
    tooth_width: float = 3.0
    # The ring of LEDs: a perfboard of 12 x 12 holes with its corners cut off.
    perfboard_half: float = 15.24
    perfboard_corner: float = 7.43
    perfboard_hole: float = 9.25
    cover_half: float = 18.9
    cover_corner: float = 3.6
    wall: float = 1.6
    stand_height: float = 22.0
    stand_screw_at: float = 19.2
    tilt_deg: float = 8.0
    places: tuple[tuple[float, float], ...] = ((0, 0), (3, 0), (-3, 0), (0, 3), (0, -3))

    def __post_init__(self) -> None:
        if self.tooth_thickness < self.tooth_least:
            most = self.bought.pupil - (self.tooth_least - self.tooth_thickness)
            raise Unsuitable(
                f"the lens's entrance pupil is {self.bought.pupil:.2f} mm behind its front glass: "
                f"at {SCENE['largest_force_n']} N the film comes too near to it. Use a lens with "
                f"at most {most:.2f} mm"
            )
        if self.lens_front < 3.0:
            least = self.bought.lens_front + 3.0 - self.lens_front
            raise Unsuitable(
                f"the lens ends {self.bought.lens_front:.2f} mm above its board, which leaves no "
                f"room for the ring of LEDs: it must be {least:.2f} mm or more"
            )

    @property
    def board_front(self) -> float:
        """The camera board's side with the lens."""
        return -self.plate_thickness - self.board_gap

    @property
    def lens_front(self) -> float:
        """The middle of the lens's front glass."""
        return self.board_front + self.bought.lens_front

    @property
    def pupil(self) -> float:
        """The lens's entrance pupil, the pinhole of the simulated sensor."""
        return self.lens_front - self.bought.pupil

    @property
    def post_length(self) -> float:
        """film distance + lens front above the plate - pupil behind the front."""
        return self.film_distance + self.lens_front - self.bought.pupil

    @property
    def film(self) -> float:
        """The film's camera side at rest, where the posts end."""
        return self.post_length

    @property
    def film_top(self) -> float:
        return self.film + self.film_thickness

    @property
    def frame_bottom(self) -> float:
        return self.film_top + self.boss

    @property
    def frame_top(self) -> float:
        return self.frame_bottom + self.frame_thickness

    @property
    def travel(self) -> float:
        """How deep a tip goes under the largest force."""
        return SCENE["travel_mm"][-1][1]

    @property
    def stop_top(self) -> float:
        return self.film - self.travel - self.stop_margin

    @property
    def tooth_thickness(self) -> float:
        return self.stop_top - self.lens_front - self.glass_gap

    @property
    def tube_inner(self) -> float:
        return self.bought.lens_diameter / 2 + 0.5

    @property
    def tube_outer(self) -> float:
        return self.tube_inner + self.tube_wall

    @property
    def cover_top(self) -> float:
        return self.lens_front + 0.5

    @property
    def screw_length(self) -> int:
        """The shortest usual countersunk M3 screw that holds its nut."""
        least = self.plate_thickness + self.frame_top + 2.4 + 0.5
        return next(length for length in (20, 25, 30, 35, 40, 45, 50) if length >= least)

    def tooth_from_axis(self, axis: int) -> float:
        """Where a tooth along x (0) or y (1) begins, so that no camera has it in its picture.

        The margin is what a camera's axis may be off, in a unit of a hundred.
        """
        height = self.stop_top - self.pupil
        aside = self.tooth_width / 2
        side = ("width", "height")[axis]

        def is_seen(begin: float, camera: dict) -> bool:
            across = math.hypot(begin, aside)
            seen = camera["focal_px"] * math.atan2(across, height) * begin / across
            return seen < (camera[side] - 1) / 2 + 2.5 * SCENE["shift_tolerance_px"]

        tenths = range(10, 150)
        hidden = [t / 10 for t in tenths if not any(is_seen(t / 10, c) for c in SCENE["cameras"])]
        return hidden[0]

    def corners(self, at: float) -> list[tuple[float, float]]:
        """From the upper left clockwise, as the camera sees them."""
        return [(-at, -at), (at, -at), (at, at), (-at, at)]
