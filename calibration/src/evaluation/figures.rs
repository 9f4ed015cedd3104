//! Draws the paper's figures 11 to 13 as SVG.

use std::collections::BTreeMap;

use super::Judged;
use super::numbers::errors;
use crate::data::loads::PaperPoses;
use crate::evaluation::plot::{Axis, COLOURS, Plot};

/// The most points of a scatter plot.
const MOST_POINTS: usize = 2500;
/// The drawn quantities: name, unit, and that unit's number per degree or newton.
const QUANTITIES: [(&str, &str, f64); 3] = [("α", "°", 1.0), ("β", "°", 1.0), ("|F|", "mN", 1e3)];
const BARS: usize = 41;

/// Every n-th frame, so that at most [`MOST_POINTS`] are drawn.
fn thinned<'a>(frames: &[&'a Judged]) -> Vec<&'a Judged> {
    let step = frames.len().div_ceil(MOST_POINTS).max(1);
    frames.iter().step_by(step).copied().collect()
}

/// Figure 11: found against true.
pub(super) fn found_against_true(frames: &[Judged]) -> Vec<String> {
    let drawn = thinned(&frames.iter().collect::<Vec<_>>());
    let one = |(i, (name, unit, scale)): (usize, &(&str, &str, f64))| {
        let points: Vec<_> = drawn
            .iter()
            .map(|f| (scale * f.truth_polar[i], scale * f.found_polar[i]))
            .collect();
        // Weak forces have wildly varying angles: the axes cover the truth with a small margin.
        let axis = |label: &str| {
            let mut axis = Axis::over(label, points.iter().map(|p| p.0));
            let margin = 0.1 * (axis.range[1] - axis.range[0]);
            axis.range = [axis.range[0] - margin, axis.range[1] + margin];
            axis
        };
        let (x, y) = (
            axis(&format!("true {name}, {unit}")),
            axis(&format!("found {name}, {unit}")),
        );
        let ends = x.range.map(|end| (end, end));
        let mut plot = Plot::new(&format!("{name}: found against true"), x, y);
        plot.line(&ends, "#888");
        plot.points(&points, 1.5, COLOURS[i]);
        plot.to_svg()
    };
    QUANTITIES.iter().enumerate().map(one).collect()
}

/// Figure 12 a–c: the average error of each pose.
pub(super) fn pose_maps(averages: &BTreeMap<usize, [f64; 3]>) -> Vec<String> {
    let one = |(i, (name, unit, scale)): (usize, &(&str, &str, f64))| {
        let largest = averages
            .values()
            .map(|a| (scale * a[i]).abs())
            .fold(1e-9, f64::max);
        let x = Axis {
            label: "α, °".into(),
            range: [-10.5, 10.5],
        };
        let y = Axis {
            label: "β, °".into(),
            range: [-8.5, 8.5],
        };
        let title =
            format!("average error of {name}; red +{largest:.3}, blue −{largest:.3} {unit}");
        let mut plot = Plot::new(&title, x, y);
        for (&pose, average) in averages {
            let [alpha, beta] = PaperPoses::angles_deg(pose);
            let error = scale * average[i];
            let hint = format!("α {alpha}°, β {beta}°: {error:.3} {unit}");
            let corners = [-0.5, 0.5].map(|d| (alpha + d, beta + d));
            plot.rectangle(corners[0], corners[1], &colour(error / largest), &hint);
        }
        plot.to_svg()
    };
    QUANTITIES.iter().enumerate().map(one).collect()
}

/// White for 0, red for 1, blue for −1.
fn colour(part: f64) -> String {
    let pale = |to: f64| (255.0 + part.abs().min(1.0) * (to - 255.0)).round() as u8;
    let [r, g, b] = if part > 0.0 {
        [200.0, 30.0, 30.0]
    } else {
        [20.0, 60.0, 200.0]
    };
    format!("#{:02x}{:02x}{:02x}", pale(r), pale(g), pale(b))
}

