//! The effect of an OV7725's registers on brightness and colours, and of an OV5640's.
//!
//! The scene's pixels are those of the sensor with gains that make its light white, the colour
//! matrix of OmniVision's application note, levels in proportion to light, well exposed. Other
//! settings change the pixels relative to these. Gains act before the matrix, which gives Cr and Cb
//! from red, green and blue; luma follows from them by BT.601. Not simulated: the sensor's own
//! filters and noise, automatic white balance, lens correction, edges, gamma and special effects.

use super::registers::{self as reg, Registers};
use crate::frame_source::{Coding, Picture};

type Matrix = [[f64; 3]; 3];

/// Luma, Cb, Cr of red, green, blue: ITU-R BT.601, full range.
const BT601: Matrix = [
    [0.299, 0.587, 0.114],
    [-0.168_736, -0.331_264, 0.5],
    [0.5, -0.418_688, -0.081_312],
];
/// The application note's coefficients 1 to 6: Cr, then Cb.
const APPLICATION_NOTE: [f64; 6] = [176.0, -157.0, -19.0, -22.0, -123.0, 145.0];

/// DSP_CTRL1 bits.
const SPECIAL_EFFECTS: u8 = 0x20;
const GAMMA: u8 = 0x04;
/// MTX_CTRL bit 7: coefficients count twice.
const DOUBLED: u8 = 0x80;
/// AWB_CTRL0 bit 7: the gains are applied. AWB_CTRL1 bit 1: 0x40 is a gain of one, instead of 0x80.
const GAINS_APPLIED: u8 = 0x80;
const UNITY_IS_0X40: u8 = 0x02;

/// The map from the scene's colours to those that are sent.
#[derive(Clone, Debug, PartialEq)]
pub struct Colour {
    /// Red, green, blue to red, green, blue.
    linear: Matrix,
}

impl Colour {
    /// Returns the map for the registers. `response` is the sensor's own to white light in red,
    /// green and blue with the fixed gains of 0x09; `exposed` is the light of the picture over the
    /// light that exposes it well.
    pub fn of(registers: &Registers, response: [f64; 3], exposed: f64) -> Self {
        let control = registers.get(reg::DSP_CTRL1);
        let (gains, fixed) = (gains(registers), fixed_gains(registers));
        let gains: [f64; 3] = std::array::from_fn(|i| gains[i] * fixed[i] * response[i]);
        let mut raw = product(&inverse(&from_raw(&APPLICATION_NOTE)), &BT601);
        for (row, gain) in raw.iter_mut().zip(gains) {
            *row = row.map(|term| term * gain * exposed);
        }
        let seen = if control & reg::COLOUR_MATRIX != 0 {
            product(&from_raw(&coefficients(registers)), &raw)
        } else {
            product(&BT601, &raw)
        };
        Self {
            linear: product(&inverse(&BT601), &seen),
        }
    }

    /// Returns the map of an OV5640 with `matrix`, whose rows give luma, Cb and Cr in any unit, for
    /// scenes that are meant for `reference`. `gains` are those of red, green and blue over the
    /// ones that make white light white and well exposed.
    pub fn between(reference: &[f64; 9], matrix: &[f64; 9], gains: [f64; 3]) -> Self {
        let rows =
            |all: &[f64; 9]| std::array::from_fn(|i| std::array::from_fn(|j| all[3 * i + j]));
        let reference: Matrix = rows(reference);
        let mut raw = product(&inverse(&reference), &BT601);
        for (row, gain) in raw.iter_mut().zip(gains) {
            *row = row.map(|term| term * gain);
        }
        let seen = product(&rows(matrix), &raw);
        Self {
            linear: product(&inverse(&BT601), &seen),
        }
    }

    /// Returns whether it leaves every picture unchanged.
    pub fn is_plain(&self) -> bool {
        let unit = |(i, row): (usize, &[f64; 3])| {
            let terms = row.iter().enumerate();
            terms
                .map(|(j, term)| (term - f64::from(u8::from(i == j))).abs())
                .fold(0.0, f64::max)
        };
        let off = self.linear.iter().enumerate().map(unit);
        // The coefficients are whole numbers; those of their inverse are not.
        off.fold(0.0, f64::max) < 1e-6
    }

