//! Tests that cross folders. They are one program, to run in parallel and to be linked once. `cargo
//! test -p hivtac-tests hard_cases::` runs the tests of one file.

mod bring_up;
mod calibration;
mod cortex_m;
mod documents;
mod faults;
mod forces;
mod formats;
mod hard_cases;
mod hard_cases_anywhere;
mod looks;
mod markers;
mod moving;
mod ov5640;
mod panics;
mod placement;
mod places;
mod recordings;
mod rig;
mod rooms;
mod sigma;
mod snapshots;
mod status_bits;
mod steps;
mod tares;
mod three_markers;
mod turned;
mod twin;
mod view;
mod view_twin;
mod web;
mod wire_vectors;
