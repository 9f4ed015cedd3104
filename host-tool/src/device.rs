//! Command-line arguments that select the devices of a command.

use clap::Args;
use hivtac_host::failure::Failure;
use hivtac_host::link::Link;
use hivtac_host::named;
use hivtac_host::port::Address;
use hivtac_wire::message::DeviceHello;
use std::time::Duration;

/// One device.
#[derive(Args, Default)]
pub struct Device {
    /// Serial port, pseudo-terminal, tcp:HOST:PORT, or uart:PORT with an adapter for the sensor's
    /// UART; found by its USB id when not given
    #[arg(long, value_name = "PORT", conflicts_with = "device")]
    port: Option<String>,
    /// The sensor with this name or serial number, as `list` shows them
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Longest wait for the device's hello and replies, s
    #[arg(long, value_name = "S", default_value = "2", value_parser = seconds)]
    pub timeout: Duration,
}

/// One device, or several.
#[derive(Args)]
pub struct Devices {
    /// Serial port, pseudo-terminal, tcp:HOST:PORT, or uart:PORT with an adapter for the sensor's
    /// UART; found by its USB id when not given. May be repeated
    #[arg(long, value_name = "PORT")]
    port: Vec<String>,
    /// The sensor with this name or serial number, as `list` shows them. May be repeated
    #[arg(long, value_name = "NAME")]
    device: Vec<String>,
    /// Longest wait for each device's hello and replies, s
    #[arg(long, value_name = "S", default_value = "2", value_parser = seconds)]
    pub timeout: Duration,
}

/// One device, and how the result is printed.
#[derive(Args)]
pub struct Target {
    #[command(flatten)]
    pub device: Device,
    /// One JSON object instead of a line
    #[arg(long)]
    pub json: bool,
}

impl Device {
    /// The device's address.
    pub fn address(&self) -> Result<Address, Failure> {
        match (&self.port, &self.device) {
            (Some(port), _) => Ok(Address::parse(port)),
            (None, Some(device)) => named::find(device, self.timeout),
            (None, None) => Ok(Address::Find),
        }
    }

    /// Connects to the device; returns the connection and the device's hello.
    pub fn connect(&self) -> Result<(Link, DeviceHello), Failure> {
        Link::connect(&self.address()?, self.timeout)
    }
}

impl Devices {
    /// The addresses of the devices.
    pub fn addresses(&self) -> Result<Vec<Address>, Failure> {
        if self.port.is_empty() && self.device.is_empty() {
            return Ok(vec![Address::Find]);
        }
        let ports = self.port.iter().map(|port| Ok(Address::parse(port)));
        let named = |device: &String| named::find(device, self.timeout);
        ports.chain(self.device.iter().map(named)).collect()
    }

    /// These arguments, as another program of the project takes them.
    pub fn words(&self) -> Vec<&str> {
        let ports = self.port.iter().map(|port| ["--port", port]);
        let named = self.device.iter().map(|device| ["--device", device]);
        ports.chain(named).flatten().collect()
    }

    /// Connects to each of these addresses; returns the connections and the devices' hellos.
    pub fn connect(&self, addresses: &[Address]) -> Result<(Vec<Link>, Vec<DeviceHello>), Failure> {
        let connect = |address| Link::connect(address, self.timeout);
        let connected: Result<Vec<_>, _> = addresses.iter().map(connect).collect();
        Ok(connected?.into_iter().unzip())
    }
}

/// A positive number of seconds, up to a year.
pub fn seconds(text: &str) -> Result<Duration, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds <= 31_536_000.0 => {
            Ok(Duration::from_secs_f64(seconds))
        }
        _ => Err("a positive number of seconds is needed".to_owned()),
    }
}
