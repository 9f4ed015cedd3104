//! Which markers to build under a camera that sees no colours, in which light; and how many rows
//! they reach, which is how many frames a second it sends.

use std::fmt::Write;

use anyhow::{Result, anyhow};
use clap::Args;
use hivtac_calibration::data::dataset::{Recipe, measure};
use hivtac_calibration::data::loads::RandomLoads;
use hivtac_calibration::data::range::Range;
use hivtac_sensor::markers::settings::Settings;
use hivtac_sensor::pipeline::Sensor;
use hivtac_terms::conditions::CentroidEstimator;
use hivtac_terms::geometry::{Geometry, Preset};
use hivtac_terms::marker::Marker;
use hivtac_terms::threshold::{ByteOrder, Mono, Threshold};
use hivtac_twin::{Lens, Load, MarkerTruth, Options, Paint, PresetCamera, Scene};
use rayon::prelude::*;
use serde::Serialize;

use crate::page;

/// The film's level, to which the camera's automatic control exposes.
const FILM: f64 = 141.0;
/// What the default model is calibrated for.
const RANGE: Range = Range {
    force_n: 0.227,
    alpha_deg: 9.1,
    beta_deg: 9.1,
    place_mm: 4.0,
};
/// What the sensor makes of red, green and blue in each light (`mono.md`).
const LIGHTS: [(&str, [f64; 3]); 2] = [("white", [0.31, 0.49, 0.20]), ("cyan", [0.03, 0.65, 0.32])];
const PAINTS: [Paint; 3] = [Paint::Black, Paint::Red, Paint::Blue];
/// A weak force, N.
const WEAK_N: f64 = 0.03;
/// Focal lengths, mm.
const LENSES_MM: [f64; 4] = [2.1, 1.7, 1.4, 1.2];
/// The camera's clock, Hz; clocks of a row; blank rows of a frame; rows of a band.
const XCLK_HZ: f64 = 240e6 / 9.0;
const ROW_CLOCKS: f64 = 690.0;
const BLANK_ROWS: u32 = 6;
const BAND_ROWS: u32 = 8;

/// Render markers of each paint in each light, and find how far they move.
#[derive(Args)]
pub struct MonoStudy {
    /// Presses of each.
    #[arg(long, default_value_t = 400)]
    pub presses: usize,
    /// Print one JSON object and write no page.
    #[arg(long)]
    pub json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    paints: Vec<Seen>,
    lenses: Vec<Reach>,
}

/// Markers of one paint in one light.
#[derive(Serialize)]
struct Seen {
    paint: &'static str,
    light: &'static str,
    /// Level of a marker, where the film has 141.
    level: f64,
    /// Largest luma of a marker: half way to the film.
    threshold: u8,
    /// In each condition of [`CONDITIONS`]: root mean square error of a marker's position, px, and
    /// frames in which not all four were found.
    off_px: Vec<Option<f64>>,
    lost: Vec<usize>,
}

/// What a lens shows of the calibrated range.
#[derive(Serialize)]
struct Reach {
    focal_mm: f64,
    /// Diameter of a marker at rest, px.
    marker_px: f64,
    /// Rows that markers reach under [`WEAK_N`] in the middle, and in the calibrated range.
    weak_rows: u32,
    rows: u32,
    /// Frames a second with as many.
    rate_hz: f64,
}

