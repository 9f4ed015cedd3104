//! A simulated loader: the protocol of AN3156 with the flash of an STM32H743, and faults on
//! request.

use super::dfuse::Trouble;
use dfu_core::functional_descriptor::FunctionalDescriptor;
use dfu_core::memory_layout::MemoryLayout;
use dfu_core::{DfuIo, DfuProtocol};
use hivtac_wire::image::header::CRC_AT;
use hivtac_wire::image::{FIRST_STAGE, FLASH, HEADER_AT, Image, PROGRAM, SECTOR_BYTES};
use std::cell::{RefCell, RefMut};
use std::rc::Rc;

/// Bytes of both banks.
const FLASH_BYTES: usize = 2 << 20;
/// wTransferSize.
const BLOCK: usize = 1024;
const IDLE: u8 = 2;
const DOWNLOAD_SYNC: u8 = 3;
const DOWNLOAD_BUSY: u8 = 4;
const DOWNLOAD_IDLE: u8 = 5;
const MANIFEST_SYNC: u8 = 6;
const MANIFEST: u8 = 7;
const UPLOAD_IDLE: u8 = 9;
const ERROR: u8 = 10;

/// A fault of the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// It is gone after this many requests.
    Gone(usize),
    /// It has no power after this many operations of the flash; the last one is half done.
    Unpowered(usize),
    /// Writing at this address fails.
    WriteFails(u32),
    /// Erasing at this address fails.
    EraseFails(u32),
    /// This byte is kept wrong.
    KeepsWrong(u32),
    /// It does not answer this many requests for its status while it erases.
    Silent(usize),
}

/// The device: its flash stays when the loader is gone.
pub struct Device {
    pub flash: Vec<u8>,
    pub fault: Option<Fault>,
    /// First addresses of sectors that were erased.
    pub erased: Vec<u32>,
    /// Where the loader jumped to when it was left.
    pub started: Option<u32>,
    state: u8,
    status: u8,
    pointer: u32,
    pending: Option<Operation>,
    requests: usize,
    operations: usize,
}

#[derive(Clone, Debug)]
enum Operation {
    Point(u32),
    Erase(u32),
    Write(u32, Vec<u8>),
}

impl Device {
    /// With blank flash, but for something in the second bank.
    pub fn new() -> Self {
        let mut flash = vec![0xFF; FLASH_BYTES];
        flash[FLASH.len()..].fill(0x4B);
        Self {
            flash,
            fault: None,
            erased: Vec::new(),
            started: None,
            state: IDLE,
            status: 0,
            pointer: FLASH.start,
            pending: None,
            requests: 0,
            operations: 0,
        }
    }

    /// The loader, started anew.
    pub fn restart(&mut self, fault: Option<Fault>) {
        let flash = std::mem::take(&mut self.flash);
        *self = Self {
            flash,
            fault,
            ..Self::new()
        };
    }

    /// The loader in an error, as an interrupted conversation leaves it.
    pub fn confuse(&mut self, state: u8) {
        self.state = state;
    }

    /// Writes an image as it lies in flash.
    pub fn put(&mut self, image: &Image) {
        self.flash[..image.bytes().len()].copy_from_slice(image.bytes());
    }

    fn at(&mut self, address: u32, length: usize) -> Option<&mut [u8]> {
        let from = address.checked_sub(FLASH.start)? as usize;
        self.flash.get_mut(from..from.checked_add(length)?)
    }

    fn is_here(&mut self) -> Result<(), Trouble> {
        self.requests += 1;
        let is_gone = match self.fault {
            Some(Fault::Gone(after)) => self.requests > after,
            Some(Fault::Unpowered(after)) => self.operations > after,
            _ => false,
        };
        match is_gone || self.started.is_some() {
            true => Err(Trouble::Lost("no such device".to_owned())),
            false => Ok(()),
        }
    }

