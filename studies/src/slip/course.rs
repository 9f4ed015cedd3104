//! Simulates how a tip or an object moves on the film, with true values: press, drag, release,
//! grasp, catch.

use anyhow::Result;
use hivtac_twin::Load;
use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::friction::{Friction, Meeting, STIFFNESS};

/// Range of friction ratios, with a uniform distribution.
const RATIOS: [f64; 2] = [0.3, 0.7];
/// Time before the first touch, s.
const BEFORE_S: f64 = 0.15;
/// Steps of the simulation in a second, and number of steps for one that is kept.
const STEPS_HZ: f64 = 5_000.0;
const KEPT_EACH: usize = 5;
/// Standard gravity, m/s².
const GRAVITY: f64 = 9.806_65;
/// Largest distance from the film's middle at which contacts begin, mm along each axis.
const REACH_MM: f64 = 2.0;

/// The kind of a course.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// A tilted press that sticks.
    Press,
    /// A tip that is dragged until it slips, stops, and lifts.
    Drag,
    /// A pulled tip that lifts: it slips while it leaves.
    Release,
    /// An object that is gripped and lifted: it holds, falls, or is gripped again.
    Grasp,
    /// An object that hits the film, with or without a motion along it.
    Catch,
}

impl Kind {
    /// All kinds, with their names for people.
    pub const ALL: [(Kind, &'static str); 5] = [
        (Kind::Press, "press"),
        (Kind::Drag, "drag"),
        (Kind::Release, "release"),
        (Kind::Grasp, "grasp and lift"),
        (Kind::Catch, "catch"),
    ];
}

/// A contact over time.
pub struct Course {
    /// The state of the contact for each millisecond.
    meetings: Vec<Meeting>,
    /// The place where it begins, mm.
    start_mm: [f64; 2],
    /// The direction of the pull.
    toward: [f64; 2],
    tip_radius_mm: f64,
}

impl Course {
    /// A random course of a kind, with a tip's radius in mm.
    pub fn random(kind: Kind, tip_radius_mm: f64, random: &mut ChaCha8Rng) -> Self {
        let ratio = random.random_range(RATIOS[0]..RATIOS[1]);
        let (sin, cos) = random.random_range(0.0..std::f64::consts::TAU).sin_cos();
        let start_mm = [0; 2].map(|_| random.random_range(-REACH_MM..REACH_MM));
        let mut run = Run {
            friction: Friction::new(ratio),
            ratio,
            random,
            meetings: vec![Meeting::default(); (BEFORE_S * 1e3) as usize],
            steps: 0,
        };
        match kind {
            Kind::Press => run.press(),
            Kind::Drag => run.drag(),
            Kind::Release => run.release(),
            Kind::Grasp => run.grasp(),
            Kind::Catch => run.catch(),
        }
        // At the end nothing touches the film.
        run.until(0.1, |_| (0.0, 0.0));
        Self {
            meetings: run.meetings,
            start_mm,
            toward: [cos, sin],
            tip_radius_mm,
        }
    }

    /// Its duration, s.
    pub fn duration_s(&self) -> f64 {
        (self.meetings.len() - 1) as f64 * 1e-3
    }

    /// The state of the contact at a time, s.
    pub fn meeting(&self, time_s: f64) -> Meeting {
        let at = (time_s * 1e3).clamp(0.0, (self.meetings.len() - 1) as f64);
        let [before, after] = [at.floor(), at.ceil()].map(|k| self.meetings[k as usize]);
        let part = at.fract();
        let between = |a: f64, b: f64| a + part * (b - a);
        Meeting {
            normal_n: between(before.normal_n, after.normal_n),
            pull_n: between(before.pull_n, after.pull_n),
            slipped_mm: between(before.slipped_mm, after.slipped_mm),
            slips: if part < 0.5 { before } else { after }.slips,
        }
    }

    /// The load at a time, s.
    pub fn load(&self, time_s: f64) -> Result<Load> {
        let meeting = self.meeting(time_s);
        let along = self.toward.map(|part| meeting.pull_n * part);
        let place = [0, 1].map(|k| self.start_mm[k] + meeting.slipped_mm * self.toward[k]);
        let load = Load::from_vector([along[0], along[1], -meeting.normal_n])?;
        Ok(load
            .with_offset_mm(place)?
            .with_tip_radius_mm(self.tip_radius_mm)?)
    }
}

/// A course that is being simulated.
struct Run<'r> {
    friction: Friction,
    ratio: f64,
    random: &'r mut ChaCha8Rng,
    meetings: Vec<Meeting>,
    steps: usize,
}

