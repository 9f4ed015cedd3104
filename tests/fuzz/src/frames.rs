//! Attacks with frames of any pixels under any settings. The measurement does not depend on how the
//! rows arrive, and a missing force has a reason.

use arbitrary::{Result, Unstructured};
use hivtac_sensor::force::forward::Drift;
use hivtac_sensor::force::model::{AlignedFile, Model};
use hivtac_sensor::markers::lost::Lost;
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::motion::Motion;
use hivtac_sensor::pipeline::{Measurement, Sensor};
use hivtac_sensor::tare::TareBuilder;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_terms::status::Status;
use hivtac_terms::threshold::{ByteOrder, PixelFormat, Threshold};
use hivtac_terms::units::{Micrometres, Px};

static DEFAULT: &AlignedFile<[u8]> =
    &AlignedFile(*include_bytes!("../../../calibration/models/default.hvtm"));

/// The largest number of frames of one attack.
const FRAMES: usize = 3;

/// A way of passing the rows of a frame to a sensor.
type Way = fn(&mut Sensor<'_>, &[u16], &mut Unstructured<'_>) -> Result<()>;

/// A painted disc: column, row, radius (px), and the value of its pixels.
type Disc = (u16, u16, u8, u16);

/// Measures the frames that the input paints, under the settings that the input describes.
pub fn attack(input: &[u8]) -> bool {
    let mut input = Unstructured::new(input);
    // The end of the input ends the attack.
    attack_with(&mut input).unwrap_or(false)
}

fn attack_with(input: &mut Unstructured<'_>) -> Result<bool> {
    let model = Model::parse(&DEFAULT.0).ok();
    let usual: bool = input.arbitrary()?;
    let settings = match &model {
        Some(model) if usual => model.conditions.settings(ByteOrder::Native),
        _ => any_settings(input)?,
    };
    let mut sensor = Box::new(Sensor::<64>::new());
    if let Err(error) = sensor.configure(settings, model) {
        assert!(!error.to_string().is_empty());
        return Ok(false);
    }
    if input.arbitrary()? {
        sensor.set_motion(Motion::rolling(input.arbitrary()?));
    }
    let mut reached = false;
    for _ in 0..FRAMES {
        let frame = paint(&settings, input)?;
        reached |= measure(&mut sensor, &frame, input)?;
    }
    Ok(reached)
}

fn any_settings(input: &mut Unstructured<'_>) -> Result<Settings> {
    let preset = *input.choose(&Preset::ALL)?;
    let side = |input: &mut Unstructured<'_>| match input.ratio(15, 16)? {
        true => input.int_in_range(1..=96),
        false => input.arbitrary(),
    };
    let (width, height) = (side(input)?, side(input)?);
    // A preset is defined only for valid frame sizes.
    let mut geometry = Geometry::preset(preset, width.min(800), height.min(800));
    (geometry.width, geometry.height) = (width, height);
    if input.ratio(1, 4)? {
        geometry.focal = Px(input.arbitrary()?);
        geometry.marker_diameter = Micrometres(input.arbitrary()?);
        geometry.marker_radius = Micrometres(input.arbitrary()?);
        geometry.film_distance = Micrometres(input.arbitrary()?);
    }
    let format = *input.choose(&PixelFormat::ALL)?;
    let limits = Threshold::of_limits(format, input.arbitrary()?);
    Ok(Settings {
        geometry,
        threshold: limits.unwrap_or(Threshold::red(format)),
        byte_order: *input.choose(&[ByteOrder::Native, ByteOrder::Swapped])?,
        dilations: input.int_in_range(0..=4)?,
        min_area: input.int_in_range(0..=64)?,
        centroid: *input.choose(&[
            CentroidEstimator::BinaryMask,
            CentroidEstimator::RednessWeighted,
        ])?,
    })
}

