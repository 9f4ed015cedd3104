//! Computes errors by the tip's distance from the film's middle.

use super::Judged;
use crate::data::loads::norm;
use crate::evaluation::bounds::PLACE_BOUND;
use crate::evaluation::errors::{WEAK_N, mean};

/// Limits of the rings of distance from the middle, mm.
const RINGS_MM: [f64; 6] = [0.0, 1.0, 2.0, 3.0, 4.0, f64::INFINITY];
/// Sizes of forces for which errors are computed, N, and the width of each, ± in parts of it.
const SIZES_N: [f64; 3] = [0.05, 0.1, 0.2];
const NEAR: f64 = 0.1;

/// Errors of a selection of the frames with a known place.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaceNumbers {
    /// The selection, in words.
    pub name: String,
    /// Number of frames.
    pub frames: usize,
    /// Root mean square of the angle between found and true force, degrees.
    pub direction_deg: f64,
    /// Root mean square error of |F|, N.
    pub magnitude_n: f64,
    /// Errors of the place; `None` for a model without places.
    pub place: Option<PlaceErrors>,
}

/// Errors of places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaceErrors {
    /// Root mean square error of p_x and p_y, mm.
    pub each_mm: f64,
    /// Part of the frames whose place error does not exceed its stated 95 % bound.
    pub within: f64,
}

/// The numbers by distance from the middle, from [`WEAK_N`] up, and by size of the force. Omits
/// selections without a frame; empty when no place is known.
pub fn by_place(frames: &[Judged]) -> Vec<PlaceNumbers> {
    let known = || frames.iter().filter_map(|f| Some((f, f.tip_mm?)));
    let weak = WEAK_N * 1e3;
    let ring = |ends: &[f64]| {
        let name = match ends[1].is_finite() {
            true => format!(
                "{} to {} mm from the middle, |F| ≥ {weak} mN",
                ends[0], ends[1]
            ),
            false => format!("{} mm from the middle and more, |F| ≥ {weak} mN", ends[0]),
        };
        let inside = |tip: [f64; 2]| (ends[0]..ends[1]).contains(&norm([tip[0], tip[1], 0.0]));
        let strong = |frame: &Judged| norm(frame.truth) >= WEAK_N;
        let frames = known().filter(|(frame, tip)| strong(frame) && inside(*tip));
        numbers(name, frames.collect())
    };
    let size = |size: &f64| {
        let name = format!("{} mN ± {} %", size * 1e3, NEAR * 1e2);
        let near = |frame: &Judged| (norm(frame.truth) / size - 1.0).abs() <= NEAR;
        numbers(name, known().filter(|(frame, _)| near(frame)).collect())
    };
    let rings = RINGS_MM.windows(2).filter_map(ring);
    rings.chain(SIZES_N.iter().filter_map(size)).collect()
}

fn numbers(name: String, frames: Vec<(&Judged, [f64; 2])>) -> Option<PlaceNumbers> {
    if frames.is_empty() {
        return None;
    }
    let root = |of: fn(&Judged) -> f64| {
        let squares = frames.iter().map(|(frame, _)| of(frame).powi(2));
        mean(squares).sqrt()
    };
    Some(PlaceNumbers {
        name,
        frames: frames.len(),
        direction_deg: root(|f| f.direction_deg),
        magnitude_n: root(|f| f.found_polar[2] - f.truth_polar[2]),
        place: place_errors(&frames),
    })
}

fn place_errors(frames: &[(&Judged, [f64; 2])]) -> Option<PlaceErrors> {
    let off = |(frame, tip): &(&Judged, [f64; 2])| {
        let (found, sigma_mm) = frame.found_place?;
        let off = norm([found[0] - tip[0], found[1] - tip[1], 0.0]);
        Some((off, PLACE_BOUND * sigma_mm))
    };
    let off: Vec<(f64, f64)> = frames.iter().map(off).collect::<Option<_>>()?;
    let within = off.iter().filter(|(off, bound)| off <= bound).count();
    Some(PlaceErrors {
        each_mm: mean(off.iter().map(|(off, _)| off * off / 2.0)).sqrt(),
        within: within as f64 / off.len() as f64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(force_n: f64, tip_mm: [f64; 2], off_mm: f64) -> Judged {
        Judged {
            truth: [0.0, 0.0, -force_n],
            truth_polar: [0.0, 0.0, force_n],
            found_polar: [0.0, 0.0, force_n + 1e-3],
            direction_deg: 0.5,
            direction_sigma_deg: 0.2,
            magnitude_sigma_n: 1e-3,
            tip_mm: Some(tip_mm),
            found_place: Some(([tip_mm[0] + off_mm, tip_mm[1]], 0.1)),
            session: 0,
            pose: None,
        }
    }

    #[test]
    fn frames_are_distinguished_by_place_and_size() {
        let frames = [
            frame(0.1, [0.5, 0.0], 0.2),
            frame(0.1, [0.0, -0.9], 0.3),
            frame(0.15, [3.0, 2.0], 0.1),
            frame(0.03, [0.0, 0.0], 9.0),
            frame(0.15, [-4.0, 4.0], 0.1),
        ];
        let parts = by_place(&frames);
        let counts: Vec<usize> = parts.iter().map(|part| part.frames).collect();
        assert_eq!(counts, [2, 1, 1, 2], "{parts:?}");
        let near = &parts[0];
        assert!(near.name.starts_with("0 to 1 mm") && parts[3].name.starts_with("100 mN"));
        let place = near.place.unwrap();
        assert!(
            (place.each_mm - (0.13_f64 / 4.0).sqrt()).abs() < 1e-12,
            "{place:?}"
        );
        assert_eq!(place.within, 0.5, "0.245 mm is the bound");
        assert!((near.direction_deg - 0.5).abs() < 1e-12);
        assert!((near.magnitude_n - 1e-3).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_known_has_no_number() {
        let mut frame = frame(0.1, [0.5, 0.0], 0.2);
        frame.found_place = None;
        assert!(by_place(&[frame]).iter().all(|part| part.place.is_none()));
        frame.tip_mm = None;
        assert!(by_place(&[frame]).is_empty());
    }
}
