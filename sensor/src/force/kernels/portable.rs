//! Defines every kernel, in portable Rust.

use super::{APART, Factors, Number, Parts, Sums};
use crate::force::layer::{Layer, MAX_WIDTH};
use crate::force::packing::{ROWS_TOGETHER, WeightWidth, unpack8, unpack16};
use crate::force::rescale::rescale_sum;
use hivtac_terms::fixed::Q;

/// Σ w_ji·x_i of every row j of a layer. [`Model::parse`](crate::force::model::Model::parse) proves
/// that it fits, in any order of summation. Not inlined into the kernel's section, which is in the
/// near memory.
#[cfg_attr(armv7em, inline(never))]
pub fn multiply(layer: &Layer<'_>, inputs: &[i16; MAX_WIDTH], sums: &mut Sums) {
    match layer.weight_width() {
        WeightWidth::Int8 => sum_groups(layer, inputs, sums, unpack8),
        WeightWidth::Int16 => sum_groups(layer, inputs, sums, unpack16),
    }
}

/// The sums of the products of one vector's numbers with those of each of four vectors, which begin
/// [`APART`] numbers after each other. Numbers beyond the end count as zero. Not inlined, as
/// [`multiply`].
#[cfg_attr(armv7em, inline(never))]
pub fn products(one: &[Number], four: &[Number]) -> [i64; 4] {
    [0, 1, 2, 3].map(|nth| {
        let other = four.get(nth * APART..).unwrap_or_default();
        let pairs = one.iter().zip(other);
        pairs.fold(0, |sum, (a, b)| {
            let [a, b] = [a, b].map(|part| i32::from(i16::from_le_bytes(*part)));
            sum + i64::from(a * b)
        })
    })
}

/// Sums all terms times their factors. Returns the value, its slopes by size and tilt, by their own
/// factors, and its slopes along x and y.
///
/// A term is the weighted sum of its coefficients at four by four nodes, times 2¹⁴: a value, a
/// slope along x and a slope along y. A coefficient is an i16. Neighbours along x are adjacent in
/// memory, those along y `line` bytes apart, and the next term begins `node` bytes later.
/// Coefficients beyond the end count as zero.
///
/// Let the absolute weights add up to at most 2¹⁵ + 4. Then a sum along x is below 2¹⁵ · (2¹⁵ + 4)
/// < 2³¹. One over both axes is below 2¹⁵ · (2¹⁵ + 4)² / 2¹⁶ + 4 < 2³⁰. Both hold for any
/// coefficients. Not inlined, as [`multiply`].
#[cfg_attr(armv7em, inline(never))]
pub fn spline(
    steps: &[u8],
    line: usize,
    node: usize,
    parts: &Parts,
    factors: &[Factors],
) -> [f32; 6] {
    let mut sums = [0.0; 6];
    for (term, [whole, by_size, by_a, by_b]) in factors.iter().enumerate() {
        let [here, along_x, along_y] =
            around(steps, term * node, line, parts).map(|sum| sum.bits() as f32);
        let products = [
            here * whole,
            here * by_size,
            here * by_a,
            here * by_b,
            along_x * whole,
            along_y * whole,
        ];
        for (sum, product) in sums.iter_mut().zip(products) {
            *sum += product;
        }
    }
    sums
}

/// A term whose coefficients begin at `at`: its value, its slope along x and its slope along y.
fn around(steps: &[u8], at: usize, line: usize, parts: &Parts) -> [Q<14>; 3] {
    let times = |sum: Q<15>, part: Q<15, i16>| {
        let product: Q<30, i64> = Q::from_bits(i64::from(sum.bits()) * i64::from(part.bits()));
        product.floor_to().narrowed()
    };
    let mut sums = [Q::default(); 3];
    for (j, [value, slope]) in parts.y.into_iter().enumerate() {
        let row = four(steps, at + j * line);
        let [here, along_x] = parts.x.map(|parts| {
            let products = row.iter().zip(parts);
            products.fold(Q::default(), |sum, (step, part)| {
                sum + Q::from_bits(i32::from(*step) * i32::from(part.bits()))
            })
        });
        sums[0] += times(here, value);
        sums[1] += times(along_x, value);
        sums[2] += times(here, slope);
    }
    sums
}

fn four(steps: &[u8], at: usize) -> [i16; 4] {
    let bytes = steps.get(at..).and_then(|rest| rest.first_chunk::<8>());
    let pairs = bytes.unwrap_or(&[0; 8]).as_chunks().0;
    [0, 1, 2, 3].map(|i| i16::from_le_bytes(pairs[i]))
}

/// Sums rows by groups. `unpack` returns the N weights of a word.
fn sum_groups<const N: usize>(
    layer: &Layer<'_>,
    inputs: &[i16; MAX_WIDTH],
    sums: &mut Sums,
    unpack: impl Fn([u8; 4]) -> [i16; N],
) {
    let (columns, _) = inputs.as_chunks::<N>();
    let (sums, _) = sums.as_chunks_mut::<ROWS_TOGETHER>();
    for (group, sums) in layer.groups().zip(sums) {
        *sums = [0; ROWS_TOGETHER];
        for (words, x) in group.iter().zip(columns) {
            for (sum, word) in sums.iter_mut().zip(words) {
                let products = unpack(*word).into_iter().zip(x);
                *sum += products
                    .map(|(w, &x)| i32::from(w) * i32::from(x))
                    .sum::<i32>();
            }
        }
    }
}

/// clamp(rescale(acc_j, m_j, s_j), 0, A) of every row j of a hidden layer, from row `first` on.
pub fn activate(layer: &Layer<'_>, sums: &Sums, activations: &mut [i16; MAX_WIDTH], first: usize) {
    let largest = i32::from(layer.largest_activation());
    let rows = layer.rows().zip(sums).zip(activations).skip(first);
    for ((row, sum), activation) in rows {
        let value = rescale_sum(sum + row.bias, row.multiplier, row.shift);
        *activation = value.clamp(0, largest) as i16;
    }
}
