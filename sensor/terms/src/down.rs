//! Defines which way the sensor is held: where gravity pulls on its film.

/// Gravity on a sensor, as far as known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub enum Down {
    /// Gravity is as when the rest position was taken: the sensor is never turned.
    #[default]
    Fixed,
    /// The sensor may be turned, in an unknown way.
    Unknown,
    /// Gravity pulls in this direction, set by the host.
    Told(Direction),
}

impl Down {
    /// The direction, if it was set by the host.
    pub fn direction(self) -> Option<Direction> {
        match self {
            Down::Told(direction) => Some(direction),
            Down::Fixed | Down::Unknown => None,
        }
    }
}

/// A direction in the film frame: x right and y down in the image, z away from the camera. A vector
/// of length 1 to 2 ‰, in thousandths.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct Direction(pub [i16; 3]);

/// Thousandths of a length of one.
const ONE: f32 = 1000.0;
/// Allowed square of the length: rounding changes each axis by at most half a thousandth.
const SQUARES: core::ops::RangeInclusive<i32> = 996_000..=1_004_000;

impl Direction {
    /// The direction of a vector of length 1.
    pub fn of_unit(vector: [f32; 3]) -> Direction {
        let rounded = |part: f32| (ONE * part + 0.5_f32.copysign(part)) as i16;
        Direction(vector.map(rounded))
    }

    /// Returns whether the length is 1, within the rounding.
    pub fn is_sound(self) -> bool {
        let squares = self
            .0
            .iter()
            .map(|part| i32::from(*part) * i32::from(*part));
        SQUARES.contains(&squares.fold(0, i32::saturating_add))
    }

    /// Returns the direction as a vector of length 1.
    pub fn to_unit(self) -> [f32; 3] {
        self.0.map(|part| f32::from(part) / ONE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_unit_vector_is_a_direction(angle in 0.0f64..6.3, z in -1.0f64..1.0) {
            let along = (1.0 - z * z).sqrt();
            let unit = [along * angle.cos(), along * angle.sin(), z].map(|part| part as f32);
            let direction = Direction::of_unit(unit);
            prop_assert!(direction.is_sound(), "{:?}", direction);
            for (a, b) in direction.to_unit().into_iter().zip(unit) {
                prop_assert!((a - b).abs() <= 5.01e-4);
            }
        }
    }

    #[test]
    fn a_vector_of_another_length_is_none() {
        assert!(!Direction([0; 3]).is_sound());
        assert!(!Direction([i16::MIN; 3]).is_sound());
        assert_eq!(Direction([600, 0, -800]).to_unit(), [0.6, 0.0, -0.8]);
    }
}
