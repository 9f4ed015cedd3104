//! A sweep as tables in Markdown, as CSV and as a plot.

use std::fmt::Write;

use hivtac_calibration::evaluation::plot::{Axis, COLOURS, Plot, Scale};

use super::pick::{Limits, best, front};
use super::plan::{
    Estimator, JUDGED_MM, JUDGED_N, Numbers, RENDERED, USUAL_STEPS, firmware_size, has_camera,
};
use super::results::Results;
use super::table::{Configuration, Mean, Reach, words};

/// What the document holds between its marks.
pub fn markdown(results: &Results, configurations: &[Configuration]) -> String {
    let mut text = about(results);
    let _ = write!(
        text,
        "\n### The Pareto front\n\nWhat a supported camera delivers, and nothing else beats in \
         both time and direction error from 50 mN up:\n\n{}",
        table(&front(configurations, Reach::Camera))
    );
    let _ = write!(
        text,
        "\nThe same of what the firmware does as it is:\n\n{}",
        table(&front(configurations, Reach::Firmware))
    );
    let here: Vec<&Configuration> = configurations
        .iter()
        .filter(|c| c.size == firmware_size())
        .collect();
    let [width, height] = firmware_size();
    let _ = write!(
        text,
        "\n### Every network at {width}×{height}\n\n{}",
        table(&here)
    );
    let _ = write!(
        text,
        "\n### Every size, behind it the same network and steps\n\n{}",
        sizes(configurations)
    );
    let _ = write!(text, "\n### The default\n\n{}", default(configurations));
    text
}

fn about(results: &Results) -> String {
    let plan = &results.plan;
    let [epochs, rounded] = plan.epochs;
    let [paper_epochs, paper_rounded] = plan.paper_epochs;
    let mut text = format!(
        "**Simulated** frames of a tip anywhere within ±{} mm, contact reading `force`, |F| to {} \
         N, angles to ±{}°: {} of each size, in {} parts. Each of {} seeds trains without one part \
         and is judged on it, on the frames up to {JUDGED_N} N and ±{JUDGED_MM} mm. Networks: \
         {epochs} passes over the data in floats, then {rounded} with the chip's rounding for each \
         arithmetic; 512-512-512: one seed, {paper_epochs} and {paper_rounded} passes. Intervals \
         (±) hold the mean of all seeds with 95 %, by Student's t.\n\n\
         | frames | of | binary: rejected | weighted: rejected |\n\
         |---|---:|---:|---:|\n",
        RENDERED.place_mm, RENDERED.force_n, RENDERED.alpha_deg, plan.rows, plan.parts, plan.seeds
    );
    for (size, seen) in &results.seen {
        let [a, b] = seen.rejected;
        let _ = writeln!(text, "| {} | {} | {a} | {b} |", frame(*size), seen.frames);
    }
    text
}

fn frame([width, height]: [u16; 2]) -> String {
    let mark = if has_camera([width, height]) {
        ""
    } else {
        " (no camera)"
    };
    format!("{width}×{height}{mark}")
}

fn interval(mean: &Mean, digits: usize) -> String {
    let value = mean.value;
    match mean.half_width {
        Some(half) => format!("{value:.digits$} ± {half:.digits$}"),
        None => format!("{value:.digits$}"),
    }
}

fn grouped(number: i64) -> String {
    let digits = number.to_string();
    let groups: Vec<&str> = digits
        .as_bytes()
        .rchunks(3)
        .rev()
        .filter_map(|group| std::str::from_utf8(group).ok())
        .collect();
    groups.join(",")
}

const HEAD: &str = "| frame | centroids | network | numbers | steps | run forwards | direction ≥ \
                    50 mN, ° | all, ° | \\|F\\| RMSE, mN | place, µm | worst: °, mN | unexplained \
                    | instructions | modelled cycles | µs | per second | latency, µs | flash, KB | \
                    RAM, KB |\n\
                    |---|---|---|---|---:|---:|---:|---:|---:|---:|---:|\
                    ---:|---:|---:|---:|---:|---:|---:|---:|\n";

