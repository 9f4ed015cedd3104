//! The polynomials in size and tilt that the answer of a film at one place is a sum of.

/// Terms of a set at most.
pub const MOST_TERMS: usize = 88;
/// Sizes of a group at most.
pub const MOST_SIZES: usize = 8;
/// Degrees of tilt, with that of none.
pub const MOST_TILTS: usize = 5;
/// Groups of a set at most.
const MOST_GROUPS: usize = MOST_TILTS * (MOST_TILTS + 1) / 2;

/// A set of terms s·T_i(2s/s_max − 1)·a^j·b^k: Chebyshev polynomials of the size s, powers of the
/// tilt (a, b) in parts of the largest.
///
/// There are so many sizes without tilt, so many with each a^j·b^k of the first degree, and so on.
/// Terms of one a^j·b^k are a *group*: degrees one after the other, in each j falling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Terms {
    /// For each degree of tilt.
    sizes: [u8; MOST_TILTS],
    count: u8,
}

/// The largest size and tilt (rad) of a film's loads: what its terms are scaled by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// The largest size.
    pub size: f32,
    /// The largest tilt, rad.
    pub tilt: f32,
}

/// What terms with a size are, and their slopes by it.
#[derive(Clone, Copy, Debug)]
pub struct Sizes {
    /// s·T_i.
    pub values: [f32; MOST_SIZES],
    /// Their slopes.
    pub slopes: [f32; MOST_SIZES],
}

/// What terms with a tilt are, by group, and their slopes by the tilt along x and y, 1/rad.
#[derive(Clone, Copy, Debug)]
pub struct Tilts {
    /// a^j·b^k.
    pub values: [f32; MOST_GROUPS],
    /// Their slopes.
    pub slopes: [[f32; 2]; MOST_GROUPS],
}

impl Terms {
    /// `None` when it would be none or more than [`MOST_TERMS`].
    pub fn new(sizes: [u8; MOST_TILTS]) -> Option<Terms> {
        let most = sizes.iter().max().map_or(0, |most| usize::from(*most));
        let of_degree = |(sizes, groups): (&u8, usize)| usize::from(*sizes) * groups;
        let count: usize = sizes.iter().zip(1..).map(of_degree).sum();
        let sound = most <= MOST_SIZES && (1..=MOST_TERMS).contains(&count);
        sound.then_some(Terms {
            sizes,
            count: count as u8,
        })
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count.into()
    }

    /// For each degree of tilt how many sizes its groups have, and how many groups it has.
    pub fn sizes_of_degrees(&self) -> impl Iterator<Item = (usize, usize)> {
        self.sizes.iter().map(|sizes| usize::from(*sizes)).zip(1..)
    }
}

impl Sizes {
    /// At a size ≥ 0.
    pub fn at(size: f32, limits: &Limits) -> Sizes {
        let rate = 2.0 / limits.size;
        let x = rate * size - 1.0;
        let (mut t, mut slopes) = ([1.0; MOST_SIZES], [0.0; MOST_SIZES]);
        (t[1], slopes[1]) = (x, 1.0);
        for i in 2..MOST_SIZES {
            t[i] = 2.0 * x * t[i - 1] - t[i - 2];
            slopes[i] = 2.0 * t[i - 1] + 2.0 * x * slopes[i - 1] - slopes[i - 2];
        }
        Sizes {
            values: t.map(|t| size * t),
            slopes: core::array::from_fn(|i| t[i] + size * rate * slopes[i]),
        }
    }
}

impl Tilts {
    /// At a tilt, rad.
    pub fn at(tilt: [f32; 2], limits: &Limits) -> Tilts {
        let by_largest = 1.0 / limits.tilt;
        let [x, y] = tilt.map(|part| powers(part * by_largest));
        let slope = |powers: &[f32; MOST_TILTS], j: usize| match j {
            0 => 0.0,
            _ => j as f32 * by_largest * powers[j - 1],
        };
        let mut tilts = Tilts {
            values: [0.0; MOST_GROUPS],
            slopes: [[0.0; 2]; MOST_GROUPS],
        };
        let mut groups = tilts.values.iter_mut().zip(&mut tilts.slopes);
        for degree in 0..MOST_TILTS {
            for (k, (value, slopes)) in (0..=degree).zip(&mut groups) {
                let j = degree - k;
                *value = x[j] * y[k];
                *slopes = [slope(&x, j) * y[k], x[j] * slope(&y, k)];
            }
        }
        tilts
    }

