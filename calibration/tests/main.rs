//! Tests of the package from outside: its library, and its program.

mod collect;
mod command_line;
mod committed_model;
mod dots;
mod evaluate;
mod layouts;
mod numerics;
mod pytorch;
mod quantization;
mod training;
