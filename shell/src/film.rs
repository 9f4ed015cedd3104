//! The film under a tip.

use crate::answers::{Change, Neighbours};
use crate::newton::{Guide, Problem, Solution};
use crate::point::{V3, dot, normal};
use crate::shell::Shell;
use crate::sparse::{COMPONENTS, Factors, Solver};
use crate::{Design, ShellError};

/// What the tip does to the film (`docs/architecture.md` has the frame: z away from the camera, a
/// press has F_z < 0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Contact {
    /// It presses with this force (N) and goes where the film lets it: the `force` reading.
    Force([f64; 3]),
    /// It goes this far (mm) with the film stuck to it, whatever the force.
    Travel([f64; 3]),
    /// It moves along a direction (of any length) with the film stuck to it, until the force along
    /// that direction is `force_n`, as a gauge on a stage reads it: the `stick` reading.
    Stick {
        /// Where the tip moves; its third part < 0.
        direction: [f64; 3],
        /// The force along it, N.
        force_n: f64,
        /// How far the tip has slid over the film from where its way began, mm: the film lags
        /// behind it by so much.
        slid_mm: [f64; 2],
    },
}

/// One tip among several that press at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Its force on the film, N; a press has F_z < 0.
    pub force_n: [f64; 3],
    /// Where it meets the film at rest, mm from the middle.
    pub at_mm: [f64; 2],
    /// Radius of the disc over which it spreads its force, mm.
    pub radius_mm: f64,
}

/// A film ready to be pressed.
pub struct Film {
    design: Design,
    shell: Shell,
    solver: Solver,
    /// The share of each coefficient in the tip's mean displacement.
    tip: Vec<f64>,
}

/// A film at rest or pressed.
#[derive(Clone, Debug)]
pub struct Equilibrium {
    unknowns: Vec<f64>,
    /// Where the tip's disc went (mean over it, weighted as its force), mm.
    pub tip_mm: [f64; 3],
    /// The tip's force on the film, N.
    pub force_n: [f64; 3],
    /// The posts' force on the film, N.
    pub reaction_n: [f64; 3],
    /// Newton steps that it took.
    pub steps: usize,
}

impl Film {
    /// Prepares the film of a design.
    ///
    /// # Errors
    /// When the design cannot be ([`Design::check`]), or memory runs out.
    pub fn new(design: &Design) -> Result<Film, ShellError> {
        design.check()?;
        let shell = design.shell();
        let solver = Solver::new(shell.pattern())?;
        let tip = tip_shares(&shell, design);
        Ok(Film {
            design: design.clone(),
            shell,
            solver,
            tip,
        })
    }

    /// Puts the tip elsewhere (mm from the centre). States found before stay good to start from.
    ///
    /// # Errors
    /// When the tip would press on a post.
    pub fn move_tip(&mut self, offset_mm: [f64; 2], radius_mm: f64) -> Result<(), ShellError> {
        let design = Design {
            tip_offset_mm: offset_mm,
            tip_radius_mm: radius_mm,
            ..self.design.clone()
        };
        design.check()?;
        self.tip = tip_shares(&self.shell, &design);
        self.design = design;
        Ok(())
    }

    /// What it was made from.
    pub fn design(&self) -> &Design {
        &self.design
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.shell.grid().unknowns()
    }

    /// The film at rest.
    pub fn rest(&self) -> Equilibrium {
        Equilibrium {
            unknowns: vec![0.0; self.unknowns()],
            tip_mm: [0.0; 3],
            force_n: [0.0; 3],
            reaction_n: [0.0; 3],
            steps: 0,
        }
    }

    /// The film under a contact, found from the state `start` (of this film; the nearer, the
    /// quicker).
    ///
    /// # Errors
    /// When the contact's numbers are not finite, its direction is none, or no equilibrium is
    /// found.
    pub fn press(&self, contact: Contact, start: &Equilibrium) -> Result<Equilibrium, ShellError> {
        let (force, guides) = self.asked(contact)?;
        let guided: Vec<V3> = guides.iter().map(|(direction, _)| *direction).collect();
        let problem = Problem {
            shell: &self.shell,
            load: weighted(&self.tip, &force),
            guides: guides
                .iter()
                .map(|(direction, target_mm)| Guide {
                    weights: weighted(&self.tip, direction),
                    target_mm: *target_mm,
                })
                .collect(),
        };
        let solution = problem.solve(&self.solver, &start.unknowns)?;
        Ok(self.equilibrium(solution, force, &guided))
    }

