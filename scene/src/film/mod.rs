//! Where the film goes when it is pressed.
//!
//! The film is a nonlinear shell; its finite elements (`film/`) take a third of a second for one press. What a frame
//! needs of it are a few curves in `data/`, made from the full solution by a command that their first lines name.

pub mod curves;
mod field;
mod format;
mod products;
mod slide;
mod table;

use std::sync::{Arc, LazyLock};

use crate::{Contact, Load, SceneError};
use curves::{Curves, DiscMotion, Pose};
use slide::Gauge;

/// Half the distance between the posts that hold the film, in mm (the paper's a = 14 mm).
pub const HALF_SIDE_MM: f64 = 14.0;
/// The largest force that the curves of [`Family::Force`] hold for, N.
pub const MAX_FORCE_N: f64 = 0.5;
/// The largest force that the others hold for, N.
pub const MAX_STUCK_N: f64 = 0.3;
/// The normal force that is the size 1 of a tip that slides, N: a little more than the largest along a tilted way.
pub const SLIP_N: f64 = 0.32;
/// The largest of |F_x / F_z| and |F_y / F_z| of a label: tan 12°.
pub const MAX_TANGENT: f64 = 0.212_556_561_670_022_13;
/// How far from the middle, along x and along y, the tip may first touch the film, mm.
pub const MAX_OFFSET_MM: f64 = 0.25;

/// Below this the film answers in proportion to the force (bending alone holds it), and so does a slide, N.
const SLIGHT_N: f64 = 2e-4;

/// A set of curves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// By the tip's force: the size is (|F| / 0.5 N)^⅓, the tilt is F_x and F_y over −F_z; the tip's vector is its way.
    Force,
    /// By the way of a tip that the film sticks to: the size is (force along the way / 0.3 N)^⅓, the tilt is the way's
    /// sideways part over its depth; the tip's vector is the sideways force on the film and minus the depth.
    Stick,
    /// By force again, as far as it takes for a tip that slides: the size is (−F_z / 0.32 N)^⅓, the tilt is F_x and F_y
    /// over −F_z up to a ratio of 1, and the tip is farther from the middle.
    Slip,
}

impl Family {
    /// All of them.
    pub const ALL: [Family; 3] = [Family::Force, Family::Stick, Family::Slip];

    /// Its name: that of its file in `data/`.
    pub fn name(self) -> &'static str {
        match self {
            Family::Force => "force",
            Family::Stick => "stick",
            Family::Slip => "slip",
        }
    }

    /// The tilt of a pose of this size: what sideways force over normal force, or sideways way over depth, is in
    /// parts of the largest.
    ///
    /// A film that sticks answers to a sideways way in another manner once one side of it goes slack, which is at a
    /// tangent of about half the depth over half the span; stretched by asinh about there, its answer is smooth.
    pub fn tilt(self, size: f64, tangents: [f64; 2]) -> [f64; 2] {
        let slack = match self {
            Family::Force => return tangents.map(|part| part / MAX_TANGENT),
            Family::Slip => return tangents,
            Family::Stick => slack(size),
        };
        let [x, y] = tangents;
        let part = (x * x + y * y).sqrt() / slack;
        let stretch = match part < 1e-9 {
            true => 1.0,
            false => libm::asinh(part) / part,
        };
        tangents.map(|tangent| tangent / slack * stretch / libm::asinh(STEEPEST / slack))
    }

    /// The way back.
    pub fn tangents(self, size: f64, tilt: [f64; 2]) -> [f64; 2] {
        let slack = match self {
            Family::Force => return tilt.map(|part| part * MAX_TANGENT),
            Family::Slip => return tilt,
            Family::Stick => slack(size),
        };
        let [x, y] = tilt;
        let part = (x * x + y * y).sqrt() * libm::asinh(STEEPEST / slack);
        let stretch = match part < 1e-9 {
            true => 1.0,
            false => libm::sinh(part) / part,
        };
        tilt.map(|tilt| tilt * slack * stretch * libm::asinh(STEEPEST / slack))
    }

    /// The largest offset of a pose of this size, along x and along y, mm: a tip slides the farther the deeper it is.
    pub fn offset_mm(self, size: f64) -> f64 {
        match self {
            Family::Force | Family::Stick => MAX_OFFSET_MM,
            Family::Slip => 0.36 + 1.9 * size,
        }
    }
}

