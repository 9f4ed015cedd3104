//! The camera interface (DCMI): the sensor's signals act on it in virtual time, and the firmware
//! sees its registers.
//!
//! The sensor's clock drives everything. Bytes arrive in groups of sixteen, one FIFO's worth, at
//! the instant at which the last of them is on the lines; the FIFO holds four words, and a fifth
//! overruns. Pixels leave only through DCMI_DR, by a DMA request through DMAMUX1 or by the
//! processor.

mod flow;
mod receiver;
mod signals;
mod timeline;

use rigless::device::{Device, DeviceContext, Level, RegisterFile};
use rigless::soc::Width;
use rigless::soc::stm32h743::generated::dcmi::Register;
use rigless::time::{EventId, VirtualNanos};

use crate::busy_bus::{Chance, InterruptLine};
use crate::camera::SharedCamera;
use crate::faults::{Faults, Kind};
use crate::peripherals::dma::Feed;
use crate::rules::Rules;
use receiver::{Receiver, Settings, control};
use signals::Frame;
use timeline::{Bytes, Epoch, Next, Step};

/// Bytes per event: one FIFO's worth.
const GROUP: u32 = 4 * receiver::FIFO_WORDS as u32;
/// The longest wait of the DMA for a busy bus, ns. A group of bytes comes every 320 ns at 50 MHz,
/// and the FIFO holds no more than one.
const LONGEST_WAIT_NS: u64 = 250;
/// The same after the last byte of a frame, when no more bytes come: a burst of the MDMA before
/// each of four words.
const LONGEST_LAST_WAIT_NS: u64 = 700;
/// GPIOB_IDR. A write has no effect on the chip; the rig uses it to make the port look at its pins.
const VSYNC_PORT_INPUT: u64 = 0x5802_0410;

/// RIS, IER, MIS and ICR bits.
mod flag {
    pub const FRAME: u32 = 1 << 0;
    pub const OVERRUN: u32 = 1 << 1;
    pub const VSYNC: u32 = 1 << 3;
    pub const LINE: u32 = 1 << 4;
}

/// The pins that carry the camera's signals to the interface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pins {
    /// Data lines.
    pub data: u8,
    /// PIXCLK.
    pub clock: bool,
    /// HSYNC.
    pub hsync: bool,
    /// VSYNC.
    pub vsync: bool,
}

/// Counters for the report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Frames that ended with data.
    pub frames: u64,
    /// Frames that ended without data.
    pub empty_frames: u64,
    /// Words put into the FIFO.
    pub words: u64,
    /// Overruns.
    pub overruns: u64,
    /// Groups of words that waited for the bus.
    pub waits: u64,
}

/// The interface with the sensor's signals.
#[derive(Debug)]
pub struct Dcmi {
    camera: SharedCamera,
    faults: Faults,
    rules: Rules,
    pins: Pins,
    hclk_hz: u64,
    frame: Option<Frame>,
    epoch: Epoch,
    next: Option<Next>,
    /// Bytes that are due and wait until the FIFO is emptied.
    due: Option<Bytes>,
    receiver: Receiver,
    settings: Settings,
    raised: u32,
    enabled: u32,
    interrupt: InterruptLine,
    chance: Chance,
    /// The event until which the DMA waits for the bus.
    bus: Option<EventId>,
    requested: bool,
    /// The DMA's way to take words at once.
    feed: Feed,
    vsync: Level,
    vsync_at: VirtualNanos,
    last_byte: u8,
    counters: Counters,
}

impl Dcmi {
    /// Returns an interface wired to a sensor.
    ///
    /// `seed` decides the waits of a busy bus ([`Kind::BusBusy`]).
    pub fn new(camera: SharedCamera, faults: Faults, rules: Rules, feed: Feed, seed: u64) -> Self {
        Self {
            camera,
            interrupt: InterruptLine::new(faults.clone(), seed),
            chance: Chance::new(seed),
            bus: None,
            faults,
            rules,
            pins: Pins::default(),
            hclk_hz: 0,
            frame: None,
            epoch: Epoch::default(),
            next: None,
            due: None,
            receiver: Receiver::default(),
            settings: Settings::default(),
            raised: 0,
            enabled: 0,
            requested: false,
            feed,
            vsync: Level::Low,
            vsync_at: VirtualNanos(0),
            last_byte: 0,
            counters: Counters::default(),
        }
    }

    /// Returns the present counters.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Returns the level of the VSYNC line.
    pub fn vsync(&self) -> Level {
        self.vsync
    }

    /// Returns the time at which it took this level.
    pub fn vsync_at(&self) -> VirtualNanos {
        self.vsync_at
    }

    /// Applies the pins' configuration and the bus clock in Hz.
    pub fn wire(&mut self, pins: Pins, hclk_hz: u64) {
        (self.pins, self.hclk_hz) = (pins, hclk_hz);
    }

    /// Resets the registers with the part; the sensor goes on.
    pub fn part_reset(&mut self) {
        self.receiver.reset();
        self.due = None;
        self.settings = Settings::default();
        (self.raised, self.enabled) = (0, 0);
        self.interrupt.reset();
        (self.bus, self.requested) = (None, false);
        self.pins = Pins::default();
    }

