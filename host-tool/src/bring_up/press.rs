//! Checks the camera's orientation with a finger's presses.

use super::report::Step;
use crate::output::note;
use hivtac_host::failure::Failure;
use hivtac_host::link::Link;
use hivtac_terms::status::Status;
use hivtac_wire::message::{DeviceMessage, Request, Sample};
use serde_json::json;
use std::time::{Duration, Instant};

/// Longest wait for a press and its end, by the computer's clock.
const PATIENCE: Duration = Duration::from_secs(60);
/// Longest part of a press that is used, by the device's clock, µs.
const LONGEST_PRESS_US: u64 = 1_000_000;
/// Least distance from the middle at which a press has a side, mm.
const BESIDE_MM: f64 = 0.7;

/// A place on the film, mm: to the right and below in the picture.
pub type Place = [f64; 2];

/// Asks for two presses, and judges whether they are seen on the right sides.
///
/// # Errors
/// When the connection breaks.
pub fn step(link: &mut Link, patience: Duration) -> Result<Step, Failure> {
    link.request(Request::Start, patience, |_| ())?;
    let side = |name: &str| {
        format!(
            "→ Look along with the camera, from behind it. Press the film {name} its middle for \
             half a second, and let go."
        )
    };
    note(&side("right of"));
    let right = press(link)?;
    let below = match right {
        Some(_) => {
            note(&side("below"));
            press(link)?
        }
        None => None,
    };
    link.request(Request::Stop, patience, |_| ())?;
    Ok(judge(right, below))
}

/// The mean place of the next press; `None` if none comes in time. A press that has begun before
/// does not count.
fn press(link: &mut Link) -> Result<Option<Place>, Failure> {
    let end = Instant::now() + PATIENCE;
    let (mut rested, mut begun_us, mut places) = (false, 0, Vec::new());
    while let Some(message) = link.receive(end)? {
        let DeviceMessage::Sample(sample) = message else {
            continue;
        };
        let touched = sample.status.contains(Status::CONTACT);
        match (place(&sample), rested) {
            _ if !touched && places.is_empty() => rested |= sample.force.is_some(),
            (Some(place), true) => {
                if places.is_empty() {
                    begun_us = sample.time_us;
                }
                places.push(place);
            }
            _ => (),
        }
        let long = sample.time_us.saturating_sub(begun_us) > LONGEST_PRESS_US;
        if !places.is_empty() && (!touched || long) {
            break;
        }
    }
    Ok(mean(&places))
}

/// The place of a sample's contact; `None` without contact or place.
fn place(sample: &Sample) -> Option<Place> {
    let place = sample.force?.place?;
    let touched = sample.status.contains(Status::CONTACT);
    touched.then(|| [place.x, place.y].map(|it| f64::from(it.0) / 1e3))
}

fn mean(places: &[Place]) -> Option<Place> {
    let count = places.len() as f64;
    let sum = |axis: usize| places.iter().map(|place| place[axis]).sum::<f64>();
    (!places.is_empty()).then(|| [sum(0) / count, sum(1) / count])
}

/// The side of the middle on which a press is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Right,
    Left,
    Below,
    Above,
}

fn side([x, y]: Place) -> Option<Side> {
    let (across, along) = (x.abs(), y.abs());
    match (across > along, x > 0.0, y > 0.0) {
        _ if across.max(along) < BESIDE_MM => None,
        (true, true, _) => Some(Side::Right),
        (true, false, _) => Some(Side::Left),
        (false, _, true) => Some(Side::Below),
        (false, _, false) => Some(Side::Above),
    }
}

/// Judges a press on the right and one below.
pub fn judge(right: Option<Place>, below: Option<Place>) -> Step {
    use Side::{Above, Below, Left, Right};
    let wrong = match (right.map(side), below.map(side)) {
        (None, _) | (_, None) => Some("no press was felt: is the tare that of the free film?"),
        (Some(None), _) | (_, Some(None)) => Some("press farther from the middle: 2 to 3 mm"),
        (Some(Some(Right)), Some(Some(Below))) => None,
        (Some(Some(Left)), Some(Some(Above))) => {
            Some("the camera is upside down: turn it by 180°, then take a new tare")
        }
        (Some(Some(Left)), Some(Some(Below))) | (Some(Some(Right)), Some(Some(Above))) => {
            Some("the picture is mirrored: a mirror is in the way, or you looked from the front")
        }
        (Some(Some(Below | Above)), Some(Some(Left | Right))) => {
            Some("the camera is turned by 90°: turn it back, then take a new tare")
        }
        _ => Some("both presses are on one axis: press on the right, then below"),
    };
    let text = |place: Option<Place>| match place {
        Some([x, y]) => format!("({x:.1}, {y:.1}) mm"),
        None => "not at all".to_owned(),
    };
    let found = format!(
        "on the right: felt {}; below: felt {}",
        text(right),
        text(below)
    );
    let figures = json!({ "right_mm": right, "below_mm": below });
    let wrong = wrong.into_iter().map(str::to_owned).collect();
    Step::new("press", found, wrong, figures)
}
