//! Ways from first guesses to a contact, as the sensor goes them.

use anyhow::Result;
use hivtac_sensor::force;
use hivtac_sensor::force::features::Features;
use hivtac_sensor::force::forward::{
    Descent, Estimate, Forward, Mounting, Observed, Pose, STEPS_AT_MOST, UNEXPLAINED,
};
use hivtac_sensor::force::model::Model;
use hivtac_sensor::force::network::Network;
use hivtac_terms::marker::Marker;
use hivtac_terms::units::Px;

use crate::press::{normal, seeded};

/// A first guess: |F| in parts of the true one, and the place, mm.
pub type Start = (f32, [f32; 2]);

/// First guesses all over the film: half, all and twice the force at 25 places, straight.
pub const STARTS: [Start; 75] = {
    let mut starts = [(0.0, [0.0; 2]); 75];
    let mut k = 0;
    while k < 75 {
        let part = [0.5, 1.0, 2.0][k / 25];
        let at = [-4.0, -2.0, 0.0, 2.0, 4.0];
        starts[k] = (part, [at[k % 5], at[k / 5 % 5]]);
        k += 1;
    }
    starts
};

/// Ends this near each other are the same: the place, mm, and |F|, N.
const SAME_MM: f32 = 0.25;
const SAME_N: f32 = 0.005;

/// Where a way ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// At the contact that explains the markers best, after so many steps.
    Found { steps: u32 },
    /// At another one that explains them, too: nobody would know.
    Another,
    /// Where nothing explains the markers: there is no force.
    Nothing,
}

impl End {
    /// Steps to the contact.
    pub fn steps(&self) -> Option<u32> {
        match self {
            End::Found { steps } => Some(*steps),
            End::Another | End::Nothing => None,
        }
    }
}

/// A model's film, and its network alone.
pub struct Film<'m> {
    forward: Forward<'m>,
    model: &'m Model<'m>,
    alone: Model<'m>,
    mounting: Mounting,
}

/// A contact, and the markers that show it.
pub struct Contact<'f> {
    film: &'f Film<'f>,
    pose: Pose,
    observed: Observed<'static>,
    best: Estimate,
}

impl<'m> Film<'m> {
    /// Of a model, and of one that has its network alone; `None` when the first has no film.
    pub fn new(model: &'m Model<'m>, alone: Model<'m>) -> Option<Film<'m>> {
        let forward = model.forward?;
        let told = forward.rest_image.mounting(&model.rest);
        Some(Film {
            forward,
            model,
            alone,
            mounting: Mounting {
                beside_mm: [[0.0; 2]; 4],
                ..told
            },
        })
    }

    /// The film run forwards.
    pub fn forward(&self) -> &Forward<'m> {
        &self.forward
    }

    /// Focal lengths per px.
    pub fn per_px(&self) -> f32 {
        self.mounting.scale()
    }

    /// A straight press, N, at a place, mm, as markers show it; the number selects their noise, and
    /// without it they have none.
    pub fn contact(&self, force_n: f64, place_mm: [f64; 2], noise: Option<u64>) -> Contact<'_> {
        let forward = &self.forward;
        let place_mm = place_mm.map(|part| part as f32);
        let pose = Pose::of_force(
            [0.0, 0.0, -force_n as f32],
            place_mm,
            &forward.stiffness,
            &forward.limits,
        );
        let scale = self.mounting.scale();
        let [away, across] = forward.noise.at_rest_px.map(|part| scale * part);
        let shown = forward
            .tables
            .predict(&pose, &forward.limits, &self.mounting.beside_mm);
        let mut random = noise.map(seeded);
        let variances = [away * away, across * across];
        let observed = Observed {
            hanging: None,
            drift: None,
            moved: shown.moved.map(|part| {
                // As large both ways as the mean of away and across is.
                let noise = random.as_mut().map_or(0.0, normal);
                part + (away + across) / 2.0 * noise as f32
            }),
            noise: std::array::from_fn(|k| forward.rest_image.noise(k, variances)),
        };
        let best = descend(forward, &observed, &self.mounting, pose).0;
        Contact {
            film: self,
            pose,
            observed,
            best,
        }
    }
}

