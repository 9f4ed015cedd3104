//! Finds steady stretches: a held force is one known load, and does not need exact clocks.

use super::assemble::Loaded;

/// The shortest stretch, s.
const SHORTEST_S: f64 = 0.3;
/// The largest deviation of the force from its mean in a stretch: in parts of the mean, and in
/// standard deviations of the gauge's noise. The largest of these limits holds.
const STRAY: f64 = 0.02;
const STRAY_SIGMAS: f64 = 4.0;
/// Its lower limit, N.
const STRAY_N: f64 = 0.000_5;
/// Frames farther apart than this, s, belong to different stretches.
const GAP_S: f64 = 0.2;

/// The frames of all steady stretches, each with the mean force of its stretch.
pub(super) fn steady_frames<'a>(frames: &[Loaded<'a>], noise_n: f64) -> Vec<Loaded<'a>> {
    let mut steady = Vec::new();
    let mut rest = frames;
    while !rest.is_empty() {
        let length = interval_length(rest, noise_n);
        let (these, others) = rest.split_at(length);
        let lasted = these[length - 1].time_s - these[0].time_s;
        if lasted >= SHORTEST_S {
            let mean = these.iter().map(|f| f.force_n).sum::<f64>() / length as f64;
            // The first and last frames may lie on the ramp.
            let inner = &these[1..length - 1];
            steady.extend(inner.iter().map(|frame| Loaded {
                force_n: mean,
                ..*frame
            }));
            rest = others;
        } else {
            rest = &rest[1..];
        }
    }
    steady
}

/// Length of the stretch at the start: frames in one pose near their common mean force.
fn interval_length(frames: &[Loaded<'_>], noise_n: f64) -> usize {
    let first = &frames[0];
    let (mut low, mut high, mut sum) = (first.force_n, first.force_n, 0.0);
    for (count, frame) in frames.iter().enumerate() {
        let apart = count > 0 && frame.time_s - frames[count - 1].time_s > GAP_S;
        (low, high) = (low.min(frame.force_n), high.max(frame.force_n));
        sum += frame.force_n;
        let mean = sum / (count + 1) as f64;
        let reach = (STRAY * mean).max(STRAY_SIGMAS * noise_n).max(STRAY_N);
        let strays = high - mean > reach || mean - low > reach;
        if apart || strays || frame.kept.pose != first.kept.pose {
            return count.max(1);
        }
    }
    frames.len()
}

#[cfg(test)]
mod tests {
    use super::super::folder::Kept;
    use super::super::poses::Pose;
    use super::*;

    fn pose(angles_deg: [f64; 2]) -> Pose {
        Pose {
            angles_deg,
            ..Pose::MIDDLE
        }
    }

    fn kept(angles_deg: [f64; 2]) -> Kept {
        Kept {
            run: 0,
            host_s: 0.0,
            device_us: 0,
            pose: Some(pose(angles_deg)),
            seen: Err(String::new()),
        }
    }

    #[test]
    fn held_forces_are_found_between_ramps() {
        let (one, two) = (kept([0.0, 0.0]), kept([8.0, 0.0]));
        let force = |i: usize| match i {
            0..40 => 0.1 * i as f64 / 40.0,
            40..80 => 0.1 + 0.000_2 * (i % 2) as f64,
            80..100 => 0.1 - 0.004 * (i - 80) as f64,
            _ => 0.02,
        };
        let frames: Vec<Loaded> = (0..140)
            .map(|i| Loaded {
                kept: if i < 120 { &one } else { &two },
                time_s: i as f64 / 40.0,
                force_n: force(i),
                clock_n: None,
            })
            .collect();
        let found = steady_frames(&frames, 0.000_1);
        let mut loads: Vec<(f64, Option<Pose>)> =
            found.iter().map(|f| (f.force_n, f.kept.pose)).collect();
        loads.dedup();
        assert_eq!(loads.len(), 3, "{loads:?}");
        assert!((loads[0].0 - 0.1).abs() < 0.001, "{loads:?}");
        assert!(
            (loads[1].0 - 0.02).abs() < 0.001 && loads[1].1 == Some(pose([0.0, 0.0])),
            "{loads:?}"
        );
        assert_eq!(loads[2].1, Some(pose([8.0, 0.0])));
        assert!(found.len() > 60, "{}", found.len());
        assert!(steady_frames(&[], 0.0).is_empty());
    }
}
