//! Finds loads whose notes contradict the sensor's picture: axes swapped, a wrong sign or unit, a
//! mistyped place.
//!
//! A sensor that knows only a unit's rest position finds places to half a millimetre, and forces to
//! a small factor. This is enough to detect such mistakes, and to name them.

use anyhow::{Result, bail};

use super::SeenLoad;

/// Axes are checked only if noted places differ by at least this, root mean square, mm.
const SPREAD_MM: f64 = 1.0;
/// Notes are wrong if their root mean square difference exceeds the first value, mm, and a mistake
/// explains them better by at least the second, a factor.
const WRONG_MM: f64 = 1.2;
const BETTER: f64 = 2.5;
/// A place is mistyped if its difference exceeds the median by this factor, and also exceeds this,
/// mm.
const FARTHER: f64 = 5.0;
const MISTYPED_MM: f64 = 2.5;
/// Forces have a wrong unit if their median ratio to the sensor's exceeds this factor, or is below
/// its inverse.
const FACTOR: f64 = 25.0;

/// A load as estimated by a sensor that knows only the unit's rest position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughLoad {
    /// |F|, N, to a small factor.
    pub magnitude_n: f64,
    /// The place, mm, to half a millimetre.
    pub place_mm: [f64; 2],
}

/// Possible mistakes in a place: matrix and description.
const MISTAKES: [([[f64; 2]; 2], &str); 7] = [
    ([[-1.0, 0.0], [0.0, 1.0]], "x has the other sign"),
    ([[1.0, 0.0], [0.0, -1.0]], "y has the other sign"),
    ([[-1.0, 0.0], [0.0, -1.0]], "x and y have the other sign"),
    ([[0.0, 1.0], [1.0, 0.0]], "x and y are swapped"),
    (
        [[0.0, -1.0], [1.0, 0.0]],
        "x and y are swapped, and x has the other sign",
    ),
    (
        [[0.0, 1.0], [-1.0, 0.0]],
        "x and y are swapped, and y has the other sign",
    ),
    (
        [[0.0, -1.0], [-1.0, 0.0]],
        "x and y are swapped, and both have the other sign",
    ),
];

/// Checks the loads' notes against the sensor's estimate of each.
///
/// # Errors
/// Names the mistake, and the load.
pub fn check(loads: &[SeenLoad], rough: &[RoughLoad]) -> Result<()> {
    check_unit(loads, rough)?;
    let pairs: Vec<(usize, [f64; 2], [f64; 2])> = (loads.iter().zip(rough).enumerate())
        .filter(|(_, (load, _))| load.each_place_mm.is_finite())
        .map(|(number, (load, rough))| (number, load.place_mm, rough.place_mm))
        .collect();
    if pairs.len() < 4 {
        return Ok(());
    }
    let noted: Vec<[f64; 2]> = pairs.iter().map(|(_, noted, _)| *noted).collect();
    if root_mean_square(&apart(&noted, &vec![[0.0; 2]; noted.len()])) < SPREAD_MM {
        return Ok(());
    }
    let found: Vec<[f64; 2]> = pairs.iter().map(|(_, _, found)| *found).collect();
    let off = apart(&noted, &found);
    let whole = root_mean_square(&off);
    let explained = MISTAKES.map(|(turn, name)| {
        let turned: Vec<[f64; 2]> = noted
            .iter()
            .map(|[x, y]| turn.map(|[a, b]| a * x + b * y))
            .collect();
        (root_mean_square(&apart(&turned, &found)), name)
    });
    let best = explained.iter().min_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((left, name)) = best.filter(|(left, _)| whole > WRONG_MM && BETTER * left < whole) {
        bail!(
            "the noted places contradict what the sensor saw: {name}. They are {whole:.1} mm off \
             as they are, and {left:.1} mm otherwise (x to the right and y down in the image, \
             `docs/architecture.md`)"
        );
    }
    let mut sizes: Vec<f64> = off.iter().map(|[x, y]| x.hypot(*y)).collect();
    let of_pair = sizes.clone();
    sizes.sort_by(f64::total_cmp);
    let usual = sizes[sizes.len() / 2];
    for ((number, noted, found), far) in pairs.iter().zip(of_pair) {
        if far > MISTYPED_MM && far > FARTHER * usual {
            bail!(
                "load {}: its place is noted as ({}, {}) mm, and the sensor saw it about ({:.1}, \
                 {:.1}) mm: correct the note, or leave the load out",
                number + 1,
                noted[0],
                noted[1],
                found[0],
                found[1]
            );
        }
    }
    Ok(())
}

