"""Writes table.csv: values of the paper's analytic model (eqs. 15-25) to 25 digits (the means: 12),
from 60-digit arithmetic.

    python3 -m venv venv && venv/bin/pip install mpmath==1.3.0
    venv/bin/python reference.py

Takes about a minute. Inputs are numbers that f32 and f64 both hold exactly; only f = 2.1 mm and
PN = sqrt(2) a of the design are not. Nothing here is written as the Rust code writes it: disp_N is
the second line of eq. 17 with the two-argument arctangent, R* the root of the derivative of that
line, and the means integrate PP'(R) where the code sums R*(z, PP'). Every R* is also compared with
Q along a scan of the whole of (0, PN].

Columns, lengths in mm: quantity, d_ph (slant or axial; empty where D_ph is an input or plays no
part), pm, epsilon, d_ph_mm, z, shear, value. Quantities: r_m, r_m_pressed, disp_n (eqs. 15-17);
disp_s (eq. 21, with PN in d_ph_mm); d_ph (eq. 23), quality (eq. 24), best_r (R*; "none" where Q has
no maximum at a positive PM); and mean_positive, mean_with_zeros, positive_share (eq. 25).
"""

import struct
from pathlib import Path

from mpmath import atan2, mp, mpf, nstr, quad, sqrt

mp.dps = 60

A, F, H, WEIGHT = mpf(14), mpf("2.1"), mpf(10), mpf(50)
PN = sqrt(2) * A
EXTENT = A / 2
READINGS = ["slant", "axial"]


def f32(value):
    """The nearest number that f32 holds, exactly."""
    return mpf(struct.unpack("f", struct.pack("f", float(value)))[0])


def distance(reading, pm):
    return sqrt(pm**2 + H**2) if reading == "slant" else H


def disp_n(pm, epsilon, d_ph, z):
    return F * (atan2(pm + epsilon, d_ph - z) - atan2(pm, d_ph))


def quality(reading, pm, z, shear):
    return WEIGHT * disp_n(pm, 0, distance(reading, pm), z) + shear * (PN - pm) / PN


def disp_n_slope(reading, pm, z):
    """d disp_N / d PM: of each angle atan2(PM, g), (g - PM g') / (g^2 + PM^2)."""
    d_ph = distance(reading, pm)
    d_ph_slope = pm / d_ph if reading == "slant" else mpf(0)
    rays = [(g - pm * d_ph_slope) / (g**2 + pm**2) for g in (d_ph - z, d_ph)]
    return F * (rays[0] - rays[1])


def balanced_shear(reading, pm, z):
    """The PP' at which Q is stationary at this PM."""
    return WEIGHT * PN * disp_n_slope(reading, pm, z)


def best_pm(reading, z, shear):
    """Where Q is largest, None when at PM = 0 (or nowhere)."""
    if balanced_shear(reading, mpf(0), z) <= shear:
        return None
    pm = stationary_pm(reading, z, shear)
    best = quality(reading, pm, z, shear)
    assert all(quality(reading, PN * i / 64, z, shear) <= best for i in range(65))
    return pm


def stationary_pm(reading, z, shear):
    low, high = mpf(0), PN
    assert balanced_shear(reading, high, z) < shear
    for _ in range(190):
        middle = (low + high) / 2
        if balanced_shear(reading, middle, z) > shear:
            low = middle
        else:
            high = middle
    return low


def rows_of_eq_17():
    radii = [f32(r) for r in ("1e-6", "1e-3", "0.25", "5.257", "10", "19.7")]
    depths = ("1e-6", "1e-5", "1e-4", "1e-3", "0.01", "0.1", "1", "3.5", "7", "9.9")
    depths = [f32(z) for z in depths]
    for pm in radii:
        for d_ph in (H, f32(sqrt(pm**2 + H**2)), mpf(2)):
            around = [d_ph, d_ph * (1 - mpf(2) ** -20), d_ph * (1 + mpf(2) ** -20)]
            beyond = [f32(d_ph + pm**2 / d_ph), mpf(13), mpf(100)]
            epsilons = [mpf(0)] if d_ph != H else [mpf(0), f32("1e-6"), f32("0.18")]
            for epsilon in epsilons:
                for z in depths + [f32(z) for z in around] + beyond:
                    yield ["disp_n", "", pm, epsilon, d_ph, z, "", disp_n(pm, epsilon, d_ph, z)]
    for pm in radii:
        yield ["r_m", "", pm, mpf(0), H, mpf(0), "", F * atan2(pm, H)]
        for z in depths + [H, mpf(13)]:
            yield ["r_m_pressed", "", pm, f32("0.18"), H, z, "", F * atan2(pm + f32("0.18"), H - z)]


