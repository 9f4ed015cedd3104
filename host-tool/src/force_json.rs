//! A force as JSON, the same for a sample of the device and for a picture.

use crate::decimal::{Millionths, Thousandths};
use hivtac_sensing::force;
use hivtac_wire::message;
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
    /// Fx, N; `null` where the model's angles are not those of the force.
    pub x_n: Option<Millionths>,
    /// Fy, N.
    pub y_n: Option<Millionths>,
    /// Fz, N.
    pub z_n: Option<Millionths>,
    /// Standard uncertainty of the direction, degrees.
    pub direction_sigma_deg: Thousandths,
    /// Standard uncertainty of |F|, N.
    pub magnitude_sigma_n: Millionths,
}

impl From<&message::Force> for ForceJson {
    fn from(force: &message::Force) -> ForceJson {
        let [x_n, y_n, z_n] = components(force.cartesian_un);
        ForceJson {
            alpha_deg: Thousandths::from_i32(force.alpha_mdeg),
            beta_deg: Thousandths::from_i32(force.beta_mdeg),
            magnitude_n: Millionths::from_i32(force.magnitude_un),
            x_n,
            y_n,
            z_n,
            direction_sigma_deg: Thousandths::from_u64(force.direction_sigma_mdeg.into()),
            magnitude_sigma_n: Millionths::from_u64(force.magnitude_sigma_un.into()),
        }
    }
}

impl From<&force::Force> for ForceJson {
    fn from(force: &force::Force) -> ForceJson {
        let [x_n, y_n, z_n] = components(force.cartesian.map(|vector| vector.map(|n| n.0)));
        ForceJson {
            alpha_deg: Thousandths::from_i32(force.alpha.0),
            beta_deg: Thousandths::from_i32(force.beta.0),
            magnitude_n: Millionths::from_i32(force.magnitude.0),
            x_n,
            y_n,
            z_n,
            direction_sigma_deg: Thousandths::from_i32(force.direction_sigma.0),
            magnitude_sigma_n: Millionths::from_i32(force.magnitude_sigma.0),
        }
    }
}

/// Each component in N, or three times none.
fn components(vector_un: Option<[i32; 3]>) -> [Option<Millionths>; 3] {
    vector_un.map_or([None; 3], |vector| {
        vector.map(|n| Some(Millionths::from_i32(n)))
    })
}