impl Run<'_> {
    fn uniform(&mut self, from: f64, to: f64) -> f64 {
        self.random.random_range(from..to)
    }

    /// Simulates a time, s. `at` gives force into the film and tip's place from the part of that
    /// time, 0 to 1.
    fn until(&mut self, duration_s: f64, at: impl Fn(f64) -> (f64, f64)) {
        let steps = (duration_s * STEPS_HZ) as usize;
        for step in 0..steps {
            let (normal_n, tip_mm) = at(step as f64 / steps as f64);
            self.step(normal_n, tip_mm);
        }
    }

    fn step(&mut self, normal_n: f64, tip_mm: f64) -> Meeting {
        let meeting = self.friction.step(normal_n, tip_mm, 1.0 / STEPS_HZ);
        self.steps += 1;
        if self.steps.is_multiple_of(KEPT_EACH) {
            self.meetings.push(meeting);
        }
        meeting
    }

    fn press(&mut self) {
        let force_n = self.uniform(0.03, 0.15);
        let [rises_s, falls_s] = [0; 2].map(|_| self.uniform(0.03, 0.3));
        let leans_mm = self.uniform(0.0, 0.6) * self.ratio * force_n / STIFFNESS;
        let pressed = |part| (force_n * part, leans_mm * part);
        self.until(rises_s, |part| pressed(ramp(part)));
        self.until(0.3, |_| pressed(1.0));
        self.until(falls_s, |part| pressed(1.0 - ramp(part)));
    }

    fn drag(&mut self) {
        let (force_n, rises_s) = (self.uniform(0.03, 0.15), self.uniform(0.05, 0.3));
        self.until(rises_s, |part| (force_n * ramp(part), 0.0));
        self.until(0.1, |_| (force_n, 0.0));
        let speed = 20f64.powf(self.uniform(0.0, 1.0));
        let sticks_mm = self.ratio * force_n / STIFFNESS;
        let slides_mm = (0.6 * speed).min(self.uniform(1.0, 2.0));
        let way_mm = sticks_mm + slides_mm;
        self.until(way_mm / speed, |part| (force_n, way_mm * part));
        self.until(0.2, |_| (force_n, way_mm));
        let falls_s = self.uniform(0.05, 0.3);
        self.until(falls_s, |part| (force_n * (1.0 - ramp(part)), way_mm));
    }

    fn release(&mut self) {
        let (force_n, rises_s) = (self.uniform(0.05, 0.15), self.uniform(0.1, 0.3));
        let pulled_mm = self.uniform(0.5, 0.9) * self.ratio * force_n / STIFFNESS;
        self.until(rises_s, |part| (force_n * ramp(part), 0.0));
        let pulls_s = self.uniform(0.1, 0.4);
        self.until(pulls_s, |part| (force_n, pulled_mm * ramp(part)));
        self.until(0.2, |_| (force_n, pulled_mm));
        let falls_s = self.uniform(0.1, 0.5);
        self.until(falls_s, |part| (force_n * (1.0 - part), pulled_mm));
    }

    /// An object hangs from the film while it sticks; a heavy one falls.
    fn grasp(&mut self) {
        let grip_n = self.uniform(0.04, 0.1);
        let closes_s = self.uniform(0.1, 0.3);
        self.until(closes_s, |part| (grip_n * ramp(part), 0.0));
        self.until(0.1, |_| (grip_n, 0.0));
        let is_light = self.random.random_bool(0.5);
        let part = if is_light {
            self.uniform(0.4, 0.8)
        } else {
            self.uniform(1.02, 1.3)
        };
        let weight_n = part * self.ratio * grip_n;
        let [lifts_s, reacts_s] = [self.uniform(0.15, 0.4), self.uniform(0.04, 0.08)];
        let mut object = Moved {
            mass_kg: weight_n / GRAVITY,
            ..Moved::default()
        };
        let (mut normal_n, mut slipped_since) = (grip_n, None);
        let grips_anew = self.random.random_bool(0.5);
        for step in 0..(1.0 * STEPS_HZ) as usize {
            let time_s = step as f64 / STEPS_HZ;
            let meeting = self.step(normal_n, object.at_mm);
            object.step(weight_n * ramp(time_s / lifts_s) - meeting.pull_n);
            if meeting.slips && meeting.slipped_mm > 0.05 {
                slipped_since.get_or_insert(time_s);
            }
            let late_s = slipped_since.map_or(0.0, |since| time_s - since - reacts_s);
            if grips_anew && late_s > 0.0 {
                normal_n = grip_n * (1.0 + 0.8 * ramp(late_s / 0.03));
            }
            if meeting.slipped_mm > 2.0 {
                break;
            }
        }
        let last_mm = object.at_mm;
        self.until(0.02, |part| (normal_n * (1.0 - ramp(part)), last_mm));
    }

    /// Like the scene's `catch`, with a motion along the film that friction slows.
    fn catch(&mut self) {
        let (peak_n, hold_n) = (self.uniform(0.08, 0.15), self.uniform(0.03, 0.06));
        let frequency_hz = self.uniform(6.0, 12.0);
        let speed = match self.random.random_bool(0.5) {
            true => self.uniform(20.0, 100.0),
            false => 0.0,
        };
        let mut object = Moved {
            mass_kg: 0.02,
            speed,
            ..Moved::default()
        };
        for step in 0..(0.7 * STEPS_HZ) as usize {
            let time_s = step as f64 / STEPS_HZ;
            let (sin, cos) = (std::f64::consts::TAU * frequency_hz * time_s).sin_cos();
            let decay = (-time_s / 0.1).exp();
            let normal_n = hold_n * (1.0 - decay * cos) + peak_n * decay * sin;
            let meeting = self.step(normal_n, object.at_mm);
            object.step(-meeting.pull_n);
        }
        let last_mm = object.at_mm;
        self.until(0.1, |part| (hold_n * (1.0 - ramp(part)), last_mm));
    }
}

/// An object that moves along the film.
#[derive(Default)]
struct Moved {
    mass_kg: f64,
    /// Place in mm, and speed in mm/s.
    at_mm: f64,
    speed: f64,
}

/// Damping of an object on the film's sideways stiffness, relative to the critical damping.
const DAMPING: f64 = 0.3;

impl Moved {
    /// One step of the simulation under a force, N.
    fn step(&mut self, force_n: f64) {
        let step_s = 1.0 / STEPS_HZ;
        // In N/m, and N s/m.
        let critical = 2.0 * (STIFFNESS * 1e3 * self.mass_kg).sqrt();
        let braked_n = DAMPING * critical * self.speed * 1e-3;
        self.speed += (force_n - braked_n) / self.mass_kg * 1e3 * step_s;
        self.at_mm += self.speed * step_s;
    }
}

/// A half cosine from 0 to 1.
fn ramp(part: f64) -> f64 {
    0.5 - 0.5 * (std::f64::consts::PI * part.clamp(0.0, 1.0)).cos()
}
