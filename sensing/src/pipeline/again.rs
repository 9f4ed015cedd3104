//! Looking again: a frame that is refused as it is may be disturbed by no more than specks, a
//! reflection, noise or little light, and show its markers all the same.
//!
//! A frame of which all rows can be had once more is looked at up to twice again:
//!
//! 1. by a mask that follows the light and has its specks taken out
//!    ([`ScanSettings::cleaned`](hivtac_markers::scanner::ScanSettings)), to see about where four
//!    markers are;
//! 2. closely around these, where an ellipse is fitted to what is left of the edge of each
//!    ([`outline`]).
//!
//! The markers are then where the outlines are, and known as well as their edges scatter. The
//! pattern and the images' sizes are judged as always, and the contact must explain all eight
//! coordinates: without a film run forwards nothing is reconstructed. What is not plain after that
//! stays refused, for the reason that it had at first.

use super::{Measurement, Sensor};
use hivtac_force::features::Features;
use hivtac_force::force::{Force, is_contact};
use hivtac_markers::closeup::Closeups;
use hivtac_markers::outline::{Outline, RAYS, outline};
use hivtac_markers::rules::Found;
use hivtac_markers::scanner::ScanSettings;
use hivtac_markers::tables::{Pixels, Table};
use hivtac_terms::marker::Marker;
use hivtac_terms::root::root;
use hivtac_terms::status::Status;
use hivtac_terms::units::Px;

/// Reasons for which a frame is looked at again.
const AGAIN: Status = Status(
    Status::MARKERS_MISSING.0
        | Status::MARKERS_AMBIGUOUS.0
        | Status::BLOB_OVERFLOW.0
        | Status::MARKERS_IMPLAUSIBLE.0
        | Status::IMAGE_SATURATED.0
        | Status::IMAGE_DARK.0
        | Status::UNEXPLAINED.0,
);
/// Those of them that images give, each of which forbids a force.
const OF_IMAGES: Status = Status(AGAIN.0 & !Status::UNEXPLAINED.0);
/// Reasons for which no look helps.
const NEVER: Status =
    Status(Status::FRAME_INCOMPLETE.0 | Status::MODEL_MISSING.0 | Status::MODEL_MISMATCH.0);
/// An outline has at least so many of its rays, and no gap of more.
const LEAST_INLIERS: u8 = 33;
const LARGEST_GAP: u8 = 8;
/// The largest scatter of an outline's edge, px with 8 fractional bits: 0.3 px.
const LARGEST_SCATTER: i32 = 77;
/// An outline's centre is at most so far from the centroid of the cleaned mask along x and y:
/// 0.35 px. What draws that farther aside covers much of a marker, or looks like one.
const FARTHEST: u32 = 22_938;
/// Standard uncertainty of an outline's centre whose edge does not scatter, px with 8 fractional
/// bits.
const LEAST_SIGMA: u64 = 12;
/// What disturbs a frame seldom ends with it, and draws markers aside before it is noticed: after a
/// frame that was reconstructed, so many more are looked at again.
const DOUBTED_FRAMES: u8 = 64;
/// What shows that a frame is disturbed whose images alone say nothing: the scatter of an edge, px
/// with 8 fractional bits, or rays that do not meet it.
const DISTURBED_SCATTER: i32 = 30;
const DISTURBED_INLIERS: u8 = 44;
/// Or a centroid that is drawn so far from its outline along x or y: 0.12 px.
const DISTURBED_FAR: u32 = 7_864;

/// Which look at a frame is under way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Look {
    /// The usual one.
    First,
    /// By the cleaned mask.
    Cleaned,
    /// Around four markers.
    Close,
}

/// The frame that was measured last, for another look.
#[derive(Clone, Debug)]
pub(super) struct Again {
    look: Look,
    /// Whether another look follows.
    wanted: bool,
    /// What the first look gave.
    first: Option<Measurement>,
    /// Where the frame showed its markers.
    seen: Option<[Marker; 4]>,
    candidate: Option<Found>,
    closeups: Closeups,
    /// So many frames more are looked at closely whatever the first look says.
    doubted: u8,
}

impl Again {
    pub const fn new() -> Again {
        Again {
            look: Look::First,
            wanted: false,
            first: None,
            seen: None,
            candidate: None,
            closeups: Closeups::new(),
            doubted: 0,
        }
    }

