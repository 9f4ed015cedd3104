//! Command-line arguments of `hivtac settings`.

use super::camera::{self, Wanted};
use super::conversation::Conversation;
use super::file;
use super::gravity::down;
use super::name::name;
use super::temporal::{self, RezeroChange, small_thousandths, thousandths, two_thousandths};
use crate::device::{Device, Target};
use clap::Subcommand;
use hivtac_host::contact_shape;
use hivtac_host::failure::Failure;
use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::temporal::{Creep, Filter, Output};
use hivtac_terms::units::{
    Micrometres, Microseconds, MilliPx, Milliseconds, Permille, Sixteenths, SmallPermille,
    UnsignedMicroNewtons,
};
use hivtac_wire::settings::Name;
use temporal::Change;

/// Show, change, save or reset what the device keeps through restarts
#[derive(Subcommand)]
pub enum SettingsCommand {
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
    /// Set and keep a setting
    #[command(subcommand)]
    Set(SetCommand),
    /// Save the settings in use in a file
    ///
    /// Example: hivtac settings export thumb.json
    Export {
        #[command(flatten)]
        target: Target,
        /// The file to make, JSON
        #[arg(value_name = "FILE.json")]
        file: String,
    },
    /// Set and keep the settings of a file
    ///
    /// The rest position only when the file is of the same device.
    ///
    /// Example: hivtac settings import thumb.json
    Import {
        #[command(flatten)]
        target: Target,
        /// A file of `export`
        #[arg(value_name = "FILE.json")]
        file: String,
    },
    /// Forget everything that was kept: no name, the built-in model and its threshold, no tare, the
    /// usual limits
    ///
    /// Example: hivtac settings reset
    Reset {
        #[command(flatten)]
        target: Target,
    },
}

#[derive(Subcommand)]
pub enum SetCommand {
    /// The device's name, by which `--device` selects it
    ///
    /// Example: hivtac settings set name thumb
    Name {
        #[command(flatten)]
        target: Target,
        /// At most 24 bytes of UTF-8
        #[arg(value_name = "NAME", value_parser = name)]
        name: Name,
    },
    /// The forces at which a contact begins and ends
    ///
    /// A contact also begins only with three times the force's standard uncertainty, and ends below
    /// half of that.
    ///
    /// Example: hivtac settings set touch --begins 5 --ends 3
    #[command(group = clap::ArgGroup::new("limit").required(true).multiple(true))]
    Touch {
        #[command(flatten)]
        target: Target,
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
        target: Target,
        /// Distance, µm, 1 to 5000; 60 by default
        #[arg(long, value_name = "UM", group = "limit")]
        distance: Option<u32>,
        /// Longest time for it, ms, 10 to 100; 50 by default
        #[arg(long, value_name = "MS", group = "limit")]
        within: Option<u32>,
        /// Least force along the film over that into it, 0 to 2; 0.1 by default
        #[arg(long, value_name = "RATIO", value_parser = small_thousandths, group = "limit")]
        ratio: Option<u16>,
    },
    /// The filter of forces
    ///
    /// Contact and slip use each frame's own, unfiltered force.
    #[command(subcommand)]
    Filter(FilterCommand),
    /// Whether the rest position follows drift while nothing touches the film
    ///
    /// A force below the contact's that grows no faster than the rate is taken for drift, and
    /// missing in every force from then on: by the total at most. With the usual limits it grows by
    /// less than 2 µN a second, and takes 0.08 mN of small forces and up to 2 mN of 100 mN.
    #[command(subcommand)]
    Rezero(RezeroCommand),
    /// When the board's output pin is high, without a host
    ///
    /// It changes with the frame that shows it, some µs before the sample is sent. PE7 on the WeAct
    /// board, P7 on the OpenMV Cam.
    #[command(subcommand)]
    Output(OutputCommand),
    /// Where gravity pulls on the film
    ///
    /// The film hangs by its own weight: turned over, it looks pressed by some mN. A sensor that
    /// knows how it is held corrects for that, from the next tare on. `none` is for one that is
    /// turned without notice, which the uncertainties then include. `fixed`, the default, is for
    /// one that stays as it was at its tare. x is to the right and y down in the image, z away from
    /// the camera; the length does not matter.
    ///
    /// Example: hivtac settings set down 0 0 -1
    Down {
        #[command(flatten)]
        target: Target,
        /// X Y Z, `none` or `fixed`
        #[arg(value_name = "X Y Z|none|fixed", num_args = 1..=3, required = true,
              allow_negative_numbers = true)]
        down: Vec<String>,
    },
    /// The shape of what presses the film
    ///
    /// How the film moves depends on it. `needle` is a tip like the model's. `round:R` is a soft or
    /// rounded tip and `flat:R` a rigid face, R being the radius of its contact in mm, 0.25 to 4.
    /// `unknown`, the default, is any of these up to 4 mm, which the uncertainties then include. It
    /// holds until the device restarts, with --keep longer.
    ///
    /// Example: hivtac settings set contact flat:2 --keep
    Contact {
        #[command(flatten)]
        target: Target,
        /// The shape: `needle`, `round:R`, `flat:R` or `unknown`
        #[arg(value_name = "needle|round:R_MM|flat:R_MM|unknown",
              value_parser = contact_shape::parse)]
        shape: ContactShape,
        /// Keep it through restarts
        #[arg(long)]
        keep: bool,
    },
    /// How much the film creeps under its loads
    ///
    /// A held load is seen as if it grew by two parts of itself, within half a second and within
    /// 20 s. After a release, the same parts of the load stay in the film. The guide to calibration
    /// says how they are measured. The device subtracts them. Without this setting, or with 0,0,
    /// its uncertainty is that of silicones in general.
    ///
    /// Example: hivtac settings set creep 0.031,0.042
    Creep {
        #[command(flatten)]
        target: Target,
        /// Parts of a force, 0 to 0.15 each
        #[arg(value_name = "A,B", value_parser = two_thousandths)]
        parts: [u8; 2],
    },
    /// How long the camera exposes each row
    ///
    /// If automatic, it is set for the light at the start and by `hivtac expose`, and then fixed. A
    /// lower rate allows a longer one.
    ///
    /// Example: hivtac settings set exposure 2.5
    Exposure {
        #[command(flatten)]
        target: Target,
        /// ms, or `auto`
        #[arg(value_name = "MS", value_parser = camera::exposure)]
        time: Wanted<Microseconds>,
    },
    /// How much the camera amplifies
    ///
    /// If automatic, it is set with the exposure, and above 1 only if that does not suffice.
    ///
    /// Example: hivtac settings set gain 1.5
    Gain {
        #[command(flatten)]
        target: Target,
        /// 1 to 4 in sixteenths, or `auto`
        #[arg(value_name = "GAIN", value_parser = camera::gain)]
        gain: Wanted<Sixteenths>,
    },
    /// How many frames the camera sends a second, and so how many forces come
    ///
    /// An OV7725 sends 156, 78 or 39, an MT9V034 231, 115 or 57. A lower rate leaves more time for
    /// light.
    ///
    /// Example: hivtac settings set rate 78
    Rate {
        #[command(flatten)]
        target: Target,
        /// Frames a second
        #[arg(value_name = "FPS")]
        rate: u16,
    },
}