impl Contact<'_> {
    /// Where steps from the truth lead.
    pub fn best(&self) -> &Estimate {
        &self.best
    }

    /// What the network alone guesses.
    ///
    /// # Errors
    /// Never, while markers lie in a picture.
    pub fn network(&self) -> Result<Pose> {
        let Film {
            forward,
            model,
            alone,
            mounting,
        } = self.film;
        let marker = |k: usize| {
            let (x, y) = model.rest.features.centroids[k];
            let off = forward.noise.rest_px[k];
            let at = |rest: Px, i: usize| {
                let px = self.observed.moved[2 * k + i] / mounting.scale() - off[i];
                Px(rest.0 + (65_536.0 * px) as i32)
            };
            Marker {
                x: at(x, 0),
                y: at(y, 1),
                area: model.rest.areas[k],
            }
        };
        let features = Features::of_markers(&std::array::from_fn(marker));
        let output = Network::new().run(alone, &features, &model.rest.features);
        let (force, _) = force::of_outputs(alone, &output);
        let place_mm = output.place.map(|part| part as f32 * 1e-3);
        let force_n = force.cartesian.map(|part| part.0 as f32 * 1e-6);
        Ok(Pose::of_force(
            force_n,
            place_mm,
            &forward.stiffness,
            &forward.limits,
        ))
    }

    /// A first guess at this contact.
    pub fn start(&self, (part, place_mm): &Start) -> Pose {
        let Film { forward, .. } = self.film;
        let force_n = forward.stiffness.magnitude_n(self.pose.size);
        let size = forward
            .stiffness
            .size_of(part * force_n, forward.limits.size);
        Pose {
            size,
            tilt: [0.0; 2],
            place_mm: *place_mm,
        }
    }

    /// Where steps from a guess lead.
    pub fn descend(&self, guess: Pose) -> End {
        let Film {
            forward, mounting, ..
        } = self.film;
        let (estimate, steps) = descend(forward, &self.observed, mounting, guess);
        self.end(&estimate, steps)
    }

    /// What the sensor makes of markers that are seen farther along x and y, focal lengths.
    pub fn with_marker_off(&self, marker: usize, off: [f32; 2]) -> Estimate {
        let Film {
            forward, mounting, ..
        } = self.film;
        let mut observed = self.observed;
        for (moved, off) in observed.moved[2 * marker..].iter_mut().zip(off) {
            *moved += off;
        }
        forward.estimate(&observed, mounting, forward.unknown(true), self.pose)
    }

    /// The load.
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// Where the sensor goes from there: from the film's middle, too, where that leads to nothing.
    pub fn sense(&self, guess: Pose) -> End {
        let Film {
            forward, mounting, ..
        } = self.film;
        self.end(
            &forward.estimate(&self.observed, mounting, forward.unknown(true), guess),
            0,
        )
    }

    fn end(&self, estimate: &Estimate, steps: u32) -> End {
        if estimate.unexplained > UNEXPLAINED {
            return End::Nothing;
        }
        let stiffness = &self.film.forward.stiffness;
        let [there, best] = [&estimate.pose, &self.best.pose];
        let off_n = stiffness.magnitude_n(there.size) - stiffness.magnitude_n(best.size);
        let [x, y] = [0, 1].map(|i| there.place_mm[i] - best.place_mm[i]);
        match x.hypot(y) <= SAME_MM && off_n.abs() <= SAME_N {
            true => End::Found { steps },
            false => End::Another,
        }
    }
}

/// Steps until more would not help: at most as many as the sensor takes.
fn descend(
    forward: &Forward<'_>,
    observed: &Observed<'_>,
    mounting: &Mounting,
    guess: Pose,
) -> (Estimate, u32) {
    let unknown = forward.unknown(true);
    let mut descent = Descent::new(forward, observed, mounting, unknown, guess);
    let mut steps = 0;
    while steps < u32::from(STEPS_AT_MOST) && !descent.is_over() && descent.step() {
        steps += 1;
    }
    (descent.estimate(), steps)
}
