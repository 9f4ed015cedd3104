//! Stores the uncertainty of a model's forces and places: standard uncertainties over |F|,
//! interpolated linearly between knots.
//!
//! A standard uncertainty σ is chosen such that 95 of 100 errors are within the 95 % bound of a
//! normal distribution of that σ. The angle between true and found force is within
//! [`DIRECTION_BOUND`] · σ of the direction (two dimensions across the force), |F| within
//! [`MAGNITUDE_BOUND`] · σ of |F|. Errors have long tails, so σ is not their root mean square.

use super::{ModelError, reader::Reader};
#[cfg(any(test, feature = "encode"))]
use alloc::vec::Vec;
use hivtac_terms::units::{MicroNewtons, Micrometres, UnsignedMicroNewtons, UnsignedMilliDegrees};

/// The largest uncertainty at a knot; keeps sums and products within their types.
pub const LARGEST_UNCERTAINTY: MicroNewtons = MicroNewtons((1 << 30) - 1);
/// The largest uncertainty of a place at a knot: a metre.
pub const LARGEST_PLACE_UNCERTAINTY: Micrometres = Micrometres(1_000_000);
/// Beyond this the direction is unknown: half a turn.
pub(crate) const NO_DIRECTION: UnsignedMilliDegrees = UnsignedMilliDegrees(180_000);
/// The largest distance of knots: the last knot is then at 2,013 N.
const MAX_STEP_BITS: u8 = 27;

/// Standard uncertainties of a model's force, over |F|.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Uncertainty {
    /// The distance of knots is 2 to the power of this, in µN; 0–27.
    pub step_bits: u8,
    /// Knots at |F| = 0, one distance, two distances …. Beyond the last knot its values apply.
    pub knots: [UncertaintyKnot; Uncertainty::KNOTS],
}

/// Standard uncertainties at one |F|; those of forces are 0 to [`LARGEST_UNCERTAINTY`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct UncertaintyKnot {
    /// Uncertainty of the force's part across itself, in two dimensions. Divided by |F| it is the
    /// direction's uncertainty in radians.
    pub across: MicroNewtons,
    /// Uncertainty of |F|.
    pub along: MicroNewtons,
    /// Uncertainty of each coordinate of the place, at most [`LARGEST_PLACE_UNCERTAINTY`]; 0 if the
    /// model has no place outputs.
    pub place: Micrometres,
}

impl Uncertainty {
    /// Number of knots.
    pub const KNOTS: usize = 16;

    /// The same uncertainties at every |F|.
    pub const fn constant(knot: UncertaintyKnot) -> Uncertainty {
        Uncertainty {
            step_bits: 0,
            knots: [knot; Self::KNOTS],
        }
    }

    /// The standard uncertainties of the direction (at most 180°) and of |F|, at this |F| ≥ 0.
    pub fn at(&self, magnitude: MicroNewtons) -> (UnsignedMilliDegrees, UnsignedMicroNewtons) {
        let knot = self.between(magnitude.0.max(0));
        let across = knot.across.0.unsigned_abs();
        let along = UnsignedMicroNewtons(knot.along.0.unsigned_abs());
        (angle(across, magnitude.0.max(0) as u32), along)
    }

    /// The standard uncertainty of each coordinate of the place, at this |F| ≥ 0.
    pub fn place_at(&self, magnitude: MicroNewtons) -> Micrometres {
        self.between(magnitude.0.max(0)).place
    }

    fn between(&self, magnitude: i32) -> UncertaintyKnot {
        let last = self.knots[Self::KNOTS - 1];
        let index = (magnitude >> self.step_bits) as usize;
        let Some([from, to]) = self.knots.get(index..index + 2) else {
            return last;
        };
        let part = i64::from(magnitude - ((index as i32) << self.step_bits));
        let half = (1 << self.step_bits) >> 1;
        // At most 2³⁰ · 2²⁷, and the result lies between both ends.
        let mix = |from: i32, to: i32| {
            let rise = i64::from(to - from);
            from + ((rise * part + half) >> self.step_bits) as i32
        };
        // Places are below 2³⁰ µm, too.
        let place = mix(from.place.0 as i32, to.place.0 as i32);
        UncertaintyKnot {
            across: MicroNewtons(mix(from.across.0, to.across.0)),
            along: MicroNewtons(mix(from.along.0, to.along.0)),
            place: Micrometres(place.unsigned_abs()),
        }
    }

    #[cfg(any(test, feature = "encode"))]
    pub(super) fn push(&self, bytes: &mut Vec<u8>) {
        bytes.extend([self.step_bits, 0, 0, 0]);
        for knot in &self.knots {
            bytes.extend(knot.across.0.to_le_bytes());
            bytes.extend(knot.along.0.to_le_bytes());
        }
    }
}

/// across / whole as an angle, rounded to nearest, at most 180°; across < 2³⁰, whole < 2³¹.
///
/// From 33 mN across, both lose their last bits. That changes the angle by less than 3.1 · 10⁻⁴
/// relative and keeps sums within 32 bits.
fn angle(across: u32, whole: u32) -> UnsignedMilliDegrees {
    /// A radian in m°, exact to 4 · 10⁻⁶ relative.
    const RADIAN: u32 = 57_296;
    let excess = 17_u32.saturating_sub(across.leading_zeros());
    let (across, whole) = (across >> excess, whole >> excess);
    // Four radians are more than half a turn.
    if whole == 0 || across / 4 >= whole {
        return NO_DIRECTION;
    }
    // 2¹⁵ · 57,296 + 2³⁰ < 2³².
    let angle = (across * RADIAN + whole / 2) / whole;
    UnsignedMilliDegrees(angle).min(NO_DIRECTION)
}

