//! Turns bands into samples: runs the sensing pipeline in thread mode, at the lowest priority.

use crate::band_copy::BandCopy;
use crate::bands::SHAPE;
use crate::camera;
use crate::capture::{self, CAPTURE_EVENTS, CaptureEvent};
use crate::condition::{self, Condition};
use crate::dtcm_table::Sensor;
use crate::model::ModelFile;
use crate::next_model::{self, InUse};
use crate::next_threshold::NextThreshold;
use crate::orders::{ORDERS, Order};
use crate::session::Origin;
use crate::snapshot_copy::SnapshotCopy;
use crate::tare::Taring;
use crate::{outbox, output, seeded_bugs, session, settings, stats, uart, vsync};
use embassy_futures::select::{Either3, select3};
use embassy_time::{Instant, Timer};
use hivtac_portable::capture::{Action, Band, Delivery, Ending, Event, Follower};
use hivtac_portable::device::answer;
use hivtac_sensor::force::forward::Drift;
use hivtac_sensor::force::rest::Rest;
use hivtac_sensor::pipeline::{Measurement, Work};
use hivtac_sensor::temporal::{Followed, Moment};
use hivtac_terms::status::Status;
use hivtac_terms::temporal::TemporalSettings;
use hivtac_wire::message::{DeviceMessage, Outcome, Sample};
use hivtac_wire::settings::RestPosition;

/// Runs for ever in thread mode. `sensor` is configured with `model`.
#[embassy_executor::task]
pub async fn run(
    sensor: &'static mut Sensor,
    model: InUse,
    bands: BandCopy,
    snapshots: SnapshotCopy,
) {
    let mut task = PipelineTask {
        sensor,
        model,
        next_threshold: NextThreshold::NONE,
        bands,
        last_band: 0,
        follower: Follower::new(SHAPE),
        busy_us: 0,
        newest: 0,
        sequence: 0,
        first: true,
        taring: None,
        snapshots,
    };
    // Only this loop waits: an async function that ends could be polled again, and panic.
    loop {
        if task.follower.is_scanning() {
            if !task.deliver_early() {
                let event = CAPTURE_EVENTS.receive().await;
                task.take(event);
            }
            continue;
        }
        // Orders wait for the end of a frame.
        let deadline = Timer::at(task.deadline());
        match select3(ORDERS.receive(), CAPTURE_EVENTS.receive(), deadline).await {
            Either3::First(order) => task.obey(order),
            Either3::Second(event) => task.take(event),
            Either3::Third(()) => task.give_up_overdue(),
        }
    }
}

struct PipelineTask {
    sensor: &'static mut Sensor,
    model: InUse,
    next_threshold: NextThreshold,
    bands: BandCopy,
    /// Sequence number of the last scanned band.
    last_band: u32,
    follower: Follower,
    /// Time spent on the current frame, µs.
    busy_us: u32,
    /// Number of the last measured frame.
    newest: u32,
    /// Number of samples produced.
    sequence: u32,
    /// True until the first frame was measured.
    first: bool,
    /// The active tare.
    taring: Option<Taring>,
    snapshots: SnapshotCopy,
}

impl PipelineTask {
    /// Returns when an active tare or snapshot gives up.
    fn deadline(&mut self) -> Instant {
        self.taring.take_if(|taring| !taring.is_wanted());
        self.tare_deadline().min(self.snapshots.deadline())
    }

    fn tare_deadline(&self) -> Instant {
        self.taring.as_ref().map_or(Instant::MAX, Taring::deadline)
    }

    /// Ends a tare or snapshot that has waited too long.
    fn give_up_overdue(&mut self) {
        let now = Instant::now();
        if self.tare_deadline() <= now {
            self.give_up_tare();
        }
        if self.snapshots.deadline() <= now {
            self.snapshots.give_up();
        }
    }

    /// Delivers the current frame before its end is known, if it has all its rows. Returns whether
    /// it did.
    fn deliver_early(&mut self) -> bool {
        let complete = self.follower.is_complete();
        let early = complete && CAPTURE_EVENTS.is_empty() && !capture::has_begun_a_band();
        if early {
            let action = self.follower.deliver();
            self.act(action);
        }
        early
    }

    /// Handles an event of the capture.
    fn take(&mut self, CaptureEvent { event, format }: CaptureEvent) {
        if let Event::Ended { edge, how } = event
            && how != Ending::Whole
        {
            defmt::warn!("frame {=u32}: {}", edge.number, defmt::Debug2Format(&how));
        }
        if let Event::Passed { .. } = event {
            self.camera_was_set_up();
        }
        let action = self.follower.event(event);
        // The first event with other pixels means that the camera was set to them.
        if format.pixels() != self.sensor.threshold().format() {
            self.change_format();
        }
        self.act(action);
    }

    /// Frames before a set-up were exposed otherwise, and may be those of another camera.
    fn camera_was_set_up(&mut self) {
        self.sensor.set_motion(camera::fitted().motion);
        self.sensor.forget_frame();
    }

