//! Measures the rest position of this unit, the tare, as the mean of good frames.
//!
//! Every force is measured against it, and a wrong rest position makes all forces wrong without a
//! sign. So it is refused unless
//!
//! 1. the images are those of whole markers ([`Sensor::tare_with`](crate::pipeline::Sensor)): a
//!    film at rest is flat, so optics give the images of four equal discs;
//! 2. nothing moves: the frames scatter no more than noise does;
//! 3. nothing touches the film, compared with the previous rest position or the unit's calibration;
//!    without either, only by the scatter of units as built;
//! 4. the markers' distance from their centre fits a film at rest ([`Rest::fits`]).
//!
//! [Forced](TareBuilder::forced) skips 2 and 3.

use crate::force::features::Features;
use crate::force::rest::Rest;
use hivtac_terms::fixed::Q;
use hivtac_terms::geometry::Geometry;
use hivtac_terms::list::List;
use hivtac_terms::marker::{MOST_MARKERS, Marker};
use hivtac_terms::root::rounded_root;
use hivtac_terms::units::{MicroNewtons, Px};

/// Most frames of a mean: the sums then stay far inside their types.
pub const MAX_FRAMES: u16 = 256;

/// x and y of each marker.
type Coordinates<T> = List<T, { 2 * MOST_MARKERS }>;
/// Coordinates and distances whose squares are summed, px.
type Coarse = Q<8, i64>;

/// Largest standard deviation of a marker's coordinate over the frames: 0.25 px.
const LARGEST_SCATTER: Coarse = Q::from_bits(64);
/// Limit of a coordinate's difference from the first frame: 32 px. Larger ones are unsteady anyway.
const FAR: Coarse = Q::from_int(32);

/// Why a rest position is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Refusal {
    /// As many frames as were wanted show markers that are cut, grown, stained or unlike each
    /// other.
    MarkersImplausible,
    /// The markers moved from frame to frame.
    Unsteady,
    /// The markers are nearer to or farther from their centre than a film at rest shows them.
    NotAtRest,
    /// Something touches the film; the force that it looks like.
    Touched(MicroNewtons),
}

/// Sums good frames until there are enough. All sums are exact; each mean is rounded once, half up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TareBuilder {
    wanted: u16,
    is_forced: bool,
    taken: u16,
    implausible: u16,
    touched: u16,
    /// The force of the last touched frame.
    touch: MicroNewtons,
    /// Sums of the coordinates, and of centre and area of their bounding rectangle.
    coordinates: Coordinates<Q<16, i64>>,
    rect: [Q<16, i64>; 3],
    areas: List<u64, MOST_MARKERS>,
    /// Coordinates of the first frame; sums of the differences of the others from it, and of their
    /// squares, px².
    first: Coordinates<Coarse>,
    differences: Coordinates<Coarse>,
    squares: Coordinates<Q<16, i64>>,
}

impl TareBuilder {
    /// For a mean of `frames` good frames. Returns `None` unless that is 1 to [`MAX_FRAMES`].
    pub fn new(frames: u16) -> Option<TareBuilder> {
        let wanted = frames;
        let empty = TareBuilder {
            wanted,
            is_forced: false,
            taken: 0,
            implausible: 0,
            touched: 0,
            touch: MicroNewtons(0),
            coordinates: List::defaults(0),
            rect: [Q::default(); 3],
            areas: List::defaults(0),
            first: List::defaults(0),
            differences: List::defaults(0),
            squares: List::defaults(0),
        };
        (1..=MAX_FRAMES).contains(&frames).then_some(empty)
    }

    /// Accepts all frames, even if something moves or touches the film.
    #[must_use]
    pub fn forced(self) -> TareBuilder {
        TareBuilder {
            is_forced: true,
            ..self
        }
    }

    /// Adds the markers and features of a good frame. Once there are enough, returns the rest
    /// position for this geometry, or why it is refused, and the same for every later frame;
    /// otherwise `None`.
    pub fn add(
        &mut self,
        markers: &[Marker],
        features: &Features,
        geometry: &Geometry,
    ) -> Option<Result<Rest, Refusal>> {
        if self.taken < self.wanted {
            self.take(markers, features);
        }
        (self.taken == self.wanted).then(|| self.judge(geometry))
    }

