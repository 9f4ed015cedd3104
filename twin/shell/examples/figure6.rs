//! Draws the paper's Figure 6 by the full solver: the film driven 10 mm by a normal and by a shear
//! force.
//!
//! `cargo run --release -p hivtac-shell --example figure6 -- docs/pictures`

use std::path::Path;
use std::process::ExitCode;

use hivtac_shell::{Contact, Design, Equilibrium, Film, ShellError, paper_camera};
use hivtac_twin::{Camera, MARKERS};

/// The tip's travel, mm, and its steps.
const TRAVEL_MM: f64 = 10.0;
const STEP_MM: f64 = 0.5;
/// Depth of the touch that a shear needs, mm.
const TOUCH_MM: f64 = 0.5;
/// Arrows along one side of the film.
const ARROWS: usize = 23;
/// Side of the left picture and height of the right one, and the space above both.
const SIDE: f64 = 420.0;
const TOP: f64 = 60.0;
const LEFT: f64 = 20.0;
const RIGHT: f64 = 480.0;

/// An arrow, in the units of its picture.
struct Arrow {
    from: [f64; 2],
    to: [f64; 2],
}

fn main() -> ExitCode {
    // The reader of the output may close it early.
    sigpipe::reset();
    let words: Vec<String> = std::env::args().skip(1).collect();
    let done = match &words[..] {
        [folder] => draw(Path::new(folder)),
        _ => Err("figure6 FOLDER".into()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::FAILURE
        }
    }
}

fn draw(folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let film = Film::new(&Design::default())?;
    let normal = |mm: f64| [0.0, 0.0, -mm];
    // Towards the upper right of the picture, as in the paper.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let shear = |mm: f64| [half * mm, -half * mm, -TOUCH_MM];
    let pressed = driven(&film, "normal", normal)?;
    let sheared = driven(&film, "shear", shear)?;
    for (name, title, state) in [
        ("figure6-normal", "10 mm by a normal force", &pressed),
        (
            "figure6-shear",
            "10 mm by a shear force, pressed 0.5 mm",
            &sheared,
        ),
    ] {
        let svg = picture(&film, state, title)?;
        std::fs::write(folder.join(format!("{name}.svg")), svg)?;
    }
    Ok(())
}

/// Returns the film after the tip's travel; each step starts from the one before.
fn driven(
    film: &Film,
    name: &str,
    way: impl Fn(f64) -> [f64; 3],
) -> Result<Equilibrium, ShellError> {
    let mut state = film.rest();
    let steps = (TRAVEL_MM / STEP_MM) as usize;
    for step in 0..=steps {
        let travel = way(TRAVEL_MM * step as f64 / steps as f64);
        state = film.press(Contact::Travel(travel), &state)?;
        eprint!("\r{name}: step {step} of {steps} ");
    }
    let [x, y, z] = state.force_n;
    eprintln!("force ({x:.3}, {y:.3}, {z:.3}) N");
    Ok(state)
}

fn picture(
    film: &Film,
    state: &Equilibrium,
    title: &str,
) -> Result<String, Box<dyn std::error::Error>> {
    let camera = paper_camera()?;
    let points = grid(film.design().half_edge_mm());
    let on_film: Vec<Arrow> = points.iter().map(|at| on_film(film, state, *at)).collect();
    let outward = on_film
        .iter()
        .max_by(|a, b| a.outward().total_cmp(&b.outward()));
    if let Some(arrow) = outward {
        println!(
            "{title}: at most {:.3} mm outward along the film, from {:?} mm",
            arrow.outward(),
            arrow.from
        );
    }
    let seen = points
        .iter()
        .filter_map(|at| seen(film, state, *at, &camera));
    let seen: Vec<Arrow> = seen.collect();
    let mut svg = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 1060 500\" \
         font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"1060\" height=\"500\" \
         fill=\"white\"/>\n",
    );
    svg += &label(
        [LEFT, 22.0],
        &format!("Film, 28 × 28 × 0.5 mm, driven {title}"),
    );
    svg += &film_panel(film.design().half_edge_mm(), &on_film);
    svg += &camera_panel(&camera, &seen, points.len());
    Ok(svg + "</svg>\n")
}

/// Returns places on the film, row by row.
fn grid(edge_mm: f64) -> Vec<[f64; 2]> {
    let at = |i: usize| edge_mm * (2.0 * i as f64 / (ARROWS - 1) as f64 - 1.0);
    let rows = (0..ARROWS).flat_map(|j| (0..ARROWS).map(move |i| [at(i), at(j)]));
    rows.collect()
}

/// Returns a point's sideways motion, mm: the paper calls it the camera's view.
fn on_film(film: &Film, state: &Equilibrium, [x, y]: [f64; 2]) -> Arrow {
    let [dx, dy, _] = film.displacement(state, [x, y]);
    Arrow {
        from: [x, y],
        to: [x + dx, y + dy],
    }
}

/// Returns a point's motion in the fisheye's picture, px. Returns `None` if the point reaches the
/// pinhole's plane.
fn seen(film: &Film, state: &Equilibrium, [x, y]: [f64; 2], camera: &Camera) -> Option<Arrow> {
    let [dx, dy, dz] = film.displacement(state, [x, y]);
    (dz > -9.9).then(|| Arrow {
        from: camera.project([x, y, 0.0]),
        to: camera.project([x + dx, y + dy, dz]),
    })
}

