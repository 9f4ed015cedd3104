//! Measures the markers in a frame: their edges, colours and pattern.

use super::dots::Dots;
use super::rim::{Edge, Field, edge};
use crate::frame::Frame;
use crate::look;
use hivtac_sensor::force::forward::Drift;
use hivtac_sensor::markers::lost::Lost;
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::pipeline::Sensor;
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_terms::marker as terms;
use hivtac_terms::threshold::{ByteOrder, PixelFormat, Threshold};
use hivtac_terms::units::{Micrometres, Px};
use hivtac_wire::message::DeviceHello;
use std::f64::consts::PI;

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

/// All markers, by identity.
#[derive(Clone, Debug)]
pub struct Seen {
    /// Each.
    pub markers: Vec<Marker>,
    /// Shift of the markers' mean from the picture's middle, to the right and down, px.
    pub shift_px: [f64; 2],
    /// Turn of the pattern, from x towards y, degrees.
    pub turn_deg: f64,
    /// Mean distance of the markers from their mean, relative to the geometry's at rest.
    pub size: f64,
}

/// Why the markers cannot be seen in a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct NotSeen {
    /// The dots that should be.
    pub dots: Dots,
    /// Number of blobs of the markers' colour.
    pub blobs: usize,
    /// Names of the sensing's status bits.
    pub status: Vec<&'static str>,
}

