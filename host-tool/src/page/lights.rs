//! The meaning of each status bit for a person, and what to do about it.

use hivtac_terms::status::Status;
use serde::Serialize;

/// The severity of a status bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// As it should be.
    Good,
    /// There is a force, but less certain.
    Warning,
    /// There is no force.
    Bad,
}

/// One status bit for a person.
#[derive(Debug, Serialize)]
pub struct Light {
    /// The bit's value.
    bit: u32,
    /// Its name, as in all outputs.
    pub name: &'static str,
    /// Its severity.
    pub level: Level,
    /// Its meaning.
    pub meaning: &'static str,
    /// The remedy; empty if nothing is necessary.
    pub advice: &'static str,
}

/// Every bit of all possible statuses, lowest first.
pub fn all() -> Vec<Light> {
    of(Status(u32::MAX))
}

/// Every bit of a status, lowest first.
pub fn of(status: Status) -> Vec<Light> {
    let bits = Status::NAMES.iter();
    let bits = bits.filter(|(bit, _)| status.contains(*bit));
    let lights = bits.map(|(bit, name)| {
        let (meaning, advice) = words(*bit);
        Light {
            bit: bit.0,
            name,
            level: level(*bit),
            meaning,
            advice,
        }
    });
    lights.collect()
}

fn level(bit: Status) -> Level {
    match bit {
        _ if Status::NO_FORCE.contains(bit) => Level::Bad,
        Status::CONTACT | Status::TWO_CONTACTS => Level::Good,
        _ => Level::Warning,
    }
}

fn words(bit: Status) -> (&'static str, &'static str) {
    match bit {
        Status::MARKERS_MISSING => (
            "fewer markers are seen than the film has",
            "look at the picture: is one covered, unlit or out of view?",
        ),
        Status::MARKERS_AMBIGUOUS => (
            "things of the markers' colour do not lie as markers do, or too many do",
            "look at the picture: take what else has their colour out of view",
        ),
        Status::BLOB_OVERFLOW => (
            "too many spots pass the threshold",
            "narrow the threshold, or give more light",
        ),
        Status::MARKERS_IMPLAUSIBLE => (
            "the markers differ in size or shape",
            "look at the picture: clean the film, and light all markers alike",
        ),
        Status::MAGNITUDE_OUT_OF_RANGE => (
            "more force than the model knows",
            "press less, or calibrate to a larger force",
        ),
        Status::DIRECTION_UNRELIABLE => ("too little force to tell its direction", ""),
        Status::IMAGE_SATURATED => (
            "most of the picture passes the threshold, or is white",
            "give less light and expose anew, or narrow the threshold",
        ),
        Status::IMAGE_DARK => (
            "nothing passes the threshold: the picture is dark, or too bright for colours",
            "switch the light on and take the cap off, or give less light, and expose anew; or go \
             back to the model's threshold",
        ),
        Status::FRAME_INCOMPLETE => (
            "the frame came incomplete",
            "check the camera's cable when it repeats",
        ),
        Status::FRAME_DROPPED => ("a frame before this one was not processed", ""),
        Status::CAPTURE_OVERRUN => (
            "bytes of the camera were lost",
            "check the camera's cable when it repeats",
        ),
        Status::CAMERA_RESTARTED => (
            "the camera was silent and was started again",
            "check the camera's cable when it repeats",
        ),
        Status::TARE_MISSING => (
            "no rest position was taken on this unit",
            "touch nothing, and take a tare",
        ),
        Status::NOT_CALIBRATED => (
            "the model is of a simulated sensor, not of this unit",
            "calibrate this unit before you rely on newtons",
        ),
        Status::MODEL_MISSING => ("the device has no usable model", "flash one"),
        Status::MODEL_MISMATCH => (
            "the model was made for another threshold, picture or number of markers",
            "go back to the model's threshold, or take a new tare",
        ),
        Status::CONTACT => ("something touches the film", ""),
        Status::SLIP => ("what touches the film slips", ""),
        Status::TWO_CONTACTS => ("two contacts press: the force is their sum", ""),
        Status::DIRECTION_OUT_OF_RANGE => (
            "more force along the film than the model knows",
            "press more steeply",
        ),
        Status::PLACE_OUT_OF_RANGE => (
            "the contact is outside the part of the film that the model knows",
            "press nearer to the middle",
        ),
        Status::REZEROED => (
            "the rest position followed what drifted since the tare",
            "take a new tare when forces matter",
        ),
        Status::REST_MOVED => (
            "the untouched film was seen off its rest position",
            "leave the film alone for a minute, or take a new tare",
        ),
        Status::WEIGHT_UNKNOWN => (
            "the film may hang otherwise than when the tare was taken",
            "say which way the sensor is held, then take a tare",
        ),
        Status::LOOSELY_EXPLAINED => (
            "one contact explains the markers badly: an edge, two tips or a large pad?",
            "press with one tip, or set the shape of what presses: hivtac settings set contact",
        ),
        Status::MARKER_LOST => (
            "a marker is not seen: the force is that of the others; of four, unchecked",
            "look at the picture: is one covered, unlit or out of view?",
        ),
        Status::ANOTHER_LAYOUT => (
            "the picture shows as many dots as another film than the model's has",
            "send the model of this film's dots: hivtac update model; or uncover its dots",
        ),
        Status::UNEXPLAINED => (
            "no single contact explains where the markers are",
            "press with one tip; at rest, take a new tare",
        ),
        Status::FRAME_DISTURBED => (
            "specks, little light, or what shows through the film: the force is less certain",
            "clean film and lens, use an opaque film; look at the light, then: hivtac expose",
        ),
        _ => (
            "this tool does not know of it",
            "use the hivtac of the firmware's release",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No known bit has the words for an unknown one.
    #[test]
    fn every_bit_has_words_of_its_own() {
        let unknown = words(Status(1 << 31)).0;
        let lights = all();
        assert_eq!(lights.len(), Status::NAMES.len());
        for light in &lights {
            assert_ne!(light.meaning, unknown, "{}", light.name);
            let same = lights.iter().filter(|it| it.meaning == light.meaning);
            assert_eq!(same.count(), 1, "{}", light.name);
        }
    }

    #[test]
    fn what_takes_the_force_away_is_bad_and_says_what_to_do() {
        for light in all() {
            let takes_it = Status::NO_FORCE.contains(Status(light.bit));
            assert_eq!(light.level == Level::Bad, takes_it, "{}", light.name);
            assert!(!takes_it || !light.advice.is_empty(), "{}", light.name);
        }
    }
}
