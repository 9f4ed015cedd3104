//! Drives the camera's lines that are not part of a bus.

use embassy_stm32::gpio::Output;
use embassy_time::{Duration, Timer};

/// Length of the camera's reset pulse: thousands of its clocks.
const RESET_PULSE: Duration = Duration::from_millis(1);

/// The camera's lines that are not part of a bus.
pub struct CameraLines {
    /// High means standby: the registers keep their values.
    pub standby: Output<'static>,
    /// Low means reset; `None` if the board does not have this line.
    pub reset: Option<Output<'static>>,
}

impl CameraLines {
    /// Ends standby, and resets the camera if there is a line for it.
    pub async fn wake(&mut self) {
        self.standby.set_low();
        if let Some(reset) = &mut self.reset {
            reset.set_low();
            Timer::after(RESET_PULSE).await;
            reset.set_high();
        }
    }
}
