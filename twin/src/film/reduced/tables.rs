//! The tables of a film, and what they say of its markers and of the tip.

use super::axis::Axis;
use super::pose::Pose;
use super::table::Table;
use super::terms::Terms;
use super::unit::Unit;

use crate::film::{DiscMotion, FilmError, MARKER_CENTRES_MM, MAX_PLACE_MM};

/// Places of the tip at which marker 2's motion is known, along x and along y, mm: close where the
/// marker is.
const NODES_MM: [f64; 16] = [
    -5.0, -3.8, -2.5, -1.4, 0.0, 0.7, 1.4, 2.0, 2.5, 2.9, 3.2, 3.5, 3.8, 4.1, 4.5, 5.0,
];
/// Those at which it is known what a film's own differences and a tip's radius do, mm.
const UNIT_NODES_MM: [f64; 11] = [-5.0, -3.8, -2.5, -1.4, 0.0, 1.4, 2.5, 3.2, 3.8, 4.5, 5.0];
/// Those at which the tip's own way is known: its quarter of the film, mm.
const TIP_NODES_MM: [f64; 12] = [0.0, 0.7, 1.4, 2.0, 2.5, 2.9, 3.2, 3.5, 3.8, 4.1, 4.5, 5.0];
/// And those at which it is known what a tip's radius does to that, mm.
const TIP_RADIUS_NODES_MM: [f64; 7] = [0.0, 1.4, 2.5, 3.2, 3.8, 4.5, 5.0];
/// The tip's radius in the first three tables, mm, and the largest in those of the radius.
pub const NOMINAL_RADIUS_MM: f64 = 0.5;
/// The largest radius of the tip that a film knows, mm.
pub const LARGEST_RADIUS_MM: f64 = 2.0;
/// The smallest, mm.
pub const SMALLEST_RADIUS_MM: f64 = 0.25;
/// How far before and behind it is seen what changes on the way of a marker and a tip, in parts of
/// that.
const STEP: f64 = 0.1;
/// What a film's own differences are: thickness, grip, and the posts' places along x and y.
pub const UNIT_PARTS: usize = 10;

/// What a table tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Marker 2's motion, mm: along x, along z.
    Moved,
    /// Its slopes: of the motion along x by x and by y, along z by x.
    Slopes,
    /// The way of a tip in the corner (+, +), mm: along x, along z.
    Tip,
    /// What the first, second and third power of ρ = (R² − 0.25) / 3.75 add for a tip of radius R
    /// mm: to the motion along x and along z, power by power.
    Radius,
    /// The same for the tip's own way.
    TipRadius,
    /// What each of the film's own differences adds per unit: to the motion along x and along z.
    Unit,
}

impl Kind {
    /// All, in the order of a file.
    pub const ALL: [Kind; 6] = [
        Kind::Moved,
        Kind::Slopes,
        Kind::Tip,
        Kind::Radius,
        Kind::TipRadius,
        Kind::Unit,
    ];

    /// Its nodes along x and along y.
    pub fn axis(self) -> Axis {
        match self {
            Kind::Tip => Axis::new(&TIP_NODES_MM),
            Kind::TipRadius => Axis::new(&TIP_RADIUS_NODES_MM),
            Kind::Radius | Kind::Unit => Axis::new(&UNIT_NODES_MM),
            _ => Axis::new(&NODES_MM),
        }
    }

    /// Its terms.
    pub fn terms(self) -> Terms {
        match self {
            Kind::Moved | Kind::Tip => Terms::up_to(7, 4, 1),
            Kind::Slopes => Terms::up_to(5, 3, 1),
            // Of these no derivatives by the force are known: two rings of tilts tell no third
            // degree.
            Kind::Radius | Kind::TipRadius | Kind::Unit => Terms::up_to(4, 2, 1),
        }
    }

