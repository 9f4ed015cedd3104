//! Finds the threshold that separates dots from film.

use super::levels::{Histogram, Scale};
use hivtac_host::focus::checks::{DARKEST_VALUES, advice};
use hivtac_host::focus::dots::Dots;
use hivtac_host::focus::seen::{NotSeen, Spot, found_by_sensing};
use hivtac_host::frame::Frame;
use hivtac_terms::hsv::Hsv;
use hivtac_terms::threshold::{HsvBox, PixelFormat, Threshold};
use hivtac_wire::message::DeviceHello;

/// Distance between two limits that are tried.
const STEP: usize = 4;
/// Largest part of a picture in the dots' colour, for each dot: three times a dot's own.
const DOT_PART: f64 = 0.0075;
/// Fewest limits that must show the same number of blobs, for these to be objects instead of noise.
const FEWEST: usize = 3;
/// Margin of a threshold, in levels: above nearly all of the film, below nearly all of the dots.
/// Five standard deviations (2.5 levels each) of the simulated camera's noise; the quantiles allow
/// for three.
const MARGIN: u8 = 12;
/// Part of the film's pixels that are not above its upper level, and part of the dots' pixels that
/// are not below their lower level.
const NEARLY_ALL: [f64; 2] = [0.999, 0.99];
/// A dot's colour is the colour of the pixels within this part of its radius. The film's is that of
/// the pixels beyond [`BEYOND`] radii from every dot.
const CORE: f64 = 0.5;
/// See [`CORE`].
const BEYOND: f64 = 1.6;
/// The film near the dots is the film within this many radii of a dot.
const NEAR: f64 = 4.0;
/// Margin of a box around the dots' hues, in units of 2°: as wide as the usual box's beyond red
/// tape in white light.
const HUE_MARGIN: i16 = 8;
/// A picture with a median below this, of 255, has no distinguishable colours.
const DARK: u8 = 20;
/// From this median on, most of a picture is white.
const WHITE: u8 = 240;

/// A device, and the dots on its film.
type Film<'a> = (&'a DeviceHello, Dots);

/// Advice about pale dots.
const PALE: &str = "use dots of a stronger colour, white light, and no light from outside";

/// The levels on both sides of a threshold, each from 0 to 255 on the scale.
#[derive(Clone, Copy, Debug)]
pub struct Levels {
    /// The film's median.
    pub film: u8,
    /// 99.9 % of the film are not above.
    pub film_high: u8,
    /// 99 % of the dots' cores are not below.
    pub dots_low: u8,
    /// The median of the dots' cores.
    pub dots: u8,
}

/// The threshold that was found.
#[derive(Clone, Debug)]
pub struct Found {
    pub scale: Scale,
    pub levels: Levels,
    /// The dots of the film.
    pub dots: Dots,
    /// First and last limit of the widest range in which the sensing finds all markers.
    pub span: [u8; 2],
    pub chosen: Threshold,
    /// The model's threshold, if that also separates dots from film.
    pub model: Option<Threshold>,
    /// The colour of the dots' cores, for RGB565.
    pub colour: Option<Colour>,
}

impl Found {
    /// The model's threshold if it separates, because only that one gives forces; otherwise the
    /// chosen one.
    pub fn wanted(&self) -> Threshold {
        self.model.unwrap_or(self.chosen)
    }
}

/// The colour of the dots' cores: the range of 98 % of their hues, and the value that 99 % reach.
#[derive(Clone, Copy, Debug)]
pub struct Colour {
    /// First and last hue, 0–179; a first above the last wraps through 0.
    pub hues: [u8; 2],
    pub value_low: u8,
}

/// Finds the threshold in pictures of one device.
///
/// # Errors
/// Why the pictures do not separate dots from film, and what to do.
pub fn find(frames: &[Frame], device: &DeviceHello) -> Result<Found, String> {
    let brightness = brightness(frames);
    if brightness < DARK {
        return Err(format!(
            "the picture is dark (half of it is below {DARK} of 255): take the cap off the lens, \
             switch the light on, then `hivtac expose`"
        ));
    }
    let dots = Dots::of(device).map_err(|failure| failure.to_string())?;
    of_brightness(frames, (device, dots), brightness).map_err(|why| match brightness {
        WHITE.. => format!(
            "the picture is white (half of it is at least {WHITE} of 255): less light, then \
             `hivtac expose`; {why}"
        ),
        _ => why,
    })
}

