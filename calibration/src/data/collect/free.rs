//! Follows a take of presses anywhere: shows its coverage a few times a second.

use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

use hivtac_host::page;
use hivtac_wire::message::Sample;

use super::coverage::{Cell, Coverage, PICTURE_LINES};

/// A complete coverage ends a take early, but not before this time, s.
const LEAST_S: f64 = 60.0;
/// Intervals of the display on a terminal, and of lines elsewhere, the latter in s of the sensor.
const SHOW_EVERY: Duration = Duration::from_millis(200);
const SAY_EVERY_S: f64 = 10.0;
/// The longest time between two frames of a press, s; longer ones are pauses.
const LONGEST_FRAME_S: f64 = 0.1;

/// The state of such a take.
#[derive(Debug)]
pub(super) struct FreeTake {
    coverage: Coverage,
    /// Recorded in earlier runs, s.
    before_s: f64,
    /// The requested length, s.
    length_s: f64,
    first_us: Option<u64>,
    last_us: u64,
    /// Whether the sensor's model gives places.
    gives_places: bool,
    /// The present press: place, mm, and force, N.
    now: Option<([f64; 2], f64)>,
    shown: Instant,
    is_drawn: bool,
    said_s: f64,
}

impl FreeTake {
    /// A take of this length, s, with the time and coverage of earlier runs.
    pub fn new(length_s: f64, before_s: f64, covered: &[([f64; 2], f64)]) -> Self {
        let mut coverage = Coverage::default();
        for (place_mm, force_n) in covered {
            if let Some(cell) = Cell::of(*place_mm, *force_n) {
                coverage.mark(cell);
            }
        }
        Self {
            coverage,
            before_s,
            length_s,
            first_us: None,
            last_us: 0,
            gives_places: false,
            now: None,
            shown: Instant::now(),
            is_drawn: false,
            said_s: 0.0,
        }
    }

    /// Adds a frame; |F| is the gauge's if there is one. Returns the place, mm, and force, N, that
    /// it made covered, if any.
    pub fn sample(&mut self, sample: &Sample, gauge_n: Option<f64>) -> Option<([f64; 2], f64)> {
        self.first_us.get_or_insert(sample.time_us);
        let step_s = sample.time_us.saturating_sub(self.last_us) as f64 / 1e6;
        self.last_us = sample.time_us;
        self.now = sample.force.as_ref().and_then(|force| {
            let place = force.place?;
            let place_mm = [place.x, place.y].map(|part| f64::from(part.0) / 1e3);
            let felt_n = f64::from(force.magnitude.0) / 1e6;
            Some((place_mm, gauge_n.map_or(felt_n, f64::abs)))
        });
        self.gives_places |= self.now.is_some();
        let (place_mm, force_n) = self.now?;
        let cell = Cell::of(place_mm, force_n)?;
        let is_new = self.coverage.press(cell, step_s.min(LONGEST_FRAME_S));
        is_new.then_some((place_mm, force_n))
    }

    fn lasted_s(&self) -> f64 {
        let first_us = self.first_us.unwrap_or(self.last_us);
        (self.last_us - first_us.min(self.last_us)) as f64 / 1e6
    }

    /// The remaining time, s.
    fn left_s(&self) -> f64 {
        (self.length_s - self.before_s - self.lasted_s()).max(0.0)
    }

    /// Whether the take can end: its time is over, or everything is covered.
    pub fn is_over(&self) -> bool {
        let lasted_s = self.before_s + self.lasted_s();
        self.left_s() == 0.0 || lasted_s >= LEAST_S && self.coverage.is_complete()
    }

    /// Shows the coverage: a map on a terminal, a line elsewhere.
    pub fn show(&mut self, sample: &Sample) {
        let mut terminal = std::io::stderr();
        if !terminal.is_terminal() {
            let lasted_s = self.lasted_s();
            if lasted_s - self.said_s >= SAY_EVERY_S {
                self.said_s = lasted_s;
                eprintln!("{}", self.line());
            }
        } else if self.shown.elapsed() >= SHOW_EVERY {
            self.shown = Instant::now();
            let up = match self.is_drawn {
                true => format!("\x1b[{}A", PICTURE_LINES + 2),
                false => String::new(),
            };
            self.is_drawn = true;
            let _ = write!(terminal, "{up}{}", self.block(sample));
        }
    }

    /// The map, the present press, and the advice; each line stands alone on the terminal.
    fn block(&self, sample: &Sample) -> String {
        let picture = self.coverage.picture(self.cell());
        let lines = picture
            .into_iter()
            .chain([self.pressed(sample), self.line()]);
        lines.map(|line| format!("\r{line}\x1b[K\n")).collect()
    }

    /// The same for a page.
    pub fn page_coverage(&self, sample: &Sample) -> page::Coverage {
        page::Coverage {
            maps: self.coverage.maps(self.cell()),
            now: self.pressed(sample),
            line: self.line(),
        }
    }

    /// The final state for a page.
    pub fn final_page_coverage(&self) -> page::Coverage {
        page::Coverage {
            maps: self.coverage.maps(None),
            now: String::new(),
            line: self.end(),
        }
    }

