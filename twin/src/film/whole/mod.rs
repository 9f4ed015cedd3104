//! The motion of any part of the film, by tables made from full solutions.
//!
//! The tables are over the tip's place and over the distance from the tip. At one distance the
//! film's motion hardly changes with the place; at one place of the film it changes quickly as the
//! tip comes near. A load enters by a few functions of its size and tilt that are common to all
//! places.

mod differences;
mod functions;
mod table;

pub use differences::{Difference, Differences};
pub use functions::{LoadFunctions, Mirrored};
use table::Window;
pub use table::{Nodes, Table};

use std::sync::LazyLock;

use differences::Part;

use crate::disc::Disc;
use crate::film::reduced::{NOMINAL_RADIUS_MM, Pose, Unit};
use crate::film::{DiscMotion, FilmError};
use crate::view;

/// The largest distance of the tip from the middle, along x and along y, mm.
pub const MAX_TIP_MM: f64 = 8.0;
/// The largest distance of the film's known points from the middle, along x and along y, mm.
pub const MAX_POINT_MM: f64 = 9.0;
/// A disc's outline is a polygon whose corners are outside its circle: by less than this part.
const OUTSIDE: f64 = 1.01;

/// The tables of the whole film.
#[derive(Clone, Debug, PartialEq)]
pub struct WholeFilm {
    functions: LoadFunctions,
    table: Table,
}

impl WholeFilm {
    /// The nodes of the table.
    pub const NODES: Nodes = Nodes {
        places_mm: &[0.0, 2.0, 4.0, 6.0, 8.0],
        around_mm: &[
            0.0, 0.25, 0.5, 0.75, 1.05, 1.4, 1.9, 2.6, 3.6, 5.0, 7.0, 9.2, 11.6, 14.2, 17.0,
        ],
    };

    /// Returns the bytes of a file from the functions of the load, and from the coefficients at the
    /// places of [`Nodes::octant`], by place, function and number of the row.
    pub fn to_bytes(functions: &LoadFunctions, octant: &[f32]) -> Vec<u8> {
        let table = Table::to_bytes(&WholeFilm::NODES, functions.count(), octant);
        [functions.to_bytes(), table].concat()
    }

    /// Reads the tables from a file's bytes.
    ///
    /// # Errors
    /// If there are too few or too many bytes.
    pub fn from_bytes(mut bytes: &[u8]) -> Result<WholeFilm, FilmError> {
        let functions = LoadFunctions::take(&mut bytes)?;
        let table = Table::take(&WholeFilm::NODES, &functions, &mut bytes)?;
        match bytes {
            [] => Ok(WholeFilm { functions, table }),
            _ => Err(FilmError::Tables(format!(
                "{} bytes follow the whole film: make the file anew",
                bytes.len()
            ))),
        }
    }

    /// Returns the nominal film.
    pub fn nominal() -> &'static WholeFilm {
        static NOMINAL: LazyLock<WholeFilm> = LazyLock::new(|| {
            let film = WholeFilm::from_bytes(include_bytes!("../../../data/whole.bin"));
            film.expect("the committed tables are a whole film's")
        });
        &NOMINAL
    }

    /// Returns the displacement of a tip of a radius on a unit's film, mm.
    pub fn tip_mm(&self, pose: &Pose, radius_mm: f64, unit: &Unit) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for share in self.shares(pose, radius_mm, unit) {
            add(&mut sum, share.back(share.table.tip_mm(&share.weights)));
        }
        sum
    }

    /// Returns the displacement, mm, of the point of the nominal film's camera side that rests at
    /// (x, y) mm, under the nominal tip.
    pub fn displacement(&self, pose: &Pose, point_mm: [f64; 2]) -> [f64; 3] {
        let share = self.own(pose);
        let from_tip = share.away_mm(point_mm);
        share
            .table
            .window(&share.weights, from_tip, 0.0)
            .at(from_tip)
    }

    /// Returns the motion over a disc of a unit's film under a tip of a radius.
    pub fn disc(&self, pose: &Pose, radius_mm: f64, unit: &Unit, disc: &Disc) -> DiscMotion {
        let shares = self.shares(pose, radius_mm, unit);
        let windows: Vec<_> = shares.iter().map(|share| share.window(disc)).collect();
        let moved = |point| {
            let mut sum = [0.0; 3];
            for (share, window) in shares.iter().zip(&windows) {
                add(&mut sum, share.back(window.at(share.away_mm(point))));
            }
            sum
        };
        view::seen_motion(moved, disc, view::paper_camera())
    }

    /// Returns all tables whose sum is the motion of a unit's film under a tip of a radius.
    fn shares(&self, pose: &Pose, radius_mm: f64, unit: &Unit) -> Vec<Share<'_>> {
        let own = std::iter::once(self.own(pose));
        if radius_mm == NOMINAL_RADIUS_MM && unit.parts().iter().all(|part| *part == 0.0) {
            return own.collect();
        }
        let parts = Differences::nominal().parts(unit, radius_mm);
        own.chain(parts.iter().map(|part| Share::of(part, pose)))
            .collect()
    }

    /// Returns the nominal film's share.
    fn own(&self, pose: &Pose) -> Share<'_> {
        let part = Part {
            table: &self.table,
            functions: &self.functions,
            factor: 1.0,
            swap: false,
            signs: [1.0; 2],
        };
        Share::of(&part, pose)
    }
}

