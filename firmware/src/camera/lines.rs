//! The camera's lines besides its buses.

use embassy_stm32::gpio::Output;
use embassy_time::{Duration, Timer};

/// How long the camera's reset line is held: thousands of its clocks.
const RESET_PULSE: Duration = Duration::from_millis(1);

/// The camera's lines besides its buses.
pub struct CameraLines {
    /// High = standby: the registers keep their values.
    pub standby: Output<'static>,
    /// Low = reset, where the microcontroller has that line.
    pub reset: Option<Output<'static>>,
}

impl CameraLines {
    /// Has the camera run, out of a reset where there is the line for one.
    pub async fn wake(&mut self) {
        self.standby.set_low();
        if let Some(reset) = &mut self.reset {
            reset.set_low();
            Timer::after(RESET_PULSE).await;
            reset.set_high();
        }
    }
}
