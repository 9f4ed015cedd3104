//! Reads the model file: every check that makes a [`Model`] safe to run is here.

use super::{
    CalibratedRange, Conditions, InputScaling, MAX_LAYERS, Model, ModelError, Origin, OutputKind,
    forward::forward, layers::layers, place::place, reader::Reader, uncertainty::uncertainty,
};
use crate::force::features::{Centroids, FEATURES, Features};
use crate::force::forward::Forward;
use crate::force::layer::Layer;
use crate::force::rest::Rest;
use crc::{CRC_32_ISO_HDLC, Crc};
use hivtac_terms::conditions::{CentroidEstimator, ContactReading};
use hivtac_terms::fixed::Q;
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_terms::list::List;
use hivtac_terms::marker::{LEAST_MARKERS, MOST_MARKERS};
use hivtac_terms::threshold::{PixelFormat, Threshold};
use hivtac_terms::units::{MicroNewtons, Micrometres, MilliDegrees, Px};

/// The first four bytes of a model file.
pub(super) const MAGIC: [u8; 4] = *b"HVTM";
/// The layout of models with forces only.
pub(super) const FORCE_VERSION: u16 = 3;
/// The layout of models with forces and places.
pub(super) const PLACE_VERSION: u16 = 7;
/// The order of the weights: field `packing`.
pub(super) const PACKING: u8 = 1;
/// Contents in addition to the layers: none, or the forward model.
pub(super) const NOTHING_BESIDE: u8 = 0;
pub(super) const FORWARD_BESIDE: u8 = 2;
/// Bytes of the preset's name, padded with zeros.
pub(super) const NAME_LENGTH: usize = 16;
/// The checksum at the end, over all bytes before it: CRC-32 of IEEE 802.3.
pub(super) const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

const LARGEST_SIDE: u16 = 800;
/// Area of the bounding rectangle of four centroids in the largest frame, px².
const LARGEST_RECT: Q<16, i64> = Q::from_int(LARGEST_SIDE as i64 * LARGEST_SIDE as i64);

pub(super) fn parse(bytes: &[u8]) -> Result<Model<'_>, ModelError> {
    let (body, crc, version) = frame(bytes)?;
    let mut reader = Reader {
        bytes: body,
        offset: HEADER_LENGTH,
    };
    let layer_count = reader.u16_in("layer count", 0, MAX_LAYERS as u16, "0 to 8")? as usize;
    let output = output_kind(&mut reader, version)?;
    let has_forward = has_forward(&mut reader, output)?;
    let (conditions, more_markers) = conditions(&mut reader)?;
    let markers = LEAST_MARKERS + more_markers;
    check_layers(layer_count, has_forward, markers)?;
    let rest = rest(&mut reader, markers)?;
    let input = match layer_count {
        0 => InputScaling::default(),
        _ => input_scaling(&mut reader)?,
    };
    let mut range = range(&mut reader)?;
    let mut uncertainty = uncertainty(&mut reader)?;
    if output.tells_place() {
        range.place = place(&mut reader, &mut uncertainty)?;
    }
    // The number of markers follows those of steps and camera.
    let markers_at = reader.offset + 2;
    let forward = match has_forward {
        true => Some(forward(&mut reader)?),
        false => None,
    };
    let is_of_rest = |film: &Forward<'_>| film.tables.dots() == rest.areas.len();
    if !forward.as_ref().is_none_or(is_of_rest) {
        return Err(ModelError::Field {
            name: "markers",
            offset: markers_at,
            allowed: "as many as the rest position has",
        });
    }
    let layers = match layer_count {
        0 => [Layer::default(); MAX_LAYERS],
        _ => layers(&mut reader, layer_count, output.count())?,
    };
    if reader.offset != body.len() {
        let announced = (reader.offset + CRC_LENGTH) as u32;
        return Err(ModelError::Length {
            announced,
            actual: bytes.len(),
        });
    }
    Ok(Model {
        conditions,
        rest,
        input,
        output,
        range,
        uncertainty,
        forward,
        crc,
        layers,
        layer_count,
    })
}

/// Whether there may be this many layers: a network has the eleven features of four markers as its
/// inputs, and without one the film must be run forwards.
fn check_layers(layers: usize, has_forward: bool, markers: usize) -> Result<(), ModelError> {
    let allowed = match (layers, has_forward, markers) {
        (0, true, _) | (1.., _, LEAST_MARKERS) => return Ok(()),
        (0, false, _) => "1 to 8 without a forward model",
        (1.., ..) => "0 with other than four markers",
    };
    Err(ModelError::Field {
        name: "layer count",
        offset: HEADER_LENGTH,
        allowed,
    })
}

/// Magic, version and length.
pub(super) const HEADER_LENGTH: usize = 12;
const CRC_LENGTH: usize = 4;

/// The layout version of a model with these outputs.
#[cfg(any(test, feature = "encode"))]
pub(super) fn version(output: OutputKind) -> u16 {
    match output.tells_place() {
        true => PLACE_VERSION,
        false => FORCE_VERSION,
    }
}

