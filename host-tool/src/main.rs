//! `hivtac`: shows the forces of a HiVTac sensor, asks and commands it, and tries pictures.

mod auto_threshold;
mod bring_up;
mod check;
mod clock;
mod command;
mod decimal;
mod finding;
mod firmware;
mod focus;
mod follow;
mod force_json;
mod health;
mod help;
mod hsv;
mod info;
mod lines;
mod list;
mod monitor;
mod output;
mod record;
mod replay;
mod ros;
mod sense;
#[cfg_attr(
    not(all(feature = "ros2", feature = "foxglove")),
    allow(dead_code, reason = "only what these features add uses it")
)]
mod serve;
mod settings;
mod snapshot;
mod tally;
mod template;
mod truth;
mod update;
mod view;

use clap::{Args, FromArgMatches, Parser, Subcommand};
use clap_complete::Shell;
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::named;
use hivtac_host::port::Address;
use hivtac_host::stop;
use hivtac_terms::geometry::Preset;
use hivtac_terms::temporal::{Creep, Filter};
use hivtac_terms::threshold::{HsvBox, Threshold};
use hivtac_terms::threshold::{Mono, Yuv422};
use hivtac_terms::units::{
    Micrometres, Microseconds, MilliPx, Milliseconds, Permille, Sixteenths, SmallPermille,
    UnsignedMicroNewtons,
};
use hivtac_wire::settings::Name;
use lines::Format;
use settings::camera::{self, Wanted};
use settings::temporal::{Change, RezeroChange, small_thousandths, thousandths, two_thousandths};
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

