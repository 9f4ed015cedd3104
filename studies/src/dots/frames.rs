//! Frames of the film with another layout of dots, through the sensor's own code: all dots seen,
//! one lost, in glare, or moved on the film.

use anyhow::{Result, anyhow};
use hivtac_calibration::evaluation::errors::angle_deg;
use hivtac_calibration::forward::{layout_model, layout_scene, rest_of, untared};
use hivtac_sensor::force::Force;
use hivtac_sensor::force::forward::Drift;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::pipeline::Sensor;
use hivtac_terms::status::Status;
use hivtac_twin::film::{Dots, Layout};
use hivtac_twin::{Load, Options, Paint, Patch, Scene};
use rand::Rng;
use rayon::prelude::*;
use serde::Serialize;

use super::{Found, STEPS, TILT_DEG};
use crate::press::seeded;

/// The largest distance of a press from the middle along each axis, mm; forces, N.
const WITHIN_MM: f64 = 4.0;
const FORCES_N: [f64; 2] = [0.05, 0.2];
/// The number of the first frame of a tare.
const TARE_FRAMES: u64 = 1_000_000;
/// Millimetres of film that a marker moves by for 0.1 px of its image.
const TENTH_OF_A_PX_MM: f64 = 0.0058;
/// Radius of glare, mm.
const GLARE_MM: f64 = 0.1;

/// What happens to one dot after the tare.
#[derive(Clone, Copy, Serialize)]
enum Fault {
    None,
    Lost,
    Glare,
    Moved,
    MovedFar,
}

const FAULTS: [(Fault, &str); 5] = [
    (Fault::None, "none"),
    (Fault::Lost, "a dot is covered"),
    (Fault::Glare, "glare of 0.1 mm on a dot's rim"),
    (Fault::Moved, "a dot moved by 0.1 px"),
    (Fault::MovedFar, "a dot moved by 0.5 px"),
];

/// The results of a fault.
#[derive(Serialize)]
pub struct Row {
    fault: &'static str,
    /// Percentage of frames with a force, and of those that go on without a dot.
    kept: f64,
    without: f64,
    /// Root mean square of the errors: direction, degrees; |F|, mN; place, µm.
    errors: [f64; 3],
    /// Percentage within the stated 95 %.
    within: [f64; 3],
}

/// The results of all faults, of this many frames each.
pub fn rows(layout: Layout, frames: u32) -> Result<Vec<Row>> {
    let spec = layout_model(layout, STEPS)?;
    let file = spec.encode().map_err(|error| anyhow!("{error}"))?;
    let model = Model::parse(&file).map_err(|error| anyhow!("{error}"))?;
    let rows = FAULTS.iter().map(|(fault, name)| {
        let dots = layout.count();
        let each = frames.div_ceil(dots as u32);
        let found: Result<Vec<Vec<_>>> = (0..dots)
            .into_par_iter()
            .map(|dot| of_dot(&model, layout, *fault, dot, each))
            .collect();
        Ok(row(name, &found?.concat()))
    });
    rows.collect()
}

/// What the frames with a fault of this dot tell: the force's errors, and whether it goes on
/// without a dot; `None` without a force.
fn of_dot(
    model: &Model<'_>,
    layout: Layout,
    fault: Fault,
    dot: usize,
    frames: u32,
) -> Result<Vec<Option<(Found, bool)>>> {
    let nominal = layout_scene(layout)?;
    let mut sensor = tared(model, &nominal)?;
    let mut options = nominal.options().clone();
    spoil(&mut options, layout, fault, dot);
    let scene = nominal.with_options(options)?;
    let mut random = seeded(dot as u64);
    let mut found = Vec::new();
    for number in 0..frames {
        let mut between = |most: f64| random.random_range(-most..most);
        let [alpha, beta] = [TILT_DEG; 2].map(&mut between);
        let place_mm = [WITHIN_MM; 2].map(&mut between);
        let force_n = random.random_range(FORCES_N[0]..FORCES_N[1]);
        let load = Load::from_angles(force_n, alpha, beta)?.with_offset_mm(place_mm)?;
        let number = 1_000 * (dot as u64 + 1) + u64::from(number);
        let frame = scene.render_load(&load, number)?;
        sensor.forget_frame();
        let seen = sensor.measure_frame_closely(&frame.to_rgb565());
        let without = seen.status.contains(Status::MARKER_LOST);
        found.push(seen.force.map(|force| (judged(&force, &load), without)));
    }
    Ok(found)
}

