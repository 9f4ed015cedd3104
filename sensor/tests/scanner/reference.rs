//! Computes what the scanner should find, pixel by pixel: dilation by definition, blobs by flood
//! fill, moments by summing.

use std::collections::HashSet;

use hivtac_sensor::markers::beside::Beside;
use hivtac_sensor::markers::blob::Blob;
use hivtac_sensor::markers::scanner::{Scan, ScanSettings, Scanner};

/// A whole frame's mask.
#[derive(Clone, Debug)]
pub struct Mask {
    pub width: usize,
    pub height: usize,
    bits: Vec<bool>,
    /// The bits before any dilation.
    passed: Vec<bool>,
}

impl Mask {
    pub fn from_bits(width: usize, bits: Vec<bool>) -> Mask {
        let height = bits.len() / width;
        Mask {
            width,
            height,
            passed: bits.clone(),
            bits,
        }
    }

    pub fn from_fn(width: usize, height: usize, set: impl Fn(usize, usize) -> bool) -> Mask {
        let pixels = (0..width * height).map(|i| set(i % width, i / width));
        Mask::from_bits(width, pixels.collect())
    }

    /// From lines of text; `#` is set.
    pub fn from_text(lines: &[&str]) -> Mask {
        let bits = lines
            .iter()
            .flat_map(|line| line.bytes().map(|byte| byte == b'#'));
        Mask::from_bits(lines[0].len(), bits.collect())
    }

    pub fn get(&self, x: usize, y: usize) -> bool {
        self.bits[y * self.width + x]
    }

    pub fn set_pixels(&self) -> u32 {
        self.bits.iter().filter(|bit| **bit).count() as u32
    }

    /// The 3×3 neighbourhood of a pixel, itself included, as far as it lies in the frame.
    fn around(&self, x: usize, y: usize) -> impl Iterator<Item = (usize, usize)> + use<> {
        let columns = x.saturating_sub(1)..(x + 2).min(self.width);
        let rows = y.saturating_sub(1)..(y + 2).min(self.height);
        rows.flat_map(move |y| columns.clone().map(move |x| (x, y)))
    }

    pub fn dilated(&self, times: u8) -> Mask {
        (0..times).fold(self.clone(), |mask, _| {
            let set = |x, y| mask.around(x, y).any(|(x, y)| mask.get(x, y));
            Mask {
                passed: mask.passed.clone(),
                ..Mask::from_fn(mask.width, mask.height, set)
            }
        })
    }

    /// The blobs in the scanner's order: by their lowest row, then by their first column in it.
    pub fn blobs(&self, min_area: u32) -> Vec<Blob> {
        self.weighted_blobs(min_area, |_, _| 0)
    }

    /// The same with weighed pixels.
    pub fn weighted_blobs(&self, min_area: u32, weight: impl Fn(usize, usize) -> u8) -> Vec<Blob> {
        let mut left = self.clone();
        let mut found = Vec::new();
        for i in 0..self.bits.len() {
            if left.bits[i] {
                let pixels = left.flood(i % self.width, i / self.width);
                let passed = |(x, y): &&(usize, usize)| self.passed[y * self.width + x];
                let blob = Blob {
                    passed: pixels.iter().filter(passed).count() as u32,
                    beside: beside(&pixels, self.width, &weight),
                    ..sum(&pixels, &weight)
                };
                found.push((order(&pixels), blob));
            }
        }
        found.sort_by_key(|(order, _)| *order);
        let blobs = found.into_iter().map(|(_, blob)| blob);
        blobs.filter(|blob| blob.area >= min_area).collect()
    }

    /// Removes the 8-connected pixels around a set one from the mask.
    fn flood(&mut self, x: usize, y: usize) -> Vec<(usize, usize)> {
        let mut pixels = vec![(x, y)];
        self.bits[y * self.width + x] = false;
        let mut done = 0;
        while let Some(&(x, y)) = pixels.get(done) {
            done += 1;
            for (x, y) in self.around(x, y) {
                if std::mem::take(&mut self.bits[y * self.width + x]) {
                    pixels.push((x, y));
                }
            }
        }
        pixels
    }