/// Shows the forces of a HiVTac sensor.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Show forces as they come, and a summary at the end
    ///
    /// Example: hivtac monitor --seconds 10
    Monitor(MonitorArguments),
    /// Measure rate, jitter, losses and latency for a while, and hold them against limits
    ///
    /// Example: hivtac check --seconds 10 --min-rate 150 --max-loss 0
    Check(CheckArguments),
    /// Record everything that one or several devices say, with both clocks, until Ctrl-C
    ///
    /// FILE.mcap has ROS 2's profile: `ros2 bag play`, Foxglove and PlotJuggler read it, and
    /// `hivtac replay`. FILE.csv has a row a sample, with units in its header. Until its end it is
    /// FILE.partial; it keeps that name when the connection was lost. Several sensors are recorded
    /// into one FILE.mcap, each with its own topics.
    ///
    /// Example: hivtac record press.mcap --seconds 60
    Record {
        #[command(flatten)]
        devices: Devices,
        /// The file to make, ….mcap or ….csv
        file: PathBuf,
        /// End after so many seconds
        #[arg(long, value_name = "S", value_parser = seconds)]
        seconds: Option<Duration>,
        /// At the end, what became of it as one JSON object
        #[arg(long)]
        json: bool,
    },
    /// Play a recording as if it were a device, for any other command, on a TCP port of this
    /// computer
    ///
    /// Prints `ready tcp=127.0.0.1:PORT`, waits for a program there, and ends with the recording:
    /// `hivtac monitor --port tcp:127.0.0.1:7000` shows the forces of the example.
    ///
    /// Example: hivtac replay press.mcap --tcp 7000
    Replay {
        /// What `record` made; also one that was cut
        file: PathBuf,
        /// The sensor with this name or serial number, where it holds several
        #[arg(long, value_name = "NAME")]
        device: Option<String>,
        /// The port; one that is free when not given
        #[arg(long, value_name = "PORT", default_value_t = 0)]
        tcp: u16,
        /// As fast as the other program reads, not as it was recorded
        #[arg(long)]
        fast: bool,
        /// One JSON object instead of a line
        #[arg(long)]
        json: bool,
    },
    /// List the sensors that are plugged in: serial number, port, name, board and firmware
    ///
    /// One that another program uses is listed with what is wrong.
    ///
    /// Example: hivtac list
    List {
        /// One JSON object a line
        #[arg(long)]
        json: bool,
        /// Longest wait for each one's hello, s
        #[arg(long, value_name = "S", default_value = "2", value_parser = seconds)]
        timeout: Duration,
    },
    /// Show what the device is and how it fares
    ///
    /// Example: hivtac info
    Info {
        #[command(flatten)]
        device: Device,
        /// One JSON object instead of lines
        #[arg(long)]
        json: bool,
    },
    /// Have the device look at itself, and show what it finds, each with its code
    ///
    /// Codes are those of docs/wire.md, "Health". Exit code 9 when something is not right.
    ///
    /// Example: hivtac self-test
    SelfTest {
        #[command(flatten)]
        device: Device,
        /// One JSON object instead of lines
        #[arg(long)]
        json: bool,
    },
    /// Take the present position of the film as its rest position, until the device restarts
    ///
    /// Refused while something moves, or touches the film as the tare from before tells. Says where
    /// the markers are, how much they scatter, and how far they are from where they were.
    ///
    /// Example: hivtac tare --keep
    Tare {
        #[command(flatten)]
        device: Device,
        /// Good frames to average
        #[arg(
            long,
            value_name = "N",
            default_value_t = command::TARE_FRAMES,
            value_parser = clap::value_parser!(u16).range(1..=256)
        )]
        frames: u16,
        /// Keep it through restarts
        #[arg(long)]
        keep: bool,
        /// Though something moves or touches the film
        #[arg(long)]
        force: bool,
        /// One JSON object instead of a line
        #[arg(long)]
        json: bool,
    },
    /// Set which pixels a marker may have, and with that the camera's pixel format, until the
    /// device restarts
    ///
    /// There are forces only with the threshold that the device's model was made for; markers there
    /// are all the same, as `hivtac-calibrate collect` needs them. Another pixel format forgets the
    /// tare.
    ///
    /// Example: hivtac threshold --hsv 170,10,100,255,45,255
    #[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
    Threshold(ThresholdArguments),
    /// Show, save, give back or forget what the device keeps through restarts
    #[command(subcommand)]
    Settings(SettingsCommand),
    /// Give the device a model of its own, or new firmware
    #[command(subcommand)]
    Update(UpdateCommand),
    /// Let the camera find exposure and gain for the light that there is, until it restarts
    ///
    /// It does so by itself when it starts. What `settings set` gave it stays.
    ///
    /// Example: hivtac expose
    Expose {
        #[command(flatten)]
        device: Device,
        /// One JSON object instead of a line
        #[arg(long)]
        json: bool,
    },
    /// Save a frame as the sensing saw it, while forces go on
    ///
    /// It says what the device itself found in it, too. `hivtac sense` on the picture or the raw
    /// frame finds the same; on that of YUV422 only on the raw frame, with the device's model.
    ///
    /// Example: hivtac snapshot frame.png --mask mask.png
    Snapshot {
        #[command(flatten)]
        device: Device,
        #[command(flatten)]
        files: SnapshotFiles,
        /// One JSON object instead of lines
        #[arg(long)]
        json: bool,
    },
    /// Show how sharp, bright and well placed the markers are, until all is right
    ///
    /// Picture after picture: the width of each marker's rim and of the marker, its colour and
    /// brightness, and where the pattern lies and how it is turned, each with its limit. Ends when
    /// everything is right.
    ///
    /// Example: hivtac focus
    Focus {
        #[command(flatten)]
        device: Device,
        /// One JSON object a picture
        #[arg(long)]
        json: bool,
    },
    /// Look at everything about a new board, in the order in which things go wrong
    ///
    /// USB, the camera and its registers, clocks, white, the markers as `focus` has them, tare and
    /// noise, and a finger's press; says what is wrong and what to do, and what a person has to do
    /// in between. Ends with the first thing on which others rest. The report is for your own
    /// notes, and to attach to a question.
    ///
    /// Example: hivtac bring-up
    BringUp {
        #[command(flatten)]
        device: Device,
        /// Where the report goes
        #[arg(value_name = "FILE.json", default_value = "bring-up.json")]
        report: String,
        /// The report on standard output, too, instead of a line a step
        #[arg(long)]
        json: bool,
    },
    /// Show a live page in a browser of this computer: forces, picture, threshold, status
    ///
    /// Prints `ready` and the page's address, which holds a secret: nobody else on this computer or
    /// in another page can open it. Ends with Ctrl-C; goes on after a lost connection. `--port`
    /// more than once shows several sensors side by side.
    ///
    /// Example: hivtac view
    View {
        /// Serial port, pseudo-terminal, or tcp:HOST:PORT; found by its USB id when not given
        #[arg(long, value_name = "PORT")]
        port: Vec<String>,
        /// Longest wait for the device's hello and replies, s
        #[arg(long, value_name = "S", default_value = "2", value_parser = seconds)]
        timeout: Duration,
        /// The page's port on 127.0.0.1; one that is free when not given
        #[arg(long, value_name = "PORT", default_value_t = 0)]
        listen: u16,
        /// Where the page's recordings go, as hivtac-UNIT-NUMBER.mcap
        #[arg(long, value_name = "FOLDER", default_value = ".")]
        recordings: PathBuf,
        /// The page's address in a JSON object
        #[arg(long)]
        json: bool,
    },
    /// Serve forces to other programs, as a node of ROS 2 or for Foxglove, until Ctrl-C
    ///
    /// For a hivtac that was built with it: `cargo install --path host-tool --features
    /// ros2,foxglove`. Prints `ready` and where; goes on after a lost connection, which diagnostics
    /// tell. Topics of the node, each below its name: `wrench`, `place`, `markers`, `contact`,
    /// `slip`, `status`; service `tare`; and `/diagnostics`. Those of several sensors are below
    /// /NODE/SENSOR.
    ///
    /// Example: hivtac serve --ros2 --foxglove
    Serve(ServeArguments),
    /// Write a template to print: where the film is punched and the dots are stuck, as SVG
    ///
    /// Example: hivtac template film.svg
    Template {
        /// File to write
        #[arg(value_name = "FILE.svg")]
        file: String,
        /// Whose markers
        #[arg(long, value_name = "paper|ov7725", default_value = "ov7725")]
        preset: Preset,
        /// One JSON object instead of a line
        #[arg(long)]
        json: bool,
    },
    /// Look for markers and force in pictures, with the sensor's own code
    ///
    /// PNG, JPEG, PPM, or a raw frame of `hivtac snapshot`, up to 800 × 800 px. Eight bits a
    /// channel are rounded to RGB565, which is what the sensor's camera delivers. There is a force
    /// only when size, preset and threshold are those of the model; the status says so otherwise,
    /// and blobs, markers and features are there all the same.
    ///
    /// Example: hivtac sense photo.jpg
    Sense(SenseArguments),
    /// Print what a shell completes this tool's commands by
    ///
    /// Example: hivtac completion bash
    Completion {
        /// Which shell's
        shell: Shell,
    },
    /// Write a man page of each command into a folder
    ///
    /// Example: hivtac man ~/.local/share/man/man1
    Man {
        /// The folder, made when it is missing
        folder: PathBuf,
    },
}

