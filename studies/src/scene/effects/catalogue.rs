//! The list of effects: what each is worth can be measured by switching it.

use hivtac_twin::{
    Contact, Creep, Discs, Format, Lens, Mounting, Options, Paint, Patch, Projection, Salt, Scene,
    SceneError, Shutter, Stiffness, Surface,
};

/// One effect of the simulated sensor, and how to switch it.
#[derive(Clone, Copy, Debug)]
pub struct Effect {
    /// Its name, such as `falloff`; unique.
    pub name: &'static str,
    /// What is switched, and to what.
    pub what: &'static str,
    /// Whether the default has it: then it is switched off, otherwise on.
    pub in_default: bool,
    /// What of the switched scene is to be compared with what is found in the default's frames.
    pub compare: Compare,
    change: fn(&Scene, &mut Options),
}

/// What tells an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Compare {
    /// What is found in its frames ([`Scene::frame`], at the times of a motion), through
    /// [`Frame::to_rgb565`] when its format is another.
    ///
    /// [`Frame::to_rgb565`]: hivtac_twin::Frame::to_rgb565
    Found,
    /// Its true centroids, which a picture of endless pixels would show.
    Truth,
}

impl Effect {
    /// The scene with this effect switched, and all else as it is.
    ///
    /// # Errors
    /// When the scene's options and the effect do not go together.
    pub fn switch(&self, scene: &Scene) -> Result<Scene, SceneError> {
        let mut options = scene.options().clone();
        (self.change)(scene, &mut options);
        scene.clone().with_options(options)
    }
}

/// Every effect, grouped by where it comes from.
pub fn effects() -> Vec<Effect> {
    [film(), lens(), mounting(), light(), sensor()].concat()
}

const fn on(name: &'static str, what: &'static str, change: fn(&Scene, &mut Options)) -> Effect {
    Effect {
        name,
        what,
        in_default: false,
        compare: Compare::Found,
        change,
    }
}

const fn off(name: &'static str, what: &'static str, change: fn(&Scene, &mut Options)) -> Effect {
    Effect {
        in_default: true,
        ..on(name, what, change)
    }
}

fn film() -> Vec<Effect> {
    vec![
        off(
            "curve of the film",
            "a film that gives in proportion to the force",
            |_, options| {
                options.film.stiffness = Stiffness::Linear;
            },
        ),
        off(
            "lateral mode",
            "no sideways motion under a tilted force",
            |_, options| {
                options.film.lateral = false;
            },
        ),
        off(
            "camera-side surface",
            "markers on the film's middle surface",
            |_, options| options.film.surface = Surface::Middle,
        ),
        on(
            "creep",
            "a film that gives a tenth more within half a minute, and as slowly back",
            |_, options| options.film.creep = Creep::of(0.1),
        ),
        on(
            "contact offset",
            "a tip 0.25 mm to the right of the middle",
            |_, options| options.film.offset_mm = [0.25, 0.0],
        ),
        on(
            "contact: stick",
            "α and β are the way of a tip that sticks",
            |_, options| options.film.contact = Contact::Stick,
        ),
        on(
            "contact: slip",
            "the same, until the pull is 0.6 of the press",
            |_, options| options.film.contact = Contact::Slip { mu: 0.6 },
        ),
    ]
}

fn lens() -> Vec<Effect> {
    vec![
        off(
            "equidistant lens",
            "a pinhole of the same focal length",
            |_, options| {
                options.lens.projection = Projection::Pinhole;
            },
        ),
        off(
            "disc area",
            "discs centred on the image of their centre",
            |_, options| {
                options.lens.discs = Discs::ByCentre;
            },
        ),
        on(
            "blur",
            "every point blurred by 6 µm on the sensor",
            |scene, options| {
                options.lens.blur_px = 6.0 / pitch_um(scene);
            },
        ),
        on(
            "focus",
            "F/2.8 focused at 8 mm, the film between 6 and 10",
            |_, options| {
                options.lens = Lens {
                    aperture_mm: 0.75,
                    focus_mm: 8.0,
                    ..options.lens
                };
            },
        ),
    ]
}

