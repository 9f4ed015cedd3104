//! How a device is doing, beside its frames: what its self-test finds.

use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Answer to [`GetHealth`](crate::message::Request::GetHealth).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub struct Health {
    /// Why the microcontroller started last.
    pub reset: ResetReason,
    /// Of the microcontroller, hundredths of a degree Celsius; `None` when its sensor does not
    /// tell.
    pub temperature_centidegrees: Option<i16>,
    /// Bytes of the stack that were in use at most since the start.
    pub stack_used: u32,
    /// Its size.
    pub stack_bytes: u32,
    /// What is not right: bits of [`Problem`].
    pub problems: u32,
    /// What was not right at the start, before the first sample: bits of [`Problem`].
    pub at_start: u32,
}

/// Why a microcontroller started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, Schema)]
pub enum ResetReason {
    /// Its supply came.
    PowerOn,
    /// Its supply was too low for a moment.
    BrownOut,
    /// The reset line: a button, or a debug probe.
    Pin,
    /// The program: a fault, or a debug probe.
    Software,
    /// The watchdog: the program stood still.
    Watchdog,
    /// None of these.
    Other,
}

/// What the self-test finds. Its number is the bit in [`Health::problems`], and the code that users
/// see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Problem {
    /// The camera does not answer, or sends nothing.
    CameraSilent = 0,
    /// There is no usable model.
    ModelMissing = 1,
    /// The kept model does not read, or is none for this sensor; the built-in one is used.
    ModelFallback = 2,
    /// Kept settings are of another version of the firmware.
    SettingsUnread = 3,
    /// An attempt to write to the flash failed since the start.
    FlashFails = 4,
    /// Less than a quarter of the stack was left at some moment.
    StackLow = 5,
    /// The last start was the watchdog's.
    WatchdogReset = 6,
    /// The last start was a fault's, or a debug probe's.
    SoftwareReset = 7,
    /// The temperature is above 85 °C, or the sensor for it does not tell.
    Temperature = 8,
    /// Another camera answers than the firmware is for.
    AnotherCamera = 9,
    /// A register of the camera did not hold what was written.
    CameraRegisters = 10,
    /// Frames take another time than they should, by the device's own clock: that or the camera's
    /// is wrong.
    Clocks = 11,
    /// The built-in model's answer to a known question is another than on a computer.
    Arithmetic = 12,
}

impl Problem {
    /// All of them, by their numbers.
    pub const ALL: [Problem; 13] = [
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