#[derive(Subcommand)]
enum SettingsCommand {
    /// Show name, threshold, tare and limits in use, and which of them are kept
    ///
    /// Example: hivtac settings get
    Get {
        #[command(flatten)]
        device: Device,
        /// One JSON object instead of lines
        #[arg(long)]
        json: bool,
    },
    /// Give the device something of yours to keep
    #[command(subcommand)]
    Set(SetCommand),
    /// Save the settings in use in a file
    ///
    /// Example: hivtac settings export thumb.json
    Export {
        #[command(flatten)]
        device: Device,
        /// The file to make, JSON
        #[arg(value_name = "FILE.json")]
        file: String,
        /// One JSON object instead of a line
        #[arg(long)]
        json: bool,
    },
    /// Set and keep the settings of a file
    ///
    /// The rest position only when the file is of the same device.
    ///
    /// Example: hivtac settings import thumb.json
    Import {
        #[command(flatten)]
        device: Device,
        /// What `export` made
        #[arg(value_name = "FILE.json")]
        file: String,
        /// One JSON object instead of a line
        #[arg(long)]
        json: bool,
    },
    /// Forget everything that was kept: no name, the built-in model and its threshold, no tare, the
    /// usual limits
    ///
    /// Example: hivtac settings reset
    Reset {
        #[command(flatten)]
        device: Device,
        /// One JSON object instead of a line
        #[arg(long)]
        json: bool,
    },
}

/// A device, and how is told what was done with it.
#[derive(Args)]
struct Told {
    #[command(flatten)]
    device: Device,
    /// One JSON object instead of a line
    #[arg(long)]
    json: bool,
}

#[derive(Subcommand)]
enum UpdateCommand {
    /// Send a model file, which the device checks, keeps through restarts and uses from then on
    ///
    /// Forces go on with the model before until then. What is damaged, not sound, or made for
    /// another camera or unit is refused, and nothing changes.
    ///
    /// Example: hivtac update model thumb.hvtm
    Model {
        #[command(flatten)]
        device: Device,
        /// What `hivtac-calibrate` made
        #[arg(value_name = "FILE.hvtm", required_unless_present = "built_in")]
        file: Option<String>,
        /// The model that is built into the firmware instead of a file; the kept one is forgotten
        #[arg(long, conflicts_with = "file")]
        built_in: bool,
        /// One JSON object instead of a line
        #[arg(long)]
        json: bool,
    },
    /// Restart the device into its own loader (USB DFU), say how to send it firmware, and wait for
    /// it to come back
    ///
    /// Prints the `dfu-util` command to run meanwhile in another terminal, then the version before
    /// and after. What the device keeps stays. When the loader was started by mistake, take the
    /// device off its supply for a moment.
    ///
    /// Example: hivtac update firmware hivtac-firmware.bin
    Firmware {
        #[command(flatten)]
        device: Device,
        /// The program as it lies in flash: `arm-none-eabi-objcopy -O binary ELF FILE.bin`
        #[arg(value_name = "FILE.bin")]
        file: String,
        /// Longest wait for the device to come back, s
        #[arg(long, value_name = "S", default_value = "300", value_parser = seconds)]
        wait: Duration,
        /// JSON objects instead of lines: the command to run, then the version before and after
        #[arg(long)]
        json: bool,
    },
}