/// The steepest way of a tip: 12° along x and along y.
const STEEPEST: f64 = std::f64::consts::SQRT_2 * MAX_TANGENT;

/// The tangent at which one side of a film that sticks goes slack; never less than where bending holds it.
fn slack(size: f64) -> f64 {
    0.22 * (size * size + 0.01).sqrt()
}

/// The paper's film model.
static CLAMPED: LazyLock<[Arc<Curves>; 3]> = LazyLock::new(|| {
    [
        committed(include_str!("../../data/force.csv")),
        committed(include_str!("../../data/stick.csv")),
        committed(include_str!("../../data/slip.csv")),
    ]
});

/// The paper's film as it is cut, 40 × 40 mm. There are no curves of it for a tip that sticks.
static OVERHANGING: LazyLock<[Arc<Curves>; 3]> = LazyLock::new(|| {
    let none = || Arc::new(Curves::new([]));
    [
        committed(include_str!("../../data/force-overhang.csv")),
        none(),
        none(),
    ]
});

fn committed(text: &str) -> Arc<Curves> {
    Arc::new(text.parse().expect("the committed curves are curves"))
}

/// The film by its curves: markers within 0.1 px of the full solution at 800×600 in the readings `force` and `slip`, within
/// 0.4 px in `stick` (rms 0.13 px; `film/README.md`); the film between them roughly.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    curves: [Arc<Curves>; 3],
}

impl Default for Film {
    /// The paper's film model: 28 × 28 mm between its posts, nothing beyond.
    fn default() -> Film {
        Film {
            curves: CLAMPED.clone(),
        }
    }
}

impl Film {
    /// The film that reaches so far beyond its posts' centres, mm: 0 or 6 (cut 40 × 40 mm, as the paper's).
    ///
    /// # Errors
    /// When it is another number: there are curves of these two.
    pub fn with_overhang(overhang_mm: f64) -> Result<Film, SceneError> {
        let curves = match overhang_mm {
            0.0 => &CLAMPED,
            6.0 => &OVERHANGING,
            _ => {
                return Err(SceneError::Load(format!(
                    "the film's overhang is {overhang_mm} mm: use 0 or 6, of which there are curves"
                )));
            }
        };
        Ok(Film {
            curves: LazyLock::force(curves).clone(),
        })
    }

    /// The same film with other curves.
    pub fn with_curves(mut self, family: Family, curves: Curves) -> Film {
        self.curves[family as usize] = Arc::new(curves);
        self
    }

    /// Whether the film can take this load.
    ///
    /// # Errors
    /// When the load is outside what the curves hold for.
    pub fn check(&self, load: &Load) -> Result<(), SceneError> {
        if load.magnitude_n() == 0.0 {
            return Ok(());
        }
        let [x, y, z] = load.vector_n();
        within("|F_x / F_z|", (x / z).abs(), MAX_TANGENT, "(12°)")?;
        within("|F_y / F_z|", (y / z).abs(), MAX_TANGENT, "(12°)")?;
        for part in load.offset_mm() {
            within("the tip's offset", part.abs(), MAX_OFFSET_MM, "mm")?;
        }
        let most_n = match load.contact() {
            Contact::Force => MAX_FORCE_N,
            Contact::Stick | Contact::Slip { .. } => MAX_STUCK_N,
        };
        within("|F|", load.magnitude_n(), most_n, "N")?;
        if load.contact() != Contact::Force && self.curves(Family::Stick).count() == 0 {
            return Err(SceneError::Load(
                "this film has curves for the contact reading `force` only: use another overhang"
                    .into(),
            ));
        }
        Ok(())
    }

