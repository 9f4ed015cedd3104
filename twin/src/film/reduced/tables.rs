//! The tables of a film; they give the motion of its markers and of the tip.

use super::axis::Axis;
use super::pose::Pose;
use super::table::Table;
use super::terms::Terms;
use super::unit::Unit;

use crate::film::{DiscMotion, FilmError, MARKER_CENTRES_MM, MAX_PLACE_MM};

/// Nodes of the tip's place for marker 2's motion, along x and along y, mm: dense near the marker.
const NODES_MM: [f64; 16] = [
    -5.0, -3.8, -2.5, -1.4, 0.0, 0.7, 1.4, 2.0, 2.5, 2.9, 3.2, 3.5, 3.8, 4.1, 4.5, 5.0,
];
/// Nodes for the effects of a film's own differences and of a tip's radius on it, mm.
const UNIT_NODES_MM: [f64; 11] = [-5.0, -3.8, -2.5, -1.4, 0.0, 1.4, 2.5, 3.2, 3.8, 4.5, 5.0];
/// Nodes for the tip's own displacement: its quarter of the film, mm.
const TIP_NODES_MM: [f64; 12] = [0.0, 0.7, 1.4, 2.0, 2.5, 2.9, 3.2, 3.5, 3.8, 4.1, 4.5, 5.0];
/// Nodes for the effect of a tip's radius on that, mm.
const TIP_RADIUS_NODES_MM: [f64; 7] = [0.0, 1.4, 2.5, 3.2, 3.8, 4.5, 5.0];
/// The tip's radius in the first three tables, mm, and the reference radius of the tables of the
/// radius.
pub const NOMINAL_RADIUS_MM: f64 = 0.5;
/// The largest radius of a tip that the tables hold for, mm.
pub const LARGEST_RADIUS_MM: f64 = 2.0;
/// The smallest radius of a tip that the tables hold for, mm.
pub const SMALLEST_RADIUS_MM: f64 = 0.25;
/// Step of the finite difference along a marker's shift, in parts of that shift, in both
/// directions.
const STEP: f64 = 0.1;
/// Number of a film's own differences: thickness, grip, and the posts' places along x and y.
pub const UNIT_PARTS: usize = 10;

/// The quantity that a table gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Marker 2's motion, mm: along x, along z.
    Moved,
    /// Its slopes: of the motion along x by x and by y, along z by x.
    Slopes,
    /// The displacement of a tip in the corner (+, +), mm: along x, along z.
    Tip,
    /// For a tip of radius R mm, the additional motion by the first, second and third power of ρ =
    /// (R² − 0.25) / 3.75: along x and along z, power by power.
    Radius,
    /// The same for the tip's own displacement.
    TipRadius,
    /// The change per unit of each of the film's own differences: of the motion along x and along
    /// z.
    Unit,
}

impl Kind {
    /// All kinds, in the order of a file.
    pub const ALL: [Kind; 6] = [
        Kind::Moved,
        Kind::Slopes,
        Kind::Tip,
        Kind::Radius,
        Kind::TipRadius,
        Kind::Unit,
    ];

    /// Returns the nodes along x and along y.
    pub fn axis(self) -> Axis {
        match self {
            Kind::Tip => Axis::new(&TIP_NODES_MM),
            Kind::TipRadius => Axis::new(&TIP_RADIUS_NODES_MM),
            Kind::Radius | Kind::Unit => Axis::new(&UNIT_NODES_MM),
            _ => Axis::new(&NODES_MM),
        }
    }

    /// Returns the terms.
    pub fn terms(self) -> Terms {
        match self {
            Kind::Moved | Kind::Tip => Terms::up_to(7, 4, 1),
            Kind::Slopes => Terms::up_to(5, 3, 1),
            // No derivatives by the force are known for these kinds, and two rings of tilts do not
            // determine the third degree.
            Kind::Radius | Kind::TipRadius | Kind::Unit => Terms::up_to(4, 2, 1),
        }
    }

    /// Returns the number of outputs.
    pub fn outputs(self) -> usize {
        match self {
            Kind::Moved | Kind::Tip => 2,
            Kind::Slopes => 3,
            Kind::Radius | Kind::TipRadius => 6,
            Kind::Unit => 2 * UNIT_PARTS,
        }
    }
}

/// All tables of a film.
#[derive(Clone, Debug, PartialEq)]
pub struct Tables([Table; 6]);

