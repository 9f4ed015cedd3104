//! Selects the cameras that may be in use: those of the board. The driver of each board's cameras
//! has the same names.

mod bus;
mod free_bus;
mod identity;
mod lines;
mod registers;
pub use bus::{BUS_CLOCK, Bus, Device};
pub use identity::Error;
pub use lines::CameraLines;
pub use registers::{Comparison, Demand};

#[cfg(feature = "board-openmv-h7")]
mod mt9v034;
#[cfg(feature = "board-openmv-h7")]
mod mt9v034_registers;
#[cfg(feature = "board-openmv-h7")]
pub use {mt9v034::*, mt9v034_registers::Format};

#[cfg(feature = "board-weact")]
mod omnivision;
#[cfg(feature = "board-weact")]
mod ov5640;
#[cfg(feature = "board-weact")]
mod ov5640_registers;
#[cfg(feature = "board-weact")]
mod ov7725;
#[cfg(feature = "board-weact")]
mod ov7725_registers;
#[cfg(feature = "board-weact")]
pub use omnivision::*;

use crate::{stats, vsync};
use core::cell::Cell;
use core::sync::atomic::{AtomicI32, Ordering};
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use embassy_time::{Duration, Instant};
use hivtac_portable::capture::Edge;
use hivtac_terms::camera::{CameraLimits, CameraSettings, Rate};
use hivtac_terms::geometry::Geometry;
use hivtac_terms::units::{Microseconds, Sixteenths};
use hivtac_wire::health::Problem;
use hivtac_wire::settings::CameraReport;

/// Time from VSYNC to the middle of the exposure, µs. Written by the capture task; read by the
/// pipeline.
static EXPOSURE_MIDDLE_US: AtomicI32 = AtomicI32::new(0);

/// The camera's settings. Written at boot and by the capture task; read by the USB tasks, the
/// memory task and the pipeline.
static CAMERA: CriticalSectionMutex<Cell<CameraReport>> =
    CriticalSectionMutex::new(Cell::new(CameraReport {
        settings: CameraSettings {
            exposure: None,
            gain: None,
            rate: Rate::Full,
            white: None,
        },
        exposure: Microseconds(0),
        gain: Sixteenths(0),
        limits: FACTS.limits,
    }));

/// Lens, frame and markers of the sensor with this camera.
pub const GEOMETRY: Geometry = Geometry::preset(PRESET, WIDTH, HEIGHT);

/// Exposure and gain are accepted as they are after this time. An automatic control that moves by a
/// sixteenth every fourth frame needs a second of it for a picture 13 times too dark.
const PATIENCE: Duration = Duration::from_millis(1_500);

/// Returns the limits of the settings of the camera that answered last.
pub fn limits() -> CameraLimits {
    fitted().limits
}

/// Time from frame to frame.
pub fn frame_time(rate: Rate) -> Duration {
    Duration::from_micros((fitted().frame_us)(rate).into())
}

/// The frame time by the device's own clock, from the last two noted frames.
#[derive(Default)]
pub struct Pace {
    before: Edge,
    frame_us: Option<u32>,
}

impl Pace {
    /// Looks at the newest frame.
    fn look(&mut self) {
        let Edge { number, time_us } = vsync::newest();
        let (frames, us) = (
            number.wrapping_sub(self.before.number),
            time_us.wrapping_sub(self.before.time_us),
        );
        if frames > 0 {
            let frame_us = (us as u32).checked_div(frames);
            self.frame_us = frame_us.filter(|_| self.before.number > 0);
            self.before = Edge { number, time_us };
        }
    }

    /// The frame time, µs; `None` before two frames were noted.
    pub fn frame_us(&self) -> Option<u32> {
        self.frame_us
    }
}

/// A search for exposure and gain. It ends once they are settled and unchanged for `frames` frames,
/// or after [`PATIENCE`].
struct Search<F> {
    frames: u32,
    begun: Instant,
    /// Their newest values.
    found: F,
    /// Number of successive settled frames with these values.
    steady: u32,
}

impl<F: PartialEq> Search<F> {
    /// Begins with the current values.
    fn new(frames: u32, found: F) -> Self {
        Self {
            frames,
            begun: Instant::now(),
            found,
            steady: 0,
        }
    }

    /// Returns whether values were found that stay.
    fn is_settled(&self) -> bool {
        self.steady >= self.frames
    }

    fn is_over(&self) -> bool {
        self.is_settled() || stats::since(self.begun) >= PATIENCE
    }

    /// Takes their values a frame later; `settled` if the control has no reason to change them.
    fn look(&mut self, now: F, settled: bool) {
        self.steady = match (settled, now == self.found) {
            (true, true) => self.steady + 1,
            (true, false) => 1,
            (false, _) => 0,
        };
        self.found = now;
    }
}

/// Returns the problems, bits of [`Problem`], of a camera that was set up.
fn problems(registers_differ: bool, well_exposed: bool) -> u32 {
    let bit = |is_there, problem: Problem| if is_there { problem.bit() } else { 0 };
    bit(registers_differ, Problem::CameraRegisters) | bit(!well_exposed, Problem::Exposure)
}

/// The state of a camera, as read back.
pub struct Setting {
    /// Its identification number.
    pub id: u16,
    /// Its registers compared with the written values.
    pub comparison: Comparison,
    /// Exposure of a row.
    pub exposure: Microseconds,
    /// The longest possible exposure.
    pub longest_exposure: Microseconds,
    /// Its gain.
    pub gain: Sixteenths,
}

/// Time from the VSYNC edge that begins a frame to the middle of its middle row's exposure, µs.
/// Negative if the exposure's middle comes first.
pub fn exposure_middle_us() -> i32 {
    EXPOSURE_MIDDLE_US.load(Ordering::Relaxed)
}

/// Returns the camera's settings, and their limits.
pub fn report() -> CameraReport {
    CAMERA.lock(|cell| cell.get())
}

/// Reports the settings that the camera is about to get.
pub fn tell(settings: CameraSettings) {
    let before = report();
    CAMERA.lock(|cell| cell.set(CameraReport { settings, ..before }));
}

/// Reports the camera's settings, and the time of the exposure's middle in a frame with them.
fn store(middle_us: i32, settings: CameraSettings, exposure: Microseconds, gain: Sixteenths) {
    EXPOSURE_MIDDLE_US.store(middle_us, Ordering::Relaxed);
    let limits = limits();
    let report = CameraReport {
        settings,
        exposure,
        gain,
        limits,
    };
    CAMERA.lock(|cell| cell.set(report));
}