    /// Changes VSYNC: on the port's pin, and in the interface.
    fn set_vsync(
        &mut self,
        level: Level,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        if self.vsync == level {
            return;
        }
        (self.vsync, self.vsync_at) = (level, context.now());
        context.write_to(VSYNC_PORT_INPUT, Width::W32, 0, 0);
        if !self.pins.vsync || !self.settings.has(control::ENABLE) {
            return;
        }
        let blanks = (level == Level::High) == self.settings.has(control::VSYNC_BLANKS_HIGH);
        if blanks {
            self.raised |= flag::VSYNC;
            if self.receiver.capturing() {
                self.end_frame(registers);
            }
        } else if self.settings.has(control::CAPTURE) {
            self.check_clock();
            self.receiver.begin_frame(&self.settings);
        }
        self.drive(context);
    }

    /// Checks RM0433's rule: the bus clock must be at least 2.5 times PIXCLK.
    fn check_clock(&self) {
        let Some(frame) = &self.frame else { return };
        let pixel_clock = frame.output.pixel_clock_hz;
        if self.hclk_hz * 2 < pixel_clock * 5 {
            let hclk = self.hclk_hz;
            self.rules.broken(|| {
                format!(
                    "DCMI: HCLK is {hclk} Hz, less than 2.5 times PIXCLK, \
                {pixel_clock} Hz (RM0433, DCMI clocks)"
                )
            });
        }
    }

    fn end_frame(&mut self, registers: &mut RegisterFile) {
        let words = self.receiver.end_frame();
        self.raised |= flag::FRAME;
        if words == 0 {
            self.counters.empty_frames += 1;
        } else {
            self.counters.frames += 1;
        }
        if self.settings.has(control::SNAPSHOT) {
            self.settings.control &= !control::CAPTURE;
            registers.set(Register::Cr, self.settings.control.into());
        }
    }

    /// Delays the words of a group to the DMA.
    fn wait_for_the_bus(&mut self, longest_ns: u64, context: &mut DeviceContext<'_>) {
        if self.bus.is_none() {
            let later = context.now().0 + self.chance.below(longest_ns);
            self.bus = Some(context.schedule(VirtualNanos(later)));
            self.counters.waits += 1;
        }
    }

    /// Sets the interrupt and the DMA request by the present state.
    fn drive(&mut self, context: &mut DeviceContext<'_>) {
        let interrupt = Level::from(self.raised & self.enabled != 0);
        self.interrupt.drive(interrupt, context);
        let stalled = self.faults.on(Kind::DcmiOverrun, context.now().0);
        let wanted = self.receiver.waiting() > 0 && !stalled && self.bus.is_none();
        if wanted != self.requested {
            self.requested = wanted;
            context.request(0, Level::from(wanted));
        }
    }

    fn write_control(&mut self, value: u32) {
        self.settings.control = value;
        if !self.settings.has(control::ENABLE) {
            self.receiver.reset();
            self.due = None;
            return;
        }
        let unsupported = [
            (control::CROP, "the crop window (CR bit 2)"),
            (control::JPEG, "JPEG mode (CR bit 3)"),
            (control::EMBEDDED, "embedded synchronization (CR bit 4)"),
            (control::WIDTH, "more than 8 data bits (CR bits 11:10)"),
        ];
        for (bits, name) in unsupported {
            if value & bits != 0 {
                self.rules.broken(|| format!("DCMI: {name}: not simulated"));
            }
        }
    }

    fn status(&self, now_ns: u64) -> u32 {
        let vsync_high = self.vsync == Level::High;
        let hsync_high = (self.frame.as_ref())
            .is_some_and(|frame| frame.in_row(now_ns) == frame.output.href_active_high);
        u32::from(hsync_high == self.settings.has(control::HSYNC_BLANKS_HIGH))
            | u32::from(vsync_high == self.settings.has(control::VSYNC_BLANKS_HIGH)) << 1
            | u32::from(self.receiver.waiting() > 0) << 2
    }
}

impl Device for Dcmi {
    type Register = Register;

    fn read(
        &mut self,
        register: Register,
        _registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) -> Option<u64> {
        self.interrupt.read_back(context);
        let value = match register {
            Register::Dr => {
                let word = self.receiver.take();
                self.receive_due();
                self.drive(context);
                word
            }
            Register::Sr => self.status(context.now().0),
            Register::Ris => self.raised,
            Register::Mis => self.raised & self.enabled,
            _ => return None,
        };
        Some(value.into())
    }

    fn write(
        &mut self,
        register: Register,
        _value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        self.catch_up(context);
        let landed = registers.get(register) as u32;
        match register {
            Register::Cr => self.write_control(landed),
            Register::Ier => self.enabled = landed,
            Register::Icr => self.raised &= !landed,
            _ => {}
        }
        self.drive(context);
    }

    fn on_event(
        &mut self,
        event: EventId,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        if self.interrupt.falls_at(event, context) {
            return;
        }
        // Words that are still there were not taken in time.
        self.receive_all_due();
        if self.bus.take_if(|bus| *bus == event).is_some() {
            return self.drive(context);
        }
        let Some(next) = self.next.take_if(|next| next.event == event) else {
            return;
        };
        let now = context.now().0;
        let silenced = {
            let camera = self.camera.lock();
            camera.restarts() || camera.silenced(now)
        };
        match next.step {
            _ if silenced => self.start_over(registers, context),
            Step::Retry => self.start_over(registers, context),
            Step::VsyncBegins => self.begin_frame(registers, context),
            Step::VsyncEnds => self.end_vsync(registers, context),
            Step::Bytes(bytes) => self.bytes(bytes, registers, context),
        }
    }

    fn reset(&mut self) {
        self.part_reset();
    }

    fn reset_line(&mut self, _registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.catch_up(context);
        let requested = self.requested;
        let pins = self.pins;
        self.part_reset();
        self.pins = pins;
        if requested {
            context.request(0, Level::Low);
        }
        self.reschedule(context);
    }
}
