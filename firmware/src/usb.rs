//! Provides a serial port over USB CDC-ACM, which never makes other tasks wait.
//!
//! # Design
//! It is one task on an executor of its own, above processing and below capture. Four parts run
//! concurrently: the USB stack, the receiver, the sender, and a watch on DTR. Samples reach the
//! sender through bounded queues (`outbox`).
//!
//! # Note
//! If the host does not read, messages are dropped whole or cut: a sample as soon as it is older
//! than [`OLDEST`], another message after [`WRITE_TIMEOUT`]. The packet that waits in the core is
//! taken back then. So what a host reads after a pause is new. After a cut the next frame begins
//! with a zero byte, so that the host resynchronizes at once.
//!
//! If USB is dead for another reason (`usb_watch::rescue_needed`), the device disconnects and
//! connects again.
//!
//! # Limitations
//! Without VBUS sensing an unplugged cable looks like a sleeping host: the conversation ends when
//! the next host resets the bus, or closes the port.

use crate::board::UsbPort;
use crate::snapshot::Outgoing;
use crate::usb_guard::Guarded;
use crate::usb_watch::{self, Watch};
use crate::{commands, outbox, session, stats, usb_core};
use embassy_futures::join::join5;
use embassy_futures::select::{Either, select};
use embassy_stm32::usb::{self, Driver};
use embassy_stm32::{bind_interrupts, peripherals};
use embassy_time::{Duration, Instant, Ticker, Timer, with_deadline};
use embassy_usb::class::cdc_acm::{CdcAcmClass, ControlChanged, Receiver, Sender, State};
use embassy_usb::{Builder, Config, UsbDevice};
use hivtac_wire::decoder::Decoder;
use hivtac_wire::frame::{HOST_FRAME_LIMIT, MAX_DEVICE_FRAME, encode};
use hivtac_wire::message::DeviceMessage;
use hivtac_wire::usb::{MANUFACTURER, PRODUCT, PRODUCT_ID, VENDOR_ID};

/// Bytes of a full-speed bulk packet.
const PACKET: usize = 64;
/// A reading host fetches a packet within a millisecond or two.
const WRITE_TIMEOUT: Duration = Duration::from_millis(100);
/// Largest age of a sample that is sent, from the middle of its exposure.
const OLDEST: Duration = Duration::from_millis(180);
/// Time without a connection after which a host has noticed it.
const DISCONNECTED: Duration = Duration::from_millis(20);
/// Period of the stats while streaming.
const STATS_PERIOD: Duration = Duration::from_secs(1);
/// Largest current of the board, an OV5640 and the kit's lamp, mA: 340 by docs/results/energy.md.
const CURRENT: u16 = 400;

bind_interrupts!(struct Irqs {
    OTG_FS => Watch, usb::InterruptHandler<peripherals::USB_OTG_FS>;
});

type Port<'d> = Guarded<Driver<'d, peripherals::USB_OTG_FS>>;

/// Runs for ever at the USB executor's priority.
#[embassy_executor::task]
pub async fn run(port: UsbPort) {
    let mut out_packets = [0; 4 * PACKET];
    let mut config_descriptor = [0; 128];
    let mut bos_descriptor = [0; 16];
    let mut control_packet = [0; PACKET];
    let mut state = State::new();
    let mut otg = usb::Config::default();
    otg.vbus_detection = false;
    let driver = Driver::new_fs(
        port.core,
        Irqs,
        port.plus,
        port.minus,
        &mut out_packets,
        otg,
    );
    let mut builder = Builder::new(
        Guarded::new(driver),
        identity(),
        &mut config_descriptor,
        &mut bos_descriptor,
        &mut [],
        &mut control_packet,
    );
    let class = CdcAcmClass::new(&mut builder, &mut state, PACKET as u16);
    let (sender, receiver, control) = class.split_with_control();
    let mut device = builder.build();
    join5(
        serve(&mut device),
        receive(receiver),
        send(sender),
        watch_dtr(control),
        send_stats(),
    )
    .await;
}

fn identity() -> Config<'static> {
    let mut config = Config::new(VENDOR_ID, PRODUCT_ID);
    config.manufacturer = Some(MANUFACTURER);
    config.product = Some(PRODUCT);
    config.serial_number = Some(embassy_stm32::uid::uid_hex());
    config.max_power = CURRENT;
    config
}