fn output_kind(reader: &mut Reader<'_>, version: u16) -> Result<OutputKind, ModelError> {
    let offset = reader.offset;
    let kinds = [
        OutputKind::ForceVector,
        OutputKind::AnglesMagnitude,
        OutputKind::ForceAndPlace,
    ];
    let kind = reader.choice("output kind", &kinds, "0, 1 or 2")?;
    if kind.tells_place() == (version == PLACE_VERSION) {
        return Ok(kind);
    }
    Err(ModelError::Field {
        name: "output kind",
        offset,
        allowed: "0 or 1 in version 3, 2 in version 7",
    })
}

/// Reads whether the forward model follows the layers.
fn has_forward(reader: &mut Reader<'_>, output: OutputKind) -> Result<bool, ModelError> {
    let offset = reader.offset;
    match reader.u8()? {
        NOTHING_BESIDE => Ok(false),
        FORWARD_BESIDE if output.tells_place() => Ok(true),
        _ => Err(ModelError::Field {
            name: "beside the layers",
            offset,
            allowed: "0, or 2 with the output kind 2 (1, a closed form, is not read: train a \
                      network)",
        }),
    }
}

/// Checks header and checksum. Returns everything before the checksum, the checksum and the
/// version.
fn frame(bytes: &[u8]) -> Result<(&[u8], u32, u16), ModelError> {
    if bytes.len() < MAGIC.len() || bytes[..MAGIC.len()] != MAGIC {
        return Err(ModelError::NotAModel);
    }
    let mut reader = Reader {
        bytes,
        offset: MAGIC.len(),
    };
    let version = reader.u16()?;
    if ![FORCE_VERSION, PLACE_VERSION].contains(&version) {
        return Err(ModelError::Version { found: version });
    }
    let found = reader.u8()?;
    if found != PACKING {
        return Err(ModelError::Packing { found });
    }
    reader.zero("reserved byte")?;
    let announced = reader.u32()?;
    if announced as usize != bytes.len() {
        return Err(ModelError::Length {
            announced,
            actual: bytes.len(),
        });
    }
    let short = ModelError::TooShort {
        offset: bytes.len(),
        length: bytes.len(),
    };
    let (body, end) = bytes.split_last_chunk::<CRC_LENGTH>().ok_or(short)?;
    let stored = u32::from_le_bytes(*end);
    let computed = CRC.checksum(body);
    if stored != computed {
        return Err(ModelError::Crc { stored, computed });
    }
    if body.len() < HEADER_LENGTH {
        return Err(short);
    }
    Ok((body, stored, version))
}

/// Reads the conditions, and the number of markers beyond four.
fn conditions(reader: &mut Reader<'_>) -> Result<(Conditions, usize), ModelError> {
    let (preset, geometry) = (preset(reader)?, geometry(reader)?);
    let threshold_at = reader.offset;
    let limits = reader.array()?;
    let dilations = reader.u8_in("dilations", 3, "0 to 3")?;
    let format = reader.choice("pixel format", &PixelFormat::ALL, "0, 1 or 2")?;
    let conditions = Conditions {
        preset,
        geometry,
        threshold: threshold(format, limits, threshold_at)?,
        dilations,
        centroid: reader.choice(
            "centroid estimator",
            &[
                CentroidEstimator::BinaryMask,
                CentroidEstimator::RednessWeighted,
            ],
            "0 or 1",
        )?,
        contact: reader.choice(
            "contact reading",
            &[
                ContactReading::Force,
                ContactReading::Stick,
                ContactReading::Slip,
            ],
            "0, 1 or 2",
        )?,
        origin: Origin::Simulated,
    };
    let (origin, more_markers) = origin(reader)?;
    Ok((
        Conditions {
            origin,
            ..conditions
        },
        more_markers,
    ))
}

fn geometry(reader: &mut Reader<'_>) -> Result<Geometry, ModelError> {
    let offset = reader.offset;
    let geometry = Geometry {
        width: reader.u16_in("width", 1, LARGEST_SIDE, "1 to 800")?,
        height: reader.u16_in("height", 1, LARGEST_SIDE, "1 to 800")?,
        focal: Px(reader.positive("focal length")?),
        marker_diameter: Micrometres(reader.u32()?),
        marker_radius: Micrometres(reader.u32()?),
        film_distance: Micrometres(reader.u32()?),
    };
    let allowed =
        "of measures of 1 to 1000000 µm, and a marker no wider than its distance from the axis";
    let wrong = ModelError::Field {
        name: "geometry",
        offset,
        allowed,
    };
    if geometry.is_sound() {
        Ok(geometry)
    } else {
        Err(wrong)
    }
}

