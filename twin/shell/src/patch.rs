//! A force that is spread over part of the film: pressures of any shape.

use std::f64::consts::TAU;
use std::sync::Arc;

use crate::design::{gauss, tip_points};
use crate::film::{Touched, finite, mean, point_shares, weighted};
use crate::newton::Problem;
use crate::point::dot;
use crate::{Contact, Equilibrium, Film, Response, ShellError};

/// Rays of the points of an ellipse and of a rim.
const RAYS: usize = 48;
/// Distance of the points along a line, mm.
const STEP_MM: f64 = 0.1;

/// Points of the mounted film, mm from its middle, and the part of the force that each one bears.
/// The parts have the sum 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    points: Vec<([f64; 2], f64)>,
}

impl Patch {
    /// Returns the patch of these points, mm, with weights of any sum > 0.
    ///
    /// # Errors
    /// If there are no points, a number is not finite, a weight is < 0, or all are zero.
    pub fn new(mut points: Vec<([f64; 2], f64)>) -> Result<Patch, ShellError> {
        let total: f64 = points.iter().map(|(_, weight)| weight).sum();
        let good =
            |([x, y], weight): &([f64; 2], f64)| x.is_finite() && y.is_finite() && *weight >= 0.0;
        if !(points.iter().all(good) && total.is_finite() && total > 0.0) {
            return Err(ShellError::Contact(
                "a patch has no weight: use finite points with weights of at least 0".into(),
            ));
        }
        for (_, weight) in &mut points {
            *weight /= total;
        }
        Ok(Patch { points })
    }

    /// Returns the disc of a tip: (1 − r²/R²)² within a radius > 0, mm.
    ///
    /// # Errors
    /// If a number is out of its range.
    pub fn tip(place_mm: [f64; 2], radius_mm: f64) -> Result<Patch, ShellError> {
        size("radius", radius_mm)?;
        Patch::new(tip_points(place_mm, radius_mm))
    }

    /// Returns the disc of a soft ball: √(1 − r²/R²) within a radius > 0, mm, as of Hertz.
    ///
    /// # Errors
    /// If a number is out of its range.
    pub fn disc(place_mm: [f64; 2], radius_mm: f64) -> Result<Patch, ShellError> {
        Patch::ellipse(place_mm, [radius_mm; 2], 0.0)
    }

    /// Returns an ellipse: √(1 − x²/a² − y²/b²) with the semi-axes [a, b] > 0, mm. Its first axis
    /// is turned by an angle, degrees, from x towards y.
    ///
    /// # Errors
    /// If a number is out of its range.
    pub fn ellipse(
        place_mm: [f64; 2],
        semi_axes_mm: [f64; 2],
        turned_deg: f64,
    ) -> Result<Patch, ShellError> {
        for axis in semi_axes_mm {
            size("semi-axis", axis)?;
        }
        let [a, b] = semi_axes_mm;
        let ring = |(height, weight): (f64, f64)| {
            // With the pressure `height` as the variable, a ring has the area height · d(height).
            let r = (1.0 - height * height).sqrt();
            let point = move |ray: usize| {
                let (sin, cos) = angle(ray).sin_cos();
                ([a * r * cos, b * r * sin], height * height * weight)
            };
            (0..RAYS).map(point)
        };
        Patch::placed(gauss([0.0, 1.0]).flat_map(ring), place_mm, turned_deg)
    }

    /// Returns the rim of a flat face of a radius > 0, mm: a ring that bears 1 − t², where t is −1
    /// to 1 across it. Half of its width, mm, is > 0 and at most the radius.
    ///
    /// # Errors
    /// If a number is out of its range.
    pub fn rim(
        place_mm: [f64; 2],
        radius_mm: f64,
        half_width_mm: f64,
    ) -> Result<Patch, ShellError> {
        size("radius", radius_mm)?;
        size("half width", half_width_mm)?;
        size("radius less half the width", radius_mm - half_width_mm)?;
        let ring = |(t, weight): (f64, f64)| {
            let r = radius_mm + half_width_mm * t;
            let weight = weight * (1.0 - t * t) * r;
            (0..RAYS).map(move |ray| {
                let (sin, cos) = angle(ray).sin_cos();
                ([r * cos, r * sin], weight)
            })
        };
        Patch::placed(gauss([-1.0, 1.0]).flat_map(ring), place_mm, 0.0)
    }

