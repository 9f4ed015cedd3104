//! Control transfers: SETUP, data, status, one transaction at a time.

use crate::peripherals::otg::{Answer, Core, Packet};

/// The address the host gives the device.
pub const ADDRESS: u8 = 7;
/// Name of the transfer that sets the address.
pub const SET_ADDRESS: &str = "SET_ADDRESS";
/// Name of the transfer that reads the device descriptor.
pub const DEVICE: &str = "GET_DESCRIPTOR device";
/// Name of the transfer that reads the whole configuration.
pub const CONFIGURATION: &str = "GET_DESCRIPTOR configuration";
/// Name of a script's own request.
pub const ANY: &str = "control";
/// Largest packet of endpoint 0.
const PACKET: usize = 64;

/// The next stage of a transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    Setup,
    DataIn,
    DataOut,
    StatusIn,
    StatusOut,
}

/// The state of a transfer after a transaction.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Progress {
    /// The transfer goes on.
    Going,
    /// The transfer is complete, with the bytes that were read.
    Done(Vec<u8>),
    /// The transfer failed.
    Failed(Failure),
}

/// The reason why a transfer failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The device refused it.
    Stalled,
    /// The device took too long.
    TimedOut,
}

impl Failure {
    /// Returns it for the log.
    pub fn name(self) -> &'static str {
        match self {
            Failure::Stalled => "stalled",
            Failure::TimedOut => "timed out",
        }
    }
}

/// The endpoints whose next packet is DATA0 after a transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Begins {
    /// No endpoint.
    None,
    /// The endpoint with this address.
    Endpoint(u8),
    /// The endpoints of the interface with this number.
    Interface(u8),
    /// All endpoints.
    All,
}

/// A control transfer.
#[derive(Clone, Debug)]
pub struct Transfer {
    /// Name for the log.
    pub name: &'static str,
    setup: [u8; 8],
    data: Vec<u8>,
    /// Number of its bytes that the device has taken.
    sent: usize,
    stage: Stage,
    deadline: u64,
}

impl Transfer {
    fn read(name: &'static str, setup: [u8; 8]) -> Self {
        Self {
            name,
            setup,
            data: Vec::new(),
            sent: 0,
            stage: Stage::Setup,
            deadline: 0,
        }
    }

    fn write(name: &'static str, setup: [u8; 8], data: &[u8]) -> Self {
        Self {
            data: data.to_vec(),
            ..Self::read(name, setup)
        }
    }

    /// Returns any request, with zeros for its data.
    pub fn any(setup: [u8; 8]) -> Self {
        let transfer = Self::read(ANY, setup);
        match transfer.is_read() {
            true => transfer,
            false => Self {
                data: vec![0; transfer.wanted().min(PACKET)],
                ..transfer
            },
        }
    }

    /// Returns a client's request with its data towards the device; `None` if their length is not
    /// the one in the request.
    pub fn of_client(setup: [u8; 8], data: &[u8]) -> Option<Self> {
        let transfer = Self::write(ANY, setup, data);
        let wanted = if transfer.is_read() {
            0
        } else {
            transfer.wanted()
        };
        (data.len() == wanted).then_some(transfer)
    }

    /// Returns the transfer's title for the log: its name, or its bytes.
    pub fn title(&self) -> String {
        match self.name {
            ANY => {
                let bytes = self.setup.map(|byte| format!("{byte:02x}"));
                format!("{ANY} {}", bytes.join(" "))
            }
            name => name.to_owned(),
        }
    }

    /// Returns the endpoint whose halt it clears: the endpoint's toggle restarts on both sides. A
    /// transfer that sets an interface restarts its endpoints, one that sets a configuration all.
    pub fn begins_anew(&self) -> Begins {
        match self.setup {
            [2, 1, 0, 0, endpoint, ..] => Begins::Endpoint(endpoint),
            [1, 11, _, _, interface, ..] => Begins::Interface(interface),
            [0, 9, ..] => Begins::All,
            _ => Begins::None,
        }
    }

    /// Starts the transfer; it fails at the deadline.
    pub fn begin(&mut self, deadline: u64) {
        self.deadline = deadline;
    }

    fn wanted(&self) -> usize {
        usize::from(u16::from_le_bytes([self.setup[6], self.setup[7]]))
    }

    fn is_read(&self) -> bool {
        self.setup[0] & 0x80 != 0
    }