fn film_panel(edge_mm: f64, arrows: &[Arrow]) -> String {
    let largest = arrows.iter().map(Arrow::length).fold(0.0, f64::max);
    // The longest arrow is three spacings long.
    let spacing = 2.0 * edge_mm / (ARROWS - 1) as f64;
    let magnify = (3.0 * spacing / largest).min(20.0);
    let scale = SIDE / (2.0 * edge_mm);
    let place = |[x, y]: [f64; 2]| [LEFT + (x + edge_mm) * scale, TOP + (y + edge_mm) * scale];
    let drawn = arrows.iter().map(|arrow| {
        let [x, y] = arrow.from;
        let by = [arrow.to[0] - x, arrow.to[1] - y].map(|part| magnify * part);
        let ends = [place(arrow.from), place([x + by[0], y + by[1]])];
        shaft(ends, arrow.length() / largest)
    });
    let mut svg = label(
        [LEFT, TOP - 12.0],
        &format!(
            "motion along the film: at most {largest:.2} mm, drawn {magnify:.1} times as long"
        ),
    );
    svg += &frame(LEFT, SIDE, SIDE);
    svg += &drawn.collect::<String>();
    for marker in MARKERS {
        svg += &circle(place(marker.centre_mm), marker.radius_mm * scale);
    }
    svg
}

fn camera_panel(camera: &Camera, arrows: &[Arrow], points: usize) -> String {
    let (width, height) = (f64::from(camera.width()), f64::from(camera.height()));
    let scale = SIDE / height;
    let inside = |[x, y]: [f64; 2]| (0.0..width).contains(&x) && (0.0..height).contains(&y);
    let place = |[x, y]: [f64; 2]| [RIGHT + x * scale, TOP + y * scale];
    let stay: Vec<&Arrow> = arrows.iter().filter(|arrow| inside(arrow.to)).collect();
    let largest = stay.iter().map(|arrow| arrow.length()).fold(0.0, f64::max);
    let drawn = stay.iter().map(|arrow| {
        shaft(
            [place(arrow.from), place(arrow.to)],
            arrow.length() / largest,
        )
    });
    let mut svg = label(
        [RIGHT, TOP - 12.0],
        &format!(
            "motion in the picture, 800×600, to scale: at most {largest:.0} px; {} of {points} \
             points are outside",
            points - stay.len()
        ),
    );
    let border = frame(RIGHT, SIDE * width / height, SIDE);
    svg += &format!("{border}<clipPath id=\"picture\">{border}</clipPath>\n");
    svg += &format!(
        "<g clip-path=\"url(#picture)\">\n{}</g>\n",
        drawn.collect::<String>()
    );
    for marker in MARKERS {
        let radius = marker.radius_mm * camera.focal_px() / 10.0 * scale;
        svg += &circle(place(marker.centroid_px(|_| [0.0; 3], camera)), radius);
    }
    svg
}

impl Arrow {
    /// Returns the arrow's component away from the middle.
    fn outward(&self) -> f64 {
        let ([x, y], [tx, ty]) = (self.from, self.to);
        let radius = x.hypot(y).max(f64::MIN_POSITIVE);
        ((tx - x) * x + (ty - y) * y) / radius
    }

    fn length(&self) -> f64 {
        (self.to[0] - self.from[0]).hypot(self.to[1] - self.from[1])
    }
}

/// Draws a line with a head in red; larger arrows have a stronger red.
fn shaft([[ax, ay], [bx, by]]: [[f64; 2]; 2], strength: f64) -> String {
    let length = (bx - ax).hypot(by - ay);
    if length < 0.3 {
        return String::new();
    }
    let head = (0.35 * length).min(5.0);
    let [ux, uy] = [(bx - ax) / length * head, (by - ay) / length * head];
    let wing = |side: f64| [bx - ux - side * 0.5 * uy, by - uy + side * 0.5 * ux];
    let ([lx, ly], [rx, ry]) = (wing(1.0), wing(-1.0));
    let pale = (200.0 * (1.0 - strength)).round();
    format!(
        "<path d=\"M{ax:.1} {ay:.1}L{bx:.1} {by:.1}M{lx:.1} {ly:.1}L{bx:.1} {by:.1}L{rx:.1} \
         {ry:.1}\" fill=\"none\" stroke=\"rgb(215,{pale},{pale})\"/>\n"
    )
}

fn frame(left: f64, width: f64, height: f64) -> String {
    format!(
        "<rect x=\"{left}\" y=\"{TOP}\" width=\"{width}\" height=\"{height}\" fill=\"none\" \
         stroke=\"black\"/>\n"
    )
}

fn circle([x, y]: [f64; 2], radius: f64) -> String {
    format!(
        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius:.1}\" fill=\"none\" stroke=\"blue\"/>\n"
    )
}

fn label([x, y]: [f64; 2], text: &str) -> String {
    format!("<text x=\"{x}\" y=\"{y}\">{text}</text>\n")
}
