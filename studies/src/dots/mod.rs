//! Measures what another layout of dots tells of a contact: the film run forwards for its dots, on
//! contacts of the simulated film; and frames of it.

mod frames;

use anyhow::{Context, Result, anyhow};
use clap::Args;
use hivtac_calibration::evaluation::errors::angle_deg;
use hivtac_calibration::forward::{UnitSetup, of_layout};
use hivtac_sensor::force::forward::{
    Column, Estimate, Forward, Markers, Mounting, Observed, Start,
};
use hivtac_sensor::markers::lost::Lost;
use hivtac_terms::list::List;
use hivtac_twin::film::reduced::{NOMINAL_RADIUS_MM, Unit};
use hivtac_twin::film::{Film, Layout};
use hivtac_twin::{Camera, Load, Preset};
use rand::Rng;
use rayon::prelude::*;
use serde::Serialize;

use crate::page;
use crate::press::{normal, seeded};

/// Forces, mN.
const FORCES_MN: [u32; 3] = [50, 100, 200];
/// Areas of contacts, and the errors wanted of eight dots at 100 mN without a dot lost.
const AREAS: [Area; 3] = [
    Area {
        within_mm: 4.0,
        wanted: [0.11, 0.06, 6.0],
    },
    Area {
        within_mm: 6.0,
        wanted: [0.14, 0.12, 8.0],
    },
    Area {
        within_mm: 8.0,
        wanted: [0.25, 0.35, 16.0],
    },
];
const WANTED_MN: u32 = 100;
/// Tilts of a force, degrees.
const TILT_DEG: f64 = 8.0;
/// Noise of each coordinate of a centroid, px: what the simulated camera's frames have.
const NOISE_PX: f64 = 0.011;
/// Gauss–Newton steps, as models ask for.
const STEPS: u8 = 2;
/// 95 of 100 normal errors are within this many standard uncertainties.
const WITHIN_95: f64 = 1.96;

/// Measure contacts by another layout of dots.
#[derive(Args)]
pub struct DotsStudy {
    /// The layout.
    #[arg(long, default_value = "8v")]
    layout: Layout,
    /// Contacts of each row.
    #[arg(long, default_value_t = 400)]
    contacts: u32,
    /// Frames of each row about faults.
    #[arg(long, default_value_t = 800)]
    frames: u32,
    /// Print one JSON object and write no page.
    #[arg(long)]
    json: bool,
}

/// An area of contacts.
#[derive(Clone, Copy, Serialize)]
struct Area {
    /// The largest distance from the middle along each axis, mm.
    within_mm: f64,
    /// The wanted errors, root mean square: direction, degrees; |F|, mN; place, µm.
    wanted: [f64; 3],
}

/// The results for contacts within an area.
#[derive(Serialize)]
struct Row {
    area: Area,
    force_mn: u32,
    /// Number of dots that are not seen.
    lost: u32,
    /// Percentage that the found load explains.
    kept: f64,
    /// Root mean square and 95th percentile of the direction's error, degrees.
    direction_deg: [f64; 2],
    /// Root mean square of the errors of |F|, mN, and of the place, µm.
    magnitude_mn: f64,
    place_um: f64,
    /// The stated standard uncertainties, root mean square, in the same units: direction, |F|,
    /// place.
    stated: [f64; 3],
    /// Percentage within the stated 95 %: direction, |F|, place.
    within: [f64; 3],
}

/// Errors of a found load, and its stated standard uncertainties: direction, degrees; |F|, mN;
/// place, µm.
#[derive(Clone)]
struct Found {
    errors: [f64; 3],
    sigma: [f64; 3],
}

/// The simulated sensor, and its film run forwards.
struct Bench<'a> {
    camera: &'a Camera,
    film: Film,
    forward: Forward<'a>,
    mounting: Mounting,
}

impl DotsStudy {
    /// Runs the study.
    pub fn run(&self) -> Result<()> {
        let (rows, about) = self.rows(&FORCES_MN)?;
        let frames = frames::rows(self.layout, self.frames)?;
        if self.json {
            println!("{}", serde_json::json!({ "rows": rows, "frames": frames }));
            return Ok(());
        }
        let mut text = format!(
            "{about}\n\n\
             | {WANTED_MN} mN, all dots seen | direction, wanted | \\|F\\|, wanted | \
             place, wanted |\n|--:|--:|--:|--:|\n"
        );
        let of_wanted = rows
            .iter()
            .filter(|row| row.force_mn == WANTED_MN && row.lost == 0);
        text.extend(of_wanted.map(Row::beside_wanted));
        text += "\n| within | dots lost | force | explained | direction, rms and 95 % | \\|F\\| | \
                 place | stated | within the stated 95 % |\n\
                 |--:|--:|--:|--:|--:|--:|--:|--:|--:|\n";
        text.extend(rows.iter().map(Row::line));
        text += "\n## Frames\n\n";
        text += frames::Row::HEAD;
        text.extend(frames.iter().map(frames::Row::line));
        print!("{text}");
        page::write("dots.md", include_str!("page.md"), &text)
    }

