//! Writes an evaluation as one HTML file, and as lines for a terminal.

use std::fmt::{self, Write};

use super::coverage::{Covered, coverage};
use super::figures::{error_against_force, found_against_true, histograms, pose_maps};
use super::numbers::{PoseNumbers, by_pose, errors};
use super::places::{PlaceNumbers, by_place};
use super::{Evaluation, Interval, Judged, Numbers};
use crate::data::conditions::meaning;
use crate::data::loads::norm;
use crate::evaluation::errors::WEAK_N;
use crate::evaluation::plot::escaped;

const STYLE: &str = "body{font-family:sans-serif;max-width:1320px;margin:1em auto;padding:0 1em}\
table{border-collapse:collapse;margin:1em 0}td,th{border:1px solid #bbb;padding:.3em \
.7em;text-align:right}\
td:first-child,th:first-child{text-align:left}svg{max-width:32%;height:auto}small{color:#555}";

/// The seed of the resamples.
const SEED: u64 = 1;

impl Evaluation {
    /// Numbers of all frames, of those below 50 mN, and of those from 50 mN up.
    pub fn groups(&self) -> [(&'static str, Option<Numbers>); 3] {
        let part = |keep: fn(&&Judged) -> bool| Numbers::of(self.judged.iter().filter(keep), SEED);
        [
            ("all frames", part(|_| true)),
            ("|F| < 50 mN", part(|f| norm(f.truth) < WEAK_N)),
            ("|F| ≥ 50 mN", part(|f| norm(f.truth) >= WEAK_N)),
        ]
    }

    /// Describes the evaluation's scope.
    pub fn sentence(&self) -> String {
        if self.measured {
            return format!(
                "Frames of a real unit ({}), contact reading `{}` ({}), all rows of a data set of \
                 its own. The truth is the gauge's reading and the pose that was set: \
                 their errors are in these numbers, too.",
                self.frames,
                self.contact,
                meaning(self.contact)
            );
        }
        format!(
            "Simulated frames ({}), contact reading `{}` ({}), all rows of a data set of its own. \
             Nothing here was measured on a real sensor, and the \
             paper's numbers include its gauge, its stage and its film's hysteresis: they are no \
             measure of ours.",
            self.frames,
            self.contact,
            meaning(self.contact)
        )
    }

    /// The evaluation as one HTML file with embedded pictures.
    pub fn to_html(&self) -> String {
        let averages = by_pose(&self.judged);
        let mut html = format!(
            "<!doctype html><html lang=\"en\"><meta \
             charset=\"utf-8\"><title>{0}</title><style>{STYLE}</style>\
             <h1>{0}</h1><p>{1}</p>\n",
            escaped(&self.model),
            escaped(&self.sentence())
        );
        self.push_table(&mut html);
        push_paper(&mut html, self, PoseNumbers::of(&averages));
        push_coverage(&mut html, &self.judged);
        push_places(&mut html, &by_place(&self.judged));
        let mut section = |title: &str, pictures: Vec<String>| {
            let _ = writeln!(html, "<h2>{title}</h2>{}", pictures.concat());
        };
        section(
            "Found against true (the paper's Figure 11)",
            found_against_true(&self.judged),
        );
        if averages.is_empty() {
            let all: Vec<_> = self.judged.iter().map(errors).collect();
            section(
                "Errors of frames (its Figure 12 d–f; the data has no poses)",
                histograms(&all, "frames"),
            );
        } else {
            let values: Vec<_> = averages.values().copied().collect();
            section(
                "Average errors of poses (its Figure 12)",
                pose_maps(&averages),
            );
            section("", histograms(&values, "poses"));
        }
        section(
            "Errors against |F| (its Figure 13)",
            error_against_force(&self.judged),
        );
        html
    }

    fn push_table(&self, html: &mut String) {
        let groups = self.groups();
        let header: String = groups
            .iter()
            .map(|(name, _)| format!("<th>{}</th>", escaped(name)))
            .collect();
        let _ = writeln!(html, "<table><tr><th></th>{header}</tr>");
        for (name, value) in ROWS {
            let cells: String = groups
                .iter()
                .map(|(_, n)| cell(n.as_ref().map(value)))
                .collect();
            let _ = writeln!(html, "<tr><td>{}</td>{cells}</tr>", escaped(name));
        }
        let rejected: usize = self.rejected.values().sum();
        let why: Vec<_> = self
            .rejected
            .iter()
            .map(|(status, count)| format!("{status} {count}"))
            .collect();
        let _ = writeln!(
            html,
            "</table><p>{rejected} frames of the data set were rejected and count nowhere. {} \
             <small>In brackets: 95 % intervals by resampling poses, or frames where there are no \
             poses.</small></p>",
            escaped(&why.join(", "))
        );
    }
}

type Value = fn(&Numbers) -> String;

const ROWS: [(&str, Value); 10] = [
    ("frames", |n| n.frames.to_string()),
    ("mean angle between found and true force, °", |n| {
        interval(n.direction_deg, 1.0, 3)
    }),
    ("largest, °", |n| format!("{:.2}", n.direction_worst_deg)),
    ("mean |error| of α, °", |n| interval(n.alpha_deg, 1.0, 3)),
    ("mean |error| of β, °", |n| interval(n.beta_deg, 1.0, 3)),
    ("α within 0.5°, %", |n| interval(n.alpha_within, 100.0, 1)),
    ("β within 0.5°, %", |n| interval(n.beta_within, 100.0, 1)),
    ("root mean square error of |F|, mN", |n| {
        interval(n.force_rmse_n, 1e3, 3)
    }),
    ("largest |error| of |F|, mN", |n| {
        format!("{:.2}", n.force_worst_n * 1e3)
    }),
    ("|F| within 10 mN, %", |n| {
        interval(n.force_within, 100.0, 1)
    }),
];

fn interval(number: Interval, scale: f64, digits: usize) -> String {
    let [low, high] = number.range.map(|end| end * scale);
    format!(
        "{:.digits$} [{low:.digits$}, {high:.digits$}]",
        number.value * scale
    )
}

fn cell(text: Option<String>) -> String {
    format!(
        "<td>{}</td>",
        text.map_or("–".into(), |text| escaped(&text))
    )
}

/// How often direction and size lie within their stated 95 % bounds.
fn push_coverage(html: &mut String, frames: &[Judged]) {
    html.push_str(
        "<h2>Do the stated uncertainties hold?</h2><table><tr><th>|F|, mN (a tenth of the \
         frames each)</th>\
         <th>direction within its stated 95 % bound, %</th><th>median bound, °</th><th>median \
         error, °</th>\
         <th>|F| within its stated 95 % bound, %</th><th>median bound, mN</th><th>median error, \
         mN</th></tr>\n",
    );
    for part in coverage(frames) {
        let [low, high] = part.force_n.map(|n| n * 1e3);
        let (direction, magnitude) = (part.direction, part.magnitude);
        let _ = writeln!(
            html,
            "<tr><td>{low:.1} to \
             {high:.1}</td><td>{:.1}</td><td>{:.3}</td><td>{:.3}</td><td>{:.1}</td><td>{:.3}</td>\
             <td>{:.3}</td></tr>",
            direction.within * 100.0,
            direction.bound,
            direction.error,
            magnitude.within * 100.0,
            magnitude.bound * 1e3,
            magnitude.error * 1e3
        );
    }
    html.push_str("</table>\n");
}

/// Errors of places, and how often they lie within their stated 95 % bound; `None` without places.
fn place_cells(part: &PlaceNumbers) -> Option<[String; 2]> {
    let place = part.place?;
    Some([
        format!("{:.0}", place.each_mm * 1e3),
        format!("{:.1}", place.within * 100.0),
    ])
}

/// Errors away from the middle; writes nothing when no place is known.
fn push_places(html: &mut String, parts: &[PlaceNumbers]) {
    if parts.is_empty() {
        return;
    }
    html.push_str(
        "<h2>Off the middle</h2><table><tr><th>tip</th><th>frames</th><th>direction, RMS, °</th>\
         <th>|F|, RMS, mN</th><th>place, RMS along x and y each, µm</th>\
         <th>place within its stated 95 % bound, %</th></tr>\n",
    );
    for part in parts {
        let [off, within] = place_cells(part).map_or([None, None], |cells| cells.map(Some));
        let _ = writeln!(
            html,
            "<tr><td>{}</td><td>{}</td><td>{:.3}</td><td>{:.3}</td>{}{}</tr>",
            escaped(&part.name),
            part.frames,
            part.direction_deg,
            part.magnitude_n * 1e3,
            cell(off),
            cell(within)
        );
    }
    html.push_str("</table>\n");
}

/// The paper's numbers (abstract and Section 7.1) next to ours.
fn push_paper(html: &mut String, evaluation: &Evaluation, poses: Option<PoseNumbers>) {
    let all = &evaluation.groups()[0].1;
    let frame = |value: Value| all.as_ref().map(value);
    let pose = |value: &dyn Fn(&PoseNumbers) -> f64, digits: usize| {
        poses.as_ref().map(|p| format!("{:.digits$}", value(p)))
    };
    let rows: [(&str, &str, Option<String>); 9] = [
        (
            "average error of the direction, °",
            "0.32",
            frame(ROWS[1].1),
        ),
        ("root mean square error of |F|, mN", "9.8", frame(ROWS[7].1)),
        (
            "largest average error of a pose: α, °",
            "1.445",
            pose(&|p| p.worst[0], 3),
        ),
        ("β, °", "1.547", pose(&|p| p.worst[1], 3)),
        ("|F|, mN", "43", pose(&|p| 1e3 * p.worst[2], 2)),
        (
            "poses whose average error is within 0.5°: α, %",
            "80.39",
            pose(&|p| 100.0 * p.within[0], 1),
        ),
        ("β, %", "89.36", pose(&|p| 100.0 * p.within[1], 1)),
        (
            "within 10 mN: |F|, %",
            "72.27",
            pose(&|p| 100.0 * p.within[2], 1),
        ),
        (
            "within 30 mN: |F|, %",
            "99.16",
            pose(&|p| 100.0 * p.within[3], 1),
        ),
    ];
    let _ = writeln!(
        html,
        "<table><tr><th></th><th>paper, real sensor</th><th>this model, {}</th></tr>",
        if evaluation.measured {
            "real unit"
        } else {
            "simulated"
        }
    );
    for (name, paper, ours) in rows {
        let _ = writeln!(
            html,
            "<tr><td>{}</td><td>{paper}</td>{}</tr>",
            escaped(name),
            cell(ours)
        );
    }
    html.push_str("</table>\n");
}

impl fmt::Display for Evaluation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}\n{}", self.model, self.sentence())?;
        for (group, numbers) in self.groups() {
            let Some(numbers) = numbers else { continue };
            writeln!(f, "{group}")?;
            ROWS.iter()
                .try_for_each(|(name, value)| writeln!(f, "  {name}: {}", value(&numbers)))?;
        }
        writeln!(
            f,
            "within the stated 95 % bound, by tenths of the frames from weak to strong (in \
             brackets: median bound over median error):"
        )?;
        for part in coverage(&self.judged) {
            let [low, high] = part.force_n.map(|n| n * 1e3);
            let cell = |covered: Covered| {
                let ratio = covered.bound / covered.error;
                format!("{:.1} % ({ratio:.2})", 100.0 * covered.within)
            };
            let (direction, magnitude) = (cell(part.direction), cell(part.magnitude));
            writeln!(
                f,
                "  {low:.1} to {high:.1} mN: direction {direction}, |F| {magnitude}"
            )?;
        }
        write_places(f, &by_place(&self.judged))?;
        write!(f, "rejected: {}", self.rejected.values().sum::<usize>())
    }
}

fn write_places(f: &mut fmt::Formatter<'_>, parts: &[PlaceNumbers]) -> fmt::Result {
    if !parts.is_empty() {
        writeln!(f, "off the middle, root mean squares:")?;
    }
    for part in parts {
        let place = place_cells(part).map_or(String::new(), |[off, within]| {
            format!(", place {off} µm along x and y each ({within} % within the stated 95 % bound)")
        });
        let (degrees, force_mn) = (part.direction_deg, part.magnitude_n * 1e3);
        writeln!(
            f,
            "  {} ({} frames): direction {degrees:.3}°, |F| {force_mn:.3} mN{place}",
            part.name, part.frames
        )?;
    }
    Ok(())
}
