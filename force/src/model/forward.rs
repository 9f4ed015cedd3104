//! What a model file holds of the film run forwards.

use super::{ModelError, reader::Reader};
use crate::forward::{
    Axis, Forward, KNOTS, Limits, MOST_STEPS, Markers, Mounting, NODES, Noise, PARTS, RestImage,
    Stiffness, SystematicGrid, Table, Tables, Terms, Tolerance,
};
#[cfg(any(test, feature = "encode"))]
use alloc::vec::Vec;

/// Outputs of the three tables.
const MOVED: usize = 1;
const BESIDE: usize = 2;
const OWN: usize = 8;

impl<'a> Forward<'a> {
    /// Reads the section of a model file alone.
    ///
    /// # Errors
    /// As [`Model::parse`](super::Model::parse).
    pub fn parse(bytes: &'a [u8]) -> Result<Forward<'a>, ModelError> {
        forward(&mut Reader { bytes, offset: 0 })
    }
}

/// Reads the section.
pub(super) fn forward<'a>(reader: &mut Reader<'a>) -> Result<Forward<'a>, ModelError> {
    let steps = reader.u8_in("steps", MOST_STEPS, "0 to 3")?;
    let has_mounting = reader.choice("mounting", &[false, true], "0 or 1")?;
    let has_own = reader.choice("own table", &[false, true], "0 or 1")?;
    reader.zero("reserved byte")?;
    let limits = Limits {
        size: float(reader, "largest size", [1e-3, 10.0], "0.001 to 10")?,
        tilt: float(reader, "largest tilt", [1e-2, 1.0], "0.01 to 1 rad")?,
    };
    let stiffness = Stiffness {
        linear_n: float(reader, "stiffness", [1e-6, 1e3], "0.000001 to 1000 N")?,
        cubic_n: float(reader, "stiffness", [1e-6, 1e3], "0.000001 to 1000 N")?,
    };
    let rest_image = RestImage {
        corner: float(reader, "corner", [1e-2, 2.0], "0.01 to 2")?,
        film_mm: pair(reader, "film", [0.1, 1e3], "0.1 to 1000 mm")?,
    };
    let noise = Noise {
        rest_px: markers(reader, "rest", [-1.0, 1.0], "-1 to 1 px")?,
        at_rest_px: pair(reader, "noise", [1e-4, 10.0], "0.0001 to 10 px")?,
        at_four_areas: pair(reader, "noise", [0.1, 10.0], "0.1 to 10")?,
    };
    let other = tolerance(reader)?;
    let mounting = mounting(reader)?;
    let own = systematic(reader)?;
    let tables = Tables {
        moved: table(reader, MOVED)?,
        beside: table(reader, BESIDE)?,
        own: match has_own {
            true => Some(table(reader, OWN)?),
            false => None,
        },
    };
    Ok(Forward {
        steps,
        limits,
        stiffness,
        rest_image,
        mounting: has_mounting.then_some(mounting),
        noise,
        own,
        other,
        tables,
    })
}

fn tolerance(reader: &mut Reader<'_>) -> Result<Tolerance, ModelError> {
    Ok(Tolerance {
        shape: float(reader, "tolerance", [0.0, 1.0], "0 to 1")?,
        stiffness: float(reader, "tolerance", [0.0, 1.0], "0 to 1")?,
    })
}

fn systematic<'a>(reader: &mut Reader<'a>) -> Result<SystematicGrid<'a>, ModelError> {
    let offset = reader.offset;
    let end_mm = f32::from_le_bytes(reader.array()?);
    let mut steps = [0.0; PARTS];
    for step in &mut steps {
        *step = f32::from_le_bytes(reader.array()?);
    }
    let knots = reader.take(2 * PARTS * KNOTS)?;
    SystematicGrid::new(end_mm, steps, knots).ok_or(ModelError::Field {
        name: "systematic uncertainty",
        offset,
        allowed: "an end of 0.1 to 100 mm and steps of 0 to 1",
    })
}

fn mounting(reader: &mut Reader<'_>) -> Result<Mounting, ModelError> {
    let mut per_px = [0.0; 2];
    for part in &mut per_px {
        *part = float(reader, "focal lengths per px", [-1.0, 1.0], "-1 to 1")?;
    }
    Ok(Mounting {
        per_px,
        beside_mm: markers(reader, "glued beside", [-2.0, 2.0], "-2 to 2 mm")?,
    })
}

