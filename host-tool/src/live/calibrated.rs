//! The simulated sensor as a calibrated unit: its dots move as the unit's own model has it.
//!
//! A unit's model holds its film as mounted, stretched or not, and its camera: how the image of
//! each dot moves under any press. The simulated camera shows dots that rest and move there. So its
//! samples are that unit's answers to a press, with noise. They lack the model's own errors.

use super::camera::Kind;
use super::hand::MOST_N;
use super::pair::step;
use super::run::device_id;
use hivtac_sensor::force::forward::{Forward, Mounting, Pose, Prediction, Stiffness};
use hivtac_sensor::force::model::{Model, Origin};
use hivtac_terms::layout::EIGHT_V;
use hivtac_twin::{
    Camera, Dots, FilmError, Frame, Layout, Load, Pressed, Scene, SceneError, Shutter, units,
};

/// Largest distance of a dot of the layout `8v` from its nominal place, mm.
const NEAR_MM: f32 = 1.0;
/// Steps to the places on the film whose images are given.
const STEPS: usize = 4;

/// A calibrated unit.
#[derive(Clone, Debug)]
pub struct Calibrated {
    /// The file of its model.
    pub file: &'static [u8],
    /// Number of its microcontroller.
    pub device_id: [u8; 12],
    /// Its dots.
    pub layout: Layout,
    film: CalibratedFilm,
}

/// The film of a calibrated unit.
#[derive(Clone, Debug)]
pub struct CalibratedFilm {
    forward: Forward<'static>,
    mounting: Mounting,
    rest_px: Dots<[f64; 2]>,
    /// The force of each size on the nominal film.
    nominal: Stiffness,
}

impl Calibrated {
    /// The unit of a model file, with a camera of this kind.
    ///
    /// # Errors
    /// When it is no model, not one for this camera, or one without a film.
    pub fn of(kind: Kind, file: &'static [u8]) -> Result<Calibrated, String> {
        let model = Model::parse(file).map_err(|error| error.to_string())?;
        let device_id = match model.conditions.origin {
            Origin::Unit(id) => id,
            Origin::Simulated => device_id(kind, units::NOMINAL),
        };
        let fits = kind.fitting(device_id).check(file);
        fits.map_err(|refusal| refusal.to_string())?;
        let no_film = "the model has no film, by which a simulated one could move";
        let forward = model.forward.ok_or(no_film)?;
        let layout = match forward.rest_image.at.len() {
            4 => Layout::default(),
            _ if forward.rest_image.is_layout(&EIGHT_V, NEAR_MM) => {
                "8v".parse().map_err(|error: FilmError| error.to_string())?
            }
            _ => return Err("its dots are those of neither layout 4 nor 8v".to_owned()),
        };
        let nominal = Model::parse(kind.model(layout)).ok();
        let nominal = nominal.and_then(|model| model.forward).unwrap_or(forward);
        let of_rest = forward.rest_image.mounting(&model.rest);
        let mounting = Mounting {
            per_px: forward.per_px.unwrap_or(of_rest.per_px),
            // The tables of a unit have its dots where they are glued.
            beside_mm: of_rest.beside_mm.map(|_| [0.0; 2]),
        };
        let centroids = model.rest.features.centroids.iter();
        let rest_px = Dots::of(centroids.map(|(x, y)| [x.to_f64(), y.to_f64()]));
        Ok(Calibrated {
            file,
            device_id,
            layout,
            film: CalibratedFilm {
                forward,
                mounting,
                rest_px,
                nominal: nominal.stiffness,
            },
        })
    }

    /// A scene with this unit's dots, and its film.
    ///
    /// # Errors
    /// When the dots rest too far from their places to be simulated.
    pub fn seen(&self, mut scene: Scene) -> Result<(Scene, CalibratedFilm), SceneError> {
        let centres_mm = self.layout.centres_mm();
        for _ in 0..STEPS {
            let mut options = scene.options().clone();
            let truth = scene.truth_under(&Load::REST)?;
            let dots = options.glued_mm.iter_mut().zip(centres_mm).enumerate();
            for (dot, (glued, [x, y])) in dots {
                let Some(seen) = truth.markers.at(dot) else {
                    continue;
                };
                let off = [0, 1].map(|i| self.film.rest_px.at(dot)[i] - seen.centroid_px[i]);
                let at = [x + glued[0], y + glued[1], 0.0];
                let [right, down] = on_film(scene.camera(), at, off);
                *glued = [glued[0] + right, glued[1] + down];
            }
            scene = scene.with_options(options)?;
        }
        Ok((scene, self.film.clone()))
    }
}