impl UpdateCommand {
    fn run(self) -> Result<(), Failure> {
        match self {
            UpdateCommand::Model {
                device, file, json, ..
            } => {
                let options = update::Options {
                    address: device.address()?,
                    patience: device.timeout,
                    json,
                };
                match file {
                    Some(path) => update::model(&options, &path),
                    None => update::built_in_model(&options),
                }
            }
            UpdateCommand::Firmware {
                device,
                file,
                wait,
                json,
            } => firmware::update(&device.address()?, device.timeout, &file, wait, json),
        }
    }
}

#[derive(Subcommand)]
enum SetCommand {
    /// A name to tell it from others, by which `info` shows it
    ///
    /// Example: hivtac settings set name thumb
    Name {
        #[command(flatten)]
        device: Told,
        /// At most 24 bytes of UTF-8
        #[arg(value_name = "NAME", value_parser = settings::name)]
        name: Name,
    },
    /// From what force on something touches the film, and until what
    ///
    /// A contact also begins only with three times the force's standard uncertainty, and ends below
    /// half of that.
    ///
    /// Example: hivtac settings set contact --begins 5 --ends 3
    #[command(group = clap::ArgGroup::new("limit").required(true).multiple(true))]
    Contact {
        #[command(flatten)]
        device: Told,
        /// |F| with which it begins, mN; 2 by default
        #[arg(long, value_name = "MN", value_parser = thousandths, group = "limit")]
        begins: Option<u32>,
        /// |F| below which it ends, mN; 1 by default
        #[arg(long, value_name = "MN", value_parser = thousandths, group = "limit")]
        ends: Option<u32>,
    },
    /// How far a contact moves over the film when it slips
    ///
    /// Example: hivtac settings set slip --distance 100
    #[command(group = clap::ArgGroup::new("limit").required(true).multiple(true))]
    Slip {
        #[command(flatten)]
        device: Told,
        /// Distance, µm, 1 to 5000; 60 by default
        #[arg(long, value_name = "UM", group = "limit")]
        distance: Option<u32>,
        /// In what time at most, ms, 10 to 100; 50 by default
        #[arg(long, value_name = "MS", group = "limit")]
        within: Option<u32>,
        /// Least force along the film over that into it, 0 to 2; 0.1 by default
        #[arg(long, value_name = "RATIO", value_parser = small_thousandths, group = "limit")]
        ratio: Option<u16>,
    },
    /// What is sent in place of each frame's own force
    ///
    /// Contact and slip are told of each frame's own force all the same.
    #[command(subcommand)]
    Filter(FilterCommand),
    /// Whether the rest position follows what drifts while nothing touches the film
    ///
    /// A force below the contact's that grows no faster than the rate is taken for drift, and
    /// missing in every force from then on: by the total at most. With the usual limits it grows by
    /// less than 2 µN a second, and takes 0.04 mN of small forces and up to 1 mN of 100 mN.
    #[command(subcommand)]
    Rezero(RezeroCommand),
    /// Where gravity pulls on the film
    ///
    /// The film hangs by its own weight: turned over, it looks pressed by some mN. A sensor that is
    /// told which way it is held takes that into account, from the next tare on; `none` where it is
    /// turned and nobody tells how, which the uncertainties then include; `fixed`, as a new device
    /// has it, where it stays as it was when the tare was taken. x is to the right and y down in
    /// the image, z away from the camera; the length does not matter.
    ///
    /// Example: hivtac settings set down 0 0 -1
    Down {
        #[command(flatten)]
        device: Told,
        /// X Y Z, `none` or `fixed`
        #[arg(value_name = "X Y Z|none|fixed", num_args = 1..=3, required = true,
              allow_negative_numbers = true)]
        down: Vec<String>,
    },
    /// How much the film remembers of its loads
    ///
    /// A held load is seen as if it grew by two parts of itself, within half a second and within
    /// 20 s, and what is taken off stays behind likewise; the guide to calibration says how they
    /// are measured. The device takes that off. Without it, or with 0,0, it states how silicones
    /// differ.
    ///
    /// Example: hivtac settings set creep 0.031,0.042
    Creep {
        #[command(flatten)]
        device: Told,
        /// Parts of a force, 0 to 0.15 each
        #[arg(value_name = "A,B", value_parser = two_thousandths)]
        parts: [u8; 2],
    },
    /// How long the camera exposes each row
    ///
    /// Automatic, it finds what the light needs when it starts and with `hivtac expose`, and then
    /// stays. At a lower rate there is time for a longer one.
    ///
    /// Example: hivtac settings set exposure 2.5
    Exposure {
        #[command(flatten)]
        device: Told,
        /// ms, or `auto`
        #[arg(value_name = "MS", value_parser = camera::exposure)]
        time: Wanted<Microseconds>,
    },
    /// How much the camera amplifies what it exposed
    ///
    /// Automatic as the exposure, and only when that alone is not enough.
    ///
    /// Example: hivtac settings set gain 1.5
    Gain {
        #[command(flatten)]
        device: Told,
        /// 1 to 4 in sixteenths, or `auto`
        #[arg(value_name = "GAIN", value_parser = camera::gain)]
        gain: Wanted<Sixteenths>,
    },
    /// How many frames the camera sends a second, and so how many forces come
    ///
    /// An OV7725 sends 156, 78 or 39, an MT9V034 244, 122 or 61. A lower rate leaves more time for
    /// light.
    ///
    /// Example: hivtac settings set rate 78
    Rate {
        #[command(flatten)]
        device: Told,
        /// Frames a second
        #[arg(value_name = "FPS")]
        rate: u16,
    },
}

