//! The sections of a scene file, each with its defaults. `docs/scene-file.md` lists every key.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

use crate::film::{Dots, Layout};
use crate::{
    Catch, Drag, Format, Grasp, JPEG_QUALITY, Lens, Load, Mechanics, Motion, Mounting,
    OV5640_NOISE, Options, Paint, Patch, Preset, PresetCamera, Press, Room, Salt, Scene,
    SceneError, Shutter, Specks, Vibration,
};

/// A whole file.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct SceneFile {
    seed: u64,
    camera: CameraSection,
    layout: Layout,
    film: Mechanics,
    lens: Lens,
    mounting: Mounting,
    shutter: Shutter,
    light: LightSection,
    room: Room,
    noise: NoiseSection,
    marks: MarksSection,
    load: LoadSection,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct CameraSection {
    #[serde(deserialize_with = "preset")]
    preset: Named,
    width: Option<u32>,
    height: Option<u32>,
    format: Option<FormatName>,
    jpeg_quality: Option<u8>,
    bayer: bool,
}

/// A camera by its name: its geometry, and the noise of its picture.
#[derive(Clone, Copy, Debug)]
struct Named {
    preset: Preset,
    noise: f64,
}

/// The camera with the OV7725's geometry, and noise of its own.
const OV5640: &str = "ov5640";

impl From<Preset> for Named {
    fn from(preset: Preset) -> Named {
        let noise = Options::of(preset).noise;
        Named { preset, noise }
    }
}

