//! Knows how two contacts differ from the mean of single ones, as a small network.
//!
//! Each single contact has the size of both together, and counts by its part of the force. The
//! mean is exact if both contacts are at one place, or one has no force. What is left is the
//! network's output times a factor that vanishes there.

use super::film::Both;
use crate::force::forward::covariance::{Covariance, triangle};
use crate::force::forward::mounting::RestImage;
use crate::force::forward::solve::Column;
use crate::force::kernels::{APART, Number, products};

/// Inputs ([`Both::inputs`]).
pub const INPUTS: usize = 10;
/// Neurons of a hidden layer.
pub const WIDTH: usize = 192;
/// Layers.
pub const LAYERS: usize = 3;
/// Markers of the layout.
pub const DOTS: usize = 8;
/// Coordinates of their images.
pub const COORDINATES: usize = 2 * DOTS;
/// Bytes of a file before the layers.
pub const HEAD: usize = 4 + 8 * DOTS + 8 * INPUTS + 4;
/// The markers are this near to those of the layout, mm.
const NEAR_MM: f32 = 0.05;

/// That of the layout `8v` on the nominal film, as the example `pairs` of `calibration/` writes it.
const OF_EIGHT_V: &[u8] = include_bytes!("../../../../data/pairs-8v.bin");

/// The interaction of two contacts, borrowed from a file.
///
/// The file has the widths of both hidden layers (u8), the number of markers (u8) and a zero. Then
/// f32: the places of the markers at rest, mm; the mean and the reciprocal deviation of each
/// input; and the distance at which the factor is half of the largest, mm. For each layer, and in
/// it for each output, follow f32 bias and step, and the weights in units of the step, i16. Then
/// comes a lower factor of the covariance that the network leaves, in units of the factor, f32.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interaction<'a> {
    head: &'a [u8; HEAD],
    layers: [Layer<'a>; LAYERS],
    left: &'a [[u8; 4]],
}

/// Values of a hidden layer and their slopes by the inputs, each in units of its own, and one more
/// so that [`products`] has whole fours.
type Hidden = [[Number; APART]; LANES];
const LANES: usize = 12;
/// Largest number of a [`Hidden`].
const LARGEST: f32 = 32_767.0;
/// Bits of a sum of products that are left out, so that 32 are enough: |Σ| ≤ 192 · 2³⁰ < 2³⁸.
const LEFT_OUT: u32 = 7;
/// What 1 is worth in a sum of products with values.
const UNIT: f32 = (1 << LEFT_OUT) as f32 / LARGEST;
const _: () = assert!(2 * APART == row(WIDTH) && WIDTH as u64 <= 1 << (31 + LEFT_OUT - 30));

/// A layer: an output's bias, step and weights after those of the one before.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Layer<'a> {
    inputs: usize,
    bytes: &'a [u8],
}

/// Bias, step and weights of an output.
type Row<'a> = (f32, f32, &'a [Number]);

/// A value with its slopes by the inputs.
type Value = [f32; 1 + INPUTS];

impl Interaction<'static> {
    /// That of a layout, if there is one. `rest` has its markers' places.
    pub fn of_layout(rest: &RestImage) -> Option<Interaction<'static>> {
        Interaction::new(OF_EIGHT_V).filter(|_| rest.is_eight_v(NEAR_MM))
    }
}

