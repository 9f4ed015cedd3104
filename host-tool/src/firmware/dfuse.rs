//! The conversation with a microcontroller's own loader: DFU with ST's extensions (DfuSe, AN3156),
//! over `dfu-core`'s interface to USB.
//!
//! `dfu-core`'s own download always erases from a memory's first page on, and starts the program
//! before anybody could read it back. So the requests are made here.

use dfu_core::functional_descriptor::FunctionalDescriptor;
use dfu_core::{DfuIo, DfuProtocol, State, Status};
use hivtac_wire::image::{FLASH, SECTOR_BYTES};
use std::fmt;
use std::thread::sleep;
use std::time::{Duration, Instant};

/// bmRequestType: to the device or from it, of its class, for the interface.
const TO_DEVICE: u8 = 0x21;
const FROM_DEVICE: u8 = 0xA1;
/// bRequest.
const DOWNLOAD: u8 = 1;
const UPLOAD: u8 = 2;
const GET_STATUS: u8 = 3;
const CLEAR_STATUS: u8 = 4;
const ABORT: u8 = 6;
/// Number of the block with commands, and of the block at the address pointer.
const COMMANDS: u16 = 0;
const FIRST_BLOCK: u16 = 2;
/// Commands, each followed by an address.
const SET_ADDRESS: u8 = 0x21;
const ERASE: u8 = 0x41;
/// Longest time for a command: an erase takes at most 4 s (DS12110), in which the loader may not
/// answer.
const PATIENCE: Duration = Duration::from_secs(12);
/// Longest pause that the loader may ask for.
const LONGEST_PAUSE: Duration = Duration::from_secs(5);
/// Number of attempts to bring the loader into its idle state.
const ATTEMPTS: usize = 4;

/// Why the conversation failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Trouble {
    /// The device is gone, or its transfers fail.
    Lost(String),
    /// It did not answer in time.
    Late,
    /// It refused a request, or gave a wrong answer.
    Refused(String),
}

impl fmt::Display for Trouble {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Trouble::Lost(why) => write!(f, "the connection was lost: {why}"),
            Trouble::Late => f.write_str("it did not answer"),
            Trouble::Refused(why) => write!(f, "its loader refused: {why}"),
        }
    }
}

impl From<dfu_core::Error> for Trouble {
    fn from(error: dfu_core::Error) -> Trouble {
        Trouble::Refused(error.to_string())
    }
}

/// USB, as the conversation needs it.
pub trait Usb: DfuIo<Read = usize, Write = usize, Error = Trouble> {}
impl<T: DfuIo<Read = usize, Write = usize, Error = Trouble>> Usb for T {}

/// An STM32H743's loader.
pub struct Loader<Io> {
    io: Io,
    block_bytes: usize,
}

impl<Io: Usb> Loader<Io> {
    /// Checks that it is the loader of such a chip, and makes it idle, whatever was interrupted
    /// before.
    ///
    /// # Errors
    /// If it is another one, or does not answer.
    pub fn new(io: Io) -> Result<Self, Trouble> {
        let FunctionalDescriptor {
            can_download,
            can_upload,
            transfer_size,
            ..
        } = *io.functional_descriptor();
        let sectors = FLASH.len() / SECTOR_BYTES as usize;
        let fits = match io.protocol() {
            DfuProtocol::Dfu => false,
            DfuProtocol::Dfuse {
                address,
                memory_layout,
            } => {
                let layout = memory_layout.as_ref().get(..sectors);
                let is_ours = |layout: &[u32]| layout.iter().all(|bytes| *bytes == SECTOR_BYTES);
                *address == FLASH.start && layout.is_some_and(is_ours)
            }
        };
        if !(fits && can_download && can_upload && transfer_size >= 32) {
            return Err(Trouble::Refused(
                "it is not that of an STM32H743, whose flash has sectors of 128 KiB".to_owned(),
            ));
        }
        // Blocks that are whole flash words.
        let block_bytes = usize::from(transfer_size) / 32 * 32;
        let loader = Self { io, block_bytes };
        loader.make_idle()?;
        Ok(loader)
    }

    /// Erases the sector that begins at this address.
    ///
    /// # Errors
    /// If the loader refuses, or is gone.
    pub fn erase(&self, sector: u32) -> Result<(), Trouble> {
        self.command(ERASE, sector)
    }

