//! Filters the force that is sent.
//!
//! *Low-pass*: y += (x − y)·dt / (τ + dt) with the time dt between two frames, the implicit Euler
//! rule of τ·y' = x − y. It is stable at any frame rate, and lags exactly τ behind a steadily
//! growing input. *Median of three*: it lags exactly one frame behind a steadily growing input.
//!
//! The filter restarts with a frame that does not immediately follow the previous one, or that
//! follows a frame without a force: then that frame's own force is sent. The place restarts at each
//! contact, because earlier places are meaningless.
//!
//! The stated uncertainty is never below that of the frame's own force: it contains constant
//! errors, which a filter does not reduce. While a force changes, the output lags. Its difference
//! from the frame's own force is added by root of the sum of squares.

use super::{Filter, Moment};
use crate::force::{Force, Place, Polar};
use hivtac_terms::angle::atan2;
use hivtac_terms::division::Divisor;
use hivtac_terms::fixed::Q;
use hivtac_terms::root::{root, rounded_root};
use hivtac_terms::units::{
    MicroNewtons, Micrometres, Milliseconds, SignedMicrometres, UnsignedMicroNewtons,
    UnsignedMilliDegrees,
};

/// Frames farther apart than this count as this far apart, µs: products then fit 64 bits.
const LONGEST_US: u64 = 1 << 20;
/// Larger time constants count as this, ms.
const LARGEST_MS: u32 = 1 << 20;

/// Filters N components.
#[derive(Clone, Copy, Debug)]
struct Smoother<const N: usize> {
    /// The previous frames, newest first, and their number.
    before: [[i32; N]; 2],
    count: u8,
    /// The low-pass output.
    smooth: [Q<8, i64>; N],
}

impl<const N: usize> Smoother<N> {
    const EMPTY: Self = Self {
        before: [[0; N]; 2],
        count: 0,
        smooth: [Q::from_bits(0); N],
    };

    /// Takes the next values, `after_us` after the previous ones, and returns the filtered ones.
    fn next(&mut self, filter: Filter, after_us: u64, now: [i32; N]) -> [i32; N] {
        let filtered = match filter {
            Filter::None => now,
            _ if self.count == 0 => now,
            Filter::LowPass { time_constant } => self.low_pass(time_constant, after_us, &now),
            Filter::MedianOfThree if self.count < 2 => now,
            Filter::MedianOfThree => self.medians(&now),
        };
        if self.count == 0 {
            self.smooth = now.map(|value| Q::from_int(value.into()));
        }
        self.before = [now, self.before[0]];
        self.count = self.count.saturating_add(1);
        filtered
    }

    /// Differences are below 2⁴¹ and times below 2²⁰.
    fn low_pass(&mut self, time_constant: Milliseconds, after_us: u64, now: &[i32; N]) -> [i32; N] {
        let after_us = after_us.min(LONGEST_US);
        let constant_us = time_constant.0.min(LARGEST_MS) * 1_000;
        let divisor = Divisor::new(constant_us + after_us as u32);
        for (smooth, now) in self.smooth.iter_mut().zip(now) {
            let off = Q::from_int(i64::from(*now)) - *smooth;
            let product = off * after_us as i64;
            *smooth += Q::from_bits(divisor.signed_quotient(product.bits()));
        }
        self.smooth.map(|smooth| smooth.rounded() as i32)
    }

    fn medians(&self, now: &[i32; N]) -> [i32; N] {
        let [newer, older] = &self.before;
        let mut medians = *now;
        for ((median, a), b) in medians.iter_mut().zip(newer).zip(older) {
            *median = (*a.min(b)).max((*median).min(*a.max(b)));
        }
        medians
    }
}

/// Filters forces and their places.
#[derive(Clone, Copy, Debug)]
pub(super) struct ForceFilter {
    force: Smoother<3>,
    place: Smoother<2>,
    newest: Option<Moment>,
}

impl ForceFilter {
    /// The state before the first frame.
    pub const EMPTY: ForceFilter = ForceFilter {
        force: Smoother::EMPTY,
        place: Smoother::EMPTY,
        newest: None,
    };

    /// Takes a frame's own force and returns the force to send.
    pub fn follow(
        &mut self,
        filter: Filter,
        at: Moment,
        own: Option<&Force>,
        is_touched: bool,
    ) -> Option<Force> {
        let before = self.newest.replace(at);
        let follows = before.filter(|before| before.frame.wrapping_add(1) == at.frame);
        let Some((own, before)) = own.zip(follows) else {
            *self = ForceFilter {
                newest: Some(at),
                ..ForceFilter::EMPTY
            };
            return own.map(|own| self.filtered(filter, 0, own, is_touched));
        };
        let after_us = at.time_us.saturating_sub(before.time_us);
        Some(self.filtered(filter, after_us, own, is_touched))
    }

