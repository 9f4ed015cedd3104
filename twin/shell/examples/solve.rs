//! Presses the film once and prints the motion of tip and markers and the camera's picture of it.
//!
//! `cargo run --release -p hivtac-shell --example solve -- --force-n 0.1 --alpha-deg 5`

use std::process::ExitCode;
use std::time::Instant;

use hivtac_shell::{Design, Film, markers, paper_camera, press_load};
use hivtac_twin::film::{Contact, FilmError, Load};

const USAGE: &str = "solve [--force-n 0.1] [--alpha-deg 0] [--beta-deg 0] [--contact \
                     force|stick|slip:0.6] [--offset-x-mm 0] [--offset-y-mm 0] [--overhang-mm 0] \
                     [--post-radius-mm 1.5] [--post-grip 20] [--tip-radius-mm 0.5] [--fineness 1] \
                     [--stretch 0.012,0.01] [--neo-hooke 1] [--stiffening 0.1] [--thickness-slope \
                     0.05,0] [--thickness-curve 0,0,0.05] [--down 0,0,-1] [--dot-stiffening 0.5] \
                     [--gauss-points 3]";

/// The press that the command line describes.
struct Request {
    tip_radius_mm: f64,
    design: Design,
    force_n: f64,
    alpha_deg: f64,
    beta_deg: f64,
    contact: Contact,
    offset_mm: [f64; 2],
}

fn main() -> ExitCode {
    // The reader of the output may close it early.
    sigpipe::reset();
    match Request::parse(std::env::args().skip(1)).and_then(|request| request.run()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}

impl Request {
    fn parse(mut words: impl Iterator<Item = String>) -> Result<Request, String> {
        let mut request = Request {
            tip_radius_mm: Design::default().tip_radius_mm,
            design: Design::default(),
            force_n: 0.1,
            alpha_deg: 0.0,
            beta_deg: 0.0,
            contact: Contact::Force,
            offset_mm: [0.0; 2],
        };
        while let Some(name) = words.next() {
            let value = words.next().ok_or(format!("{name}: no value\n{USAGE}"))?;
            request.set(&name, &value)?;
        }
        Ok(request)
    }

    fn set(&mut self, name: &str, value: &str) -> Result<(), String> {
        if name == "--contact" {
            self.contact = value.parse().map_err(|why: FilmError| why.to_string())?;
            return Ok(());
        }
        let design = &mut self.design;
        match name {
            "--stretch" => return numbers(name, value, &mut design.stretch),
            "--thickness-slope" => return numbers(name, value, &mut design.thickness_slope),
            "--thickness-curve" => return numbers(name, value, &mut design.thickness_curve),
            "--down" => return numbers(name, value, &mut design.down),
            "--gauss-points" => {
                design.gauss_points = value
                    .parse()
                    .map_err(|_| format!("{name} {value}: not a number of points"))?;
                return Ok(());
            }
            _ => {}
        }
        let slot = match name {
            "--force-n" => &mut self.force_n,
            "--alpha-deg" => &mut self.alpha_deg,
            "--beta-deg" => &mut self.beta_deg,
            "--offset-x-mm" => &mut self.offset_mm[0],
            "--offset-y-mm" => &mut self.offset_mm[1],
            "--overhang-mm" => &mut design.overhang_mm,
            "--post-radius-mm" => &mut design.post_radius_mm,
            "--post-grip" => &mut design.post_grip_n_per_mm3,
            "--neo-hooke" => &mut design.law.neo_hooke,
            "--stiffening" => &mut design.law.stiffening,
            "--dot-stiffening" => &mut design.dot_stiffening,
            "--tip-radius-mm" => &mut self.tip_radius_mm,
            "--fineness" => &mut design.fineness,
            _ => return Err(format!("{name}: unknown\n{USAGE}")),
        };
        *slot = value
            .parse()
            .map_err(|_| format!("{name} {value}: not a number"))?;
        Ok(())
    }

    fn load(&self) -> Result<Load, FilmError> {
        Load::from_angles(self.force_n, self.alpha_deg, self.beta_deg)?
            .with_contact(self.contact)?
            .with_offset_mm(self.offset_mm)?
            .with_tip_radius_mm(self.tip_radius_mm)
    }

    fn run(&self) -> Result<(), String> {
        let load = self.load().map_err(|error| error.to_string())?;
        let begin = Instant::now();
        let mut film = Film::new(&self.design).map_err(|error| error.to_string())?;
        let prepared = begin.elapsed();
        let loaded = press_load(&mut film, &load).map_err(|error| error.to_string())?;
        let state = loaded.state;
        let solved = begin.elapsed() - prepared;
        let camera = paper_camera().map_err(|error| error.to_string())?;

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
fn numbers<const N: usize>(name: &str, value: &str, slots: &mut [f64; N]) -> Result<(), String> {
    let read: Result<Vec<f64>, _> = value.split(',').map(str::parse).collect();
    *slots = read
        .ok()
        .and_then(|read| read.try_into().ok())
        .ok_or(format!(
            "{name} {value}: not {N} numbers with commas between them"
        ))?;
    Ok(())
}
