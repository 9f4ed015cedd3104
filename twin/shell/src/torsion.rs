//! A torque about the film's normal, as friction under a turning contact brings it.

use crate::design::tip_points;
use crate::film::{Touched, finite, mean, point_shares, weighted};
use crate::newton::Problem;
use crate::point::{V3, cross};
use crate::sparse::COMPONENTS;
use crate::{Equilibrium, Film, Patch, Response, ShellError};

/// How often the torque's forces are turned with the film that they turn.
const TURNS: usize = 4;

impl Film {
    /// Returns the film under a force, N, that is spread over a patch as by [`Film::press_patch`],
    /// and under a torque along the film's normal there, whose z component is `torque_nmm`, N·mm.
    ///
    /// # Errors
    /// As [`Film::press_patch`], and if the torque is not finite.
    pub fn press_twisted(
        &self,
        patch: &Patch,
        force_n: [f64; 3],
        torque_nmm: f64,
        start: &Equilibrium,
    ) -> Result<Equilibrium, ShellError> {
        finite("torque", [torque_nmm, 0.0, 0.0])?;
        let mut state = self.press_patch(patch, force_n, start)?;
        let force = weighted(&point_shares(self.shell().grid(), patch.points()), &force_n);
        for _ in 0..TURNS {
            let twist = self.torque_forces(&state);
            let pairs = force.iter().zip(twist);
            let problem = Problem {
                shell: self.shell(),
                load: pairs
                    .map(|(force, twist)| force + torque_nmm * twist)
                    .collect(),
                guides: Vec::new(),
            };
            let solution = problem.solve(self.solver(), state.unknowns())?;
            let tip_mm = mean(&self.shares_of(&state.touched), &solution.unknowns);
            state = self.equilibrium(solution, force_n, &[], (state.touched, tip_mm));
        }
        Ok(state)
    }

    /// Returns a state's derivative by a torque along the film's normal under what presses, per
    /// N·mm of its z component.
    ///
    /// # Errors
    /// As [`Film::linearize`].
    pub fn answer_to_torque(&self, state: &Equilibrium) -> Result<Response, ShellError> {
        self.fits(state)?;
        let mut unknowns = self.torque_forces(state);
        self.factors_at(state)?.solve(&mut unknowns, 1);
        Ok(Response {
            tip_mm: mean(&self.shares_of(&state.touched), &unknowns),
            unknowns,
            change: None,
        })
    }

    /// Returns the force on each unknown, N, of a torque whose z component is 1 N·mm. It lies along
    /// the mean normal of the film under what presses. Friction acts across that normal and across
    /// the arm from the centre of pressure, in proportion to pressure and arm.
    fn torque_forces(&self, state: &Equilibrium) -> Vec<f64> {
        let grid = self.shell().grid();
        let points = match &state.touched {
            Touched::Tip(tip) => tip_points(tip.place_mm, tip.radius_mm),
            Touched::Patch(patch) => patch.points().to_vec(),
        };
        let (mut normal, mut centre) = ([0.0; 3], [0.0; 3]);
        let mut there = Vec::with_capacity(points.len());
        for (point, part) in points {
            let place = grid.place(point);
            let [mut a1, mut a2] = grid.gradients(state.unknowns(), &place);
            a1[0] += 1.0;
            a2[1] += 1.0;
            let [x, y, z] = grid.interpolate(state.unknowns(), &place);
            let at = [point[0] + x, point[1] + y, z];
            let area = cross(&a1, &a2);
            for c in 0..3 {
                normal[c] += part * area[c];
                centre[c] += part * at[c];
            }
            there.push((place, at, part));
        }
        let mut forces = vec![0.0; self.unknowns()];
        let mut torque_z = 0.0;
        for (place, at, part) in there {
            let arm: V3 = std::array::from_fn(|c| at[c] - centre[c]);
            let force = cross(&normal, &arm).map(|side| part * side);
            torque_z += cross(&arm, &force)[2];
            for (local, value) in place.values.iter().enumerate() {
                let first = COMPONENTS * grid.coefficient(place.origin, local);
                for (sum, side) in forces[first..].iter_mut().zip(force) {
                    *sum += value * side;
                }
            }
        }
        forces.into_iter().map(|force| force / torque_z).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Contact, Design};

    /// In a flat film a torque turns a circle of radius r about the tip by M / (4 π G t r²), plus
    /// what the far film turns (plane stress: Timoshenko and Goodier, "Theory of Elasticity",
    /// section 28). The tip is wide enough for the mesh.
    #[test]
    fn a_torque_turns_circles_of_a_flat_film() {
        let design = Design {
            tip_radius_mm: 1.0,
            ..Design::default()
        };
        let film = Film::new(&design).unwrap();
        let answer = film.answer_to_torque(&film.rest()).unwrap();
        let grid = film.shell().grid();
        let turned = |r: f64| {
            let ray = |k: u32| {
                let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_8).sin_cos();
                let place = grid.place([r * cos, r * sin]);
                let [x, y, _] = grid.interpolate(&answer.unknowns, &place);
                (cos * y - sin * x) / r
            };
            (0..16).map(ray).sum::<f64>() / 16.0
        };
        let film = &film.shell().sheet().material;
        let shear_mpa = film.youngs_mpa / (2.0 * (1.0 + film.poisson));
        let by_square = 1.0 / (4.0 * std::f64::consts::PI * shear_mpa * film.thickness_mm);
        let (near, far) = (1.5, 3.0);
        let expected = by_square * (1.0 / (near * near) - 1.0 / (far * far));
        let found = turned(near) - turned(far);
        assert!((found / expected - 1.0).abs() < 5e-3, "{found} {expected}");
    }

    /// The derivative is the difference of full solutions, and a small torque is nearly linear.
    #[test]
    fn a_torque_turns_a_pressed_film() {
        let design = Design {
            fineness: 0.5,
            ..Design::default()
        };
        let film = Film::new(&design).unwrap();
        let (place_mm, force_n) = ([2.0, 1.0], [0.005, 0.0, -0.1]);
        let tip = Patch::tip(place_mm, design.tip_radius_mm).unwrap();
        let state = film
            .press_at(
                place_mm,
                design.tip_radius_mm,
                Contact::Force(force_n),
                &film.rest(),
            )
            .unwrap();
        let answer = film.answer_to_torque(&state).unwrap();
        let [back, forth] =
            [-0.02, 0.02].map(|torque| film.press_twisted(&tip, force_n, torque, &state).unwrap());
        for point in [[3.7, 3.7], [0.0, 2.4], [2.5, 0.0]] {
            let predicted = film.beside(&state, &answer, 0.02);
            let moved = film.displacement(&predicted, point);
            let still = film.displacement(&state, point);
            let [a, b] = [&back, &forth].map(|there| film.displacement(there, point));
            for c in 0..3 {
                let (linear, full) = (moved[c] - still[c], 0.5 * (b[c] - a[c]));
                assert!(
                    (linear - full).abs() < 0.02 * full.abs() + 2e-5,
                    "{linear} {full}"
                );
            }
        }
    }
}
