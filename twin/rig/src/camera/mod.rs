//! The camera, an OV7725, an OV5640 or an MT9V034: registers on its control bus, a clock from the
//! microcontroller, and pixels that its registers describe.
//!
//! The sensor runs by itself. It never waits for the firmware, and its registers, power-up values
//! included, decide what it sends. Geometry, format and clock take effect at the start of a frame.
//! A register reset, a change of the input clock and power-up restart the frame timing; the first
//! VSYNC edge comes one frame later.
//!
//! OV7725: exposure, gain and colours follow the registers (`exposure`, `colour`). A register whose
//! reset value differs between sources gets another value for each seed. Capturing a frame that
//! depends on such an unwritten register breaks a rule. Not simulated: the zoom registers (the
//! window is scaled to the output size by taking the nearest pixel), automatic frame rate,
//! automatic white balance. MT9V034: `mt9v034`; OV5640: `ov5640`.

pub mod colour;
pub mod encode;
mod exposure;
pub mod mt9v034;
pub mod mt9v034_registers;
pub mod output;
mod ov5640;
pub mod ov5640_registers;
mod ov7725;
pub mod part;
pub mod registers;
pub mod sccb;
mod two_wire;

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::faults::{Faults, Kind};
use crate::frame_source::{FrameSource, Picture};
use crate::rules::Rules;
use crate::truth::{Exposed, TruthLog};
use mt9v034::Mt9v034;
use output::Output;
use ov5640::Ov5640;
use ov7725::Ov7725;
use part::Part;
pub use sccb::Sccb;
pub use two_wire::TwoWire;

/// Surplus rows of a frame under [`Kind::FrameLong`]; there is room for eight before the next
/// VSYNC.
const SURPLUS_ROWS: u32 = 5;

/// The supplies and signals that the board gives to the sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Supply {
    /// The camera's power switch is on.
    pub powered: bool,
    /// XCLK, Hz; 0 without a clock.
    pub clock_hz: u64,
    /// SCL and SDA reach the I2C peripheral.
    pub sccb: bool,
    /// Its reset line is at its active level.
    pub reset: bool,
}

/// The sensor.
#[derive(Debug)]
pub struct Camera {
    kind: part::Kind,
    part: Box<dyn Part>,
    supply: Supply,
    source: Box<dyn FrameSource>,
    truth: TruthLog,
    faults: Faults,
    rules: Rules,
    frame: u64,
    exposure: u64,
    restarted: bool,
    count_begins: bool,
    counting: bool,
    faulty_output: Option<String>,
    sccb_writes: u64,
    forgot: bool,
}

/// The sensor, shared by the owners of its pins.
#[derive(Clone, Debug)]
pub struct SharedCamera(Arc<Mutex<Camera>>);

impl SharedCamera {
    /// Shares a sensor.
    pub fn new(camera: Camera) -> Self {
        Self(Arc::new(Mutex::new(camera)))
    }

    /// Locks the sensor. One thread runs the whole rig, therefore the lock never waits.
    pub fn lock(&self) -> MutexGuard<'_, Camera> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Camera {
    /// Returns a sensor in power-down that looks at `source`. `seed` decides the values on which
    /// sources disagree.
    pub fn new(
        kind: part::Kind,
        source: Box<dyn FrameSource>,
        truth: TruthLog,
        faults: Faults,
        rules: Rules,
        seed: u64,
    ) -> Self {
        let used = faults.on(Kind::CameraUsed, 0);
        let hesitant = faults.on(Kind::CameraHesitant, 0);
        Self {
            kind,
            part: match kind {
                part::Kind::Ov7725 => Box::new(Ov7725::new(seed, used, hesitant)),
                part::Kind::Mt9v034 => Box::new(Mt9v034::new(used, hesitant)),
                part::Kind::Ov5640 => Box::new(Ov5640::new(seed, used, hesitant)),
            },
            rules,
            supply: Supply::default(),
            source,
            truth,
            faults,
            frame: 0,
            exposure: 0,
            restarted: false,
            count_begins: false,
            counting: false,
            faulty_output: None,
            sccb_writes: 0,
            forgot: false,
        }
    }

    /// Returns the kind of camera.
    pub fn kind(&self) -> part::Kind {
        self.kind
    }

