//! Frames that are not perfect: how many keep their force, and whether any is wrong without a word.

use std::path::PathBuf;

use anyhow::{Result, anyhow};
use clap::Args;
use hivtac_calibration::evaluation::bounds::{DIRECTION_BOUND, MAGNITUDE_BOUND, PLACE_BOUND};
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::Force;
use hivtac_sensor::force::model::Model;
use hivtac_terms::status::Status;
use hivtac_twin::{Format, Load, MARKERS, Options, Paint, Patch, Salt, Specks};
use rayon::prelude::*;
use serde::Serialize;

use crate::anywhere::WEIGHTS;
use crate::page;
use crate::press::{Answer, Off, REACH_MM, TestedUnit, press_of_any};

/// The least |F|, N: what counts as a contact.
const LEAST_N: f64 = 0.002;
/// The largest, N.
const MOST_N: f64 = 0.2;
/// A marker that is farther off without a word is silently wrong, px.
const WRONG_PX: f64 = 0.3;
/// So is a force that is off by more than so many of its stated standard uncertainties, when that
/// is more than a hand feels: of the direction, degrees, of |F|, mN, and of the place, µm.
const WRONG_SIGMAS: f64 = 3.0;
const NO_FAULT: [f64; 3] = [5.0, 5.0, 250.0];
/// Frames that one sensor sees.
const CHUNK: u32 = 400;
/// Frames of each before they count: 0.2 s at 156 frames a second, in which the sensor comes to
/// know how noisy they are.
const UNCOUNTED: u32 = 32;
/// Frames on the way from one press to the next.
const ON_THE_WAY: u32 = 16;
/// The first press: no limit was chosen by it or those after it.
const FIRST: u32 = 50_000;
/// Scenes of a case in which something lies at a random place.
const VARIANTS: u32 = 24;

/// Show the sensor frames that are not perfect, one disturbance at a time.
#[derive(Args)]
pub struct Refused {
    /// A weights file of a network that tells places, with its film.
    #[arg(long, default_value = WEIGHTS)]
    weights: PathBuf,
    /// Frames of each case.
    #[arg(long, default_value_t = 10_000)]
    frames: u32,
    /// Only the cases whose names contain this.
    #[arg(long, default_value = "")]
    only: String,
    /// Print one JSON object and write no page.
    #[arg(long)]
    json: bool,
}

/// What disturbs frames.
struct Case {
    name: &'static str,
    /// Whether its frames are good enough for a force.
    is_good: bool,
    /// Of one of [`VARIANTS`] scenes.
    options: fn(u32) -> Options,
}

/// What became of the frames of a case.
#[derive(Default, Serialize)]
struct Row {
    case: String,
    is_good: bool,
    frames: u32,
    /// With a force by the first look, and by the second.
    looks: [Kept; 2],
    /// The rest, by what refused them.
    refused: std::collections::BTreeMap<&'static str, u32>,
}

/// Frames with a force.
#[derive(Default, Serialize)]
struct Kept {
    frames: u32,
    /// With a marker more than 0.3 px off.
    wrong_px: u32,
    /// With a force off by more than three stated standard uncertainties.
    beyond_three_sigmas: u32,
    /// Of these, by more than a hand feels.
    wrong_force: u32,
    /// The largest distance of a marker from its place, px.
    worst_px: f64,
    /// Of coordinates of markers, px, summed.
    squares: f64,
    /// The largest error in stated standard uncertainties: of direction, |F| and place.
    worst_sigmas: [f64; 3],
}

/// What presses in a frame of a way from press to press.
fn on_the_way(frame: u32) -> Result<Load> {
    let press = FIRST + frame / ON_THE_WAY;
    let [from, to] = [press, press + 1].map(|k| press_of_any(k, [LEAST_N, MOST_N], REACH_MM));
    let (from, to) = (from?, to?);
    let part = f64::from(frame % ON_THE_WAY) / f64::from(ON_THE_WAY);
    let between = |from: f64, to: f64| from + part * (to - from);
    let vector_n = std::array::from_fn(|k| between(from.vector_n()[k], to.vector_n()[k]));
    let offset_mm = std::array::from_fn(|k| between(from.offset_mm()[k], to.offset_mm()[k]));
    Ok(Load::from_vector(vector_n)?.with_offset_mm(offset_mm)?)
}