    /// Returns the picture that is sent.
    pub fn apply(&self, mut picture: Picture) -> Picture {
        if self.is_plain() {
            return picture;
        }
        match picture.coding {
            Coding::Rgb565 => {
                for pixel in &mut picture.pixels {
                    *pixel = rgb565(self.seen(rgb(*pixel)));
                }
            }
            // Only cameras without colours have this coding.
            Coding::Mono => {}
            Coding::Yuv422 => {
                for pair in picture.pixels.chunks_exact_mut(2) {
                    self.apply_to_pair(pair);
                }
            }
        }
        picture
    }

    /// Changes two pixels of YUV422: luma in the low bytes, Cb and Cr in the high ones.
    fn apply_to_pair(&self, pair: &mut [u16]) {
        let bytes = [pair[0].to_le_bytes(), pair[1].to_le_bytes()];
        let chroma = [bytes[0][1], bytes[1][1]].map(|c| f64::from(c) - 128.0);
        let back = inverse(&BT601);
        let sent = [0, 1].map(|i| {
            let luma = f64::from(bytes[i][0]);
            times(
                &BT601,
                self.seen(times(&back, [luma, chroma[0], chroma[1]])),
            )
        });
        for (i, pixel) in pair.iter_mut().enumerate() {
            let luma = byte(sent[i][0]);
            let chroma = byte((sent[0][1 + i] + sent[1][1 + i]) / 2.0 + 128.0);
            *pixel = u16::from_le_bytes([luma, chroma]);
        }
    }

    fn seen(&self, rgb: [f64; 3]) -> [f64; 3] {
        times(&self.linear, rgb).map(|level| level.clamp(0.0, 255.0))
    }
}

/// Whether the gamma curve or the special effects are on, which are not simulated.
pub fn is_bent(registers: &Registers) -> bool {
    registers.get(reg::DSP_CTRL1) & (GAMMA | SPECIAL_EFFECTS) != 0
}

/// Returns the gains of red, green and blue.
fn gains(registers: &Registers) -> [f64; 3] {
    if registers.get(reg::AWB_CTRL0) & GAINS_APPLIED == 0 {
        return [1.0; 3];
    }
    let unity = match registers.get(reg::AWB_CTRL1) & UNITY_IS_0X40 {
        0 => 128.0,
        _ => 64.0,
    };
    [reg::RED, reg::GREEN, reg::BLUE].map(|gain| f64::from(registers.get(gain)) / unity)
}

/// Returns the fixed gains of red, green and blue, relative to those of 0x09. The size of a step is
/// not documented; it is a quarter here.
fn fixed_gains(registers: &Registers) -> [f64; 3] {
    let code = registers.get(reg::FIXGAIN);
    let gain = |steps: u8| 1.0 + f64::from(steps & 3) / 4.0;
    [gain(code) / gain(1), 1.0, gain(code >> 2) / gain(2)]
}

/// Returns coefficients 1 to 6 of the colour matrix with their signs, on which all sources agree.
fn coefficients(registers: &Registers) -> [f64; 6] {
    let doubled = registers.get(reg::MTX_CTRL) & DOUBLED != 0;
    let strength = if doubled { 2.0 } else { 1.0 };
    let signs = [1.0, -1.0, -1.0, -1.0, -1.0, 1.0];
    std::array::from_fn(|i| {
        let value = registers.get(reg::MTX1 + i as u8);
        f64::from(value) * strength * signs[i]
    })
}

/// Returns the matrix from the sensor's own red, green, blue to luma, Cb and Cr, by coefficients in
/// 256ths.
fn from_raw(coefficients: &[f64; 6]) -> Matrix {
    let [r1, g1, b1, r2, g2, b2] = coefficients.map(|coefficient| coefficient / 256.0);
    [BT601[0], [r2, g2, b2], [r1, g1, b1]]
}

fn rgb(pixel: u16) -> [f64; 3] {
    [
        f64::from(pixel >> 11) * 255.0 / 31.0,
        f64::from(pixel >> 5 & 63) * 255.0 / 63.0,
        f64::from(pixel & 31) * 255.0 / 31.0,
    ]
}

fn rgb565([r, g, b]: [f64; 3]) -> u16 {
    let level = |value: f64, top: f64| (value * top / 255.0).round() as u16;
    level(r, 31.0) << 11 | level(g, 63.0) << 5 | level(b, 31.0)
}

fn byte(level: f64) -> u8 {
    level.round().clamp(0.0, 255.0) as u8
}

