//! Shows the sensor's condition on the LED.
//!
//! | pattern | meaning |
//! |---|---|
//! | breathes, 4 s | frames give forces |
//! | blinks once a second | frames arrive but give no force: markers, light or model |
//! | blinks five times a second | no camera |
//! | three flashes every two seconds | the self-test found something at the start |
//! | two flashes a second | silicon too old: `board/silicon.rs` |

use crate::board::StatusLed;
use crate::condition::{self, Condition};
use crate::self_test;
use embassy_time::{Duration, Instant, Timer};
use micromath::F32Ext;

/// One period of the LED's dimming: fast enough not to flicker.
const PERIOD: Duration = Duration::from_millis(10);
const BREATH: Duration = Duration::from_secs(4);
const SLOW_BLINK: Duration = Duration::from_secs(1);
const FLASHES: Duration = Duration::from_secs(2);
const FAST_BLINK: Duration = Duration::from_millis(200);

/// Drives the LED for ever.
#[embassy_executor::task]
pub async fn run(mut led: StatusLed) {
    loop {
        let lit = lit_time(Instant::now());
        if lit > Duration::MIN {
            led.set(true);
            Timer::after(lit).await;
        }
        if lit < PERIOD {
            led.set(false);
            Timer::after(PERIOD - lit).await;
        }
    }
}

/// Returns how long the LED is on in the dimming period that begins at `now`.
fn lit_time(now: Instant) -> Duration {
    match condition::get() {
        Condition::NoCamera => blink(now, FAST_BLINK),
        _ if self_test::failed_at_start() => three_flashes(now),
        Condition::Good => {
            let brightness = brightness(phase(now, BREATH));
            Duration::from_micros((brightness * PERIOD.as_micros() as f32) as u64)
        }
        Condition::NoForce => blink(now, SLOW_BLINK),
    }
}

/// Three flashes of a tenth of a period each, a tenth apart, then a pause.
fn three_flashes(now: Instant) -> Duration {
    let tenth = (phase(now, FLASHES) * 10.0) as u32;
    if matches!(tenth, 0 | 2 | 4) {
        PERIOD
    } else {
        Duration::MIN
    }
}

fn blink(now: Instant, period: Duration) -> Duration {
    if phase(now, period) < 0.5 {
        PERIOD
    } else {
        Duration::MIN
    }
}

/// The phase of `now` in its period, 0 to 1.
fn phase(now: Instant, period: Duration) -> f32 {
    (now.as_micros() % period.as_micros()) as f32 / period.as_micros() as f32
}

/// Brightness, 0 to 1, at a phase of the breath: ((1 − cos 2πp) / 2)², squared because the eye is
/// more sensitive to little light. The error of `micromath`'s cosine is at most 0.0011, which makes
/// at most 0.0007 here (both over 4,001 phases). That is less than a tenth of the smallest step
/// that an eye sees.
fn brightness(phase: f32) -> f32 {
    let half = (1.0 - (phase * core::f32::consts::TAU).cos()) / 2.0;
    half * half
}