/// Reads a preset by its name.
fn preset<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Named, D::Error> {
    const NAMES: &[&str] = &{
        let [first, second, third] = Preset::ALL;
        [first.name(), second.name(), third.name(), OV5640]
    };
    let name = String::deserialize(deserializer)?;
    if name == OV5640 {
        return Ok(Named {
            preset: Preset::Ov7725,
            noise: OV5640_NOISE,
        });
    }
    let preset = Preset::from_name(&name);
    (preset.map(Named::from)).ok_or_else(|| D::Error::unknown_variant(&name, NAMES))
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum FormatName {
    Rgb565,
    Yuv422,
    Mono,
    Jpeg,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct LightSection {
    gain: f64,
    gradient: [f64; 2],
    falloff: f64,
    haze: f64,
    white_balance: [f64; 3],
    mono: [f64; 3],
    board_leds_mm: Option<f64>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct NoiseSection {
    noise: Option<f64>,
    texture: f64,
    salt: f64,
    salt_paint: Paint,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct MarksSection {
    paint: Option<Paint>,
    missing: Vec<u8>,
    glued_mm: Option<Vec<[f64; 2]>>,
    moved_mm: Option<Vec<[f64; 3]>>,
    patch: Vec<Patch>,
    specks: u32,
    speck_radius_mm: f64,
    checkerboard_px: u32,
}

#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct LoadSection {
    motion: MotionName,
    #[serde(rename = "static")]
    constant: Option<ConstantSection>,
    press: Option<Press>,
    drag: Option<Drag>,
    grasp: Option<Grasp>,
    catch: Option<Catch>,
    vibration: Option<Vibration>,
}

#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
enum MotionName {
    #[default]
    Rest,
    Static,
    Demo,
    Sweep,
    Press,
    Drag,
    Grasp,
    Catch,
    Vibration,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct ConstantSection {
    force_n: f64,
    alpha_deg: f64,
    beta_deg: f64,
}

impl SceneFile {
    pub(super) fn scene(&self) -> Result<Scene, SceneError> {
        let [width, height] = self.camera.size();
        Scene::preset("rest", self.camera.preset.preset, width, height, self.seed)?
            .with_options(self.options()?)?
            .with_motion(self.load.motion(self.seed)?)
    }

    /// Returns the room. Its keys would have no effect, silently, behind an opaque film.
    fn room(&self) -> Result<Room, SceneError> {
        let unseen = self.room.transmission == 0.0 && self.room != Room::default();
        match unseen {
            false => Ok(self.room.clone()),
            true => Err(SceneError::Key {
                key: "room",
                why: "nothing is seen through an opaque film: give a `transmission`".to_owned(),
            }),
        }
    }

    fn options(&self) -> Result<Options, SceneError> {
        let LightSection {
            gain,
            gradient,
            falloff,
            haze,
            white_balance,
            mono,
            board_leds_mm,
        } = self.light;
        Ok(Options {
            format: self.camera.format()?,
            gain,
            gradient,
            falloff,
            haze,
            white_balance,
            mono,
            board_leds_mm,
            room: self.room()?,
            bayer: self.camera.bayer()?,
            markers: (self.marks.paint).unwrap_or(self.camera.preset.preset.usual_markers()),
            texture: self.noise.texture,
            noise: self.noise.noise.unwrap_or(self.camera.preset.noise),
            salt: Salt {
                fraction: self.noise.salt,
                paint: self.noise.salt_paint,
            },
            missing: self.marks.missing(self.layout.count())?,
            glued_mm: self.marks.glued_mm(self.layout.count())?,
            moved_mm: self.marks.moved_mm(self.layout.count())?,
            layout: self.layout,
            patches: self.marks.patch.clone(),
            specks: Specks {
                count: self.marks.specks,
                radius_mm: self.marks.speck_radius_mm,
            },
            checkerboard_px: self.marks.checkerboard_px,
            film: self.film,
            lens: self.lens,
            mounting: self.mounting,
            shutter: self.shutter,
        })
    }
}

impl CameraSection {
    /// Returns columns and rows.
    fn size(&self) -> [u32; 2] {
        let [width, height] = self.preset.preset.usual_size();
        [self.width.unwrap_or(width), self.height.unwrap_or(height)]
    }

    fn bayer(&self) -> Result<bool, SceneError> {
        match self.bayer && self.format()? == Format::Mono {
            false => Ok(self.bayer),
            true => Err(SceneError::Key {
                key: "bayer",
                why: "a camera without colours has no pixels for one colour each".to_owned(),
            }),
        }
    }

    fn format(&self) -> Result<Format, SceneError> {
        let format = match self.format {
            None => self.preset.preset.usual_format(),
            Some(FormatName::Rgb565) => Format::Rgb565,
            Some(FormatName::Yuv422) => Format::Yuv422,
            Some(FormatName::Mono) => Format::Mono,
            Some(FormatName::Jpeg) => {
                let quality = self.jpeg_quality.unwrap_or(JPEG_QUALITY);
                return Ok(Format::Jpeg { quality });
            }
        };
        match self.jpeg_quality {
            None => Ok(format),
            Some(quality) => Err(SceneError::Key {
                key: "jpeg_quality",
                why: format!("{quality} is the quality of a JPEG, and the format is {format}"),
            }),
        }
    }
}

impl MarksSection {
    fn missing(&self, count: usize) -> Result<Dots<bool>, SceneError> {
        match self.missing.iter().find(|id| usize::from(**id) >= count) {
            None => Ok(Dots::from_fn(count, |id| {
                self.missing.contains(&(id as u8))
            })),
            Some(id) => Err(SceneError::Key {
                key: "missing",
                why: format!("there is no marker {id}: use 0 to {}", count - 1),
            }),
        }
    }

    fn moved_mm(&self, count: usize) -> Result<Option<Dots<[f64; 3]>>, SceneError> {
        match &self.moved_mm {
            None => Ok(None),
            Some(ways) if ways.len() == count => Ok(Some(Dots::of(ways.iter().copied()))),
            Some(ways) => Err(SceneError::Key {
                key: "moved_mm",
                why: format!("{} motions: use one for each of {count} dots", ways.len()),
            }),
        }
    }

    fn glued_mm(&self, count: usize) -> Result<Dots<[f64; 2]>, SceneError> {
        match &self.glued_mm {
            None => Ok(Dots::from_fn(count, |_| [0.0; 2])),
            Some(places) if places.len() == count => Ok(Dots::of(places.iter().copied())),
            Some(places) => Err(SceneError::Key {
                key: "glued_mm",
                why: format!("{} shifts: use one for each of {count} dots", places.len()),
            }),
        }
    }
}

impl LoadSection {
    fn motion(&self, seed: u64) -> Result<Motion, SceneError> {
        self.check_tables()?;
        Ok(match self.motion {
            MotionName::Rest => Motion::Rest,
            MotionName::Static => self.constant.unwrap_or_default().motion()?,
            MotionName::Demo => Motion::Demo { seed },
            MotionName::Sweep => Motion::Sweep,
            MotionName::Press => Motion::Press(self.press.unwrap_or_default()),
            MotionName::Drag => Motion::Drag(self.drag.unwrap_or_default()),
            MotionName::Grasp => Motion::Grasp(self.grasp.unwrap_or_default()),
            MotionName::Catch => Motion::Catch(self.catch.unwrap_or_default()),
            MotionName::Vibration => Motion::Vibration(self.vibration.unwrap_or_default()),
        })
    }

    /// Rejects a table of a motion that was not chosen: it would have no effect, silently.
    fn check_tables(&self) -> Result<(), SceneError> {
        let tables = [
            ("static", MotionName::Static, self.constant.is_some()),
            ("press", MotionName::Press, self.press.is_some()),
            ("drag", MotionName::Drag, self.drag.is_some()),
            ("grasp", MotionName::Grasp, self.grasp.is_some()),
            ("catch", MotionName::Catch, self.catch.is_some()),
            ("vibration", MotionName::Vibration, self.vibration.is_some()),
        ];
        let other = |(_, name, given): &(_, MotionName, bool)| *given && *name != self.motion;
        match tables.into_iter().find(other) {
            None => Ok(()),
            Some((key, ..)) => Err(SceneError::Key {
                key,
                why: format!("it does nothing unless load.motion is \"{key}\""),
            }),
        }
    }
}

impl ConstantSection {
    fn motion(&self) -> Result<Motion, SceneError> {
        let load = Load::from_angles(self.force_n, self.alpha_deg, self.beta_deg)?;
        Ok(Motion::Static(load))
    }
}

impl Default for CameraSection {
    fn default() -> CameraSection {
        CameraSection {
            preset: Preset::Ov7725.into(),
            width: None,
            height: None,
            format: None,
            jpeg_quality: None,
            bayer: false,
        }
    }
}

impl Default for LightSection {
    fn default() -> LightSection {
        let usual = Options::default();
        LightSection {
            gain: usual.gain,
            gradient: usual.gradient,
            falloff: usual.falloff,
            haze: usual.haze,
            white_balance: usual.white_balance,
            mono: usual.mono,
            board_leds_mm: usual.board_leds_mm,
        }
    }
}

impl Default for NoiseSection {
    fn default() -> NoiseSection {
        let usual = Options::default();
        NoiseSection {
            noise: None,
            texture: usual.texture,
            salt: usual.salt.fraction,
            salt_paint: usual.salt.paint,
        }
    }
}

impl Default for MarksSection {
    fn default() -> MarksSection {
        let usual = Options::default();
        MarksSection {
            paint: None,
            missing: Vec::new(),
            glued_mm: None,
            moved_mm: None,
            patch: Vec::new(),
            specks: usual.specks.count,
            speck_radius_mm: usual.specks.radius_mm,
            checkerboard_px: usual.checkerboard_px,
        }
    }
}

impl Default for ConstantSection {
    fn default() -> ConstantSection {
        ConstantSection {
            force_n: 0.1,
            alpha_deg: 4.0,
            beta_deg: -3.0,
        }
    }
}
