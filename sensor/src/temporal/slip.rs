//! Detects whether a contact slips: its place on the film moves.
//!
//! The place is a point of the film itself. It stays while the contact sticks, however far the
//! contact drags the film, and moves when it slips. Friction then pulls along the film with a part
//! of the force into it. If a place moves without such a force, that is not a slip.
//!
//! A place has noise, which grows as the force falls. Model errors shift it with every change of
//! the force; the stated uncertainty includes that. So a place counts as moved since an earlier
//! frame if it moved by at least
//!
//! distance · (1 + 10 mN / |F|) + σ · (1/8 + |ΔF| / 2|F|)
//!
//! with the smaller |F| of the two frames, ΔF the vector between their forces, and σ the place's
//! stated uncertainty. The places of a frame whose markers change their motion are less certain
//! than those of its steady neighbours: for either frame, that difference of σ is added. It must
//! also have moved by three times the noise of the frames between: the mean length of the place's
//! second differences, which are 0 in a steady motion. A slip begins with the second such frame in
//! a row: when a force begins to change, a rolling shutter gives one frame whose markers do not
//! move as before. While it slips, three fifths of the distance are enough.

use super::SlipLimits;
use crate::force::Force;
use hivtac_terms::division::Divisor;
use hivtac_terms::root::root;
use hivtac_terms::units::MicroNewtons;

/// Number of frames that are remembered: 100 ms, the longest time of the limits, at 310 frames a
/// second. At a higher rate it is a shorter time.
const FRAMES: usize = 32;
/// |F| at which noise doubles the distance, µN.
const DOUBLES_AT: u64 = 10_000;
/// A place must have moved by this many mean second differences.
const NOISES: u64 = 3;
/// Larger uncertainties of a place count as this large, µm.
const LARGEST_SIGMA: u32 = 1 << 30;
/// Fraction of the distance that is enough while it slips.
const GOES_ON: [u64; 2] = [3, 5];

/// Force and place of a frame.
#[derive(Clone, Copy, Debug)]
struct Seen {
    /// Modulo 2³².
    time_us: u32,
    /// µm.
    place: [i32; 2],
    /// µN.
    force: [i32; 3],
    magnitude: u32,
    /// The place's stated uncertainty, µm.
    sigma: u32,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Slip {
    frames: [Seen; FRAMES],
    /// Number of frames, and index of the next one.
    count: usize,
    next: usize,
    /// Whether the place had moved in the newest frame.
    moved: bool,
    slips: bool,
}

impl Slip {
    /// No frames so far.
    pub const NONE: Slip = Slip {
        frames: [Seen {
            time_us: 0,
            place: [0; 2],
            force: [0; 3],
            magnitude: 0,
            sigma: 0,
        }; FRAMES],
        count: 0,
        next: 0,
        moved: false,
        slips: false,
    };

    /// Takes a frame and returns whether its contact slips. A frame with unknown force, place or
    /// contact is skipped; if the film is not touched, the history is discarded.
    pub fn follow(
        &mut self,
        limits: &SlipLimits,
        time_us: u64,
        force: Option<&Force>,
        touched: Option<bool>,
    ) -> bool {
        if touched == Some(false) {
            (self.count, self.moved, self.slips) = (0, false, false);
        }
        let placed = force.and_then(|force| Some((force, force.place?)));
        let Some((force, place)) = placed.filter(|_| touched == Some(true)) else {
            return false;
        };
        let seen = Seen {
            time_us: time_us as u32,
            place: [place.x.0, place.y.0],
            force: force.cartesian.map(|part| part.0),
            magnitude: force.magnitude.0.unsigned_abs().max(1),
            sigma: place.sigma.0.min(LARGEST_SIGMA),
        };
        self.forget_older(time_us as u32, limits.within.0.saturating_mul(1_000));
        let moved = is_pulled(force, limits) && self.has_moved(limits, &seen);
        self.slips = moved && self.moved;
        self.moved = moved;
        self.keep(seen);
        self.slips
    }

    /// The frames, newest first.
    fn newest(&self) -> impl Iterator<Item = &Seen> {
        (1..=self.count).filter_map(|back| {
            let at = self.next.wrapping_add(FRAMES).wrapping_sub(back) % FRAMES;
            self.frames.get(at)
        })
    }

    fn forget_older(&mut self, now_us: u32, within_us: u32) {
        let recent = |seen: &&Seen| now_us.wrapping_sub(seen.time_us) <= within_us;
        self.count = self.newest().take_while(recent).count();
    }

    fn keep(&mut self, seen: Seen) {
        if let Some(frame) = self.frames.get_mut(self.next) {
            *frame = seen;
        }
        self.next = (self.next + 1) % FRAMES;
        self.count = (self.count + 1).min(FRAMES);
    }

    fn has_moved(&self, limits: &SlipLimits, now: &Seen) -> bool {
        let distance = match self.slips {
            true => u64::from(limits.distance.0) * GOES_ON[0] / GOES_ON[1],
            false => limits.distance.0.into(),
        };
        let steady = self
            .newest()
            .fold(now.sigma, |least, seen| least.min(seen.sigma));
        let mut noise = None;
        self.newest().any(|before| {
            let moved = far(now.place, before.place);
            moved >= distance
                && moved >= least_moved(distance, now, before, steady)
                && moved >= *noise.get_or_insert_with(|| NOISES * self.noise(now))
        })
    }