    fn act(&mut self, action: Action) {
        match action {
            Action::None => {}
            Action::Scan(band) => self.scan(&band),
            Action::Deliver(delivery) => self.deliver(&delivery),
        }
        let tally = self.follower.take_tally();
        stats::FRAMES_PROCESSED.add(tally.processed);
        stats::DROPPED_BUSY.add(tally.busy);
        stats::DROPPED_OVERRUN.add(tally.overrun);
        stats::DROPPED_SIZE.add(tally.size);
        stats::DROPPED_SETUP.add(tally.passed);
        if tally.overrun + tally.size > 0 {
            condition::set(Condition::NoForce);
        }
    }

    /// Scans the rows of a band.
    fn scan(&mut self, band: &Band) {
        let begun = Instant::now();
        if band.index == 0 {
            self.busy_us = 0;
            match band.edge.number.wrapping_sub(self.newest) {
                1 => {}
                passed => self.sensor.miss_frames(passed.wrapping_sub(1)),
            }
            self.sensor.set_down(settings::down());
            self.sensor.set_contact_shape(settings::contact_shape());
            self.sensor.begin_frame();
        }
        let fetched = self.bands.fetch(band, capture::finished);
        let rows = fetched.as_ref().map(|fetched| fetched.rows);
        self.snapshots.band(band.index, rows);
        self.last_band = band.sequence;
        if let Some(band) = &fetched {
            self.sensor.push_rows_below(band.above, band.rows);
        }
        self.follower.scanned(fetched.is_some());
        self.busy_us += stats::since(begun).as_micros() as u32;
    }

    fn obey(&mut self, order: Order) {
        match order {
            Order::SetThreshold { id, threshold } => {
                match self.next_threshold.take(id, threshold, self.sensor) {
                    Ok(true) => {
                        self.threshold_changed();
                        outbox::reply(id, Outcome::Done);
                    }
                    Ok(false) => {}
                    Err(outcome) => outbox::reply(id, outcome),
                }
            }
            Order::Tare { id, .. } if self.taring.is_some() => outbox::reply(id, Outcome::Busy),
            Order::Tare { id, frames, anyway } => match Taring::begin(id, frames, anyway) {
                Some(taring) => self.taring = Some(taring),
                None => outbox::reply(id, Outcome::InvalidArgument),
            },
            Order::SetTare { id, position } => {
                outbox::reply(id, self.set_tare(position));
            }
            Order::SetTemporal { id, settings } => {
                let outcome = match self.sensor.set_temporal(settings) {
                    Ok(()) => Outcome::Done,
                    Err(_) => Outcome::InvalidArgument,
                };
                self.follow();
                outbox::reply(id, outcome);
            }
            Order::Snapshot(origin) => self.snapshots.begin(origin),
            Order::UseModel {
                origin,
                next,
                afresh,
            } => self.use_model(origin, next, afresh),
        }
    }

    /// Called between two frames, so that no frame mixes two models.
    fn use_model(&mut self, origin: Origin, next: ModelFile, afresh: bool) {
        self.give_up_tare();
        let before = self.sensor.threshold();
        let wanted = next_model::bring_into_use(next, afresh, self.sensor, &mut self.model);
        if afresh {
            // The usual settings are always valid.
            let _ = self.sensor.set_temporal(TemporalSettings::USUAL);
        }
        if self.sensor.threshold() == before {
            self.follow();
        } else {
            self.threshold_changed();
        }
        let waits = wanted.is_some_and(|threshold| self.next_threshold.wait_for(origin, threshold));
        if let Some(id) = origin.id().filter(|_| !waits) {
            outbox::reply(id, Outcome::Done);
        }
    }

    fn set_tare(&mut self, position: Option<RestPosition>) -> Outcome {
        let rest = position.map(|position| settings::rest(&position, self.sensor));
        match rest.transpose() {
            Ok(rest) => {
                self.give_up_tare();
                // It was taken at another time, so the film may have drifted.
                let down = position.and_then(|position| position.down);
                self.sensor.set_tare_under(rest, Drift::UNSEEN, down);
                self.follow();
                Outcome::Done
            }
            Err(outcome) => outcome,
        }
    }

    /// Publishes the pipeline's settings.
    fn follow(&self) {
        settings::follow(self.sensor, self.model.source);
    }

    /// Measures against this rest position from the next frame on; with `None` against the model's
    /// own.
    fn use_tare(&mut self, rest: Option<Rest>, drift: Drift) {
        self.sensor.set_tare(rest, drift);
        self.follow();
    }

    /// Call when frames of a new pixel format come, that of the waiting threshold. Markers have
    /// other areas in them, so the rest position is discarded.
    fn change_format(&mut self) {
        let origin = self.next_threshold.come_into_use(self.sensor);
        self.use_tare(None, Drift::NONE);
        self.give_up_tare();
        self.threshold_changed();
        if let Some(id) = origin.and_then(Origin::id) {
            outbox::reply(id, Outcome::Done);
        }
    }

