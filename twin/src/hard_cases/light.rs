//! Hard cases of the light: too dim, or of the wrong colour.

use super::{Expected, HardCase};
use crate::Options;

/// A dark picture. The default threshold needs a value of 45 of 255, which red tape reaches at a
/// gain of about 0.3. A second look does not need it.
pub(super) fn dark() -> Vec<HardCase> {
    let case = |(gain, expected)| {
        let name = format!("gain-{gain:.2}");
        HardCase::new(name, "dim light", expected, move |_| Options {
            gain,
            ..Options::default()
        })
    };
    let gains = [
        (0.4, Expected::Found),
        (0.35, Expected::Either),
        (0.3, Expected::Either),
        (0.2, Expected::Either),
    ];
    gains.into_iter().map(case).collect()
}

/// A picture that is dark on one side.
pub(super) fn one_sided() -> Vec<HardCase> {
    let case = |(name, what, gain, gradient, expected)| {
        HardCase::new(name, what, expected, move |_| Options {
            gain,
            gradient,
            ..Options::default()
        })
    };
    use Expected::{Either, Found};
    let cases: [(&str, &str, f64, [f64; 2], Expected); 4] = [
        (
            "one-sided-right",
            "60 % more light at the right edge",
            1.0,
            [0.6, 0.0],
            Found,
        ),
        (
            "one-sided-dim",
            "the left markers at the edge of the threshold",
            0.45,
            [0.7, 0.0],
            Either,
        ),
        (
            "one-sided-below",
            "the upper markers at the edge of the threshold",
            0.5,
            [0.0, 0.8],
            Either,
        ),
        (
            "one-sided-dark",
            "the left markers below the threshold",
            0.3,
            [0.9, 0.0],
            Either,
        ),
    ];
    cases.into_iter().map(case).collect()
}

/// Stray light and colour casts.
pub(super) fn veiled() -> Vec<HardCase> {
    let haze = |haze: f64| {
        let name = format!("haze-{haze}");
        HardCase::new(name, "veiling light", Expected::Either, move |_| Options {
            haze,
            ..Options::default()
        })
    };
    let cast = |name: &str, what: &str, expected, white_balance| {
        HardCase::new(name, what, expected, move |_| Options {
            white_balance,
            ..Options::default()
        })
    };
    let mut cases: Vec<HardCase> = [20.0, 60.0, 100.0].map(haze).into();
    cases.extend([
        cast("warm", "a warm cast", Expected::Either, [1.2, 0.9, 0.75]),
        cast(
            "warm-background-passes",
            "a cast so warm that the film passes the red threshold",
            Expected::Rejected,
            [1.4, 0.7, 0.6],
        ),
        cast("cold", "a cold cast", Expected::Either, [0.75, 1.0, 1.3]),
    ]);
    cases
}
