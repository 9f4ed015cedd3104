//! The functions of a load's size and tilt whose sums are the film's motions.

use crate::film::FilmError;
use crate::film::reduced::{Pose, Terms};

/// Functions of a load, the same at all places of the film. Each is a sum of
/// [`LoadFunctions::terms`].
#[derive(Clone, Debug, PartialEq)]
pub struct LoadFunctions {
    terms: Terms,
    /// By function and term.
    coefficients: Vec<f64>,
    mirrored: Vec<Mirrored>,
}

/// A function under a mirrored load.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mirrored {
    /// Whether it changes its sign with that of the tilt along x, and along y.
    pub odd: [bool; 2],
    /// The function that it is when the tilts along x and y are exchanged.
    pub swapped: u8,
    /// Whether it then has the other sign.
    pub minus: bool,
}

/// Count of bytes of a [`Mirrored`] in a file.
const MIRRORED: usize = 4;

impl LoadFunctions {
    /// Returns the terms that the functions are sums of.
    pub fn terms() -> Terms {
        Terms::up_to(8, 4, 1)
    }

    /// Returns the functions with these coefficients, by function and term.
    pub fn new(coefficients: Vec<f64>, mirrored: Vec<Mirrored>) -> LoadFunctions {
        LoadFunctions {
            terms: LoadFunctions::terms(),
            coefficients,
            mirrored,
        }
    }

    /// Returns the number of functions.
    pub fn count(&self) -> usize {
        self.mirrored.len()
    }

    /// Returns the functions' coefficients, by function and term.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Returns the functions' values under a load.
    pub fn values(&self, pose: &Pose) -> Vec<f64> {
        let terms = self.terms.exact(pose);
        let rows = self.coefficients.chunks_exact(terms.len());
        rows.map(|row| row.iter().zip(&terms).map(|(a, b)| a * b).sum())
            .collect()
    }

    /// Returns which function, and with which sign, function `k` is of a load whose tilts are
    /// exchanged, if `swap`, before they take these signs.
    pub fn seen(&self, k: usize, swap: bool, signs: [f64; 2]) -> (usize, f64) {
        let own = self.mirrored[k];
        let (other, sign) = match (swap, own.minus) {
            (false, _) => (k, 1.0),
            (true, minus) => (usize::from(own.swapped), if minus { -1.0 } else { 1.0 }),
        };
        let odd = self.mirrored[other].odd.iter().zip(signs);
        let turned = odd.filter(|(odd, sign)| **odd && *sign < 0.0).count();
        (other, if turned == 1 { -sign } else { sign })
    }

    /// Returns the functions as a file stores them.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = vec![self.count() as u8];
        for Mirrored {
            odd: [x, y],
            swapped,
            minus,
        } in &self.mirrored
        {
            bytes.extend([u8::from(*x), u8::from(*y), *swapped, u8::from(*minus)]);
        }
        bytes.extend(self.coefficients.iter().flat_map(|part| part.to_le_bytes()));
        bytes
    }

    /// Takes functions from the front of a file's bytes.
    ///
    /// # Errors
    /// If the bytes end too early, or exchange a function with one that is not there.
    pub fn take(bytes: &mut &[u8]) -> Result<LoadFunctions, FilmError> {
        let wrong = |why: &str| FilmError::Tables(format!("the load's functions {why}"));
        let cut = || wrong("are cut off");
        let (&count, rest) = bytes.split_first().ok_or_else(cut)?;
        let count = usize::from(count);
        let (own, rest) = rest.split_at_checked(MIRRORED * count).ok_or_else(cut)?;
        let length = 8 * count * LoadFunctions::terms().count();
        let (coefficients, rest) = rest.split_at_checked(length).ok_or_else(cut)?;
        let mirrored = own.as_chunks::<MIRRORED>().0.iter();
        let mirrored = mirrored.map(|[x, y, swapped, minus]| Mirrored {
            odd: [*x != 0, *y != 0],
            swapped: *swapped,
            minus: *minus != 0,
        });
        let mirrored: Vec<Mirrored> = mirrored.collect();
        if mirrored.iter().any(|one| usize::from(one.swapped) >= count) {
            return Err(wrong("name one that is not there"));
        }
        *bytes = rest;
        let coefficients = coefficients.as_chunks().0.iter();
        let coefficients = coefficients.map(|b| f64::from_le_bytes(*b)).collect();
        Ok(LoadFunctions::new(coefficients, mirrored))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The functions a·s·T_0, b·s·T_0 and s·T_0, among the first terms of degrees 1, 1 and 0.
    fn functions() -> LoadFunctions {
        let count = LoadFunctions::terms().count();
        let one = |term: usize| (0..count).map(move |k| f64::from(u8::from(k == term)));
        // Eight terms without tilt, then seven of the tilt along x, then seven of that along y.
        let coefficients = one(8).chain(one(15)).chain(one(0)).collect();
        let mirrored = |odd, swapped| Mirrored {
            odd,
            swapped,
            minus: false,
        };
        let mirrored = vec![
            mirrored([true, false], 1),
            mirrored([false, true], 0),
            mirrored([false, false], 2),
        ];
        LoadFunctions::new(coefficients, mirrored)
    }

    #[test]
    fn mirrored_loads_have_the_functions_that_are_seen() {
        let functions = functions();
        let pose = Pose {
            size: 0.4,
            tilt: [0.3, -0.2],
            place_mm: [0.0; 2],
        };
        let own = functions.values(&pose);
        for swap in [false, true] {
            for signs in [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]] {
                let turned = if swap { pose.swapped() } else { pose };
                let there = functions.values(&turned.mirrored(signs));
                for (k, value) in own.iter().enumerate() {
                    let (other, sign) = functions.seen(k, swap, signs);
                    assert!((sign * there[other] - value).abs() < 1e-15);
                }
            }
        }
    }

    #[test]
    fn files_keep_functions() {
        let bytes = functions().to_bytes();
        let mut left = bytes.as_slice();
        assert_eq!(LoadFunctions::take(&mut left), Ok(functions()));
        assert!(left.is_empty());
        assert!(LoadFunctions::take(&mut &bytes[..bytes.len() - 1]).is_err());
        let mut wrong = bytes;
        wrong[3] = 3;
        assert!(LoadFunctions::take(&mut wrong.as_slice()).is_err());
    }
}
