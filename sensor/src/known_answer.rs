//! Checks a model with a question whose answer is known. The answer is computed on a computer when
//! a program is built, and the program computes it again where it runs. Equal numbers prove that
//! weights, kernels and arithmetic work there.

use crate::force::features::Features;
use crate::force::model::Model;
use crate::force::network::Network;
use crate::force::{self, Resting};
use hivtac_terms::marker::{Marker, MarkerList};
use hivtac_terms::units::Px;

/// The numbers of a force: α, β (m°), |F|, the vector (µN), two uncertainties (m°, µN), the place
/// and its uncertainty (µm; 0 without a place).
pub type Answer = [i32; 11];

/// Markers move away from their common centre by one part in this many of their distance.
const OUTWARD: i32 = 8;
/// And all of them along x by this.
const SIDEWARD: Px = Px(Px::ONE.0 / 2);

/// Returns the model's force for the markers of its own rest position, moved outward, as a press
/// moves them, and to the side. The same bits on every machine.
pub fn of(model: &Model<'_>, network: &mut Network) -> Answer {
    let markers = moved(model);
    let features = Features::of_markers(&markers);
    let output = network.run(model, &features, &model.rest.features);
    let resting = Resting::of_model(model, &model.rest);
    let (force, _) = match (&model.forward, &resting) {
        (Some(forward), Some(resting)) => resting.force(forward, &model.range, &markers, &output),
        _ => force::of_outputs(model, &output),
    };
    let [x, y, z] = force.cartesian.map(|component| component.0);
    let [place_x, place_y, place_sigma] = match force.place {
        Some(place) => [place.x.0, place.y.0, place.sigma.0 as i32],
        None => [0; 3],
    };
    [
        force.alpha.0,
        force.beta.0,
        force.magnitude.0,
        x,
        y,
        z,
        force.direction_sigma.0 as i32,
        force.magnitude_sigma.0 as i32,
        place_x,
        place_y,
        place_sigma,
    ]
}

fn moved(model: &Model<'_>) -> MarkerList {
    let (Px(center_x), Px(center_y)) = model.rest.features.rect_center;
    let outward = |Px(at), center: i32| Px(at.saturating_add(at.saturating_sub(center) / OUTWARD));
    model.rest.markers().map(|marker| Marker {
        x: Px(outward(marker.x, center_x).0.saturating_add(SIDEWARD.0)),
        y: outward(marker.y, center_y),
        ..marker
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::model::AlignedFile;
    use std::vec::Vec;

    static FILE: &AlignedFile<[u8]> =
        &AlignedFile(*include_bytes!("../../calibration/models/default.hvtm"));

    fn answer(model: &Model<'_>) -> Answer {
        of(model, &mut Network::new())
    }

    /// A press of some ten millinewtons, off the film's middle.
    #[test]
    fn the_answer_is_a_press_with_a_place() {
        let [
            alpha,
            beta,
            magnitude,
            _,
            _,
            z,
            direction,
            size,
            x,
            _,
            place,
        ] = answer(&Model::parse(&FILE.0).unwrap());
        assert!((5_000..500_000).contains(&magnitude), "{magnitude} µN");
        assert!(z < 0 && direction > 0 && size > 0 && place > 0);
        assert!(alpha != 0 || beta != 0);
        assert!(x != 0);
    }

    /// With one bit of the file changed and its checksum corrected, a model that still parses gives
    /// a different force. Exception: bits about contacts elsewhere, as most bits of the tables are.
    #[test]
    fn another_model_has_another_answer() {
        let good = answer(&Model::parse(&FILE.0).unwrap());
        let end = FILE.0.len() - 4;
        let (mut models, mut others) = (0, 0);
        for at in (0..end).step_by(499) {
            let mut file: Vec<u8> = FILE.0.to_vec();
            file[at] ^= 0x40;
            let crc = crc32(&file[..end]).to_le_bytes();
            file[end..].copy_from_slice(&crc);
            if let Ok(model) = Model::parse(&file) {
                models += 1;
                others += u32::from(answer(&model) != good);
            }
        }
        assert!(models > 50 && others >= 5, "{others} of {models}");
    }

    fn crc32(bytes: &[u8]) -> u32 {
        !bytes.iter().fold(u32::MAX, |crc, byte| {
            (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
                (crc >> 1) ^ (0xEDB8_8320 * (crc & 1))
            })
        })
    }
}
