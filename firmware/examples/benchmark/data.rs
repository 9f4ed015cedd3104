//! The measured frames and models, as `benchmark-cases` (in `tests`) wrote them.

use hivtac_sensor::force::model::AlignedFile;

/// A frame and the model for it.
pub struct Frame {
    /// Columns and rows.
    pub size: [u16; 2],
    /// The frame's special property; empty for the usual one.
    pub special: &'static str,
    /// RGB565 in the order in which the camera interface stores it in memory.
    pub pixels: &'static [u8],
    /// A model file.
    pub model: &'static [u8],
}

/// A model that is measured alone.
pub struct Network {
    /// Its layers: `network 11-64-64-3`.
    pub name: &'static str,
    /// A model file.
    pub model: &'static [u8],
}

// This file defines `FRAMES` and `NETWORKS`.
include!(concat!(
    env!(
        "HIVTAC_BOARD_DATA",
        "the frames are missing: build this by `cargo xtask bench --board`"
    ),
    "/board.rs"
));