    fn filtered(&mut self, filter: Filter, after_us: u64, own: &Force, is_touched: bool) -> Force {
        let now = own.cartesian.map(|part| part.0);
        let cartesian = self.force.next(filter, after_us, now).map(MicroNewtons);
        let place = own.place.map(|place| {
            if !is_touched {
                self.place = Smoother::EMPTY;
            }
            let [x, y] = self.place.next(filter, after_us, [place.x.0, place.y.0]);
            late_place(&place, [x, y].map(SignedMicrometres))
        });
        match filter {
            Filter::None => *own,
            _ => late_force(own, cartesian, place),
        }
    }
}

/// A filtered force, whose uncertainty includes its difference from the frame's own force.
fn late_force(own: &Force, cartesian: [MicroNewtons; 3], place: Option<Place>) -> Force {
    let Polar {
        alpha,
        beta,
        magnitude,
    } = Polar::of_vector(cartesian);
    let turned = angle_mdeg(&own.cartesian, &cartesian);
    let grown = own.magnitude.0.abs_diff(magnitude.0);
    Force {
        alpha,
        beta,
        magnitude,
        cartesian,
        direction_sigma: UnsignedMilliDegrees(both(own.direction_sigma.0, turned).min(180_000)),
        magnitude_sigma: UnsignedMicroNewtons(both(own.magnitude_sigma.0, grown)),
        place,
        torque: own.torque,
    }
}

/// The same for a place: each coordinate has half of the squared distance.
fn late_place(own: &Place, [x, y]: [SignedMicrometres; 2]) -> Place {
    let [right, down] = [own.x.0.abs_diff(x.0), own.y.0.abs_diff(y.0)];
    let square = (u64::from(right).pow(2) / 2).saturating_add(u64::from(down).pow(2) / 2);
    Place {
        x,
        y,
        sigma: Micrometres(both(own.sigma.0, root(square))),
    }
}

/// √(a² + b²), at most 2³¹ − 1.
pub(super) fn both(a: u32, b: u32) -> u32 {
    const MOST: u32 = i32::MAX as u32;
    let sum = u64::from(a.min(MOST)).pow(2) + u64::from(b.min(MOST)).pow(2);
    rounded_root(sum).min(u64::from(MOST)) as u32
}

