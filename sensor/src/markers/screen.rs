//! Screens pixels with wide registers: most words of a mask are found empty without a look-up.

use crate::markers::mask::any_set;
use crate::markers::tables::{ByteTable, Pixels, Table};
use hivtac_terms::threshold::{ByteOrder, HsvBox, ThresholdError};

/// Pixels of a word of the mask.
const WORD: usize = 32;
/// Keeps sums of the screen above zero: larger than any channel.
const OFFSET: u16 = 64;

/// A [`ByteTable`] behind a *screen*: a condition that every accepted colour meets. It consists of
/// a few operations without branches or look-ups, which compilers turn into vector code. A word in
/// which no pixel meets the condition is empty; in other words the table decides on the pixels that
/// do. The masks equal the table's, bit for bit.
///
/// The microcontroller has no such registers and is faster with the tables alone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ScreenedTable {
    table: ByteTable,
    screen: Screen,
}

impl Table for ScreenedTable {
    const CLOSED: ScreenedTable = ScreenedTable {
        table: ByteTable::CLOSED,
        screen: Screen::CLOSED,
    };

    fn set(&mut self, hsv_box: &HsvBox, order: ByteOrder) -> Result<(), ThresholdError> {
        self.table.set(hsv_box, order)?;
        self.screen = Screen::of(&self.table, order);
        Ok(())
    }

    fn accepts(&self, raw: u16) -> bool {
        self.table.accepts(raw)
    }
}

impl Pixels for ScreenedTable {
    fn row_length(&self, width: u16) -> usize {
        self.table.row_length(width)
    }

    fn mask_row(&self, row: &[u16], mask: &mut [u32]) -> bool {
        match self.screen.channel {
            Channel::Red => self.mask_by(row, mask, |raw| self.screen.red(raw)),
            Channel::Green => self.mask_by(row, mask, |raw| self.screen.green(raw)),
            Channel::Blue => self.mask_by(row, mask, |raw| self.screen.blue(raw)),
        }
        any_set(mask)
    }

    fn mask_covered_rows(&self, rows: &[u16], width: u16, mask: &mut [u32]) {
        self.table.mask_covered_rows(rows, width, mask);
    }

    fn weight(&self, row: &[u16], column: u16) -> u8 {
        self.table.weight(row, column)
    }
}

impl ScreenedTable {
    #[inline(always)]
    fn mask_by(&self, row: &[u16], mask: &mut [u32], excess: impl Fn(u16) -> u16 + Copy) {
        let (full, rest) = row.as_chunks::<WORD>();
        for (word, pixels) in mask.iter_mut().zip(full) {
            let any = pixels.iter().fold(0, |any, &raw| any | excess(raw));
            *word = if any == 0 {
                0
            } else {
                self.look_up(pixels, candidates(pixels, excess))
            };
        }
        if let Some(last) = mask.get_mut(full.len()) {
            *last = self.look_up(rest, u32::MAX);
        }
    }

    /// Returns those candidates, bit i for pixel i, that the table accepts; bits beyond the pixels
    /// are unset.
    fn look_up(&self, pixels: &[u16], candidates: u32) -> u32 {
        let (mut accepted, mut left) = (0, candidates);
        while let Some(&raw) = pixels.get(left.trailing_zeros() as usize) {
            let bit = left & left.wrapping_neg();
            if self.table.accepts(raw) {
                accepted |= bit;
            }
            left ^= bit;
        }
        accepted
    }
}

/// Bit i of the result is set if pixel i has an excess.
#[inline(always)]
fn candidates(pixels: &[u16; WORD], excess: impl Fn(u16) -> u16) -> u32 {
    let flags = pixels.map(|raw| u8::from(excess(raw) != 0));
    let (eights, _) = flags.as_chunks::<8>();
    // The factor's bit 56 − 7·i moves flag i, in bit 8·i, to bit 56 + i. No two terms meet, so
    // there are no carries.
    let packed = |eight: &[u8; 8]| {
        let bits = u64::from_le_bytes(*eight).wrapping_mul(0x0102_0408_1020_4080) >> 56;
        bits as u32
    };
    (0..)
        .zip(eights)
        .fold(0, |bits, (i, eight)| bits | packed(eight) << (8 * i))
}

/// A channel of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Channel {
    Red,
    Green,
    Blue,
}

/// The condition: c − ⌊c / 2^shift⌋ exceeds the larger of the other two channels by more than a
/// limit. All channels have 5 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Screen {
    /// The channel c that stands out.
    channel: Channel,
    shift: u32,
    /// The limit plus [`OFFSET`].
    limit: u16,
    order: ByteOrder,
}

impl Screen {
    /// A condition that no colour meets.
    const CLOSED: Screen = Screen {
        channel: Channel::Red,
        shift: 1,
        limit: 2 * OFFSET,
        order: ByteOrder::Native,
    };

