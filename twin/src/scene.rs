//! The scene: the load on the sensor, and the camera's frames of it.

use std::borrow::Cow;

use crate::bayer;
use crate::coverage::Coverage;
use crate::exposure::{Exposure, Image};
use crate::film::{Dots, Film, Pressed};
use crate::frame::Raster;
use crate::light::{Channel, Light, STEPS};
use crate::motion::Motion;
use crate::noise::{LOTS, Noise};
use crate::{
    Camera, Disc, Format, Frame, Load, Mechanics, Options, Paint, Preset, SceneError, Shutter,
    Truth,
};

/// A simulated sensor and its load. Frames depend only on the scene and the arguments.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    film: Film,
    camera: Camera,
    motion: Motion,
    options: Options,
    seed: u64,
    light: Light,
    noise: Noise,
    specks: Vec<Disc>,
}

impl Scene {
    /// Returns a scene by name, with the preset's options, at a frame size that the preset has
    /// ([`Camera::new`]). The seed decides the noise, and where `demo` starts.
    ///
    /// - `rest`: no load.
    /// - `static`: 0.1 N at α = 4°, β = −3°.
    /// - `demo`: a tenth of a second of rest, then a tip whose force wanders smoothly, |F| 0.02–0.2
    ///   N, |α| ≤ 8°, |β| ≤ 6°.
    /// - `sweep`: |F| goes 0 → 0.2 N → 0 in 4 s, again and again; straight, then at α = ±8°, then
    ///   at β = ±6°.
    /// - `press`, `drag`, `grasp`, `catch`, `vibration`: a tenth of a second of rest, then the
    ///   defaults of [`Press`](crate::Press), [`Drag`](crate::Drag), [`Grasp`](crate::Grasp),
    ///   [`Catch`](crate::Catch) and [`Vibration`](crate::Vibration).
    ///
    /// # Errors
    /// If no scene has that name, or the preset has no frames of that size.
    pub fn preset(
        name: &str,
        preset: Preset,
        width: u32,
        height: u32,
        seed: u64,
    ) -> Result<Scene, SceneError> {
        let camera = Camera::new(preset, width, height)?;
        let options = Options::of(preset);
        Ok(Scene {
            film: Film::default(),
            motion: Motion::named(name, seed)?,
            light: Light::new(&camera, &options, seed),
            noise: Noise::new(options.noise * STEPS, seed),
            specks: Vec::new(),
            camera,
            options,
            seed,
        })
    }

    /// Returns the same scene under one constant load.
    ///
    /// # Errors
    /// If the film cannot take the load.
    pub fn with_load(self, load: Load) -> Result<Scene, SceneError> {
        self.with_motion(Motion::Static(load))
    }

    /// Returns the same scene with another motion.
    ///
    /// # Errors
    /// If a parameter is outside its range, or the film cannot take a load within the motion's
    /// first ten seconds.
    pub fn with_motion(mut self, motion: Motion) -> Result<Scene, SceneError> {
        self.try_motion(&motion)?;
        self.motion = motion;
        Ok(self)
    }

    /// Returns the same scene under other conditions.
    ///
    /// # Errors
    /// If an option is outside its range, or the film that the options describe cannot take the
    /// motion.
    pub fn with_options(mut self, options: Options) -> Result<Scene, SceneError> {
        options.check()?;
        self.film = options.film.film(options.layout, options.glued_mm)?;
        self.camera = self.camera.fitted(&options.lens, &options.mounting);
        let seen = self.camera.finer(options.finer());
        self.light = Light::new(&seen, &options, self.seed);
        self.specks = options.specks.discs(self.seed);
        self.noise = Noise::new(options.noise * STEPS, self.seed);
        let other_film = self.options.film != options.film || self.options.layout != options.layout;
        self.options = options;
        if other_film {
            self.try_motion(&self.motion)?;
        }
        Ok(self)
    }

