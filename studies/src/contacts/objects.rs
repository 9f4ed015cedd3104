//! Draws objects that press the film, and solves the film under them, with the truth.

use anyhow::{Context, Result};
use hivtac_shell::{Body, Ends, Equilibrium, Film, Patch, Shape};
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::units::Micrometres;
use hivtac_twin::film::reduced::NOMINAL_RADIUS_MM;
use hivtac_twin::{Load, MARKER_REST_MM};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use crate::press::{ANGLE_DEG, REACH_MM, seeded};

/// Forces, N.
const FORCES_N: [f64; 2] = [0.02, 0.25];
/// The largest tilt of a face, degrees.
const TILT_DEG: f64 = 5.0;
/// Largest distance of presses near a dot from its centre, along x and along y, mm.
const BESIDE_MM: f64 = 1.5;
/// Radii of flat faces, of cylinders and of balls, mm.
const FACES_MM: [f64; 2] = [1.0, 3.0];
const CYLINDER_MM: f64 = 0.8;
/// Largest torque over the force of a needle and of a disc that turn, mm: some friction times two
/// thirds of the radius.
const ARMS_MM: [f64; 2] = [0.5, 1.0];

/// A kind of objects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// The model's own tip.
    Needle,
    /// A soft disc with Hertz's pressure, with a radius in this range, mm.
    Disc([f64; 2]),
    /// A rigid flat face, straight.
    Face,
    /// A rigid flat face, tilted.
    TiltedFace,
    /// A finger's pad.
    Pad,
    /// A rigid cylinder with rounded ends and this length, mm, lying on the film.
    Cylinder(f64),
    /// A rigid ball of this diameter, mm.
    Ball(f64),
    /// The model's own tip, which also turns.
    TurnedNeedle,
    /// A soft disc that also turns, with a radius in this range, mm.
    TurnedDisc([f64; 2]),
}

/// All kinds.
pub const KINDS: [Kind; 13] = [
    Kind::Needle,
    Kind::Disc([0.25, 1.0]),
    Kind::Disc([1.0, 2.5]),
    Kind::Disc([2.5, 4.0]),
    Kind::Face,
    Kind::TiltedFace,
    Kind::Pad,
    Kind::Cylinder(6.0),
    Kind::Cylinder(12.0),
    Kind::Ball(10.0),
    Kind::Ball(40.0),
    Kind::TurnedNeedle,
    Kind::TurnedDisc([1.0, 2.5]),
];

/// The object that presses.
enum Object {
    /// A pressure that is known before.
    Patch(Patch),
    /// A body whose pressure follows from its contact.
    Body(Body),
}

/// A press of an object.
#[derive(Clone, Debug)]
pub struct Press {
    /// The object's kind.
    pub kind: Kind,
    /// Its shape, if the sensor has a setting for it.
    pub shape: Option<ContactShape>,
    /// The film under it.
    pub state: Equilibrium,
    /// The true force on the film, N, film frame.
    pub force_n: [f64; 3],
    /// The z component of the true torque along the film's normal, N·mm.
    pub torque_nmm: f64,
    /// The true centre of pressure, mm: the mean of the points of the mounted film that touch,
    /// weighted by the normal pressure.
    pub centre_mm: [f64; 2],
}

/// Solves presses of all kinds on a film, `of_each` of each, on all threads. They come by kind, in
/// the order of [`KINDS`], each kind in the order of its draws, anywhere or near dots only. A press
/// whose contact reaches too far for the solver is left out, and named on stderr.
pub fn presses(film: &Film, of_each: u32, seed: u64, near_dots: bool) -> Vec<Press> {
    let draws = KINDS
        .into_iter()
        .flat_map(|kind| (0..of_each).map(move |number| (kind, number)));
    let solved = draws.collect::<Vec<_>>().into_par_iter();
    let solved = solved.map(|(kind, number)| {
        let press = kind.press(film, seed, number, near_dots);
        press.inspect_err(|why| eprintln!("left out: {why:#}")).ok()
    });
    solved.collect::<Vec<_>>().into_iter().flatten().collect()
}

impl Object {
    /// The film under it with a force, N, and a torque, N·mm, and the centre of the pressure, mm.
    /// A body does not turn.
    fn press(
        self,
        film: &Film,
        force_n: [f64; 3],
        torque_nmm: f64,
    ) -> Result<(Equilibrium, [f64; 2])> {
        Ok(match self {
            Object::Patch(patch) if torque_nmm != 0.0 => {
                let state = film.press_twisted(&patch, force_n, torque_nmm, &film.rest());
                (state?, patch.centre_mm())
            }
            Object::Patch(patch) => {
                let state = film.press_patch(&patch, force_n, &film.rest());
                (state?, patch.centre_mm())
            }
            Object::Body(body) => {
                let touch = film.press_body(&body, force_n, &film.rest())?;
                (touch.state, touch.patch.centre_mm())
            }
        })
    }
}

impl Kind {
    /// Returns the kind in words.
    pub fn name(self) -> String {
        match self {
            Kind::Needle => "needle".into(),
            Kind::Disc([from, to]) => format!("soft disc, {from} to {to} mm"),
            Kind::Face => format!("flat face, {} to {} mm", FACES_MM[0], FACES_MM[1]),
            Kind::TiltedFace => format!("the same, tilted to {TILT_DEG}°"),
            Kind::Pad => "finger's pad, 4 × 2.5 mm".into(),
            Kind::Cylinder(length) => format!("cylinder of {length} mm"),
            Kind::Ball(diameter) => format!("ball of {diameter} mm"),
            Kind::TurnedNeedle => format!("needle that turns, to {} N·mm/N", ARMS_MM[0]),
            Kind::TurnedDisc([from, to]) => {
                format!(
                    "soft disc, {from} to {to} mm, that turns, to {} N·mm/N",
                    ARMS_MM[1]
                )
            }
        }
    }

