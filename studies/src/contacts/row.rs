//! Sums the errors of one kind of presses under one setting.

use std::collections::BTreeMap;

use anyhow::Result;
use hivtac_calibration::data::dataset::reasons;
use hivtac_calibration::data::loads::norm;
use hivtac_sensor::force::Force;
use hivtac_sensor::pipeline::Measurement;
use hivtac_terms::status::Status;
use serde::Serialize;

use super::objects::Press;
use crate::press::{Judged, judged};

/// The stated 95 % of a torque, in standard uncertainties.
const TORQUE_BOUND: f64 = 1.960;

/// The sensor's answers to the frames of a kind of presses.
#[derive(Debug, Default, Serialize)]
pub struct Row {
    kind: String,
    setting: &'static str,
    presses: u32,
    frames: u32,
    /// Frames with a force that one contact explains loosely.
    loosely: u32,
    /// Frames with a force of three markers, because the fourth one looks faulty.
    of_three: u32,
    /// Frames without a force, by the reasons.
    refused: BTreeMap<String, u32>,
    /// Errors in frames with a force: of the direction, degrees; of |F|, in parts of the true size;
    /// of the place, mm.
    errors: [Vec<f64>; 3],
    /// Sum of the errors of |F| with their signs.
    stronger: f64,
    /// Frames with errors within their stated 95 % bounds, of the same three.
    within: [u32; 3],
    /// Errors of the torque about z, N·mm, of forces that have one, and how many are within their
    /// stated 95 %.
    torque: (Vec<f64>, u32),
}

impl Row {
    /// Returns a row without presses.
    pub fn new(kind: String, setting: &'static str) -> Row {
        Row {
            kind,
            setting,
            ..Row::default()
        }
    }

    /// Returns whether it has no presses.
    pub fn is_empty(&self) -> bool {
        self.presses == 0
    }

    /// Adds the frames of a press.
    ///
    /// # Errors
    /// If a force has no place.
    pub fn add(&mut self, press: &Press, answers: &[Measurement]) -> Result<()> {
        self.presses += 1;
        for answer in answers {
            self.frames += 1;
            match &answer.force {
                Some(force) => self.add_force(force, answer.status, press)?,
                None => *self.refused.entry(reasons(answer.status)).or_default() += 1,
            }
        }
        Ok(())
    }

    fn add_force(&mut self, force: &Force, status: Status, press: &Press) -> Result<()> {
        self.of_three += u32::from(status.contains(Status::MARKER_LOST));
        self.loosely += u32::from(status.contains(Status::LOOSELY_EXPLAINED));
        let size_mn = 1e3 * norm(press.force_n);
        if let Some(torque) = &force.torque {
            let error = (f64::from(torque.z.0) * 1e-6 - press.torque_nmm).abs();
            let bound = TORQUE_BOUND * f64::from(torque.sigma.0) * 1e-6;
            self.torque.0.push(error);
            self.torque.1 += u32::from(error <= bound);
        }
        let Judged { errors, bounds } = judged(force, press.force_n, press.centre_mm)?;
        self.stronger += errors[1] / size_mn;
        // |F| in parts of the true size, places in mm.
        let units = [1.0, size_mn, 1e3];
        for k in 0..3 {
            let error = errors[k].abs();
            self.errors[k].push(error / units[k]);
            self.within[k] += u32::from(error <= bounds[k]);
        }
        Ok(())
    }

    /// Adds the frames of another row to this one.
    pub fn extend(&mut self, other: &Row) {
        self.presses += other.presses;
        self.frames += other.frames;
        self.loosely += other.loosely;
        self.of_three += other.of_three;
        for (reason, count) in &other.refused {
            *self.refused.entry(reason.clone()).or_default() += count;
        }
        self.stronger += other.stronger;
        self.torque.0.extend(&other.torque.0);
        self.torque.1 += other.torque.1;
        for k in 0..3 {
            self.errors[k].extend(&other.errors[k]);
            self.within[k] += other.within[k];
        }
    }

    /// The reasons of refusals, with the part of all frames.
    fn reasons(&self) -> String {
        if self.refused.is_empty() {
            return "–".into();
        }
        let parts = self.refused.iter().map(|(reason, count)| {
            let part = 100.0 * f64::from(*count) / f64::from(self.frames);
            format!("{part:.1} % `{reason}`")
        });
        parts.collect::<Vec<_>>().join(", ")
    }

    fn line(&self) -> String {
        let Row { kind, setting, .. } = self;
        let forces = self.errors[0].len() as f64;
        let part = |count: f64| 100.0 * count / f64::from(self.frames);
        let [loosely, of_three] = [self.loosely, self.of_three].map(|count| part(count.into()));
        let before = format!(
            "| {kind} | {setting} | {} | {:.0} % | {loosely:.0} % | {of_three:.0} % | {} |",
            self.presses,
            part(forces),
            self.reasons()
        );
        if forces == 0.0 {
            return format!("{before} – | – | – | – | – |\n");
        }
        let parts = self.errors.each_ref().map(|errors| {
            let mut sorted = errors.clone();
            sorted.sort_by(f64::total_cmp);
            [50, 95].map(|part| sorted[(sorted.len() * part / 100).min(sorted.len() - 1)])
        });
        let [[angle, most_angle], [size, most_size], [place, most_place]] = parts;
        let [a, b, c] = self.within.map(|within| 100.0 * f64::from(within) / forces);
        format!(
            "{before} {angle:.2}° [{most_angle:.1}] | {:.1} % [{:.1}], {:+.1} % | {place:.3} mm \
             [{most_place:.2}] | {a:.0}, {b:.0}, {c:.0} % | {} |\n",
            100.0 * size,
            100.0 * most_size,
            100.0 * self.stronger / forces,
            self.torques()
        )
    }

    /// The torque's column: frames that have one, in parts of those with a force; its error; how
    /// many are within the stated 95 %.
    fn torques(&self) -> String {
        let (errors, within) = &self.torque;
        if errors.is_empty() {
            return "–".into();
        }
        let count = errors.len() as f64;
        let rms = (errors.iter().map(|error| error * error).sum::<f64>() / count).sqrt();
        format!(
            "{:.0} %, {rms:.4} N·mm, {:.0} %",
            100.0 * count / self.errors[0].len() as f64,
            100.0 * f64::from(*within) / count
        )
    }
}

/// Returns the table of all kinds.
pub fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "| what presses | `contact` | presses | forces | loosely | of three markers | refused \
         | direction, median [95 %] | \\|F\\|, median [95 %], mean | place, median [95 %] | within the stated 95 %: \
         direction, \\|F\\|, place | torque: frames, rms, within the stated 95 % \
         |\n|---|---|--:|--:|--:|--:|---|--:|--:|--:|--:|--:|\n",
    );
    text.extend(rows.iter().map(Row::line));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kind_that_is_always_refused_has_no_errors() {
        let row = Row {
            presses: 2,
            frames: 4,
            refused: [("unexplained".into(), 3), ("markers_missing".into(), 1)].into(),
            ..Row::new("pad".into(), "needle")
        };
        let line = "| pad | needle | 2 | 0 % | 0 % | 0 % | 25.0 % `markers_missing`, 75.0 % \
                    `unexplained` | – | – | – | – | – |\n";
        assert_eq!(row.line(), line);
        assert_eq!(table(&[row]).lines().count(), 3);
    }
}
