//! Which rows a training does not see.

use anyhow::{Result, ensure};
use clap::ValueEnum;
use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::{Dataset, Row};

/// What is held out together: one row or pose in ten, one session in four.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Split {
    /// Single rows: every pose is seen in training, with other forces (the paper's).
    #[default]
    WithinPose,
    /// All rows of a pose: directions between those of training.
    Poses,
    /// All rows of a session: built, mounted, lit, focused and pressed otherwise than in training.
    Sessions,
}

impl Split {
    /// What it says, for reports.
    pub fn words(self) -> &'static str {
        match self {
            Split::WithinPose => "rows held out at random within poses",
            Split::Poses => "whole poses held out",
            Split::Sessions => "whole sessions held out",
        }
    }

    /// One group in this many is held out, at least one. Each session is wrong in its own way: it takes many to know how much.
    fn part(self) -> usize {
        match self {
            Split::WithinPose | Split::Poses => 10,
            Split::Sessions => 4,
        }
    }

    fn group(self, index: usize, row: &Row) -> Option<usize> {
        match self {
            Split::WithinPose => Some(index),
            Split::Poses => row.place.pose,
            Split::Sessions => Some(row.place.session),
        }
    }

    /// Numbers of the rows to train on and of those held out, each in order. Rejected rows are in neither; rows without
    /// a pose are trained on when poses are held out.
    ///
    /// # Errors
    /// When there are fewer than two groups.
    pub fn of(self, dataset: &Dataset, seed: u64) -> Result<[Vec<usize>; 2]> {
        let rows = || {
            dataset
                .rows
                .iter()
                .enumerate()
                .filter(|(_, row)| row.seen.is_ok())
        };
        let mut groups: Vec<usize> = rows().filter_map(|(i, row)| self.group(i, row)).collect();
        groups.sort_unstable();
        groups.dedup();
        let what = match self {
            Split::WithinPose => "rows",
            Split::Poses => "poses",
            Split::Sessions => "sessions",
        };
        ensure!(
            groups.len() > 1,
            "the data set has {} {what}: none can be held out",
            groups.len()
        );
        groups.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
        groups.truncate((groups.len() / self.part()).max(1));
        groups.sort_unstable();
        let held = |&(i, row): &(usize, &Row)| {
            self.group(i, row)
                .is_some_and(|g| groups.binary_search(&g).is_ok())
        };
        let (held_out, training): (Vec<_>, Vec<_>) = rows().partition(held);
        Ok([training, held_out].map(|rows| rows.into_iter().map(|(i, _)| i).collect()))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::super::tests::many;
    use super::*;

    #[test]
    fn groups_are_held_out_whole() {
        let dataset = many(3, 20, 5);
        for split in [Split::WithinPose, Split::Poses, Split::Sessions] {
            let [training, held_out] = split.of(&dataset, 4).unwrap();
            let groups = |rows: &[usize]| -> BTreeSet<Option<usize>> {
                rows.iter()
                    .map(|&i| split.group(i, &dataset.rows[i]))
                    .collect()
            };
            assert!(
                groups(&training).is_disjoint(&groups(&held_out)),
                "{split:?}"
            );
            assert_eq!(training.len() + held_out.len(), dataset.accepted().count());
            let expected = match split {
                Split::WithinPose => 30,
                Split::Poses => 30,
                Split::Sessions => 101,
            };
            assert_eq!(held_out.len(), expected, "{split:?}");
            assert_eq!(split.of(&dataset, 4).unwrap(), [training, held_out]);
        }
    }

    #[test]
    fn what_there_is_not_cannot_be_held_out() {
        let dataset = many(1, 1, 5);
        assert!(Split::WithinPose.of(&dataset, 1).is_ok());
        let error = Split::Sessions.of(&dataset, 1).unwrap_err().to_string();
        assert!(error.contains("1 sessions"), "{error}");
        assert!(Split::Poses.of(&dataset, 1).is_err());
    }
}
