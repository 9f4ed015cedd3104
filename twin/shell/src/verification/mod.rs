//! Verification of the shell against results from elsewhere.

mod bending;
mod derivatives;
mod large;
mod mounted;
mod patch;
mod plates;

use crate::Material;
use crate::grid::Grid;
use crate::newton::Problem;
use crate::sheet::Sheet;
use crate::shell::Shell;
use crate::sparse::Solver;
use crate::spline::Axis;

/// Stiffness of pins: high enough to hold, low enough for rounding, N/mm.
const PIN_N_PER_MM: f64 = 1e7;

/// Returns a rectangle [0, a] × [0, b] of equal cells.
fn rectangle([a, b]: [f64; 2], [columns, rows]: [usize; 2], material: &Material) -> Shell {
    sheet_rectangle([a, b], [columns, rows], &Sheet::of(material))
}

/// As [`rectangle`], for any sheet.
fn sheet_rectangle([a, b]: [f64; 2], [columns, rows]: [usize; 2], sheet: &Sheet) -> Shell {
    let axis = |length: f64, cells: usize| {
        let breaks: Vec<f64> = (0..=cells)
            .map(|i| length * i as f64 / cells as f64)
            .collect();
        Axis::new(&breaks)
    };
    let axes = [axis(a, columns), axis(b, rows)];
    let points = 3;
    Shell::new(Grid { axes, points }, sheet)
}

/// Returns the distance of coefficient `k` from the film's edges, in coefficients: along x and
/// along y.
fn depth(shell: &Shell, k: usize) -> [usize; 2] {
    let [columns, rows] = shell.grid().functions();
    let (i, j) = (k % columns, k / columns);
    [i.min(columns - 1 - i), j.min(rows - 1 - j)]
}

/// Returns coefficients that move each point (x, y) by an affine function.
fn coefficients(shell: &Shell, u: impl Fn(f64, f64) -> [f64; 3]) -> Vec<f64> {
    let [x, y] = &shell.grid().axes;
    let xs: Vec<f64> = x.greville().collect();
    y.greville()
        .flat_map(|y| xs.iter().flat_map(|&x| u(x, y)).collect::<Vec<_>>())
        .collect()
}

/// Returns a force spread evenly over the film, N per mm² of it at rest, along component `c`.
fn pressure(shell: &Shell, size: f64, c: usize) -> Vec<f64> {
    let integrals = |axis: &Axis| -> Vec<f64> {
        let mut sums = vec![0.0; axis.functions()];
        for span in 0..axis.spans() {
            let [from, to] = axis.ends(span);
            for (at, weight) in [(-1.0, 1.0), (0.0, 4.0), (1.0, 1.0)] {
                // Simpson's rule is exact for cubics.
                let x = (from + to + at * (to - from)) / 2.0;
                for (i, value) in axis.basis(span, x)[0].iter().enumerate() {
                    sums[span + i] += weight / 6.0 * (to - from) * value;
                }
            }
        }
        sums
    };
    let (x, y) = (
        integrals(&shell.grid().axes[0]),
        integrals(&shell.grid().axes[1]),
    );
    let mut load = vec![0.0; shell.grid().unknowns()];
    for (j, down) in y.iter().enumerate() {
        for (i, across) in x.iter().enumerate() {
            load[3 * (j * x.len() + i) + c] = size * across * down;
        }
    }
    load
}

/// Returns a force at a point, along component `c`.
fn point_force(shell: &Shell, at: [f64; 2], size: f64, c: usize) -> Vec<f64> {
    let mut load = vec![0.0; shell.grid().unknowns()];
    let place = shell.grid().place(at);
    for (local, value) in place.values.iter().enumerate() {
        load[3 * shell.grid().coefficient(place.origin, local) + c] += size * value;
    }
    load
}

/// Returns the linear answer of the film at rest to a load.
fn linear(shell: &Shell, mut load: Vec<f64>) -> Vec<f64> {
    let at_rest = shell.derivatives(&vec![0.0; load.len()]);
    let solver = Solver::new(shell.pattern()).unwrap();
    let factors = solver.factor(shell.pattern(), &at_rest.stiffness).unwrap();
    factors.solve(&mut load, 1);
    load
}

/// Returns the nonlinear answer, with the load in `stages` equal steps.
fn ramped(shell: &Shell, load: &[f64], stages: usize) -> Vec<f64> {
    let solver = Solver::new(shell.pattern()).unwrap();
    let mut u = vec![0.0; load.len()];
    for stage in 1..=stages {
        let share = stage as f64 / stages as f64;
        let problem = Problem {
            shell,
            load: load.iter().map(|part| share * part).collect(),
            guides: Vec::new(),
        };
        u = problem.solve(&solver, &u).unwrap().unknowns;
    }
    u
}

fn displacement(shell: &Shell, u: &[f64], at: [f64; 2]) -> [f64; 3] {
    shell.grid().interpolate(u, &shell.grid().place(at))
}

/// Prints the time of a film's steps, ms: the smallest of several tries.
#[test]
#[ignore = "a measurement"]
fn speed() {
    use crate::{Change, Contact, Design, Equilibrium, Film};

    fn least<T>(work: impl Fn() -> T) -> f64 {
        let timed = |_| {
            let begin = std::time::Instant::now();
            std::hint::black_box(work());
            1e3 * begin.elapsed().as_secs_f64()
        };
        (0..9).map(timed).fold(f64::INFINITY, f64::min)
    }

    for (fineness, gauss_points) in [0.3, 0.5, 0.7].into_iter().flat_map(|f| [(f, 3), (f, 2)]) {
        let design = Design {
            fineness,
            gauss_points,
            ..Design::default()
        };
        let film = Film::new(&design).unwrap();
        let press =
            |force: f64, start: &Equilibrium| film.press(Contact::Force([0.02, 0.0, force]), start);
        let (rest, near) = (film.rest(), press(-0.11, &film.rest()).unwrap());
        let state = press(-0.1, &rest).unwrap();
        let (shell, u) = (film.shell(), state.unknowns());
        let stiffness = shell.stiffness(u);
        let solver = Solver::new(shell.pattern()).unwrap();
        let factors = solver.factor(shell.pattern(), &stiffness).unwrap();
        let changes: Vec<Change> = Change::all().collect();
        println!(
            "fineness {fineness}, {} unknowns, {gauss_points} x {gauss_points} points: film {:.2}, \
             stiffness {:.2}, factors {:.2}, solution {:.2}, gradient {:.2}, press in {} steps \
             {:.1}, from a neighbour in {} {:.1}, {} answers {:.1} ms",
            u.len(),
            least(|| Film::new(&design)),
            least(|| shell.stiffness(u)),
            least(|| solver.factor(shell.pattern(), &stiffness)),
            least(|| factors.solve(&mut vec![1.0; u.len()], 1)),
            least(|| shell.first(u)),
            state.steps,
            least(|| press(-0.1, &rest)),
            press(-0.1, &near).unwrap().steps,
            least(|| press(-0.1, &near)),
            changes.len(),
            least(|| film.linearize(&state, &changes)),
        );
    }
}