fn table(configurations: &[&Configuration]) -> String {
    let rows = configurations.iter().map(|c| row(c));
    HEAD.to_owned() + &rows.collect::<String>()
}

fn row(c: &Configuration) -> String {
    let cost = match &c.cost {
        None => "| – | – | – | – | – | – | – |".to_owned(),
        Some(cost) => format!(
            "| {} | {} | {:.0} | {} | {:.0} | {:.0} | {:.0} |",
            grouped(cost.instructions),
            grouped(cost.cycles),
            cost.microseconds(),
            grouped(cost.rate().round() as i64),
            cost.latency_microseconds(),
            cost.flash as f64 / 1e3,
            cost.ram as f64 / 1e3,
        ),
    };
    format!(
        "| {} | {} | {} | {} | {} | {:.2} | {} | {} | {} | {} | {:.2}, {:.2} | {:.2} % {cost}\n",
        frame(c.size),
        words(c.centroid),
        c.estimator,
        c.numbers,
        c.steps,
        c.looks,
        interval(&c.strong_direction_deg, 3),
        interval(&c.direction_deg, 2),
        interval(&c.force_rmse_mn, 3),
        interval(&c.place_rmse_um, 1),
        c.worst[0],
        c.worst[1],
        1e2 * c.unexplained,
    )
}

/// One estimator at every size.
fn sizes(configurations: &[Configuration]) -> String {
    let estimator = default_estimator();
    let mut text = format!(
        "{estimator}, {}, {USUAL_STEPS} step.\n\n\
         | frame | centroids | direction ≥ 50 mN, ° | all, ° | \\|F\\| RMSE, mN | place, µm | \
         cycles | µs |\n\
         |---|---|---:|---:|---:|---:|---:|---:|\n",
        Numbers::Int8PerChannel
    );
    let of_it = configurations
        .iter()
        .filter(|c| c.estimator == estimator && c.numbers == Numbers::Int8PerChannel)
        .filter(|c| c.steps == USUAL_STEPS);
    for c in of_it {
        let _ = write!(
            text,
            "| {} | {} | {} | {} | {} | {} |",
            frame(c.size),
            words(c.centroid),
            interval(&c.strong_direction_deg, 3),
            interval(&c.direction_deg, 2),
            interval(&c.force_rmse_mn, 3),
            interval(&c.place_rmse_um, 1)
        );
        if let Some(cost) = c.cost {
            let (cycles, time) = (grouped(cost.cycles), cost.microseconds());
            let _ = write!(text, " {cycles} | {time:.0} |");
        }
        text.push('\n');
    }
    text
}

fn default_estimator() -> Estimator {
    Estimator {
        hidden: hivtac_calibration::train::Options::default().hidden,
    }
}

fn default(configurations: &[Configuration]) -> String {
    match best(configurations, &Limits::default()) {
        Ok(best) => format!("Without limits the pick is **{best}**.\n"),
        Err(error) => format!("Without limits there is no pick: {error}.\n"),
    }
}

/// Every configuration.
pub fn csv(configurations: &[Configuration]) -> String {
    let mut text = "width,height,centroid,network,numbers,steps,looks,reach,\
                    direction_deg,direction_deg_95,strong_direction_deg,strong_direction_deg_95,\
                    force_rmse_mn,force_rmse_mn_95,place_rmse_um,place_rmse_um_95,\
                    worst_strong_direction_deg,worst_force_mn,unexplained,instructions,\
                    modelled_cycles,microseconds,per_second,latency_microseconds,\
                    flash_bytes,ram_bytes\n"
        .to_owned();
    for c in configurations {
        let reach = match c.reach() {
            Reach::None => "none",
            Reach::Camera => "camera",
            Reach::Firmware => "firmware",
        };
        let [width, height] = c.size;
        let (centroid, network, numbers) = (words(c.centroid), &c.estimator, c.numbers);
        let (steps, looks) = (c.steps, c.looks);
        let _ = write!(
            text,
            "{width},{height},{centroid},{network},{numbers},{steps},{looks:.3},{reach}"
        );
        let means = [
            &c.direction_deg,
            &c.strong_direction_deg,
            &c.force_rmse_mn,
            &c.place_rmse_um,
        ];
        for mean in means {
            let half = mean
                .half_width
                .map_or(String::new(), |half| format!("{half:.5}"));
            let _ = write!(text, ",{:.5},{half}", mean.value);
        }
        let _ = write!(
            text,
            ",{:.5},{:.5},{:.5}",
            c.worst[0], c.worst[1], c.unexplained
        );
        let _ = match &c.cost {
            None => writeln!(text, ",,,,,,,"),
            Some(cost) => writeln!(
                text,
                ",{},{},{:.1},{:.0},{:.1},{},{}",
                cost.instructions,
                cost.cycles,
                cost.microseconds(),
                cost.rate(),
                cost.latency_microseconds(),
                cost.flash,
                cost.ram
            ),
        };
    }
    text
}

