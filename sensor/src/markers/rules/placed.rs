//! Finds the markers of any layout by their rest places.
//!
//! Each marker is nearest to its own rest place: loads within ±6 mm of the middle, up to 200 mN,
//! move no marker half the way to another one's. An image that is not whole, or shares its rest
//! place with another, is no marker. The other rules for four markers are not needed: the residual
//! of the redundant markers exposes a false one.

use super::pattern::{distance, larger};
use super::shape::Shape;
use super::trust::{HOLLOW, LOPSIDED, LOPSIDED_PIXELS};
use super::{Finder, Reading};
use crate::markers::blob::Blob;
use crate::markers::kernels::sqrt;
use crate::markers::lost::Lost;
use hivtac_terms::conditions::ContactReading;
use hivtac_terms::list::List;
use hivtac_terms::marker::{MOST_MARKERS, Marker, MarkerList};
use hivtac_terms::status::Status;
use hivtac_terms::units::Px;

/// Most markers that may be lost; at least [`FEWEST`] must be seen.
const MOST_LOST: usize = 2;
/// Fewest markers: their eight coordinates check a contact's five unknowns.
const FEWEST: usize = 4;
/// Largest ratio of two markers' areas over those of the same markers in another rest picture.
/// Discs punched alike differ by less; half a disc by more.
const UNLIKE: f32 = 1.5;

/// Markers at their rest places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// The markers. A lost one is where it rests.
    pub markers: MarkerList,
    /// Markers without an image.
    pub lost: Lost,
    /// [`Shape::shift_px2`] of each image; 0 of a lost marker.
    pub shifts_px2: List<f32, MOST_MARKERS>,
}

impl Finder {
    /// Returns the markers among `blobs`, by their places in `rest`. If all are seen, and the
    /// camera `may_be_shifted` since that picture, their middle shows by how much.
    ///
    /// # Errors
    /// [`Status::MARKERS_MISSING`] if fewer than four are seen, or three are lost.
    pub fn place(
        &self,
        blobs: &[Blob],
        rest: &[Marker],
        may_be_shifted: bool,
    ) -> Result<Placed, Status> {
        let mut markers = MarkerList::of(rest.iter().copied());
        let mut shifts_px2 = List::defaults(rest.len());
        let mut images = List::<u32, MOST_MARKERS>::defaults(rest.len());
        let (dx, dy) = match may_be_shifted {
            true => self.shift(blobs, rest),
            false => (Px(0), Px(0)),
        };
        for shape in self.whole(blobs) {
            let identity = nearest((shape.x - dx, shape.y - dy), rest);
            let place = images.get_mut(identity).zip(markers.get_mut(identity));
            if let Some(((images, marker), shift)) = place.zip(shifts_px2.get_mut(identity)) {
                *images += 1;
                *marker = shape.marker();
                *shift = shape.shift_px2;
            }
        }
        let mut lost = Lost::NONE;
        let places = markers.iter_mut().zip(rest).zip(shifts_px2.iter_mut());
        for (identity, (images, ((marker, rest), shift))) in images.iter().zip(places).enumerate() {
            if *images != 1 {
                lost = lost.and(identity);
                (*marker, *shift) = (*rest, 0.0);
            }
        }
        let placed = Placed {
            markers,
            lost,
            shifts_px2,
        };
        match placed.may_lose(0) {
            true => Ok(placed),
            false => Err(Status::MARKERS_MISSING),
        }
    }

    /// The images that are as full and even as markers'.
    fn whole(&self, blobs: &[Blob]) -> impl Iterator<Item = Shape> {
        let candidates = blobs.iter().filter_map(|blob| self.candidate(blob).ok());
        candidates.filter(|shape| self.is_whole(shape))
    }

    /// The number of whole dots.
    pub fn dots(&self, blobs: &[Blob]) -> usize {
        self.whole(blobs).count()
    }

    /// How far the middle of as many images as markers is from the middle of these; 0 for another
    /// number of images.
    fn shift(&self, blobs: &[Blob], rest: &[Marker]) -> (Px, Px) {
        let (mut x, mut y, mut count) = (0_i64, 0_i64, 0_i64);
        for shape in self.whole(blobs) {
            (x, y, count) = (
                x + i64::from(shape.x.0),
                y + i64::from(shape.y.0),
                count + 1,
            );
        }
        if count != rest.len() as i64 {
            return (Px(0), Px(0));
        }
        for marker in rest {
            (x, y) = (x - i64::from(marker.x.0), y - i64::from(marker.y.0));
        }
        let mean = |sum: i64| Px(sum.checked_div(count).unwrap_or(0) as i32);
        (mean(x), mean(y))
    }

    /// Whether an image is as full and even as a marker's.
    fn is_whole(&self, shape: &Shape) -> bool {
        const FOUR_OVER_PI: f32 = 4.0 / core::f32::consts::PI;
        let width = sqrt(FOUR_OVER_PI * shape.area as f32);
        let hollow = HOLLOW.get(usize::from(self.dilations)).or(HOLLOW.last());
        let hollow =
            hollow.copied().unwrap_or_default() + Reading::of(ContactReading::Force, true).hollow;
        shape.hollow <= self.grid * hollow
            && shape.lopsided <= self.grid * LOPSIDED_PIXELS + width * LOPSIDED
    }
}

impl Placed {
    /// All markers of a film, with nothing that shows through it beside them.
    pub fn of(markers: &[Marker]) -> Placed {
        Placed {
            markers: MarkerList::of(markers.iter().copied()),
            lost: Lost::NONE,
            shifts_px2: List::defaults(markers.len()),
        }
    }

    /// Whether this many more markers may be lost.
    pub fn may_lose(&self, more: usize) -> bool {
        let lost = self.lost.count() + more;
        lost <= MOST_LOST && lost + FEWEST <= self.markers.len()
    }

    /// The markers without weight: those that are lost, and this one.
    pub fn without(&self, left_out: Option<usize>) -> Lost {
        left_out.map_or(self.lost, |identity| self.lost.and(identity))
    }

    /// The largest of [`Placed::shifts_px2`].
    pub fn largest_shift_px2(&self) -> f32 {
        self.shifts_px2.iter().copied().fold(0.0, larger)
    }

    /// Whether these are whole markers of a film at rest, as the film of another rest picture has
    /// them.
    pub fn may_rest(&self, other: &[Marker]) -> bool {
        let (mut least, mut most) = (f32::INFINITY, 0.0_f32);
        for (marker, other) in self.markers.iter().zip(other) {
            let ratio = marker.area as f32 / other.area.max(1) as f32;
            (least, most) = (least.min(ratio), most.max(ratio));
        }
        self.lost == Lost::NONE && most <= UNLIKE * least
    }
}

/// The identity whose rest place is nearest.
pub(super) fn nearest(place: (Px, Px), rest: &[Marker]) -> usize {
    let (mut nearest, mut least) = (0, f32::INFINITY);
    for (identity, marker) in rest.iter().enumerate() {
        let far = distance(place, (marker.x, marker.y));
        if far < least {
            (nearest, least) = (identity, far);
        }
    }
    nearest
}
