//! Faults on request: their kinds, and the times at which they are on.

use std::fmt;
use std::str::FromStr;

/// The kinds of fault. All are outside the microcontroller, except the DMA
/// stall and those of the USB core.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// No camera on the connector: no acknowledge, no signals.
    CameraAbsent,
    /// The camera answers with a different product id.
    CameraWrongId,
    /// The camera's registers have the values of another program.
    CameraUsed,
    /// The camera was interrupted in the middle of a byte and holds SDA low until it has had its
    /// nine clocks.
    SdaStuck,
    /// The camera holds SCL low.
    SclStretch,
    /// I²C1 reports a bus error in the first transfer from that time on; the transfer goes on
    /// normally.
    BerrOnce,
    /// The camera's clock tree stops: no VSYNC, no pixels; its registers still answer.
    CameraSilent,
    /// The camera's clock loop multiplies by half of the value in its register.
    CameraSlow,
    /// A register of the camera goes back to its value after a reset, once.
    CameraForgets,
    /// The camera's automatic exposure and gain move by a sixteenth every fourth frame, and rest as
    /// soon as the level is within its limits.
    CameraHesitant,
    /// The camera sends half of its rows in frames that begin while the fault is on.
    FrameShort,
    /// The camera sends five surplus rows in frames that begin while the fault is on.
    FrameLong,
    /// VSYNC comes with the last byte of a frame, whose last words wait for the bus, by seed.
    VsyncEarly,
    /// The DMA gets no access to the bus, and the camera interface overruns.
    DcmiOverrun,
    /// Others hold the bus, by seed. Blocks that the MDMA moves take up to 16 times as long, the
    /// DMA waits for words of the camera interface, and both their interrupt lines fall late.
    BusBusy,
    /// The host has the port open but does not ask for data.
    HostNotReading,
    /// The USB data lines are disconnected; the device stays powered.
    CablePulled,
    /// The USB core latches a suspend that is over together with the end of a bus reset.
    UsbStaleSuspend,
    /// The USB core sends no bulk or interrupt packet any more until it disconnects.
    UsbStuck,
    /// Operations of the flash's second bank that begin while the fault is on end with an error. A
    /// word that was to be programmed is unreadable; a sector that was to be erased looks blank and
    /// is not.
    FlashFails,
    /// The board's supply sags to 2.7 V, at which the microcontroller still runs.
    SupplyLow,
    /// The board's crystal does not start in the whole run.
    CrystalSilent,
}

const NAMES: [(&str, Kind); 22] = [
    ("camera-absent", Kind::CameraAbsent),
    ("camera-wrong-id", Kind::CameraWrongId),
    ("camera-used", Kind::CameraUsed),
    ("sda-stuck", Kind::SdaStuck),
    ("scl-stretch", Kind::SclStretch),
    ("berr-once", Kind::BerrOnce),
    ("camera-silent", Kind::CameraSilent),
    ("camera-slow", Kind::CameraSlow),
    ("camera-forgets", Kind::CameraForgets),
    ("camera-hesitant", Kind::CameraHesitant),
    ("frame-short", Kind::FrameShort),
    ("frame-long", Kind::FrameLong),
    ("vsync-early", Kind::VsyncEarly),
    ("dcmi-overrun", Kind::DcmiOverrun),
    ("bus-busy", Kind::BusBusy),
    ("host-not-reading", Kind::HostNotReading),
    ("cable-pulled", Kind::CablePulled),
    ("usb-stale-suspend", Kind::UsbStaleSuspend),
    ("usb-stuck", Kind::UsbStuck),
    ("flash-fails", Kind::FlashFails),
    ("supply-low", Kind::SupplyLow),
    ("crystal-silent", Kind::CrystalSilent),
];

/// Longest time, ms: a thousand days.
const LONGEST_MS: u64 = 86_400_000_000;

/// A fault and the virtual time during which it is on, ns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The kind of fault.
    pub kind: Kind,
    /// The instant at which it begins.
    pub from_ns: u64,
    /// The instant at which it ends; `u64::MAX` for the rest of the run.
    pub until_ns: u64,
}

impl FromStr for Fault {
    type Err = String;

    /// Reads `KIND`, `KIND@MS` or `KIND@MS-MS`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, time) = text
            .split_once('@')
            .map_or((text, None), |(name, time)| (name, Some(time)));
        let kind = NAMES
            .iter()
            .find(|(known, _)| *known == name)
            .map(|(_, kind)| *kind);
        let kind = kind.ok_or_else(|| format!("no fault is called `{name}`: use {}", names()))?;
        let (from, until) = match time.map(|time| time.split_once('-').unwrap_or((time, ""))) {
            None => (0, u64::MAX),
            Some((from, "")) => (milliseconds(from)?, default_end(kind, milliseconds(from)?)),
            Some((from, until)) => (milliseconds(from)?, milliseconds(until)?),
        };
        if from >= until {
            return Err(format!(
                "`{text}` ends before it begins: write KIND@FROM-UNTIL in milliseconds"
            ));
        }
        Ok(Self {
            kind,
            from_ns: from,
            until_ns: until,
        })
    }
}