impl<'a> Interaction<'a> {
    /// Takes a file. Returns `None` if its length is not what its widths say, or a width is not
    /// [`WIDTH`].
    pub fn new(bytes: &'a [u8]) -> Option<Interaction<'a>> {
        let (head, mut rest) = bytes.split_first_chunk::<HEAD>()?;
        let [first, second, dots, _, ..] = head.map(usize::from);
        let widths = [INPUTS, first, second, COORDINATES];
        if dots != DOTS || [first, second] != [WIDTH; 2] {
            return None;
        }
        let mut layers = [Layer {
            inputs: 0,
            bytes: &[],
        }; LAYERS];
        for (layer, pair) in layers.iter_mut().zip(widths.windows(2)) {
            let [inputs, outputs] = *pair else {
                return None;
            };
            let (own, others) = rest.split_at_checked(outputs * row(inputs))?;
            *layer = Layer { inputs, bytes: own };
            rest = others;
        }
        let (left, over) = rest.as_chunks();
        let sound = over.is_empty() && left.len() == triangle(COORDINATES);
        sound.then_some(Interaction { head, layers, left })
    }

    /// A number of the head.
    fn number(&self, nth: usize) -> f32 {
        let (words, _) = self.head.as_chunks();
        f32::from_le_bytes(words.get(1 + nth).copied().unwrap_or_default())
    }

    /// The mean and the reciprocal deviation of an input.
    fn scale(&self, input: usize) -> [f32; 2] {
        [2 * input, 2 * input + 1].map(|nth| self.number(COORDINATES + nth))
    }

    /// The inputs of a pair, as the network takes them.
    fn scaled(&self, both: &Both) -> [f32; INPUTS] {
        let inputs = both.inputs();
        core::array::from_fn(|nth| {
            let [mean, per_deviation] = self.scale(nth);
            (inputs[nth] - mean) * per_deviation
        })
    }

    /// The factor on the network's outputs, with its slopes by the inputs.
    fn factor(&self, both: &Both) -> [f32; 1 + INPUTS] {
        let [size, part, .., ax, ay, bx, by] = both.inputs();
        let far_mm = self.number(COORDINATES + 2 * INPUTS);
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
    #[inline(never)]
    pub fn moved(&self, both: &Both) -> Column {
        let [first, second, last] = &self.layers;
        let inputs = self.scaled(both);
        let mut hidden = [[0; 2]; APART];
        for (number, (bias, step, weights)) in hidden.iter_mut().zip(first.rows()) {
            let [value, _] = bent(bias + step * sum(weights, &inputs));
            *number = rounded(LARGEST * value);
        }
        let hidden = hidden.get(..WIDTH).unwrap_or_default();
        let mut outputs = [0.0; COORDINATES];
        for (nth, four) in second.fours().enumerate() {
            let sums = products(hidden, four.numbers);
            for (k, (bias, step)) in four.scales.into_iter().enumerate() {
                let [value, _] = bent(bias + step * UNIT * short(sums[k]));
                for (output, (_, _, weights)) in outputs.iter_mut().zip(last.rows()) {
                    let weight = weights.get(4 * nth + k).copied().unwrap_or_default();
                    *output += number(weight) * value;
                }
            }
        }
        let [factor, ..] = self.factor(both);
        let outputs = outputs.iter().zip(last.rows());
        Column::of(outputs.map(|(sum, (bias, step, _))| factor * (step * sum + bias)))
    }

    /// Adds that motion to a prediction, and its slopes by the inputs to `slopes`.
    #[inline(never)]
    pub fn add_to(&self, both: &Both, moved: &mut Column, slopes: &mut [Column; INPUTS]) {
        let [_, second, last] = &self.layers;
        let (hidden, units) = self.hidden(both);
        // A value of the second layer is used at once: there is no room for two layers' values.
        let mut outputs = [[0.0; 1 + INPUTS]; COORDINATES];
        for (nth, (bias, step, weights)) in second.rows().enumerate() {
            let mut sums = [0.0; LANES];
            let fours = hidden.as_chunks::<4>().0.iter();
            for (sums, four) in sums.as_chunks_mut().0.iter_mut().zip(fours) {
                *sums = products(weights, four.as_flattened()).map(short);
            }
            let mut value: Value = [0.0; 1 + INPUTS];
            for ((value, sum), unit) in value.iter_mut().zip(sums).zip(units) {
                *value = step * unit * sum;
            }
            let [bent, slope] = bent(bias + value[0]);
            value = value.map(|part| slope * part);
            value[0] = bent;
            for (output, (_, _, weights)) in outputs.iter_mut().zip(last.rows()) {
                let weight = number(weights.get(nth).copied().unwrap_or_default());
                for (sum, value) in output.iter_mut().zip(&value) {
                    *sum += weight * value;
                }
            }
        }
        for (output, (bias, step, _)) in outputs.iter_mut().zip(last.rows()) {
            *output = output.map(|sum| step * sum);
            output[0] += bias;
        }
        let [factor, by_inputs @ ..] = self.factor(both);
        let values = moved.iter_mut().zip(&outputs);
        for (nth, (moved, [output, of_output @ ..])) in values.enumerate() {
            *moved += factor * output;
            let parts = by_inputs.iter().zip(of_output);
            for (slope, (by_input, of_output)) in slopes.iter_mut().zip(parts) {
                if let Some(slope) = slope.get_mut(nth) {
                    *slope += factor * of_output + by_input * output;
                }
            }
        }
    }

    /// The first layer with its slopes, and the units of its sums.
    #[inline(never)]
    fn hidden(&self, both: &Both) -> (Hidden, Value) {
        let [first, ..] = &self.layers;
        let inputs = self.scaled(both);
        // The largest slopes of any pair: the neurons' function is nowhere steeper than 1.
        let mut steepest = [f32::MIN_POSITIVE; INPUTS];
        for (_, step, weights) in first.rows() {
            for (most, weight) in steepest.iter_mut().zip(weights) {
                *most = most.max((step * number(*weight)).abs());
            }
        }
        let mut hidden = [[[0; 2]; APART]; LANES];
        let [values, slopes @ ..] = &mut hidden;
        let per_steepest = steepest.map(|most| LARGEST / most);
        for (nth, (bias, step, weights)) in first.rows().enumerate() {
            let [value, slope] = bent(bias + step * sum(weights, &inputs));
            if let Some(place) = values.get_mut(nth) {
                *place = rounded(LARGEST * value);
            }
            let weights = weights.iter().zip(&per_steepest);
            for (slopes, (weight, per_steepest)) in slopes.iter_mut().zip(weights) {
                if let Some(place) = slopes.get_mut(nth) {
                    *place = rounded(step * number(*weight) * slope * per_steepest);
                }
            }
        }
        let mut units = [UNIT; 1 + INPUTS];
        for (nth, (unit, most)) in units.iter_mut().skip(1).zip(steepest).enumerate() {
            let [_, per_deviation] = self.scale(nth);
            *unit *= most * per_deviation;
        }
        (hidden, units)
    }

    /// Adds what the network leaves to a covariance.
    pub fn add_uncertainty(&self, both: &Both, covariance: &mut Covariance) {
        let [factor, ..] = self.factor(both);
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
                covariance.add(one, other, factor * factor * products.sum::<f32>());
            }
        }
    }
}