#[derive(Subcommand)]
pub enum FilterCommand {
    /// Each frame's own force
    ///
    /// Example: hivtac settings set filter none
    None {
        #[command(flatten)]
        target: Target,
    },
    /// A first-order low-pass; a steady change comes its time constant later
    ///
    /// Example: hivtac settings set filter low-pass --ms 20
    LowPass {
        #[command(flatten)]
        target: Target,
        /// Its time constant, ms, 1 to 10000
        #[arg(long, value_name = "MS")]
        ms: u32,
    },
    /// The median of each component in three frames; a steady change comes a frame later
    ///
    /// Example: hivtac settings set filter median-of-three
    MedianOfThree {
        #[command(flatten)]
        target: Target,
    },
}

#[derive(Subcommand)]
pub enum RezeroCommand {
    /// It stays where it was taken
    ///
    /// Example: hivtac settings set rezero off
    Off {
        #[command(flatten)]
        target: Target,
    },
    /// It follows, within limits
    ///
    /// Example: hivtac settings set rezero on
    On {
        #[command(flatten)]
        target: Target,
        /// How long nothing touches before, s, 1 to 3600; 10 by default
        #[arg(long, value_name = "S", value_parser = thousandths)]
        after: Option<u32>,
        /// How far in a second, px, 0.001 to 0.1; 0.005 by default
        #[arg(long, value_name = "PX", value_parser = small_thousandths)]
        rate: Option<u16>,
        /// How far in all, px, 0.001 to 0.25; 0.2 by default
        #[arg(long, value_name = "PX", value_parser = small_thousandths)]
        total: Option<u16>,
    },
}