    /// The film under several tips at once, each with a force of its own, found from rest. What the
    /// state calls its tip is where the design has it.
    ///
    /// # Errors
    /// When a touch cannot be, or no equilibrium is found.
    pub fn press_all(&self, touches: &[Touch]) -> Result<Equilibrium, ShellError> {
        let (mut load, mut sum_n) = (vec![0.0; self.unknowns()], [0.0; 3]);
        for touch in touches {
            let force_n = finite("force", touch.force_n)?;
            let design = Design {
                tip_offset_mm: touch.at_mm,
                tip_radius_mm: touch.radius_mm,
                ..self.design.clone()
            };
            design.check()?;
            let shares = self.shares(&design);
            for (sum, part) in load.iter_mut().zip(weighted(&shares, &force_n)) {
                *sum += part;
            }
            sum_n = [0, 1, 2].map(|i| sum_n[i] + force_n[i]);
        }
        let problem = Problem {
            shell: &self.shell,
            load,
            guides: Vec::new(),
        };
        let solution = problem.solve(&self.solver, &self.rest().unknowns)?;
        Ok(self.equilibrium(solution, sum_n, &[]))
    }

    /// How the camera-side surface point that rests at (x, y) mm moves, mm: half the thickness
    /// below the middle surface, along its normal.
    pub fn displacement(&self, state: &Equilibrium, rest_mm: [f64; 2]) -> [f64; 3] {
        self.surface(state, rest_mm, self.design.material.thickness_mm / 2.0)
    }

    /// The same of the surface that is `half` mm below the middle one.
    pub(crate) fn surface(&self, state: &Equilibrium, rest_mm: [f64; 2], half: f64) -> [f64; 3] {
        let grid = self.shell.grid();
        let place = grid.place(rest_mm);
        let [mut a1, mut a2] = grid.gradients(&state.unknowns, &place);
        a1[0] += 1.0;
        a2[1] += 1.0;
        let n = normal(&a1, &a2);
        let [dx, dy, dz] = grid.interpolate(&state.unknowns, &place);
        [dx - half * n[0], dy - half * n[1], dz + half * (1.0 - n[2])]
    }

    /// The force on the tip, and directions in which its travel is given (mm).
    fn asked(&self, contact: Contact) -> Result<(V3, Vec<(V3, f64)>), ShellError> {
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
                let lag = finite("slide", [-x, -y, 0.0])?;
                let along = unit(finite("direction", direction)?)?;
                let sides = across(&along).map(|side| (side, dot(&side, &lag)));
                Ok((along.map(|part| force_n * part), sides.to_vec()))
            }
        }
    }

    fn equilibrium(&self, solution: Solution, load: V3, guided: &[V3]) -> Equilibrium {
        let mut force_n = load;
        for (direction, size) in guided.iter().zip(&solution.guide_n) {
            for (sum, part) in force_n.iter_mut().zip(direction) {
                *sum += size * part;
            }
        }
        Equilibrium {
            tip_mm: mean(&self.tip, &solution.unknowns),
            force_n,
            reaction_n: self.shell.reaction(&solution.unknowns),
            unknowns: solution.unknowns,
            steps: solution.steps,
        }
    }
}

/// How a state's tip and unknowns answer to a small change.
pub struct Response {
    unknowns: Vec<f64>,
    /// The tip's way, mm per unit.
    pub tip_mm: V3,
}

impl Film {
    /// The factored stiffness of a state.
    pub(crate) fn factors_at(&self, state: &Equilibrium) -> Result<Factors, ShellError> {
        let at = self.shell.derivatives(&state.unknowns);
        let factors = self.solver.factor(self.shell.pattern(), &at.stiffness);
        factors.ok_or_else(|| ShellError::Solver("the film is not stable".into()))
    }

    pub(crate) fn shell(&self) -> &Shell {
        &self.shell
    }

    /// The response whose unknowns change so, as far as the tip stays where it is.
    pub(crate) fn response(&self, unknowns: Vec<f64>) -> Response {
        Response {
            tip_mm: mean(&self.tip, &unknowns),
            unknowns,
        }
    }

    /// The tip's shares of another design on this mesh.
    pub(crate) fn shares(&self, design: &Design) -> Vec<f64> {
        tip_shares(&self.shell, design)
    }

    /// The displacement of what `shares` weigh, mm.
    pub(crate) fn mean(&self, shares: &[f64], state: &Equilibrium) -> V3 {
        mean(shares, &state.unknowns)
    }

    /// A force at the tip on each unknown, N.
    pub(crate) fn load(&self, force: &V3) -> Vec<f64> {
        weighted(&self.tip, force)
    }

    /// A force on each unknown by its share, N.
    pub(crate) fn spread(shares: &[f64], force: &V3) -> Vec<f64> {
        weighted(shares, force)
    }

    /// How a state answers to one more newton along x, y and z, and to a tip that touches the film
    /// one millimetre farther along x and y with the force kept: its derivatives.
    ///
    /// # Errors
    /// When the stiffness is not positive definite: a force would not hold the film there.
    pub fn responses(&self, state: &Equilibrium) -> Result<[Response; 5], ShellError> {
        let load: Vec<Change> = Change::all().take(5).collect();
        let beside = Neighbours::of(&self.design);
        let answers = self.answers(&beside, state, &load)?;
        answers
            .try_into()
            .map_err(|_| ShellError::Solver("five changes have five answers".into()))
    }