    /// Returns the screen that the fewest colours meet, of those that all accepted colours meet.
    fn of(table: &ByteTable, order: ByteOrder) -> Screen {
        let channels = [Channel::Red, Channel::Green, Channel::Blue];
        // With the last shift the channel itself is compared.
        let all = channels.iter().flat_map(|&channel| {
            [1, 2, 3, 5].map(|shift| Screen {
                channel,
                shift,
                limit: 0,
                order,
            })
        });
        let fitted = all.map(|screen| screen.fitted(table));
        fitted
            .min_by_key(|screen| {
                (0..=u16::MAX)
                    .filter(|raw| screen.excess(*raw) != 0)
                    .count()
            })
            .unwrap_or(Screen::CLOSED)
    }

    /// Returns the screen with the largest limit that all accepted colours exceed.
    fn fitted(self, table: &ByteTable) -> Screen {
        let accepted = (0..=u16::MAX).filter(|raw| table.accepts(*raw));
        // With a limit of zero the excess is the difference plus OFFSET, and never cut off at zero.
        let least = accepted.map(|raw| self.excess(raw)).min();
        Screen {
            limit: least.map_or(2 * OFFSET, |least| least - 1),
            ..self
        }
    }

    fn excess(&self, raw: u16) -> u16 {
        match self.channel {
            Channel::Red => self.red(raw),
            Channel::Green => self.green(raw),
            Channel::Blue => self.blue(raw),
        }
    }

    #[inline(always)]
    fn red(&self, raw: u16) -> u16 {
        let [red, green, blue] = self.channels(raw);
        self.above(red, green, blue)
    }

    #[inline(always)]
    fn green(&self, raw: u16) -> u16 {
        let [red, green, blue] = self.channels(raw);
        self.above(green, red, blue)
    }

    #[inline(always)]
    fn blue(&self, raw: u16) -> u16 {
        let [red, green, blue] = self.channels(raw);
        self.above(blue, red, green)
    }

    /// The three channels, five bits each.
    #[inline(always)]
    fn channels(&self, raw: u16) -> [u16; 3] {
        let pixel = self.order.pixel(raw);
        [pixel >> 11, pixel >> 6 & 31, pixel & 31]
    }

    /// The amount by which the channel exceeds its limit; 0 if it does not.
    #[inline(always)]
    fn above(&self, channel: u16, a: u16, b: u16) -> u16 {
        // Signed, because the vector units of older processors have only that maximum; all values
        // are below 32.
        let other = (a as i16).max(b as i16) as u16;
        (channel - (channel >> self.shift) + OFFSET).saturating_sub(other + self.limit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::{boxed::Box, vec, vec::Vec};

    fn boxes() -> impl Strategy<Value = HsvBox> {
        let range = || (any::<u8>(), any::<u8>()).prop_map(|(a, b)| (a.min(b), a.max(b)));
        (0..180_u8, 0..180_u8, range(), range()).prop_map(|(low, high, saturation, value)| HsvBox {
            hue_low: low,
            hue_high: high,
            saturation_low: saturation.0,
            saturation_high: saturation.1,
            value_low: value.0,
            value_high: value.1,
        })
    }

    fn both(hsv_box: &HsvBox, order: ByteOrder) -> (Box<ScreenedTable>, Box<ByteTable>) {
        let mut screened = Box::new(ScreenedTable::CLOSED);
        screened.set(hsv_box, order).unwrap();
        (screened, Box::new(ByteTable::new(hsv_box, order).unwrap()))
    }

    fn masks(pixels: &impl Pixels, row: &[u16]) -> Vec<u32> {
        let mut mask = vec![u32::MAX; row.len().div_ceil(WORD)];
        pixels.mask_row(row, &mut mask);
        mask
    }

    #[test]
    fn every_colour_is_masked_as_by_the_table() {
        let green = HsvBox {
            hue_low: 50,
            hue_high: 70,
            ..HsvBox::RED
        };
        let all: Vec<u16> = (0..=u16::MAX).collect();
        for hsv_box in [HsvBox::RED, green] {
            for order in [ByteOrder::Native, ByteOrder::Swapped] {
                let (screened, table) = both(&hsv_box, order);
                for row in all.chunks(777) {
                    assert_eq!(masks(&*screened, row), masks(&*table, row));
                }
            }
        }
    }

    #[test]
    fn greys_do_not_pass_the_screen_of_red() {
        let (screened, _) = both(&HsvBox::RED, ByteOrder::Native);
        // In five bits the darkest greys cannot be distinguished from dark reds.
        for level in 4..32 {
            assert_eq!(screened.screen.excess(level << 11 | level << 6 | level), 0);
        }
    }

    #[test]
    fn a_closed_table_accepts_nothing() {
        assert_eq!(masks(&ScreenedTable::CLOSED, &[0xf800; 40]), [0, 0]);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn any_box_is_masked_as_by_the_table(
            hsv_box in boxes(),
            swapped: bool,
            row in prop::collection::vec(any::<u16>(), 1..=800),
        ) {
            let order = if swapped { ByteOrder::Swapped } else { ByteOrder::Native };
            let (screened, table) = both(&hsv_box, order);
            prop_assert_eq!(masks(&*screened, &row), masks(&*table, &row));
        }
    }
}