/// Measures the markers of these dots in a frame of this device.
///
/// # Errors
/// When there are not as many blobs, placed as the dots.
pub fn look(frame: &Frame, device: &DeviceHello, dots: Dots) -> Result<Seen, NotSeen> {
    let geometry = geometry(frame, device);
    let spots = spots(frame, device, dots, geometry)?;
    let colours = look::levels(frame);
    let field = Field::new(frame.width, contrast(frame.format(), &colours));
    let middle = middle(&spots);
    let off: Vec<[f64; 2]> = spots
        .iter()
        .map(|spot| [0, 1].map(|i| spot.centre[i] - middle[i]))
        .collect();
    let far_mm = dots
        .centres_mm(&geometry)
        .into_iter()
        .map(|[x, y]| x.hypot(y));
    let seen = spots.iter().zip(&off).zip(far_mm);
    let markers = seen.map(|((spot, [x, y]), far_mm)| Marker {
        edge: edge(&field, spot.centre, spot.radius),
        expected_px: expected_px(&geometry, x.hypot(*y), far_mm),
        colour: mean_colour(&colours, frame.width, spot, [0.0, CORE]),
        film: mean_colour(&colours, frame.width, spot, AROUND),
    });
    let (x, y) = geometry.center();
    let nominal = dots.seen_px(&geometry);
    let distance = |places: &[[f64; 2]]| places.iter().map(|[x, y]| x.hypot(*y)).sum::<f64>();
    Ok(Seen {
        markers: markers.collect(),
        shift_px: [middle[0] - x.to_f64(), middle[1] - y.to_f64()],
        turn_deg: turn(&nominal, &off).to_degrees(),
        size: distance(&off) / distance(&nominal),
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

/// The markers as the sensing finds them, or else the largest blobs if they lie as the dots. The
/// latter serve for a picture that must be corrected.
fn spots(
    frame: &Frame,
    device: &DeviceHello,
    dots: Dots,
    geometry: Geometry,
) -> Result<Vec<Spot>, NotSeen> {
    let mut sensor = Box::default();
    let not_seen = match sensed(
        &mut sensor,
        frame,
        device,
        (dots, geometry),
        frame.threshold,
    ) {
        Ok(spots) => return Ok(spots),
        Err(not_seen) => not_seen,
    };
    let mut blobs: Vec<_> = sensor.blobs().iter().take(not_seen.blobs).collect();
    blobs.sort_by_key(|blob| std::cmp::Reverse(blob.area));
    let largest = blobs.iter().take(dots.count()).map(|blob| {
        let (x, y) = blob.centroid();
        Spot::new(x, y, blob.area)
    });
    matched(&largest.collect::<Vec<_>>(), &dots.seen_px(&geometry)).ok_or(not_seen)
}

/// The markers as the sensing finds them with a threshold of the frame's format.
///
/// # Errors
/// When the sensing does not find all of them.
pub fn found_by_sensing(
    frame: &Frame,
    device: &DeviceHello,
    dots: Dots,
    threshold: Threshold,
) -> Result<Vec<Spot>, NotSeen> {
    let geometry = geometry(frame, device);
    sensed(
        &mut Box::default(),
        frame,
        device,
        (dots, geometry),
        threshold,
    )
}

fn sensed(
    sensor: &mut Sensor<64>,
    frame: &Frame,
    device: &DeviceHello,
    (dots, geometry): (Dots, Geometry),
    threshold: Threshold,
) -> Result<Vec<Spot>, NotSeen> {
    let settings = Settings {
        threshold,
        dilations: device.dilations,
        centroid: device.centroid,
        ..Settings::usual(geometry, ByteOrder::Native)
    };
    if sensor.configure(settings, None).is_err() {
        return Err(NotSeen {
            dots,
            blobs: 0,
            status: Vec::new(),
        });
    }
    sensor.set_tare(dots.rest(&geometry), Drift::NONE);
    let measurement = sensor.measure_frame(&frame.pixels());
    let spot = |marker: terms::Marker| Spot::new(marker.x, marker.y, marker.area);
    let whole = measurement.lost == Lost::NONE;
    let markers = measurement
        .markers
        .filter(|markers| whole && markers.len() == dots.count());
    let markers = markers.map(|markers| markers.into_iter().map(spot).collect());
    markers.ok_or_else(|| NotSeen {
        dots,
        blobs: sensor.blobs().len(),
        status: measurement.status.names().collect(),
    })
}

/// The spots in the order of the dots' nominal places around their middle; `None` unless there are
/// as many, and each is nearest to a place of its own.
fn matched(spots: &[Spot], nominal: &[[f64; 2]]) -> Option<Vec<Spot>> {
    let middle = middle(spots);
    let mut all = vec![None; nominal.len()];
    for spot in spots {
        let far = |[x, y]: &[f64; 2]| {
            (spot.centre[0] - middle[0] - x).hypot(spot.centre[1] - middle[1] - y)
        };
        let places = nominal.iter().enumerate();
        let (nearest, _) = places.min_by(|(_, a), (_, b)| far(a).total_cmp(&far(b)))?;
        if all[nearest].replace(*spot).is_some() {
            return None;
        }
    }
    all.into_iter().collect()
}

/// The turn of places around their middle from the nominal ones, by least squares, rad.
fn turn(nominal: &[[f64; 2]], places: &[[f64; 2]]) -> f64 {
    let both = nominal.iter().zip(places);
    let [along, across] = both.fold([0.0; 2], |[along, across], ([a, b], [x, y])| {
        [along + a * x + b * y, across + a * y - b * x]
    });
    across.atan2(along)
}

/// Diameter that the optics give a marker at a distance from the middle, px, that is this far from
/// the film's middle, mm.
fn expected_px(geometry: &Geometry, distance: f64, far_mm: f64) -> f64 {
    let geometry = Geometry {
        marker_radius: Micrometres((1e3 * far_mm).round() as u32),
        ..*geometry
    };
    let distance = Px((distance * 65_536.0) as i32);
    let [across, along] = [geometry.across(distance), geometry.along_flat(distance)];
    (across.to_f64() * along.to_f64()).sqrt()
}

/// The mean of the spots' centres.
fn middle(spots: &[Spot]) -> [f64; 2] {
    let count = spots.len() as f64;
    [0, 1].map(|i| spots.iter().map(|spot| spot.centre[i]).sum::<f64>() / count)
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
