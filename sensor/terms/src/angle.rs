//! Computes the angle of a vector in integers, with a table and a division.
//!
//! Over every input, the error of [`atan2`] is at most 0.51 m°, including 0.5 for the rounding to
//! whole m°; the tests assert it.
//!
//! With a ≥ b ≥ 0 and k the integer nearest to 64·b/a, atan(b/a) = atan(k/64) + atan z with z =
//! (64·b − k·a)/(64·a + k·b). Since |z| ≤ 1/127, z − z³/3 is below atan z by at most z⁵/5 < 10⁻¹¹.
//! Numbers of 31 bits lose less than 10⁻⁹.

use crate::division::Divisor;
use crate::fixed::Q;
use crate::units::MilliDegrees;

/// Fractional bits of intermediate m°.
const BITS: u32 = 14;
/// Intermediate m°, at most half a turn.
type Angle = Q<BITS, u32>;

const QUARTER_TURN: Angle = Q::from_bits(90_000 << BITS);
const HALF_TURN: Angle = Q::from_bits(180_000 << BITS);
/// A radian in m°.
const RADIAN: Q<8, u64> = Q::from_bits(14_667_720);

/// atan(k/64) in m° · 2¹⁴, rounded.
const STEPS: [u32; 65] = [
    0,
    14_666_526,
    29_325_895,
    43_970_972,
    58_594_662,
    73_189_934,
    87_749_838,
    102_267_525,
    116_736_268,
    131_149_478,
    145_500_720,
    159_783_730,
    173_992_432,
    188_120_946,
    202_163_606,
    216_114_966,
    229_969_813,
    243_723_174,
    257_370_322,
    270_906_783,
    284_328_340,
    297_631_032,
    310_811_162,
    323_865_292,
    336_790_245,
    349_583_103,
    362_241_202,
    374_762_130,
    387_143_725,
    399_384_062,
    411_481_455,
    423_434_446,
    435_241_798,
    446_902_491,
    458_415_708,
    469_780_832,
    480_997_434,
    492_065_267,
    502_984_254,
    513_754_484,
    524_376_198,
    534_849_784,
    545_175_765,
    555_354_793,
    565_387_641,
    575_275_191,
    585_018_432,
    594_618_445,
    604_076_403,
    613_393_557,
    622_571_232,
    631_610_823,
    640_513_784,
    649_281_623,
    657_915_898,
    666_418_210,
    674_790_198,
    683_033_534,
    691_149_919,
    699_141_078,
    707_008_753,
    714_754_707,
    722_380_711,
    729_888_546,
    737_280_000,
];

/// Returns the angle of (x, y) from the x axis towards y, −180,000 < angle ≤ 180,000 m°; 0 for (0,
/// 0).
pub fn atan2(y: i64, x: i64) -> MilliDegrees {
    let [across, along] = normalized([y.unsigned_abs(), x.unsigned_abs()]);
    let acute = if across <= along {
        first_octant(across, along)
    } else {
        QUARTER_TURN - first_octant(along, across)
    };
    let turned = if x < 0 { HALF_TURN - acute } else { acute };
    let rounded = turned.rounded() as i32;
    MilliDegrees(if y < 0 && rounded < 180_000 {
        -rounded
    } else {
        rounded
    })
}

/// Shifts both numbers equally until the larger has 31 bits; zeros remain.
fn normalized(parts: [u64; 2]) -> [u32; 2] {
    let zeros = (parts[0] | parts[1]).leading_zeros();
    parts.map(|part| match zeros {
        64 => 0,
        33.. => (part << (zeros - 33)) as u32,
        _ => (part >> (33 - zeros)) as u32,
    })
}

/// atan(`small` / `large`), for 2³⁰ ≤ `large` < 2³¹ and `small` ≤ `large`; 0 for (0, 0).
fn first_octant(small: u32, large: u32) -> Angle {
    let step = ((small + (large >> 7)) / (large >> 6).max(1)).min(64);
    let ahead = 64 * i64::from(small) - i64::from(step) * i64::from(large);
    let beneath = (64 * u64::from(large) + u64::from(step) * u64::from(small)) >> 6;
    // z with 38 fractional bits: below 2³²/1.98.
    let z = Divisor::new(beneath as u32).quotient(ahead.unsigned_abs() << 32);
    // z² with 44, and z³/3 with 38.
    let square = (z >> 16) * (z >> 16);
    let bent = z - ((z * (square / 3)) >> 44);
    let beyond = ((bent * RADIAN.bits()) >> 32) as u32;
    let at_step = STEPS.get(step as usize).copied().unwrap_or(0);
    Q::from_bits(if ahead < 0 {
        at_step - beyond
    } else {
        at_step + beyond
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cordic::sin_cos;
    use proptest::prelude::*;

    #[test]
    fn the_table_is_that_of_its_formula() {
        for (step, angle) in STEPS.iter().enumerate() {
            let exact = (step as f64 / 64.0).atan().to_degrees() * 1e3 * f64::from(1 << BITS);
            assert!((f64::from(*angle) - exact).abs() < 0.51, "step {step}");
        }
        assert!((RADIAN.bits() as f64 / 256.0 - 1f64.to_degrees() * 1e3).abs() < 2e-3);
    }

    /// Error in m°, the shorter way round the circle.
    fn error(y: i64, x: i64) -> f64 {
        let exact = (y as f64).atan2(x as f64).to_degrees() * 1e3;
        let error = (f64::from(atan2(y, x).0) - exact).abs();
        error.min(360_000.0 - error)
    }

    #[test]
    fn every_thousandth_of_a_degree_is_met() {
        for angle in -180_000..=180_000 {
            let (sin, cos) = sin_cos(MilliDegrees(angle));
            let expected = if angle == -180_000 { 180_000 } else { angle };
            let [sin, cos] = [sin, cos].map(|part| i64::from(part.bits()));
            assert_eq!(atan2(sin, cos).0, expected);
        }
    }

    /// Between the steps of the table, where z is largest.
    #[test]
    fn every_part_of_the_table_is_as_good() {
        for part in 0..=1 << 20 {
            let small = (part << 11) as i64;
            for (y, x) in [(small, 1 << 31), (1 << 31, -small), (-small, 3 << 31)] {
                assert!(error(y, x) <= 0.501, "({x}, {y})");
            }
        }
    }

    #[test]
    fn special_directions() {
        for size in [1, 3, 1 << 31, 1 << 62] {
            for (y, x, angle) in [
                (0, size, 0),
                (size, size, 45_000),
                (size, 0, 90_000),
                (size, -size, 135_000),
                (0, -size, 180_000),
                (-size, -size, -135_000),
                (-size, 0, -90_000),
                (-1, -(1 << 40), 180_000),
            ] {
                assert_eq!(atan2(y, x), MilliDegrees(angle), "({x}, {y})");
            }
        }
        assert_eq!(atan2(0, 0), MilliDegrees(0));
    }

    #[test]
    fn extreme_arguments() {
        for (y, x) in [
            (i64::MIN, i64::MIN),
            (i64::MAX, i64::MIN),
            (1, i64::MIN),
            (i64::MIN, 1),
        ] {
            assert!(error(y, x) <= 0.51, "({x}, {y})");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        #[test]
        fn it_is_within_its_bound(y: i64, x: i64, y_shift in 0u32..64, x_shift in 0u32..64) {
            prop_assert!(error(y >> y_shift, x >> x_shift) <= 0.51);
        }
    }
}
