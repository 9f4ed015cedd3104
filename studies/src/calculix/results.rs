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
    /// The film before the first step.
    pub fn cut(mesh: &'a Mesh) -> Pressed<'a> {
        let moved_mm = vec![[0.0; 3]; mesh.nodes.len()];
        Pressed { mesh, moved_mm }
    }

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

    /// How far apart the film's two faces are at a place, mm; nothing of shells.
    pub fn thickness_mm(&self, [x, y]: [f64; 2]) -> f64 {
        let [top, bottom] = [0.5, -0.5].map(|side| self.at([x, y, side]));
        let [dx, dy, dz] = [0, 1, 2].map(|axis| top[axis] - bottom[axis]);
        dx.hypot(dy).hypot(dz)
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

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_shell::Design;

    /// Printed by CalculiX 2.20.
    const PRINTED: &str = "
 displacements (vx,vy,vz) for set ALL and time  0.5000000E+00

         1 -1.234485E-05 -1.266214E-05  1.419579E-05

 displacements (vx,vy,vz) for set ALL and time  0.1000000E+01

         1 -1.234485E-04 -1.266214E-04  1.419579E-04
         2 -1.550103E-04 -9.270004E-05 -3.754029E-05
         3 -3.703311E-04 -3.689632E-04  3.093809E-05
         4 -8.384139E-05 -1.506104E-04 -5.011277E-05
         5  1.128976E-04  1.008343E-04  1.476431E-04
";

    /// A mesh of which only the number of nodes counts.
    fn mesh(nodes: usize) -> Mesh {
        let mut mesh = Mesh::new(&Design::default(), Cut::Shells, 0.25);
        mesh.nodes.truncate(nodes);
        mesh
    }

    #[test]
    fn the_table_of_a_time_is_read() {
        let mesh = mesh(5);
        let pressed = Pressed::read(&mesh, PRINTED, 1.0).unwrap();
        assert_eq!(
            pressed.moved_mm[0],
            [-1.234485e-4, -1.266214e-4, 1.419579e-4]
        );
        assert_eq!(pressed.moved_mm[4][2], 1.476431e-4);
    }

    #[test]
    fn numbers_may_touch() {
        let (node, moved) = row("12 -1.0E-04-2.5E+00-3.0E-01").unwrap();
        assert_eq!((node, moved), (12, [-1e-4, -2.5, -0.3]));
        assert!(row("12 1.0 2.0").is_err() && row("one 1. 2. 3.").is_err());
    }

    #[test]
    fn what_is_not_whole_is_refused() {
        let why = |nodes, text: &str| {
            Pressed::read(&mesh(nodes), text, 1.0)
                .err()
                .map(|why| why.to_string())
                .unwrap()
        };
        assert!(why(6, PRINTED).contains("missing"));
        assert!(why(4, PRINTED).contains("node 5"));
        assert!(why(5, "").contains("no displacements"));
        let stopped = PRINTED.replace("0.1000000E+01", "0.9000000E+00");
        assert!(why(5, &stopped).contains("stopped at 0.9 of 1 steps"));
        assert!(Pressed::read(&mesh(1), PRINTED, 0.5).is_ok());
    }
}
