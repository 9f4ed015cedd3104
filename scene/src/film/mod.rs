//! Where the film goes when it is pressed.
//!
//! The film is a nonlinear shell; its finite elements (`film/`) take a third of a second for one press. What a frame
//! needs of it are a few curves in `data/`, made from the full solution by a command that their first lines name.

pub mod curves;
mod field;
mod format;
mod products;
mod travel;

use std::sync::{Arc, LazyLock};

use crate::{Contact, Load, SceneError};
use curves::{Curves, DiscMotion, Pose};
use travel::{Gauge, Travel};

/// Half the distance between the posts that hold the film, in mm (the paper's a = 14 mm).
pub const HALF_SIDE_MM: f64 = 14.0;
/// The largest force that the curves of [`Family::Force`] hold for, N.
pub const MAX_FORCE_N: f64 = 0.5;
/// The deepest travel that the others hold for, mm: 0.3 N.
pub const MAX_DEPTH_MM: f64 = 7.0;
/// The largest of |F_x / F_z| and |F_y / F_z| of a label: tan 12°.
pub const MAX_TANGENT: f64 = 0.212_556_561_670_022_13;
/// How far from the middle, along x and along y, the tip may first touch the film, mm.
pub const MAX_OFFSET_MM: f64 = 0.25;

/// Below this, the curves do not tell sideways from normal force well enough to find where a tip slides, N.
const SLIGHT_N: f64 = 6e-3;

/// A set of curves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// By the tip's force: the size is (|F| / 0.5 N)^⅓, the tilt is F_x and F_y over −F_z; the tip's vector is its way.
    Force,
    /// By the tip's travel, the film stuck to it: the size is its depth, the tilt is sideways travel over depth; the
    /// tip's vector is its force on the film.
    Stick,
    /// The same for a tip that has slid: less sideways travel, but farther from the middle.
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

    /// The tilt of a pose of this size: what sideways force over normal force, or sideways travel over depth, is in
    /// parts of the largest.
    ///
    /// A film that sticks answers to sideways travel in another way once one side of it goes slack, which is at a
    /// tangent of about half the depth over half the span; stretched by asinh about there, its answer is smooth.
    pub fn tilt(self, size: f64, tangents: [f64; 2]) -> [f64; 2] {
        let Some((slack, most)) = self.slack(size) else {
            return tangents.map(|part| part / MAX_TANGENT);
        };
        let [x, y] = tangents;
        let part = (x * x + y * y).sqrt() / slack;
        let stretch = match part < 1e-9 {
            true => 1.0,
            false => libm::asinh(part) / part,
        };
        tangents.map(|tangent| tangent / slack * stretch / libm::asinh(most / slack))
    }

    /// The way back.
    pub fn tangents(self, size: f64, tilt: [f64; 2]) -> [f64; 2] {
        let Some((slack, most)) = self.slack(size) else {
            return tilt.map(|part| part * MAX_TANGENT);
        };
        let [x, y] = tilt;
        let part = (x * x + y * y).sqrt() * libm::asinh(most / slack);
        let stretch = match part < 1e-9 {
            true => 1.0,
            false => libm::sinh(part) / part,
        };
        tilt.map(|tilt| tilt * slack * stretch * libm::asinh(most / slack))
    }

    /// Where one side goes slack, and the largest tangent of all, for travels of a size.
    fn slack(self, size: f64) -> Option<(f64, f64)> {
        let slack = 0.22 * size.max(1e-9);
        match self {
            Family::Force => None,
            Family::Stick => Some((slack, std::f64::consts::SQRT_2 * MAX_TANGENT)),
            Family::Slip => Some((slack, 0.16)),
        }
    }

    /// The largest offset of a pose, along x and along y, mm.
    pub fn offset_mm(self) -> f64 {
        match self {
            Family::Force | Family::Stick => MAX_OFFSET_MM,
            Family::Slip => 1.75,
        }
    }
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