/// The angle between two vectors, m°, to 4 m°; 0 if one of them is 0.
fn angle_mdeg(a: &[MicroNewtons; 3], b: &[MicroNewtons; 3]) -> u32 {
    let (a, b) = (shortened(a), shortened(b));
    let ([ax, ay, az], [bx, by, bz]) = (a, b);
    let dot = ax * bx + ay * by + az * bz;
    let cross = [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
    // |a × b|² ≤ |a|²·|b|² < 2⁶⁴.
    let square: u64 = cross.iter().map(|part| part.unsigned_abs().pow(2)).sum();
    atan2(i64::from(root(square)), dot).0.unsigned_abs()
}

/// Shifts a vector until its largest component has 15 bits.
fn shortened(vector: &[MicroNewtons; 3]) -> [i64; 3] {
    let largest = vector
        .iter()
        .fold(0, |all, part| all | part.0.unsigned_abs());
    let zeros = largest.leading_zeros();
    vector.map(|part| match zeros {
        17.. => i64::from(part.0) << (zeros - 17),
        _ => i64::from(part.0) >> (17 - zeros),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::temporal::tests::{force_of, pressed};
    use proptest::prelude::*;
    use std::vec::Vec;

    /// Time between frames, µs.
    const FRAME_US: u64 = 6_405;

    fn low_pass(ms: u32) -> Filter {
        Filter::LowPass {
            time_constant: Milliseconds(ms),
        }
    }

    /// Fz of the output for forces straight into the film, µN, `frame_us` apart.
    fn sent(filter: Filter, frame_us: u64, forces: &[i32]) -> Vec<i32> {
        let mut state = ForceFilter::EMPTY;
        let frames = (1..).zip(forces);
        let sent = frames.map(|(frame, force)| {
            let time_us = u64::from(frame) * frame_us;
            let own = pressed(*force, 100);
            let sent = state.follow(filter, Moment { frame, time_us }, Some(&own), true);
            -sent.unwrap().cartesian[2].0
        });
        sent.collect()
    }

    #[test]
    fn a_steady_change_comes_as_late_as_stated() {
        for frame_us in [4_076, FRAME_US, 25_000] {
            // 100 µN a ms.
            let slope = (frame_us / 10) as i32;
            let forces: Vec<i32> = (0..400).map(|k| 10_000 + slope * k).collect();
            let late = |filter| {
                let sent = sent(filter, frame_us, &forces);
                let behind = forces[399] - sent[399];
                f64::from(behind) / f64::from(slope) * frame_us as f64 * 1e-3
            };
            assert_eq!(late(Filter::None), 0.0);
            let frame_ms = frame_us as f64 * 1e-3;
            assert!((late(Filter::MedianOfThree) - frame_ms).abs() < 1e-9);
            for ms in [1, 20, 100] {
                let late = late(low_pass(ms));
                assert!((late - f64::from(ms)).abs() < 0.05, "{ms} ms: {late}");
            }
        }
    }

    #[test]
    fn a_median_takes_a_spike_out() {
        let forces = [10, 10, 10, 900, 10, 10, 20, 20].map(|f| f * 1_000);
        let expected = [10, 10, 10, 10, 10, 10, 10, 20].map(|f| f * 1_000);
        assert_eq!(sent(Filter::MedianOfThree, FRAME_US, &forces), expected);
    }

    #[test]
    fn it_begins_anew_after_a_gap_and_after_a_frame_without_a_force() {
        let far = pressed(50_000, 100);
        for filter in [low_pass(100), Filter::MedianOfThree] {
            for gap in [false, true] {
                let mut state = ForceFilter::EMPTY;
                let mut at = Moment {
                    frame: u32::MAX - 3,
                    time_us: 0,
                };
                let mut next = |own: Option<&Force>, frames: u32| {
                    at.frame = at.frame.wrapping_add(frames);
                    at.time_us += u64::from(frames) * FRAME_US;
                    state.follow(filter, at, own, true)
                };
                for _ in 0..5 {
                    next(Some(&pressed(10_000, 100)), 1);
                }
                let sent = match gap {
                    true => next(Some(&far), 2),
                    false => {
                        assert_eq!(next(None, 1), None);
                        next(Some(&far), 1)
                    }
                };
                assert_eq!(sent, Some(far), "{filter:?}");
                assert_ne!(next(Some(&pressed(10_000, 100)), 1), None);
            }
        }
    }

    #[test]
    fn without_a_filter_nothing_is_changed() {
        let mut state = ForceFilter::EMPTY;
        for frame in 0..4 {
            let time_us = u64::from(frame) * FRAME_US;
            let own = pressed(1_000 * frame as i32, 7);
            let sent = state.follow(Filter::None, Moment { frame, time_us }, Some(&own), false);
            assert_eq!(sent, Some(own));
        }
    }

    #[test]
    fn what_is_late_is_uncertain() {
        let mut state = ForceFilter::EMPTY;
        let [before, now] = [[0, 0, -10_000], [30_000, 0, -40_000]].map(force_of);
        let mut next = |frame: u32, own: &Force| {
            let time_us = u64::from(frame) * 20_000;
            state.follow(low_pass(60), Moment { frame, time_us }, Some(own), true)
        };
        next(0, &before);
        let sent = next(1, &now).unwrap();
        // A quarter of the way.
        assert_eq!(sent.cartesian.map(|part| part.0), [7_500, 0, -17_500]);
        let late = f64::from(now.magnitude.0 - sent.magnitude.0);
        let expected = late.hypot(f64::from(now.magnitude_sigma.0));
        assert!((f64::from(sent.magnitude_sigma.0) - expected).abs() < 1.0);
        let turned = (0.75f64.atan() - (7.5f64 / 17.5).atan()).to_degrees() * 1e3;
        let expected = turned.hypot(f64::from(now.direction_sigma.0));
        assert!((f64::from(sent.direction_sigma.0) - expected).abs() < 4.0);
    }

    fn any_filter() -> impl Strategy<Value = Filter> {
        prop_oneof![
            Just(Filter::None),
            Just(Filter::MedianOfThree),
            (1u32..=10_000).prop_map(low_pass),
        ]
    }

    proptest! {
        /// For any numbers, the output is within the frames' range and never more certain than they
        /// are.
        #[test]
        fn what_is_sent_lies_between_the_frames(
            filter in any_filter(),
            forces in proptest::collection::vec((any::<[i32; 3]>(), 1u64..3_000_000), 1..20),
        ) {
            let mut state = ForceFilter::EMPTY;
            let mut time_us = 0;
            for (frame, (vector, after_us)) in (0..).zip(&forces) {
                time_us += after_us;
                let own = force_of(*vector);
                let sent = state.follow(filter, Moment { frame, time_us }, Some(&own), true);
                let sent = sent.unwrap();
                let seen = &forces[..=frame as usize];
                for axis in 0..3 {
                    let (low, high) = seen.iter().fold((i32::MAX, i32::MIN), |(low, high), f| {
                        (low.min(f.0[axis]), high.max(f.0[axis]))
                    });
                    prop_assert!((low..=high).contains(&sent.cartesian[axis].0));
                }
                prop_assert!(sent.magnitude_sigma >= own.magnitude_sigma);
                prop_assert!(sent.direction_sigma >= own.direction_sigma);
                prop_assert!(sent.place.unwrap().sigma >= own.place.unwrap().sigma);
            }
        }
    }
}