/// Finds the threshold in pictures that are not dark.
fn of_brightness(frames: &[Frame], of: Film<'_>, brightness: u8) -> Result<Found, String> {
    let format = frames[0].format();
    let scale = Scale::of(format, brightness);
    let pictures: Vec<Picture> = frames.iter().map(|it| Picture::of(it, scale)).collect();
    let span = span(&pictures, of, scale)?;
    let middle = span[0].midpoint(span[1]);
    let spots = markers(&pictures, of, scale.threshold(middle)).map_err(|it| advice(&it))?;
    let seen = levels(&pictures, &spots, f64::INFINITY);
    let level = limit(scale, &seen).map_err(|why| {
        let beside_dots = levels(&pictures, &spots, NEAR);
        match limit(scale, &beside_dots) {
            Ok(_) => "something else in the picture has the dots' colour: take it out of view, \
                      or cover it"
                .to_owned(),
            Err(_) => why,
        }
    })?;
    let colour = (format == PixelFormat::Rgb565).then(|| colour(&pictures, &spots));
    let chosen = match (scale.threshold(level), colour) {
        (Threshold::Rgb565(it), Some(colour)) => Threshold::Rgb565(narrowed(it, &colour)),
        (threshold, _) => threshold,
    };
    markers(&pictures, of, chosen).map_err(|it| advice(&it))?;
    let is_good = |it: &Threshold| {
        separates(it, &seen, colour.as_ref()) && markers(&pictures, of, *it).is_ok()
    };
    let (device, dots) = of;
    let model = device.model.as_ref().map(|model| model.threshold);
    Ok(Found {
        dots,
        scale,
        levels: seen,
        span,
        chosen,
        model: model.filter(is_good),
        colour,
    })
}

/// A frame with the level of each pixel.
struct Picture<'f> {
    frame: &'f Frame,
    levels: Vec<u8>,
}

