//! The events of the page: samples, true presses and states, as JSON.

use super::feed::News;
use super::lights;
use crate::force_fields::{FORCE, PLACE, TORQUE};
use crate::shown::to_json;
use hivtac_terms::force::Force;
use hivtac_wire::message::Sample;
use serde::Serialize;
use serde_json::{Value, json};

/// An event: its name, and its data as JSON in one line.
pub type Event = (&'static str, String);

/// The first event. `obeys` says whether the sensors take orders from the page, `presses` whether
/// it can press their films.
pub fn hello(sensors: usize, obeys: bool, presses: bool) -> Event {
    let hello = Hello {
        sensors,
        obeys,
        presses,
        lights: lights::all(),
    };
    ("hello", to_json(&hello))
}

/// The events of a sensor's news: state, true presses, samples.
pub fn events(sensor: usize, news: &News) -> Vec<Event> {
    let mut events = Vec::new();
    if let Some(state) = &news.state {
        let state = format!("{{\"sensor\":{sensor},\"state\":{state}}}");
        events.push(("state", state));
    }
    if !news.truths.is_empty() {
        let truths = json!({ "sensor": sensor, "truths": news.truths });
        events.push(("truths", truths.to_string()));
    }
    if !news.samples.is_empty() {
        let samples = Samples {
            sensor,
            skipped: news.skipped,
            samples: news.samples.iter().map(Row::from).collect(),
        };
        events.push(("samples", to_json(&samples)));
    }
    events
}

/// The data of the first event.
#[derive(Serialize)]
struct Hello {
    sensors: usize,
    obeys: bool,
    presses: bool,
    lights: Vec<lights::Light>,
}

#[derive(Serialize)]
struct Samples {
    sensor: usize,
    skipped: u64,
    samples: Vec<Row>,
}

/// A sample: sequence number, frame, device time (µs), status; then its force or `null`, and the
/// two contacts that the force is the sum of, if they are resolved.
#[derive(Serialize)]
struct Row(u32, u32, u64, u32, Option<Value>, Vec<Value>);

/// A sample as the page reads it.
pub fn row(sample: &Sample) -> impl Serialize + use<> {
    Row::from(sample)
}

impl From<&Sample> for Row {
    fn from(sample: &Sample) -> Row {
        Row(
            sample.sequence,
            sample.frame,
            sample.time_us,
            sample.status.0,
            sample.force.as_ref().map(force_row),
            sample.contacts.iter().map(force_row).collect(),
        )
    }
}

/// Fx, Fy, Fz, |F| and its standard uncertainty; α, β and the direction's standard uncertainty;
/// then the place or `null`, and the torque or `null`. Integers as in the wire format.
fn force_row(force: &Force) -> Value {
    let [alpha, beta, size, x, y, z, angle_sigma, size_sigma] = FORCE.map(|it| it.integer(force));
    let place = force.place.as_ref();
    let place = place.map(|place| PLACE.map(|it| it.integer(place)));
    let torque = force.torque.as_ref();
    let torque = torque.map(|torque| TORQUE.map(|it| it.integer(torque)));
    json!([
        x,
        y,
        z,
        size,
        size_sigma,
        alpha,
        beta,
        angle_sigma,
        place,
        torque
    ])
}
