//! Runs golden cases: the input is a script of frames and numbers, the output a text with every bit
//! of the results.
//!
//! A script is a sequence of records until its end. Each is a kind in one byte and the fields that
//! [`Kind`] lists, little-endian. Every result is one line, printed by `Debug`. All numbers are
//! integers: equal text means equal bits.

mod marks;
mod record;

use core::fmt::{self, Write};
use core::ops::Range;

use hivtac_sensor::force::features::{FEATURES, Features};
use hivtac_sensor::force::forward::Estimate;
use hivtac_sensor::force::model::{AlignedFile, Model};
use hivtac_sensor::force::network::Network;
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::force::{FrameNoise, Polar, Resting};
use hivtac_sensor::markers::formats::Formats;
use hivtac_sensor::markers::scanner::{MAX_WIDTH, ScanSettings, Scanner};
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::markers::tables::{ByteTable, Pixels};
use hivtac_sensor::pipeline::{Measurement, Sensor, Work};
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::fixed::Q;
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_terms::list::List;
use hivtac_terms::marker::Marker;
use hivtac_terms::threshold::{ByteOrder, PixelFormat, Threshold};
use hivtac_terms::units::{MicroNewtons, MilliDegrees, Px};

use marks::{counting_begins, counting_ends, last_band_begins};
pub use record::{Kind, ScriptError, Source};
use record::{bytes, fill, number};

/// Bytes of a model of 11-512-512-512-3 with int16 weights.
pub const MAX_MODEL_BYTES: usize = 1088 * 1024;
/// Bytes of such a model with int8 weights, which is enough if no instructions are counted.
const USUAL_MODEL_BYTES: usize = 600 * 1024;
/// Storage for that. It is a constant, because a value would cross the stack twice.
pub const NO_USUAL_MODEL: AlignedFile<[u8; USUAL_MODEL_BYTES]> =
    AlignedFile([0; USUAL_MODEL_BYTES]);
/// Storage for a model file, at an address that is a multiple of four.
pub type ModelBuffer = AlignedFile<[u8; MAX_MODEL_BYTES]>;
/// Storage without a model.
pub const NO_MODEL: ModelBuffer = AlignedFile([0; MAX_MODEL_BYTES]);
/// Room for the widest row of pixels.
pub const MAX_ROW_PIXELS: usize = MAX_WIDTH as usize;
/// Rows that arrive together: those of the firmware's bands.
pub const BAND_ROWS: u16 = 8;
/// Room for two bands of the widest rows.
pub const TWO_BANDS_PIXELS: usize = 2 * BAND_ROWS as usize * MAX_ROW_PIXELS;
/// Number of blobs that a scan keeps.
pub const BLOBS: usize = 64;

/// Storage for a script's data. The caller provides it: a microcontroller decides in which memory
/// it lies.
pub struct Buffers<'b> {
    /// The model file.
    pub model: &'b mut AlignedFile<[u8]>,
    /// The present row of pixels.
    pub row: &'b mut [u16; MAX_ROW_PIXELS],
    /// The present band and the one above it.
    pub bands: &'b mut [u16; TWO_BANDS_PIXELS],
}

/// The pixel format of later frames, and how their pixels are used.
#[derive(Clone, Copy)]
struct PixelSettings {
    order: ByteOrder,
    threshold: Threshold,
    weighted: bool,
}

/// The state for running cases. It is large: on a microcontroller it lives in a `static`.
pub struct Runner<'b> {
    buffers: Buffers<'b>,
    /// The range of the model file in its buffer.
    model_place: Range<usize>,
    sent: PixelSettings,
    pixels: Formats<ByteTable>,
    scanner: Scanner<BLOBS>,
    cases: u32,
}

