//! Keeps the camera going: sets it up, and starts it again when it falls silent.

use crate::camera::{self, Camera, FRAME_TIME};
use crate::capture::{Capture, EVENTS};
use crate::health::{self, Condition};
use crate::{log, stats, vsync};
use embassy_time::{Duration, Timer};
use hivtac_capture::Event;
use hivtac_wire::message::LogLevel;

/// So many frame times without a band or the end of a frame are a silence. Bands come all the time but for the vertical
/// blanking, a seventh of a frame, or what a crop window leaves out.
const SILENCE: u32 = 2;
/// So many silences in a row, and the camera is set up again.
const SILENCES: u32 = 3;
/// Pause before the next attempt when the camera does not answer.
const RETRY: Duration = Duration::from_millis(500);

/// Runs for ever at the capture executor's priority.
#[embassy_executor::task]
pub async fn run(camera: Camera, capture: Capture) {
    let mut task = CaptureTask {
        camera,
        capture,
        numbering: false,
        activity: 0,
        quiet: 0,
        silences: 0,
    };
    task.start_camera().await;
    loop {
        Timer::after(FRAME_TIME).await;
        task.listen().await;
    }
}

struct CaptureTask {
    camera: Camera,
    capture: Capture,
    /// VSYNC edges count since the first register reset.
    numbering: bool,
    /// [`Capture::activity`] when it was looked at last.
    activity: u32,
    /// Frame times without activity.
    quiet: u32,
    /// In a row.
    silences: u32,
}

impl CaptureTask {
    /// Looks whether something has come during the last frame time.
    async fn listen(&mut self) {
        let activity = self.capture.activity();
        if activity != self.activity {
            (self.quiet, self.silences) = (0, 0);
        } else {
            self.quiet += 1;
        }
        self.activity = activity;
        if self.quiet >= SILENCE {
            self.quiet = 0;
            self.silent().await;
        }
    }

    async fn silent(&mut self) {
        stats::CAMERA_TIMEOUTS.count();
        self.silences += 1;
        if self.silences >= SILENCES {
            health::set(Condition::NoCamera);
            self.silences = 0;
            log::say(
                LogLevel::Warning,
                format_args!("camera silent, restarting it"),
            );
            self.start_camera().await;
            stats::CAMERA_RESTARTS.count();
        } else {
            self.capture.start_again();
            // What that told is no sign of life.
            self.activity = self.capture.activity();
        }
    }

    /// Sets the camera up; tries until it answers. Frames that pass meanwhile count as dropped at once.
    async fn start_camera(&mut self) {
        self.capture.stop();
        let restart = self.numbering;
        let from = if restart { vsync::newest().number } else { 0 };
        stats::pass_over_frames_after(from);
        self.try_until_it_answers().await;
        let to = vsync::newest().number;
        stats::end_passing_over(to);
        EVENTS.send(Event::Passed { from, to, restart }).await;
        self.capture.start();
    }

    async fn try_until_it_answers(&mut self) {
        while let Err(error) = self.try_camera().await {
            health::set(Condition::NoCamera);
            log::say(LogLevel::Error, format_args!("camera: {error}"));
            Timer::after(RETRY).await;
        }
    }

    async fn try_camera(&mut self) -> Result<(), camera::Error> {
        self.camera.reset().await?;
        if !self.numbering {
            self.numbering = true;
            vsync::restart_count();
        }
        self.camera.configure().await
    }
}