fn check_unit(loads: &[SeenLoad], rough: &[RoughLoad]) -> Result<()> {
    let ratios = loads.iter().zip(rough);
    let mut ratios: Vec<f64> = ratios
        .map(|(load, rough)| load.magnitude_n() / rough.magnitude_n.max(1e-4))
        .collect();
    ratios.sort_by(f64::total_cmp);
    let usual = ratios[ratios.len() / 2];
    if !(1.0 / FACTOR..=FACTOR).contains(&usual) {
        bail!(
            "the noted forces are {usual:.2} times what the sensor saw, about: are they in another \
             unit than newtons (`--gauge-unit`)?"
        );
    }
    Ok(())
}

/// Differences between noted and found places minus their median, because a stage's zero is
/// arbitrary.
fn apart(noted: &[[f64; 2]], found: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let off: Vec<[f64; 2]> = (noted.iter().zip(found))
        .map(|(a, b)| [a[0] - b[0], a[1] - b[1]])
        .collect();
    let median = [0, 1].map(|i| {
        let mut parts: Vec<f64> = off.iter().map(|off| off[i]).collect();
        parts.sort_by(f64::total_cmp);
        parts[parts.len() / 2]
    });
    off.iter()
        .map(|off| [off[0] - median[0], off[1] - median[1]])
        .collect()
}

fn root_mean_square(off: &[[f64; 2]]) -> f64 {
    let sum: f64 = off.iter().map(|[x, y]| x * x + y * y).sum();
    (sum / off.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLACES: [[f64; 2]; 6] = [
        [0.0, 0.0],
        [3.0, 0.5],
        [-0.5, 3.0],
        [-3.0, -0.5],
        [0.5, -3.0],
        [1.0, 2.0],
    ];

    fn load(place_mm: [f64; 2], force_n: f64) -> SeenLoad {
        SeenLoad {
            force_n: [0.0, 0.0, -force_n],
            size_n: 1e-3,
            direction_rad: 0.0,
            place_mm,
            each_place_mm: 0.0,
            seen_px: [[0.0; 2]; 4].into(),
            noise_px: 0.01,
            frames: 4,
        }
    }

    /// The sensor's estimates of those presses: some tenths of a millimetre off, a third of the
    /// force.
    fn rough() -> Vec<RoughLoad> {
        let off = |k: usize| 0.3 * if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let of_place = |(k, [x, y]): (usize, &[f64; 2])| RoughLoad {
            magnitude_n: 0.03,
            place_mm: [x + 0.4 + off(k), y - off(k)],
        };
        PLACES.iter().enumerate().map(of_place).collect()
    }

    fn said(loads: &[SeenLoad]) -> String {
        check(loads, &rough()).map_or_else(|error| error.to_string(), |()| String::new())
    }

    #[test]
    fn what_fits_is_taken_and_mistakes_are_named() {
        let noted = |of: fn([f64; 2]) -> [f64; 2]| PLACES.map(|place| load(of(place), 0.1));
        assert_eq!(said(&noted(|place| place)), "");
        for (mistake, name) in [
            (
                (|[x, y]| [-x, y]) as fn([f64; 2]) -> [f64; 2],
                "x has the other sign",
            ),
            (|[x, y]| [y, x], "x and y are swapped"),
            (|[x, y]| [-y, x], "x and y are swapped, and"),
        ] {
            let said = said(&noted(mistake));
            assert!(said.contains(name), "{name}: {said}");
        }
        let mut mistyped = noted(|place| place);
        mistyped[3].place_mm = [3.0, -0.5];
        assert!(said(&mistyped).contains("load 4"), "{}", said(&mistyped));
        let milli = PLACES.map(|place| load(place, 100.0));
        assert!(said(&milli).contains("another unit"), "{}", said(&milli));
    }

    #[test]
    fn places_that_nobody_noted_contradict_nothing() {
        let anywhere = PLACES.map(|[x, y]| SeenLoad {
            each_place_mm: f64::INFINITY,
            ..load([y, x], 0.1)
        });
        assert_eq!(said(&anywhere), "");
    }
}
