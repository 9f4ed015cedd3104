//! A force as JSON, the same for a sample of the device and for a picture.

use crate::decimal::{Millionths, Thousandths};
use hivtac_terms::force::Force;
use serde::Serialize;

/// Keys and values of `"force"`.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ForceJson {
    /// α, degrees.
    pub alpha_deg: Thousandths,
    /// β, degrees.
    pub beta_deg: Thousandths,
    /// |F|, N.
    pub magnitude_n: Millionths,
    /// Fx, N.
    pub x_n: Millionths,
    /// Fy, N.
    pub y_n: Millionths,
    /// Fz, N.
    pub z_n: Millionths,
    /// Standard uncertainty of the direction, degrees.
    pub direction_sigma_deg: Thousandths,
    /// Standard uncertainty of |F|, N.
    pub magnitude_sigma_n: Millionths,
    /// Where the tip touches the film, each `null` where the model does not tell.
    #[serde(flatten)]
    pub place: PlaceJson,
}

/// A place of contact: three numbers, or three times none.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct PlaceJson {
    /// To the right in the image, mm from the film's middle.
    pub place_x_mm: Option<Thousandths>,
    /// Down in the image, mm from the film's middle.
    pub place_y_mm: Option<Thousandths>,
    /// Standard uncertainty of each coordinate, mm.
    pub place_sigma_mm: Option<Thousandths>,
}

impl From<&Force> for ForceJson {
    fn from(force: &Force) -> ForceJson {
        let [x_n, y_n, z_n] = force.cartesian.map(|n| Millionths::from_i32(n.0));
        ForceJson {
            alpha_deg: Thousandths::from_i32(force.alpha.0),
            beta_deg: Thousandths::from_i32(force.beta.0),
            magnitude_n: Millionths::from_i32(force.magnitude.0),
            x_n,
            y_n,
            z_n,
            direction_sigma_deg: Thousandths::from_u64(force.direction_sigma.0.into()),
            magnitude_sigma_n: Millionths::from_u64(force.magnitude_sigma.0.into()),
            place: force.place.map_or_else(PlaceJson::default, |place| {
                PlaceJson::of_micrometres(place.x.0, place.y.0, place.sigma.0)
            }),
        }
    }
}

impl PlaceJson {
    fn of_micrometres(x: i32, y: i32, sigma: u32) -> PlaceJson {
        PlaceJson {
            place_x_mm: Some(Thousandths::from_i32(x)),
            place_y_mm: Some(Thousandths::from_i32(y)),
            place_sigma_mm: Some(Thousandths::from_u64(sigma.into())),
        }
    }

    /// x, y and its uncertainty, in the order of the columns.
    pub fn numbers(&self) -> [Option<Thousandths>; 3] {
        [self.place_x_mm, self.place_y_mm, self.place_sigma_mm]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::force::Place;
    use hivtac_terms::units::{
        MicroNewtons, Micrometres, MilliDegrees, SignedMicrometres, UnsignedMicroNewtons,
        UnsignedMilliDegrees,
    };

    const FORCE: Force = Force {
        alpha: MilliDegrees(-5000),
        beta: MilliDegrees(2500),
        magnitude: MicroNewtons(100_000),
        cartesian: [
            MicroNewtons(-8707),
            MicroNewtons(4362),
            MicroNewtons(-99_525),
        ],
        direction_sigma: UnsignedMilliDegrees(480),
        magnitude_sigma: UnsignedMicroNewtons(900),
        place: Some(Place {
            x: SignedMicrometres(1250),
            y: SignedMicrometres(-7),
            sigma: Micrometres(85),
        }),
    };

    fn json(force: ForceJson) -> String {
        serde_json::to_string(&force).unwrap()
    }

    #[test]
    fn numbers_are_exact() {
        assert!(
            json((&FORCE).into())
                .ends_with(r#","place_x_mm":1.250,"place_y_mm":-0.007,"place_sigma_mm":0.085}"#)
        );
    }

    #[test]
    fn a_place_that_is_not_there_is_null() {
        let force = Force {
            place: None,
            ..FORCE
        };
        assert!(
            json((&force).into())
                .ends_with(r#","place_x_mm":null,"place_y_mm":null,"place_sigma_mm":null}"#)
        );
    }
}
