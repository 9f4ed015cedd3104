//! Presses the film once and prints the motion of tip and markers and the camera's picture of it.
//!
//! `cargo run --release -p hivtac-shell --example solve -- --force-n 0.1 --alpha-deg 5`

use std::error::Error;
use std::time::Instant;

use clap::Parser;
use hivtac_shell::{Design, Film, markers, paper_camera, press_load};
use hivtac_twin::film::{Contact, FilmError, Load};

/// Presses the film once.
#[derive(Parser)]
#[command(allow_negative_numbers = true)]
struct Press {
    #[arg(long, default_value_t = 0.1)]
    force_n: f64,
    #[arg(long, default_value_t = 0.0)]
    alpha_deg: f64,
    #[arg(long, default_value_t = 0.0)]
    beta_deg: f64,
    /// force, stick, or slip:0.6
    #[arg(long, default_value = "force")]
    contact: Contact,
    #[arg(long, default_value_t = 0.0)]
    offset_x_mm: f64,
    #[arg(long, default_value_t = 0.0)]
    offset_y_mm: f64,
    #[arg(long, default_value_t = Design::default().tip_radius_mm)]
    tip_radius_mm: f64,
    #[arg(long, default_value_t = Design::default().overhang_mm)]
    overhang_mm: f64,
    #[arg(long, default_value_t = Design::default().post_radius_mm)]
    post_radius_mm: f64,
    /// Stiffness of the posts' grip, N/mm³
    #[arg(long, default_value_t = Design::default().post_grip_n_per_mm3)]
    post_grip: f64,
    #[arg(long, default_value_t = Design::default().fineness)]
    fineness: f64,
    #[arg(long, default_value_t = Design::default().law.neo_hooke)]
    neo_hooke: f64,
    #[arg(long, default_value_t = Design::default().law.stiffening)]
    stiffening: f64,
    #[arg(long, default_value_t = Design::default().dot_stiffening)]
    dot_stiffening: f64,
    #[arg(long, default_value_t = Design::default().gauss_points)]
    gauss_points: usize,
    #[arg(long, default_value = "0,0", value_parser = numbers::<2>, allow_hyphen_values = true)]
    stretch: [f64; 2],
    #[arg(long, default_value = "0,0", value_parser = numbers::<2>, allow_hyphen_values = true)]
    thickness_slope: [f64; 2],
    #[arg(long, default_value = "0,0,0", value_parser = numbers::<3>, allow_hyphen_values = true)]
    thickness_curve: [f64; 3],
    #[arg(long, default_value = "0,0,0", value_parser = numbers::<3>, allow_hyphen_values = true)]
    down: [f64; 3],
}

fn main() -> Result<(), Box<dyn Error>> {
    // The reader of the output may close it early.
    sigpipe::reset();
    Press::parse().run()
}

impl Press {
    fn design(&self) -> Design {
        let mut design = Design {
            overhang_mm: self.overhang_mm,
            stretch: self.stretch,
            thickness_slope: self.thickness_slope,
            thickness_curve: self.thickness_curve,
            down: self.down,
            dot_stiffening: self.dot_stiffening,
            post_radius_mm: self.post_radius_mm,
            post_grip_n_per_mm3: self.post_grip,
            fineness: self.fineness,
            gauss_points: self.gauss_points,
            ..Design::default()
        };
        design.law.neo_hooke = self.neo_hooke;
        design.law.stiffening = self.stiffening;
        design
    }

    fn load(&self) -> Result<Load, FilmError> {
        Load::from_angles(self.force_n, self.alpha_deg, self.beta_deg)?
            .with_contact(self.contact)?
            .with_offset_mm([self.offset_x_mm, self.offset_y_mm])?
            .with_tip_radius_mm(self.tip_radius_mm)
    }

    fn run(&self) -> Result<(), Box<dyn Error>> {
        let load = self.load()?;
        let begin = Instant::now();
        let mut film = Film::new(&self.design())?;
        let prepared = begin.elapsed();
        let loaded = press_load(&mut film, &load)?;
        let state = loaded.state;
        let solved = begin.elapsed() - prepared;
        let camera = paper_camera()?;

        let three = |v: [f64; 3]| format!("({:9.4}, {:9.4}, {:9.4})", v[0], v[1], v[2]);
        let rest = film.rest();
        let since_rest = [0, 1, 2].map(|c| state.tip_mm[c] - rest.tip_mm[c]);
        println!("tip depth      {:.4} mm since rest", -since_rest[2]);
        println!("tip rested at  {} mm", three(rest.tip_mm));
        println!("tip moved      {} mm", three(since_rest));
        let [x, y] = loaded.touches_mm;
        println!("tip touches    ({x:9.4}, {y:9.4}) mm of the film at rest");
        println!("force on film  {} N", three(state.force_n));
        println!("posts' force   {} N", three(state.reaction_n));
        for (id, marker) in markers(&film, &state, &camera).iter().enumerate() {
            let [x, y] = marker.seen_px;
            println!(
                "marker {id}: moved {} mm, seen at ({x:8.3}, {y:8.3}) px",
                three(marker.moved_mm)
            );
        }
        println!(
            "{} unknowns, {} Newton steps; prepared in {:.3} s, solved in {:.3} s",
            film.unknowns(),
            state.steps,
            prepared.as_secs_f64(),
            solved.as_secs_f64()
        );
        Ok(())
    }
}

/// Reads numbers with commas between them.
fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let read: Result<Vec<f64>, _> = text.split(',').map(str::parse).collect();
    let read = read.ok().and_then(|read| read.try_into().ok());
    read.ok_or_else(|| format!("not {N} numbers with commas between them"))
}