/// Returns a frame of one colour with some discs in it, and noise at its beginning. Sometimes its
/// length is wrong.
fn paint(settings: &Settings, input: &mut Unstructured<'_>) -> Result<Vec<u16>> {
    let Geometry { width, height, .. } = settings.geometry;
    let columns = settings.threshold.format().row_length(width);
    let mut frame = vec![input.arbitrary::<u16>()?; columns * usize::from(height)];
    for _ in 0..input.int_in_range(0..=6)? {
        disc(&mut frame, columns, input.arbitrary()?);
    }
    let noise = input.arbitrary::<u8>()?.into();
    for pixel in frame.iter_mut().take(noise) {
        *pixel = input.arbitrary()?;
    }
    if input.ratio(1, 32)? {
        frame.resize(input.int_in_range(0..=frame.len() + columns)?, 0);
    }
    Ok(frame)
}

fn disc(frame: &mut [u16], columns: usize, (x, y, radius, pixel): Disc) {
    let radius = i32::from(radius % 32);
    let rows = frame.len() / columns;
    let (x, y) = (usize::from(x) % columns, usize::from(y) % rows.max(1));
    for (row, line) in frame.chunks_exact_mut(columns).enumerate() {
        for (column, place) in line.iter_mut().enumerate() {
            let (dx, dy) = (column as i32 - x as i32, row as i32 - y as i32);
            if dx * dx + dy * dy <= radius * radius {
                *place = pixel;
            }
        }
    }
}

/// Measures a frame as a whole and by another way of passing its rows. Then takes it as a rest
/// position and measures it against that. Returns whether there were markers.
fn measure(sensor: &mut Sensor<'_>, frame: &[u16], input: &mut Unstructured<'_>) -> Result<bool> {
    let mut other = Box::new(sensor.clone());
    let whole = sensor.measure_frame(frame);
    is_sound(sensor, &whole);
    let way = *input.choose::<Way>(&[row_by_row, in_bands, in_bands_below])?;
    other.begin_frame();
    way(&mut other, frame, input)?;
    assert_eq!(other.finish_frame(), whole);
    // The weight of the last blobs in an incomplete frame depends on which of its pixels are still
    // there.
    if !whole.status.intersects(Status::FRAME_INCOMPLETE) {
        assert_eq!(other.blobs(), sensor.blobs());
    }
    if let Some(mut tare) = TareBuilder::new(1)
        && let Some(Ok(rest)) = sensor.tare_with(&mut tare, &whole)
    {
        sensor.set_tare(Some(rest), Drift::NONE);
        let measurement = sensor.measure_frame(frame);
        is_sound(sensor, &measurement);
    }
    Ok(whole.markers.is_some())
}

fn columns(sensor: &Sensor<'_>) -> usize {
    let format = sensor.threshold().format();
    format.row_length(sensor.settings().geometry.width)
}

fn row_by_row(sensor: &mut Sensor<'_>, frame: &[u16], _: &mut Unstructured<'_>) -> Result<()> {
    let columns = columns(sensor);
    frame.chunks(columns).for_each(|row| sensor.push_row(row));
    Ok(())
}

fn in_bands(sensor: &mut Sensor<'_>, frame: &[u16], input: &mut Unstructured<'_>) -> Result<()> {
    let rows: usize = input.int_in_range(1..=17)?;
    let band = rows * columns(sensor);
    frame.chunks(band).for_each(|rows| sensor.push_rows(rows));
    Ok(())
}

fn in_bands_below(
    sensor: &mut Sensor<'_>,
    frame: &[u16],
    input: &mut Unstructured<'_>,
) -> Result<()> {
    let rows: usize = input.int_in_range(1..=17)?;
    let band = rows * columns(sensor);
    for begin in (0..frame.len()).step_by(band) {
        let (above, below) = frame.split_at(begin);
        sensor.push_rows_below(above, &below[..band.min(below.len())]);
    }
    Ok(())
}

fn is_sound(sensor: &Sensor<'_>, measurement: &Measurement) {
    let Measurement {
        status,
        markers,
        lost,
        features,
        force,
        contacts,
    } = measurement;
    assert!(contacts.is_empty() || force.is_some());
    assert_eq!(force.is_none(), status.intersects(Status::NO_FORCE));
    let is_whole = markers.is_some() && *lost == Lost::NONE;
    assert_eq!(is_whole, features.is_some());
    let least = sensor.settings().min_area;
    assert!(sensor.blobs().iter().all(|blob| blob.area >= least));
}
