//! The film of a unit under a load.

use std::sync::{Arc, LazyLock};

use crate::disc::Disc;
use crate::film::label::{Felt, Reached, Stage};
use crate::film::reduced::{
    LARGEST_RADIUS_MM, LARGEST_SIZE, LARGEST_TILT, Pose, SMALLEST_RADIUS_MM, Tables, Unit, Weight,
};
use crate::film::whole::{MAX_TIP_MM, WholeFilm};
use crate::film::{Contact, DiscMotion, Dots, FilmError, Layout, Load, field};
use crate::film::{MARKER_CENTRES_MM, MARKER_RADIUS_MM};

/// Half the distance between the posts that hold the film, in mm (the paper's a = 14 mm).
pub const HALF_SIDE_MM: f64 = 14.0;
/// The largest force for which the film's tables hold, N.
pub const MAX_FORCE_N: f64 = 0.25;
/// The largest ratio of tangential to normal force.
pub const MAX_RATIO: f64 = 0.8;
/// The largest distance of a tip's place from the middle, along x and along y, mm, on a film with
/// the nominal dots.
pub const MAX_PLACE_MM: f64 = 5.0;
/// The largest label if the tip sticks or slides, N. The force on the film is larger.
pub const MAX_LABEL_N: f64 = 0.22;
/// The largest of |F_x / F_z| and |F_y / F_z| of a label if the tip sticks or slides: tan 12°.
pub const MAX_TANGENT: f64 = 0.212_556_561_670_022_13;
/// The largest distance from the middle, along x and along y, at which such a tip may first touch
/// the film, mm.
pub const MAX_OFFSET_MM: f64 = 0.25;

/// The nominal film.
static NOMINAL: LazyLock<Film> = LazyLock::new(|| {
    let tables = Tables::from_bytes(include_bytes!("../../data/film.bin"));
    Film {
        tables: Arc::new(tables.expect("the committed tables are a film's")),
        unit: Unit::default(),
        down: None,
        layout: Layout::default(),
    }
});

/// The effect of the nominal film's own weight.
static WEIGHT: LazyLock<Weight> = LazyLock::new(|| {
    let weight = Weight::from_bytes(include_bytes!("../../data/weight.bin"));
    weight.expect("the committed table is one of weight")
});

/// The largest difference of a direction's length from 1.
const UNIT_LENGTH: f64 = 1e-3;

/// The film, computed from its tables. Its markers are within 0.1 px of the full solution at
/// 320×240 (`shell/README.md`); between them the film is approximate.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    tables: Arc<Tables>,
    unit: Unit,
    /// Direction of gravity in parts of g; `None` means that the film weighs nothing.
    down: Option<[f64; 3]>,
    layout: Layout,
}

impl Default for Film {
    /// Returns the nominal film: the paper's, 28 × 28 mm between its posts.
    fn default() -> Film {
        NOMINAL.clone()
    }
}

impl Film {
    /// Returns the film of one unit.
    ///
    /// # Errors
    /// If the unit differs more from the nominal one than the tables allow.
    pub fn of(unit: Unit) -> Result<Film, FilmError> {
        unit.check()?;
        Ok(Film {
            unit,
            ..NOMINAL.clone()
        })
    }

    /// Returns the same film with its weight, held so that gravity pulls along `down`, a unit
    /// vector in the film's frame. With `None` it weighs nothing. Markers are within 0.1 px of the
    /// full solution (`shell/README.md`) at rest and from 20 mN on.
    ///
    /// # Errors
    /// If `down` is not a unit vector, or the dots are not the nominal ones.
    pub fn with_down(self, down: Option<[f64; 3]>) -> Result<Film, FilmError> {
        let length = |[x, y, z]: [f64; 3]| libm::sqrt(x * x + y * y + z * z);
        let length = down.map_or(1.0, length);
        if !(1.0 - UNIT_LENGTH..=1.0 + UNIT_LENGTH).contains(&length) {
            return Err(FilmError::Load(format!(
                "down is {length} long: use a vector of length 1, such as [0, 0, -1]"
            )));
        }
        let down = down.map(|down| down.map(|part| part / length));
        let layout = self.layout;
        Film { down, ..self }.with_layout(layout)
    }

