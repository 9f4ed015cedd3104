//! Splits rows into those for training and those held out.

use anyhow::{Result, ensure};
use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;

use super::Dataset;

/// One accepted row in this many is held out, at least one.
const PART: usize = 10;

impl Dataset {
    /// Numbers of the rows to train on and of those held out, each in order, without rejected rows.
    /// The same seed holds out the same rows.
    ///
    /// # Errors
    /// When there are fewer than two accepted rows.
    pub fn split(&self, seed: u64) -> Result<[Vec<usize>; 2]> {
        let rows = self.rows.iter().enumerate();
        let accepted = rows.filter(|(_, row)| row.seen.is_ok());
        let accepted: Vec<usize> = accepted.map(|(number, _)| number).collect();
        ensure!(
            accepted.len() > 1,
            "the data set has {} rows: none can be held out",
            accepted.len()
        );
        let mut held_out = accepted.clone();
        held_out.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
        held_out.truncate((held_out.len() / PART).max(1));
        held_out.sort_unstable();
        let is_left = |number: &usize| held_out.binary_search(number).is_err();
        let training = accepted.into_iter().filter(is_left).collect();
        Ok([training, held_out])
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::many;

    #[test]
    fn a_tenth_is_held_out_the_same_for_the_same_seed() {
        let dataset = many(3, 20, 5);
        let [training, held_out] = dataset.split(4).unwrap();
        assert_eq!(training.len() + held_out.len(), dataset.accepted().count());
        assert_eq!(held_out.len(), 30);
        assert!(held_out.iter().all(|row| !training.contains(row)));
        assert_eq!(dataset.split(4).unwrap(), [training, held_out.clone()]);
        assert_ne!(dataset.split(5).unwrap()[1], held_out);
    }

    #[test]
    fn what_there_is_not_cannot_be_held_out() {
        let mut dataset = many(1, 1, 5);
        assert!(dataset.split(1).is_ok());
        dataset.rows.truncate(1);
        let error = dataset.split(1).unwrap_err().to_string();
        assert!(error.contains("1 rows"), "{error}");
    }
}
