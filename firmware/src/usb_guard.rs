//! Wraps the OTG driver to correct faults in its control transfers and in its handling of resets.
//!
//! # Design
//! Only the bus and the control pipe differ from the driver's.
//!
//! *Cut transfers*: a host may end a control transfer anywhere, by a bus reset or another SETUP
//! (USB 2.0, section 5.5.5). The driver would wait for the missing stage for ever, and serve no
//! reset. So each stage ends with the reset or the SETUP, or after [`STAGE_LIMIT`]. Before a SETUP
//! is taken, the control endpoint is cleared of an earlier transfer's data.
//!
//! *Packets*: a packet that no host fetched is taken back at each reset, configuration, interface
//! and halt (`usb_core`).
//!
//! *Suspend*: with one from before a reset, the stack would ignore SETUPs. It is passed on only if
//! the bus is still suspended.
//!
//! *Requests*: a device without high speed stalls a request for its device qualifier (section
//! 9.6.2). A request about an endpoint that does not exist would fail an assertion in the driver
//! (embassy-usb-synopsys-otg 0.3). So it is stalled before any other code acts on it, as USB 2.0,
//! section 9.4, requires. The standard also requires that an endpoint restarts with DATA0 after a
//! halt is cleared, or a configuration or an interface is set (sections 9.1.1.5, 9.4.5). So the
//! toggle is reset then: the host expects DATA0, and would take a packet with the other toggle for
//! one that it already has.

use crate::{usb_core, usb_watch};
use core::future::{Future, poll_fn};
use core::pin::{Pin, pin};
use core::task::Poll;
use embassy_futures::poll_once;
use embassy_futures::select::select;
use embassy_time::{Duration, Timer, with_timeout};
use embassy_usb::driver::{
    Bus, ControlPipe, Direction, Driver, Endpoint, EndpointAddress, EndpointAllocError,
    EndpointError, EndpointType, Event, Unsupported,
};

/// Longest time of a stage of a control transfer. Hosts wait for up to 5 s.
const STAGE_LIMIT: Duration = Duration::from_secs(2);
/// Time after which the driver is asked for a SETUP that was not counted.
const MISSED: Duration = Duration::from_secs(1);
/// Largest packet of the control endpoint.
const CONTROL_PACKET: usize = 64;

/// The existing endpoints: a bit for each number, IN and OUT.
#[derive(Clone, Copy)]
struct Allocated {
    ins: u16,
    outs: u16,
}

impl Allocated {
    fn add(&mut self, address: EndpointAddress) {
        let bit = 1u16.checked_shl(address.index() as u32).unwrap_or(0);
        match address.direction() {
            Direction::In => self.ins |= bit,
            Direction::Out => self.outs |= bit,
        }
    }

    fn has(&self, address: EndpointAddress) -> bool {
        let bits = match address.direction() {
            Direction::In => self.ins,
            Direction::Out => self.outs,
        };
        bits.checked_shr(address.index() as u32).unwrap_or(0) & 1 != 0
    }
}

/// A driver that survives every request.
pub struct Guarded<D> {
    driver: D,
    allocated: Allocated,
}

impl<D> Guarded<D> {
    /// Wraps a driver that has only the control endpoint so far.
    pub fn new(driver: D) -> Self {
        Self {
            driver,
            allocated: Allocated { ins: 1, outs: 1 },
        }
    }
}

impl<'d, D: Driver<'d>> Driver<'d> for Guarded<D> {
    type EndpointOut = D::EndpointOut;
    type EndpointIn = D::EndpointIn;
    type ControlPipe = GuardedPipe<D::ControlPipe>;
    type Bus = GuardedBus<D::Bus>;

    fn alloc_endpoint_out(
        &mut self,
        kind: EndpointType,
        address: Option<EndpointAddress>,
        packet: u16,
        interval_ms: u8,
    ) -> Result<Self::EndpointOut, EndpointAllocError> {
        let endpoint = (self.driver).alloc_endpoint_out(kind, address, packet, interval_ms)?;
        self.allocated.add(endpoint.info().addr);
        Ok(endpoint)
    }

    fn alloc_endpoint_in(
        &mut self,
        kind: EndpointType,
        address: Option<EndpointAddress>,
        packet: u16,
        interval_ms: u8,
    ) -> Result<Self::EndpointIn, EndpointAllocError> {
        let endpoint = (self.driver).alloc_endpoint_in(kind, address, packet, interval_ms)?;
        self.allocated.add(endpoint.info().addr);
        Ok(endpoint)
    }

    fn start(self, control_packet: u16) -> (Self::Bus, Self::ControlPipe) {
        let (bus, pipe) = self.driver.start(control_packet);
        let allocated = self.allocated;
        (
            GuardedBus { bus, allocated },
            GuardedPipe {
                pipe,
                allocated,
                served: usb_watch::setups(),
            },
        )
    }
}

/// The control endpoint.
pub struct GuardedPipe<P> {
    pipe: P,
    allocated: Allocated,
    /// SETUPs so far, with the one of the present transfer.
    served: u32,
}

