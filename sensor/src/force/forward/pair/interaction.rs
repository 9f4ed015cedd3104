//! Predicts how two contacts differ from the mean of single ones, by a small network.
//!
//! Each single contact has the size of both together, and is weighted by its part of the force. The
//! mean is exact if both contacts are at one place, or one has no force. The difference is the
//! network's output times a factor that vanishes there.

use super::film::Both;
use super::network::{self, COORDINATES, DOTS, FIRST, Network, SECOND};
use crate::force::forward::covariance::{Covariance, triangle};
use crate::force::forward::mounting::RestImage;
use crate::force::forward::solve::Column;
use hivtac_terms::layout::EIGHT_V;

pub use super::network::INPUTS;

/// Bytes of a file before the network.
const HEAD: usize = 4 + 8 * INPUTS + 4;
/// The markers are this near to those of the layout, mm.
const NEAR_MM: f32 = 0.05;

/// That of the layout `8v` on the nominal film, as `train_pairs.py` of `calibration/` writes it.
const OF_EIGHT_V: &[u8] = include_bytes!("../../../../data/pairs-8v.bin");

/// The interaction of two contacts, borrowed from a file.
///
/// The file has the channels of both hidden layers (u8), the number of markers (u8) and a zero.
/// Then f32: the mean and the reciprocal deviation of each input, and the distance at which the
/// factor is half of the largest, mm. The [`Network`] follows. Then comes a lower factor of the
/// covariance that the model leaves, f32, where [`Both::left`] is 1. It has the errors of the
/// single contacts' tables for pairs, too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interaction<'a> {
    head: &'a [u8; HEAD],
    network: Network<'a>,
    left: &'a [[u8; 4]],
}

impl Interaction<'static> {
    /// That of a layout, if there is one. `rest` has its markers' places.
    pub fn of_layout(rest: &RestImage) -> Option<Interaction<'static>> {
        Interaction::new(OF_EIGHT_V).filter(|_| rest.is_layout(&EIGHT_V, NEAR_MM))
    }
}

