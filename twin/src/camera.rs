//! The simulated cameras of the presets: they give the place in the picture of a point in space.

use hivtac_terms::geometry::Preset;

use crate::{Format, Lens, Mounting, Paint, Projection, SceneError};

/// Focal length of the paper's lens, mm.
pub const FOCAL_LENGTH_MM: f64 = 2.1;
/// Distance from the pinhole to the film at rest along the optical axis, mm.
pub const FILM_DISTANCE_MM: f64 = 10.0;
/// Angle of view across the `paper` preset's diagonal, degrees.
const PAPER_VIEW_DEG: f64 = 150.0;
/// Width of the OV7725's picture: 640 pixels of 6 µm, in mm.
const OV7725_WIDTH_MM: f64 = 3.84;
/// Focal length of the lens on an MT9V034, mm. It keeps the markers within the rows that the chip
/// reads out.
const MT9V034_FOCAL_LENGTH_MM: f64 = 1.2;
/// Pitch of the MT9V034's pixels, mm: 6 µm, binned 2 × 2.
const MT9V034_PITCH_MM: f64 = 0.012;
/// Columns and rows of the MT9V034's whole array of binned pixels.
const MT9V034_ARRAY: [u32; 2] = [376, 240];

/// The simulated camera of a preset.
pub trait PresetCamera {
    /// Columns and rows of its usual frame.
    fn usual_size(self) -> [u32; 2];

    /// The default pixel format.
    fn usual_format(self) -> Format;

    /// The default markers: black if the camera sees no colours, otherwise red.
    fn usual_markers(self) -> Paint;

    /// Focal length of its lens, mm.
    fn focal_length_mm(self) -> f64;
}

impl PresetCamera for Preset {
    fn usual_size(self) -> [u32; 2] {
        match self {
            Preset::Paper | Preset::Ov7725 => [320, 240],
            Preset::Mt9v034 => [160, 152],
        }
    }

    fn usual_format(self) -> Format {
        match self {
            Preset::Paper | Preset::Ov7725 => Format::Rgb565,
            Preset::Mt9v034 => Format::Mono,
        }
    }

    fn usual_markers(self) -> Paint {
        match self {
            Preset::Paper | Preset::Ov7725 => Paint::Red,
            Preset::Mt9v034 => Paint::Black,
        }
    }

    fn focal_length_mm(self) -> f64 {
        match self {
            Preset::Paper | Preset::Ov7725 => FOCAL_LENGTH_MM,
            Preset::Mt9v034 => MT9V034_FOCAL_LENGTH_MM,
        }
    }
}

/// Whether the preset's camera can give frames of this size.
fn has_size(preset: Preset, width: u32, height: u32) -> bool {
    match preset {
        Preset::Paper | Preset::Ov7725 => {
            (160..=800).contains(&width) && width * 3 == height.saturating_mul(4)
        }
        Preset::Mt9v034 => {
            let [columns, rows] = MT9V034_ARRAY;
            let even = width.is_multiple_of(2) && height.is_multiple_of(2);
            even && (80..=columns).contains(&width) && (80..=rows).contains(&height)
        }
    }
}

/// Pixel pitch at this frame size, mm: 13.744 µm (`paper`) and 12 µm (`ov7725`) at 320×240.
fn pitch_mm(preset: Preset, width: u32, height: u32) -> f64 {
    let (w, h) = (f64::from(width), f64::from(height));
    match preset {
        Preset::Paper => FOCAL_LENGTH_MM * radians(PAPER_VIEW_DEG) / (w * w + h * h).sqrt(),
        Preset::Ov7725 => OV7725_WIDTH_MM / w,
        Preset::Mt9v034 => MT9V034_PITCH_MM,
    }
}

