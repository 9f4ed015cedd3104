//! Bands into samples: runs the sensing pipeline in thread mode, below everything else.

use crate::band_copy::BandCopy;
use crate::bands::SHAPE;
use crate::camera::{self, Format};
use crate::capture::{self, EVENTS, Told};
use crate::convert;
use crate::follow::Follow;
use crate::health::{self, Condition};
use crate::near_table::NearTable;
use crate::next_threshold::NextThreshold;
use crate::tare::Taring;
use crate::{info, outbox, session, stats};
use embassy_futures::select::{Either3, select3};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Instant, Timer};
use hivtac_capture::{Action, Band, Delivery, Ending, Event, Follower};
use hivtac_sensing::pipeline::{self, Measurement};
use hivtac_wire::message::{DeviceMessage, Outcome, Reply, Sample, Threshold};
use hivtac_wire::status::Status;

/// What the host wants of the pipeline; done between two frames. Each is answered with its `id`.
pub enum Order {
    /// Use this threshold and its pixel format as soon as possible.
    SetThreshold {
        /// Of the command.
        id: u16,
        /// As it came, unchecked.
        threshold: Threshold,
    },
    /// Take the mean of the next good frames as the rest position.
    Tare {
        /// Of the command.
        id: u16,
        /// How many; unchecked.
        frames: u16,
    },
}

/// The pipeline, its table in DTCM.
pub type Sensor = pipeline::Sensor<'static, 64, NearTable>;

/// Orders that wait.
pub static ORDERS: Channel<CriticalSectionRawMutex, Order, 4> = Channel::new();

/// Runs for ever in thread mode. `sensor` is configured.
#[embassy_executor::task]
pub async fn run(sensor: &'static mut Sensor, bands: BandCopy) {
    let next = NextThreshold::take(sensor.settings().byte_order);
    let sent = Format::of(sensor.threshold().format()).unwrap_or(Format::Rgb565);
    let mut task = PipelineTask {
        sensor,
        sent,
        next,
        bands,
        follower: Follower::new(SHAPE),
        follow: Follow::new(),
        busy_us: 0,
        newest: 0,
        sequence: 0,
        first: true,
        taring: None,
    };
    loop {
        task.step().await;
    }
}

struct PipelineTask {
    sensor: &'static mut Sensor,
    /// The pixels of the frames that come.
    sent: Format,
    next: NextThreshold,
    bands: BandCopy,
    follower: Follower,
    follow: Follow,
    /// Spent on the frame under way, µs.
    busy_us: u32,
    /// The frame that was measured last.
    newest: u32,
    /// Samples produced.
    sequence: u32,
    /// No frame was measured yet.
    first: bool,
    /// A tare under way.
    taring: Option<Taring>,
}

impl PipelineTask {
    /// Does the next thing there is to do. Orders wait for the end of a frame.
    async fn step(&mut self) {
        if self.follower.is_scanning() {
            return self.go_on().await;
        }
        self.use_next_threshold();
        if self.next.is_unfinished() && EVENTS.is_empty() {
            self.next.go_on();
            return;
        }
        self.taring.take_if(|taring| !taring.is_wanted());
        let deadline = self.taring.as_ref().map_or(Instant::MAX, Taring::deadline);
        match select3(ORDERS.receive(), EVENTS.receive(), Timer::at(deadline)).await {
            Either3::First(order) => self.obey(order),
            Either3::Second(told) => self.follow(told),
            Either3::Third(()) => self.give_up_tare(),
        }
    }

    /// Goes on with the frame under way. One that has all its rows need not wait for its end.
    async fn go_on(&mut self) {
        let complete = self.follower.is_complete();
        if complete && EVENTS.is_empty() && !capture::has_begun_a_band() {
            let action = self.follower.deliver();
            self.act(action);
        } else if !complete && self.next.is_unfinished() && EVENTS.is_empty() {
            self.next.go_on();
        } else {
            let told = EVENTS.receive().await;
            self.follow(told);
        }
    }

    fn follow(&mut self, Told { event, format }: Told) {
        if format != self.sent {
            self.change_format(format);
        }
        if let Event::Ended { edge, how } = event
            && how != Ending::Whole
        {
            defmt::warn!("frame {=u32}: {}", edge.number, defmt::Debug2Format(&how));
        }
        let action = self.follower.event(event);
        self.act(action);
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
        if tally.overrun + tally.size > 0 {
            health::set(Condition::NoForce);
        }
    }

