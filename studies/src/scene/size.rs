//! Frame sizes on the command line.

use std::fmt;
use std::str::FromStr;

use anyhow::{Context, Error, Result};

/// Columns and rows of a frame; whether a camera has them is the scene's to say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    pub width: u32,
    pub height: u32,
}

impl FromStr for Size {
    type Err = Error;

    fn from_str(text: &str) -> Result<Size> {
        let parsed = text.split_once(['x', '×']).and_then(|(width, height)| {
            Some(Size {
                width: width.parse().ok()?,
                height: height.parse().ok()?,
            })
        });
        parsed.context("use columns and rows, such as 320x240")
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}