    /// Row `y` as words, bit i of word w for column 32·w + i.
    pub fn words(&self, y: usize) -> Vec<u32> {
        let mut words = vec![0; self.width.div_ceil(32)];
        for x in (0..self.width).filter(|x| self.get(*x, y)) {
            words[x / 32] |= 1 << (x % 32);
        }
        words
    }
}

fn order(pixels: &[(usize, usize)]) -> (usize, usize) {
    let lowest = pixels.iter().map(|(_, y)| *y).max().unwrap();
    let begins = pixels.iter().filter(|(_, y)| *y == lowest).map(|(x, _)| *x);
    (lowest, begins.min().unwrap())
}

fn sum(pixels: &[(usize, usize)], weight: impl Fn(usize, usize) -> u8) -> Blob {
    let weighed = |f: fn(u64, u64) -> u64| {
        let terms = pixels
            .iter()
            .map(|&(x, y)| u64::from(weight(x, y)) * f(x as u64, y as u64));
        terms.sum::<u64>()
    };
    let total = |f: fn(u64, u64) -> u64| pixels.iter().map(|&(x, y)| f(x as u64, y as u64)).sum();
    let columns = || pixels.iter().map(|(x, _)| *x as u16);
    let rows = || pixels.iter().map(|(_, y)| *y as u16);
    Blob {
        area: pixels.len() as u32,
        passed: pixels.len() as u32,
        sum_x: total(|x, _| x),
        sum_y: total(|_, y| y),
        sum_xx: total(|x, _| x * x),
        sum_xy: total(|x, y| x * y),
        sum_yy: total(|_, y| y * y),
        sum_xxx: total(|x, _| x * x * x),
        sum_xxy: total(|x, y| x * x * y),
        sum_xyy: total(|x, y| x * y * y),
        sum_yyy: total(|_, y| y * y * y),
        weight: weighed(|_, _| 1) as u32,
        weight_x: weighed(|x, _| x),
        weight_y: weighed(|_, y| y),
        x0: columns().min().unwrap(),
        y0: rows().min().unwrap(),
        x1: columns().max().unwrap(),
        y1: rows().max().unwrap(),
        beside: Beside::NONE,
    }
}

/// The weights two columns left and right of each run in an even row.
fn beside(pixels: &[(usize, usize)], width: usize, weight: impl Fn(usize, usize) -> u8) -> Beside {
    let inside: HashSet<_> = pixels.iter().copied().collect();
    let mut sums = Beside::NONE;
    for &(x, y) in pixels.iter().filter(|(_, y)| y % 2 == 0) {
        let mut add = |at: Option<usize>, sign: i32| {
            let at = at.filter(|at| *at < width);
            let weight = u32::from(at.map_or(0, |x| weight(x, y)));
            let pull = if weight > 64 { 0 } else { weight + weight / 2 };
            sums.both += pull;
            sums.right += sign * pull as i32;
            sums.by_row = sums.by_row.wrapping_add(pull * y as u32);
        };
        if x == 0 || !inside.contains(&(x - 1, y)) {
            add(x.checked_sub(2), -1);
        }
        if !inside.contains(&(x + 1, y)) {
            add(Some(x + 2), 1);
        }
    }
    sums
}

/// Settings that fit a mask.
pub fn settings(mask: &Mask, dilations: u8, min_area: u32) -> ScanSettings {
    ScanSettings {
        width: mask.width as u16,
        height: mask.height as u16,
        dilations,
        min_area,
        weighted: false,
        max_runs: u32::MAX,
        cleaned: false,
    }
}

/// Scans a whole mask.
pub fn scan<'a, const BLOBS: usize>(
    scanner: &'a mut Scanner<BLOBS>,
    mask: &Mask,
    dilations: u8,
    min_area: u32,
) -> Scan<'a> {
    scanner.begin(settings(mask, dilations, min_area)).unwrap();
    for y in 0..mask.height {
        scanner.push_mask_row(&mask.words(y));
    }
    scanner.finish(&())
}
