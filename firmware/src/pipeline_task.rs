//! Frames into samples: runs the sensing pipeline in thread mode, below everything else.

use crate::convert;
use crate::frame::{CAPTURED, Captured, FREE};
use crate::health::{self, Condition};
use crate::tare::Taring;
use crate::{info, outbox, session, stats};
use embassy_futures::select::{Either3, select3};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Instant, Timer};
use hivtac_sensing::pipeline::{Measurement, Sensor};
use hivtac_wire::message::{DeviceMessage, HsvBox, Outcome, Reply, Sample};
use hivtac_wire::status::Status;

/// What the host wants of the pipeline; done between two frames. Each is answered with its `id`.
pub enum Order {
    /// Use this threshold from the next frame on.
    SetThreshold {
        /// Of the command.
        id: u16,
        /// As it came, unchecked.
        threshold: HsvBox,
    },
    /// Take the mean of the next good frames as the rest position.
    Tare {
        /// Of the command.
        id: u16,
        /// How many; unchecked.
        frames: u16,
    },
}

/// Orders that wait.
pub static ORDERS: Channel<CriticalSectionRawMutex, Order, 4> = Channel::new();

/// Runs for ever in thread mode. `sensor` is configured.
#[embassy_executor::task]
pub async fn run(sensor: &'static mut Sensor<'static>) {
    info::set_threshold(convert::threshold_to_wire(sensor.threshold()));
    let mut task = PipelineTask {
        sensor,
        sequence: 0,
        last_frame: None,
        taring: None,
    };
    loop {
        task.step().await;
    }
}

struct PipelineTask {
    sensor: &'static mut Sensor<'static>,
    /// Samples produced.
    sequence: u32,
    /// Number of the frame processed last.
    last_frame: Option<u32>,
    /// A tare under way.
    taring: Option<Taring>,
}

impl PipelineTask {
    /// Does the next thing there is to do.
    async fn step(&mut self) {
        self.taring.take_if(|taring| !taring.is_wanted());
        let deadline = self.taring.as_ref().map_or(Instant::MAX, Taring::deadline);
        match select3(ORDERS.receive(), CAPTURED.receive(), Timer::at(deadline)).await {
            Either3::First(order) => self.obey(order),
            Either3::Second(captured) => self.process(captured).await,
            Either3::Third(()) => self.give_up_tare(),
        }
    }

    fn obey(&mut self, order: Order) {
        match order {
            Order::SetThreshold { id, threshold } => reply(id, self.set_threshold(threshold)),
            Order::Tare { id, .. } if self.taring.is_some() => reply(id, Outcome::Busy),
            Order::Tare { id, frames } => match Taring::begin(id, frames) {
                Some(taring) => self.taring = Some(taring),
                None => reply(id, Outcome::InvalidArgument),
            },
        }
    }

    fn set_threshold(&mut self, threshold: HsvBox) -> Outcome {
        let wanted = convert::threshold_from_wire(threshold);
        match self.sensor.set_threshold(wanted) {
            Ok(()) => {
                info::set_threshold(threshold);
                Outcome::Done
            }
            Err(_) => Outcome::InvalidArgument,
        }
    }

    async fn process(&mut self, captured: Captured) {
        let begun = Instant::now();
        let measurement = self.measure(&captured);
        stats::PROCESSING_US.set(begun.elapsed().as_micros() as u32);
        stats::FRAMES_PROCESSED.count();
        let sample = self.sample(&captured, &measurement);
        FREE.send(captured.frame).await;
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

    fn measure(&mut self, captured: &Captured) -> Measurement {
        self.sensor.begin_frame();
        for row in captured.frame.rows() {
            self.sensor.push_row(row);
        }
        self.sensor.finish_frame()
    }

    fn sample(&mut self, captured: &Captured, measurement: &Measurement) -> Sample {
        let number = captured.edge.number;
        let mut status = Status(measurement.status.bits());
        let follows = self
            .last_frame
            .is_none_or(|last| last.wrapping_add(1) == number);
        for (set, bit) in [
            (!follows, Status::FRAME_DROPPED),
            (captured.after_overrun, Status::CAPTURE_OVERRUN),
            (captured.after_restart, Status::CAMERA_RESTARTED),
        ] {
            if set {
                status |= bit;
            }
        }
        self.last_frame = Some(number);
        Sample {
            sequence: self.sequence,
            frame: number,
            time_us: captured.edge.time_us,
            status,
            force: measurement.force.map(convert::force_to_wire),
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