fn mounting() -> Vec<Effect> {
    vec![
        on("focal length", "1 % longer", |scene, options| {
            options.lens.pitch_um = Some(pitch_um(scene) / 1.01);
        }),
        on(
            "optical centre",
            "24 µm to the right, 12 µm up",
            |scene, options| {
                let pixels = 12.0 / pitch_um(scene);
                options.mounting.shift_px = [2.0 * pixels, -pixels];
            },
        ),
        on("roll", "the camera turned by 1°", |_, options| {
            options.mounting = Mounting {
                roll_deg: 1.0,
                ..options.mounting
            };
        }),
    ]
}

fn pitch_um(scene: &Scene) -> f64 {
    1000.0 * hivtac_twin::FOCAL_LENGTH_MM / scene.camera().focal_px()
}

fn light() -> Vec<Effect> {
    vec![
        on(
            "falloff",
            "three tenths of the light lost 75° off the axis",
            |_, options| {
                options.falloff = 0.3;
            },
        ),
        on(
            "gradient",
            "60 % more light at the right edge, 60 % less at the left",
            |_, options| {
                options.gradient = [0.6, 0.0];
            },
        ),
        on("dim light", "half the light", |_, options| {
            options.gain = 0.5
        }),
        on("dark", "0.28 of the light", |_, options| {
            options.gain = 0.28
        }),
        on("haze", "veiling light of 20 levels", |_, options| {
            options.haze = 20.0
        }),
        on(
            "warm cast",
            "10 % more red, 10 % less blue",
            |_, options| {
                options.white_balance = [1.1, 1.0, 0.9];
            },
        ),
        on(
            "glare",
            "a reflection of 0.1 mm on a marker's rim",
            |_, options| {
                options.patches.push(Patch {
                    centre_mm: [3.4, -3.4],
                    radius_mm: 0.1,
                    paint: Paint::Glare,
                });
            },
        ),
    ]
}

fn sensor() -> Vec<Effect> {
    [
        off("noise", "no noise", |_, options| options.noise = 0.0),
        Effect {
            compare: Compare::Truth,
            ..off("pixel grid", "the true centroids", |_, _| {})
        },
        on(
            "texture",
            "brightness uneven by 3 % from pixel to pixel",
            |_, options| {
                options.texture = 0.03;
            },
        ),
        on(
            "salt",
            "0.1 % of all pixels show the markers' red",
            |_, options| {
                options.salt = Salt {
                    fraction: 0.001,
                    paint: Paint::Red,
                };
            },
        ),
        on(
            "rolling shutter",
            "a sixtieth of a second from first row to last",
            |_, options| {
                options.shutter.readout_s = 1.0 / 60.0;
            },
        ),
        on("motion blur", "exposures of 5 ms", |_, options| {
            options.shutter = Shutter {
                exposure_s: 0.005,
                ..options.shutter
            };
        }),
        on("YUV422", "chroma shared by two pixels", |_, options| {
            options.format = Format::Yuv422;
        }),
        on("JPEG", "quality 85", |_, options| {
            options.format = Format::Jpeg { quality: 85 };
        }),
    ]
    .into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_twin::Preset;
    use std::collections::BTreeSet;

    #[test]
    fn every_effect_changes_a_moving_picture_and_says_how() {
        let sweep = Scene::preset("sweep", Preset::Ov7725, 320, 240, 1).unwrap();
        let names: BTreeSet<&str> = effects().iter().map(|effect| effect.name).collect();
        assert_eq!(names.len(), effects().len());
        for effect in effects() {
            assert!(!effect.what.is_empty());
            let switched = effect.switch(&sweep).unwrap();
            let same = switched.frame(9, 4.9).to_rgb888() == sweep.frame(9, 4.9).to_rgb888();
            assert_eq!(same, effect.compare == Compare::Truth, "{}", effect.name);
            assert_eq!(switched.motion(), sweep.motion());
        }
    }

    #[test]
    fn an_effect_leaves_the_others_alone() {
        let sweep = Scene::preset("sweep", Preset::Paper, 320, 240, 1).unwrap();
        let dim = Options {
            gain: 0.7,
            ..Options::default()
        };
        let sweep = sweep.with_options(dim).unwrap();
        let dims = ["dim light", "dark"];
        for effect in effects() {
            let kept = effect.switch(&sweep).unwrap().options().gain == 0.7;
            assert_eq!(kept, !dims.contains(&effect.name), "{}", effect.name);
        }
    }
}