/// Returns the endpoint of a standard request to an endpoint; otherwise `None`. In bmRequestType
/// bits 6–5 mean standard, bits 4–0 an endpoint; wIndex is its address.
fn endpoint_of(setup: &[u8; 8]) -> Option<EndpointAddress> {
    let [request_type, _, _, _, index, _, _, _] = *setup;
    (request_type & 0x7F == 0x02).then(|| EndpointAddress::from(index & 0x8F))
}

impl<P: ControlPipe> GuardedPipe<P> {
    /// Waits for a SETUP, and clears the data of an earlier transfer.
    async fn next_setup(&mut self) -> [u8; 8] {
        loop {
            let counted = with_timeout(MISSED, usb_watch::another_setup(self.served)).await;
            if counted.is_ok() {
                usb_core::abort_in(0);
                let mut left = [0; CONTROL_PACKET];
                let _ = poll_once(self.pipe.data_out(&mut left, true, true));
            }
            // No other SETUP may come between the count and the bytes.
            let setup = critical_section::with(|_| {
                self.served = usb_watch::setups();
                poll_once(self.pipe.setup())
            });
            if let Poll::Ready(setup) = setup {
                return setup;
            }
        }
    }

    fn refuses(&self, setup: &[u8; 8]) -> bool {
        const DEVICE_QUALIFIER: u8 = 6;
        matches!(setup, [0x80, 6, _, DEVICE_QUALIFIER, ..])
            || endpoint_of(setup).is_some_and(|address| !self.allocated.has(address))
    }
}

/// Carries out a stage; returns `None` if its transfer is cut off.
async fn unless_cut<T>(served: u32, mut stage: Pin<&mut impl Future<Output = T>>) -> Option<T> {
    let cut = usb_watch::cut_off(served);
    let mut end = pin!(select(cut, Timer::after(STAGE_LIMIT)));
    let done = poll_fn(|context| match stage.as_mut().poll(context) {
        Poll::Ready(done) => Poll::Ready(Some(done)),
        Poll::Pending => end.as_mut().poll(context).map(|_| None),
    });
    let done = done.await;
    if done.is_none() {
        usb_core::abort_in(0);
    }
    done
}

impl<P: ControlPipe> ControlPipe for GuardedPipe<P> {
    fn max_packet_size(&self) -> usize {
        self.pipe.max_packet_size()
    }

    async fn setup(&mut self) -> [u8; 8] {
        loop {
            let setup = self.next_setup().await;
            if !self.refuses(&setup) {
                return setup;
            }
            self.pipe.reject().await;
        }
    }

    async fn data_out(
        &mut self,
        buffer: &mut [u8],
        first: bool,
        last: bool,
    ) -> Result<usize, EndpointError> {
        let stage = pin!(self.pipe.data_out(buffer, first, last));
        let done = unless_cut(self.served, stage).await;
        done.unwrap_or(Err(EndpointError::Disabled))
    }

    async fn data_in(&mut self, data: &[u8], first: bool, last: bool) -> Result<(), EndpointError> {
        let stage = pin!(self.pipe.data_in(data, first, last));
        let done = unless_cut(self.served, stage).await;
        done.unwrap_or(Err(EndpointError::Disabled))
    }

    async fn accept(&mut self) {
        unless_cut(self.served, pin!(self.pipe.accept())).await;
    }

    async fn reject(&mut self) {
        self.pipe.reject().await;
    }

    async fn accept_set_address(&mut self, address: u8) {
        let stage = pin!(self.pipe.accept_set_address(address));
        unless_cut(self.served, stage).await;
    }
}

/// The bus.
pub struct GuardedBus<B> {
    bus: B,
    allocated: Allocated,
}

impl<B: Bus> Bus for GuardedBus<B> {
    async fn enable(&mut self) {
        self.bus.enable().await;
    }

    async fn disable(&mut self) {
        self.bus.disable().await;
    }

    async fn poll(&mut self) -> Event {
        loop {
            match self.bus.poll().await {
                Event::Reset => {
                    usb_core::abort_all();
                    usb_core::forget_suspend();
                    return Event::Reset;
                }
                Event::Suspend if !usb_core::is_suspended() => {}
                event => return event,
            }
        }
    }

    fn endpoint_set_enabled(&mut self, address: EndpointAddress, enabled: bool) {
        if self.allocated.has(address) {
            take_back(address);
            if enabled {
                usb_core::begin_with_data0(address);
            }
            self.bus.endpoint_set_enabled(address, enabled);
        }
    }

    fn endpoint_set_stalled(&mut self, address: EndpointAddress, stalled: bool) {
        if self.allocated.has(address) {
            if stalled {
                take_back(address);
            }
            self.bus.endpoint_set_stalled(address, stalled);
            if !stalled {
                usb_core::begin_with_data0(address);
            }
        }
    }

    fn endpoint_is_stalled(&mut self, address: EndpointAddress) -> bool {
        self.allocated.has(address) && self.bus.endpoint_is_stalled(address)
    }

    fn force_reset(&mut self) -> Result<(), Unsupported> {
        self.bus.force_reset()
    }

    async fn remote_wakeup(&mut self) -> Result<(), Unsupported> {
        self.bus.remote_wakeup().await
    }
}

/// Takes back the packet of an IN endpoint.
fn take_back(address: EndpointAddress) {
    if address.direction() == Direction::In {
        usb_core::abort_in(address.index());
    }
}