    /// Applies the board's supply. In power-down the sensor stands by and keeps its registers.
    pub fn supply(&mut self, supply: Supply) {
        if supply == self.supply {
            return;
        }
        let before = std::mem::replace(&mut self.supply, supply);
        if supply.reset {
            self.part.reset();
        }
        let timed = |supply: Supply| (supply.powered, supply.clock_hz, supply.reset);
        self.restarted |= timed(before) != timed(supply);
    }

    /// Restarts the frame timing now.
    pub fn restart(&mut self) {
        self.restarted = false;
        if std::mem::take(&mut self.count_begins) {
            (self.frame, self.counting) = (0, true);
        }
    }

    /// Resets the count of frames with the microcontroller: it starts at the next register reset.
    pub fn host_reset(&mut self) {
        self.counting = false;
    }

    /// Returns whether the frame timing has to restart.
    pub fn restarts(&self) -> bool {
        self.restarted
    }

    /// Returns whether a fault keeps the sensor silent.
    pub fn silenced(&self, now_ns: u64) -> bool {
        self.faults.on(Kind::CameraAbsent, now_ns) || self.faults.on(Kind::CameraSilent, now_ns)
    }

    /// Returns the sensor's output from `now_ns` on; `None` while it sends nothing.
    pub fn output(&self, now_ns: u64) -> Option<Output> {
        if self.silenced(now_ns) || !self.supply.powered || self.supply.reset {
            return None;
        }
        let mut output = self.part.output(self.supply.clock_hz)?;
        if self.faults.on(Kind::CameraSlow, now_ns) {
            output.pixel_clock_hz /= 2;
        }
        if self.faults.on(Kind::FrameShort, now_ns) {
            output.rows /= 2;
        }
        if self.faults.on(Kind::FrameLong, now_ns) {
            output.rows += SURPLUS_ROWS;
        }
        Some(output)
    }

    /// Returns the next instant at which a fault starts or stops the sensor.
    pub fn next_fault(&self, now_ns: u64) -> Option<u64> {
        let change = |kind| self.faults.next_change(kind, now_ns);
        [change(Kind::CameraAbsent), change(Kind::CameraSilent)]
            .into_iter()
            .flatten()
            .min()
    }

    /// Counts the edge of VSYNC that ends its pulse. The edge numbers the frame that follows.
    pub fn count_edge(&mut self, now_ns: u64) -> Exposed {
        if self.faults.on(Kind::CameraForgets, now_ns) && !self.forgot {
            self.forgot = true;
            self.part.forget();
        }
        let mut exposed = Exposed {
            at_ns: now_ns,
            middle_ns: now_ns,
            ..Exposed::default()
        };
        if let Some(output) = self.output(now_ns) {
            let timing = self.part.expose(&output);
            exposed.exposure_ns = timing.exposure_ns;
            exposed.readout_ns = timing.readout_ns;
            exposed.middle_ns = (now_ns + timing.ends_ns).saturating_sub(timing.exposure_ns / 2);
        }
        self.frame += u64::from(self.counting);
        self.exposure += 1;
        Exposed {
            frame: self.frame,
            exposure: self.exposure,
            ..exposed
        }
    }

    /// Logs the ground truth of an exposure.
    pub fn log_truth(&mut self, exposed: Exposed) {
        if self.truth.wanted() {
            let truth = self.source.truth(exposed);
            self.truth.exposed(exposed, truth);
        }
    }

    /// Returns the picture of an exposure.
    pub fn picture(&self, exposed: Exposed) -> Picture {
        self.part.picture(&*self.source, exposed, &self.rules)
    }

    /// Returns the count of VSYNC edges since the run began.
    pub fn exposures(&self) -> u64 {
        self.exposure
    }

    /// Returns the count of registers written since the run began.
    pub fn sccb_writes(&self) -> u64 {
        self.sccb_writes
    }

    /// Returns the reason for the last time that the sensor sent no rows; `None` if there was no
    /// such time.
    pub fn faulty_output(&self) -> Option<&str> {
        self.faulty_output.as_deref()
    }

    /// Returns the reason why the truth log ended early; `None` if it did not.
    pub fn truth_failure(&self) -> Option<&str> {
        self.truth.failure()
    }

