//! Reads and writes the model file's section on the forward model.

use super::{ModelError, reader::Reader};
use crate::force::forward::{
    Axis, CovarianceGrid, Dot, Forward, Gravity, Limits, MOST_DOTS, MOST_FUNCTIONS, MOST_STEPS,
    Markers, NODES, Noise, Others, RELATIVE, RestImage, SHAPES_COORDINATES, Shapes, Stiffness,
    Table, Tables, Terms, Torques, Weight, Widths, weight,
};
use hivtac_terms::list::List;
use hivtac_terms::marker::LEAST_MARKERS;
#[cfg(any(test, feature = "encode"))]
use {
    crate::force::forward::{EVEN, MOST_TILTS, ODD, OUTPUTS, SHIFTS},
    alloc::vec::Vec,
};

impl<'a> Forward<'a> {
    /// Reads a section that stands alone.
    ///
    /// # Errors
    /// As [`Model::parse`](super::Model::parse).
    pub fn parse(bytes: &'a [u8]) -> Result<Forward<'a>, ModelError> {
        forward(&mut Reader { bytes, offset: 0 })
    }
}

/// Optional parts of a file: the covariance of its own unit, the knowledge of other units, and the
/// effect of the film's weight.
const PARTS: [[bool; 3]; 8] = {
    const NO: bool = false;
    const HAS: bool = true;
    [
        [NO, NO, NO],
        [HAS, NO, NO],
        [NO, HAS, NO],
        [HAS, HAS, NO],
        [NO, NO, HAS],
        [HAS, NO, HAS],
        [NO, HAS, HAS],
        [HAS, HAS, HAS],
    ]
};

/// Reads the section.
pub(super) fn forward<'a>(reader: &mut Reader<'a>) -> Result<Forward<'a>, ModelError> {
    let steps = reader.u8_in("steps", MOST_STEPS, "0 to 3")?;
    let has_camera = reader.choice("camera", &[false, true], "0 or 1")?;
    let dots = dots(reader)?;
    let [has_own, has_other, has_weight] = reader.choice("parts", &PARTS, "0 to 7")?;
    let limits = Limits {
        size: float(reader, "largest size", [1e-3, 10.0], "0.001 to 10")?,
        tilt: float(reader, "largest tilt", [1e-2, 1.0], "0.01 to 1 rad")?,
    };
    let stiffness = stiffness(reader)?;
    let rest_image = RestImage {
        at: markers(reader, dots, "rest image", [-2.0, 2.0], "-2 to 2")?,
        film_mm: markers(reader, dots, "film", [0.1, 1e3], "0.1 to 1000 mm")?,
    };
    let noise = Noise {
        rest_px: markers(reader, dots, "rest", [-1.0, 1.0], "-1 to 1 px")?,
        at_rest_px: pair(reader, "noise", [1e-4, 10.0], "0.0001 to 10 px")?,
        at_four_areas: pair(reader, "noise", [0.1, 10.0], "0.1 to 10")?,
    };
    let per_px = pair(reader, "focal lengths per px", [-1.0, 1.0], "-1 to 1")?;
    Ok(Forward {
        steps,
        limits,
        stiffness,
        rest_image,
        per_px: has_camera.then_some(per_px),
        noise,
        tables: tables(reader, dots)?,
        own: has_own.then(|| covariances(reader, dots)).transpose()?,
        other: has_other.then(|| others(reader, dots)).transpose()?,
        weight: has_weight.then(|| weight(reader, dots)).transpose()?,
        shapes: Shapes::nominal().filter(|_| 2 * dots == SHAPES_COORDINATES),
        widths: Widths::nominal(&rest_image),
        torques: Torques::nominal(&rest_image),
    })
}

