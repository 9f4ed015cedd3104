//! `hivtac grip`: shows what two fingers feel together, and how late it comes. Also the arguments
//! that name the two fingers, for other commands.

use crate::device::seconds;
use crate::output::{self, Reader, note, print};
use crate::record::{Arrival, listen_to_all};
use clap::Args;
use hivtac_host::clock::{Clock, now_ns};
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::grip::geometry::Geometry;
use hivtac_host::grip::pair::Pair;
use hivtac_host::grip::{Grip, Reading, lines};
use hivtac_host::link::Link;
use hivtac_host::named;
use hivtac_host::port::Address;
use hivtac_host::shown::unit_number;
use hivtac_host::stop;
use hivtac_wire::message::{DeviceHello, DeviceMessage};
use std::path::PathBuf;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

/// The fingers of a grip: names or serial numbers of sensors, or ports.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fingers([String; 2]);

impl Fingers {
    /// From `FIRST,SECOND`.
    ///
    /// # Errors
    /// When these are not two.
    pub fn parse(text: &str) -> Result<Fingers, String> {
        let parts: Vec<String> = text.split(',').map(str::to_owned).collect();
        let two = <[String; 2]>::try_from(parts).ok();
        let two = two.filter(|[first, second]| !first.is_empty() && !second.is_empty());
        two.map(Fingers)
            .ok_or_else(|| "two fingers are needed, as in thumb,index".to_owned())
    }

    /// Their addresses.
    ///
    /// # Errors
    /// [`Kind::NoDevice`] when no sensor has a name, or more than one.
    pub fn addresses(&self, patience: Duration) -> Result<Vec<Address>, Failure> {
        let each = self.0.iter().map(|finger| match is_port(finger) {
            true => Ok(Address::parse(finger)),
            false => named::find(finger, patience),
        });
        each.collect()
    }
}

/// Whether a finger is named by its port.
fn is_port(finger: &str) -> bool {
    let is_com = finger
        .strip_prefix("COM")
        .is_some_and(|rest| rest.parse::<u32>().is_ok());
    let is_address = ["tcp:", "uart:"].iter().any(|it| finger.starts_with(it));
    is_address || finger.contains('/') || is_com
}

/// Two fingers of a command that also works without.
#[derive(Args)]
pub struct GripArguments {
    /// Two sensors that grip together, by name, serial number or port: also grip force, common
    /// wrench and friction margin; where there are topics, below grip/
    #[arg(long, value_name = "FIRST,SECOND", value_parser = Fingers::parse)]
    grip: Option<Fingers>,
    /// Where the fingers are in the grip, and friction: a JSON file; opposing fingers, 30 mm apart,
    /// when not given
    #[arg(long, value_name = "FILE", requires = "grip")]
    grip_poses: Option<PathBuf>,
}

impl GripArguments {
    /// The addresses of the two fingers, and then those that the command has besides.
    ///
    /// # Errors
    /// Those of [`Fingers::addresses`], and of the others.
    pub fn before(
        &self,
        patience: Duration,
        others: impl FnOnce() -> Result<Vec<Address>, Failure>,
    ) -> Result<Vec<Address>, Failure> {
        let Some(grip) = &self.grip else {
            return others();
        };
        let fingers = grip.addresses(patience)?;
        let others = others()?.into_iter().filter(|it| *it != Address::Find);
        Ok(fingers.into_iter().chain(others).collect())
    }

    /// The pair of the first two of these devices; `None` without a grip.
    ///
    /// # Errors
    /// When the file with the poses cannot be used.
    pub fn pair(&self, hellos: &[DeviceHello]) -> Result<Option<Paired>, Failure> {
        let geometry = geometry(self.grip_poses.as_ref())?;
        let paired = |_: &Fingers| Paired::new(geometry, hellos);
        Ok(self.grip.as_ref().map(paired))
    }
}

/// Two fingers and their names.
pub struct Paired {
    /// Their samples.
    pub pair: Pair,
    /// Their names.
    pub names: [String; 2],
}

impl Paired {
    /// The first two of these devices; names that are the same give way to serial numbers.
    fn new(geometry: Geometry, hellos: &[DeviceHello]) -> Paired {
        let each = |name: fn(&DeviceHello) -> String| {
            [0, 1].map(|finger| hellos.get(finger).map(name).unwrap_or_default())
        };
        let [first, second] = each(lines::finger);
        let names = match first == second {
            true => each(|hello| unit_number(&hello.device_id)),
            false => [first, second],
        };
        Paired {
            pair: Pair::new(geometry),
            names,
        }
    }
}

/// The geometry of a file; the usual one without.
fn geometry(poses: Option<&PathBuf>) -> Result<Geometry, Failure> {
    let read = poses.map(|path| Geometry::read(path)).transpose()?;
    Ok(read.unwrap_or_default())
}

