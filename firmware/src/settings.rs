//! Holds the settings in use, as the host sees them and as they are kept. The pipeline publishes
//! them, the USB tasks read them.

use crate::dtcm_table::Sensor;
use core::cell::Cell;
use embassy_sync::blocking_mutex::CriticalSectionMutex;
use hivtac_sensor::force::forward::CameraMotion;
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::markers::settings::Settings;
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

/// The pipeline's settings; `None` before it is configured. Written at boot and by the pipeline;
/// read by the USB tasks and the memory task.
static PIPELINE: CriticalSectionMutex<Cell<Option<OfPipeline>>> =
    CriticalSectionMutex::new(Cell::new(None));

/// The device's name. Written at boot and by the USB tasks; read by them and the memory task.
static NAME: CriticalSectionMutex<Cell<Name>> = CriticalSectionMutex::new(Cell::new(Name::new()));

/// The known direction of gravity. Written at boot, by the USB tasks, and by the memory task on a
/// reset to a new device's settings. Read by the memory task and, before each frame, by the
/// pipeline.
static DOWN: CriticalSectionMutex<Cell<Down>> = CriticalSectionMutex::new(Cell::new(Down::Fixed));

/// The shape of what presses. Written at boot, by the USB tasks, and by the memory task on a reset
/// to a new device's settings. Read by the memory task and, before each frame, by the pipeline.
static CONTACT_SHAPE: CriticalSectionMutex<Cell<ContactShape>> =
    CriticalSectionMutex::new(Cell::new(ContactShape::Unknown));

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

/// Publishes the pipeline's settings, with the source of its model.
pub fn follow(sensor: &Sensor, source: ModelSource) {
    let model = sensor.model().map(|model| ModelIdentity {
        crc: model.crc(),
        name: model.name(),
        simulated: model.is_simulated(),
        threshold: model.conditions.threshold,
        source,
    });
    let told = OfPipeline {
        settings: *sensor.settings(),
        tare: sensor.taken().map(|rest| (*rest, sensor.down_when_taken())),
        rezeroed: sensor.rezeroed(),
        seen: sensor.rest_seen(),
        temporal: *sensor.temporal(),
        model,
    };
    PIPELINE.lock(|cell| cell.set(Some(told)));
}

/// Returns the pipeline's settings; `None` before it is configured.
pub fn of_pipeline() -> Option<OfPipeline> {
    PIPELINE.lock(copy)
}

/// Sets the device's name.
pub fn set_name(name: Name) {
    NAME.lock(|cell| cell.set(name));
}

/// The device's name.
pub fn name() -> Name {
    NAME.lock(copy)
}

/// Sets the direction of gravity from the next frame on: unknown if it is not a valid direction.
pub fn set_down(down: Down) {
    let is_sound = down.told().is_none_or(Direction::is_sound);
    let known = if is_sound { down } else { Down::Unknown };
    DOWN.lock(|cell| cell.set(known));
}

/// Returns the known direction of gravity.
pub fn down() -> Down {
    DOWN.lock(Cell::get)
}

/// Sets the shape of what presses, from the next frame on.
///
/// # Errors
/// [`Outcome::InvalidArgument`] if its radius is out of range; then nothing changes.
pub fn set_contact_shape(shape: ContactShape) -> Result<(), Outcome> {
    if !shape.is_sound() {
        return Err(Outcome::InvalidArgument);
    }
    CONTACT_SHAPE.lock(|cell| cell.set(shape));
    Ok(())
}

/// Returns the shape of what presses.
pub fn contact_shape() -> ContactShape {
    CONTACT_SHAPE.lock(Cell::get)
}

fn copy<T: Clone + Default>(cell: &Cell<T>) -> T {
    let value = cell.take();
    cell.set(value.clone());
    value
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
    /// Returns the threshold; `None` if it is the model's.
    pub fn own_threshold(&self) -> Option<Threshold> {
        Some(self.threshold).filter(|_| Some(self.threshold) != self.of_model)
    }
}

/// Returns the settings in use; `None` before the pipeline is configured.
pub fn in_use() -> Option<InUse> {
    let OfPipeline {
        settings,
        tare,
        rezeroed,
        seen,
        temporal,
        model,
    } = of_pipeline()?;
    Some(InUse {
        name: name(),
        threshold: settings.threshold,
        tare: tare.map(|(rest, down)| position(&rest, down, &settings)),
        down: down(),
        contact_shape: contact_shape(),
        rezeroed,
        seen,
        temporal,
        of_model: model.map(|model| model.threshold),
    })
}

/// Returns a rest position with gravity when it was taken, and the settings with which its markers
/// were found.
pub fn position(rest: &Rest, down: Option<Direction>, settings: &Settings) -> RestPosition {
    RestPosition {
        format: settings.threshold.format(),
        dilations: settings.dilations,
        centroid: settings.centroid,
        markers: rest.markers().array(),
        rect_center: rest.features.rect_center,
        rect_area: rest.features.rect_area,
        down,
    }
}

/// Returns the report of a tare whose result is `rest`; the sensor still has the previous rest
/// position.
pub fn tared(rest: &Rest, sensor: &Sensor, spread: Px) -> TareReport {
    let before = sensor.tare();
    TareReport {
        rest: position(rest, sensor.down().told(), sensor.settings()),
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

/// Returns the rest position for frames with these settings.
///
/// # Errors
/// Why it is not valid for them.
pub fn rest(position: &RestPosition, settings: &Settings) -> Result<Rest, Outcome> {
    let seen_so = position.format == settings.threshold.format()
        && position.dilations == settings.dilations
        && position.centroid == settings.centroid;
    let mut rest = Rest::of_markers(&position.markers);
    rest.features.rect_center = position.rect_center;
    rest.features.rect_area = position.rect_area;
    if !seen_so || !rest.is_sound() || !position.down.is_none_or(Direction::is_sound) {
        Err(Outcome::InvalidArgument)
    } else if !rest.fits(&settings.geometry) {
        Err(Outcome::NotAtRest)
    } else {
        Ok(rest)
    }
}