fn markers(
    reader: &mut Reader<'_>,
    name: &'static str,
    range: [f32; 2],
    allowed: &'static str,
) -> Result<Markers, ModelError> {
    let mut markers = Markers::default();
    for part in markers.as_flattened_mut() {
        *part = float(reader, name, range, allowed)?;
    }
    Ok(markers)
}

fn table<'a>(reader: &mut Reader<'a>, outputs: usize) -> Result<Table<'a>, ModelError> {
    let offset = reader.offset;
    let [count, sizes @ .., _] = reader.array::<8>()?;
    let count = usize::from(count);
    let [sizes @ .., zero] = sizes;
    let terms = Terms::new(sizes).filter(|_| NODES.contains(&count) && zero == 0);
    let wrong = |name, allowed| ModelError::Field {
        name,
        offset,
        allowed,
    };
    let terms = terms.ok_or(wrong("table", "6 to 16 nodes and 1 to 88 terms"))?;
    let mut nodes_mm = [0.0; *NODES.end()];
    for node in nodes_mm.iter_mut().take(count) {
        *node = f32::from_le_bytes(reader.array()?);
    }
    let axis = Axis::new(nodes_mm.get(..count).unwrap_or_default());
    let axis = axis.ok_or(wrong("table's nodes", "growing from -100 to 100 mm"))?;
    let [sizes, steps] = Table::lengths(&axis, &terms, outputs);
    let (sizes, steps) = (reader.take(sizes)?, reader.take(steps)?);
    reader.pad()?;
    Table::new(axis, terms, outputs, sizes, steps).ok_or(wrong("table's size of a step", "0 to 1"))
}

fn pair(
    reader: &mut Reader<'_>,
    name: &'static str,
    range: [f32; 2],
    allowed: &'static str,
) -> Result<[f32; 2], ModelError> {
    Ok([
        float(reader, name, range, allowed)?,
        float(reader, name, range, allowed)?,
    ])
}

fn float(
    reader: &mut Reader<'_>,
    name: &'static str,
    [low, high]: [f32; 2],
    allowed: &'static str,
) -> Result<f32, ModelError> {
    let offset = reader.offset;
    let value = f32::from_le_bytes(reader.array()?);
    if (low..=high).contains(&value) {
        return Ok(value);
    }
    Err(ModelError::Field {
        name,
        offset,
        allowed,
    })
}

/// A film run forwards, to be written. The fields mean what [`Forward`]'s do.
#[cfg(any(test, feature = "encode"))]
#[derive(Clone, Debug, PartialEq)]
pub struct ForwardSpec {
    /// Gauss–Newton steps, 0–3.
    pub steps: u8,
    /// The largest loads.
    pub limits: Limits,
    /// How strong the force of a size is.
    pub stiffness: Stiffness,
    /// What a rest picture says of a unit.
    pub rest_image: RestImage,
    /// What is known of one unit beside its rest picture.
    pub mounting: Option<Mounting>,
    /// How well markers are seen.
    pub noise: Noise,
    /// What is not known of the unit.
    pub own: SystematicSpec,
    /// How far another unit may differ.
    pub other: Tolerance,
    /// [`Tables::moved`], one output.
    pub moved: TableSpec,
    /// [`Tables::beside`], two outputs.
    pub beside: TableSpec,
    /// [`Tables::own`], eight outputs.
    pub own_table: Option<TableSpec>,
}

/// What is not known of a unit, to be written.
#[cfg(any(test, feature = "encode"))]
#[derive(Clone, Debug, PartialEq)]
pub struct SystematicSpec {
    /// Places go to so many mm either way.
    pub end_mm: f32,
    /// Standard uncertainties by size, place along y and place along x ([`SystematicGrid`]): of the
    /// force across itself, N, of |F|, as sizes, of the place, mm, and of the residual.
    pub knots: Vec<[f32; PARTS]>,
}

/// A table, to be written.
#[cfg(any(test, feature = "encode"))]
#[derive(Clone, Debug, PartialEq)]
pub struct TableSpec {
    /// The nodes of both axes, mm.
    pub nodes_mm: Vec<f32>,
    /// What [`Terms::new`] takes.
    pub terms: [u8; crate::forward::MOST_TILTS],
    /// By node along y, node along x, output and term.
    pub coefficients: Vec<f64>,
}

