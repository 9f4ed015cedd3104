//! Defines a device's health, apart from its frames: the result of its self-test.

use crate::failure::Failure;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Answer to [`GetHealth`](crate::message::Request::GetHealth).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Health {
    /// Why the microcontroller last started.
    pub reset: ResetReason,
    /// Temperature of the microcontroller, hundredths of a degree Celsius; `None` if its sensor
    /// gives no plausible value.
    pub temperature_centidegrees: Option<i16>,
    /// Largest number of bytes of the stack in use since the start.
    pub stack_used: u32,
    /// Size of the stack, bytes.
    pub stack_bytes: u32,
    /// Current problems: bits of [`Problem`].
    pub problems: u32,
    /// Problems at the start, before the first sample: bits of [`Problem`].
    pub at_start: u32,
    /// The supply voltage under which the microcontroller resets itself.
    pub brown_out: BrownOut,
    /// What ended the program in an earlier run; `None` if nothing did since power-on.
    pub failure: Option<Failure>,
}

/// The level of the brown-out reset, an option of the microcontroller (RM0433, BOR_LEV).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum BrownOut {
    /// No level is chosen: only the power-on reset is there.
    Off,
    /// Level 1.
    Low,
    /// Level 2.
    Middle,
    /// Level 3.
    High,
}

impl BrownOut {
    /// All levels, sorted by the value of BOR_LEV.
    pub const ALL: [BrownOut; 4] = [
        BrownOut::Off,
        BrownOut::Low,
        BrownOut::Middle,
        BrownOut::High,
    ];

    /// The threshold, mV, as ST names it (its HAL, `OB_BOR_LEVEL0` to 3). A falling supply resets
    /// about 0.1 V below.
    pub const fn millivolts(self) -> u16 {
        match self {
            BrownOut::Off => 1_600,
            BrownOut::Low => 2_100,
            BrownOut::Middle => 2_400,
            BrownOut::High => 2_700,
        }
    }
}

/// Why a microcontroller started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum ResetReason {
    /// Power was switched on.
    PowerOn,
    /// The supply voltage was too low for a moment.
    BrownOut,
    /// The reset line was pulled: by a button, or a debug probe.
    Pin,
    /// The program reset itself, after a fault, or a debug probe did.
    Software,
    /// The watchdog: the program was blocked.
    Watchdog,
    /// None of these.
    Other,
}

/// A problem that the self-test finds. Its number is the bit in [`Health::problems`], and the code
/// that users see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Problem {
    /// The camera does not answer, or sends nothing.
    CameraSilent = 0,
    /// There is no usable model.
    ModelMissing = 1,
    /// The kept model is unreadable, or does not fit this sensor; the built-in one is used.
    ModelFallback = 2,
    /// The kept settings are of another firmware version.
    SettingsUnread = 3,
    /// An attempt to write to the flash has failed since the start.
    FlashFails = 4,
    /// Less than a fifth of the stack was free at some moment.
    StackLow = 5,
    /// The last start followed a reset by the watchdog.
    WatchdogReset = 6,
    /// The last start followed a fault, or a reset by a debug probe.
    SoftwareReset = 7,
    /// The temperature is above 105 °C, or its sensor gives no plausible value.
    Temperature = 8,
    /// The camera is not the one that the firmware supports.
    AnotherCamera = 9,
    /// A register of the camera did not hold the written value. The camera is used if frames can be
    /// read.
    CameraRegisters = 10,
    /// The frame time is wrong by the device's own clock: this clock or the camera's is wrong.
    Clocks = 11,
    /// The built-in model's answer to a known question differs from a computer's.
    Arithmetic = 12,
    /// The search for exposure and gain found none that expose the picture well.
    Exposure = 13,
}

impl Problem {
    /// All problems, sorted by number.
    pub const ALL: [Problem; 14] = [
        Problem::CameraSilent,
        Problem::ModelMissing,
        Problem::ModelFallback,
        Problem::SettingsUnread,
        Problem::FlashFails,
        Problem::StackLow,
        Problem::WatchdogReset,
        Problem::SoftwareReset,
        Problem::Temperature,
        Problem::AnotherCamera,
        Problem::CameraRegisters,
        Problem::Clocks,
        Problem::Arithmetic,
        Problem::Exposure,
    ];

    /// Its number.
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// Its bit.
    pub const fn bit(self) -> u32 {
        1 << self.code()
    }

    /// Its name in `docs/wire.md`.
    pub const fn name(self) -> &'static str {
        match self {
            Problem::CameraSilent => "camera_silent",
            Problem::ModelMissing => "model_missing",
            Problem::ModelFallback => "model_fallback",
            Problem::SettingsUnread => "settings_unread",
            Problem::FlashFails => "flash_fails",
            Problem::StackLow => "stack_low",
            Problem::WatchdogReset => "watchdog_reset",
            Problem::SoftwareReset => "software_reset",
            Problem::Temperature => "temperature",
            Problem::AnotherCamera => "another_camera",
            Problem::CameraRegisters => "camera_registers",
            Problem::Clocks => "clocks",
            Problem::Arithmetic => "arithmetic",
            Problem::Exposure => "exposure",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn problems_are_listed_by_their_numbers() {
        for (nth, problem) in (0..).zip(Problem::ALL) {
            assert_eq!(problem.code(), nth, "{problem:?}");
        }
    }
}