    /// Writes bytes to blank flash; `each` is called after each block.
    ///
    /// # Errors
    /// If the loader refuses, or is gone; those of `each`.
    pub fn write<E: From<Trouble>>(
        &self,
        mut address: u32,
        bytes: &[u8],
        mut each: impl FnMut() -> Result<(), E>,
    ) -> Result<(), E> {
        for block in bytes.chunks(self.block_bytes) {
            // Before each block, as other tools do: no loader's counting of blocks matters.
            self.command(SET_ADDRESS, address)?;
            self.download(FIRST_BLOCK, block)?;
            self.settle()?;
            address += block.len() as u32;
            each()?;
        }
        Ok(())
    }

    /// Reads bytes.
    ///
    /// # Errors
    /// If the loader refuses, or is gone.
    pub fn read(&self, address: u32, length: usize) -> Result<Vec<u8>, Trouble> {
        let mut bytes = vec![0; length];
        let whole = length / self.block_bytes * self.block_bytes;
        let (blocks, rest) = bytes.split_at_mut(whole);
        self.upload(address, blocks)?;
        // On its own, as loaders need not agree where a shorter block begins.
        self.upload(address + whole as u32, rest)?;
        Ok(bytes)
    }

    /// Reads blocks of one length.
    fn upload(&self, address: u32, bytes: &mut [u8]) -> Result<(), Trouble> {
        if bytes.is_empty() {
            return Ok(());
        }
        self.command(SET_ADDRESS, address)?;
        self.make_idle()?;
        for (number, block) in (FIRST_BLOCK..).zip(bytes.chunks_mut(self.block_bytes)) {
            let came = self.io.read_control(FROM_DEVICE, UPLOAD, number, block)?;
            if came != block.len() {
                let why = format!("block {number} has {came} of {} bytes", block.len());
                return Err(Trouble::Refused(why));
            }
        }
        self.make_idle()
    }

    /// Leaves the loader for the program at this address. The loader may not live to confirm that.
    ///
    /// # Errors
    /// If it is gone before.
    pub fn leave(self, program: u32) -> Result<(), Trouble> {
        self.command(SET_ADDRESS, program)?;
        self.download(FIRST_BLOCK, &[])?;
        let _ = self.status();
        Ok(())
    }

    fn command(&self, command: u8, address: u32) -> Result<(), Trouble> {
        let [a, b, c, d] = address.to_le_bytes();
        self.download(COMMANDS, &[command, a, b, c, d])?;
        self.settle()
    }

    fn download(&self, block: u16, bytes: &[u8]) -> Result<(), Trouble> {
        self.io
            .write_control(TO_DEVICE, DOWNLOAD, block, bytes)
            .map(|_| ())
    }

    /// Waits until the loader has finished a request.
    fn settle(&self) -> Result<(), Trouble> {
        let end = Instant::now() + PATIENCE;
        while Instant::now() < end {
            let (status, state, pause) = match self.status() {
                Err(Trouble::Late) => continue,
                answer => answer?,
            };
            match state {
                State::DfuDnloadIdle | State::DfuIdle => return Ok(()),
                State::DfuDnloadSync | State::DfuDnbusy => sleep(pause.min(LONGEST_PAUSE)),
                _ => {
                    let _ = self.make_idle();
                    return Err(Trouble::Refused(format!("{status} ({state})")));
                }
            }
        }
        Err(Trouble::Late)
    }

    /// Status, state, and how long to wait before the next look.
    fn status(&self) -> Result<(Status, State, Duration), Trouble> {
        let mut answer = [0; 6];
        let came = self
            .io
            .read_control(FROM_DEVICE, GET_STATUS, 0, &mut answer)?;
        if came < answer.len() {
            return Err(Trouble::Refused(format!("a status of {came} bytes")));
        }
        let [status, low, middle, high, state, _] = answer;
        let pause = u32::from_le_bytes([low, middle, high, 0]);
        let pause = Duration::from_millis(pause.into());
        Ok((status.into(), state.into(), pause))
    }

    fn make_idle(&self) -> Result<(), Trouble> {
        for _ in 0..ATTEMPTS {
            let (_, state, pause) = self.status()?;
            let request = match state {
                State::DfuIdle => return Ok(()),
                State::DfuError => CLEAR_STATUS,
                State::DfuDnbusy => {
                    sleep(pause.min(LONGEST_PAUSE));
                    continue;
                }
                _ => ABORT,
            };
            self.io.write_control(TO_DEVICE, request, 0, &[])?;
        }
        Err(Trouble::Refused("it does not become idle".to_owned()))
    }
}
