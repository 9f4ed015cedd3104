//! Finds the serial port in a configuration descriptor (USB 2.0 chapter 9, CDC 1.2).

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

const INTERFACE: u8 = 4;
const ENDPOINT: u8 = 5;
const BULK: u8 = 2;
/// Communications class, abstract control model.
const COMMUNICATIONS: [u8; 2] = [2, 2];
const DATA: u8 = 10;

impl Function {
    /// Reads a configuration descriptor and the descriptors that follow it.
    ///
    /// # Errors
    /// Describes what is missing or malformed.
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
