//! Computes the force that explains the markers best, by the forward model.

use super::{Force, FrameNoise, Place, Polar, trust};
use crate::force::forward::{
    Column, Drift, Estimate, Forward, Hanging, MOST_DOTS, Markers, Mounting, Noise, Observed, Pose,
    Sigma, Start, Turned, centre_mm,
};
use crate::force::model::{CalibratedRange, LARGEST_PLACE_UNCERTAINTY, Model, NO_DIRECTION};
use crate::force::network::Output;
use crate::force::rest::Rest;
use crate::markers::lost::Lost;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::list::List;
use hivtac_terms::marker::Marker;
use hivtac_terms::status::Status;
use hivtac_terms::units::{
    MicroNewtons, Micrometres, Px, SignedMicrometres, UnsignedMicroNewtons, UnsignedMilliDegrees,
};

/// A unit's rest position, with the values derived from it before the first frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Resting {
    pub(super) mounting: Mounting,
    /// True for the unit that the model was made on.
    pub(super) is_own: bool,
    px: Markers,
    areas: List<f32, MOST_DOTS>,
    /// How far the film may rest from this; `None` if there is no difference.
    drift: Option<Drift>,
    /// The effect of the film's own weight; `None` if the tables and the rest position include it.
    hanging: Option<Hanging>,
    pub(super) shape: ContactShape,
}

/// Largest usual residual of markers that are known less well, relative to its variance. Their
/// uncertainty is stated for the worst of them, which are few: at a fifth of the light, 1 of 1,000
/// frames exceeds this.
const UNEXPLAINED_BLURRED: f32 = 5.0;
/// Largest standard uncertainties of a force that is still of use: of the direction, m°; of |F|, in
/// parts of it; and of the place, µm.
const OF_USE: (u32, u32, u32) = (10_000, 5, 1_500);
/// A contact of unknown or wide shape this near to a marker, mm, moves it in ways that the tables
/// of shapes do not have. The uncertainties of direction, |F| and place grow by these factors.
/// Chosen on presses near markers (`hivtac-studies contacts --near-dots --seed 11`).
const BESIDE_MM: f32 = 2.0;
const BESIDE: [u32; 3] = [3, 4, 3];
/// The same for a layout without a table of shapes or of widths, wherever it is pressed. Chosen on
/// presses of the layout `8v` before it had one.
const WITHOUT_TABLE: [u32; 3] = [3, 3, 2];
/// A model that does not say how other units' films differ has too small uncertainties on them: by
/// these factors. Chosen on six units with the layout `8v` and a tare alone.
const OF_OTHER_UNITS: [u32; 3] = [3, 1, 1];
/// Where the search for a light touch begins, as a fraction of the largest size.
const FIRST_SIZE: f32 = 0.1;
/// How exactly units are built, as standard deviations. `GLUED_MM`: a marker's place along each
/// axis, mm. `BUILT`: any shift and turn of the camera; focal length and distance from the film as
/// a fraction of the pattern's radius.
const GLUED_MM: f32 = 0.15;
const BUILT: Drift = Drift {
    unseen: [0.1, 0.1, 0.025],
    ..Drift::NONE
};
/// Areas, relative to the area at rest, between which a marker's noise is known.
const AREAS: [f32; 2] = [0.5, 6.0];

impl Resting {
    /// Takes a model that takes steps, and the rest position of the markers. The film's weight
    /// needs no correction: gravity is as it was when the rest position was taken. Returns `None`
    /// if the model takes no steps, or has another number of markers.
    pub fn of_model(model: &Model<'_>, rest: &Rest) -> Option<Resting> {
        Resting::of_turned(model, rest, None)
    }

    /// As [`Resting::of_model`], for a sensor that was turned since; `rest` is under today's
    /// gravity.
    pub fn of_turned(model: &Model<'_>, rest: &Rest, turned: Option<Turned>) -> Option<Resting> {
        let forward = model.forward.as_ref().filter(|forward| forward.steps > 0)?;
        if forward.tables.dots() != rest.areas.len() {
            return None;
        }
        let flat = turned.map_or(*rest, |turned| forward.as_made(rest, turned));
        let mut resting = Resting::new(forward, rest, &flat, &model.rest, !model.is_simulated());
        resting.hanging = turned.and_then(|turned| forward.hanging(turned, resting.is_own));
        Some(resting)
    }

