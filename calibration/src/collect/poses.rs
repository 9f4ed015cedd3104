//! Which poses to take: typed, or from a list.

use std::io::BufRead;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use hivtac_host::stop;

/// Largest |α| and |β|, degrees: beyond, a press is no press.
const LARGEST_DEG: f64 = 60.0;

/// Reads a list of poses: two columns, α and β in degrees, separated by comma, semicolon, tab or space. Empty lines,
/// lines that begin with `#`, and a first line of names are passed over.
///
/// # Errors
/// When it cannot be read, or a line is no pose; names the line.
pub fn load(path: &Path) -> Result<Vec<[f64; 2]>> {
    let text =
        std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    let mut poses = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let line = line.trim();
        let is_names = poses.is_empty() && !line.contains(|c: char| c.is_ascii_digit());
        if line.is_empty() || line.starts_with('#') || is_names {
            continue;
        }
        poses.push(parse(line).with_context(|| format!("{}, line {}", path.display(), index + 1))?);
    }
    ensure!(!poses.is_empty(), "{} has no pose", path.display());
    Ok(poses)
}

/// α and β, degrees.
///
/// # Errors
/// When the text is not two angles of a press.
pub fn parse(text: &str) -> Result<[f64; 2]> {
    let parts: Vec<f64> = text
        .split([',', ';', '\t', ' '])
        .filter(|part| !part.is_empty())
        .map(|part| part.parse().ok())
        .collect::<Option<_>>()
        .with_context(|| {
            format!("`{text}` is no pose: write α and β in degrees, such as `4, -3`")
        })?;
    match parts[..] {
        [alpha, beta] if alpha.abs() <= LARGEST_DEG && beta.abs() <= LARGEST_DEG => {
            Ok([alpha, beta])
        }
        _ => anyhow::bail!("`{text}` is no pose: write two angles, each within ±{LARGEST_DEG}°"),
    }
}

/// The poses of a list that are left after some were done; one that is listed twice is done twice.
pub fn left(list: &[[f64; 2]], done: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut done = done.to_vec();
    let mut left = Vec::new();
    for pose in list {
        match done.iter().position(|d| d == pose) {
            Some(place) => drop(done.swap_remove(place)),
            None => left.push(*pose),
        }
    }
    left
}

/// What a person says, line by line, without keeping Ctrl-C waiting.
#[derive(Debug)]
pub struct Person(Receiver<String>);

impl Person {
    /// Whoever is at standard input.
    pub fn at_the_terminal() -> Self {
        let (sender, receiver) = channel();
        std::thread::spawn(move || {
            let lines = std::io::stdin().lock().lines();
            for line in lines.map_while(Result::ok) {
                if sender.send(line).is_err() {
                    return;
                }
            }
        });
        Self(receiver)
    }

    /// Asks, and waits for a line; nothing when there will be none any more.
    ///
    /// # Errors
    /// When it was asked to end (Ctrl-C).
    pub fn ask(&self, question: &str) -> Result<Option<String>> {
        eprintln!("{question}");
        loop {
            stop::check()?;
            match self.0.recv_timeout(Duration::from_millis(50)) {
                Ok(line) => return Ok(Some(line.trim().to_owned())),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(None),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_are_read_from_text_and_lists() {
        assert_eq!(parse("4, -3.5").unwrap(), [4.0, -3.5]);
        assert_eq!(parse("0 0").unwrap(), [0.0, 0.0]);
        for text in ["4", "4,3,2", "four,3", "90,0", "NaN,0", ""] {
            assert!(parse(text).is_err(), "{text}");
        }
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("poses.csv");
        std::fs::write(&path, "alpha,beta\n# first\n0,0\n\n8;-4\n").unwrap();
        assert_eq!(load(&path).unwrap(), [[0.0, 0.0], [8.0, -4.0]]);
        std::fs::write(&path, "0,0\n8,x\n").unwrap();
        let error = format!("{:#}", load(&path).unwrap_err());
        assert!(
            error.contains("line 2") && error.contains("`8,x`"),
            "{error}"
        );
        std::fs::write(&path, "alpha,beta\n").unwrap();
        assert!(load(&path).is_err());
    }

    #[test]
    fn what_was_done_is_left_out_once() {
        let list = [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]];
        assert_eq!(left(&list, &[]), list);
        assert_eq!(left(&list, &[[0.0, 0.0]]), [[1.0, 0.0], [0.0, 0.0]]);
        assert_eq!(left(&list, &[[0.0, 0.0], [0.0, 0.0]]), [[1.0, 0.0]]);
        assert_eq!(left(&list, &[[5.0, 0.0]]), list);
    }
}
