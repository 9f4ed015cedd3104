"""Drawings as SVG: sections of the assembled sensor, and three views of each part."""

import numpy as np
from build123d import Part, Plane, Vector, section

from kit.dimensions import SCENE, Kit

STYLE = (
    'font-family="sans-serif" font-size="2.4" fill="none" stroke="#000" stroke-width="0.12" '
    'stroke-linejoin="round"'
)
COLOURS = {
    "plate": "#8fa6c4",
    "post": "#c9d3e0",
    "stop": "#555b66",
    "cover": "#7d8aa0",
    "shell": "#9db0a5",
    "frame": "#b7a98a",
    "stand": "#a9b7ae",
    "film": "#e7dcc3",
    "perfboard": "#2f7d4f",
    "leds": "#ffd84d",
    "diffuser": "#dff1ff",
    "camera": "#6c7480",
}


def page(width: float, height: float, body: str) -> str:
    """An SVG page, 1 unit = 1 mm."""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.0f}mm" height="{height:.0f}mm" '
        f'viewBox="0 0 {width:.1f} {height:.1f}" {STYLE}>\n'
        f'<rect width="{width:.1f}" height="{height:.1f}" fill="#fff" stroke="none"/>\n'
        f"{body}</svg>\n"
    )


def text(x: float, y: float, words: str, anchor: str = "start") -> str:
    return (
        f'<text x="{x:.2f}" y="{y:.2f}" text-anchor="{anchor}" fill="#000" stroke="none">'
        f"{words}</text>\n"
    )


def line(x0: float, y0: float, x1: float, y1: float, more: str = "") -> str:
    return f'<path d="M{x0:.2f} {y0:.2f}L{x1:.2f} {y1:.2f}" {more}/>\n'


def upright_span(x: float, y0: float, y1: float, words: str) -> str:
    """A dimension along the page's height, with its words on the right."""
    ends = "".join(line(x - 0.8, y, x + 0.8, y) for y in (y0, y1))
    return line(x, y0, x, y1) + ends + text(x + 1, (y0 + y1) / 2 + 0.8, words)


def level_span(x0: float, x1: float, y: float, words: str) -> str:
    """A dimension along the page's width, with its words above."""
    ends = "".join(line(x, y - 0.8, x, y + 0.8) for x in (x0, x1))
    return line(x0, y, x1, y) + ends + text((x0 + x1) / 2, y - 0.7, words, "middle")


def outline(wire, flat) -> str:
    """A closed wire as a path."""
    points = []
    for edge in wire.order_edges():
        steps = 1 if edge.geom_type.name == "LINE" else 20
        points += [flat(edge.position_at(i / steps)) for i in range(steps)]
    return "M" + "L".join(f"{x:.2f} {y:.2f}" for x, y in points) + "Z"


def cut(placed: dict[str, Part], along: Vector, flat) -> str:
    """The parts cut by the plane of the axis and a direction."""
    across = Vector(-along.Y, along.X, 0)
    plane = Plane((0, 0, 0), x_dir=along, z_dir=across)
    body = ""
    for name, part in placed.items():
        colour = COLOURS[name.split()[0]]
        hatched = section(part, section_by=plane)
        if hatched is None:
            continue
        for face in hatched.faces():
            wires = [face.outer_wire(), *face.inner_wires()]
            path = "".join(outline(wire, flat) for wire in wires)
            body += f'<path d="{path}" fill="{colour}" fill-rule="evenodd"/>\n'
    return body


def sections(kit: Kit, placed: dict[str, Part]) -> str:
    """Two sections of the sensor: through the windows and along the diagonal of the posts."""
    middles, floor = (36.0, 124.0), kit.frame_top + 10
    body = ""
    for middle, along in zip(middles, (Vector(1, 0, 0), Vector(1, 1, 0).normalized())):

        def flat(point, middle=middle, along=along):
            return middle + point.X * along.X + point.Y * along.Y, floor - point.Z

        body += cut(placed, along, flat)
        pupil, film = floor - kit.pupil, floor - kit.film
        body += f'<circle cx="{middle}" cy="{pupil}" r="0.5" fill="#c00" stroke="none"/>\n'
        body += line(middle, film - 8, middle, floor + 30, 'stroke-dasharray="2 1" stroke="#888"')
    left, right = middles
    rays = 'stroke="#c00" stroke-dasharray="1 0.7"'
    reach = kit.film_distance
    camera = SCENE["cameras"][0]
    angle = (camera["width"] - 1) / 2 / camera["focal_px"]
    diagonal = float(np.hypot(*SCENE["marker_centres_mm"][0]))
    for side in (-1, 1):
        body += line(right, floor - kit.pupil, right + side * diagonal, floor - kit.film, rays)
        x = left + side * reach * np.tan(angle)
        body += line(left, floor - kit.pupil, x, floor - kit.film, 'stroke="#c00"')
    body += text(left, 7, "through the windows of the lamp", "middle")
    body += text(right, 7, "along the diagonal, through two posts", "middle")
    x = left + 28
    words = f"{kit.film_distance:g}: film to pupil"
    body += upright_span(x, floor - kit.film, floor - kit.pupil, words)
    x += 3
    body += upright_span(
        x - 3, floor - kit.pupil, floor, f"{kit.pupil:.2f}: pupil to plate"
    )
    x = right + 38
    body += upright_span(x, floor - kit.film, floor, f"L = {kit.post_length:.2f}")
    for number, (name, colour) in enumerate(COLOURS.items()):
        x, y = 8 + 28 * (number % 6), floor + 33 + 5 * (number // 6)
        body += f'<rect x="{x}" y="{y - 2.4}" width="3" height="3" fill="{colour}"/>\n'
        body += text(x + 4, y, name)
    return page(182, floor + 42, body)


def views(part: Part, title: str) -> str:
    """A part from above, from the front and from the right, with its size."""
    size = part.bounding_box().size
    middle = part.bounding_box().center()
    gap, left, top = 14, 14, 16
    far = 10 * max(size.X, size.Y, size.Z)
    eyes = [((0, 0, far), (0, 1, 0)), ((0, -far, 0), (0, 0, 1)), ((far, 0, 0), (0, 0, 1))]
    places = [(left, top), (left, top + size.Y + gap), (left + size.X + gap, top + size.Y + gap)]
    sides = [(size.X, size.Y), (size.X, size.Z), (size.Y, size.Z)]
    body = text(left, 6, f"{title}: {size.X:.1f} × {size.Y:.1f} × {size.Z:.1f} mm")
    for (eye, up), (x0, y0), (width, height) in zip(eyes, places, sides):
        origin = middle + Vector(*eye)
        seen, hidden = part.project_to_viewport(origin, up, middle)
        for edges, style in ((hidden, 'stroke="#999" stroke-dasharray="0.8 0.6"'), (seen, "")):
            for edge in edges:
                steps = 1 if edge.geom_type.name == "LINE" else 24
                points = [edge.position_at(i / steps) for i in range(steps + 1)]
                path = "L".join(
                    f"{x0 + width / 2 + p.X:.2f} {y0 + height / 2 - p.Y:.2f}" for p in points
                )
                body += f'<path d="M{path}" {style}/>\n'
        body += level_span(x0, x0 + width, y0 - 3, f"{width:.2f}")
        body += upright_span(x0 + width + 2, y0, y0 + height, f"{height:.2f}")
    return page(left + size.X + gap + size.Y + 26, top + size.Y + gap + size.Z + 8, body)
