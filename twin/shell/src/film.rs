//! The film under a tip: finds its equilibrium for each contact.

use std::borrow::Cow;
use std::sync::Arc;

use crate::answers::Beside;
use crate::design::tip_points;
use crate::grid::Grid;
use crate::newton::{Guide, Problem, Solution};
use crate::point::{V3, cross, dot};
use crate::shell::Shell;
use crate::sparse::{COMPONENTS, Factors, Solver};
use crate::{Design, Patch, ShellError};

/// A slack film is first pushed by this much, mm, to decide the side on which it bulges.
const PUSH_MM: f64 = 1e-2;

/// The tip's action on the film (`docs/architecture.md` has the frame: z away from the camera, a
/// press has F_z < 0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Contact {
    /// The tip presses with this force (N) and goes where the film lets it: the `force` reading.
    Force([f64; 3]),
    /// The tip goes this far (mm, from the flat mounted film) with the film stuck to it, at
    /// whatever force that needs.
    Travel([f64; 3]),
    /// From the film at rest the tip moves along a direction (of any length) with the film stuck to
    /// it. It stops when the force along that direction is `force_n`, as a gauge on a stage reads
    /// it: the `stick` reading.
    Stick {
        /// The tip's direction of travel; its third component is < 0.
        direction: [f64; 3],
        /// The force along the direction, N.
        force_n: f64,
        /// The distance that the tip has slid over the film since the start of its travel, mm. The
        /// film lags behind the tip by this.
        slid_mm: [f64; 2],
    },
}

/// A tip's place and size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tip {
    /// Its middle on the mounted film, mm.
    pub place_mm: [f64; 2],
    /// The radius of its disc, mm.
    pub radius_mm: f64,
}

/// The contact on a film.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Touched {
    /// A tip.
    Tip(Tip),
    /// A pressure of any shape.
    Patch(Arc<Patch>),
}

impl Touched {
    /// Returns the shares of each coefficient of a grid.
    pub(crate) fn shares(&self, grid: &Grid) -> Vec<f64> {
        match self {
            Touched::Tip(tip) => tip_shares(grid, tip.place_mm, tip.radius_mm),
            Touched::Patch(patch) => point_shares(grid, patch.points()),
        }
    }

    /// Returns it shifted along x or y by some mm.
    pub(crate) fn shifted(&self, way: usize, by_mm: f64) -> Touched {
        match self {
            Touched::Tip(tip) => {
                let mut tip = *tip;
                tip.place_mm[way] += by_mm;
                Touched::Tip(tip)
            }
            Touched::Patch(patch) => Touched::Patch(Arc::new(patch.shifted(way, by_mm))),
        }
    }

    /// Returns the tip with a larger radius, mm. A patch has none.
    pub(crate) fn grown(&self, by_mm: f64) -> Option<Touched> {
        match self {
            Touched::Tip(tip) => Some(Touched::Tip(Tip {
                radius_mm: tip.radius_mm + by_mm,
                ..*tip
            })),
            Touched::Patch(_) => None,
        }
    }
}

/// A film ready to be pressed; threads can share it.
pub struct Film {
    design: Design,
    shell: Shell,
    solver: Arc<Solver>,
    /// The share of each coefficient in the tip's mean displacement.
    tip: Vec<f64>,
    /// The unknowns at rest, mm, with the number of steps that found them.
    rest: Solution,
    around: Beside,
}

/// A film at rest or pressed.
#[derive(Clone, Debug)]
pub struct Equilibrium {
    pub(crate) unknowns: Vec<f64>,
    pub(crate) touched: Touched,
    /// The displacement of the tip's disc from the flat mounted film, mm (the mean over the disc or
    /// the patch, weighted as its force).
    pub tip_mm: [f64; 3],
    /// The tip's or the patch's force on the film, N.
    pub force_n: [f64; 3],
    /// The posts' force on the film, N.
    pub reaction_n: [f64; 3],
    /// Number of Newton steps that found it.
    pub steps: usize,
}

impl Film {
    /// Prepares the film of a design and finds its rest.
    ///
    /// # Errors
    /// If the design is impossible ([`Design::check`]), memory runs out, or the film finds no rest.
    pub fn new(design: &Design) -> Result<Film, ShellError> {
        design.check()?;
        let shell = design.shell(None);
        let solver = Arc::new(Solver::new(shell.pattern())?);
        Film::of(design, shell, solver, None)
    }

