//! `scene dimensions`: the lengths that a real sensor shares with the simulated one, for
//! `hardware/`.

use anyhow::{Context, Result};
use clap::Args;
use hivtac_shell::Design;
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_twin::film::{Film, HALF_SIDE_MM, Load, MARKER_CENTRES_MM, MARKER_RADIUS_MM};
use hivtac_twin::film::{MAX_FORCE_N, Pressed};
use hivtac_twin::{FILM_DISTANCE_MM, units};
use serde_json::{Value, json};

use crate::press::REACH_MM;

/// The cameras that a sensor can be built with, with the size of their frames.
const CAMERAS: [(Preset, u16, u16); 2] = [(Preset::Ov7725, 320, 240), (Preset::Mt9v034, 160, 152)];
/// Presses along each axis, from −[`REACH_MM`] to it, for the film's lowest surface.
const PRESSES: i32 = 4;
/// Distances from the middle at which that surface is printed: the first, the step and their
/// number, mm.
const STEP_MM: f64 = 1.0;
const STEPS: i32 = 14;
/// Number of directions in which it is measured.
const RAYS: i32 = 24;

/// Arguments of `scene dimensions`.
#[derive(Args)]
pub struct DimensionsArgs {}

impl DimensionsArgs {
    pub(super) fn run(&self) -> Result<()> {
        println!("{}", serde_json::to_string_pretty(&dimensions()?)?);
        Ok(())
    }
}

/// All dimensions; lengths in mm, forces in N.
fn dimensions() -> Result<Value> {
    let design = Design::default();
    let cameras = CAMERAS.map(|(preset, width, height)| {
        let focal_px = Geometry::preset(preset, width, height).focal.to_f64();
        json!({ "preset": preset.name(), "width": width, "height": height, "focal_px": focal_px })
    });
    let lowest = lowest_mm()?;
    Ok(json!({
        "film_distance_mm": FILM_DISTANCE_MM,
        "film_thickness_mm": design.material.thickness_mm,
        "post_mm": HALF_SIDE_MM,
        "marker_centres_mm": MARKER_CENTRES_MM,
        "marker_diameter_mm": 2.0 * MARKER_RADIUS_MM,
        "reach_mm": REACH_MM,
        "largest_force_n": MAX_FORCE_N,
        "travel_mm": [[0.1, travel_mm(0.1)?], [0.2, travel_mm(0.2)?], [MAX_FORCE_N, travel_mm(MAX_FORCE_N)?]],
        "lowest_mm": lowest,
        "marker_tolerance_mm": units::MARKER_MM,
        "post_tolerance_mm": units::POST_MM,
        "roll_tolerance_deg": units::ROLL_DEG,
        "shift_tolerance_px": units::MIDDLE_PX,
        "cameras": cameras,
    }))
}

/// How deep a tip goes in the film's middle under a force, N; in steps of a micrometre.
fn travel_mm(force_n: f64) -> Result<f64> {
    let pressed = press(force_n, [0.0; 2])?;
    Ok(rounded(-pressed.tip_mm[2]))
}

/// The lowest place of the film's camera side under any press of the largest force within the
/// reach: pairs of the distance from the middle, mm, and the place along the axis, mm.
fn lowest_mm() -> Result<Vec<[f64; 2]>> {
    let at = |k: i32| REACH_MM * f64::from(k) / f64::from(PRESSES);
    let places =
        (-PRESSES..=PRESSES).flat_map(|x| (-PRESSES..=PRESSES).map(move |y| [at(x), at(y)]));
    let all: Vec<Pressed> = places
        .map(|place_mm| press(MAX_FORCE_N, place_mm))
        .collect::<Result<_>>()?;
    let lowest = |step: i32| {
        let from_middle = STEP_MM * f64::from(step);
        let rays = (0..RAYS).map(|ray| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(ray) / f64::from(RAYS)).sin_cos();
            [from_middle * cos, from_middle * sin]
        });
        let depths = rays.flat_map(|place| all.iter().map(move |film| film.displacement(place)[2]));
        [from_middle, rounded(depths.fold(0.0, f64::min))]
    };
    Ok((0..STEPS).map(lowest).collect())
}

fn press(force_n: f64, place_mm: [f64; 2]) -> Result<Pressed> {
    let load = Load::from_angles(force_n, 0.0, 0.0)?.with_offset_mm(place_mm)?;
    let film = Film::default();
    film.check(&load).context("the film's tables end before")?;
    Ok(film.press(&load))
}

fn rounded(length_mm: f64) -> f64 {
    (1000.0 * length_mm).round() / 1000.0
}
