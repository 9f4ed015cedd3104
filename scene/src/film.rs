//! Where a point of the film goes when the film is pressed.

use crate::{FILM_DISTANCE_MM, Load, SceneError};

/// Half the distance between the film's fixed corners, in mm (the paper's a = 14 mm).
pub const HALF_SIDE_MM: f64 = 14.0;

/// The film's mechanics: all that optics and renderer know of it.
pub trait Film {
    /// Whether the film can take this load.
    ///
    /// # Errors
    /// When the load is outside what the film's model holds for, or would press the film into the lens.
    fn check(&self, load: &Load) -> Result<(), SceneError>;

    /// Where the point of the film that rests at (x, y) mm moves: (dx, dy, dz) in mm, film frame (z away from the
    /// camera, so that a press gives dz ≤ 0). Holds for loads that [`Film::check`] accepts.
    fn displacement(&self, load: &Load, rest_mm: [f64; 2]) -> [f64; 3];
}

/// A stand-in until the film's mechanics are simulated: a tent whose top is the tip.
///
/// The tip goes 5.6 mm · (−F_z / 0.2 N)^⅓ deep (a stretched membrane: force with the cube of depth) and
/// 2.9 mm/N · (F_x, F_y) sideways. Depth and sideways motion fall linearly with the distance from the centre, to
/// nothing at the fixed corners, (√2 · 14) mm away: the markers at 5.26 mm take 73 % of them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StandInFilm;

impl StandInFilm {
    /// Tip depth at a normal force of 0.2 N, mm.
    const DEPTH_MM: f64 = 5.6;
    /// The force of [`Self::DEPTH_MM`], N.
    const DEPTH_FORCE_N: f64 = 0.2;
    /// Sideways motion of the tip, mm/N.
    const LATERAL_MM_PER_N: f64 = 2.9;
    /// The deepest tip, 1 mm short of the pinhole (0.83 N).
    const MAX_DEPTH_MM: f64 = FILM_DISTANCE_MM - 1.0;
    /// The farthest sideways tip (1.03 N), well past any use.
    const MAX_LATERAL_MM: f64 = 3.0;

    fn tip_depth_mm(load: &Load) -> f64 {
        let normal_n = -load.vector_n()[2];
        Self::DEPTH_MM * libm::cbrt(normal_n / Self::DEPTH_FORCE_N)
    }

    /// The part of the tip's motion that a point takes: 1 at the centre, 0 at the corners' distance and beyond.
    fn share([x, y]: [f64; 2]) -> f64 {
        let corner_mm = HALF_SIDE_MM * std::f64::consts::SQRT_2;
        (1.0 - (x * x + y * y).sqrt() / corner_mm).max(0.0)
    }
}

impl Film for StandInFilm {
    fn check(&self, load: &Load) -> Result<(), SceneError> {
        let [x, y, _] = load.vector_n();
        let lateral_mm = Self::LATERAL_MM_PER_N * (x * x + y * y).sqrt();
        let within = |value: f64, limit: f64, what: &str| {
            if value <= limit {
                return Ok(());
            }
            Err(SceneError::Load(format!(
                "{} N would move the tip {value:.2} mm {what}, and the film can go {limit} mm: use a smaller force",
                load.magnitude_n()
            )))
        };
        within(Self::tip_depth_mm(load), Self::MAX_DEPTH_MM, "deep")?;
        within(lateral_mm, Self::MAX_LATERAL_MM, "sideways")
    }

    fn displacement(&self, load: &Load, rest_mm: [f64; 2]) -> [f64; 3] {
        let [x, y, _] = load.vector_n();
        let share = Self::share(rest_mm);
        let lateral = Self::LATERAL_MM_PER_N * share;
        [lateral * x, lateral * y, -Self::tip_depth_mm(load) * share]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn press(force_n: f64) -> Load {
        Load::from_angles(force_n, 0.0, 0.0).unwrap()
    }

    #[test]
    fn the_tip_goes_as_deep_as_stated() {
        let [dx, dy, dz] = StandInFilm.displacement(&press(0.2), [0.0, 0.0]);
        assert_eq!((dx, dy), (0.0, 0.0));
        assert!((dz + 5.6).abs() < 1e-12);
        let an_eighth = StandInFilm.displacement(&press(0.025), [0.0, 0.0]);
        assert!((an_eighth[2] + 2.8).abs() < 1e-12);
    }

    #[test]
    fn corners_stay_and_half_way_takes_half() {
        let corner = StandInFilm.displacement(&press(0.2), [14.0, -14.0]);
        assert!(corner[2].abs() < 1e-12);
        let half_way = StandInFilm.displacement(&press(0.2), [7.0, 7.0]);
        assert!((half_way[2] + 2.8).abs() < 1e-12);
        assert_eq!(StandInFilm.displacement(&press(0.2), [20.0, 20.0])[2], 0.0);
    }

    #[test]
    fn sideways_force_moves_the_tip_sideways() {
        let load = Load::from_vector([0.01, -0.02, -0.1]).unwrap();
        let [dx, dy, _] = StandInFilm.displacement(&load, [0.0, 0.0]);
        assert!((dx - 0.029).abs() < 1e-12 && (dy + 0.058).abs() < 1e-12);
    }

    #[test]
    fn the_film_stays_in_front_of_the_lens() {
        assert!(StandInFilm.check(&press(0.83)).is_ok());
        let deep = StandInFilm.check(&press(0.84)).unwrap_err().to_string();
        assert!(deep.contains("0.84 N") && deep.contains("deep"), "{deep}");
        let aside = Load::from_vector([1.1, 0.0, -0.1]).unwrap();
        assert!(StandInFilm.check(&aside).is_err());
    }
}
