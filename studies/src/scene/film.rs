//! `scene film`: the film under one load, with the places of tip and markers and the markers'
//! images.

use anyhow::Result;
use clap::{Args, ValueEnum};
use hivtac_twin::film::Film;
use hivtac_twin::{Camera, Contact, Disc, Layout, Load, Preset, disc_motion};
use serde_json::{Value, json};

/// The frame size for the printed pixels.
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
    /// The dots: a layout's name (4, 8v).
    #[arg(long, value_name = "NAME", default_value = "4")]
    layout: String,
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
struct Answer {
    tip_mm: [f64; 3],
    /// The tip's force on the film, N.
    force_n: [f64; 3],
    /// Mean displacement of each marker over its disc, mm, and the centroid of its image, px.
    markers: Vec<([f64; 3], [f64; 2])>,
}

impl FilmArgs {
    pub(super) fn run(&self) -> Result<()> {
        let load = Load::from_angles(self.force_n, self.alpha_deg, self.beta_deg)?;
        let load = load.with_contact(self.contact)?;
        let load = load.with_offset_mm(self.offset_mm)?;
        let camera = Camera::new(self.preset, SIZE[0], SIZE[1])?;
        let layout: Layout = self.layout.parse()?;
        let answer = match self.solver {
            Solver::Reduced => self.reduced(&load, &layout, &camera)?,
            Solver::Full => self.full(&load, &layout, &camera)?,
        };
        if self.json {
            println!("{}", serde_json::to_string_pretty(&answer.to_json())?);
        } else {
            print!("{}", answer.to_text());
        }
        Ok(())
    }

    fn reduced(&self, load: &Load, layout: &Layout, camera: &Camera) -> Result<Answer> {
        let film = Film::default().with_down(self.down)?.with_layout(*layout)?;
        film.check(load)?;
        let pressed = film.press(load);
        let seen = |disc: &Disc| disc.centroid_px(|rest| pressed.displacement(rest), camera);
        let moved = pressed.discs.iter().map(|disc| disc.moved_mm);
        Ok(Answer {
            tip_mm: pressed.tip_mm,
            force_n: pressed.force_n,
            markers: moved.zip(discs(layout).iter().map(seen)).collect(),
        })
    }

    fn full(&self, load: &Load, layout: &Layout, camera: &Camera) -> Result<Answer> {
        use hivtac_shell::{Design, Film, press_load};

        let mut film = Film::new(&Design {
            down: self.down.unwrap_or_default(),
            ..Design::default()
        })?;
        let state = press_load(&mut film, load)?.state;
        let moved = |rest| film.displacement(&state, rest);
        let marker = |disc: &Disc| {
            (
                disc_motion(moved, disc).moved_mm,
                disc.centroid_px(moved, camera),
            )
        };
        Ok(Answer {
            tip_mm: state.tip_mm,
            force_n: state.force_n,
            markers: discs(layout).iter().map(marker).collect(),
        })
    }
}

/// Returns a layout's dots.
fn discs(layout: &Layout) -> Vec<Disc> {
    let radius_mm = layout.diameter_mm() / 2.0;
    let centres = layout.centres_mm().into_iter();
    let disc = |centre_mm| Disc {
        centre_mm,
        radius_mm,
    };
    centres.map(disc).collect()
}

impl Answer {
    fn tip_depth_mm(&self) -> f64 {
        // Avoids −0 at rest.
        0.0 - self.tip_mm[2]
    }

    fn to_json(&self) -> Value {
        let marker = |(id, ([dx, dy, dz], [x, y])): (usize, &([f64; 3], [f64; 2]))| json!({ "id": id, "dx_mm": dx, "dy_mm": dy, "dz_mm": dz, "x_px": x, "y_px": y });
        let markers: Vec<Value> = self.markers.iter().enumerate().map(marker).collect();
        json!({ "tip_depth_mm": self.tip_depth_mm(), "markers": markers })
    }

    fn to_text(&self) -> String {
        let three = |[x, y, z]: [f64; 3], digits: usize| {
            format!("({x:.digits$}, {y:.digits$}, {z:.digits$})")
        };
        let mut text = format!(
            "tip depth      {:.4} mm; the tip moved {} mm\nforce on film  {} N\n\n\
             marker   dx, mm   dy, mm   dz, mm  at 800×600: x, px    y, px\n",
            self.tip_depth_mm(),
            three(self.tip_mm, 4),
            three(self.force_n, 5)
        );
        for (id, ([dx, dy, dz], [x, y])) in self.markers.iter().enumerate() {
            text += &format!("{id:6} {dx:8.4} {dy:8.4} {dz:8.4} {x:18.3} {y:8.3}\n");
        }
        text
    }
}