#[derive(Subcommand)]
enum FilterCommand {
    /// Each frame's own force
    ///
    /// Example: hivtac settings set filter none
    None {
        #[command(flatten)]
        device: Told,
    },
    /// A first-order low-pass; a steady change comes its time constant later
    ///
    /// Example: hivtac settings set filter low-pass --ms 20
    LowPass {
        #[command(flatten)]
        device: Told,
        /// Its time constant, ms, 1 to 10000
        #[arg(long, value_name = "MS")]
        ms: u32,
    },
    /// The median of each component in three frames; a steady change comes a frame later
    ///
    /// Example: hivtac settings set filter median-of-three
    MedianOfThree {
        #[command(flatten)]
        device: Told,
    },
}

impl FilterCommand {
    fn change(self) -> (Told, Change) {
        let (device, filter) = match self {
            FilterCommand::None { device } => (device, Filter::None),
            FilterCommand::LowPass { device, ms } => {
                let time_constant = Milliseconds(ms);
                (device, Filter::LowPass { time_constant })
            }
            FilterCommand::MedianOfThree { device } => (device, Filter::MedianOfThree),
        };
        (device, Change::Filter(filter))
    }
}

#[derive(Subcommand)]
enum RezeroCommand {
    /// It stays where it was taken
    ///
    /// Example: hivtac settings set rezero off
    Off {
        #[command(flatten)]
        device: Told,
    },
    /// It follows, within limits
    ///
    /// Example: hivtac settings set rezero on
    On {
        #[command(flatten)]
        device: Told,
        /// How long nothing touches before, s, 1 to 3600; 10 by default
        #[arg(long, value_name = "S", value_parser = thousandths)]
        after: Option<u32>,
        /// How far in a second, px, 0.001 to 0.1; 0.005 by default
        #[arg(long, value_name = "PX", value_parser = small_thousandths)]
        rate: Option<u16>,
        /// How far in all, px, 0.001 to 0.25; 0.1 by default
        #[arg(long, value_name = "PX", value_parser = small_thousandths)]
        total: Option<u16>,
    },
}

impl RezeroCommand {
    fn change(self) -> (Told, Change) {
        match self {
            RezeroCommand::Off { device } => (device, Change::Rezero(None)),
            RezeroCommand::On {
                device,
                after,
                rate,
                total,
            } => {
                let change = RezeroChange {
                    after: after.map(Milliseconds),
                    rate: rate.map(MilliPx),
                    total: total.map(MilliPx),
                };
                (device, Change::Rezero(Some(change)))
            }
        }
    }
}

impl SetCommand {
    fn action(self) -> Result<(Told, settings::Action), Failure> {
        let (device, change) = match self {
            SetCommand::Down { device, down } => {
                return Ok((device, settings::Action::SetDown(settings::down(&down)?)));
            }
            SetCommand::Name { device, name } => {
                return Ok((device, settings::Action::SetName(name)));
            }
            SetCommand::Exposure { device, time } => {
                let change = camera::Change::Exposure(time);
                return Ok((device, settings::Action::SetCamera(change)));
            }
            SetCommand::Gain { device, gain } => {
                let change = camera::Change::Gain(gain);
                return Ok((device, settings::Action::SetCamera(change)));
            }
            SetCommand::Rate { device, rate } => {
                let change = camera::Change::Rate(rate);
                return Ok((device, settings::Action::SetCamera(change)));
            }
            SetCommand::Contact {
                device,
                begins,
                ends,
            } => {
                let [begins, ends] = [begins, ends].map(|limit| limit.map(UnsignedMicroNewtons));
                (device, Change::Contact { begins, ends })
            }
            SetCommand::Slip {
                device,
                distance,
                within,
                ratio,
            } => {
                let change = Change::Slip {
                    distance: distance.map(Micrometres),
                    within: within.map(Milliseconds),
                    ratio: ratio.map(Permille),
                };
                (device, change)
            }
            SetCommand::Filter(filter) => filter.change(),
            SetCommand::Rezero(rezero) => rezero.change(),
            SetCommand::Creep { device, parts } => {
                let parts = parts.map(SmallPermille);
                (device, Change::Creep(Creep { parts }))
            }
        };
        Ok((device, settings::Action::SetTemporal(change)))
    }
}

