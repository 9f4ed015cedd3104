//! The network for two contacts: layers of channels, each with a value for every image of a pair.
//!
//! A layout that is symmetric about x and y moves symmetrically, and contacts have no order: a pair
//! has eight images. A channel has a value for each. Sums of these with the signs of a parity
//! change at most their sign from image to image, as inputs and outputs do. So between the layers
//! each parity has weights of its own: an eighth of those that all values would have.

use crate::force::kernels::{APART, Number, products};

/// Inputs: the size of both, the first one's part, sums and differences of tilts and of places,
/// along x and y.
pub const INPUTS: usize = 10;
/// Markers of the layout, and coordinates of their images.
pub const DOTS: usize = 8;
pub const COORDINATES: usize = 2 * DOTS;
/// Channels of the hidden layers.
pub const FIRST: usize = 24;
pub const SECOND: usize = 128;

/// Images of a pair. Bits of an image and of a parity say what is mirrored or changes the sign: x
/// (1), y (2), the order of the contacts (4).
const IMAGES: usize = 8;
/// Parities of outputs: no order matters there.
const PARITIES: usize = 4;
/// Outputs of a parity.
const OUTPUTS: usize = COORDINATES / PARITIES;
/// The parities of the inputs.
const OF_INPUTS: [usize; INPUTS] = [0, 4, 1, 2, 5, 6, 1, 2, 5, 6];
/// For each marker of `8v` its kind, and the mirrors that take the kind's first marker to it.
const OF_MARKERS: [(Kind, usize); DOTS] = [
    (Kind::Corner, 0),
    (Kind::Corner, 1),
    (Kind::Corner, 3),
    (Kind::Corner, 2),
    (Kind::Left, 0),
    (Kind::Top, 0),
    (Kind::Left, 1),
    (Kind::Top, 2),
];

/// Markers that are mirrored to each other.
#[derive(Clone, Copy)]
enum Kind {
    Corner,
    Left,
    Top,
}

/// The layers, borrowed from a file.
///
/// For each channel of the two hidden layers it has f32 bias and step, and the weights in units of
/// the step, i16. In the second layer the weights are ordered by parity. Then come f32 bias and
/// step of each output, and for each channel the weights of all outputs. Outputs of a parity are x
/// and y of the first corner, and that coordinate of the first left and of the first top marker
/// which has the parity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Network<'a> {
    first: &'a [[u8; row(INPUTS)]; FIRST],
    second: &'a [[u8; row(IMAGES * FIRST)]; SECOND],
    scales: &'a [[u8; 8]; COORDINATES],
    last: &'a [[Number; COORDINATES]; SECOND],
}

/// Bytes of a network.
pub const BYTES: usize =
    FIRST * row(INPUTS) + SECOND * row(IMAGES * FIRST) + COORDINATES * (8 + 2 * SECOND);

/// Values of the first layer by parity, and their slopes by the inputs, each in units of its own,
/// and one more so that [`products`] has whole fours.
type Hidden = [[Number; APART]; LANES];
const LANES: usize = 12;
/// Largest number of a [`Hidden`].
const LARGEST: f32 = 32_767.0;
/// Bits of a sum of products that are left out, so that 32 are enough: |Σ| ≤ 24 · 2³⁰ < 2³⁵.
const LEFT_OUT: u32 = 4;
/// The value of 1 in a sum of products.
const UNIT: f32 = (1 << LEFT_OUT) as f32 / LARGEST;
const _: () = assert!(2 * APART == row(IMAGES * FIRST) && FIRST <= 1 << (31 + LEFT_OUT - 30));

/// A number for each image, or for each parity.
type Images = [f32; IMAGES];
/// The motion of all markers' images, or outputs by parity.
pub type Motion = [f32; COORDINATES];