impl Tables {
    /// Makes the tables from each kind's coefficients: by node along y, node along x, output and
    /// term.
    pub fn new(coefficients: impl Fn(Kind) -> Vec<f64>) -> Tables {
        Tables(Kind::ALL.map(|kind| {
            let values = coefficients(kind);
            Table::new(kind.axis(), kind.terms(), kind.outputs(), &values)
        }))
    }

    /// Returns the tables as a file stores them.
    pub fn to_bytes(&self) -> Vec<u8> {
        self.0.iter().flat_map(Table::to_bytes).collect()
    }

    /// Reads the tables from a file's bytes.
    ///
    /// # Errors
    /// If there are too few or too many bytes.
    pub fn from_bytes(mut bytes: &[u8]) -> Result<Tables, FilmError> {
        let mut tables = Vec::new();
        for kind in Kind::ALL {
            tables.push(Table::take(
                kind.axis(),
                kind.terms(),
                kind.outputs(),
                &mut bytes,
            )?);
        }
        match (bytes, tables.try_into()) {
            ([], Ok(tables)) => Ok(Tables(tables)),
            _ => Err(FilmError::Tables(format!(
                "{} bytes follow the last table: make the file anew",
                bytes.len()
            ))),
        }
    }

    fn table(&self, kind: Kind) -> &Table {
        &self.0[kind as usize]
    }

    /// Returns the tip's displacement, mm.
    pub fn tip_mm(&self, pose: &Pose, radius_mm: f64) -> [f64; 3] {
        let signs = pose.place_mm.map(|part| 1.0_f64.copysign(part));
        let here = pose.mirrored(signs);
        let kinds = [Kind::Tip, Kind::TipRadius];
        let [x, z] = self.under(kinds, &here, radius_mm);
        let [y] = self.under(kinds, &here.swapped(), radius_mm);
        [signs[0] * x, signs[1] * y, z]
    }

    /// Returns the motion of the film around marker `k`, which sits `markers_mm` off its nominal
    /// place.
    pub fn disc(&self, pose: &Pose, radius_mm: f64, unit: &Unit, k: usize) -> DiscMotion {
        let parts = unit.parts();
        let signs = MARKER_CENTRES_MM[k].map(f64::signum);
        let here = pose.mirrored(signs);
        let own = (parts != [0.0; UNIT_PARTS]).then(|| mirrored(parts, signs));
        let [x, y] = unit.markers_mm.at(k);
        let disc = match [signs[0] * x, signs[1] * y] {
            [0.0, 0.0] => self.corner_disc(&here, radius_mm, own.as_ref()),
            beside_mm => self.beside(&here, radius_mm, own.as_ref(), beside_mm),
        };
        mirrored_disc(disc, signs)
    }

    /// Returns marker 2's motion.
    fn corner_disc(&self, pose: &Pose, radius_mm: f64, own: Option<&Parts>) -> DiscMotion {
        let poses = [*pose, pose.swapped()];
        let kinds = [Kind::Moved, Kind::Radius];
        let [mut ux, mut uz] = self.under(kinds, &poses[0], radius_mm);
        let [mut uy] = self.under(kinds, &poses[1], radius_mm);
        if let Some(own) = own {
            let [along, away] = self.by_unit(&poses[0], own);
            let [across, _] = self.by_unit(&poses[1], &swapped(*own));
            (ux, uy, uz) = (ux + along, uy + across, uz + away);
        }
        let table = self.table(Kind::Slopes);
        let slopes = poses.map(|pose| table.sums::<3>(&table.at(&pose), 0));
        let [[xx, xy, zx], [yy, yx, zy]] = slopes;
        DiscMotion {
            moved_mm: [ux, uy, uz],
            along_x: [xx, yx, zx],
            along_y: [xy, yy, zy],
        }
    }

    /// Returns the first outputs of a table of motions along x and z, for a tip of a radius. The
    /// second table gives the effect of the radius.
    fn under<const N: usize>(
        &self,
        [nominal, by_radius]: [Kind; 2],
        pose: &Pose,
        radius_mm: f64,
    ) -> [f64; N] {
        let table = self.table(nominal);
        let own: [f64; N] = table.sums(&table.at(pose), 0);
        let more = self.by_radius(by_radius, pose, radius_mm);
        std::array::from_fn(|k| own[k] + more[k])
    }

