//! `hivtac template`: a drawing at true size of where to punch the film and stick the dots.

use crate::output::tell;
use clap::{Args, ValueEnum};
use hivtac_host::failure::Failure;
use hivtac_host::focus::dots;
use hivtac_terms::geometry::{Geometry, Preset};
use serde_json::json;

/// Distance of each post from the film's middle, along x and y, mm, as on the simulated sensor.
const POST_MM: f64 = 14.0;
/// Distance of the film's edge from its middle, along x and y, mm.
const EDGE_MM: f64 = 20.0;
/// Diameter of a hole for an M3 screw, mm.
const HOLE_MM: f64 = 3.2;
/// Length of the ruler that shows whether the print has true size, mm.
const RULER_MM: u32 = 50;
/// Size of the page, mm.
const PAGE_MM: [f64; 2] = [70.0, 76.0];
/// Position of the film's middle on the page, mm.
const MIDDLE_MM: [f64; 2] = [35.0, 26.0];

/// Write a template to print: where the film is punched and the dots are stuck, as SVG
///
/// Example: hivtac template film.svg
#[derive(Args)]
pub struct TemplateArguments {
    /// File to write
    #[arg(value_name = "FILE.svg")]
    file: String,
    /// Whose markers
    #[arg(long, value_name = "paper|ov7725", default_value = "ov7725")]
    preset: Preset,
    /// Which dots: four in a square, or the eight of a model for more force and a wider place
    #[arg(long, value_enum, default_value_t)]
    layout: Dots,
    /// One JSON object instead of a line
    #[arg(long)]
    json: bool,
}

/// The dots on a film.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Dots {
    /// Four, in a square
    #[default]
    #[value(name = "4")]
    Four,
    /// Eight, wide corners and a narrow middle
    #[value(name = "8v")]
    EightV,
}

impl Dots {
    /// Their centres from the film's middle, mm.
    fn centres_mm(self, geometry: &Geometry) -> Vec<[f64; 2]> {
        let dots = match self {
            Dots::Four => dots::Dots::Four,
            Dots::EightV => dots::Dots::EightV,
        };
        dots.centres_mm(geometry)
    }
}

/// Writes the template for a preset's markers.
pub fn run(arguments: &TemplateArguments) -> Result<(), Failure> {
    let TemplateArguments {
        file,
        preset,
        layout,
        json,
    } = arguments;
    // Sizes on the film do not depend on the frame's size.
    let svg = svg(&Geometry::preset(*preset, 320, 240), *layout);
    std::fs::write(file, svg).map_err(|error| {
        let message = format!("cannot write the template {file}: {error}");
        Failure::input(message)
    })?;
    let message =
        format!("{file}: print it at 100 % and check that its ruler is {RULER_MM} mm long");
    tell(
        *json,
        &message,
        &json!({ "file": file, "ruler_mm": RULER_MM }),
    )
}

/// The drawing as SVG, with all lengths in millimetres, the page's size included.
fn svg(geometry: &Geometry, dots: Dots) -> String {
    let [width, height] = PAGE_MM;
    let body = [film(), marks(geometry, dots), ruler()].concat();
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}mm\" height=\"{height}mm\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"2.6\" \
         text-anchor=\"middle\" fill=\"none\" stroke=\"#000\" stroke-width=\"0.12\">\n{body}\
         </svg>\n"
    )
}

/// Draws the film's edge, its middle and the holes for the posts.
fn film() -> String {
    let [x, y] = MIDDLE_MM;
    let (left, top, side) = (x - EDGE_MM, y - EDGE_MM, 2.0 * EDGE_MM);
    let edge = format!(
        "<rect class=\"film\" x=\"{left}\" y=\"{top}\" width=\"{side}\" height=\"{side}\"/>\n\
         <path d=\"M{} {y}h2M{x} {}v2\"/>\n",
        x - 1.0,
        y - 1.0
    );
    let hole = |[across, down]: [f64; 2]| {
        let centre = [x + across * POST_MM, y + down * POST_MM];
        circle("post", centre, HOLE_MM)
    };
    edge + &CORNERS.map(hole).concat()
}

