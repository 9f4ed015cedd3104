//! A tare under way: which command it answers, what it has, and when it gives up.

use crate::camera;
use crate::dtcm_table::Sensor;
use crate::session;
use embassy_time::{Duration, Instant};
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::pipeline::Measurement;
use hivtac_sensor::tare::{Refusal, TareBuilder};
use hivtac_terms::units::Px;
use hivtac_wire::message::Outcome;

/// Every second frame may be bad, and a camera may need some time to come back.
const FRAME_TIMES_EACH: u32 = 2;
const EXTRA: Duration = Duration::from_secs(2);

/// Sums up good frames.
pub struct Taring {
    id: u16,
    conversation: u32,
    builder: TareBuilder,
    deadline: Instant,
}

impl Taring {
    /// For command `id`, over `frames` good frames; when the host `anyway`, also while something
    /// moves or touches the film. `None` when that number is out of its range.
    pub fn begin(id: u16, frames: u16, anyway: bool) -> Option<Self> {
        let frame_time = camera::frame_time(camera::report().settings.rate);
        let patience = frame_time * FRAME_TIMES_EACH * u32::from(frames) + EXTRA;
        let builder = TareBuilder::new(frames)?;
        Some(Self {
            id,
            conversation: session::number(),
            builder: if anyway { builder.insisting() } else { builder },
            deadline: Instant::now() + patience,
        })
    }

    /// The command's number.
    pub fn id(&self) -> u16 {
        self.id
    }

    /// False once the host that asked has gone.
    pub fn is_wanted(&self) -> bool {
        self.conversation == session::number()
    }

    /// When there were not enough good frames.
    pub fn deadline(&self) -> Instant {
        self.deadline
    }

    /// Takes the frame that was measured; gives the rest position once there were enough good ones,
    /// or why there is none.
    pub fn add(
        &mut self,
        sensor: &Sensor,
        measurement: &Measurement,
    ) -> Option<Result<Rest, Outcome>> {
        let outcome = sensor.tare_with(&mut self.builder, measurement)?;
        Some(outcome.map_err(|refusal| match refusal {
            Refusal::MarkersImplausible => Outcome::MarkersImplausible,
            Refusal::Unsteady => Outcome::Unsteady,
            Refusal::NotAtRest => Outcome::NotAtRest,
            Refusal::Touched(looks_like) => Outcome::Touched { looks_like },
        }))
    }

    /// The largest standard deviation of a marker's coordinate.
    pub fn spread(&self) -> Px {
        self.builder.spread()
    }

    /// Why there were not enough good frames in time.
    pub fn given_up(&self) -> Outcome {
        if self.builder.saw_implausible() {
            Outcome::MarkersImplausible
        } else if let Some(looks_like) = self.builder.saw_touch() {
            Outcome::Touched { looks_like }
        } else {
            Outcome::NoGoodFrames
        }
    }
}
