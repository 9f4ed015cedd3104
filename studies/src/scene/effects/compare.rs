//! How far what is found moves when an effect is switched.

use anyhow::Result;
use hivtac_calibration::data::loads::norm;
use hivtac_calibration::evaluation::errors::{WEAK_N, angle_deg};
use hivtac_twin::{Frame, Options, Preset, Scene};

use crate::scene::pipeline::{FrameMeasurement, Pipeline};
use crate::scene::size::Size;

use super::catalogue::{Compare, Effect};

/// Frames per second.
const RATE: f64 = 12.0;
/// From here on the tip of `sweep` presses, s.
const PRESSED_S: f64 = 0.2;
/// Decides the noise.
const SEED: u64 = 1;

/// The default sensor, and what is found in its frames.
pub struct Nominal {
    noisy: Scene,
    quiet: Measurements,
    frames: u32,
}

/// What is found in the frames of a scene, after a tare on its own untouched film.
struct Measurements {
    rest_px: Option<[[f64; 2]; 4]>,
    /// The true centroids at rest.
    rest_truth_px: Option<[[f64; 2]; 4]>,
    frames: Vec<FrameMeasurement>,
    /// |F| in each frame, N.
    sizes_n: Vec<f64>,
    /// The true centroids in each frame.
    truths_px: Vec<Option<[[f64; 2]; 4]>>,
}

/// What an effect changes, over all frames in which markers were found with and without it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Change {
    /// A marker's centroid, px.
    pub centroid_px: Spread,
    /// Its motion from where it rests, which is what a tare leaves of that, px.
    pub motion_px: Spread,
    /// The force, |ΔF|, mN, each after its own tare.
    pub force_mn: Spread,
    /// The force's direction where |F| is at least 50 mN, degrees.
    pub direction_deg: Spread,
    /// Frames without a force only because of the effect.
    pub rejected: usize,
}

/// Root mean square and worst of sizes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Spread {
    square: f64,
    count: usize,
    /// The largest.
    pub worst: f64,
}

impl Spread {
    fn add(&mut self, size: f64) {
        self.square += size * size;
        self.count += 1;
        self.worst = self.worst.max(size);
    }

    /// Root mean square; `None` when there was nothing.
    pub fn rms(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.square / self.count as f64).sqrt())
    }
}

impl Nominal {
    pub fn new(preset: Preset, size: Size, frames: u32) -> Result<Nominal> {
        let noisy = Scene::preset("sweep", preset, size.width, size.height, SEED)?;
        let silent = quiet(&noisy)?;
        Ok(Nominal {
            quiet: Measurements::of(&silent, Pipeline::tared(&silent)?, frames, 0),
            noisy,
            frames,
        })
    }

    /// Whether forces can be told.
    pub fn has_model(&self) -> bool {
        let mut frames = self.quiet.frames.iter();
        frames.any(|frame| frame.force_n.is_some())
    }

    /// What an effect changes, without noise where it is not about noise: the change and not the
    /// noise is measured.
    pub fn change(&self, effect: &Effect) -> Result<Change> {
        if effect.compare == Compare::Truth {
            return Ok(self.quiet.against_truth());
        }
        let switched = effect.switch(&self.noisy)?;
        let about_noise = switched.options().noise != self.noisy.options().noise;
        let scene = if about_noise {
            self.noisy.clone()
        } else {
            quiet(&switched)?
        };
        let measured = Measurements::of(&scene, self.pipeline(&scene)?, self.frames, 0);
        Ok(self.quiet.against(&measured))
    }

    /// What other noise changes: the default sensor twice.
    pub fn noise_floor(&self) -> Result<Change> {
        let measured = |series| -> Result<Measurements> {
            let pipeline = self.pipeline(&self.noisy)?;
            Ok(Measurements::of(&self.noisy, pipeline, self.frames, series))
        };
        Ok(measured(0)?.against(&measured(1)?))
    }

    /// A sensor with a tare on the untouched film of a scene, or on the default one where that is
    /// not to be had.
    fn pipeline(&self, scene: &Scene) -> Result<Pipeline> {
        Pipeline::tared(scene).or_else(|_| Pipeline::tared(&self.noisy))
    }
}

fn quiet(scene: &Scene) -> Result<Scene> {
    let options = Options {
        noise: 0.0,
        ..scene.options().clone()
    };
    Ok(scene.clone().with_options(options)?)
}