impl<'b> Runner<'b> {
    /// Returns a runner without a model, and with a threshold that accepts no pixel.
    pub const fn new(buffers: Buffers<'b>) -> Runner<'b> {
        Runner {
            buffers,
            model_place: 0..0,
            sent: PixelSettings {
                order: ByteOrder::Native,
                threshold: Threshold::red(PixelFormat::Rgb565),
                weighted: false,
            },
            pixels: Formats::CLOSED,
            scanner: Scanner::new(),
            cases: 0,
        }
    }

    /// Runs a whole script.
    ///
    /// # Errors
    /// [`ScriptError`] at the first record that cannot be run.
    pub fn run(
        &mut self,
        source: &mut impl Source,
        results: &mut impl Write,
    ) -> Result<(), ScriptError> {
        let mut kind = [0];
        while source.read(&mut kind) == 1 {
            let known = Kind::ALL.into_iter().find(|known| *known as u8 == kind[0]);
            match known.ok_or(ScriptError::UnknownKind(kind[0]))? {
                Kind::Model => self.load_model(source)?,
                Kind::Threshold => self.set_threshold(source)?,
                Kind::Scan => self.scan(source, results)?,
                Kind::Sense => self.sense(source, results)?,
                Kind::Network => self.network(source, results)?,
                Kind::Force => self.force(source, results)?,
                Kind::Press => self.press(source, results)?,
            }
            self.cases += 1;
        }
        Ok(())
    }

    fn load_model(&mut self, source: &mut impl Source) -> Result<(), ScriptError> {
        let [offset] = bytes(source)?;
        let length = u32::from_le_bytes(bytes(source)?) as usize;
        self.model_place = usize::from(offset)..usize::from(offset) + length;
        let room = self.buffers.model.0.get_mut(self.model_place.clone());
        fill(source, room.ok_or(ScriptError::ModelTooLarge(length))?)
    }

    fn set_threshold(&mut self, source: &mut impl Source) -> Result<(), ScriptError> {
        let [flags, limits @ ..] = bytes::<7>(source)?;
        self.sent.weighted = flags & 2 != 0;
        self.sent.order = if flags & 1 != 0 {
            ByteOrder::Swapped
        } else {
            ByteOrder::Native
        };
        let format = PixelFormat::ALL.get(usize::from(flags >> 3));
        let format = *format.ok_or(ScriptError::Format(flags >> 3))?;
        self.sent.threshold =
            Threshold::of_limits(format, limits).map_err(ScriptError::Threshold)?;
        let PixelSettings {
            order, threshold, ..
        } = self.sent;
        if flags & 4 != 0 {
            counting_begins();
        }
        let set = self.pixels.set(&threshold, order);
        counting_ends();
        set.map_err(ScriptError::Threshold)
    }

    fn scan(
        &mut self,
        source: &mut impl Source,
        results: &mut impl Write,
    ) -> Result<(), ScriptError> {
        let (width, height) = (number(source)?, number(source)?);
        let [dilations, min_area] = bytes(source)?;
        let min_area = u32::from(min_area);
        let settings = ScanSettings {
            width,
            height,
            dilations,
            min_area,
            weighted: self.sent.weighted,
            max_runs: u32::MAX,
            cleaned: false,
        };
        self.scanner.begin(settings).map_err(ScriptError::Scan)?;
        let (scanner, pixels) = (&mut self.scanner, &self.pixels);
        let words = [pixels.row_length(width), height.into()];
        for_each_row(source, self.buffers.row, words, |row| {
            counting_begins();
            scanner.push_row(pixels, row);
            counting_ends();
        })?;
        counting_begins();
        let scan = scanner.finish(pixels);
        counting_ends();
        say(results, self.cases, format_args!("{scan:?}"))
    }

    fn sense(
        &mut self,
        source: &mut impl Source,
        results: &mut impl Write,
    ) -> Result<(), ScriptError> {
        let (width, height, frames) = (number(source)?, number(source)?, number(source)?);
        let file = &self.buffers.model.0[self.model_place.clone()];
        let mut sensor = sensor(file, self.sent, [width, height])?;
        let words = [self.pixels.row_length(width), height.into()];
        for left in (0..frames).rev() {
            let buffers = (&mut self.buffers.row[..], &mut self.buffers.bands[..]);
            let measurement = sense_frame(&mut sensor, source, buffers, words, left == 0)?;
            say(results, self.cases, format_args!("{measurement:?}"))?;
            say(results, self.cases, format_args!("{:?}", sensor.blobs()))?;
        }
        Ok(())
    }

    fn network(
        &mut self,
        source: &mut impl Source,
        results: &mut impl Write,
    ) -> Result<(), ScriptError> {
        let (features, tare) = (features(source)?, features(source)?);
        let model = model(&self.buffers.model.0[self.model_place.clone()])?;
        let model = model.ok_or(ScriptError::NoModel)?;
        let mut network = Network::new();
        counting_begins();
        let output = network.run(&model, &features, &tare);
        counting_ends();
        say(results, self.cases, format_args!("{output:?}"))
    }

    fn press(
        &mut self,
        source: &mut impl Source,
        results: &mut impl Write,
    ) -> Result<(), ScriptError> {
        let mut markers = [Marker::default(); 4];
        for marker in &mut markers {
            marker.x = Px(i32::from_le_bytes(bytes(source)?));
            marker.y = Px(i32::from_le_bytes(bytes(source)?));
            marker.area = u32::from_le_bytes(bytes(source)?);
        }
        let mut rest = Rest {
            features: features(source)?,
            areas: List::defaults(4),
        };
        for area in rest.areas.iter_mut() {
            *area = u32::from_le_bytes(bytes(source)?);
        }
        let model = model(&self.buffers.model.0[self.model_place.clone()])?;
        let model = model.ok_or(ScriptError::NoModel)?;
        let resting = Resting::of_model(&model, &rest);
        let forward = model.forward.as_ref().zip(resting);
        let (forward, resting) = forward.ok_or(ScriptError::NoSteps)?;
        let mut network = Network::new();
        counting_begins();
        let features = Features::of_markers(&markers);
        let output = network.run(&model, &features, &rest.features);
        let found = resting.force(forward, &model.range, &markers, &output);
        counting_ends();
        say(results, self.cases, format_args!("{found:?}"))?;
        for lost in 0..4 {
            let noise = FrameNoise::AS_MODELLED;
            let (load, at) = resting.estimate_of_three(forward, &markers, lost, noise);
            let Estimate {
                pose, unexplained, ..
            } = load;
            let text = format_args!("without {lost}: {pose:?} {unexplained:?} {at:?}");
            say(results, self.cases, text)?;
        }
        Ok(())
    }

    fn force(
        &mut self,
        source: &mut impl Source,
        results: &mut impl Write,
    ) -> Result<(), ScriptError> {
        let mut numbers = [0; 3];
        for value in &mut numbers {
            *value = i32::from_le_bytes(bytes(source)?);
        }
        let [alpha, beta, magnitude] = numbers;
        let polar = Polar {
            alpha: MilliDegrees(alpha),
            beta: MilliDegrees(beta),
            magnitude: MicroNewtons(magnitude),
        };
        let (angles, vector) = (
            Polar::of_vector(numbers.map(MicroNewtons)),
            polar.to_vector(),
        );
        say(results, self.cases, format_args!("{angles:?} {vector:?}"))
    }
}

fn sensor(
    file: &[u8],
    sent: PixelSettings,
    [width, height]: [u16; 2],
) -> Result<Sensor<'_, BLOBS>, ScriptError> {
    let model = model(file)?;
    let mut settings = match &model {
        Some(model) => model.conditions.settings(sent.order),
        None => Settings::usual(Geometry::preset(Preset::Ov7725, width, height), sent.order),
    };
    settings.threshold = sent.threshold;
    if model.is_none() && sent.weighted {
        settings.centroid = CentroidEstimator::RednessWeighted;
    }
    let mut sensor = Sensor::new();
    let configured = sensor.configure(settings, model);
    configured.map_err(ScriptError::Settings)?;
    Ok(sensor)
}

