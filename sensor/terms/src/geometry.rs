//! Defines the geometry of lens and markers, by which a marker is distinguished from other red
//! objects.

use crate::angle::atan2;
use crate::cordic::sin_cos;
use crate::division::Divisor;
use crate::fixed::Q;
use crate::units::{Micrometres, MilliDegrees, Px};
use core::fmt;
use core::str::FromStr;

/// Lens, frame and marker geometry (`docs/architecture.md`, presets).
///
/// The optical axis meets the image at its centre, ((W−1)/2, (H−1)/2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Geometry {
    /// Columns of a frame, 1–800.
    pub width: u16,
    /// Rows of a frame, 1–800.
    pub height: u16,
    /// Focal length of the equidistant lens (r = f·θ), in pixels.
    pub focal: Px,
    /// Diameter of a marker on the film.
    pub marker_diameter: Micrometres,
    /// Distance of a marker's centre from the optical axis, on the film at rest.
    pub marker_radius: Micrometres,
    /// Distance of the film at rest from the lens, along the axis.
    pub film_distance: Micrometres,
}

/// The geometries that the project knows by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Preset {
    /// The paper's camera: f = 2.1 mm, 150° across the frame's diagonal, whatever its size.
    Paper,
    /// The same lens on an OV7725: 640 × 480 pixels of 6 µm, binned or scaled to the frame's width.
    Ov7725,
    /// A lens of 1.2 mm on an MT9V034, whose pixels of 6 µm are binned 2 × 2: 12 µm, whatever part
    /// of them is sent.
    Mt9v034,
}

impl Preset {
    /// Every preset, in the order in which the model file numbers them.
    pub const ALL: [Preset; 3] = [Preset::Paper, Preset::Ov7725, Preset::Mt9v034];

    /// Its name in files, on the command line and in the hello.
    pub const fn name(self) -> &'static str {
        match self {
            Preset::Paper => "paper",
            Preset::Ov7725 => "ov7725",
            Preset::Mt9v034 => "mt9v034",
        }
    }

    /// Returns the preset with this name; `None` if there is no such preset.
    pub fn from_name(name: &str) -> Option<Preset> {
        Preset::ALL.into_iter().find(|preset| preset.name() == name)
    }
}

impl fmt::Display for Preset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Preset {
    type Err = UnknownPreset;

    fn from_str(name: &str) -> Result<Preset, UnknownPreset> {
        Preset::from_name(name).ok_or(UnknownPreset)
    }
}

/// There is no preset with this name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct UnknownPreset;

impl fmt::Display for UnknownPreset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [first, second, third] = Preset::ALL;
        write!(f, "unknown preset: use {first}, {second} or {third}")
    }
}

impl core::error::Error for UnknownPreset {}

/// 6/(5π): converts a frame's diagonal, px, to the focal length that makes it 150° (5π/6) wide.
const DIAGONAL_TO_FOCAL: Q<32, u64> = Q::from_bits(1_640_556_661);
/// 2.1 mm / (640 · 6 µm): converts an OV7725 frame's width to its focal length, both in px. Exact.
const OV7725_WIDTH_TO_FOCAL: Q<16> = Q::from_bits(35_840);
/// 1.2 mm / 12 µm.
const MT9V034_FOCAL: Px = Px::from_int(100);

/// Largest measure: a metre.
const LARGEST_MEASURE: Micrometres = Micrometres(1_000_000);
/// A radian in m°, exact to 4 · 10⁻⁶ relative.
const RADIAN: i64 = 57_296;
/// π/4.
const QUARTER_PI: Q<30> = Q::from_bits(843_314_857);

impl Geometry {
    /// Markers 1 mm across at (±3.717, ±3.717) mm on a film 10 mm away, seen by `preset` in frames
    /// of `width` × `height` pixels (each 1–800).
    pub const fn preset(preset: Preset, width: u16, height: u16) -> Geometry {
        let focal = match preset {
            Preset::Paper => paper_focal(width as u64, height as u64),
            Preset::Ov7725 => Px(OV7725_WIDTH_TO_FOCAL.bits() * width as i32),
            Preset::Mt9v034 => MT9V034_FOCAL,
        };
        Geometry {
            width,
            height,
            focal,
            marker_diameter: Micrometres(1_000),
            marker_radius: Micrometres(5_257),
            film_distance: Micrometres(10_000),
        }
    }

    /// Where the optical axis meets the image.
    pub const fn center(&self) -> (Px, Px) {
        (half_span(self.width), half_span(self.height))
    }

    /// Returns whether all measures are positive and at most a metre, and the markers do not
    /// overlap.
    pub const fn is_sound(&self) -> bool {
        let diameter = self.marker_diameter.0;
        let radius = self.marker_radius.0;
        self.focal.0 > 0
            && 0 < diameter
            && diameter <= radius
            && radius <= LARGEST_MEASURE.0
            && 0 < self.film_distance.0
            && self.film_distance.0 <= LARGEST_MEASURE.0
    }

    /// Area of a marker's image at rest, px, rounded down. The mask adds `edge` to its diameters.
    pub fn rest_area(&self, edge: Px) -> u32 {
        let across = self.across(self.rest_distance());
        let along = self.along_flat(self.rest_distance());
        let grow = |diameter: Px| i128::from(diameter.0) + i128::from(edge.0);
        let area: Q<62, i128> =
            Q::from_bits(grow(across) * grow(along) * i128::from(QUARTER_PI.bits()));
        u32::try_from(area.floor()).unwrap_or(0)
    }