/// A lens and a picture: together they give the place in the picture of a point in space.
///
/// By default an equidistant fisheye, r = f·θ (the paper's eq. 14), with θ = arctan(ρ / Z). ρ is
/// the distance from the optical axis, Z the *axial* distance from the pinhole. The paper's eq. 15
/// means this Z. Its eq. 23 uses the slant distance √(ρ² + Z²) instead, which does not give a ray's
/// angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    preset: Preset,
    width: u32,
    height: u32,
    /// Focal length in pixels.
    focal_px: f64,
    projection: Projection,
    /// The point where the optical axis meets the picture, px.
    axis_px: [f64; 2],
    /// Sine and cosine of the roll about the optical axis.
    roll: (f64, f64),
}

impl Camera {
    /// Returns the camera of a preset at a frame size. Sizes are 4:3, 160×120 to 800×600. For
    /// `mt9v034` they are an even number of columns and rows, 80×80 to 376×240.
    ///
    /// # Errors
    /// If the preset has no frames of this size.
    pub fn new(preset: Preset, width: u32, height: u32) -> Result<Camera, SceneError> {
        if !has_size(preset, width, height) {
            return Err(SceneError::Size {
                preset,
                width,
                height,
            });
        }
        Ok(Camera {
            preset,
            width,
            height,
            focal_px: preset.focal_length_mm() / pitch_mm(preset, width, height),
            projection: Projection::Equidistant,
            axis_px: [centre(width), centre(height)],
            roll: (0.0, 1.0),
        })
    }

    /// Returns the same camera with this lens and this mounting.
    pub(crate) fn fitted(mut self, lens: &Lens, mounting: &Mounting) -> Camera {
        let preset_mm = pitch_mm(self.preset, self.width, self.height);
        let pitch_mm = lens.pitch_um.map_or(preset_mm, |um| um / 1000.0);
        self.focal_px = self.preset.focal_length_mm() / pitch_mm;
        self.projection = lens.projection;
        let [dx, dy] = mounting.shift_px;
        self.axis_px = [centre(self.width) + dx, centre(self.height) + dy];
        self.roll = libm::sincos(radians(mounting.roll_deg));
        self
    }

    /// Returns the same camera with pixels smaller by this factor.
    pub(crate) fn finer(self, times: u32) -> Camera {
        let factor = f64::from(times);
        Camera {
            width: self.width * times,
            height: self.height * times,
            focal_px: self.focal_px * factor,
            axis_px: self.axis_px.map(|at| (at + 0.5) * factor - 0.5),
            ..self
        }
    }

    /// The preset.
    pub fn preset(&self) -> Preset {
        self.preset
    }

    /// Columns of a frame.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows of a frame.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Focal length in pixels: 175 at `ov7725` QVGA.
    pub fn focal_px(&self) -> f64 {
        self.focal_px
    }

    /// Returns the place in the picture, px, of the point (x, y, z) mm of the film frame. The point
    /// must be in front of the pinhole: z > −10 mm.
    pub fn project(&self, [x, y, z]: [f64; 3]) -> [f64; 2] {
        let rho = (x * x + y * y).sqrt();
        if rho == 0.0 {
            return self.axis_px;
        }
        let axial = FILM_DISTANCE_MM + z;
        let scale = match self.projection {
            Projection::Equidistant => self.focal_px * libm::atan2(rho, axial) / rho,
            Projection::Pinhole => self.focal_px / axial,
        };
        let (sin, cos) = self.roll;
        let [cx, cy] = self.axis_px;
        [
            cx + scale * (x * cos - y * sin),
            cy + scale * (x * sin + y * cos),
        ]
    }

    /// Returns the angle between the optical axis and a pixel's line of sight, radians.
    pub(crate) fn view_angle(&self, [x, y]: [f64; 2]) -> f64 {
        let (dx, dy) = (x - self.axis_px[0], y - self.axis_px[1]);
        let part = (dx * dx + dy * dy).sqrt() / self.focal_px;
        match self.projection {
            Projection::Equidistant => part,
            Projection::Pinhole => libm::atan(part),
        }
    }
}

