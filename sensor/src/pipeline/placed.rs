//! Measures a film with another layout than the square of four dots.
//!
//! The rest position identifies each marker, and the forward model explains them all. Five or more
//! markers are redundant, so one or two may be lost: without an image of their own, or left out
//! because no contact explains them with the others. The force then comes from the others
//! ([`Status::MARKER_LOST`]), with its own uncertainty.

use super::again::BLUR;
use super::{Look, Measurement, Prepared, Sensor, at_the_middle, is_a_press};
use crate::force::features::Features;
use crate::force::forward::{Column, Estimate, Forward, Pose, Start};
use crate::force::rest::Rest;
use crate::force::{Force, FrameNoise, Resting};
use crate::markers::lost::Lost;
use crate::markers::rules::Placed;
use crate::markers::tables::Table;
use hivtac_terms::force::ContactList;
use hivtac_terms::marker::LEAST_MARKERS;
use hivtac_terms::status::Status;
use hivtac_terms::units::Px;

/// The number of markers whose layout has rules of its own ([`crate::markers::rules`]).
const SQUARE: usize = 4;
/// Number of markers that are left out in turn, those that a contact explains least first.
const SUSPECTS: usize = 3;

/// Frames after which everything was tried that is tried at once after a frame that a load
/// explained: in each second one something. All of it takes longer than a frame.
const ATTEMPTS: u8 = 2 * (SUSPECTS as u8 + 3);

/// The previous frame's result, where the steps of the next one begin.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Before {
    /// The load that explained its markers; `None` if no load did.
    load: Option<Pose>,
    /// The marker that it left out.
    left_out: Option<usize>,
    /// Whether that load turned.
    is_turned: bool,
    /// The frame, if no load explained it.
    refused: Option<Refused>,
    /// Whether the last second look showed that the frame was disturbed.
    pub(super) is_disturbed: bool,
}

/// A frame that no load explains.
#[derive(Clone, Copy, Debug)]
struct Refused {
    /// The load that explains it best.
    load: Pose,
    /// The number of such frames before, modulo 256.
    count: u8,
}

/// The attempts at a frame that follows an unexplained one.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Attempt {
    /// Steps from the load of the frame before, and nothing else.
    Same,
    /// Also with a torque.
    Turned,
    /// Also without the marker that they explain least; or the one after that.
    Without(usize),
    /// Also from elsewhere.
    From(Start),
}

impl Before {
    /// The load that explains the last frame best, if none explains it well.
    pub(super) fn refused(&self) -> Option<Pose> {
        self.refused.map(|refused| refused.load)
    }

    /// Whether more than the same load was tried in the last frame.
    pub(super) fn tried_more(&self) -> bool {
        self.refused.is_some_and(|refused| refused.count % 2 == 0)
    }

    /// Whether a second look at the last frame, which no load explained, may show more. It takes
    /// longer than the rest: if the last one showed no disturbance, few are worth it.
    pub(super) fn may_be_disturbed(&self) -> bool {
        let count = self.refused.map_or(0, |refused| refused.count);
        self.is_disturbed || count == 0 || count % ATTEMPTS == 2
    }

    /// The next attempt; `None` after a frame that a load explained.
    fn attempt(&self) -> Option<(Pose, Attempt)> {
        let Refused { load, count } = self.refused?;
        let attempt = match count % ATTEMPTS {
            nth if nth % 2 == 0 => Attempt::Same,
            1 => Attempt::From(Start::WhereMost),
            3 => Attempt::From(Start::Press),
            5 => Attempt::Turned,
            nth => Attempt::Without(usize::from(nth / 2).saturating_sub(3)),
        };
        Some((load, attempt))
    }
}

impl Prepared {
    /// The rest position of a film with another layout than the square of four dots.
    pub(super) fn other_layout(&self) -> Option<&Rest> {
        self.rest.as_ref().filter(|rest| rest.areas.len() != SQUARE)
    }

    /// The number of markers.
    pub(super) fn markers(&self) -> usize {
        self.rest.as_ref().map_or(SQUARE, |rest| rest.areas.len())
    }
}