    /// Sets the shape of what presses. Initially it is the tip of the model's tables.
    pub fn set_contact_shape(&mut self, shape: ContactShape) {
        self.shape = shape;
    }

    /// Sets how far the film may rest from this rest position.
    pub fn set_drift(&mut self, drift: &Drift) {
        self.drift = Some(*drift).filter(|drift| *drift != Drift::NONE);
    }

    /// For markers that rest at `rest`, and at `flat` under the gravity of the model's film. For
    /// the unit that the model was made on, the mounting comes from the model; for any other unit,
    /// from its rest picture. The camera of a calibrated unit may have been mounted anew.
    fn new(
        forward: &Forward<'_>,
        rest: &Rest,
        flat: &Rest,
        own: &Rest,
        is_calibrated: bool,
    ) -> Resting {
        let of_rest = forward.rest_image.mounting(flat);
        let near = own.is_near(&flat.features);
        // The tables already include how this unit's markers are glued.
        let known = Mounting {
            per_px: forward.per_px.unwrap_or(of_rest.per_px),
            beside_mm: Markers::defaults(of_rest.beside_mm.len()),
        };
        let own = match near {
            true => Some(known),
            false => known.remounted(flat, own).filter(|_| is_calibrated),
        };
        let is_own = own.is_some();
        let mounting = own.unwrap_or(of_rest);
        let centroids = &rest.features.centroids;
        let off = match near {
            true => forward.noise.rest_px,
            false => Markers::defaults(centroids.len()),
        };
        let pairs = centroids.iter().zip(off.iter());
        let px = pairs.map(|((x, y), off)| [x.to_f32() - off[0], y.to_f32() - off[1]]);
        Resting {
            mounting,
            is_own,
            px: List::of(px),
            areas: List::of(rest.areas.iter().map(|area| *area as f32)),
            drift: None,
            hanging: None,
            shape: ContactShape::Needle,
        }
    }

    /// Returns the force, µN, that the difference to another rest position of this unit looks like,
    /// and its standard uncertainty by noise. The camera may have moved in any way. Returns `None`
    /// if the model takes no steps.
    pub fn touch(
        model: &Model<'_>,
        rest: &Rest,
        turned: Option<Turned>,
        other: &Rest,
    ) -> Option<(MicroNewtons, UnsignedMicroNewtons)> {
        let noise = FrameNoise::AS_MODELLED;
        Self::touch_by(model, rest, turned, other, (&Drift::MOUNTED_ANEW, noise))
    }

    /// As [`Resting::touch`], for a unit built like the model's whose rest position under today's
    /// gravity is unknown.
    pub fn touch_of_unit(
        model: &Model<'_>,
        rest: &Rest,
        turned: Option<Turned>,
        other: &Rest,
    ) -> Option<(MicroNewtons, UnsignedMicroNewtons)> {
        let forward = model.forward.as_ref()?;
        let scale = forward.rest_image.mounting(&model.rest).scale();
        let [away, _] = *forward.rest_image.film_mm.first()?;
        let noise = FrameNoise {
            blur: Px((GLUED_MM / away / scale * 65_536.0) as i32),
            ..FrameNoise::AS_MODELLED
        };
        Self::touch_by(model, rest, turned, other, (&BUILT, noise))
    }

