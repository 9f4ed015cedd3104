//! Which loads a data set shows.

use anyhow::Result;
use hivtac_scene::Load;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::weights::Range;

/// Loads drawn at random: |F|, α and β uniform and independent from nothing to their limits.
#[derive(Clone, Copy, Debug)]
pub struct RandomLoads {
    /// The limits.
    pub range: Range,
    /// How many loads come first that are no load at all; they give the rest position.
    pub rest: usize,
    /// Decides the loads.
    pub seed: u64,
}

impl RandomLoads {
    /// The load of a row; it depends on nothing but the row's number and these settings.
    ///
    /// # Errors
    /// When the limits are no limits of a force.
    pub fn load(&self, row: usize) -> Result<Load> {
        if row < self.rest {
            return Ok(Load::REST);
        }
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(row as u64);
        let Range {
            force_n,
            alpha_deg,
            beta_deg,
        } = self.range;
        let force = force_n * random.random_range(0.0..=1.0);
        let alpha = alpha_deg * random.random_range(-1.0..=1.0);
        let beta = beta_deg * random.random_range(-1.0..=1.0);
        Ok(Load::from_angles(force, alpha, beta)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loads_fill_their_range_and_no_more() {
        let loads = RandomLoads {
            range: Range::default(),
            rest: 3,
            seed: 5,
        };
        let drawn: Vec<Load> = (0..2000).map(|row| loads.load(row).unwrap()).collect();
        assert!(drawn[..3].iter().all(|load| *load == Load::REST));
        let extent = |of: fn(&Load) -> f64| {
            let values = drawn[3..].iter().map(of);
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
    fn a_row_depends_on_seed_and_number_only() {
        let loads = |seed| RandomLoads {
            range: Range::default(),
            rest: 0,
            seed,
        };
        assert_eq!(loads(1).load(7).unwrap(), loads(1).load(7).unwrap());
        assert_ne!(loads(1).load(7).unwrap(), loads(1).load(8).unwrap());
        assert_ne!(loads(1).load(7).unwrap(), loads(2).load(7).unwrap());
    }
}
