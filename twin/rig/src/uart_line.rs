//! Records bytes and times of the UART for samples.

use rigless::chip::Timeline;
use rigless::chip::uart::Peer;
use rigless::snapshot::Store;
use rigless::time::VirtualNanos;

/// A byte on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UartByte {
    /// Time at which its stop bit ended, ns.
    pub at_ns: u64,
    /// The byte.
    pub byte: u8,
}

/// The far end of the line, which only listens.
#[derive(Debug, Default)]
pub struct Listener {
    /// All bytes since the start of the run.
    pub bytes: Vec<UartByte>,
}

// The rig takes no snapshots.
impl Store for Listener {}

impl Peer for Listener {
    fn receive(&mut self, word: u16, context: &mut Timeline<'_, '_>) {
        let VirtualNanos(at_ns) = context.now();
        let [byte, _] = word.to_le_bytes();
        self.bytes.push(UartByte { at_ns, byte });
    }

    fn transmit(&mut self, _now: VirtualNanos) -> Option<u16> {
        None
    }
}