    /// Continues with the next frame. A threshold of RGB565 takes some 7 million instructions,
    /// during which frames pass.
    fn threshold_changed(&mut self) {
        self.follow();
        self.sensor.forget_frame();
        let mut missed = false;
        while let Ok(CaptureEvent { event, .. }) = CAPTURE_EVENTS.try_receive() {
            missed = true;
            if let Event::Passed { from, .. } = event {
                self.camera_was_set_up();
                self.follower.pass_over(from);
                self.follower.event(event);
            }
        }
        if missed {
            self.follower.pass_over(vsync::newest().number);
        }
        self.act(Action::None);
    }

    /// Measures the frame whose rows were scanned.
    fn deliver(&mut self, delivery: &Delivery) {
        seeded_bugs::fail_at(delivery.edge.number);
        let begun = Instant::now();
        let mut measurement = self.sensor.finish_frame();
        (self.sensor).follow_two_contacts(&mut measurement, Work::OF_A_FRAME);
        if self.taring.is_none() {
            self.look_again(&mut measurement, delivery);
        }
        self.newest = delivery.edge.number;
        let followed = self.sensor.follow(moment(delivery), &measurement);
        output::set(followed.output);
        let sample = self.sample(delivery, &measurement, &followed);
        let (frame, time_us) = (sample.frame, sample.time_us);
        self.busy_us += stats::since(begun).as_micros() as u32;
        stats::PROCESSING_US.set(self.busy_us);
        let latency_us = Instant::now().as_micros().saturating_sub(sample.time_us);
        stats::LATENCY_US.set(latency_us as u32);
        if followed.tells_rest {
            self.follow();
        }
        self.tare_with(&measurement);
        condition::set(match measurement.force {
            Some(_) => Condition::Good,
            None => Condition::NoForce,
        });
        if session::is_streaming() {
            self.sequence = self.sequence.wrapping_add(1);
            outbox::offer_sample(sample.clone());
        }
        uart::offer(sample);
        // After the sample, which goes first.
        let threshold = self.sensor.threshold();
        self.snapshots.frame(frame, time_us, threshold);
    }

    /// Takes a second look at the frame if the pipeline wants one and all its bands are still in
    /// the ring. If a band is overwritten meanwhile, the measurement stays unchanged.
    fn look_again(&mut self, measurement: &mut Measurement, delivery: &Delivery) {
        let Some(again) = self.sensor.look_again() else {
            return;
        };
        self.bands.rewind();
        let first = self.last_band.wrapping_sub(u32::from(SHAPE.bands()) - 1);
        for index in 0..SHAPE.bands() {
            let band = Band {
                sequence: first.wrapping_add(u32::from(index)),
                index,
                edge: delivery.edge,
            };
            let Some(fetched) = self.bands.fetch(&band, capture::finished) else {
                return;
            };
            self.sensor.push_rows_below(fetched.above, fetched.rows);
        }
        *measurement = self.sensor.finish_again(again);
    }

    fn sample(
        &mut self,
        delivery: &Delivery,
        measurement: &Measurement,
        followed: &Followed,
    ) -> Sample {
        let mut on_the_way = Status::OK;
        let first = core::mem::replace(&mut self.first, false);
        for (set, bit) in [
            (delivery.after_loss && !first, Status::FRAME_DROPPED),
            (delivery.after_overrun, Status::CAPTURE_OVERRUN),
            (delivery.after_restart, Status::CAMERA_RESTARTED),
        ] {
            if set {
                on_the_way |= bit;
            }
        }
        answer::sample(
            self.sequence,
            moment(delivery),
            on_the_way,
            measurement,
            followed,
            session::wants_markers(),
        )
    }

    fn tare_with(&mut self, measurement: &Measurement) {
        let Some(taring) = &mut self.taring else {
            return;
        };
        if let Some(outcome) = taring.add(self.sensor, measurement) {
            let id = taring.id();
            if let Ok(rest) = outcome {
                let report = settings::tared(&rest, self.sensor, taring.spread());
                outbox::offer(DeviceMessage::Tared(report));
            }
            self.taring = None;
            if let Ok(rest) = outcome {
                self.use_tare(Some(rest), Drift::NONE);
            }
            outbox::reply(id, outcome.err().unwrap_or(Outcome::Done));
        }
    }

    fn give_up_tare(&mut self) {
        if let Some(taring) = self.taring.take() {
            outbox::reply(taring.id(), taring.given_up());
        }
    }
}

/// Returns the frame number and exposure time of a delivery.
fn moment(delivery: &Delivery) -> Moment {
    let edge = delivery.edge;
    Moment {
        frame: edge.number,
        time_us: (edge.time_us).saturating_add_signed(camera::exposure_middle_us().into()),
    }
}
