//! The motion that a film's own differences, and another tip, add to the whole film.

use std::sync::LazyLock;

use super::functions::LoadFunctions;
use super::table::{Nodes, Table};
use crate::film::FilmError;
use crate::film::reduced::{Unit, rho};

/// The tables of the additional motion. Those of a post are of the shift along x of the post in the
/// corner (+, +); mirrored films have those of the others.
#[derive(Clone, Debug, PartialEq)]
pub struct Differences {
    functions: LoadFunctions,
    /// By the logarithm of the thickness, at the same depth, and by that of the posts' grip.
    sheet: [Table; 2],
    post: Table,
    /// By the first, second and third power of ρ, as of [`rho`].
    radius: [Table; 3],
}

/// The quantity that a table gives, in the order of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Difference {
    /// The thickness.
    Thickness,
    /// The posts' grip.
    Grip,
    /// The shift of a post along x.
    Post,
    /// A power of ρ, from 0 for the first.
    Radius(usize),
}

/// A part of the additional motion: a table, its factor, and the film that it is seen in. There the
/// axes are exchanged if `swap`, and before that take the signs.
pub(super) struct Part<'a> {
    pub table: &'a Table,
    pub functions: &'a LoadFunctions,
    pub factor: f64,
    pub swap: bool,
    pub signs: [f64; 2],
}

/// The signs of the corners, by the identity of the post there.
const CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
/// The nodes of the differences of the film.
const FILM: Nodes = Nodes {
    places_mm: &[0.0, 4.0, 8.0],
    around_mm: &[0.0, 0.5, 1.05, 1.9, 3.6, 7.0, 11.6, 17.0],
};
/// The nodes of those of the tip.
const TIP: Nodes = Nodes {
    places_mm: &[0.0, 4.0, 8.0],
    around_mm: &[
        0.0, 0.25, 0.5, 0.75, 1.05, 1.4, 1.9, 2.6, 3.6, 7.0, 11.6, 17.0,
    ],
};

impl Difference {
    /// All of them.
    pub const ALL: [Difference; 6] = [
        Difference::Thickness,
        Difference::Grip,
        Difference::Post,
        Difference::Radius(0),
        Difference::Radius(1),
        Difference::Radius(2),
    ];

    /// Returns the nodes of its table.
    pub fn nodes(self) -> Nodes {
        match self {
            Difference::Radius(_) => TIP,
            _ => FILM,
        }
    }

    /// Returns whether a mirrored film has it, so that the places of an octant suffice.
    pub fn is_even(self) -> bool {
        self != Difference::Post
    }
}

impl Differences {
    /// Returns the bytes of a file from the functions of the load, and from each difference's
    /// coefficients by place, function and number of the row. Places are those of an octant, or
    /// all, along y and, within, along x.
    pub fn to_bytes(functions: &LoadFunctions, of: impl Fn(Difference) -> Vec<f32>) -> Vec<u8> {
        let table = |one: Difference| Table::to_bytes(&one.nodes(), functions.count(), &of(one));
        let tables = Difference::ALL.into_iter().flat_map(table);
        functions.to_bytes().into_iter().chain(tables).collect()
    }

    /// Reads the tables from a file's bytes.
    ///
    /// # Errors
    /// If there are too few or too many bytes.
    pub fn from_bytes(mut bytes: &[u8]) -> Result<Differences, FilmError> {
        let functions = LoadFunctions::take(&mut bytes)?;
        let mut table = |one: Difference| match one.is_even() {
            true => Table::take(&one.nodes(), &functions, &mut bytes),
            false => Table::take_all(&one.nodes(), &functions, &mut bytes),
        };
        let sheet = [table(Difference::Thickness)?, table(Difference::Grip)?];
        let post = table(Difference::Post)?;
        let [first, second, third] = [0, 1, 2].map(Difference::Radius);
        let radius = [table(first)?, table(second)?, table(third)?];
        match bytes {
            [] => Ok(Differences {
                functions,
                sheet,
                post,
                radius,
            }),
            _ => Err(FilmError::Tables(format!(
                "{} bytes follow the film's differences: make the file anew",
                bytes.len()
            ))),
        }
    }

    /// Returns those of the nominal film.
    pub fn nominal() -> &'static Differences {
        static NOMINAL: LazyLock<Differences> = LazyLock::new(|| {
            let bytes = include_bytes!("../../../data/whole-differences.bin");
            Differences::from_bytes(bytes).expect("the committed tables are of differences")
        });
        &NOMINAL
    }

    /// Returns the parts of a unit under a tip of a radius; none for the nominal ones.
    pub(super) fn parts(&self, unit: &Unit, radius_mm: f64) -> Vec<Part<'_>> {
        let [thickness, grip, posts @ ..] = unit.parts();
        let rho = rho(radius_mm);
        let even = self.sheet.iter().chain(&self.radius);
        let factors = [thickness, grip, rho, rho * rho, rho * rho * rho];
        let even = even
            .zip(factors)
            .map(|(table, factor)| (table, factor, false, [1.0; 2]));
        let posts = posts.into_iter().enumerate().map(|(k, shift)| {
            let (signs, way) = (CORNERS[k / 2], k % 2);
            (&self.post, signs[way] * shift, way == 1, signs)
        });
        let parts = even.chain(posts).filter(|(_, factor, ..)| *factor != 0.0);
        let part = |(table, factor, swap, signs)| Part {
            table,
            functions: &self.functions,
            factor,
            swap,
            signs,
        };
        parts.map(part).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nominal_film_and_tip_add_nothing() {
        let nominal = Differences::nominal();
        let parts = |unit: &Unit, radius_mm| nominal.parts(unit, radius_mm).len();
        let mut unit = Unit::default();
        assert_eq!(parts(&unit, 0.5), 0);
        assert_eq!(parts(&unit, 1.0), 3);
        (unit.thickness, unit.posts_mm[1]) = (1.1, [0.0, 0.2]);
        assert_eq!(parts(&unit, 0.5), 2);
        // Posts hold a stiffer film less.
        unit.stiffness = 1.2;
        assert_eq!(parts(&unit, 0.5), 3);
    }

    #[test]
    fn what_is_no_difference_is_refused() {
        let bytes = include_bytes!("../../../data/whole-differences.bin");
        assert!(Differences::from_bytes(&bytes[..bytes.len() - 2]).is_err());
        assert!(Differences::from_bytes(&[&bytes[..], &[0]].concat()).is_err());
        assert!(Differences::from_bytes(&[]).is_err());
    }
}
