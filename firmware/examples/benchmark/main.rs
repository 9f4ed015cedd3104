//! Measures the sensing on an STM32H743 with the core's own cycle counter, and prints
//! `item|frame|format|cycles` by a debug probe, one line each: the items of `cargo xtask bench`.
//!
//! The core runs at 480 MHz from its internal oscillator: any board with this chip works. The
//! placement is the firmware's (`memory.x`): the sensing's code in ITCM, its working data in DTCM,
//! the scanner's state in SRAM. Rows are copied to DTCM before they are timed, as is a model that
//! is measured alone and fits. Other models are read from flash through the data cache.
#![no_std]
#![no_main]

mod data;
#[path = "../../src/dtcm_table.rs"]
mod dtcm_table;
mod measure;
mod meter;

use core::panic::PanicInfo;

use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use defmt_rtt as _;
use embassy_stm32::Config;
use embassy_stm32::rcc::*;
use hivtac_wire::image::header::{Header, Mark};

use measure::{Scanners, Workplace};
use meter::Meter;
use static_cell::ConstStaticCell;

// The first stage, which loads ITCM as `memory.x` says.
core::arch::global_asm!(include_str!("../../src/first_stage.s"));
core::arch::global_asm!(include_str!("../../src/start.s"));

#[used]
#[unsafe(link_section = ".first_stage.mark")]
static FIRST_STAGE: Mark = Mark::of_first_stage("benchmark");
#[used]
#[unsafe(link_section = ".image_header")]
static HEADER: Header = Header::unsealed("benchmark", env!("CARGO_PKG_VERSION"));

static WORKPLACE: ConstStaticCell<Workplace> = ConstStaticCell::new(Workplace::new());
#[unsafe(link_section = ".sram.scanners")]
static SCANNERS: ConstStaticCell<Scanners> = ConstStaticCell::new(Scanners::new());

#[entry]
fn main() -> ! {
    let mut core = cortex_m::Peripherals::take().expect("first and only use");
    core.SCB.enable_icache();
    core.SCB.enable_dcache(&mut core.CPUID);
    let _peripherals = embassy_stm32::init(clocks());
    let meter = Meter::start(core.DCB, core.DWT);
    let (place, scanners) = (WORKPLACE.take(), SCANNERS.take());
    for frame in data::FRAMES {
        measure::frame(scanners, place, frame, &meter);
    }
    for network in data::NETWORKS {
        measure::network(place, network, &meter);
    }
    hprintln!("done");
    loop {
        debug::exit(debug::EXIT_SUCCESS);
    }
}

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    hprintln!("{}", info);
    loop {
        debug::exit(debug::EXIT_FAILURE);
    }
}

/// 64 MHz / 4 · 60 / 2 = 480 MHz for the core, 240 MHz for the buses, 120 MHz for the peripherals.
fn clocks() -> Config {
    let mut config = Config::default();
    config.rcc.hsi = Some(HSIPrescaler::DIV1);
    config.rcc.pll1 = Some(Pll {
        source: PllSource::HSI,
        prediv: PllPreDiv::DIV4,
        mul: PllMul::MUL60,
        fracn: None,
        divp: Some(PllDiv::DIV2),
        divq: None,
        divr: None,
    });
    // 480 MHz needs the highest core voltage.
    config.rcc.voltage_scale = VoltageScale::Scale0;
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.d1c_pre = AHBPrescaler::DIV1;
    config.rcc.ahb_pre = AHBPrescaler::DIV2;
    config.rcc.apb1_pre = APBPrescaler::DIV2;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config.rcc.apb3_pre = APBPrescaler::DIV2;
    config.rcc.apb4_pre = APBPrescaler::DIV2;
    config
}