    /// Returns the same film with other dots. Dots other than the nominal ones move by the tables
    /// of the whole film.
    ///
    /// # Errors If the film has a weight, whose effect is known for the nominal dots alone.
    pub fn with_layout(self, layout: Layout) -> Result<Film, FilmError> {
        if layout.is_nominal() || self.down.is_none() {
            return Ok(Film { layout, ..self });
        }
        Err(FilmError::Layout(
            "the film has a weight, and what that does is known of the layout 4 alone: leave \
             down out, or use the layout 4"
                .to_owned(),
        ))
    }

    /// Returns the film's dots.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Returns the largest distance of a tip's place from the middle, along x and along y, mm.
    pub fn most_place_mm(&self) -> f64 {
        match self.layout.is_nominal() {
            true => MAX_PLACE_MM,
            false => MAX_TIP_MM,
        }
    }

    /// Checks that the film can take this load.
    ///
    /// # Errors
    /// If the load is outside the range of the tables.
    pub fn check(&self, load: &Load) -> Result<(), FilmError> {
        let radius = load.tip_radius_mm();
        if !(SMALLEST_RADIUS_MM..=LARGEST_RADIUS_MM).contains(&radius) {
            return Err(FilmError::Load(format!(
                "the tip's radius is {radius} mm: use {SMALLEST_RADIUS_MM} to {LARGEST_RADIUS_MM}"
            )));
        }
        if load.magnitude_n() == 0.0 {
            return Ok(());
        }
        let [x, y, z] = load.vector_n();
        if load.contact() == Contact::Force {
            within(
                "the tangential over the normal force",
                libm::hypot(x, y) / -z,
                MAX_RATIO,
                "",
            )?;
            for part in load.offset_mm() {
                within("the tip's offset", part.abs(), self.most_place_mm(), "mm")?;
            }
            return within("|F|", load.magnitude_n(), MAX_FORCE_N, "N");
        }
        if self.down.is_some() {
            return Err(FilmError::Load(format!(
                "the contact is {} and the film has a weight: what its tip's way means is known \
                 of a weightless film alone; use the contact force, or leave down out",
                load.contact()
            )));
        }
        within("|F_x / F_z|", (x / z).abs(), MAX_TANGENT, "(12°)")?;
        within("|F_y / F_z|", (y / z).abs(), MAX_TANGENT, "(12°)")?;
        for part in load.offset_mm() {
            within("the tip's offset", part.abs(), MAX_OFFSET_MM, "mm")?;
        }
        within("|F|", load.magnitude_n(), MAX_LABEL_N, "N")
    }

    /// Returns the film under a load that [`Film::check`] accepts. Under any other load the film
    /// stays at the limit of the tables.
    pub fn press(&self, load: &Load) -> Pressed {
        self.press_dots(load, |_| true)
    }

    /// As [`Film::press`], for a look at a disc of the film: where the tables of the whole film
    /// give the motion, dots that have no part in the disc's are left at rest.
    pub(crate) fn press_around(&self, load: &Load, disc: &Disc) -> Pressed {
        let reach_mm = field::reach_mm(self.layout.diameter_mm() / 2.0) + 2.0 * disc.radius_mm;
        self.press_dots(load, |[x, y]| {
            let [to_x, to_y] = disc.centre_mm;
            self.layout.is_nominal() || libm::hypot(x - to_x, y - to_y) < reach_mm
        })
    }

    /// Returns the film under a load. Dots whose places, mm, are not wanted are left at rest.
    fn press_dots(&self, load: &Load, is_wanted: impl Fn([f64; 2]) -> bool) -> Pressed {
        let pressed = self.pressed(load, is_wanted);
        match self.down {
            None => pressed,
            Some(down) => self.weighted(pressed, down),
        }
    }