/// The film by its curves: markers within 0.1 px of the full solution at 800×600 in the reading `force`, within 0.4 px in
/// `stick` and 0.8 px in `slip` (rms 0.11 and 0.15 px; `film/README.md`); the film between them roughly.
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
        match load.contact() {
            Contact::Force => within("|F|", load.magnitude_n(), MAX_FORCE_N, "N"),
            Contact::Stick => self.stick(load).map(drop),
            Contact::Slip { mu } => self.slip(load, mu).map(drop),
        }
    }

    /// The film under a load that [`Film::check`] accepts. Under another one it stays at the curves' limit.
    pub fn press(&self, load: &Load) -> Pressed {
        if load.magnitude_n() == 0.0 {
            return Pressed {
                touches_mm: load.offset_mm(),
                ..Pressed::default()
            };
        }
        let pressed = match load.contact() {
            Contact::Force => Ok(self.by_force(load)),
            Contact::Stick => self.stick(load),
            Contact::Slip { mu } => self.slip(load, mu),
        };
        let limit = |_| self.travel(Family::Stick).stuck(&gauge(load), MAX_DEPTH_MM);
        pressed.unwrap_or_else(limit)
    }

    fn by_force(&self, load: &Load) -> Pressed {
        let [x, y, z] = load.vector_n();
        let answer = self.curves[Family::Force as usize].at(&Pose {
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

    fn stick(&self, load: &Load) -> Result<Pressed, SceneError> {
        if self.curves[Family::Stick as usize].count() == 0 {
            return Err(SceneError::Load(
                "this film has curves for the contact reading `force` only: use another overhang"
                    .into(),
            ));
        }
        let stuck = self.travel(Family::Stick).stick(&gauge(load));
        stuck.ok_or_else(|| {
            SceneError::Load(format!(
                "|F| is {} N and moves the tip deeper than {MAX_DEPTH_MM} mm, where the film's curves end: press less",
                load.magnitude_n()
            ))
        })
    }

    fn slip(&self, load: &Load, mu: f64) -> Result<Pressed, SceneError> {
        let stuck = self.stick(load)?;
        if load.magnitude_n() < SLIGHT_N {
            return self.slip_slightly(load, mu, &stuck);
        }
        let [x, y, z] = stuck.force_n;
        if (x * x + y * y).sqrt() <= mu * -z {
            return Ok(stuck);
        }
        let slid = self.travel(Family::Slip).slide(&gauge(load), mu, &stuck);
        slid.ok_or_else(|| {
            SceneError::Load(format!(
                "|F| is {} N and slides at a friction ratio of {mu} to where the film's curves end: press less, or \
                 straighter",
                load.magnitude_n()
            ))
        })
    }

    /// The state of a slight force, in proportion to the depth to which a tip that sticks would go.
    fn slip_slightly(&self, load: &Load, mu: f64, stuck: &Pressed) -> Result<Pressed, SceneError> {
        let slight = load.of_size(SLIGHT_N);
        let depth_mm = self.stick(&slight)?.tip_mm[2];
        let [x, y] = load.offset_mm();
        let whole = self.slip(&slight, mu)?;
        let (by_depth, by_force) = (stuck.tip_mm[2] / depth_mm, load.magnitude_n() / SLIGHT_N);
        let times = |vector: [f64; 3]| vector.map(|part| by_depth * part);
        let [tx, ty] = whole.touches_mm;
        Ok(Pressed {
            tip_mm: times(whole.tip_mm),
            force_n: whole.force_n.map(|part| by_force * part),
            touches_mm: [x + by_depth * (tx - x), y + by_depth * (ty - y)],
            discs: whole.discs.map(|disc| DiscMotion {
                moved_mm: times(disc.moved_mm),
                along_x: times(disc.along_x),
                along_y: times(disc.along_y),
            }),
        })
    }

    fn travel(&self, family: Family) -> Travel<'_> {
        Travel {
            curves: &self.curves[family as usize],
            family,
        }
    }
}

fn gauge(load: &Load) -> Gauge {
    let [x, y, z] = load.vector_n();
    Gauge {
        tangents: [x, y].map(|part| part / -z),
        force_n: load.magnitude_n(),
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
        assert!(slight <= 0.0 && slight > -1e-3, "{slight}");
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
