//! Chooses the loads of a rendered data set.

use anyhow::Result;
use hivtac_twin::Load;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::data::range::Range;

/// |F| in the unit of its components.
pub fn norm([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

/// α and β in degrees (Section 5), and |F|; a zero force has the angles 0.
pub fn polar(force: [f64; 3]) -> [f64; 3] {
    if force == [0.0; 3] {
        return force;
    }
    let [x, y, z] = force;
    let alpha = libm::atan2(x, -z).to_degrees();
    let beta = libm::atan2(y, (x * x + z * z).sqrt()).to_degrees();
    [alpha, beta, norm(force)]
}

/// The force with these angles, degrees, and this |F|.
pub fn from_polar([alpha_deg, beta_deg, magnitude]: [f64; 3]) -> [f64; 3] {
    let (sin_a, cos_a) = libm::sincos(alpha_deg.to_radians());
    let (sin_b, cos_b) = libm::sincos(beta_deg.to_radians());
    [sin_a * cos_b, sin_b, -cos_a * cos_b].map(|part| part * magnitude)
}

/// Random loads: |F|, α, β and the tip's place are uniform and independent, from 0 to their limits.
#[derive(Clone, Copy, Debug)]
pub struct RandomLoads {
    /// The limits.
    pub range: Range,
    /// Seed of the loads.
    pub seed: u64,
}

impl RandomLoads {
    /// The load of a row; it depends only on the row's number and these settings.
    ///
    /// # Errors
    /// When the limits cannot be those of a force.
    pub fn load(&self, row: usize) -> Result<Load> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(row as u64);
        let Range {
            force_n,
            alpha_deg,
            beta_deg,
            place_mm,
        } = self.range;
        let force = force_n * random.random_range(0.0..=1.0);
        let alpha = alpha_deg * random.random_range(-1.0..=1.0);
        let beta = beta_deg * random.random_range(-1.0..=1.0);
        let load = Load::from_angles(force, alpha, beta)?;
        if place_mm == 0.0 {
            return Ok(load);
        }
        let place = [0; 2].map(|_: u8| place_mm * random.random_range(-1.0..=1.0));
        Ok(load.with_offset_mm(place)?)
    }
}

/// The paper's poses (Section 6): α from −10° to 10°, β from −8° to 8°, in steps of 1°, with |F|
/// uniform from 0 to its limit.
#[derive(Clone, Copy, Debug)]
pub struct PaperPoses {
    /// The largest |F|, N.
    pub force_n: f64,
    /// Seed of the forces.
    pub seed: u64,
}

impl PaperPoses {
    /// Largest |α| and |β|, whole degrees.
    const ALPHA: usize = 10;
    const BETA: usize = 8;
    /// Number of poses: 21 · 17.
    pub const COUNT: usize = (2 * Self::ALPHA + 1) * (2 * Self::BETA + 1);

    /// α and β of a pose in degrees; β changes fastest.
    pub fn angles_deg(pose: usize) -> [f64; 2] {
        let betas = 2 * Self::BETA + 1;
        [
            (pose / betas) as f64 - Self::ALPHA as f64,
            (pose % betas) as f64 - Self::BETA as f64,
        ]
    }

    /// The number of the pose with these angles; `None` if there is no such pose.
    pub fn numbered([alpha, beta]: [f64; 2]) -> Option<usize> {
        (0..Self::COUNT).find(|&pose| Self::angles_deg(pose) == [alpha, beta])
    }

    /// The load of a row in a pose below [`Self::COUNT`].
    ///
    /// # Errors
    /// When the limit cannot be that of a force.
    pub fn load(&self, pose: usize, row: usize) -> Result<Load> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(row as u64);
        let [alpha, beta] = Self::angles_deg(pose);
        Ok(Load::from_angles(
            self.force_n * random.random_range(0.0..=1.0),
            alpha,
            beta,
        )?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loads_fill_their_range_and_no_more() {
        let loads = RandomLoads {
            range: Range::default(),
            seed: 5,
        };
        let drawn: Vec<Load> = (0..2000).map(|row| loads.load(row).unwrap()).collect();
        let extent = |of: fn(&Load) -> f64| {
            let values = drawn.iter().map(of);
            (
                values.clone().fold(f64::MAX, f64::min),
                values.fold(f64::MIN, f64::max),
            )
        };
        let (low, high) = extent(Load::magnitude_n);
        assert!(
            (0.0..0.001).contains(&low) && (0.199..=0.2).contains(&high),
            "{low} {high}"
        );
        let (low, high) = extent(Load::alpha_deg);
        assert!(
            (-10.0..-9.9).contains(&low) && (9.9..=10.0).contains(&high),
            "{low} {high}"
        );
        let (low, high) = extent(Load::beta_deg);
        assert!(
            (-8.0..-7.9).contains(&low) && (7.9..=8.0).contains(&high),
            "{low} {high}"
        );
    }

    #[test]
    fn places_fill_their_square_and_change_no_force() {
        let loads = |place_mm| RandomLoads {
            range: Range {
                place_mm,
                ..Range::default()
            },
            seed: 5,
        };
        let places: Vec<[f64; 2]> = (0..2000)
            .map(|row| {
                let (middle, anywhere) = (loads(0.0).load(row).unwrap(), loads(4.0).load(row));
                let anywhere = anywhere.unwrap();
                assert_eq!(middle.vector_n(), anywhere.vector_n());
                assert_eq!(middle.offset_mm(), [0.0; 2]);
                anywhere.offset_mm()
            })
            .collect();
        for axis in 0..2 {
            let mean = places.iter().map(|place| place[axis]).sum::<f64>() / 2000.0;
            let most = places.iter().map(|p| p[axis].abs()).fold(0.0, f64::max);
            assert!(
                mean.abs() < 0.2 && (3.98..=4.0).contains(&most),
                "{mean} {most}"
            );
        }
    }

    #[test]
    fn the_papers_poses_are_357() {
        assert_eq!(PaperPoses::COUNT, 357);
        assert_eq!(PaperPoses::angles_deg(0), [-10.0, -8.0]);
        assert_eq!(PaperPoses::angles_deg(1), [-10.0, -7.0]);
        assert_eq!(PaperPoses::angles_deg(178), [0.0, 0.0]);
        assert_eq!(PaperPoses::angles_deg(356), [10.0, 8.0]);
        assert_eq!(PaperPoses::numbered([-10.0, -7.0]), Some(1));
        assert_eq!(PaperPoses::numbered([0.5, 0.0]), None);
    }

    #[test]
    fn a_row_depends_on_seed_and_number_only() {
        let loads = |seed| RandomLoads {
            range: Range::default(),
            seed,
        };
        assert_eq!(loads(1).load(7).unwrap(), loads(1).load(7).unwrap());
        assert_ne!(loads(1).load(7).unwrap(), loads(1).load(8).unwrap());
        assert_ne!(loads(1).load(7).unwrap(), loads(2).load(7).unwrap());
    }
}