fn weight<'a>(reader: &mut Reader<'a>, dots: usize) -> Result<Weight<'a>, ModelError> {
    let mut down = Gravity::default();
    for part in &mut down {
        *part = float(reader, "gravity", [-2.0, 2.0], "-2 to 2 g")?;
    }
    let press_n = float(reader, "weight", [0.0, 1.0], "0 to 1 N")?;
    let unsure = pair(reader, "weight's uncertainty", [0.0, 10.0], "0 to 10")?;
    let from = reader.offset;
    for _ in 0..2 * dots * weight::AT_REST {
        float(reader, "weight at rest", [-1e3, 1e3], "-1000 to 1000")?;
    }
    let at_rest = reader.bytes.get(from..reader.offset).unwrap_or_default();
    let offset = reader.offset;
    let under_load = reader.take(weight::length(2 * dots))?;
    if !Weight::is_under_load(under_load, 2 * dots) {
        return Err(ModelError::Field {
            name: "weight under a load",
            offset,
            allowed: "steps of 0 to 1000",
        });
    }
    Ok(Weight {
        down,
        press_n,
        unsure,
        coordinates: 2 * dots,
        at_rest,
        under_load,
    })
}

/// Reads the number of markers.
fn dots(reader: &mut Reader<'_>) -> Result<usize, ModelError> {
    let offset = reader.offset;
    match usize::from(reader.u8()?) {
        dots @ LEAST_MARKERS..=MOST_DOTS => Ok(dots),
        _ => Err(ModelError::Field {
            name: "markers",
            offset,
            allowed: "4 to 16",
        }),
    }
}

fn tables<'a>(reader: &mut Reader<'a>, dots: usize) -> Result<Tables<'a>, ModelError> {
    let offset = reader.offset;
    let wrong = |name, allowed| ModelError::Field {
        name,
        offset,
        allowed,
    };
    let [sizes @ .., even, odd, _] = reader.array::<8>()?;
    let functions = [even, odd].map(usize::from);
    let count = functions.iter().sum();
    let terms = Terms::new(sizes).filter(|_| (1..=MOST_FUNCTIONS).contains(&count));
    let terms = terms.ok_or(wrong("tables", "1 to 88 terms and 1 to 16 functions"))?;
    reader.offset -= 1;
    reader.zero("reserved byte")?;
    let [terms_even, terms_odd] = terms.counts();
    let even = reader.take(4 * functions[0] * terms_even)?;
    let odd = reader.take(4 * functions[1] * terms_odd)?;
    let from = reader.offset;
    let mut tables = List::default();
    for _ in 0..dots {
        let at = (reader.offset - from) as u32;
        let slope_units = table(reader, count)?.axes().map(|axis| axis.slope_unit());
        tables.push(Dot { at, slope_units });
    }
    let bytes = reader.bytes.get(from..reader.offset).unwrap_or_default();
    Tables::new(terms, [even, odd], bytes, tables).ok_or(wrong("functions", "-1 to 1"))
}

/// Not inlined, so that its stack is released on return.
#[inline(never)]
fn table<'a>(reader: &mut Reader<'a>, functions: usize) -> Result<Table<'a>, ModelError> {
    let offset = reader.offset;
    let wrong = |name, allowed| ModelError::Field {
        name,
        offset,
        allowed,
    };
    let counts = reader.array::<2>()?;
    reader.zero("reserved byte")?;
    reader.zero("reserved byte")?;
    let mut axis = |count: u8| {
        if !NODES.contains(&usize::from(count)) {
            return Err(wrong("table", "6 to 20 nodes"));
        }
        let (nodes, _) = reader.take(4 * usize::from(count))?.as_chunks();
        Axis::new(nodes).ok_or(wrong(
            "table's nodes",
            "6 to 20, growing from -100 to 100 mm",
        ))
    };
    let axes = [axis(counts[0])?, axis(counts[1])?];
    let away = pair(reader, "direction", [-1.0, 1.0], "-1 to 1")?;
    let steps = reader.take(Table::length(&axes, functions))?;
    reader.pad()?;
    Table::new(axes, away, functions, steps).ok_or(wrong("table", "1 to 16 functions"))
}

fn others<'a>(reader: &mut Reader<'a>, dots: usize) -> Result<Others<'a>, ModelError> {
    let stiffness = stiffness(reader)?;
    let mut relative = [0.0; RELATIVE];
    for part in &mut relative {
        *part = float(reader, "other units' strength", [0.0, 100.0], "0 to 100")?;
    }
    Ok(Others {
        stiffness,
        relative,
        covariance: covariances(reader, dots)?,
    })
}

fn stiffness(reader: &mut Reader<'_>) -> Result<Stiffness, ModelError> {
    Ok(Stiffness {
        linear_n: float(reader, "stiffness", [1e-6, 1e3], "0.000001 to 1000 N")?,
        cubic_n: float(reader, "stiffness", [1e-6, 1e3], "0.000001 to 1000 N")?,
    })
}