    /// Carries out one transaction.
    pub fn step(&mut self, now: u64, address: u8, device: &mut Core) -> Progress {
        if now >= self.deadline {
            return Progress::Failed(Failure::TimedOut);
        }
        match self.stage {
            Stage::Setup => self.send_setup(address, device),
            Stage::DataIn => match device.transmit(address, 0) {
                Answer::Ack(packet) => self.data_in(&packet.bytes),
                other => waiting(other),
            },
            Stage::DataOut => self.data_out(address, device),
            Stage::StatusIn => match device.transmit(address, 0) {
                Answer::Ack(_) => Progress::Done(Vec::new()),
                other => waiting(other),
            },
            Stage::StatusOut => match device.receive(address, 0, &packet(&[])) {
                Answer::Ack(()) => Progress::Done(std::mem::take(&mut self.data)),
                other => waiting(other),
            },
        }
    }

    fn send_setup(&mut self, address: u8, device: &mut Core) -> Progress {
        if device.setup(address, self.setup) != Answer::Ack(()) {
            return Progress::Going;
        }
        self.go(match (self.is_read(), self.wanted()) {
            (_, 0) => Stage::StatusIn,
            (true, _) => Stage::DataIn,
            (false, _) => Stage::DataOut,
        })
    }

    fn data_in(&mut self, packet: &[u8]) -> Progress {
        self.data.extend(packet);
        if packet.len() < PACKET || self.data.len() >= self.wanted() {
            self.go(Stage::StatusOut)
        } else {
            Progress::Going
        }
    }

    fn data_out(&mut self, address: u8, device: &mut Core) -> Progress {
        let rest = &self.data[self.sent..];
        let bytes = &rest[..rest.len().min(PACKET)];
        match device.receive(address, 0, &packet(bytes)) {
            Answer::Ack(()) => self.sent += bytes.len(),
            other => return waiting(other),
        }
        match self.sent == self.data.len() {
            true => self.go(Stage::StatusIn),
            false => Progress::Going,
        }
    }

    fn go(&mut self, stage: Stage) -> Progress {
        self.stage = stage;
        Progress::Going
    }
}

/// The core manages the toggles of endpoint 0.
fn packet(bytes: &[u8]) -> Packet {
    Packet {
        bytes: bytes.to_vec(),
        data1: true,
    }
}

fn waiting<T>(answer: Answer<T>) -> Progress {
    if matches!(answer, Answer::Stall) {
        Progress::Failed(Failure::Stalled)
    } else {
        Progress::Going
    }
}

/// Returns the host's requests to a new device.
pub fn enumeration() -> Vec<Transfer> {
    vec![
        Transfer::read(
            "GET_DESCRIPTOR device, first part",
            [0x80, 6, 0, 1, 0, 0, 8, 0],
        ),
        set_address(),
        Transfer::read(DEVICE, [0x80, 6, 0, 1, 0, 0, 18, 0]),
        Transfer::read(
            "GET_DESCRIPTOR configuration, first part",
            [0x80, 6, 0, 2, 0, 0, 9, 0],
        ),
        Transfer::read(CONFIGURATION, [0x80, 6, 0, 2, 0, 0, 0xFF, 0]),
        Transfer::read(
            "GET_DESCRIPTOR manufacturer",
            [0x80, 6, 1, 3, 9, 4, 0xFF, 0],
        ),
        Transfer::read("GET_DESCRIPTOR product", [0x80, 6, 2, 3, 9, 4, 0xFF, 0]),
        Transfer::write("SET_CONFIGURATION", [0, 9, 1, 0, 0, 0, 0, 0], &[]),
    ]
}

/// Returns the request that gives a device its address.
pub fn set_address() -> Transfer {
    Transfer::write(SET_ADDRESS, [0, 5, ADDRESS, 0, 0, 0, 0, 0], &[])
}

/// Returns the host's requests to a new device that a client will use: those up to the whole
/// configuration.
pub fn introduction() -> Vec<Transfer> {
    let mut all = enumeration();
    let last = all
        .iter()
        .position(|transfer| transfer.name == CONFIGURATION);
    all.truncate(last.map_or(0, |last| last + 1));
    all
}

/// Returns the host's requests when a program opens (115200 8N1, DTR and RTS) or closes the port.
pub fn line(interface: u8, open: bool) -> Vec<Transfer> {
    let state = Transfer::write(
        "SET_CONTROL_LINE_STATE",
        [0x21, 0x22, if open { 3 } else { 0 }, 0, interface, 0, 0, 0],
        &[],
    );
    let coding = Transfer::write(
        "SET_LINE_CODING",
        [0x21, 0x20, 0, 0, interface, 0, 7, 0],
        &[0, 0xC2, 1, 0, 0, 0, 8],
    );
    if open {
        vec![coding, state]
    } else {
        vec![state]
    }
}