    /// The film under a load that [`Film::check`] accepts. Under another one it stays at the curves' limit.
    pub fn press(&self, load: &Load) -> Pressed {
        if load.magnitude_n() == 0.0 {
            return Pressed {
                touches_mm: load.offset_mm(),
                ..Pressed::default()
            };
        }
        match load.contact() {
            Contact::Force => self.by_force(load),
            Contact::Stick => self.stick(load),
            Contact::Slip { mu } => self.slip(load, mu),
        }
    }

    fn by_force(&self, load: &Load) -> Pressed {
        let [x, y, z] = load.vector_n();
        let answer = self.curves(Family::Force).at(&Pose {
            size: libm::cbrt(load.magnitude_n() / MAX_FORCE_N).min(1.0),
            tilt: [x, y].map(|part| (part / -z / MAX_TANGENT).clamp(-1.0, 1.0)),
            offset: load
                .offset_mm()
                .map(|part| (part / MAX_OFFSET_MM).clamp(-1.0, 1.0)),
        });
        Pressed {
            tip_mm: answer.tip,
            force_n: load.vector_n(),
            touches_mm: load.offset_mm(),
            discs: answer.discs,
        }
    }

    fn stick(&self, load: &Load) -> Pressed {
        let gauge = gauge(load);
        let answer = self.curves(Family::Stick).at(&stuck(&gauge));
        let [x, y, z] = answer.tip;
        Pressed {
            tip_mm: [-z * gauge.tangents[0], -z * gauge.tangents[1], z],
            force_n: gauge.force_n([x, y]),
            touches_mm: load.offset_mm(),
            discs: answer.discs,
        }
    }

    fn slip(&self, load: &Load, mu: f64) -> Pressed {
        if load.magnitude_n() < SLIGHT_N {
            return self.slip_slightly(load, mu);
        }
        let gauge = gauge(load);
        let [x, y, _] = self.curves(Family::Stick).tip(&stuck(&gauge));
        let [_, _, z] = gauge.force_n([x, y]);
        if (x * x + y * y).sqrt() <= mu * -z {
            return self.stick(load);
        }
        let slid = gauge.slide(self.curves(Family::Slip), mu, [x, y]);
        slid.unwrap_or_else(|| self.stick(load))
    }

    /// The state of a slight force, in proportion to it.
    fn slip_slightly(&self, load: &Load, mu: f64) -> Pressed {
        let part = load.magnitude_n() / SLIGHT_N;
        let times = |vector: [f64; 3]| vector.map(|component| part * component);
        let whole = self.slip(&load.of_size(SLIGHT_N), mu);
        let offset = load.offset_mm();
        Pressed {
            tip_mm: times(whole.tip_mm),
            force_n: times(whole.force_n),
            touches_mm: [0, 1].map(|c| offset[c] + part * (whole.touches_mm[c] - offset[c])),
            discs: whole.discs.map(|disc| DiscMotion {
                moved_mm: times(disc.moved_mm),
                along_x: times(disc.along_x),
                along_y: times(disc.along_y),
            }),
        }
    }

    fn curves(&self, family: Family) -> &Curves {
        &self.curves[family as usize]
    }
}

/// The pose of a tip that sticks.
fn stuck(gauge: &Gauge) -> Pose {
    let size = libm::cbrt(gauge.force_n / MAX_STUCK_N).min(1.0);
    Pose {
        size,
        tilt: Family::Stick.tilt(size, gauge.tangents),
        offset: gauge
            .offset_mm
            .map(|mm| (mm / MAX_OFFSET_MM).clamp(-1.0, 1.0)),
    }
}

fn gauge(load: &Load) -> Gauge {
    let [x, y, z] = load.vector_n();
    Gauge {
        tangents: [x, y].map(|part| (part / -z).clamp(-MAX_TANGENT, MAX_TANGENT)),
        force_n: load.magnitude_n().min(MAX_STUCK_N),
        offset_mm: load.offset_mm(),
    }
}

