//! The poses of a recording: typed by a person, or from a list.

use std::fmt;
use std::io::BufRead;
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use hivtac_host::stop;

/// Largest |α| and |β| of a press, degrees.
const LARGEST_DEG: f64 = 60.0;

/// The greatest distance of a stage's tip from the film's middle along x and y, mm.
const LARGEST_MM: f64 = hivtac_twin::film::MAX_PLACE_MM;

/// The direction and place of the tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// α and β, degrees.
    pub angles_deg: [f64; 2],
    /// The stage's place of the tip, from the film's middle along x and y, mm; `None` for presses
    /// anywhere, whose places are not recorded.
    pub place_mm: Option<[f64; 2]>,
}

impl Pose {
    /// Straight down on the film's middle.
    pub const MIDDLE: Pose = Pose {
        angles_deg: [0.0; 2],
        place_mm: Some([0.0; 2]),
    };

    /// Anywhere on the film, roughly along this axis.
    pub fn anywhere(angles_deg: [f64; 2]) -> Pose {
        Pose {
            angles_deg,
            place_mm: None,
        }
    }

    /// Whether the tip may be anywhere.
    pub fn is_free(&self) -> bool {
        self.place_mm.is_none()
    }
}

impl fmt::Display for Pose {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [alpha, beta] = self.angles_deg;
        write!(f, "α = {alpha}°, β = {beta}°, the tip ")?;
        match self.place_mm {
            Some([x, y]) => write!(f, "at x = {x} mm, y = {y} mm"),
            None => write!(f, "anywhere"),
        }
    }
}

/// Reads a list of poses: α and β in degrees, then x and y of the tip in mm if it is not in the
/// middle. Separators are comma, semicolon, tab or space. Empty lines, lines that begin with `#`,
/// and a first line of names are skipped.
///
/// # Errors
/// When it cannot be read, or a line is not a pose; names the line.
pub fn load(path: &Path) -> Result<Vec<Pose>> {
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

/// Parses α and β, degrees, and optionally x and y, mm.
///
/// # Errors
/// When the text is not two or four such numbers within the limits of a press.
pub fn parse(text: &str) -> Result<Pose> {
    const WRITE: &str = "write α and β in degrees, such as `4, -3`, and where the tip is not in \
                         the middle x and y in mm, such as `4, -3, 2.5, 0`";
    let parts: Option<Vec<f64>> = text
        .split([',', ';', '\t', ' '])
        .filter(|part| !part.is_empty())
        .map(|part| part.parse().ok())
        .collect();
    let (angles_deg, place_mm) = match parts.as_deref() {
        Some(&[alpha, beta]) => ([alpha, beta], [0.0; 2]),
        Some(&[alpha, beta, x, y]) => ([alpha, beta], [x, y]),
        _ => bail!("`{text}` is no pose: {WRITE}"),
    };
    let within = |parts: [f64; 2], largest: f64| parts.iter().all(|part| part.abs() <= largest);
    ensure!(
        within(angles_deg, LARGEST_DEG) && within(place_mm, LARGEST_MM),
        "`{text}` is no pose: angles are within ±{LARGEST_DEG}°, places within ±{LARGEST_MM} mm"
    );
    Ok(Pose {
        angles_deg,
        place_mm: Some(place_mm),
    })
}

/// Parses α and β, degrees, of a tip that may be anywhere.
///
/// # Errors
/// When the text is not two such numbers within the limits of a press.
pub fn parse_axis(text: &str) -> Result<Pose> {
    let pose = parse(text)?;
    let numbers = text.split([',', ';', '\t', ' ']);
    let numbers = numbers.filter(|part| !part.is_empty()).count();
    ensure!(
        numbers == 2,
        "`{text}` is no axis: write α and β in degrees, such as `4,-3`"
    );
    Ok(Pose::anywhere(pose.angles_deg))
}

/// A pose, and how to press in it, as a person is asked for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// The pose.
    pub pose: Pose,
    /// Instruction for setting it; Enter continues.
    pub set: String,
    /// Instruction for pressing, while it is recorded.
    pub press: String,
    /// Length of the take, s of the sensor's clock.
    pub seconds: f64,
    /// Whether a take without a force from the sensor is repeated.
    pub must_be_felt: bool,
}

