//! The full solution of the film under the loads of a scene.

use hivtac_twin::film::{Contact as Reading, Load, MAX_RATIO};

use crate::{Contact, Equilibrium, Film, ShellError};

/// Largest error of friction ratio and direction at which a sliding tip counts as found, N.
const TOLERANCE_N: f64 = 1e-6;
const MAX_STEPS: usize = 25;
const SLOPE_STEP_MM: f64 = 1e-3;

/// A film under a load.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// Its state.
    pub state: Equilibrium,
    /// The point of the film that the tip touches, given by its place at rest, mm.
    pub touches_mm: [f64; 2],
}

/// A sliding tip: film, load and the current estimate.
struct Slide<'a> {
    film: &'a mut Film,
    /// The tip's place at the start, mm.
    from_mm: [f64; 3],
    load: &'a Load,
    mu: f64,
    state: Equilibrium,
}

/// Returns the full solution for a load in its contact reading. The film's tip stays where the load
/// ends.
///
/// # Errors
/// If the load is impossible, or no equilibrium is found.
pub fn press_load(film: &mut Film, load: &Load) -> Result<Loaded, ShellError> {
    film.move_tip(load.offset_mm(), load.tip_radius_mm())?;
    if load.magnitude_n() == 0.0 {
        let state = film.rest();
        let touches_mm = load.offset_mm();
        return Ok(Loaded { state, touches_mm });
    }
    let contact = match load.contact() {
        Reading::Force => Contact::Force(load.vector_n()),
        Reading::Stick | Reading::Slip { .. } => stage(load, [0.0; 2]),
    };
    let state = film.press(contact, &film.rest())?;
    let [x, y, z] = state.force_n;
    let friction = match load.contact() {
        Reading::Force => f64::INFINITY,
        Reading::Stick => MAX_RATIO,
        Reading::Slip { mu } => mu,
    };
    match friction {
        mu if x.hypot(y) > mu * -z => {
            let slide = Slide {
                from_mm: film.rest().tip_mm,
                film,
                load,
                mu,
                state,
            };
            slide.find()
        }
        _ => Ok(Loaded {
            state,
            touches_mm: load.offset_mm(),
        }),
    }
}

/// Returns the contact of a tip on a stage that moves in the direction of the load's label and has
/// slid over the film by `slid_mm`.
fn stage(load: &Load, slid_mm: [f64; 2]) -> Contact {
    Contact::Stick {
        direction: load.vector_n(),
        force_n: load.magnitude_n(),
        slid_mm,
    }
}

impl Slide<'_> {
    /// Finds the slide of the tip by Broyden's method.
    fn find(mut self) -> Result<Loaded, ShellError> {
        let [x, y, z] = self.state.force_n;
        let share = 1.0 - self.mu * -z / x.hypot(y);
        let mut slid = [0, 1].map(|c| share * (self.state.tip_mm[c] - self.from_mm[c]));
        let mut gap = self.gap(slid)?;
        let mut slopes = self.slopes(slid, gap)?;
        for _ in 0..MAX_STEPS {
            if gap.iter().all(|part| part.abs() < TOLERANCE_N) {
                let [x, y] = self.load.offset_mm();
                return Ok(Loaded {
                    state: self.state,
                    touches_mm: [x + slid[0], y + slid[1]],
                });
            }
            let [[a, b], [c, d]] = slopes;
            let whole = a * d - b * c;
            let step = [
                (b * gap[1] - d * gap[0]) / whole,
                (c * gap[0] - a * gap[1]) / whole,
            ];
            slid = [slid[0] + step[0], slid[1] + step[1]];
            gap = self.gap(slid)?;
            let square = step[0] * step[0] + step[1] * step[1];
            for (row, left) in slopes.iter_mut().zip(gap) {
                // The old slopes predicted a gap of zero after this step.
                *row = [0, 1].map(|k| row[k] + left * step[k] / square);
            }
        }
        Err(ShellError::NoEquilibrium {
            steps: MAX_STEPS,
            left_over_n: gap[0].abs().max(gap[1].abs()),
        })
    }

    /// Returns the remaining errors, N: of the friction ratio, and of a slide along the sideways
    /// force.
    fn gap(&mut self, slid: [f64; 2]) -> Result<[f64; 2], ShellError> {
        let [x, y] = self.load.offset_mm();
        let radius_mm = self.load.tip_radius_mm();
        self.film.move_tip([x + slid[0], y + slid[1]], radius_mm)?;
        self.state = self.film.press(stage(self.load, slid), &self.state)?;
        let [x, y, z] = self.state.force_n;
        let across = (slid[0] * y - slid[1] * x) / (self.from_mm[2] - self.state.tip_mm[2]);
        Ok([x.hypot(y) + self.mu * z, across])
    }

    fn slopes(&mut self, slid: [f64; 2], gap: [f64; 2]) -> Result<[[f64; 2]; 2], ShellError> {
        let [x, y] = slid;
        let by_x = self.gap([x + SLOPE_STEP_MM, y])?;
        let by_y = self.gap([x, y + SLOPE_STEP_MM])?;
        Ok([0, 1].map(|row| [by_x, by_y].map(|there| (there[row] - gap[row]) / SLOPE_STEP_MM)))
    }
}
