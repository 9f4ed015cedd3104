//! Moves markers to one common time: a rolling shutter sees the lower ones later.
//!
//! A row is exposed one line after the row above it, and a frame every L lines. A marker seen in
//! row y of one frame, and in row y′ of the frame n before it, has moved for n L + y − y′ lines.
//! With this velocity it is moved to the time of the frame's middle row: by (y − middle) / (n L +
//! y − y′) of its motion. Usually n is 1; it is more after frames that were missed.
//!
//! Using two frames instead of one changes a position's noise. At rest the weights are 1 − c and c,
//! with c = (y − middle) / L. For markers 54 rows off the middle of 278 lines, the upper ones have
//! 1.21 times the noise, the lower ones 0.83 times.
//!
//! Markers whose velocity changes were not moved as far as that: a hit, a slip that begins, or a
//! grip that opens. The change of their motion from frame to frame limits the error, which the
//! forces then state ([`Motion::unsteadiness`]).

use crate::markers::lost::Lost;
use crate::markers::sqrt;
use hivtac_terms::marker::{Marker, MarkerList};
use hivtac_terms::units::Px;

/// The most frames that may be missed between two that give a motion. The mean motion over
/// more says little about that during a frame.
const MOST_MISSED: u16 = 7;
/// A change of a marker's motion, in px from frame to frame, that may be the modelled noise: one
/// and a half times its root mean square.
const STEADY_PX: f32 = 0.06;

/// The previous frame's markers, from which those of the current frame have moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Motion {
    /// Lines from frame to frame, blank ones included; `None` with a global shutter.
    lines: Option<u16>,
    before: Option<Seen>,
    /// The frame right before that one; `None` if frames were missed since.
    earlier: Option<Seen>,
    /// The markers of the current frame, which may be looked at again.
    now: Option<Seen>,
    /// Frames missed between the previous frame and the current one.
    missed: u16,
    /// Frames missed since the current one.
    missing: u16,
}

/// The markers of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Seen {
    markers: MarkerList,
    /// Those that were not seen.
    lost: Lost,
}

impl Motion {
    /// All markers of a frame are seen at once.
    pub const GLOBAL: Motion = Motion {
        lines: None,
        ..Motion::rolling(0)
    };

    /// A frame every `lines` lines, blank ones included; each line exposes a row.
    pub const fn rolling(lines: u16) -> Motion {
        Motion {
            lines: Some(lines),
            before: None,
            earlier: None,
            now: None,
            missed: 0,
            missing: 0,
        }
    }

    /// Whether the rows of a frame are exposed one after the other.
    pub fn is_rolling(&self) -> bool {
        self.lines.is_some()
    }

    /// Call before a frame that the previous one says nothing about.
    pub fn forget(&mut self) {
        (self.before, self.earlier, self.now) = (None, None, None);
    }

    /// Call before a frame, for frames that were missed before it.
    pub fn miss(&mut self, frames: u32) {
        let missing = u32::from(self.missing).saturating_add(frames);
        self.missing = u16::try_from(missing).unwrap_or(u16::MAX);
    }

    /// Call at the beginning of each frame.
    pub fn begin_frame(&mut self) {
        let missed_before = self.missed;
        self.missed = core::mem::take(&mut self.missing);
        match self.now.take() {
            Some(now) => {
                let none_is_missed = missed_before == 0 && self.missed == 0;
                self.earlier = self.before.take().filter(|_| none_is_missed);
                self.before = Some(now);
            }
            None => {
                self.earlier = None;
                self.missed = self.missed.saturating_add(missed_before).saturating_add(1);
            }
        }
        if self.missed > MOST_MISSED {
            self.before = None;
        }
    }

    /// Call at the end of each frame, with its markers and those that are lost, whose places are
    /// not used. A frame that showed no markers, `None`, is as one that was missed.
    pub fn ended(&mut self, seen: Option<(&MarkerList, Lost)>) {
        self.now = seen.map(|(markers, lost)| Seen {
            markers: *markers,
            lost,
        });
    }

