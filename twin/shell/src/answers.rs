//! Derivatives of a pressed film's state by its load and by the film's own properties.

use crate::film::{Touched, mean, weighted};
use crate::point::{V3, cross, dot};
use crate::shell::{Hold, Shell};
use crate::{Design, Equilibrium, Film, ShellError};

/// Steps of finite differences, mm: of the tip's place and radius, of the posts' places, and of
/// changes that move cells with them.
const TIP_STEP_MM: f64 = 1e-3;
const POST_STEP_MM: f64 = 2e-2;
const MORPH_STEP_MM: f64 = 1e-3;
/// The directions of a change, for films on both sides of the one in question.
const BESIDE: [f64; 2] = [-1.0, 1.0];

/// A quantity by which a film's state is differentiated, with its unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The force along x, y or z, N.
    Force(usize),
    /// The place of the tip along x or y at constant force, mm.
    Place(usize),
    /// The tip's radius, mm. A patch does not change with it.
    TipRadius,
    /// The film's thickness at constant grip, mm.
    Thickness,
    /// The posts' grip, in parts of itself.
    Grip,
    /// A post's place along x or y, mm.
    Post(usize, usize),
    /// Young's modulus at constant grip and weight, in parts of itself.
    Youngs,
    /// The stretch along x or y.
    Stretch(usize),
    /// [`crate::Law::neo_hooke`].
    NeoHooke,
    /// [`crate::Law::stiffening`].
    Stiffening,
    /// A component of [`Design::thickness_slope`].
    ThicknessSlope(usize),
    /// A component of [`Design::thickness_curve`].
    ThicknessCurve(usize),
    /// [`Design::dot_stiffening`].
    DotStiffening,
    /// Gravity along x, y or z, in parts of g.
    Down(usize),
    /// The posts' radius, mm.
    PostRadius,
    /// Reach of the film beyond the posts' centres, mm.
    Overhang,
}

impl Change {
    /// Iterates over all changes.
    pub fn all() -> impl Iterator<Item = Change> {
        Change::of_sweep()
            .chain([Change::Youngs])
            .chain((0..2).map(Change::Stretch))
            .chain([Change::NeoHooke, Change::Stiffening])
            .chain((0..2).map(Change::ThicknessSlope))
            .chain((0..3).map(Change::ThicknessCurve))
            .chain([Change::DotStiffening])
            .chain((0..3).map(Change::Down))
            .chain([Change::PostRadius, Change::Overhang])
    }

    /// Iterates over the changes for the reduced film, in the order of its records.
    pub fn of_sweep() -> impl Iterator<Item = Change> {
        let posts = (0..4).flat_map(|post| (0..2).map(move |way| Change::Post(post, way)));
        (0..3)
            .map(Change::Force)
            .chain((0..2).map(Change::Place))
            .chain([Change::TipRadius, Change::Thickness, Change::Grip])
            .chain(posts)
    }

    /// Returns the index of the thickness's term that it changes; `None` if it changes no term.
    pub(crate) fn term(self) -> Option<usize> {
        match self {
            Change::ThicknessSlope(k) => Some(k),
            Change::ThicknessCurve(k) => Some(2 + k),
            _ => None,
        }
    }

    /// Returns whether it changes the sheet itself, without moving cells.
    fn of_sheet(self) -> bool {
        self.term().is_some()
            || matches!(
                self,
                Change::Thickness
                    | Change::Youngs
                    | Change::Stretch(_)
                    | Change::NeoHooke
                    | Change::Stiffening
                    | Change::DotStiffening
                    | Change::Down(_)
            )
    }

    /// Returns its index in [`Beside::morphed`]; `None` if it does not move the cells.
    fn morph(self) -> Option<usize> {
        match self {
            Change::PostRadius => Some(0),
            Change::Overhang => Some(1),
            _ => None,
        }
    }
}

/// A state's derivatives per unit of a change.
#[derive(Clone, Debug)]
pub struct Response {
    pub(crate) unknowns: Vec<f64>,
    /// The tip's displacement, mm per unit.
    pub tip_mm: V3,
    /// The change; `None` for several changes of the load at once.
    pub(crate) change: Option<Change>,
}