/// The shift of a point along the film, mm, that moves its image by `px`.
fn on_film(camera: &Camera, [x, y, z]: [f64; 3], px: [f64; 2]) -> [f64; 2] {
    let at = |[right, down]: [f64; 2]| camera.project([x + right, y + down, z]);
    step(at([0.0; 2]), at, px)
}

impl CalibratedFilm {
    /// As [`Scene::frame_under`], with each dot where the model has it at the time of its row.
    ///
    /// # Errors
    /// When the film cannot take the load in the middle of the exposure.
    pub fn frame(
        &self,
        scene: &Scene,
        shutter: &Shutter,
        number: u64,
        load: &dyn Fn(f64) -> Load,
    ) -> Result<Frame, SceneError> {
        let now = load(0.0);
        // The scene's film completes a load, by its place.
        let taken = scene.pressed(&now)?;
        let mut pressed = Pressed {
            force_n: taken.force_n,
            ..scene.pressed(&self.on_nominal(&taken))?
        };
        let height = f64::from(scene.camera().height());
        let aims = (0..).zip(self.rest_px).map(|(dot, rest_px)| {
            let row_s = (rest_px[1] / height - 0.5) * shutter.readout_s;
            let then = scene.pressed(&load(row_s)).unwrap_or(taken);
            let moved_px = self.moved_px(&then, dot);
            [0, 1].map(|i| rest_px[i] + moved_px[i])
        });
        let aims = Dots::of(aims);
        for _ in 0..STEPS {
            let seen = scene.truth_of_pressed(pressed, &now).markers;
            let centres_mm = pressed.centres_mm;
            let dots = pressed.discs.iter_mut().zip(centres_mm).enumerate();
            for (dot, (disc, [x, y])) in dots {
                let (aim, Some(seen)) = (aims.at(dot), seen.at(dot)) else {
                    continue;
                };
                let off = [0, 1].map(|i| aim[i] - seen.centroid_px[i]);
                let [right, down, away] = disc.moved_mm;
                let shift = on_film(scene.camera(), [x + right, y + down, away], off);
                disc.moved_mm = [right + shift[0], down + shift[1], away];
            }
        }
        Ok(scene.render_pressed(pressed, &now, number))
    }

    /// The load that moves the nominal film about as this one moves the unit's: how near the dots
    /// come to the camera, and how they lean, is that film's. No load if that film cannot take it.
    fn on_nominal(&self, taken: &Pressed) -> Load {
        let size = self.pose(taken).size;
        let wanted_n = f64::from(self.nominal.magnitude_n(size)).min(MOST_N);
        let [x, y, z] = taken.force_n;
        let part = wanted_n / libm::hypot(libm::hypot(x, y), z).max(f64::MIN_POSITIVE);
        let scaled = Load::from_vector(taken.force_n.map(|force_n| part * force_n));
        let placed = scaled.and_then(|scaled| scaled.with_offset_mm(taken.touches_mm));
        placed.unwrap_or(Load::REST)
    }

    fn pose(&self, taken: &Pressed) -> Pose {
        let force_n = taken.force_n.map(|part| part as f32);
        let place_mm = taken.touches_mm.map(|part| part as f32);
        let Forward {
            stiffness, limits, ..
        } = &self.forward;
        Pose::of_force(force_n, place_mm, stiffness, limits)
    }

    /// How far a dot's image moves under a press, px.
    fn moved_px(&self, taken: &Pressed, dot: usize) -> [f64; 2] {
        let Forward { limits, tables, .. } = &self.forward;
        let beside_mm = &self.mounting.beside_mm;
        let Prediction { moved, .. } = tables.predict(&self.pose(taken), limits, beside_mm);
        let moved = [2 * dot, 2 * dot + 1].map(|k| moved.at(k));
        self.mounting.px(moved).map(f64::from)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::device::Device;
    use crate::live::eye::{Disturbances, Eye, Presses};
    use crate::live::hand::{Hand, Press};
    use crate::live::tested::Tested;
    use hivtac_terms::contact_shape::ContactShape;
    use hivtac_wire::message::{Request, Sample};

    const KIND: Kind = Kind::Ov7725;
    const PRESS: Press = Press {
        place_mm: [1.5, -1.0],
        force_n: 0.12,
        angles_deg: [4.0, -3.0],
    };

    /// The built-in model, of a film that is `times` as stiff, as a stretched one is.
    fn stiffer(times: f32) -> &'static [u8] {
        let mut file = KIND.model(Layout::default()).to_vec();
        let stiffness = Model::parse(&file).unwrap().forward.unwrap().stiffness;
        let bytes = |by: f32| {
            [stiffness.linear_n, stiffness.cubic_n]
                .map(|part| (by * part).to_le_bytes())
                .concat()
        };
        let (before, after) = (bytes(1.0), bytes(times));
        let end = file.len() - 4;
        let at = (0..end - 8).filter(|&at| file[at..at + 8] == before);
        for at in at.collect::<Vec<_>>() {
            file[at..at + 8].copy_from_slice(&after);
        }
        let sum = crc32fast::hash(&file[..end]);
        file[end..].copy_from_slice(&sum.to_le_bytes());
        file.leak()
    }