/// Something round at a place around a marker's middle: which marker and which way is the
/// variant's.
fn patch_at(variant: u32, far_mm: f64, radius_mm: f64, paint: Paint) -> Options {
    let [x, y] = MARKERS[variant as usize % 4].centre_mm;
    let (sin, cos) = (f64::from(variant) * 2.399_963).sin_cos();
    Options {
        patches: vec![Patch {
            centre_mm: [x + far_mm * cos, y + far_mm * sin],
            radius_mm,
            paint,
        }],
        ..Options::default()
    }
}

fn salt(fraction: f64) -> Options {
    let paint = Paint::Red;
    Options {
        salt: Salt { fraction, paint },
        ..Options::default()
    }
}

fn gain(gain: f64) -> Options {
    Options {
        gain,
        ..Options::default()
    }
}

/// One of which the force is wanted.
const fn good(name: &'static str, options: fn(u32) -> Options) -> Case {
    Case {
        name,
        is_good: true,
        options,
    }
}

/// One that shall be refused.
const fn bad(name: &'static str, options: fn(u32) -> Options) -> Case {
    Case {
        name,
        is_good: false,
        options,
    }
}

const CASES: [Case; 17] = [
    good("nothing", |_| Options::default()),
    good("0.1 % red salt", |_| salt(0.001)),
    good("1 % red salt", |_| salt(0.01)),
    good("glare of 0.1 mm on a rim", |variant| {
        patch_at(variant, 0.45, 0.1, Paint::Glare)
    }),
    good("2,000 red specks of 0.05 mm", |_| Options {
        specks: Specks {
            count: 2000,
            radius_mm: 0.05,
        },
        ..Options::default()
    }),
    good("light × 0.28", |_| gain(0.28)),
    good("light × 0.2", |_| gain(0.2)),
    good("noise × 4", |_| Options {
        noise: 4.0 * Options::default().noise,
        ..Options::default()
    }),
    good("JPEG of quality 85", |_| Options {
        format: Format::Jpeg { quality: 85 },
        ..Options::default()
    }),
    good("2 % red salt", |_| salt(0.02)),
    good("5 % red salt", |_| salt(0.05)),
    good("light × 0.15", |_| gain(0.15)),
    good("light × 0.1", |_| gain(0.1)),
    good("glare of 0.1 mm on a marker", |variant| {
        patch_at(variant, 0.05, 0.1, Paint::Glare)
    }),
    bad("glare of 0.25 mm on a rim", |variant| {
        patch_at(variant, 0.4, 0.25, Paint::Glare)
    }),
    bad("a red disc half over a marker", |variant| {
        patch_at(variant, 0.5, 0.5, Paint::Red)
    }),
    bad(
        "a red disc of a quarter of a marker's size on its rim",
        |variant| patch_at(variant, 0.5, 0.25, Paint::Red),
    ),
];

impl Refused {
    /// Runs it.
    ///
    /// # Errors
    /// When a file cannot be read or written, or a press cannot be made.
    pub fn run(&self) -> Result<()> {
        let bytes = export(&Weights::load(&self.weights)?)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let cases = CASES.iter().filter(|case| case.name.contains(&self.only));
        let rows: Vec<Row> = cases
            .map(|case| self.case(&model, case))
            .collect::<Result<_>>()?;
        if self.json {
            return page::print_rows(&rows);
        }
        let mut text = String::from(
            "| frames with | kept | by the second look | marker, rms and worst: first look | \
             second | farther than 0.3 px: first | second | beyond 3 σ (worst of direction, \
             \\|F\\|, place): first | second | wrong force: first | second | refused by \
             |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|---|\n",
        );
        text.extend(rows.iter().map(Row::line));
        print!("{text}");
        page::write("refused.md", include_str!("refused.md"), &text)
    }

    fn case(&self, model: &Model<'_>, case: &Case) -> Result<Row> {
        let nominal = TestedUnit::new(&model.conditions, Options::default(), 0.5, 1)?;
        let chunks = (0..self.frames.div_ceil(CHUNK)).into_par_iter();
        let rows = chunks.map(|chunk| {
            let to = (CHUNK * (chunk + 1)).min(self.frames);
            let options = (case.options)(chunk % VARIANTS);
            // Noise, salt and specks are another seed's.
            let seed = u64::from(FIRST + chunk);
            let unit = TestedUnit::new(&model.conditions, options, 0.5, seed)?;
            let mut tared = nominal.tare(model)?;
            let mut row = Row::default();
            let from = CHUNK * chunk;
            let begins = (CHUNK + UNCOUNTED) * chunk;
            for number in begins..begins + UNCOUNTED + to - from {
                let load = on_the_way(number)?;
                if !unit.shows_all(&load)? {
                    continue;
                }
                let answer = tared.answer_next(&unit, load, number.into())?;
                if number >= begins + UNCOUNTED {
                    row.take(&answer)?;
                }
            }
            Ok(row)
        });
        let rows: Vec<Row> = rows.collect::<Result<_>>()?;
        let first = Row {
            case: case.name.to_owned(),
            is_good: case.is_good,
            ..Row::default()
        };
        Ok(rows.into_iter().fold(first, Row::and))
    }
}

