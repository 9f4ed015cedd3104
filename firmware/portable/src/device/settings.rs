//! The settings in use, as the host sees them, and rest positions as they go to a host and come
//! back.

use hivtac_sensor::force::forward::CameraMotion;
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::markers::tables::Table;
use hivtac_sensor::pipeline::Sensor;
use hivtac_terms::angle::atan2;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::down::{Direction, Down};
use hivtac_terms::fixed::Q;
use hivtac_terms::marker::Marker;
use hivtac_terms::root::root;
use hivtac_terms::temporal::TemporalSettings;
use hivtac_terms::threshold::Threshold;
use hivtac_terms::units::{MilliPx, Px};
use hivtac_wire::message::{ModelIdentity, ModelSource, Outcome};
use hivtac_wire::settings::{Moved, Name, RestPosition, TareReport};

/// The pipeline's settings.
#[derive(Clone)]
pub struct OfPipeline {
    /// Its settings.
    pub settings: Settings,
    /// Its rest position as it was taken, and gravity then; `None` without a rest position.
    pub tare: Option<(Rest, Option<Direction>)>,
    /// Distance by which re-zeroing has moved it.
    pub rezeroed: Px,
    /// Distance from the rest position at which the untouched film was last seen.
    pub seen: Option<MilliPx>,
    /// How it follows forces from frame to frame.
    pub temporal: TemporalSettings,
    /// Its model; `None` without one.
    pub model: Option<ModelIdentity>,
}

impl OfPipeline {
    /// The settings of a sensor, with the source of its model.
    pub fn of<const BLOBS: usize, T: Table>(
        sensor: &Sensor<'_, BLOBS, T>,
        source: ModelSource,
    ) -> Self {
        let model = sensor.model().map(|model| ModelIdentity {
            crc: model.crc(),
            name: model.name(),
            markers: model.rest.areas.len() as u8,
            simulated: model.is_simulated(),
            threshold: model.conditions.threshold,
            source,
        });
        Self {
            settings: *sensor.settings(),
            tare: sensor.taken().map(|rest| (*rest, sensor.down_when_taken())),
            rezeroed: sensor.rezeroed(),
            seen: sensor.rest_seen(),
            temporal: *sensor.temporal(),
            model,
        }
    }
}

/// All settings that can be kept.
pub struct InUse {
    /// The device's name.
    pub name: Name,
    /// The threshold.
    pub threshold: Threshold,
    /// The rest position as it was taken; `None` without one.
    pub tare: Option<RestPosition>,
    /// Distance by which re-zeroing has moved it.
    pub rezeroed: Px,
    /// Distance from the rest position at which the untouched film was last seen.
    pub seen: Option<MilliPx>,
    /// How forces are followed from frame to frame.
    pub temporal: TemporalSettings,
    /// The known direction of gravity.
    pub down: Down,
    /// The shape of what presses.
    pub contact_shape: ContactShape,
    /// The threshold of the model.
    of_model: Option<Threshold>,
}

impl InUse {
    /// The settings of the pipeline, with those that are kept outside it.
    pub fn of(pipeline: OfPipeline, name: Name, down: Down, contact_shape: ContactShape) -> Self {
        let OfPipeline {
            settings,
            tare,
            rezeroed,
            seen,
            temporal,
            model,
        } = pipeline;
        Self {
            name,
            threshold: settings.threshold,
            tare: tare.map(|(rest, down)| position(&rest, down, &settings)),
            down,
            contact_shape,
            rezeroed,
            seen,
            temporal,
            of_model: model.map(|model| model.threshold),
        }
    }

    /// Returns the threshold; `None` if it is the model's.
    pub fn own_threshold(&self) -> Option<Threshold> {
        Some(self.threshold).filter(|_| Some(self.threshold) != self.of_model)
    }
}

