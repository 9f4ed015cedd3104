//! Opens the device's port: a serial port found by USB id or name, a TCP address, or the UART on
//! which a device only sends.

use crate::failure::{Failure, Kind};
use hivtac_wire::uart::BAUD;
use hivtac_wire::usb::{PRODUCT, PRODUCT_ID, VENDOR_ID};
use serialport::{ErrorKind, SerialPortInfo, SerialPortType, UsbPortInfo};
use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// Longest wait of one read or write.
const PATIENCE: Duration = Duration::from_millis(50);
/// Over USB, the device ignores the baud rate, which some drivers require.
const USB_BAUD: u32 = 115_200;
/// The start of a UART's address.
const UART: &str = "uart:";
/// Longest wait for a TCP connection.
const TCP_PATIENCE: Duration = Duration::from_secs(2);

/// A byte stream whose reads and writes give up after [`PATIENCE`] with an error of kind `TimedOut`
/// or `WouldBlock`.
pub trait Port: Read + Write + Send {}
impl<T: Read + Write + Send> Port for T {}

/// The address of a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// The one serial port with the sensor's USB id and product.
    Find,
    /// The serial port with the sensor's USB id and this serial number, lower case.
    Serial(String),
    /// A serial port or pseudo-terminal.
    Tty(String),
    /// `host:port`.
    Tcp(String),
    /// The serial port of an adapter for the device's UART, or `tcp:host:port` of a bridge to it.
    Uart(String),
}

impl Address {
    /// From the text of `--port`: `tcp:HOST:PORT`, `uart:PORT`, or the name of a serial port.
    pub fn parse(text: &str) -> Address {
        if let Some(line) = text.strip_prefix(UART) {
            return Address::Uart(line.to_owned());
        }
        match text.strip_prefix("tcp:") {
            Some(address) => Address::Tcp(address.to_owned()),
            None => Address::Tty(text.to_owned()),
        }
    }

    /// True for a line on which the device only sends.
    pub fn only_sends(&self) -> bool {
        matches!(self, Address::Uart(_))
    }

    /// Opens the port; returns it with its name.
    ///
    /// # Errors
    /// [`Kind::NoDevice`] when the port is missing or cannot be opened.
    pub fn open(&self) -> Result<(Box<dyn Port>, String), Failure> {
        match self {
            Address::Find => open_tty(&find(&ports()?)?, USB_BAUD),
            Address::Serial(number) => open_tty(&find_serial(&ports()?, number)?, USB_BAUD),
            Address::Tty(name) => open_tty(name, USB_BAUD),
            Address::Tcp(address) => open_tcp(address),
            Address::Uart(line) => open_uart(line),
        }
    }
}

/// A sensor on a serial port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Attached {
    /// The port's name.
    pub port: String,
    /// The serial number, lower case: that of the microcontroller, as in its hello.
    pub serial: String,
}

/// All sensors on the serial ports of this machine.
///
/// # Errors
/// [`Kind::NoDevice`] when the ports cannot be listed.
pub fn attached() -> Result<Vec<Attached>, Failure> {
    Ok(ports()?.iter().filter_map(sensor).collect())
}

fn failure(message: String) -> Failure {
    Failure::new(Kind::NoDevice, message)
}

/// All serial ports of this machine.
fn ports() -> Result<Vec<SerialPortInfo>, Failure> {
    // `serialport` panics on a Linux without this directory, as in some containers.
    if cfg!(target_os = "linux") && !std::path::Path::new("/sys/class/tty").exists() {
        return Ok(Vec::new());
    }
    let ports = serialport::available_ports().map_err(|error| {
        failure(format!(
            "cannot list the serial ports: {error}; name one with --port"
        ))
    })?;
    // macOS lists each port twice; opening the `tty` one would wait for a carrier.
    Ok(ports
        .into_iter()
        .filter(|port| !port.port_name.starts_with("/dev/tty."))
        .collect())
}

/// The name of the only port with the sensor's USB id; an error if none or several have it.
fn find(ports: &[SerialPortInfo]) -> Result<String, Failure> {
    let sensors: Vec<_> = ports.iter().filter(|port| is_sensor(port)).collect();
    match sensors[..] {
        [sensor] => Ok(sensor.port_name.clone()),
        [] => Err(failure(format!(
            "no sensor found: no serial port has USB id {VENDOR_ID:04x}:{PRODUCT_ID:04x}; {}; \
             plug it in, or name its port with --port",
            seen(ports.iter())
        ))),
        _ => Err(failure(format!(
            "more than one sensor found; {}; choose one with --device (`hivtac list`)",
            seen(sensors.into_iter())
        ))),
    }
}

