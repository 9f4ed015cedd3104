//! Resolves two contacts in a frame that one does not explain, and follows them from frame to
//! frame.

use super::explained::{Resting, of_vector, rounded};
use super::{Force, FrameNoise, trust};
use crate::force::forward::pair::{Found, PairEstimate, Part, Problem, Search, Work, find, follow};
use crate::force::forward::{Forward, Pose, Start};
use crate::force::model::CalibratedRange;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::marker::MarkerList;
use hivtac_terms::status::Status;
use hivtac_terms::units::MicroNewtons;

/// Frames after which two contacts that explained none of them are forgotten.
const FORGOTTEN: u8 = 16;
/// Frames between two looks for others that explain them as well.
const LOOK_EVERY: u8 = 64;

/// The ratio of a contact's size to the other's below which it may have ended.
const ENDED: f32 = 0.2;

/// Two contacts that explain a frame together.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TwoContacts {
    /// The sum of both forces. Its place is the mean of both places by the forces' sizes.
    pub sum: Force,
    /// Each of them; `None` if they are too near to each other for that, or if two others explain
    /// the frame nearly as well.
    pub each: Option<[Force; 2]>,
    /// How far the sum can be trusted: range, reliability and contact.
    pub status: Status,
}

/// Two contacts as known from earlier frames.
#[derive(Clone, Copy, Debug)]
pub struct Pairs {
    known: Option<PairEstimate>,
    /// Frames since these explained one, and since the last search for others.
    missed: u8,
    looked: u8,
    /// A search under way, and the markers for which it looks.
    search: Option<(Search, MarkerList)>,
    /// Whether the search has this frame's work: every second one's, where there is not enough for
    /// both.
    searches: bool,
}

/// The work allowed for a frame that one contact does not explain, and the data about it.
#[derive(Clone, Copy, Debug)]
pub struct Means {
    /// Steps.
    pub work: Work,
    /// The one contact that explains it best, if that is known.
    pub one: Option<Pose>,
}

impl Pairs {
    /// Nothing.
    pub const NONE: Pairs = Pairs {
        known: None,
        missed: 0,
        looked: 0,
        search: None,
        searches: false,
    };

    /// Takes a frame that one contact explains, or that shows none.
    pub fn miss(&mut self) {
        self.search = None;
        self.pass();
    }

    /// Whether two contacts explained the frame before.
    pub fn are_followed(&self) -> bool {
        self.known.is_some() && self.missed == 0
    }

    /// The stronger of two contacts that explained the frame before, if the other one is hardly
    /// there: perhaps it ended.
    pub fn nearly_one(&self) -> Option<Pose> {
        let [first, second] = self.known.filter(|_| self.missed == 0)?.pair;
        let [weaker, stronger] = match first.size < second.size {
            true => [first, second],
            false => [second, first],
        };
        (weaker.size < ENDED * stronger.size).then_some(stronger)
    }

    /// Takes a frame that the known contacts do not explain.
    fn pass(&mut self) {
        self.missed = self.missed.saturating_add(1);
        if self.missed > FORGOTTEN {
            self.known = None;
        }
    }

    /// Follows the known contacts to a frame; returns those that explain it. Where the work is not
    /// enough for a search as well, they are held for every second frame.
    fn follow(&mut self, problem: &Problem<'_>, work: &mut Work) -> Option<PairEstimate> {
        let is_wanted = self.search.is_some() || self.must_look();
        let known = self.known.as_ref()?;
        // They take turns in frames with work.
        if *work != Work(0) {
            self.searches = is_wanted && !self.searches;
        }
        let is_held = is_wanted && self.searches && *work != Work::ALL;
        let estimate = match is_held {
            true => follow(known, problem, &mut Work(0)),
            false => follow(known, problem, work),
        };
        self.looked = self.looked.saturating_add(1);
        self.known = Some(estimate);
        match estimate.is_explained() {
            true => self.missed = 0,
            false => self.pass(),
        }
        Some(estimate).filter(|estimate| estimate.is_explained() && estimate.solved.is_some())
    }

    /// Whether to search for contacts: none are known, or there may be others.
    fn must_look(&self) -> bool {
        let is_sure = |known: &PairEstimate| known.is_only || self.looked < LOOK_EVERY;
        self.search.is_none() && (self.missed > 0 || !self.known.as_ref().is_some_and(is_sure))
    }

    /// Takes the result of a search.
    fn take(&mut self, found: Option<Found>) {
        self.search = None;
        self.looked = 0;
        if let Some(found) = found {
            self.missed = 0;
            self.known = Some(PairEstimate::from(found));
        }
    }
}

impl Resting {
    /// Returns the two contacts that explain the markers, and their sum; `None` if one contact
    /// explains them, two do not, or what presses is not known to be a needle. It begins with those
    /// of the frames before. Where the work does not suffice, it goes on with the next frame.
    #[inline(never)]
    pub fn follow_two_contacts(
        &self,
        forward: &Forward<'_>,
        range: &CalibratedRange,
        markers: &MarkerList,
        noise: FrameNoise,
        (pairs, mut means): (&mut Pairs, Means),
    ) -> Option<TwoContacts> {
        if self.shape != ContactShape::Needle {
            return None;
        }
        let observed = self.observed(forward, markers, noise);
        let unknown = forward.unknown(self.is_own);
        let found = find(forward, &observed, &self.mounting, unknown, |problem| {
            let followed = pairs.follow(problem, &mut means.work);
            let searched = self.search(problem, markers, noise, (pairs, &mut means));
            followed.or(searched)
        });
        self.forces(forward, range, &found??)
    }

    /// Goes on with a search, or begins one. Returns the contacts if it ends with this frame's.
    #[inline(never)]
    fn search(
        &self,
        problem: &Problem<'_>,
        markers: &MarkerList,
        noise: FrameNoise,
        (pairs, means): (&mut Pairs, &mut Means),
    ) -> Option<PairEstimate> {
        if means.work == Work(0) {
            return None;
        }
        if pairs.must_look() {
            let one = problem.one(means.one.map_or(Start::Anywhere, Start::At));
            if one.is_explained() {
                return None;
            }
            pairs.search = Some((Search::new(one.pose), *markers));
        }
        let (search, searched) = pairs.search.as_mut()?;
        let is_now = searched == markers;
        let observed = self.observed(problem.forward, searched, noise);
        let problem = Problem {
            observed: &observed,
            ..*problem
        };
        if !search.go_on(&problem, &mut means.work) {
            return None;
        }
        let found = search.found();
        let best = is_now.then(|| search.best(&problem)).flatten();
        pairs.take(found);
        best
    }

    /// The forces of two contacts; `None` beyond the tables.
    fn forces(
        &self,
        forward: &Forward<'_>,
        range: &CalibratedRange,
        found: &PairEstimate,
    ) -> Option<TwoContacts> {
        let strength = forward.strength(self.is_own);
        let of_part = |part: Part| {
            let cartesian = part.force_n.map(|part| MicroNewtons(rounded(1e6 * part)));
            of_vector(cartesian, part.place_mm, part.sigma)
        };
        let (sum, by_noise) = of_part(found.sum(&strength));
        let each = || found.contacts(&strength).map(|part| of_part(part).0);
        let in_tables = found.size < forward.limits.size;
        in_tables.then(|| TwoContacts {
            status: trust(&sum, by_noise, range),
            sum,
            each: found.are_apart(&strength).then(each),
        })
    }
}
