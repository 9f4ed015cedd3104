//! The catalogue of scenes in which markers are hard to find; the sensing is tested against it.

mod camera;
mod film;
mod light;

use std::fmt;
use std::sync::Arc;

use crate::{Load, Motion, Options, Patch, Preset, Scene, SceneError};

/// A scene in which markers are hard to find.
///
/// The rule for each of them: the sensing finds the markers within [`HardCase::tolerance_px`] of
/// the truth, or gives no force and a status with the reason. A force is never silently wrong.
#[derive(Clone)]
pub struct HardCase {
    /// Its name, such as `gain-0.30`; unique.
    pub name: String,
    /// Its difficulty, for a reader.
    pub what: String,
    /// The correct result of the sensing.
    pub expected: Expected,
    motion: Motion,
    noisy: bool,
    conditions: Conditions,
}

/// The options of a case. They depend on the nominal scene, which has the places in the picture.
type Conditions = Arc<dyn Fn(&Scene) -> Options + Send + Sync>;

/// The correct result of the sensing in a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Expected {
    /// The markers are plain to see: it is a fault to reject them.
    Found,
    /// The frame does not show where the markers are: any force is a fault.
    Rejected,
    /// Both results are correct, as long as a force is right.
    Either,
}

impl Expected {
    /// Returns `found`, `rejected` or `either`.
    pub fn name(self) -> &'static str {
        match self {
            Expected::Found => "found",
            Expected::Rejected => "rejected",
            Expected::Either => "either",
        }
    }
}

impl HardCase {
    fn new(
        name: impl Into<String>,
        what: impl Into<String>,
        expected: Expected,
        conditions: impl Fn(&Scene) -> Options + Send + Sync + 'static,
    ) -> HardCase {
        HardCase {
            name: name.into(),
            what: what.into(),
            expected,
            motion: Motion::Static(usual_load()),
            noisy: false,
            conditions: Arc::new(conditions),
        }
    }

    /// Returns the case as a scene. Most cases do not move: they show 0.1 N at α = 4°, β = −3°, and
    /// [`Scene::render_load`] shows them under any other load. See [`HardCase::moves`].
    ///
    /// # Errors
    /// If the frame size is not one of the preset's.
    pub fn scene(
        &self,
        preset: Preset,
        width: u32,
        height: u32,
        seed: u64,
    ) -> Result<Scene, SceneError> {
        let nominal =
            Scene::preset("rest", preset, width, height, seed)?.with_motion(self.motion)?;
        let options = (self.conditions)(&nominal);
        nominal.with_options(options)
    }

    /// Returns whether the case is about motion. [`Scene::frame`] at several times shows it, a
    /// constant load does not.
    pub fn moves(&self) -> bool {
        !matches!(self.motion, Motion::Static(_))
    }

    /// Returns the largest allowed distance of a marker from the truth in frames of a width, px. It
    /// is 0.3 up to QVGA, 0.15 at 800×600, linear between them; 1 in cases with four times the
    /// usual noise.
    pub fn tolerance_px(&self, width: u32) -> f64 {
        if self.noisy {
            return 1.0;
        }
        let part = (f64::from(width) - 320.0) / (800.0 - 320.0);
        0.3 - 0.15 * part.clamp(0.0, 1.0)
    }
}

impl fmt::Debug for HardCase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let HardCase {
            name,
            what,
            expected,
            ..
        } = self;
        write!(f, "{name} ({what}; {})", expected.name())
    }
}

/// Returns every hard case.
pub fn hard_cases() -> Vec<HardCase> {
    let groups = [
        light::dark(),
        light::one_sided(),
        light::veiled(),
        film::red_things(),
        film::merged(),
        film::missing(),
        film::cut(),
        film::glare(),
        film::dirt(),
        camera::leaving(),
        camera::noise(),
        camera::unsharp(),
        camera::moving(),
        camera::compressed(),
    ];
    groups.into_iter().flatten().collect()
}

/// Returns the loads for trying a still case: rest, and presses over the calibrated range.
pub fn hard_loads() -> Vec<Load> {
    let presses = [
        (0.0, 0.0, 0.0),
        (0.02, 0.0, 0.0),
        (0.1, 4.0, -3.0),
        (0.2, -8.0, 6.0),
    ];
    let load = |(force_n, alpha, beta)| Load::from_angles(force_n, alpha, beta).ok();
    presses.into_iter().filter_map(load).collect()
}

fn usual_load() -> Load {
    Load::from_angles(0.1, 4.0, -3.0).unwrap_or(Load::REST)
}

fn patched(patches: Vec<Patch>) -> Options {
    Options {
        patches,
        ..Options::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_case_renders_at_every_size_and_is_unlike_the_nominal_frame() {
        for case in hard_cases() {
            for (preset, width) in [(Preset::Ov7725, 320), (Preset::Paper, 160)] {
                let height = width / 4 * 3;
                let scene = case.scene(preset, width, height, 1).unwrap();
                assert_eq!(scene.motion().load(0.0) == Load::REST, case.moves());
                let usual = Scene::preset("static", preset, width, height, 1).unwrap();
                let frame = scene.frame(1, 0.25);
                let nominal = usual.frame(1, 0.25);
                assert_ne!(frame.pixels, nominal.pixels, "{case:?}");
            }
        }
    }

    #[test]
    fn still_cases_stand_every_load() {
        for case in hard_cases().iter().filter(|case| !case.moves()) {
            let scene = case.scene(Preset::Ov7725, 160, 120, 1).unwrap();
            for load in hard_loads() {
                assert!(scene.render_load(&load, 2).is_ok(), "{case:?} {load:?}");
            }
        }
        assert_eq!(hard_loads().len(), 4);
    }

    #[test]
    fn names_are_unique_and_all_that_must_be_there_is() {
        let cases = hard_cases();
        let names: BTreeSet<&str> = cases.iter().map(|case| case.name.as_str()).collect();
        assert_eq!(names.len(), cases.len());
        for name in [
            "gain-0.40",
            "gain-0.20",
            "one-sided-right",
            "red-same-size",
            "red-larger",
            "red-overlapping",
            "red-touching",
            "merged-0-1",
            "missing-3",
            "cut-0.30-mm",
            "leaving-half",
            "glare-0.20-mm",
            "haze-60",
            "warm-background-passes",
            "salt-5-percent",
            "specks-2000",
            "checkerboard-1-px",
            "noise-4x",
            "blur-2",
            "rolling-shutter",
        ] {
            assert!(names.contains(name), "{name}");
        }
    }

    #[test]
    fn tolerances_are_the_stated_ones() {
        let cases = hard_cases();
        let of = |name: &str| cases.iter().find(|case| case.name == name).unwrap();
        assert_eq!(of("haze-60").tolerance_px(320), 0.3);
        assert!((of("haze-60").tolerance_px(800) - 0.15).abs() < 1e-12);
        assert_eq!(of("noise-4x").tolerance_px(800), 1.0);
    }
}
