//! What a film's memory does to forces: held loads, what they leave behind, and sines.

use std::f64::consts::TAU;
use std::fmt::Write;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use hivtac_calibration::evaluation::bounds::MAGNITUDE_BOUND;
use hivtac_calibration::quantize::export;
use hivtac_calibration::weights::Weights;
use hivtac_sensor::force::Force;
use hivtac_sensor::force::model::Model;
use hivtac_sensor::temporal::Moment;
use hivtac_terms::temporal::{Creep as Undone, TemporalSettings};
use hivtac_terms::units::SmallPermille;
use hivtac_twin::film::reduced::Unit;
use hivtac_twin::{Creep, Load, Mechanics, Memory, Options};
use rayon::prelude::*;

use crate::anywhere::WEIGHTS;
use crate::page;
use crate::press::{Errors, REACH_MM, Tared, TestedUnit, press};

/// How much a held load grows in all.
const PARTS: [f64; 3] = [0.02, 0.05, 0.15];
/// |F|; of sines the mean, N.
const FORCE_N: f64 = 0.1;
/// When held loads are read, s.
const HELD_S: [f64; 3] = [1.0, 10.0, 60.0];
/// When the film is looked at after it was let go, s.
const LEFT_S: [f64; 4] = [0.1, 1.0, 10.0, 60.0];
/// Half of the mean up and down, Hz.
const SINES_HZ: [f64; 3] = [0.1, 1.0, 5.0];
/// A unit's loads are read so long after they were put on, s: then its forces are right.
const CALIBRATED_S: f64 = 1.0;
/// A load is put on and taken off within a step, s.
const STEP_S: f64 = 0.02;
/// For so long frames follow by that, s, and then by a longer one.
const CLOSELY_S: f64 = 1.2 - 1e-6;
const PAUSE_S: f64 = 0.1;

/// Whether a device knows the parts of its film.
const KNOWN: [bool; 2] = [false, true];

/// Press films that creep and unload late: hold, let go, and press by sines of time.
#[derive(Args)]
pub struct CreepStudy {
    /// Presses of each kind.
    #[arg(long, default_value_t = 20)]
    presses: u32,
}

/// A unit whose film creeps, its sensor, and what presses it.
struct Finger<'m> {
    unit: TestedUnit,
    tared: Tared<'m>,
    memory: Memory,
    load: Load,
    /// For how long it was that, s.
    held_s: f64,
    time_s: f64,
    frame: u32,
    /// Another sensor on the unit, for tares that are not kept.
    judge: Tared<'m>,
}

/// What is told of some presses at one moment.
#[derive(Clone, Copy, Default)]
struct Told {
    errors: Errors,
    /// Sum of squares of |F| of an untouched film, mN², and of markers beside their rest, px².
    left_mn2: f64,
    left_px2: f64,
    /// How many of the former are within their stated 95 % bounds.
    within: u32,
    refused: u32,
    /// Of |F|, mN², by a tare that was insisted on.
    tare_mn2: f64,
    /// By which part of the swing falling forces are told larger than rising ones.
    late: f64,
}

impl CreepStudy {
    /// Runs it.
    ///
    /// # Errors
    /// When a file cannot be read or written, or a press cannot be made.
    pub fn run(&self) -> Result<()> {
        let bytes = export(&Weights::load(WEIGHTS.as_ref())?)?;
        let model = Model::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let mut tables = [
            "| film | creep is | held for | direction, rms | \\|F\\| | place | within the stated \
             95 %: direction, \\|F\\|, place |\n|--:|---|--:|--:|--:|--:|---|\n"
                .to_owned(),
            "| film | creep is | let go for | \\|F\\| that is told, rms | within the stated 95 % \
             | markers | tares refused | \\|F\\| of a press after a tare that was insisted on \
             |\n|--:|---|--:|--:|--:|--:|--:|--:|\n"
                .to_owned(),
            "| film | creep is | sine | falling forces above rising ones | direction, rms \
             | \\|F\\| | place | within the stated 95 %: direction, \\|F\\|, place \
             |\n|--:|---|--:|--:|--:|--:|--:|---|\n"
                .to_owned(),
        ];
        for (part, known) in PARTS
            .into_iter()
            .flat_map(|part| KNOWN.map(|known| (part, known)))
        {
            let name = if known { "known" } else { "unknown" };
            let film = format!("| {:.0} % | {name}", 100.0 * part);
            let finger = || Finger::new(&model, Creep::of(part), known);
            let told = self.all(|number| pressed(finger()?, number))?;
            let (held, left) = told.split_at(HELD_S.len());
            for (told, held_s) in held.iter().zip(HELD_S) {
                writeln!(tables[0], "{film} | {held_s} s | {}", told.cells())?;
            }
            for (told, left_s) in left.iter().zip(LEFT_S) {
                writeln!(
                    tables[1],
                    "{film} | {left_s} s | {}",
                    told.left(self.presses)
                )?;
            }
            for rate_hz in SINES_HZ {
                let told = self.all(|number| swung(finger()?, number, rate_hz))?;
                let late = 100.0 * told[0].late / f64::from(self.presses);
                let cells = told[0].cells();
                writeln!(tables[2], "{film} | {rate_hz} Hz | {late:.1} % | {cells}")?;
            }
        }
        let [held, left, sines] = tables;
        let names = [("held", held), ("left", left), ("sines", sines)];
        let text = page::filled(include_str!("creep.md"), &names);
        page::write_file("docs/results/creep.md".as_ref(), &text)
    }

