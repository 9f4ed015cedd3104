//! Evaluates the polynomials in size and tilt whose sum is the film's answer at one place.

use crate::force::kernels::Factors;

/// Most terms of a set.
pub const MOST_TERMS: usize = 88;
/// Most sizes of a group.
pub const MOST_SIZES: usize = 8;
/// Number of degrees of tilt, degree 0 included.
pub const MOST_TILTS: usize = 5;
/// The powers j and k of the groups of even k: sorted by j + k, then by k.
pub const EVEN: [[usize; 2]; 9] = [
    [0, 0],
    [1, 0],
    [2, 0],
    [0, 2],
    [3, 0],
    [1, 2],
    [4, 0],
    [2, 2],
    [0, 4],
];
/// The same for odd k.
pub const ODD: [[usize; 2]; 6] = [[0, 1], [1, 1], [2, 1], [0, 3], [3, 1], [1, 3]];

/// A set of terms s·T_i(2s/s_max − 1)·a^j·b^k: Chebyshev polynomials of the size s, powers of the
/// tilt (a, b) in parts of the largest.
///
/// The number of sizes depends on the degree j + k of the tilt. Terms of one a^j·b^k are a *group*.
/// Groups are sorted by degree, and by falling j within a degree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terms {
    /// Number of sizes for each degree of tilt.
    sizes: [u8; MOST_TILTS],
}

/// The largest size and tilt (rad) of a film's loads, which scale the terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// The largest size.
    pub size: f32,
    /// The largest tilt, rad.
    pub tilt: f32,
}

/// The size's factors of the terms, s·T_i, and their slopes.
#[derive(Clone, Copy, Debug)]
pub struct Sizes([[f32; 2]; MOST_SIZES]);

/// The powers of one part of a tilt, relative to the largest.
#[derive(Clone, Copy, Debug)]
pub struct Powers {
    /// a^j.
    values: [f32; MOST_TILTS],
    /// The slopes of the powers, 1/rad.
    slopes: [f32; MOST_TILTS],
}

/// A function of size and tilt at one size.
#[derive(Clone, Copy, Debug)]
pub struct OfSize {
    /// The sum of each group over the size, and its slope by the size.
    sums: [[f32; 2]; EVEN.len()],
    /// Whether the groups are those of odd k.
    is_odd: bool,
}

/// The tilt's factors of the terms: a^j·b^k of the groups of even k and of odd k, and their slopes
/// by both parts of the tilt, 1/rad.
#[derive(Clone, Copy, Debug)]
pub struct Tilts {
    even: [[f32; 3]; EVEN.len()],
    odd: [[f32; 3]; ODD.len()],
}

impl Terms {
    /// Returns `None` if there are no terms or more than [`MOST_TERMS`], or a degree has more than
    /// [`MOST_SIZES`].
    pub fn new(sizes: [u8; MOST_TILTS]) -> Option<Terms> {
        let most = sizes.iter().max().map_or(0, |most| usize::from(*most));
        let terms = Terms { sizes };
        let count = terms.counts().iter().sum();
        let sound = most <= MOST_SIZES && (1..=MOST_TERMS).contains(&count);
        sound.then_some(terms)
    }

    /// Number of terms of even k, and of odd k.
    pub fn counts(&self) -> [usize; 2] {
        let of = |[j, k]: &[usize; 2]| self.sizes_of(j + k);
        [EVEN.iter().map(of).sum(), ODD.iter().map(of).sum()]
    }

    /// Number of sizes of a degree of tilt.
    #[inline]
    fn sizes_of(&self, degree: usize) -> usize {
        self.sizes.get(degree).copied().map_or(0, usize::from)
    }

    /// Makes `of_size` the function at one size with the coefficients `parts`: of the terms of odd
    /// k if it is odd, else of even k.
    #[inline]
    pub fn put(&self, mut parts: &[[u8; 4]], sizes: &Sizes, of_size: &mut OfSize) {
        let groups: &[[usize; 2]] = if of_size.is_odd { &ODD } else { &EVEN };
        for ([j, k], group) in groups.iter().zip(&mut of_size.sums) {
            let count = self.sizes_of(j + k);
            let (own, rest) = parts.split_at(count.min(parts.len()));
            parts = rest;
            *group = sum(own, sizes);
        }
    }
}