impl Response {
    /// Returns the response to several changes of the load at once.
    pub fn to_all(responses: &[Response; 5], changes: [f64; 5]) -> Response {
        let mut sum = Response {
            unknowns: vec![0.0; responses[0].unknowns.len()],
            tip_mm: [0.0; 3],
            change: None,
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

    /// Returns the largest absolute value of its unknowns.
    pub fn size(&self) -> f64 {
        let parts = self.unknowns.iter();
        parts.fold(0.0, |most, part| most.max(part.abs()))
    }
}

/// Films next to this one, each made on first use.
#[derive(Default)]
pub(crate) struct Beside {
    /// Each post moved along x and y, in both directions.
    posts: std::sync::OnceLock<Vec<[Hold; 2]>>,
    /// Smaller and larger posts; less and more overhang.
    morphed: [std::sync::OnceLock<[Shell; 2]>; 2],
}

impl Film {
    /// Returns a state's derivatives by each change, per unit of it, at a constant force of the
    /// tip. The stiffness is factored once.
    ///
    /// # Errors
    /// If the stiffness is not positive definite: a force would not hold the film there. If the
    /// state belongs to another mesh.
    pub fn linearize(
        &self,
        state: &Equilibrium,
        changes: &[Change],
    ) -> Result<Vec<Response>, ShellError> {
        self.fits(state)?;
        let factors = self.factors_at(state)?;
        if changes.is_empty() {
            return Ok(Vec::new());
        }
        let of_sheet: Vec<Change> = changes.iter().copied().filter(|c| c.of_sheet()).collect();
        let mut by_sheet = match of_sheet.is_empty() {
            true => Vec::new(),
            false => self.shell().by_sheet(state.unknowns(), &of_sheet),
        }
        .into_iter();
        let mut sides = Vec::with_capacity(changes.len() * self.unknowns());
        for &change in changes {
            let side = match change.of_sheet() {
                true => by_sheet.next().map(negative).unwrap_or_default(),
                false => self.force_of(state, change),
            };
            sides.extend(side);
        }
        factors.solve(&mut sides, changes.len());
        let tip = self.shares_of(&state.touched);
        let columns = sides.chunks(self.unknowns()).zip(changes);
        let answer = |(unknowns, &change): (&[f64], &Change)| {
            let mut tip_mm = mean(&tip, unknowns);
            // A tip or cells that moved average over another part of the film.
            if let Some(shares) = self.shares_by(&state.touched, change) {
                let seen = mean(&shares, state.unknowns());
                for (sum, part) in tip_mm.iter_mut().zip(seen) {
                    *sum += part;
                }
            }
            Response {
                unknowns: unknowns.to_vec(),
                tip_mm,
                change: Some(change),
            }
        };
        Ok(columns.map(answer).collect())
    }

    /// Returns the derivatives of a state by the force along x, y and z, per newton, and by the
    /// tip's place. The place is where the tip touches the film, along x and y at constant force,
    /// per millimetre.
    ///
    /// # Errors
    /// If the stiffness is not positive definite: a force would not hold the film there.
    pub fn responses(&self, state: &Equilibrium) -> Result<[Response; 5], ShellError> {
        let load: Vec<Change> = Change::of_sweep().take(5).collect();
        let answers = self.linearize(state, &load)?;
        answers
            .try_into()
            .map_err(|_| ShellError::Solver("five changes have five answers".into()))
    }

    /// Returns the neighbouring state that a response predicts, `units` away. Only the unknowns
    /// change.
    pub fn beside(&self, state: &Equilibrium, response: &Response, units: f64) -> Equilibrium {
        let mut there = state.clone();
        for (u, part) in there.unknowns.iter_mut().zip(&response.unknowns) {
            *u += units * part;
        }
        there
    }

    /// Returns the derivative of [`Film::displacement`] at a point (mm, of the mounted film) by the
    /// change of a response, mm per unit. It includes the film's motion and the direct effect of
    /// the change on the surface.
    pub fn surface_rate(
        &self,
        state: &Equilibrium,
        response: &Response,
        point_mm: [f64; 2],
    ) -> [f64; 3] {
        let grid = self.shell().grid();
        let place = grid.place(point_mm);
        let [mut a1, mut a2] = grid.gradients(state.unknowns(), &place);
        a1[0] += 1.0;
        a2[1] += 1.0;
        let mut moved = grid.interpolate(&response.unknowns, &place);
        let mut turned = grid.gradients(&response.unknowns, &place);
        if let Some(k) = response.change.and_then(Change::morph) {
            let [back, forth] = self.morphed(k);
            let seen = [back, forth].map(|shell| {
                let place = shell.grid().place(point_mm);
                let [b1, b2] = shell.grid().gradients(state.unknowns(), &place);
                [shell.grid().interpolate(state.unknowns(), &place), b1, b2]
            });
            let parts = [&mut moved];
            let [first, second] = &mut turned;
            for (k, sum) in parts.into_iter().chain([first, second]).enumerate() {
                for c in 0..3 {
                    sum[c] += (seen[1][k][c] - seen[0][k][c]) / (2.0 * MORPH_STEP_MM);
                }
            }
        }

        let area = cross(&a1, &a2);
        let size = dot(&area, &area).sqrt();
        let n = area.map(|part| part / size);
        let [by1, by2] = [cross(&turned[0], &a2), cross(&a1, &turned[1])];
        let swung: V3 = std::array::from_fn(|c| by1[c] + by2[c]);
        let grown = dot(&swung, &n) / size;
        let leant: V3 = std::array::from_fn(|c| swung[c] / size - grown * n[c]);
        let half = self.half_mm(point_mm, size, 0.0);
        let thinner = self.half_rate(point_mm, size, grown, response.change);
        let flat = self.half_rate(point_mm, 1.0, 0.0, response.change);
        let up = [0.0, 0.0, flat];
        std::array::from_fn(|c| moved[c] - thinner * n[c] - half * leant[c] + up[c])
    }

    /// Returns the derivative of half of the thickness at a point by a change, mm per unit. The
    /// area there is `size` times that of the flat mounted film and grows by `grown` of itself.
    fn half_rate(&self, point: [f64; 2], size: f64, grown: f64, change: Option<Change>) -> f64 {
        let sheet = self.shell().sheet();
        let [across, down] = sheet.scales();
        let (rubber, stretched) = (sheet.law.neo_hooke, across * down * size);
        let unstretched = 0.5 * sheet.material.thickness_mm * sheet.relative(point);
        let half = self.half_mm(point, size, 0.0);
        let own = match change {
            Some(Change::Thickness) => half / sheet.material.thickness_mm,
            Some(change @ (Change::ThicknessSlope(_) | Change::ThicknessCurve(_))) => {
                let term = change.term().unwrap_or_default();
                half * crate::sheet::Sheet::terms_at(point)[term] / sheet.relative(point)
            }
            Some(Change::NeoHooke) => unstretched * (1.0 / stretched - 1.0),
            Some(Change::Stretch(way)) => -unstretched * rubber / stretched / sheet.scales()[way],
            _ => 0.0,
        };
        own - unstretched * rubber / stretched * grown
    }

    /// Returns the force on each unknown that one unit of a change leaves unbalanced, N.
    fn force_of(&self, state: &Equilibrium, change: Change) -> Vec<f64> {
        let (u, grid) = (state.unknowns(), self.shell().grid());
        match change {
            Change::Force(axis) => {
                let mut force = [0.0; 3];
                force[axis] = 1.0;
                weighted(&self.shares_of(&state.touched), &force)
            }
            Change::Grip => negative(self.shell().pull(u)),
            Change::Post(post, way) => {
                let [back, forth] = &self.posts_beside()[2 * post + way];
                let mut sum = vec![0.0; u.len()];
                back.pull(grid, u, 0.5 / POST_STEP_MM, &mut sum);
                forth.pull(grid, u, -0.5 / POST_STEP_MM, &mut sum);
                sum
            }
            _ => {
                let shares = self.shares_by(&state.touched, change);
                let mut sum = shares.map_or_else(
                    || vec![0.0; u.len()],
                    |shares| weighted(&shares, &state.force_n),
                );
                if let Some(k) = change.morph() {
                    let [back, forth] = self.morphed(k);
                    let pair = back.first(u).1.into_iter().zip(forth.first(u).1);
                    for (sum, (back, forth)) in sum.iter_mut().zip(pair) {
                        *sum += (back - forth) / (2.0 * MORPH_STEP_MM);
                    }
                }
                sum
            }
        }
    }

    /// Returns the derivative of the tip's shares by a change, per unit; `None` if they do not
    /// depend on it.
    fn shares_by(&self, touched: &Touched, change: Change) -> Option<Vec<f64>> {
        let there = |sign: f64| -> Option<Vec<f64>> {
            let grid = self.shell().grid();
            match change {
                Change::Place(way) => Some(touched.shifted(way, sign * TIP_STEP_MM).shares(grid)),
                Change::TipRadius => Some(touched.grown(sign * TIP_STEP_MM)?.shares(grid)),
                _ => {
                    let [back, forth] = self.morphed(change.morph()?);
                    let shell = if sign < 0.0 { back } else { forth };
                    Some(touched.shares(shell.grid()))
                }
            }
        };
        let step = match change.morph() {
            Some(_) => MORPH_STEP_MM,
            None => TIP_STEP_MM,
        };
        let [back, forth] = BESIDE.map(there);
        let pairs = forth?.into_iter().zip(back?);
        Some(pairs.map(|(b, a)| (b - a) / (2.0 * step)).collect())
    }

    fn posts_beside(&self) -> &[[Hold; 2]] {
        self.around().posts.get_or_init(|| {
            let moved = |k: usize| {
                BESIDE.map(|sign| {
                    let mut design = self.design().clone();
                    design.post_shift_mm[k / 2][k % 2] += sign * POST_STEP_MM;
                    Hold::new(self.shell().grid(), design.springs(Some(k / 2)))
                })
            };
            (0..8).map(moved).collect()
        })
    }

    fn morphed(&self, k: usize) -> &[Shell; 2] {
        self.around().morphed[k].get_or_init(|| {
            BESIDE.map(|sign| {
                let mut design = Design {
                    cells: Some(self.design().cells()),
                    ..self.design().clone()
                };
                match k {
                    0 => design.post_radius_mm += sign * MORPH_STEP_MM,
                    _ => design.overhang_mm += sign * MORPH_STEP_MM,
                }
                design.shell(Some(self.shell().pattern()))
            })
        })
    }
}

fn negative(mut force: Vec<f64>) -> Vec<f64> {
    for part in &mut force {
        *part = -*part;
    }
    force
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Contact, Law};

    const POINT_MM: [f64; 2] = [3.7, -3.7];

    fn changed(design: &Design, force: &mut [f64; 3], change: Change, by: f64) -> Design {
        let mut there = design.clone();
        match change {
            Change::Force(axis) => force[axis] += by,
            Change::Place(way) => there.tip_offset_mm[way] += by,
            Change::TipRadius => there.tip_radius_mm += by,
            Change::Thickness => there.material.thickness_mm += by,
            Change::Grip => there.post_grip_n_per_mm3 *= 1.0 + by,
            Change::Post(post, way) => there.post_shift_mm[post][way] += by,
            Change::Youngs => there.material.youngs_mpa *= by.exp(),
            Change::Stretch(way) => there.stretch[way] += by,
            Change::NeoHooke => there.law.neo_hooke += by,
            Change::Stiffening => there.law.stiffening += by,
            Change::ThicknessSlope(k) => there.thickness_slope[k] += by,
            Change::ThicknessCurve(k) => there.thickness_curve[k] += by,
            Change::DotStiffening => there.dot_stiffening += by,
            Change::Down(axis) => there.down[axis] += by,
            Change::PostRadius => there.post_radius_mm += by,
            Change::Overhang => there.overhang_mm += by,
        }
        there
    }

    /// Checks that every derivative is the difference of full solutions.
    fn answers_are_differences(design: &Design, force: [f64; 3]) {
        let film = Film::new(design).unwrap();
        let state = film.press(Contact::Force(force), &film.rest()).unwrap();
        let pressed = |change, by| {
            let mut force = force;
            let there = film
                .changed(&changed(design, &mut force, change, by))
                .unwrap();
            let pressed = there.press(Contact::Force(force), &state).unwrap();
            (
                there.displacement(&pressed, POINT_MM),
                pressed.tip_mm,
                there.displacement(&there.rest(), POINT_MM),
            )
        };
        let changes: Vec<Change> = Change::all().collect();
        let answers = film.linearize(&state, &changes).unwrap();
        let at_rest = film.linearize(&film.rest(), &changes).unwrap();
        for (k, change) in changes.into_iter().enumerate() {
            let step = match change {
                Change::Post(..) => 2e-2,
                Change::Stretch(_) => 2e-4,
                _ => 1e-3,
            };
            let (back, forth) = (pressed(change, -step), pressed(change, step));
            let slope = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] {
                std::array::from_fn(|c| (b[c] - a[c]) / (2.0 * step))
            };
            let mut pairs = vec![
                (
                    "surface",
                    film.surface_rate(&state, &answers[k], POINT_MM),
                    slope(back.0, forth.0),
                ),
                ("tip", answers[k].tip_mm, slope(back.1, forth.1)),
            ];
            // At rest there are no forces.
            if !Change::of_sweep().take(6).any(|load| load == change) {
                let reported = film.surface_rate(&film.rest(), &at_rest[k], POINT_MM);
                pairs.push(("rest", reported, slope(back.2, forth.2)));
            }
            for (what, reported, full) in pairs {
                for c in 0..3 {
                    assert!(
                        (reported[c] - full[c]).abs() < 2e-3 * full[c].abs() + 2e-4,
                        "{change:?} {what} {c}: {reported:?} {full:?}"
                    );
                }
            }
        }
    }

