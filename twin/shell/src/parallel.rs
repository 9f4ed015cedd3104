//! Runs many presses on several threads.

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::{Design, Film, ShellError};

/// Runs `work` on each item, every thread with its own film. Returns the results in the items'
/// order.
pub fn in_parallel<T: Sync, R: Send>(
    design: &Design,
    items: &[T],
    threads: usize,
    progress: impl Fn(usize, usize) + Sync,
    work: impl Fn(&mut Film, &T) -> Result<R, ShellError> + Sync,
) -> Result<Vec<R>, ShellError> {
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let worker = || -> Result<Vec<(usize, R)>, ShellError> {
        let mut film = Film::new(design)?;
        let mut results = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(index) else {
                return Ok(results);
            };
            results.push((index, work(&mut film, item)?));
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, items.len());
        }
    };
    let shares = std::thread::scope(|scope| {
        let handles: Vec<_> = (0..threads.max(1)).map(|_| scope.spawn(worker)).collect();
        let stopped = || ShellError::Solver("a thread stopped".into());
        let joined = handles
            .into_iter()
            .map(|handle| handle.join().map_err(|_| stopped())?);
        joined.collect::<Result<Vec<_>, _>>()
    })?;
    let mut all: Vec<(usize, R)> = shares.into_iter().flatten().collect();
    all.sort_by_key(|(index, _)| *index);
    Ok(all.into_iter().map(|(_, result)| result).collect())
}
