//! The errors of a scene.

use std::fmt;

use crate::film::FilmError;

use crate::{Motion, Preset, PresetCamera};

/// An error of a scene, size, load or option that cannot be simulated. The message names the item,
/// the cause and the possible values.
#[derive(Clone, Debug, PartialEq)]
pub enum SceneError {
    /// There is no scene with this name.
    UnknownScene(String),
    /// There is no pixel format with this name.
    UnknownFormat(String),
    /// A frame size that the simulated camera does not have.
    Size {
        /// The preset of the camera.
        preset: Preset,
        /// Columns that the caller asked for.
        width: u32,
        /// Rows that the caller asked for.
        height: u32,
    },
    /// A load or a film that is impossible.
    Film(FilmError),
    /// An invalid scene file: the message has the line, the key and the possible values.
    #[cfg(feature = "file")]
    File(String),
    /// A key of a scene file whose value does not fit the others.
    #[cfg(feature = "file")]
    Key {
        /// The key.
        key: &'static str,
        /// The reason.
        why: String,
    },
    /// An option outside its range.
    Option {
        /// The option's name.
        name: &'static str,
        /// The value given.
        value: f64,
        /// The smallest and the largest possible value.
        range: [f64; 2],
    },
}

#[cfg(feature = "jpeg")]
const FORMATS: &str = "rgb565, yuv422, mono or jpeg";
#[cfg(not(feature = "jpeg"))]
const FORMATS: &str = "rgb565, yuv422 or mono (this program was built without jpeg)";

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SceneError::UnknownScene(name) => {
                let names = Motion::NAMES.join(", ");
                write!(f, "unknown scene `{name}`: use one of {names}")
            }
            SceneError::UnknownFormat(name) => {
                write!(f, "unknown pixel format `{name}`: use {FORMATS}")
            }
            SceneError::Size {
                preset,
                width,
                height,
            } => {
                let possible = match preset {
                    Preset::Paper | Preset::Ov7725 => "a 4:3 size from 160×120 to 800×600",
                    Preset::Mt9v034 => "even numbers from 80×80 to 376×240",
                };
                let [columns, rows] = preset.usual_size();
                write!(
                    f,
                    "frame size {width}×{height}: for {preset} use {possible}, such as \
                     {columns}×{rows}"
                )
            }
            SceneError::Film(error) => error.fmt(f),
            #[cfg(feature = "file")]
            SceneError::File(why) => write!(f, "scene file: {why}"),
            #[cfg(feature = "file")]
            SceneError::Key { key, why } => write!(f, "{key}: {why}"),
            SceneError::Option { name, value, range } => {
                let [low, high] = range;
                write!(f, "{name} is {value}: use {low} to {high}")
            }
        }
    }
}

impl std::error::Error for SceneError {}

impl From<FilmError> for SceneError {
    fn from(error: FilmError) -> SceneError {
        SceneError::Film(error)
    }
}
