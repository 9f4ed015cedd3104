"""The sensor put together: what collides, what the camera sees, where the light goes."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from build123d import Compound, Part

from kit import parts
from kit.dimensions import SCENE, Kit
from kit.mesh import Mesh

# Parts that touch the light or the film, and are not printed.
BOUGHT = {
    "film": parts.film,
    "perfboard": parts.perfboard,
    "leds": parts.leds,
    "diffuser": parts.diffuser,
    "camera": parts.camera,
}
# Overlap of two parts that a print cannot tell, mm³.
TOUCH = 0.05


def assembled(kit: Kit) -> dict[str, Part]:
    """All parts of the sensor in their places."""
    single = {name: make for name, (make, _) in parts.PRINTED.items() if name != "post"}
    placed = {name: make(kit) for name, make in {**single, **BOUGHT}.items()}
    for number, at in enumerate(kit.corners(kit.post_at)):
        placed[f"post {number}"] = parts.post(kit, at)
    return placed


def collisions(placed: dict[str, Part]) -> list[str]:
    """Pairs of parts that share space."""
    boxes = {name: part.bounding_box() for name, part in placed.items()}

    def apart(a: str, b: str) -> bool:
        one, other = boxes[a], boxes[b]
        return any(
            getattr(one.min, axis) >= getattr(other.max, axis) - 1e-6
            or getattr(other.min, axis) >= getattr(one.max, axis) - 1e-6
            for axis in "XYZ"
        )

    found = []
    for a, b in combinations(placed, 2):
        if apart(a, b):
            continue
        common = placed[a].intersect(placed[b])
        volume = 0.0 if common is None else Compound(children=list(shapes(common))).volume
        if volume > TOUCH:
            found.append(f"{a} and {b} share {volume:.2f} mm³")
    return found


def shapes(common) -> list:
    """The solids of an intersection, as a list."""
    return list(common.solids())


@dataclass(frozen=True)
class Picture:
    """A camera's picture: an equidistant fisheye in the entrance pupil."""

    preset: str
    width: int
    height: int
    focal_px: float

    @staticmethod
    def all() -> list["Picture"]:
        return [Picture(**camera) for camera in SCENE["cameras"]]

    def seen(self, kit: Kit, points: np.ndarray) -> np.ndarray:
        """Where points are seen, px from the picture's middle."""
        away = points - np.array([0, 0, kit.pupil])
        across = np.hypot(away[:, 0], away[:, 1])
        angle = np.arctan2(across, away[:, 2])
        return (self.focal_px * angle / np.maximum(across, 1e-9))[:, None] * away[:, :2]

    def inside(self, kit: Kit, points: np.ndarray) -> np.ndarray:
        """How far points are inside of the picture's border, px; negative outside."""
        seen = np.abs(self.seen(kit, points))
        sides = np.array([self.width - 1, self.height - 1]) / 2
        return (sides - seen).min(axis=1)


def dots(kit: Kit) -> np.ndarray:
    """The rims of the four dots on the film at rest."""
    turns = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    rim = kit.dot_diameter / 2 * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    centres = np.array(SCENE["marker_centres_mm"])
    flat = (centres[:, None] + rim[None]).reshape(-1, 2)
    return np.column_stack([flat, np.full(len(flat), kit.film)])


def intruders(kit: Kit, meshes: dict[str, Mesh]) -> dict[str, dict[str, float]]:
    """For each camera, how far each part reaches into the picture, px; negative outside."""
    found = {}
    for picture in Picture.all():
        rows = {}
        for name, mesh in meshes.items():
            points = np.concatenate([mesh.samples(1.0)[0], mesh.corners])
            # The film hides everything above it, the lens does not look back.
            points = points[(points[:, 2] < kit.film - 0.01) & (points[:, 2] > kit.pupil + 0.01)]
            if len(points):
                rows[name] = float(picture.inside(kit, points).max())
        found[picture.preset] = rows
    return found


