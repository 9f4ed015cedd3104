//! Measures the four markers in a frame: their edges, colours and pattern.

use super::rim::{Edge, Field, edge};
use crate::frame::Frame;
use crate::look;
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::pipeline::Sensor;
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_terms::marker as terms;
use hivtac_terms::threshold::{ByteOrder, PixelFormat, Threshold};
use hivtac_terms::units::Px;
use hivtac_wire::message::DeviceHello;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// A marker's colour is that of the pixels within this part of its radius.
const CORE: f64 = 0.5;
/// The film's colour around a marker is that of the pixels between these distances, in radii.
const AROUND: [f64; 2] = [1.6, 2.0];

/// One marker.
#[derive(Clone, Copy, Debug)]
pub struct Marker {
    /// Its rim and diameter; `None` if it has no edge.
    pub edge: Option<Edge>,
    /// Diameter that the optics give a marker at this place, px.
    pub expected_px: f64,
    /// Its mean colour: red, green, blue, of 255.
    pub colour: [f64; 3],
    /// The mean colour of the film around it, of 255.
    pub film: [f64; 3],
}

/// Four markers, from the upper left clockwise.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Each.
    pub markers: [Marker; 4],
    /// Shift of the markers' mean from the picture's middle, to the right and down, px.
    pub shift_px: [f64; 2],
    /// Turn of the pattern, from x towards y, degrees, −45 to 45.
    pub turn_deg: f64,
    /// Mean distance of the markers from their mean, relative to the geometry's at rest.
    pub size: f64,
}

/// Why four markers cannot be seen in a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct NotSeen {
    /// Number of blobs of the markers' colour.
    pub blobs: usize,
    /// Names of the sensing's status bits.
    pub status: Vec<&'static str>,
}

/// Measures the markers in a frame of this device.
///
/// # Errors
/// When there are not four blobs around the picture's middle.
pub fn look(frame: &Frame, device: &DeviceHello) -> Result<Seen, NotSeen> {
    let geometry = geometry(frame, device);
    let spots = spots(frame, device, geometry)?;
    let colours = look::levels(frame);
    let field = Field::new(frame.width, contrast(frame.format(), &colours));
    let middle = mean(spots.map(|spot| spot.centre));
    let away = |spot: &Spot| (spot.centre[0] - middle[0]).hypot(spot.centre[1] - middle[1]);
    let distance = spots.iter().map(away).sum::<f64>() / 4.0;
    let markers = spots.map(|spot| Marker {
        edge: edge(&field, spot.centre, spot.radius),
        expected_px: expected_px(&geometry, away(&spot)),
        colour: mean_colour(&colours, frame.width, &spot, [0.0, CORE]),
        film: mean_colour(&colours, frame.width, &spot, AROUND),
    });
    let (x, y) = geometry.center();
    Ok(Seen {
        markers,
        shift_px: [middle[0] - x.to_f64(), middle[1] - y.to_f64()],
        turn_deg: turn(&spots, middle).to_degrees(),
        size: distance / geometry.rest_distance().to_f64(),
    })
}

/// The device's lens at this frame's size; the usual lens if its name is unknown.
fn geometry(frame: &Frame, device: &DeviceHello) -> Geometry {
    let preset = Preset::from_name(&device.preset).unwrap_or(Preset::Ov7725);
    Geometry::preset(preset, frame.width, frame.height)
}

/// A blob as a disc, px.
#[derive(Clone, Copy, Debug)]
pub struct Spot {
    /// Its centre, (x, y).
    pub centre: [f64; 2],
    /// Radius of a disc with the blob's area.
    pub radius: f64,
}

impl Spot {
    fn new(x: Px, y: Px, area: u32) -> Spot {
        Spot {
            centre: [x.to_f64(), y.to_f64()],
            radius: (f64::from(area) / PI).sqrt(),
        }
    }
}

/// The markers as the sensing finds them, or else the four largest blobs if they lie around their
/// own middle. The latter serve for a picture that must be corrected.
fn spots(frame: &Frame, device: &DeviceHello, geometry: Geometry) -> Result<[Spot; 4], NotSeen> {
    let mut sensor = Box::default();
    let not_seen = match sensed(&mut sensor, frame, device, geometry, frame.threshold) {
        Ok(spots) => return Ok(spots),
        Err(not_seen) => not_seen,
    };
    let mut blobs: Vec<_> = sensor.blobs().iter().take(not_seen.blobs).collect();
    blobs.sort_by_key(|blob| std::cmp::Reverse(blob.area));
    let largest = blobs.iter().take(4).map(|blob| {
        let (x, y) = blob.centroid();
        Spot::new(x, y, blob.area)
    });
    let four: Result<[Spot; 4], _> = largest.collect::<Vec<_>>().try_into();
    four.ok().and_then(clockwise).ok_or(not_seen)
}

