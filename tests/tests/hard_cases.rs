//! Correct or rejected, never silently wrong: the scene's hard cases; and no honest frame refused for it.

use hivtac_scene::{Expected, Load, Preset};
use hivtac_tests::hard::look_at_all;
use hivtac_tests::looking::{ESTIMATORS, Seen, View};

fn views(sizes: &[[u32; 2]]) -> Vec<View> {
    let mut views = Vec::new();
    for &size in sizes {
        for preset in [Preset::Ov7725, Preset::Paper] {
            views.extend(ESTIMATORS.map(|estimator| View {
                preset,
                size,
                estimator,
            }));
        }
    }
    views
}

/// Every case is right or refused; what is plain to see is mostly found.
fn hold(views: &[View], repeats: u64) {
    let mut wrong = Vec::new();
    for &view in views {
        for outcome in look_at_all(view, repeats).unwrap() {
            println!("{view:?} {}", outcome.row());
            let found =
                outcome.case.expected != Expected::Found || 2 * outcome.trusted > outcome.frames;
            if outcome.is_silently_wrong() || !found {
                wrong.push(format!("{view:?}\n{}", outcome.row()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn hard_cases_are_right_or_refused() {
    hold(&views(&[[320, 240]]), 1);
}

#[test]
#[ignore = "slow: run by cargo xtask test --all"]
fn hard_cases_are_right_or_refused_at_every_size() {
    hold(&views(&[[320, 240], [800, 600]]), 4);
}

/// Presses over the whole range in a sequence that fills it evenly: |F| to 0.25 N, α to ±11.5°, β to ±9.5°,
/// the tip up to 0.25 mm off the middle.
fn honest_load(index: usize) -> Load {
    let part = |step: f64| (0.5 + index as f64 * step).fract();
    let signed = |step: f64| 2.0 * part(step) - 1.0;
    let (alpha, beta) = (
        11.5 * signed(0.671_043_606_703_789_2),
        9.5 * signed(0.549_700_477_901_970_3),
    );
    let (sin, cos) = (std::f64::consts::TAU * part(0.450_306_786)).sin_cos();
    let offset = 0.25 * part(0.368_875).sqrt();
    Load::from_angles(0.25 * part(0.819_172_513_396_164_5), alpha, beta)
        .and_then(|load| load.with_offset_mm([offset * cos, offset * sin]))
        .unwrap()
}

/// Shows nominal frames and counts the refused; no accepted one may be off.
fn refused(view: View, frames: usize) -> usize {
    let mut looker = view.looker().unwrap();
    let scene = view.nominal().unwrap();
    let mut refused = 0;
    let mut worst = 0.0f64;
    for index in 0..frames {
        let frame = scene
            .render_load(&honest_load(index), index as u64)
            .unwrap();
        match looker.look(&frame) {
            Seen::Trusted { worst_px, .. } => worst = worst.max(worst_px),
            Seen::Refused(status) => {
                refused += 1;
                println!(
                    "{view:?}: {:?} {:?}",
                    honest_load(index),
                    status.names().collect::<Vec<_>>()
                );
            }
        }
    }
    println!("{view:?}: {refused} of {frames} refused, worst {worst:.3} px");
    assert!(worst <= view.tolerance_px(), "{view:?}: off by {worst} px");
    refused
}

#[test]
fn honest_frames_are_accepted() {
    for view in views(&[[320, 240]]) {
        // One of a thousand may be.
        assert!(refused(view, 500) <= 1, "{view:?}");
    }
}

#[test]
#[ignore = "slow: run by cargo xtask test --all"]
fn of_ten_thousand_honest_frames_at_most_ten_are_refused() {
    for view in views(&[[320, 240]]) {
        assert!(refused(view, 10_000) <= 10, "{view:?}");
    }
    for view in views(&[[800, 600]]) {
        assert!(refused(view, 1_000) <= 1, "{view:?}");
    }
}
