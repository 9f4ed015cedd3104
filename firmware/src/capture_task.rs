//! Keeps frames coming: hands out buffers, drops what is broken, restarts a camera that fell silent.

use crate::camera::Camera;
use crate::capture::{Capture, Failure};
use crate::frame::{CAPTURED, Captured, FREE, Frame};
use crate::health::{self, Condition};
use crate::vsync::{self, Edge};
use crate::{camera, log, stats};
use embassy_time::{Duration, Timer};
use hivtac_wire::message::LogLevel;

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
        last: Edge::default(),
        silences: 0,
        after_overrun: false,
        after_restart: false,
    };
    task.start_camera().await;
    loop {
        let frame = FREE.receive().await;
        task.step(frame).await;
    }
}

struct CaptureTask {
    camera: Camera,
    capture: Capture,
    /// VSYNC edges count since the first register reset.
    numbering: bool,
    /// Edge of the newest frame that was captured or counted as lost.
    last: Edge,
    /// In a row.
    silences: u32,
    after_overrun: bool,
    after_restart: bool,
}

impl CaptureTask {
    /// Captures into `frame` and passes it on, or counts why not.
    async fn step(&mut self, frame: &'static mut Frame) {
        match self.capture.frame(frame).await {
            Ok(edge) => self.deliver(frame, edge).await,
            Err((failure, edge)) => {
                FREE.send(frame).await;
                self.lost(failure, edge).await;
            }
        }
    }

    async fn deliver(&mut self, frame: &'static mut Frame, edge: Edge) {
        self.frames_missed_before(edge);
        self.silences = 0;
        let captured = Captured {
            frame,
            edge,
            after_overrun: core::mem::take(&mut self.after_overrun),
            after_restart: core::mem::take(&mut self.after_restart),
        };
        CAPTURED.send(captured).await;
    }

    async fn lost(&mut self, failure: Failure, edge: Edge) {
        defmt::warn!("frame {=u32} lost: {}", edge.number, failure);
        let begun = edge.number != self.last.number;
        self.frames_missed_before(edge);
        match failure {
            Failure::Overrun => self.overrun(),
            Failure::Size => stats::DROPPED_SIZE.count(),
            Failure::Silence if begun => stats::DROPPED_SIZE.count(),
            Failure::Silence => {}
        }
        match failure {
            Failure::Silence => self.silent().await,
            Failure::Overrun | Failure::Size => {
                self.silences = 0;
                health::set(Condition::NoForce);
            }
        }
    }

    fn overrun(&mut self) {
        stats::DROPPED_OVERRUN.count();
        stats::CAPTURE_OVERRUNS.count();
        self.after_overrun = true;
    }

    /// Counts the frames between the last one and the one that `edge` began: nothing was armed for them.
    fn frames_missed_before(&mut self, edge: Edge) {
        let passed = edge.number.saturating_sub(self.last.number);
        stats::DROPPED_BUSY.add(passed.saturating_sub(1));
        self.last = edge;
    }

    async fn silent(&mut self) {
        stats::CAMERA_TIMEOUTS.count();
        self.silences += 1;
        if self.silences >= SILENCES {
            health::set(Condition::NoCamera);
            self.silences = 0;
            self.after_restart = true;
            log::say(
                LogLevel::Warning,
                format_args!("camera silent, restarting it"),
            );
            self.start_camera().await;
            stats::CAMERA_RESTARTS.count();
        }
    }

    /// Sets the camera up; tries until it answers. Frames that pass meanwhile count as dropped at once.
    async fn start_camera(&mut self) {
        stats::pass_over_frames_after(self.last.number);
        self.try_until_it_answers().await;
        self.last = vsync::newest();
        stats::end_passing_over(self.last.number);
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