    /// Returns the film of another design with as many cells as this one, independent of
    /// [`Design::cells`]. Its rest is found from this one's, and this film's states are valid
    /// starts for its own.
    ///
    /// # Errors
    /// As [`Film::new`].
    pub fn changed(&self, design: &Design) -> Result<Film, ShellError> {
        let design = Design {
            cells: Some(self.design.cells()),
            ..design.clone()
        };
        design.check()?;
        let shell = design.shell(Some(self.shell.pattern()));
        Film::of(
            &design,
            shell,
            Arc::clone(&self.solver),
            Some(&self.rest.unknowns),
        )
    }

    fn of(
        design: &Design,
        shell: Shell,
        solver: Arc<Solver>,
        start: Option<&[f64]>,
    ) -> Result<Film, ShellError> {
        Ok(Film {
            tip: tip_shares(shell.grid(), design.tip_offset_mm, design.tip_radius_mm),
            rest: rest_of(design, &shell, &solver, start)?,
            design: design.clone(),
            shell,
            solver,
            around: Beside::default(),
        })
    }

    /// Moves the tip to another place (mm from the centre). States found before stay valid starts.
    ///
    /// # Errors
    /// If the tip would press on a post.
    pub fn move_tip(&mut self, offset_mm: [f64; 2], radius_mm: f64) -> Result<(), ShellError> {
        self.check_tip(offset_mm, radius_mm)?;
        self.tip = tip_shares(self.shell.grid(), offset_mm, radius_mm);
        self.design.tip_offset_mm = offset_mm;
        self.design.tip_radius_mm = radius_mm;
        Ok(())
    }

    fn check_tip(&self, offset_mm: [f64; 2], radius_mm: f64) -> Result<(), ShellError> {
        self.design.check_tip_at(offset_mm, radius_mm)
    }