/// Figure 12 d–f: histograms of each pose's average error, or of each frame's error without poses.
pub(super) fn histograms(values: &[[f64; 3]], of: &str) -> Vec<String> {
    let one = |(i, (name, unit, scale)): (usize, &(&str, &str, f64))| {
        let mut sizes: Vec<f64> = values.iter().map(|v| (scale * v[i]).abs()).collect();
        sizes.sort_unstable_by(f64::total_cmp);
        // Errors beyond the 99th percentile count in the outermost bars.
        let limit = sizes
            .get(sizes.len() * 99 / 100)
            .copied()
            .unwrap_or(1.0)
            .max(1e-9);
        let mut counts = [0_usize; BARS];
        for value in values {
            let place = ((scale * value[i] / limit + 1.0) / 2.0 * BARS as f64).floor();
            counts[place.clamp(0.0, (BARS - 1) as f64) as usize] += 1;
        }
        let share = |count: usize| 100.0 * count as f64 / values.len().max(1) as f64;
        let x = Axis {
            label: format!("error of {name}, {unit}"),
            range: [-limit, limit],
        };
        let tops = counts.iter().map(|&c| share(c)).chain([0.0]);
        let y = Axis::over(&format!("part of the {of}, %"), tops);
        let mut plot = Plot::new(&format!("errors of {name}"), x, y);
        for (bar, &count) in counts.iter().enumerate() {
            let edge = |b: usize| limit * (2.0 * b as f64 / BARS as f64 - 1.0);
            plot.rectangle(
                (edge(bar), 0.0),
                (edge(bar + 1), share(count)),
                COLOURS[i],
                &count.to_string(),
            );
        }
        plot.to_svg()
    };
    QUANTITIES.iter().enumerate().map(one).collect()
}

/// Figure 13: error against |F|, at the paper's four poses, or over all frames without poses.
pub(super) fn error_against_force(frames: &[Judged]) -> Vec<String> {
    let near = |alpha: f64, beta: f64| -> Vec<&Judged> {
        let there = |pose: usize| PaperPoses::angles_deg(pose) == [alpha, beta];
        frames
            .iter()
            .filter(|f| f.pose.is_some_and(there))
            .collect()
    };
    let mut parts: Vec<(String, Vec<&Judged>)> =
        [(5.0, 4.0), (-5.0, 4.0), (5.0, -4.0), (-5.0, -4.0)]
            .into_iter()
            .map(|(a, b)| (format!("errors at α = {a}°, β = {b}°"), near(a, b)))
            .filter(|(_, frames)| !frames.is_empty())
            .collect();
    parts.push(("errors of all frames".to_owned(), frames.iter().collect()));
    parts
        .iter()
        .map(|(title, frames)| against_force(title, &thinned(frames)))
        .collect()
}

fn against_force(title: &str, frames: &[&Judged]) -> String {
    let forces = frames.iter().map(|f| 1e3 * f.truth_polar[2]);
    let x = Axis::over("|F|, mN", forces.chain([0.0]));
    let mut sizes: Vec<f64> = frames
        .iter()
        .flat_map(|f| scaled_errors(f))
        .map(f64::abs)
        .collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let limit = sizes
        .get(sizes.len() * 97 / 100)
        .copied()
        .unwrap_or(1.0)
        .max(0.1);
    let y = Axis {
        label: "error".into(),
        range: [-limit, limit],
    };
    let mut plot = Plot::new(title, x, y);
    for (i, (name, unit, _)) in QUANTITIES.iter().enumerate() {
        let points: Vec<_> = frames
            .iter()
            .map(|f| (1e3 * f.truth_polar[2], scaled_errors(f)[i]))
            .collect();
        plot.points(&points, 1.8, COLOURS[i]);
        plot.name(&format!("{name}, {unit}"), COLOURS[i]);
    }
    plot.to_svg()
}

fn scaled_errors(frame: &Judged) -> [f64; 3] {
    let errors = errors(frame);
    std::array::from_fn(|i| QUANTITIES[i].2 * errors[i])
}