/// Draws the dots, each on a cross that sticks out from under it.
fn marks(geometry: &Geometry, dots: Dots) -> String {
    let [x, y] = MIDDLE_MM;
    let diameter_mm = f64::from(geometry.marker_diameter.0) / 1e3;
    let dot = |[across, down]: [f64; 2]| {
        let [x, y] = [x + across, y + down];
        let (left, top) = (x - 1.5, y - 1.5);
        let cross = format!("<path d=\"M{left:.3} {y:.3}h3M{x:.3} {top:.3}v3\"/>\n");
        cross + &circle("marker", [x, y], diameter_mm)
    };
    let centres = dots.centres_mm(geometry);
    centres.into_iter().map(dot).collect()
}

/// Directions of the four corners, from the upper left clockwise.
const CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

fn circle(class: &str, [x, y]: [f64; 2], diameter_mm: f64) -> String {
    let radius = diameter_mm / 2.0;
    format!("<circle class=\"{class}\" cx=\"{x:.3}\" cy=\"{y:.3}\" r=\"{radius:.3}\"/>\n")
}

fn ruler() -> String {
    let (left, y) = (MIDDLE_MM[0] - f64::from(RULER_MM) / 2.0, 56.0);
    let ticks = (0..=RULER_MM / 10).map(|tick| {
        let x = left + f64::from(10 * tick);
        format!("<path d=\"M{x} {}v2\"/>\n", y - 1.0)
    });
    let texts = [
        (61.0, format!("{RULER_MM} mm when printed at 100 %")),
        (65.0, "outer line: film, 40 × 40 mm".to_owned()),
        (
            69.0,
            "large: holes for the posts; small: red dots, camera's side".to_owned(),
        ),
    ];
    let texts = texts.map(|(y, text)| {
        let x = MIDDLE_MM[0];
        format!("<text x=\"{x}\" y=\"{y}\" fill=\"#000\" stroke=\"none\">{text}</text>\n")
    });
    let line = format!("<path class=\"ruler\" d=\"M{left} {y}h{RULER_MM}\"/>\n");
    line + &ticks.collect::<String>() + &texts.concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_twin::{HALF_SIDE_MM, Layout, MARKER_RADIUS_MM, MARKER_REST_MM};

    /// Centre and diameter of all circles of a class.
    fn circles(svg: &str, class: &str) -> Vec<[f64; 3]> {
        let opening = format!("<circle class=\"{class}\"");
        let own = svg.lines().filter(|line| line.starts_with(&opening));
        own.map(|line| {
            ["cx", "cy", "r"].map(|name| {
                let (_, rest) = line.split_once(&format!(" {name}=\"")).unwrap();
                rest.split('"').next().unwrap().parse().unwrap()
            })
        })
        .collect()
    }

    /// Dots and posts have the places and sizes of the simulated sensor's.
    #[test]
    fn it_is_the_scenes_geometry_to_scale() {
        for preset in Preset::ALL {
            let svg = svg(&Geometry::preset(preset, 320, 240), Dots::Four);
            assert!(svg.contains("width=\"70mm\" height=\"76mm\" viewBox=\"0 0 70 76\""));
            let [markers, posts] = ["marker", "post"].map(|class| circles(&svg, class));
            assert_eq!((markers.len(), posts.len()), (4, 4));
            for (i, [across, down]) in CORNERS.into_iter().enumerate() {
                let there = |rest: f64| [35.0 + across * rest, 26.0 + down * rest];
                let near = |found: [f64; 3], rest: f64| {
                    let [x, y] = there(rest);
                    (found[0] - x).hypot(found[1] - y) < 2e-3
                };
                assert!(near(markers[i], MARKER_REST_MM), "{markers:?}");
                assert!(near(posts[i], HALF_SIDE_MM), "{posts:?}");
                assert!((markers[i][2] - MARKER_RADIUS_MM).abs() < 1e-9);
            }
            assert!(svg.contains("class=\"ruler\" d=\"M10 56h50\""), "{svg}");
        }
    }

    #[test]
    fn the_eight_dots_are_those_of_the_simulated_layout() {
        let svg = svg(&Geometry::preset(Preset::Ov7725, 320, 240), Dots::EightV);
        let layout: Layout = "8v".parse().unwrap();
        let markers = circles(&svg, "marker");
        assert_eq!(markers.len(), layout.count());
        for (found, [x, y]) in markers.iter().zip(layout.centres_mm()) {
            let off = (found[0] - 35.0 - x).hypot(found[1] - 26.0 - y);
            assert!(off < 2e-3, "{markers:?}");
            assert!((2.0 * found[2] - layout.diameter_mm()).abs() < 1e-9);
        }
    }
}
