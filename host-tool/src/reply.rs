//! A device's replies and lines in words for a person.

use crate::failure::{Failure, Kind};
use crate::shown::shown;
use hivtac_wire::message::{LogLevel, LogLine, Outcome, Request};
use hivtac_wire::version::HelloPrefix;
use std::time::Duration;

/// Longest time for keeping settings: erasing a sector takes 1 to 2 s and is repeated for a worn
/// one.
pub const KEEP_PATIENCE: Duration = Duration::from_secs(20);

/// Longest time for setting the camera: the search for exposure takes up to 1.5 s, at the lowest
/// rate after a quarter of a second.
pub const CAMERA_PATIENCE: Duration = Duration::from_secs(4);

/// The name of the command that a camera may be unable to carry out.
const SET_THRESHOLD: &str = "set threshold";

/// A command's name.
pub fn name_of(request: &Request) -> &'static str {
    match request {
        Request::GetInfo => "get info",
        Request::Start => "start",
        Request::Stop => "stop",
        Request::SetThreshold(_) => SET_THRESHOLD,
        Request::Tare { .. } => "tare",
        Request::StartWithMarkers => "start with markers",
        Request::Expose => "expose",
        Request::Snapshot => "snapshot",
        Request::Inspect => "inspect",
        Request::GetSettings => "get settings",
        Request::SetName(_) => "set name",
        Request::SetTemporal(_) => "set limits of touch, slip, filter and re-zeroing",
        Request::SetTare(_) => "set tare",
        Request::Keep(_) => "keep settings",
        Request::BeginModel { .. } => "begin model",
        Request::ModelPart(_) => "model part",
        Request::UseModel => "use model",
        Request::UseBuiltInModel => "use built-in model",
        Request::Reset => "reset",
        Request::TareAnyway { .. } => "tare",
        Request::GetHealth => "get health",
        Request::StartLoader => "start loader",
        Request::SetCamera(_) => "set the camera",
        Request::SetContactShape(_) => "set the shape of what presses",
    }
}

/// Advice when no reply came. The device may still carry the command out.
fn after_silence(request: &Request) -> &'static str {
    match request {
        Request::Keep(_) => {
            "it may be writing still and keep them all the same: wait 10 s, see what is kept with \
             `hivtac settings get`, and try again if it is not"
        }
        Request::UseModel | Request::UseBuiltInModel | Request::Reset => {
            "it may be writing still and do it all the same: wait 10 s, see with `hivtac info` \
             which model it uses, and try again if it is another one"
        }
        _ => {
            "it may do it all the same: wait 10 s and try again; when it repeats, `hivtac info` \
             shows whether it restarts"
        }
    }
}

/// The failure of a command without a reply within `patience`.
pub fn unanswered(request: &Request, patience: Duration) -> Failure {
    let (what, advice) = (name_of(request), after_silence(request));
    let seconds = patience.as_secs_f32();
    refused(format!(
        "the device did not answer \"{what}\" within {seconds} s; {advice}"
    ))
}

/// The failure for the device `name` with another version of the protocol.
pub fn foreign(name: &str, device: HelloPrefix) -> Failure {
    let host = HelloPrefix::OURS;
    let message = format!(
        "the device at {name} speaks protocol {} (schema {:#018x}), this tool protocol {} (schema \
         {:#018x}); use the hivtac and the firmware of one release",
        device.protocol, device.schema, host.protocol, host.schema
    );
    Failure::new(Kind::Version, message)
}

fn refused(message: String) -> Failure {
    Failure::new(Kind::Refused, message)
}

/// Turns the outcome of the command `what` into a result.
///
/// # Errors
/// [`Kind::Refused`] with the reason unless the outcome is `Done`.
pub fn judge(what: &str, outcome: Outcome) -> Result<(), Failure> {
    let why = match outcome {
        Outcome::Done => return Ok(()),
        Outcome::InvalidArgument => "an argument is outside its range",
        Outcome::Unsupported if what == SET_THRESHOLD => {
            "it cannot do that: its camera does not send that pixel format; choose another"
        }
        Outcome::Unsupported => {
            "it cannot do that: a recording only plays, and a simulated sensor has neither \
             registers nor a loader"
        }
        Outcome::Busy => {
            "it is still busy with an earlier command, perhaps one that was not answered or of \
             another program: wait 10 s and try again"
        }
        Outcome::NotRead => "this computer took no bytes for 0.1 s; is it busy? try again",
        Outcome::NoCamera => {
            "its camera does not answer, or is another one; `hivtac bring-up` says what to do"
        }
        Outcome::Worn => {
            "its flash is worn, or its supply is under 2.8 V, and keeps nothing new; it works on, \
             with what it kept before at each start"
        }
        Outcome::ModelUnusable => {
            "it cannot use this model file; the one in use goes on, and the device's line above \
             says why"
        }
        Outcome::AnotherSensor => {
            "the model was made for another sensor, camera or frame; the one in use goes on, and \
             the device's line above says which"
        }
        Outcome::NotAtRest => {
            "the markers are not where a film at rest has them; take away what touches it, and \
             check the film's distance"
        }
        Outcome::MarkersImplausible => {
            "the images at rest are not those of four whole, equal markers: one may be covered, \
             cut, stained or glare; look at the film and its light, and clean it"
        }
        Outcome::Touched { looks_like } => {
            let millinewtons = f64::from(looks_like.0) * 1e-3;
            &format!(
                "the film looks touched, by {millinewtons:.1} mN, compared with the film at an \
                 earlier tare, at its calibration, or of sensors as built; take away what touches it, or \
                 say --force when nothing does"
            )
        }
        Outcome::Unsteady => {
            "the markers moved meanwhile; take away what touches or shakes the film"
        }
        Outcome::NoGoodFrames => {
            "not enough good frames came in time; does the camera see all four markers? (hivtac \
             monitor)"
        }
    };
    Err(refused(format!("the device refused \"{what}\": {why}")))
}

/// The text of a device's log line, for standard error.
pub fn log_text(line: &LogLine) -> String {
    let level = match line.level {
        LogLevel::Error => "error",
        LogLevel::Warning => "warning",
        LogLevel::Info => "info",
    };
    let seconds = line.time_us as f64 / 1e6;
    format!("device, {seconds:.3} s, {level}: {}", shown(&line.text))
}
