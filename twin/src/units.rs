//! How exactly units are built: standard deviations of their numbers, and units drawn by them.

use crate::film::reduced::Unit;
use crate::film::{Dots, Layout};
use crate::{Camera, Lens, Mechanics, Mounting, Options, PresetCamera, Scene, SceneError, noise};
use std::ops::RangeInclusive;

/// ln of the film's Young's modulus.
pub const STIFFNESS: f64 = 0.2;
/// ln of its thickness.
pub const THICKNESS: f64 = 0.1;
/// A post's place along each axis, mm.
pub const POST_MM: f64 = 0.3;
/// A marker's place along each axis, mm.
pub const MARKER_MM: f64 = 0.15;
/// The camera's roll, degrees.
pub const ROLL_DEG: f64 = 2.0;
/// ln of its focal length.
pub const FOCAL: f64 = 0.02;
/// Where its axis meets the picture along each side, px.
pub const MIDDLE_PX: f64 = 3.0;
/// Range of the tip's radius, mm, with a uniform distribution.
pub const TIP_RADIUS_MM: [f64; 2] = [0.25, 1.0];

/// Largest error of a glued marker along an axis, mm.
const MARKER_AT_MOST_MM: f64 = 0.3;
/// Largest deviation of a drawn number, in standard deviations.
const AT_MOST: f64 = 2.5;

/// Draws a unit with these dots: its scene's options, with a camera of a focal length in µm, and in
/// px for the nominal unit. `normal` gives random numbers of the standard normal distribution.
pub fn random_unit(
    mut normal: impl FnMut() -> f64,
    layout: Layout,
    focal_um: f64,
    focal_px: f64,
) -> Options {
    let mut within = |sigma: f64, at_most: f64| {
        let mut all = std::iter::repeat_with(|| sigma * normal());
        all.find(|value| value.abs() <= at_most).unwrap_or(0.0)
    };
    let mut usual = |sigma: f64| within(sigma, AT_MOST * sigma);
    let mounting = Mounting {
        shift_px: [usual(MIDDLE_PX), usual(MIDDLE_PX)],
        roll_deg: usual(ROLL_DEG),
    };
    let longer = 1.0 + usual(FOCAL);
    let (stiffness, thickness) = (1.0 + usual(STIFFNESS), 1.0 + usual(THICKNESS));
    let posts_mm = std::array::from_fn(|_| [usual(POST_MM), usual(POST_MM)]);
    let glued_mm = Dots::from_fn(layout.count(), |_| {
        [0, 1].map(|_| within(MARKER_MM, MARKER_AT_MOST_MM))
    });
    Options {
        film: Mechanics {
            unit: Unit {
                stiffness,
                thickness,
                posts_mm,
                ..Unit::default()
            },
            ..Mechanics::default()
        },
        layout,
        glued_mm,
        lens: Lens {
            pitch_um: Some(focal_um / (focal_px * longer)),
            ..Lens::default()
        },
        mounting,
        ..Options::default()
    }
}

/// Number of the nominal unit.
pub const NOMINAL: u64 = 0;
/// Numbers of the units that are drawn.
pub const DRAWN: RangeInclusive<u64> = 1..=1_000_000;

/// Returns the scene of unit `number`. The same number is the same unit everywhere, under the
/// nominal tip.
///
/// # Errors
/// Those of [`Scene::with_options`].
pub fn as_unit(number: u64, scene: Scene) -> Result<Scene, SceneError> {
    let options = with_unit(number, scene.camera(), scene.options().clone());
    scene.with_options(options)
}

/// Returns these options with the differences of unit `number`: camera, film and glued markers.
fn with_unit(number: u64, camera: &Camera, options: Options) -> Options {
    let mut random = noise::uniform(noise::mix(number));
    // The sum of twelve uniform numbers: nearly normal, with variance 1.
    let normal = || random.by_ref().take(12).map(|part| part - 0.5).sum();
    let focal_um = 1000.0 * camera.preset().focal_length_mm();
    let unit = random_unit(normal, options.layout, focal_um, camera.focal_px());
    Options {
        film: Mechanics {
            unit: unit.film.unit,
            ..options.film
        },
        glued_mm: unit.glued_mm,
        lens: Lens {
            pitch_um: unit.lens.pitch_um,
            ..options.lens
        },
        mounting: unit.mounting,
        ..options
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Preset;

    #[test]
    fn units_differ_by_their_number_alone_and_can_be_simulated() {
        for preset in [Preset::Ov7725, Preset::Mt9v034] {
            let [width, height] = match preset {
                Preset::Mt9v034 => [160, 152],
                _ => [320, 240],
            };
            let nominal = Scene::preset("demo", preset, width, height, 1).unwrap();
            let of = |number| with_unit(number, nominal.camera(), nominal.options().clone());
            assert_eq!(of(7), of(7));
            assert_ne!(of(7), of(8));
            for number in 0..100 {
                let unit = of(number);
                let pitch_um = unit.lens.pitch_um.unwrap();
                assert!((11.0..13.1).contains(&pitch_um), "{pitch_um}");
                nominal.clone().with_options(unit).unwrap();
            }
        }
    }

    /// Every dot of a layout is glued somewhat off its place; camera and film are those of the same
    /// unit with four dots.
    #[test]
    fn a_unit_with_more_dots_has_all_of_them_glued_off() {
        let nominal = Scene::preset("demo", Preset::Ov7725, 320, 240, 1).unwrap();
        let of = |layout: Layout| {
            let options = Options {
                layout,
                ..nominal.options().clone()
            };
            with_unit(7, nominal.camera(), options)
        };
        let (four, eight) = (of(Layout::default()), of("8v".parse().unwrap()));
        assert_eq!(eight.glued_mm.len(), 8);
        assert!(eight.glued_mm.iter().flatten().all(|mm| *mm != 0.0));
        assert_eq!(eight.glued_mm[..4], four.glued_mm[..]);
        assert_eq!((eight.mounting, eight.film), (four.mounting, four.film));
        nominal.with_options(eight).unwrap();
    }
}