    /// Returns the design that the film was made from.
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// Returns the number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.shell.grid().unknowns()
    }

    /// Returns the film at rest. It is flat if it is neither stretched nor heavy. A slack,
    /// weightless film bulges towards the camera.
    pub fn rest(&self) -> Equilibrium {
        let unknowns = self.rest.unknowns.clone();
        Equilibrium {
            tip_mm: mean(&self.tip, &unknowns),
            touched: Touched::Tip(self.own_tip()),
            force_n: [0.0; 3],
            reaction_n: self.shell.reaction(&unknowns),
            steps: self.rest.steps,
            unknowns,
        }
    }

    /// Returns the film under a contact, found from the state `start`. That is a state of this film
    /// or of another with as many cells; a nearer one makes the search quicker.
    ///
    /// # Errors
    /// If the contact's numbers are not finite, its direction is zero, no equilibrium is found, or
    /// the start belongs to another mesh.
    pub fn press(&self, contact: Contact, start: &Equilibrium) -> Result<Equilibrium, ShellError> {
        self.press_touched(Touched::Tip(self.own_tip()), contact, start)
    }

    /// As [`Film::press`], with the tip at another place, mm on the mounted film, and with another
    /// radius, mm.
    ///
    /// # Errors
    /// As [`Film::press`], and if the tip would press on a post.
    pub fn press_at(
        &self,
        place_mm: [f64; 2],
        radius_mm: f64,
        contact: Contact,
        start: &Equilibrium,
    ) -> Result<Equilibrium, ShellError> {
        self.check_tip(place_mm, radius_mm)?;
        let tip = Tip {
            place_mm,
            radius_mm,
        };
        self.press_touched(Touched::Tip(tip), contact, start)
    }

    /// Returns the film under a force, N, of a tip with its design's radius at a point of the film,
    /// mm. It is found from a nearby state if there is one, otherwise from rest.
    ///
    /// # Errors
    /// As [`Film::press_at`].
    pub fn press_force(
        &self,
        place_mm: [f64; 2],
        force_n: [f64; 3],
        start: &Equilibrium,
    ) -> Result<Equilibrium, ShellError> {
        let from = |start: &Equilibrium| {
            self.press_at(
                place_mm,
                self.design.tip_radius_mm,
                Contact::Force(force_n),
                start,
            )
        };
        from(start).or_else(|_| from(&self.rest()))
    }

    pub(crate) fn press_touched(
        &self,
        touched: Touched,
        contact: Contact,
        start: &Equilibrium,
    ) -> Result<Equilibrium, ShellError> {
        self.fits(start)?;
        let shares = self.shares_of(&touched);
        let (force, guides) = self.asked(contact, mean(&shares, &self.rest.unknowns))?;
        let guided: Vec<V3> = guides.iter().map(|(direction, _)| *direction).collect();
        let problem = Problem {
            shell: &self.shell,
            load: weighted(&shares, &force),
            guides: guides
                .iter()
                .map(|(direction, target_mm)| Guide {
                    weights: weighted(&shares, direction),
                    target_mm: *target_mm,
                })
                .collect(),
        };
        let solution = problem.solve(&self.solver, &start.unknowns)?;
        let tip_mm = mean(&shares, &solution.unknowns);
        drop(shares);
        Ok(self.equilibrium(solution, force, &guided, (touched, tip_mm)))
    }

    /// Returns the displacement, mm, of the point of the camera-side surface of the mounted film at
    /// (x, y) mm, relative to the flat mounted film. That surface is half the thickness below the
    /// middle surface, along its normal. The motion since rest is the difference to the
    /// displacement in [`Film::rest`].
    pub fn displacement(&self, state: &Equilibrium, point_mm: [f64; 2]) -> [f64; 3] {
        self.surface(state, point_mm, 0.0)
    }

    /// As [`Film::displacement`], for a film that is `thicker_mm` thicker.
    pub(crate) fn surface(
        &self,
        state: &Equilibrium,
        point_mm: [f64; 2],
        thicker_mm: f64,
    ) -> [f64; 3] {
        let grid = self.shell.grid();
        let place = grid.place(point_mm);
        let [mut a1, mut a2] = grid.gradients(&state.unknowns, &place);
        a1[0] += 1.0;
        a2[1] += 1.0;
        let area = cross(&a1, &a2);
        let size = dot(&area, &area).sqrt();
        let half = self.half_mm(point_mm, size, thicker_mm);
        let flat = self.half_mm(point_mm, 1.0, thicker_mm);
        let [dx, dy, dz] = grid.interpolate(&state.unknowns, &place);
        let [x, y, z] = area.map(|part| half * part / size);
        [dx - x, dy - y, dz + flat - z]
    }

    /// Returns half of the thickness at a point whose area is `size` times that of the flat mounted
    /// film. Rubber gets thinner as it is stretched.
    pub(crate) fn half_mm(&self, point_mm: [f64; 2], size: f64, thicker_mm: f64) -> f64 {
        let sheet = self.shell.sheet();
        let [across, down] = sheet.scales();
        let rubber = sheet.law.neo_hooke;
        let thinned = 1.0 - rubber + rubber / (across * down * size);
        0.5 * (sheet.material.thickness_mm + thicker_mm) * sheet.relative(point_mm) * thinned
    }

    /// Returns half of the flat mounted film's thickness at a point, mm: the distance of its
    /// camera-side surface from its middle plane.
    pub fn half_thickness_mm(&self, point_mm: [f64; 2]) -> f64 {
        self.half_mm(point_mm, 1.0, 0.0)
    }

    /// Returns the point of the mounted film (its coordinates in the flat film, mm) whose camera
    /// side is at (x, y) mm in a state, for example at rest. The inverse of [`Film::lab_place`].
    pub fn material_point(&self, state: &Equilibrium, lab_mm: [f64; 2]) -> [f64; 2] {
        let mut point = lab_mm;
        for _ in 0..100 {
            let there = self.lab_place(state, point);
            let gap = [0, 1].map(|c| lab_mm[c] - there[c]);
            point = [0, 1].map(|c| point[c] + gap[c]);
            if gap.iter().all(|part| part.abs() < 1e-13) {
                break;
            }
        }
        point
    }

    /// Returns (x, y), mm, of the camera side of a point of the mounted film in a state.
    pub fn lab_place(&self, state: &Equilibrium, point_mm: [f64; 2]) -> [f64; 2] {
        let [x, y, _] = self.displacement(state, point_mm);
        [point_mm[0] + x, point_mm[1] + y]
    }

    /// Returns the force on the tip, and the directions with a prescribed travel (mm).
    fn asked(&self, contact: Contact, at_rest: V3) -> Result<(V3, Vec<(V3, f64)>), ShellError> {
        match contact {
            Contact::Force(force) => finite("force", force).map(|force| (force, Vec::new())),
            Contact::Travel(travel) => {
                let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
                let travel = finite("travel", travel)?;
                Ok(([0.0; 3], axes.into_iter().zip(travel).collect()))
            }
            Contact::Stick {
                direction,
                force_n,
                slid_mm: [x, y],
            } => {
                finite("force", [force_n; 3])?;
                let lag = finite("slide", [at_rest[0] - x, at_rest[1] - y, at_rest[2]])?;
                let along = unit(finite("direction", direction)?)?;
                let sides = across(&along).map(|side| (side, dot(&side, &lag)));
                Ok((along.map(|part| force_n * part), sides.to_vec()))
            }
        }
    }

    pub(crate) fn equilibrium(
        &self,
        solution: Solution,
        load: V3,
        guided: &[V3],
        (touched, tip_mm): (Touched, V3),
    ) -> Equilibrium {
        let mut force_n = load;
        for (direction, size) in guided.iter().zip(&solution.guide_n) {
            for (sum, part) in force_n.iter_mut().zip(direction) {
                *sum += size * part;
            }
        }
        Equilibrium {
            tip_mm,
            touched,
            force_n,
            reaction_n: self.shell.reaction(&solution.unknowns),
            unknowns: solution.unknowns,
            steps: solution.steps,
        }
    }
}

