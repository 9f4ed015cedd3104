//! Pictures that are hard for the sensing: RGB565 with red in bits 15–11, row by row.

use std::vec::Vec;

/// A pixel that the usual threshold accepts.
pub const RED: u16 = 0xf800;
/// A pixel that it rejects.
pub const BLACK: u16 = 0;

/// Returns a picture that is red where `red(x, y)` is true.
pub fn painted(width: u16, height: u16, red: impl Fn(u16, u16) -> bool) -> Vec<u16> {
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| if red(x, y) { RED } else { BLACK })
        .collect()
}

/// Returns a picture of one colour.
pub fn plain(width: u16, height: u16, pixel: u16) -> Vec<u16> {
    std::vec![pixel; usize::from(width) * usize::from(height)]
}

/// Every second pixel is red: the largest possible number of runs in a row.
pub fn checkerboard(width: u16, height: u16) -> Vec<u16> {
    painted(width, height, |x, y| (x + y) % 2 == 0)
}

/// Every second column is red: the largest possible number of separate runs.
pub fn stripes(width: u16, height: u16) -> Vec<u16> {
    painted(width, height, |x, _| x % 2 == 0)
}

/// Discs of one radius on all four borders, in all corners and in the middle.
pub fn discs_on_borders(width: u16, height: u16, radius: i32) -> Vec<u16> {
    let (right, low) = (i32::from(width) - 1, i32::from(height) - 1);
    let (xs, ys) = ([0, right / 2, right], [0, low / 2, low]);
    painted(width, height, |x, y| {
        let near = |centre: i32, at: u16| (i32::from(at) - centre).pow(2);
        xs.iter().any(|&cx| {
            ys.iter()
                .any(|&cy| near(cx, x) + near(cy, y) <= radius * radius)
        })
    })
}

/// A comb whose teeth only join in the last row: many labels that become one.
pub fn comb(width: u16, height: u16) -> Vec<u16> {
    painted(width, height, |x, y| x % 2 == 0 || y == height - 1)
}

/// Every pixel has a random value.
pub fn noise(width: u16, height: u16, seed: u64) -> Vec<u16> {
    let mut random = Random::new(seed);
    (0..usize::from(width) * usize::from(height))
        .map(|_| random.next() as u16)
        .collect()
}

/// Returns the picture with red in `percent` of its pixels.
pub fn salted(mut pixels: Vec<u16>, percent: u64, seed: u64) -> Vec<u16> {
    let mut random = Random::new(seed);
    for pixel in pixels.iter_mut() {
        if random.next() % 100 < percent {
            *pixel = RED;
        }
    }
    pixels
}

/// Returns the picture with this number of single red pixels, none next to another.
pub fn specked(mut pixels: Vec<u16>, width: u16, specks: usize, seed: u64) -> Vec<u16> {
    let columns = usize::from(width) / 3;
    let cells = columns * (pixels.len() / usize::from(width) / 3);
    assert!(specks <= cells, "the picture holds {cells} specks");
    let mut free: Vec<usize> = (0..cells).collect();
    let mut random = Random::new(seed);
    for _ in 0..specks {
        let cell = free.swap_remove(random.next() as usize % free.len());
        let (x, y) = (3 * (cell % columns) + 1, 3 * (cell / columns) + 1);
        pixels[y * usize::from(width) + x] = RED;
    }
    pixels
}

/// SplitMix64: small, and the same on every machine.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// Returns the numbers of a seed.
    pub fn new(seed: u64) -> Random {
        Random(seed)
    }

    /// Returns the next number.
    #[allow(clippy::should_implement_trait)]
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Returns a number from `low` to `high`, both included.
    pub fn between(&mut self, low: i64, high: i64) -> i64 {
        let span = (high - low) as u64 + 1;
        low + (self.next() % span) as i64
    }
}