impl SettingsCommand {
    fn run(self) -> Result<(), Failure> {
        use settings::Action;
        let (device, json, action) = match self {
            SettingsCommand::Get { device, json } => (device, json, Action::Get),
            SettingsCommand::Set(command) => {
                let (Told { device, json }, action) = command.action()?;
                (device, json, action)
            }
            SettingsCommand::Export { device, file, json } => (device, json, Action::Export(file)),
            SettingsCommand::Import { device, file, json } => (device, json, Action::Import(file)),
            SettingsCommand::Reset { device, json } => (device, json, Action::Reset),
        };
        let options = settings::Options {
            address: device.address()?,
            patience: device.timeout,
            json,
        };
        settings::run(&options, &action)
    }
}

#[derive(Args)]
struct Device {
    /// Serial port, pseudo-terminal, or tcp:HOST:PORT; found by its USB id when not given
    #[arg(long, value_name = "PORT", conflicts_with = "device")]
    port: Option<String>,
    /// The sensor with this name or serial number, as `list` shows them
    #[arg(long, value_name = "NAME")]
    device: Option<String>,
    /// Longest wait for the device's hello and replies, s
    #[arg(long, value_name = "S", default_value = "2", value_parser = seconds)]
    timeout: Duration,
}

/// One device, or several.
#[derive(Args)]
struct Devices {
    /// Serial port, pseudo-terminal, or tcp:HOST:PORT; found by its USB id when not given. May be
    /// repeated
    #[arg(long, value_name = "PORT")]
    port: Vec<String>,
    /// The sensor with this name or serial number, as `list` shows them. May be repeated
    #[arg(long, value_name = "NAME")]
    device: Vec<String>,
    /// Longest wait for each device's hello and replies, s
    #[arg(long, value_name = "S", default_value = "2", value_parser = seconds)]
    timeout: Duration,
}

impl Devices {
    fn addresses(&self) -> Result<Vec<Address>, Failure> {
        if self.port.is_empty() && self.device.is_empty() {
            return Ok(vec![Address::Find]);
        }
        let ports = self.port.iter().map(|port| Ok(Address::parse(port)));
        let named = |device: &String| named::find(device, self.timeout);
        ports.chain(self.device.iter().map(named)).collect()
    }
}

impl Device {
    fn address(&self) -> Result<Address, Failure> {
        match (&self.port, &self.device) {
            (Some(port), _) => Ok(Address::parse(port)),
            (None, Some(device)) => named::find(device, self.timeout),
            (None, None) => Ok(Address::Find),
        }
    }
}