    /// Mean length of the second differences of all places, µm; with fewer than three places, the
    /// largest number.
    fn noise(&self, now: &Seen) -> u64 {
        let places = || core::iter::once(now).chain(self.newest());
        let triples = places().zip(places().skip(1)).zip(places().skip(2));
        let (mut sum, mut count) = (0_u64, 0_u32);
        for ((a, b), c) in triples {
            let ([ax, ay], [bx, by], [cx, cy]) = (a.place, b.place, c.place);
            sum += u64::from(length(second(ax, bx, cx), second(ay, by, cy)));
            count += 1;
        }
        match count {
            0 => u64::MAX / NOISES,
            _ => Divisor::new(count).quotient(sum),
        }
    }
}

/// Coordinates farther apart than this count as this far apart, µm: squares then fit 64 bits.
const FAR: i64 = 1 << 30;

/// Distance of two places, µm.
fn far([ax, ay]: [i32; 2], [bx, by]: [i32; 2]) -> u64 {
    length(i64::from(ax) - i64::from(bx), i64::from(ay) - i64::from(by)).into()
}

fn second(a: i32, b: i32, c: i32) -> i64 {
    i64::from(a) - 2 * i64::from(b) + i64::from(c)
}

fn length(x: i64, y: i64) -> u32 {
    let [x, y] = [x, y].map(|part| part.clamp(-FAR, FAR));
    root((x * x + y * y) as u64)
}

/// How far a place must have moved from one frame to another, µm; `steady` is the least σ of the
/// frames between.
fn least_moved(distance: u64, now: &Seen, before: &Seen, steady: u32) -> u64 {
    let pairs = now.force.iter().zip(&before.force);
    let squares = pairs.map(|(now, before)| u64::from(now.abs_diff(*before).min(1 << 30)).pow(2));
    let change = u64::from(root(squares.sum()));
    let smaller = Divisor::new(now.magnitude.min(before.magnitude));
    let [now, before, steady] = [now.sigma, before.sigma, steady].map(u64::from);
    let unsteady = (now + before).saturating_sub(2 * steady);
    distance
        + smaller.quotient(distance * DOUBLES_AT)
        + now / 8
        + smaller.quotient(now * change) / 2
        + unsteady
}

/// Whether the force along the film is a large enough part of the force into it.
fn is_pulled(force: &Force, limits: &SlipLimits) -> bool {
    let [x, y, z] = force.cartesian;
    let square = |part: MicroNewtons| u64::from(part.0.unsigned_abs()).pow(2);
    let along = u64::from(root(square(x) + square(y)));
    along * 1_000 >= u64::from(z.0.unsigned_abs()) * u64::from(limits.ratio.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::Place;
    use crate::temporal::tests::force_of;
    use hivtac_terms::units::{Micrometres, Permille, SignedMicrometres};
    use proptest::prelude::*;
    use std::vec::Vec;

    const LIMITS: SlipLimits = SlipLimits {
        distance: Micrometres(60),
        within: hivtac_terms::units::Milliseconds(50),
        ratio: Permille(100),
    };

    /// A contact at a place, µm, under a force, µN.
    fn at(x: i32, vector: [i32; 3]) -> Force {
        let force = force_of(vector);
        let place = force.place.map(|place| Place {
            x: SignedMicrometres(x),
            ..place
        });
        Force { place, ..force }
    }

    const PULLED: [i32; 3] = [30_000, 0, -100_000];

    /// Times, µs, at which a contact slips that moves at a speed, mm/s, after 0.3 s. Frames are
    /// `frame_us` apart; one in `every` arrives.
    fn slips(speed: f64, vector: [i32; 3], frame_us: u64, every: u64) -> Vec<u64> {
        let mut slip = Slip::NONE;
        let frames = (0..600_000 / frame_us).filter(|frame| frame % every == 0);
        let times = frames.map(|frame| 7_000 + frame * frame_us);
        let slipping = times.filter(|time_us| {
            let moved_us = time_us.saturating_sub(300_000);
            let x = 500 + (speed * 1e-3 * moved_us as f64) as i32;
            slip.follow(&LIMITS, *time_us, Some(&at(x, vector)), Some(true))
        });
        slipping.collect()
    }

    #[test]
    fn a_place_that_moves_slips_at_any_frame_rate_and_across_lost_frames() {
        for (frame_us, every) in [(6_405, 1), (4_076, 1), (6_405, 3), (2_000, 1)] {
            assert_eq!(slips(0.0, PULLED, frame_us, every), []);
            // 65 µm within 50 ms is 1.3 mm/s.
            assert_eq!(slips(1.2, PULLED, frame_us, every), []);
            for speed in [2.0, 10.0, 100.0] {
                let times = slips(speed, PULLED, frame_us, every);
                let late_us = times[0] - 300_000;
                let least_us = (65.0 / speed * 1e3) as u64;
                let most_us = least_us + 3 * every * frame_us;
                assert!(
                    (least_us..=most_us).contains(&late_us),
                    "{speed}: {late_us}"
                );
            }
        }
    }

    #[test]
    fn without_a_force_along_the_film_nothing_slips() {
        assert_eq!(slips(10.0, [9_900, 0, -100_000], 6_405, 1), []);
        assert!(!slips(10.0, [10_000, 0, -100_000], 6_405, 1).is_empty());
    }

    #[test]
    fn a_slip_ends_when_the_place_stays_and_begins_anew_with_a_contact() {
        let mut slip = Slip::NONE;
        let mut time_us = 0;
        let mut next = |x: i32, touched: bool| {
            time_us += 6_405;
            slip.follow(&LIMITS, time_us, Some(&at(x, PULLED)), Some(touched))
        };
        (0..8).for_each(|_| assert!(!next(0, true)));
        assert!((1..20).any(|k| next(20 * k, true)));
        let ends = (0..20).take_while(|_| next(380, true)).count();
        assert!((5..9).contains(&ends), "{ends} frames");
        assert!(!next(380, false));
        // Somewhere else.
        (0..8).for_each(|_| assert!(!next(-900, true)));
    }

    /// A press whose place settles by 240 µm while |F| grows tenfold, with a model that knows
    /// little of the unit.
    #[test]
    fn what_the_model_does_not_know_does_not_slip() {
        let reported = |sigma: u32| {
            let mut slip = Slip::NONE;
            (0..40).any(|k: i32| {
                let force = at(
                    2 * k.min(30),
                    [1_000, 0, -5_000].map(|part| part * (1 + k.min(30))),
                );
                let place = force.place.map(|place| Place {
                    sigma: Micrometres(sigma),
                    x: SignedMicrometres(20 * k.min(12)),
                    ..place
                });
                let force = Force { place, ..force };
                slip.follow(&LIMITS, 6_405 * k as u64, Some(&force), Some(true))
            })
        };
        assert!(!reported(250));
        assert!(reported(3), "a model that knows the place");
    }

    /// A hit: for two frames the place is 200 µm off, as their stated uncertainty allows.
    #[test]
    fn places_of_uncertain_frames_do_not_slip() {
        let reported = |sigma: u32| {
            let mut slip = Slip::NONE;
            (0..40).any(|k: i32| {
                let is_hit = k == 20 || k == 21;
                let force = at(if is_hit { 200 } else { 0 }, PULLED);
                let place = force.place.map(|place| Place {
                    sigma: Micrometres(if is_hit { sigma } else { 5 }),
                    ..place
                });
                let force = Force { place, ..force };
                slip.follow(&LIMITS, 6_405 * k as u64, Some(&force), Some(true))
            })
        };
        assert!(reported(5));
        assert!(!reported(150));
    }

    #[test]
    fn noise_does_not_slip() {
        let mut slip = Slip::NONE;
        // 100 µm from frame to frame.
        let reported = (0..60).any(|k: u64| {
            let x = if k.is_multiple_of(2) { 100 } else { 0 };
            slip.follow(&LIMITS, 6_405 * k, Some(&at(x, PULLED)), Some(true))
        });
        assert!(!reported);
    }

    #[test]
    fn frames_that_do_not_tell_are_passed_over() {
        let mut slip = Slip::NONE;
        let mut next = |k: u64, force: Option<&Force>, touched: Option<bool>| {
            slip.follow(&LIMITS, 6_405 * k, force, touched)
        };
        (0..5).for_each(|k| assert!(!next(k, Some(&at(0, PULLED)), Some(true))));
        assert!(!next(5, None, None));
        let unplaced = Force {
            place: None,
            ..at(0, PULLED)
        };
        assert!(!next(6, Some(&unplaced), Some(true)));
        assert!(!next(7, Some(&at(150, PULLED)), Some(true)), "one frame");
        assert!(next(8, Some(&at(300, PULLED)), Some(true)));
    }

    proptest! {
        #[test]
        fn any_numbers_are_followed(
            frames in proptest::collection::vec(
                (any::<[i32; 3]>(), any::<[i32; 2]>(), any::<u32>(), any::<u64>(), 0u8..3),
                1..80,
            ),
            distance in 1u32..=5_000,
            within in 10u32..=100,
        ) {
            let limits = SlipLimits {
                distance: Micrometres(distance),
                within: hivtac_terms::units::Milliseconds(within),
                ..LIMITS
            };
            let mut slip = Slip::NONE;
            for (vector, [x, y], sigma, time_us, touched) in frames {
                let force = force_of(vector);
                let place = Place {
                    x: SignedMicrometres(x),
                    y: SignedMicrometres(y),
                    sigma: Micrometres(sigma),
                };
                let force = Force { place: Some(place), ..force };
                let touched = [None, Some(false), Some(true)][usize::from(touched)];
                let reported = slip.follow(&limits, time_us, Some(&force), touched);
                prop_assert!(!reported || touched == Some(true));
                prop_assert!(slip.count <= FRAMES);
            }
        }
    }
}
