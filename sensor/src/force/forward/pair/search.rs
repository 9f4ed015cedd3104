//! Looks for two contacts in parts, each about as long as one step, and follows them from frame to
//! frame.

use super::descent::{Problem, STEPS};
use super::{
    ALONG, APART_MM, DESCENTS, LEAST_APART_MM, PARTS, Pair, PairEstimate, far_mm, has_rival,
    is_explained,
};
use crate::force::forward::pose::Pose;

/// Number of starts, and how many are compared in place of one step.
const STARTS: usize = ALONG.len() * APART_MM.len() * PARTS.len();
const AT_ONCE: usize = 4;
/// One contact of unknown width has four unknowns fewer than two: it explains the markers as well
/// if it leaves at most so much more, as noise does on average.
const FEWER_UNKNOWNS: f32 = 4.0;

/// A number of steps that may be taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Work(pub u32);

impl Work {
    /// As many as are of use: for a computer.
    pub const ALL: Work = Work(u32::MAX);
    /// The work of a device in one frame.
    pub const OF_A_FRAME: Work = Work(1);

    /// Takes one; returns whether there was one.
    fn take(&mut self) -> bool {
        let was_there = self.0 > 0;
        self.0 = self.0.saturating_sub(1);
        was_there
    }
}

/// A search for the two contacts that explain one frame.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    one: Pose,
    /// The next start to compare; then all are.
    start: usize,
    /// The nearest starts, the best first. Later where steps led from there.
    nearest: [(f32, Pair); DESCENTS],
    /// The start from which steps are taken, and how many were.
    descent: usize,
    steps: usize,
    /// Whether one contact, wider than a needle, explains the markers as well; `None` before all
    /// steps are taken.
    is_one: Option<bool>,
}

impl Search {
    /// Begins around the contact that explains the markers best.
    pub fn new(one: Pose) -> Search {
        Search {
            one,
            start: 0,
            nearest: [(f32::INFINITY, [one; 2]); DESCENTS],
            descent: 0,
            steps: 0,
            is_one: None,
        }
    }

    /// Goes on until it is over, or the work is done. Returns whether it is over.
    pub fn go_on(&mut self, problem: &Problem<'_>, work: &mut Work) -> bool {
        while self.is_one.is_none() && work.take() {
            if self.start < STARTS {
                self.compare(problem);
            } else if self.descent < DESCENTS {
                self.step(problem);
            } else {
                self.is_one = Some(self.is_one_wide(problem));
            }
        }
        self.is_one.is_some()
    }

    /// Compares the next starts.
    fn compare(&mut self, problem: &Problem<'_>) {
        for _ in 0..AT_ONCE {
            let nth = self.start;
            let [along, apart_mm, part] = [
                nth / (APART_MM.len() * PARTS.len()),
                nth / PARTS.len() % APART_MM.len(),
                nth % PARTS.len(),
            ];
            let start = ALONG.get(along).zip(APART_MM.get(apart_mm));
            let Some(((along, apart_mm), part)) = start.zip(PARTS.get(part)) else {
                return;
            };
            let pair = problem.forward.around(&self.one, *along, *apart_mm, *part);
            let mut next = (problem.left(&pair), pair);
            for kept in &mut self.nearest {
                if next.0 < kept.0 {
                    core::mem::swap(kept, &mut next);
                }
            }
            self.start += 1;
        }
    }

    /// Takes the next step.
    fn step(&mut self, problem: &Problem<'_>) {
        let Some((unexplained, pair)) = self.nearest.get_mut(self.descent) else {
            return;
        };
        let stepped = problem.step(*pair);
        *unexplained = stepped.here.unexplained;
        match stepped.next.filter(|_| self.steps < STEPS) {
            Some((next, _)) => {
                *pair = next;
                self.steps += 1;
            }
            None => {
                self.descent += 1;
                self.steps = 0;
            }
        }
    }

    /// Returns whether one contact of unknown width explains the markers as well as two do that are
    /// not resolved. A ball is no needle, and moves markers as two near needles do.
    fn is_one_wide(&self, problem: &Problem<'_>) -> bool {
        let (unexplained, [first, second]) = self.best_of_all();
        let wide = || problem.one_wide(self.one);
        far_mm(&first, &second) < LEAST_APART_MM
            && is_explained(unexplained)
            && wide().is_some_and(|wide| {
                wide.is_explained() && wide.unexplained < unexplained + FEWER_UNKNOWNS
            })
    }

    /// The contacts that leave least, and how much.
    fn best_of_all(&self) -> (f32, Pair) {
        let mut best = (f32::INFINITY, [self.one; 2]);
        for found in &self.nearest {
            if found.0 < best.0 {
                best = *found;
            }
        }
        best
    }

    /// Returns the contacts and their residual, once the search is over. Returns `None` if two do
    /// not explain the markers, or one does as well.
    pub fn found(&self) -> Option<Found> {
        let (unexplained, pair) = self.best_of_all();
        let rivals = |other: &(f32, Pair)| has_rival((unexplained, &pair), (other.0, &other.1));
        let is_two = is_explained(unexplained) && self.is_one == Some(false);
        is_two.then(|| Found {
            pair,
            unexplained,
            is_only: !self.nearest.iter().any(rivals),
        })
    }

    /// [`found`](Self::found), with how well they are known in the markers of the search.
    pub fn best(&self, problem: &Problem<'_>) -> Option<PairEstimate> {
        let Found { pair, is_only, .. } = self.found()?;
        Some(PairEstimate {
            is_only,
            ..problem.step(pair).here
        })
    }
}

/// The result of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// The contacts.
    pub pair: Pair,
    /// The squared residual, relative to its covariance.
    pub unexplained: f32,
    /// Whether no other two contacts were found that explain the markers nearly as well.
    pub is_only: bool,
}

impl From<Found> for PairEstimate {
    /// How well they are known is not known before a step.
    fn from(found: Found) -> PairEstimate {
        PairEstimate {
            pair: found.pair,
            size: 0.0,
            unexplained: found.unexplained,
            is_only: found.is_only,
            solved: None,
        }
    }
}

/// Returns the contacts of the frame before, taken nearer to this frame's by a step, and by more if
/// there is work left. Without work it returns them as they were.
pub fn follow(before: &PairEstimate, problem: &Problem<'_>, work: &mut Work) -> PairEstimate {
    if !work.take() {
        return problem.held(before);
    }
    let mut stepped = problem.step(before.pair);
    while let Some((next, _)) = stepped.next.filter(|_| work.take()) {
        stepped = problem.step(next);
    }
    let mut estimate = stepped.here;
    if let Some((next, unexplained)) = stepped.next {
        // Slopes where the step began are near enough for the uncertainties.
        (estimate.pair, estimate.unexplained) = (next, unexplained);
    }
    estimate.is_only = before.is_only;
    estimate
}