    /// How many numbers it tells.
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
    /// Of each kind's coefficients: by node along y, node along x, output and term.
    pub fn new(coefficients: impl Fn(Kind) -> Vec<f64>) -> Tables {
        Tables(Kind::ALL.map(|kind| {
            let values = coefficients(kind);
            Table::new(kind.axis(), kind.terms(), kind.outputs(), &values)
        }))
    }

    /// As a file keeps them.
    pub fn to_bytes(&self) -> Vec<u8> {
        self.0.iter().flat_map(Table::to_bytes).collect()
    }

    /// From a file's bytes.
    ///
    /// # Errors
    /// When there are fewer or more of them.
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

    /// The tip's way, mm.
    pub fn tip_mm(&self, pose: &Pose, radius_mm: f64) -> [f64; 3] {
        let signs = pose.place_mm.map(|part| 1.0_f64.copysign(part));
        let here = pose.mirrored(signs);
        let kinds = [Kind::Tip, Kind::TipRadius];
        let [x, z] = self.under(kinds, &here, radius_mm);
        let [y] = self.under(kinds, &here.swapped(), radius_mm);
        [signs[0] * x, signs[1] * y, z]
    }

    /// How the film moves around the place of marker `k`, `markers_mm` beside the nominal one.
    pub fn disc(&self, pose: &Pose, radius_mm: f64, unit: &Unit, k: usize) -> DiscMotion {
        let parts = unit.parts();
        let signs = MARKER_CENTRES_MM[k].map(f64::signum);
        let here = pose.mirrored(signs);
        let own = (parts != [0.0; UNIT_PARTS]).then(|| mirrored(parts, signs));
        let [x, y] = unit.markers_mm[k];
        let disc = match [signs[0] * x, signs[1] * y] {
            [0.0, 0.0] => self.corner_disc(&here, radius_mm, own.as_ref()),
            beside_mm => self.beside(&here, radius_mm, own.as_ref(), beside_mm),
        };
        mirrored_disc(disc, signs)
    }

    /// Marker 2's motion.
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

    /// The first outputs of a table of motions along x and z under a tip of a radius, by the table
    /// of what that adds.
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

    /// The motion of a marker glued `beside_mm` marker 2's place: that of marker 2 with the tip as
    /// far beside it, and what changes on the way as both go on to where they are. That changes
    /// little and evenly, where the motion of a place near the tip is quite another a little
    /// beside.
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
        // Along the way on which it is clamped the tip does not go on.
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

/// The variable of the tables of the radius.
pub fn rho(radius_mm: f64) -> f64 {
    let square = |r: f64| r * r;
    let [own, nominal, largest] = [radius_mm, NOMINAL_RADIUS_MM, LARGEST_RADIUS_MM].map(square);
    (own - nominal) / (largest - nominal)
}

type Parts = [f64; UNIT_PARTS];

/// Which post is where another was, after mirroring x, mirroring y, and at the diagonal.
const MIRRORED: [[usize; 4]; 2] = [[1, 0, 3, 2], [3, 2, 1, 0]];
const SWAPPED: [usize; 4] = [0, 3, 2, 1];

/// A film's differences seen in a mirror.
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

/// A film's differences mirrored at the diagonal.
fn swapped(parts: Parts) -> Parts {
    let mut seen = parts;
    for (post, from) in SWAPPED.into_iter().enumerate() {
        seen[2 + 2 * post] = parts[3 + 2 * from];
        seen[3 + 2 * post] = parts[2 + 2 * from];
    }
    seen
}

/// A disc's motion seen in a mirror.
pub(super) fn mirrored_disc(disc: DiscMotion, [sx, sy]: [f64; 2]) -> DiscMotion {
    let mirror = |[x, y, z]: [f64; 3], sign: f64| [sign * sx * x, sign * sy * y, sign * z];
    DiscMotion {
        moved_mm: mirror(disc.moved_mm, 1.0),
        along_x: mirror(disc.along_x, sx),
        along_y: mirror(disc.along_y, sy),
    }
}