    /// What is told of all presses, moment by moment.
    fn all<const N: usize>(
        &self,
        one: impl Fn(u32) -> Result<[Told; N]> + Send + Sync,
    ) -> Result<[Told; N]> {
        let all: Vec<_> = (0..self.presses).into_par_iter().map(one).collect();
        let mut sums = [Told::default(); N];
        for told in all {
            for (sum, told) in sums.iter_mut().zip(told?) {
                sum.add(&told);
            }
        }
        Ok(sums)
    }
}

/// A load that is put on, held, and taken off.
fn pressed(mut finger: Finger<'_>, number: u32) -> Result<[Told; 7]> {
    let load = press(number, FORCE_N, REACH_MM)?;
    let mut told = [Told::default(); 7];
    for (told, held_s) in told.iter_mut().zip(HELD_S) {
        let force = finger.hold(&load, held_s)?;
        told.errors.add(force.as_ref(), &load)?;
    }
    for (told, left_s) in told.iter_mut().skip(HELD_S.len()).zip(LEFT_S) {
        let force = finger.hold(&Load::REST, left_s)?;
        *told = finger.left(force.as_ref(), &load)?;
    }
    Ok(told)
}

/// A force that goes up and down.
fn swung(mut finger: Finger<'_>, number: u32, rate_hz: f64) -> Result<[Told; 1]> {
    let mut told = Told::default();
    let (step_s, steps) = (0.05 / rate_hz.max(0.5), 200);
    let mut sum = 0.0;
    for step in 1..=steps {
        let phase = TAU * rate_hz * step_s * f64::from(step);
        let load = press(number, FORCE_N * (1.0 + 0.5 * phase.sin()), REACH_MM)?;
        let force = finger.next(&load, step_s)?;
        // The first half settles.
        if step > steps / 2 {
            told.errors.add(force.as_ref(), &load)?;
            let found_n = force.map_or(0.0, |force| f64::from(force.magnitude.0) * 1e-6);
            sum += (found_n - load.magnitude_n()) * phase.cos();
        }
    }
    let amplitude_n = -2.0 * sum / f64::from(steps / 2);
    told.late = amplitude_n / (0.5 * FORCE_N);
    Ok([told])
}

impl<'m> Finger<'m> {
    /// A unit that was calibrated by loads that were held for a second, as by a model of a film
    /// that gives as far at once.
    fn new(model: &Model<'m>, creep: Creep, known: bool) -> Result<Self> {
        let grown = creep.grown(CALIBRATED_S);
        let film = Unit {
            stiffness: grown,
            grip: grown,
            ..Unit::default()
        };
        let options = Options {
            film: Mechanics {
                unit: film,
                ..Mechanics::default()
            },
            ..Options::default()
        };
        let unit = TestedUnit::new(&model.conditions, options, 0.5, 1)?;
        let mut tared = unit.tare(model)?;
        if known {
            let parts = creep
                .parts
                .map(|part| SmallPermille((1e3 * part).round() as u8));
            tared.set_temporal(TemporalSettings {
                creep: Undone { parts },
                ..TemporalSettings::USUAL
            })?;
        }
        Ok(Self {
            tared,
            judge: unit.tare(model)?,
            unit,
            memory: creep.unpressed(),
            load: Load::REST,
            held_s: 0.0,
            time_s: 0.0,
            frame: 0,
        })
    }