    /// Notes once why no rows come.
    pub fn complain(&mut self, output: &Output) {
        if let Some(fault) = &output.fault
            && self.faulty_output.as_ref() != Some(fault)
        {
            eprintln!("hivtac-rig: the camera sends no rows: {fault}");
            self.faulty_output = Some(fault.clone());
        }
    }

    fn answers(&self, now_ns: u64) -> bool {
        self.supply.powered
            && !self.supply.reset
            && self.supply.clock_hz != 0
            && self.supply.sccb
            && !self.faults.on(Kind::CameraAbsent, now_ns)
    }

    fn read_register(&self, address: u16, now_ns: u64) -> u16 {
        match self.faults.on(Kind::CameraWrongId, now_ns) {
            true => self.part.read_as_another(address),
            false => self.part.read(address),
        }
    }

    fn write_register(&mut self, address: u16, value: u16) {
        self.sccb_writes += 1;
        let sent = self.part.output(self.supply.clock_hz).is_some();
        if self.part.write(address, value) {
            self.restarted = true;
            self.count_begins |= !self.counting;
        }
        // A sensor that begins to send begins with a frame.
        self.restarted |= !sent && self.part.output(self.supply.clock_hz).is_some();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame_source::TestPicture;

    const SUPPLY: Supply = Supply {
        powered: true,
        clock_hz: 24_000_000,
        sccb: true,
        reset: false,
    };

    fn camera(faults: &[&str]) -> Camera {
        let faults = Faults::new(faults.iter().map(|fault| fault.parse().unwrap()).collect());
        Camera::new(
            part::Kind::Ov7725,
            Box::new(TestPicture),
            TruthLog::default(),
            faults,
            Rules::default(),
            1,
        )
    }

    #[test]
    fn frames_count_from_the_first_register_reset_after_the_microcontrollers() {
        let mut camera = camera(&[]);
        camera.supply(SUPPLY);
        assert_eq!(camera.count_edge(1).frame, 0);
        camera.write_register(registers::COM7.into(), 0x80);
        assert!(camera.restarts());
        camera.restart();
        assert!(!camera.restarts());
        assert_eq!(camera.count_edge(2).frame, 1);
        camera.write_register(registers::COM7.into(), 0x80);
        camera.restart();
        let exposed = camera.count_edge(3);
        assert_eq!((exposed.frame, exposed.exposure), (2, 3));
        camera.host_reset();
        camera.write_register(registers::COM7.into(), 0x80);
        camera.restart();
        assert_eq!(camera.count_edge(4).frame, 1);
    }

    #[test]
    fn in_power_down_there_is_no_output_and_the_registers_stay() {
        let mut camera = camera(&[]);
        assert_eq!(camera.output(0), None);
        camera.supply(SUPPLY);
        camera.write_register(registers::COM7.into(), 0x46);
        camera.supply(Supply {
            powered: false,
            ..SUPPLY
        });
        assert!(camera.output(0).is_none() && !camera.answers(0));
        camera.supply(SUPPLY);
        assert_eq!(camera.read_register(registers::COM7.into(), 0), 0x46);
    }

    #[test]
    fn faults_silence_the_sensor_and_change_its_frames() {
        let mut camera = camera(&["camera-silent@1-2", "camera-absent@3-4"]);
        camera.supply(SUPPLY);
        let at = |ms: u64| ms * 1_000_000;
        assert!(camera.output(at(0)).is_some() && camera.answers(at(0)));
        assert!(camera.output(at(1)).is_none() && camera.answers(at(1)));
        assert!(camera.output(at(3)).is_none() && !camera.answers(at(3)));
        assert_eq!(camera.next_fault(at(1)), Some(at(2)));
        let mut camera = self::camera(&["frame-short@1-2", "frame-long@3-4"]);
        camera.supply(SUPPLY);
        let rows = [0, 1, 3].map(|ms| camera.output(at(ms)).unwrap().rows);
        assert_eq!(rows, [480, 240, 485]);
    }

    #[test]
    fn a_wrong_id_is_only_that() {
        let mut camera = camera(&["camera-wrong-id@5"]);
        camera.supply(SUPPLY);
        let at = |ms: u64| ms * 1_000_000;
        let ids = [0, 5].map(|ms| camera.read_register(registers::PID.into(), at(ms)));
        assert_eq!(ids, [0x77, 0x76]);
    }
}