    /// Scans the rows of a band.
    fn scan(&mut self, band: &Band) {
        let begun = Instant::now();
        if band.index == 0 {
            self.busy_us = 0;
            if band.edge.number != self.newest.wrapping_add(1) {
                self.sensor.forget_motion();
            }
            self.follow.begin(self.sensor, band.window);
        }
        let fetched = self.bands.fetch(band, capture::finished);
        if let Some(band) = &fetched {
            self.sensor.push_rows_below(band.above, band.rows);
        }
        self.follower.scanned(fetched.is_some());
        self.busy_us += begun.elapsed().as_micros() as u32;
    }

    fn obey(&mut self, order: Order) {
        match order {
            Order::SetThreshold { id, threshold } => {
                let wanted = convert::threshold_from_wire(threshold);
                if let Err(outcome) = self.next.begin(id, wanted) {
                    reply(id, outcome);
                }
            }
            Order::Tare { id, .. } if self.taring.is_some() => reply(id, Outcome::Busy),
            Order::Tare { id, frames } => match Taring::begin(id, frames) {
                Some(taring) => self.taring = Some(taring),
                None => reply(id, Outcome::InvalidArgument),
            },
        }
    }

    /// Between two frames: from the next one on, the threshold that was asked for holds, if it can.
    fn use_next_threshold(&mut self) {
        if let Some(asked) = self.next.come_into_use(self.sensor, self.sent) {
            info::set_looking(self.sensor.settings());
            if let Some(id) = asked.id() {
                reply(id, Outcome::Done);
            }
        }
    }

    /// Frames of other pixels come from now on. Markers have other areas in them: no rest position and no window holds.
    fn change_format(&mut self, format: Format) {
        self.sent = format;
        self.use_next_threshold();
        self.sensor.set_tare(None);
        self.sensor.forget_motion();
        self.give_up_tare();
        self.follow = Follow::new();
    }

    /// Measures the frame whose rows were scanned.
    fn deliver(&mut self, delivery: &Delivery) {
        let begun = Instant::now();
        let measurement = self.follow.finish(self.sensor);
        self.newest = delivery.edge.number;
        let sample = self.sample(delivery, &measurement);
        self.busy_us += begun.elapsed().as_micros() as u32;
        stats::PROCESSING_US.set(self.busy_us);
        let latency_us = Instant::now().as_micros().saturating_sub(sample.time_us);
        stats::LATENCY_US.set(latency_us as u32);
        self.tare_with(&measurement);
        health::set(match measurement.force {
            Some(_) => Condition::Good,
            None => Condition::NoForce,
        });
        if session::is_streaming() {
            self.sequence = self.sequence.wrapping_add(1);
            outbox::offer_sample(sample);
        }
    }

    fn sample(&mut self, delivery: &Delivery, measurement: &Measurement) -> Sample {
        let mut status = Status(measurement.status.bits());
        let first = core::mem::replace(&mut self.first, false);
        for (set, bit) in [
            (delivery.after_loss && !first, Status::FRAME_DROPPED),
            (delivery.after_overrun, Status::CAPTURE_OVERRUN),
            (delivery.after_restart, Status::CAMERA_RESTARTED),
        ] {
            if set {
                status |= bit;
            }
        }
        Sample {
            sequence: self.sequence,
            frame: delivery.edge.number,
            time_us: delivery.edge.time_us + u64::from(camera::exposure_middle_us()),
            status,
            force: measurement.force.map(convert::force_to_wire),
            markers: measurement
                .markers
                .filter(|_| session::wants_markers())
                .map(|markers| markers.map(convert::marker_to_wire)),
        }
    }

    fn tare_with(&mut self, measurement: &Measurement) {
        let Some(taring) = &mut self.taring else {
            return;
        };
        if let Some(rest) = taring.add(measurement) {
            let at_rest = rest.fits(&self.sensor.settings().geometry);
            if at_rest {
                self.sensor.set_tare(Some(rest));
            }
            reply(taring.id(), tare_outcome(at_rest));
            self.taring = None;
        }
    }

    fn give_up_tare(&mut self) {
        if let Some(taring) = self.taring.take() {
            reply(taring.id(), Outcome::NoGoodFrames);
        }
    }
}

fn tare_outcome(at_rest: bool) -> Outcome {
    if at_rest {
        Outcome::Done
    } else {
        Outcome::NotAtRest
    }
}

/// Answers a command. With no room the host does not read, and the reply is of no use.
fn reply(id: u16, outcome: Outcome) {
    outbox::offer(DeviceMessage::Reply(Reply { id, outcome }));
}
