//! The microcontroller: the emulator's STM32H743 with the camera interface, the MDMA and the USB
//! core that the emulator lacks.
//!
//! The emulator itself is not patched. [`Chip`] wraps the part and handles nine slots itself: DCMI,
//! MDMA, CRC, CRS, IWDG, the flash, and the three blocks of OTG2. All other accesses go to the
//! part's own models.

use std::any::Any;

use rigless::device::{Device, ErasedDevice, Level, ResetCause};
use rigless::emulator::{Access, AccessKind, Memory};
use rigless::mcu::Mcu;
use rigless::soc::stm32h743::Stm32h743;
use rigless::soc::stm32h743::generated::{dbgmcu, rcc};
use rigless::soc::{Bus, Error};
use rigless::time::VirtualNanos;

use crate::board::{self, Wiring};
use crate::camera::{Sccb, SharedCamera, TwoWire, part, sccb};
use crate::control_bus::{ControlBus, HeldBus};
use crate::dma_requests;
use crate::faults::{Faults, Kind};
use crate::late_enable::LateEnable;
use crate::late_flags::LateFlags;
use crate::late_line::{self, LateLine};
use crate::mpu::{Mpu, Protection};
use crate::peripherals::crc::Crc;
use crate::peripherals::crs::Crs;
use crate::peripherals::dcmi::Dcmi;
use crate::peripherals::dma::{Dma, Feed};
use crate::peripherals::flash::{Bank, Flash};
use crate::peripherals::iwdg::Iwdg;
use crate::peripherals::mdma::Mdma;
use crate::peripherals::otg::{Blocks, SharedCore};
use crate::rules::Rules;
use crate::uart_line::{Listener, UartByte};
use crate::usb_host::SharedHost;

/// The board's supply, mV.
const SUPPLY_MV: u32 = 3300;
/// The same while it sags, mV.
const LOW_SUPPLY_MV: u32 = 2700;
/// Temperature of the part, hundredths of a degree Celsius.
const TEMPERATURE: i32 = 6_000;

/// Revision of the silicon.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Revision {
    /// 400 MHz at most.
    Y,
    /// 480 MHz.
    #[default]
    V,
}

impl Revision {
    /// Returns DBGMCU_IDC.
    fn identity(self) -> u64 {
        match self {
            Revision::Y => 0x1003_6450,
            Revision::V => 0x2003_6450,
        }
    }

    /// Returns the fastest bus clock, Hz: half the core's (DS12110).
    fn fastest_bus_hz(self) -> u64 {
        match self {
            Revision::Y => 200_000_000,
            Revision::V => 240_000_000,
        }
    }
}

/// The part with the rig's additions.
#[derive(Debug)]
pub struct Chip {
    /// The emulator's part.
    pub part: Stm32h743,
    /// The camera interface.
    pub dcmi: Dcmi,
    /// The DMA controller that takes the camera interface's words.
    dma: Dma,
    /// The DMA controller that reaches DTCM.
    pub mdma: Mdma,
    /// The registers of an MPU that is not enforced.
    pub mpu: Option<Mpu>,
    faults: Faults,
    is_supply_low: bool,
    crc: Crc,
    crs: Crs,
    iwdg: Iwdg,
    flash: Flash,
    control_bus: ControlBus,
    held_bus: HeldBus,
    late: LateLine,
    late_flags: LateFlags,
    late_enable: LateEnable,
    rules: Rules,
    board: board::Kind,
    revision: Revision,
    led: Switches,
    output: Switches,
    camera: SharedCamera,
    otg: Blocks,
    core: SharedCore,
    host: SharedHost,
    slots: board::Slots,
    dcmi_slot: usize,
    dma_slot: usize,
    mdma_slot: usize,
    crc_slot: usize,
    crs_slot: usize,
    iwdg_slot: usize,
    flash_slot: usize,
    vsync: Level,
    /// The longest time from one of its changes to the handler, ns.
    latest_stamp_ns: u64,
    wiring: Wiring,
}

/// Times at which a pin was switched on and off in turn, ns; it begins off.
#[derive(Debug, Default)]
struct Switches(Vec<u64>);