impl Measurements {
    /// Measures frames of a scene; `series` selects the noise.
    fn of(scene: &Scene, mut pipeline: Pipeline, frames: u32, series: u64) -> Measurements {
        let at_rest = scene.frame(series << 32, 0.0);
        let mut measurements = Measurements {
            rest_px: pipeline.measure(&at_rest).centroids_px,
            rest_truth_px: truth_px(&at_rest),
            frames: Vec::new(),
            sizes_n: Vec::new(),
            truths_px: Vec::new(),
        };
        for number in 0..frames {
            let time_s = PRESSED_S + f64::from(number) / RATE;
            let frame = scene.frame((series << 32) + 1 + u64::from(number), time_s);
            measurements.frames.push(pipeline.measure(&frame));
            measurements.sizes_n.push(frame.truth.force.magnitude_n());
            measurements.truths_px.push(truth_px(&frame));
        }
        measurements
    }

    fn against(&self, other: &Measurements) -> Change {
        let mut change = Change::default();
        let rest = [&self.rest_px, &other.rest_px];
        for (frame, (a, b)) in self.frames.iter().zip(&other.frames).enumerate() {
            if let (Some(a), Some(b)) = (&a.centroids_px, &b.centroids_px) {
                change.add_centroids([a, b], rest);
            }
            if let (Some(a), Some(b)) = (a.force_n, b.force_n) {
                change.add_forces(a, b, self.sizes_n[frame] >= WEAK_N);
            }
            if a.rejected.is_empty() && !b.rejected.is_empty() {
                change.rejected += 1;
            }
        }
        change
    }

    /// What is found against what is true.
    fn against_truth(&self) -> Change {
        let mut change = Change::default();
        for (frame, truth_px) in self.frames.iter().zip(&self.truths_px) {
            if let (Some(centroids_px), Some(truth_px)) = (&frame.centroids_px, truth_px) {
                change.add_centroids(
                    [centroids_px, truth_px],
                    [&self.rest_px, &self.rest_truth_px],
                );
            }
        }
        change
    }
}

fn truth_px(frame: &Frame) -> Option<[[f64; 2]; 4]> {
    let mut places = [[0.0; 2]; 4];
    for (place, marker) in places.iter_mut().zip(frame.truth.markers) {
        *place = marker?.centroid_px;
    }
    Some(places)
}

impl Change {
    fn add_centroids(&mut self, seen: [&[[f64; 2]; 4]; 2], rest: [&Option<[[f64; 2]; 4]>; 2]) {
        let [a, b] = seen;
        for id in 0..4 {
            let [x, y] = [0, 1].map(|k| b[id][k] - a[id][k]);
            self.centroid_px.add(x.hypot(y));
            if let [Some(a), Some(b)] = rest {
                let [rest_x, rest_y] = [0, 1].map(|k| b[id][k] - a[id][k]);
                self.motion_px.add((x - rest_x).hypot(y - rest_y));
            }
        }
    }

    fn add_forces(&mut self, a: [f64; 3], b: [f64; 3], strong: bool) {
        let difference = std::array::from_fn(|k| b[k] - a[k]);
        self.force_mn.add(norm(difference) * 1e3);
        if let Some(angle) = angle_deg(a, b).filter(|_| strong) {
            self.direction_deg.add(angle);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::catalogue::effects;
    use super::*;

    #[test]
    fn effects_are_told_from_noise_and_a_tare_takes_a_shift_off() {
        let size = Size {
            width: 320,
            height: 240,
        };
        let nominal = Nominal::new(Preset::Ov7725, size, 24).unwrap();
        assert!(nominal.has_model());
        let of = |name: &str| {
            let effects = effects();
            let effect = effects.iter().find(|effect| effect.name == name).unwrap();
            nominal.change(effect).unwrap()
        };
        let rms = |spread: Spread| spread.rms().unwrap();
        let floor = nominal.noise_floor().unwrap();
        assert!((0.001..0.1).contains(&rms(floor.motion_px)), "{floor:?}");
        let lens = of("equidistant lens");
        assert!(
            rms(lens.motion_px) > 50.0 * rms(floor.motion_px),
            "{lens:?}"
        );
        // A shift of 24 and 12 µm is 2.24 px of 12 µm, and nothing after a tare but what pixels
        // make of it.
        let shift = of("optical centre");
        assert!((rms(shift.centroid_px) - 2.236).abs() < 0.05, "{shift:?}");
        assert!(rms(shift.motion_px) < 0.1, "{shift:?}");
        assert!(rms(of("noise").force_mn) > 0.0);
        assert!(rms(of("pixel grid").centroid_px) > 0.0);
    }

    #[test]
    fn no_change_is_none() {
        let size = Size {
            width: 160,
            height: 120,
        };
        let nominal = Nominal::new(Preset::Paper, size, 3).unwrap();
        assert!(!nominal.has_model());
        let none = nominal.quiet.against(&nominal.quiet);
        assert_eq!((none.centroid_px.rms(), none.rejected), (Some(0.0), 0));
        assert_eq!(none.force_mn.rms(), None);
    }
}