impl Film {
    /// Returns the factored stiffness of a state.
    pub(crate) fn factors_at(&self, state: &Equilibrium) -> Result<Factors, ShellError> {
        let stiffness = self.shell.stiffness(&state.unknowns);
        let factors = self.solver.factor(self.shell.pattern(), &stiffness);
        factors.ok_or_else(|| ShellError::Solver("the film is not stable".into()))
    }

    pub(crate) fn shell(&self) -> &Shell {
        &self.shell
    }

    pub(crate) fn solver(&self) -> &Solver {
        &self.solver
    }

    pub(crate) fn around(&self) -> &Beside {
        &self.around
    }

    fn own_tip(&self) -> Tip {
        Tip {
            place_mm: self.design.tip_offset_mm,
            radius_mm: self.design.tip_radius_mm,
        }
    }

    /// Returns the shares of each coefficient in the contact.
    pub(crate) fn shares_of(&self, touched: &Touched) -> Cow<'_, [f64]> {
        let grid = self.shell.grid();
        match touched {
            Touched::Tip(tip) if *tip == self.own_tip() => Cow::Borrowed(&self.tip),
            other => Cow::Owned(other.shares(grid)),
        }
    }

    /// Rejects a state of another mesh.
    pub(crate) fn fits(&self, state: &Equilibrium) -> Result<(), ShellError> {
        let (own, other) = (self.unknowns(), state.unknowns.len());
        if own == other {
            return Ok(());
        }
        Err(ShellError::Contact(format!(
            "a state of {other} unknowns does not fit a film of {own}: start from a film with as \
             many cells"
        )))
    }
}

/// Finds a film's rest from `start` or from the flat film.
fn rest_of(
    design: &Design,
    shell: &Shell,
    solver: &Solver,
    start: Option<&[f64]>,
) -> Result<Solution, ShellError> {
    let unknowns = shell.grid().unknowns();
    if design.stretch == [0.0; 2] && design.down == [0.0; 3] {
        return Ok(Solution {
            unknowns: vec![0.0; unknowns],
            guide_n: Vec::new(),
            steps: 0,
        });
    }
    let mut from = start.map_or_else(|| vec![0.0; unknowns], <[f64]>::to_vec);
    let slack = design.stretch.iter().any(|part| *part < 0.0);
    if slack
        && from
            .iter()
            .skip(2)
            .step_by(COMPONENTS)
            .all(|part| part.abs() < PUSH_MM)
    {
        let way = if design.down[2] > 0.0 { 1.0 } else { -1.0 };
        let [columns, rows] = shell.grid().functions();
        let bulge = |k: usize, count: usize| {
            let along = k as f64 / (count - 1) as f64;
            (std::f64::consts::PI * along).sin()
        };
        for (k, u) in from.chunks_mut(COMPONENTS).enumerate() {
            u[2] += way * PUSH_MM * bulge(k % columns, columns) * bulge(k / columns, rows);
        }
    }
    let problem = Problem {
        shell,
        load: vec![0.0; unknowns],
        guides: Vec::new(),
    };
    problem.solve(solver, &from)
}