/// The film in one state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pressed {
    /// Where the tip went, mm, film frame (z away from the camera: a press goes to z < 0).
    pub tip_mm: [f64; 3],
    /// The tip's force on the film, N.
    pub force_n: [f64; 3],
    /// Which point of the film the tip is on, by where it rests, mm: a tip that slides leaves the load's offset.
    pub touches_mm: [f64; 2],
    /// How the film moved at the markers, by identity.
    pub discs: [DiscMotion; 4],
}

impl Pressed {
    /// Where the point of the film's camera side that rests at (x, y) mm moves, mm, film frame.
    ///
    /// On a marker this is the marker's own motion; elsewhere an interpolation between tip, markers and posts that is
    /// off the full solution by up to 0.4 mm at 0.25 N: good for a thing that distracts, not for one that measures.
    pub fn displacement(&self, rest_mm: [f64; 2]) -> [f64; 3] {
        field::displacement(self, rest_mm)
    }
}

fn within(what: &str, value: f64, most: f64, unit: &str) -> Result<(), SceneError> {
    // Angles come back from a vector with a rounding.
    if value <= most * (1.0 + 1e-9) {
        return Ok(());
    }
    Err(SceneError::Load(format!(
        "{what} is {value} {unit} and the film's curves hold up to {most}: press less, or straighter"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(force_n: f64, alpha_deg: f64, beta_deg: f64) -> Load {
        Load::from_angles(force_n, alpha_deg, beta_deg).unwrap()
    }

    #[test]
    fn beyond_the_curves_is_refused() {
        let film = Film::default();
        let refused = |f, a, b| film.check(&load(f, a, b)).unwrap_err().to_string();
        assert!(refused(0.51, 0.0, 0.0).contains("|F| is 0.51 N"));
        assert!(refused(0.2, -12.5, 0.0).contains("|F_x / F_z|"));
        assert!(refused(0.2, 0.0, 12.5).contains("|F_y / F_z|"));
        assert_eq!(film.check(&load(0.5, 12.0, -10.0)), Ok(()));
        assert_eq!(film.check(&Load::REST), Ok(()));
    }

    #[test]
    fn tilts_are_tangents_and_back() {
        for family in Family::ALL {
            for size in [1e-6, 0.1, 1.0] {
                for tangents in [[0.0; 2], [1e-12, 0.0], [0.1, -0.05]] {
                    let tilt = family.tilt(size, tangents);
                    let back = family.tangents(size, tilt);
                    for (there, again) in tangents.iter().zip(back) {
                        assert!((there - again).abs() < 1e-12, "{family:?} {tangents:?}");
                    }
                }
            }
        }
        let [x, y] = Family::Stick.tilt(0.5, [MAX_TANGENT; 2]);
        assert!((x * x + y * y - 1.0).abs() < 1e-12);
    }

    #[test]
    fn no_force_moves_nothing() {
        let film = Film::default();
        assert_eq!(film.press(&Load::REST), Pressed::default());
        let slight = film.press(&load(1e-9, 0.0, 0.0)).tip_mm[2];
        assert!(slight.abs() < 1e-4, "{slight}");
    }

    #[test]
    fn the_tip_goes_as_deep_as_the_full_solution_says() {
        let depth = |force_n| -Film::default().press(&load(force_n, 0.0, 0.0)).tip_mm[2];
        for (force_n, expected) in [(0.01, 1.96), (0.1, 4.71), (0.2, 6.03)] {
            assert!((depth(force_n) - expected).abs() < 0.006, "{force_n} N");
        }
    }

    #[test]
    fn mirrored_loads_move_mirrored_markers() {
        let film = Film::default();
        let [right, left] = [6.0, -6.0].map(|alpha| film.press(&load(0.2, alpha, 3.0)));
        for (a, b) in [(0, 1), (3, 2)] {
            let (a, b) = (right.discs[a], left.discs[b]);
            for at in [[0.0, 0.0], [0.3, 0.1]] {
                let [x, y, z] = a.at(at);
                let [mx, my, mz] = b.at([-at[0], at[1]]);
                assert!((x + mx).abs() < 1e-12 && (y - my).abs() < 1e-12);
                assert!((z - mz).abs() < 1e-12);
            }
        }
    }
}
