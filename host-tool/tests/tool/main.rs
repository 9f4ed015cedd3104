//! The tool against scripted devices: what it prints, and how it ends.
#![cfg(unix)]

mod bring_up;
mod commands;
mod documents;
mod endings;
mod fake;
mod firmware;
mod health;
mod monitor;
mod recordings;
mod rests;
mod run;
mod sense;
mod serve;
mod settings;
mod snapshot;
mod threshold_auto;
mod update;
mod view;
