//! `hivtac focus`: checks picture after picture, until everything about them is right.

use crate::device::Device;
use crate::output::{self, Reader};
use crate::snapshot::snapshot;
use clap::Args;
use hivtac_host::failure::Failure;
use hivtac_host::focus::Focus;

/// Show how sharp, bright and well placed the markers are, until all is right
///
/// For each picture: the widths of each marker and its rim, its colour and brightness, and the
/// pattern's place and turn, each with its limit. Ends when everything is right.
///
/// Example: hivtac focus
#[derive(Args)]
pub struct FocusArguments {
    #[command(flatten)]
    device: Device,
    /// One JSON object a picture
    #[arg(long)]
    json: bool,
}

/// Shows the checks of each picture, until all are right or the program is interrupted.
pub fn run(arguments: &FocusArguments) -> Result<(), Failure> {
    let (mut link, hello) = arguments.device.connect()?;
    loop {
        let taken = snapshot(&mut link, arguments.device.timeout)?;
        let focus = Focus::of(&taken.frame, &hello)?;
        let reader = output::report(arguments.json, &focus, || focus.text())?;
        if reader == Reader::Gone || focus.right {
            return Ok(());
        }
    }
}
