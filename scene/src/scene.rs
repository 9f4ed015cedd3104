//! The scene: what presses the sensor, and the frames its camera takes of it.

use crate::coverage::Coverage;
use crate::disc::Outline;
use crate::frame::rgb565;
use crate::light::{Light, STEPS};
use crate::motion::Motion;
use crate::noise::Noise;
use crate::{
    Camera, Disc, Film, Frame, Load, MARKERS, MarkerTruth, Options, Paint, Preset, SceneError,
    StandInFilm, Truth,
};

/// A simulated sensor and what presses it. Frames depend on nothing but the scene and the arguments.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    film: StandInFilm,
    camera: Camera,
    motion: Motion,
    options: Options,
    seed: u64,
    light: Light,
    noise: Noise,
}

impl Scene {
    /// A scene by name, with default options, at a frame size (4:3, 160×120 to 800×600). The seed decides the noise,
    /// and where `demo` starts.
    ///
    /// - `rest`: nothing presses.
    /// - `static`: 0.1 N at α = 4°, β = −3°.
    /// - `demo`: a tenth of a second of rest, then a tip whose force wanders smoothly, |F| 0.02–0.2 N, |α| ≤ 8°,
    ///   |β| ≤ 6°.
    /// - `sweep`: |F| goes 0 → 0.2 N → 0 in 4 s, again and again; straight, then at α = ±8°, then at β = ±6°.
    ///
    /// # Errors
    /// When there is no scene of that name or the size is another.
    pub fn preset(
        name: &str,
        preset: Preset,
        width: u32,
        height: u32,
        seed: u64,
    ) -> Result<Scene, SceneError> {
        let camera = Camera::new(preset, width, height)?;
        let options = Options::default();
        Ok(Scene {
            film: StandInFilm,
            motion: Motion::named(name, seed)?,
            light: Light::new(&camera, &options),
            noise: Noise::new(options.noise * STEPS, seed),
            camera,
            options,
            seed,
        })
    }

    /// The same scene under one constant load.
    ///
    /// # Errors
    /// When the film cannot take the load.
    pub fn with_load(mut self, load: Load) -> Result<Scene, SceneError> {
        self.film.check(&load)?;
        self.motion = Motion::Static(load);
        Ok(self)
    }

    /// The same scene under other conditions.
    ///
    /// # Errors
    /// When an option is outside its range.
    pub fn with_options(mut self, options: Options) -> Result<Scene, SceneError> {
        options.check()?;
        self.camera = self.camera.mounted(&options.mounting);
        self.light = Light::new(&self.camera, &options);
        self.noise = Noise::new(options.noise * STEPS, self.seed);
        self.options = options;
        Ok(self)
    }

    /// The camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// The conditions.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// The frame taken at a time in seconds; its number selects its noise.
    pub fn frame(&self, number: u64, time_s: f64) -> Frame {
        self.expose(&self.motion.load(time_s), number)
    }

    /// What is true at a time in seconds, without rendering.
    pub fn truth(&self, time_s: f64) -> Truth {
        let load = self.motion.load(time_s);
        self.truth_of(&load, &self.marker_images(&load))
    }

    /// A frame under any load, whatever the scene's motion; the number selects its noise.
    ///
    /// # Errors
    /// When the film cannot take the load.
    pub fn render_load(&self, load: &Load, number: u64) -> Result<Frame, SceneError> {
        self.film.check(load)?;
        Ok(self.expose(load, number))
    }

    fn expose(&self, load: &Load, number: u64) -> Frame {
        let markers = self.marker_images(load);
        let mut picture = self.light.bare_film();
        for image in markers.iter().flatten() {
            self.paint(&mut picture, image, Paint::Red);
        }
        for patch in &self.options.patches {
            let disc = Disc {
                centre_mm: patch.centre_mm,
                radius_mm: patch.radius_mm,
            };
            self.paint(&mut picture, &self.image(&disc, load), patch.paint);
        }
        Frame {
            width: self.camera.width(),
            height: self.camera.height(),
            pixels: self.digitize(&picture, number),
            truth: self.truth_of(load, &markers),
        }
    }

    fn image(&self, disc: &Disc, load: &Load) -> Outline {
        disc.image(&self.film, load, &self.camera)
    }

    /// The images of the markers that have not come off.
    fn marker_images(&self, load: &Load) -> [Option<Outline>; 4] {
        std::array::from_fn(|id| {
            let there = !self.options.missing[id];
            there.then(|| self.image(&MARKERS[id], load))
        })
    }

    fn paint(&self, picture: &mut [[i16; 3]], image: &Outline, paint: Paint) {
        let (width, height) = (self.camera.width(), self.camera.height());
        for (pixel, part) in Coverage::of(image).pixels(width, height) {
            picture[pixel] = self.light.painted(pixel, picture[pixel], paint, part);
        }
    }

    fn digitize(&self, picture: &[[i16; 3]], number: u64) -> Vec<u16> {
        let noisy = |(&clean, noise): (&[i16; 3], [i32; 3])| {
            rgb565(std::array::from_fn(|c| i32::from(clean[c]) + noise[c]))
        };
        let noise = self.noise.of_frame(number);
        picture.iter().zip(noise).map(noisy).collect()
    }

    fn truth_of(&self, load: &Load, markers: &[Option<Outline>; 4]) -> Truth {
        Truth {
            force: *load,
            markers: std::array::from_fn(|id| self.marker_truth(markers[id].as_ref()?)),
        }
    }

    fn marker_truth(&self, image: &Outline) -> Option<MarkerTruth> {
        let (area_px2, centroid_px) = image.area_and_centroid();
        let inside = image.clipped(self.camera.width(), self.camera.height());
        let visible = inside.area() / area_px2;
        (visible > 0.0).then_some(MarkerTruth {
            centroid_px,
            area_px2,
            visible: visible.min(1.0),
        })
    }
}