fn covariances<'a>(reader: &mut Reader<'a>, dots: usize) -> Result<CovarianceGrid<'a>, ModelError> {
    let offset = reader.offset;
    let counts = reader.array::<3>()?;
    reader.zero("reserved byte")?;
    let end_mm = f32::from_le_bytes(reader.array()?);
    let knots = reader.take(CovarianceGrid::length(2 * dots, counts))?;
    CovarianceGrid::new(2 * dots, counts, end_mm, knots).ok_or(ModelError::Field {
        name: "covariances",
        offset,
        allowed: "2 to 16 knots along each axis, an end of 0.1 to 100 mm and steps of 0 to 0.001",
    })
}

fn markers(
    reader: &mut Reader<'_>,
    dots: usize,
    name: &'static str,
    range: [f32; 2],
    allowed: &'static str,
) -> Result<Markers, ModelError> {
    let mut markers = Markers::defaults(dots);
    for part in markers.as_flattened_mut() {
        *part = float(reader, name, range, allowed)?;
    }
    Ok(markers)
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

/// A forward model, to be written. The fields are those of [`Forward`].
#[cfg(any(test, feature = "encode"))]
#[derive(Clone, Debug, PartialEq)]
pub struct ForwardSpec {
    /// Gauss–Newton steps, 0–3.
    pub steps: u8,
    /// The largest loads.
    pub limits: Limits,
    /// How strong the force of a size is.
    pub stiffness: Stiffness,
    /// How to read a unit's mounting from its rest picture.
    pub rest_image: RestImage,
    /// Focal lengths per px of the unit's own camera.
    pub per_px: Option<[f32; 2]>,
    /// How well markers are seen.
    pub noise: Noise,
    /// How the images move.
    pub tables: TablesSpec,
    /// The covariance that the tables leave on its own unit.
    pub own: Option<CovarianceSpec>,
    /// Properties of any other unit.
    pub other: Option<OthersSpec>,
    /// The effect of the film's own weight.
    pub weight: Option<WeightSpec>,
}

/// The effect of the contact's shape, to be written.
#[cfg(any(test, feature = "encode"))]
#[derive(Clone, Debug, PartialEq)]
pub struct ShapesSpec {
    /// The covariance over all shapes.
    pub covariance: CovarianceSpec,
    /// The motions at each of its knots, focal lengths: the mean over all shapes, then those of a
    /// round and of a flat contact in proportion to [`span`](crate::force::forward::span) and to
    /// its square.
    pub shifts: Vec<[[f64; SHAPES_COORDINATES]; SHIFTS]>,
}

/// The effect of a film's weight, to be written. The fields are those of [`Weight`].
#[cfg(any(test, feature = "encode"))]
#[derive(Clone, Debug, PartialEq)]
pub struct WeightSpec {
    /// Gravity on the model's own film.
    pub down: Gravity,
    /// The press that sinks the film as its weight does, N.
    pub press_n: f32,
    /// Relative standard uncertainty: of the model's own unit, of any other.
    pub unsure: [f32; 2],
    /// The effect at rest of each function of gravity, focal lengths.
    pub at_rest: [Vec<f64>; weight::AT_REST],
    /// The additional part by size, function of gravity, coordinate and term, divided by the
    /// softness.
    pub under_load: [[Vec<[f64; weight::TERMS]>; weight::UNDER_LOAD]; weight::SIZES],
}

/// Properties of other units, to be written. The fields are those of [`Others`].
#[cfg(any(test, feature = "encode"))]
#[derive(Clone, Debug, PartialEq)]
pub struct OthersSpec {
    /// The force of each size on a unit without stretch.
    pub stiffness: Stiffness,
    /// Relative standard uncertainty of the force.
    pub relative: [f32; RELATIVE],
    /// The covariance that the tables leave in the motion, apart from the size's.
    pub covariance: CovarianceSpec,
}

/// The tables of a film, to be written.
#[cfg(any(test, feature = "encode"))]
#[derive(Clone, Debug, PartialEq)]
pub struct TablesSpec {
    /// The argument of [`Terms::new`].
    pub terms: [u8; MOST_TILTS],
    /// Functions of size and tilt: a coefficient of each term, sorted by the degree of the tilt,
    /// then by that of its second part, then by that of the size. A function has only terms of even
    /// powers of the tilt's second part or only of odd ones; those of even powers come first.
    pub functions: Vec<Vec<f32>>,
    /// One table for each marker.
    pub dots: Vec<TableSpec>,
}

/// A marker's table, to be written.
#[cfg(any(test, feature = "encode"))]
#[derive(Clone, Debug, PartialEq)]
pub struct TableSpec {
    /// The nodes along x and along y, mm.
    pub nodes_mm: [Vec<f32>; 2],
    /// The direction of the first part of the functions' tilt, of length one.
    pub away: [f32; 2],
    /// By node along y, node along x, output (motion along x, along y) and function: coefficients
    /// of B-splines.
    pub coefficients: Vec<f64>,
}

/// Covariances of x and y of all images, to be written.
#[cfg(any(test, feature = "encode"))]
#[derive(Clone, Debug, PartialEq)]
pub struct CovarianceSpec {
    /// Knots along the size, along y and along x.
    pub counts: [u8; 3],
    /// Places range from −`end_mm` to `end_mm` along each axis.
    pub end_mm: f32,
    /// By size, place along y and place along x: the lower factor of each covariance, focal
    /// lengths.
    pub factors: Vec<Vec<Vec<f64>>>,
}

#[cfg(any(test, feature = "encode"))]
impl ForwardSpec {
    /// A section that stands alone.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.push(&mut bytes);
        bytes
    }

    pub(super) fn push(&self, bytes: &mut Vec<u8>) {
        let has = [
            self.own.is_some(),
            self.other.is_some(),
            self.weight.is_some(),
        ];
        let parts = PARTS.iter().position(|parts| *parts == has).unwrap_or(0);
        let camera = u8::from(self.per_px.is_some());
        bytes.extend([
            self.steps,
            camera,
            self.tables.dots.len() as u8,
            parts as u8,
        ]);
        let load = [
            self.limits.size,
            self.limits.tilt,
            self.stiffness.linear_n,
            self.stiffness.cubic_n,
        ];
        let parts = load.iter().chain(self.rest_image.at.as_flattened());
        let parts = parts.chain(self.rest_image.film_mm.as_flattened());
        let parts = parts.chain(self.noise.rest_px.as_flattened());
        let parts = parts.chain(&self.noise.at_rest_px);
        let parts = parts.chain(&self.noise.at_four_areas);
        for part in parts.chain(&self.per_px.unwrap_or_default()) {
            bytes.extend(part.to_le_bytes());
        }
        self.tables.push(bytes);
        if let Some(own) = &self.own {
            own.push(bytes);
        }
        if let Some(other) = &self.other {
            let Stiffness { linear_n, cubic_n } = other.stiffness;
            let parts = [linear_n, cubic_n].into_iter().chain(other.relative);
            bytes.extend(parts.flat_map(f32::to_le_bytes));
            other.covariance.push(bytes);
        }
        if let Some(weight) = &self.weight {
            weight.push(bytes);
        }
    }
}