    /// The same seen in a mirror: x and y by these signs.
    pub fn mirrored(&self, [sx, sy]: [f32; 2]) -> Tilts {
        let mut tilts = *self;
        let mut groups = tilts.values.iter_mut().zip(&mut tilts.slopes);
        let mut signs = [1.0; MOST_TILTS];
        for degree in 0..MOST_TILTS {
            for (sign, (value, slopes)) in signs[..=degree].iter().zip(&mut groups) {
                *value *= sign;
                *slopes = [sign * sx * slopes[0], sign * sy * slopes[1]];
            }
            // Those of the next degree: one more a, and for the last one more b.
            if degree + 1 < MOST_TILTS {
                signs[degree + 1] = sy * signs[degree];
                signs[..=degree].iter_mut().for_each(|sign| *sign *= sx);
            }
        }
        tilts
    }
}

fn powers(base: f32) -> [f32; MOST_TILTS] {
    let mut powers = [1.0; MOST_TILTS];
    for j in 1..MOST_TILTS {
        powers[j] = powers[j - 1] * base;
    }
    powers
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits {
        size: 0.63,
        tilt: 0.67,
    };

    #[test]
    fn groups_follow_the_degrees() {
        let terms = Terms::new([4, 3, 1, 0, 0]).unwrap();
        assert_eq!(terms.count(), 4 + 2 * 3 + 3);
        let sizes: std::vec::Vec<_> = terms.sizes_of_degrees().collect();
        assert_eq!(sizes, [(4, 1), (3, 2), (1, 3), (0, 4), (0, 5)]);
        let tilts = Tilts::at([0.335, 0.67], &LIMITS);
        assert_eq!(&tilts.values[..6], &[1.0, 0.5, 1.0, 0.25, 0.5, 1.0]);
        for wrong in [[9, 0, 0, 0, 0], [0; 5], [8, 8, 8, 8, 8], [255; 5]] {
            assert_eq!(Terms::new(wrong), None, "{wrong:?}");
        }
    }

    #[test]
    fn mirrors_turn_signs() {
        for signs in [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]] {
            let [sx, sy] = signs;
            let (seen, own) = (
                Tilts::at([0.3 * sx, -0.5 * sy], &LIMITS),
                Tilts::at([0.3, -0.5], &LIMITS).mirrored(signs),
            );
            assert_eq!(
                (seen.values, seen.slopes),
                (own.values, own.slopes),
                "{signs:?}"
            );
        }
    }

    #[test]
    fn slopes_are_the_values_differences() {
        let near = |slope: f32, told: f32| (slope - told).abs() < 2e-2 * (1.0 + told.abs());
        let step = 1e-2;
        let [back, here, forth] = [-step, 0.0, step].map(|step| Sizes::at(0.4 + step, &LIMITS));
        for i in 0..MOST_SIZES {
            let slope = (forth.values[i] - back.values[i]) / (2.0 * step);
            assert!(near(slope, here.slopes[i]), "{i}: {slope} {here:?}");
        }
        for axis in [0, 1] {
            let at = |step: f32| {
                let mut tilt = [0.3, -0.5];
                tilt[axis] += step;
                Tilts::at(tilt, &LIMITS)
            };
            let (back, here, forth) = (at(-step), at(0.0), at(step));
            for k in 0..MOST_GROUPS {
                let slope = (forth.values[k] - back.values[k]) / (2.0 * step);
                assert!(near(slope, here.slopes[k][axis]), "{k}: {slope} {here:?}");
            }
        }
    }

    #[test]
    fn without_size_there_is_nothing_but_slopes() {
        let sizes = Sizes::at(0.0, &LIMITS);
        assert_eq!(sizes.values, [0.0; MOST_SIZES]);
        assert_eq!(sizes.slopes[0], 1.0);
    }
}
