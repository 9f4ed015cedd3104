//! What the sensing needs to know of lens and markers to tell a marker from another red thing.

use crate::units::{Micrometres, Px};

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

impl Geometry {
    /// Markers 1 mm across at (±3.717, ±3.717) mm, seen by `preset` in frames of `width` × `height`
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
        }
    }

    /// Where the optical axis meets the image.
    pub const fn center(&self) -> (Px, Px) {
        (half_span(self.width), half_span(self.height))
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