    /// Another frame begins; gives where the one before showed its markers.
    pub fn begin_frame(&mut self) -> Option<[Marker; 4]> {
        (self.look, self.wanted) = (Look::First, false);
        self.seen.take()
    }

    /// The next frame does not follow this one.
    pub fn forget(&mut self) {
        self.seen = None;
    }

    /// Another look would be by other settings.
    pub fn give_up(&mut self) {
        self.wanted = false;
    }

    pub fn is_looking(&self) -> bool {
        self.look != Look::First
    }

    #[inline(always)]
    pub fn takes_closeups(&self) -> bool {
        self.look == Look::Close
    }

    /// The first look ended with this.
    pub fn ended(&mut self, measurement: &Measurement, wanted: bool) {
        self.seen = measurement.markers;
        self.wanted = wanted;
        if wanted {
            self.first = Some(*measurement);
        }
        self.doubted = self.doubted.saturating_sub(1);
    }

    #[inline(never)]
    pub fn push_rows(&mut self, pixels: &impl Pixels, rows: &[u16]) {
        self.closeups.push_rows(pixels, rows);
    }
}

impl<const BLOBS: usize, T: Table> Sensor<'_, BLOBS, T> {
    /// Whether another look at the frame that was finished last may give a force, and begins it:
    /// push all rows of the frame again, and [finish](Self::finish_frame) it; then ask again.
    #[inline(never)]
    pub fn look_again(&mut self) -> bool {
        if !core::mem::take(&mut self.again.wanted) {
            return false;
        }
        match self.again.look {
            Look::First => {
                let settings = ScanSettings {
                    cleaned: true,
                    ..self.settings.scan()
                };
                self.again.look = Look::Cleaned;
                self.scanner.begin(settings).is_ok()
            }
            Look::Cleaned | Look::Close => {
                let Some(found) = &self.again.candidate else {
                    return false;
                };
                let geometry = &self.settings.geometry;
                let whole = |px: Px| (px.0 >> Px::FRACTION_BITS) as u16;
                let around = found.markers.map(|marker| [marker.x, marker.y].map(whole));
                let size = [geometry.width, geometry.height];
                self.again.closeups.begin(size, around);
                self.again.look = Look::Close;
                true
            }
        }
    }

    /// Whether what the first look gave calls for another.
    pub(super) fn wants_again(&self, measurement: &Measurement) -> bool {
        let status = measurement.status;
        let prepared = self.prepared.as_ref();
        (self.again.doubted > 0 || status.intersects(AGAIN))
            && !status.intersects(NEVER)
            && prepared.is_some_and(|prepared| prepared.resting.is_some())
            // Markers seen at several times are not explained, however good their images; those of
            // a frame without markers tell at least the next frame where they were.
            && (self.motion.is_known()
                || status.intersects(OF_IMAGES) && !status.contains(Status::UNEXPLAINED))
    }

    /// Ends another look.
    #[inline(never)]
    pub(super) fn finish_look(&mut self) -> Measurement {
        let closely = self.again.look == Look::Close;
        let found = match closely {
            true => None,
            false => self.end_scan().and_then(|()| self.find_disturbed()).ok(),
        };
        let reconstructed = match closely {
            true => self.reconstructed(),
            false => None,
        };
        self.again.wanted = found.is_some();
        self.again.candidate = found;
        let measurement = match reconstructed.or(self.again.first) {
            Some(measurement) => measurement,
            // There was a first look.
            None => self.measurement(Err(Status::FRAME_INCOMPLETE)),
        };
        self.again.seen = measurement.markers;
        measurement
    }

    /// The measurement by the outlines of four markers, where it can be trusted.
    #[inline(never)]
    fn reconstructed(&mut self) -> Option<Measurement> {
        let candidate = self.again.candidate.take()?;
        let first = self.again.first?;
        let outlines = self.outlines(&candidate)?;
        let markers = &candidate.markers;
        let looked_good = !first.status.intersects(OF_IMAGES);
        let is_disturbed = outlines.iter().zip(markers).any(is_disturbed);
        let is_sound = outlines.iter().zip(markers).all(is_sound) && are_alike(&outlines);
        if !is_sound || looked_good && !is_disturbed {
            return None;
        }
        let seen = candidate.outlined(&outlines);
        let rows = self.settings.geometry.height;
        let still = match self.motion.at_the_middle(&seen.markers, rows) {
            Some(markers) => seen.moved_to(markers),
            None => seen,
        };
        let prepared = self.prepared.as_ref()?;
        let mut status = prepared.standing | Status::MARKERS_RECONSTRUCTED;
        if prepared.trust.as_ref()?.judge(&still) != Status::OK {
            return None;
        }
        let features = Features::of_markers(&still.markers);
        let blur = outlines.map(|outline| sigma(&outline));
        let force = match self.motion.is_known() {
            true => Some(self.force_of_blurred(&features, &still.markers, &blur, &mut status)?),
            // The next frame is told where they were.
            false => {
                status |= first.status;
                None
            }
        };
        if first.force.is_none() {
            self.again.doubted = DOUBTED_FRAMES;
        }
        Some(Measurement {
            status,
            markers: Some(seen.markers),
            features: Some(features),
            force,
        })
    }

    /// Four markers about which there may be outlines.
    fn find_disturbed(&self) -> Result<Found, Status> {
        let prepared = self.prepared.as_ref().ok_or(Status::IMAGE_DARK)?;
        prepared.finder.find_disturbed(self.scanner.blobs())
    }

    fn outlines(&self, candidate: &Found) -> Option<[Outline; 4]> {
        let windows = self.again.closeups.windows()?;
        let variances = candidate.variances();
        let mut outlines = [None; 4];
        let markers = candidate.markers.iter().zip(windows).zip(variances);
        for (place, ((marker, window), variance)) in outlines.iter_mut().zip(markers) {
            *place = outline(window, [marker.x, marker.y], variance);
        }
        let [a, b, c, d] = outlines;
        Some([a?, b?, c?, d?])
    }

    fn force_of_blurred(
        &mut self,
        features: &Features,
        markers: &[Marker; 4],
        blur: &[Px; 4],
        status: &mut Status,
    ) -> Option<Force> {
        let model = self.model.as_ref()?;
        let tare = self.tare.as_ref().unwrap_or(&model.rest);
        let output = self.network.run(model, features, &tare.features);
        let resting = self.prepared.as_ref()?.resting.as_ref()?;
        let forward = model.forward.as_ref()?;
        let (force, trust) =
            resting.force_of_blurred(forward, &model.range, (markers, blur), &output);
        if trust.contains(Status::UNEXPLAINED) {
            return None;
        }
        *status |= trust;
        if output.input_saturated {
            *status |= Status::MAGNITUDE_OUT_OF_RANGE;
        }
        if is_contact(&force) {
            *status |= Status::CONTACT;
        }
        Some(force)
    }
}

