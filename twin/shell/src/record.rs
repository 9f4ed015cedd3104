//! Full solutions as a file stores them: rows of numbers. A sweep of an hour can thus be
//! interrupted and continued.

use hivtac_twin::film::DiscMotion;
use hivtac_twin::film::reduced::Pose;

use crate::Change;
use crate::sweep::{Moved, Solved};

/// Count of numbers of a disc and of a [`Moved`].
const DISC: usize = 9;
const MOVED: usize = 3 + 4 * DISC;

/// Returns the count of numbers of a record.
pub fn length() -> usize {
    5 + (1 + Change::of_sweep().count()) * MOVED
}

/// Returns a solution as numbers.
pub fn numbers(solved: &Solved) -> Vec<f64> {
    let Pose {
        size,
        tilt,
        place_mm,
    } = solved.pose;
    let mut numbers = vec![size, tilt[0], tilt[1], place_mm[0], place_mm[1]];
    for moved in [&solved.moved].into_iter().chain(&solved.answers) {
        numbers.extend(moved.tip_mm);
        for disc in &moved.discs {
            numbers.extend([disc.moved_mm, disc.along_x, disc.along_y].as_flattened());
        }
    }
    numbers
}

/// Returns the solution from its numbers; `None` if the record has another length.
pub fn solved(numbers: &[f64]) -> Option<Solved> {
    if numbers.len() != length() {
        return None;
    }
    let (&[size, x, y, px, py], rest) = numbers.split_first_chunk()?;
    let mut moved = rest.as_chunks::<MOVED>().0.iter().map(moved_of);
    Some(Solved {
        pose: Pose {
            size,
            tilt: [x, y],
            place_mm: [px, py],
        },
        moved: moved.next()?,
        answers: moved.collect(),
    })
}

fn moved_of(numbers: &[f64; MOVED]) -> Moved {
    let vector = |first: usize| [0, 1, 2].map(|c| numbers[first + c]);
    Moved {
        tip_mm: vector(0),
        discs: std::array::from_fn(|k| {
            let first = 3 + k * DISC;
            DiscMotion {
                moved_mm: vector(first),
                along_x: vector(first + 3),
                along_y: vector(first + 6),
            }
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_comes_back() {
        let numbers_in: Vec<f64> = (0..length()).map(|k| k as f64).collect();
        let read = solved(&numbers_in).unwrap();
        assert_eq!(numbers(&read), numbers_in);
        assert_eq!(read.answers.len(), Change::of_sweep().count());
        assert!(solved(&numbers_in[1..]).is_none());
    }
}
