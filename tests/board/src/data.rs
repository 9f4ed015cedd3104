//! The frames and models that are measured, as `benchmark-cases` (in `tests`) wrote them.

use hivtac_sensor::force::model::AlignedFile;

/// A frame and the model that is for it.
pub struct Frame {
    /// Columns and rows.
    pub size: [u16; 2],
    /// What is special about it; empty for the usual one.
    pub special: &'static str,
    /// RGB565 as the camera's interface leaves it in memory.
    pub pixels: &'static [u8],
    /// A model file.
    pub model: &'static [u8],
}

/// A model by itself.
pub struct Network {
    /// Its layers: `11-64-64-3`.
    pub name: &'static str,
    /// A model file.
    pub model: &'static [u8],
}

// `FRAMES` and `NETWORKS`.
include!(concat!(
    env!(
        "HIVTAC_BOARD_DATA",
        "the frames are missing: build this by `cargo xtask bench --board`"
    ),
    "/board.rs"
));
