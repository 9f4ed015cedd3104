//! Runs a tare: which command it answers, its frames so far, and its deadline.

use crate::camera;
use crate::dtcm_table::Sensor;
use crate::session;
use embassy_time::{Duration, Instant};
use hivtac_portable::device::answer;
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::pipeline::Measurement;
use hivtac_sensor::tare::TareBuilder;
use hivtac_terms::units::Px;
use hivtac_wire::message::Outcome;

/// Allows every second frame to be bad, and some time for a camera to come back.
const FRAME_TIMES_EACH: u32 = 2;
const EXTRA: Duration = Duration::from_secs(2);

/// Sums good frames.
pub struct Taring {
    id: u16,
    conversation: u32,
    builder: TareBuilder,
    deadline: Instant,
}

impl Taring {
    /// For the command `id`, over `frames` good frames; with `anyway` also while something moves or
    /// touches the film. Returns `None` if `frames` is out of range.
    pub fn begin(id: u16, frames: u16, anyway: bool) -> Option<Self> {
        let frame_time = camera::frame_time(camera::report().settings.rate);
        let patience = frame_time * FRAME_TIMES_EACH * u32::from(frames) + EXTRA;
        let builder = TareBuilder::new(frames)?;
        Some(Self {
            id,
            conversation: session::number(),
            builder: if anyway { builder.forced() } else { builder },
            deadline: Instant::now() + patience,
        })
    }

    /// The command's number.
    pub fn id(&self) -> u16 {
        self.id
    }

    /// Returns false once the host that requested it has gone.
    pub fn is_wanted(&self) -> bool {
        self.conversation == session::number()
    }

    /// When it gives up for lack of good frames.
    pub fn deadline(&self) -> Instant {
        self.deadline
    }

    /// Adds the measured frame. Once there are enough good ones, returns the rest position, or why
    /// it is refused; otherwise `None`.
    pub fn add(
        &mut self,
        sensor: &Sensor,
        measurement: &Measurement,
    ) -> Option<Result<Rest, Outcome>> {
        let outcome = sensor.tare_with(&mut self.builder, measurement)?;
        Some(outcome.map_err(answer::refused))
    }

    /// The largest standard deviation of a marker's coordinate.
    pub fn spread(&self) -> Px {
        self.builder.spread()
    }

    /// Returns why there were not enough good frames in time.
    pub fn given_up(&self) -> Outcome {
        answer::given_up(&self.builder)
    }
}