def rows_of_eq_21():
    for pn in (f32(PN), mpf(20)):
        for pm in (mpf(0), f32("1e-6"), f32("5.257"), mpf(14), f32("19.79")):
            for shear in (f32("1e-6"), f32("0.1"), mpf(7), mpf(100)):
                yield ["disp_s", "", pm, "", pn, "", shear, shear * (pn - pm) / pn]


def rows_of_the_design():
    for pm in [mpf(0)] + [f32(r) for r in ("1e-6", "1e-3", "1", "5.257", "10", "19.7")]:
        yield ["d_ph", "slant", pm, "", "", "", "", distance("slant", pm)]
    depths = ("1e-6", "1e-3", "0.1", "1", "3.5", "7", "9.999", "10", "10.5", "13", "100")
    depths = [f32(z) for z in depths]
    for reading in READINGS:
        for pm in [f32(r) for r in ("1e-6", "1e-3", "1", "5.257", "10", "18")]:
            for z in depths:
                for shear in (mpf(0), f32("1e-6"), mpf(7)):
                    yield ["quality", reading, pm, "", "", z, shear, quality(reading, pm, z, shear)]


def rows_of_the_optimum():
    depths = ("1e-6", "1e-4", "0.01", "0.1", "0.33", "1", "2", "3.5", "5", "7", "9", "9.99")
    depths = [f32(z) for z in depths]
    for reading in READINGS:
        for z in [mpf(0)] + depths:
            onset = balanced_shear(reading, mpf(0), z)
            parts = ["1e-3", "0.02", "0.1", "0.3", "0.6", "0.9", "0.99",
                     "0.999", "0.99999", "1.00001", "1.5"]
            near = [f32(onset * mpf(part)) for part in parts] if z else []
            for shear in [mpf(0), f32("1e-6"), mpf(1), f32("3.5"), mpf(7)] + near:
                pm = best_pm(reading, z, shear)
                yield ["best_r", reading, "", "", "", z, shear, "none" if pm is None else pm / PN]


def area_under_best_pm(reading, z):
    """The integral of the best PM over PP' in [0, a/2] at this z, by parts: over PM, of PP'(PM)."""
    with mp.workdps(60):
        end = min(EXTENT, balanced_shear(reading, mpf(0), z))
        inner = stationary_pm(reading, z, EXTENT) if end == EXTENT else mpf(0)
        outer = stationary_pm(reading, z, mpf(0))
    with mp.workdps(20):
        integral = quad(lambda pm: exactly(balanced_shear, reading, pm, z), [inner, outer])
        return end * inner + integral


def exactly(function, *arguments):
    """At full precision: nodes of a quadrature come close to 0, where both angles of
    disp_N are nearly equal."""
    with mp.workdps(60):
        return function(*arguments)


def rows_of_the_mean():
    for reading in READINGS:
        # Above this depth every PP' up to a/2 has a positive R*: 50 f PN z = PP' h (h - z).
        kink = EXTENT * H**2 / (WEIGHT * F * PN + EXTENT * H)
        with mp.workdps(20):
            area = quad(lambda z: area_under_best_pm(reading, z), [0, kink, 2, EXTENT]) / PN
            onset = quad(lambda z: exactly(balanced_shear, reading, mpf(0), z), [0, kink])
        length = onset + (EXTENT - kink) * EXTENT
        yield ["mean_positive", reading, "", "", "", "", "", area / length]
        yield ["mean_with_zeros", reading, "", "", "", "", "", area / EXTENT**2]
        yield ["positive_share", reading, "", "", "", "", "", length / EXTENT**2]


def text(field):
    """A field of the table; inputs have 17 digits, which give back the f64 that they are."""
    return field if isinstance(field, str) else nstr(field, 17, min_fixed=-5, max_fixed=5)


def main():
    lines = ["quantity,d_ph,pm,epsilon,d_ph_mm,z,shear,value"]
    tables = (rows_of_eq_17, rows_of_eq_21, rows_of_the_design, rows_of_the_optimum,
              rows_of_the_mean)
    for rows in tables:
        for row in rows():
            digits = 12 if row[0].startswith(("mean", "positive")) else 25
            value = row[-1] if isinstance(row[-1], str) else nstr(row[-1], digits)
            lines.append(",".join([text(field) for field in row[:-1]] + [value]))
    # At small PM the slant and the axial D_ph are the same number.
    lines = list(dict.fromkeys(lines))
    path = Path(__file__).with_name("table.csv")
    path.write_text("\n".join(lines) + "\n")
    print(f"{path.name}: {len(lines) - 1} rows")


main()