#[cfg(any(test, feature = "encode"))]
impl ShapesSpec {
    /// The bytes of `sensor/data/contact-shapes.bin`. Each knot's step is the largest of its
    /// entries over 32,767.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.covariance.push(&mut bytes);
        for shifts in &self.shifts {
            push_steps(shifts.as_flattened(), &mut bytes);
        }
        bytes
    }
}

/// Appends a step, the largest entry over 32,767, and the entries in steps.
#[cfg(any(test, feature = "encode"))]
fn push_steps(entries: &[f64], bytes: &mut Vec<u8>) {
    let largest = entries
        .iter()
        .fold(0.0_f64, |most, entry| most.max(entry.abs()));
    let size = (largest / f64::from(i16::MAX)) as f32;
    bytes.extend(size.to_le_bytes());
    let steps = entries.iter().map(|entry| step(*entry, size.into()));
    bytes.extend(steps.flat_map(i16::to_le_bytes));
}

#[cfg(any(test, feature = "encode"))]
impl WeightSpec {
    /// Each function's step at a size is the largest of its entries over 32,767.
    fn push(&self, bytes: &mut Vec<u8>) {
        let parts = self.down.iter().chain([&self.press_n]).chain(&self.unsure);
        bytes.extend(parts.flat_map(|part| part.to_le_bytes()));
        let at_rest = self.at_rest.iter().flatten();
        bytes.extend(at_rest.flat_map(|part| (*part as f32).to_le_bytes()));
        for block in self.under_load.as_flattened() {
            push_steps(block.as_flattened(), bytes);
        }
    }
}

