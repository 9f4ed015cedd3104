//! The sensor's answers to frames of presses of the full film.

use anyhow::Result;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::pipeline::Measurement;
use hivtac_shell::Film;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_twin::film::Layout;
use hivtac_twin::{Frame, Load, Options};

use super::objects::Press;
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
}

impl<'m> Reader<'m> {
    /// Returns a sensor with a model, tared on a film at rest. It takes this many frames of each
    /// press.
    ///
    /// # Errors
    /// If the film at rest gives no rest position.
    pub fn new(
        model: &'m Model<'m>,
        film: &'m Film,
        layout: Layout,
        (frames, seed): (u32, u64),
    ) -> Result<Reader<'m>> {
        let options = Options {
            layout,
            ..Options::of(model.conditions.preset)
        };
        let unit = TestedUnit::new(&model.conditions, options, TIP_RADIUS_MM, seed)?;
        Ok(Reader {
            rest: unit.rest(model)?,
            model,
            film,
            unit,
            frames,
        })
    }

    /// Returns the sensor's measurements of the frames of the press with this number, with each of
    /// these contact settings. All settings see the same frames.
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
            .collect::<Vec<_>>();
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
    fn frame(&self, press: &Press, number: u64) -> Frame {
        let moved = |rest_mm| self.film.displacement(&press.state, rest_mm);
        self.unit.scene.render_film(moved, &Load::REST, number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contacts::objects::Kind;
    use anyhow::anyhow;
    use hivtac_calibration::data::loads::norm;
    use hivtac_calibration::quantize::export;
    use hivtac_calibration::weights::Weights;
    use hivtac_shell::Design;
    use std::path::Path;

    /// A needle that presses hard near a dot bends it more than anything else.
    #[test]
    #[ignore = "10 s: frames with rims by the film"]
    fn a_dot_that_a_needle_bends_is_still_a_marker() {
        let path = Path::new("..").join(crate::anywhere::WEIGHTS);
        let weights = Weights::load(&path).unwrap();
        let bytes = export(&weights).unwrap();
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"));
        let model = model.unwrap();
        let film = Film::new(&Design::default()).unwrap();
        let press = Kind::Needle.press(&film, 12, 71, true).unwrap();
        let reader = Reader::new(&model, &film, Layout::default(), (5, 1)).unwrap();
        let [answers] = reader.read((0, &press), [press.shape]).unwrap();
        for answer in answers {
            let force = answer.force.ok_or(answer.status).unwrap();
            assert!(answer.markers.is_some(), "{:?}", answer.status);
            let off_n = f64::from(force.magnitude.0) * 1e-6 - norm(press.force_n);
            assert!(off_n.abs() < 0.005, "{off_n} N");
        }
    }
}