/// The name of the port whose sensor has this serial number.
fn find_serial(ports: &[SerialPortInfo], number: &str) -> Result<String, Failure> {
    let mut sensors = ports.iter().filter_map(sensor);
    let found = sensors.find(|sensor| sensor.serial == number);
    found.map(|sensor| sensor.port).ok_or_else(|| {
        failure(format!(
            "no sensor with serial number {number}; {}; `hivtac list` shows those that there are",
            seen(ports.iter())
        ))
    })
}

fn is_sensor(port: &SerialPortInfo) -> bool {
    sensor(port).is_some()
}

fn sensor(port: &SerialPortInfo) -> Option<Attached> {
    match &port.port_type {
        SerialPortType::UsbPort(usb) if is_ours(usb) => {
            let serial = usb.serial_number.as_deref().unwrap_or_default();
            Some(Attached {
                port: port.port_name.clone(),
                serial: serial.to_lowercase(),
            })
        }
        _ => None,
    }
}

/// Anybody's test devices have the same id, so the product's name is compared, too. Linux may
/// replace its spaces. Windows gives only its driver's name.
fn is_ours(usb: &UsbPortInfo) -> bool {
    let same_product = |product: &String| product.replace('_', " ") == PRODUCT;
    let product = (usb.product.as_ref()).filter(|_| !cfg!(windows));
    (usb.vid, usb.pid) == (VENDOR_ID, PRODUCT_ID) && product.is_none_or(same_product)
}

/// "ports seen: …" for a message.
fn seen<'a>(ports: impl Iterator<Item = &'a SerialPortInfo>) -> String {
    let names: Vec<_> = ports.map(describe).collect();
    match names[..] {
        [] => "there are no serial ports here".to_owned(),
        _ => format!("ports seen: {}", names.join(", ")),
    }
}

fn describe(port: &SerialPortInfo) -> String {
    match &port.port_type {
        SerialPortType::UsbPort(usb) => {
            let serial = usb.serial_number.as_deref().unwrap_or("no serial number");
            let product = usb.product.as_ref().filter(|_| !is_ours(usb));
            let product = product.map_or_else(String::new, |product| format!(", {product}"));
            format!(
                "{} (USB {:04x}:{:04x}{product}, {serial})",
                port.port_name, usb.vid, usb.pid
            )
        }
        _ => port.port_name.clone(),
    }
}

fn open_uart(line: &str) -> Result<(Box<dyn Port>, String), Failure> {
    let opened = match line.strip_prefix("tcp:") {
        Some(address) => open_tcp(address),
        None => open_tty(line, BAUD),
    };
    opened.map(|(port, name)| (port, format!("{UART}{name}")))
}

fn open_tty(name: &str, baud: u32) -> Result<(Box<dyn Port>, String), Failure> {
    // DTR signals a host to the device's USB.
    let port = serialport::new(name, baud)
        .timeout(PATIENCE)
        .dtr_on_open(true)
        .open();
    match port {
        Ok(port) => Ok((Box::new(port), name.to_owned())),
        Err(error) => Err(failure(format!("cannot open {name}: {}", advice(&error)))),
    }
}

/// The cause of an error on a port, and the remedy.
fn advice(error: &serialport::Error) -> String {
    match error.kind {
        ErrorKind::Io(io::ErrorKind::NotFound) => {
            let ports = ports().unwrap_or_default();
            format!(
                "there is no such port; {}; is the sensor plugged in?",
                seen(ports.iter())
            )
        }
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => {
            "permission denied; on Linux join the port's group: \
             sudo usermod -aG dialout $USER, then log in again"
                .to_owned()
        }
        ErrorKind::NoDevice => format!("{error}; close the other program that uses it"),
        _ => format!("{error}; is it a serial port?"),
    }
}

fn open_tcp(address: &str) -> Result<(Box<dyn Port>, String), Failure> {
    let name = format!("tcp:{address}");
    match connect(address) {
        Ok(stream) => Ok((Box::new(stream), name)),
        Err(error) => Err(failure(format!(
            "cannot connect to {name}: {error}; is something listening there? (form: tcp:HOST:PORT)"
        ))),
    }
}

