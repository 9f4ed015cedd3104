//! Makes the reduced film's curves and checks them against the full solution.
//!
//! `cargo run --release -p hivtac-film --example reduce -- film/data/force.csv`

use std::hint::black_box;
use std::io::Write;
use std::process::ExitCode;
use std::time::Instant;

use hivtac_film::{Design, Reduced, fit};
use hivtac_scene::Load;

const CHECKS: usize = 60;

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let done = match &words[..] {
        [path] => reduce(path),
        _ => Err("reduce OUT.csv".into()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}

fn reduce(path: &str) -> Result<(), Box<dyn std::error::Error>> {
    let begin = Instant::now();
    let threads = std::thread::available_parallelism()?.get();
    let design = Design::default();
    let curves = fit(&design, threads, progress("curves"))?;
    let check = curves.check(&design, CHECKS, threads, progress("check"))?;
    let seconds = begin.elapsed().as_secs_f64();
    let notes = format!(
        "# The reduced film, contact reading `force`: {} curves (see src/reduced/mod.rs).\n\
         # cargo run --release -p hivtac-film --example reduce -- {path}\n\
         # Against the full solution at {} poses: at most {:.3} px, rms {:.3} px; tip depth within {:.4} mm.\n\
         # motion, powers of (q_r, q_t, o_r, o_t), Chebyshev coefficients in mm\n",
        curves.curves(),
        check.poses,
        check.worst_px,
        check.rms_px,
        check.worst_depth_mm
    );
    std::fs::write(path, format!("{notes}{curves}"))?;
    print!("{notes}");
    println!(
        "{seconds:.0} s on {threads} threads; one evaluation {:.2} µs",
        evaluation_us(&curves)?
    );
    Ok(())
}

/// What one load costs, mean of many.
fn evaluation_us(curves: &Reduced) -> Result<f64, Box<dyn std::error::Error>> {
    const LOADS: u32 = 200_000;
    let begin = Instant::now();
    for k in 0..LOADS {
        let load = Load::from_angles(0.25 * f64::from(k) / f64::from(LOADS), 5.0, -3.0)?;
        black_box(curves.press(&load, [0.1, -0.1])?);
    }
    Ok(begin.elapsed().as_secs_f64() * 1e6 / f64::from(LOADS))
}

/// A line that counts.
fn progress(what: &str) -> impl Fn(usize, usize) + Sync {
    let begin = Instant::now();
    move |done, all| {
        let left = begin.elapsed().as_secs_f64() * (all - done) as f64 / done as f64;
        let end = if done == all { "\n" } else { "" };
        eprint!("\r{what}: {done} of {all}, {left:.0} s left   {end}");
        // A progress that cannot be shown is no reason to stop.
        let _ = std::io::stderr().flush();
    }
}