    fn try_motion(&self, motion: &Motion) -> Result<(), SceneError> {
        motion.check(|load| self.options.film.check(&self.film, load))
    }

    /// Returns the camera.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Returns the load as a function of time.
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// Returns the conditions.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Returns the frame taken at a time in seconds. Its number selects its noise.
    pub fn frame(&self, number: u64, time_s: f64) -> Frame {
        self.frame_by(&self.options.shutter, number, time_s)
    }

    /// As [`Self::frame`], by a camera with another shutter, whose times are in their ranges.
    pub fn frame_by(&self, shutter: &Shutter, number: u64, time_s: f64) -> Frame {
        let force = self.motion.load(time_s);
        self.expose(
            &self.exposure(shutter, self.course(shutter, time_s)),
            &force,
            number,
        )
    }

    /// Returns the effective load, by seconds from a time, while a shutter is open: under it an
    /// elastic film has the shape that this film has under the motion.
    fn course(&self, shutter: &Shutter, time_s: f64) -> impl Fn(f64) -> Load {
        let mechanics = &self.options.film;
        let load = move |time_s| mechanics.completed(&self.motion.load(time_s));
        // The first row is exposed this much earlier than the middle one.
        let begin_s = time_s - shutter.exposure_s - shutter.readout_s;
        let memory = mechanics.creep.memory(begin_s, load);
        move |after_s| {
            let now_s = time_s + after_s;
            memory.after(begin_s, now_s, load).effective(&load(now_s))
        }
    }

    /// Returns the ground truth at a time in seconds, without rendering.
    pub fn truth(&self, time_s: f64) -> Truth {
        self.truth_by(&self.options.shutter, time_s)
    }

    /// As [`Self::truth`], for a camera with another shutter, whose times are in their ranges.
    pub fn truth_by(&self, shutter: &Shutter, time_s: f64) -> Truth {
        let exposure = self.exposure(shutter, self.course(shutter, time_s));
        self.truth_of(
            &exposure,
            &self.motion.load(time_s),
            &self.marker_images(&exposure),
        )
    }

    /// Returns the ground truth under a constant load instead of the scene's motion, without
    /// rendering.
    ///
    /// # Errors
    /// If the film cannot take the load.
    pub fn truth_under(&self, load: &Load) -> Result<Truth, SceneError> {
        self.options.film.check(&self.film, load)?;
        let exposure = self.exposure(&self.options.shutter, |_| *load);
        Ok(self.truth_of(&exposure, load, &self.marker_images(&exposure)))
    }

    /// Returns a frame under a constant load instead of the scene's motion. The number selects its
    /// noise.
    ///
    /// # Errors
    /// If the film cannot take the load.
    pub fn render_load(&self, load: &Load, number: u64) -> Result<Frame, SceneError> {
        self.options.film.check(&self.film, load)?;
        let exposure = self.exposure(&self.options.shutter, |_| *load);
        Ok(self.expose(&exposure, load, number))
    }

    /// Returns the film as it is seen under a load.
    ///
    /// # Errors
    /// If the film cannot take the load.
    pub fn pressed(&self, load: &Load) -> Result<Pressed, SceneError> {
        self.options.film.check(&self.film, load)?;
        Ok(self.options.film.seen(&self.film, load))
    }

    /// Returns a frame of a film whose state comes from elsewhere, such as finite elements. The
    /// number selects its noise; the frame's truth has `load`. The film's markers are those of this
    /// scene.
    pub fn render_pressed(&self, pressed: Pressed, load: &Load, number: u64) -> Frame {
        let shutter = Shutter::default();
        let exposure = Exposure {
            now: pressed,
            ..self.exposure(&shutter, |_| *load)
        };
        self.expose(&exposure, load, number)
    }