    /// Returns a line, as a cylinder presses: even along its length > 0, and √(1 − t²) across it,
    /// within half of its width > 0, mm. It lies at an angle, degrees, from x towards y.
    ///
    /// # Errors
    /// If a number is out of its range.
    pub fn line(
        place_mm: [f64; 2],
        length_mm: f64,
        half_width_mm: f64,
        turned_deg: f64,
    ) -> Result<Patch, ShellError> {
        size("length", length_mm)?;
        size("half width", half_width_mm)?;
        let count = (length_mm / STEP_MM).ceil();
        let row = |k: usize| {
            let along = ((k as f64 + 0.5) / count - 0.5) * length_mm;
            gauss([-1.0, 1.0])
                .map(move |(t, weight)| ([along, half_width_mm * t], weight * (1.0 - t * t).sqrt()))
        };
        Patch::placed((0..count as usize).flat_map(row), place_mm, turned_deg)
    }

    /// Returns several patches at once, each with its part of the force, of any sum > 0.
    ///
    /// # Errors If `patches` is empty, a part is < 0, or all are zero.
    pub fn all(patches: &[(Patch, f64)]) -> Result<Patch, ShellError> {
        let points = patches.iter().flat_map(|(patch, part)| {
            let points = patch.points.iter();
            points.map(move |(point, weight)| (*point, part * weight))
        });
        Patch::new(points.collect())
    }

    /// Returns this patch with its centre of pressure at a place, mm.
    ///
    /// # Errors
    /// If the place is not finite.
    pub fn moved_to(&self, place_mm: [f64; 2]) -> Result<Patch, ShellError> {
        let off_mm = self.centre_mm();
        let points = self.points.iter().map(|(point, part)| {
            let there = [0, 1].map(|way| point[way] - off_mm[way] + place_mm[way]);
            (there, *part)
        });
        Patch::new(points.collect())
    }

    /// Returns the points, mm, and their parts of the force.
    pub fn points(&self) -> &[([f64; 2], f64)] {
        &self.points
    }

    /// Returns the centre of pressure, mm: the points' mean by their parts of the force.
    pub fn centre_mm(&self) -> [f64; 2] {
        [0, 1].map(|way| {
            self.points
                .iter()
                .map(|(point, part)| point[way] * part)
                .sum()
        })
    }

    /// Returns the patch shifted along x or y by some mm.
    pub(crate) fn shifted(&self, way: usize, by_mm: f64) -> Patch {
        let mut there = self.clone();
        for (point, _) in &mut there.points {
            point[way] += by_mm;
        }
        there
    }

    /// Returns the patch of points around (0, 0), turned, then moved to its place.
    fn placed(
        points: impl Iterator<Item = ([f64; 2], f64)>,
        [cx, cy]: [f64; 2],
        turned_deg: f64,
    ) -> Result<Patch, ShellError> {
        let (sin, cos) = turned_deg.to_radians().sin_cos();
        let point = |([x, y], weight): ([f64; 2], f64)| {
            ([cx + cos * x - sin * y, cy + sin * x + cos * y], weight)
        };
        Patch::new(points.map(point).collect())
    }
}

impl Film {
    /// Returns the film under a force, N, that is spread over a patch and keeps its direction at
    /// each of its points. It is found from the state `start`, or from rest if that fails.
    /// [`Equilibrium::tip_mm`] is then the patch's mean displacement.
    ///
    /// # Errors
    /// If the force is not finite, the patch leaves the film or lies on a post, no equilibrium is
    /// found, or the start belongs to another mesh.
    pub fn press_patch(
        &self,
        patch: &Patch,
        force_n: [f64; 3],
        start: &Equilibrium,
    ) -> Result<Equilibrium, ShellError> {
        for (point, _) in &patch.points {
            self.design().check_pressed(*point)?;
        }
        self.fits(start)?;
        let touched = Touched::Patch(Arc::new(patch.clone()));
        let from = |start: &Equilibrium| {
            self.press_touched(touched.clone(), Contact::Force(force_n), start)
        };
        from(start).or_else(|_| from(&self.rest()))
    }