#[derive(Subcommand)]
pub enum OutputCommand {
    /// The pin stays low
    ///
    /// Example: hivtac settings set output off
    Off {
        #[command(flatten)]
        target: Target,
    },
    /// High while something touches the film
    ///
    /// Example: hivtac settings set output contact
    Contact {
        #[command(flatten)]
        target: Target,
    },
    /// High while the contact slips
    ///
    /// Example: hivtac settings set output slip
    Slip {
        #[command(flatten)]
        target: Target,
    },
    /// High from a force on, until a tenth below
    ///
    /// Example: hivtac settings set output force 200
    Force {
        #[command(flatten)]
        target: Target,
        /// |F|, mN, 0.001 to 1000
        #[arg(value_name = "MN", value_parser = thousandths)]
        limit: u32,
    },
}

impl SettingsCommand {
    /// Runs the command.
    ///
    /// # Errors
    /// When a file has no settings, which is checked before anything is sent; when the device
    /// refuses; those of [`Link::connect`](hivtac_host::link::Link::connect).
    pub fn run(self) -> Result<(), Failure> {
        match self {
            SettingsCommand::Get { device, json } => {
                Conversation::begin(&Target { device, json })?.show()
            }
            SettingsCommand::Set(command) => command.run(),
            SettingsCommand::Export { target, file } => Conversation::begin(&target)?.export(&file),
            SettingsCommand::Import { target, file: path } => {
                let address = target.device.address()?;
                let file = file::read(&path)?;
                Conversation::begin_at(&address, &target)?.import(&path, &file)
            }
            SettingsCommand::Reset { target } => Conversation::begin(&target)?.reset(),
        }
    }
}

impl SetCommand {
    fn run(self) -> Result<(), Failure> {
        let (target, change) = match self {
            SetCommand::Name { target, name } => {
                return Conversation::begin(&target)?.set_name(&name);
            }
            SetCommand::Down {
                target,
                down: words,
            } => {
                let down = down(&words)?;
                return Conversation::begin(&target)?.set_down(down);
            }
            SetCommand::Contact {
                target,
                shape,
                keep,
            } => {
                return Conversation::begin(&target)?.set_contact_shape(shape, keep);
            }
            SetCommand::Exposure { target, time } => {
                return Conversation::begin(&target)?.set_camera(camera::Change::Exposure(time));
            }
            SetCommand::Gain { target, gain } => {
                return Conversation::begin(&target)?.set_camera(camera::Change::Gain(gain));
            }
            SetCommand::Rate { target, rate } => {
                return Conversation::begin(&target)?.set_camera(camera::Change::Rate(rate));
            }
            SetCommand::Touch {
                target,
                begins,
                ends,
            } => {
                let [begins, ends] = [begins, ends].map(|limit| limit.map(UnsignedMicroNewtons));
                (target, Change::Touch { begins, ends })
            }
            SetCommand::Slip {
                target,
                distance,
                within,
                ratio,
            } => {
                let change = Change::Slip {
                    distance: distance.map(Micrometres),
                    within: within.map(Milliseconds),
                    ratio: ratio.map(Permille),
                };
                (target, change)
            }
            SetCommand::Filter(filter) => filter.change(),
            SetCommand::Rezero(rezero) => rezero.change(),
            SetCommand::Creep { target, parts } => {
                let parts = parts.map(SmallPermille);
                (target, Change::Creep(Creep { parts }))
            }
            SetCommand::Output(output) => output.change(),
        };
        Conversation::begin(&target)?.set_temporal(change)
    }
}

impl FilterCommand {
    fn change(self) -> (Target, Change) {
        let (target, filter) = match self {
            FilterCommand::None { target } => (target, Filter::None),
            FilterCommand::LowPass { target, ms } => {
                let time_constant = Milliseconds(ms);
                (target, Filter::LowPass { time_constant })
            }
            FilterCommand::MedianOfThree { target } => (target, Filter::MedianOfThree),
        };
        (target, Change::Filter(filter))
    }
}

impl OutputCommand {
    fn change(self) -> (Target, Change) {
        let (target, output) = match self {
            OutputCommand::Off { target } => (target, Output::Off),
            OutputCommand::Contact { target } => (target, Output::Contact),
            OutputCommand::Slip { target } => (target, Output::Slip),
            OutputCommand::Force { target, limit } => {
                let limit = UnsignedMicroNewtons(limit);
                (target, Output::Force { limit })
            }
        };
        (target, Change::Output(output))
    }
}

impl RezeroCommand {
    fn change(self) -> (Target, Change) {
        match self {
            RezeroCommand::Off { target } => (target, Change::Rezero(None)),
            RezeroCommand::On {
                target,
                after,
                rate,
                total,
            } => {
                let change = RezeroChange {
                    after: after.map(Milliseconds),
                    rate: rate.map(MilliPx),
                    total: total.map(MilliPx),
                };
                (target, Change::Rezero(Some(change)))
            }
        }
    }
}
