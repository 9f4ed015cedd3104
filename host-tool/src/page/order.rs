//! Orders from the page to a device: read from JSON, passed to the device's thread, and answered.

use super::press::{Fingers, Press};
use crate::contact_shape;
use crate::failure::{Failure, Kind};
use crate::reply::{CAMERA_PATIENCE, KEEP_PATIENCE};
use crate::usual_tare::usual_tare;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::threshold::{PixelFormat, Threshold};
use hivtac_wire::message::{DeviceHello, Request};
use hivtac_wire::settings::Selection;
use serde::Deserialize;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Duration;

/// An order to a device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// Take the rest position.
    Tare,
    /// Find exposure and gain.
    Expose,
    /// Set the threshold.
    Threshold(Threshold),
    /// Set the model's threshold.
    ModelThreshold,
    /// Begin a recording.
    Record,
    /// End the recording.
    StopRecording,
    /// Take a frame.
    Picture,
    /// Set the contact's shape.
    Contact(ContactShape),
    /// Keep the settings in use through restarts.
    Keep,
    /// Press the film of a simulated sensor, or release it.
    Press(Fingers),
}

/// The device's command for an order.
pub struct DeviceCommand {
    /// The command.
    pub request: Request,
    /// Longest wait for its reply.
    pub patience: Duration,
    /// The message once it is done.
    pub done: String,
}

impl Order {
    /// The command of an order to the device with this hello, whose replies take up to `patience`;
    /// `None` for a picture, a recording or a press, which are no single command.
    ///
    /// # Errors
    /// When the device has no model whose threshold it could use.
    pub fn command(
        &self,
        hello: &DeviceHello,
        patience: Duration,
    ) -> Result<Option<DeviceCommand>, Failure> {
        let (request, patience, done) = match self {
            Order::Tare => usual_tare(patience),
            Order::Expose => {
                let done = "exposure and gain found; take a new tare".to_owned();
                (Request::Expose, patience.max(CAMERA_PATIENCE), done)
            }
            Order::Threshold(wanted) => {
                let done = "threshold set".to_owned();
                (Request::SetThreshold(*wanted), patience, done)
            }
            Order::ModelThreshold => {
                let model = hello.model.as_ref();
                let none = || Failure::new(Kind::Refused, "the device has no usable model");
                let wanted = model.ok_or_else(none)?.threshold;
                let done = "threshold of the model set".to_owned();
                (Request::SetThreshold(wanted), patience, done)
            }
            Order::Contact(shape) => {
                let done = format!("what presses: {}", contact_shape::text(*shape));
                (Request::SetContactShape(*shape), patience, done)
            }
            Order::Keep => {
                let done = "settings kept through restarts".to_owned();
                let patience = patience.max(KEEP_PATIENCE);
                (Request::Keep(Selection::ALL), patience, done)
            }
            Order::Record | Order::StopRecording | Order::Picture | Order::Press(_) => {
                return Ok(None);
            }
        };
        Ok(Some(DeviceCommand {
            request,
            patience,
            done,
        }))
    }
}

/// The result of an order.
pub enum Answer {
    /// Done, in words for a person.
    Done(String),
    /// Not done, and why.
    Failed(String),
    /// The frame, as a function that makes its bytes for the page: that takes long.
    Picture(Box<dyn FnOnce() -> Vec<u8> + Send>),
}

/// An order on its way to the device's thread.
pub struct Posted {
    /// The order.
    pub order: Order,
    answer: SyncSender<Answer>,
}

impl Posted {
    /// An order, and the receiver of its answer.
    pub fn new(order: Order) -> (Posted, Receiver<Answer>) {
        let (answer, answers) = sync_channel(1);
        (Posted { order, answer }, answers)
    }

    /// Answers it; the sender may have stopped waiting.
    pub fn answer(self, answer: Answer) {
        let _ = self.answer.try_send(answer);
    }
}

/// An order as the page writes it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    sensor: usize,
    order: String,
    format: Option<String>,
    limits: Option<[u8; 6]>,
    press: Option<[f64; 5]>,
    /// A second finger's press.
    other: Option<[f64; 5]>,
    contact: Option<String>,
}

