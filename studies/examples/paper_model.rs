//! The paper's analytic model in numbers: `cargo run --release -p hivtac-studies --example
//! paper_model`.
//!
//! Prints the mean of R* in each reading of the paper, where disp_N peaks, and the errors of the
//! model in `f64` and `f32` against the reference table. With `--figure8 FILE` it also writes
//! Figure 8 as an SVG picture.

#[path = "../tests/paper_reference/picture.rs"]
mod picture;
#[path = "../tests/paper_reference/readings.rs"]
mod readings;
#[path = "../tests/paper_reference/scan.rs"]
mod scan;
#[path = "../tests/paper_reference/table.rs"]
mod table;

use std::error::Error;

use hivtac_studies::paper_model::{Design, OutOfDomain, PinholeDistance};

const READINGS: [PinholeDistance; 2] = [PinholeDistance::Slant, PinholeDistance::Axial];
/// Cells along each axis for the means.
const MEAN_CELLS: usize = 700;

fn main() -> Result<(), Box<dyn Error>> {
    // Whoever reads the output may have enough of it.
    sigpipe::reset();
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let figure8 = match arguments.as_slice() {
        [] => None,
        [flag, file] if flag == "--figure8" => Some(file),
        _ => return Err("usage: paper_model [--figure8 FILE]".into()),
    };
    print_means()?;
    print_peaks()?;
    let rows = table::rows();
    print_errors(&rows);
    print_second_line(&rows);
    if let Some(file) = figure8 {
        std::fs::write(file, picture::figure8_svg()?).map_err(|why| format!("{file}: {why}"))?;
        println!("\nwrote {file}");
    }
    Ok(())
}

fn print_means() -> Result<(), OutOfDomain> {
    println!("mean of R* over z, PP' in [0, a/2] (the paper prints 0.2655)\n");
    println!("{:42} {:>9} {:>11}", "reading", "positive", "with zeros");
    for d_ph in READINGS {
        let reading = format!("{d_ph:?}").to_lowercase();
        let name = |what: &str| format!("{reading} D_ph, {what}");
        for (what, design) in [
            ("eq. 24", Design::paper(d_ph)),
            ("disp_S as seen (f/h)", readings::shear_as_seen(d_ph)),
        ] {
            let mean = design.mean_best_r(MEAN_CELLS)?;
            println!(
                "{:42} {:9.4} {:11.4}",
                name(what),
                mean.positive,
                mean.with_zeros
            );
        }
        let epsilon = format!("ε = {} mm", readings::EPSILON_MM);
        for (what, [positive, with_zeros]) in [
            ("eq. 24, scanned", readings::as_printed(d_ph)),
            ("z of the centre", readings::depth_of_the_centre(d_ph)),
            (&epsilon, readings::constant_epsilon(d_ph)),
        ] {
            println!("{:42} {positive:9.3} {with_zeros:11.3}", name(what));
        }
        let [low, high] = readings::over_grids(d_ph);
        let range = format!("{low:.4} to {high:.4}");
        println!("{:42} {range}", name("5 to 101 points a side"));
    }
    Ok(())
}

fn print_peaks() -> Result<(), OutOfDomain> {
    println!("\ndisp_N along the diagonal\n");
    println!(
        "{:6} {:>8} {:>8} {:>11} {:>14}",
        "D_ph", "z, mm", "peak, R", "there, mm", "in corner, mm"
    );
    for d_ph in READINGS {
        let design = Design::<f64>::paper(d_ph);
        for z in [1e-6, 1.0, 3.5, 7.0] {
            let r = design.best_r(z, 0.0)?.unwrap_or(0.0);
            let peak = design.disp_n_mm(r * design.pn_mm(), z)?;
            let corner = design.disp_n_mm(design.pn_mm(), z)?;
            let name = format!("{d_ph:?}").to_lowercase();
            println!("{name:6} {z:8} {r:8.4} {peak:11.3e} {corner:14.3e}");
        }
    }
    Ok(())
}

fn print_errors(rows: &[table::Row]) {
    println!("\nlargest error against the table: relative, but of R* |Δ(R*²)|\n");
    println!("{:12} {:>5} {:>9} {:>9}", "", "rows", "f64", "f32");
    let quantities = ["r_m", "r_m_pressed", "disp_n", "disp_s", "d_ph", "quality"];
    for quantity in quantities.into_iter().chain(["best_r"]) {
        let (count, double, single) = table::largest_errors(rows, quantity);
        println!("{quantity:12} {count:5} {double:9.1e} {single:9.1e}");
    }
    let [double, single] = [
        table::error_of_r::<f64>(rows, 0.1),
        table::error_of_r::<f32>(rows, 0.1),
    ];
    println!("{:12} {:>5} {double:9.1e} {single:9.1e}", "R* ≥ 0.1", "");
}

fn print_second_line(rows: &[table::Row]) {
    println!(
        "\nlargest relative error of disp_N in f32 with ε = 0, by its second line and as computed \
         here\n"
    );
    println!("{:>10} {:>12} {:>9}", "z, mm", "second line", "here");
    for exponent in -6..=0 {
        let z = libm::exp10(f64::from(exponent));
        let at_z = |row: &&table::Row| {
            row.quantity == "disp_n" && row.epsilon == 0.0 && (row.z / z - 1.0).abs() < 1e-6
        };
        let largest =
            |error: fn(&table::Row) -> f64| rows.iter().filter(at_z).map(error).fold(0.0, f64::max);
        let second = largest(table::Row::error_of_second_line);
        println!(
            "{z:10} {second:12.1e} {:9.1e}",
            largest(table::Row::error::<f32>)
        );
    }
}