    fn download(&mut self, block: u16, bytes: &[u8]) -> Result<usize, Trouble> {
        if ![IDLE, DOWNLOAD_IDLE].contains(&self.state) {
            return Err(self.stall());
        }
        let address = |bytes: &[u8]| Some(u32::from_le_bytes(bytes.try_into().ok()?));
        let operation = match (block, bytes) {
            (_, []) => {
                self.state = MANIFEST_SYNC;
                return Ok(0);
            }
            (0, [0x21, rest @ ..]) => address(rest).map(Operation::Point),
            (0, [0x41, rest @ ..]) => address(rest).map(Operation::Erase),
            (2.., bytes) if bytes.len() <= BLOCK => {
                let at = self.pointer + (u32::from(block) - 2) * BLOCK as u32;
                Some(Operation::Write(at, bytes.to_vec()))
            }
            _ => None,
        };
        self.pending = Some(operation.ok_or_else(|| self.stall())?);
        self.state = DOWNLOAD_SYNC;
        Ok(bytes.len())
    }

    fn stall(&mut self) -> Trouble {
        (self.state, self.status) = (ERROR, 0x0F);
        Trouble::Refused("stalled".to_owned())
    }

    fn operate(&mut self, operation: Operation) {
        let fault = self.fault;
        let done = match operation {
            Operation::Point(address) => {
                self.pointer = address;
                true
            }
            Operation::Erase(sector) => self.erase(sector, fault),
            Operation::Write(address, bytes) => self.program(address, bytes, fault),
        };
        if !done {
            (self.state, self.status) = (ERROR, 0x03);
        }
    }

    fn is_cut(&mut self) -> bool {
        self.operations += 1;
        matches!(self.fault, Some(Fault::Unpowered(after)) if self.operations > after)
    }

    fn erase(&mut self, sector: u32, fault: Option<Fault>) -> bool {
        assert!(sector.is_multiple_of(SECTOR_BYTES), "{sector:#x}");
        self.erased.push(sector);
        let length = match self.is_cut() {
            true => SECTOR_BYTES as usize / 2,
            false => SECTOR_BYTES as usize,
        };
        match self.at(sector, length) {
            Some(bytes) if fault != Some(Fault::EraseFails(sector)) => {
                bytes.fill(0xFF);
                true
            }
            _ => false,
        }
    }

    fn program(&mut self, address: u32, mut bytes: Vec<u8>, fault: Option<Fault>) -> bool {
        assert!(address.is_multiple_of(32) && bytes.len().is_multiple_of(32));
        if let Some(Fault::KeepsWrong(at)) = fault
            && (address..address + bytes.len() as u32).contains(&at)
        {
            bytes[(at - address) as usize] ^= 4;
        }
        if self.is_cut() {
            bytes.truncate(bytes.len() / 2);
        }
        match self.at(address, bytes.len()) {
            Some(to) if fault != Some(Fault::WriteFails(address)) => {
                assert!(
                    to.iter().all(|byte| *byte == 0xFF),
                    "a word twice: {address:#x}"
                );
                to.copy_from_slice(&bytes);
                true
            }
            _ => false,
        }
    }

    fn get_status(&mut self) -> Result<[u8; 6], Trouble> {
        let shown = match self.state {
            DOWNLOAD_SYNC => {
                if let (Some(Fault::Silent(times)), Some(Operation::Erase(_))) =
                    (self.fault, &self.pending)
                    && times > 0
                {
                    self.fault = Some(Fault::Silent(times - 1));
                    return Err(Trouble::Late);
                }
                self.state = DOWNLOAD_IDLE;
                if let Some(operation) = self.pending.take() {
                    self.operate(operation);
                }
                // An error shows at the next request.
                DOWNLOAD_BUSY
            }
            MANIFEST_SYNC => {
                self.started = Some(self.pointer);
                MANIFEST
            }
            state => state,
        };
        let status = if shown == ERROR { self.status } else { 0 };
        let pause_ms = 0;
        Ok([status, pause_ms, 0, 0, shown, 0])
    }