fn times(matrix: &Matrix, vector: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let column = |j: usize| times(a, [b[0][j], b[1][j], b[2][j]]);
    let columns = [column(0), column(1), column(2)];
    std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]))
}

/// Returns the inverse by cofactors; `m` must not be singular.
fn inverse(m: &Matrix) -> Matrix {
    let minor = |i: usize, j: usize| {
        let [r0, r1] = [(i + 1) % 3, (i + 2) % 3];
        let [c0, c1] = [(j + 1) % 3, (j + 2) % 3];
        m[r0][c0] * m[r1][c1] - m[r0][c1] * m[r1][c0]
    };
    let determinant: f64 = (0..3).map(|j| m[0][j] * minor(0, j)).sum();
    std::array::from_fn(|i| std::array::from_fn(|j| minor(j, i) / determinant))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns registers with gains of one, the application note's matrix, no gamma, no effects.
    fn application_note() -> Registers {
        let mut registers = Registers::default();
        let matrix = [0xB0, 0x9D, 0x13, 0x16, 0x7B, 0x91, 0x1E];
        for (address, value) in (reg::MTX1..).zip(matrix) {
            registers.write(address, value);
        }
        for (address, value) in [
            (reg::DSP_CTRL1, 0x98),
            (reg::AWB_CTRL0, 0xE0),
            (reg::AWB_CTRL1, 0x5E),
            (reg::FIXGAIN, 0x09),
            (reg::RED, 0x54),
            (reg::GREEN, 0x40),
            (reg::BLUE, 0x6D),
        ] {
            registers.write(address, value);
        }
        registers
    }

    fn sent(registers: &Registers, exposed: f64, pixel: u16) -> u16 {
        let picture = Picture {
            width: 2,
            height: 1,
            coding: Coding::Rgb565,
            pixels: vec![pixel; 2],
        };
        Colour::of(registers, LIGHT, exposed).apply(picture).pixels[0]
    }

    /// The response that the gains above make white.
    const LIGHT: [f64; 3] = [64.0 / 84.0, 1.0, 64.0 / 109.0];
    const GREY: u16 = 16 << 11 | 32 << 5 | 16;
    const RED: u16 = 24 << 11 | 10 << 5 | 5;

    #[test]
    fn the_scenes_colours_are_those_of_the_application_note() {
        assert!(Colour::of(&application_note(), LIGHT, 1.0).is_plain());
        assert_eq!(sent(&application_note(), 1.0, RED), RED);
    }

    #[test]
    fn with_equal_gains_a_neutral_film_is_green() {
        let mut registers = application_note();
        for (address, value) in [(reg::FIXGAIN, 0), (reg::RED, 0x40), (reg::BLUE, 0x40)] {
            registers.write(address, value);
        }
        let [red, green, blue] = rgb(sent(&registers, 1.0, GREY));
        assert!(
            green > 1.5 * red && green > 1.5 * blue,
            "{red} {green} {blue}"
        );
    }

    #[test]
    fn without_a_gain_of_green_a_neutral_film_is_not_neutral() {
        let mut registers = application_note();
        registers.write(reg::GREEN, 0);
        let [red, green, blue] = rgb(sent(&registers, 1.0, GREY));
        assert!(
            green < red / 2.0 && green < blue / 2.0,
            "{red} {green} {blue}"
        );
    }

    #[test]
    fn half_the_matrix_is_half_the_colour() {
        let saturation = |pixel: u16| {
            let [red, green, _] = rgb(pixel);
            1.0 - green / red
        };
        let mut registers = application_note();
        let power_up = [0x2C, 0x24, 0x08, 0x14, 0x24, 0x38, 0x9E];
        for (address, value) in (reg::MTX1..).zip(power_up) {
            registers.write(address, value);
        }
        let [full, half] = [application_note(), registers].map(|r| saturation(sent(&r, 1.0, RED)));
        assert!(half < 0.75 * full, "{half} of {full}");
    }

    #[test]
    fn exposure_scales_levels_and_both_codings_see_the_same() {
        let [red, ..] = rgb(sent(&application_note(), 0.5, GREY));
        assert!((red - 66.0).abs() < 5.0, "{red}");
        let mut pair = [u16::from_le_bytes([120, 128]); 2];
        Colour::of(&application_note(), LIGHT, 0.5).apply_to_pair(&mut pair);
        assert_eq!(pair, [u16::from_le_bytes([60, 128]); 2]);
    }
}
