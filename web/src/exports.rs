//! Functions that the page's scripts call. Bytes go in and out through one buffer each: the scripts
//! write into [`reserve`]'s memory before a call, and read [`taken`]'s after it.

use crate::engine::Engine;
use crate::firmware::Firmware;
use crate::{photograph, same_bits};
use hivtac_host::live::camera::Kind;
use std::cell::RefCell;

thread_local! {
    static INPUT: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static OUTPUT: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    static ENGINE: RefCell<Option<Engine>> = const { RefCell::new(None) };
    static FIRMWARE: RefCell<Firmware> = RefCell::default();
}

#[link(wasm_import_module = "page")]
unsafe extern "C" {
    /// The page's time, µs.
    safe fn now_us() -> f64;
    /// Shows why the module has stopped: a text of this length, at [`taken`].
    safe fn stopped(length: usize);
}

fn now() -> u64 {
    now_us() as u64
}

fn put(bytes: Vec<u8>) -> usize {
    OUTPUT.with_borrow_mut(|output| {
        *output = bytes;
        output.len()
    })
}

fn input<T>(what: impl FnOnce(&[u8]) -> T) -> T {
    INPUT.with_borrow(|input| what(input))
}

fn with<T: Default>(what: impl FnOnce(&mut Engine) -> T) -> T {
    ENGINE.with_borrow_mut(|engine| engine.as_mut().map(what).unwrap_or_default())
}

/// Makes room for a call's bytes; returns where they go.
#[unsafe(no_mangle)]
pub extern "C" fn reserve(bytes: usize) -> *mut u8 {
    INPUT.with_borrow_mut(|input| {
        input.resize(bytes, 0);
        input.as_mut_ptr()
    })
}

/// Where the bytes of the last call are.
#[unsafe(no_mangle)]
pub extern "C" fn taken() -> *const u8 {
    OUTPUT.with_borrow(|output| output.as_ptr())
}

/// Starts the simulated sensor with 4 or 8 dots; `epoch_ms` is the time since 1970 at the page's
/// time 0. Returns the length of a text that says why it cannot, 0 if it can.
#[unsafe(no_mangle)]
pub extern "C" fn simulate(dots: u32, epoch_ms: f64) -> usize {
    std::panic::set_hook(Box::new(|panic| {
        stopped(put(panic.to_string().into_bytes()));
    }));
    match Engine::simulated(dots, now(), (epoch_ms * 1e6) as u64) {
        Ok(engine) => {
            ENGINE.set(Some(engine));
            put(Vec::new())
        }
        Err(why) => put(why.into_bytes()),
    }
}

/// Begins a conversation with the device at the port whose name was put in.
#[unsafe(no_mangle)]
pub extern "C" fn connect(epoch_ms: f64) {
    let name = input(|bytes| String::from_utf8_lossy(bytes).into_owned());
    let engine = Engine::connected(&name, now(), (epoch_ms * 1e6) as u64);
    ENGINE.set(Some(engine));
}

/// Lets time pass; returns when the next turn is due, µs.
#[unsafe(no_mangle)]
pub extern "C" fn turn() -> f64 {
    with(|engine| engine.turn(&now)) as f64
}

/// Takes the device's bytes that were put in.
#[unsafe(no_mangle)]
pub extern "C" fn receive() {
    input(|bytes| with(|engine| engine.receive(bytes, now())));
}

/// Puts the bytes for the device out; returns their number.
#[unsafe(no_mangle)]
pub extern "C" fn sent() -> usize {
    put(with(Engine::sent))
}

/// The port is gone; why was put in.
#[unsafe(no_mangle)]
pub extern "C" fn lost() {
    let why = input(|bytes| String::from_utf8_lossy(bytes).into_owned());
    with(|engine| engine.lost(&why, now()));
}

/// Carries out the order that was put in as JSON.
#[unsafe(no_mangle)]
pub extern "C" fn order(ticket: u32) {
    input(|body| with(|engine| engine.order(ticket, body, now())));
}

/// Takes a picture.
#[unsafe(no_mangle)]
pub extern "C" fn picture(ticket: u32) {
    with(|engine| engine.picture(ticket));
}

/// Has the connected device restart into its loader.
#[unsafe(no_mangle)]
pub extern "C" fn start_loader(ticket: u32) {
    with(|engine| engine.start_loader(ticket));
}

/// Checks the input as a firmware file; outputs its identity as JSON.
#[unsafe(no_mangle)]
pub extern "C" fn firmware() -> usize {
    let board = with(|engine| engine.board().map(str::to_owned));
    let facts =
        FIRMWARE.with_borrow_mut(|firmware| input(|file| firmware.choose(file, board.as_deref())));
    put(facts.to_string().into_bytes())
}

/// Outputs the parts to write into a device whose flash begins with the input's bytes: a line of
/// JSON, then the bytes.
#[unsafe(no_mangle)]
pub extern "C" fn firmware_parts() -> usize {
    let (facts, bytes) = FIRMWARE.with_borrow(|firmware| input(|found| firmware.parts(found)));
    put([facts.to_string().into_bytes(), vec![b'\n'], bytes].concat())
}

/// Puts the events since the last call out, as JSON; returns their length.
#[unsafe(no_mangle)]
pub extern "C" fn events() -> usize {
    put(with(Engine::events).into_bytes())
}

/// Puts the bytes out that the next event announced; returns their number.
#[unsafe(no_mangle)]
pub extern "C" fn blob() -> usize {
    put(with(Engine::blob))
}

/// Senses the input's picture, red, green, blue and opacity of each pixel; outputs the page's view
/// of it.
#[unsafe(no_mangle)]
pub extern "C" fn sense(width: u16, height: u16) -> usize {
    put(input(|levels| photograph::sense(levels, width, height)))
}

/// Sums up some frames of the first camera (0) or the second: the CRC in the lower half, the number
/// of forces above it.
#[unsafe(no_mangle)]
pub extern "C" fn sum(camera: u32, frames: u32) -> u64 {
    let kind = match camera {
        0 => Kind::Ov7725,
        _ => Kind::Mt9v034,
    };
    let summed = same_bits::sum(kind, frames);
    summed.map_or(0, |it| u64::from(it.forces) << 32 | u64::from(it.crc))
}