    /// Draws press `number` of this kind and solves it: the same for the same seed, however many
    /// are drawn. Its place is anywhere within [`REACH_MM`], or [near a dot](beside_a_dot).
    ///
    /// # Errors
    /// If the film finds no rest under it.
    pub fn press(self, film: &Film, seed: u64, number: u32, near_dots: bool) -> Result<Press> {
        let mut random = seeded(seed);
        let index = KINDS
            .iter()
            .position(|kind| *kind == self)
            .unwrap_or(KINDS.len());
        random.set_stream((index as u64) << 32 | u64::from(number));
        let mut between = |[from, to]: [f64; 2]| random.random_range(from..=to);
        let force_n = between(FORCES_N);
        let [alpha_deg, beta_deg] = [(); 2].map(|()| between([-ANGLE_DEG, ANGLE_DEG]));
        let anywhere_mm = [(); 2].map(|()| between([-REACH_MM, REACH_MM]));
        let place_mm = match near_dots {
            true => beside_a_dot(anywhere_mm),
            false => anywhere_mm,
        };
        let load = Load::from_angles(force_n, alpha_deg, beta_deg)?;
        let (name, object, shape) = self.object(place_mm, &mut random)?;
        let arm_mm = self.arm_mm();
        let torque_nmm = force_n * random.random_range(-arm_mm..=arm_mm);
        let [x, y] = place_mm;
        let (state, centre_mm) = (object.press(film, load.vector_n(), torque_nmm))
            .with_context(|| format!("{name} at ({x:.2}, {y:.2}) mm, {:.0} mN", 1e3 * force_n))?;
        Ok(Press {
            kind: self,
            shape,
            state,
            force_n: load.vector_n(),
            torque_nmm,
            centre_mm,
        })
    }

    /// The largest torque of a kind over its force, mm.
    pub fn arm_mm(self) -> f64 {
        match self {
            Kind::TurnedNeedle => ARMS_MM[0],
            Kind::TurnedDisc(_) => ARMS_MM[1],
            _ => 0.0,
        }
    }

    /// Draws an object over a point of the film, mm.
    fn object(
        self,
        place_mm: [f64; 2],
        random: &mut ChaCha8Rng,
    ) -> Result<(String, Object, Option<ContactShape>)> {
        let mut between = |[from, to]: [f64; 2]| random.random_range(from..=to);
        let turned = |shape, turned_deg| Body {
            turned_deg,
            ..Body::rigid(shape, place_mm)
        };
        let body = |body: Body| Object::Body(body);
        let micrometres = |mm: f64| Micrometres((1e3 * mm).round() as u32);
        let flat = |radius_mm| Some(ContactShape::Flat(micrometres(radius_mm)));
        Ok(match self {
            Kind::Needle | Kind::TurnedNeedle => {
                let tip = Object::Patch(Patch::tip(place_mm, NOMINAL_RADIUS_MM)?);
                ("needle".into(), tip, Some(ContactShape::Needle))
            }
            Kind::Disc(range) | Kind::TurnedDisc(range) => {
                let radius = between(range);
                let name = format!("soft disc of {radius:.2} mm");
                let disc = Object::Patch(Patch::disc(place_mm, radius)?);
                (name, disc, Some(ContactShape::Round(micrometres(radius))))
            }
            Kind::Face => {
                let radius_mm = between(FACES_MM);
                let name = format!("flat face of {radius_mm:.2} mm");
                let face = body(turned(Shape::Face { radius_mm }, 0.0));
                (name, face, flat(radius_mm))
            }
            Kind::TiltedFace => {
                let radius_mm = between(FACES_MM);
                let (turned_deg, tilt_deg) = (between([0.0, 360.0]), between([0.0, TILT_DEG]));
                let face = turned(Shape::Face { radius_mm }, turned_deg);
                let name = format!("flat face of {radius_mm:.2} mm, tilted by {tilt_deg:.1}°");
                (name, body(Body { tilt_deg, ..face }), flat(radius_mm))
            }
            Kind::Pad => {
                let turned_deg = between([0.0, 180.0]);
                let name = format!("pad at {turned_deg:.0}°");
                (name, body(Body::pad(place_mm, turned_deg)), None)
            }
            Kind::Cylinder(length_mm) => {
                let turned_deg = between([0.0, 180.0]);
                let shape = Shape::Cylinder {
                    radius_mm: CYLINDER_MM,
                    length_mm,
                    ends: Ends::Rounded,
                };
                let name = format!("cylinder of {length_mm} mm at {turned_deg:.0}°");
                (name, body(turned(shape, turned_deg)), None)
            }
            Kind::Ball(diameter) => {
                let radius_mm = diameter / 2.0;
                let name = format!("ball of {diameter} mm");
                (name, body(turned(Shape::Sphere { radius_mm }, 0.0)), None)
            }
        })
    }
}

/// Maps a place within [`REACH_MM`] to one that is at most [`BESIDE_MM`] from a dot's centre along
/// x and along y, and within that reach: each quadrant to its own dot.
fn beside_a_dot(place_mm: [f64; 2]) -> [f64; 2] {
    place_mm.map(|part| {
        let beside = BESIDE_MM * (2.0 * part.abs() / REACH_MM - 1.0);
        (MARKER_REST_MM + beside).min(REACH_MM).copysign(part)
    })
}