    /// As [`Film::press_dots`], without the film's weight.
    fn pressed(&self, load: &Load, is_wanted: impl Fn([f64; 2]) -> bool) -> Pressed {
        if load.magnitude_n() == 0.0 {
            return Pressed {
                touches_mm: load.offset_mm(),
                ..self.at_rest()
            };
        }
        let (pose, force_n) = self.reached(load);
        let at_rest = self.at_rest();
        let disc = |k| match is_wanted(self.marker_mm(k)) {
            true => self.disc(&pose, load, k),
            false => DiscMotion::default(),
        };
        Pressed {
            tip_mm: self.tip_mm(&pose, load.tip_radius_mm()),
            force_n,
            touches_mm: pose.place_mm,
            discs: Dots::from_fn(self.layout.count(), disc),
            whole: at_rest.whole.map(|_| pose),
            ..at_rest
        }
    }

    /// Returns the film at rest, without its weight.
    fn at_rest(&self) -> Pressed {
        let centres_mm = self.markers_mm();
        Pressed {
            centres_mm,
            discs: centres_mm.map(|_| DiscMotion::default()),
            radius_mm: self.layout.diameter_mm() / 2.0,
            whole: (!self.layout.is_nominal()).then(Pose::default),
            ..Pressed::default()
        }
    }

    /// Returns the motion of the film around a marker under a load with this pose.
    fn disc(&self, pose: &Pose, load: &Load, marker: usize) -> DiscMotion {
        if self.layout.is_nominal() {
            return (self.tables).disc(pose, load.tip_radius_mm(), &self.unit, marker);
        }
        let disc = Disc {
            centre_mm: self.marker_mm(marker),
            radius_mm: self.layout.diameter_mm() / 2.0,
        };
        WholeFilm::nominal().disc(pose, load.tip_radius_mm(), &self.unit, &disc)
    }

    /// Returns the displacement of a tip of a radius, mm.
    fn tip_mm(&self, pose: &Pose, radius_mm: f64) -> [f64; 3] {
        match self.layout.is_nominal() {
            true => self.tables.tip_mm(pose, radius_mm),
            false => WholeFilm::nominal().tip_mm(pose, radius_mm, &self.unit),
        }
    }

    /// Adds the effect of the weight to a pressed film.
    fn weighted(&self, mut pressed: Pressed, down: [f64; 3]) -> Pressed {
        let pose = self.pose(pressed.force_n, pressed.touches_mm);
        let mut sag_mm = 0.0;
        for (k, disc) in pressed.discs.iter_mut().enumerate() {
            let more = WEIGHT.disc(&pose, down, &self.unit, k);
            *disc = sum(disc, &more);
            sag_mm += more.moved_mm[2] / 4.0;
        }
        pressed.tip_mm[2] += field::from_markers(sag_mm, pressed.touches_mm);
        pressed
    }

    /// Returns the motion of the film around one marker, by its identity. It is the marker's part
    /// of [`Self::press`], without the other markers and the tip.
    pub fn marker_motion(&self, load: &Load, marker: usize) -> DiscMotion {
        let mut pose = Pose::default();
        let mut disc = DiscMotion::default();
        if load.magnitude_n() > 0.0 {
            (pose, _) = self.reached(load);
            disc = self.disc(&pose, load, marker);
        }
        match self.down {
            None => disc,
            Some(down) => sum(&disc, &WEIGHT.disc(&pose, down, &self.unit, marker)),
        }
    }

    /// Returns the pose and the force on the film, N, that a pressing load leads to.
    fn reached(&self, load: &Load) -> (Pose, [f64; 3]) {
        match load.contact() {
            Contact::Force => (
                self.pose(load.vector_n(), load.offset_mm()),
                load.vector_n(),
            ),
            Contact::Stick => self.on_stage(load, MAX_RATIO),
            Contact::Slip { mu } => self.on_stage(load, mu),
        }
    }

