//! Whole frames, or only the rectangle around the windows that follow the markers (cargo feature `tracking`).
//!
//! Cropped by DCMI, a frame costs the DMA, the bus and the scanner a part of what a whole one costs. In doubt (a marker
//! leaves its window, its area jumps, a status) that frame has no force and the next one is captured whole. Without the
//! feature every frame is.

use crate::bands::{FRAME, SHAPE};
use crate::capture;
use crate::pipeline_task::Sensor;
use crate::stats;
use hivtac_capture::Window;
use hivtac_sensing::pipeline::Measurement;
use hivtac_sensing::windows::{Rectangle, Tracks};

const TRACKING: bool = cfg!(feature = "tracking");

/// What is captured of the frame under way, and where the markers were.
pub struct Follow {
    window: Window,
    tracks: Tracks,
}

impl Follow {
    /// Before the first frame.
    pub const fn new() -> Self {
        Self {
            window: FRAME,
            tracks: Tracks::new(),
        }
    }

    /// Begins a frame of which `window` was captured.
    pub fn begin(&mut self, sensor: &mut Sensor, window: Window) {
        self.window = window;
        if window == FRAME {
            sensor.begin_frame();
        } else {
            sensor.begin_cropped(rectangle(window));
        }
    }

    /// Measures it, and tells what to capture of the next one.
    pub fn finish(&mut self, sensor: &mut Sensor) -> Measurement {
        if !TRACKING {
            return sensor.finish_frame();
        }
        let measurement = if self.window == FRAME {
            let measurement = sensor.finish_frame();
            self.tracks.measured_whole(measurement.markers.as_ref());
            measurement
        } else {
            sensor.finish_cropped(&mut self.tracks, rectangle(self.window))
        };
        let tally = self.tracks.tally();
        stats::FRAMES_TRACKED.set(tally.tracked);
        stats::TRACKING_LOST.set(tally.fallen_back);
        capture::set_window(self.wanted(sensor));
        measurement
    }

    fn wanted(&self, sensor: &Sensor) -> Window {
        let dilations = sensor.settings().dilations;
        let around = self.tracks.rectangle(FRAME.width, FRAME.height, dilations);
        let window = around.and_then(|around| {
            let window = Window {
                left: around.x0,
                top: around.y0,
                width: around.width(),
                height: around.height(),
            };
            window.capturable(FRAME, SHAPE)
        });
        window.unwrap_or(FRAME)
    }
}

fn rectangle(window: Window) -> Rectangle {
    Rectangle {
        x0: window.left,
        y0: window.top,
        x1: window.left + window.width,
        y1: window.top + window.height,
    }
}