/// Show the grip of two fingers: grip force, common wrench, friction margin
///
/// A line for each frame of the first finger, and at the end how late they came. `serve`, `record`
/// and `view` have the same by `--grip`.
///
/// Example: hivtac grip thumb,index --seconds 10
#[derive(Args)]
pub struct GripCommand {
    /// Two sensors, by name, serial number or port
    #[arg(value_name = "FIRST,SECOND", value_parser = Fingers::parse)]
    fingers: Fingers,
    /// Where the fingers are in the grip, and friction: a JSON file; opposing fingers, 30 mm apart,
    /// when not given
    #[arg(long, value_name = "FILE")]
    poses: Option<PathBuf>,
    /// End after S seconds
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<Duration>,
    /// One JSON object a line
    #[arg(long)]
    json: bool,
    /// Longest wait for each device's hello and replies, s
    #[arg(long, value_name = "S", default_value = "2", value_parser = seconds)]
    timeout: Duration,
}

/// Shows grips until the time is over, the reader is gone, or a finger is lost.
pub fn run(command: &GripCommand) -> Result<(), Failure> {
    let geometry = geometry(command.poses.as_ref())?;
    let addresses = command.fingers.addresses(command.timeout)?;
    let connect = |address| Link::connect(address, command.timeout);
    let connected: Result<Vec<_>, _> = addresses.iter().map(connect).collect();
    let (mut links, hellos): (Vec<Link>, Vec<DeviceHello>) = connected?.into_iter().unzip();
    if hellos[0].device_id == hellos[1].device_id {
        return Err(Failure::new(Kind::Usage, "the same sensor is named twice"));
    }
    let mut shown = Shown {
        paired: Paired::new(geometry, &hellos),
        clocks: [Clock::default(), Clock::default()],
        begun: Instant::now(),
        begun_ns: now_ns(),
        json: command.json,
        lateness: Lateness::default(),
    };
    if !command.json {
        print(&lines::header())?;
    }
    let result = listen_to_all(&mut links, command.timeout, command.seconds, |arrivals| {
        shown.all(arrivals)
    });
    note(&shown.lateness.summary());
    result.and_then(|()| stop::check())
}

/// The lines and counts shown for two fingers.
struct Shown {
    paired: Paired,
    clocks: [Clock; 2],
    /// The start by this program's clock, which never jumps, and as ns since 1970: the origin of
    /// the times of both fingers.
    begun: Instant,
    begun_ns: u64,
    json: bool,
    lateness: Lateness,
}

impl Shown {
    /// Shows all grips until both fingers are over.
    fn all(&mut self, arrivals: &Receiver<Arrival>) -> Result<(), Failure> {
        for Arrival {
            sensor,
            at,
            message,
        } in arrivals
        {
            match message {
                DeviceMessage::Stats(stats) => self.clocks[sensor].latency(stats.latency_us),
                DeviceMessage::Sample(sample) => {
                    let came_ns = self.ns(at);
                    let stamp_ns = self.clocks[sensor].stamp_ns(sample.time_us, came_ns);
                    let reading = Reading::of(&sample, stamp_ns, came_ns);
                    for grip in self.paired.pair.push(sensor, reading) {
                        if self.show(&grip)? != Reader::There {
                            return Ok(());
                        }
                    }
                }
                _ => (),
            }
        }
        Ok(())
    }

    fn ns(&self, at: Instant) -> u64 {
        self.begun_ns + at.saturating_duration_since(self.begun).as_nanos() as u64
    }

    fn show(&mut self, grip: &Grip) -> Result<output::Reader, Failure> {
        self.lateness.add(grip, self.ns(Instant::now()));
        print(&match self.json {
            true => lines::json(grip, &self.paired.names),
            false => lines::line(grip, &self.paired.names),
        })
    }
}

/// How late grips were known.
#[derive(Default)]
struct Lateness {
    /// After the first finger's sample arrived, and after its frame was exposed, ms.
    times_ms: [Vec<f64>; 2],
    without: usize,
}

impl Lateness {
    fn add(&mut self, grip: &Grip, now_ns: u64) {
        let origins = [grip.came_ns, grip.stamp_ns];
        for (times, origin_ns) in self.times_ms.iter_mut().zip(origins) {
            times.push(now_ns.saturating_sub(origin_ns) as f64 * 1e-6);
        }
        self.without += usize::from(grip.held.is_err());
    }

    /// For a person.
    fn summary(&mut self) -> String {
        let count = self.times_ms[0].len();
        let [came, exposed] = self.times_ms.each_mut().map(|times| {
            times.sort_by(f64::total_cmp);
            let part = |part: usize| times.get((count.saturating_sub(1)) * part / 100);
            let [p50, p99] = [part(50), part(99)].map(|it| it.copied().unwrap_or_default());
            format!("p50 {p50:.2} ms, p99 {p99:.2} ms")
        });
        format!(
            "{count} times shown, {} of them without a grip\n\
             latency: {came} after the first finger's sample; {exposed} after its exposure",
            self.without
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fingers_are_two_names_or_ports() {
        let fingers = Fingers::parse("thumb,tcp:127.0.0.1:7000").unwrap();
        assert_eq!(fingers.0, ["thumb", "tcp:127.0.0.1:7000"]);
        for text in ["", "thumb", "thumb,", ",index", "a,b,c"] {
            assert!(Fingers::parse(text).unwrap_err().contains("thumb,index"));
        }
        for (finger, port) in [
            ("tcp:robot:7000", true),
            ("/dev/ttyACM0", true),
            ("COM5", true),
            ("uart:COM4", true),
            ("COMfort", false),
            ("0001020304050607080910ff", false),
        ] {
            assert_eq!(is_port(finger), port, "{finger}");
        }
    }
}