    /// Returns the pose of a force, N, at a place, mm. It is clamped to the limits of the tables.
    fn pose(&self, force_n: [f64; 3], place_mm: [f64; 2]) -> Pose {
        let stiffness = self.unit.bending_and_stretching();
        let mut pose = Pose::of_force(force_n, place_mm, stiffness);
        let steep = libm::hypot(pose.tilt[0], pose.tilt[1]) / LARGEST_TILT;
        pose.size = pose.size.min(LARGEST_SIZE);
        pose.tilt = pose.tilt.map(|part| part / steep.max(1.0));
        pose
    }

    /// Returns the pose and the force on the film, N, of a label whose tip is on a stage.
    fn on_stage(&self, load: &Load, friction: f64) -> (Pose, [f64; 3]) {
        let [x, y, z] = load.vector_n();
        let stage = Stage {
            tangents: [x, y].map(|part| (part / -z).clamp(-MAX_TANGENT, MAX_TANGENT)),
            force_n: load.magnitude_n().min(MAX_LABEL_N),
            offset_mm: load.offset_mm(),
            friction,
        };
        let under = Under {
            film: self,
            radius_mm: load.tip_radius_mm(),
        };
        let Reached { pose, magnitude_n } = stage.reach(&under);
        (pose, pose.direction().map(|part| magnitude_n * part))
    }

    /// Returns the places of the markers' centres at rest, by identity, mm.
    pub fn markers_mm(&self) -> Dots<[f64; 2]> {
        Dots::from_fn(self.layout.count(), |k| self.marker_mm(k))
    }

    fn marker_mm(&self, marker: usize) -> [f64; 2] {
        let (place, shift) = (
            self.layout.centres_mm().at(marker),
            self.unit.markers_mm.at(marker),
        );
        [0, 1].map(|c| place[c] + shift[c])
    }
}

/// A film under a tip of one radius.
struct Under<'a> {
    film: &'a Film,
    radius_mm: f64,
}

impl Felt for Under<'_> {
    fn tip_mm(&self, pose: &Pose) -> [f64; 3] {
        self.film.tip_mm(pose, self.radius_mm)
    }

    fn size_of(&self, force_n: f64) -> f64 {
        self.film.pose([0.0, 0.0, -force_n], [0.0; 2]).size
    }
}

/// The film in one state: at rest or under a load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressed {
    /// The tip's displacement, mm, film frame (z away from the camera: a press goes to z < 0).
    pub tip_mm: [f64; 3],
    /// The tip's force on the film, N.
    pub force_n: [f64; 3],
    /// The point of the film that the tip touches, given by its place at rest, mm. It differs from
    /// the load's offset if the tip slides.
    pub touches_mm: [f64; 2],
    /// The markers' centres at rest, by identity, mm.
    pub centres_mm: Dots<[f64; 2]>,
    /// The motion of the film at the markers, by identity.
    pub discs: Dots<DiscMotion>,
    /// The markers' radius, mm.
    pub radius_mm: f64,
    /// The load by which the tables of the whole film give the motion between the markers; `None`
    /// where it is interpolated.
    pub whole: Option<Pose>,
}

impl Default for Pressed {
    /// The nominal film at rest.
    fn default() -> Pressed {
        Pressed {
            tip_mm: [0.0; 3],
            force_n: [0.0; 3],
            touches_mm: [0.0; 2],
            centres_mm: MARKER_CENTRES_MM.into(),
            discs: [DiscMotion::default(); 4].into(),
            radius_mm: MARKER_RADIUS_MM,
            whole: None,
        }
    }
}

