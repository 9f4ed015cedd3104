//! Wraps the OTG driver to correct two faults in its control transfers.
//!
//! # Design
//! Only the bus and the control pipe differ from the driver's. A request about an endpoint that
//! does not exist would fail an assertion in the driver (embassy-usb-synopsys-otg 0.3). So it is
//! stalled before any other code acts on it, as USB 2.0, section 9.4, requires. The standard also
//! requires that an endpoint restarts with DATA0 after a halt is cleared, or a configuration or an
//! interface is set (sections 9.1.1.5, 9.4.5). So the toggle is reset then: the host expects DATA0,
//! and would take a packet with the other toggle for one that it already has.

use embassy_stm32::pac;
use embassy_usb::driver::{
    Bus, ControlPipe, Direction, Driver, Endpoint, EndpointAddress, EndpointAllocError,
    EndpointError, EndpointType, Event, Unsupported,
};

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
            GuardedPipe { pipe, allocated },
        )
    }
}

/// The control endpoint.
pub struct GuardedPipe<P> {
    pipe: P,
    allocated: Allocated,
}

/// Returns the endpoint of a standard request to an endpoint; otherwise `None`. In bmRequestType
/// bits 6–5 mean standard, bits 4–0 an endpoint; wIndex is its address.
fn endpoint_of(setup: &[u8; 8]) -> Option<EndpointAddress> {
    let [request_type, _, _, _, index, _, _, _] = *setup;
    (request_type & 0x7F == 0x02).then(|| EndpointAddress::from(index & 0x8F))
}

impl<P: ControlPipe> ControlPipe for GuardedPipe<P> {
    fn max_packet_size(&self) -> usize {
        self.pipe.max_packet_size()
    }

    async fn setup(&mut self) -> [u8; 8] {
        loop {
            let setup = self.pipe.setup().await;
            match endpoint_of(&setup) {
                Some(address) if !self.allocated.has(address) => self.pipe.reject().await,
                _ => return setup,
            }
        }
    }

    async fn data_out(
        &mut self,
        buffer: &mut [u8],
        first: bool,
        last: bool,
    ) -> Result<usize, EndpointError> {
        self.pipe.data_out(buffer, first, last).await
    }

    async fn data_in(&mut self, data: &[u8], first: bool, last: bool) -> Result<(), EndpointError> {
        self.pipe.data_in(data, first, last).await
    }

    async fn accept(&mut self) {
        self.pipe.accept().await;
    }

    async fn reject(&mut self) {
        self.pipe.reject().await;
    }

    async fn accept_set_address(&mut self, address: u8) {
        self.pipe.accept_set_address(address).await;
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
        self.bus.poll().await
    }

    fn endpoint_set_enabled(&mut self, address: EndpointAddress, enabled: bool) {
        if self.allocated.has(address) {
            if enabled {
                begin_with_data0(address);
            }
            self.bus.endpoint_set_enabled(address, enabled);
        }
    }

    fn endpoint_set_stalled(&mut self, address: EndpointAddress, stalled: bool) {
        if self.allocated.has(address) {
            self.bus.endpoint_set_stalled(address, stalled);
            if !stalled {
                begin_with_data0(address);
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

/// Makes DATA0 the next packet of a bulk or interrupt endpoint. The control endpoint's toggle
/// follows from each SETUP by itself.
fn begin_with_data0(address: EndpointAddress) {
    let index = address.index();
    if index == 0 {
        return;
    }
    let registers = pac::USB_OTG_FS;
    // The interrupt handler changes these registers, too.
    critical_section::with(|_| match address.direction() {
        Direction::In => registers
            .diepctl(index)
            .modify(|control| control.set_sd0pid_sevnfrm(true)),
        Direction::Out => registers
            .doepctl(index)
            .modify(|control| control.set_sd0pid_sevnfrm(true)),
    });
}