/// A sum of the size's factors, and its slope.
#[inline]
fn sum(parts: &[[u8; 4]], sizes: &Sizes) -> [f32; 2] {
    let mut sums = [0.0; 2];
    for (part, [value, slope]) in parts.iter().zip(&sizes.0) {
        let part = f32::from_le_bytes(*part);
        sums = [sums[0] + part * value, sums[1] + part * slope];
    }
    sums
}

impl OfSize {
    /// A function without coefficients, of odd k or of even k.
    pub fn new(is_odd: bool) -> OfSize {
        OfSize {
            sums: [[0.0; 2]; EVEN.len()],
            is_odd,
        }
    }

    /// The function under a tilt.
    #[inline]
    pub fn at(&self, tilts: &Tilts) -> Factors {
        let tilts: &[[f32; 3]] = if self.is_odd { &tilts.odd } else { &tilts.even };
        let mut sums = Factors::default();
        for ([value, slope], [whole, by_a, by_b]) in self.sums.iter().zip(tilts) {
            let products = [value * whole, slope * whole, value * by_a, value * by_b];
            for (sum, product) in sums.iter_mut().zip(products) {
                *sum += product;
            }
        }
        sums
    }
}

impl Sizes {
    /// The factors at a size ≥ 0.
    pub fn at(size: f32, limits: &Limits) -> Sizes {
        let rate = 2.0 / limits.size;
        let x = rate * size - 1.0;
        let (mut t, mut slopes) = ([1.0; MOST_SIZES], [0.0; MOST_SIZES]);
        (t[1], slopes[1]) = (x, 1.0);
        for i in 2..MOST_SIZES {
            t[i] = 2.0 * x * t[i - 1] - t[i - 2];
            slopes[i] = 2.0 * t[i - 1] + 2.0 * x * slopes[i - 1] - slopes[i - 2];
        }
        Sizes(core::array::from_fn(|i| {
            [size * t[i], t[i] + size * rate * slopes[i]]
        }))
    }
}

impl Powers {
    /// The powers of one part of a tilt, rad.
    pub fn at(part: f32, limits: &Limits) -> Powers {
        let by_largest = 1.0 / limits.tilt;
        let base = part * by_largest;
        let mut powers = Powers {
            values: [1.0; MOST_TILTS],
            slopes: [0.0; MOST_TILTS],
        };
        for j in 1..MOST_TILTS {
            powers.values[j] = powers.values[j - 1] * base;
            powers.slopes[j] = j as f32 * by_largest * powers.values[j - 1];
        }
        powers
    }
}

impl Tilts {
    /// The products of powers of both parts of a tilt. Compiled once, because the near memory is
    /// scarce.
    #[inline(never)]
    pub fn of(a: &Powers, b: &Powers) -> Tilts {
        let mut tilts = Tilts {
            even: [[0.0; 3]; EVEN.len()],
            odd: [[0.0; 3]; ODD.len()],
        };
        let even = EVEN.iter().zip(&mut tilts.even);
        for ([j, k], group) in even.chain(ODD.iter().zip(&mut tilts.odd)) {
            let (value, slope) = (power(&a.values, *j), power(&a.slopes, *j));
            let (other, other_slope) = (power(&b.values, *k), power(&b.slopes, *k));
            *group = [value * other, slope * other, value * other_slope];
        }
        tilts
    }
}