fn names() -> String {
    NAMES.map(|(name, _)| name).join(", ")
}

fn milliseconds(text: &str) -> Result<u64, String> {
    match text.parse::<u64>() {
        Ok(ms) if ms <= LONGEST_MS => Ok(ms * 1_000_000),
        _ => Err(format!(
            "`{text}` is no time in whole milliseconds up to {LONGEST_MS}"
        )),
    }
}

/// Returns the end of a fault without a given end. A DMA stall lasts a millisecond, a held clock
/// twenty, a wrong size a frame or two, and all others the rest of the run.
fn default_end(kind: Kind, from_ns: u64) -> u64 {
    match kind {
        Kind::DcmiOverrun => from_ns + 1_000_000,
        Kind::SclStretch => from_ns + 20_000_000,
        Kind::FrameShort | Kind::FrameLong => from_ns + 7_000_000,
        _ => u64::MAX,
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = NAMES
            .iter()
            .find(|(_, kind)| *kind == self.kind)
            .map_or("?", |(name, _)| *name);
        write!(f, "{name}@{}", self.from_ns / 1_000_000)?;
        if self.until_ns == u64::MAX {
            Ok(())
        } else {
            write!(f, "-{}", self.until_ns / 1_000_000)
        }
    }
}

/// Every fault of a run.
#[derive(Clone, Debug, Default)]
pub struct Faults(Vec<Fault>);

impl Faults {
    /// Returns the given faults.
    pub fn new(faults: Vec<Fault>) -> Self {
        Self(faults)
    }

    /// Returns whether the run has a fault of this kind.
    pub fn asked_for(&self, kind: Kind) -> bool {
        self.of(kind).next().is_some()
    }

    /// Returns whether a fault of this kind is on at an instant.
    pub fn on(&self, kind: Kind, now_ns: u64) -> bool {
        self.of(kind)
            .any(|fault| (fault.from_ns..fault.until_ns).contains(&now_ns))
    }

    /// Returns the next instant after `now_ns` at which a fault of this kind begins or ends, if
    /// any.
    pub fn next_change(&self, kind: Kind, now_ns: u64) -> Option<u64> {
        let instants = self
            .of(kind)
            .flat_map(|fault| [fault.from_ns, fault.until_ns]);
        instants.filter(|&at| at > now_ns && at != u64::MAX).min()
    }

    fn of(&self, kind: Kind) -> impl Iterator<Item = &Fault> {
        self.0.iter().filter(move |fault| fault.kind == kind)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_is_written_as_kind_and_time() {
        let fault: Fault = "camera-silent@100-250".parse().unwrap();
        assert_eq!(
            (fault.kind, fault.from_ns, fault.until_ns),
            (Kind::CameraSilent, 100_000_000, 250_000_000)
        );
        assert_eq!(fault.to_string(), "camera-silent@100-250");
        let fault: Fault = "dcmi-overrun@7".parse().unwrap();
        assert_eq!(fault.until_ns - fault.from_ns, 1_000_000);
        assert_eq!("camera-absent".parse::<Fault>().unwrap().until_ns, u64::MAX);
    }

    #[test]
    fn a_fault_that_makes_no_sense_is_explained() {
        for (text, word) in [
            ("fire", "fire"),
            ("camera-silent@x", "x"),
            ("cable-pulled@9-3", "ends"),
            ("cable-pulled@-1", "time"),
        ] {
            let error = text.parse::<Fault>().unwrap_err();
            assert!(error.contains(word), "{text}: {error}");
        }
    }

    #[test]
    fn a_fault_is_on_from_its_start_to_just_before_its_end() {
        let faults = Faults::new(vec!["cable-pulled@1-2".parse().unwrap()]);
        let on =
            [999_999, 1_000_000, 1_999_999, 2_000_000].map(|at| faults.on(Kind::CablePulled, at));
        assert_eq!(on, [false, true, true, false]);
        assert_eq!(faults.next_change(Kind::CablePulled, 0), Some(1_000_000));
        assert_eq!(
            faults.next_change(Kind::CablePulled, 1_000_000),
            Some(2_000_000)
        );
        assert_eq!(faults.next_change(Kind::CablePulled, 2_000_000), None);
        assert!(!faults.on(Kind::CameraSilent, 1_500_000));
    }
}
