//! A simulated unit: its scene, its tare and its answers.

use anyhow::{Result, anyhow};
use hivtac_calibration::forward::untared;
use hivtac_sensor::force::Force;
use hivtac_sensor::force::forward::Drift;
use hivtac_sensor::force::model::{Conditions, Model};
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::markers::lost::Lost;
use hivtac_sensor::pipeline::{Measurement, Sensor};
use hivtac_sensor::tare::TareBuilder;
use hivtac_terms::status::Status;
use hivtac_twin::film::reduced::{LARGEST_SIZE, Pose, Unit};
use hivtac_twin::film::{Dots, Layout, Pressed};
use hivtac_twin::units::{TIP_RADIUS_MM, random_unit};
use hivtac_twin::{Frame, Load, Options, Scene, Truth};
use rand::Rng;

use super::{RealFilm, normal, seeded};

/// Frames of a tare.
const TARE_FRAMES: u16 = 64;
/// The focal length of all lenses, µm.
const FOCAL_UM: f64 = 2100.0;

/// A simulated sensor, as a person built it.
pub struct TestedUnit {
    pub scene: Scene,
    pub tip_radius_mm: f64,
    /// Its film, if that is not the scene's.
    real: Option<RealFilm>,
}

/// A sensor with a model, tared on a unit.
pub struct Tared<'m> {
    pub sensor: Box<Sensor<'m>>,
}

/// A sensor's answer to a press.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    /// The press.
    pub load: Load,
    /// The force; `None` if it was refused.
    pub force: Option<Force>,
    /// Why it was refused, or how reliable it is.
    pub status: Status,
    /// Error of each marker's centroid, px; `None` if the markers were not found.
    pub off_px: Option<Dots<[f64; 2]>>,
}

impl TestedUnit {
    /// The unit with these options and a camera for these conditions, pressed by a tip with a
    /// radius in mm.
    pub fn new(
        conditions: &Conditions,
        options: Options,
        tip_radius_mm: f64,
        seed: u64,
    ) -> Result<Self> {
        let geometry = &conditions.geometry;
        let (width, height) = (geometry.width.into(), geometry.height.into());
        let preset = conditions.preset.name().parse()?;
        let scene = Scene::preset("demo", preset, width, height, seed)?;
        Ok(Self {
            scene: scene.with_options(options)?,
            tip_radius_mm,
            real: None,
        })
    }

    /// The unit with this number and these dots among randomly drawn units.
    pub fn random(conditions: &Conditions, layout: Layout, number: u64) -> Result<Self> {
        let focal_px = conditions.geometry.focal.to_f64();
        let mut random = seeded(number);
        let options = random_unit(|| normal(&mut random), layout, FOCAL_UM, focal_px);
        let [from, to] = TIP_RADIUS_MM;
        let tip_radius_mm = random.random_range(from..to);
        Self::new(conditions, options, tip_radius_mm, number)
    }

    /// The same unit with the film of this number among randomly drawn films.
    pub fn with_real_film(conditions: &Conditions, layout: Layout, number: u64) -> Result<Self> {
        let unit = Self::random(conditions, layout, number)?;
        let options = unit.scene.options();
        let film = RealFilm::random(number, options, unit.tip_radius_mm)?;
        Ok(unit.on_film(film))
    }

    /// The same unit with this film.
    pub fn on_film(self, film: RealFilm) -> Self {
        Self {
            real: Some(film),
            ..self
        }
    }

    /// A frame under a press; `number` selects its noise.
    pub fn frame(&self, load: &Load, number: u64) -> Result<Frame> {
        let load = self.with_tip(*load)?;
        Ok(match self.pressed(&load)? {
            None => self.scene.render_load(&load, number)?,
            Some(pressed) => self.scene.render_pressed(pressed, &load, number),
        })
    }

    fn truth(&self, load: &Load) -> Result<Truth> {
        let load = self.with_tip(*load)?;
        Ok(match self.pressed(&load)? {
            None => self.scene.truth_under(&load)?,
            Some(pressed) => self.scene.truth_of_pressed(pressed, &load),
        })
    }

    /// The film under a press with this unit's tip; `None` if the film is the scene's.
    pub fn pressed(&self, load: &Load) -> Result<Option<Pressed>> {
        let film = self.real.as_ref();
        film.map(|film| film.press(load)).transpose()
    }

    /// The press with this unit's tip.
    pub fn with_tip(&self, load: Load) -> Result<Load> {
        Ok(load.with_tip_radius_mm(self.tip_radius_mm)?)
    }