pub(super) fn uncertainty(reader: &mut Reader<'_>) -> Result<Uncertainty, ModelError> {
    let step_bits = reader.u8_in("distance of uncertainties", MAX_STEP_BITS, "0 to 27")?;
    for _ in 0..3 {
        reader.zero("reserved byte")?;
    }
    let mut value = || {
        let value = reader.i32_in("uncertainty", LARGEST_UNCERTAINTY.0, "0 to 1073741823");
        value.map(MicroNewtons)
    };
    let mut knots = [UncertaintyKnot::default(); Uncertainty::KNOTS];
    for knot in &mut knots {
        knot.across = value()?;
        knot.along = value()?;
    }
    Ok(Uncertainty { step_bits, knots })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn knot(across: i32, along: i32) -> UncertaintyKnot {
        UncertaintyKnot {
            across: MicroNewtons(across),
            along: MicroNewtons(along),
            place: Micrometres(0),
        }
    }

    /// Knots at 0, 1,024 µN, 2,048 µN … with values that begin at `from` and grow by `rise`.
    fn growing(from: i32, rise: i32) -> Uncertainty {
        Uncertainty {
            step_bits: 10,
            knots: core::array::from_fn(|i| knot(from + rise * i as i32, 3 * i as i32)),
        }
    }

    #[test]
    fn between_knots_it_is_interpolated_and_beyond_constant() {
        let table = growing(100, 10);
        for (magnitude, across, along) in [
            (0, 100, 0),
            (1024, 110, 3),
            (1536, 115, 5),
            (15 * 1024 - 1, 250, 45),
            (15 * 1024, 250, 45),
            (i32::MAX, 250, 45),
        ] {
            assert_eq!(table.between(magnitude), knot(across, along), "{magnitude}");
        }
        let falling = growing(1000, -60);
        assert_eq!(falling.between(1536), knot(910, 5));
    }

    #[test]
    fn a_place_is_interpolated_rising_and_falling() {
        let place = |knots: [u32; 3], magnitude: i32| {
            let mut table = Uncertainty::constant(knot(0, 0));
            table.step_bits = 10;
            for (knot, place) in table.knots.iter_mut().zip(knots) {
                knot.place = Micrometres(place);
            }
            table.place_at(MicroNewtons(magnitude)).0
        };
        assert_eq!(place([900, 100, 300], 0), 900);
        assert_eq!(place([900, 100, 300], 512), 500);
        assert_eq!(place([900, 100, 300], 1024 + 256), 150);
        assert_eq!(place([LARGEST_PLACE_UNCERTAINTY.0, 0, 0], 1), 999_023);
        assert_eq!(place([900, 100, 300], i32::MAX), 0);
    }

    #[test]
    fn directions_are_known_up_to_half_a_turn() {
        let at = |across: i32, magnitude: i32| {
            let (direction, _) = Uncertainty::constant(knot(across, 0)).at(MicroNewtons(magnitude));
            direction.0
        };
        assert_eq!(at(1000, 0), 180_000);
        assert_eq!(at(0, 0), 180_000, "nothing has no direction, however exact");
        assert_eq!(at(0, 1), 0);
        assert_eq!(at(1000, 318), 180_000, "180.2°");
        assert_eq!(at(1000, 319), 179_611);
        assert_eq!(at(1000, 57_296_000), 1);
        assert_eq!(at(LARGEST_UNCERTAINTY.0, 1), 180_000);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn it_is_what_exact_arithmetic_says(
            values in prop::array::uniform16(
                (0..=LARGEST_UNCERTAINTY.0, 0..=LARGEST_UNCERTAINTY.0),
            ),
            (shift, step_bits, magnitude) in (0..30_u32, 0..=MAX_STEP_BITS, 0..=i32::MAX),
            magnitude_shift in 0..31_u32,
        ) {
            let magnitude = magnitude >> magnitude_shift;
            let knots = values.map(|(across, along)| knot(across >> shift, along >> shift));
            let (direction, along) = Uncertainty { step_bits, knots }.at(MicroNewtons(magnitude));
            let place = f64::from(magnitude) / f64::from(1_u32 << step_bits);
            let (index, part) = (place.floor(), place.fract());
            let mixed = |of: fn(&UncertaintyKnot) -> MicroNewtons| {
                let knot = |i: f64| f64::from(of(&knots[i.min(15.0) as usize]).0);
                knot(index) + part * (knot(index + 1.0) - knot(index))
            };
            prop_assert!((f64::from(along.0) - mixed(|knot| knot.along)).abs() <= 0.5 + 1e-6);
            let across = mixed(|knot| knot.across);
            if magnitude == 0 {
                prop_assert_eq!(direction, NO_DIRECTION);
                return Ok(());
            }
            // Half a µN by interpolation, half an m° by rounding, and the bits that are cut off.
            let degrees = |of: f64| (of / f64::from(magnitude)).to_degrees() * 1e3;
            let (found, exact) = (f64::from(direction.0), degrees(across).min(180_000.0));
            let slack = degrees(0.5) + 0.51 + 3.1e-4 * exact;
            prop_assert!((found - exact).abs() <= slack, "{found} {exact}");
        }
    }
}
