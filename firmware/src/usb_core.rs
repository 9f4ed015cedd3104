//! Commands and flags of the USB core that its driver (embassy-usb-synopsys-otg 0.3) lacks.
//!
//! An IN endpoint keeps its packet through a bus reset, a new configuration and a halt, until the
//! firmware takes it back (DIEPCTL.EPENA, RM0433 chapter 60). The driver waits for such a packet
//! to leave before it writes the next one, and the host may never fetch it.

use crate::seeded_bugs;
use embassy_stm32::interrupt::{self, InterruptExt};
use embassy_stm32::pac::USB_OTG_FS as CORE;
use embassy_time::{Duration, Instant};
use embassy_usb::driver::{Direction, EndpointAddress};

/// Endpoints of the core, in each direction.
const ENDPOINTS: usize = 9;
/// Longest wait for the core to obey: it takes microseconds.
const PATIENCE: Duration = Duration::from_millis(10);

/// Takes back the packets of all IN endpoints; returns whether an endpoint other than the control
/// endpoint had one.
pub fn abort_all() -> bool {
    abort_in(0);
    abort_data()
}

/// Takes back the packets of all IN endpoints but the control endpoint's; returns whether there was
/// one.
pub fn abort_data() -> bool {
    let mut any = false;
    for index in 1..ENDPOINTS {
        any |= abort_in(index);
    }
    any
}

/// Takes back the packet of an IN endpoint; returns false if it had none, or if the packet left in
/// the meantime.
pub fn abort_in(index: usize) -> bool {
    let control = CORE.diepctl(index);
    if !control.read().epena() {
        return false;
    }
    // Its handler clears the flags that this waits for.
    interrupt::OTG_FS.disable();
    let armed = disable(index);
    // SAFETY: the driver had it enabled, and its handler has no state of ours to find half-changed.
    unsafe { interrupt::OTG_FS.enable() };
    armed
}

/// Disables an IN endpoint, first its answers, then its transfer, and empties its FIFO.
fn disable(index: usize) -> bool {
    let (control, flags) = (CORE.diepctl(index), CORE.diepint(index));
    if !control.read().naksts() {
        flags.write(|w| w.set_inepne(true));
        control.modify(|w| w.set_snak(true));
        wait_until(|| flags.read().inepne() || !control.read().epena());
    }
    if !control.read().epena() {
        return false;
    }
    flags.write(|w| w.set_epdisd(true));
    control.modify(|w| {
        w.set_snak(true);
        w.set_epdis(true);
    });
    wait_until(|| flags.read().epdisd() || !control.read().epena());
    flags.write(|w| w.set_epdisd(true));
    CORE.grstctl().write(|w| {
        w.set_txfflsh(true);
        w.set_txfnum(index as u8);
    });
    wait_until(|| !CORE.grstctl().read().txfflsh());
    true
}

fn wait_until(condition: impl Fn() -> bool) {
    let end = Instant::now() + PATIENCE;
    while !condition() && Instant::now() < end {}
}

/// Makes DATA0 the next packet of a bulk or interrupt endpoint. The control endpoint's toggle
/// follows from each SETUP by itself.
pub fn begin_with_data0(address: EndpointAddress) {
    let index = address.index();
    if index == 0 || seeded_bugs::keeps_toggles() {
        return;
    }
    // The interrupt handler changes these registers, too.
    critical_section::with(|_| match address.direction() {
        Direction::In => CORE
            .diepctl(index)
            .modify(|control| control.set_sd0pid_sevnfrm(true)),
        Direction::Out => CORE
            .doepctl(index)
            .modify(|control| control.set_sd0pid_sevnfrm(true)),
    });
}

/// True while a bus reset waits to be served.
pub fn is_reset() -> bool {
    let flags = CORE.gintsts().read();
    flags.usbrst() || flags.enumdne()
}

/// True while the bus is suspended.
pub fn is_suspended() -> bool {
    CORE.dsts().read().suspsts()
}

/// Forgets a suspend from before a bus reset.
pub fn forget_suspend() {
    CORE.gintsts().write(|w| w.set_usbsusp(true));
}

/// Connects to the bus, or disconnects: the host sees a plug.
pub fn connect(on: bool) {
    CORE.dctl().modify(|w| w.set_sdis(!on));
}