    /// The next frame, so long after the one before; the load came to this meanwhile.
    fn next(&mut self, load: &Load, after_s: f64) -> Result<Option<Force>> {
        self.memory.pass(&self.load, load, after_s);
        self.held_s = if *load == self.load {
            self.held_s + after_s
        } else {
            0.0
        };
        self.load = *load;
        self.time_s += after_s;
        self.frame += 1;
        let frame = self.unit.frame(&self.seen(), self.frame.into())?;
        let measurement = self.tared.measure(&frame);
        let at = Moment {
            frame: self.frame,
            time_us: (self.time_s * 1e6).round() as u64,
        };
        Ok(self.tared.follow(at, &measurement).force)
    }

    /// The load of which an elastic film would look as this one does.
    fn seen(&self) -> Load {
        self.memory.effective(&self.load)
    }

    /// Puts a load on, unless it is, and holds it until it was held for so long, s.
    fn hold(&mut self, load: &Load, until_s: f64) -> Result<Option<Force>> {
        loop {
            let is_new = *load != self.load || self.held_s < CLOSELY_S;
            let force = self.next(load, if is_new { STEP_S } else { PAUSE_S })?;
            if self.held_s > until_s - 1e-6 {
                return Ok(force);
            }
        }
    }

    /// What there is to say of a film that was let go, and of a tare that is taken then.
    fn left(&mut self, force: Option<&Force>, press: &Load) -> Result<Told> {
        let seen = self.seen();
        let scene = self.unit.scene();
        let [now, rest] = [seen, Load::REST].map(|load| scene.truth_under(&load));
        let mut left_px2 = 0.0;
        for (now, rest) in now?
            .markers
            .iter()
            .flatten()
            .zip(rest?.markers.iter().flatten())
        {
            let far = |axis: usize| now.centroid_px[axis] - rest.centroid_px[axis];
            left_px2 += (far(0).powi(2) + far(1).powi(2)) / 4.0;
        }
        let judge = &mut self.judge;
        let is_refused = judge.judge_tare(&self.unit, &seen, false)?.is_err();
        let before = *judge.rest().context("a tare")?;
        let insisted = judge.judge_tare(&self.unit, &seen, true)?;
        let mut told_mn = |rest| -> Result<f64> {
            judge.set_rest(rest);
            let force = judge.answer(&self.unit, *press, 7)?.force;
            Ok(force.map_or(0.0, |force| f64::from(force.magnitude.0) * 1e-3))
        };
        let [good, bad] = [before, insisted.unwrap_or(before)].map(&mut told_mn);
        judge.set_rest(before);
        let told_un = force.map_or([0.0; 2], |f| {
            [f.magnitude.0.into(), f.magnitude_sigma.0.into()]
        });
        let [left_mn, sigma_mn] = told_un.map(|un: f64| un * 1e-3);
        Ok(Told {
            left_mn2: left_mn.powi(2),
            within: u32::from(left_mn <= MAGNITUDE_BOUND * sigma_mn),
            left_px2,
            refused: u32::from(is_refused),
            tare_mn2: (bad? - good?).powi(2),
            ..Told::default()
        })
    }
}

impl Told {
    fn add(&mut self, other: &Told) {
        self.errors.merge(&other.errors);
        self.left_mn2 += other.left_mn2;
        self.left_px2 += other.left_px2;
        self.within += other.within;
        self.refused += other.refused;
        self.tare_mn2 += other.tare_mn2;
        self.late += other.late;
    }

    fn cells(&self) -> String {
        let [direction, magnitude, place] = self.errors.rms();
        let [of_direction, of_magnitude, of_place] = self.errors.covered();
        format!(
            "{direction:.2}° | {magnitude:.2} mN | {place:.0} µm | {of_direction:.0}, \
             {of_magnitude:.0}, {of_place:.0} % |"
        )
    }

    fn left(&self, presses: u32) -> String {
        let rms = |sum: f64| (sum / f64::from(presses)).sqrt();
        format!(
            "{:.2} mN | {} of {presses} | {:.2} px | {} of {presses} | {:.2} mN off |",
            rms(self.left_mn2),
            self.within,
            rms(self.left_px2),
            self.refused,
            rms(self.tare_mn2)
        )
    }
}
