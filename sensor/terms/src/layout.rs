//! Defines where the dots of the layouts are that the project has.

use crate::units::SignedMicrometres;

/// The dots of the layout `4`: (x, y) from the film's middle, in the order of their identities.
pub const SQUARE: [[SignedMicrometres; 2]; 4] = [
    at(-3_717, -3_717),
    at(3_717, -3_717),
    at(3_717, 3_717),
    at(-3_717, 3_717),
];

/// The dots of the layout `8v`: (x, y) from the film's middle, in the order of their identities.
/// Wide corners and a narrow middle, so that no dot leaves the picture.
pub const EIGHT_V: [[SignedMicrometres; 2]; 8] = [
    at(-7_000, -4_500),
    at(7_000, -4_500),
    at(7_000, 4_500),
    at(-7_000, 4_500),
    at(-2_500, 0),
    at(0, -2_400),
    at(2_500, 0),
    at(0, 2_400),
];

const fn at(x: i32, y: i32) -> [SignedMicrometres; 2] {
    [SignedMicrometres(x), SignedMicrometres(y)]
}