/// The markers as the sensing finds them with a threshold of the frame's format.
///
/// # Errors
/// When the sensing does not find four markers.
pub fn found_by_sensing(
    frame: &Frame,
    device: &DeviceHello,
    threshold: Threshold,
) -> Result<[Spot; 4], NotSeen> {
    let geometry = geometry(frame, device);
    sensed(&mut Box::default(), frame, device, geometry, threshold)
}

fn sensed(
    sensor: &mut Sensor<64>,
    frame: &Frame,
    device: &DeviceHello,
    geometry: Geometry,
    threshold: Threshold,
) -> Result<[Spot; 4], NotSeen> {
    let settings = Settings {
        threshold,
        dilations: device.dilations,
        centroid: device.centroid,
        ..Settings::usual(geometry, ByteOrder::Native)
    };
    if sensor.configure(settings, None).is_err() {
        return Err(NotSeen {
            blobs: 0,
            status: Vec::new(),
        });
    }
    let measurement = sensor.measure_frame(&frame.pixels());
    let spot = |marker: terms::Marker| Spot::new(marker.x, marker.y, marker.area);
    let markers = measurement.markers.and_then(|markers| markers.exactly());
    let markers = markers.map(|four| four.map(spot));
    markers.ok_or_else(|| NotSeen {
        blobs: sensor.blobs().len(),
        status: measurement.status.names().collect(),
    })
}

/// The spots from the upper left clockwise; `None` unless one is on each side of their middle.
fn clockwise(mut spots: [Spot; 4]) -> Option<[Spot; 4]> {
    let middle = mean(spots.map(|spot| spot.centre));
    spots.sort_by(|one, other| angle(one, middle).total_cmp(&angle(other, middle)));
    let step = |i: usize| {
        let to = angle(&spots[(i + 1) % 4], middle);
        (to - angle(&spots[i], middle)).rem_euclid(4.0 * FRAC_PI_2)
    };
    let even = (0..4).all(|i| (FRAC_PI_4..3.0 * FRAC_PI_4).contains(&step(i)));
    even.then_some(spots)
}

/// Angle of a spot around the middle, from x towards y.
fn angle(spot: &Spot, middle: [f64; 2]) -> f64 {
    (spot.centre[1] - middle[1]).atan2(spot.centre[0] - middle[0])
}

/// The mean angle of the spots from their diagonals.
fn turn(spots: &[Spot; 4], middle: [f64; 2]) -> f64 {
    let off = |spot: &Spot| angle(spot, middle).rem_euclid(FRAC_PI_2) - FRAC_PI_4;
    spots.iter().map(off).sum::<f64>() / 4.0
}

/// Diameter that the optics give a marker at a distance from the middle, px.
fn expected_px(geometry: &Geometry, distance: f64) -> f64 {
    let distance = Px((distance * 65_536.0) as i32);
    let [across, along] = [geometry.across(distance), geometry.along_flat(distance)];
    (across.to_f64() * along.to_f64()).sqrt()
}

fn mean(points: [[f64; 2]; 4]) -> [f64; 2] {
    [0, 1].map(|i| points.iter().map(|point| point[i]).sum::<f64>() / 4.0)
}

/// The quantity that distinguishes a marker from the film, proportional to light: Cr for red
/// markers, luma for others.
fn contrast(format: PixelFormat, colours: &[u8]) -> Vec<f64> {
    let weights = match format {
        PixelFormat::Rgb565 | PixelFormat::Yuv422 => [0.5, -0.419, -0.081],
        PixelFormat::Mono => [1.0, 0.0, 0.0],
    };
    let pixels = colours.chunks_exact(3);
    pixels
        .map(|pixel| {
            pixel
                .iter()
                .zip(weights)
                .map(|(level, weight)| f64::from(*level) * weight)
        })
        .map(Iterator::sum)
        .collect()
}

/// Mean colour of the pixels between two distances from a spot's centre, in radii.
fn mean_colour(colours: &[u8], width: u16, spot: &Spot, [from, to]: [f64; 2]) -> [f64; 3] {
    let inside = |index: usize| {
        let (x, y) = (index % usize::from(width), index / usize::from(width));
        let distance = (x as f64 - spot.centre[0]).hypot(y as f64 - spot.centre[1]);
        (from * spot.radius..=to * spot.radius).contains(&distance)
    };
    let pixels = colours.chunks_exact(3).enumerate();
    let near: Vec<_> = pixels.filter(|(index, _)| inside(*index)).collect();
    let sum = |channel: usize| {
        near.iter()
            .map(|(_, pixel)| f64::from(pixel[channel]))
            .sum::<f64>()
    };
    [0, 1, 2].map(|channel| sum(channel) / near.len().max(1) as f64)
}
