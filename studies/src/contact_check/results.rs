//! What CalculiX printed: where its nodes went.

use anyhow::{Context, Result, bail};

use super::mesh::{Cut, Mesh};

/// CalculiX writes times with seven digits.
const SAME_TIME: f64 = 1e-6;

/// A line above each table of displacements.
const TABLE: &str = "displacements (vx,vy,vz)";

/// Half the distance over which a shell's slope is taken, mm.
const SLOPE_STEP_MM: f64 = 1e-3;

/// A film as CalculiX left it at the end of a step.
pub struct Pressed<'a> {
    mesh: &'a Mesh,
    moved_mm: Vec<[f64; 3]>,
}

impl<'a> Pressed<'a> {
    /// Reads the displacements at a time, a step's end, out of a `.dat` file's text.
    ///
    /// # Errors
    /// When the step did not come to its end, or a node of the mesh is not in the table.
    pub fn read(mesh: &'a Mesh, text: &str, end: f64) -> Result<Pressed<'a>> {
        let mut reached = None;
        let mut rest = text;
        let mut lines = loop {
            let Some(start) = rest.find(TABLE) else {
                let time: f64 = reached.context("no displacements in CalculiX's results")?;
                bail!("CalculiX stopped at {time} of {end} steps");
            };
            let mut lines = rest[start..].lines();
            let title = lines.next().unwrap_or_default();
            let time: f64 = title.rsplit(' ').next().unwrap_or_default().parse()?;
            if (time - end).abs() < SAME_TIME {
                break lines.take_while(|line| !line.contains(TABLE));
            }
            reached = Some(time);
            rest = &rest[start + TABLE.len()..];
        };
        let mut moved_mm = vec![None; mesh.nodes.len()];
        for line in lines
            .by_ref()
            .map(str::trim)
            .filter(|line| !line.is_empty())
        {
            let (node, moved) = row(line)?;
            match moved_mm.get_mut(node.wrapping_sub(1)) {
                Some(place) => *place = Some(moved),
                None => bail!("node {node} is not of the mesh"),
            }
        }
        let moved_mm: Option<Vec<_>> = moved_mm.into_iter().collect();
        let moved_mm = moved_mm.context("a node is missing in CalculiX's results")?;
        Ok(Pressed { mesh, moved_mm })
    }

    /// Where a point is, mm: on the flat mounted film at (x, y) mm, and what part of the thickness
    /// above the middle surface it is.
    pub fn at(&self, place: [f64; 3]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (node, weight) in self.mesh.place(place) {
            let (from, moved) = (self.mesh.nodes[node], self.moved_mm[node]);
            for axis in 0..3 {
                sum[axis] += weight * (from[axis] + moved[axis]);
            }
        }
        sum
    }

    /// How the point of the camera's side is displaced from the flat mounted film's, which is half
    /// a thickness (mm) below its middle surface, mm. Shells carry it on their normal.
    pub fn camera_side(&self, [x, y]: [f64; 2], half_mm: f64) -> [f64; 3] {
        let [to_x, to_y, to_z] = if self.mesh.cut == Cut::Shells {
            let [a, b] = [[SLOPE_STEP_MM, 0.0], [0.0, SLOPE_STEP_MM]].map(|[dx, dy]| {
                let (to, from) = (
                    self.at([x + dx, y + dy, 0.0]),
                    self.at([x - dx, y - dy, 0.0]),
                );
                [0, 1, 2].map(|axis| to[axis] - from[axis])
            });
            let n = cross(a, b);
            let length = n[0].hypot(n[1]).hypot(n[2]);
            let middle = self.at([x, y, 0.0]);
            [0, 1, 2].map(|axis| middle[axis] - half_mm * n[axis] / length)
        } else {
            self.at([x, y, -0.5])
        };
        [to_x - x, to_y - y, to_z + half_mm]
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// A node's number and displacement. The numbers are of fixed width: a minus may stand where a
/// space would.
fn row(line: &str) -> Result<(usize, [f64; 3])> {
    let wrong = || format!("not a line of displacements: {line}");
    let (node, rest) = line.split_once(' ').with_context(wrong)?;
    let spaced = rest
        .replace("E-", "e~")
        .replace('-', " -")
        .replace('~', "-");
    let parts: Result<Vec<f64>, _> = spaced.split_whitespace().map(str::parse).collect();
    let parts: [f64; 3] = parts
        .ok()
        .and_then(|p| p.try_into().ok())
        .with_context(wrong)?;
    Ok((node.parse().with_context(wrong)?, parts))
}
