//! What waits to be sent to the host. Bounded: nobody who measures ever waits for the host.

use crate::shared::{ANSWERS, SAMPLES};
use crate::snapshot::Outgoing;
use crate::{session, stats};
use embassy_futures::select::{Either3, select3};
use hivtac_wire::message::{DeviceMessage, Outcome, Reply, Sample};

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

/// The next message to send; answers go before samples, and these before a snapshot's parts.
pub async fn next(snapshot: &mut Outgoing) -> DeviceMessage {
    match select3(ANSWERS.receive(), SAMPLES.receive(), snapshot.next()).await {
        Either3::First(answer) => answer,
        Either3::Second(sample) => DeviceMessage::Sample(sample),
        Either3::Third(message) => message,
    }
}

/// Throws away what is left of an earlier conversation.
pub fn clear() {
    ANSWERS.clear();
    SAMPLES.clear();
}
