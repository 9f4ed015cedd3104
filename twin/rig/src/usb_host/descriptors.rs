//! Finds the serial port in a configuration descriptor (USB 2.0 chapter 9, CDC 1.2).

use super::control::Begins;
use crate::peripherals::otg::ENDPOINTS;

/// The properties of a CDC-ACM function that the host needs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Function {
    /// Number of the communications interface.
    pub control_interface: u8,
    /// Number of the data interface.
    pub data_interface: u8,
    /// Bulk IN endpoint.
    pub bulk_in: usize,
    /// Bulk OUT endpoint.
    pub bulk_out: usize,
}

/// The parts of a configuration that a host needs for any device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outline {
    /// Number of the configuration.
    pub configuration: u8,
    /// Class, subclass and protocol of each interface.
    pub interfaces: Vec<[u8; 3]>,
    /// Interface, address and largest packet of each endpoint but 0.
    endpoints: Vec<(u8, u8, usize)>,
}

impl Outline {
    /// Reads a configuration descriptor and the descriptors that follow it, up to the first one
    /// that is not whole.
    pub fn of(configuration: &[u8]) -> Self {
        let mut outline = Self::default();
        let mut interface = 0;
        let mut rest = configuration;
        while let [length, kind, ..] = *rest {
            let Some((descriptor, tail)) = rest.split_at_checked(length.max(2).into()) else {
                break;
            };
            rest = tail;
            match (kind, descriptor) {
                (CONFIGURATION, [_, _, _, _, _, number, ..]) => outline.configuration = *number,
                (INTERFACE, [_, _, number, 0, _, class, subclass, protocol, ..]) => {
                    interface = *number;
                    outline.interfaces.push([*class, *subclass, *protocol]);
                }
                (ENDPOINT, [_, _, address, _, low, high, ..])
                    if usize::from(address & 15) < ENDPOINTS =>
                {
                    let size = u16::from_le_bytes([*low, high & 7]);
                    (outline.endpoints).push((interface, *address, size.into()));
                }
                _ => {}
            }
        }
        outline
    }

    /// Returns the largest packet of an endpoint; `None` if there is no such endpoint.
    pub fn packet_size(&self, address: u8) -> Option<usize> {
        let found = self
            .endpoints
            .iter()
            .find(|(_, other, _)| *other == address);
        found.map(|(_, _, size)| *size)
    }

    /// Returns the endpoints whose next packet is DATA0.
    pub fn begun_anew(&self, which: Begins) -> Vec<u8> {
        let begins = |interface: u8, address: u8| match which {
            Begins::None => false,
            Begins::Endpoint(number) => number == address,
            Begins::Interface(number) => number == interface,
            Begins::All => true,
        };
        let all = self.endpoints.iter();
        all.filter(|(interface, address, _)| begins(*interface, *address))
            .map(|(_, address, _)| *address)
            .collect()
    }
}

const CONFIGURATION: u8 = 2;
const INTERFACE: u8 = 4;
const ENDPOINT: u8 = 5;
const BULK: u8 = 2;
/// Communications class, abstract control model.
const COMMUNICATIONS: [u8; 2] = [2, 2];
const DATA: u8 = 10;

impl Function {
    /// Reads a configuration descriptor and the descriptors that follow it.
    ///
    /// # Errors Names the missing or malformed part.
    pub fn parse(configuration: &[u8]) -> Result<Self, &'static str> {
        let mut function = Self::default();
        let (mut has_control, mut in_data) = (false, false);
        let mut rest = configuration;
        while let [length, kind, ..] = *rest {
            let length = usize::from(length);
            if length < 2 || length > rest.len() {
                return Err("a descriptor's length is wrong");
            }
            let (descriptor, tail) = rest.split_at(length);
            rest = tail;
            match (kind, descriptor) {
                (INTERFACE, [_, _, number, _, _, class, subclass, ..]) => {
                    in_data = *class == DATA;
                    if in_data {
                        function.data_interface = *number;
                    }
                    if [*class, *subclass] == COMMUNICATIONS {
                        (has_control, function.control_interface) = (true, *number);
                    }
                }
                (ENDPOINT, [_, _, address, attributes, ..])
                    if in_data && attributes & 3 == BULK =>
                {
                    let number = usize::from(address & 15);
                    if address & 0x80 != 0 {
                        function.bulk_in = number
                    } else {
                        function.bulk_out = number
                    }
                }
                _ => {}
            }
        }
        match function {
            _ if !has_control => Err("no abstract control model interface"),
            Function {
                bulk_in: 1..=8,
                bulk_out: 1..=8,
                ..
            } => Ok(function),
            _ => Err("no pair of bulk endpoints 1 to 8 in a data interface"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONTROL: [u8; 9] = [9, 4, 3, 0, 1, 2, 2, 1, 0];
    const DATA_INTERFACE: [u8; 9] = [9, 4, 4, 0, 2, 10, 0, 0, 0];
    const IN: [u8; 7] = [7, 5, 0x82, 2, 64, 0, 0];
    const OUT: [u8; 7] = [7, 5, 0x01, 2, 64, 0, 0];

    #[test]
    fn finds_the_interface_and_the_endpoints() {
        let configuration = [
            &CONTROL[..],
            &[7, 5, 0x81, 3, 8, 0, 255],
            &DATA_INTERFACE,
            &IN,
            &OUT,
        ]
        .concat();
        let function = Function {
            control_interface: 3,
            data_interface: 4,
            bulk_in: 2,
            bulk_out: 1,
        };
        assert_eq!(Function::parse(&configuration), Ok(function));
    }

    #[test]
    fn an_outline_has_interfaces_and_endpoints() {
        let configuration = [
            &[9, 2, 0, 0, 2, 1, 0, 0x80, 50][..],
            &CONTROL,
            &[7, 5, 0x81, 3, 8, 0, 255],
            &DATA_INTERFACE,
            &IN,
            &OUT,
            &[9, 4],
        ]
        .concat();
        let outline = Outline::of(&configuration);
        assert_eq!(outline.configuration, 1);
        assert_eq!(outline.interfaces, [[2, 2, 1], [10, 0, 0]]);
        let sizes = [0x81, 0x82, 1, 2].map(|address| outline.packet_size(address));
        assert_eq!(sizes, [Some(8), Some(64), Some(64), None]);
        assert_eq!(outline.begun_anew(Begins::Interface(4)), [0x82, 1]);
        assert_eq!(outline.begun_anew(Begins::Endpoint(0x81)), [0x81]);
        assert_eq!(outline.begun_anew(Begins::All).len(), 3);
        assert_eq!(Outline::of(&[0, 5, 0]), Outline::default());
    }

    #[test]
    fn says_what_is_missing() {
        assert!(
            Function::parse(&[&DATA_INTERFACE[..], &IN, &OUT].concat())
                .unwrap_err()
                .contains("control")
        );
        assert!(
            Function::parse(&[&CONTROL[..], &DATA_INTERFACE, &IN].concat())
                .unwrap_err()
                .contains("bulk")
        );
        assert!(Function::parse(&[0, 0]).unwrap_err().contains("length"));
        assert!(Function::parse(&[9, 4]).unwrap_err().contains("length"));
    }
}