    fn upload(&mut self, block: u16, buffer: &mut [u8]) -> Result<usize, Trouble> {
        if ![IDLE, UPLOAD_IDLE].contains(&self.state) || block < 2 {
            return Err(self.stall());
        }
        let address = self.pointer + (u32::from(block) - 2) * BLOCK as u32;
        let Some(bytes) = self.at(address, buffer.len()) else {
            return Err(self.stall());
        };
        buffer.copy_from_slice(bytes);
        self.state = UPLOAD_IDLE;
        Ok(buffer.len())
    }
}

/// The device's USB.
pub struct Usb {
    device: Rc<RefCell<Device>>,
    protocol: DfuProtocol<MemoryLayout>,
    descriptor: FunctionalDescriptor,
}

impl Usb {
    pub fn of(device: &Rc<RefCell<Device>>) -> Self {
        Self::named(device, "@Internal Flash   /0x08000000/16*128Kg")
    }

    /// With another memory.
    pub fn named(device: &Rc<RefCell<Device>>, memory: &str) -> Self {
        Self {
            device: device.clone(),
            protocol: DfuProtocol::new(memory, (1, 0x1A)).unwrap(),
            descriptor: FunctionalDescriptor {
                can_download: true,
                can_upload: true,
                manifestation_tolerant: false,
                will_detach: true,
                detach_timeout: 255,
                transfer_size: BLOCK as u16,
                dfu_version: (1, 0x1A),
            },
        }
    }

    fn device(&self) -> Result<RefMut<'_, Device>, Trouble> {
        let mut device = self.device.borrow_mut();
        device.is_here()?;
        Ok(device)
    }
}

impl DfuIo for Usb {
    type Read = usize;
    type Write = usize;
    type Reset = ();
    type Error = Trouble;
    type MemoryLayout = MemoryLayout;

    fn read_control(
        &self,
        request_type: u8,
        request: u8,
        value: u16,
        buffer: &mut [u8],
    ) -> Result<usize, Trouble> {
        assert_eq!(request_type, 0xA1);
        let mut device = self.device()?;
        match request {
            2 => device.upload(value, buffer),
            3 => {
                buffer.copy_from_slice(&device.get_status()?);
                Ok(buffer.len())
            }
            _ => Err(device.stall()),
        }
    }

    fn write_control(
        &self,
        request_type: u8,
        request: u8,
        value: u16,
        buffer: &[u8],
    ) -> Result<usize, Trouble> {
        assert_eq!(request_type, 0x21);
        let mut device = self.device()?;
        match (request, device.state) {
            (1, _) => device.download(value, buffer),
            (4, ERROR) => {
                (device.state, device.status) = (IDLE, 0);
                Ok(0)
            }
            (6, IDLE | DOWNLOAD_IDLE | UPLOAD_IDLE) => {
                device.state = IDLE;
                Ok(0)
            }
            _ => Err(device.stall()),
        }
    }

    fn usb_reset(self) -> Result<(), Trouble> {
        Ok(())
    }

    fn protocol(&self) -> &DfuProtocol<MemoryLayout> {
        &self.protocol
    }

    fn functional_descriptor(&self) -> &FunctionalDescriptor {
        &self.descriptor
    }
}

/// Whether the first stage would start this flash's program.
pub fn starts(flash: &[u8]) -> bool {
    let program = &flash[(PROGRAM - FIRST_STAGE) as usize..FLASH.len()];
    let word = |at: usize| u32::from_le_bytes(program[at..at + 4].try_into().unwrap());
    let header = HEADER_AT as usize;
    let length = word(header + 80) as usize;
    program[header..].starts_with(b"HiVTacFW")
        && program
            .get(..length)
            .is_some_and(|program| crc_of(program) == word(CRC_AT as usize))
}

fn crc_of(program: &[u8]) -> u32 {
    let (before, rest) = program.split_at(CRC_AT as usize);
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(before);
    hasher.update(&rest[4..]);
    hasher.finalize()
}