    /// The results at these forces, mN, and a sentence about the tables.
    fn rows(&self, forces_mn: &[u32]) -> Result<(Vec<Row>, String)> {
        let camera = Camera::new(Preset::Ov7725, 320, 240)?;
        let (spec, left) = of_layout(self.layout, STEPS, NOISE_PX, &camera)?;
        let bytes = spec.to_bytes();
        let forward = Forward::parse(&bytes).map_err(|error| anyhow!("{error}"))?;
        let dots = forward.tables.dots();
        let (kib, left) = (bytes.len() / 1024, left * camera.focal_px());
        let about = format!(
            "{dots} dots: tables of {kib} KiB, within {left:.4} px of the simulated film (root \
             mean square)."
        );
        let bench = Bench {
            camera: &camera,
            film: Film::default().with_layout(self.layout)?,
            mounting: Mounting {
                per_px: [1.0 / camera.focal_px() as f32, 0.0],
                beside_mm: Markers::defaults(dots),
            },
            forward,
        };
        let mut rows = Vec::new();
        let most_mm = bench.film.most_place_mm();
        for area in AREAS.iter().filter(|area| area.within_mm <= most_mm) {
            for lost in [0, 1] {
                for force_mn in forces_mn {
                    rows.push(self.row(&bench, area, *force_mn, lost)?);
                }
            }
        }
        Ok((rows, about))
    }

    fn row(&self, bench: &Bench<'_>, area: &Area, force_mn: u32, lost: u32) -> Result<Row> {
        let contacts = (0..self.contacts).into_par_iter();
        let found = contacts.map(|number| {
            let number = u64::from(number) + 1_000 * u64::from(force_mn);
            bench.contact(number, area, f64::from(force_mn) * 1e-3, lost)
        });
        let all = found.collect::<Result<Vec<Option<Found>>>>()?;
        let found: Vec<&Found> = all.iter().flatten().collect();
        let count = found.len().max(1) as f64;
        let root_mean_square = |of: &dyn Fn(&Found) -> f64| {
            let squares = found.iter().map(|found| of(found) * of(found));
            (squares.sum::<f64>() / count).sqrt()
        };
        let rms = |k: usize| root_mean_square(&|found| found.errors[k]);
        let mut directions: Vec<f64> = found.iter().map(|found| found.errors[0]).collect();
        directions.sort_by(f64::total_cmp);
        let last = directions.get(directions.len() * 95 / 100).copied();
        let is_within = |k: usize| {
            let within = found.iter().filter(|own| own.errors[k] <= own.limit(k));
            100.0 * within.count() as f64 / count
        };
        Ok(Row {
            area: *area,
            force_mn,
            lost,
            kept: 100.0 * found.len() as f64 / f64::from(self.contacts),
            direction_deg: [rms(0), last.context("no contact is explained")?],
            magnitude_mn: rms(1),
            place_um: rms(2),
            stated: [0, 1, 2].map(|k| root_mean_square(&|found| found.stated(k))),
            within: [0, 1, 2].map(is_within),
        })
    }
}

