//! Hard cases on the film: extra things, and damaged markers.

use super::{Expected, HardCase, patched};
use crate::film::Dots;
use crate::{MARKERS, Options, Paint, Patch, Specks};

/// The marker that a case changes: upper right.
const TARGET: usize = 1;

fn patch(centre_mm: [f64; 2], radius_mm: f64, paint: Paint) -> Patch {
    Patch {
        centre_mm,
        radius_mm,
        paint,
    }
}

/// Returns a place at a distance, mm, from the target marker's centre towards the film's middle.
fn inwards(distance_mm: f64) -> [f64; 2] {
    let [x, y] = MARKERS[TARGET].centre_mm;
    let step = distance_mm * std::f64::consts::FRAC_1_SQRT_2;
    [x - step, y + step]
}

/// Red things in addition to the markers.
pub(super) fn red_things() -> Vec<HardCase> {
    let case = |(name, what, expected, centre_mm, radius_mm)| {
        HardCase::new(name, what, expected, move |_| {
            patched(vec![patch(centre_mm, radius_mm, Paint::Red)])
        })
    };
    use Expected::Either;
    let cases: [(&str, &str, Expected, [f64; 2], f64); 8] = [
        (
            "red-same-size",
            "a fifth disc like a marker, in the middle",
            Either,
            [0.3, -0.2],
            0.5,
        ),
        (
            "red-same-size-aside",
            "a fifth disc like a marker, between two",
            Either,
            [3.7, 0.4],
            0.5,
        ),
        (
            "red-larger",
            "a red disc of twice the size",
            Either,
            [0.5, 1.0],
            1.0,
        ),
        (
            "red-huge",
            "a red disc of six times the size",
            Either,
            [0.0, 0.5],
            3.0,
        ),
        (
            "red-near",
            "a fifth disc a marker's width from one",
            Either,
            inwards(1.6),
            0.5,
        ),
        (
            "red-touching",
            "a red disc that touches a marker",
            Either,
            inwards(1.0),
            0.5,
        ),
        (
            "red-overlapping",
            "a red disc half over a marker",
            Either,
            inwards(0.5),
            0.5,
        ),
        (
            "red-hiding",
            "a red disc that hides a marker",
            Either,
            inwards(0.4),
            1.0,
        ),
    ];
    cases.into_iter().map(case).collect()
}

/// Two markers joined by a red bridge.
pub(super) fn merged() -> Vec<HardCase> {
    let case = |(from, to): (usize, usize)| {
        let name = format!("merged-{from}-{to}");
        HardCase::new(
            name,
            "a red bridge between two markers",
            Expected::Either,
            move |_| {
                patched(stripe(
                    MARKERS[from].centre_mm,
                    MARKERS[to].centre_mm,
                    0.2,
                    Paint::Red,
                ))
            },
        )
    };
    [(0, 1), (1, 2), (0, 2)].into_iter().map(case).collect()
}

/// Returns discs in a row that together form a stripe of a half width, mm.
fn stripe(from_mm: [f64; 2], to_mm: [f64; 2], half_mm: f64, paint: Paint) -> Vec<Patch> {
    let (dx, dy) = (to_mm[0] - from_mm[0], to_mm[1] - from_mm[1]);
    let count = ((dx * dx + dy * dy).sqrt() / half_mm * 2.0).ceil().max(1.0);
    let at = |i: u32| {
        let part = f64::from(i) / count;
        let centre_mm = [from_mm[0] + part * dx, from_mm[1] + part * dy];
        patch(centre_mm, half_mm, paint)
    };
    (0..=count as u32).map(at).collect()
}

