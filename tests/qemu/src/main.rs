//! Runs a script of golden cases (`hivtac_tests::golden`) on a Cortex-M7.
//!
//! The command line, given by semihosting, is `hivtac-qemu-image SCRIPT RESULTS`: two files of the
//! host.
#![no_std]
#![no_main]

mod file;

use core::fmt::Write;
use core::panic::PanicInfo;

use cortex_m_rt::{ExceptionFrame, entry, exception};
use cortex_m_semihosting::{debug, hio};
use hivtac_tests::golden::{
    Buffers, MAX_ROW_PIXELS, ModelBuffer, NO_MODEL, Runner, TWO_BANDS_PIXELS,
};

use file::{Reader, Writer};

#[entry]
fn main() -> ! {
    let status = match run() {
        Ok(()) => debug::EXIT_SUCCESS,
        Err(problem) => {
            complain(format_args!("{problem}"));
            debug::EXIT_FAILURE
        }
    };
    debug::exit(status);
    halt()
}

fn run() -> Result<(), &'static str> {
    let buffers = buffers()?;
    let runner: &mut Runner<'static> =
        cortex_m::singleton!(: Runner<'static> = Runner::new(buffers))
            .ok_or("the runner is taken")?;
    let mut line = [0; 512];
    let mut words = file::command_line(&mut line)?.split(' ').skip(1);
    let script = words.next().ok_or("the command line names no script")?;
    let results = words
        .next()
        .ok_or("the command line names no file for the results")?;
    let mut results = Writer::create(results)?;
    let outcome = runner.run(&mut Reader::open(script)?, &mut results);
    results.flush()?;
    outcome.map_err(|error| {
        complain(format_args!("{error:?}"));
        "the script cannot be run"
    })
}

/// Returns storage in the memories that the benchmark distinguishes (`memory.x`). QEMU fills them
/// with zeros.
fn buffers() -> Result<Buffers<'static>, &'static str> {
    let model = cortex_m::singleton!(
        #[unsafe(link_section = ".weights")]
        MODEL: ModelBuffer = NO_MODEL
    );
    let row = cortex_m::singleton!(
        #[unsafe(link_section = ".rows")]
        ROW: [u16; MAX_ROW_PIXELS] = [0; MAX_ROW_PIXELS]
    );
    let bands = cortex_m::singleton!(
        #[unsafe(link_section = ".rows")]
        BANDS: [u16; TWO_BANDS_PIXELS] = [0; TWO_BANDS_PIXELS]
    );
    match (model, row, bands) {
        (Some(model), Some(row), Some(bands)) => Ok(Buffers { model, row, bands }),
        _ => Err("the buffers are taken"),
    }
}

fn complain(text: core::fmt::Arguments<'_>) {
    if let Ok(mut stderr) = hio::hstderr() {
        let _ = writeln!(stderr, "hivtac-qemu-image: {text}");
    }
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    complain(format_args!("{info}"));
    debug::exit(debug::EXIT_FAILURE);
    halt()
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    complain(format_args!("hard fault at {:#010x}", frame.pc()));
    debug::exit(debug::EXIT_FAILURE);
    halt()
}

fn halt() -> ! {
    loop {
        cortex_m::asm::nop();
    }
}
