//! What can be wrong with a scene.

use std::fmt;

use crate::film::FilmError;

use crate::{Motion, Preset, PresetCamera};

/// A scene, size, load or option that cannot be simulated. The message says what, where and what is
/// possible.
#[derive(Clone, Debug, PartialEq)]
pub enum SceneError {
    /// No scene of this name.
    UnknownScene(String),
    /// No pixel format of this name.
    UnknownFormat(String),
    /// A frame size that the simulated camera does not have.
    Size {
        /// Whose camera.
        preset: Preset,
        /// Columns asked for.
        width: u32,
        /// Rows asked for.
        height: u32,
    },
    /// A load or a film that cannot be.
    Film(FilmError),
    /// A scene file that is not one: the line, the key and what is possible.
    #[cfg(feature = "file")]
    File(String),
    /// A key of a scene file whose value does not fit the others.
    #[cfg(feature = "file")]
    Key {
        /// The key.
        key: &'static str,
        /// Why not.
        why: String,
    },
    /// An option outside its range.
    Option {
        /// The option's name.
        name: &'static str,
        /// The value given.
        value: f64,
        /// The smallest and the largest value that is possible.
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