impl<const BLOBS: usize, T: Table> Sensor<'_, BLOBS, T> {
    /// Whether the film has another layout than the square of four dots.
    pub(super) fn has_other_layout(&self) -> bool {
        let prepared = self.prepared.as_ref();
        prepared.is_some_and(|prepared| prepared.other_layout().is_some())
    }

    /// Returns the markers of the last scanned frame by their rest places.
    ///
    /// # Errors
    /// Why they are not known.
    pub(super) fn place_markers(&self) -> Result<Placed, Status> {
        let prepared = self.prepared.as_ref().ok_or(Status::IMAGE_DARK)?;
        let rest = prepared.rest.as_ref().ok_or(Status::MARKERS_MISSING)?;
        let blobs = self.scanner.blobs();
        let may_be_shifted = self.tare.is_none();
        prepared
            .finder
            .place(blobs, &rest.markers(), may_be_shifted)
    }

    /// Returns [`Status::ANOTHER_LAYOUT`] if the last scanned frame, refused for this reason, shows
    /// as many whole dots as a film of another layout. Those of the film itself may be up to three
    /// fewer, or one more by a thing of their colour.
    #[inline(never)]
    pub(super) fn another_layout(&self, reason: Status) -> Status {
        let refused = Status::MARKERS_MISSING | Status::MARKERS_AMBIGUOUS;
        let prepared = self
            .prepared
            .as_ref()
            .filter(|_| reason.intersects(refused));
        let parts = prepared.and_then(|prepared| Some((prepared, prepared.rest.as_ref()?)));
        let Some((prepared, rest)) = parts else {
            return Status::OK;
        };
        let shown = prepared.finder.dots(self.scanner.blobs());
        let is_another = shown >= LEAST_MARKERS
            && (shown >= rest.areas.len() + 2 || shown + 2 < rest.areas.len());
        match is_another {
            true => Status::ANOTHER_LAYOUT,
            false => Status::OK,
        }
    }

    /// Returns the measurement of the last scanned frame. Not inlined, so that it stays out of the
    /// near memory.
    #[inline(never)]
    pub(super) fn measure_placed(&mut self) -> Measurement {
        let placed = match self.place_markers() {
            Ok(placed) => placed,
            Err(reason) => {
                let reason = reason | self.another_layout(reason);
                return self.measurement(Err(reason));
            }
        };
        let prepared = self.prepared.as_ref();
        let mut status = prepared.map_or(Status::OK, |prepared| prepared.standing);
        let rows = self.settings.geometry.height;
        self.noise.set_beside(placed.largest_shift_px2());
        let moved = at_the_middle(
            &self.motion,
            &mut self.noise,
            &placed.markers,
            placed.lost,
            rows,
        );
        let still = Placed {
            markers: moved.unwrap_or(placed.markers),
            ..placed
        };
        // Within a rolling frame, markers whose motion is unknown may be anywhere on their way.
        let is_still = moved.is_some() || !self.motion.is_rolling();
        let force = self.explain(&still, is_still, &mut status);
        let is_whole = placed.lost == Lost::NONE;
        Measurement {
            status,
            markers: Some(placed.markers),
            lost: placed.lost,
            features: is_whole.then(|| Features::of_markers(&still.markers)),
            force,
            contacts: ContactList::default(),
        }
    }

    /// Returns the force of markers; `None` if `status` forbids one. `is_still` says that they are
    /// seen at one common time.
    fn explain(&mut self, placed: &Placed, is_still: bool, status: &mut Status) -> Option<Force> {
        if status.intersects(Status::NO_FORCE) {
            return None;
        }
        let model = self.model.as_ref()?;
        let prepared = self.prepared.as_ref()?;
        let parts = model.forward.as_ref().zip(prepared.resting.as_ref());
        let Some((forward, resting)) = parts else {
            *status |= Status::MODEL_MISMATCH;
            return None;
        };
        let is_again = matches!(self.look, Look::Again);
        let frame = self.noise.of_frame(if is_again { BLUR } else { Px(0) });
        // What shows through beside a marker counts for that marker alone: others check it.
        let noise = FrameNoise {
            beside: Px(0),
            ..frame
        };
        if frame.is_disturbed() {
            *status |= Status::FRAME_DISTURBED;
        }
        let seen = Seen {
            forward,
            resting,
            placed,
            noise,
        };
        let mut before = prepared.before;
        match self.pairs.nearly_one().zip(before.refused.as_mut()) {
            _ if is_again => before.refused = None,
            Some((one, refused)) => refused.load = one,
            None => {}
        }
        let (estimate, left_out) = seen.explained(&before, is_still, self.pairs.are_followed());
        let lost = placed.without(left_out);
        if !is_again && lost == Lost::NONE {
            self.noise.saw(noise, &estimate.left);
        }
        let (force, found) = resting.force_and_status(forward, &model.range, noise, &estimate);
        if !is_again && lost == Lost::NONE && is_a_press(found) {
            self.noise.saw_press(frame, &estimate, &placed.markers);
        }
        *status |= found;
        if lost != Lost::NONE {
            *status |= Status::MARKER_LOST;
        }
        // A second look may come too late: no later frame depends on it.
        if let Some(prepared) = self.prepared.as_mut().filter(|_| !is_again) {
            let is_explained = estimate.is_explained();
            let count = before
                .refused
                .map_or(0, |refused| refused.count.wrapping_add(1));
            prepared.now = Some(Before {
                load: is_explained.then_some(estimate.pose),
                left_out,
                is_turned: estimate.is_turned(),
                refused: (!is_explained).then_some(Refused {
                    load: estimate.pose,
                    count,
                }),
                is_disturbed: before.is_disturbed,
            });
        }
        (!status.intersects(Status::NO_FORCE)).then_some(force)
    }
}

