//! Tests of the package from outside.

mod conditions;
mod determinism;
mod geometry;
mod layouts;
mod rendering;
mod scene_file;