/// How far an outline's centre is from the centroid of the cleaned mask along x or y, the larger,
/// px in Q16.16.
fn far(outline: &Outline, marker: &Marker) -> u32 {
    let [x, y] = [(outline.x, marker.x), (outline.y, marker.y)].map(|(a, b)| a.0.abs_diff(b.0));
    x.max(y)
}

/// Whether enough is left of an edge, and nothing large lies on it.
fn is_sound((outline, marker): (&Outline, &Marker)) -> bool {
    outline.inliers >= LEAST_INLIERS
        && outline.gap <= LARGEST_GAP
        && outline.scatter <= LARGEST_SCATTER
        && far(outline, marker) <= FARTHEST
}

/// Whether no outline is wider than another by more than a quarter of that: two discs that overlap
/// by half look like one that is a third wider, and their middle like a marker's.
fn are_alike(outlines: &[Outline; 4]) -> bool {
    let radii = outlines.map(|outline| i64::from(outline.radius));
    let (least, most) = (radii.iter().min(), radii.iter().max());
    least
        .zip(most)
        .is_some_and(|(least, most)| 4 * most <= 5 * least)
}

/// Whether an edge shows that its frame is disturbed.
fn is_disturbed((outline, marker): (&Outline, &Marker)) -> bool {
    outline.scatter > DISTURBED_SCATTER
        || outline.inliers < DISTURBED_INLIERS
        || far(outline, marker) > DISTURBED_FAR
}

/// Standard uncertainty of an outline's centre: of n points that scatter by s, √(2/n)·s in each
/// coordinate, and what the pixel grid does to all of them.
fn sigma(outline: &Outline) -> Px {
    let squared = (outline.scatter * outline.scatter) as u64;
    let of_points = 2 * squared * 2 / u64::from(outline.inliers.max(1));
    Px((root((of_points + LEAST_SIGMA * LEAST_SIGMA) << 16)) as i32)
}

const _: () = assert!(DISTURBED_INLIERS as usize <= RAYS);