/// Direction error from 50 mN up against modelled cycles, with the fronts.
pub fn plot(configurations: &[Configuration]) -> String {
    let place = |c: &Configuration| Some((c.cost?.cycles as f64, c.strong_direction_deg.value));
    let placed: Vec<_> = configurations.iter().filter_map(place).collect();
    let x = Axis::over(
        "modelled cycles of a frame",
        placed.iter().map(|p| p.0),
        Scale::Log,
    );
    let y = Axis::over(
        "mean direction error from 50 mN up, ° (simulated)",
        placed.iter().map(|p| p.1),
        Scale::Log,
    );
    let mut plot = Plot::new("Speed and accuracy", x, y);
    let mut sizes: Vec<[u16; 2]> = configurations.iter().map(|c| c.size).collect();
    sizes.dedup();
    let mut colours = COLOURS.into_iter().cycle();
    for size in sizes {
        let colour = colours.next().unwrap_or("black");
        let of_size = configurations.iter().filter(|c| c.size == size);
        plot.points(&of_size.filter_map(place).collect::<Vec<_>>(), 3.0, colour);
        plot.name(&frame(size), colour);
    }
    for (reach, name) in [
        (Reach::Camera, "front: a camera delivers"),
        (Reach::Firmware, "front: the firmware does"),
    ] {
        let colour = colours.next().unwrap_or("black");
        let points: Vec<_> = front(configurations, reach)
            .into_iter()
            .filter_map(place)
            .collect();
        plot.line(&points, colour);
        plot.name(name, colour);
    }
    plot.to_svg()
}

#[cfg(test)]
mod tests {
    use super::super::pick::tests::made;
    use super::*;
    use crate::document::replaced;

    #[test]
    fn tables_say_what_is_there_and_mark_what_cannot_be() {
        let mut all = vec![
            made([320, 240], 480_000, [0.25, 0.1]),
            made([800, 600], 1_200_000, [0.125, 0.1]),
            made([320, 240], 1, [0.0625, 0.1]),
        ];
        all[2].cost = None;
        all[2].numbers = Numbers::F32;
        let text = table(&all.iter().collect::<Vec<_>>());
        assert!(
            text.contains("| 480,000 | 1000 | 1,000 |")
                || text.contains("| 480,000 | 1000 | 1,000 | 200 |"),
            "{text}"
        );
        assert!(
            text.contains("800×600 (no camera)") && text.contains("| f32 |"),
            "{text}"
        );
        assert!(text.contains("0.250 ± 0.025"), "{text}");
        assert!(default(&all).contains("320×240**"));
        assert_eq!(csv(&all).lines().count(), 4);
        let columns: Vec<usize> = csv(&all)
            .lines()
            .map(|line| line.split(',').count())
            .collect();
        assert_eq!(columns, [26; 4]);
        let svg = plot(&all);
        assert!(svg.contains("800×600 (no camera)") && svg.ends_with("</svg>\n"));
    }

    #[test]
    fn only_what_is_generated_changes() {
        let document = "a\n<!-- tradeoff: begin, by x -->\nold\n<!-- tradeoff: end -->\nb\n";
        let new = replaced(document, "tradeoff", "new").unwrap();
        assert_eq!(new, document.replace("\nold\n", "\n\nnew\n\n"));
        assert_eq!(replaced("no marks", "tradeoff", "new"), None);
    }
}