/// The markers of a frame, with the settings for their measurement.
struct Seen<'a> {
    forward: &'a Forward<'a>,
    resting: &'a Resting,
    placed: &'a Placed,
    noise: FrameNoise,
}

impl Seen<'_> {
    /// Returns the load that explains the markers best, and the one that it leaves out. A marker is
    /// left out if a contact explains only the others, and if they are `still`. After a frame that
    /// no load explained, little is tried in each; less if two contacts explained it.
    fn explained(
        &self,
        before: &Before,
        is_still: bool,
        are_two: bool,
    ) -> (Estimate, Option<usize>) {
        let may_leave_out = is_still && self.placed.may_lose(1);
        let Some((load, attempt)) = before.attempt() else {
            return self.usual(before, may_leave_out);
        };
        let tried = self.tried(load, attempt, may_leave_out, are_two);
        if !tried.0.is_explained() {
            return tried;
        }
        let usual = self.usual(before, may_leave_out);
        match usual.0.is_explained() {
            true => usual,
            false => tried,
        }
    }

    /// Tries the load of the frame before, and one thing more.
    fn tried(
        &self,
        load: Pose,
        attempt: Attempt,
        may_leave_out: bool,
        are_two: bool,
    ) -> (Estimate, Option<usize>) {
        let found = self.estimate(None, Start::At(load), false);
        if found.is_explained() || are_two {
            return (found, None);
        }
        let other = match attempt {
            Attempt::Without(nth) if may_leave_out => {
                let suspect = least_explained(&found.left, self.placed.lost, nth);
                let others = self.estimate(Some(suspect), Start::At(found.pose), false);
                (others, Some(suspect))
            }
            Attempt::From(start) => (self.estimate(None, start, false), None),
            Attempt::Turned => (self.estimate(None, Start::At(found.pose), true), None),
            Attempt::Same | Attempt::Without(_) => return (found, None),
        };
        match other.0.is_explained() {
            true => other,
            false => (found, None),
        }
    }

    /// Tries the load of the frame before, then without the marker that it left out, then all
    /// places, then without each marker that is explained least, and at last with a torque: it
    /// would explain a part of what a marker in a wrong place shows.
    fn usual(&self, before: &Before, may_leave_out: bool) -> (Estimate, Option<usize>) {
        if let Some(load) = before.load {
            let found = self.estimate(None, Start::At(load), before.is_turned);
            if found.is_explained() {
                return (found, None);
            }
            let again = before.left_out.filter(|_| may_leave_out);
            if let Some(suspect) = again.filter(|again| !self.placed.lost.contains(*again)) {
                let others = self.estimate(Some(suspect), Start::At(load), false);
                if others.is_explained() {
                    return (others, Some(suspect));
                }
            }
        }
        let all = self.estimate(None, Start::Anywhere, false);
        if all.is_explained() {
            return (all, None);
        }
        let suspects = if may_leave_out { SUSPECTS } else { 0 };
        for nth in 0..suspects {
            let suspect = least_explained(&all.left, self.placed.lost, nth);
            let others = self.estimate(Some(suspect), Start::At(all.pose), false);
            if others.is_explained() {
                return (others, Some(suspect));
            }
        }
        let turned = self.estimate(None, Start::At(all.pose), true);
        match turned.is_explained() {
            true => (turned, None),
            false => (all, None),
        }
    }

    /// Returns the load that explains the markers best without one. `may_turn` allows a torque
    /// where nothing else does.
    fn estimate(&self, left_out: Option<usize>, start: Start, may_turn: bool) -> Estimate {
        let placed = (self.placed, self.placed.without(left_out));
        self.resting
            .estimate_without(self.forward, placed, self.noise, (start, may_turn))
    }
}

/// The marker, not lost, that a load explains worst, after `before` others that it explains worse.
fn least_explained(left: &Column, lost: Lost, before: usize) -> usize {
    let mut others = lost;
    let mut suspect = 0;
    for _ in 0..=before {
        let mut most = -1.0;
        for (identity, [x, y]) in left.as_chunks().0.iter().enumerate() {
            let square = x * x + y * y;
            if square > most && !others.contains(identity) {
                (suspect, most) = (identity, square);
            }
        }
        others = others.and(suspect);
    }
    suspect
}