    /// As [`Self::render_pressed`], of a film whose points move by `displacement`, mm from rest, of
    /// a point in mm. So the discs' images have their true shape, also where the film is curved
    /// within a disc. The frame's truth has the scene's own tip.
    pub fn render_film(
        &self,
        displacement: impl Fn([f64; 2]) -> [f64; 3],
        load: &Load,
        number: u64,
    ) -> Frame {
        let shutter = Shutter::default();
        let exposure = Exposure {
            exactly: Some(&displacement),
            ..self.exposure(&shutter, |_| *load)
        };
        self.expose(&exposure, load, number)
    }

    /// Returns the ground truth of a film as [`Self::render_pressed`] takes it, without rendering.
    pub fn truth_of_pressed(&self, pressed: Pressed, load: &Load) -> Truth {
        let shutter = Shutter::default();
        let exposure = Exposure {
            now: pressed,
            ..self.exposure(&shutter, |_| *load)
        };
        self.truth_of(&exposure, load, &self.marker_images(&exposure))
    }

    /// Returns the frame of a camera with a shutter under loads in time that are not a [`Motion`].
    /// `load` takes the seconds from the middle of the exposure. The number selects the noise.
    ///
    /// # Errors
    /// If the film cannot take the load at that middle. Loads before and after it are clamped to
    /// the film's limits.
    pub fn frame_under(
        &self,
        shutter: &Shutter,
        number: u64,
        load: impl Fn(f64) -> Load,
    ) -> Result<Frame, SceneError> {
        let force = load(0.0);
        self.options.film.check(&self.film, &force)?;
        Ok(self.expose(&self.exposure(shutter, load), &force, number))
    }