/// Reads an order and the index of its sensor.
///
/// # Errors The text names the invalid part.
pub fn parse(body: &[u8]) -> Result<(usize, Order), String> {
    let written: Written = serde_json::from_slice(body).map_err(|error| error.to_string())?;
    let order = match written.order.as_str() {
        "tare" => Order::Tare,
        "expose" => Order::Expose,
        "model_threshold" => Order::ModelThreshold,
        "record" => Order::Record,
        "stop_recording" => Order::StopRecording,
        "press" => Order::Press(fingers(&written)?),
        "release" => Order::Press([None; 2]),
        "threshold" => Order::Threshold(threshold(&written)?),
        "contact" => {
            let shape = written.contact.as_deref().unwrap_or("");
            Order::Contact(contact_shape::parse(shape)?)
        }
        "keep" => Order::Keep,
        _ => return Err("there is no such order".to_owned()),
    };
    Ok((written.sensor, order))
}

fn fingers(written: &Written) -> Result<Fingers, String> {
    let needed = "a press has a place (mm), a force (N) and two angles (degrees)";
    let first = written.press.ok_or(needed)?;
    let press = |[x, y, force_n, alpha, beta]: [f64; 5]| Press {
        place_mm: [x, y],
        force_n,
        angles_deg: [alpha, beta],
    };
    Ok([Some(press(first)), written.other.map(press)])
}

fn threshold(written: &Written) -> Result<Threshold, String> {
    let name = written.format.as_deref();
    let format = PixelFormat::ALL
        .into_iter()
        .find(|format| Some(format.name()) == name);
    let (format, limits) = format
        .zip(written.limits)
        .ok_or("a threshold has a format and six limits")?;
    Threshold::of_limits(format, limits).map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::threshold::{HsvBox, Yuv422};

    #[test]
    fn orders_are_understood() {
        let tare = parse(br#"{"sensor":1,"order":"tare"}"#);
        assert_eq!(tare, Ok((1, Order::Tare)));
        let red = parse(
            br#"{"sensor":0,"order":"threshold","format":"rgb565","limits":[170,10,100,255,45,255]}"#,
        );
        assert_eq!(red, Ok((0, Order::Threshold(HsvBox::RED.into()))));
        let cr = br#"{"sensor":0,"order":"threshold","format":"yuv422","limits":[162,0,0,0,0,0]}"#;
        let expected = Threshold::Yuv422(Yuv422 { cr_low: 162 });
        assert_eq!(parse(cr), Ok((0, Order::Threshold(expected))));
    }

    #[test]
    fn presses_have_place_force_and_angles() {
        let press = br#"{"sensor":0,"order":"press","press":[1.5,-2,0.1,4,0]}"#;
        let expected = Press {
            place_mm: [1.5, -2.0],
            force_n: 0.1,
            angles_deg: [4.0, 0.0],
        };
        assert_eq!(parse(press), Ok((0, Order::Press([Some(expected), None]))));
        let both =
            br#"{"sensor":0,"order":"press","press":[0,0,0.1,0,0],"other":[1.5,-2,0.1,4,0]}"#;
        let Ok((0, Order::Press([Some(_), second]))) = parse(both) else {
            panic!("two fingers press");
        };
        assert_eq!(second, Some(expected));
        let release = parse(br#"{"sensor":0,"order":"release"}"#);
        assert_eq!(release, Ok((0, Order::Press([None; 2]))));
    }

    #[test]
    fn whatever_else_comes_is_refused() {
        for body in [
            "",
            "{}",
            r#"{"sensor":-1,"order":"tare"}"#,
            r#"{"sensor":0,"order":"format"}"#,
            r#"{"sensor":0,"order":"tare","more":1}"#,
            r#"{"sensor":0,"order":"threshold"}"#,
            r#"{"sensor":0,"order":"press"}"#,
            r#"{"sensor":0,"order":"press","press":[0,0,1]}"#,
            r#"{"sensor":0,"order":"press","other":[0,0,1,0,0]}"#,
            r#"{"sensor":0,"order":"press","press":[0,0,1e999,0,0]}"#,
            r#"{"sensor":0,"order":"threshold","format":"rgb565","limits":[180,0,0,0,0,0]}"#,
            r#"{"sensor":0,"order":"threshold","format":"rgb565","limits":[300,0,0,0,0,0]}"#,
            r#"{"sensor":0,"order":"threshold","format":"mono","limits":[9,8,0,0,0,0]}"#,
            r#"{"sensor":0,"order":"threshold","format":"ccd","limits":[9,8,0,0,0,0]}"#,
        ] {
            assert!(parse(body.as_bytes()).is_err(), "{body}");
        }
    }
}