    /// Returns the markers as they were while the middle row of a frame of `rows` rows was exposed.
    /// Those that are `lost` stay where they are. Returns `None` with a global shutter, or if the
    /// previous frame does not show each of the others or is too long ago.
    pub fn at_the_middle(&self, seen: &MarkerList, lost: Lost, rows: u16) -> Option<MarkerList> {
        let (lines, before) = (self.lines?, self.before.as_ref()?);
        let lines = (i64::from(self.missed) + 1) * i64::from(lines);
        if !before.lost.is_within(lost) {
            return None;
        }
        let mut moved = *seen;
        let pairs = moved.iter_mut().zip(before.markers.iter()).enumerate();
        for (_, (marker, before)) in pairs.filter(|(identity, _)| !lost.contains(*identity)) {
            move_to_the_middle(marker, before, rows, lines);
        }
        Some(moved)
    }

    /// Returns the standard uncertainty, on each axis, with which markers are where
    /// [`Motion::at_the_middle`] says: 0 while their motion is steady, or with a global shutter.
    /// Without an earlier frame that shows a marker, the marker rested before. `noise` is the
    /// factor on the modelled noise.
    #[inline(never)]
    pub fn unsteadiness(&self, seen: &MarkerList, lost: Lost, rows: u16, noise: f32) -> Px {
        let Some((lines, before)) = self.lines.zip(self.before.as_ref()) else {
            return Px(0);
        };
        let earlier = self.earlier.as_ref();
        let steady = STEADY_PX * noise;
        let (mut sum, mut count) = (0.0, 0.0);
        for (identity, (now, then)) in seen.iter().zip(before.markers.iter()).enumerate() {
            if lost.contains(identity) || before.lost.contains(identity) {
                continue;
            }
            let first = earlier
                .filter(|earlier| !earlier.lost.contains(identity))
                .and_then(|earlier| earlier.markers.get(identity))
                .unwrap_or(then);
            let [x, y] = [[now.x, then.x, first.x], [now.y, then.y, first.y]].map(change);
            let lines = (f32::from(self.missed) + 1.0) * f32::from(lines);
            let late = below_middle(now, rows).to_f32() / lines;
            sum += (x * x + y * y - steady * steady).max(0.0) * late * late;
            count += 1.0;
        }
        Px::of_f32(sqrt(sum / f32::max(count, 1.0)))
    }
}

/// How much farther a coordinate moved, px, than from the first frame to the second.
fn change([now, then, first]: [Px; 3]) -> f32 {
    Px(now.0 - 2 * then.0 + first.0).to_f32()
}

/// How far below the middle row a marker is.
fn below_middle(marker: &Marker, rows: u16) -> Px {
    Px(marker.y.0 - ((i32::from(rows) - 1) << 15))
}