impl Row {
    fn take(&mut self, answer: &Answer) -> Result<()> {
        self.frames += 1;
        let Some(force) = &answer.force else {
            for name in answer.refusals() {
                *self.refused.entry(name).or_default() += 1;
            }
            return Ok(());
        };
        let look = usize::from(answer.status.contains(Status::FRAME_DISTURBED));
        self.looks[look].take(answer, force)
    }

    fn and(mut self, other: Row) -> Row {
        self.frames += other.frames;
        for (kept, other) in self.looks.iter_mut().zip(&other.looks) {
            kept.add(other);
        }
        for (name, count) in other.refused {
            *self.refused.entry(name).or_default() += count;
        }
        self
    }

    fn line(&self) -> String {
        let percent = |part: u32| 100.0 * f64::from(part) / f64::from(self.frames);
        let refused: Vec<String> = self
            .refused
            .iter()
            .map(|(name, count)| format!("`{name}` {:.1} %", percent(*count)))
            .collect();
        let [first, second] = &self.looks;
        let kept = format!(
            "| {} | {:.2} % of {} | {:.1} % ",
            self.case,
            percent(first.frames + second.frames),
            self.frames,
            percent(second.frames)
        );
        let both = |cell: fn(&Kept) -> String| format!("| {} | {} ", cell(first), cell(second));
        [
            kept,
            both(Kept::px),
            both(|kept| kept.wrong_px.to_string()),
            both(Kept::sigmas),
            both(|kept| kept.wrong_force.to_string()),
            format!("| {} |\n", refused.join(", ")),
        ]
        .concat()
    }
}

impl Kept {
    fn take(&mut self, answer: &Answer, force: &Force) -> Result<()> {
        self.frames += 1;
        let off_px = answer.off_px.unwrap_or([[f64::INFINITY; 2]; 4]);
        let far_px = off_px
            .iter()
            .fold(0.0, |far: f64, [x, y]| far.max(x.hypot(*y)));
        self.worst_px = self.worst_px.max(far_px);
        self.wrong_px += u32::from(far_px > WRONG_PX);
        self.squares += off_px.iter().flatten().map(|off| off * off).sum::<f64>();
        let off = Off::of(force, &answer.load)?;
        let bounds = [DIRECTION_BOUND, MAGNITUDE_BOUND, PLACE_BOUND];
        let sigmas: [f64; 3] = std::array::from_fn(|k| off.errors[k] / off.bounds[k] * bounds[k]);
        for (worst, sigmas) in self.worst_sigmas.iter_mut().zip(sigmas) {
            *worst = worst.max(sigmas);
        }
        let beyond = sigmas.map(|sigmas| sigmas > WRONG_SIGMAS);
        self.beyond_three_sigmas += u32::from(beyond.contains(&true));
        let felt = (0..3).any(|k| beyond[k] && off.errors[k] > NO_FAULT[k]);
        self.wrong_force += u32::from(felt);
        Ok(())
    }

    fn add(&mut self, other: &Kept) {
        self.frames += other.frames;
        self.wrong_px += other.wrong_px;
        self.beyond_three_sigmas += other.beyond_three_sigmas;
        self.wrong_force += other.wrong_force;
        self.worst_px = self.worst_px.max(other.worst_px);
        self.squares += other.squares;
        for (worst, other) in self.worst_sigmas.iter_mut().zip(other.worst_sigmas) {
            *worst = worst.max(other);
        }
    }

    /// Root mean square of a coordinate of a marker, and the largest distance.
    fn px(&self) -> String {
        if self.frames == 0 {
            return "–".to_owned();
        }
        let rms = (self.squares / f64::from(8 * self.frames)).sqrt();
        format!("{rms:.3}, {:.2} px", self.worst_px)
    }

    fn sigmas(&self) -> String {
        let [direction, magnitude, place] = self.worst_sigmas;
        let beyond = self.beyond_three_sigmas;
        if self.frames == 0 {
            return "–".to_owned();
        }
        format!("{beyond} ({direction:.1}, {magnitude:.1}, {place:.1})")
    }
}
