//! What the host asks for, and the answers.

use crate::capture_task::{self, Action};
use crate::pipeline_task::Order;
use crate::shared::ORDERS;
use crate::{info, loader, memory, model_upload, outbox, session, settings, snapshot, stats};
use hivtac_wire::decoder::Received;
use hivtac_wire::message::{Command, DeviceMessage, HostMessage, Outcome, Reply, Request};
use hivtac_wire::version::HelloPrefix;

/// Acts on one message.
pub async fn handle(received: Received<HostMessage>) {
    match received {
        Received::Message(HostMessage::Hello(hello)) => {
            let prefix = HelloPrefix {
                protocol: hello.protocol,
                schema: hello.schema,
            };
            greet(prefix).await;
        }
        Received::ForeignHello(prefix) => greet(prefix).await,
        // Before a hello, and after one of another version, commands are ignored.
        Received::Message(HostMessage::Command(command)) if session::is_open() => {
            obey(command).await;
        }
        Received::Message(HostMessage::Down(down)) if session::is_open() => {
            settings::set_down(down)
        }
        Received::Message(HostMessage::Command(_) | HostMessage::Down(_)) => {}
    }
}

async fn greet(prefix: HelloPrefix) {
    session::begin(prefix.is_ours());
    outbox::clear();
    outbox::answer(DeviceMessage::Hello(info::hello())).await;
}

async fn obey(Command { id, request }: Command) {
    let outcome = match request {
        Request::GetInfo => {
            outbox::answer(DeviceMessage::Hello(info::hello())).await;
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
        Request::SetCamera(settings) => match capture_task::order(Action::Set(settings), id) {
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
        Request::Tare { frames } => match tare(id, frames, false) {
            Some(outcome) => outcome,
            None => return,
        },
        Request::TareAnyway { frames } => match tare(id, frames, true) {
            Some(outcome) => outcome,
            None => return,
        },
        Request::SetTare(position) => match order(Order::SetTare { id, position }) {
            Some(outcome) => outcome,
            None => return,
        },
        Request::SetName(name) => {
            settings::set_name(name);
            Outcome::Done
        }
        Request::SetTemporal(settings) => match order(Order::SetTemporal { id, settings }) {
            Some(outcome) => outcome,
            None => return,
        },
        Request::BeginModel { bytes } => model_upload::begin(bytes),
        Request::ModelPart(part) => model_upload::part(&part),
        // The memory task replies itself, when it has done so, or the pipeline then.
        Request::GetSettings => match memory::order(memory::Action::Report, id) {
            Some(outcome) => outcome,
            None => return,
        },
        Request::GetHealth => match memory::order(memory::Action::Health, id) {
            Some(outcome) => outcome,
            None => return,
        },
        Request::StartLoader => {
            let outcome = Outcome::Done;
            outbox::answer(DeviceMessage::Reply(Reply { id, outcome })).await;
            loader::start().await
        }
        Request::Keep(selection) => match memory::order(memory::Action::Keep(selection), id) {
            Some(outcome) => outcome,
            None => return,
        },
        Request::UseModel => match memory::order(memory::Action::UseModel, id) {
            Some(outcome) => outcome,
            None => return,
        },
        Request::UseBuiltInModel => match memory::order(memory::Action::UseBuiltInModel, id) {
            Some(outcome) => outcome,
            None => return,
        },
        Request::Reset => match memory::order(memory::Action::Reset, id) {
            Some(outcome) => outcome,
            None => return,
        },
    };
    outbox::answer(DeviceMessage::Reply(Reply { id, outcome })).await;
}

fn tare(id: u16, frames: u16, insists: bool) -> Option<Outcome> {
    order(Order::Tare {
        id,
        frames,
        insists,
    })
}

/// Passes an order on; `Busy` when there are too many.
pub fn order(order: Order) -> Option<Outcome> {
    match ORDERS.try_send(order) {
        Ok(()) => None,
        Err(_) => Some(Outcome::Busy),
    }
}