/// Markers that came off.
pub(super) fn missing() -> Vec<HardCase> {
    let without = |name: String, what: &str, gone: &'static [usize], patches: Vec<Patch>| {
        // Three markers may have a force; one in place of a lost marker may not.
        let expected = match gone.len() == 1 && patches.is_empty() {
            true => Expected::Either,
            false => Expected::Rejected,
        };
        HardCase::new(name, what, expected, move |_| Options {
            missing: Dots::from_fn(4, |id| gone.contains(&id)),
            ..patched(patches.clone())
        })
    };
    let mut cases: Vec<HardCase> = [(0, &[0]), (1, &[1]), (2, &[2]), (3, &[3])]
        .map(|(id, gone): (usize, &'static [usize; 1])| {
            without(
                format!("missing-{id}"),
                "a marker has come off",
                gone,
                Vec::new(),
            )
        })
        .into();
    cases.push(without(
        "missing-all".into(),
        "all markers have come off",
        &[0, 1, 2, 3],
        Vec::new(),
    ));
    let [x, y] = inwards(1.2);
    cases.push(without(
        "missing-replaced".into(),
        "a marker has come off, and something red of its size lies beside its place",
        &[TARGET],
        vec![patch([x, y], 0.5, Paint::Red)],
    ));
    cases
}

/// A marker that a stripe of the film's colour cuts in two, or that is bitten from a side.
pub(super) fn cut() -> Vec<HardCase> {
    let [x, y] = MARKERS[TARGET].centre_mm;
    let through = move |width_mm: f64| {
        let name = format!("cut-{width_mm:.2}-mm");
        let what = "a stripe through a marker, in the film's colour";
        HardCase::new(name, what, Expected::Either, move |_| {
            // The stripe is a little off the middle, to make unequal halves.
            let (x, half) = (x + 0.1, width_mm / 2.0);
            patched(stripe([x, y - 0.7], [x, y + 0.7], half, Paint::Film))
        })
    };
    let bitten = |depth_mm: f64| {
        let name = format!("bitten-{depth_mm:.2}-mm");
        let what = "a marker covered from one side";
        HardCase::new(name, what, Expected::Either, move |_| {
            patched(vec![patch(inwards(1.5 - depth_mm), 1.0, Paint::Film)])
        })
    };
    let mut cases: Vec<HardCase> = [0.05, 0.1, 0.2, 0.3, 0.5].map(through).into();
    cases.extend([0.1, 0.25, 0.5, 0.8].map(bitten));
    cases
}

/// A lamp's reflection on a marker.
pub(super) fn glare() -> Vec<HardCase> {
    let case = |(radius_mm, distance_mm, where_on): (f64, f64, &str)| {
        let name = format!("glare{where_on}-{radius_mm:.2}-mm");
        let what = "a lamp's reflection on a marker";
        HardCase::new(name, what, Expected::Either, move |_| {
            patched(vec![patch(inwards(distance_mm), radius_mm, Paint::Glare)])
        })
    };
    let cases = [
        (0.1, 0.05, ""),
        (0.2, 0.1, ""),
        (0.4, 0.0, ""),
        (0.1, 0.45, "-rim"),
        (0.25, 0.4, "-rim"),
    ];
    cases.into_iter().map(case).collect()
}

/// Red specks and squares.
pub(super) fn dirt() -> Vec<HardCase> {
    let specks = |count: u32, radius_mm: f64, name: &str| {
        let what = format!("{count} red specks of {radius_mm} mm");
        HardCase::new(name, what, Expected::Either, move |_| Options {
            specks: Specks { count, radius_mm },
            ..Options::default()
        })
    };
    let board = |side: u32| {
        let name = format!("checkerboard-{side}-px");
        let what = "markers on a red checkerboard";
        HardCase::new(name, what, Expected::Rejected, move |_| Options {
            checkerboard_px: side,
            ..Options::default()
        })
    };
    let mut cases = vec![
        specks(2000, 0.05, "specks-2000"),
        specks(2000, 0.02, "specks-2000-fine"),
        specks(100, 0.1, "specks-100-coarse"),
    ];
    cases.extend([1, 4, 12].map(board));
    cases
}