    /// Whether the simulated film holds a press, with all markers wholly in the picture. The tables
    /// of a soft film end before the largest force; beyond their end the simulated film would not
    /// move.
    pub fn shows_all(&self, load: &Load) -> Result<bool> {
        if self.real.is_none() && !self.scene_holds(load) {
            return Ok(false);
        }
        let truth = self.truth(load)?;
        let camera = self.scene.camera();
        let sides = [camera.width(), camera.height()].map(f64::from);
        let inside = truth.markers.iter().flatten().filter(|marker| {
            // A marker's image is at most 1.2 times as long as a round one of its area.
            let far = 1.2 * (marker.area_px2 / std::f64::consts::PI).sqrt() + 2.0;
            let within = |at: f64, side: f64| (far..side - 1.0 - far).contains(&at);
            let [x, y] = marker.centroid_px;
            within(x, sides[0]) && within(y, sides[1])
        });
        Ok(inside.count() == self.scene.options().layout.count())
    }

    /// Whether the tables of the scene's film cover a press.
    fn scene_holds(&self, load: &Load) -> bool {
        let Unit {
            stiffness,
            thickness,
            ..
        } = self.scene.options().film.unit;
        let stretching = stiffness * thickness;
        let times = [stretching * thickness * thickness, stretching];
        let pose = Pose::of_force(load.vector_n(), load.offset_mm(), times);
        pose.size <= LARGEST_SIZE
    }

    /// A sensor with this model, tared on the unit at rest.
    pub fn tare<'m>(&self, model: &Model<'m>) -> Result<Tared<'m>> {
        Tared::new(model, self.rest(model)?)
    }

    /// The rest position of this unit for a model.
    pub fn rest(&self, model: &Model<'_>) -> Result<Rest> {
        let mut sensor = untared(model)?;
        let mut tare = TareBuilder::new(TARE_FRAMES).ok_or_else(|| anyhow!("no frames"))?;
        // Every second frame may be bad.
        for number in 0..2 * TARE_FRAMES {
            let frame = self.frame(&Load::REST, 1_000_000 + u64::from(number))?;
            let seen = sensor.measure_frame(&frame.to_rgb565());
            if let Some(outcome) = sensor.tare_with(&mut tare, &seen) {
                return outcome.map_err(|refusal| anyhow!("no rest position: {refusal:?}"));
            }
        }
        Err(anyhow!("no rest position: too few frames show the markers"))
    }
}

impl<'m> Tared<'m> {
    /// A sensor with this model and this rest position.
    pub fn new(model: &Model<'m>, rest: Rest) -> Result<Tared<'m>> {
        let mut tared = Tared {
            sensor: untared(model)?,
        };
        tared.begin(rest);
        Ok(tared)
    }
}

impl Tared<'_> {
    /// Begins anew with this rest position, as if there had been no frames.
    pub fn begin(&mut self, rest: Rest) {
        self.sensor.set_tare(Some(rest), Drift::NONE);
        self.sensor.forget_frame();
    }

    /// The sensor's measurement of a frame of any format.
    pub fn measure(&mut self, frame: &Frame) -> Measurement {
        self.sensor.measure_frame(&frame.to_rgb565())
    }

    /// The same, with a second look if that may help, as the device takes it.
    pub fn measure_closely(&mut self, frame: &Frame) -> Measurement {
        self.sensor.measure_frame_closely(&frame.to_rgb565())
    }

    /// The mean places of the markers under a press, over some frames; `number` selects their
    /// noise.
    pub fn seen_px(
        &mut self,
        unit: &TestedUnit,
        load: Load,
        frames: u64,
        number: u64,
    ) -> Result<Dots<[f64; 2]>> {
        let mut mean = Dots::defaults(unit.scene.options().layout.count());
        for frame in 0..frames {
            let picture = unit.frame(&load, number + frame)?;
            let seen = self.measure(&picture);
            let markers = seen.markers.filter(|_| seen.lost == Lost::NONE);
            let markers = markers.ok_or_else(|| anyhow!("no markers under a load"))?;
            for (mean, marker) in mean.iter_mut().zip(markers) {
                let mean: &mut [f64; 2] = mean;
                mean[0] += marker.x.to_f64() / frames as f64;
                mean[1] += marker.y.to_f64() / frames as f64;
            }
        }
        Ok(mean)
    }

    /// The sensor's answer to a single press on its unit; `number` selects the noise.
    pub fn answer(&mut self, unit: &TestedUnit, load: Load, number: u64) -> Result<Answer> {
        self.sensor.forget_frame();
        let frame = unit.frame(&load, number)?;
        let seen = self.measure(&frame);
        let off = |k: usize| {
            let [x, y] = frame.truth.markers[k]?.centroid_px;
            let marker = seen.markers?.get(k).copied()?;
            Some([marker.x.to_f64() - x, marker.y.to_f64() - y])
        };
        let dots = unit.scene.options().layout.count();
        let off_px: Vec<[f64; 2]> = (0..dots).filter_map(off).collect();
        Ok(Answer {
            load,
            force: seen.force,
            status: seen.status,
            off_px: (off_px.len() == dots).then(|| Dots::of(off_px)),
        })
    }
}
