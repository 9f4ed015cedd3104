//! Finds where the untouched film rests: how far from its rest position, and re-zeroing, which
//! follows it.
//!
//! The markers' rest positions drift with temperature and with the film's creep. Frames with all
//! markers within half a pixel of the rest position show the untouched film, whether or not a force
//! explains them: a touch moves the markers farther. The mean of a second of such frames gives the
//! drift.
//!
//! Once this has lasted long enough, each coordinate of the rest position follows that mean. It
//! moves by at most a rate, and never farther from where it was taken than a total.
//!
//! A force too small for a contact looks like drift. A force that grows no faster than the rate is
//! followed, and is missing in every later force, up to the total. A force that grows faster
//! becomes a contact and stays whole, except for the part that was followed until then. In the
//! simulated sensor at 320×240 a straight press moves each coordinate by 2.6 px for its first mN,
//! and by 0.1 px per mN at 0.1 N (`twin/shell`, its example `solve`). So the usual rate of
//! 0.005 px a second is 2 µN a second at rest. The usual total of 0.2 px takes 0.08 mN of a force
//! of a few mN, and at most 2 mN of one of 0.1 N.

use crate::force::features::Features;
use crate::force::forward::{Drift, Gravity, Markers};
use crate::force::rest::Rest;
use hivtac_terms::fixed::Q;
use hivtac_terms::list::List;
use hivtac_terms::marker::MOST_MARKERS;
use hivtac_terms::status::Status;
use hivtac_terms::temporal::Rezero;
use hivtac_terms::units::{MilliPx, Px};

/// x and y of each marker.
type Coordinates<T> = List<T, { 2 * MOST_MARKERS }>;

/// Time over which frames are averaged, µs.
const MEAN_US: u64 = 1_000_000;
/// The rest position counts as moved if a coordinate was seen farther from it than this, px: 3 µm
/// of film.
const MOVED_PX: f32 = 0.05;
/// Frames farther apart than this do not follow each other: a touch in between would be unseen.
const LONGEST_GAP_US: u64 = 100_000;
/// Most frames of a mean: 65 s of frames of a millisecond. Sums are below 2⁴⁸.
const MOST_FRAMES: u32 = 1 << 16;

/// A frame's evidence about the rest position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RestChange {
    /// No result: no second of the untouched film ends with this frame.
    Nothing,
    /// A new drift: how far the film rests from the rest position.
    Drift,
    /// A new drift, and re-zeroing moved the rest position.
    Moved,
}

/// A rest position that forces are measured against, and its changes since it was taken.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tare {
    /// The rest position as it was taken.
    taken: Rest,
    /// Gravity then, in g, film frame; `None` if unknown.
    down: Option<Gravity>,
    /// The taken position converted to today's gravity.
    hung: Rest,
    /// How far re-zeroing moved it from there: x and y of each marker.
    moved: Coordinates<Px>,
    /// The result: the rest position in use.
    rest: Rest,
    /// How far the film may rest from that.
    drift: Drift,
    /// True once the untouched film was seen.
    is_seen: bool,
    quiet: Option<Quiet>,
}

/// A time in which the film was not touched.
#[derive(Clone, Copy, Debug)]
struct Quiet {
    since_us: u64,
    newest_us: u64,
    mean: Mean,
}

/// A mean of frames.
#[derive(Clone, Copy, Debug)]
struct Mean {
    begun_us: u64,
    frames: u32,
    /// x and y of each marker, px.
    sums: Coordinates<Q<16, i64>>,
}

impl Mean {
    /// A mean of no frames, of as many coordinates.
    fn new(begun_us: u64, coordinates: usize) -> Mean {
        Mean {
            begun_us,
            frames: 0,
            sums: List::defaults(coordinates),
        }
    }

    /// The mean's difference from a rest position, px.
    fn beside(&self, rest: &Rest) -> Coordinates<Q<16, i64>> {
        let frames = i64::from(self.frames);
        let mut beside = self.sums;
        for (part, rest) in beside.iter_mut().zip(coordinates(rest)) {
            *part = Q::from_bits(part.bits().checked_div(frames).unwrap_or(0)) - Q::from(rest);
        }
        beside
    }
}

