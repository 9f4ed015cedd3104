//! A sensor whose pixels see one colour each. Its picture has twice the resolution of a frame. It
//! averages the nearest four pixels of one colour, and interpolates all colours of the frame's
//! pixels from these means.

use crate::exposure::Image;
use crate::light::Channel;

/// Channels of a square of four pixels: blue and green in even rows, green and red in odd ones.
const SQUARE: [[usize; 2]; 2] = [[2, 1], [1, 0]];
/// The sensor's pixels along a frame's pixel.
pub(crate) const FINER: u32 = 2;

/// Returns an image in the sensor's pixels.
pub(crate) fn finer(mut image: Image) -> Image {
    let times = f64::from(FINER);
    image.blur_px *= times;
    for outline in &mut image.outlines {
        for corner in &mut outline.corners {
            *corner = corner.map(|at| (at + 0.5) * times - 0.5);
        }
    }
    image
}

/// Returns the means of four pixels of one colour in a sensor's picture with rows of `width`
/// pixels, a multiple of four: a pixel for each of a frame's, which has the channel that it sees,
/// and zeros. Below a frame with an odd number of rows there are no more.
pub(crate) fn binned(width: u32, picture: &[[Channel<i16>; 3]]) -> Vec<[Channel<i16>; 3]> {
    let width = width as usize;
    let [columns, rows] = [width / 2, picture.len() / width / 2];
    let mean = |[x, y]: [usize; 2]| {
        let channel = SQUARE[y % 2][x % 2];
        // The colour comes again two pixels farther on.
        let [left, above] = [x, y].map(|at| at / 2 * 4 + at % 2);
        let four = [0, 2].into_iter().flat_map(|dy| [0, 2].map(|dx| (dx, dy)));
        let sum: i32 = four
            .map(|(dx, dy)| {
                let row = if above + dy < 2 * rows {
                    above + dy
                } else {
                    above
                };
                i32::from(picture[row * width + left + dx][channel].bits())
            })
            .sum();
        let mut pixel = [Channel::default(); 3];
        pixel[channel] = Channel::from_bits((sum / 4) as i16);
        pixel
    };
    let pixels = (0..rows).flat_map(|y| (0..columns).map(move |x| [x, y]));
    pixels.map(mean).collect()
}

/// Returns all colours of the pixels of a picture, in rows of `width`; each sees one colour.
pub(crate) fn interpolated(width: u32, picture: &[[Channel; 3]]) -> Vec<[Channel; 3]> {
    let width = width as usize;
    let height = picture.len() / width;
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
    pixels
        .map(|at| pixel(picture, [width, height], at))
        .collect()
}

/// Returns a pixel's colours: each is the mean of the nearest pixels that see it.
fn pixel(picture: &[[Channel; 3]], size: [usize; 2], [x, y]: [usize; 2]) -> [Channel; 3] {
    let (mut nearest, mut sums, mut counts) = ([usize::MAX; 3], [0; 3], [0; 3]);
    for (dx, dy) in (0..3).flat_map(|dx| (0..3).map(move |dy| (dx, dy))) {
        let at = [beside(x, dx, size[0]), beside(y, dy, size[1])];
        let channel = SQUARE[at[1] % 2][at[0] % 2];
        let far = dx.abs_diff(1) + dy.abs_diff(1);
        if far < nearest[channel] {
            (nearest[channel], sums[channel], counts[channel]) = (far, 0, 0);
        }
        if far == nearest[channel] {
            sums[channel] += picture[at[1] * size[0] + at[0]][channel].bits();
            counts[channel] += 1;
        }
    }
    std::array::from_fn(|c| Channel::from_bits((sums[c] + counts[c] / 2).div_euclid(counts[c])))
}

/// Returns the place `step` − 1 away from another one, of `count`. Beyond the border the picture is
/// mirrored, so that colours alternate on.
fn beside(at: usize, step: usize, count: usize) -> usize {
    match (at + step).checked_sub(1) {
        None => 1,
        Some(place) if place == count => count - 2,
        Some(place) => place,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(level: i32) -> [Channel; 3] {
        [Channel::from_bits(level); 3]
    }

    #[test]
    fn an_even_picture_stays_and_an_edge_is_smeared_in_red_and_blue() {
        let even = vec![grey(6_400); 12 * 8];
        assert_eq!(interpolated(12, &even), even);
        // Dark up to column 5, bright from 6 on, where blue is seen in even rows.
        let edge = (0..96).map(|i| grey(if i % 12 < 6 { 0 } else { 640 }));
        let seen = interpolated(12, &edge.collect::<Vec<_>>());
        let of = |column: usize| seen[2 * 12 + column].map(Channel::bits);
        assert_eq!([of(5), of(6)], [[0, 0, 320], [320, 480, 640]]);
    }

    /// The means of one colour are farther apart and nearer to each other in turns.
    #[test]
    fn four_pixels_of_a_colour_are_one() {
        let ramp = (0..8 * 4).map(|i| [Channel::from_bits(64 * (i % 8)); 3]);
        let binned = binned(8, &ramp.collect::<Vec<_>>());
        let seen: Vec<i16> = (binned.iter().take(4))
            .map(|pixel| pixel.iter().map(|channel| channel.bits()).sum())
            .collect();
        assert_eq!(seen, [64, 128, 320, 384]);
        assert_eq!(binned.len(), 4 * 2);
    }
}