impl Switches {
    fn drive(&mut self, is_on: bool, at: VirtualNanos) {
        let was_on = !self.0.len().is_multiple_of(2);
        if is_on != was_on {
            self.0.push(at.0);
        }
    }
}

impl Chip {
    /// Returns a part out of reset, with the camera on its pins and the host on its cable.
    ///
    /// # Errors
    /// If the emulator's part is not laid out as expected.
    #[expect(clippy::too_many_arguments, reason = "all that a chip is connected to")]
    pub fn new(
        camera: SharedCamera,
        host: SharedHost,
        faults: Faults,
        rules: Rules,
        bank: Bank,
        protection: Protection,
        board: board::Kind,
        revision: Revision,
        seed: u64,
    ) -> Result<Self, Error> {
        let mut part = Stm32h743::new()?;
        part.dma = dma_requests::controllers();
        let crystal_hz = match faults.asked_for(Kind::CrystalSilent) {
            true => 0,
            false => board.crystal_hz(),
        };
        part.rcc.attach_crystals(crystal_hz, 0);
        part.set_supply(SUPPLY_MV);
        part.set_analog_supply(SUPPLY_MV);
        part.adc[2].set_temperature(TEMPERATURE);
        let mpu = match protection {
            Protection::Enforced => None,
            Protection::Ignored => Some(Mpu::fit(part.bus_mut(), rules.clone())?),
        };
        let types = mpu.as_ref().map(|mpu| mpu.types().clone());
        let kind = camera.lock().kind();
        match kind {
            part::Kind::Ov7725 => part.i2c[0].attach(Sccb::new(camera.clone(), sccb::OV7725)),
            part::Kind::Ov5640 => part.i2c[0].attach(Sccb::new(camera.clone(), sccb::OV5640)),
            part::Kind::Mt9v034 => part.i2c[0].attach(TwoWire::new(camera.clone())),
        };
        part.usart[board::UART].attach(Listener::default());
        let core = SharedCore::new(faults.clone(), seed);
        let late_flags = LateFlags::new(faults.clone(), seed);
        let mut otg = Blocks::fit(&mut part, &core, &host)?;
        otg.wake_host(part.bus_mut(), VirtualNanos(0));
        let slots = board::Slots::of(part.bus(), board)?;
        let dcmi_slot = part.bus().slot("DCMI")?;
        let dma_slot = part.bus().slot("DMA1")?;
        let mdma_slot = part.bus().slot("MDMA")?;
        let crc_slot = part.bus().slot("CRC")?;
        let crs_slot = part.bus().slot("CRS")?;
        let iwdg_slot = part.bus().slot("IWDG")?;
        let flash_slot = part.bus().slot("Flash")?;
        let i2c_slot = part.bus().slot("I2C1")?;
        let feed = Feed::default();
        let mut chip = Self {
            dcmi: Dcmi::new(
                camera.clone(),
                faults.clone(),
                rules.clone(),
                feed.clone(),
                seed,
            ),
            dma: Dma::new(feed, rules.clone()),
            dma_slot,
            control_bus: ControlBus::new(faults.clone(), slots.vsync_port(), i2c_slot),
            held_bus: HeldBus,
            mdma: Mdma::new(rules.clone(), faults.clone(), bank.clone(), types, seed),
            flash: Flash::new(bank, rules.clone(), faults.clone()),
            flash_slot,
            rules,
            board,
            revision,
            led: Switches::default(),
            output: Switches::default(),
            late: LateLine::default(),
            late_flags,
            late_enable: LateEnable::new(seed),
            faults,
            is_supply_low: false,
            crc: Crc::default(),
            crs: Crs::default(),
            iwdg: Iwdg::default(),
            mpu,
            part,
            camera,
            otg,
            core,
            host,
            slots,
            dcmi_slot,
            mdma_slot,
            crc_slot,
            crs_slot,
            iwdg_slot,
            vsync: Level::Low,
            latest_stamp_ns: 0,
            wiring: Wiring::default(),
        };
        chip.identify();
        chip.load_options();
        Ok(chip)
    }