/// A sensor with this model, tared on this scene. What presses is known to be a needle.
fn tared<'m>(model: &Model<'m>, scene: &Scene) -> Result<Box<Sensor<'m>>> {
    let mut sensor = untared(model)?;
    let rest = rest_of(&mut sensor, scene, TARE_FRAMES)?;
    sensor.set_tare(Some(rest), Drift::NONE);
    Ok(sensor)
}

fn spoil(options: &mut Options, layout: Layout, fault: Fault, dot: usize) {
    let moved = |times: f64| {
        let mut glued_mm = Dots::defaults(layout.count());
        glued_mm[dot] = [0.6, 0.8].map(|part| times * TENTH_OF_A_PX_MM * part);
        glued_mm
    };
    match fault {
        Fault::None => {}
        Fault::Lost => options.missing = Dots::from_fn(layout.count(), |other| other == dot),
        Fault::Glare => {
            let (sin, cos) = (dot as f64).sin_cos();
            let [x, y] = layout.centres_mm()[dot];
            let radius_mm = layout.diameter_mm() / 2.0;
            options.patches.push(Patch {
                centre_mm: [x + radius_mm * cos, y + radius_mm * sin],
                radius_mm: GLARE_MM,
                paint: Paint::Glare,
            });
        }
        Fault::Moved => options.glued_mm = moved(1.0),
        Fault::MovedFar => options.glued_mm = moved(5.0),
    }
}

fn judged(force: &Force, load: &Load) -> Found {
    let newtons = force.cartesian.map(|part| f64::from(part.0) * 1e-6);
    let magnitude_n = newtons.iter().map(|part| part * part).sum::<f64>().sqrt();
    let direction = newtons.map(|part| part / magnitude_n);
    let true_direction = load.vector_n().map(|part| part / load.magnitude_n());
    let ([x, y], place) = (load.offset_mm().map(|part| 1e3 * part), force.place);
    Found {
        errors: [
            angle_deg(direction, true_direction).unwrap_or(180.0),
            1e3 * (magnitude_n - load.magnitude_n()).abs(),
            place.map_or(f64::INFINITY, |place| {
                (f64::from(place.x.0) - x).hypot(f64::from(place.y.0) - y)
            }),
        ],
        sigma: [
            1e-3 * f64::from(force.direction_sigma.0),
            1e-3 * f64::from(force.magnitude_sigma.0),
            place.map_or(0.0, |place| f64::from(place.sigma.0)),
        ],
    }
}

fn row(fault: &'static str, all: &[Option<(Found, bool)>]) -> Row {
    let found: Vec<&(Found, bool)> = all.iter().flatten().collect();
    let percent = |part: usize, of: usize| 100.0 * part as f64 / of.max(1) as f64;
    let rms = |k: usize| {
        let squares = found.iter().map(|(found, _)| found.errors[k].powi(2));
        (squares.sum::<f64>() / found.len().max(1) as f64).sqrt()
    };
    let within = |k: usize| {
        let within = found
            .iter()
            .filter(|(own, _)| own.errors[k] <= own.limit(k));
        percent(within.count(), found.len())
    };
    Row {
        fault,
        kept: percent(found.len(), all.len()),
        without: percent(
            found.iter().filter(|(_, without)| *without).count(),
            all.len(),
        ),
        errors: [0, 1, 2].map(rms),
        within: [0, 1, 2].map(within),
    }
}

impl Row {
    /// The head of the table of rows.
    pub const HEAD: &str = "| fault | a force | without a dot | direction | \\|F\\| | place | \
                            within the stated 95 % |\n|---|--:|--:|--:|--:|--:|--:|\n";

    /// Its line in that table.
    pub fn line(&self) -> String {
        let ([off_deg, off_mn, off_um], [direction, magnitude, place]) = (self.errors, self.within);
        format!(
            "| {} | {:.1} % | {:.1} % | {off_deg:.3}° | {off_mn:.3} mN | {off_um:.1} µm | \
             {direction:.0}, {magnitude:.0}, {place:.0} % |\n",
            self.fault, self.kept, self.without,
        )
    }
}