/// A power by its degree. The groups' degrees are below the number of powers.
#[inline]
fn power(of: &[f32; MOST_TILTS], degree: usize) -> f32 {
    of.get(degree).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const LIMITS: Limits = Limits {
        size: 0.63,
        tilt: 0.67,
    };

    const TERMS: [u8; MOST_TILTS] = [4, 3, 2, 1, 1];

    fn at(tilt: [f32; 2]) -> Tilts {
        let [a, b] = tilt.map(|part| Powers::at(part, &LIMITS));
        Tilts::of(&a, &b)
    }

    /// An even and an odd function.
    fn at_size(terms: &Terms, parts: [&[[u8; 4]]; 2], sizes: &Sizes) -> [OfSize; 2] {
        let mut both = [false, true].map(OfSize::new);
        for (of_size, parts) in both.iter_mut().zip(parts) {
            terms.put(parts, sizes, of_size);
        }
        both
    }

    fn parts(count: usize) -> Vec<[u8; 4]> {
        (0..count)
            .map(|k| (1.0 + k as f32).sin().to_le_bytes())
            .collect()
    }

    #[test]
    fn groups_follow_the_degrees() {
        let terms = Terms::new([4, 3, 1, 0, 0]).unwrap();
        assert_eq!(terms.counts(), [4 + 3 + 2, 3 + 1]);
        let tilts = at([0.335, 0.67]);
        assert_eq!(
            tilts.even.map(|[value, ..]| value)[..4],
            [1.0, 0.5, 0.25, 1.0]
        );
        assert_eq!(tilts.odd.map(|[value, ..]| value)[..2], [1.0, 0.5]);
        for wrong in [[9, 0, 0, 0, 0], [0; 5], [8, 8, 8, 8, 8], [255; 5]] {
            assert_eq!(Terms::new(wrong), None, "{wrong:?}");
        }
    }

    /// Every a^j·b^k up to the fourth degree is in exactly one group.
    #[test]
    fn groups_are_all_there_are() {
        let mut all: Vec<_> = EVEN.iter().chain(&ODD).map(|[j, k]| (j + k, *k)).collect();
        all.sort_unstable();
        let every: Vec<_> = (0..MOST_TILTS)
            .flat_map(|degree| (0..=degree).map(move |k| (degree, k)))
            .collect();
        assert_eq!(all, every);
        assert!(EVEN.iter().all(|[_, k]| k % 2 == 0) && ODD.iter().all(|[_, k]| k % 2 == 1));
    }

    #[test]
    fn slopes_are_the_values_differences() {
        let near =
            |slope: f32, reported: f32| (slope - reported).abs() < 2e-2 * (1.0 + reported.abs());
        let terms = Terms::new(TERMS).unwrap();
        let [even, odd] = terms.counts().map(parts);
        let functions = |[size, a, b]: [f32; 3]| {
            let (sizes, tilts) = (Sizes::at(size, &LIMITS), at([a, b]));
            at_size(&terms, [&even, &odd], &sizes).map(|of_size| of_size.at(&tilts))
        };
        let here = [0.4, 0.3, -0.5];
        for axis in 0..3 {
            let step = 1e-2;
            let [mut back, mut forth] = [here; 2];
            back[axis] -= step;
            forth[axis] += step;
            let (back, forth, reported) = (functions(back), functions(forth), functions(here));
            for k in [0, 1] {
                let slope = (forth[k][0] - back[k][0]) / (2.0 * step);
                assert!(
                    near(slope, reported[k][1 + axis]),
                    "{axis}: {slope} {reported:?}"
                );
            }
        }
    }

    /// Mirroring the tilt at its first axis keeps functions of even k, and negates those of odd k.
    #[test]
    fn a_mirror_turns_odd_functions() {
        let terms = Terms::new(TERMS).unwrap();
        let [even, odd] = terms.counts().map(parts);
        let sizes = Sizes::at(0.4, &LIMITS);
        let both = [0.2, -0.2].map(|b| {
            let tilts = at([0.3, b]);
            at_size(&terms, [&even, &odd], &sizes).map(|of_size| of_size.at(&tilts))
        });
        let [[even, odd], [other_even, other_odd]] = both;
        for (k, turned) in [1.0, 1.0, 1.0, -1.0].into_iter().enumerate() {
            assert_eq!(even[k], turned * other_even[k]);
            assert_eq!(odd[k], -turned * other_odd[k]);
        }
    }

    #[test]
    fn without_size_there_is_nothing_but_slopes() {
        let Sizes(sizes) = Sizes::at(0.0, &LIMITS);
        assert!(sizes.iter().all(|[value, _]| *value == 0.0));
        assert_eq!(sizes[0][1], 1.0);
    }
}
