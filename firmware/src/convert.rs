//! Between the sensing pipeline's types and those of the wire.

use hivtac_sensing::formats::{Mono, Yuv422};
use hivtac_sensing::threshold::{HsvBox, Threshold};
use hivtac_sensing::{
    force::{Force, Place},
    markers::Marker,
    model::CentroidEstimator,
};
use hivtac_wire::message;

/// A force for the wire. Uncertainties are never negative.
pub fn force_to_wire(force: Force) -> message::Force {
    message::Force {
        alpha_mdeg: force.alpha.0,
        beta_mdeg: force.beta.0,
        magnitude_un: force.magnitude.0,
        cartesian_un: force.cartesian.map(|component| component.0),
        direction_sigma_mdeg: force.direction_sigma.0.unsigned_abs(),
        magnitude_sigma_un: force.magnitude_sigma.0.unsigned_abs(),
        place: force.place.map(place_to_wire),
    }
}

/// A place of contact for the wire.
fn place_to_wire(place: Place) -> message::Place {
    message::Place {
        x_um: place.x.0,
        y_um: place.y.0,
        sigma_um: place.sigma.0,
    }
}

/// A marker for the wire.
pub fn marker_to_wire(marker: Marker) -> message::Marker {
    message::Marker {
        x_q16: marker.x.0,
        y_q16: marker.y.0,
        area_px: marker.area,
    }
}

/// A centroid estimator for the wire.
pub fn centroid_to_wire(from: CentroidEstimator) -> message::Centroid {
    match from {
        CentroidEstimator::BinaryMask => message::Centroid::BinaryMask,
        CentroidEstimator::RednessWeighted => message::Centroid::RednessWeighted,
    }
}

/// A threshold for the wire.
pub fn threshold_to_wire(from: Threshold) -> message::Threshold {
    match from {
        Threshold::Rgb565(from) => {
            message::Threshold::Rgb565(message::HsvBox::of_limits(from.limits()))
        }
        Threshold::Yuv422(Yuv422 { cr_low }) => message::Threshold::Yuv422 { cr_low },
        Threshold::Mono(Mono { low, high }) => message::Threshold::Mono {
            luma_low: low,
            luma_high: high,
        },
    }
}

/// A threshold from the wire, unchecked.
pub fn threshold_from_wire(from: message::Threshold) -> Threshold {
    match from {
        message::Threshold::Rgb565(from) => Threshold::Rgb565(HsvBox::of_limits(from.limits())),
        message::Threshold::Yuv422 { cr_low } => Threshold::Yuv422(Yuv422 { cr_low }),
        message::Threshold::Mono {
            luma_low,
            luma_high,
        } => Threshold::Mono(Mono {
            low: luma_low,
            high: luma_high,
        }),
    }
}