/// Four outputs of a layer that follow each other.
struct Four<'a> {
    /// Bias and step of each.
    scales: [(f32, f32); 4],
    /// The weights of the first, and [`APART`] numbers later those of the next.
    numbers: &'a [Number],
}

impl<'a> Layer<'a> {
    /// The outputs in fours. The layer's inputs are [`WIDTH`].
    fn fours(&self) -> impl Iterator<Item = Four<'a>> {
        self.bytes.chunks_exact(4 * row(WIDTH)).filter_map(|four| {
            let scale = |nth: usize| {
                let (words, _) = four.get(nth * row(WIDTH)..)?.as_chunks::<4>();
                let ([bias, step], _) = words.split_first_chunk()?;
                Some((f32::from_le_bytes(*bias), f32::from_le_bytes(*step)))
            };
            Some(Four {
                scales: [scale(0)?, scale(1)?, scale(2)?, scale(3)?],
                numbers: four.get(8..)?.as_chunks().0,
            })
        })
    }

    /// Bias, step and weights of each output.
    fn rows(&self) -> impl Iterator<Item = Row<'a>> {
        let rows = self.bytes.chunks_exact(row(self.inputs).max(1));
        rows.filter_map(|row| {
            let ([bias, step], _) = row.as_chunks::<4>().0.split_first_chunk()?;
            let weights = row.get(8..)?.as_chunks().0;
            Some((
                f32::from_le_bytes(*bias),
                f32::from_le_bytes(*step),
                weights,
            ))
        })
    }
}

/// Σ w·x.
fn sum(weights: &[Number], values: &[f32]) -> f32 {
    let products = weights.iter().zip(values);
    products.fold(0.0, |sum, (weight, value)| sum + number(*weight) * value)
}

fn number(bytes: Number) -> f32 {
    f32::from(i16::from_le_bytes(bytes))
}

/// The nearest number; within ±[`LARGEST`] the value of a [`Number`].
fn rounded(value: f32) -> Number {
    ((value + 0.5f32.copysign(value)) as i16).to_le_bytes()
}

/// A sum of products without its last bits.
fn short(sum: i64) -> f32 {
    (sum >> LEFT_OUT) as i32 as f32
}

/// Bytes of an output of a layer.
const fn row(inputs: usize) -> usize {
    8 + 2 * inputs
}

/// The hidden neurons' function x / (1 + |x|), with its slope. It needs no exponential.
fn bent(x: f32) -> [f32; 2] {
    let part = 1.0 / (1.0 + x.abs());
    [x * part, part * part]
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
            let step = 5e-3;
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