/// Reads rows into memory, one by one.
fn read_band<'f>(
    source: &mut impl Source,
    row: &mut [u16],
    band: &'f mut [u16],
    words: [usize; 2],
) -> Result<&'f mut [u16], ScriptError> {
    let band = band.get_mut(..words[0] * words[1]);
    let band = band.ok_or(ScriptError::TooLarge(words))?;
    let mut rows = band.chunks_exact_mut(words[0].max(1));
    for_each_row(source, row, words, |row| {
        if let Some(place) = rows.next() {
            place.copy_from_slice(row);
        }
    })?;
    Ok(band)
}

fn model(file: &[u8]) -> Result<Option<Model<'_>>, ScriptError> {
    match file {
        [] => Ok(None),
        file => Model::parse(file).map(Some).map_err(ScriptError::Model),
    }
}

fn say(results: &mut impl Write, case: u32, result: fmt::Arguments<'_>) -> Result<(), ScriptError> {
    writeln!(results, "{case}: {result}").map_err(ScriptError::Output)
}

/// Senses a frame. The instruction counter counts the work if `is_counted`: the last frame's.
fn sense_frame(
    sensor: &mut Sensor<'_, BLOBS>,
    source: &mut impl Source,
    (row, bands): (&mut [u16], &mut [u16]),
    [length, height]: [usize; 2],
    is_counted: bool,
) -> Result<Measurement, ScriptError> {
    let counting_begins = || is_counted.then(|| counting_begins());
    let mut left = height;
    // As in the firmware, a band stays in memory until the next one was pushed.
    let (mut above, mut below) = bands.split_at_mut(bands.len() / 2);
    let mut above_length = 0;
    counting_begins();
    sensor.begin_frame();
    counting_ends();
    while left > 0 {
        let rows = left.min(usize::from(BAND_ROWS));
        let band = read_band(source, row, below, [length, rows])?;
        if is_counted && left <= usize::from(BAND_ROWS) {
            last_band_begins();
        }
        left -= rows;
        counting_begins();
        sensor.push_rows_below(&above[..above_length], band);
        counting_ends();
        above_length = band.len();
        core::mem::swap(&mut above, &mut below);
    }
    // As the firmware does; the frames before are to leave nothing to be searched.
    let work = match is_counted {
        true => Work::OF_A_FRAME,
        false => Work::ALL,
    };
    counting_begins();
    let mut measurement = sensor.finish_frame();
    sensor.follow_two_contacts(&mut measurement, work);
    counting_ends();
    Ok(measurement)
}

/// Reads `height` rows of `length` words in turn into `row`, and passes each on.
fn for_each_row(
    source: &mut impl Source,
    row: &mut [u16],
    [length, height]: [usize; 2],
    mut each: impl FnMut(&[u16]),
) -> Result<(), ScriptError> {
    let mut raw = [0; 2 * MAX_ROW_PIXELS];
    let raw = raw
        .get_mut(..2 * length)
        .ok_or(ScriptError::TooWide(length))?;
    for _ in 0..height {
        fill(source, raw)?;
        for (pixel, pair) in row.iter_mut().zip(raw.chunks_exact(2)) {
            *pixel = u16::from_le_bytes([pair[0], pair[1]]);
        }
        each(&row[..length]);
    }
    Ok(())
}

fn features(source: &mut impl Source) -> Result<Features, ScriptError> {
    let mut numbers = [Q::default(); FEATURES];
    for value in &mut numbers {
        *value = Q::from_bits(i64::from_le_bytes(bytes(source)?));
    }
    Ok(Features::from_array(numbers))
}
