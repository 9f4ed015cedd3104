//! Colours, and the light on the film.
//!
//! Channels are proportional to the light (no gamma), so that a half-covered pixel is half-way
//! between two colours. The film fills the picture.

use crate::camera::centre;
use crate::camera::radians;
use crate::{Camera, Options, Paint, Room, noise};
use hivtac_terms::fixed::Q;

/// A channel in 8-bit levels, before it is rounded to a pixel's code.
pub(crate) type Channel<T = i32> = Q<6, T>;
/// Number of steps per level.
pub(crate) const STEPS: f64 = 64.0;
/// The brightest channel.
pub(crate) const WHITE: Channel = Q::from_bits(255 << 6);
/// The film, a translucent, slightly warm grey: saturation 37 of 255, far below the red
/// threshold's 100.
const FILM_COLOUR: [f64; 3] = [150.0, 141.0, 128.0];
/// Red tape: hue 179, saturation 197 of 255, and a value that meets the threshold's 45 at a gain of
/// about 0.3.
const RED_COLOUR: [f64; 3] = [160.0, 36.0, 40.0];
/// A lamp's reflection: white even in dim light.
const GLARE_COLOUR: [f64; 3] = [2000.0; 3];
/// Matte black paint: it reflects about 7 %; the film reflects or lets through about 40 %.
const BLACK_COLOUR: [f64; 3] = [25.0, 24.0, 22.0];
/// Blue tape: hue 105, as bright in blue as the red tape is in red.
const BLUE_COLOUR: [f64; 3] = [30.0, 75.0, 120.0];
/// Fair skin: it reflects 55, 36 and 28 % of red, green and blue; the film 40 % of green. Hue 9,
/// saturation 125 of 255: within the default threshold.
const SKIN_COLOUR: [f64; 3] = [194.0, 127.0, 99.0];
/// The angle to which [`Options::falloff`] refers, degrees.
const FALLOFF_ANGLE_DEG: f64 = 75.0;

impl Paint {
    /// Returns its level in a camera of [`Format::Mono`](crate::Format::Mono) with these weights,
    /// in the nominal light.
    pub fn level(self, mono: [f64; 3]) -> f64 {
        let colour = self.colour();
        mono.iter().zip(colour).map(|(w, c)| w * c).sum()
    }

    fn colour(self) -> [f64; 3] {
        match self {
            Paint::Red => RED_COLOUR,
            Paint::Film => FILM_COLOUR,
            Paint::Glare => GLARE_COLOUR,
            Paint::Black => BLACK_COLOUR,
            Paint::Blue => BLUE_COLOUR,
            Paint::Skin => SKIN_COLOUR,
        }
    }
}

/// The light on each pixel, and the picture of the bare film in it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Light {
    /// Brightness per pixel, row by row; 1 is nominal.
    brightness: Vec<f64>,
    /// The levels added to red, green and blue before their gain.
    haze: f64,
    /// Gain of red, green and blue.
    balance: [f64; 3],
    /// The room behind the film.
    room: Room,
    /// The film without markers.
    film: Vec<[Channel<i16>; 3]>,
}

impl Light {
    pub(crate) fn new(camera: &Camera, options: &Options, seed: u64) -> Light {
        let mut light = Light {
            brightness: brightness(camera, options, seed),
            haze: options.haze * options.gain,
            balance: options.white_balance,
            room: options.room.clone(),
            film: Vec::new(),
        };
        let width = camera.width() as usize;
        let square_px = options.checkerboard_px * options.finer();
        let paint = |pixel: usize| board(square_px, pixel % width, pixel / width);
        let pixels = light.brightness.iter().enumerate();
        light.film = pixels
            .map(|(pixel, &brightness)| {
                let colour = light.colour(paint(pixel));
                light.seen(colour, brightness).map(channel)
            })
            .collect();
        light
    }

    /// Returns the picture of the film without markers.
    pub(crate) fn bare_film(&self) -> Vec<[Channel<i16>; 3]> {
        self.film.clone()
    }

    /// Returns the colour of a paint on the film. The film's own includes the light through it.
    pub(crate) fn colour(&self, paint: Paint) -> [f64; 3] {
        match paint {
            Paint::Film => self.room.through(FILM_COLOUR, FILM_COLOUR),
            other => other.colour(),
        }
    }

    /// Returns the film's colour in front of a thing of this paint in the room.
    pub(crate) fn before(&self, thing: Paint) -> [f64; 3] {
        self.room.through(FILM_COLOUR, thing.colour())
    }

    /// Returns the film's colour where a finger touches it.
    pub(crate) fn before_a_finger(&self) -> [f64; 3] {
        self.room.through_to_touching(FILM_COLOUR, SKIN_COLOUR)
    }

    /// Returns the colour of a pixel, a part (0 to 1) of it in another colour.
    pub(crate) fn painted(
        &self,
        pixel: usize,
        below: [Channel<i16>; 3],
        colour: [f64; 3],
        part: f64,
    ) -> [Channel<i16>; 3] {
        let above = self.seen(colour, self.brightness[pixel]);
        std::array::from_fn(|c| {
            let below = f64::from(below[c].bits());
            channel(below + (above[c] - below) * part)
        })
    }

    /// Returns a colour in light of a brightness, in steps, at most white: a camera clips brighter
    /// values.
    fn seen(&self, colour: [f64; 3], brightness: f64) -> [f64; 3] {
        std::array::from_fn(|c| {
            let level = (colour[c] * brightness + self.haze) * self.balance[c];
            (level * STEPS).min(f64::from(WHITE.bits()))
        })
    }

    /// Returns a paint's colour in the light of the picture's middle.
    pub(crate) fn in_the_middle(&self, paint: Paint) -> [Channel; 3] {
        let middle = self.brightness[self.brightness.len() / 2];
        let seen = self.seen(self.colour(paint), middle);
        seen.map(|steps| channel(steps).into())
    }
}

/// Returns the paint at a pixel of a checkerboard; without squares it is the film everywhere.
fn board(square_px: u32, x: usize, y: usize) -> Paint {
    let square = square_px as usize;
    match square > 0 && (x / square + y / square) % 2 == 1 {
        true => Paint::Red,
        false => Paint::Film,
    }
}

fn brightness(camera: &Camera, options: &Options, seed: u64) -> Vec<f64> {
    let pixels = (0..camera.height()).flat_map(|y| (0..camera.width()).map(move |x| [x, y]));
    let smooth = pixels.map(|pixel| brightness_at(camera, options, pixel.map(f64::from)));
    if options.texture == 0.0 {
        return smooth.collect();
    }
    let uneven = noise::pattern(seed).map(|z| (1.0 + options.texture * z).max(0.0));
    smooth
        .zip(uneven)
        .map(|(light, part)| light * part)
        .collect()
}

/// Returns the brightness at a pixel, from gain, gradient across the picture, and falloff with the
/// square of the angle off the axis.
fn brightness_at(camera: &Camera, options: &Options, [x, y]: [f64; 2]) -> f64 {
    let across = |v: f64, count: u32| (v - centre(count)) / centre(count);
    let slope = options.gradient[0] * across(x, camera.width())
        + options.gradient[1] * across(y, camera.height());
    let angle = camera.view_angle([x, y]) / radians(FALLOFF_ANGLE_DEG);
    let falloff = 1.0 - options.falloff * angle * angle;
    options.gain * (1.0 + slope).max(0.0) * falloff.max(0.0)
}

/// Returns the channel nearest to a number of steps.
fn channel(steps: f64) -> Channel<i16> {
    Q::from_bits(steps.round() as i16)
}
