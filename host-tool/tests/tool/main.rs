//! Tests the tool with simulated devices: its output and its exit codes.
#![cfg(unix)]

mod bring_up;
mod commands;
mod documents;
mod endings;
mod fake;
mod firmware;
mod health;
mod messages;
mod monitor;
mod reader;
mod recordings;
mod rests;
mod run;
mod sense;
mod serve;
mod settings;
mod snapshot;
mod threshold_auto;
#[cfg(feature = "twin")]
mod twin;
mod uart;
mod update;
mod view;
