//! A scripted host: its actions and their times, in virtual time. With a script, a run gives the
//! same bytes every time.
//!
//! One action per line, `MS ACTION`, times in milliseconds (fractions allowed) in any order:
//!
//! ```text
//! # a comment
//! 0     open               the program opens the port (sets DTR)
//! 250   send 00 02 1a 00   bytes for the device, hexadecimal
//! 400   stop-reading
//! 600   read
//! 800   unplug
//! 900   plug
//! 950   request 82 00 00 00 0f 00 02 00   a control transfer, by its SETUP; written data are zeros
//! 960   cancel           the control transfer under way is given up, wherever it is
//! 1000  reset            the host resets the bus and enumerates the device again
//! 1200  close
//! 1500  button           the board's reset button is pressed
//! 1800  power-cycle      the power is cut for a moment
//! ```

use std::path::Path;

use anyhow::{Context, bail};

use crate::usb_host::Host;

/// An action of a scripted host.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Action {
    /// Open the port.
    Open,
    /// Close the port.
    Close,
    /// Send bytes.
    Send(Vec<u8>),
    /// Read the device's bytes.
    Read,
    /// Do not read the device's bytes.
    StopReading,
    /// Plug the cable in.
    Plug,
    /// Pull the cable.
    Unplug,
    /// Reset the bus.
    Reset,
    /// Give the control transfer under way up.
    Cancel,
    /// A control transfer, by its SETUP packet.
    Request([u8; 8]),
    /// Do something to the board.
    Restart(Restart),
}

/// A restart of the microcontroller from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Restart {
    /// The reset line is pulled, by the board's button or its supply's supervisor.
    Button,
    /// The power is cut for a moment. Memory holds nothing afterwards.
    PowerCycle,
}

/// Actions in the order of their times.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Script(Vec<(u64, Action)>);

impl Script {
    /// Returns a script of (virtual time in ns, action).
    pub fn new(mut actions: Vec<(u64, Action)>) -> Self {
        actions.sort_by_key(|(at, _)| *at);
        Self(actions)
    }

    /// Reads a script file.
    ///
    /// # Errors
    /// If it cannot be read, or a line is invalid.
    pub fn load(path: &Path) -> anyhow::Result<Self> {
        let text =
            std::fs::read_to_string(path).with_context(|| format!("script {}", path.display()))?;
        Self::parse(&text).with_context(|| format!("script {}", path.display()))
    }

    /// Reads a script from its text.
    ///
    /// # Errors
    /// If a line is invalid.
    pub fn parse(text: &str) -> anyhow::Result<Self> {
        let lines = text
            .lines()
            .enumerate()
            .map(|(number, line)| (number + 1, line.split('#').next().unwrap_or("").trim()));
        let actions = lines
            .filter(|(_, line)| !line.is_empty())
            .map(|(number, line)| action(line).with_context(|| format!("line {number}: `{line}`")));
        Ok(Self::new(actions.collect::<anyhow::Result<_>>()?))
    }

    /// Returns the time of the next action, ns; `None` if no action is left.
    pub fn next_at(&self) -> Option<u64> {
        self.0.first().map(|(at, _)| *at)
    }

    /// Carries out the actions that are due; returns the last restart among them, which is left to
    /// the caller.
    pub fn run(&mut self, now_ns: u64, host: &mut Host) -> Option<Restart> {
        let mut wanted = None;
        let due = self.0.iter().take_while(|(at, _)| *at <= now_ns).count();
        for (_, action) in self.0.drain(..due) {
            match action {
                Action::Open => host.set_open(true),
                Action::Close => host.set_open(false),
                Action::Send(bytes) => host.to_device.extend(bytes),
                Action::Read => host.set_reading(true),
                Action::StopReading => host.set_reading(false),
                Action::Plug => host.set_cable(true),
                Action::Unplug => host.set_cable(false),
                Action::Reset => host.reset(),
                Action::Cancel => host.cancel(),
                Action::Request(setup) => host.request(setup),
                Action::Restart(restart) => wanted = Some(restart),
            }
        }
        wanted
    }
}

fn action(line: &str) -> anyhow::Result<(u64, Action)> {
    let (time, rest) = line
        .split_once(char::is_whitespace)
        .context("write MS ACTION")?;
    let ms: f64 = time
        .parse()
        .ok()
        .filter(|ms| (0.0..1e9).contains(ms))
        .context("the time is no number of milliseconds")?;
    let (word, argument) = rest
        .trim()
        .split_once(char::is_whitespace)
        .unwrap_or((rest.trim(), ""));
    let action = match word {
        "open" => Action::Open,
        "close" => Action::Close,
        "send" => Action::Send(hexadecimal(argument)?),
        "read" => Action::Read,
        "stop-reading" => Action::StopReading,
        "plug" => Action::Plug,
        "unplug" => Action::Unplug,
        "reset" => Action::Reset,
        "cancel" => Action::Cancel,
        "request" => {
            let bytes = hexadecimal(argument)?;
            Action::Request(bytes.try_into().ok().context("a SETUP has eight bytes")?)
        }
        "button" => Action::Restart(Restart::Button),
        "power-cycle" => Action::Restart(Restart::PowerCycle),
        _ => bail!(
            "no action is called `{word}`: use open, close, send, read, stop-reading, plug, \
             unplug, reset, cancel, request, button, power-cycle"
        ),
    };
    if !argument.is_empty() && word != "send" && word != "request" {
        bail!("`{word}` takes no argument");
    }
    Ok(((ms * 1e6) as u64, action))
}

fn hexadecimal(text: &str) -> anyhow::Result<Vec<u8>> {
    let digits: Vec<char> = text.chars().filter(|c| !c.is_whitespace()).collect();
    if digits.is_empty() || !digits.len().is_multiple_of(2) {
        bail!("write bytes as pairs of hexadecimal digits");
    }
    let byte = |pair: &[char]| {
        let text: String = pair.iter().collect();
        u8::from_str_radix(&text, 16).with_context(|| format!("`{text}` is no hexadecimal byte"))
    };
    digits.chunks(2).map(byte).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_sorted_by_time_and_comments_ignored() {
        let script =
            Script::parse("20 close\n# nothing\n 0.5 open # now\n10 send 01 fF\n").unwrap();
        let expected = [
            (500_000, Action::Open),
            (10_000_000, Action::Send(vec![1, 255])),
            (20_000_000, Action::Close),
        ];
        assert_eq!(script, Script(expected.to_vec()));
    }

    #[test]
    fn nonsense_is_named_with_its_line() {
        for (text, word) in [
            ("open", "MS"),
            ("\nx open", "line 2"),
            ("1 jump", "jump"),
            ("1 send 1", "pairs"),
            ("1 send zz", "zz"),
            ("1 open now", "argument"),
            ("1 request 80 06", "eight"),
        ] {
            let error = format!("{:#}", Script::parse(text).unwrap_err());
            assert!(error.contains(word), "{text}: {error}");
        }
    }
}
