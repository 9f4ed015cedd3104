//! What the host asks for, and the answers.

use crate::capture_task::{self, Action};
use crate::pipeline_task::Order;
use crate::shared::ORDERS;
use crate::{info, outbox, session, snapshot, stats};
use hivtac_sensing::model::Model;
use hivtac_wire::decoder::Received;
use hivtac_wire::message::{Command, DeviceMessage, HostMessage, Outcome, Reply, Request};
use hivtac_wire::version::HelloPrefix;

/// Acts on one message. `model` is for the hello.
pub async fn handle(received: Received<HostMessage>, model: Option<&Model<'_>>) {
    match received {
        Received::Message(HostMessage::Hello(hello)) => {
            let prefix = HelloPrefix {
                protocol: hello.protocol,
                schema: hello.schema,
            };
            greet(prefix, model).await;
        }
        Received::ForeignHello(prefix) => greet(prefix, model).await,
        // Before a hello, and after one of another version, commands are ignored.
        Received::Message(HostMessage::Command(command)) if session::is_open() => {
            obey(command, model).await;
        }
        Received::Message(HostMessage::Command(_)) => {}
    }
}

async fn greet(prefix: HelloPrefix, model: Option<&Model<'_>>) {
    session::begin(prefix.is_ours());
    outbox::clear();
    outbox::answer(DeviceMessage::Hello(info::hello(model))).await;
}

async fn obey(Command { id, request }: Command, model: Option<&Model<'_>>) {
    let outcome = match request {
        Request::GetInfo => {
            outbox::answer(DeviceMessage::Hello(info::hello(model))).await;
            outbox::answer(DeviceMessage::Stats(stats::snapshot())).await;
            Outcome::Done
        }
        Request::Start | Request::StartWithMarkers => {
            session::send_markers(request == Request::StartWithMarkers);
            session::stream(true);
            Outcome::Done
        }
        Request::Stop => {
            session::stream(false);
            Outcome::Done
        }
        // The pipeline replies itself, between two frames.
        Request::SetThreshold(threshold) => match order(Order::SetThreshold { id, threshold }) {
            Some(outcome) => outcome,
            None => return,
        },
        // The capture task replies itself, when the camera is ready.
        Request::Expose => match capture_task::order(Action::Expose, id) {
            Some(outcome) => outcome,
            None => return,
        },
        Request::Inspect => match capture_task::order(Action::Inspect, id) {
            Some(outcome) => outcome,
            None => return,
        },
        // The sender replies itself, behind the last part.
        Request::Snapshot => match snapshot::ask(id) {
            Some(outcome) => outcome,
            None => return,
        },
        Request::Tare { frames } => match order(Order::Tare { id, frames }) {
            Some(outcome) => outcome,
            None => return,
        },
    };
    outbox::answer(DeviceMessage::Reply(Reply { id, outcome })).await;
}

/// Passes an order on; `Busy` when there are too many.
pub fn order(order: Order) -> Option<Outcome> {
    match ORDERS.try_send(order) {
        Ok(()) => None,
        Err(_) => Some(Outcome::Busy),
    }
}
