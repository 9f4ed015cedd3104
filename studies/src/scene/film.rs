//! The film under one load: where tip and markers go, and where the markers are seen.

use std::str::FromStr;

use anyhow::Result;
use clap::{Args, ValueEnum};
use hivtac_twin::film::Film;
use hivtac_twin::{Camera, Contact, Load, MARKERS, Preset};
use serde_json::{Value, json};

/// The frame size that pixels are told for.
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
    contact: ContactArg,
    /// Where the tip first touches, mm from the middle.
    #[arg(
        long,
        default_value = "0,0",
        value_name = "X,Y",
        allow_hyphen_values = true
    )]
    offset_mm: Offset,
    /// Where gravity pulls, a vector of length one in the film's frame; without it the film weighs
    /// nothing.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    down: Option<Down>,
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

#[derive(Clone, Copy, Debug, PartialEq)]
struct ContactArg(Contact);

impl FromStr for ContactArg {
    type Err = String;

    fn from_str(text: &str) -> Result<ContactArg, String> {
        let slip = |ratio: &str| {
            Some(Contact::Slip {
                mu: ratio.parse().ok()?,
            })
        };
        let contact = match text {
            "force" => Some(Contact::Force),
            "stick" => Some(Contact::Stick),
            _ => text.strip_prefix("slip:").and_then(slip),
        };
        let contact = contact.ok_or("use force, stick or slip:RATIO, such as slip:0.6")?;
        Ok(ContactArg(contact))
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Offset([f64; 2]);

impl FromStr for Offset {
    type Err = String;

    fn from_str(text: &str) -> Result<Offset, String> {
        let parsed = text
            .split_once(',')
            .and_then(|(x, y)| Some([x.trim().parse().ok()?, y.trim().parse().ok()?]));
        let offset = parsed.ok_or("use two numbers, such as 0.1,-0.2")?;
        Ok(Offset(offset))
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Down([f64; 3]);

impl FromStr for Down {
    type Err = String;

    fn from_str(text: &str) -> Result<Down, String> {
        let parts: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
        let down = parts.ok().and_then(|parts| parts.try_into().ok());
        Ok(Down(down.ok_or("use three numbers, such as 0,0.6,-0.8")?))
    }
}

/// The film under a load.
struct Answer {
    tip_mm: [f64; 3],
    /// The tip's force on the film, N.
    force_n: [f64; 3],
    markers: [Marker; 4],
}

/// One marker.
struct Marker {
    /// How it moved, the mean over its disc, mm.
    moved_mm: [f64; 3],
    /// The centroid of its image, px.
    seen_px: [f64; 2],
}

impl FilmArgs {
    pub(super) fn run(&self) -> Result<()> {
        let load = Load::from_angles(self.force_n, self.alpha_deg, self.beta_deg)?;
        let load = load.with_contact(self.contact.0)?;
        let load = load.with_offset_mm(self.offset_mm.0)?;
        let camera = Camera::new(self.preset, SIZE[0], SIZE[1])?;
        let answer = match self.solver {
            Solver::Reduced => reduced(&load, self.down, &camera)?,
            Solver::Full => full(&load, self.down, &camera)?,
        };
        if self.json {
            println!("{}", serde_json::to_string_pretty(&answer.to_json())?);
        } else {
            print!("{}", answer.to_text());
        }
        Ok(())
    }
}

fn reduced(load: &Load, down: Option<Down>, camera: &Camera) -> Result<Answer> {
    let film = Film::default().with_down(down.map(|down| down.0))?;
    film.check(load)?;
    let pressed = film.press(load);
    Ok(Answer {
        tip_mm: pressed.tip_mm,
        force_n: pressed.force_n,
        markers: std::array::from_fn(|id| Marker {
            moved_mm: pressed.discs[id].moved_mm,
            seen_px: MARKERS[id].centroid_px(|rest| pressed.displacement(rest), camera),
        }),
    })
}

fn full(load: &Load, down: Option<Down>, camera: &Camera) -> Result<Answer> {
    use hivtac_shell::{Design, Film, markers, press_load};

    let mut film = Film::new(&Design {
        down: down.map_or([0.0; 3], |down| down.0),
        ..Design::default()
    })?;
    let state = press_load(&mut film, load)?.state;
    Ok(Answer {
        tip_mm: state.tip_mm,
        force_n: state.force_n,
        markers: markers(&film, &state, camera).map(|marker| Marker {
            moved_mm: marker.moved_mm,
            seen_px: marker.seen_px,
        }),
    })
}

impl Answer {
    fn tip_depth_mm(&self) -> f64 {
        // Not −0 at rest.
        0.0 - self.tip_mm[2]
    }

    fn to_json(&self) -> Value {
        let marker = |(id, marker): (usize, &Marker)| {
            let ([dx, dy, dz], [x, y]) = (marker.moved_mm, marker.seen_px);
            json!({ "id": id, "dx_mm": dx, "dy_mm": dy, "dz_mm": dz, "x_px": x, "y_px": y })
        };
        json!({
            "tip_depth_mm": self.tip_depth_mm(),
            "markers": self.markers.iter().enumerate().map(marker).collect::<Vec<_>>(),
        })
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
        for (id, marker) in self.markers.iter().enumerate() {
            let ([dx, dy, dz], [x, y]) = (marker.moved_mm, marker.seen_px);
            text += &format!("{id:6} {dx:8.4} {dy:8.4} {dz:8.4} {x:18.3} {y:8.3}\n");
        }
        text
    }
}
