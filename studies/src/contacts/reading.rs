//! The sensor's answers to frames of presses of the full film.

use anyhow::Result;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::pipeline::Measurement;
use hivtac_shell::{Film, pressed};
use hivtac_terms::contact_shape::ContactShape;
use hivtac_twin::{Frame, Load, MARKERS, Options};

use super::presses::Press;
use crate::press::{Tared, TestedUnit};

/// Numbers of noise that a press has for itself.
const NUMBERS: u64 = 10_000;
/// Radius of the tip of the scene's own film, mm: it only presses the truths of the frames.
const TIP_RADIUS_MM: f64 = 0.5;

/// A simulated sensor that sees the full film.
pub struct Reader<'m> {
    model: &'m Model<'m>,
    film: &'m Film,
    unit: TestedUnit,
    rest: Rest,
    frames: u32,
    plane: bool,
}

impl<'m> Reader<'m> {
    /// Returns a sensor with a model, tared on a film at rest. It takes this many frames of each
    /// press. With `plane`, each dot's image is that of a plane disc.
    ///
    /// # Errors
    /// If the film at rest gives no rest position.
    pub fn new(
        (model, weights): (&'m Model<'m>, &Weights),
        film: &'m Film,
        (frames, seed, plane): (u32, u64, bool),
    ) -> Result<Reader<'m>> {
        let preset = weights.conditions.preset.parse()?;
        let options = Options::of(preset);
        let unit = TestedUnit::new(&model.conditions, options, TIP_RADIUS_MM, seed)?;
        Ok(Reader {
            rest: unit.rest(model)?,
            model,
            film,
            unit,
            frames,
            plane,
        })
    }

    /// Returns the sensor's measurements of the frames of the press with this number, with each of
    /// these settings of what presses. All settings see the same frames.
    ///
    /// # Errors
    /// If the model does not fit the frames.
    pub fn read<const N: usize>(
        &self,
        (number, press): (usize, &Press),
        shapes: [Option<ContactShape>; N],
    ) -> Result<[Vec<Measurement>; N]> {
        let first = number as u64 * NUMBERS;
        let frames = (0..self.frames)
            .map(|frame| self.frame(press, first + u64::from(frame)))
            .collect::<Result<Vec<_>>>()?;
        let mut tared = Tared::new(self.model, self.rest)?;
        let mut measure = |shape: Option<ContactShape>| {
            let Some(shape) = shape else {
                return Vec::new();
            };
            tared.begin(self.rest);
            tared.sensor.set_contact_shape(shape);
            let frames = frames.iter();
            frames.map(|frame| tared.measure_closely(frame)).collect()
        };
        Ok(shapes.map(&mut measure))
    }

    /// Returns a frame of a press; `number` selects its noise.
    fn frame(&self, press: &Press, number: u64) -> Result<Frame> {
        let scene = &self.unit.scene;
        if self.plane {
            let film = pressed(self.film, &press.state, MARKERS.into_iter())?;
            return Ok(scene.render_pressed(film, &Load::REST, number));
        }
        let moved = |rest_mm| self.film.displacement(&press.state, rest_mm);
        Ok(scene.render_film(moved, &Load::REST, number))
    }
}