    /// The state beside this one that a response foretells, `units` away; only its unknowns are
    /// changed.
    pub fn beside(&self, state: &Equilibrium, response: &Response, units: f64) -> Equilibrium {
        let mut there = state.clone();
        for (u, part) in there.unknowns.iter_mut().zip(&response.unknowns) {
            *u += units * part;
        }
        there
    }
}

impl Response {
    /// How a state answers to several changes at once.
    pub fn to_all(responses: &[Response; 5], changes: [f64; 5]) -> Response {
        let mut sum = Response {
            unknowns: vec![0.0; responses[0].unknowns.len()],
            tip_mm: [0.0; 3],
        };
        for (response, change) in responses.iter().zip(changes) {
            for (total, part) in sum.unknowns.iter_mut().zip(&response.unknowns) {
                *total += change * part;
            }
            for (total, part) in sum.tip_mm.iter_mut().zip(response.tip_mm) {
                *total += change * part;
            }
        }
        sum
    }

    /// The largest part of it.
    pub fn size(&self) -> f64 {
        let parts = self.unknowns.iter();
        parts.fold(0.0, |most, part| most.max(part.abs()))
    }
}

impl Equilibrium {
    /// The film's unknowns, mm.
    pub(crate) fn unknowns(&self) -> &[f64] {
        &self.unknowns
    }

    /// The state at a place of a path that the polynomial through some known states of it
    /// foretells: a start for [`Film::press`]. `None` of none.
    pub fn foretold(path: &[(f64, &Equilibrium)], at: f64) -> Option<Equilibrium> {
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

/// Σ share · displacement.
fn mean(shares: &[f64], unknowns: &[f64]) -> V3 {
    let mut sum = [0.0; 3];
    for (share, u) in shares.iter().zip(unknowns.chunks(COMPONENTS)) {
        for (total, part) in sum.iter_mut().zip(u) {
            *total += share * part;
        }
    }
    sum
}

/// A vector on each coefficient by its share.
fn weighted(shares: &[f64], vector: &V3) -> Vec<f64> {
    let parts = shares
        .iter()
        .flat_map(|share| vector.map(|part| share * part));
    parts.collect()
}

fn tip_shares(shell: &Shell, design: &Design) -> Vec<f64> {
    let grid = shell.grid();
    let mut shares = vec![0.0; grid.unknowns() / COMPONENTS];
    for (point, share) in design.tip_points() {
        let place = grid.place(point);
        for (local, value) in place.values.iter().enumerate() {
            shares[grid.coefficient(place.origin, local)] += share * value;
        }
    }
    shares
}

fn finite(what: &str, vector: V3) -> Result<V3, ShellError> {
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

/// Two unit vectors across a unit vector that is not along x.
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
    fn tips_at_once_are_one_where_they_touch_the_same() {
        let film = film(0.5);
        let touch = |force_n, x: f64| Touch {
            force_n,
            at_mm: [x, 0.0],
            radius_mm: 0.5,
        };
        let (part, whole) = ([0.01, 0.0, -0.04], [0.03, 0.0, -0.12]);
        let rest = part.map(|component| 2.0 * component);
        let once = pressed(&film, Contact::Force(whole));
        let both = film
            .press_all(&[touch(part, 0.0), touch(rest, 0.0)])
            .unwrap();
        close(both.force_n, whole, 1e-15);
        close(both.tip_mm, once.tip_mm, 1e-8);
        let apart = film
            .press_all(&[touch(part, -2.0), touch(rest, 2.0)])
            .unwrap();
        close(apart.reaction_n, whole.map(|component| -component), 1e-9);
        assert!(
            apart.tip_mm[2] > once.tip_mm[2],
            "spread, a load goes less deep"
        );
        assert!(film.press_all(&[touch(part, 13.0)]).is_err());
    }

    /// So weak that the film answers in proportion: each touch then adds what it does alone, at its
    /// own place.
    #[test]
    fn faint_touches_add_up() {
        let film = film(0.5);
        let touches = [(-2.0, 1.0, 0.3), (3.0, -0.5, 0.8)].map(|(x, y, radius_mm)| Touch {
            force_n: [2e-6 * x, 1e-6, -1e-5],
            at_mm: [x, y],
            radius_mm,
        });
        let both = film.press_all(&touches).unwrap();
        let alone = touches.map(|touch| film.press_all(&[touch]).unwrap());
        for place in [[-2.0, 1.0], [3.0, -0.5], [3.717, 3.717], [0.0, -6.0]] {
            let [a, b] = [0, 1].map(|k| film.displacement(&alone[k], place));
            let sum = [0, 1, 2].map(|i| a[i] + b[i]);
            assert!(a[2] < 0.0 && b[2] < 0.0, "both press: {a:?} {b:?}");
            close(film.displacement(&both, place), sum, 1e-3 * -sum[2]);
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
            // Points of posts lie by columns, so that the diagonal is met less closely.
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
    fn a_thin_film_takes_force_with_the_cube_of_depth() {
        let mut design = Design {
            fineness: 0.5,
            ..Design::default()
        };
        design.material.thickness_mm = 0.01;
        let film = Film::new(&design).unwrap();
        // Shallow, but a hundred times the thickness.
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