    /// Distance of a marker's image from the axis at rest: f·θ.
    pub fn rest_distance(&self) -> Px {
        let theta = atan2(
            i64::from(self.marker_radius.0),
            i64::from(self.film_distance.0),
        );
        Px::saturated(Q::from_bits(
            i64::from(self.focal.0) * i64::from(theta.0) / RADIAN,
        ))
    }

    /// Diameter of a marker's image across the radius, at `distance` from the axis: distance·d/R. A
    /// lens that is symmetric about its axis images a circle about the axis as a circle. So this
    /// holds for any lens, and any height or tilt of the film.
    pub fn across(&self, distance: Px) -> Px {
        let product = i64::from(distance.0) * i64::from(self.marker_diameter.0);
        Px::saturated(Q::from_bits(
            Divisor::new(self.marker_radius.0).signed_quotient(product),
        ))
    }

    /// Diameter of a marker's image along the radius, on a flat film: f·d·sin θ·cos θ/R with θ =
    /// distance/f.
    pub fn along_flat(&self, distance: Px) -> Px {
        let theta = i64::from(distance.0) * RADIAN / i64::from(self.focal.0.max(1));
        let theta = theta.clamp(1, 90_000);
        let (sin, cos) = sin_cos(MilliDegrees(theta as i32));
        let product: Q<60, i64> = Q::from_bits(i64::from(sin.bits()) * i64::from(cos.bits()));
        let factor: Q<30, i64> = Q::from_bits(product.floor_to::<30>().bits() * RADIAN / theta);
        let along: Q<46, i64> = Q::from_bits(i64::from(self.across(distance).0) * factor.bits());
        Px::saturated(along.floor_to())
    }
}

/// 2.1 mm over a pixel pitch that makes the diagonal 150°: the pitch cancels out.
const fn paper_focal(width: u64, height: u64) -> Px {
    // In 1/65,536 px: the root of 2³² times a square.
    let diagonal = ((width * width + height * height) << 32).isqrt();
    Px(((diagonal * DIAGONAL_TO_FOCAL.bits() + (1 << 31)) >> 32) as i32)
}

/// (`pixels` − 1)/2.
const fn half_span(pixels: u16) -> Px {
    Px((pixels as i32 - 1) << (Px::FRACTION_BITS - 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn presets_have_the_documented_focal_lengths() {
        for (preset, width, height, focal_um, pitch_um) in [
            (Preset::Paper, 800, 600, 2_100.0, 5.497_787),
            (Preset::Paper, 320, 240, 2_100.0, 13.744_468),
            (Preset::Ov7725, 320, 240, 2_100.0, 12.0),
            (Preset::Ov7725, 640, 480, 2_100.0, 6.0),
            (Preset::Mt9v034, 160, 152, 1_200.0, 12.0),
            (Preset::Mt9v034, 376, 240, 1_200.0, 12.0),
        ] {
            let focal = Geometry::preset(preset, width, height).focal.to_f64();
            let pitch = focal_um / focal;
            assert!(
                (pitch - pitch_um).abs() < 1e-5,
                "{preset:?} {width}: {pitch} µm"
            );
        }
    }

    #[test]
    fn a_marker_at_rest_has_the_area_of_its_ellipse() {
        let geometry = Geometry::preset(Preset::Ov7725, 320, 240);
        let theta = (5.257f64 / 10.0).atan();
        assert!((geometry.rest_distance().to_f64() - 175.0 * theta).abs() < 2e-3);
        let across = 175.0 * theta / 5.257;
        let along = across * theta.sin() * theta.cos() / theta;
        assert!((geometry.across(geometry.rest_distance()).to_f64() - across).abs() < 1e-3);
        assert!((geometry.along_flat(geometry.rest_distance()).to_f64() - along).abs() < 1e-3);
        for edge in [0.0, 2.8] {
            let area = std::f64::consts::FRAC_PI_4 * (across + edge) * (along + edge);
            let found = geometry.rest_area(Px((edge * 65_536.0) as i32));
            assert!((f64::from(found) - area).abs() < 1.0, "{found} for {area}");
        }
    }

    #[test]
    fn extreme_geometries_are_refused_or_give_a_number() {
        let good = Geometry::preset(Preset::Paper, 800, 600);
        assert!(good.is_sound());
        for wrong in [
            Geometry {
                focal: Px(0),
                ..good
            },
            Geometry {
                marker_diameter: Micrometres(0),
                ..good
            },
            Geometry {
                marker_diameter: Micrometres(5_258),
                ..good
            },
            Geometry {
                marker_radius: Micrometres(u32::MAX),
                ..good
            },
            Geometry {
                film_distance: Micrometres(0),
                ..good
            },
            Geometry {
                film_distance: Micrometres(1_000_001),
                ..good
            },
        ] {
            assert!(!wrong.is_sound(), "{wrong:?}");
            let _ = wrong.rest_area(Px(i32::MAX));
        }
        let largest = Geometry {
            focal: Px(i32::MAX),
            marker_diameter: Micrometres(1_000_000),
            marker_radius: Micrometres(1_000_000),
            film_distance: Micrometres(1),
            ..good
        };
        assert!(largest.is_sound());
        assert!(largest.rest_area(Px(0)) > 0);
    }

    #[test]
    fn names_round_trip() {
        for preset in Preset::ALL {
            assert_eq!(preset.to_string().parse(), Ok(preset));
        }
        let error = "Paper".parse::<Preset>().unwrap_err();
        let text = "unknown preset: use paper, ov7725 or mt9v034";
        assert_eq!(error.to_string(), text);
    }

    #[test]
    fn the_axis_meets_the_middle_of_the_frame() {
        let (x, y) = Geometry::preset(Preset::Ov7725, 320, 240).center();
        assert_eq!((x.to_f64(), y.to_f64()), (159.5, 119.5));
    }
}