#[cfg(any(test, feature = "encode"))]
impl ForwardSpec {
    /// The section of a model file alone.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.push(&mut bytes);
        bytes
    }

    pub(super) fn push(&self, bytes: &mut Vec<u8>) {
        bytes.extend([
            self.steps,
            u8::from(self.mounting.is_some()),
            u8::from(self.own_table.is_some()),
            0,
        ]);
        let nothing = Mounting {
            per_px: [0.0; 2],
            beside_mm: Markers::default(),
        };
        let mounting = self.mounting.unwrap_or(nothing);
        let before = [
            self.limits.size,
            self.limits.tilt,
            self.stiffness.linear_n,
            self.stiffness.cubic_n,
            self.rest_image.corner,
        ];
        let parts = before.iter().chain(&self.rest_image.film_mm);
        let parts = parts.chain(self.noise.rest_px.as_flattened());
        let parts = parts
            .chain(&self.noise.at_rest_px)
            .chain(&self.noise.at_four_areas);
        let other = [self.other.shape, self.other.stiffness];
        let parts = parts.chain(&other).chain(&mounting.per_px);
        for part in parts.chain(mounting.beside_mm.as_flattened()) {
            bytes.extend(part.to_le_bytes());
        }
        self.own.push(bytes);
        for (table, outputs) in [(&self.moved, MOVED), (&self.beside, BESIDE)] {
            table.push(outputs, bytes);
        }
        if let Some(own) = &self.own_table {
            own.push(OWN, bytes);
        }
    }
}

#[cfg(any(test, feature = "encode"))]
impl SystematicSpec {
    /// Each part's step is the largest of its numbers over 65,535; numbers are rounded up, as
    /// nothing is known better than it is said to be.
    fn push(&self, bytes: &mut Vec<u8>) {
        let mut steps = [0.0_f32; PARTS];
        for knot in &self.knots {
            for (step, part) in steps.iter_mut().zip(knot) {
                *step = step.max(*part / f32::from(u16::MAX));
            }
        }
        for number in [self.end_mm].iter().chain(&steps) {
            bytes.extend(number.to_le_bytes());
        }
        for knot in &self.knots {
            for (part, step) in knot.iter().zip(steps) {
                let count = if step > 0.0 {
                    libm::ceilf(part / step)
                } else {
                    0.0
                };
                bytes.extend((count as u16).to_le_bytes());
            }
        }
    }
}

#[cfg(any(test, feature = "encode"))]
impl TableSpec {
    /// Each output's and term's step is the largest of its coefficients over 32,767.
    fn push(&self, outputs: usize, bytes: &mut Vec<u8>) {
        let nodes = self.nodes_mm.len();
        bytes.push(u8::try_from(nodes).unwrap_or(u8::MAX));
        bytes.extend(self.terms);
        bytes.extend([0; 2]);
        bytes.extend(self.nodes_mm.iter().flat_map(|node| node.to_le_bytes()));
        let row = self.coefficients.len() / (nodes * nodes).max(1);
        let mut sizes = alloc::vec![0.0_f64; row];
        for of_node in self.coefficients.chunks(row.max(1)) {
            for (size, value) in sizes.iter_mut().zip(of_node) {
                *size = size.max(value.abs() / f64::from(i16::MAX));
            }
        }
        debug_assert_eq!(row % outputs, 0);
        let sizes: Vec<f32> = sizes.into_iter().map(|size| size as f32).collect();
        bytes.extend(sizes.iter().flat_map(|size| size.to_le_bytes()));
        for y in 0..nodes {
            for (k, size) in sizes.iter().enumerate() {
                for x in 0..nodes {
                    let value = self.coefficients[(y * nodes + x) * row + k];
                    bytes.extend(step(value, *size).to_le_bytes());
                }
            }
        }
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
}

/// A coefficient in steps of a size, rounded to nearest.
#[cfg(any(test, feature = "encode"))]
fn step(value: f64, size: f32) -> i16 {
    if size == 0.0 {
        return 0;
    }
    let steps = value / f64::from(size);
    (steps + 0.5_f64.copysign(steps)) as i16
}