    fn by_radius(&self, kind: Kind, pose: &Pose, radius_mm: f64) -> [f64; 2] {
        let rho = rho(radius_mm);
        if rho == 0.0 {
            return [0.0; 2];
        }
        let table = self.table(kind);
        let [x1, z1, x2, z2, x3, z3]: [f64; 6] = table.sums(&table.at(pose), 0);
        [(x1, x2, x3), (z1, z2, z3)].map(|(a, b, c)| rho * (a + rho * (b + rho * c)))
    }

    fn by_unit(&self, pose: &Pose, parts: &Parts) -> [f64; 2] {
        let table = self.table(Kind::Unit);
        let per_unit: [f64; 2 * UNIT_PARTS] = table.sums(&table.at(pose), 0);
        let pairs = per_unit.as_chunks::<2>().0.iter().zip(parts);
        pairs.fold([0.0; 2], |[x, z], ([along, away], part)| {
            [x + along * part, z + away * part]
        })
    }

    /// Returns the motion of a marker glued `beside_mm` off marker 2's place. It is marker 2's
    /// motion with the tip shifted by as much in the opposite direction, plus the change as both
    /// move to their real places. That change is small and even. The motion of a fixed place near
    /// the tip, however, differs much from that of its neighbour.
    fn beside(
        &self,
        pose: &Pose,
        radius_mm: f64,
        own: Option<&Parts>,
        beside_mm: [f64; 2],
    ) -> DiscMotion {
        let at = |part: f64| {
            let place_mm = [0, 1].map(|c| pose.place_mm[c] - part * beside_mm[c]);
            let pose = Pose {
                place_mm: place_mm.map(|part| part.clamp(-MAX_PLACE_MM, MAX_PLACE_MM)),
                ..*pose
            };
            (self.corner_disc(&pose, radius_mm, own), pose.place_mm)
        };
        let (disc, place_mm) = at(1.0);
        let ((back, from), (forth, to)) = (at(1.0 + STEP), at(1.0 - STEP));
        // In a direction in which its place is clamped, the tip does not move on.
        let gone = |c: usize| {
            let whole = to[c] - from[c];
            if whole == 0.0 {
                0.0
            } else {
                (pose.place_mm[c] - place_mm[c]) / whole
            }
        };
        let part = gone(0).abs().max(gone(1).abs());
        let at = disc.at(beside_mm);
        DiscMotion {
            moved_mm: std::array::from_fn(|c| {
                at[c] + part * (forth.moved_mm[c] - back.moved_mm[c])
            }),
            ..disc
        }
    }
}

/// Returns the variable of the tables of the radius.
pub fn rho(radius_mm: f64) -> f64 {
    let square = |r: f64| r * r;
    let [own, nominal, largest] = [radius_mm, NOMINAL_RADIUS_MM, LARGEST_RADIUS_MM].map(square);
    (own - nominal) / (largest - nominal)
}

type Parts = [f64; UNIT_PARTS];

/// For mirroring x, mirroring y, and mirroring at the diagonal: the post that takes each post's
/// place.
const MIRRORED: [[usize; 4]; 2] = [[1, 0, 3, 2], [3, 2, 1, 0]];
const SWAPPED: [usize; 4] = [0, 3, 2, 1];

/// Returns a film's differences mirrored.
fn mirrored(parts: Parts, signs: [f64; 2]) -> Parts {
    let mut seen = parts;
    for (axis, places) in MIRRORED.into_iter().enumerate() {
        if signs[axis] < 0.0 {
            let before = seen;
            for (post, from) in places.into_iter().enumerate() {
                seen[2 + 2 * post] = before[2 + 2 * from];
                seen[3 + 2 * post] = before[3 + 2 * from];
                seen[2 + 2 * post + axis] *= -1.0;
            }
        }
    }
    seen
}

/// Returns a film's differences mirrored at the diagonal.
fn swapped(parts: Parts) -> Parts {
    let mut seen = parts;
    for (post, from) in SWAPPED.into_iter().enumerate() {
        seen[2 + 2 * post] = parts[3 + 2 * from];
        seen[3 + 2 * post] = parts[2 + 2 * from];
    }
    seen
}

/// Returns a disc's motion mirrored.
pub(super) fn mirrored_disc(disc: DiscMotion, [sx, sy]: [f64; 2]) -> DiscMotion {
    let mirror = |[x, y, z]: [f64; 3], sign: f64| [sign * sx * x, sign * sy * y, sign * z];
    DiscMotion {
        moved_mm: mirror(disc.moved_mm, 1.0),
        along_x: mirror(disc.along_x, sx),
        along_y: mirror(disc.along_y, sy),
    }
}