    fn touch_by(
        model: &Model<'_>,
        rest: &Rest,
        turned: Option<Turned>,
        other: &Rest,
        (drift, noise): (&Drift, FrameNoise),
    ) -> Option<(MicroNewtons, UnsignedMicroNewtons)> {
        let forward = model.forward.as_ref()?;
        let mut resting = Resting::of_turned(model, rest, turned)?;
        resting.set_drift(drift);
        let observed = resting.observed(forward, &other.markers(), noise);
        let guess = Pose {
            size: FIRST_SIZE * forward.limits.size,
            place_mm: forward.rest_image.where_most(&observed.moved),
            ..Pose::default()
        };
        let unknown = forward.unknown(resting.is_own);
        let estimate = forward.estimate(&observed, &resting.mounting, unknown, Start::Near(guess));
        let (force, by_noise) = force(forward, resting.is_own, &estimate);
        Some((force.magnitude, by_noise))
    }

    /// How the markers moved from rest. Compiled once, because the near memory is scarce.
    #[inline(never)]
    pub(super) fn observed<'a>(
        &'a self,
        forward: &Forward<'a>,
        markers: &[Marker],
        frame: FrameNoise,
    ) -> Observed<'a> {
        let (mut moved, mut noise) = (Column::defaults(2 * self.px.len()), List::default());
        let scale = self.mounting.scale();
        let parts = [frame.blur, frame.motion, frame.beside].map(|px| scale * px.to_f32());
        let blurred: f32 = parts.iter().map(|part| part * part).sum();
        let at_rest = self.px.iter().zip(self.areas.iter());
        let pairs = markers.iter().zip(at_rest).zip(moved.as_chunks_mut().0);
        for (k, ((marker, ([x, y], area)), moved)) in pairs.enumerate() {
            let [x, y] = [marker.x.to_f32() - x, marker.y.to_f32() - y];
            *moved = self.mounting.moved([x, y]);
            let larger = (marker.area as f32 / area).clamp(AREAS[0], AREAS[1]);
            let Noise {
                at_rest_px,
                at_four_areas,
                ..
            } = &forward.noise;
            let [away, across] = *at_rest_px;
            let [more_away, more_across] = *at_four_areas;
            let variances = [(away, more_away), (across, more_across)].map(|(at_rest, more)| {
                let growth = 1.0 + (more - 1.0) * (larger - 1.0) / 3.0;
                // Limited from below: a law that falls to 0 within the areas would make a marker
                // certain.
                let seen = frame.times * scale * at_rest * growth.max(0.1);
                seen * seen + blurred
            });
            noise.push(forward.rest_image.noise(k, variances));
        }
        let drift = self.drift.as_ref().map(|drift| (drift, &self.px));
        let hanging = self.hanging.as_ref();
        Observed {
            moved,
            noise,
            lost: Lost::NONE,
            drift,
            hanging,
            pressing: (forward.shapes).and_then(|shapes| shapes.pressing(self.shape)),
            wide: (forward.widths).and_then(|widths| widths.pressing(self.shape)),
            turning: forward.torques.map(|torques| torques.of(self.shape)),
        }
    }

    /// Returns the load that explains the markers best. The steps begin at the network's answer.
    pub fn estimate(
        &self,
        forward: &Forward<'_>,
        markers: &[Marker],
        noise: FrameNoise,
        output: &Output,
    ) -> Estimate {
        let newtons = output.values.map(|part| part as f32 * 1e-6);
        let place_mm = output.place.map(|part| part as f32 * 1e-3);
        let guess = Pose::of_force(newtons, place_mm, &forward.stiffness, &forward.limits);
        let observed = self.observed(forward, markers, noise);
        forward.estimate(
            &observed,
            &self.mounting,
            forward.unknown(self.is_own),
            Start::Near(guess),
        )
    }

    /// Returns the load that explains three markers best, and where marker `lost` (0–3) is seen
    /// under this load, px.
    pub fn estimate_of_three(
        &self,
        forward: &Forward<'_>,
        markers: &[Marker],
        lost: usize,
        noise: FrameNoise,
    ) -> (Estimate, (Px, Px)) {
        let observed = self.observed(forward, markers, noise);
        let unknown = forward.unknown(self.is_own);
        let (estimate, moved) = forward.estimate_of_three(observed, lost, &self.mounting, unknown);
        let [x, y] = self.mounting.px(moved);
        let [rest_x, rest_y] = self.px.get(lost).copied().unwrap_or_default();
        (estimate, (Px::of_f32(rest_x + x), Px::of_f32(rest_y + y)))
    }

    /// Returns the load that explains the markers but the lost ones best. The steps begin at
    /// `start`. A torque that is a last resort counts if it `may_turn`.
    pub fn estimate_without(
        &self,
        forward: &Forward<'_>,
        (markers, lost): (&[Marker], Lost),
        noise: FrameNoise,
        (start, may_turn): (Start, bool),
    ) -> Estimate {
        let mut observed = self.observed(forward, markers, noise);
        let turning = observed.turning;
        observed.turning = turning.filter(|turning| may_turn || !turning.is_last_resort);
        observed.lost = lost;
        lost.clear(&mut observed.moved);
        forward.estimate(
            &observed,
            &self.mounting,
            forward.unknown(self.is_own),
            start,
        )
    }

    /// Returns whether a force that one contact explains badly may be given. The contact must not
    /// be known to be a needle, whose residual shows a fault. And the uncertainties, widened by the
    /// residual, must be of use.
    fn may_be_loose(&self, force: &Force) -> bool {
        let (direction, magnitude, place) = OF_USE;
        self.shape != ContactShape::Needle
            && force.direction_sigma.0 <= direction
            && force.magnitude_sigma.0 <= force.magnitude.0.unsigned_abs() / magnitude
            && force.place.is_some_and(|at| at.sigma.0 <= place)
    }

    /// Whether a contact that need not be a needle is so near to a marker that it moves it in ways
    /// that the tables of shapes do not have.
    fn is_beside_a_marker(&self, forward: &Forward<'_>, estimate: &Estimate) -> bool {
        let place_mm = estimate.pose.place_mm;
        let mut distances = forward.rest_image.squared_distances_mm(place_mm);
        self.shape != ContactShape::Needle && distances.any(|square| square < BESIDE_MM * BESIDE_MM)
    }

    /// Returns the force of a load that was found in a frame of this noise, and its status. If the
    /// load explains the markers badly, its uncertainties are widened and the status is
    /// [`Status::LOOSELY_EXPLAINED`]. It is [`Status::UNEXPLAINED`] if that is not
    /// [allowed](Self::may_be_loose), or the load is the largest in the tables.
    pub fn force_and_status(
        &self,
        forward: &Forward<'_>,
        range: &CalibratedRange,
        noise: FrameNoise,
        estimate: &Estimate,
    ) -> (Force, Status) {
        let (mut force, by_noise) = force(forward, self.is_own, estimate);
        let has_widths = forward.widths.is_some();
        if !has_widths && self.is_beside_a_marker(forward, estimate) {
            widen(&mut force, BESIDE);
        }
        if self.shape != ContactShape::Needle && forward.shapes.is_none() && !has_widths {
            widen(&mut force, WITHOUT_TABLE);
        }
        if !self.is_own && forward.other.is_none() {
            widen(&mut force, OF_OTHER_UNITS);
        }
        let mut status = trust(&force, by_noise, range);
        if noise.is_disturbed() {
            status |= Status::FRAME_DISTURBED;
        }
        let is_uncertain = noise.blur.0 > 0 || noise.beside.0 > 0;
        let is_blurred = is_uncertain && estimate.unexplained > UNEXPLAINED_BLURRED;
        if is_blurred || !estimate.is_explained() && !self.may_be_loose(&force) {
            status |= Status::UNEXPLAINED;
        } else if !estimate.is_explained() {
            status |= Status::LOOSELY_EXPLAINED;
        }
        // Where the tables end, a larger force may explain the markers better.
        if estimate.pose.size >= forward.limits.size {
            status |= Status::MAGNITUDE_OUT_OF_RANGE | Status::UNEXPLAINED;
        }
        // A load that does not explain the markers is no evidence of a contact.
        if status.contains(Status::UNEXPLAINED) {
            status.0 &= !(Status::CONTACT | Status::LOOSELY_EXPLAINED).0;
        }
        (force, status)
    }

    /// [`Self::estimate`] and [`Self::force_and_status`] in one, for a frame whose noise is as
    /// modelled.
    pub fn force(
        &self,
        forward: &Forward<'_>,
        range: &CalibratedRange,
        markers: &[Marker],
        output: &Output,
    ) -> (Force, Status) {
        let noise = FrameNoise::AS_MODELLED;
        let estimate = self.estimate(forward, markers, noise, output);
        self.force_and_status(forward, range, noise, &estimate)
    }
}