/// `lines` are those from `before` to `marker`'s frame. Coordinates are below 2¹⁰ px, 2²⁶ in
/// 1/65,536 px: products fit `i64` with 10 bits to spare. The divisor is positive, because a frame
/// has more lines than rows.
#[inline(never)]
fn move_to_the_middle(marker: &mut Marker, before: &Marker, rows: u16, lines: i64) {
    let below = i64::from(below_middle(marker, rows).0);
    let lines = (lines << 16) + i64::from(marker.y.0) - i64::from(before.y.0);
    let back = |now: Px, before: Px| {
        let moved = i64::from(now.0) - i64::from(before.0);
        Px(now.0 - (moved * below / lines.max(1)) as i32)
    };
    (marker.x, marker.y) = (back(marker.x, before.x), back(marker.y, before.y));
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROWS: u16 = 240;
    const LINES: u16 = 278;

    fn marker(x: f64, y: f64) -> Marker {
        let px = |value: f64| Px((value * 65_536.0).round() as i32);
        Marker {
            x: px(x),
            y: px(y),
            area: 130,
        }
    }

    /// Where a steadily moving marker is seen that passes `place` at time 0, in the frame whose
    /// middle is `at` frame times later.
    fn seen(place: [f64; 2], velocity: [f64; 2], at: f64) -> Marker {
        // The row in which it is seen determines the time: y = y₀ + v·(at + (y − middle) / L).
        let middle = (f64::from(ROWS) - 1.0) / 2.0;
        let lines = f64::from(LINES);
        let y = (place[1] + velocity[1] * (at - middle / lines)) / (1.0 - velocity[1] / lines);
        let time = at + (y - middle) / lines;
        marker(place[0] + velocity[0] * time, y)
    }

    const PLACES: [[f64; 2]; 4] = [[105.0, 65.0], [214.0, 65.0], [214.0, 174.0], [105.0, 174.0]];

    #[test]
    fn markers_that_move_steadily_are_where_they_were_at_the_middle() {
        for velocity in [[0.0, 0.0], [1.5, 0.0], [0.0, 3.0], [-2.0, 5.0], [8.0, -8.0]] {
            let frame = |at| MarkerList::from(PLACES.map(|place| seen(place, velocity, at)));
            for missed in [0, 1, MOST_MISSED] {
                let mut motion = Motion::rolling(LINES);
                let earlier = frame(-1.0 - f64::from(missed));
                motion.ended(Some((&earlier, Lost::NONE)));
                motion.miss(missed.into());
                motion.begin_frame();
                let moved = motion.at_the_middle(&frame(0.0), Lost::NONE, ROWS).unwrap();
                for (moved, place) in moved.iter().zip(PLACES) {
                    let there = marker(place[0], place[1]);
                    let off = [moved.x.0 - there.x.0, moved.y.0 - there.y.0];
                    assert!(
                        off.iter().all(|off| off.abs() <= 3),
                        "{velocity:?}, {missed} missed: {off:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_frame_without_markers_is_as_one_that_was_missed() {
        let frame = |x: f64| MarkerList::from(PLACES.map(|[x0, y]| marker(x0 + x, y)));
        let moved = |between: &dyn Fn(&mut Motion)| {
            let mut motion = Motion::rolling(LINES);
            motion.ended(Some((&frame(0.0), Lost::NONE)));
            between(&mut motion);
            motion.begin_frame();
            motion.at_the_middle(&frame(4.0), Lost::NONE, ROWS)
        };
        let unseen = |motion: &mut Motion| {
            motion.begin_frame();
            motion.ended(None);
        };
        let missed = moved(&|motion| motion.miss(2));
        assert!(missed.is_some());
        assert_eq!(moved(&|motion| (0..2).for_each(|_| unseen(motion))), missed);
        let long = moved(&|motion| (0..=MOST_MISSED).for_each(|_| unseen(motion)));
        assert_eq!(long, None);
    }

    /// At rest, then moved by these distances, px, from frame to frame.
    fn unsteady(moved: &[f64]) -> f64 {
        let mut motion = Motion::rolling(LINES);
        let mut x = 0.0;
        let mut unsteady = Px(0);
        for by in [0.0, 0.0].iter().chain(moved) {
            x += by;
            let now = MarkerList::from(PLACES.map(|[x0, y]| marker(x0 + x, y)));
            motion.begin_frame();
            unsteady = motion.unsteadiness(&now, Lost::NONE, ROWS, 1.0);
            motion.ended(Some((&now, Lost::NONE)));
        }
        unsteady.to_f64()
    }

    #[test]
    fn markers_are_uncertain_while_their_motion_changes() {
        let late = 54.5 / f64::from(LINES);
        for (moved, expected) in [
            (&[][..], 0.0),
            (&[3.0], 3.0),
            (&[3.0, 3.0], 0.0),
            (&[3.0, 3.0, -1.0], 4.0),
            (&[0.05], 0.0),
            (&[1.0, 1.05], 0.0),
        ] {
            let off = unsteady(moved) - late * expected;
            assert!(off.abs() < 2e-3, "{moved:?}: {off}");
        }
    }

    #[test]
    fn after_missed_frames_markers_rested_before() {
        let mut motion = Motion::rolling(LINES);
        let at = |x| MarkerList::from(PLACES.map(|[x0, y]| marker(x0 + x, y)));
        for x in [0.0, 4.0] {
            motion.begin_frame();
            motion.ended(Some((&at(x), Lost::NONE)));
        }
        motion.miss(1);
        motion.begin_frame();
        let unsteady = motion
            .unsteadiness(&at(12.0), Lost::NONE, ROWS, 1.0)
            .to_f64();
        let late = 54.5 / f64::from(2 * LINES);
        assert!((unsteady - late * 8.0).abs() < 2e-3, "{unsteady}");
        let global = Motion::GLOBAL.unsteadiness(&at(12.0), Lost::NONE, ROWS, 1.0);
        assert_eq!(global, Px(0));
    }

    #[test]
    fn a_frame_that_is_long_ago_says_nothing() {
        let now = MarkerList::from(PLACES.map(|[x, y]| marker(x, y)));
        for missed in [MOST_MISSED + 1, u16::MAX] {
            let mut motion = Motion::rolling(LINES);
            motion.ended(Some((&now, Lost::NONE)));
            motion.miss(u32::from(missed) - 1);
            motion.miss(1);
            motion.begin_frame();
            assert_eq!(motion.at_the_middle(&now, Lost::NONE, ROWS), None);
            motion.ended(Some((&now, Lost::NONE)));
            motion.begin_frame();
            assert!(motion.at_the_middle(&now, Lost::NONE, ROWS).is_some());
        }
    }

    #[test]
    fn without_a_frame_before_or_with_a_global_shutter_nothing_moves() {
        let [before, now] =
            [0.0, 4.0].map(|x| MarkerList::from(PLACES.map(|[x0, y]| marker(x0 + x, y))));
        let mut motion = Motion::rolling(LINES);
        assert_eq!(motion.at_the_middle(&now, Lost::NONE, ROWS), None);
        motion.ended(Some((&before, Lost::NONE)));
        assert_eq!(motion.at_the_middle(&now, Lost::NONE, ROWS), None);
        motion.begin_frame();
        assert!(
            motion
                .at_the_middle(&now, Lost::NONE, ROWS)
                .is_some_and(|moved| moved != now)
        );
        motion.forget();
        assert_eq!(motion.at_the_middle(&now, Lost::NONE, ROWS), None);
        let mut global = Motion::GLOBAL;
        global.ended(Some((&before, Lost::NONE)));
        global.begin_frame();
        assert_eq!(global.at_the_middle(&now, Lost::NONE, ROWS), None);
    }

    /// The lost marker says nothing, in its own frame and in the next one.
    #[test]
    fn three_markers_move_as_four_do_and_the_lost_one_stays() {
        let [before, now] =
            [0.0, 4.0].map(|x| MarkerList::from(PLACES.map(|[x0, y]| marker(x0 + x, y))));
        let mut whole = Motion::rolling(LINES);
        whole.ended(Some((&before, Lost::NONE)));
        whole.begin_frame();
        let moved = whole.at_the_middle(&now, Lost::NONE, ROWS).unwrap();
        for lost in 0..4 {
            let mut expected = moved;
            expected[lost] = now[lost];
            let three = |motion: &Motion| motion.at_the_middle(&now, Lost::only(lost), ROWS);
            assert_eq!(three(&whole), Some(expected));
            let mut motion = Motion::rolling(LINES);
            motion.ended(Some((&before, Lost::only(lost))));
            motion.begin_frame();
            assert_eq!(three(&motion), Some(expected));
            assert_eq!(motion.at_the_middle(&now, Lost::NONE, ROWS), None);
            let other = (lost + 1) % 4;
            assert_eq!(motion.at_the_middle(&now, Lost::only(other), ROWS), None);
        }
    }

    #[test]
    fn coordinates_at_their_limits_do_not_overflow() {
        let corners = [[0.0, 0.0], [799.0, 0.0], [799.0, 599.0], [0.0, 599.0]];
        let [first, turned] = [0, 2].map(|by| {
            MarkerList::from_fn(4, |id| {
                let [x, y] = corners[(id + by) % 4];
                marker(x, y)
            })
        });
        let mut motion = Motion::rolling(600);
        motion.ended(Some((&first, Lost::NONE)));
        motion.begin_frame();
        assert!(motion.at_the_middle(&turned, Lost::NONE, 600).is_some());
    }
}