    /// Returns the film under several patches at once, each with its own force, N. It is found as
    /// by [`Film::press_patch`]. [`Equilibrium::tip_mm`] is then the mean displacement of all
    /// patches by their forces' sizes, and [`Equilibrium::force_n`] the forces' sum.
    ///
    /// # Errors
    /// As [`Film::press_patch`], and if there are no patches, or no patch has a force.
    pub fn press_patches(
        &self,
        patches: &[(Patch, [f64; 3])],
        start: &Equilibrium,
    ) -> Result<Equilibrium, ShellError> {
        self.fits(start)?;
        let mut load = vec![0.0; self.unknowns()];
        let mut sum_n = [0.0; 3];
        let mut parts = Vec::new();
        for (patch, force_n) in patches {
            for (point, _) in &patch.points {
                self.design().check_pressed(*point)?;
            }
            let force_n = finite("force", *force_n)?;
            let shares = point_shares(self.shell().grid(), &patch.points);
            for (load, part) in load.iter_mut().zip(weighted(&shares, &force_n)) {
                *load += part;
            }
            for (sum, part) in sum_n.iter_mut().zip(force_n) {
                *sum += part;
            }
            parts.push((patch.clone(), dot(&force_n, &force_n).sqrt()));
        }
        let touched = Touched::Patch(Arc::new(Patch::all(&parts)?));
        let from = |start: &Equilibrium| {
            let problem = Problem {
                shell: self.shell(),
                load: load.clone(),
                guides: Vec::new(),
            };
            problem.solve(self.solver(), start.unknowns())
        };
        let solution = from(start).or_else(|_| from(&self.rest()))?;
        let tip_mm = mean(&self.shares_of(&touched), &solution.unknowns);
        Ok(self.equilibrium(solution, sum_n, &[], (touched, tip_mm)))
    }

    /// Returns a state's derivatives by loads that are added to those that press it: each is of
    /// forces, N, that are spread over patches. The stiffness is factored once.
    ///
    /// # Errors
    /// As [`Film::linearize`].
    pub fn answers_to_patches(
        &self,
        state: &Equilibrium,
        loads: &[Vec<(Patch, [f64; 3])>],
    ) -> Result<Vec<Response>, ShellError> {
        self.fits(state)?;
        let factors = self.factors_at(state)?;
        let mut sides = vec![0.0; loads.len() * self.unknowns()];
        for (side, load) in sides.chunks_mut(self.unknowns()).zip(loads) {
            for (patch, force_n) in load {
                let shares = point_shares(self.shell().grid(), &patch.points);
                for (sum, part) in side.iter_mut().zip(weighted(&shares, force_n)) {
                    *sum += part;
                }
            }
        }
        factors.solve(&mut sides, loads.len());
        let tip = self.shares_of(&state.touched);
        let answers = sides.chunks(self.unknowns()).map(|unknowns| Response {
            unknowns: unknowns.to_vec(),
            tip_mm: mean(&tip, unknowns),
            change: None,
        });
        Ok(answers.collect())
    }
}

fn angle(ray: usize) -> f64 {
    (ray as f64 + 0.5) * TAU / RAYS as f64
}

