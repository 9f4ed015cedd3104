"""The ring of LEDs: its currents, its heat, its schematic and its perfboard."""

from dataclasses import dataclass

from kit.drawing import line, page, text

# Supply, V: nominal, and USB's range at a device.
SUPPLY = (5.0, 4.4, 5.25)
# Forward voltage of a white LED of 0.2 W at some mA, V: usual, and its spread.
FORWARD = (2.8, 2.65, 3.0)
LEDS = 8
# A usual LED of this kind gives so much light for its current, lm/mA.
LUMENS_PER_MA = 0.38
# Transmission of the diffuser and the windows, estimated, not measured.
PASSED = 0.25


@dataclass(frozen=True)
class Lamp:
    """Eight LEDs in parallel, each behind a resistor of this many ohms."""

    ohms: float

    def current_ma(self, supply: float = SUPPLY[0], forward: float = FORWARD[0]) -> float:
        """Current of one LED."""
        return 1000 * (supply - forward) / self.ohms

    @property
    def currents_ma(self) -> tuple[float, float]:
        """The least and the largest current of one LED."""
        return (
            self.current_ma(SUPPLY[1], FORWARD[2]),
            self.current_ma(SUPPLY[2], FORWARD[1]),
        )

    @property
    def total_ma(self) -> float:
        return LEDS * self.current_ma()

    @property
    def heat_mw(self) -> tuple[float, float]:
        """Heat of the whole lamp, and of one resistor."""
        return SUPPLY[0] * self.total_ma, self.current_ma() ** 2 * self.ohms / 1000

    @property
    def lumens(self) -> float:
        """Light behind diffuser and windows."""
        return LEDS * self.current_ma() * LUMENS_PER_MA * PASSED


def schematic(lamp: Lamp) -> str:
    """Eight branches of a resistor and an LED between 5 V and ground."""
    body = text(6, 8, f"{LEDS} × white LED, 0.2 W, 2835; {LEDS} × {lamp.ohms:g} Ω, 5 %, 1/8 W")
    low, high = lamp.currents_ma
    body += text(
        6,
        12,
        f"{lamp.current_ma():.1f} mA each ({low:.1f} to {high:.1f}), {lamp.total_ma:.0f} mA in all",
    )
    top, bottom, left = 20.0, 58.0, 16.0
    step = 13.0
    right = left + step * (LEDS - 1)
    body += line(left - 8, top, right, top) + line(left - 8, bottom, right, bottom)
    for y, words in ((top, "5 V"), (bottom, "GND")):
        body += f'<circle cx="{left - 8}" cy="{y}" r="0.7" fill="#fff"/>\n'
        body += text(left - 11.5, y - 1.6, words)
    for number in range(LEDS):
        x = left + step * number
        body += line(x, top, x, top + 6)
        body += f'<rect x="{x - 1.5}" y="{top + 6}" width="3" height="8"/>\n'
        body += text(x + 2.2, top + 11, f"R{number + 1}")
        body += line(x, top + 14, x, top + 22)
        body += f'<path d="M{x - 2.5} {top + 22}h5l-2.5 4.5z" fill="#ffd84d"/>\n'
        body += line(x - 2.5, top + 26.5, x + 2.5, top + 26.5)
        body += text(x + 3, top + 26, f"D{number + 1}")
        for shift in (0, 2.2):
            tip = f"M{x - 3 - shift} {top + 22 + shift / 2}l-2.2 -2.2m0 1.2v-1.2h1.2"
            body += f'<path d="{tip}"/>\n'
        body += line(x, top + 26.5, x, bottom)
        for y in (top, bottom):
            body += f'<circle cx="{x}" cy="{y}" r="0.5" fill="#000"/>\n'
    return page(right + 14, bottom + 8, body)


def perfboard(half: float, corner: float, hole: float) -> str:
    """The perfboard from the side of LEDs and copper, at four times its size."""
    scale, middle = 4.0, 74.0

    def at(x: float, y: float) -> tuple[float, float]:
        return middle + scale * x, middle + scale * y

    inner = half - corner
    points = [(half, inner), (inner, half), (-inner, half), (-half, inner)]
    points += [(-x, -y) for x, y in points]
    path = "L".join("{:.1f} {:.1f}".format(*at(x, y)) for x, y in points)
    body = f'<path d="M{path}Z" fill="#dcebdc"/>\n'
    body += f'<circle cx="{middle}" cy="{middle}" r="{scale * hole}" fill="#fff"/>\n'
    for column in range(12):
        for row in range(12):
            x, y = 2.54 * (column - 5.5), 2.54 * (row - 5.5)
            on_board = abs(x) + abs(y) < half + inner - 0.8 and x * x + y * y > (hole + 0.8) ** 2
            if on_board:
                circle = '<circle cx="{:.1f}" cy="{:.1f}" r="1.9" fill="#fff" stroke="#999"/>\n'
                body += circle.format(*at(x, y))
    for x, y in ((-8.89, -8.89), (8.89, -8.89), (8.89, 8.89), (-8.89, 8.89)):
        body += '<circle cx="{:.1f}" cy="{:.1f}" r="4.4" stroke="#00c"/>\n'.format(*at(x, y))
    for turn in range(4):
        body += f'<g transform="rotate({90 * turn} {middle} {middle})">\n'
        for side in (-1, 1):
            x, y = at(12.7, 3.81 * side)
            body += (
                f'<rect x="{x - 7:.1f}" y="{y - 5.6:.1f}" width="14" height="11.2" '
                'fill="#ffe98a"/>\n'
            )
            x, y = at(11.43, 2.54 * side)
            body += (
                f'<rect x="{x - 2.6:.1f}" y="{y - 5:.1f}" width="5.2" height="10" fill="#444"/>\n'
            )
        x, y0 = at(11.43, -1.27)
        _, y1 = at(11.43, 1.27)
        body += line(x, y0, x, y1, 'stroke="#c00" stroke-width="0.8"')
        x, y0 = at(13.97, -3.81)
        _, y1 = at(13.97, 3.81)
        body += line(x, y0, x, y1, 'stroke="#00c" stroke-width="1"')
        body += "</g>\n"
    words = [
        "copper and LEDs on this side, towards the film; yellow LEDs, black resistors",
        "red: 5 V (LEDs' anodes are on its side), blue: GND; a wire joins the four of each",
    ]
    for row, line in enumerate(words):
        body += text(6, 2 * middle - 4 + 4 * row, line)
    return page(2 * middle, 2 * middle + 4, body)