/// A table's share of a motion under a load.
struct Share<'a> {
    table: &'a Table,
    weights: table::Weights,
    /// The tip's place, in the film that the table is seen in, mm.
    tip_mm: [f64; 2],
    swap: bool,
    signs: [f64; 2],
}

impl<'a> Share<'a> {
    fn of(part: &Part<'a>, pose: &Pose) -> Share<'a> {
        let limit = |part: f64| part.clamp(-MAX_TIP_MM, MAX_TIP_MM);
        let mirrored = pose.mirrored(part.signs);
        let seen = if part.swap {
            mirrored.swapped()
        } else {
            mirrored
        };
        let tip_mm = seen.place_mm.map(limit);
        let values = part.functions.values(&seen);
        let values: Vec<f64> = values
            .into_iter()
            .map(|value| part.factor * value)
            .collect();
        Share {
            table: part.table,
            weights: part.table.weights(tip_mm, &values),
            tip_mm,
            swap: part.swap,
            signs: part.signs,
        }
    }

    /// Returns the motions around a disc.
    fn window(&self, disc: &Disc) -> Window<'a> {
        let from_tip = self.away_mm(disc.centre_mm);
        (self.table).window(&self.weights, from_tip, OUTSIDE * disc.radius_mm)
    }

    /// Returns a point's distance from the tip, in the film that the table is seen in.
    fn away_mm(&self, point_mm: [f64; 2]) -> [f64; 2] {
        let [x, y] = [0, 1].map(|c| self.signs[c] * point_mm[c]);
        let [x, y] = if self.swap { [y, x] } else { [x, y] };
        [x - self.tip_mm[0], y - self.tip_mm[1]]
    }

    /// Returns a motion of the film that the table is seen in as one of the film itself.
    fn back(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [x, y] = if self.swap { [y, x] } else { [x, y] };
        [self.signs[0] * x, self.signs[1] * y, z]
    }
}

fn add(sum: &mut [f64; 3], more: [f64; 3]) {
    for (sum, more) in sum.iter_mut().zip(more) {
        *sum += more;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Film, Load, MARKER_CENTRES_MM};

    fn pose(tilt: [f64; 2], place_mm: [f64; 2]) -> Pose {
        Pose {
            size: 0.5,
            tilt,
            place_mm,
        }
    }

    fn close(a: [f64; 3], b: [f64; 3], tolerance: f64) {
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() <= tolerance, "{a} {b}");
        }
    }

    #[test]
    fn a_mirrored_load_moves_mirrored_points() {
        let film = WholeFilm::nominal();
        let (load, point) = (pose([0.3, -0.2], [5.3, 1.1]), [6.2, 0.4]);
        let [x, y, z] = film.displacement(&load, point);
        let left = film.displacement(&load.mirrored([-1.0, 1.0]), [-point[0], point[1]]);
        close(left, [-x, y, z], 1e-5);
        let above = film.displacement(&load.mirrored([1.0, -1.0]), [point[0], -point[1]]);
        close(above, [x, -y, z], 1e-5);
        let turned = film.displacement(&load.swapped(), [point[1], point[0]]);
        close(turned, [y, x, z], 1e-5);
    }

    #[test]
    fn the_four_dots_move_as_by_their_own_tables() {
        let own = Film::default();
        for (force_n, place_mm) in [
            ([0.0, 0.0, -0.02], [0.0, 0.0]),
            ([0.05, -0.02, -0.2], [-2.3, 1.1]),
            ([-0.01, 0.03, -0.1], [3.4, 3.9]),
            ([0.0, 0.02, -0.05], [-4.8, 4.6]),
        ] {
            let load = Load::from_vector(force_n).unwrap();
            let pressed = own.press(&load.with_offset_mm(place_mm).unwrap());
            let pose = Pose::of_force(force_n, place_mm, [1.0; 2]);
            let film = WholeFilm::nominal();
            for (centre_mm, disc) in MARKER_CENTRES_MM.into_iter().zip(pressed.discs) {
                let moved = film.disc(&pose, 0.5, &Unit::default(), &Disc::marker(centre_mm));
                close(moved.moved_mm, disc.moved_mm, 0.01);
                close(moved.along_x, disc.along_x, 0.02);
                close(moved.along_y, disc.along_y, 0.02);
            }
            close(
                film.tip_mm(&pose, 0.5, &Unit::default()),
                pressed.tip_mm,
                0.01,
            );
        }
    }

    #[test]
    fn a_disc_moves_as_its_points_do() {
        let (film, load) = (WholeFilm::nominal(), pose([0.1, 0.3], [-7.1, 2.0]));
        let disc = Disc::marker([-6.4, 2.3]);
        let motion = film.disc(&load, 0.5, &Unit::default(), &disc);
        for at in [[0.0, 0.0], [0.3, 0.0], [0.0, -0.4]] {
            let point = [disc.centre_mm[0] + at[0], disc.centre_mm[1] + at[1]];
            close(motion.at(at), film.displacement(&load, point), 0.05);
        }
        let nothing = film.disc(&Pose::default(), 0.5, &Unit::default(), &disc);
        close(nothing.moved_mm, [0.0; 3], 1e-12);
    }

    #[test]
    fn what_is_no_whole_film_is_refused() {
        let bytes = include_bytes!("../../../data/whole.bin");
        assert!(WholeFilm::from_bytes(&bytes[..bytes.len() - 2]).is_err());
        assert!(WholeFilm::from_bytes(&[&bytes[..], &[0]].concat()).is_err());
        assert!(WholeFilm::from_bytes(&[]).is_err());
    }
}