    fn exposure<'a, L: Fn(f64) -> Load>(
        &'a self,
        shutter: &'a Shutter,
        load: L,
    ) -> Exposure<'a, L> {
        Exposure {
            film: &self.film,
            mechanics: &self.options.film,
            camera: &self.camera,
            lens: &self.options.lens,
            shutter,
            now: self.options.film.seen(&self.film, &load(0.0)),
            exactly: None,
            moved: self.options.moved_mm.as_ref(),
            load,
        }
    }

    fn expose<L: Fn(f64) -> Load>(
        &self,
        exposure: &Exposure<'_, L>,
        force: &Load,
        number: u64,
    ) -> Frame {
        let markers = self.marker_images(exposure);
        let picture = self.picture(exposure, &markers);
        let Raster { words, bytes } = self.digitize(&picture, number);
        Frame {
            width: self.camera.width(),
            height: self.camera.height(),
            format: self.options.format,
            pixels: words,
            mono: bytes,
            truth: self.truth_of(exposure, force, &markers),
        }
    }

    /// Returns the images of the markers that have not come off.
    fn marker_images<L: Fn(f64) -> Load>(&self, exposure: &Exposure<'_, L>) -> Vec<Option<Image>> {
        let radius_mm = self.options.layout.diameter_mm() / 2.0;
        let discs = self.film.markers_mm().into_iter().map(|centre_mm| Disc {
            centre_mm,
            radius_mm,
        });
        let images = discs.enumerate().map(|(id, disc)| {
            let there = !self.options.missing.at(id);
            there.then(|| exposure.image(&disc))
        });
        images.collect()
    }

    /// Returns the picture of film, specks, markers and patches in their light, without noise.
    fn picture<L: Fn(f64) -> Load>(
        &self,
        exposure: &Exposure<'_, L>,
        markers: &[Option<Image>],
    ) -> Vec<[Channel<i16>; 3]> {
        let mut picture = self.light.bare_film();
        let colour = |paint| self.light.colour(paint);
        self.paint_behind(&mut picture, exposure);
        for speck in &self.specks {
            self.paint(&mut picture, &exposure.image(speck), colour(Paint::Red));
        }
        for marker in markers.iter().flatten() {
            self.paint(&mut picture, marker, colour(self.options.markers));
        }
        for patch in &self.options.patches {
            let image = exposure.image(&patch.disc());
            self.paint(&mut picture, &image, colour(patch.paint));
        }
        for image in self
            .options
            .board_leds_mm
            .iter()
            .flat_map(|board_mm| exposure.leds(*board_mm))
        {
            self.paint(&mut picture, &image, colour(Paint::Glare));
        }
        picture
    }

    /// Paints the things behind the film: those of the room, and the fingertip that presses.
    fn paint_behind<L: Fn(f64) -> Load>(
        &self,
        picture: &mut [[Channel<i16>; 3]],
        exposure: &Exposure<'_, L>,
    ) {
        let room = &self.options.room;
        for thing in &room.things {
            let image = exposure.far_image(&thing.disc());
            self.paint(picture, &image, self.light.before(thing.paint));
        }
        if room.finger_mm > 0.0 && exposure.now.force_n != [0.0; 3] {
            let finger = Disc {
                centre_mm: exposure.now.touches_mm,
                radius_mm: room.finger_mm,
            };
            self.paint(
                picture,
                &exposure.image(&finger),
                self.light.before_a_finger(),
            );
        }
    }

    fn paint(&self, picture: &mut [[Channel<i16>; 3]], image: &Image, colour: [f64; 3]) {
        let finer = self.options.finer();
        let [width, height] = [self.camera.width(), self.camera.height()].map(|side| side * finer);
        let image = match finer {
            1 => Cow::Borrowed(image),
            _ => Cow::Owned(bayer::finer(image.clone())),
        };
        for (pixel, part) in Coverage::of(&image, width, height).pixels(width, height) {
            picture[pixel] = self.light.painted(pixel, picture[pixel], colour, part);
        }
    }

    fn digitize(&self, picture: &[[Channel<i16>; 3]], number: u64) -> Raster {
        let width = self.camera.width();
        let is_bayer = self.options.finer() > 1;
        let picture = match is_bayer {
            true => Cow::Owned(bayer::binned(bayer::FINER * width, picture)),
            false => Cow::Borrowed(picture),
        };
        let salt = self.light.in_the_middle(self.options.salt.paint);
        let salted = (self.options.salt.fraction * f64::from(LOTS)) as u32;
        let noise = self.noise.of_frame(number);
        let noisy = picture.iter().zip(noise).map(|(clean, (noise, lot))| {
            let clean = if lot < salted {
                salt
            } else {
                clean.map(Channel::from)
            };
            let clean = self.as_seen(clean);
            std::array::from_fn(|channel| clean[channel] + noise[channel])
        });
        if is_bayer {
            let raw: Vec<[Channel; 3]> = noisy.collect();
            let colours = bayer::interpolated(width, &raw);
            return self.options.format.code(width, colours.into_iter());
        }
        self.options.format.code(width, noisy)
    }

    /// Returns red, green and blue as the camera sees them. A camera without colours gives all
    /// three the same value.
    fn as_seen(&self, colour: [Channel; 3]) -> [Channel; 3] {
        if self.options.format != Format::Mono {
            return colour;
        }
        let weighed = (self.options.mono.iter().zip(colour)).map(|(w, c)| w * f64::from(c.bits()));
        [Channel::from_bits(weighed.sum::<f64>().round() as i32); 3]
    }

    fn truth_of<L: Fn(f64) -> Load>(
        &self,
        exposure: &Exposure<'_, L>,
        force: &Load,
        markers: &[Option<Image>],
    ) -> Truth {
        let Mechanics { creep, .. } = self.options.film;
        let force = self.options.film.completed(force);
        let presses = force.magnitude_n() > 0.0;
        // Force and place are the tip's, independent of creep.
        let touched = match creep.is_elastic() {
            true => exposure.now,
            false => self.options.film.press(&self.film, &force),
        };
        Truth {
            force,
            on_film_n: touched.force_n,
            tip_mm: exposure.now.tip_mm,
            touches_mm: presses.then_some(touched.touches_mm),
            markers: Dots::from_fn(markers.len(), |id| {
                markers[id].as_ref()?.truth(&self.camera)
            }),
        }
    }
}