    /// Writes the revision to the register from which the program reads it.
    fn identify(&mut self) {
        let slot = self.slots.dbgmcu;
        let registers = self.part.bus_mut().slot_mut(slot).registers_mut();
        registers.set(dbgmcu::Register::Idc, self.revision.identity());
    }

    /// Loads the option bytes, as every reset does.
    fn load_options(&mut self) {
        let registers = self.part.bus_mut().slot_mut(self.flash_slot);
        self.flash.load_options(registers.registers_mut());
    }

    /// Makes the flags of the reset that has just happened those of a power-on (RM0433, table of
    /// reset sources).
    pub fn powered_on(&mut self) {
        const POWER_ON: u64 = 0x00FE_0000;
        let slot = self.part.bus().slot("RCC").expect("the part has it");
        let registers = self.part.bus_mut().slot_mut(slot).registers_mut();
        registers.set(rcc::Register::Rsr, POWER_ON);
        registers.set(rcc::Register::C1Rsr, POWER_ON);
    }

    /// Returns the part's board.
    pub fn board(&self) -> board::Kind {
        self.board
    }

    /// Returns the times of the LED's switches, on and off in turn, ns.
    pub fn led_edges_ns(&self) -> &[u64] {
        &self.led.0
    }

    /// Returns the times of the output pin's edges, high and low in turn, ns.
    pub fn output_edges_ns(&self) -> &[u64] {
        &self.output.0
    }

    /// Returns the bytes of the UART for samples.
    pub fn uart_bytes(&self) -> &[UartByte] {
        let peer = self.part.usart[board::UART].peer();
        let listener = peer.and_then(|peer| (peer as &dyn Any).downcast_ref::<Listener>());
        listener.map_or(&[], |listener| &listener.bytes)
    }

    /// Returns the count of words that the firmware wrote into full USB FIFOs.
    pub fn lost_usb_words(&self) -> u64 {
        self.core.lock().lost_words
    }

    /// Returns the longest time from an edge of VSYNC to the handler that stamps it, ns.
    pub fn latest_stamp_ns(&self) -> u64 {
        self.latest_stamp_ns
    }

    /// Reads the pins and clocks again, and passes on the changes.
    pub fn rewire(&mut self, at: VirtualNanos) {
        let wiring = self.slots.wiring(&self.part);
        self.led.drive(wiring.led, at);
        self.output.drive(wiring.output, at);
        if wiring != self.wiring {
            if wiring.hclk_hz > self.revision.fastest_bus_hz() {
                let (hclk, revision) = (wiring.hclk_hz, self.revision);
                self.rules.broken(|| {
                    format!(
                        "RCC: HCLK is {hclk} Hz, too fast for silicon \
                    revision {revision:?} (DS12110)"
                    )
                });
            }
            self.wiring = wiring;
            self.dcmi.wire(wiring.pins, wiring.hclk_hz);
            // Without its pin, nothing of it reaches the line.
            let _ = self.part.usart[board::UART].silence(!wiring.uart);
            let mut core = self.core.lock();
            (core.wired, core.clock_hz) = (wiring.usb, wiring.usb_hz);
            drop(core);
            self.camera.lock().supply(wiring.supply);
        }
        if self.camera.lock().restarts() {
            let (registers, mut context) = self.part.bus_mut().drive(at, self.dcmi_slot);
            self.dcmi.start_over(registers, &mut context);
        }
    }

    /// Handles the effects of an access: on the camera's control bus, on lines that fall late, and
    /// on blocks of the MDMA that ended.
    pub fn settle(&mut self, at: VirtualNanos, memory: &mut dyn Memory) {
        self.sag(at);
        self.dma.settle(memory);
        self.mdma.settle(memory);
        self.control_bus.settle(&mut self.part, at);
        self.late.settle(&mut self.part, at);
        self.late_flags.settle(&mut self.part, at);
    }

    /// Sets the supply, which a fault lowers.
    fn sag(&mut self, at: VirtualNanos) {
        let is_low = self.faults.on(Kind::SupplyLow, at.0);
        if is_low != std::mem::replace(&mut self.is_supply_low, is_low) {
            let supply = if is_low { LOW_SUPPLY_MV } else { SUPPLY_MV };
            self.part.set_supply(supply);
        }
    }

