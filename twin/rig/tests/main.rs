//! Tests of the flashed firmware in the rig. They are one program, to run in parallel and to be
//! linked once. `cargo test settings::` runs the tests of one file.

mod common;

mod attack;
mod camera;
mod camera_settings;
mod cameras;
mod command;
mod cuts;
mod energy;
mod failures;
mod faults;
mod firmware;
mod format;
mod health;
mod image;
mod led;
mod looks;
mod models;
mod openmv;
mod output;
mod ov5640;
mod rules;
mod seeded_bugs;
mod settings;
mod silicon;
mod slip;
mod snapshot;
mod supply;
mod tare;
mod threshold;
mod uart;
mod usb;
mod usb_dead;
mod usbip;
