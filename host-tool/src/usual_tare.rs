//! The usual tare: its number of frames, its time limit, and its messages.

use hivtac_wire::message::Request;
use std::time::Duration;

/// Time for a tare in addition to its frames.
pub const TARE_PATIENCE: Duration = Duration::from_secs(10);
/// Good frames that a tare averages by default.
pub const TARE_FRAMES: u16 = 32;

/// The default tare: the request, the longest time it may take, and the message when it is done.
pub fn usual_tare(patience: Duration) -> (Request, Duration, String) {
    let frames = TARE_FRAMES;
    let done = taken_over(frames);
    (Request::Tare { frames }, patience.max(TARE_PATIENCE), done)
}

/// The message of a tare over this number of frames.
pub fn taken_over(frames: u16) -> String {
    format!("tare taken over {frames} frames")
}