impl Tare {
    /// A rest position that was taken under a gravity, `None` if unknown, and from which the film
    /// may have drifted since.
    pub fn new(taken: Rest, drift: Drift, down: Option<Gravity>) -> Tare {
        Tare {
            taken,
            down,
            hung: taken,
            moved: List::defaults(2 * taken.areas.len()),
            rest: taken,
            drift,
            is_seen: false,
            quiet: None,
        }
    }

    /// Restarts the waiting time; re-zeroing so far is kept.
    pub fn begin_anew(&mut self) {
        self.quiet = None;
    }

    /// The rest position as it was taken.
    pub fn taken(&self) -> &Rest {
        &self.taken
    }

    /// Gravity when it was taken; `None` if unknown.
    pub fn down(&self) -> Option<Gravity> {
        self.down
    }

    /// Sets the rest position under today's gravity; re-zeroing so far is kept.
    pub fn hang(&mut self, hung: Rest) {
        if self.hung != hung {
            self.hung = hung;
            self.quiet = None;
            self.rezero();
        }
    }

    fn rezero(&mut self) {
        let moved = self.moved.as_chunks().0.iter();
        let px = Markers::of(moved.map(|[x, y]| [x.to_f32(), y.to_f32()]));
        self.rest = self.hung.displaced(&px);
    }

    /// The rest position in use.
    pub fn rest(&self) -> &Rest {
        &self.rest
    }

    /// The distance by which re-zeroing has moved the coordinate that it moved most.
    pub fn farthest(&self) -> Px {
        let far = self.moved.iter().map(|moved| Px(moved.0.abs()));
        far.max().unwrap_or_default()
    }

    /// How far the film may rest from the rest position in use.
    pub fn drift(&self) -> &Drift {
        &self.drift
    }

    /// The largest distance of a coordinate from the rest position when the untouched film was last
    /// seen; `None` if it has not been seen.
    pub fn seen(&self) -> Option<MilliPx> {
        let far = 1e3 * self.drift.farthest_px() + 0.5;
        self.is_seen.then_some(MilliPx(far as u16))
    }

    /// Returns [`Status::REZEROED`] and [`Status::REST_MOVED`] if they apply.
    pub fn status(&self) -> Status {
        let mut status = Status::OK;
        if self.farthest() != Px(0) {
            status |= Status::REZEROED;
        }
        if self.drift.farthest_px() > MOVED_PX {
            status |= Status::REST_MOVED;
        }
        status
    }

    /// Takes the features of a frame without a contact; `None` for any other frame.
    pub fn follow(
        &mut self,
        limits: Option<&Rezero>,
        time_us: u64,
        features: Option<&Features>,
    ) -> RestChange {
        let Some(features) = features.filter(|features| self.rest.is_near(features)) else {
            self.quiet = None;
            return RestChange::Nothing;
        };
        let since = |quiet: &Quiet| time_us.saturating_sub(quiet.newest_us);
        let follows = |quiet: &Quiet| since(quiet) <= LONGEST_GAP_US;
        let mut quiet = self.quiet.filter(follows).unwrap_or(Quiet {
            since_us: time_us,
            newest_us: time_us,
            mean: Mean::new(time_us, self.moved.len()),
        });
        quiet.newest_us = time_us;
        take(&mut quiet.mean, features);
        let mean = quiet.mean;
        let averaged_us = time_us.saturating_sub(mean.begun_us);
        let is_due = averaged_us >= MEAN_US || mean.frames >= MOST_FRAMES;
        if is_due {
            quiet.mean = Mean::new(time_us, self.moved.len());
        }
        self.quiet = Some(quiet);
        if !is_due {
            return RestChange::Nothing;
        }
        let there = mean.beside(&self.hung);
        let quiet_us = mean.begun_us.saturating_sub(quiet.since_us);
        let is_long = |limits: &&Rezero| quiet_us >= u64::from(limits.after.0) * 1_000;
        let before = self.moved;
        if let Some(limits) = limits.filter(is_long) {
            self.move_towards(limits, &there);
        }
        // A seen drift replaces the uncertainty of an unseen one.
        (self.drift, self.is_seen) = (Drift::NONE, true);
        let mut seen_px = Markers::defaults(self.moved.len() / 2);
        let pairs = there.iter().zip(self.moved.iter());
        for (seen, (there, moved)) in seen_px.as_flattened_mut().iter_mut().zip(pairs) {
            *seen = Px::saturated(*there - Q::from(*moved)).to_f32();
        }
        self.drift.seen_px = Some(seen_px);
        if self.moved == before {
            return RestChange::Drift;
        }
        self.rezero();
        RestChange::Moved
    }

