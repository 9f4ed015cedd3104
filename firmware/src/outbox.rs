//! What waits to be sent to the host. Bounded: nobody who measures ever waits for the host.

use crate::{session, stats};
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use hivtac_wire::message::{DeviceMessage, Outcome, Reply, Sample};

/// What waits for the sender, one of the USB tasks.
type Queue<T, const N: usize> = Channel<CriticalSectionRawMutex, T, N>;

/// Hellos, replies, statistics and log lines. From the USB tasks, the pipeline and the capture task.
static ANSWERS: Queue<DeviceMessage, 8> = Queue::new();

/// Samples: 0.2 s of them. Older ones are worth more than a gap, but not more than a fresh
/// measurement's latency. From the pipeline.
#[unsafe(link_section = ".sram.samples")]
static SAMPLES: Queue<Sample, 32> = Queue::new();

/// Queues an answer that the host waits for; waits for room. Only for tasks that serve the host.
pub async fn answer(message: DeviceMessage) {
    ANSWERS.send(message).await;
}

/// Queues a message when a host listens and there is room; says whether it did.
pub fn offer(message: DeviceMessage) -> bool {
    session::is_open() && ANSWERS.try_send(message).is_ok()
}

/// Answers a command. With no room the host does not read, and the reply is of no use.
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

/// Throws away what is left of an earlier conversation.
pub fn clear() {
    ANSWERS.clear();
    SAMPLES.clear();
}