/// What is wrong with the light.
type Condition = (&'static str, fn(&mut Options));
const CONDITIONS: [Condition; 3] = [
    ("as it should be", |_| ()),
    ("40 % uneven", |options| options.gradient = [0.4, 0.0]),
    ("veiled by 40 levels", |options| options.haze = 40.0),
];

impl MonoStudy {
    /// Runs it.
    ///
    /// # Errors
    /// When frames cannot be rendered, or the page cannot be written.
    pub fn run(&self) -> Result<()> {
        let report = Report {
            paints: self.paints()?,
            lenses: LENSES_MM.into_iter().map(reach).collect::<Result<_>>()?,
        };
        if self.json {
            println!("{}", serde_json::to_string(&report)?);
            return Ok(());
        }
        let text = report.text()?;
        print!("{text}");
        page::write("mono.md", include_str!("mono.md"), &text)
    }

    fn paints(&self) -> Result<Vec<Seen>> {
        let pairs = PAINTS.into_iter();
        let pairs = pairs.flat_map(|paint| LIGHTS.map(|(light, mono)| (paint, light, mono)));
        pairs
            .map(|(paint, light, mono)| self.seen(paint, light, mono))
            .collect()
    }

    fn seen(&self, paint: Paint, light: &'static str, mono: [f64; 3]) -> Result<Seen> {
        let mut options = Options {
            markers: paint,
            mono,
            ..Options::of(Preset::Mt9v034)
        };
        options.gain = FILM / Paint::Film.level(mono);
        let level = paint.level(mono) * options.gain;
        let threshold = ((level + FILM) / 2.0).round() as u8;
        let errors = CONDITIONS.map(|(_, spoil)| {
            let mut options = options.clone();
            spoil(&mut options);
            self.errors(options, threshold)
        });
        let errors = errors.into_iter().collect::<Result<Vec<_>>>()?;
        Ok(Seen {
            paint: paint.name(),
            light,
            level,
            threshold,
            off_px: errors.iter().map(|(off_px, _)| *off_px).collect(),
            lost: errors.iter().map(|(_, lost)| *lost).collect(),
        })
    }

    /// Root mean square error of markers' positions, px, and frames without them.
    fn errors(&self, options: Options, threshold: u8) -> Result<(Option<f64>, usize)> {
        let Recipe { width, height, .. } = Recipe::of(Preset::Mt9v034);
        let (columns, rows) = (width.into(), height.into());
        let scene = Scene::preset("rest", Preset::Mt9v034, columns, rows, 3)?;
        let scene = scene.with_options(options)?;
        let geometry = Geometry::preset(Preset::Mt9v034, width, height);
        let settings = Settings {
            threshold: Threshold::Mono(Mono {
                low: 0,
                high: threshold,
            }),
            centroid: CentroidEstimator::RednessWeighted,
            ..Settings::usual(geometry, ByteOrder::Native)
        };
        let loads = RandomLoads {
            range: RANGE,
            seed: 11,
        };
        let off = (0..self.presses).into_par_iter().map(|number| {
            let mut sensor = Box::new(Sensor::<64>::new());
            let configured = sensor.configure(settings, None);
            configured.map_err(|error| anyhow!("{error}"))?;
            let frame = scene.render_load(&loads.load(number)?, number as u64)?;
            let measured = measure(&mut sensor, &frame);
            let square = |(found, truth): (Marker, Option<MarkerTruth>)| {
                let [x, y] = truth?.centroid_px;
                let (dx, dy) = (found.x.to_f64() - x, found.y.to_f64() - y);
                Some(dx * dx + dy * dy)
            };
            let squares = measured.markers.map(|found| {
                let pairs = found.into_iter().zip(frame.truth.markers);
                pairs.filter_map(square).sum::<f64>() / 4.0
            });
            Ok(squares)
        });
        let off = off.collect::<Result<Vec<_>>>()?;
        let found: Vec<f64> = off.iter().copied().flatten().collect();
        let mean = found.iter().sum::<f64>() / found.len() as f64;
        let off_px = (!found.is_empty()).then(|| mean.sqrt());
        Ok((off_px, off.len() - found.len()))
    }
}

/// How many rows the markers reach, about the axis.
fn reach(focal_mm: f64) -> Result<Reach> {
    // Half as large as on its own pixels: nothing leaves the picture.
    let pitch_um = 2.0 * 12.0 * Preset::Mt9v034.focal_length_mm() / focal_mm;
    let mut options = Options::of(Preset::Mt9v034);
    options.lens = Lens {
        pitch_um: Some(pitch_um),
        ..Lens::default()
    };
    let scene = Scene::preset("rest", Preset::Mt9v034, 376, 240, 1)?.with_options(options)?;
    let weak = Load::from_angles(WEAK_N, 0.0, 0.0)?;
    let weak_rows = rows(&scene, &[weak])?;
    let rows = rows(&scene, &corners()?)?;
    let rest = scene.truth_under(&Load::REST)?.markers[0];
    let area = rest.map_or(0.0, |marker| 4.0 * marker.area_px2);
    let read = rows.next_multiple_of(BAND_ROWS);
    Ok(Reach {
        focal_mm,
        marker_px: 2.0 * (area / std::f64::consts::PI).sqrt(),
        weak_rows,
        rows,
        rate_hz: XCLK_HZ / (ROW_CLOCKS * f64::from(read + BLANK_ROWS)),
    })
}

/// Rows about the axis in which all of every marker's image lies, in a scene that shows it half as
/// large.
fn rows(scene: &Scene, loads: &[Load]) -> Result<u32> {
    let mut most = 0.0_f64;
    for load in loads {
        for marker in scene.truth_under(load)?.markers.into_iter().flatten() {
            let radius = (marker.area_px2 / std::f64::consts::PI).sqrt();
            most = most.max(2.0 * ((marker.centroid_px[1] - 119.5).abs() + radius));
        }
    }
    Ok(2 * most.ceil() as u32)
}

/// The strongest forces of the calibrated range, at its ends and between them.
fn corners() -> Result<Vec<Load>> {
    let ends = [-1.0, 0.0, 1.0];
    let mut loads = Vec::new();
    for alpha in ends {
        for beta in ends {
            let (alpha, beta) = (alpha * RANGE.alpha_deg, beta * RANGE.beta_deg);
            let load = Load::from_angles(RANGE.force_n, alpha, beta)?;
            for x in ends {
                for y in ends {
                    let place = [x, y].map(|part| part * RANGE.place_mm);
                    loads.push(load.with_offset_mm(place)?);
                }
            }
        }
    }
    Ok(loads)
}

impl Report {
    fn text(&self) -> Result<String> {
        let mut text = String::from("| markers | light | their level | threshold |");
        for (name, _) in CONDITIONS {
            write!(text, " off, light {name} | frames lost |")?;
        }
        text.push_str("\n|---|---|--:|--:|--:|--:|--:|--:|--:|--:|\n");
        for seen in &self.paints {
            let Seen {
                paint,
                light,
                level,
                threshold,
                ..
            } = seen;
            write!(text, "| {paint} | {light} | {level:.0} | {threshold} |")?;
            for (off_px, lost) in seen.off_px.iter().zip(&seen.lost) {
                match off_px {
                    Some(off_px) => write!(text, " {off_px:.3} px | {lost} |")?,
                    None => write!(text, " – | {lost} |")?,
                }
            }
            text.push('\n');
        }
        text.push_str(
            "\n| lens | marker at rest | rows that markers reach at 30 mN in the middle | in the \
             calibrated range | frames a second with these |\n|--:|--:|--:|--:|--:|\n",
        );
        for reach in &self.lenses {
            writeln!(
                text,
                "| {:.1} mm | {:.1} px | {} | {} | {:.0} |",
                reach.focal_mm, reach.marker_px, reach.weak_rows, reach.rows, reach.rate_hz
            )?;
        }
        Ok(text)
    }
}