impl<'a> Network<'a> {
    /// Takes a file's bytes; `None` if they are not [`BYTES`].
    pub fn new(bytes: &'a [u8]) -> Option<Network<'a>> {
        let (first, rest) = bytes.split_at_checked(FIRST * row(INPUTS))?;
        let (second, rest) = rest.split_at_checked(SECOND * row(IMAGES * FIRST))?;
        let (scales, last) = rest.split_at_checked(8 * COORDINATES)?;
        let (last, over) = last.as_chunks::<2>().0.as_chunks();
        (over.is_empty() && bytes.len() == BYTES).then_some(Network {
            first: first.as_chunks().0.try_into().ok()?,
            second: second.as_chunks().0.try_into().ok()?,
            scales: scales.as_chunks().0.try_into().ok()?,
            last: last.try_into().ok()?,
        })
    }

    /// The motion at inputs.
    #[inline(never)]
    pub fn motion(&self, inputs: &[f32; INPUTS]) -> Motion {
        let mut hidden = [[[0; 2]; FIRST]; IMAGES];
        for (nth, row) in self.first.iter().enumerate() {
            let [values, _] = channel(parts(row), inputs);
            for (hidden, value) in hidden.iter_mut().zip(values) {
                if let Some(place) = hidden.get_mut(nth) {
                    *place = rounded(LARGEST * value);
                }
            }
        }
        let mut outputs = Motion::default();
        let lasts = self.last.as_chunks::<4>().0;
        for (rows, lasts) in self.second.as_chunks::<4>().0.iter().zip(lasts) {
            // Weights of the first of four rows, and `APART` numbers later those of the next.
            let (numbers, _) = rows.as_flattened().as_chunks();
            let mut sums = [Images::default(); 4];
            for (parity, hidden) in hidden.iter().enumerate() {
                let numbers = numbers.get(4 + parity * FIRST..).unwrap_or_default();
                for (sums, sum) in sums.iter_mut().zip(products(hidden, numbers)) {
                    if let Some(place) = sums.get_mut(parity) {
                        *place = short(sum);
                    }
                }
            }
            for ((row, sums), last) in rows.iter().zip(sums).zip(lasts) {
                let (bias, step, _) = parts(row);
                let values = mixed(sums).map(|sum| bent(bias + step * UNIT * sum)[0]);
                add(&mut outputs, &last.map(number), evened(values));
            }
        }
        self.scale(&mut outputs, true);
        of_markers(&outputs)
    }

    /// Makes `lanes` the motion at inputs, then its slopes by each of them.
    #[inline(never)]
    pub fn put_with_slopes(&self, inputs: &[f32; INPUTS], lanes: &mut [Motion; 1 + INPUTS]) {
        let mut hidden = [[[0; 2]; APART]; LANES];
        let units = self.put_hidden(inputs, &mut hidden);
        *lanes = [Motion::default(); 1 + INPUTS];
        // A value of the second layer is used at once: there is no room for two layers' values.
        for (row, last) in self.second.iter().zip(self.last) {
            let (bias, step, weights) = parts(row);
            let last = last.map(number);
            let mut slopes = Images::default();
            for (four, lanes) in lanes.chunks_mut(4).enumerate() {
                let sums = sums(weights, &hidden, four);
                let units = units.iter().skip(4 * four);
                let all = sums.into_iter().zip(units).zip(lanes).enumerate();
                for (lane, ((sums, unit), outputs)) in all {
                    let mut values = mixed(sums);
                    for (value, slope) in values.iter_mut().zip(&mut slopes) {
                        match 4 * four + lane {
                            0 => [*value, *slope] = bent(bias + step * unit * *value),
                            _ => *value *= step * unit * *slope,
                        }
                    }
                    add(outputs, &last, evened(values));
                }
            }
        }
        for (nth, outputs) in lanes.iter_mut().enumerate() {
            self.scale(outputs, nth == 0);
            *outputs = of_markers(outputs);
        }
    }

    /// Makes `hidden` the first layer with its slopes, and returns the units of its sums. There is
    /// no room for a copy.
    #[inline(never)]
    fn put_hidden(&self, inputs: &[f32; INPUTS], hidden: &mut Hidden) -> [f32; 1 + INPUTS] {
        // The largest slopes of any pair: the neurons' function is nowhere steeper than 1.
        let mut steepest = [f32::MIN_POSITIVE; INPUTS];
        for row in self.first {
            let (_, step, weights) = parts(row);
            for (most, weight) in steepest.iter_mut().zip(weights) {
                *most = most.max((step * number(*weight)).abs());
            }
        }
        let [all_values, all_slopes @ ..] = hidden;
        for (nth, row) in self.first.iter().enumerate() {
            let (bias, step, weights) = parts(row);
            let [values, slopes] = channel((bias, step, weights), inputs);
            for (parity, value) in values.into_iter().enumerate() {
                if let Some(place) = all_values.get_mut(parity * FIRST + nth) {
                    *place = rounded(LARGEST * value);
                }
            }
            let weights = weights.iter().zip(steepest).zip(OF_INPUTS);
            for (lane, ((weight, most), of_input)) in all_slopes.iter_mut().zip(weights) {
                let per_slope = step * number(*weight) * LARGEST / most;
                let places = lane.iter_mut().skip(nth).step_by(FIRST);
                for (parity, place) in places.take(IMAGES).enumerate() {
                    *place = rounded(per_slope * slopes[(parity ^ of_input) % IMAGES]);
                }
            }
        }
        let mut units = [UNIT; 1 + INPUTS];
        for (unit, most) in units.iter_mut().skip(1).zip(steepest) {
            *unit *= most;
        }
        units
    }

    /// Gives outputs their steps, and their biases if they are values.
    fn scale(&self, outputs: &mut Motion, are_values: bool) {
        for (output, scale) in outputs.iter_mut().zip(self.scales) {
            let (bias, step, _) = parts(scale);
            *output = step * *output + if are_values { bias } else { 0.0 };
        }
    }
}

/// The sums of a row's products with the nth four of values and slopes, by parity.
#[inline(always)]
fn sums(weights: &[Number], hidden: &Hidden, nth: usize) -> [Images; 4] {
    let mut sums = [Images::default(); 4];
    let four = hidden.as_chunks::<4>().0.get(nth);
    let four = four.map_or(&[][..], |four| four.as_flattened());
    for (parity, weights) in weights.as_chunks::<FIRST>().0.iter().enumerate() {
        let numbers = four.get(parity * FIRST..).unwrap_or_default();
        for (sums, sum) in sums.iter_mut().zip(products(weights, numbers)) {
            if let Some(place) = sums.get_mut(parity) {
                *place = short(sum);
            }
        }
    }
    sums
}

/// A channel of the first layer: means over the images, with the signs of each parity, of its
/// values and of the slopes of its function.
fn channel((bias, step, weights): Row<'_>, inputs: &[f32; INPUTS]) -> [Images; 2] {
    let mut sums = Images::default();
    sums[0] = bias;
    for ((weight, input), parity) in weights.iter().zip(inputs).zip(OF_INPUTS) {
        sums[parity % IMAGES] += step * number(*weight) * input;
    }
    let bent = mixed(sums).map(bent);
    let [values, slopes] = [bent.map(|[value, _]| value), bent.map(|[_, slope]| slope)];
    [values, slopes].map(|images| mixed(images.map(|image| image / IMAGES as f32)))
}

/// From parities to images, and from images to sums of each parity.
fn mixed([a, b, c, d, e, f, g, h]: Images) -> Images {
    let [i, j, k, l] = mixed_four([a + e, b + f, c + g, d + h]);
    let [m, n, o, p] = mixed_four([a - e, b - f, c - g, d - h]);
    [i, j, k, l, m, n, o, p]
}

/// The first four of these sums.
fn evened([a, b, c, d, e, f, g, h]: Images) -> [f32; PARITIES] {
    mixed_four([a + e, b + f, c + g, d + h])
}

fn mixed_four([a, b, c, d]: [f32; PARITIES]) -> [f32; PARITIES] {
    [a + b + c + d, a - b + c - d, a + b - c - d, a - b - c + d]
}

/// Adds a channel's values to all outputs.
fn add(outputs: &mut Motion, weights: &Motion, values: [f32; PARITIES]) {
    let weights = weights.as_chunks::<OUTPUTS>().0;
    let outputs = outputs.as_chunks_mut::<OUTPUTS>().0.iter_mut();
    for ((outputs, weights), value) in outputs.zip(weights).zip(values) {
        for (output, weight) in outputs.iter_mut().zip(weights) {
            *output += weight * value;
        }
    }
}

/// The motion of all markers, from the outputs by parity.
fn of_markers(outputs: &Motion) -> Motion {
    let mut motion = Motion::default();
    for (at, (kind, image)) in motion.as_chunks_mut().0.iter_mut().zip(OF_MARKERS) {
        let outputs = outputs.as_chunks::<OUTPUTS>().0;
        for (parity, [x, y, left, top]) in outputs.iter().enumerate() {
            let (along_x, along_y) = match kind {
                Kind::Corner => (*x, *y),
                Kind::Left if parity & 2 == 0 => (*left, 0.0),
                Kind::Left => (0.0, *left),
                Kind::Top if parity & 1 == 0 => (0.0, *top),
                Kind::Top => (*top, 0.0),
            };
            // A mirrored marker moves the other way.
            let sign =
                |way: usize| 1.0 - 2.0 * (((parity & image).count_ones() + way as u32) % 2) as f32;
            let [sum_x, sum_y]: &mut [f32; 2] = at;
            *sum_x += sign(image & 1) * along_x;
            *sum_y += sign(image >> 1) * along_y;
        }
    }
    motion
}

/// Bias, step and weights of an output.
type Row<'a> = (f32, f32, &'a [Number]);

fn parts(row: &[u8]) -> Row<'_> {
    let (words, _) = row.as_chunks::<4>();
    let word = |nth: usize| f32::from_le_bytes(words.get(nth).copied().unwrap_or_default());
    let weights = row.get(8..).unwrap_or_default();
    (word(0), word(1), weights.as_chunks().0)
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
