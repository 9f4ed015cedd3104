//! The flashed firmware in the rig. One program, so that its tests run side by side whatever they
//! are about, and are linked once; `cargo test settings::` runs one file's.

mod common;

mod attack;
mod camera;
mod camera_settings;
mod command;
mod cuts;
mod faults;
mod firmware;
mod format;
mod health;
mod led;
mod looks;
mod models;
mod openmv;
mod rules;
mod seeded_bugs;
mod settings;
mod silicon;
mod slip;
mod snapshot;
mod tare;
mod threshold;
mod usb;
