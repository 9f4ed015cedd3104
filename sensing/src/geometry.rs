//! What the sensing needs to know of lens and markers to tell a marker from another red thing.

use crate::{
    cordic::{ONE_BITS, atan2, sin_cos},
    units::{Micrometres, Px},
};

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
    /// The paper's camera: f = 2.1 mm, 150° across the frame's diagonal whatever its size.
    Paper,
    /// The same lens on an OV7725: 640 × 480 pixels of 6 µm, binned or scaled to the frame's width.
    Ov7725,
}

impl Preset {
    /// Both presets.
    pub const ALL: [Preset; 2] = [Preset::Paper, Preset::Ov7725];

    /// The name in files, on the command line and in the hello.
    pub const fn name(self) -> &'static str {
        match self {
            Preset::Paper => "paper",
            Preset::Ov7725 => "ov7725",
        }
    }

    /// The preset of that name.
    pub fn from_name(name: &str) -> Option<Preset> {
        Preset::ALL.into_iter().find(|preset| preset.name() == name)
    }
}

/// 6/(5π) in Q32: a frame's diagonal, in pixels, to the focal length that makes it 150° (5π/6) wide.
const DIAGONAL_TO_FOCAL_Q32: u64 = 1_640_556_661;
/// 2.1 mm / (640 · 6 µm) in Q16: an OV7725 frame's width to its focal length, both in pixels. Exact.
const OV7725_WIDTH_TO_FOCAL_Q16: i32 = 35_840;

/// π/180,000 in Q30: a thousandth of a degree in radians, to 2 · 10⁻⁵ of itself.
const RADIANS_Q30: i64 = 18_740;
/// π/4 in Q30.
const QUARTER_PI_Q30: i64 = 843_314_857;

impl Geometry {
    /// Markers 1 mm across at (±3.717, ±3.717) mm on a film 10 mm away, seen by `preset` in frames of `width` × `height`
    /// pixels (each 1–800).
    pub const fn preset(preset: Preset, width: u16, height: u16) -> Geometry {
        let focal = match preset {
            Preset::Paper => paper_focal(width as u64, height as u64),
            Preset::Ov7725 => Px(OV7725_WIDTH_TO_FOCAL_Q16 * width as i32),
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

    /// Area of a marker's image at rest, px, rounded down; without any dilation.
    ///
    /// A disc of diameter d at distance R from the axis and at angle θ from it shows an ellipse, f·d·θ/R across the
    /// radius and f·d·sin θ·cos θ/R along it.
    pub fn rest_area(&self) -> u32 {
        let (radius, distance) = (
            i64::from(self.marker_radius.0),
            i64::from(self.film_distance.0),
        );
        let theta = atan2(radius, distance);
        let (sin, cos) = sin_cos(theta);
        let scale = (i64::from(self.focal.0) * i64::from(self.marker_diameter.0) / radius.max(1))
            .clamp(0, 1 << 40);
        let factors = [i64::from(theta.0) * RADIANS_Q30, sin, cos, QUARTER_PI_Q30];
        let area_q32 = factors
            .iter()
            .fold(i128::from(scale) * i128::from(scale), |area, factor| {
                (area * i128::from(*factor)) >> ONE_BITS
            });
        u32::try_from(area_q32 >> 32).unwrap_or(u32::MAX)
    }

    /// Whether all measures are positive.
    pub const fn is_sound(&self) -> bool {
        self.focal.0 > 0
            && self.marker_diameter.0 > 0
            && self.marker_radius.0 > 0
            && self.film_distance.0 > 0
    }
}

/// 2.1 mm over a pitch that makes the diagonal 150°: the pitch cancels out.
const fn paper_focal(width: u64, height: u64) -> Px {
    let diagonal_q16 = ((width * width + height * height) << 32).isqrt();
    Px(((diagonal_q16 * DIAGONAL_TO_FOCAL_Q32 + (1 << 31)) >> 32) as i32)
}

/// (`pixels` − 1)/2.
const fn half_span(pixels: u16) -> Px {
    Px((pixels as i32 - 1) << (Px::FRACTION_BITS - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_have_the_documented_focal_lengths() {
        for (preset, width, height, pitch_um) in [
            (Preset::Paper, 800, 600, 5.497_787),
            (Preset::Paper, 320, 240, 13.744_468),
            (Preset::Ov7725, 320, 240, 12.0),
            (Preset::Ov7725, 640, 480, 6.0),
        ] {
            let focal = Geometry::preset(preset, width, height).focal.to_f64();
            let pitch = 2_100.0 / focal;
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
        let scale = 175.0 / 5.257;
        let area = std::f64::consts::FRAC_PI_4 * scale * scale * theta * theta.sin() * theta.cos();
        assert_eq!(geometry.rest_area(), area as u32);
        let extreme = Geometry {
            focal: Px(i32::MAX),
            marker_radius: Micrometres(1),
            ..geometry
        };
        let _ = Geometry {
            marker_diameter: Micrometres(u32::MAX),
            ..extreme
        }
        .rest_area();
    }

    #[test]
    fn names_round_trip() {
        for preset in Preset::ALL {
            assert_eq!(Preset::from_name(preset.name()), Some(preset));
        }
        assert_eq!(Preset::from_name("Paper"), None);
    }

    #[test]
    fn the_axis_meets_the_middle_of_the_frame() {
        let (x, y) = Geometry::preset(Preset::Ov7725, 320, 240).center();
        assert_eq!((x.to_f64(), y.to_f64()), (159.5, 119.5));
    }
}
