//! The dots that a device's film has, and where a camera sees them at rest.

use crate::failure::{Failure, Kind};
use hivtac_sensor::force::rest::Rest;
use hivtac_terms::geometry::Geometry;
use hivtac_terms::layout::EIGHT_V;
use hivtac_terms::marker::{LEAST_MARKERS, Marker};
use hivtac_terms::units::Px;
use hivtac_wire::message::DeviceHello;

/// Directions of four dots in a square from its middle, from the upper left clockwise.
const CORNERS: [[f64; 2]; LEAST_MARKERS] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
/// Width that the mask adds to a dot's diameters, px.
const EDGE: Px = Px(183_501);

/// The dots of a film whose layout is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dots {
    /// Four in a square.
    Four,
    /// The eight of the layout `8v`.
    EightV,
}

impl Dots {
    /// Those that the device's model is for; four without a model.
    ///
    /// # Errors
    /// [`Kind::NotRight`] when no known layout has as many.
    pub fn of(device: &DeviceHello) -> Result<Dots, Failure> {
        let model = device.model.as_ref();
        match model.map_or(LEAST_MARKERS, |model| model.markers.into()) {
            LEAST_MARKERS => Ok(Dots::Four),
            count if count == EIGHT_V.len() => Ok(Dots::EightV),
            count => Err(Failure::new(
                Kind::NotRight,
                format!(
                    "this knows films of four dots and of the eight of 8v; the device's model is \
                     for {count}: look at its picture with `hivtac view`"
                ),
            )),
        }
    }

    /// Their number in words.
    pub fn in_words(self) -> &'static str {
        match self {
            Dots::Four => "four",
            Dots::EightV => "eight",
        }
    }

    /// Their number.
    pub fn count(self) -> usize {
        match self {
            Dots::Four => CORNERS.len(),
            Dots::EightV => EIGHT_V.len(),
        }
    }

    /// Their centres from the film's middle, by identity, mm.
    pub fn centres_mm(self, geometry: &Geometry) -> Vec<[f64; 2]> {
        match self {
            Dots::Four => {
                let rest_mm = f64::from(geometry.marker_radius.0) / 1e3 / std::f64::consts::SQRT_2;
                CORNERS
                    .map(|corner| corner.map(|part| part * rest_mm))
                    .into()
            }
            Dots::EightV => EIGHT_V
                .map(|dot| dot.map(|part| f64::from(part.0) / 1e3))
                .into(),
        }
    }

    /// Where a camera over the film's middle sees them at rest, px from its axis.
    pub fn seen_px(self, geometry: &Geometry) -> Vec<[f64; 2]> {
        let film_mm = f64::from(geometry.film_distance.0) / 1e3;
        let seen = |[x, y]: [f64; 2]| {
            let far = x.hypot(y);
            let scale = geometry.focal.to_f64() * (far / film_mm).atan() / far;
            [scale * x, scale * y]
        };
        self.centres_mm(geometry).into_iter().map(seen).collect()
    }

    /// The rest position that the sensing needs to know which dot is which; `None` for four in a
    /// square, which it knows.
    pub fn rest(self, geometry: &Geometry) -> Option<Rest> {
        if self == Dots::Four {
            return None;
        }
        let (x, y) = geometry.center();
        let px = |at: f64, off: f64| Px(((at + off) * 65_536.0).round() as i32);
        let markers = self.seen_px(geometry).into_iter().map(|off| Marker {
            x: px(x.to_f64(), off[0]),
            y: px(y.to_f64(), off[1]),
            area: geometry.rest_area(EDGE),
        });
        Some(Rest::of_markers(&markers.collect::<Vec<_>>()))
    }
}