    fn move_towards(&mut self, limits: &Rezero, there: &[Q<16, i64>]) {
        let (rate, total) = (steps(limits.rate), steps(limits.total));
        for (moved, there) in self.moved.iter_mut().zip(there) {
            let farther = (*there - Q::from(*moved)).clamp(-rate, rate);
            // Also limits earlier motion, if the total was lowered.
            *moved = Px::saturated((Q::from(*moved) + farther).clamp(-total, total));
        }
    }
}

/// Converts to px.
fn steps(distance: MilliPx) -> Q<16, i64> {
    Q::from_bits(Q::<16, i64>::from_int(distance.0.into()).bits() / 1_000)
}

fn take(mean: &mut Mean, features: &Features) {
    mean.frames += 1;
    let all = features.centroids.iter().flat_map(|(x, y)| [*x, *y]);
    for (sum, coordinate) in mean.sums.iter_mut().zip(all) {
        *sum += Q::from(coordinate);
    }
}

fn coordinates(rest: &Rest) -> impl Iterator<Item = Px> {
    let centroids = rest.features.centroids;
    centroids.into_iter().flat_map(|(x, y)| [x, y])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::rest::NEAR;
    use hivtac_terms::marker::Marker;
    use proptest::prelude::*;

    const FRAME_US: u64 = 6_405;
    const LIMITS: Rezero = Rezero {
        after: hivtac_terms::units::Milliseconds(2_000),
        rate: MilliPx(10),
        total: MilliPx(100),
    };

    /// Markers that rest, all shifted to the right.
    fn shifted(right: Px) -> [Marker; 4] {
        [(100, 60), (210, 60), (210, 170), (100, 170)].map(|(x, y)| Marker {
            x: Px::from_int(x) + right,
            y: Px::from_int(y),
            area: 130,
        })
    }

    fn features(right: Px) -> Features {
        Features::of_markers(&shifted(right))
    }

    /// Follows a rest position frame by frame.
    struct Followed {
        tare: Tare,
        time_us: u64,
    }

    impl Followed {
        fn new() -> Self {
            let rest = Rest::of_markers(&shifted(Px(0)));
            Self {
                tare: Tare::new(rest, Drift::NONE, None),
                time_us: 5_000_000,
            }
        }

        /// Follows for this many ms; without features if something touches.
        fn for_ms(&mut self, ms: u64, features: Option<&Features>) {
            self.with(&LIMITS, ms, features);
        }

        fn with(&mut self, limits: &Rezero, ms: u64, features: Option<&Features>) {
            for _ in 0..ms * 1_000 / FRAME_US {
                self.time_us += FRAME_US;
                let before = self.tare;
                let reported = self.tare.follow(Some(limits), self.time_us, features);
                let has_moved = before.rest != self.tare.rest;
                assert_eq!(has_moved, reported == RestChange::Moved);
                assert!(reported != RestChange::Nothing || before.drift == self.tare.drift);
            }
        }

        /// Shift of the rest position to the right, px.
        fn right(&self) -> f64 {
            (self.tare.rest.features.centroids[0].0 - Px::from_int(100)).to_f64()
        }
    }

    #[test]
    fn it_waits_goes_by_its_rate_and_stops_at_its_total() {
        let drifted = features(NEAR);
        let mut film = Followed::new();
        film.for_ms(2_900, Some(&drifted));
        assert!(
            film.right() == 0.0 && film.tare.farthest() == Px(0),
            "it waits"
        );
        film.for_ms(5_000, Some(&drifted));
        assert!((0.039..0.061).contains(&film.right()), "{}", film.right());
        assert!((film.tare.farthest().to_f64() - film.right()).abs() < 1e-9);
        film.for_ms(20_000, Some(&drifted));
        assert!((film.right() - 0.1).abs() < 1e-4, "{}", film.right());
        assert_eq!(film.tare.rest.areas, [130; 4]);
        let moved = film.tare.rest.features;
        assert_eq!(moved, Features::of_markers(&film.tare.rest.markers()));
        let taken = Rest::of_markers(&shifted(Px(0)));
        assert_eq!(film.tare.taken(), &taken, "as it was taken");
        assert_eq!(film.tare.status(), Status::REZEROED | Status::REST_MOVED);
    }

    #[test]
    fn what_drifts_back_is_followed_back() {
        let mut film = Followed::new();
        film.for_ms(20_000, Some(&features(Px(3_000))));
        assert!((film.right() - 3_000.0 / 65_536.0).abs() < 1e-4);
        film.for_ms(20_000, Some(&features(Px(0))));
        assert_eq!(film.right(), 0.0);
    }

    #[test]
    fn nothing_is_followed_while_something_touches_nor_soon_after() {
        let drifted = features(NEAR);
        let mut film = Followed::new();
        film.for_ms(10_000, None);
        film.for_ms(1_900, Some(&drifted));
        film.for_ms(10, None);
        film.for_ms(2_900, Some(&drifted));
        assert_eq!(film.right(), 0.0);
        // A gap, in which a touch would be unseen.
        film.time_us += LONGEST_GAP_US;
        film.for_ms(2_900, Some(&drifted));
        assert_eq!(film.right(), 0.0);
    }

    /// A second of frames gives the film's distance from the rest position, even if that does not
    /// follow. A followed drift is no longer a drift.
    #[test]
    fn how_far_the_film_was_seen_from_there_stays_until_it_is_seen_again() {
        let mut film = Followed::new();
        film.for_ms(1_100, Some(&features(Px(6_554))));
        let far = |film: &Followed| f64::from(film.tare.drift().farthest_px());
        assert!((far(&film) - 0.1).abs() < 1e-4, "{}", far(&film));
        film.for_ms(60_000, None);
        assert!((far(&film) - 0.1).abs() < 1e-4, "through a press");
        film.for_ms(20_000, Some(&features(Px(6_554))));
        assert!((film.right() - 0.1).abs() < 1e-4 && far(&film) < 1e-4);
    }

    /// Five millinewtons for ten minutes, for which the chip gives no force: beyond half a pixel.
    #[test]
    fn what_is_held_is_no_rest() {
        let mut film = Followed::new();
        film.for_ms(600_000, Some(&features(Px(NEAR.0 + 1))));
        assert!(film.right() == 0.0 && film.tare.drift() == &Drift::NONE);
    }

    proptest! {
        /// No force, however it grows, moves the rest position faster than the rate or farther than
        /// the total.
        #[test]
        fn rate_and_total_hold(
            shifts in proptest::collection::vec((-500_000i32..500_000, 0u64..4_000), 1..12),
            rate in 1u16..=100,
            total in 1u16..=250,
        ) {
            let limits = Rezero { rate: MilliPx(rate), total: MilliPx(total), ..LIMITS };
            let mut film = Followed::new();
            let mut before = film.right();
            for (shift, ms) in shifts {
                film.with(&limits, ms, Some(&features(Px(shift))));
                let fastest = f64::from(rate) * 1e-3 * (ms / 1_000 + 1) as f64;
                prop_assert!((film.right() - before).abs() <= fastest + 1e-4);
                prop_assert!(film.right().abs() <= f64::from(total) * 1e-3 + 1e-4);
                before = film.right();
            }
        }
    }
}