/// Returns this gravity, or unknown if it is not a valid direction.
pub fn known(down: Down) -> Down {
    let is_sound = down.direction().is_none_or(Direction::is_sound);
    if is_sound { down } else { Down::Unknown }
}

/// Returns a rest position with gravity when it was taken, and the settings with which its markers
/// were found.
pub fn position(rest: &Rest, down: Option<Direction>, settings: &Settings) -> RestPosition {
    RestPosition {
        format: settings.threshold.format(),
        dilations: settings.dilations,
        centroid: settings.centroid,
        markers: rest.markers(),
        rect_center: rest.features.rect_center,
        rect_area: rest.features.rect_area,
        down,
    }
}

/// Returns the report of a tare whose result is `rest`; the sensor still has the previous rest
/// position.
pub fn tared<const BLOBS: usize, T: Table>(
    rest: &Rest,
    sensor: &Sensor<'_, BLOBS, T>,
    spread: Px,
) -> TareReport {
    let before = sensor.tare();
    TareReport {
        rest: position(rest, sensor.down().direction(), sensor.settings()),
        spread,
        moved: before.map(|before| moved(before, rest)),
    }
}

/// Returns the motion from one rest position to another.
fn moved(before: &Rest, now: &Rest) -> Moved {
    let px = |px: f32| Px((65_536.0 * px) as i32);
    let motion = CameraMotion::between(before, now);
    let [x, y] = motion.shift_px;
    // The parts are of the order of one, unless all markers are in one place.
    let [along, across] = motion.back.map(|part| (part * (1 << 24) as f32) as i64);
    Moved {
        farthest: farthest(&before.markers(), &now.markers()),
        shift: (px(x), px(y)),
        turn: atan2(-across, along),
        larger: Q::from_bits((65_536.0 * (motion.times() - 1.0)) as i32),
        beside: px(motion.beside_px),
    }
}

/// Returns the distance between two rest positions; `None` if their markers were found differently.
pub fn drift(one: &RestPosition, other: &RestPosition) -> Option<Px> {
    let seen = |rest: &RestPosition| (rest.format, rest.dilations, rest.centroid);
    (seen(one) == seen(other)).then(|| farthest(&one.markers, &other.markers))
}

/// Returns the largest distance between corresponding markers.
fn farthest(one: &[Marker], other: &[Marker]) -> Px {
    let distance = |(one, other): (&Marker, &Marker)| {
        let [x, y] = [one.x.0.abs_diff(other.x.0), one.y.0.abs_diff(other.y.0)];
        // Inside a picture, both are below 2²⁶.
        let squares = [x, y].map(|side| u64::from(side) * u64::from(side));
        root(squares[0].saturating_add(squares[1]))
    };
    let largest = one.iter().zip(other).map(distance).max().unwrap_or(0);
    Px(largest.min(i32::MAX as u32) as i32)
}

/// Returns the rest position for the frames and the model of a sensor.
///
/// # Errors
/// Why it is not valid for them.
pub fn rest<const BLOBS: usize, T: Table>(
    position: &RestPosition,
    sensor: &Sensor<'_, BLOBS, T>,
) -> Result<Rest, Outcome> {
    let settings = sensor.settings();
    let markers = sensor.model().map(|model| model.rest.areas.len());
    let is_of_layout = markers.is_none_or(|markers| markers == position.markers.len());
    let seen_so = position.format == settings.threshold.format()
        && position.dilations == settings.dilations
        && position.centroid == settings.centroid;
    let mut rest = Rest::of_markers(&position.markers);
    rest.features.rect_center = position.rect_center;
    rest.features.rect_area = position.rect_area;
    if !seen_so
        || !is_of_layout
        || !rest.is_sound()
        || !position.down.is_none_or(Direction::is_sound)
    {
        Err(Outcome::InvalidArgument)
    } else if !rest.fits(&settings.geometry) {
        Err(Outcome::NotAtRest)
    } else {
        Ok(rest)
    }
}