fn preset(reader: &mut Reader<'_>) -> Result<Preset, ModelError> {
    let offset = reader.offset;
    let field: [u8; NAME_LENGTH] = reader.array()?;
    Preset::ALL
        .into_iter()
        .find(|preset| padded_name(*preset) == field)
        .ok_or(ModelError::Field {
            name: "preset name",
            offset,
            allowed: "`paper`, `ov7725` or `mt9v034`",
        })
}

/// A preset's name as stored in the file.
pub(super) fn padded_name(preset: Preset) -> [u8; NAME_LENGTH] {
    let mut padded = [0; NAME_LENGTH];
    let name = preset.name().as_bytes();
    padded[..name.len()].copy_from_slice(name);
    padded
}

fn threshold(format: PixelFormat, limits: [u8; 6], offset: usize) -> Result<Threshold, ModelError> {
    let allowed = match format {
        PixelFormat::Rgb565 => {
            "hues of 0 to 179, and no lowest saturation or value above the highest"
        }
        PixelFormat::Yuv422 => "a lowest Cr and five zeros",
        PixelFormat::Mono => "a lowest luma not above the highest, and four zeros",
    };
    let wrong = ModelError::Field {
        name: "threshold",
        offset,
        allowed,
    };
    Threshold::of_limits(format, limits).map_err(|_| wrong)
}

/// Reads the origin, and the number of markers beyond four.
fn origin(reader: &mut Reader<'_>) -> Result<(Origin, usize), ModelError> {
    let is_unit = reader.choice("origin", &[false, true], "0 or 1")?;
    let most = (MOST_MARKERS - LEAST_MARKERS) as u8;
    let more_markers = usize::from(reader.u8_in("markers beyond four", most, "0 to 12")?);
    let offset = reader.offset;
    let unit: [u8; 12] = reader.array()?;
    match (is_unit, unit) {
        (true, unit) => Ok((Origin::Unit(unit), more_markers)),
        (false, [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]) => Ok((Origin::Simulated, more_markers)),
        _ => Err(ModelError::Field {
            name: "unit id",
            offset,
            allowed: "zero when simulated",
        }),
    }
}

fn rest(reader: &mut Reader<'_>, markers: usize) -> Result<Rest, ModelError> {
    let offset = reader.offset;
    let features = features(reader, markers)?;
    let mut areas = List::defaults(markers);
    for area in areas.iter_mut() {
        *area = reader.u32()?;
    }
    let rest = Rest { features, areas };
    let allowed = "centroids of 0 to 800 px and areas of 1 to 640000 px";
    let wrong = ModelError::Field {
        name: "rest position",
        offset,
        allowed,
    };
    if rest.is_sound() {
        Ok(rest)
    } else {
        Err(wrong)
    }
}

fn features(reader: &mut Reader<'_>, markers: usize) -> Result<Features, ModelError> {
    let mut centroids = Centroids::defaults(markers);
    for at in centroids.iter_mut() {
        *at = point(reader)?;
    }
    let rect_center = point(reader)?;
    let offset = reader.offset;
    let rect_area = Q::from_bits(i64::from_le_bytes(reader.array()?));
    if !(Q::from_bits(0)..=LARGEST_RECT).contains(&rect_area) {
        let allowed = "0 to 640000 px² in Q16.16";
        return Err(ModelError::Field {
            name: "rectangle area",
            offset,
            allowed,
        });
    }
    Ok(Features {
        centroids,
        rect_center,
        rect_area,
    })
}

fn point(reader: &mut Reader<'_>) -> Result<(Px, Px), ModelError> {
    Ok((Px(reader.u32()? as i32), Px(reader.u32()? as i32)))
}

fn input_scaling(reader: &mut Reader<'_>) -> Result<InputScaling, ModelError> {
    let mean = features(reader, LEAST_MARKERS)?;
    let mut multipliers = [0; FEATURES];
    for multiplier in &mut multipliers {
        let offset = reader.offset;
        *multiplier = reader.u32()?;
        if !(1..1 << 24).contains(multiplier) {
            let allowed = "1 to 16777215";
            return Err(ModelError::Field {
                name: "input multiplier",
                offset,
                allowed,
            });
        }
    }
    let mut shifts = [0; FEATURES];
    for shift in &mut shifts {
        let offset = reader.offset;
        *shift = reader.u8()?;
        if !(1..=62).contains(shift) {
            return Err(ModelError::Field {
                name: "input shift",
                offset,
                allowed: "1 to 62",
            });
        }
    }
    reader.zero("reserved byte")?;
    Ok(InputScaling {
        mean,
        multipliers,
        shifts,
    })
}

fn range(reader: &mut Reader<'_>) -> Result<CalibratedRange, ModelError> {
    Ok(CalibratedRange {
        magnitude: MicroNewtons(reader.positive("largest force")?),
        alpha: MilliDegrees(reader.i32_in("largest alpha", 90_000, "0 to 90000")?),
        beta: MilliDegrees(reader.i32_in("largest beta", 90_000, "0 to 90000")?),
        place: Micrometres(0),
    })
}