impl Bench<'_> {
    /// The answer to a contact; `None` if none explains the dots.
    fn contact(&self, number: u64, area: &Area, force_n: f64, lost: u32) -> Result<Option<Found>> {
        let mut random = seeded(number);
        let mut between = |most: f64| random.random_range(-most..most);
        let [alpha, beta] = [TILT_DEG; 2].map(&mut between);
        let place_mm = [area.within_mm; 2].map(&mut between);
        let load = Load::from_angles(force_n, alpha, beta)?.with_offset_mm(place_mm)?;
        let setup = UnitSetup {
            unit: Unit::default(),
            tip_radius_mm: NOMINAL_RADIUS_MM,
            camera: self.camera,
        };
        let dots = self.forward.tables.dots();
        let mut moved = Column::defaults(2 * dots);
        let mut seen: Vec<bool> = (0..dots)
            .map(|dot| setup.sees(&self.film, &load, dot))
            .collect();
        for _ in 0..lost {
            seen[random.random_range(0..dots)] = false;
        }
        let variance = (self.mounting.scale() * NOISE_PX as f32).powi(2);
        let noise = List::from_fn(dots, |_| [variance, 0.0, variance]);
        let unseen = (0..dots).filter(|dot| !seen[*dot]);
        let unseen = unseen.fold(Lost::NONE, Lost::and);
        for (dot, moved) in moved.as_chunks_mut().0.iter_mut().enumerate() {
            let motion = setup.moved_by(&self.film, &load, dot)?;
            let noise = self.mounting.scale() as f64 * NOISE_PX;
            let measured = motion.map(|part| (part + noise * normal(&mut random)) as f32);
            *moved = if seen[dot] { measured } else { [0.0; 2] };
        }
        let observed = Observed {
            moved,
            noise,
            lost: unseen,
            drift: None,
            hanging: None,
            pressing: None,
            wide: None,
        };
        let unknown = self.forward.unknown(true);
        let found = (self.forward).estimate(&observed, &self.mounting, unknown, Start::Anywhere);
        Ok(self.judged(&found, &load))
    }

    fn judged(&self, found: &Estimate, load: &Load) -> Option<Found> {
        let strength = self.forward.strength(true);
        let sigma = found.sigma(&strength).filter(|_| found.is_explained())?;
        let direction = found.pose.direction().map(f64::from);
        let magnitude_n = f64::from(self.forward.stiffness.magnitude_n(found.pose.size));
        let [x, y] = [0, 1].map(|i| f64::from(found.pose.place_mm[i]) - load.offset_mm()[i]);
        let true_direction = load.vector_n().map(|part| part / load.magnitude_n());
        Some(Found {
            errors: [
                angle_deg(direction, true_direction).unwrap_or(180.0),
                1e3 * (magnitude_n - load.magnitude_n()).abs(),
                1e3 * x.hypot(y),
            ],
            sigma: [
                f64::from(sigma.direction).to_degrees(),
                1e3 * f64::from(sigma.magnitude_n),
                1e3 * f64::from(sigma.place_mm),
            ],
        })
    }
}

impl Found {
    /// The stated standard uncertainty, of both axes together for direction and place; the sensor
    /// states that of a place for each axis.
    fn stated(&self, k: usize) -> f64 {
        let times = [1.0, 1.0, std::f64::consts::SQRT_2];
        times[k] * self.sigma[k]
    }

    /// The largest error within the stated 95 %. Of two axes, 95 of 100 errors are within 1.731
    /// times what is stated.
    fn limit(&self, k: usize) -> f64 {
        [1.731, WITHIN_95, 1.731][k] * self.stated(k)
    }
}

impl Row {
    fn line(&self) -> String {
        let [rms, last] = self.direction_deg;
        let [direction_deg, magnitude_mn, place_um] = self.stated;
        let [direction, magnitude, place] = self.within;
        format!(
            "| ±{} mm | {} | {} mN | {:.1} % | {rms:.3}°, {last:.3}° | {:.3} mN | {:.1} µm | \
             {direction_deg:.3}°, {magnitude_mn:.3} mN, {place_um:.1} µm | \
             {direction:.0}, {magnitude:.0}, {place:.0} % |\n",
            self.area.within_mm,
            self.lost,
            self.force_mn,
            self.kept,
            self.magnitude_mn,
            self.place_um,
        )
    }

    fn beside_wanted(&self) -> String {
        let ([rms, _], [direction, magnitude, place]) = (self.direction_deg, self.area.wanted);
        format!(
            "| ±{} mm | {rms:.3}°, {direction}° | {:.3} mN, {magnitude} mN | {:.1} µm, {place} µm \
             |\n",
            self.area.within_mm, self.magnitude_mn, self.place_um,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Contacts are found without a network, with an honest uncertainty; also with a dot lost, and
    /// near the film's edge, where few of them make most of the mean square.
    #[test]
    #[ignore = "40 s: the table of 60 contacts"]
    fn eight_dots_tell_a_contact() {
        let study = DotsStudy {
            layout: "8v".parse().unwrap(),
            contacts: 60,
            frames: 0,
            json: true,
        };
        for row in study.rows(&[WANTED_MN]).unwrap().0 {
            let (within_mm, wanted) = (row.area.within_mm, row.area.wanted);
            let rms = [row.direction_deg[0], row.magnitude_mn, row.place_um];
            assert!(row.kept >= 95.0, "±{within_mm} mm: {} %", row.kept);
            for (rms, wanted) in rms.into_iter().zip(wanted) {
                // Less exact than wanted of all dots: near the edge, and with a dot lost.
                let times = if within_mm > 6.0 || row.lost > 0 {
                    2.0
                } else {
                    1.5
                };
                assert!(rms < times * wanted, "±{within_mm} mm: {rms}, {wanted}");
            }
            assert!(
                row.within.iter().all(|part| *part >= 88.0),
                "{:?}",
                row.within
            );
        }
    }
}