impl Equilibrium {
    /// Returns the film's unknowns, mm.
    pub(crate) fn unknowns(&self) -> &[f64] {
        &self.unknowns
    }

    /// Returns the state at a place of a path, predicted by the polynomial through known states: a
    /// start for [`Film::press`]. Returns `None` if `path` is empty.
    pub fn extrapolated(path: &[(f64, &Equilibrium)], at: f64) -> Option<Equilibrium> {
        let mut state = (*path.last()?.1).clone();
        state.unknowns.fill(0.0);
        for (k, (place, known)) in path.iter().enumerate() {
            let others = path.iter().enumerate().filter(|(other, _)| *other != k);
            let parts = others.map(|(_, (other, _))| (at - other) / (place - other));
            let weight: f64 = parts.product();
            for (sum, part) in state.unknowns.iter_mut().zip(&known.unknowns) {
                *sum += weight * part;
            }
        }
        Some(state)
    }
}

/// Returns Σ share · displacement.
pub(crate) fn mean(shares: &[f64], unknowns: &[f64]) -> V3 {
    let mut sum = [0.0; 3];
    for (share, u) in shares.iter().zip(unknowns.chunks(COMPONENTS)) {
        for (total, part) in sum.iter_mut().zip(u) {
            *total += share * part;
        }
    }
    sum
}

/// Returns a vector at each coefficient, times the coefficient's share.
pub(crate) fn weighted(shares: &[f64], vector: &V3) -> Vec<f64> {
    let parts = shares
        .iter()
        .flat_map(|share| vector.map(|part| share * part));
    parts.collect()
}

/// Returns the shares of a tip's force on each coefficient.
pub(crate) fn tip_shares(grid: &Grid, place_mm: [f64; 2], radius_mm: f64) -> Vec<f64> {
    point_shares(grid, &tip_points(place_mm, radius_mm))
}

/// Returns the shares on each coefficient of a force that acts on points, mm, by their weights.
pub(crate) fn point_shares(grid: &Grid, points: &[([f64; 2], f64)]) -> Vec<f64> {
    let mut shares = vec![0.0; grid.unknowns() / COMPONENTS];
    for &(point, share) in points {
        let place = grid.place(point);
        for (local, value) in place.values.iter().enumerate() {
            shares[grid.coefficient(place.origin, local)] += share * value;
        }
    }
    shares
}

pub(crate) fn finite(what: &str, vector: V3) -> Result<V3, ShellError> {
    if vector.iter().all(|part| part.is_finite()) {
        return Ok(vector);
    }
    Err(ShellError::Contact(format!(
        "{what} is {vector:?}: use finite numbers"
    )))
}

fn unit(vector: V3) -> Result<V3, ShellError> {
    let length = dot(&vector, &vector).sqrt();
    if length > 0.0 && vector[2] < 0.0 {
        return Ok(vector.map(|part| part / length));
    }
    Err(ShellError::Contact(format!(
        "direction is {vector:?}: a tip presses towards the camera, which is z < 0"
    )))
}

