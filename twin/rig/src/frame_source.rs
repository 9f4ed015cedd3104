//! Sources of the camera's pictures: a scene, or a test picture.

use std::path::Path;

use crate::camera::part::Kind;
use crate::truth::Exposed;
use anyhow::{Context, bail};
use hivtac_twin::{Format, Layout, OV5640_NOISE, Options, Preset, PresetCamera, Scene, Shutter};
use serde_json::{Value, json};

/// The coding of a picture's pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// RGB565 in native order.
    Rgb565,
    /// Luma in the low byte. The high byte has the pair's Cb in even columns and its Cr in odd
    /// ones.
    Yuv422,
    /// Luma in the low byte.
    Mono,
}

/// A picture of the whole pixel array.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Columns; even.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The pixels' coding.
    pub coding: Coding,
    /// Pixels, row by row.
    pub pixels: Vec<u16>,
}

/// The camera's view.
pub trait FrameSource: Send + std::fmt::Debug {
    /// Returns the picture of one exposure. `wanted` is the coding that the sensor sends; a source
    /// without that coding returns its own.
    fn picture(&self, exposed: Exposed, wanted: Coding) -> Picture;

    /// Returns the ground truth at the middle of the exposure, for the truth log.
    fn truth(&self, exposed: Exposed) -> Value;
}

/// A moving white square over a gradient, with every pixel known.
#[derive(Clone, Copy, Debug, Default)]
pub struct TestPicture;

impl FrameSource for TestPicture {
    fn picture(&self, exposed: Exposed, _wanted: Coding) -> Picture {
        let exposure = exposed.exposure;
        let square = [40 + exposure * 3 % 240, 40 + exposure * 2 % 160];
        let pixel = |x: u64, y: u64| {
            let inside = x.abs_diff(square[0]) < 12 && y.abs_diff(square[1]) < 12;
            if inside {
                0xFFFF
            } else {
                ((x >> 4) << 11 | ((x + y) >> 5) << 5 | y >> 4) as u16
            }
        };
        let pixels = (0..240)
            .flat_map(|y| (0..320).map(move |x| pixel(x, y)))
            .collect();
        Picture {
            width: 320,
            height: 240,
            coding: Coding::Rgb565,
            pixels,
        }
    }

    fn truth(&self, _exposed: Exposed) -> Value {
        json!({})
    }
}

/// A simulated sensor whose camera can code its pixels in each of its codings.
#[derive(Debug)]
pub struct SceneSource {
    /// The scene in the first coding.
    usual: Scene,
    /// The scene in the second coding, if it has one.
    yuv422: Option<Scene>,
    /// Place in the picture of the first pixel of the firmware's frames. The truth gives markers in
    /// the coordinates of those frames.
    window: [f64; 2],
}

/// The picture of a camera's whole array.
struct Array {
    preset: Preset,
    size: (u32, u32),
    window: [f64; 2],
}

impl Array {
    fn of(camera: Kind) -> Self {
        match camera {
            Kind::Ov7725 | Kind::Ov5640 => Self {
                preset: Preset::Ov7725,
                size: (320, 240),
                window: [0.0; 2],
            },
            // Binned 2 × 2. The firmware asks for the middle 160 × 152.
            Kind::Mt9v034 => Self {
                preset: Preset::Mt9v034,
                size: (376, 240),
                window: [108.0, 44.0],
            },
        }
    }
}

impl SceneSource {
    /// Loads the scene of a file (`docs/scene-file.md`), whose frames must be the camera's.
    ///
    /// # Errors
    /// If it cannot be read, is not a scene, or has frames of another size.
    pub fn load(path: &Path, camera: Kind) -> anyhow::Result<Self> {
        let array = Array::of(camera);
        let context = || format!("--scene {}", path.display());
        let text = std::fs::read_to_string(path).with_context(context)?;
        let scene = Scene::from_toml(&text).with_context(context)?;
        let frame = scene.frame(0, 0.0);
        if (frame.width, frame.height) != array.size {
            bail!(
                "--scene {}: its frames are {} × {}, and this camera's are {} × {}",
                path.display(),
                frame.width,
                frame.height,
                array.size.0,
                array.size.1
            );
        }
        if frame.format != scene.camera().preset().usual_format() {
            bail!(
                "--scene {}: the camera's registers say what its pixels are: leave `format` out",
                path.display()
            );
        }
        if scene.options().shutter != Shutter::default() {
            bail!(
                "--scene {}: the camera's registers say how it exposes: leave `shutter` out",
                path.display()
            );
        }
        Self::of(scene, array.window).with_context(context)
    }

