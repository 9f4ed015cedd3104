//! Writes an image by a loader, and reads it back.

use super::dfuse::{Loader, Trouble, Usb};
use hivtac_host::failure::{Failure, Kind};
use hivtac_host::stop;
use hivtac_wire::image::{FIRST_LOOK, FIRST_STAGE, Image, Part};

/// Reports progress while an image is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// The device has no first stage, which is written now, before all else.
    FirstStage,
    /// Bytes of the program that were written, of all.
    Written(usize, usize),
    /// All bytes were read back.
    ReadBack,
}

/// Writes the image, reads it back, and starts it.
///
/// Only sectors that the image fills are erased, and the first one only where no first stage of
/// this layout is. Until the last byte is written the first stage finds a wrong checksum, and a
/// device without power starts its loader again.
///
/// # Errors
/// [`Kind::Input`] if the loader's device is another board; [`Kind::Refused`] if it refuses or
/// keeps something else; [`Kind::Lost`] if it is gone; [`Kind::Interrupted`].
pub fn write<Io: Usb>(
    loader: Loader<Io>,
    image: &Image,
    mut tell: impl FnMut(Progress),
) -> Result<(), Failure> {
    let found = loader.read(FIRST_STAGE, FIRST_LOOK);
    let found = found.map_err(|why| broken("reading the first stage".to_owned(), why))?;
    let parts = image
        .parts(&found)
        .map_err(|why| Failure::input(format!("the device in its loader is another one: {why}")))?;
    let is_first_stage = |part: &Part<'_>| part.address == FIRST_STAGE;
    let (first_stage, program): (Vec<_>, Vec<_>) = parts.into_iter().partition(is_first_stage);
    for part in &first_stage {
        tell(Progress::FirstStage);
        fill(&loader, part)?;
        verify(&loader, part)?;
    }
    let mut written = 0;
    for part in &program {
        fill(&loader, part)?;
        written += part.bytes.len();
        tell(Progress::Written(written, image.program().len()));
    }
    for part in &program {
        verify(&loader, part)?;
    }
    tell(Progress::ReadBack);
    let left = loader.leave(FIRST_STAGE);
    left.map_err(|why| broken("starting the program".to_owned(), why))
}

/// Erases a sector, and writes these bytes to its begin.
fn fill<Io: Usb>(loader: &Loader<Io>, part: &Part<'_>) -> Result<(), Failure> {
    let sector = part.address;
    stop::check().map_err(interrupted)?;
    let erased = loader.erase(sector);
    erased.map_err(|why| broken(format!("erasing at {sector:#010x}"), why))?;
    let written = loader.write(sector, part.bytes, || {
        stop::check().map_err(Stopped::Interrupted)
    });
    written.map_err(|stopped| match stopped {
        Stopped::Interrupted(failure) => interrupted(failure),
        Stopped::Broken(why) => broken(format!("writing at {sector:#010x}"), why),
    })
}

/// Why writing stopped.
enum Stopped {
    Interrupted(Failure),
    Broken(Trouble),
}

impl From<Trouble> for Stopped {
    fn from(why: Trouble) -> Stopped {
        Stopped::Broken(why)
    }
}

fn verify<Io: Usb>(loader: &Loader<Io>, part: &Part<'_>) -> Result<(), Failure> {
    let Part { address, bytes } = *part;
    let read = loader.read(address, bytes.len());
    let read = read.map_err(|why| broken(format!("reading back at {address:#010x}"), why))?;
    let differs = read.iter().zip(bytes).position(|(is, should)| is != should);
    match differs {
        None => Ok(()),
        Some(at) => {
            let address = address as usize + at;
            let message = format!(
                "the device kept other bytes than it was sent, the first at {address:#010x}; \
                 {AGAIN}; if that does not help, its flash is worn"
            );
            Err(Failure::new(Kind::Refused, message))
        }
    }
}

/// What to do after a failure in the middle.
const AGAIN: &str = "run the same command again: the device waits in its loader";

fn interrupted(failure: Failure) -> Failure {
    Failure::new(failure.kind, format!("{failure}; {AGAIN}"))
}

fn broken(doing: String, why: Trouble) -> Failure {
    let kind = match why {
        Trouble::Lost(_) | Trouble::Late => Kind::Lost,
        Trouble::Refused(_) => Kind::Refused,
    };
    Failure::new(kind, format!("{doing}: {why}; {AGAIN}"))
}