#[derive(Args)]
struct CheckArguments {
    #[command(flatten)]
    device: Device,
    /// How long to measure
    #[arg(long, value_name = "S", default_value = "10", value_parser = seconds)]
    seconds: Duration,
    /// Fewest samples a second, by the device's clock
    #[arg(long, value_name = "HZ")]
    min_rate: Option<f64>,
    /// Most frames without a sample
    #[arg(long, value_name = "N")]
    max_loss: Option<u64>,
    /// One JSON object instead of lines
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
struct ThresholdArguments {
    #[command(subcommand)]
    auto: Option<ThresholdCommand>,
    #[command(flatten)]
    device: Device,
    #[command(flatten)]
    wanted: Option<WantedThreshold>,
    /// Keep it through restarts
    #[arg(long)]
    keep: bool,
    /// One JSON object instead of a line
    #[arg(long)]
    json: bool,
}

#[derive(Subcommand)]
enum ThresholdCommand {
    /// Find the threshold that separates the dots from the film in the device's own pictures, show
    /// why, and set it
    ///
    /// It is half way between film and dots; or the model's, when that separates them, too, since
    /// there are forces only with that. The pixel format stays. Nothing should touch the film.
    ///
    /// Example: hivtac threshold auto --dry-run
    Auto {
        #[command(flatten)]
        device: Device,
        /// Keep it through restarts
        #[arg(long)]
        keep: bool,
        /// Set nothing
        #[arg(long, conflicts_with = "keep")]
        dry_run: bool,
        /// One JSON object instead of lines
        #[arg(long)]
        json: bool,
    },
}

impl ThresholdArguments {
    fn run(self) -> Result<(), Failure> {
        match self.auto {
            Some(ThresholdCommand::Auto {
                device,
                keep,
                dry_run,
                json,
            }) => auto_threshold::run(&auto_threshold::Options {
                address: device.address()?,
                patience: device.timeout,
                keep,
                dry_run,
                json,
            }),
            None => command::threshold(
                &self.device.address()?,
                self.device.timeout,
                self.wanted.and_then(|wanted| wanted.threshold()),
                self.keep,
                self.json,
            ),
        }
    }
}

#[derive(Args)]
#[group(required = true, multiple = false)]
struct WantedThreshold {
    /// RGB565; inclusive bounds in OpenCV's 8-bit HSV: hue 0–179 (h0 > h1 wraps), saturation and
    /// value 0–255
    #[arg(long, value_name = "h0,h1,s0,s1,v0,v1", value_parser = hsv::parse)]
    hsv: Option<HsvBox>,
    /// YUV422; lowest Cr, 0–255
    #[arg(long, value_name = "LOW")]
    cr: Option<u8>,
    /// Mono; inclusive bounds of the luma, 0–255. An MT9V034 sends it, an OV7725 does not
    #[arg(long, value_name = "l0,l1", value_parser = hsv::parse_luma)]
    luma: Option<Mono>,
    /// The one that the device's model was made for
    #[arg(long)]
    model: bool,
}

impl WantedThreshold {
    /// `None` for the model's.
    fn threshold(&self) -> Option<Threshold> {
        let hsv = self.hsv.map(Threshold::Rgb565);
        let cr = self.cr.map(|cr_low| Threshold::Yuv422(Yuv422 { cr_low }));
        hsv.or(cr).or(self.luma.map(Threshold::Mono))
    }
}

#[derive(Args)]
#[group(required = true, multiple = true)]
struct SnapshotFiles {
    /// The frame, as PNG
    #[arg(value_name = "FILE.png")]
    picture: Option<String>,
    /// The frame's bytes as the camera sent them, as PAM with two bytes a pixel
    #[arg(long, value_name = "FILE.pam")]
    raw: Option<String>,
    /// What passes the threshold, white, and what dilation adds, grey, as PNG
    #[arg(long, value_name = "FILE.png")]
    mask: Option<String>,
}

impl SnapshotFiles {
    fn files(self) -> snapshot::Files {
        let SnapshotFiles { picture, raw, mask } = self;
        snapshot::Files { picture, raw, mask }
    }
}

#[derive(Args)]
struct MonitorArguments {
    #[command(flatten)]
    device: Device,
    /// End after N frames
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,
    /// End after S seconds
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<Duration>,
    /// One JSON object a line
    #[arg(long, conflicts_with = "csv")]
    json: bool,
    /// Comma-separated values
    #[arg(long)]
    csv: bool,
    /// Go on after a lost connection, trying twice a second
    #[arg(long)]
    reconnect: bool,
    /// Compare with the log of a simulated sensor: JSON lines with "frame" and the true force
    #[arg(long, value_name = "FILE")]
    truth: Option<String>,
}

#[derive(Args)]
struct ServeArguments {
    #[command(flatten)]
    devices: Devices,
    #[command(flatten)]
    outlets: Outlets,
    /// The node's name in ROS 2
    #[arg(long, value_name = "NODE", default_value = "hivtac", requires = "ros2")]
    name: String,
    /// ROS 2's domain, 0–232; ROS_DOMAIN_ID when not given, else 0
    #[arg(
        long,
        value_name = "ID",
        requires = "ros2",
        value_parser = clap::value_parser!(u16).range(0..=i64::from(serve::LAST_DOMAIN))
    )]
    domain: Option<u16>,
    /// Where Foxglove finds it; port 0 for any that is free. Only this computer can reach
    /// 127.0.0.1, others too 0.0.0.0: whoever reaches it can read everything
    #[arg(
        long,
        value_name = "ADDRESS:PORT",
        default_value = "127.0.0.1:8765",
        requires = "foxglove"
    )]
    listen: SocketAddr,
    /// Where it is as one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
#[group(required = true, multiple = true)]
struct Outlets {
    /// As a node of ROS 2, which needs no ROS to be installed here
    #[arg(long)]
    ros2: bool,
    /// For Foxglove, over its WebSocket
    #[arg(long)]
    foxglove: bool,
}

impl ServeArguments {
    fn options(self) -> Result<serve::Options, Failure> {
        Ok(serve::Options {
            addresses: self.devices.addresses()?,
            patience: self.devices.timeout,
            ros2: self.outlets.ros2,
            foxglove: self.outlets.foxglove,
            name: self.name,
            domain: self.domain,
            listen: self.listen,
            json: self.json,
        })
    }
}

