//! Between the sensing pipeline's types and those of the wire.

use hivtac_sensing::{force::Force, markers::Marker, model::CentroidEstimator, threshold};
use hivtac_wire::message;

/// A force for the wire. Uncertainties are never negative.
pub fn force_to_wire(force: Force) -> message::Force {
    message::Force {
        alpha_mdeg: force.alpha.0,
        beta_mdeg: force.beta.0,
        magnitude_un: force.magnitude.0,
        cartesian_un: force.cartesian.map(|vector| vector.map(|f| f.0)),
        direction_sigma_mdeg: force.direction_sigma.0.unsigned_abs(),
        magnitude_sigma_un: force.magnitude_sigma.0.unsigned_abs(),
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

/// A threshold of RGB565 for the wire, which knows no other.
pub fn threshold_to_wire(from: threshold::Threshold) -> message::HsvBox {
    let from = threshold::HsvBox::of_limits(from.limits());
    message::HsvBox {
        hue_low: from.hue_low,
        hue_high: from.hue_high,
        saturation_low: from.saturation_low,
        saturation_high: from.saturation_high,
        value_low: from.value_low,
        value_high: from.value_high,
    }
}

/// A threshold from the wire, unchecked.
pub fn threshold_from_wire(from: message::HsvBox) -> threshold::HsvBox {
    threshold::HsvBox {
        hue_low: from.hue_low,
        hue_high: from.hue_high,
        saturation_low: from.saturation_low,
        saturation_high: from.saturation_high,
        value_low: from.value_low,
        value_high: from.value_high,
    }
}
