//! Work in parts that all processors share.

use std::sync::{Mutex, PoisonError};

use anyhow::Result;
use rayon::prelude::*;

/// Does `count` parts of some work; returns their results in order.
pub fn map<T: Send>(count: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let made: Vec<Mutex<Option<T>>> = (0..count).map(|_| Mutex::default()).collect();
    each(count, &|part| {
        let done = work(part);
        *made[part].lock().unwrap_or_else(PoisonError::into_inner) = Some(done);
    });
    made.into_iter()
        .filter_map(|done| done.into_inner().unwrap_or_else(PoisonError::into_inner))
        .collect()
}

/// As [`map`], for work that can fail.
///
/// # Errors
/// The first part's that failed.
pub fn try_map<T: Send>(count: usize, work: impl Fn(usize) -> Result<T> + Sync) -> Result<Vec<T>> {
    map(count, work).into_iter().collect()
}

/// Of one type for all work, so that it is compiled once.
fn each(count: usize, work: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().for_each(work);
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    #[test]
    fn parts_are_in_their_order_and_the_first_error_is_reported() {
        assert_eq!(
            map(1000, |part| 3 * part),
            (0..1000).map(|part| 3 * part).collect::<Vec<_>>()
        );
        let odd = |part: usize| match part % 2 {
            0 => Ok(part),
            _ => Err(anyhow!("part {part}")),
        };
        assert_eq!(try_map(9, odd).unwrap_err().to_string(), "part 1");
        assert_eq!(try_map(1, odd).unwrap(), [0]);
    }
}