    #[test]
    #[ignore = "10 s: full solutions"]
    fn answers_of_a_nominal_film_are_differences() {
        let mut design = Design {
            fineness: 0.5,
            tip_offset_mm: [2.0, 1.0],
            ..Design::default()
        };
        // Values that may change in both directions.
        design.overhang_mm = 0.01;
        design.law = Law {
            neo_hooke: 0.01,
            stiffening: 0.01,
        };
        design.dot_stiffening = 0.01;
        answers_are_differences(&design, [0.02, -0.01, -0.1]);
    }

    #[test]
    fn answers_of_a_mounted_film_are_differences() {
        let design = Design {
            fineness: 0.4,
            overhang_mm: 4.0,
            post_radius_mm: 1.8,
            post_shift_mm: [[0.2, -0.1], [0.0, 0.3], [-0.2, 0.0], [0.1, 0.1]],
            tip_offset_mm: [-1.0, 2.0],
            stretch: [0.012, 0.004],
            law: Law {
                neo_hooke: 0.8,
                stiffening: 0.1,
            },
            thickness_slope: [0.05, -0.04],
            thickness_curve: [0.03, 0.02, -0.05],
            down: [0.3, -0.2, -0.9],
            dot_stiffening: 0.7,
            gauss_points: 2,
            ..Design::default()
        };
        answers_are_differences(&design, [0.06, -0.03, -0.15]);
    }

    #[test]
    #[ignore = "10 s: full solutions"]
    fn slack_films_answer_too() {
        let design = Design {
            fineness: 0.3,
            stretch: [-0.003, -0.002],
            down: [0.0, 0.0, 1.0],
            law: Law {
                neo_hooke: 0.5,
                stiffening: 0.05,
            },
            dot_stiffening: 0.3,
            overhang_mm: 1.0,
            ..Design::default()
        };
        answers_are_differences(&design, [0.01, 0.0, -0.1]);
    }
}
