//! Golden cases: a script of frames and numbers goes in, a text that says every bit of the results comes out.
//!
//! A script is a sequence of records, each a kind in one byte and what [`Kind`] says, little-endian, until its end.
//! Every result is one line, printed by `Debug`: all numbers are integers, so equal text means equal bits.

use core::fmt::{self, Write};

use hivtac_sensing::features::{FEATURES, Features};
use hivtac_sensing::force::Polar;
use hivtac_sensing::geometry::{Geometry, Preset};
use hivtac_sensing::model::{Model, ModelError};
use hivtac_sensing::network::Network;
use hivtac_sensing::pipeline::{Measurement, Sensor};
use hivtac_sensing::scanner::{MAX_WIDTH, ScanError, ScanSettings, Scanner};
use hivtac_sensing::settings::{Settings, SettingsError};
use hivtac_sensing::threshold::{ByteOrder, HsvBox, ThresholdError, ThresholdTable};
use hivtac_sensing::units::{MicroNewtons, MilliDegrees, Px};

/// Room for a model of 11-512-512-512-3.
pub const MAX_MODEL_BYTES: usize = 600 * 1024;
/// Blobs that a scan keeps.
pub const BLOBS: usize = 64;

/// What a record holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// Length (u32), then the bytes of the model file that later records use.
    Model = 1,
    /// Byte order (u8, 1 is swapped), then a threshold box (6 × u8) for later frames.
    Threshold = 2,
    /// Width, height (u16), dilations, minimum area (u8), then the pixels (u16): blobs.
    Scan = 3,
    /// Width, height, number of frames (u16), then their pixels (u16): the whole pipeline, blobs included.
    Sense = 4,
    /// Eleven features, then eleven of the rest position (i64): network outputs.
    Network = 5,
    /// Three numbers (i32), taken as a force vector in µN and as α, β in m° and |F| in µN.
    Force = 6,
}

impl Kind {
    const ALL: [Kind; 6] = [
        Kind::Model,
        Kind::Threshold,
        Kind::Scan,
        Kind::Sense,
        Kind::Network,
        Kind::Force,
    ];
}

/// Where a script comes from.
pub trait Source {
    /// Fills as much of the buffer as there is, and says how much: less than all only at the end of the script.
    fn read(&mut self, buffer: &mut [u8]) -> usize;
}

impl Source for &[u8] {
    fn read(&mut self, buffer: &mut [u8]) -> usize {
        let length = buffer.len().min(self.len());
        let (head, tail) = self.split_at(length);
        buffer[..length].copy_from_slice(head);
        *self = tail;
        length
    }
}

/// Why a script cannot be run.
#[derive(Debug)]
pub enum ScriptError {
    /// It ends inside a record.
    Cut,
    /// No record begins with this byte.
    UnknownKind(u8),
    /// A frame is wider than the widest row.
    TooWide(u16),
    /// A model needs more room than there is.
    ModelTooLarge(usize),
    /// A record needs a model, and none came before.
    NoModel,
    /// The model is not sound.
    Model(ModelError),
    /// The threshold box means nothing.
    Threshold(ThresholdError),
    /// The frame cannot be scanned.
    Scan(ScanError),
    /// The sensor cannot be set so.
    Settings(SettingsError),
    /// The results could not be written.
    Output(fmt::Error),
}

/// Everything that runs cases. Large: on a microcontroller it lives in a `static`.
pub struct Runner {
    model: [u8; MAX_MODEL_BYTES],
    model_length: usize,
    order: ByteOrder,
    hsv_box: HsvBox,
    table: ThresholdTable,
    scanner: Scanner<BLOBS>,
    cases: u32,
}