fn size(what: &str, value: f64) -> Result<(), ShellError> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(ShellError::Contact(format!(
        "a patch's {what} is {value} mm: use a number more than 0"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Design;

    fn film() -> Film {
        let design = Design {
            fineness: 0.5,
            ..Design::default()
        };
        Film::new(&design).unwrap()
    }

    fn close<const N: usize>(a: [f64; N], b: [f64; N], tolerance: f64) {
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < tolerance, "{a} {b}");
        }
    }

    /// Returns the second moments along an angle and across it, mm².
    fn moments(patch: &Patch, turned_deg: f64) -> [f64; 2] {
        let (sin, cos) = turned_deg.to_radians().sin_cos();
        let [cx, cy] = patch.centre_mm();
        let mut sum = [0.0; 2];
        for ([x, y], part) in patch.points() {
            let (x, y) = (x - cx, y - cy);
            sum[0] += part * (cos * x + sin * y).powi(2);
            sum[1] += part * (cos * y - sin * x).powi(2);
        }
        sum
    }

    #[test]
    fn patches_have_their_middle_and_their_size() {
        let place = [1.5, -2.0];
        let [a, b] = [2.0, 0.5];
        let all = [
            // Of Hertz's pressure: a²/5. Of the uniform: a²/3. Of √(1 − t²): b²/4.
            (Patch::disc(place, a).unwrap(), [0.8, 0.8]),
            (Patch::ellipse(place, [a, b], 30.0).unwrap(), [0.8, 0.05]),
            (
                Patch::line(place, 2.0 * a, b, 30.0).unwrap(),
                [4.0 / 3.0, 0.0625],
            ),
            (Patch::rim(place, a, 1e-3).unwrap(), [2.0, 2.0]),
        ];
        for (patch, size) in all {
            let parts: f64 = patch.points().iter().map(|(_, part)| part).sum();
            assert!((parts - 1.0).abs() < 1e-12);
            close(patch.centre_mm(), place, 1e-9);
            close(moments(&patch, 30.0), size, 2e-3);
        }
    }

    #[test]
    fn a_patch_of_a_tip_is_the_tip() {
        let film = film();
        let (place, force) = ([2.0, 1.0], [0.01, -0.005, -0.1]);
        let contact = Contact::Force(force);
        let tip = film.press_at(place, 0.5, contact, &film.rest()).unwrap();
        let patch = Patch::tip(place, 0.5).unwrap();
        let spread = film.press_patch(&patch, force, &film.rest()).unwrap();
        close(spread.tip_mm, tip.tip_mm, 1e-9);
        close(spread.reaction_n, force.map(|part| -part), 1e-9);
        assert_eq!(spread.force_n, force);
        let [by_tip, by_patch] =
            [tip, spread].map(|state| film.responses(&state).unwrap().map(|one| one.tip_mm));
        for (a, b) in by_tip.into_iter().zip(by_patch) {
            close(a, b, 1e-6);
        }
    }

    #[test]
    fn two_contacts_are_one_patch() {
        let film = film();
        let tips = [-2.0, 2.0].map(|x| (Patch::tip([x, 0.0], 0.5).unwrap(), 0.5));
        let both = Patch::all(&tips).unwrap();
        close(both.centre_mm(), [0.0; 2], 1e-12);
        let state = film
            .press_patch(&both, [0.0, 0.0, -0.1], &film.rest())
            .unwrap();
        let depth = |x: f64| film.displacement(&state, [x, 0.0])[2];
        assert!((depth(-2.0) - depth(2.0)).abs() < 1e-8 && depth(2.0) < depth(0.0) - 0.01);
    }

    /// Contacts with one direction are one patch. Forces that differ balance with the posts.
    #[test]
    fn each_patch_has_its_own_force() {
        let film = film();
        let [left, right] = [-2.0, 2.0].map(|x| Patch::tip([x, 0.0], 0.5).unwrap());
        let rest = film.rest();
        let (force, all) = (
            [0.01, 0.0, -0.1],
            [(left.clone(), 0.25), (right.clone(), 0.75)],
        );
        let one = film
            .press_patch(&Patch::all(&all).unwrap(), force, &rest)
            .unwrap();
        let parts = |part: f64| force.map(|whole| part * whole);
        let both = [(left, parts(0.25)), (right, parts(0.75))];
        let two = film.press_patches(&both, &rest).unwrap();
        close(one.tip_mm, two.tip_mm, 1e-9);
        close(one.force_n, two.force_n, 1e-15);
        let [(left, _), (right, _)] = both;
        let pinched = [(left, [0.01, 0.0, -0.05]), (right, [-0.01, 0.0, -0.05])];
        let pinched = film.press_patches(&pinched, &rest).unwrap();
        close(pinched.reaction_n, [0.0, 0.0, 0.1], 1e-9);
        assert!(film.press_patches(&[], &rest).is_err());
    }

    #[test]
    fn what_cannot_press_is_refused() {
        assert!(Patch::new(Vec::new()).is_err());
        assert!(Patch::new(vec![([0.0, f64::NAN], 1.0)]).is_err());
        assert!(Patch::new(vec![([0.0; 2], -1.0), ([1.0, 0.0], 3.0)]).is_err());
        assert!(Patch::disc([0.0; 2], 0.0).is_err());
        assert!(Patch::ellipse([0.0; 2], [1.0, f64::NAN], 0.0).is_err());
        assert!(Patch::rim([0.0; 2], 1.0, 2.0).is_err());
        assert!(Patch::line([0.0; 2], -1.0, 0.1, 0.0).is_err());
        let film = film();
        let press = |place| {
            let patch = Patch::tip(place, 0.5).unwrap();
            film.press_patch(&patch, [0.0, 0.0, -0.1], &film.rest())
        };
        assert!(press([13.9, 0.0]).is_err(), "off the film");
        assert!(press([13.2, 13.2]).is_err(), "on a post");
        assert!(press([9.0, 9.0]).is_ok());
    }
}
