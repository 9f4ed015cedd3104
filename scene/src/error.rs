//! What can be wrong with a scene.

use std::fmt;

/// A scene, size, load or option that cannot be simulated. The message says what, where and what is possible.
#[derive(Clone, Debug, PartialEq)]
pub enum SceneError {
    /// No scene of this name.
    UnknownScene(String),
    /// No geometry preset of this name.
    UnknownPreset(String),
    /// A frame size that the simulated camera does not have.
    Size {
        /// Columns asked for.
        width: u32,
        /// Rows asked for.
        height: u32,
    },
    /// A load that is no number, pulls, or presses the film further than it can go.
    Load(String),
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

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SceneError::UnknownScene(name) => {
                write!(f, "unknown scene `{name}`: use rest, static, demo or sweep")
            }
            SceneError::UnknownPreset(name) => {
                write!(f, "unknown preset `{name}`: use paper or ov7725")
            }
            SceneError::Size { width, height } => write!(
                f,
                "frame size {width}×{height}: use a 4:3 size from 160×120 to 800×600, such as 320×240"
            ),
            SceneError::Load(why) => write!(f, "load: {why}"),
            SceneError::Option { name, value, range } => {
                let [low, high] = range;
                write!(f, "option {name} is {value}: use {low} to {high}")
            }
        }
    }
}

impl std::error::Error for SceneError {}