    /// The device of a unit, untouched for ten frames, then pressed: the last sample of either.
    fn samples(file: &'static [u8], touch: Press) -> [Sample; 2] {
        let unit = Calibrated::of(KIND, file).unwrap();
        let scene = KIND.scene("rest", unit.layout, 1).unwrap();
        let (scene, film) = unit.seen(scene).unwrap();
        let hand = Hand::at_once();
        let usual = Disturbances::default();
        let eye = Eye::new(KIND, scene, Presses::Scene, usual, hand.clone());
        let device = Device::with_model(KIND, unit.file, unit.device_id, 1.0);
        let mut tested = Tested::new(device, eye.unwrap().with_film(film));
        tested.greet();
        tested.ask(1, Request::SetContactShape(ContactShape::Needle));
        tested.ask(1, Request::StartWithMarkers);
        let mut last_of_ten = || (0..10).map(|_| tested.sample()).last().unwrap();
        let rest = last_of_ten();
        hand.set([Some(touch), None]);
        [rest, last_of_ten()]
    }

    /// Largest difference of coordinates, px.
    fn apart(one: &Sample, other: &Sample) -> f64 {
        let pairs = one.markers.iter().zip(other.markers.iter());
        let off = pairs.flat_map(|(a, b)| [a.x.0.abs_diff(b.x.0), a.y.0.abs_diff(b.y.0)]);
        f64::from(off.max().unwrap()) / 65_536.0
    }

    /// A stiffer film moves its dots less, and its own model finds the same force.
    #[test]
    fn a_unit_says_of_a_press_what_its_model_knows() {
        let [rest, pressed] = samples(stiffer(1.5), PRESS);
        let [_, softer] = samples(stiffer(1.0), PRESS);
        for sample in [&pressed, &softer] {
            let force = sample.force.unwrap();
            assert!((force.magnitude.0 - 120_000).abs() < 1_000, "{force:?}");
            let off = [force.alpha.0 - 4_000, force.beta.0 + 3_000];
            let most = 3 * force.direction_sigma.0;
            assert!(off.iter().all(|off| off.unsigned_abs() < most), "{force:?}");
            let place = force.place.unwrap();
            assert!((place.x.0 - 1_500).abs() < 40 && (place.y.0 + 1_000).abs() < 40);
        }
        assert!(apart(&pressed, &rest) > 5.0);
        assert!(
            apart(&pressed, &softer) > 1.0,
            "{}",
            apart(&pressed, &softer)
        );
        let lighter = Press {
            force_n: PRESS.force_n / 1.5,
            ..PRESS
        };
        let [_, same] = samples(stiffer(1.0), lighter);
        assert!(apart(&pressed, &same) < 0.15, "{}", apart(&pressed, &same));
    }

    /// The dots rest where the model has them, and move as the scene's own do, which the built-in
    /// model knows.
    #[test]
    fn the_dots_rest_where_the_model_has_them() {
        let file = KIND.model(Layout::default());
        let [rest, _] = samples(file, PRESS);
        let model = Model::parse(file).unwrap();
        let own = Sample {
            markers: model.rest.markers(),
            ..Sample::default()
        };
        assert!(apart(&rest, &own) < 0.1, "{}", apart(&rest, &own));
    }

    #[test]
    fn what_is_no_unit_of_this_camera_is_refused() {
        let other = Kind::Mt9v034.model(Layout::default());
        for (file, words) in [(&b"none"[..], "model"), (other, "another camera")] {
            let why = Calibrated::of(KIND, file).unwrap_err();
            assert!(why.contains(words), "{why}");
        }
    }
}