    /// Returns a scene by name, under a geometry preset, or the camera's own.
    ///
    /// # Errors
    /// If there is no such scene or preset.
    pub fn new(name: &str, preset: Option<&str>, seed: u64, camera: Kind) -> anyhow::Result<Self> {
        let array = Array::of(camera);
        let preset = match preset {
            Some(preset) => preset
                .parse()
                .with_context(|| format!("--preset {preset}"))?,
            None => array.preset,
        };
        let (width, height) = array.size;
        let mut scene = Scene::preset(name, preset, width, height, seed).context("--scene")?;
        if camera == Kind::Ov5640 {
            let options = Options {
                noise: OV5640_NOISE,
                ..scene.options().clone()
            };
            scene = scene.with_options(options).context("--scene")?;
        }
        Self::of(scene, array.window)
    }

    /// The same with other dots on the film.
    ///
    /// # Errors
    /// If the film does not take them.
    pub fn with_layout(self, layout: Layout) -> anyhow::Result<Self> {
        if layout == self.usual.options().layout {
            return Ok(self);
        }
        let options = Options {
            layout,
            ..self.usual.options().clone()
        };
        let scene = self.usual.with_options(options).context("--layout")?;
        Self::of(scene, self.window)
    }

    fn of(usual: Scene, window: [f64; 2]) -> anyhow::Result<Self> {
        let options = Options {
            format: Format::Yuv422,
            ..usual.options().clone()
        };
        let colours = usual.options().format != Format::Mono;
        let yuv422 = colours.then(|| usual.clone().with_options(options));
        Ok(Self {
            yuv422: yuv422.transpose()?,
            usual,
            window,
        })
    }
}

impl FrameSource for SceneSource {
    fn picture(&self, exposed: Exposed, wanted: Coding) -> Picture {
        let scene = match (wanted, &self.yuv422) {
            (Coding::Yuv422, Some(yuv422)) => yuv422,
            _ => &self.usual,
        };
        let frame = scene.frame_by(&exposed.shutter(), exposed.exposure, exposed.time_s());
        let (coding, pixels) = match frame.format {
            Format::Mono => {
                let luma = frame.mono.into_iter();
                (Coding::Mono, luma.map(u16::from).collect())
            }
            Format::Yuv422 => (Coding::Yuv422, frame.pixels),
            _ => (Coding::Rgb565, frame.pixels),
        };
        Picture {
            width: frame.width,
            height: frame.height,
            coding,
            pixels,
        }
    }

    fn truth(&self, exposed: Exposed) -> Value {
        let truth = self.usual.truth_by(&exposed.shutter(), exposed.time_s());
        let force = truth.force.vector_n();
        let markers: Vec<Value> = (truth.markers.iter())
            .map(|marker| match marker {
                Some(marker) => json!({
                    "x": marker.centroid_px[0] - self.window[0],
                    "y": marker.centroid_px[1] - self.window[1],
                    "area": marker.area_px2,
                }),
                None => Value::Null,
            })
            .collect();
        json!({
            "alpha_deg": truth.force.alpha_deg(),
            "beta_deg": truth.force.beta_deg(),
            "magnitude_n": truth.force.magnitude_n(),
            "x_n": force[0], "y_n": force[1], "z_n": force[2],
            "place_x_mm": truth.touches_mm.map(|place| place[0]),
            "place_y_mm": truth.touches_mm.map(|place| place[1]),
            "markers": markers,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the truth of a scene file at 0.2 s: |F| and the place.
    fn truth(file: &str) -> [Value; 3] {
        let scene = Scene::from_toml(file).unwrap();
        let exposed = Exposed {
            middle_ns: 200_000_000,
            ..Exposed::default()
        };
        let truth = SceneSource::of(scene, [0.0; 2]).unwrap().truth(exposed);
        ["magnitude_n", "place_x_mm", "place_y_mm"].map(|key| truth[key].clone())
    }

    #[test]
    fn the_truth_tells_the_place_of_a_tip_that_presses() {
        let film = "[film]\noffset_mm = [0.2, -0.1]\n";
        let pressed = format!("{film}[load]\nmotion = \"static\"\n[load.static]\nforce_n = 0.1\n");
        assert_eq!(truth(&pressed), [json!(0.1), json!(0.2), json!(-0.1)]);
        assert_eq!(truth(film), [json!(0.0), Value::Null, Value::Null]);
    }
}
