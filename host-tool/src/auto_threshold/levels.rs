//! Measures how much each pixel looks like a dot, as one number from 0 to 255 for a threshold.

use hivtac_host::frame::Frame;
use hivtac_terms::hsv::Hsv;
use hivtac_terms::threshold::{HsvBox, Mono, PixelFormat, Threshold, Yuv422};

/// First and last hue of a possible dot. The sensing weighs pixels by redness, which excludes hues
/// beyond 60° from red.
const RED_HUES: [u8; 2] = [150, 30];

/// The number along which a threshold separates dots from film.
#[derive(Clone, Copy, Debug)]
pub enum Scale {
    /// RGB565: the saturation of reddish pixels of at least this value; all other pixels have 0.
    Saturation {
        /// Lowest value of a considered pixel; in the dark, noise has every colour.
        value_low: u8,
    },
    /// YUV422: Cr.
    Cr,
    /// Mono: 255 less the pixel's luma; dots are dark.
    Darkness,
}

impl Scale {
    /// The scale for frames of this format with a median value of `brightness`.
    pub fn of(format: PixelFormat, brightness: u8) -> Scale {
        match format {
            // Finds a dot in a quarter of the light.
            PixelFormat::Rgb565 => Scale::Saturation {
                value_low: (brightness / 4).max(1),
            },
            PixelFormat::Yuv422 => Scale::Cr,
            PixelFormat::Mono => Scale::Darkness,
        }
    }

    /// Its name, for a person.
    pub fn name(self) -> &'static str {
        match self {
            Scale::Saturation { .. } => "saturation",
            Scale::Cr => "Cr",
            Scale::Darkness => "255 − luma",
        }
    }

    /// The number of each pixel, row after row, without pixels outside the picture.
    pub fn levels(self, frame: &Frame) -> Vec<u8> {
        let pixels = frame.pixels();
        match self {
            Scale::Saturation { .. } => {
                let reddish = self.threshold(0);
                let level = |pixel| {
                    let colour = Hsv::from_rgb565(pixel);
                    match reddish {
                        Threshold::Rgb565(it) if it.contains(colour) => colour.saturation,
                        _ => 0,
                    }
                };
                pixels.into_iter().map(level).collect()
            }
            Scale::Cr => {
                let pairs = pixels.as_chunks::<2>().0.iter();
                pairs
                    .flat_map(|[_, right]| [(right >> 8) as u8; 2])
                    .collect()
            }
            Scale::Darkness => frame.bytes.iter().map(|luma| 255 - luma).collect(),
        }
    }

    /// The threshold that passes pixels from `level` up.
    pub fn threshold(self, level: u8) -> Threshold {
        match self {
            Scale::Saturation { value_low } => Threshold::Rgb565(HsvBox {
                hue_low: RED_HUES[0],
                hue_high: RED_HUES[1],
                saturation_low: level,
                saturation_high: 255,
                value_low,
                value_high: 255,
            }),
            Scale::Cr => Threshold::Yuv422(Yuv422 { cr_low: level }),
            Scale::Darkness => Threshold::Mono(Mono {
                low: 0,
                high: 255 - level,
            }),
        }
    }

    /// The level from which a threshold of the same format passes pixels.
    pub fn limit(threshold: &Threshold) -> u8 {
        match threshold {
            Threshold::Rgb565(it) => it.saturation_low,
            Threshold::Yuv422(it) => it.cr_low,
            Threshold::Mono(it) => 255 - it.high,
        }
    }
}

/// How often each number from 0 to 255 occurs.
#[derive(Clone, Debug)]
pub struct Histogram([u32; 256]);

impl Histogram {
    /// The histogram of these numbers.
    pub fn of(numbers: impl IntoIterator<Item = u8>) -> Histogram {
        let mut counts = [0; 256];
        numbers
            .into_iter()
            .for_each(|number| counts[usize::from(number)] += 1);
        Histogram(counts)
    }

    /// The smallest number that at least `part` (0 to 1) of all numbers do not exceed; 0 if empty.
    pub fn quantile(&self, part: f64) -> u8 {
        let all: u32 = self.0.iter().sum();
        let wanted = f64::from(all) * part;
        let mut below = 0;
        let reached = |&count: &u32| {
            below += count;
            f64::from(below) >= wanted
        };
        self.0.iter().position(reached).unwrap_or(0) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_numbers_that_occur() {
        let histogram = Histogram::of((1..=100).chain([200; 100]));
        assert_eq!(histogram.quantile(0.0), 0);
        assert_eq!(histogram.quantile(0.005), 1);
        assert_eq!(histogram.quantile(0.25), 50);
        assert_eq!(histogram.quantile(0.501), 200);
        assert_eq!(Histogram::of([]).quantile(0.5), 0);
    }

    /// A threshold at a level passes exactly the pixels of at least that level.
    #[test]
    fn a_level_is_what_a_threshold_lets_pass() {
        let every = |pixel: u16| pixel.to_be_bytes();
        let scale = Scale::Saturation { value_low: 40 };
        let frame = Frame {
            number: 0,
            time_us: 0,
            width: 256,
            height: 256,
            threshold: scale.threshold(0),
            bytes: (0..=u16::MAX).flat_map(every).collect(),
        };
        let levels = scale.levels(&frame);
        for limit in [1, 100, 180] {
            let Threshold::Rgb565(it) = scale.threshold(limit) else {
                panic!("a box of colours")
            };
            for (pixel, level) in (0..=u16::MAX).zip(&levels) {
                let passes = it.contains(Hsv::from_rgb565(pixel));
                assert_eq!(passes, *level >= limit, "{pixel:#06x}");
            }
        }
    }
}