fn connect(address: &str) -> io::Result<TcpStream> {
    let mut last = io::Error::new(io::ErrorKind::NotFound, "the name has no address");
    for target in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&target, TCP_PATIENCE) {
            Ok(stream) => {
                stream.set_read_timeout(Some(PATIENCE))?;
                stream.set_write_timeout(Some(PATIENCE))?;
                stream.set_nodelay(true)?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serialport::UsbPortInfo;

    fn usb(name: &str, vid: u16, pid: u16, serial: &str) -> SerialPortInfo {
        SerialPortInfo {
            port_name: name.to_owned(),
            port_type: SerialPortType::UsbPort(UsbPortInfo {
                vid,
                pid,
                serial_number: Some(serial.to_owned()),
                manufacturer: None,
                product: None,
            }),
        }
    }

    fn plain(name: &str) -> SerialPortInfo {
        SerialPortInfo {
            port_name: name.to_owned(),
            port_type: SerialPortType::Unknown,
        }
    }

    #[test]
    fn addresses_are_distinguished() {
        assert_eq!(
            Address::parse("tcp:localhost:7"),
            Address::Tcp("localhost:7".into())
        );
        assert_eq!(
            Address::parse("/dev/ttyACM0"),
            Address::Tty("/dev/ttyACM0".into())
        );
        assert_eq!(Address::parse("COM3"), Address::Tty("COM3".into()));
        let uart = Address::parse("uart:/dev/ttyUSB0");
        assert_eq!(uart, Address::Uart("/dev/ttyUSB0".into()));
        assert!(uart.only_sends());
    }

    #[test]
    fn the_sensor_is_found_among_others() {
        let ports = [
            plain("ttyS0"),
            usb("ttyACM0", 1, 2, "a"),
            usb("ttyACM1", 0x1209, 1, "b"),
        ];
        assert_eq!(find(&ports).unwrap(), "ttyACM1");
    }

    /// On Windows a port's product is the name of its driver.
    #[test]
    #[cfg(not(windows))]
    fn another_device_of_the_same_id_is_no_sensor() {
        let named = |name: &str, product: &str| {
            let mut port = usb(name, 0x1209, 1, "a");
            if let SerialPortType::UsbPort(usb) = &mut port.port_type {
                usb.product = Some(product.to_owned());
            }
            port
        };
        let blinker = named("A", "Blinker");
        let ports = [blinker.clone(), named("B", "HiVTac_force_sensor")];
        assert_eq!(find(&ports).unwrap(), "B");
        let error = find(&[blinker]).unwrap_err().to_string();
        assert!(error.contains("A (USB 1209:0001, Blinker, a)"), "{error}");
    }

    #[test]
    fn a_sensor_is_found_by_its_serial_number() {
        let ports = [
            usb("A", 0x1209, 1, "0A1B"),
            usb("B", 0x1209, 1, "0A1C"),
            usb("C", 1, 2, "0a1d"),
        ];
        assert_eq!(find_serial(&ports, "0a1c").unwrap(), "B");
        let other = find_serial(&ports, "0a1d").unwrap_err().to_string();
        assert!(
            other.contains("0a1d") && other.contains("hivtac list"),
            "{other}"
        );
    }

    #[test]
    fn without_a_sensor_the_ports_are_listed() {
        let ports = [plain("ttyS0"), usb("ttyACM0", 1, 2, "a")];
        assert_eq!(
            find(&ports).unwrap_err().to_string(),
            "no sensor found: no serial port has USB id 1209:0001; ports seen: ttyS0, \
             ttyACM0 (USB 0001:0002, a); plug it in, or name its port with --port"
        );
        assert!(
            find(&[])
                .unwrap_err()
                .to_string()
                .contains("there are no serial ports here")
        );
    }

    #[test]
    fn two_sensors_are_listed() {
        let ports = [
            usb("A", 0x1209, 1, "a"),
            plain("S"),
            usb("B", 0x1209, 1, "b"),
        ];
        assert_eq!(
            find(&ports).unwrap_err().to_string(),
            "more than one sensor found; ports seen: A (USB 1209:0001, a), B (USB 1209:0001, b); \
             choose one with --device (`hivtac list`)"
        );
    }
}
