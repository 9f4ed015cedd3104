//! The motion of any part of the nominal film under the nominal tip, by tables made from full
//! solutions.
//!
//! The tables are over the tip's place and over the distance from the tip: at one distance the
//! film's motion hardly changes with the place, while at one place of the film it changes quickly
//! as the tip comes near. A load enters by a few functions of its size and tilt that are common to
//! all places.

mod functions;
mod table;

pub use functions::{LoadFunctions, Mirrored};
pub use table::{Nodes, Table};

use std::sync::LazyLock;

use crate::disc::Disc;
use crate::film::reduced::Pose;
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

    /// Returns the tip's displacement, mm.
    pub fn tip_mm(&self, pose: &Pose) -> [f64; 3] {
        let (_, weights) = self.weights(pose);
        self.table.tip_mm(&weights)
    }

    /// Returns the displacement, mm, of the point of the film's camera side that rests at (x, y)
    /// mm.
    pub fn displacement(&self, pose: &Pose, point_mm: [f64; 2]) -> [f64; 3] {
        let (tip, weights) = self.weights(pose);
        let from_tip = [0, 1].map(|c| point_mm[c] - tip[c]);
        self.table.window(&weights, from_tip, 0.0).at(from_tip)
    }

    /// Returns the motion of the film over a disc.
    pub fn disc(&self, pose: &Pose, disc: &Disc) -> DiscMotion {
        let (tip, weights) = self.weights(pose);
        let from_tip = |[x, y]: [f64; 2]| [x - tip[0], y - tip[1]];
        let within = OUTSIDE * disc.radius_mm;
        let window = (self.table).window(&weights, from_tip(disc.centre_mm), within);
        view::seen_motion(
            |point| window.at(from_tip(point)),
            disc,
            view::paper_camera(),
        )
    }

    /// Returns the tip's place, mm, within the table's limits, and the weights of rows.
    fn weights(&self, pose: &Pose) -> ([f64; 2], table::Weights) {
        let tip = pose
            .place_mm
            .map(|part| part.clamp(-MAX_TIP_MM, MAX_TIP_MM));
        (tip, self.table.weights(tip, &self.functions.values(pose)))
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
                let moved = film.disc(&pose, &Disc::marker(centre_mm));
                close(moved.moved_mm, disc.moved_mm, 0.01);
                close(moved.along_x, disc.along_x, 0.02);
                close(moved.along_y, disc.along_y, 0.02);
            }
            close(film.tip_mm(&pose), pressed.tip_mm, 0.01);
        }
    }

    #[test]
    fn a_disc_moves_as_its_points_do() {
        let (film, load) = (WholeFilm::nominal(), pose([0.1, 0.3], [-7.1, 2.0]));
        let disc = Disc::marker([-6.4, 2.3]);
        let motion = film.disc(&load, &disc);
        for at in [[0.0, 0.0], [0.3, 0.0], [0.0, -0.4]] {
            let point = [disc.centre_mm[0] + at[0], disc.centre_mm[1] + at[1]];
            close(motion.at(at), film.displacement(&load, point), 0.05);
        }
        let nothing = film.disc(&Pose::default(), &disc);
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