    /// Handles an access by the core: a read or a write.
    pub fn accessed(&mut self, access: &Access, value: u64) {
        if access.kind == AccessKind::Write && access.address == late_line::CLEAR {
            let taken_ns = access.virtual_time.0 - self.dcmi.vsync_at().0;
            self.latest_stamp_ns = self.latest_stamp_ns.max(taken_ns);
        }
        self.late.accessed(access, value);
        self.late_flags.accessed(&mut self.part, access, value);
        self.late_enable.accessed(&mut self.part, access, value);
    }

    /// Sets the pin of VSYNC to the line's level.
    fn drive_vsync(&mut self, at: VirtualNanos) {
        if self.dcmi.vsync() != self.vsync {
            self.vsync = self.dcmi.vsync();
            let level = Some(self.vsync);
            self.part
                .drive_port(at, board::VSYNC_PORT, |port, registers, context| {
                    port.drive(board::vsync_pin(), level, registers, context);
                });
        }
    }
}

impl Mcu for Chip {
    fn bus(&self) -> &Bus {
        self.part.bus()
    }

    fn bus_mut(&mut self) -> &mut Bus {
        self.part.bus_mut()
    }

    fn reset(&mut self, at: VirtualNanos, cause: ResetCause) {
        self.otg.exchange(&mut self.part);
        self.part.reset(at, cause);
        self.part.dma = dma_requests::controllers();
        self.core.lock().reset();
        self.core.line().reset();
        self.late_flags.reset();
        self.camera.lock().host_reset();
        self.otg = Blocks::fit(&mut self.part, &self.core, &self.host)
            .expect("a part that was fitted once");
        self.otg.wake_host(self.part.bus_mut(), at);
        if let Some(mpu) = &mut self.mpu {
            mpu.reset();
        }
        self.dma.part_reset();
        Device::reset(&mut self.mdma);
        Device::reset(&mut self.crc);
        Device::reset(&mut self.crs);
        Device::reset(&mut self.iwdg);
        Device::reset(&mut self.flash);
        self.load_options();
        self.dcmi.part_reset();
        let (_, mut context) = self.part.bus_mut().drive(at, self.dcmi_slot);
        self.dcmi.reschedule(&mut context);
        self.wiring = Wiring::default();
        self.identify();
        self.rewire(at);
    }

    /// Does nothing: the camera and the host live on events.
    fn poll(&mut self, _now: VirtualNanos) {}

    fn split(&mut self, slot: usize) -> (&mut Bus, Option<&mut dyn ErasedDevice>) {
        if slot == self.slots.tim1 {
            // Its registers decide whether it is the camera's clock (`board`). Its model would
            // count every edge.
            return (self.part.bus_mut(), None);
        }
        if slot == self.dcmi_slot {
            return (self.part.bus_mut(), Some(&mut self.dcmi));
        }
        if slot == self.dma_slot {
            return (self.part.bus_mut(), Some(&mut self.dma));
        }
        if slot == self.mdma_slot {
            return (self.part.bus_mut(), Some(&mut self.mdma));
        }
        if self.mpu.as_ref().is_some_and(|mpu| mpu.slot() == slot) {
            let mpu = self.mpu.as_mut().map(|mpu| mpu as &mut dyn ErasedDevice);
            return (self.part.bus_mut(), mpu);
        }
        if self.control_bus.holds(slot) {
            return (self.part.bus_mut(), Some(&mut self.held_bus));
        }
        if slot == self.flash_slot {
            return (self.part.bus_mut(), Some(&mut self.flash));
        }
        if slot == self.crc_slot {
            return (self.part.bus_mut(), Some(&mut self.crc));
        }
        if slot == self.crs_slot {
            return (self.part.bus_mut(), Some(&mut self.crs));
        }
        if slot == self.iwdg_slot {
            return (self.part.bus_mut(), Some(&mut self.iwdg));
        }
        if slot == self.slots.vsync_port() {
            self.drive_vsync(self.dcmi.vsync_at());
        }
        match self.otg.model(slot) {
            Some(model) => (self.part.bus_mut(), Some(model)),
            None => self.part.split(slot),
        }
    }
}
