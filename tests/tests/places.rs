//! Tests that contacts anywhere get a force from a model that gives places, and that few of them
//! get one from a model that does not.

use hivtac_terms::status::Status;
use hivtac_tests::judged::Contacts;
use hivtac_tests::pictures::Random;
use hivtac_tests::tared::{Detection, View, views};
use hivtac_twin::{Contact, Frame};

/// The contacts.
const CONTACTS: Contacts = Contacts {
    force_n: [0.005, 0.25],
    ratio: 0.8,
    place_mm: 4.0,
};

/// The results by kind.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    /// Frames in which the picture's border hides or cuts a marker.
    cut: u64,
    /// Frames with all markers in the picture, and without a force.
    refused: u64,
    /// Frames with a force.
    trusted: u64,
}

impl Counts {
    fn add(&mut self, detection: Detection, frame: &Frame) {
        let inside = |marker: &Option<_>| {
            marker.is_some_and(|marker: hivtac_twin::MarkerTruth| marker.visible == 1.0)
        };
        match detection {
            Detection::Trusted { .. } => self.trusted += 1,
            // A marker also counts as cut if only the threshold's margin separates its edge from
            // the border.
            Detection::Refused(status)
                if status.contains(Status::MARKERS_MISSING)
                    || !frame.truth.markers.iter().all(inside) =>
            {
                self.cut += 1;
            }
            Detection::Refused(_) => self.refused += 1,
        }
    }
}

/// Compares a model of presses in the middle with one that gives places, on the same frames.
fn compare(views: [View; 2], frames: u64) {
    let scene = views[0].nominal().unwrap();
    let sensors = |view: View| [view.sensor().unwrap(), view.sensor_anywhere().unwrap()];
    let mut sensors = views.map(sensors);
    let mut counts = [[Counts::default(); 2]; 2];
    let mut random = Random::new(5);
    for number in 0..frames {
        let load = CONTACTS.draw(&mut random).unwrap();
        let frame = scene.render_load(&load, number).unwrap();
        let pairs = sensors.as_flattened_mut().iter_mut();
        for (sensor, counts) in pairs.zip(counts.as_flattened_mut()) {
            counts.add(sensor.detect(&frame), &frame);
        }
    }
    for (view, [middle, anywhere]) in views.iter().zip(counts) {
        println!("{view:?}: of {frames} frames, in the middle {middle:?}, anywhere {anywhere:?}");
        // Nine in ten frames are whole. Of these, only those are refused that the finder finds too
        // wide.
        assert!(anywhere.cut * 10 < frames, "{view:?}: {anywhere:?}");
        assert!(anywhere.refused * 200 <= frames, "{view:?}: {anywhere:?}");
        // For most of these frames, a model of presses in the middle has no valid answer.
        assert!(middle.refused * 3 > frames, "{view:?}: {middle:?}");
    }
}

#[test]
fn undisturbed_contacts_anywhere_have_a_force_at_qvga() {
    for views in views(Contact::Force, &[[320, 240]]) {
        compare(views, 2_400);
    }
}

#[test]
#[ignore = "slow: run by cargo xtask test --all"]
fn undisturbed_contacts_anywhere_have_a_force_at_800_by_600() {
    for views in views(Contact::Force, &[[800, 600]]) {
        compare(views, 800);
    }
}
