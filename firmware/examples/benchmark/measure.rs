//! The timed work: the parts of a frame, and an inference.

use cortex_m_semihosting::hprintln;
use hivtac_sensor::force::features::Features;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::force::network::Network as Inference;
use hivtac_sensor::markers::scanner::{MAX_WIDTH, ScanSettings, Scanner};
use hivtac_sensor::markers::tables::Pixels;
use hivtac_terms::threshold::ByteOrder;

use crate::data::{Frame, Network};
use crate::dtcm_table::Sensor;
use crate::meter::Meter;

/// Widest row, in pixels.
const ROW: usize = MAX_WIDTH as usize;
/// Rows that arrive together: those of the firmware's bands.
const BAND_ROWS: usize = 8;
/// Room for a model in DTCM.
const MODEL: usize = 16 * 1024;
/// Number of repetitions; in the first one caches are cold.
const REPETITIONS: usize = 2;

/// A model file, aligned so that the kernels can read whole words.
#[repr(align(8))]
struct ModelFile([u8; MODEL]);

/// The parts that do not fit into DTCM together with the table, as in the firmware.
pub struct Scanners {
    sensor: Sensor,
    scanner: Scanner<64>,
}

impl Scanners {
    /// Returns them ready for the first frame.
    pub const fn new() -> Scanners {
        Scanners {
            sensor: Sensor::new(),
            scanner: Scanner::new(),
        }
    }
}

/// All other working data, in DTCM as all statics.
pub struct Workplace {
    inference: Inference,
    row: [u16; ROW],
    model: ModelFile,
}

impl Workplace {
    /// Returns it ready for the first frame.
    pub const fn new() -> Workplace {
        Workplace {
            inference: Inference::new(),
            row: [0; ROW],
            model: ModelFile([0; MODEL]),
        }
    }
}

/// Times the parts of one frame and prints them.
pub fn frame(scanners: &mut Scanners, place: &mut Workplace, frame: &Frame, meter: &Meter) {
    let [width, height] = frame.size;
    let print = |item: &str, cycles: u32| {
        let (comma, special) = (
            if frame.special.is_empty() { "" } else { ", " },
            frame.special,
        );
        hprintln!(
            "{}{}{}|{}x{}|rgb565|{}",
            item,
            comma,
            special,
            width,
            height,
            cycles
        );
    };
    let (mut whole, mut last_band) = (0, 0);
    for _ in 0..REPETITIONS {
        (whole, last_band) = sense(&mut scanners.sensor, &mut place.row, frame, meter);
    }
    let (mut rows, mut masks) = (0, 0);
    for _ in 0..REPETITIONS {
        rows = scan(scanners, &mut place.row, frame, meter, Entry::Pixels);
        masks = scan(scanners, &mut place.row, frame, meter, Entry::Mask);
    }
    print("threshold", rows.saturating_sub(masks));
    print("blobs", masks);
    print("frame full", whole);
    print("latency", last_band);
}

/// Times one inference and prints it.
pub fn network(place: &mut Workplace, network: &Network, meter: &Meter) {
    let model = load(&mut place.model, network.model);
    let inference = &mut place.inference;
    let rest: Features = model.rest.features;
    let mut cycles = 0;
    for _ in 0..REPETITIONS {
        (_, cycles) = meter.time(|| inference.run(&model, &rest, &rest));
    }
    hprintln!("{}|320x240|rgb565|{}", network.name, cycles);
}

/// Returns the cycles of a frame from its first row to the force, and from its last band on.
fn sense(sensor: &mut Sensor, buffer: &mut [u16; ROW], frame: &Frame, meter: &Meter) -> (u32, u32) {
    let model = parse(frame.model);
    let settings = model.conditions.settings(ByteOrder::Swapped);
    let configured = sensor.configure(settings, Some(model));
    assert!(configured.is_ok(), "the model does not fit the frame");
    let (_, mut whole) = meter.time(|| sensor.begin_frame());
    let mut last_band = 0;
    let rows = usize::from(frame.size[1]);
    for y in 0..rows {
        let row = copy_row(buffer, frame, y);
        let (_, cycles) = meter.time(|| sensor.push_row(row));
        whole += cycles;
        if y + BAND_ROWS >= rows {
            last_band += cycles;
        }
    }
    let (_, finish) = meter.time(|| sensor.finish_frame());
    (whole + finish, last_band + finish)
}

/// The point at which a frame enters the scanner.
#[derive(Clone, Copy)]
enum Entry {
    Pixels,
    Mask,
}

/// Returns the cycles of the scanner alone, which reads pixels by the sensor's configuration.
fn scan(
    Scanners { sensor, scanner }: &mut Scanners,
    buffer: &mut [u16; ROW],
    frame: &Frame,
    meter: &Meter,
    entry: Entry,
) -> u32 {
    let [width, height] = frame.size;
    let settings = ScanSettings {
        width,
        height,
        dilations: 1,
        min_area: 1,
        weighted: false,
        max_runs: u32::MAX,
        cleaned: false,
    };
    let pixels = sensor.pixels();
    let begun = scanner.begin(settings);
    assert!(begun.is_ok(), "the frame can be scanned");
    let mut cycles = 0;
    for y in 0..height {
        let row = copy_row(buffer, frame, usize::from(y));
        cycles += match entry {
            Entry::Pixels => meter.time(|| scanner.push_row(pixels, row)).1,
            Entry::Mask => {
                let mut mask = [0; ROW.div_ceil(32)];
                let mask = &mut mask[..row.len().div_ceil(32)];
                pixels.mask_row(row, mask);
                meter.time(|| scanner.push_mask_row(mask)).1
            }
        };
    }
    cycles + meter.time(|| scanner.finish(pixels).blobs.len()).1
}

/// Copies row `y` to DTCM.
fn copy_row<'r>(row: &'r mut [u16; ROW], frame: &Frame, y: usize) -> &'r [u16] {
    let width = usize::from(frame.size[0]);
    let bytes = frame.pixels.chunks_exact(2 * width).nth(y).unwrap_or(&[]);
    for (pixel, pair) in row.iter_mut().zip(bytes.chunks_exact(2)) {
        *pixel = u16::from_le_bytes([pair[0], pair[1]]);
    }
    &row[..width]
}

/// Returns the model, in DTCM if it fits.
fn load<'m>(room: &'m mut ModelFile, file: &'static [u8]) -> Model<'m> {
    match room.0.get_mut(..file.len()) {
        Some(room) => {
            room.copy_from_slice(file);
            parse(room)
        }
        None => parse(file),
    }
}

fn parse(file: &[u8]) -> Model<'_> {
    match Model::parse(file) {
        Ok(model) => model,
        Err(error) => panic!("a model: {error}"),
    }
}