    /// The cell for which the present press counts.
    fn cell(&self) -> Option<Cell> {
        let (place_mm, force_n) = self.now?;
        Cell::of(place_mm, force_n)
    }

    /// The present press, in words.
    fn pressed(&self, sample: &Sample) -> String {
        match self.now {
            Some(([x, y], force_n)) => {
                format!("{:4.0} mN at x {x:+.1}, y {y:+.1} mm", 1e3 * force_n)
            }
            None if sample.found().is_some() => "nothing presses the film".to_owned(),
            None => "NOT all markers are seen".to_owned(),
        }
    }

    /// Coverage and advice on one line.
    fn line(&self) -> String {
        let left_s = self.left_s();
        if !self.gives_places {
            return format!(
                "{left_s:.0} s left; the sensor has given no place yet: the coverage is unknown"
            );
        }
        let [covered, all] = self.coverage.count();
        let advice = self.coverage.advice();
        let advice = advice.unwrap_or_else(|| "all is covered: go on anywhere".to_owned());
        format!("{covered} of {all} covered, {left_s:.0} s left; {advice}")
    }

    /// The final summary.
    pub fn end(&self) -> String {
        if !self.gives_places {
            return "The sensor gave no place: the coverage is unknown. With a model of places \
                    (`hivtac info`) it would be shown."
                .to_owned();
        }
        let [covered, all] = self.coverage.count();
        match self.coverage.missing() {
            Some(missing) => format!("{covered} of {all} places and forces are covered; {missing}"),
            None => format!("All {all} places and forces are covered."),
        }
    }
}

#[cfg(test)]
mod tests {
    use hivtac_terms::force::{ContactList, Force, Place};
    use hivtac_terms::marker::MarkerList;
    use hivtac_terms::status::Status;
    use hivtac_terms::units::{
        MicroNewtons, Micrometres, MilliDegrees, SignedMicrometres, UnsignedMicroNewtons,
        UnsignedMilliDegrees,
    };

    use super::*;

    fn sample(time_s: f64, force_mn: i32, place_um: Option<[i32; 2]>) -> Sample {
        let place = place_um.map(|[x, y]| Place {
            x: SignedMicrometres(x),
            y: SignedMicrometres(y),
            sigma: Micrometres(200),
        });
        let force = Force {
            alpha: MilliDegrees(0),
            beta: MilliDegrees(0),
            magnitude: MicroNewtons(1000 * force_mn),
            cartesian: [0, 0, -1000 * force_mn].map(MicroNewtons),
            direction_sigma: UnsignedMilliDegrees(10_000),
            magnitude_sigma: UnsignedMicroNewtons(20_000),
            place,
            torque: None,
        };
        Sample {
            sequence: 0,
            frame: 0,
            time_us: (time_s * 1e6) as u64,
            status: Status::NOT_CALIBRATED,
            force: Some(force),
            contacts: ContactList::default(),
            markers: MarkerList::default(),
        }
    }

    #[test]
    fn a_take_ends_at_its_time_and_goes_on_with_what_is_left() {
        let mut take = FreeTake::new(180.0, 100.0, &[]);
        for i in 0..=799 {
            take.sample(&sample(0.1 * f64::from(i), 100, Some([0, 0])), None);
            assert!(!take.is_over(), "{i}");
        }
        take.sample(&sample(80.0, 100, Some([0, 0])), None);
        assert!(take.is_over());
        assert!(take.end().contains("1 of 71"), "{}", take.end());
    }

    #[test]
    fn a_take_ends_early_when_all_is_covered() {
        let mut all = Vec::new();
        for place in 0..25 {
            let at = |index: i32| -3.2 + 1.6 * f64::from(index);
            let place_mm = [at(place % 5), at(place / 5)];
            all.extend([0.05, 0.1, 0.2].map(|force_n| (place_mm, force_n)));
        }
        let mut take = FreeTake::new(180.0, 0.0, &all);
        take.sample(&sample(0.0, 0, None), None);
        take.sample(&sample(59.0, 0, None), None);
        assert!(!take.is_over());
        take.sample(&sample(60.0, 0, None), None);
        assert!(take.is_over());
    }

    #[test]
    fn the_gauge_counts_before_the_sensor() {
        let mut take = FreeTake::new(180.0, 0.0, &[]);
        let at = Some([3_200, -3_200]);
        take.sample(&sample(0.0, 100, at), Some(-0.2));
        let covered: Vec<_> = (1..5)
            .filter_map(|i| take.sample(&sample(0.1 * f64::from(i), 100, at), Some(-0.2)))
            .collect();
        assert_eq!(covered, [([3.2, -3.2], 0.2)]);
        assert!(take.block(&sample(0.5, 0, None)).contains("●"));
        let line = take.line();
        assert!(line.contains("0 of 71"), "no corner is needed: {line}");
    }

    #[test]
    fn a_sensor_without_places_says_so() {
        let mut take = FreeTake::new(180.0, 0.0, &[]);
        take.sample(&sample(0.0, 100, None), None);
        assert!(take.line().contains("no place"), "{}", take.line());
        assert!(take.end().contains("gave no place"), "{}", take.end());
    }
}