/// Converts degrees to radians.
pub(crate) fn radians(degrees: f64) -> f64 {
    degrees * (std::f64::consts::PI / 180.0)
}

/// Returns the middle of `count` pixels; the centre of the first is at 0.
pub(crate) fn centre(count: u32) -> f64 {
    (f64::from(count) - 1.0) / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(preset: Preset, width: u32) -> Camera {
        Camera::new(preset, width, width / 4 * 3).unwrap()
    }

    #[test]
    fn presets_have_their_stated_pitch() {
        let pitch_um = |preset, width| 2100.0 / camera(preset, width).focal_px();
        assert!((pitch_um(Preset::Paper, 800) - 5.498).abs() < 0.0005);
        assert!((pitch_um(Preset::Paper, 320) - 13.744).abs() < 0.0005);
        assert!((pitch_um(Preset::Ov7725, 320) - 12.0).abs() < 1e-9);
        assert!((pitch_um(Preset::Ov7725, 640) - 6.0).abs() < 1e-9);
        for [width, height] in [Preset::Mt9v034.usual_size(), MT9V034_ARRAY] {
            let camera = Camera::new(Preset::Mt9v034, width, height).unwrap();
            assert!((camera.focal_px() - 100.0).abs() < 1e-9);
        }
    }

    #[test]
    fn the_paper_sees_150_degrees_across_the_diagonal() {
        for width in [160, 320, 800] {
            let camera = camera(Preset::Paper, width);
            let outer_corner = camera.view_angle([-0.5, -0.5]);
            assert!((outer_corner - radians(75.0)).abs() < 1e-12);
        }
    }

    #[test]
    fn projection_is_equidistant_with_the_axial_distance() {
        let camera = camera(Preset::Ov7725, 320);
        // 10 mm from the axis at 10 mm axial distance is 45° off the axis.
        let [x, y] = camera.project([10.0, 0.0, 0.0]);
        assert!((x - 159.5 - 175.0 * radians(45.0)).abs() < 1e-9);
        assert!((y - 119.5).abs() < 1e-9);
        assert_eq!(camera.project([0.0, 0.0, -3.0]), [159.5, 119.5]);
    }

    #[test]
    fn a_pinhole_sees_without_distortion_and_by_its_own_pitch() {
        let lens = Lens {
            projection: Projection::Pinhole,
            pitch_um: Some(6.0),
            ..Lens::default()
        };
        let camera = camera(Preset::Ov7725, 320).fitted(&lens, &Mounting::default());
        // 2.1 mm · 3/10 on pixels of 6 µm.
        let [x, y] = camera.project([3.0, 0.0, 0.0]);
        assert!((x - 159.5 - 105.0).abs() < 1e-9 && (y - 119.5).abs() < 1e-9);
        assert!((camera.view_angle([x, y]) - libm::atan(0.3)).abs() < 1e-12);
    }

    #[test]
    fn roll_turns_x_towards_y() {
        let mounting = Mounting {
            shift_px: [1.0, -2.0],
            roll_deg: 90.0,
        };
        let camera = camera(Preset::Ov7725, 320).fitted(&Lens::default(), &mounting);
        let [x, y] = camera.project([10.0, 0.0, 0.0]);
        assert!((x - 160.5).abs() < 1e-9);
        assert!((y - 117.5 - 175.0 * radians(45.0)).abs() < 1e-9);
    }

    #[test]
    fn other_sizes_are_refused() {
        for (width, height) in [(0, 0), (156, 117), (320, 200), (804, 603), (320, u32::MAX)] {
            assert_eq!(
                Camera::new(Preset::Paper, width, height),
                Err(SceneError::Size {
                    preset: Preset::Paper,
                    width,
                    height
                })
            );
        }
        for (width, height) in [(78, 152), (160, 151), (378, 240), (376, 242)] {
            assert!(
                Camera::new(Preset::Mt9v034, width, height).is_err(),
                "{width} × {height}"
            );
        }
    }
}