impl<'f> Picture<'f> {
    fn of(frame: &'f Frame, scale: Scale) -> Picture<'f> {
        let levels = scale.levels(frame);
        Picture { frame, levels }
    }

    /// Distance of a pixel from the nearest spot, in radii of that spot.
    fn off(&self, index: usize, spots: &[Spot]) -> f64 {
        let width = usize::from(self.frame.width);
        let (x, y) = ((index % width) as f64, (index / width) as f64);
        let off = |spot: &Spot| (x - spot.centre[0]).hypot(y - spot.centre[1]) / spot.radius;
        spots.iter().map(off).fold(f64::INFINITY, f64::min)
    }
}

/// Median of the frames' value (RGB565) or luma.
fn brightness(frames: &[Frame]) -> u8 {
    let values = frames.iter().flat_map(|frame| match frame.format() {
        PixelFormat::Rgb565 => {
            let value = |pixel| Hsv::from_rgb565(pixel).value;
            frame.pixels().into_iter().map(value).collect::<Vec<_>>()
        }
        PixelFormat::Yuv422 => frame.bytes.iter().copied().step_by(2).collect(),
        PixelFormat::Mono => frame.bytes.clone(),
    });
    Histogram::of(values).quantile(0.5)
}

/// The markers in every picture, as the sensing finds them with a threshold.
fn markers(
    pictures: &[Picture],
    (device, dots): Film<'_>,
    threshold: Threshold,
) -> Result<Vec<Vec<Spot>>, NotSeen> {
    let of_one = |picture: &Picture| found_by_sensing(picture.frame, device, dots, threshold);
    pictures.iter().map(of_one).collect()
}

/// The widest range of limits with which the sensing finds all markers in every picture.
fn span(pictures: &[Picture], of: Film<'_>, scale: Scale) -> Result<[u8; 2], String> {
    let (_, dots) = of;
    let mut best: Option<[u8; 2]> = None;
    let mut row: Option<[u8; 2]> = None;
    let mut misses = Vec::new();
    let all = pictures.iter().flat_map(|it| it.levels.iter().copied());
    let film = Histogram::of(all).quantile(1.0 - DOT_PART * dots.count() as f64);
    for level in (STEP as u8..=u8::MAX).step_by(STEP) {
        match markers(pictures, of, scale.threshold(level)) {
            Ok(_) => row = Some([row.map_or(level, |[from, _]| from), level]),
            Err(not_seen) => {
                row = None;
                // At lower limits the film passes, and its blobs are not dots.
                if level > film {
                    misses.push(not_seen);
                }
            }
        }
        let length = |row: Option<[u8; 2]>| row.map(|[from, to]| to - from);
        if length(row) > length(best) {
            best = row;
        }
    }
    best.ok_or_else(|| {
        let why = match usual(&misses) {
            Some(not_seen) if not_seen.blobs == dots.count() => format!(
                "{} things are seen, but with none they are whole, equal markers ({}): {PALE}",
                dots.in_words(),
                not_seen.status.join(" ")
            ),
            Some(not_seen) => advice(not_seen),
            None => "nothing in the picture has another colour than the film: are the dots in \
                     view, red (dark ones for a mono camera), and without glare?"
                .to_owned(),
        };
        format!(
            "with no limit of the {} {} dots are found: {why}",
            scale.name(),
            dots.in_words()
        )
    })
}

/// The most frequent result among limits that show blobs; `None` if no result is frequent enough.
fn usual(misses: &[NotSeen]) -> Option<&NotSeen> {
    let count = |blobs: usize| misses.iter().filter(|it| it.blobs == blobs).count();
    let is_seen = |it: &&NotSeen| it.blobs > 0 && count(it.blobs) >= FEWEST;
    let of_dots = misses.iter().filter(is_seen);
    of_dots.max_by_key(|it| count(it.blobs))
}

/// Levels of the dots, and of the film within `within` radii of a dot.
fn levels(pictures: &[Picture], spots: &[Vec<Spot>], within: f64) -> Levels {
    let of = |is_wanted: &dyn Fn(f64) -> bool| {
        let both = pictures.iter().zip(spots);
        Histogram::of(both.flat_map(|(picture, spots)| {
            let pixels = picture.levels.iter().enumerate();
            pixels
                .filter(|(index, _)| is_wanted(picture.off(*index, spots)))
                .map(|(_, level)| *level)
                .collect::<Vec<_>>()
        }))
    };
    let (film, dots) = (
        of(&|off| off > BEYOND && off <= within),
        of(&|off| off <= CORE),
    );
    Levels {
        film: film.quantile(0.5),
        film_high: film.quantile(NEARLY_ALL[0]),
        dots_low: dots.quantile(1.0 - NEARLY_ALL[1]),
        dots: dots.quantile(0.5),
    }
}

/// The limit half way between the medians of film and dots, or as near to it as the margins allow.
/// At half way lies a pixel that a dot covers by half.
pub fn limit(scale: Scale, levels: &Levels) -> Result<u8, String> {
    let least = levels.film_high.saturating_add(MARGIN);
    let most = levels.dots_low.saturating_sub(MARGIN);
    if least > most {
        return Err(format!(
            "the {} of the film goes up to {}, that of the dots down to {}, and {} are needed \
             between them: {PALE}",
            scale.name(),
            levels.film_high,
            levels.dots_low,
            2 * MARGIN
        ));
    }
    Ok(levels.film.midpoint(levels.dots).clamp(least, most))
}

/// Whether a threshold of the same format lies between film and dots, with the margins.
fn separates(threshold: &Threshold, levels: &Levels, colour: Option<&Colour>) -> bool {
    let limit = Scale::limit(threshold);
    let is_between =
        limit >= levels.film_high + MARGIN && limit.saturating_add(MARGIN) <= levels.dots_low;
    let holds_colour = match (threshold, colour) {
        (Threshold::Rgb565(it), Some(colour)) => {
            let hue_is_in = |hue| {
                it.contains(Hsv {
                    hue,
                    saturation: it.saturation_high,
                    value: it.value_high,
                })
            };
            f64::from(it.value_low) * DARKEST_VALUES <= f64::from(colour.value_low)
                && colour.hues.into_iter().all(hue_is_in)
        }
        (Threshold::Rgb565(_), None) | (Threshold::Yuv422(_) | Threshold::Mono(_), Some(_)) => {
            false
        }
        (Threshold::Yuv422(_), None) => true,
        (Threshold::Mono(it), None) => it.low == 0,
    };
    is_between && holds_colour
}

fn colour(pictures: &[Picture], spots: &[Vec<Spot>]) -> Colour {
    let both = pictures.iter().zip(spots);
    let core: Vec<Hsv> = both
        .flat_map(|(picture, spots)| {
            let pixels = picture.frame.pixels().into_iter().enumerate();
            pixels
                .filter(|(index, _)| picture.off(*index, spots) <= CORE)
                .map(|(_, pixel)| Hsv::from_rgb565(pixel))
                .collect::<Vec<_>>()
        })
        .collect();
    // Counted from the hue opposite to red, which keeps all reds together.
    let turned = Histogram::of(core.iter().map(|it| beside(it.hue, 90)));
    let hue = |part| beside(turned.quantile(part), 90);
    Colour {
        hues: [hue(1.0 - NEARLY_ALL[1]), hue(NEARLY_ALL[1])],
        value_low: Histogram::of(core.iter().map(|it| it.value)).quantile(1.0 - NEARLY_ALL[1]),
    }
}

/// The hue at distance `by` from a hue, on the circle of 180.
fn beside(hue: u8, by: i16) -> u8 {
    (i16::from(hue) + by).rem_euclid(180) as u8
}

/// A box around a colour: its hues with a margin, and half of its value, which suffices in half of
/// the light.
fn narrowed(wide: HsvBox, colour: &Colour) -> HsvBox {
    HsvBox {
        hue_low: beside(colour.hues[0], -HUE_MARGIN),
        hue_high: beside(colour.hues[1], HUE_MARGIN),
        value_low: (f64::from(colour.value_low) / DARKEST_VALUES) as u8,
        ..wide
    }
}
