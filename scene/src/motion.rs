//! Loads in time.

use std::f64::consts::PI;

use crate::noise::mix;
use crate::{Load, SceneError};

/// Size of the largest load of the named scenes, N: the paper's range.
const FULL_N: f64 = 0.2;
/// How long `demo` rests before the tip comes, s: three frames at 30 per second.
const DEMO_REST_S: f64 = 0.1;
/// `sweep` goes up and down once in this time, s.
const SWEEP_S: f64 = 4.0;
/// The directions of `sweep`, (α, β) in degrees, one after the other.
const SWEEP_DIRECTIONS: [(f64, f64); 5] =
    [(0.0, 0.0), (8.0, 0.0), (-8.0, 0.0), (0.0, 6.0), (0.0, -6.0)];

/// What presses the film, as a function of time. Before time 0, and at a time that is no number, nothing does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Motion {
    /// Nothing presses.
    Rest,
    /// One load, from time 0 on.
    Static(Load),
    /// A tenth of a second of rest, then a tip whose force wanders smoothly: |F| 0.02–0.2 N, |α| ≤ 8°, |β| ≤ 6°.
    /// The seed decides where α and β start.
    Demo {
        /// Any number.
        seed: u64,
    },
    /// |F| goes 0 → 0.2 N → 0 in 4 s, again and again; straight, then tilted by α = ±8° and by β = ±6°.
    Sweep,
}

impl Motion {
    /// A motion by its name: `rest`, `static` (0.1 N, α = 4°, β = −3°), `demo` or `sweep`.
    ///
    /// # Errors
    /// When there is none of that name.
    pub(crate) fn named(name: &str, seed: u64) -> Result<Motion, SceneError> {
        match name {
            "rest" => Ok(Motion::Rest),
            "static" => Ok(Motion::Static(load(0.1, 4.0, -3.0))),
            "demo" => Ok(Motion::Demo { seed }),
            "sweep" => Ok(Motion::Sweep),
            _ => Err(SceneError::UnknownScene(name.to_owned())),
        }
    }

    /// The load at a time in seconds.
    pub(crate) fn load(&self, time_s: f64) -> Load {
        if !time_s.is_finite() || time_s < 0.0 {
            return Load::REST;
        }
        match *self {
            Motion::Rest => Load::REST,
            Motion::Static(load) => load,
            Motion::Demo { seed } => demo(time_s, seed),
            Motion::Sweep => sweep(time_s),
        }
    }
}

fn demo(time_s: f64, seed: u64) -> Load {
    let pressed_s = time_s - DEMO_REST_S;
    if pressed_s < 0.0 {
        return Load::REST;
    }
    let wave = |period_s: f64, phase: f64| libm::sin(2.0 * PI * (pressed_s / period_s + phase));
    let phase = |index: u64| (mix(seed.wrapping_add(index)) >> 40) as f64 / f64::from(1 << 24);
    // A quarter period back: the tip comes with the smallest force.
    let magnitude_n = 0.11 + 0.09 * wave(0.9, -0.25);
    load(
        magnitude_n,
        8.0 * wave(1.3, phase(1)),
        6.0 * wave(0.7, phase(2)),
    )
}

fn sweep(time_s: f64) -> Load {
    let turn = (time_s / SWEEP_S).floor();
    let part = time_s / SWEEP_S - turn;
    let (alpha, beta) = SWEEP_DIRECTIONS[(turn % 5.0) as usize];
    load(FULL_N * (1.0 - (2.0 * part - 1.0).abs()), alpha, beta)
}

/// A load of the named scenes, all of which are possible.
fn load(magnitude_n: f64, alpha_deg: f64, beta_deg: f64) -> Load {
    Load::from_angles(magnitude_n, alpha_deg, beta_deg).expect("the named scenes press gently")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn demo_rests_for_three_frames_and_then_presses_within_its_range() {
        let motion = Motion::named("demo", 1).unwrap();
        let at_frame = |n: u32| motion.load(f64::from(n) / 30.0);
        for frame in 0..3 {
            assert_eq!(at_frame(frame), Load::REST);
        }
        for frame in 3..3000 {
            let load = at_frame(frame);
            assert!((0.02 - 1e-12..=FULL_N + 1e-12).contains(&load.magnitude_n()));
            assert!(load.alpha_deg().abs() <= 8.0 && load.beta_deg().abs() <= 6.0);
        }
    }

    #[test]
    fn demo_is_smooth_and_uses_its_range_within_thirty_frames() {
        for seed in 0..20 {
            let motion = Motion::named("demo", seed).unwrap();
            let loads: Vec<Load> = (3..30).map(|n| motion.load(f64::from(n) / 30.0)).collect();
            let sizes = loads.iter().map(Load::magnitude_n);
            assert!(sizes.clone().fold(0.0, f64::max) > 0.19);
            assert!(sizes.fold(1.0, f64::min) < 0.03);
            for pair in loads.windows(2) {
                assert!((pair[0].magnitude_n() - pair[1].magnitude_n()).abs() < 0.025);
                assert!((pair[0].alpha_deg() - pair[1].alpha_deg()).abs() < 1.5);
            }
        }
    }

    #[test]
    fn sweep_reaches_zero_and_full_force_in_every_direction() {
        let motion = Motion::named("sweep", 0).unwrap();
        for (turn, (alpha, beta)) in SWEEP_DIRECTIONS.into_iter().enumerate() {
            let start_s = SWEEP_S * turn as f64;
            assert_eq!(motion.load(start_s), Load::REST);
            let top = motion.load(start_s + 2.0);
            assert_eq!(
                (top.magnitude_n(), top.alpha_deg(), top.beta_deg()),
                (FULL_N, alpha, beta)
            );
        }
        assert_eq!(motion.load(22.0).alpha_deg(), 0.0, "starts over");
    }

    #[test]
    fn outside_time_nothing_presses() {
        for name in ["rest", "static", "demo", "sweep"] {
            let motion = Motion::named(name, 0).unwrap();
            for time_s in [-1.0, f64::NAN, f64::INFINITY] {
                assert_eq!(motion.load(time_s), Load::REST);
            }
        }
        assert!(Motion::named("dance", 0).is_err());
    }
}
