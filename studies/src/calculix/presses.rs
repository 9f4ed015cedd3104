//! The presses that are compared, and the variations of CalculiX's film that tell why they differ.

use super::deck::Law;
use super::mesh::Cut;

/// A force at a place of the film.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Press {
    /// Short name.
    pub name: &'static str,
    /// The tip's force, N.
    pub force_n: [f64; 3],
    /// Where the tip meets the film at rest, mm from the middle.
    pub place_mm: [f64; 2],
}

/// A film for CalculiX.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variant {
    /// What is varied.
    pub name: &'static str,
    /// Its elements.
    pub cut: Cut,
    /// Its law.
    pub law: Law,
    /// Its mesh, in parts of the one asked for.
    pub fineness: f64,
}

/// In the middle and off it, straight and tilted, from 5 mN to 0.25 N.
pub const PRESSES: [Press; 14] = [
    press("a", [0.0, 0.0, -0.005], [0.0, 0.0]),
    press("b", [0.0, 0.0, -0.02], [0.0, 0.0]),
    press("c", [0.0, 0.0, -0.1], [0.0, 0.0]),
    press("d", [0.0, 0.0, -0.25], [0.0, 0.0]),
    press("e", [0.02, 0.0, -0.05], [0.0, 0.0]),
    press("f", [0.064, 0.048, -0.1], [0.0, 0.0]),
    press("g", [0.0, 0.0, -0.01], [3.0, 0.0]),
    press("h", [0.0, 0.0, -0.05], [0.0, -4.5]),
    press("i", [0.0, 0.0, -0.1], [3.0, 3.0]),
    press("j", [-0.03, 0.01, -0.1], [-4.0, 2.0]),
    press("k", [0.0, -0.08, -0.1], [2.0, -3.0]),
    press("l", [0.0, 0.0, -0.15], [3.5, -3.0]),
    press("m", [-0.04, 0.04, -0.15], [1.0, -1.5]),
    press("n", [0.0, 0.0, -0.25], [5.0, 0.0]),
];

/// So weak that the film answers in proportion.
pub const FAINT: Press = press("faint", [0.0, 0.0, -2e-5], [0.0, 0.0]);

/// The film that is compared at every press.
pub const BASE: Variant = variant("as compared", Cut::Bricks(1), Law::StVenant, 1.0);
/// Rubber as it thins, at every press, too.
pub const RUBBER: Variant = variant("neo-Hooke", Cut::Bricks(1), Law::Rubber(0.0), 1.0);
/// Variations at a few presses.
pub const VARIANTS: [Variant; 7] = [
    BASE,
    variant("1.4 × finer mesh", Cut::Bricks(1), Law::StVenant, 1.4),
    variant(
        "two bricks through the thickness",
        Cut::Bricks(2),
        Law::StVenant,
        1.0,
    ),
    variant("S8R shells", Cut::Shells, Law::StVenant, 1.0),
    variant(
        "no shear across",
        Cut::Bricks(1),
        Law::StiffShear(STIFFER),
        1.0,
    ),
    variant(
        "neither shear nor thinning",
        Cut::Bricks(1),
        Law::StiffAcross(STIFFER),
        1.0,
    ),
    variant(
        "neither, 1.4 × finer mesh",
        Cut::Bricks(1),
        Law::StiffAcross(STIFFER),
        1.4,
    ),
];
/// The presses of [`PRESSES`] at which they are tried.
pub const VARIED: [usize; 2] = [0, 3];

/// How many times stiffer a film is against what it is to do without.
pub const STIFFER: f64 = 100.0;

const fn press(name: &'static str, force_n: [f64; 3], place_mm: [f64; 2]) -> Press {
    Press {
        name,
        force_n,
        place_mm,
    }
}

const fn variant(name: &'static str, cut: Cut, law: Law, fineness: f64) -> Variant {
    Variant {
        name,
        cut,
        law,
        fineness,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presses_are_what_is_promised() {
        let off = |press: &Press| press.place_mm[0].hypot(press.place_mm[1]);
        let tilt = |press: &Press| {
            let [x, y, z] = press.force_n;
            assert!((-0.25..=-0.005).contains(&z));
            x.hypot(y) / -z
        };
        assert!(PRESSES.iter().map(off).fold(0.0, f64::max) >= 4.5);
        let steepest = PRESSES.iter().map(tilt).fold(0.0, f64::max);
        assert!((steepest - 0.8).abs() < 1e-9);
    }
}