/// Multiplies the standard uncertainties of direction, |F| and place.
fn widen(force: &mut Force, [direction, magnitude, place]: [u32; 3]) {
    let sigma = &mut force.direction_sigma.0;
    *sigma = sigma.saturating_mul(direction).min(NO_DIRECTION.0);
    let sigma = &mut force.magnitude_sigma.0;
    *sigma = sigma.saturating_mul(magnitude);
    if let Some(at) = &mut force.place {
        let sigma = at.sigma.0.saturating_mul(place);
        at.sigma.0 = sigma.min(LARGEST_PLACE_UNCERTAINTY.0);
    }
}

/// Returns the force of a load, and the standard uncertainty of |F| by noise.
fn force(
    forward: &Forward<'_>,
    is_own: bool,
    estimate: &Estimate,
) -> (Force, UnsignedMicroNewtons) {
    let (pose, strength) = (&estimate.pose, forward.strength(is_own));
    let micronewtons = 1e6 * strength.stiffness.magnitude_n(pose.size);
    let cartesian = pose
        .direction()
        .map(|part| MicroNewtons(rounded(micronewtons * part)));
    let place_mm = centre_mm(pose, &forward.limits);
    let (force, by_noise) = of_vector(cartesian, place_mm, estimate.sigma(&strength));
    let torque = estimate.torque(micronewtons);
    (Force { torque, ..force }, by_noise)
}

