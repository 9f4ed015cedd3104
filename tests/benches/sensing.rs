//! Measures the time of the sensing's stages on this computer, to show a regression without an
//! emulator: `cargo bench --package hivtac-tests`.

use std::hint::black_box;
use std::time::Instant;

use hivtac_sensor::force::model::{Model, OutputKind};
use hivtac_sensor::force::network::Network;
use hivtac_sensor::markers::scanner::{ScanSettings, Scanner};
use hivtac_sensor::markers::screen::ScreenedTable;
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::markers::tables::Table;
use hivtac_sensor::pipeline::Sensor;
use hivtac_terms::geometry::Geometry;
use hivtac_terms::threshold::{ByteOrder, HsvBox};
use hivtac_tests::models::{self, Weights};
use hivtac_tests::pictures;
use hivtac_twin::{Preset, Scene};

/// Columns and rows of the frames.
const SIZES: [[u16; 2]; 2] = [[320, 240], [800, 600]];
/// Runs of each stage. The fastest is printed, as other programs may use the computer.
const RUNS: u32 = 2_000;

/// Runs a stage, and prints its fastest time.
fn measure<T>(stage: &str, mut run: impl FnMut() -> T) {
    let seconds = (0..RUNS).map(|_| {
        let begin = Instant::now();
        black_box(run());
        begin.elapsed().as_secs_f64()
    });
    let fastest = seconds.fold(f64::MAX, f64::min);
    println!("{stage}: {:.1} µs", 1e6 * fastest);
}

struct Frame {
    name: String,
    size: [u16; 2],
    pixels: Vec<u16>,
}

impl Frame {
    fn all() -> Vec<Frame> {
        let frames = SIZES.iter().flat_map(|&[width, height]| {
            let (columns, rows) = (u32::from(width), u32::from(height));
            let scene = Scene::preset("static", Preset::Ov7725, columns, rows, 1);
            let usual = scene.expect("a sound scene").frame(0, 1.0).pixels;
            let salted = pictures::salted(usual.clone(), 5, 1);
            [("", usual), (", 5 % salt", salted)].map(|(special, pixels)| Frame {
                name: format!("{width}x{height}{special}"),
                size: [width, height],
                pixels,
            })
        });
        frames.collect()
    }

    fn rows(&self) -> impl Iterator<Item = &[u16]> {
        black_box(&self.pixels).chunks_exact(usize::from(self.size[0]))
    }

    /// Returns the masks that the threshold makes of the rows.
    fn masks(&self, table: &ScreenedTable) -> Vec<Vec<u32>> {
        let word = |pixels: &[u16]| {
            let bits = pixels.iter().map(|&raw| u32::from(table.accepts(raw)));
            (0..).zip(bits).fold(0, |word, (i, bit)| word | bit << i)
        };
        let rows = self.rows();
        rows.map(|row| row.chunks(32).map(word).collect()).collect()
    }
}

fn table() -> Box<ScreenedTable> {
    let mut table = Box::new(ScreenedTable::CLOSED);
    let set = table.set(&HsvBox::RED, ByteOrder::Native);
    set.expect("the usual box is a threshold");
    table
}

/// Measures the scanner alone: from pixels, and from masks, that is, without the threshold.
fn scanner() {
    let (table, mut scanner) = (table(), Box::new(Scanner::<64>::new()));
    for frame in Frame::all() {
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
        measure(&format!("scanner, pixels of {}", frame.name), || {
            scanner.begin(settings).expect("a size that it takes");
            frame.rows().for_each(|row| scanner.push_row(&*table, row));
            scanner.finish(&*table).set_pixels
        });
        let masks = frame.masks(&table);
        measure(&format!("scanner, masks of {}", frame.name), || {
            scanner.begin(settings).expect("a size that it takes");
            black_box(&masks)
                .iter()
                .for_each(|mask| scanner.push_mask_row(mask));
            scanner.finish(&*table).set_pixels
        });
    }
}

/// Measures the way from pixels to features.
fn frame() {
    let mut sensor = Box::new(Sensor::<64, ScreenedTable>::new());
    for frame in Frame::all() {
        let [width, height] = frame.size;
        let geometry = Geometry::preset(Preset::Ov7725, width, height);
        sensor
            .configure(Settings::usual(geometry, ByteOrder::Native), None)
            .expect("usual settings");
        measure(&format!("frame of {}", frame.name), || {
            sensor.begin_frame();
            frame.rows().for_each(|row| sensor.push_row(row));
            sensor.finish_frame()
        });
    }
}

/// Measures one inference.
fn network() {
    for widths in [&[11, 64, 64, 3][..], &[11, 512, 512, 512, 3]] {
        let file = models::file(widths, Weights::Random, OutputKind::ForceVector, 1);
        let model = Model::parse(&file).expect("a sound model");
        let (mut network, rest) = (Network::new(), models::rest());
        measure(&format!("network {widths:?}"), || {
            network.run(&model, black_box(&rest), &rest)
        });
    }
}

fn main() {
    scanner();
    frame();
    network();
}