#[cfg(any(test, feature = "encode"))]
impl TablesSpec {
    fn push(&self, bytes: &mut Vec<u8>) {
        bytes.extend(self.terms);
        let is_even = |function: &&Vec<f32>| {
            let mut odd = function
                .iter()
                .zip(self.powers())
                .filter(|(_, [_, k])| k % 2 == 1);
            odd.all(|(part, _)| *part == 0.0)
        };
        let even = self.functions.iter().take_while(is_even).count();
        bytes.extend([even as u8, (self.functions.len() - even) as u8, 0]);
        let sizes = self.sizes();
        for (number, (function, size)) in self.functions.iter().zip(&sizes).enumerate() {
            let groups: &[[usize; 2]] = if number < even { &EVEN } else { &ODD };
            for group in groups {
                let parts = function
                    .iter()
                    .zip(self.powers())
                    .filter(|(_, own)| own == group);
                let parts = parts.map(|(part, _)| (f64::from(*part) * size) as f32);
                bytes.extend(parts.flat_map(f32::to_le_bytes));
            }
        }
        for table in &self.dots {
            table.push(&sizes, bytes);
        }
    }

    /// The powers of the tilt's parts in each term.
    fn powers(&self) -> impl Iterator<Item = [usize; 2]> + use<'_> {
        let of_degree = |(degree, sizes): (usize, &u8)| {
            let sizes = usize::from(*sizes);
            (0..=degree).flat_map(move |k| core::iter::repeat_n([degree - k, k], sizes))
        };
        self.terms.iter().enumerate().flat_map(of_degree)
    }

    /// Each function's step: the largest of its coefficients over 32,767.
    fn sizes(&self) -> Vec<f64> {
        let count = self.functions.len();
        let mut sizes = alloc::vec![0.0_f64; count];
        let outputs = self
            .dots
            .iter()
            .flat_map(|dot| dot.coefficients.chunks(count.max(1)));
        for of_output in outputs {
            for (size, value) in sizes.iter_mut().zip(of_output) {
                *size = size.max(value.abs() / f64::from(i16::MAX));
            }
        }
        sizes
    }
}

#[cfg(any(test, feature = "encode"))]
impl TableSpec {
    fn push(&self, sizes: &[f64], bytes: &mut Vec<u8>) {
        let [nodes_x, nodes_y] = self.nodes_mm.each_ref().map(Vec::len);
        bytes.extend([nodes_x as u8, nodes_y as u8, 0, 0]);
        let nodes = self.nodes_mm.iter().flatten();
        bytes.extend(nodes.chain(&self.away).flat_map(|part| part.to_le_bytes()));
        let row = OUTPUTS * sizes.len();
        for y in 0..nodes_y {
            for k in 0..row {
                for x in 0..nodes_x {
                    let value = self.coefficients[(y * nodes_x + x) * row + k];
                    bytes.extend(step(value, sizes[k % sizes.len()]).to_le_bytes());
                }
            }
        }
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
}

#[cfg(any(test, feature = "encode"))]
impl CovarianceSpec {
    /// Appends the grid as a file holds it. Each knot's step is the largest of its entries over
    /// 32,767.
    pub fn push(&self, bytes: &mut Vec<u8>) {
        bytes.extend(self.counts);
        bytes.push(0);
        bytes.extend(self.end_mm.to_le_bytes());
        for factor in &self.factors {
            let rows = factor.iter().enumerate();
            let entries = rows.flat_map(|(i, row)| row.iter().take(i + 1));
            push_steps(&entries.copied().collect::<Vec<_>>(), bytes);
        }
    }
}

/// A coefficient in steps of `size`, rounded to nearest.
#[cfg(any(test, feature = "encode"))]
fn step(value: f64, size: f64) -> i16 {
    if size == 0.0 {
        return 0;
    }
    let steps = value / size;
    (steps + 0.5_f64.copysign(steps)) as i16
}
