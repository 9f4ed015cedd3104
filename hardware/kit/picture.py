"""Shaded pictures of meshes, by a depth buffer."""

import numpy as np
from PIL import Image

from kit.mesh import Mesh

LIGHT = np.array([-0.35, -0.5, 0.79])


def view(azimuth_deg: float, elevation_deg: float) -> np.ndarray:
    """Rows: right, up, and towards the eye."""
    a, e = np.radians([azimuth_deg, elevation_deg])
    eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0])
    return np.array([right, np.cross(eye, right), eye])


def draw(
    meshes: list[tuple[Mesh, tuple[int, int, int]]], axes: np.ndarray, scale: float, smooth: int = 2
) -> Image.Image:
    """The meshes in their colours, `scale` pixels a millimetre."""
    scale *= smooth
    all_points = np.concatenate([mesh.corners for mesh, _ in meshes]) @ axes.T
    low, high = all_points.min(axis=0), all_points.max(axis=0)
    margin = 6 * smooth
    width, height = (np.ceil((high - low)[:2] * scale).astype(int) + 2 * margin).tolist()
    depth = np.full((height, width), -np.inf)
    picture = np.full((height, width, 3), 255.0)
    for mesh, colour in meshes:
        turned = (mesh.points @ axes.T - low) * scale
        turned[..., 0] += margin
        turned[..., 1] = height - margin - turned[..., 1]
        lengths = np.linalg.norm(mesh.normals, axis=1)
        normals = mesh.normals / np.maximum(lengths, 1e-12)[:, None]
        towards = normals @ axes[2] > 1e-9
        bright = 0.45 + 0.55 * np.clip(normals @ LIGHT, 0, 1)
        for triangle, light in zip(turned[towards], bright[towards]):
            fill(picture, depth, triangle, light * np.array(colour))
    # Lines where the depth jumps.
    far = np.where(np.isfinite(depth), depth, low[2] - 50 * scale)
    down = np.abs(np.diff(far, axis=0, prepend=far[:1]))
    along = np.abs(np.diff(far, axis=1, prepend=far[:, :1]))
    jump = np.maximum(down, along)
    picture[jump > 0.9 * scale] *= 0.35
    image = Image.fromarray(picture.clip(0, 255).astype(np.uint8))
    return image.resize((width // smooth, height // smooth), Image.Resampling.LANCZOS)


def fill(picture: np.ndarray, depth: np.ndarray, triangle: np.ndarray, colour: np.ndarray) -> None:
    """Draws one triangle where it is nearer than those before it."""
    a, b, c = triangle
    left, top = np.floor(triangle[:, :2].min(axis=0)).astype(int)
    right, bottom = np.ceil(triangle[:, :2].max(axis=0)).astype(int) + 1
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    if abs(area) < 1e-9:
        return
    y, x = np.mgrid[top:bottom, left:right] + 0.5
    v = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area
    w = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area
    z = a[2] + v * (b[2] - a[2]) + w * (c[2] - a[2])
    there = depth[top:bottom, left:right]
    seen = (v >= -1e-6) & (w >= -1e-6) & (v + w <= 1 + 1e-6) & (z > there)
    there[seen] = z[seen]
    picture[top:bottom, left:right][seen] = colour
