//! Keeps the camera going: sets it up, changes its pixel format or has it expose anew, and starts
//! it again when it falls silent.

use crate::camera::{self, Camera, FRAME_TIME, Format};
use crate::capture::Capture;
use crate::health::{self, Condition};
use crate::session::Asked;
use crate::shared::{EXPOSING, REQUESTED_EXPOSURE, REQUESTED_FORMAT};
use crate::{log, outbox, stats, vsync};
use core::sync::atomic::Ordering;
use embassy_futures::select::{Either3, select3};
use embassy_time::{Duration, Timer};
use hivtac_capture::Event;
use hivtac_wire::message::{LogLevel, Outcome};

/// So many frame times without a band or the end of a frame are a silence. Bands come all the
/// time but for the vertical blanking, a seventh of a frame.
const SILENCE: u32 = 2;
/// So many silences in a row, and the camera is set up again.
const SILENCES: u32 = 3;
/// Pause before the next attempt when the camera does not answer.
const RETRY: Duration = Duration::from_millis(500);

/// Has exposure and gain found anew for the command `id`; `Busy` while they are.
pub fn expose(id: u16) -> Option<Outcome> {
    if EXPOSING.swap(true, Ordering::Relaxed) {
        return Some(Outcome::Busy);
    }
    REQUESTED_EXPOSURE.signal(Asked::by(id));
    None
}

/// Runs for ever at the capture executor's priority. The camera begins with `format`.
#[embassy_executor::task]
pub async fn run(camera: Camera, mut capture: Capture, format: Format) {
    capture.set_format(format);
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
        let frame_time = Timer::after(FRAME_TIME);
        let (format, exposure) = (REQUESTED_FORMAT.wait(), REQUESTED_EXPOSURE.wait());
        match select3(format, exposure, frame_time).await {
            Either3::First(format) => task.change_format(format).await,
            Either3::Second(asked) => task.expose(asked).await,
            Either3::Third(()) if task.is_silent() => task.silent().await,
            Either3::Third(()) => {}
        }
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
    /// Looks whether something has come during the last frame time; whether nothing has for too
    /// long.
    fn is_silent(&mut self) -> bool {
        let activity = self.capture.activity();
        if activity != self.activity {
            (self.quiet, self.silences) = (0, 0);
        } else {
            self.quiet += 1;
        }
        self.activity = activity;
        let silent = self.quiet >= SILENCE;
        if silent {
            self.quiet = 0;
        }
        silent
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

    /// Sets the camera up; tries until it answers.
    async fn start_camera(&mut self) {
        let restart = self.numbering;
        let from = self.stop();
        self.try_until_it_answers().await;
        self.go_on(from, restart).await;
    }

    /// Has the camera send other pixels.
    async fn change_format(&mut self, format: Format) {
        let from = self.stop();
        self.capture.set_format(format);
        let answered = self.camera.set_format(format).await;
        self.go_on_when_set_up(from, answered).await;
    }

    /// Has the camera find exposure and gain anew.
    async fn expose(&mut self, asked: Asked) {
        let from = self.stop();
        let answered = self.camera.lock_exposure().await;
        self.go_on_when_set_up(from, answered).await;
        EXPOSING.store(false, Ordering::Relaxed);
        if let Some(id) = asked.id() {
            outbox::reply(id, Outcome::Done);
        }
    }

    /// Captures again; a camera that did not answer is set up anew before.
    async fn go_on_when_set_up(&mut self, from: u32, answered: Result<(), camera::Error>) {
        if let Err(error) = answered {
            log::say(LogLevel::Error, format_args!("camera: {error}"));
            self.try_until_it_answers().await;
            stats::CAMERA_RESTARTS.count();
        }
        self.go_on(from, answered.is_err()).await;
    }

    /// Captures no more; the newest frame so far. Frames that pass from now on count as dropped at
    /// once.
    fn stop(&mut self) -> u32 {
        self.capture.stop();
        let from = match self.numbering {
            true => vsync::newest().number,
            false => 0,
        };
        stats::pass_over_frames_after(from);
        from
    }

    /// Captures again, after the frames that passed since [`stop`](Self::stop).
    async fn go_on(&mut self, from: u32, restart: bool) {
        let to = vsync::newest().number;
        stats::end_passing_over(to);
        let passed = Event::Passed { from, to, restart };
        self.capture.start(passed).await;
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
        self.camera.configure(self.capture.format()).await
    }
}
