//! Tests of the LED's signals, read from its pin as a person sees them: by flashes and pauses, or
//! by the brightness while it is dimmed.

use std::ops::Range;

use crate::common::{Run, Setup, command, firmware, openmv, set_threshold};
use crate::settings::{Device, of_another_version};
use hivtac_rig::report::Report;
use hivtac_rig::script::Action;
use hivtac_terms::camera::{CameraSettings, Rate};
use hivtac_terms::threshold::{Mono, Threshold};
use hivtac_wire::message::Request;

/// Shorter pulses count as dimming, s.
const SHORTEST_FLASH_S: f64 = 0.02;
/// Time over which an eye averages, s.
const GLANCE_S: f64 = 0.02;

/// A pattern as a person sees it.
#[derive(Debug, PartialEq)]
enum Pattern {
    /// This many flashes, repeated with a period, s.
    Flashes(usize, f64),
    /// Brighter and darker, with a period, s.
    Breathes(f64),
}

impl Pattern {
    /// Asserts that the pattern is `expected`; the period may differ by `off_s`.
    fn assert_is(&self, expected: &Pattern, off_s: f64) {
        let ((kind, period), (other, expected_s)) = (self.parts(), expected.parts());
        let is_near = (period - expected_s).abs() <= off_s;
        assert!(kind == other && is_near, "{self:?} instead of {expected:?}");
    }

    /// Returns the number of flashes (`None` if it breathes) and the period, s.
    fn parts(&self) -> (Option<usize>, f64) {
        match *self {
            Pattern::Flashes(count, period_s) => (Some(count), period_s),
            Pattern::Breathes(period_s) => (None, period_s),
        }
    }
}

/// The times during which the LED was on, s.
struct Light(Vec<Range<f64>>);

impl Light {
    /// Returns the times of a run, from a time on; a pulse that lasts to the run's end is left out.
    fn of(report: &Report, from_s: f64) -> Light {
        let edges = report.led_edges_ns.as_chunks().0.iter();
        let lit = edges.map(|[on, off]| *on as f64 / 1e9..*off as f64 / 1e9);
        Light(lit.filter(|lit| lit.start >= from_s).collect())
    }

    fn pattern(&self) -> Pattern {
        let is_dimmed = |lit: &&Range<f64>| lit.end - lit.start < SHORTEST_FLASH_S;
        let dimmed = self.0.iter().filter(is_dimmed).count();
        match dimmed > self.0.len() / 2 {
            true => self.breath(),
            false => self.flashes(),
        }
    }

    /// Returns groups of flashes: a pause within a group is shorter than the one after it. The
    /// first and the last group may be incomplete.
    fn flashes(&self) -> Pattern {
        let pauses = self.0.windows(2);
        let pauses: Vec<f64> = pauses.map(|pair| pair[1].start - pair[0].end).collect();
        let longest = pauses.iter().copied().fold(0.0, f64::max);
        let ends = (0..)
            .zip(&pauses)
            .filter(|(_, pause)| **pause > 0.8 * longest);
        let begins: Vec<usize> = ends.map(|(nth, _): (usize, _)| nth + 1).collect();
        let [first, second, ..] = begins[..] else {
            panic!("no two pauses: {:?}", self.0);
        };
        Pattern::Flashes(second - first, self.0[second].start - self.0[first].start)
    }

    /// The period is twice the time from the middle of the bright half to the middle of the dark
    /// half.
    fn breath(&self) -> Pattern {
        let [from, to] = [self.0[0].start, self.0[self.0.len() - 1].end];
        let glances =
            (0..((to - from) / GLANCE_S) as u32).map(|nth| from + f64::from(nth) * GLANCE_S);
        let bright: Vec<f64> = glances.filter(|at| self.brightness(*at) > 0.5).collect();
        let brightest = (bright[0] + bright[bright.len() - 1] + GLANCE_S) / 2.0;
        let behind = self.0.windows(2).filter(|pair| pair[0].start > brightest);
        let dark = behind.max_by(|one, other| {
            let [one, other] = [one, other].map(|pair| pair[1].start - pair[0].end);
            one.total_cmp(&other)
        });
        let dark = dark.expect("it is dark once");
        Pattern::Breathes(2.0 * ((dark[0].end + dark[1].start) / 2.0 - brightest))
    }

    /// Returns the mean brightness over a glance, 0 to 1.
    fn brightness(&self, at: f64) -> f64 {
        let end = at + GLANCE_S;
        let shares = self
            .0
            .iter()
            .map(|lit| (lit.end.min(end) - lit.start.max(at)).max(0.0));
        shares.sum::<f64>() / GLANCE_S
    }
}

/// Asserts the signal of a chip revision that is too old: two flashes, and a pause of seven times
/// that. The duration of a flash depends on the core's clock, which the rig does not follow there.
pub fn assert_flashes_twice(report: &Report) {
    let light = Light::of(report, 0.0);
    let flash_s = light.0[0].end - light.0[0].start;
    let expected = Pattern::Flashes(2, 10.0 * flash_s);
    light.pattern().assert_is(&expected, flash_s);
}

/// Returns the pattern of the second board from its first frames on, at its lowest rate: the frames
/// make up most of a run's time.
fn shown(setup: Setup) -> Pattern {
    let slowly = CameraSettings {
        rate: Rate::Quarter,
        ..CameraSettings::default()
    };
    let slowly = Action::Send(command(30, Request::SetCamera(slowly)));
    let setup = Setup {
        scene: "rest",
        ..setup.at(400, slowly)
    };
    let run: Run = setup.run();
    assert!(!run.samples().is_empty(), "{}", run.log());
    assert_eq!(run.report.resets, 0, "{}", run.log());
    Light::of(&run.report, 0.5).pattern()
}

#[test]
#[ignore = "20 s: 4 s of virtual time"]
fn it_breathes_while_frames_give_forces() {
    shown(openmv(4_300)).assert_is(&Pattern::Breathes(4.0), 0.1);
}

/// The threshold is darker than all markers.
#[test]
#[ignore = "10 s of a lamp"]
fn it_blinks_once_a_second_when_frames_give_no_force() {
    let nothing = Threshold::Mono(Mono { low: 0, high: 0 });
    let pattern = shown(openmv(3_700).at(380, set_threshold(31, nothing)));
    pattern.assert_is(&Pattern::Flashes(1, 1.0), 0.02);
}

#[test]
fn it_blinks_five_times_a_second_without_a_camera() {
    let run = Setup::new(firmware(), 1_200).fault("camera-absent").run();
    let pattern = Light::of(&run.report, 0.3).pattern();
    pattern.assert_is(&Pattern::Flashes(1, 0.2), 0.02);
}

/// The kept settings have another version, which the start detects, while frames give forces.
#[test]
#[ignore = "20 s: 4 s of virtual time"]
fn it_flashes_three_times_when_the_self_test_found_something() {
    let device = Device::new();
    of_another_version(&device.flash);
    let setup = Setup {
        flash: Some(device.flash.clone()),
        ..openmv(4_300)
    };
    shown(setup).assert_is(&Pattern::Flashes(3, 2.0), 0.02);
}
