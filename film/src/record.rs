//! Full solutions as a file keeps them: rows of numbers, so that a sweep of an hour can be broken off and gone on with.

use hivtac_scene::film::DiscMotion;
use hivtac_scene::film::reduced::Pose;

use crate::Change;
use crate::sweep::{Moved, Solved};

/// Numbers of a disc, of a [`Moved`], around the markers, and of a whole record.
const DISC: usize = 9;
const MOVED: usize = 3 + 4 * DISC;
const AROUND: usize = 4 * 9 * 3;

/// Numbers of a record.
pub fn length() -> usize {
    5 + (1 + Change::all().count()) * MOVED + AROUND
}

/// A solution as numbers.
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
    numbers.extend(solved.around_mm.as_flattened().as_flattened());
    numbers
}

/// The solution that numbers are; none of a record of another length.
pub fn solved(numbers: &[f64]) -> Option<Solved> {
    let (&[size, x, y, px, py], rest) = numbers.split_first_chunk()?;
    let (moved, around) = rest.split_at_checked((1 + Change::all().count()) * MOVED)?;
    let (around, []) = around.split_first_chunk::<AROUND>()? else {
        return None;
    };
    let mut moved = moved.as_chunks::<MOVED>().0.iter().map(moved_of);
    Some(Solved {
        pose: Pose {
            size,
            tilt: [x, y],
            place_mm: [px, py],
        },
        moved: moved.next()?,
        around_mm: around_of(around),
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

fn around_of(numbers: &[f64; AROUND]) -> [[[f64; 3]; 9]; 4] {
    let at = |k: usize, i: usize, c: usize| numbers[(k * 9 + i) * 3 + c];
    std::array::from_fn(|k| std::array::from_fn(|i| [0, 1, 2].map(|c| at(k, i, c))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_comes_back() {
        let numbers_in: Vec<f64> = (0..length()).map(|k| k as f64).collect();
        let read = solved(&numbers_in).unwrap();
        assert_eq!(numbers(&read), numbers_in);
        assert_eq!(read.answers.len(), Change::all().count());
        assert!(solved(&numbers_in[1..]).is_none());
    }
}
