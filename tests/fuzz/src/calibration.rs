//! Attacks on the files that calibration reads: data sets, recordings of a unit and a gauge,
//! networks.

use hivtac_calibration::data::collect::assemble::{Gauge, How, assemble};
use hivtac_calibration::data::collect::folder::Recording;
use hivtac_calibration::data::collect::gauge_file;
use hivtac_calibration::data::dataset::Dataset;
use hivtac_calibration::import;
use hivtac_calibration::quantize;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::Model;

/// The end of one of several files in an input.
const END: char = '\0';
/// Number of sessions up to which a data set is examined further.
const SESSIONS: usize = 8;

/// A data set is refused, or it is the same after it was written and read, and it can be used.
pub fn dataset(input: &[u8]) -> bool {
    let Some(dataset) = text(input).and_then(|text| Dataset::parse(text).ok()) else {
        return false;
    };
    let written = dataset.to_text().expect("it can be written");
    let again = Dataset::parse(text(&written).expect("it is text")).expect("it can be read");
    assert_eq!(again, dataset);
    dataset.rejected();
    assert!(dataset.samples().count() <= dataset.rows.len());
    if dataset.about.sessions <= SESSIONS {
        let _ = dataset.split(1);
        let _ = dataset.tared();
    }
    true
}

/// The files of a recording's folder, one of a gauge and the sensor's orientation, separated by
/// zeros. They are refused, or made into a data set that can be read, or refused at that later step
/// with a reason.
pub fn recording(input: &[u8]) -> bool {
    let Some(recorded) = text(input) else {
        return false;
    };
    let mut files = recorded.splitn(5, END);
    let mut file = || files.next().unwrap_or_default();
    let [unit, samples, lines, gauge, down] = std::array::from_fn(|_| file());
    let Ok(recording) = Recording::parse(unit, samples, lines, down) else {
        return false;
    };
    let gauge = match gauge_file::parse(gauge, None) {
        Ok(series) => Gauge::Files(series),
        Err(error) => {
            assert!(!error.to_string().is_empty());
            Gauge::AtThePort
        }
    };
    for holds in [false, true] {
        let how = How {
            holds,
            ..How::default()
        };
        match assemble(&recording, &gauge, how) {
            Ok((dataset, report)) => {
                assert!(!report.sentence().is_empty());
                let written = dataset.to_text().expect("it can be written");
                let written = text(&written).expect("it is text");
                Dataset::parse(written).expect("it can be read");
            }
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
    true
}

/// Weights, or a network trained elsewhere. They are refused, or made into a model file that is
/// accepted, or refused at that later step with a reason.
pub fn network(input: &[u8]) -> bool {
    let imported = import::parse(input).is_ok();
    let weights = text(input).and_then(|text| Weights::parse(text).ok());
    if let Some(file) = weights
        .as_ref()
        .and_then(|weights| quantize::export(weights).ok())
    {
        assert!(Model::parse(&file).is_ok());
    }
    imported || weights.is_some()
}

fn text(input: &[u8]) -> Option<&str> {
    std::str::from_utf8(input).ok()
}
