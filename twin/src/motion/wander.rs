//! The motions `demo`, all over the film, and `sweep`, in its middle, through the paper's whole
//! range.

use std::f64::consts::PI;

use super::load;
use crate::Load;
use crate::noise::mix;

/// Size of the largest load of the named scenes, N: the paper's range.
const FULL_N: f64 = 0.2;
/// Time for which `demo` rests before the tip comes, s: three frames at 30 per second.
const DEMO_REST_S: f64 = 0.1;
/// Largest distance of the tip of `demo` from the film's middle along x and y, mm.
const DEMO_REACH_MM: f64 = 3.0;
/// Time in which `sweep` goes up and down once, s.
const SWEEP_S: f64 = 4.0;
/// The directions of `sweep`, (α, β) in degrees, one after the other.
const SWEEP_DIRECTIONS: [(f64, f64); 5] =
    [(0.0, 0.0), (8.0, 0.0), (-8.0, 0.0), (0.0, 6.0), (0.0, -6.0)];

/// A tenth of a second of rest, then a tip that wanders over the film while its force changes.
pub(super) fn demo(time_s: f64, seed: u64) -> Load {
    let pressed_s = time_s - DEMO_REST_S;
    if pressed_s < 0.0 {
        return Load::REST;
    }
    let wave = |period_s: f64, phase: f64| libm::sin(2.0 * PI * (pressed_s / period_s + phase));
    let phase = |index: u64| (mix(seed.wrapping_add(index)) >> 40) as f64 / f64::from(1 << 24);
    // The phase is a quarter period back: the tip starts with the smallest force.
    let magnitude_n = 0.11 + 0.09 * wave(0.9, -0.25);
    let place_mm =
        [(1.7, 3), (1.1, 4)].map(|(period_s, index)| DEMO_REACH_MM * wave(period_s, phase(index)));
    let force = load(
        magnitude_n,
        8.0 * wave(1.3, phase(1)),
        6.0 * wave(0.7, phase(2)),
    );
    force.with_offset_mm(place_mm).unwrap_or(force)
}

/// Up and down, in one direction after the other.
pub(super) fn sweep(time_s: f64) -> Load {
    let turn = (time_s / SWEEP_S).floor();
    let part = time_s / SWEEP_S - turn;
    let (alpha, beta) = SWEEP_DIRECTIONS[(turn % 5.0) as usize];
    load(FULL_N * (1.0 - (2.0 * part - 1.0).abs()), alpha, beta)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Motion;

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
            let far_mm = load.offset_mm().map(f64::abs);
            assert!(far_mm.iter().all(|&mm| mm <= DEMO_REACH_MM));
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
            let far_mm = loads.iter().map(|load| load.offset_mm()[1].abs());
            assert!(far_mm.fold(0.0, f64::max) > 2.0);
            for pair in loads.windows(2) {
                assert!((pair[0].magnitude_n() - pair[1].magnitude_n()).abs() < 0.025);
                assert!((pair[0].alpha_deg() - pair[1].alpha_deg()).abs() < 1.5);
                let [from, to] = [0, 1].map(|k| pair[k].offset_mm());
                let far_mm = libm::hypot(from[0] - to[0], from[1] - to[1]);
                assert!(far_mm < 0.8, "{far_mm}");
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
}
