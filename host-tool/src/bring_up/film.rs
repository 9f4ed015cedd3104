//! Checks whether the film keeps the room's light out: a hand over it must not change the picture.

use super::colours::Middle;
use super::report::Step;
use serde_json::json;

/// Largest relative change of a level by a hand.
const LARGEST_CHANGE: f64 = 0.03;

/// Judges the middle of a picture of the free film, and of one with a hand over it, which does not
/// touch it.
pub fn judge(free: &Middle, covered: &Middle) -> Step {
    let channels = free.mean.iter().zip(covered.mean);
    let changes = channels.map(|(free, covered)| covered / free.max(1.0) - 1.0);
    let largest = changes.fold(0.0, |most: f64, change| {
        if change.abs() > most.abs() {
            change
        } else {
            most
        }
    });
    let percent = 100.0 * largest;
    let wrong = (largest.abs() > LARGEST_CHANGE).then(|| {
        format!(
            "a hand over the film changes it by {percent:+.0} % (at most {:.0}): the film lets \
             light through, or light comes in around it; use an opaque film or a black skin, and \
             close the shell",
            100.0 * LARGEST_CHANGE
        )
    });
    let found = format!("a hand over it changes the picture by {percent:+.1} %");
    let figures = json!({ "free": free.mean, "covered": covered.mean });
    Step::new("film", found, wrong.into_iter().collect(), figures)
}