/// Serves bus and control pipe for ever.
async fn serve<'d>(device: &mut UsbDevice<'d, Port<'d>>) {
    loop {
        select(device.run(), usb_watch::rescue_needed()).await;
        defmt::warn!("USB is dead: connects again");
        session::end();
        device.disable().await;
        usb_core::connect(false);
        Timer::after(DISCONNECTED).await;
        usb_core::abort_all();
        usb_core::connect(true);
    }
}

async fn receive<'d>(mut receiver: Receiver<'d, Port<'d>>) {
    let mut decoder = Decoder::<HOST_FRAME_LIMIT>::new();
    let mut packet = [0; PACKET];
    loop {
        receiver.wait_connection().await;
        while let Ok(length) = receiver.read_packet(&mut packet).await {
            let mut bytes = packet.get(..length).unwrap_or(&packet);
            while let Some(message) = decoder.feed(&mut bytes) {
                commands::handle(message).await;
            }
            stats::HOST_FRAMES_REJECTED.set(decoder.rejected().frames());
        }
        decoder.reset();
        session::end();
    }
}

async fn send<'d>(mut sender: Sender<'d, Port<'d>>) {
    // A zero byte precedes the first frame, and each frame after a cut one.
    let mut buffer = [0; 1 + MAX_DEVICE_FRAME];
    let mut cut = true;
    let mut after_sample = false;
    let mut snapshot = Outgoing::NONE;
    loop {
        // Messages in the outbox go before a snapshot's parts.
        let (Either::First(message) | Either::Second(message)) =
            select(outbox::next(), snapshot.next()).await;
        let Some(frame) = buffer.get_mut(1..) else {
            return;
        };
        let Ok(frame) = encode(&message, frame) else {
            defmt::error!("a message is longer than the longest frame");
            continue;
        };
        let length = 1 + frame.len();
        let bytes = buffer.get(usize::from(!cut)..length).unwrap_or(&[]);
        let sent = send_bytes(&mut sender, bytes, last_moment(&message)).await;
        cut = sent.is_err();
        let is_sample = matches!(message, DeviceMessage::Sample(_));
        if let Err(Cut { packets }) = sent {
            let waited = usb_core::abort_data();
            if waited && packets == 0 && after_sample {
                // It was the last packet of the sample before.
                stats::USB_DROPPED.count();
            }
            match message {
                DeviceMessage::Sample(_) => stats::USB_DROPPED.count(),
                DeviceMessage::Snapshot(_) | DeviceMessage::SnapshotPart(_) => snapshot.give_up(),
                _ => {}
            }
        }
        after_sample = is_sample && !cut;
    }
}

/// The time at which a message is given up.
fn last_moment(message: &DeviceMessage) -> Instant {
    match message {
        DeviceMessage::Sample(sample) => Instant::from_micros(sample.time_us) + OLDEST,
        _ => Instant::now() + WRITE_TIMEOUT,
    }
}

/// A frame that was not sent whole.
struct Cut {
    /// Its packets that the core took.
    packets: usize,
}

/// Sends one frame, or as much of it as the host takes in time.
async fn send_bytes<'d>(
    sender: &mut Sender<'d, Port<'d>>,
    bytes: &[u8],
    until: Instant,
) -> Result<(), Cut> {
    // A transfer ends with a short packet, which is empty when the bytes fill the last one.
    let end = bytes.len().is_multiple_of(PACKET).then_some(&[][..]);
    for (packets, packet) in bytes.chunks(PACKET).chain(end).enumerate() {
        match with_deadline(until, sender.write_packet(packet)).await {
            Ok(Ok(())) => {}
            _ => return Err(Cut { packets }),
        }
    }
    Ok(())
}

/// A host that closes the port drops DTR.
async fn watch_dtr(control: ControlChanged<'_>) {
    let mut was_ready = false;
    loop {
        control.control_changed().await;
        let ready = control.dtr();
        if was_ready && !ready {
            session::end();
        }
        was_ready = ready;
    }
}

async fn send_stats() {
    let mut ticker = Ticker::every(STATS_PERIOD);
    loop {
        ticker.next().await;
        if session::is_streaming() {
            outbox::offer(DeviceMessage::Stats(stats::snapshot()));
        }
    }
}