impl Runner {
    /// Without a model, and with a threshold that accepts nothing.
    pub const fn new() -> Runner {
        Runner {
            model: [0; MAX_MODEL_BYTES],
            model_length: 0,
            order: ByteOrder::Native,
            hsv_box: HsvBox::RED,
            table: ThresholdTable::closed(),
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
            }
            self.cases += 1;
        }
        Ok(())
    }

    fn load_model(&mut self, source: &mut impl Source) -> Result<(), ScriptError> {
        let length = u32::from_le_bytes(bytes(source)?) as usize;
        let room = self.model.get_mut(..length);
        fill(source, room.ok_or(ScriptError::ModelTooLarge(length))?)?;
        self.model_length = length;
        Ok(())
    }

    fn set_threshold(&mut self, source: &mut impl Source) -> Result<(), ScriptError> {
        let [swapped, values @ ..] = bytes::<7>(source)?;
        self.order = if swapped == 1 {
            ByteOrder::Swapped
        } else {
            ByteOrder::Native
        };
        let [
            hue_low,
            hue_high,
            saturation_low,
            saturation_high,
            value_low,
            value_high,
        ] = values;
        self.hsv_box = HsvBox {
            hue_low,
            hue_high,
            saturation_low,
            saturation_high,
            value_low,
            value_high,
        };
        self.table
            .set(&self.hsv_box, self.order)
            .map_err(ScriptError::Threshold)
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
        };
        self.scanner.begin(settings).map_err(ScriptError::Scan)?;
        let (scanner, table) = (&mut self.scanner, &self.table);
        for_each_row(source, width, height, |row| {
            counting_begins();
            scanner.push_row(table, row);
            counting_ends();
        })?;
        counting_begins();
        let scan = scanner.finish();
        counting_ends();
        say(results, self.cases, format_args!("{scan:?}"))
    }

    fn sense(
        &mut self,
        source: &mut impl Source,
        results: &mut impl Write,
    ) -> Result<(), ScriptError> {
        let (width, height, frames) = (number(source)?, number(source)?, number(source)?);
        let model = self.model()?;
        let mut settings = match &model {
            Some(model) => Settings::of_model(model, self.order),
            None => Settings::usual(Geometry::preset(Preset::Ov7725, width, height), self.order),
        };
        settings.threshold = self.hsv_box;
        let mut sensor = Sensor::<BLOBS>::new();
        sensor
            .configure(settings, model)
            .map_err(ScriptError::Settings)?;
        for _ in 0..frames {
            let measurement = sense_frame(&mut sensor, source, width, height)?;
            say(results, self.cases, format_args!("{measurement:?}"))?;
            say(results, self.cases, format_args!("{:?}", sensor.blobs()))?;
        }
        Ok(())
    }

    fn model(&self) -> Result<Option<Model<'_>>, ScriptError> {
        match &self.model[..self.model_length] {
            [] => Ok(None),
            file => Model::parse(file).map(Some).map_err(ScriptError::Model),
        }
    }

    fn network(
        &mut self,
        source: &mut impl Source,
        results: &mut impl Write,
    ) -> Result<(), ScriptError> {
        let (features, tare) = (features(source)?, features(source)?);
        let model = self.model()?.ok_or(ScriptError::NoModel)?;
        let mut network = Network::new();
        counting_begins();
        let output = network.run(&model, &features, &tare);
        counting_ends();
        say(results, self.cases, format_args!("{output:?}"))
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

impl Default for Runner {
    fn default() -> Self {
        Runner::new()
    }
}

fn say(results: &mut impl Write, case: u32, result: fmt::Arguments<'_>) -> Result<(), ScriptError> {
    writeln!(results, "{case}: {result}").map_err(ScriptError::Output)
}

fn sense_frame(
    sensor: &mut Sensor<'_, BLOBS>,
    source: &mut impl Source,
    width: u16,
    height: u16,
) -> Result<Measurement, ScriptError> {
    counting_begins();
    sensor.begin_frame();
    counting_ends();
    for_each_row(source, width, height, |row| {
        counting_begins();
        sensor.push_row(row);
        counting_ends();
    })?;
    counting_begins();
    let measurement = sensor.finish_frame();
    counting_ends();
    Ok(measurement)
}

fn for_each_row(
    source: &mut impl Source,
    width: u16,
    height: u16,
    mut each: impl FnMut(&[u16]),
) -> Result<(), ScriptError> {
    let mut raw = [0; 2 * MAX_WIDTH as usize];
    let mut row = [0; MAX_WIDTH as usize];
    let raw = raw
        .get_mut(..2 * usize::from(width))
        .ok_or(ScriptError::TooWide(width))?;
    for _ in 0..height {
        fill(source, raw)?;
        for (pixel, pair) in row.iter_mut().zip(raw.chunks_exact(2)) {
            *pixel = u16::from_le_bytes([pair[0], pair[1]]);
        }
        each(&row[..usize::from(width)]);
    }
    Ok(())
}

fn features(source: &mut impl Source) -> Result<Features, ScriptError> {
    let mut numbers = [0; FEATURES];
    for value in &mut numbers {
        *value = i64::from_le_bytes(bytes(source)?);
    }
    let px = |i: usize| Px(numbers[i] as i32);
    Ok(Features {
        centroids: core::array::from_fn(|marker| (px(2 * marker), px(2 * marker + 1))),
        rect_center: (px(8), px(9)),
        rect_area: numbers[10],
    })
}

fn number(source: &mut impl Source) -> Result<u16, ScriptError> {
    Ok(u16::from_le_bytes(bytes(source)?))
}

fn bytes<const N: usize>(source: &mut impl Source) -> Result<[u8; N], ScriptError> {
    let mut bytes = [0; N];
    fill(source, &mut bytes)?;
    Ok(bytes)
}

fn fill(source: &mut impl Source, buffer: &mut [u8]) -> Result<(), ScriptError> {
    if source.read(buffer) == buffer.len() {
        Ok(())
    } else {
        Err(ScriptError::Cut)
    }
}

/// Tells the instruction counter, which knows this function by its name, to count from here on.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn counting_begins() {
    core::hint::black_box(1);
}

/// Tells the instruction counter to count no longer.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn counting_ends() {
    core::hint::black_box(2);
}
