//! Draws pictures of discs for tests, without light or noise, so that assertions can be exact.

use crate::force::forward::Drift;
use crate::force::model::Model;
use crate::force::rest::Rest;
use crate::markers::settings::Settings;
use crate::pipeline::{Measurement, Sensor};
use crate::tare::TareBuilder;
use hivtac_terms::geometry::Geometry;
use hivtac_terms::marker::Marker;
use hivtac_terms::threshold::ByteOrder;
use std::{boxed::Box, vec, vec::Vec};

/// A pixel that passes the default threshold.
pub const RED: u16 = 0xD8A3;
/// A pixel that does not.
pub const GREY: u16 = 0x8410;
/// Width that soft edges add to a marker's diameter, px.
const SOFT_EDGE: f64 = 0.8;

/// Rows of pixels.
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<u16>,
}

/// The places and the look of the markers.
#[derive(Clone, Copy, Debug)]
pub struct Pattern {
    pub geometry: Geometry,
    /// Shift of the pattern's centre from the picture's, px.
    pub shift: (f64, f64),
    /// Distance from the centre relative to rest.
    pub scale: f64,
    /// Turn, degrees, x towards y.
    pub turn: f64,
    /// Tilt of the film, degrees: foreshortens the markers along the radius.
    pub tilt: f64,
    /// Displacement of each marker, px.
    pub displaced: [(f64, f64); 4],
    /// Change of each diameter, px.
    pub swollen: f64,
}

impl Picture {
    pub fn new(geometry: &Geometry) -> Picture {
        let (width, height) = (usize::from(geometry.width), usize::from(geometry.height));
        Picture {
            width,
            height,
            pixels: vec![GREY; width * height],
        }
    }

    /// Paints every pixel whose centre is `inside`.
    pub fn paint(&mut self, color: u16, inside: impl Fn(f64, f64) -> bool) {
        let middle = (self.width as f64 / 2.0, self.height as f64 / 2.0);
        self.paint_near(color, middle, self.width.max(self.height) as f64, inside);
    }

    /// The same, limited to `reach` px around a point along x and y.
    pub fn paint_near(
        &mut self,
        color: u16,
        (x, y): (f64, f64),
        reach: f64,
        inside: impl Fn(f64, f64) -> bool,
    ) {
        let span = |middle: f64, end: usize| {
            let clip = |value: f64| value.clamp(0.0, end as f64) as usize;
            clip(middle - reach)..clip(middle + reach + 1.0)
        };
        for row in span(y, self.height) {
            for column in span(x, self.width) {
                if inside(column as f64, row as f64) {
                    self.pixels[row * self.width + column] = color;
                }
            }
        }
    }

    pub fn disc(&mut self, color: u16, (x, y): (f64, f64), diameter: f64) {
        self.paint_near(color, (x, y), diameter, |px, py| {
            (px - x).hypot(py - y) <= diameter / 2.0
        });
    }

    /// Measures the picture with a sensor.
    pub fn feed(&self, sensor: &mut Sensor<'_>) -> Measurement {
        sensor.begin_frame();
        self.pixels
            .chunks(self.width)
            .for_each(|row| sensor.push_row(row));
        sensor.finish_frame()
    }
}

impl Pattern {
    pub fn at_rest(geometry: Geometry) -> Pattern {
        Pattern {
            geometry,
            shift: (0.0, 0.0),
            scale: 1.0,
            turn: 0.0,
            tilt: 0.0,
            displaced: [(0.0, 0.0); 4],
            swollen: 0.0,
        }
    }

    fn distance(&self) -> f64 {
        self.geometry.rest_distance().to_f64() * self.scale
    }

    /// Direction of a marker from the centre, rad.
    fn direction(&self, identity: usize) -> f64 {
        (self.turn + [-135.0, -45.0, 45.0, 135.0][identity]).to_radians()
    }

    pub fn center_of(&self, identity: usize) -> (f64, f64) {
        let (center_x, center_y) = self.geometry.center();
        let (sin, cos) = self.direction(identity).sin_cos();
        let (dx, dy) = self.displaced[identity];
        (
            center_x.to_f64() + self.shift.0 + self.distance() * cos + dx,
            center_y.to_f64() + self.shift.1 + self.distance() * sin + dy,
        )
    }

    /// Diameters across and along the radius.
    pub fn diameters(&self) -> (f64, f64) {
        let part =
            f64::from(self.geometry.marker_diameter.0) / f64::from(self.geometry.marker_radius.0);
        let across = self.distance() * part;
        let theta = self.distance() / self.geometry.focal.to_f64();
        let along = across * theta.sin() * (theta + self.tilt.to_radians()).cos() / theta;
        (
            across + SOFT_EDGE + self.swollen,
            along + SOFT_EDGE + self.swollen,
        )
    }

    pub fn draw_marker(&self, picture: &mut Picture, identity: usize) {
        let (x, y) = self.center_of(identity);
        let (across, along) = self.diameters();
        let (sin, cos) = self.direction(identity).sin_cos();
        picture.paint_near(RED, (x, y), across, |px, py| {
            let (dx, dy) = (px - x, py - y);
            let (u, v) = (dx * cos + dy * sin, dy * cos - dx * sin);
            (2.0 * u / along).hypot(2.0 * v / across) <= 1.0
        });
    }

    pub fn draw(&self) -> Picture {
        let mut picture = Picture::new(&self.geometry);
        (0..4).for_each(|identity| self.draw_marker(&mut picture, identity));
        picture
    }

    /// The largest distance of a found marker from its drawn place, px.
    pub fn error(&self, markers: &[Marker]) -> f64 {
        let errors = markers.iter().enumerate().map(|(identity, marker)| {
            let (x, y) = self.center_of(identity);
            (marker.x.to_f64() - x).hypot(marker.y.to_f64() - y)
        });
        errors.fold(0.0, f64::max)
    }
}

/// A sensor for such pictures, without a tare.
pub fn sensor<'m>(geometry: Geometry, model: Option<Model<'m>>) -> Box<Sensor<'m>> {
    let mut sensor = Box::new(Sensor::new());
    sensor
        .configure(Settings::usual(geometry, ByteOrder::Native), model)
        .unwrap();
    sensor
}

/// The rest position that a sensor sees in one picture.
pub fn rest_of(picture: &Picture, sensor: &mut Sensor<'_>) -> Rest {
    let seen = picture.feed(sensor);
    let mut builder = TareBuilder::new(1).unwrap();
    builder
        .add(
            &seen.markers.unwrap(),
            &seen.features.unwrap(),
            &sensor.settings().geometry,
        )
        .unwrap()
        .unwrap()
}

/// A sensor with a tare of the pattern at rest.
pub fn tared(geometry: Geometry) -> Box<Sensor<'static>> {
    let mut sensor = sensor(geometry, None);
    let rest = rest_of(&Pattern::at_rest(geometry).draw(), &mut sensor);
    sensor.set_tare(Some(rest), Drift::NONE);
    sensor
}