/// Returns two unit vectors perpendicular to a unit vector that is not along x.
fn across(along: &V3) -> [V3; 2] {
    let [x, y, z] = *along;
    let size = (y * y + z * z).sqrt();
    let first = [0.0, -z / size, y / size];
    let second = [size, -x * y / size, -x * z / size];
    [first, second]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(fineness: f64) -> Film {
        let design = Design {
            fineness,
            ..Design::default()
        };
        Film::new(&design).unwrap()
    }

    fn pressed(film: &Film, contact: Contact) -> Equilibrium {
        film.press(contact, &film.rest()).unwrap()
    }

    fn close(a: [f64; 3], b: [f64; 3], tolerance: f64) {
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < tolerance, "{a} {b}");
        }
    }

    #[test]
    fn posts_carry_the_load() {
        let film = film(0.5);
        for force in [[0.0, 0.0, -0.01], [0.05, -0.03, -0.2], [0.0, 0.02, -1.0]] {
            let state = pressed(&film, Contact::Force(force));
            assert_eq!(state.force_n, force);
            close(state.reaction_n, force.map(|part| -part), 1e-9);
        }
    }

    #[test]
    fn a_normal_press_is_symmetric() {
        let film = film(0.5);
        let state = pressed(&film, Contact::Force([0.0, 0.0, -0.2]));
        for (x, y) in [(3.717, 3.717), (8.0, 2.0), (13.0, 0.5)] {
            let [dx, dy, dz] = film.displacement(&state, [x, y]);
            assert!(dz < -0.1);
            close(film.displacement(&state, [-x, y]), [-dx, dy, dz], 1e-8);
            close(film.displacement(&state, [x, -y]), [dx, -dy, dz], 1e-8);
            // Points of posts lie by columns, therefore the symmetry at the diagonal is less exact.
            close(film.displacement(&state, [y, x]), [dy, dx, dz], 1e-6);
        }
    }

    #[test]
    fn force_and_travel_are_two_views_of_one_state() {
        let film = film(0.5);
        let force = [0.02, -0.01, -0.15];
        let by_force = pressed(&film, Contact::Force(force));
        let by_travel = pressed(&film, Contact::Travel(by_force.tip_mm));
        close(by_travel.force_n, force, 1e-8);
        close(by_travel.tip_mm, by_force.tip_mm, 1e-9);
        let direction = [0.1, 0.05, -1.0];
        let stuck = pressed(
            &film,
            Contact::Stick {
                direction,
                force_n: 0.1,
                slid_mm: [0.0; 2],
            },
        );
        let [x, y, z] = stuck.tip_mm;
        assert!((x + 0.1 * z).abs() < 1e-9 && (y + 0.05 * z).abs() < 1e-9);
        let along = unit(direction).unwrap();
        assert!((dot(&stuck.force_n, &along) - 0.1).abs() < 1e-9);
        close(
            pressed(&film, Contact::Force(stuck.force_n)).tip_mm,
            stuck.tip_mm,
            1e-7,
        );
    }

    #[test]
    #[ignore = "10 s: full solutions"]
    fn the_mesh_converges() {
        let depth = |fineness| {
            let film = film(fineness);
            pressed(&film, Contact::Force([0.0, 0.0, -0.2])).tip_mm[2]
        };
        let [coarse, middle, fine] = [0.5, 1.0, 1.4].map(depth);
        assert!(
            (fine - middle).abs() < 0.006 && (fine - middle).abs() < (middle - coarse).abs() / 4.0
        );
    }

    #[test]
    #[ignore = "10 s: full solutions"]
    fn a_thin_film_takes_force_with_the_cube_of_depth() {
        let mut design = Design {
            fineness: 0.5,
            ..Design::default()
        };
        design.material.thickness_mm = 0.01;
        let film = Film::new(&design).unwrap();
        // Shallow for the film, but a hundred times its thickness.
        let force = |depth: f64| pressed(&film, Contact::Travel([0.0, 0.0, -depth])).force_n[2];
        let order = (force(1.0) / force(0.5)).log2();
        println!("thin film: force with depth to the {order:.3}");
        assert!((order - 3.0).abs() < 0.1, "{order}");
    }

    #[test]
    fn what_cannot_be_pressed_is_refused() {
        let film = film(0.25);
        let refused = |contact| film.press(contact, &film.rest()).unwrap_err().to_string();
        assert!(refused(Contact::Force([0.0, f64::NAN, 0.0])).contains("finite"));
        assert!(refused(Contact::Travel([f64::INFINITY, 0.0, 0.0])).contains("finite"));
        for direction in [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]] {
            let contact = Contact::Stick {
                direction,
                force_n: 0.1,
                slid_mm: [0.0; 2],
            };
            assert!(refused(contact).contains("z < 0"));
        }
    }
}
