//! Defines the status of a sample: why it has no force, or how far its force can be trusted
//! (`docs/wire.md`).

/// A set of status bits; a receiver ignores bits that it does not know.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "wire",
    derive(serde::Serialize, serde::Deserialize, postcard_schema::Schema)
)]
pub struct Status(pub u32);

macro_rules! bits {
    ($($(#[$doc:meta])* $name:ident = $bit:literal, $text:literal;)*) => {
        impl Status {
            $($(#[$doc])* pub const $name: Status = Status(1 << $bit);)*
            /// Every bit with its name in JSON, CSV and human output, lowest bit first.
            pub const NAMES: &'static [(Status, &'static str)] = &[$((Status::$name, $text)),*];
        }
    };
}

bits! {
    /// Fewer markers were found than the film has, and too few for a force: no force.
    MARKERS_MISSING = 0, "markers_missing";
    /// The blobs can be read as the markers in more than one plausible way, or in none: no force.
    MARKERS_AMBIGUOUS = 1, "markers_ambiguous";
    /// More blobs than the fixed storage holds, or more runs than a frame of noise is allowed: no
    /// force.
    BLOB_OVERFLOW = 2, "blob_overflow";
    /// Areas or shapes of the markers do not fit each other and their distance: no force.
    MARKERS_IMPLAUSIBLE = 3, "markers_implausible";
    /// |F| is outside the range that the model was calibrated for, or the markers moved farther
    /// than the inputs of the model can represent.
    MAGNITUDE_OUT_OF_RANGE = 4, "magnitude_out_of_range";
    /// The force is too small for a reliable direction; its size is still good.
    DIRECTION_UNRELIABLE = 5, "direction_unreliable";
    /// Most of the image passed the threshold, or clipped: no force.
    IMAGE_SATURATED = 6, "image_saturated";
    /// No pixel passed the threshold: no light, or the lens is covered; no force.
    IMAGE_DARK = 7, "image_dark";
    /// The frame had fewer or more rows, or rows of another width, than announced: no force.
    FRAME_INCOMPLETE = 8, "frame_incomplete";
    /// At least one frame between this sample and the previous one was exposed but not processed.
    FRAME_DROPPED = 9, "frame_dropped";
    /// The camera interface overran since the previous sample.
    CAPTURE_OVERRUN = 10, "capture_overrun";
    /// The camera was silent and was restarted since the previous sample.
    CAMERA_RESTARTED = 11, "camera_restarted";
    /// No rest position was taken on this unit: the model's own was used.
    TARE_MISSING = 12, "tare_missing";
    /// The model was not calibrated on this unit, but trained on a simulated sensor.
    NOT_CALIBRATED = 13, "not_calibrated";
    /// There is no usable model: no force.
    MODEL_MISSING = 14, "model_missing";
    /// The model was made for another frame size, format, threshold, centroid estimator or number
    /// of markers: no force.
    MODEL_MISMATCH = 15, "model_mismatch";
    /// Something touches the film ([`ContactLimits`](crate::temporal::ContactLimits)).
    CONTACT = 16, "contact";
    /// The contact slips ([`SlipLimits`](crate::temporal::SlipLimits)).
    SLIP = 17, "slip";
    /// The direction is outside the range that the model was calibrated for: too much force along
    /// the film for the force into it.
    DIRECTION_OUT_OF_RANGE = 18, "direction_out_of_range";
    /// The place of contact is outside the range that the model was calibrated for.
    PLACE_OUT_OF_RANGE = 19, "place_out_of_range";
    /// No single contact fits the positions of the markers: no force.
    UNEXPLAINED = 20, "unexplained";
    /// Re-zeroing has moved the rest position from where it was taken.
    REZEROED = 21, "rezeroed";
    /// The frame has specks or little light, and its markers were found by a second look; or the
    /// film next to a marker looks different on one side, by light through it or a reflection. The
    /// standard uncertainties are larger.
    FRAME_DISTURBED = 22, "frame_disturbed";
    /// The untouched film was last seen away from its rest position; standard uncertainties include
    /// that.
    REST_MOVED = 23, "rest_moved";
    /// The film may hang differently than when its rest position was taken, and the direction of
    /// gravity or its effect is unknown. If the model knows the effect, standard uncertainties
    /// include it.
    WEIGHT_UNKNOWN = 24, "weight_unknown";
    /// One contact explains the markers' positions badly, so standard uncertainties are widened by
    /// the residual.
    LOOSELY_EXPLAINED = 25, "loosely_explained";
    /// A marker is not seen, or is plainly faulty. The force is that of the others; with four
    /// markers nothing checks it.
    MARKER_LOST = 26, "marker_lost";
    /// With too few or ambiguous markers: the picture shows as many whole dots as a film of another
    /// layout than the model's.
    ANOTHER_LAYOUT = 27, "another_layout";
    /// Two contacts press: the force is their sum, its place their mean by their forces. Each is
    /// known if they are resolved.
    TWO_CONTACTS = 28, "two_contacts";
}

impl Status {
    /// No bit set.
    pub const OK: Status = Status(0);

    /// The bits that mean "no force": a sample has a force exactly if it has none of them.
    pub const NO_FORCE: Status = Status(
        Status::MARKERS_MISSING.0
            | Status::MARKERS_AMBIGUOUS.0
            | Status::BLOB_OVERFLOW.0
            | Status::MARKERS_IMPLAUSIBLE.0
            | Status::IMAGE_SATURATED.0
            | Status::IMAGE_DARK.0
            | Status::FRAME_INCOMPLETE.0
            | Status::MODEL_MISSING.0
            | Status::MODEL_MISMATCH.0
            | Status::UNEXPLAINED.0,
    );

    /// True when every bit of `other` is set here.
    pub const fn contains(self, other: Status) -> bool {
        self.0 & other.0 == other.0
    }

    /// True when `self` and `other` have a bit in common.
    pub const fn intersects(self, other: Status) -> bool {
        self.0 & other.0 != 0
    }

    /// Names of the known bits that are set, lowest bit first.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        Self::NAMES
            .iter()
            .filter(move |(bit, _)| self.contains(*bit))
            .map(|(_, name)| *name)
    }
}

impl core::ops::BitOr for Status {
    type Output = Status;
    fn bitor(self, other: Status) -> Status {
        Status(self.0 | other.0)
    }
}

impl core::ops::BitOrAssign for Status {
    fn bitor_assign(&mut self, other: Status) {
        self.0 |= other.0;
    }
}
