//! Queues messages for the host. All queues are bounded: measuring never waits for the host.

use crate::{session, stats};
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use hivtac_wire::message::{DeviceMessage, Outcome, Reply, Sample};

/// A queue for the sender, one of the USB tasks.
type Queue<T, const N: usize> = Channel<CriticalSectionRawMutex, T, N>;

/// Hellos, replies, statistics and log lines. From the USB tasks, the pipeline and the capture
/// task.
static ANSWERS: Queue<DeviceMessage, 8> = Queue::new();

/// Samples: 0.2 s of them. Sending older ones is better than a gap, but not at the cost of more
/// latency. From the pipeline.
#[unsafe(link_section = ".sram.samples")]
static SAMPLES: Queue<Sample, 32> = Queue::new();

/// Queues an answer that the host waits for; waits for space. Only for tasks that serve the host.
pub async fn answer(message: DeviceMessage) {
    ANSWERS.send(message).await;
}

/// Queues a message if a host listens and there is space; returns whether it did.
pub fn offer(message: DeviceMessage) -> bool {
    session::is_open() && ANSWERS.try_send(message).is_ok()
}

/// Answers a command. If there is no space, the host does not read, and the reply is dropped.
pub fn reply(id: u16, outcome: Outcome) {
    offer(DeviceMessage::Reply(Reply { id, outcome }));
}

/// Queues a sample, or drops and counts it.
pub fn offer_sample(sample: Sample) {
    if SAMPLES.try_send(sample).is_err() {
        stats::USB_DROPPED.count();
    }
}

/// The next message to send; answers go before samples.
pub async fn next() -> DeviceMessage {
    match select(ANSWERS.receive(), SAMPLES.receive()).await {
        Either::First(answer) => answer,
        Either::Second(sample) => DeviceMessage::Sample(sample),
    }
}

/// Discards the messages of an earlier conversation.
pub fn clear() {
    ANSWERS.clear();
    SAMPLES.clear();
}
