//! The report of a run, for people and as JSON.

use std::collections::BTreeSet;
use std::time::Duration;

use rigless::machine::Board;
use rigless::session::Session;
use serde_json::{Value, json};

use crate::camera::SharedCamera;
use crate::chip::Chip;
use crate::peripherals::dcmi;
use crate::peripherals::flash::{Bank, Operation};
use crate::uart_line::UartByte;
use crate::usb_host::{self, Port, SharedHost};

/// Counters of a run.
#[derive(Clone, Debug)]
pub struct Report {
    /// Virtual time, ns.
    pub virtual_ns: u64,
    /// Share of the time during which the core executed instructions, once the camera was set up;
    /// asleep in the rest. `None` in a run that ended before.
    pub awake: Option<f64>,
    /// Wall time.
    pub wall: Duration,
    /// Times of the LED's switches, on and off in turn, ns.
    pub led_edges_ns: Vec<u64>,
    /// Times of the output pin's edges, high and low in turn, ns.
    pub output_edges_ns: Vec<u64>,
    /// The longest time from an edge of VSYNC to its handler, ns.
    pub latest_stamp_ns: u64,
    /// A memory that the program may both write and execute, if its regions are not enforced.
    pub writable_code: Option<u64>,
    /// Resets of the microcontroller.
    pub resets: usize,
    /// VSYNC pulses of the sensor.
    pub exposures: u64,
    /// Registers written over SCCB.
    pub sccb_writes: u64,
    /// The reason why the sensor sent no rows.
    pub camera_fault: Option<String>,
    /// The reason why the truth log ended early.
    pub truth_failure: Option<String>,
    /// The reason why the log of arrivals is incomplete.
    pub arrivals_failure: Option<String>,
    /// Counters of the camera interface.
    pub dcmi: dcmi::Counters,
    /// Operations of the flash's second bank, and changes of options.
    pub flash_operations: Vec<Operation>,
    /// Addresses of its words that were read or programmed.
    pub flash_words: BTreeSet<u32>,
    /// Whether the power was cut during one of the operations.
    pub power_was_cut: bool,
    /// Bytes that the MDMA moved out of memories.
    pub mdma_bytes: u64,
    /// The state of the USB port at the end.
    pub port: Port,
    /// Counters of the USB host.
    pub usb: usb_host::Counters,
    /// Events on the USB port.
    pub usb_log: Vec<String>,
    /// Bytes that came over the UART for samples.
    pub uart: Vec<UartByte>,
    /// Words that the firmware wrote into full USB FIFOs.
    pub lost_usb_words: u64,
    /// Accesses to addresses without a device, or refused by a clock gate.
    pub refused: Vec<String>,
    /// Warnings of the emulator's models about settings that the manual forbids.
    pub warnings: Vec<String>,
}

impl Report {
    /// Collects the counters.
    pub(crate) fn new<D: Board>(
        session: &Session<D>,
        chip: &Chip,
        camera: &SharedCamera,
        host: &SharedHost,
        bank: &Bank,
        wall: Duration,
        virtual_ns: u64,
    ) -> Self {
        let (camera, host) = (camera.lock(), host.lock());
        let unmapped = session
            .unmapped()
            .into_iter()
            .map(|unmapped| unmapped.to_string());
        let refused = session
            .refused()
            .iter()
            .map(|(address, fault)| format!("{address:#010x}: {fault}"));
        Self {
            virtual_ns,
            awake: None,
            wall,
            resets: session.resets().len(),
            led_edges_ns: chip.led_edges_ns().to_vec(),
            output_edges_ns: chip.output_edges_ns().to_vec(),
            latest_stamp_ns: chip.latest_stamp_ns(),
            writable_code: (chip.mpu.as_ref()).and_then(|mpu| mpu.types().writable_code()),
            exposures: camera.exposures(),
            sccb_writes: camera.sccb_writes(),
            camera_fault: camera.faulty_output().map(str::to_owned),
            truth_failure: camera.truth_failure().map(str::to_owned),
            arrivals_failure: host.arrivals_failure().map(str::to_owned),
            dcmi: chip.dcmi.counters(),
            flash_operations: bank.operations(),
            flash_words: bank.touched(),
            power_was_cut: bank.was_cut(),
            mdma_bytes: chip.mdma.memory_bytes(),
            port: host.port(),
            usb: host.counters(),
            usb_log: host.log().to_vec(),
            uart: chip.uart_bytes().to_vec(),
            lost_usb_words: chip.lost_usb_words(),
            refused: unmapped.chain(refused).collect(),
            warnings: session
                .told()
                .map(|it| format!("{} {}: {}", it.instance, it.register, it.reason))
                .collect(),
        }
    }

    /// Returns the wall time per captured frame, s; `None` without frames.
    pub fn wall_per_frame_s(&self) -> Option<f64> {
        (self.dcmi.frames > 0).then(|| self.wall.as_secs_f64() / self.dcmi.frames as f64)
    }

    /// Returns the report as JSON.
    pub fn json(&self) -> Value {
        json!({
            "virtual_s": self.virtual_ns as f64 / 1e9,
            "awake": self.awake,
            "wall_s": self.wall.as_secs_f64(),
            "wall_per_frame_s": self.wall_per_frame_s(),
            "resets": self.resets,
            "camera": {
                "exposures": self.exposures,
                "sccb_writes": self.sccb_writes,
                "fault": self.camera_fault,
            },
            "dcmi": {
                "frames": self.dcmi.frames,
                "empty_frames": self.dcmi.empty_frames,
                "words": self.dcmi.words,
                "overruns": self.dcmi.overruns,
                "waits": self.dcmi.waits,
            },
            "flash": {
                "operations": self.flash_operations.len(),
                "power_was_cut": self.power_was_cut,
            },
            "mdma": { "bytes": self.mdma_bytes },
            "usb": {
                "port": format!("{:?}", self.port),
                "enumerations": self.usb.enumerations,
                "failed_transfers": self.usb.failed_transfers,
                "repeated_packets": self.usb.repeated_packets,
                "port_resets": self.usb.port_resets,
                "suspends": self.usb.suspends,
                "bytes_in": self.usb.bytes_in,
                "packets_in": self.usb.packets_in,
                "bytes_out": self.usb.bytes_out,
                "lost_words": self.lost_usb_words,
                "log": self.usb_log,
            },
            "uart": { "bytes": self.uart.len() },
            "refused": self.refused,
            "warnings": self.warnings,
        })
    }

    /// Returns one line for a person.
    pub fn line(&self) -> String {
        let per_frame = self
            .wall_per_frame_s()
            .map_or(String::new(), |s| format!(" ({s:.3} s per frame)"));
        format!(
            "{:.3} s of virtual time in {:.1} s{per_frame}; {} exposures, {} frames captured, {} \
             overruns; {} bytes over USB, {} resets",
            self.virtual_ns as f64 / 1e9,
            self.wall.as_secs_f64(),
            self.exposures,
            self.dcmi.frames,
            self.dcmi.overruns,
            self.usb.bytes_in,
            self.resets,
        )
    }
}