#[derive(Args)]
struct SenseArguments {
    /// Pictures
    #[arg(required = true, value_name = "IMAGE")]
    images: Vec<String>,
    /// Lens and pixels; the model's when not given. Other sizes than the preset's scale its focal
    /// length
    #[arg(long, value_name = "paper|ov7725")]
    preset: Option<Preset>,
    /// Colours of a marker, as in `hivtac threshold --hsv`; the model's when not given
    #[arg(long, value_name = "h0,h1,s0,s1,v0,v1", value_parser = hsv::parse)]
    threshold: Option<HsvBox>,
    /// Smallest blob, px; a quarter of a marker at rest when not given
    #[arg(long, value_name = "PX")]
    min_area: Option<u32>,
    /// Model file; the firmware's own when not given
    #[arg(long, value_name = "FILE")]
    model: Option<String>,
    /// Picture of the untouched film, to measure displacements from
    #[arg(long, value_name = "IMAGE")]
    tare: Option<String>,
    /// One JSON object a line
    #[arg(long)]
    json: bool,
}

impl SenseArguments {
    fn options(self) -> sense::Options {
        sense::Options {
            images: self.images,
            preset: self.preset,
            threshold: self.threshold,
            min_area: self.min_area,
            model: self.model,
            tare: self.tare,
            json: self.json,
        }
    }
}

impl MonitorArguments {
    fn options(self) -> Result<monitor::Options, Failure> {
        let format = match (self.json, self.csv) {
            (true, _) => Format::Json,
            (_, true) => Format::Csv,
            _ => Format::Human,
        };
        Ok(monitor::Options {
            address: self.device.address()?,
            patience: self.device.timeout,
            frames: self.frames,
            duration: self.seconds,
            format,
            reconnect: self.reconnect,
            truth: self.truth,
        })
    }
}

/// A positive number of seconds, up to a year.
fn seconds(text: &str) -> Result<Duration, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds <= 31_536_000.0 => {
            Ok(Duration::from_secs_f64(seconds))
        }
        _ => Err("a positive number of seconds is needed".to_owned()),
    }
}

fn run(command: Command) -> Result<(), Failure> {
    stop::install()?;
    match command {
        Command::Sense(arguments) => sense::run(&arguments.options()),
        Command::Monitor(arguments) => monitor::run(&arguments.options()?),
        Command::Check(arguments) => check::run(&check::Options {
            address: arguments.device.address()?,
            patience: arguments.device.timeout,
            duration: arguments.seconds,
            min_rate_hz: arguments.min_rate,
            max_loss: arguments.max_loss,
            json: arguments.json,
        }),
        Command::Record {
            devices,
            file,
            seconds,
            json,
        } => record::run(&record::Options {
            addresses: devices.addresses()?,
            patience: devices.timeout,
            duration: seconds,
            file,
            json,
        }),
        Command::Replay {
            file,
            device,
            tcp,
            fast,
            json,
        } => replay::run(&replay::Options {
            file,
            device,
            port: tcp,
            fast,
            json,
        }),
        Command::Snapshot {
            device,
            files,
            json,
        } => snapshot::run(&device.address()?, device.timeout, &files.files(), json),
        Command::View {
            port,
            timeout,
            listen,
            recordings,
            json,
        } => view::run(&view::Options {
            addresses: match port.as_slice() {
                [] => vec![Address::Find],
                ports => ports.iter().map(|port| Address::parse(port)).collect(),
            },
            patience: timeout,
            port: listen,
            folder: recordings,
            json,
        }),
        Command::Serve(arguments) => serve::run(&arguments.options()?),
        Command::Template { file, preset, json } => template::run(&file, preset, json),
        Command::BringUp {
            device,
            report,
            json,
        } => bring_up::run(&bring_up::Options {
            address: device.address()?,
            patience: device.timeout,
            report,
            json,
        }),
        Command::List { json, timeout } => list::run(timeout, json),
        Command::Focus { device, json } => focus::run(&device.address()?, device.timeout, json),
        Command::SelfTest { device, json } => health::run(&device.address()?, device.timeout, json),
        Command::Info { device, json } => info::run(&device.address()?, device.timeout, json),
        Command::Tare {
            device,
            frames,
            keep,
            force,
            json,
        } => {
            let tare = command::Tare {
                frames,
                force,
                keep,
                json,
            };
            command::tare(&device.address()?, device.timeout, &tare)
        }
        Command::Expose { device, json } => {
            command::expose(&device.address()?, device.timeout, json)
        }
        Command::Threshold(arguments) => arguments.run(),
        Command::Settings(command) => command.run(),
        Command::Update(command) => command.run(),
        Command::Completion { shell } => help::completion(shell),
        Command::Man { folder } => help::man(&folder),
    }
}

fn main() -> ExitCode {
    let matches = help::command().get_matches();
    let arguments = Arguments::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    match run(arguments.command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            if failure.kind != Kind::Interrupted {
                output::note(&format!("hivtac: {failure}"));
            }
            ExitCode::from(failure.kind.exit_code())
        }
    }
}