impl Pressed {
    /// Returns the displacement, mm, film frame, of the point of the film's camera side that rests
    /// at (x, y) mm.
    ///
    /// On a marker this is the marker's own motion. Elsewhere it is an interpolation between tip,
    /// markers and posts, with errors up to 0.4 mm against the full solution at 0.25 N. That is
    /// good enough for things that distract, not for things that measure.
    pub fn displacement(&self, rest_mm: [f64; 2]) -> [f64; 3] {
        field::displacement(self, rest_mm)
    }
}

fn sum(a: &DiscMotion, b: &DiscMotion) -> DiscMotion {
    let sum = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|c| a[c] + b[c]);
    DiscMotion {
        moved_mm: sum(a.moved_mm, b.moved_mm),
        along_x: sum(a.along_x, b.along_x),
        along_y: sum(a.along_y, b.along_y),
    }
}

fn within(what: &str, value: f64, most: f64, unit: &str) -> Result<(), FilmError> {
    // Angles computed from a vector have a rounding error.
    if value <= most * (1.0 + 1e-9) {
        return Ok(());
    }
    Err(FilmError::Load(format!(
        "{what} is {value} {unit} and the film's tables hold up to {most}: press less, or \
         straighter"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn load(force_n: f64, alpha_deg: f64, beta_deg: f64) -> Load {
        Load::from_angles(force_n, alpha_deg, beta_deg).unwrap()
    }

    #[test]
    fn beyond_the_tables_is_refused() {
        let film = Film::default();
        let refused = |f, a, b| film.check(&load(f, a, b)).unwrap_err().to_string();
        assert!(refused(0.26, 0.0, 0.0).contains("|F| is 0.26 N"));
        assert!(refused(0.2, -30.0, 30.0).contains("tangential"));
        assert_eq!(film.check(&load(0.25, 30.0, -20.0)), Ok(()));
        let far = load(0.2, 0.0, 0.0).with_offset_mm([0.0, 5.1]).unwrap();
        assert!(
            film.check(&far)
                .unwrap_err()
                .to_string()
                .contains("offset is 5.1")
        );
        let blunt = load(0.2, 0.0, 0.0).with_tip_radius_mm(2.5).unwrap();
        assert!(
            film.check(&blunt)
                .unwrap_err()
                .to_string()
                .contains("radius is 2.5")
        );
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
    fn one_marker_alone_moves_as_with_the_others() {
        let mut unit = Unit::default();
        (unit.thickness, unit.posts_mm[1]) = (1.1, [0.2, -0.1]);
        unit.markers_mm[2] = [0.1, 0.3];
        let film = Film::of(unit).unwrap();
        let off = load(0.1, 8.0, -3.0).with_offset_mm([1.0, 2.5]).unwrap();
        let stuck = load(0.2, 4.0, 0.0).with_contact(Contact::Stick).unwrap();
        for load in &[Load::REST, off, stuck] {
            let discs = film.press(load).discs;
            for (marker, disc) in discs.iter().enumerate() {
                assert_eq!(film.marker_motion(load, marker), *disc);
            }
        }
    }

    /// Bit for bit: at every disc that is on, beside or far from a dot.
    #[test]
    fn a_look_at_one_disc_is_as_one_at_the_whole_film() {
        let pressed = load(0.15, 6.0, -3.0).with_offset_mm([1.8, 0.9]).unwrap();
        for layout in ["4", "8v"] {
            let film = Film::default()
                .with_layout(layout.parse().unwrap())
                .unwrap();
            let whole = film.press(&pressed);
            let dots = film.markers_mm();
            let centres = dots.iter().flat_map(|[x, y]| {
                [0.0, 0.4, 1.1, 1.9, 2.2, 2.9].map(|beside| [x + beside, y - 0.3 * beside])
            });
            for centre_mm in centres {
                let radius_mm = 0.5;
                let around = film.press_around(
                    &pressed,
                    &Disc {
                        centre_mm,
                        radius_mm,
                    },
                );
                for corner in crate::disc::rim(centre_mm, radius_mm) {
                    assert_eq!(around.displacement(corner), whole.displacement(corner));
                }
            }
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
