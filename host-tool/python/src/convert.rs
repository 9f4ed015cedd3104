//! Converts a device's messages to tuples and dictionaries in SI units.

use hivtac_host::force_fields::{FORCE, PLACE, TORQUE};
use hivtac_host::shown::{shown, unit_number};
use hivtac_terms::force::Force;
use hivtac_terms::marker::Marker;
use hivtac_terms::units::{MilliPx, Px};
use hivtac_wire::message::{DeviceHello, Sample};
use hivtac_wire::settings::{Moved, SettingsReport, TareReport};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Force, N; α, β, rad; |F|, N; standard uncertainties of the direction, rad, and of |F|, N; place,
/// m, and its standard uncertainty, m; torque about the normal and its standard uncertainty, N·m.
type ForceNumbers = (
    [f64; 3],
    [f64; 2],
    f64,
    f64,
    f64,
    Option<([f64; 2], f64)>,
    Option<(f64, f64)>,
);

/// Sequence, frame, device time, s, host times of arrival and exposure, s, status bits, names of
/// these, force, each contact, and column, row and area of each marker, px.
pub type SampleNumbers = (
    u32,
    u32,
    f64,
    f64,
    f64,
    u32,
    Vec<&'static str>,
    Option<ForceNumbers>,
    Vec<ForceNumbers>,
    Option<Vec<MarkerNumbers>>,
);

/// Column, row and area, px.
pub type MarkerNumbers = (f64, f64, u32);

/// A sample that was received at `came_ns` and exposed at `exposed_ns`, ns since 1970.
pub fn sample(sample: &Sample, came_ns: u64, exposed_ns: u64) -> SampleNumbers {
    (
        sample.sequence,
        sample.frame,
        sample.time_us as f64 / 1e6,
        came_ns as f64 / 1e9,
        exposed_ns as f64 / 1e9,
        sample.status.0,
        sample.status.names().collect(),
        sample.force.as_ref().map(force),
        sample.each_contact().iter().map(force).collect(),
        markers(sample),
    )
}

/// The markers of a sample; `None` if not all were found.
pub fn markers(sample: &Sample) -> Option<Vec<MarkerNumbers>> {
    let numbers = |marker: &Marker| (px(marker.x), px(marker.y), marker.area);
    let found = sample.found()?;
    Some(found.iter().map(numbers).collect())
}

fn force(force: &Force) -> ForceNumbers {
    let [alpha, beta, size, x, y, z, angle_sigma, size_sigma] = FORCE.map(|it| it.si(force));
    let place = force.place.as_ref().map(|place| {
        let [x, y, sigma] = PLACE.map(|it| it.si(place));
        ([x, y], sigma)
    });
    let torque = (force.torque.as_ref()).map(|torque| TORQUE.map(|it| it.si(torque)).into());
    let (vector, angles) = ([x, y, z], [alpha, beta]);
    (vector, angles, size, angle_sigma, size_sigma, place, torque)
}

/// The device's identity.
pub fn hello<'py>(py: Python<'py>, hello: &DeviceHello) -> PyResult<Bound<'py, PyDict>> {
    let fields = PyDict::new(py);
    fields.set_item("serial", unit_number(&hello.device_id))?;
    fields.set_item("name", shown(&hello.name))?;
    fields.set_item("board", shown(&hello.board))?;
    fields.set_item("firmware", shown(&hello.firmware))?;
    let model = hello.model.as_ref();
    fields.set_item("model", model.map(|model| shown(&model.name)))?;
    fields.set_item("width", hello.width)?;
    fields.set_item("height", hello.height)?;
    Ok(fields)
}

/// Largest motion of a marker, px; motion of the markers' middle, px; turn, rad; relative growth of
/// the pattern; largest coordinate of the unexplained motion, px.
type MovedNumbers = (f64, (f64, f64), f64, f64, f64);

/// Markers at rest, px; their motion during the tare, px; motion from the rest position before.
pub type TareNumbers = (Vec<(f64, f64)>, f64, Option<MovedNumbers>);

/// Whether a rest position was taken, and whether it is kept. Then distances in px: by re-zeroing,
/// last one of the untouched film, from the kept position.
pub type RestNumbers = (bool, bool, f64, Option<f64>, Option<f64>);

/// The result of a tare.
pub fn tare(report: &TareReport) -> TareNumbers {
    (
        (report.rest.markers.iter())
            .map(|marker| (px(marker.x), px(marker.y)))
            .collect(),
        px(report.spread),
        report.moved.as_ref().map(moved),
    )
}

fn moved(moved: &Moved) -> MovedNumbers {
    (
        px(moved.farthest),
        (px(moved.shift.0), px(moved.shift.1)),
        f64::from(moved.turn.0).to_radians() / 1e3,
        moved.larger.to_f64(),
        px(moved.beside),
    )
}

/// The state and changes of a rest position.
pub fn rest(report: &SettingsReport) -> RestNumbers {
    let is_taken = report.tare.is_some();
    (
        is_taken,
        is_taken && report.kept.tare,
        px(report.rezeroed),
        report.seen.map(MilliPx::to_f64),
        report.drift.map(px),
    )
}

fn px(px: Px) -> f64 {
    px.to_f64()
}
