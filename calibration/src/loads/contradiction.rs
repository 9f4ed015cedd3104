//! Loads whose notes contradict what the sensor saw: axes swapped, a sign or a unit wrong, a place
//! mistyped.
//!
//! A sensor that knows of a unit only how it rests finds places to half a millimetre and forces to
//! a factor of some units: enough to see such mistakes, and to name them.

use anyhow::{Result, bail};

use super::SeenLoad;

/// Noted places that differ less, root mean square, mm, tell nothing of axes.
const SPREAD_MM: f64 = 1.0;
/// Notes are wrong where they are this far off, root mean square, mm, and something else explains
/// them so many times better.
const WRONG_MM: f64 = 1.2;
const BETTER: f64 = 2.5;
/// A place is mistyped where it is so much farther off than the others, and so far, mm.
const FARTHER: f64 = 5.0;
const MISTYPED_MM: f64 = 2.5;
/// Forces that are so many times what a sensor finds are in another unit.
const FACTOR: f64 = 25.0;

/// What a sensor that knows only how the unit rests makes of a load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughLoad {
    /// |F|, N, to a factor of some units.
    pub magnitude_n: f64,
    /// The place, mm, to half a millimetre.
    pub place_mm: [f64; 2],
}

/// What may have been done to a place, and what it is called.
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

/// Checks the loads' notes against what the sensor made of each.
///
/// # Errors
/// Says what is wrong, and in which load.
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

/// How far places are apart, but for their median: a stage's zero is anywhere.
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
            seen_px: [[0.0; 2]; 4],
            noise_px: 0.01,
            frames: 4,
        }
    }

    /// What a sensor makes of presses there: some tenths of a millimetre off, a third of the force.
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