impl<'a> Interaction<'a> {
    /// Takes a file. Returns `None` if it has other channels or markers than a [`Network`], or not
    /// its length.
    pub fn new(bytes: &'a [u8]) -> Option<Interaction<'a>> {
        let (head, rest) = bytes.split_first_chunk::<HEAD>()?;
        let (network, left) = rest.split_at_checked(network::BYTES)?;
        let [first, second, dots, _, ..] = head.map(usize::from);
        let (left, over) = left.as_chunks();
        let sound = [first, second, dots] == [FIRST, SECOND, DOTS]
            && over.is_empty()
            && left.len() == triangle(COORDINATES);
        let network = Network::new(network).filter(|_| sound)?;
        Some(Interaction {
            head,
            network,
            left,
        })
    }

    /// A number of the head.
    fn number(&self, nth: usize) -> f32 {
        let (words, _) = self.head.as_chunks();
        f32::from_le_bytes(words.get(1 + nth).copied().unwrap_or_default())
    }

    /// The mean and the reciprocal deviation of an input.
    fn scale(&self, input: usize) -> [f32; 2] {
        [2 * input, 2 * input + 1].map(|nth| self.number(nth))
    }

    /// The inputs of a pair, as the network takes them.
    fn scaled(&self, both: &Both) -> [f32; INPUTS] {
        let inputs = added(both.inputs());
        core::array::from_fn(|nth| {
            let [mean, per_deviation] = self.scale(nth);
            (inputs[nth] - mean) * per_deviation
        })
    }

    /// The factor on the network's outputs, with its slopes by the inputs.
    fn factor(&self, both: &Both) -> [f32; 1 + INPUTS] {
        let [size, part, .., ax, ay, bx, by] = both.inputs();
        let far_mm = self.number(2 * INPUTS);
        let [x, y] = [ax - bx, ay - by];
        let square = x * x + y * y;
        let all = square + far_mm * far_mm;
        let apart = square / all;
        let parts = 4.0 * part * (1.0 - part);
        let of_square = size * parts * far_mm * far_mm / (all * all);
        let [by_x, by_y] = [x, y].map(|way| 2.0 * way * of_square);
        let mut factor = [0.0; 1 + INPUTS];
        factor[0] = size * parts * apart;
        factor[1] = parts * apart;
        factor[2] = 4.0 * size * apart * (1.0 - 2.0 * part);
        factor[7..].copy_from_slice(&[by_x, by_y, -by_x, -by_y]);
        factor
    }

    /// The motion of the images that the mean of single contacts leaves, focal lengths.
    pub fn moved(&self, both: &Both) -> Column {
        let motion = self.network.motion(&self.scaled(both));
        let [factor, ..] = self.factor(both);
        Column::of(motion.into_iter().map(|part| factor * part))
    }

    /// Adds that motion to a prediction, and its slopes by [`Both::inputs`] to `slopes`.
    #[inline(never)]
    pub fn add_to(&self, both: &Both, moved: &mut Column, slopes: &mut [Column; INPUTS]) {
        let mut lanes = [[0.0; COORDINATES]; 1 + INPUTS];
        (self.network).put_with_slopes(&self.scaled(both), &mut lanes);
        let [motion, by_scaled @ ..] = &lanes;
        let [factor, by_inputs @ ..] = self.factor(both);
        for (nth, (moved, part)) in moved.iter_mut().zip(motion).enumerate() {
            *moved += factor * part;
            let slope = |input: usize| {
                let [_, per_deviation] = self.scale(input);
                by_scaled[input]
                    .get(nth)
                    .map_or(0.0, |slope| per_deviation * slope)
            };
            let of_motion = added(core::array::from_fn(slope));
            let parts = by_inputs.iter().zip(of_motion);
            for (slope, (by_input, of_motion)) in slopes.iter_mut().zip(parts) {
                if let Some(slope) = slope.get_mut(nth) {
                    *slope += factor * of_motion + by_input * part;
                }
            }
        }
    }

    /// Adds the network's error to a covariance.
    pub fn add_uncertainty(&self, both: &Both, covariance: &mut Covariance) {
        let left = both.left();
        let row = |nth: usize| self.left.get(triangle(nth)..triangle(nth + 1));
        for one in 0..COORDINATES {
            for other in 0..=one {
                let [Some(a), Some(b)] = [one, other].map(row) else {
                    return;
                };
                let products = a.iter().zip(b).map(|(a, b)| {
                    let [a, b] = [a, b].map(|part| f32::from_le_bytes(*part));
                    a * b
                });
                covariance.add(one, other, left * products.sum::<f32>());
            }
        }
    }
}

/// Sums and differences of tilts and of places, in place of those of both. It takes slopes by the
/// former to slopes by the latter, too.
fn added([size, part, a, b, c, d, x, y, z, w]: [f32; INPUTS]) -> [f32; INPUTS] {
    [
        size,
        part,
        a + c,
        b + d,
        a - c,
        b - d,
        x + z,
        y + w,
        x - z,
        y - w,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::forward::Pose;
    use crate::force::model::Model;
    use std::vec::Vec;

    const MODEL: &[u8] = include_bytes!("../../../../../calibration/models/8v/default.hvtm");
    const FOUR: &[u8] = include_bytes!("../../../../../calibration/models/default.hvtm");

    fn pair(sizes: [f32; 2], places_mm: [[f32; 2]; 2]) -> [Pose; 2] {
        [0, 1].map(|k| Pose {
            size: sizes[k],
            tilt: [0.05, -0.08 + 0.1 * k as f32],
            place_mm: places_mm[k],
            width: 0.0,
        })
    }

    fn eight_dots() -> Interaction<'static> {
        let forward = Model::parse(MODEL).unwrap().forward.unwrap();
        Interaction::of_layout(&forward.rest_image).unwrap()
    }

    #[test]
    fn it_is_that_of_its_layout() {
        let four = Model::parse(FOUR).unwrap().forward.unwrap();
        assert_eq!(Interaction::of_layout(&four.rest_image), None);
        let mut moved = Model::parse(MODEL).unwrap().forward.unwrap().rest_image;
        assert!(Interaction::of_layout(&moved).is_some());
        moved.at[5][0] += 0.02;
        assert_eq!(Interaction::of_layout(&moved), None);
    }

    #[test]
    fn slopes_are_differences() {
        let forward = Model::parse(MODEL).unwrap().forward.unwrap();
        let interaction = eight_dots();
        let both = Both::new(pair([0.3, 0.35], [[1.0, 2.0], [-1.5, 0.5]]), &forward);
        let mut moved = Column::defaults(COORDINATES);
        let mut slopes = [Column::defaults(COORDINATES); INPUTS];
        interaction.add_to(&both, &mut moved, &mut slopes);
        let alone = interaction.moved(&both);
        for (a, b) in moved.iter().zip(alone.iter()) {
            assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
        for (way, slope) in slopes.iter().enumerate().skip(2) {
            let step = 2e-2;
            let [back, forth] = [-step, step].map(|step| {
                let mut poses = both.poses;
                let (number, axis) = ((way - 2) / 2, way % 2);
                match number {
                    0 | 1 => poses[number].tilt[axis] += step,
                    _ => poses[number - 2].place_mm[axis] += step,
                }
                interaction.moved(&Both::new(poses, &forward))
            });
            for (k, slope) in slope.iter().enumerate() {
                let difference = (forth[k] - back[k]) / (2.0 * step);
                let limit = 1e-4 + 0.05 * slope.abs();
                assert!(
                    (difference - slope).abs() < limit,
                    "{way} {difference} {slope}"
                );
            }
        }
    }

    #[test]
    fn where_the_mean_is_exact_it_is_nothing() {
        let forward = Model::parse(MODEL).unwrap().forward.unwrap();
        let together = pair([0.3, 0.3], [[1.0, 2.0]; 2]);
        let alone = pair([0.4, 0.0], [[1.0, 2.0], [-3.0, 0.0]]);
        for poses in [together, alone] {
            let moved = eight_dots().moved(&Both::new(poses, &forward));
            assert!(moved.iter().all(|part| *part == 0.0), "{moved:?}");
        }
    }

    #[test]
    fn other_files_are_refused() {
        assert!(Interaction::new(OF_EIGHT_V).is_some());
        for length in [0, HEAD - 1, HEAD, OF_EIGHT_V.len() - 1] {
            assert_eq!(Interaction::new(&OF_EIGHT_V[..length]), None, "{length}");
        }
        for (place, wrong) in [(0, 0), (0, 255), (1, 0), (2, 4)] {
            let mut bytes: Vec<u8> = OF_EIGHT_V.to_vec();
            bytes[place] = wrong;
            assert_eq!(Interaction::new(&bytes), None, "{place}");
        }
    }
}