impl Task {
    /// A pose in which forces rise and fall for this many seconds.
    pub fn any_force(pose: Pose, seconds: f64) -> Task {
        Task {
            pose,
            set: format!("Set {pose}, and press Enter (`done` to end)."),
            press: "press and release, in no even rhythm".to_owned(),
            seconds,
            must_be_felt: false,
        }
    }

    /// Presses anywhere, roughly along the pose's axis, for this many seconds.
    pub fn anywhere(pose: Pose, seconds: f64) -> Task {
        let axis = match pose.angles_deg {
            [0.0, 0.0] => "about straight down".to_owned(),
            [alpha, beta] => format!("about along α = {alpha}°, β = {beta}°"),
        };
        Task {
            pose,
            set: format!(
                "Press the film anywhere within 4 mm of its middle, {axis}, lightly and hard, up \
                 to 0.25 N, for {seconds} s. What is covered is shown as the camera sees the \
                 film, ○ is where you press. Press Enter to begin (`done` to end)."
            ),
            press: "touch, hold it for a moment, let go, and touch elsewhere".to_owned(),
            seconds,
            must_be_felt: false,
        }
    }
}

/// The list without the poses that were done; a pose that is listed twice is done twice.
pub fn left<T: Clone>(list: &[T], done: &[Pose], pose: impl Fn(&T) -> Pose) -> Vec<T> {
    let mut done = done.to_vec();
    let mut left = Vec::new();
    for it in list {
        match done.iter().position(|d| *d == pose(it)) {
            Some(place) => drop(done.swap_remove(place)),
            None => left.push(it.clone()),
        }
    }
    left
}

/// A person's input, line by line; Ctrl-C works while waiting.
#[derive(Debug)]
pub struct Person(Receiver<String>);

impl Person {
    /// The person at standard input.
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

    /// Asks, and waits for a line; `None` at the end of input.
    ///
    /// # Errors
    /// When the program was asked to end (Ctrl-C).
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

    fn pose(parts: [f64; 4]) -> Pose {
        let [alpha, beta, x, y] = parts;
        Pose {
            angles_deg: [alpha, beta],
            place_mm: Some([x, y]),
        }
    }

    #[test]
    fn poses_are_read_from_text_and_lists() {
        assert_eq!(parse("4, -3.5").unwrap(), pose([4.0, -3.5, 0.0, 0.0]));
        assert_eq!(parse("0 0").unwrap(), Pose::MIDDLE);
        assert_eq!(parse_axis("4,-3").unwrap(), Pose::anywhere([4.0, -3.0]));
        assert!(parse_axis("4,-3,0,0").is_err() && parse_axis("4").is_err());
        assert_eq!(parse("0 0 3 -0.5").unwrap(), pose([0.0, 0.0, 3.0, -0.5]));
        for text in [
            "4",
            "4,3,2",
            "four,3",
            "90,0",
            "NaN,0",
            "",
            "0,0,9,0",
            "1,2,3,4,5",
        ] {
            assert!(parse(text).is_err(), "{text}");
        }
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("poses.csv");
        std::fs::write(&path, "alpha,beta\n# first\n0,0\n\n8;-4;1;2\n").unwrap();
        assert_eq!(
            load(&path).unwrap(),
            [Pose::MIDDLE, pose([8.0, -4.0, 1.0, 2.0])]
        );
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
        let [rest, other] = [Pose::MIDDLE, pose([1.0, 0.0, 0.0, 0.0])];
        let list = [rest, other, rest];
        let left = |done: &[Pose]| left(&list, done, |pose| *pose);
        assert_eq!(left(&[]), list);
        assert_eq!(left(&[rest]), [other, rest]);
        assert_eq!(left(&[rest, rest]), [other]);
        assert_eq!(left(&[pose([0.0, 0.0, 1.0, 0.0])]), list);
    }
}