/// Returns the force of a vector at a place, mm, and the standard uncertainty of |F| by noise.
#[inline(always)]
pub(super) fn of_vector(
    cartesian: [MicroNewtons; 3],
    place_mm: [f32; 2],
    sigma: Option<Sigma>,
) -> (Force, UnsignedMicroNewtons) {
    let Polar {
        alpha,
        beta,
        magnitude,
    } = Polar::of_vector(cartesian);
    let [direction, magnitude_sigma, place, by_noise] = stated(sigma);
    let [x, y] = place_mm.map(|part| SignedMicrometres(rounded(1e3 * part)));
    let force = Force {
        alpha,
        beta,
        magnitude,
        cartesian,
        direction_sigma: UnsignedMilliDegrees(direction),
        magnitude_sigma: UnsignedMicroNewtons(magnitude_sigma),
        place: Some(Place {
            x,
            y,
            sigma: Micrometres(place),
        }),
        torque: None,
    };
    (force, UnsignedMicroNewtons(by_noise))
}

/// Returns the uncertainties of direction, |F|, place and |F| by noise, in m°, µN, µm and µN; each
/// at least 1.
fn stated(sigma: Option<Sigma>) -> [u32; 4] {
    let Some(sigma) = sigma else {
        let nothing = i32::MAX as u32;
        return [
            NO_DIRECTION.0,
            nothing,
            LARGEST_PLACE_UNCERTAINTY.0,
            nothing,
        ];
    };
    let direction = (sigma.direction.to_degrees() * 1e3).min(NO_DIRECTION.0 as f32);
    let place = (sigma.place_mm * 1e3).min(LARGEST_PLACE_UNCERTAINTY.0 as f32);
    let [magnitude, by_noise] = [sigma.magnitude_n, sigma.by_noise_n].map(|part| 1e6 * part);
    [direction, magnitude, place, by_noise].map(|part| rounded(part).max(1).unsigned_abs())
}

/// Rounds to nearest; saturates at the limits of 32 bits.
pub(super) fn rounded(value: f32) -> i32 {
    (value + 0.5f32.copysign(value)) as i32
}
