"""Checks of a part's triangles: closed, thick enough, printable without support."""

from dataclasses import dataclass

import numpy as np
from build123d import Part


@dataclass(frozen=True)
class Mesh:
    """Triangles: corners, mm, and three indices of each triangle, anticlockwise from outside."""

    corners: np.ndarray
    triangles: np.ndarray

    @staticmethod
    def of(part: Part, tolerance: float = 0.1) -> "Mesh":
        """The triangles of a part, with its common corners joined."""
        points, triangles = part.tessellate(tolerance, 0.4)
        corners = np.array([[p.X, p.Y, p.Z] for p in points])
        _, first, joined = np.unique(
            np.round(corners, 5), axis=0, return_index=True, return_inverse=True
        )
        triangles = joined.reshape(-1)[np.array(triangles)]
        whole = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
        return Mesh(corners[first], triangles[whole])

    @property
    def points(self) -> np.ndarray:
        """The corners of each triangle."""
        return self.corners[self.triangles]

    @property
    def normals(self) -> np.ndarray:
        """Outward normals, as long as the triangles' areas."""
        a, b, c = np.moveaxis(self.points, 1, 0)
        return np.cross(b - a, c - a) / 2

    def is_closed(self) -> bool:
        """Whether each edge belongs to two triangles that run along it in opposite directions."""
        edges = np.concatenate([self.triangles[:, [i, (i + 1) % 3]] for i in range(3)])
        there = {tuple(edge) for edge in edges.tolist()}
        return len(there) == len(edges) and all((b, a) in there for a, b in there)

    def volume(self) -> float:
        """The enclosed volume, mm³."""
        a, b, c = np.moveaxis(self.points, 1, 0)
        return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)

    def samples(self, spacing: float) -> tuple[np.ndarray, np.ndarray]:
        """Points on the surface, about `spacing` mm apart, and the triangle of each."""
        areas = np.linalg.norm(self.normals, axis=1)
        counts = np.maximum(1, np.ceil(areas / spacing**2)).astype(int)
        of = np.repeat(np.arange(len(areas)), counts)
        nth = np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts)
        # An even sequence (Roberts' R2) over each triangle.
        u = (0.5 + 0.7548776662466927 * (nth + 1)) % 1
        v = (0.5 + 0.5698402909980532 * (nth + 1)) % 1
        turned = u + v > 1
        u, v = np.where(turned, 1 - u, u), np.where(turned, 1 - v, v)
        a, b, c = np.moveaxis(self.points[of], 1, 0)
        return a + u[:, None] * (b - a) + v[:, None] * (c - a), of

    def first_hits(self, origins: np.ndarray, ways: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """For rays: the distance to the first triangle, in lengths of `ways`, and the triangle."""
        a, b, c = np.moveaxis(self.points, 1, 0)
        ab, ac = b - a, c - a
        best = np.full(len(origins), np.inf)
        which = np.full(len(origins), -1)
        for start in range(0, len(origins), 256):
            rays = slice(start, start + 256)
            way, origin = ways[rays, None], origins[rays, None]
            p = np.cross(way, ac)
            det = np.einsum("rtk,tk->rt", p, ab)
            with np.errstate(divide="ignore", invalid="ignore"):
                from_a = origin - a
                u = np.einsum("rtk,rtk->rt", from_a, p) / det
                q = np.cross(from_a, ab)
                v = np.einsum("rk,rtk->rt", ways[rays], q) / det
                far = np.einsum("tk,rtk->rt", ac, q) / det
                hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (far > 1e-4)
            far = np.where(hit, far, np.inf)
            best[rays] = far.min(axis=1)
            which[rays] = far.argmin(axis=1)
        return best, which

    def thinnest_wall(self, spacing: float = 1.5) -> tuple[float, np.ndarray]:
        """The least distance, mm, between two sides that face away from each other, and where."""
        origins, of = self.samples(spacing)
        lengths = np.linalg.norm(self.normals, axis=1, keepdims=True)
        normals = self.normals / np.maximum(lengths, 1e-12)
        inward = -normals[of]
        far, hit = self.first_hits(origins, inward)
        facing = np.einsum("ij,ij->i", normals[hit], inward)
        walls = np.where(np.isfinite(far) & (facing > 0.9), far, np.inf)
        thinnest = int(walls.argmin())
        return float(walls[thinnest]), origins[thinnest]

    def overhangs(self, steepest_deg: float = 50) -> list[tuple[float, float]]:
        """Surfaces that look down more than the angle from upright and lie above the bed.

        For each, its area, mm², and the largest distance, mm, of its points from what it hangs on.
        """
        areas = np.linalg.norm(self.normals, axis=1)
        down = -self.normals[:, 2] / np.maximum(areas, 1e-12)
        lowest = self.points[:, :, 2].min(axis=1)
        bed = self.corners[:, 2].min()
        hanging = (down > np.sin(np.radians(steepest_deg))) & (lowest > bed + 0.05)
        left = set(np.flatnonzero(hanging).tolist())
        found = []
        while left:
            patch = {left.pop()}
            fresh = set(patch)
            while fresh:
                corners = np.unique(self.triangles[list(fresh)])
                near = {t for t in left if np.isin(self.triangles[t], corners).any()}
                left -= near
                patch |= near
                fresh = near
            found.append(self._patch(sorted(patch), areas))
        return found

    def _patch(self, patch: list[int], areas: np.ndarray) -> tuple[float, float]:
        own = set(patch)
        edges = {}
        for t, triangle in enumerate(self.triangles.tolist()):
            for i in range(3):
                edges.setdefault(frozenset((triangle[i], triangle[(i + 1) % 3])), []).append(t)
        # It hangs on the edges beyond which the surface goes down.
        held = []
        for edge, sides in edges.items():
            inside = [t for t in sides if t in own]
            outside = [t for t in sides if t not in own]
            if inside and outside:
                middle = self.corners[list(edge)].mean(axis=0)
                lower = self.points[outside[0]].mean(axis=0)[2] < middle[2] - 1e-6
                if lower:
                    held.append(self.corners[list(edge)])
        points, _ = Mesh(self.corners, self.triangles[patch]).samples(0.7)
        far = np.inf
        if held:
            ends = np.array(held)
            steps = np.linspace(0, 1, 12)[:, None, None]
            along = (ends[:, 0] + steps * (ends[:, 1] - ends[:, 0])).reshape(-1, 3)
            apart = np.linalg.norm(points[:, None] - along[None], axis=2)
            far = float(apart.min(axis=1).max())
        return float(areas[patch].sum()), far
