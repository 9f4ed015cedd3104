//! Where the film goes when it is pressed.
//!
//! The film is a nonlinear shell; its finite elements (`film/`) take a third of a second for one press. What a frame
//! needs of it are a few curves in `data/`, and for a tip that sticks a grid of solutions, made from the full solution by a
//! command that their first lines name.

pub mod curves;
mod field;
mod format;
mod products;
mod slide;
pub mod stuck;
mod table;

use std::sync::{Arc, LazyLock};

use crate::{Contact, Load, SceneError};
use curves::{Curves, DiscMotion, Pose};
use slide::Gauge;
use stuck::{Solved, Stuck};

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
    /// By force again, as far as it takes for a tip that slides: the size is (−F_z / 0.32 N)^⅓, the tilt is F_x and F_y
    /// over −F_z up to a ratio of 1, and the tip is farther from the middle.
    Slip,
}

impl Family {
    /// All of them.
    pub const ALL: [Family; 2] = [Family::Force, Family::Slip];

    /// Its name: that of its file in `data/`.
    pub fn name(self) -> &'static str {
        match self {
            Family::Force => "force",
            Family::Slip => "slip",
        }
    }

    /// F_x and F_y over −F_z of a pose's tilt.
    pub fn tangents(self, tilt: [f64; 2]) -> [f64; 2] {
        match self {
            Family::Force => tilt.map(|part| part * MAX_TANGENT),
            Family::Slip => tilt,
        }
    }

    /// The largest offset of a pose of this size, along x and along y, mm: a tip slides the farther the deeper it is.
    pub fn offset_mm(self, size: f64) -> f64 {
        match self {
            Family::Force => MAX_OFFSET_MM,
            Family::Slip => 0.36 + 1.9 * size,
        }
    }
}

/// The paper's film model.
static CLAMPED: LazyLock<Film> = LazyLock::new(|| Film {
    force: committed(include_str!("../../data/force.csv")),
    stick: Some(Arc::new(solved(include_str!("../../data/stick.csv")))),
    slip: committed(include_str!("../../data/slip.csv")),
});

/// The paper's film as it is cut, 40 × 40 mm. It is not known under a tip that sticks.
static OVERHANGING: LazyLock<Film> = LazyLock::new(|| Film {
    force: committed(include_str!("../../data/force-overhang.csv")),
    stick: None,
    slip: Arc::new(Curves::new([])),
});

fn committed(text: &str) -> Arc<Curves> {
    Arc::new(text.parse().expect("the committed curves are curves"))
}

fn solved(text: &str) -> Stuck {
    let solved = text
        .parse::<Solved>()
        .and_then(|solved| Stuck::new(&solved));
    solved.expect("the committed solutions are a grid")
}

/// The film by its curves and solutions: markers within 0.07 px of the full solution at 800×600 (`film/README.md`); the
/// film between them roughly.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    force: Arc<Curves>,
    stick: Option<Arc<Stuck>>,
    slip: Arc<Curves>,
}

impl Default for Film {
    /// The paper's film model: 28 × 28 mm between its posts, nothing beyond.
    fn default() -> Film {
        CLAMPED.clone()
    }
}

impl Film {
    /// The film that reaches so far beyond its posts' centres, mm: 0 or 6 (cut 40 × 40 mm, as the paper's).
    ///
    /// # Errors
    /// When it is another number: there are curves of these two.
    pub fn with_overhang(overhang_mm: f64) -> Result<Film, SceneError> {
        match overhang_mm {
            0.0 => Ok(CLAMPED.clone()),
            6.0 => Ok(OVERHANGING.clone()),
            _ => Err(SceneError::Load(format!(
                "the film's overhang is {overhang_mm} mm: use 0 or 6, of which there are curves"
            ))),
        }
    }

    /// The same film with other curves.
    pub fn with_curves(mut self, family: Family, curves: Curves) -> Film {
        match family {
            Family::Force => self.force = Arc::new(curves),
            Family::Slip => self.slip = Arc::new(curves),
        }
        self
    }

    /// The same film with another answer to a tip that sticks.
    pub fn with_stuck(mut self, stuck: Stuck) -> Film {
        self.stick = Some(Arc::new(stuck));
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
        if load.contact() != Contact::Force && self.stick.is_none() {
            return Err(SceneError::Load(
                "this film has curves for the contact reading `force` only: use another overhang"
                    .into(),
            ));
        }
        Ok(())
    }

    /// The film under a load that [`Film::check`] accepts. Under another one it stays at the curves' limit.
    pub fn press(&self, load: &Load) -> Pressed {
        match (load.contact(), &self.stick) {
            _ if load.magnitude_n() == 0.0 => at_rest(load),
            (Contact::Force, _) => self.by_force(load),
            (Contact::Stick, Some(stuck)) => {
                let gauge = gauge(load);
                gauge.stuck(&gauge.placed(stuck))
            }
            (Contact::Slip { mu }, Some(stuck)) => self.slip(stuck, load, mu),
            (_, None) => at_rest(load),
        }
    }

    fn by_force(&self, load: &Load) -> Pressed {
        let [x, y, z] = load.vector_n();
        let answer = self.force.at(&Pose {
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

    fn slip(&self, stuck: &Stuck, load: &Load, mu: f64) -> Pressed {
        if load.magnitude_n() < SLIGHT_N {
            return self.slip_slightly(stuck, load, mu);
        }
        let gauge = gauge(load);
        let start = gauge.start(&self.slip, mu);
        if start.is_sure()
            && let Some(slid) = gauge.slide(&self.slip, &start)
        {
            return slid;
        }
        let placed = gauge.placed(stuck);
        if gauge.is_held(&placed, mu) {
            return gauge.stuck(&placed);
        }
        let slid = gauge.slide(&self.slip, &start);
        slid.unwrap_or_else(|| gauge.stuck(&placed))
    }

    /// The state of a slight force, in proportion to it.
    fn slip_slightly(&self, stuck: &Stuck, load: &Load, mu: f64) -> Pressed {
        let part = load.magnitude_n() / SLIGHT_N;
        let times = |vector: [f64; 3]| vector.map(|component| part * component);
        let whole = self.slip(stuck, &load.of_size(SLIGHT_N), mu);
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
}

fn at_rest(load: &Load) -> Pressed {
    Pressed {
        touches_mm: load.offset_mm(),
        ..Pressed::default()
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
