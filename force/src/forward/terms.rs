//! The polynomials in size and tilt that the answer of a film at one place is a sum of.

/// Terms of a set at most.
pub const MOST_TERMS: usize = 88;
/// Sizes of a group at most.
pub const MOST_SIZES: usize = 8;
/// Degrees of tilt, with that of none.
pub const MOST_TILTS: usize = 5;
/// Groups of a set at most.
pub const MOST_GROUPS: usize = MOST_TILTS * (MOST_TILTS + 1) / 2;

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

/// The powers of one part of a tilt, in parts of the largest.
#[derive(Clone, Copy, Debug)]
pub struct Powers {
    /// a^j.
    values: [f32; MOST_TILTS],
    /// Their slopes, 1/rad.
    slopes: [f32; MOST_TILTS],
}

/// What terms with a tilt are, by group: a^j·b^k, and its slopes by the tilt along x and y, 1/rad.
#[derive(Clone, Copy, Debug)]
pub struct Tilts(pub [[f32; 3]; MOST_GROUPS]);

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

    /// How many groups there are, up to the last of which there is a term.
    pub fn groups(&self) -> usize {
        let last = self.sizes.iter().rposition(|sizes| *sizes > 0);
        last.map_or(0, |degree| (degree + 1) * (degree + 2) / 2)
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

impl Powers {
    /// Of one part of a tilt, rad.
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
    /// Of the powers of both parts of a tilt.
    pub fn of(x: &Powers, y: &Powers) -> Tilts {
        let mut tilts = Tilts([[0.0; 3]; MOST_GROUPS]);
        let mut groups = tilts.0.iter_mut();
        for degree in 0..MOST_TILTS {
            for (k, group) in (0..=degree).zip(&mut groups) {
                let j = degree - k;
                *group = [
                    x.values[j] * y.values[k],
                    x.slopes[j] * y.values[k],
                    x.values[j] * y.slopes[k],
                ];
            }
        }
        tilts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits {
        size: 0.63,
        tilt: 0.67,
    };

    fn at(tilt: [f32; 2]) -> Tilts {
        let [x, y] = tilt.map(|part| Powers::at(part, &LIMITS));
        Tilts::of(&x, &y)
    }

    #[test]
    fn groups_follow_the_degrees() {
        let terms = Terms::new([4, 3, 1, 0, 0]).unwrap();
        assert_eq!(terms.count(), 4 + 2 * 3 + 3);
        let sizes: std::vec::Vec<_> = terms.sizes_of_degrees().collect();
        assert_eq!(sizes, [(4, 1), (3, 2), (1, 3), (0, 4), (0, 5)]);
        assert_eq!(terms.groups(), 6);
        let values = at([0.335, 0.67]).0.map(|[value, ..]| value);
        assert_eq!(&values[..6], &[1.0, 0.5, 1.0, 0.25, 0.5, 1.0]);
        for wrong in [[9, 0, 0, 0, 0], [0; 5], [8, 8, 8, 8, 8], [255; 5]] {
            assert_eq!(Terms::new(wrong), None, "{wrong:?}");
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
            let beside = |step: f32| {
                let mut tilt = [0.3, -0.5];
                tilt[axis] += step;
                at(tilt).0
            };
            let (back, here, forth) = (beside(-step), beside(0.0), beside(step));
            for k in 0..MOST_GROUPS {
                let slope = (forth[k][0] - back[k][0]) / (2.0 * step);
                assert!(near(slope, here[k][1 + axis]), "{k}: {slope} {here:?}");
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