    /// Counts a frame whose images are not those of whole markers. Returns the refusal once there
    /// were as many as good frames are wanted; otherwise `None`.
    pub fn add_implausible(&mut self) -> Option<Refusal> {
        self.implausible = self.implausible.saturating_add(1);
        (self.implausible >= self.wanted).then_some(Refusal::MarkersImplausible)
    }

    /// Counts a frame in which something touches the film with this force. Returns the refusal once
    /// there were as many as good frames are wanted; otherwise `None`.
    pub fn add_touched(&mut self, touch: MicroNewtons) -> Option<Refusal> {
        self.touched = self.touched.saturating_add(1);
        self.touch = touch;
        (self.touched >= self.wanted).then_some(Refusal::Touched(touch))
    }

    /// Returns whether touched frames are accepted.
    pub fn is_forced(&self) -> bool {
        self.is_forced
    }

    /// The force of the last touched frame; `None` if no frame was touched.
    pub fn saw_touch(&self) -> Option<MicroNewtons> {
        (self.touched > 0).then_some(self.touch)
    }

    /// The largest standard deviation of a marker's coordinate over the frames so far, to 1/256 px.
    pub fn spread(&self) -> Px {
        let frames = i64::from(self.taken.max(1));
        let largest = self.variances().max().unwrap_or_default();
        // Below 2⁴² · 2¹⁶; a root has half as many fractional bits.
        let scaled = rounded_root((largest.bits().max(0) as u64) << 16) as i64;
        Px((scaled / frames) as i32)
    }

    /// Returns whether a frame's images were not those of whole markers.
    pub fn saw_implausible(&self) -> bool {
        self.implausible > 0
    }

    fn take(&mut self, markers: &[Marker], features: &Features) {
        let at = features.centroids.iter().flat_map(|(x, y)| [*x, *y]);
        if self.taken == 0 {
            self.coordinates = List::defaults(2 * markers.len());
            self.squares = self.coordinates;
            self.differences = List::defaults(2 * markers.len());
            self.first = List::of(at.clone().map(|px| Q::<16, i64>::from(px).floor_to()));
            self.areas = List::defaults(markers.len());
        }
        let (x, y) = features.rect_center;
        let rect = [x.into(), y.into(), features.rect_area];
        for (sum, part) in self.rect.iter_mut().zip(rect) {
            *sum += part;
        }
        for (sum, marker) in self.areas.iter_mut().zip(markers) {
            *sum += u64::from(marker.area);
        }
        for (sum, coordinate) in self.coordinates.iter_mut().zip(at.clone()) {
            *sum += Q::from(coordinate);
        }
        let sums = self.differences.iter_mut().zip(self.squares.iter_mut());
        for ((first, coordinate), (sum, square)) in self.first.iter().zip(at).zip(sums) {
            let coordinate: Coarse = Q::<16, i64>::from(coordinate).floor_to();
            let difference = (coordinate - *first).clamp(-FAR, FAR);
            *sum += difference;
            *square += squared(difference);
        }
        self.taken += 1;
    }

    fn judge(&self, geometry: &Geometry) -> Result<Rest, Refusal> {
        let rest = self.mean();
        if !self.is_forced && !self.is_steady() {
            Err(Refusal::Unsteady)
        } else if !rest.fits(geometry) {
            Err(Refusal::NotAtRest)
        } else {
            Ok(rest)
        }
    }

    /// Whether no coordinate's variance is too large.
    fn is_steady(&self) -> bool {
        let largest = squared(LARGEST_SCATTER * i64::from(self.taken));
        self.variances().all(|variance| variance <= largest)
    }

    /// n² times each coordinate's variance, ΣΔ²/n − (ΣΔ/n)², px². All terms are below 2⁴² steps.
    fn variances(&self) -> impl Iterator<Item = Q<16, i64>> {
        let frames = i64::from(self.taken.max(1));
        let sums = self.differences.iter().zip(self.squares.iter());
        sums.map(move |(sum, square)| *square * frames - squared(*sum))
    }

