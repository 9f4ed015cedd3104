//! The film run forwards for any layout of dots: its tables come from those of the whole film, so
//! that a layout needs no new finite elements.

use anyhow::Result;
use hivtac_sensor::force::forward::{Markers, Noise, Stiffness};
use hivtac_sensor::force::model::ForwardSpec;
use hivtac_twin::Camera;
use hivtac_twin::film::reduced::{NOMINAL_RADIUS_MM, Unit};
use hivtac_twin::film::{Film, Layout};

use super::tables::{Dot, UnitSetup, tables};
use super::{limits, rest_image};

/// Nodes of a dot's table along each axis.
const NODES: usize = 16;

/// The nominal film with the dots of a layout, under a needle within ±`last_mm` along each axis.
/// Also the error of its tables, root mean square, focal lengths. `noise_px` is that of a dot's
/// coordinates, px of the camera.
///
/// # Errors
/// When the motion does not fit into tables.
pub fn of_layout(
    layout: Layout,
    last_mm: f64,
    steps: u8,
    noise_px: f64,
    camera: &Camera,
) -> Result<(ForwardSpec, f64)> {
    let film = Film::default().with_layout(layout)?;
    let setup = UnitSetup {
        unit: Unit::default(),
        tip_radius_mm: NOMINAL_RADIUS_MM,
        camera,
    };
    let places_mm = film.markers_mm();
    let dots = places_mm
        .iter()
        .map(|place| Dot::within(*place, NODES, last_mm));
    let dots: Vec<Dot> = dots.collect();
    let (tables, left) = tables(&dots, |pose, dot| setup.moved(&film, pose, dot))?;
    let [linear_n, cubic_n] = setup.stiffness_n().map(|part| part as f32);
    let spec = ForwardSpec {
        steps,
        limits: limits(),
        stiffness: Stiffness { linear_n, cubic_n },
        rest_image: rest_image(&places_mm, camera),
        per_px: None,
        noise: Noise {
            rest_px: Markers::defaults(places_mm.len()),
            at_rest_px: [noise_px as f32; 2],
            at_four_areas: [1.0; 2],
        },
        tables,
        own: None,
        other: None,
        weight: None,
    };
    Ok((spec, left))
}
