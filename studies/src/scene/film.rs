//! The film under one load: where tip and markers go, and where the markers are seen.

use anyhow::Result;
use clap::{Args, ValueEnum};
use hivtac_film::Film;
use hivtac_scene::{Camera, Contact, Load, MARKERS, Preset};
use serde::Serialize;

/// The frame size whose pixels are printed.
const SIZE: [u32; 2] = [800, 600];

/// Arguments of `scene film`.
#[derive(Args)]
pub struct FilmArgs {
    /// Geometry preset: paper or ov7725.
    #[arg(long, default_value = "paper")]
    preset: Preset,
    /// |F|, N.
    #[arg(long, default_value_t = 0.1, allow_negative_numbers = true)]
    force_n: f64,
    /// Direction, degrees.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    alpha_deg: f64,
    /// Direction, degrees.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    beta_deg: f64,
    /// What force and direction mean: force (they are the force on the film), stick (the tip's way,
    /// and the force along it) or slip:RATIO (the same, until the tip slides at that ratio of
    /// friction).
    #[arg(long, default_value = "force")]
    contact: Contact,
    /// Where the tip first touches, mm from the middle.
    #[arg(long, default_value = "0,0", value_name = "X,Y", allow_hyphen_values = true,
          value_parser = numbers::<2>)]
    offset_mm: [f64; 2],
    /// Where gravity pulls, a vector of length one in the film's frame; without it the film weighs
    /// nothing.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = numbers::<3>)]
    down: Option<[f64; 3]>,
    /// The tables that scenes use, or the finite elements that they were made from.
    #[arg(long, value_enum, default_value_t = Solver::Reduced)]
    solver: Solver,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Solver {
    /// The tables: some microseconds.
    Reduced,
    /// The finite elements: a second, or some.
    Full,
}

fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let parts: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    let numbers = parts.ok().and_then(|parts| parts.try_into().ok());
    numbers.ok_or_else(|| format!("use {N} numbers, such as 0.1,-0.2"))
}

/// The film under a load.
#[derive(Serialize)]
struct Answer {
    tip_depth_mm: f64,
    #[serde(skip)]
    tip_mm: [f64; 3],
    /// The tip's force on the film, N.
    #[serde(skip)]
    force_n: [f64; 3],
    markers: [Marker; 4],
}

/// How one marker moved, the mean over its disc, and the centroid of its image.
#[derive(Serialize)]
struct Marker {
    id: usize,
    dx_mm: f64,
    dy_mm: f64,
    dz_mm: f64,
    x_px: f64,
    y_px: f64,
}

impl FilmArgs {
    pub(super) fn run(&self) -> Result<()> {
        let load = Load::from_angles(self.force_n, self.alpha_deg, self.beta_deg)?;
        let load = load.with_contact(self.contact)?;
        let load = load.with_offset_mm(self.offset_mm)?;
        let camera = Camera::new(self.preset, SIZE[0], SIZE[1])?;
        let answer = match self.solver {
            Solver::Reduced => reduced(&load, self.down, &camera)?,
            Solver::Full => full(&load, self.down, &camera)?,
        };
        if self.json {
            println!("{}", serde_json::to_string_pretty(&answer)?);
        } else {
            print!("{}", answer.to_text());
        }
        Ok(())
    }
}

fn reduced(load: &Load, down: Option<[f64; 3]>, camera: &Camera) -> Result<Answer> {
    let film = Film::default().with_down(down)?;
    film.check(load)?;
    let pressed = film.press(load);
    let marker = |id: usize| {
        let seen_px = MARKERS[id].centroid_px(|rest| pressed.displacement(rest), camera);
        Marker::new(id, pressed.discs[id].moved_mm, seen_px)
    };
    let markers = std::array::from_fn(marker);
    Ok(Answer::new(pressed.tip_mm, pressed.force_n, markers))
}

fn full(load: &Load, down: Option<[f64; 3]>, camera: &Camera) -> Result<Answer> {
    use hivtac_shell::{Design, Film, markers, press_load};

    let mut film = Film::new(&Design {
        down: down.unwrap_or_default(),
        ..Design::default()
    })?;
    let state = press_load(&mut film, load)?.state;
    let seen = markers(&film, &state, camera);
    let marker = |id: usize| Marker::new(id, seen[id].moved_mm, seen[id].seen_px);
    let markers = std::array::from_fn(marker);
    Ok(Answer::new(state.tip_mm, state.force_n, markers))
}

impl Marker {
    fn new(id: usize, [dx_mm, dy_mm, dz_mm]: [f64; 3], [x_px, y_px]: [f64; 2]) -> Marker {
        Marker {
            id,
            dx_mm,
            dy_mm,
            dz_mm,
            x_px,
            y_px,
        }
    }
}

impl Answer {
    fn new(tip_mm: [f64; 3], force_n: [f64; 3], markers: [Marker; 4]) -> Answer {
        Answer {
            // Not −0 at rest.
            tip_depth_mm: 0.0 - tip_mm[2],
            tip_mm,
            force_n,
            markers,
        }
    }

    fn to_text(&self) -> String {
        let three = |[x, y, z]: [f64; 3], digits: usize| {
            format!("({x:.digits$}, {y:.digits$}, {z:.digits$})")
        };
        let mut text = format!(
            "tip depth      {:.4} mm; the tip moved {} mm\nforce on film  {} N\n\n\
             marker   dx, mm   dy, mm   dz, mm  at 800×600: x, px    y, px\n",
            self.tip_depth_mm,
            three(self.tip_mm, 4),
            three(self.force_n, 5)
        );
        for m in &self.markers {
            text += &format!(
                "{:6} {:8.4} {:8.4} {:8.4} {:18.3} {:8.3}\n",
                m.id, m.dx_mm, m.dy_mm, m.dz_mm, m.x_px, m.y_px
            );
        }
        text
    }
}
