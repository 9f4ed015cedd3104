//! Carries out the host's requests and answers them.

use crate::capture_task::{self, Action};
use crate::orders::{Order, order};
use crate::{
    info, loader, memory, model_upload, outbox, session, settings, snapshot, starts, stats,
};
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
    starts::good();
    session::begin(prefix.is_ours());
    outbox::clear();
    outbox::answer(DeviceMessage::Hello(info::hello())).await;
    if prefix == HelloPrefix::START_LOADER {
        loader::start().await;
    }
}

async fn obey(Command { id, request }: Command) {
    if let Some(outcome) = carry_out(id, request).await {
        outbox::answer(DeviceMessage::Reply(Reply { id, outcome })).await;
    }
}

/// Returns the outcome; `None` if another task replies. That is the pipeline between two frames,
/// the capture task when the camera is ready, the memory task after writing, or the sender after a
/// snapshot's last part.
async fn carry_out(id: u16, request: Request) -> Option<Outcome> {
    match request {
        Request::GetInfo => {
            outbox::answer(DeviceMessage::Hello(info::hello())).await;
            outbox::answer(DeviceMessage::Stats(stats::snapshot())).await;
            Some(Outcome::Done)
        }
        Request::Start | Request::StartWithMarkers => {
            session::send_markers(request == Request::StartWithMarkers);
            session::stream(true);
            Some(Outcome::Done)
        }
        Request::Stop => {
            session::stream(false);
            Some(Outcome::Done)
        }
        Request::SetThreshold(threshold) => order(Order::SetThreshold { id, threshold }),
        Request::Expose => capture_task::order(Action::Expose, id),
        Request::SetCamera(settings) => capture_task::order(Action::Set(settings), id),
        Request::Inspect => capture_task::order(Action::Inspect, id),
        Request::Snapshot => snapshot::ask(id),
        Request::Tare { frames } => tare(id, frames, false),
        Request::TareAnyway { frames } => tare(id, frames, true),
        Request::SetTare(position) => order(Order::SetTare { id, position }),
        Request::SetName(name) => {
            settings::set_name(name);
            Some(Outcome::Done)
        }
        Request::SetContactShape(shape) => {
            let set = settings::set_contact_shape(shape);
            Some(set.err().unwrap_or(Outcome::Done))
        }
        Request::SetTemporal(settings) => order(Order::SetTemporal { id, settings }),
        // The memory task is reading the last upload.
        Request::BeginModel { .. } if memory::is_ordered() => Some(Outcome::Busy),
        Request::BeginModel { bytes } => Some(model_upload::begin(bytes)),
        Request::ModelPart(part) => Some(model_upload::part(&part)),
        Request::GetSettings => memory::order(memory::Action::Report, id),
        Request::GetHealth => memory::order(memory::Action::Health, id),
        Request::StartLoader => {
            let outcome = Outcome::Done;
            outbox::answer(DeviceMessage::Reply(Reply { id, outcome })).await;
            loader::start().await
        }
        Request::Keep(selection) => memory::order(memory::Action::Keep(selection), id),
        Request::UseModel => memory::order(memory::Action::UseModel, id),
        Request::UseBuiltInModel => memory::order(memory::Action::UseBuiltInModel, id),
        Request::Reset => memory::order(memory::Action::Reset, id),
    }
}

fn tare(id: u16, frames: u16, anyway: bool) -> Option<Outcome> {
    order(Order::Tare { id, frames, anyway })
}
