//! What two sensors feel together.

use crate::connection::{Connection, Talk};
use crate::error::raised;
use hivtac_host::failure::Failure;
use hivtac_host::grip::geometry::Geometry;
use hivtac_host::grip::pair::Pair;
use hivtac_host::grip::{self, Held, Reading, lines};
use pyo3::prelude::*;
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Longest wait for a finger before the other one's turn.
const TURN: Duration = Duration::from_millis(1);

/// Grip force and margin, N, each with its standard uncertainty; common force, N, and torque, N·m,
/// each with those of its components.
type HeldNumbers = (
    [f64; 2],
    [f64; 2],
    ([f64; 3], [f64; 3]),
    Option<([f64; 3], [f64; 3])>,
);

/// Time, s since 1970; names of the status bits of both fingers; whether both are touched; the
/// grip, and why it is unknown.
type GripNumbers = (
    f64,
    [Vec<&'static str>; 2],
    Option<bool>,
    Option<HeldNumbers>,
    Option<String>,
);

/// Two connected sensors.
#[pyclass(frozen)]
pub struct Grips {
    talks: [Arc<Talk>; 2],
    names: [String; 2],
    patience: Duration,
    state: Mutex<State>,
}

struct State {
    pair: Pair,
    known: VecDeque<grip::Grip>,
}

#[pymethods]
impl Grips {
    /// Of two connections; `poses` is a file (docs/robots.md).
    #[new]
    fn new(first: &Connection, second: &Connection, poses: Option<PathBuf>) -> PyResult<Grips> {
        let geometry = poses.map(|path| Geometry::read(&path)).transpose();
        let geometry = geometry.map_err(raised)?.unwrap_or_default();
        Ok(Grips {
            talks: [first.talk()?, second.talk()?],
            names: [first, second].map(|it| lines::finger(it.device())),
            patience: first.patience(),
            state: Mutex::new(State {
                pair: Pair::new(geometry),
                known: VecDeque::new(),
            }),
        })
    }

    /// The next grip.
    fn next(&self, py: Python<'_>) -> PyResult<GripNumbers> {
        let next = py.detach(|| self.wait());
        next.map(|grip| self.numbers(&grip)).map_err(raised)
    }
}

impl Grips {
    fn wait(&self) -> Result<grip::Grip, Failure> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if let Some(grip) = state.known.pop_front() {
                return Ok(grip);
            }
            for (finger, talk) in self.talks.iter().enumerate() {
                let arrived = talk.arrived(self.patience, |reader| reader.next_within(TURN))?;
                if let Some(it) = arrived {
                    let reading = Reading::of(&it.sample, it.exposed_ns, it.came_ns);
                    let grips = state.pair.push(finger, reading);
                    state.known.extend(grips);
                }
            }
        }
    }

    fn numbers(&self, grip: &grip::Grip) -> GripNumbers {
        (
            grip.stamp_ns as f64 / 1e9,
            grip.status.map(|status| status.names().collect()),
            grip.contact(),
            grip.held.as_ref().ok().map(held),
            lines::cause(grip, &self.names),
        )
    }
}

fn held(held: &Held) -> HeldNumbers {
    (
        [held.force, held.force_sigma],
        [held.margin, held.margin_sigma],
        (held.common, held.common_sigma),
        held.torque,
    )
}