    fn mean(&self) -> Rest {
        let frames = i64::from(self.taken);
        // Without frames the mean is 0.
        let mean = |sum: i64| {
            (2 * sum + frames)
                .checked_div_euclid(2 * frames)
                .unwrap_or(0)
        };
        let px = |sum: Q<16, i64>| Px(mean(sum.bits()) as i32);
        let [x, y, area] = self.rect;
        let pairs = self.coordinates.as_chunks().0.iter();
        Rest {
            features: Features {
                centroids: List::of(pairs.map(|[x, y]| (px(*x), px(*y)))),
                rect_center: (px(x), px(y)),
                rect_area: Q::from_bits(mean(area.bits())),
            },
            areas: List::of(self.areas.iter().map(|sum| mean(*sum as i64) as u32)),
        }
    }
}

/// The square of a distance, px².
fn squared(distance: Coarse) -> Q<16, i64> {
    Q::from_bits(distance.bits() * distance.bits())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::force::features::FEATURES;
    use hivtac_terms::geometry::Preset;

    const GEOMETRY: Geometry = Geometry::preset(Preset::Ov7725, 320, 240);

    /// Markers of a film at rest, moved to the right.
    fn frame(right: Px, area: u32) -> ([Marker; 4], Features) {
        let half = (f64::from(GEOMETRY.rest_distance().0) / 2.0_f64.sqrt()) as i32;
        let at = |x: i32, y: i32| Marker {
            x: Px((160 << 16) + x * half) + right,
            y: Px((120 << 16) + y * half),
            area,
        };
        let markers = [at(-1, -1), at(1, -1), at(1, 1), at(-1, 1)];
        (markers, Features::of_markers(&markers))
    }

    /// The result of a tare with frames shifted to the right by these distances.
    fn tare_of(frames: impl Iterator<Item = Px> + Clone) -> Result<Rest, Refusal> {
        let mut builder = TareBuilder::new(frames.clone().count() as u16).unwrap();
        let mut outcome = None;
        for right in frames {
            assert_eq!(outcome, None);
            let (markers, features) = frame(right, 100);
            outcome = builder.add(&markers, &features, &GEOMETRY);
        }
        outcome.unwrap()
    }

    fn left_of(rest: &Rest) -> Px {
        rest.features.centroids[0].0 - frame(Px(0), 1).0[0].x
    }

    #[test]
    fn the_mean_is_rounded_once() {
        let mut builder = TareBuilder::new(3).unwrap();
        for area in [100, 101] {
            let (markers, features) = frame(Px(10), area);
            assert_eq!(builder.add(&markers, &features, &GEOMETRY), None);
        }
        let (markers, features) = frame(Px(12), 101);
        let rest = builder.add(&markers, &features, &GEOMETRY).unwrap();
        assert_eq!(left_of(&rest.unwrap()), Px(11), "32/3 = 10.67");
        assert_eq!(rest.unwrap().areas, [101; 4], "302/3 = 100.67");
        assert_eq!(
            builder.add(&markers, &features, &GEOMETRY),
            Some(rest),
            "more frames change nothing"
        );
    }

    #[test]
    fn halves_round_up_on_both_sides_of_zero() {
        for (first, second, mean) in [(1, 2, 2), (-1, -2, -1), (-1, 0, 0)] {
            let rest = tare_of([first, second].map(Px).into_iter()).unwrap();
            assert_eq!(left_of(&rest), Px(mean));
        }
    }

    #[test]
    fn one_frame_is_its_own_mean() {
        let (markers, features) = frame(Px(123_456), 7);
        let rest = TareBuilder::new(1)
            .unwrap()
            .add(&markers, &features, &GEOMETRY)
            .unwrap()
            .unwrap();
        assert_eq!((rest.features, rest.areas), (features, [7; 4].into()));
    }

    #[test]
    fn the_number_of_frames_is_checked() {
        assert!(TareBuilder::new(0).is_none());
        assert!(TareBuilder::new(MAX_FRAMES + 1).is_none());
        assert!(TareBuilder::new(MAX_FRAMES).is_some());
    }

    /// A square wave's standard deviation is half of its jump.
    #[test]
    fn markers_that_move_are_refused_whether_they_jump_or_drift() {
        let jumping = |px: f64| (0..64).map(move |i| Px((px * 65_536.0) as i32 * (i % 2)));
        assert!(tare_of(jumping(0.49)).is_ok());
        assert_eq!(tare_of(jumping(0.51)), Err(Refusal::Unsteady));
        assert_eq!(tare_of(jumping(400.0)), Err(Refusal::Unsteady));
        let drifting = (0..256).map(|i| Px(i * 260));
        assert_eq!(tare_of(drifting), Err(Refusal::Unsteady), "1 px in all");
    }

    /// With a square wave of 0.2 px, and with one that is too large to be steady.
    #[test]
    fn the_spread_is_the_standard_deviation_and_a_forced_tare_takes_any() {
        let spread = |jump: f64, is_forced: bool| {
            let mut builder = TareBuilder::new(64).unwrap();
            if is_forced {
                builder = builder.forced();
            }
            let mut outcome = None;
            for nth in 0..64 {
                let right = Px((jump * 65_536.0) as i32 * (nth % 2));
                let (markers, features) = frame(right, 100);
                outcome = builder.add(&markers, &features, &GEOMETRY);
            }
            (
                builder.spread(),
                outcome.unwrap().map(|rest| left_of(&rest)),
            )
        };
        let (small, taken) = spread(0.2, false);
        assert!((small.0 - 6_554).abs() <= 256, "{small:?}: 0.1 px");
        assert!(taken.is_ok());
        let (large, refused) = spread(4.0, false);
        let two = Px::from_int(2);
        assert_eq!((large, refused), (two, Err(Refusal::Unsteady)));
        assert_eq!(spread(4.0, true), (two, Ok(two)));
    }

    #[test]
    fn as_many_touched_frames_as_good_ones_are_wanted_end_it() {
        let mut builder = TareBuilder::new(2).unwrap();
        assert_eq!(builder.saw_touch(), None);
        let [first, last] = [3_000, 4_000].map(MicroNewtons);
        assert_eq!(builder.add_touched(first), None);
        assert_eq!(builder.saw_touch(), Some(first));
        assert_eq!(builder.add_touched(last), Some(Refusal::Touched(last)));
    }

    #[test]
    fn a_pressed_film_is_not_at_rest() {
        let (markers, _) = frame(Px(0), 100);
        let pressed = markers.map(|marker| Marker {
            x: Px((marker.x.0 - (160 << 16)) / 5 * 6 + (160 << 16)),
            y: Px((marker.y.0 - (120 << 16)) / 5 * 6 + (120 << 16)),
            ..marker
        });
        let features = Features::of_markers(&pressed);
        let mut builder = TareBuilder::new(1).unwrap();
        let refused = builder.add(&pressed, &features, &GEOMETRY);
        assert_eq!(refused, Some(Err(Refusal::NotAtRest)));
    }

    #[test]
    fn as_many_implausible_frames_as_good_ones_are_wanted_end_it() {
        let mut builder = TareBuilder::new(3).unwrap();
        assert!(!builder.saw_implausible());
        assert_eq!(builder.add_implausible(), None);
        assert_eq!(builder.add_implausible(), None);
        assert!(builder.saw_implausible());
        let refused = builder.add_implausible();
        assert_eq!(refused, Some(Refusal::MarkersImplausible));
    }

    #[test]
    fn the_largest_sums_fit() {
        let largest = Features {
            centroids: [(Px(i32::MAX), Px(i32::MAX)); 4].into(),
            rect_center: (Px(i32::MAX), Px(i32::MAX)),
            rect_area: Q::from_int(800 * 800),
        };
        let markers = [Marker {
            x: Px(0),
            y: Px(0),
            area: u32::MAX,
        }; 4];
        let mut builder = TareBuilder::new(MAX_FRAMES).unwrap();
        (0..MAX_FRAMES).for_each(|_| builder.take(&markers, &largest));
        let rest = builder.mean();
        assert_eq!((rest.features, rest.areas), (largest, [u32::MAX; 4].into()));
        let mut builder = TareBuilder::new(MAX_FRAMES).unwrap();
        let least = Features::from_array([Q::from_bits(i64::from(i32::MIN)); FEATURES]);
        builder.take(&markers, &least);
        (1..MAX_FRAMES).for_each(|_| builder.take(&markers, &largest));
        assert!(!builder.is_steady());
    }
}
