//! Writes whole lines to standard output and standard error.
//!
//! A closed pipe ends the output without a crash, and a stalled reader does not keep the program
//! from ending. Each stream has its own thread, which writes one text at a time. The caller waits
//! for it, but at most [`GRACE`] after the program was interrupted or its [`limit`] has passed.

use hivtac_host::failure::Failure;
use hivtac_host::shown::to_json;
use hivtac_host::stop;
use serde::Serialize;
use serde_json::Value;
use std::fs::File;
use std::io::{self, ErrorKind, Seek, SeekFrom, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The state of the output's reader after a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reader {
    /// The text was written.
    There,
    /// The pipe is closed.
    Gone,
    /// The program must end, and the text has not been read yet.
    Stalled,
}

/// Longest time for a text once the program must end.
const GRACE: Duration = Duration::from_millis(50);
/// Time between two checks whether the program must end.
const LOOK_EVERY: Duration = Duration::from_millis(10);

static OUTPUT: LazyLock<Mutex<Stream>> = LazyLock::new(|| Mutex::new(Stream::new(Target::Output)));
static NOTES: LazyLock<Mutex<Stream>> = LazyLock::new(|| Mutex::new(Stream::new(Target::Notes)));
static END: Mutex<Option<Instant>> = Mutex::new(None);

/// Sets the time after which no text waits for a reader.
pub fn limit(end: Instant) {
    *lock(&END) = Some(end);
}

/// Writes a line to standard output.
pub fn print(line: &str) -> Result<Reader, Failure> {
    lock(&OUTPUT).write(format!("{line}\n")).or_else(|error| {
        if error.kind() == ErrorKind::BrokenPipe {
            return Ok(Reader::Gone);
        }
        let message = format!("cannot write to standard output: {error}");
        Err(Failure::input(message))
    })
}

/// Prints a report: one JSON object, or a text for a person.
pub fn report(
    json: bool,
    object: &impl Serialize,
    text: impl FnOnce() -> String,
) -> Result<Reader, Failure> {
    match json {
        true => print(&to_json(object)),
        false => print(&text()),
    }
}

/// Prints the result of a command: a line for a person, or one JSON object.
pub fn tell(json: bool, line: &str, object: &Value) -> Result<(), Failure> {
    match json {
        true => print(&object.to_string()),
        false => print(line),
    }
    .map(|_| ())
}

/// Writes a line for a person to standard error; errors are ignored.
pub fn note(line: &str) {
    let _ = lock(&NOTES).write(format!("{line}\n"));
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Whether the program must end.
fn is_over() -> bool {
    stop::requested() || lock(&END).is_some_and(|end| Instant::now() >= end)
}

/// The stream that a text goes to.
#[derive(Clone, Copy)]
enum Target {
    Output,
    Notes,
}

/// A thread that writes texts and reports each result.
struct Stream {
    texts: SyncSender<String>,
    done: Receiver<io::Result<()>>,
    /// A text was handed over, and its result has not come yet.
    under_way: bool,
}

impl Stream {
    fn new(target: Target) -> Stream {
        let (texts, to_write) = sync_channel::<String>(0);
        let (written, done) = sync_channel(1);
        std::thread::spawn(move || {
            for text in to_write {
                if written.send(target.write(&text)).is_err() {
                    return;
                }
            }
        });
        Stream {
            texts,
            done,
            under_way: false,
        }
    }

    fn write(&mut self, text: String) -> io::Result<Reader> {
        if self.under_way && self.wait()? == Reader::Stalled {
            return Ok(Reader::Stalled);
        }
        let gone = || io::Error::other("its thread has ended");
        self.texts.send(text).map_err(|_| gone())?;
        self.under_way = true;
        self.wait()
    }

    fn wait(&mut self) -> io::Result<Reader> {
        let patience = Instant::now() + GRACE;
        loop {
            match self.done.recv_timeout(LOOK_EVERY) {
                Ok(result) => {
                    self.under_way = false;
                    return result.map(|()| Reader::There);
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(io::Error::other("its thread has ended"));
                }
                Err(RecvTimeoutError::Timeout) if Instant::now() >= patience && is_over() => {
                    return Ok(Reader::Stalled);
                }
                Err(RecvTimeoutError::Timeout) => (),
            }
        }
    }
}

impl Target {
    fn write(self, text: &str) -> io::Result<()> {
        match self {
            Target::Output => match regular_output() {
                Some(mut file) => write_whole(&mut file, text.as_bytes()),
                None => {
                    let mut output = io::stdout().lock();
                    output.write_all(text.as_bytes())?;
                    output.flush()
                }
            },
            Target::Notes => io::stderr().write_all(text.as_bytes()),
        }
    }
}

/// Standard output if it is a regular file, else `None`.
fn regular_output() -> Option<File> {
    #[cfg(unix)]
    let owned = std::os::fd::AsFd::as_fd(&io::stdout()).try_clone_to_owned();
    #[cfg(windows)]
    let owned = std::os::windows::io::AsHandle::as_handle(&io::stdout()).try_clone_to_owned();
    let file = File::from(owned.ok()?);
    file.metadata().ok()?.is_file().then_some(file)
}

/// Writes all of a text to a file or, on an error, none: a full disk would keep its beginning.
pub fn write_whole(file: &mut File, text: &[u8]) -> io::Result<()> {
    let mut written = 0;
    while written < text.len() {
        match file.write(&text[written..]) {
            Ok(0) => return take_back(file, written, ErrorKind::WriteZero.into()),
            Ok(count) => written += count,
            Err(error) if error.kind() == ErrorKind::Interrupted => (),
            Err(error) => return take_back(file, written, error),
        }
    }
    Ok(())
}

/// Removes the last `count` bytes of a file unless another program has appended to it; returns
/// `error`.
fn take_back(file: &mut File, count: usize, error: io::Error) -> io::Result<()> {
    let end = file.stream_position()?;
    if count > 0 && file.metadata()?.len() == end {
        let whole = end - count as u64;
        file.set_len(whole)?;
        file.seek(SeekFrom::Start(whole))?;
    }
    Err(error)
}
