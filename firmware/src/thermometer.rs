//! Measures the microcontroller's own temperature by channel 18 of ADC3, against two words from the
//! chip's factory calibration.
//!
//! # Design
//! The converter is started for each reading and switched off afterwards, because no other code
//! needs it. Callers wait without blocking other tasks. One reading in 16 bits takes 0.1 ms; the
//! sensor is accurate to some degrees (DS12110, temperature sensor characteristics).

use embassy_stm32::pac::adc::vals::{Adcaldif, Boost, Pcsel, Res, SampleTime};
use embassy_stm32::pac::adccommon::vals::Presc;
use embassy_stm32::pac::rcc::vals::Adcsel;
use embassy_stm32::pac::{ADC3, ADC3_COMMON, RCC};
use embassy_stm32::{Peri, peripherals};
use embassy_time::{Duration, Timer};

/// The sensor's channel.
const CHANNEL: usize = 18;
/// Factory readings of the sensor at 3.3 V in 16 bits (DS12110, TS_CAL1 and TS_CAL2).
const CALIBRATION: [*const u16; 2] = [0x1FF1_E820 as *const u16, 0x1FF1_E840 as *const u16];
/// Temperatures of these, hundredths of a degree: 30 °C, and 130 °C on the revisions that this
/// program runs on. On earlier silicon the second is 110 °C (ST's HAL, `TEMPSENSOR_CAL2_TEMP`).
const CALIBRATED_AT: [i32; 2] = [3_000, 13_000];
/// Plausible temperatures, hundredths of a degree.
const SENSIBLE: core::ops::RangeInclusive<i32> = -5_000..=16_000;
/// Duration of a step of the converter, and interval of checks for its end.
const STEP: Duration = Duration::from_micros(50);
const LOOKS: u32 = 40;

/// The converter. Ownership proves that no other code uses it.
pub struct Thermometer(pub Peri<'static, peripherals::ADC3>);

impl Thermometer {
    /// Returns the temperature, hundredths of a degree Celsius; `None` if the sensor or its
    /// calibration gives an implausible value.
    pub async fn read(&mut self) -> Option<i16> {
        wake();
        let word = convert().await;
        sleep();
        temperature(word?)
    }
}

/// Switches on clocks and regulator, and the sensor.
fn wake() {
    RCC.d3ccipr().modify(|w| w.set_adcsel(Adcsel::PER));
    RCC.ahb4enr().modify(|w| w.set_adc3en(true));
    // 64 MHz of the internal oscillator, divided by eight here and by two in the converter.
    ADC3_COMMON.ccr().modify(|w| {
        w.set_presc(Presc::DIV8);
        w.set_vsenseen(true);
    });
    ADC3.cr().modify(|w| w.set_deeppwd(false));
    ADC3.cr().modify(|w| {
        w.set_advregen(true);
        w.set_boost(Boost::LT12_5);
    });
}

async fn convert() -> Option<u16> {
    Timer::after(STEP).await;
    ADC3.cr().modify(|w| {
        w.set_adcaldif(Adcaldif::SINGLE_ENDED);
        w.set_adcallin(false);
        w.set_adcal(true);
    });
    until(|| !ADC3.cr().read().adcal()).await?;
    ADC3.isr().write(|w| w.set_adrdy(true));
    ADC3.cr().modify(|w| w.set_aden(true));
    until(is_ready).await?;
    ADC3.cfgr().modify(|w| w.set_res(Res::BITS16));
    ADC3.pcsel()
        .modify(|w| w.set_pcsel(CHANNEL, Pcsel::PRESELECTED));
    ADC3.smpr(1)
        .modify(|w| w.set_smp(CHANNEL - 10, SampleTime::CYCLES810_5));
    ADC3.sqr1().modify(|w| {
        w.set_l(0);
        w.set_sq(0, CHANNEL as u8);
    });
    ADC3.cr().modify(|w| w.set_adstart(true));
    until(|| ADC3.isr().read().eoc()).await?;
    Some(ADC3.dr().read().rdata())
}

/// True once the converter is ready. The end of the calibration takes back an enable that comes
/// within four of its clocks, so that it is enabled again (ST's HAL does the same).
fn is_ready() -> bool {
    let ready = ADC3.isr().read().adrdy();
    if !ready && !ADC3.cr().read().aden() {
        ADC3.cr().modify(|w| w.set_aden(true));
    }
    ready
}

async fn until(is_done: impl Fn() -> bool) -> Option<()> {
    for _ in 0..LOOKS {
        Timer::after(STEP).await;
        if is_done() {
            return Some(());
        }
    }
    None
}

fn sleep() {
    if ADC3.cr().read().aden() {
        ADC3.cr().modify(|w| w.set_addis(true));
    }
    ADC3_COMMON.ccr().modify(|w| w.set_vsenseen(false));
}

/// Interpolates on the line through the two calibrated points.
fn temperature(word: u16) -> Option<i16> {
    // SAFETY: two words of the part's system memory, which only its maker writes.
    let [cold, hot] = CALIBRATION.map(|word| i32::from(unsafe { word.read_volatile() }));
    let [cold_at, hot_at] = CALIBRATED_AT;
    let above = (i32::from(word) - cold) * (hot_at - cold_at);
    let centidegrees = cold_at + above.checked_div(hot - cold)?;
    i16::try_from(centidegrees)
        .ok()
        .filter(|_| SENSIBLE.contains(&centidegrees))
}
