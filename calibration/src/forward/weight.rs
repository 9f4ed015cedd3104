//! Computes the effect of a film's own weight on its images, for a model file.

use crate::parallel;
use anyhow::Result;
use hivtac_sensor::force::forward::weight::{
    AT_REST, Functions, SIZES, TERMS, UNDER_LOAD, soft, terms,
};
use hivtac_sensor::force::forward::{Gravity, Stiffness};
use hivtac_sensor::force::model::WeightSpec;
use hivtac_twin::film::reduced::{AS_A_PRESS_N, LARGEST_SIZE, LARGEST_TILT};

use super::covariances::Moved;
use super::least_squares::LeastSquares;

/// Number of directions of gravity around the film, in the planes of x and z and of y and z, at
/// which its rest is computed.
const AROUND: usize = 24;
/// Places of the tip along each axis, and tilts of its force, in parts of the largest.
const PLACES_MM: [f64; 7] = [-4.5, -3.2, -1.6, 0.0, 1.6, 3.2, 4.5];
const TILTS: [[f64; 2]; 5] = [[0.0, 0.0], [0.6, 0.0], [-0.6, 0.0], [0.0, 0.6], [0.0, -0.6]];
/// Gravity for which the effect under loads is computed: none, along −z, z, x and y.
const DOWN: [[f64; 3]; 5] = [
    [0.0, 0.0, 0.0],
    [0.0, 0.0, -1.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
];
/// Standard uncertainty of the effect of weight, in parts of that effect: for a film that was
/// fitted to its loads, and for any other.
const UNSURE: [f32; 2] = [0.05, 0.5];

/// A load under which the effect of weight is computed: place of the tip, mm, and tilt.
pub type Pressed = ([f64; 2], [f64; 2]);

/// A film whose images can be computed under loads and gravity.
pub trait Weighed: Sync {
    /// The film with gravity in some direction.
    type Turned: Send + Sync;

    /// Weight of the film, as the press that makes it sink as far, N.
    fn press_n(&self) -> f64 {
        AS_A_PRESS_N
    }

    /// Where it is pressed: at least as many loads as there are terms.
    fn pressed(&self) -> Vec<Pressed>;

    /// The film with gravity in this direction.
    ///
    /// # Errors
    /// When no equilibrium is found.
    fn turned(&self, down: [f64; 3]) -> Result<Self::Turned>;

    /// Motion of all markers' images at one place and tilt under growing sizes, focal lengths. It
    /// counts from the untouched, weightless film.
    ///
    /// # Errors
    /// When no equilibrium is found.
    fn moved(&self, film: &Self::Turned, pressed: &Pressed, sizes: &[f64]) -> Result<Vec<Moved>>;

    /// The same for the untouched film.
    ///
    /// # Errors
    /// When its images cannot be computed.
    fn hangs(&self, film: &Self::Turned) -> Result<Moved>;
}

/// Places all over the film, each with five tilts.
pub fn everywhere() -> Vec<Pressed> {
    let places = PLACES_MM
        .into_iter()
        .flat_map(|y| PLACES_MM.map(|x| [x, y]));
    places
        .flat_map(|place_mm| TILTS.map(|tilt| (place_mm, tilt.map(|part| LARGEST_TILT * part))))
        .collect()
}

/// The effect of weight on a film whose tables and rest position hold with gravity `down`.
///
/// # Errors
/// When no equilibrium is found.
pub fn weight(film: &impl Weighed, stiffness: Stiffness, down: [f64; 3]) -> Result<WeightSpec> {
    let functions = Functions {
        stiffness,
        press_n: film.press_n() as f32,
    };
    let at_rest = at_rest(film, &functions)?;
    Ok(WeightSpec {
        down: single(down),
        press_n: functions.press_n,
        unsure: UNSURE,
        under_load: under_load(film, &functions, &at_rest)?,
        at_rest: at_rest.map(|column| column.to_vec()),
    })
}

fn at_rest(film: &impl Weighed, functions: &Functions) -> Result<[Moved; AT_REST]> {
    let hangs = |down| film.hangs(&film.turned(down)?);
    let weightless = hangs([0.0; 3])?;
    let around = (0..AROUND).flat_map(|k| {
        let (sin, cos) = libm::sincos(k as f64 * std::f64::consts::TAU / AROUND as f64);
        [[sin, 0.0, cos], [0.0, sin, cos]]
    });
    let around: Vec<[f64; 3]> = around.collect();
    let sides = parallel::try_map(around.len(), |k| Ok(less(&hangs(around[k])?, &weightless)))?;
    let rows = around
        .iter()
        .map(|down| functions.at(0.0, single(*down)).map(f64::from));
    let coordinates = weightless.len();
    fitted_parts(&rows.collect::<Vec<_>>(), coordinates, |i, c| sides[i][c])
}

/// The effect added under loads, by size, function of gravity, coordinate and term.
fn under_load(
    film: &impl Weighed,
    functions: &Functions,
    at_rest: &[Moved; AT_REST],
) -> Result<[[Vec<[f64; TERMS]>; UNDER_LOAD]; SIZES]> {
    let sizes: [f64; SIZES] = std::array::from_fn(|number| {
        let root = (number + 1) as f64 / SIZES as f64;
        LARGEST_SIZE * root * root
    });
    let pressed = film.pressed();
    let turned = |down| Ok::<_, anyhow::Error>((down, film.turned(down)?));
    let [weightless, toward, away, along_x, along_y] = DOWN.map(turned);
    let turned = [weightless?, toward?, away?, along_x?, along_y?];
    // By place and tilt, and by size.
    let sides = parallel::try_map(pressed.len(), |k| {
        added(film, &turned, functions, at_rest, &pressed[k], &sizes)
    })?;
    let rows = pressed.iter().map(|(place_mm, tilt)| {
        let [place, tilt] = [place_mm, tilt].map(|pair| pair.map(|part| part as f32));
        terms(place, tilt).map(f64::from)
    });
    let rows: Vec<[f64; TERMS]> = rows.collect();
    let coordinates = at_rest[0].len();
    let mut under_load: [[Vec<[f64; TERMS]>; UNDER_LOAD]; SIZES] = Default::default();
    for (number, (of_size, size)) in under_load.iter_mut().zip(sizes).enumerate() {
        let softness = f64::from(soft(&functions.stiffness, size as f32));
        for (f, of_function) in of_size.iter_mut().enumerate() {
            let found = fitted_parts(&rows, coordinates, |i, c| sides[i][number][f][c] / softness)?;
            *of_function = (0..coordinates)
                .map(|c| found.map(|of_term| of_term[c]))
                .collect();
        }
    }
    Ok(under_load)
}

/// Coefficients of `N` functions, whose values are the rows, nearest to the known values of each of
/// these coordinates.
fn fitted_parts<const N: usize>(
    rows: &[[f64; N]],
    coordinates: usize,
    known: impl Fn(usize, usize) -> f64,
) -> Result<[Moved; N]> {
    let through = LeastSquares::new(&rows.iter().map(|row| row.to_vec()).collect::<Vec<_>>())?;
    let of_coordinate = |c: usize| {
        let samples: Vec<f64> = (0..rows.len()).map(|i| known(i, c)).collect();
        through.coefficients(&samples)
    };
    let found: Vec<Vec<f64>> = (0..coordinates).map(of_coordinate).collect();
    Ok(std::array::from_fn(|f| {
        Moved::from_fn(coordinates, |c| found[c][f])
    }))
}

/// The effect that loads of these sizes add to that of gravity at rest, by function of gravity.
/// Gravity along z and −z separates the parts in Δ and in its square; that along the film is
/// proportional. `turned` are the films under gravity in each direction of [`DOWN`].
fn added<F: Weighed>(
    film: &F,
    turned: &[([f64; 3], F::Turned); 5],
    functions: &Functions,
    at_rest: &[Moved; AT_REST],
    pressed: &Pressed,
    sizes: &[f64],
) -> Result<Vec<[Moved; UNDER_LOAD]>> {
    let [(_, weightless), toward, away, along_x, along_y] = turned;
    let weightless = film.moved(weightless, pressed, sizes)?;
    let more = |(down, turned): &([f64; 3], F::Turned)| -> Result<Vec<(f64, Moved)>> {
        let moved = film.moved(turned, pressed, sizes)?;
        let of_size = |((moved, weightless), size): ((&Moved, &Moved), &f64)| {
            let parts = functions.at(*size as f32, single(*down)).map(f64::from);
            let mut more = less(moved, weightless);
            for (part, column) in parts.iter().zip(at_rest) {
                for (sum, value) in more.iter_mut().zip(column.iter()) {
                    *sum -= part * value;
                }
            }
            (parts[0], more)
        };
        Ok(moved
            .iter()
            .zip(&weightless)
            .zip(sizes)
            .map(of_size)
            .collect())
    };
    let [toward, away] = [more(toward)?, more(away)?];
    let [along_x, along_y] = [more(along_x)?, more(along_y)?];
    let of_size = |k: usize| {
        let ((d, toward), (e, away)) = (&toward[k], &away[k]);
        let square = Moved::from_fn(toward.len(), |c| (toward[c] / d - away[c] / e) / (d - e));
        let first = Moved::from_fn(toward.len(), |c| toward[c] / d - square[c] * d);
        [first, square, along_x[k].1, along_y[k].1]
    };
    Ok((0..sizes.len()).map(of_size).collect())
}

fn less(a: &Moved, b: &Moved) -> Moved {
    Moved::from_fn(a.len(), |c| a[c] - b[c])
}

fn single(down: [f64; 3]) -> Gravity {
    down.map(|part| part as f32)
}