def film_clearance(kit: Kit, mesh: Mesh) -> float:
    """The least distance, mm, of a part below the film, pressed by the largest force anywhere."""
    radii, lowest = np.array(SCENE["lowest_mm"]).T
    points = np.concatenate([mesh.samples(0.5)[0], mesh.corners])
    across = np.hypot(points[:, 0], points[:, 1])
    points, across = points[across < radii[-1]], across[across < radii[-1]]
    if len(points) == 0:
        return float("inf")
    return float((kit.film + np.interp(across, radii, lowest) - points[:, 2]).min())


def direct_light(kit: Kit, meshes: dict[str, Mesh]) -> list[str]:
    """Rays from the LEDs to the lens or the film that meet neither a part nor the diffuser."""
    lamp = meshes["leds"]
    tops = lamp.samples(0.7)[0]
    tops = tops[tops[:, 2] > tops[:, 2].max() - 1e-3] + np.array([0, 0, 1e-3])
    turns = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    rings = [(r, kit.lens_front + 0.01) for r in np.linspace(0, kit.bought.lens_diameter / 2, 4)]
    rings += [(r, kit.film) for r in np.linspace(0, 18, 7)]
    targets = {"lens": rings[:4], "film": rings[4:]}
    walls = [meshes[name] for name in ("stop", "cover", "diffuser")]
    found = []
    for name, circles in targets.items():
        ends = [[r * np.cos(t), r * np.sin(t), z] for r, z in circles for t in turns]
        ends = np.array(ends)
        begins = np.repeat(tops, len(ends), axis=0)
        ways = np.tile(ends, (len(tops), 1)) - begins
        free = np.ones(len(begins), dtype=bool)
        for wall in walls:
            left = np.flatnonzero(free)
            free[left] = wall.first_hits(begins[left], ways[left])[0] > 1
        if free.any():
            found.append(f"{name}: {free.sum()} of {len(free)} rays from the LEDs meet nothing")
    return found


def mirrored(kit: Kit, meshes: dict[str, Mesh]) -> float:
    """The least distance, mm, on a mirroring film at rest, of a lit window's image from a dot."""
    mesh = meshes["diffuser"]
    points = mesh.samples(0.5)[0]
    points = points[points[:, 2] > points[:, 2].max() - 1e-3]
    # Only the part below a window shines.
    up = np.tile([0.0, 0.0, 50.0], (len(points), 1))
    points = points[~np.isfinite(meshes["cover"].first_hits(points, up)[0])]
    below = kit.film - points[:, 2]
    part = kit.film_distance / (kit.film_distance + below)
    images = points[:, :2] * part[:, None]
    centres = np.array(SCENE["marker_centres_mm"])
    apart = np.linalg.norm(images[:, None] - centres[None], axis=2)
    return float(apart.min() - kit.dot_diameter / 2)


def illuminance(kit: Kit, lumens: float) -> list[float]:
    """Illuminance, lx, in the film's middle, above a dot and at 12 mm, for this light.

    The diffuser's lit parts shine as Lambert's law says; walls add nothing.
    """
    x, y = np.meshgrid(np.linspace(10.2, 15.4, 14), np.linspace(-6.5, 6.5, 27))
    window = np.stack([x.ravel(), y.ravel()], axis=1)
    windows = np.concatenate([window @ np.array(turn).T for turn in TURNS])
    height = kit.film - (kit.cover_top - 1.2)
    levels = []
    for place in ([0, 0], SCENE["marker_centres_mm"][0], [12, 0]):
        square = ((windows - np.array(place)) ** 2).sum(axis=1) + height**2
        levels.append(float((lumens / np.pi * height**2 / square**2).mean() * 1e6))
    return levels


TURNS = [[[1, 0], [0, 1]], [[0, -1], [1, 0]], [[-1, 0], [0, -1]], [[0, 1], [-1, 0]]]
