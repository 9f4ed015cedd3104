//! Bodies in contact with the shell's film, beside the same in CalculiX.

mod deck;
mod mesh;
mod program;
mod results;
mod solid;

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use hivtac_shell::{Body, Design, Ends, Film, Shape, Touch};
use hivtac_twin::{Camera, MARKERS, Preset};

use deck::Deck;
use mesh::{Cut, Mesh};
use program::Program;
use results::Pressed;

/// Turns in which the shell's body is moved until its foot is where CalculiX's is.
const TURNS: usize = 3;

/// Press bodies on the film in CalculiX, too.
#[derive(Args)]
pub struct ContactCheck {
    /// CalculiX's program.
    #[arg(long, default_value = "ccx")]
    ccx: PathBuf,
    /// Folder of decks and results.
    #[arg(long, default_value = "target/calculix")]
    keep: PathBuf,
    /// How fine CalculiX's mesh is.
    #[arg(long, default_value_t = 0.5)]
    fineness: f64,
    /// How many times stiffer CalculiX's film is against shear across it and thinning: with 100 it
    /// is like a shell.
    #[arg(long, default_value_t = 1.0)]
    stiffer: f64,
    /// Only the case with this number.
    #[arg(long)]
    only: Option<usize>,
}

/// A body and the force on the shell's film that gives its depth, N.
struct Case {
    name: &'static str,
    body: Body,
    force_n: [f64; 3],
}

impl ContactCheck {
    /// Runs it.
    ///
    /// # Errors
    /// If the shell finds no equilibrium. What CalculiX does not solve is told and left out.
    pub fn run(&self) -> Result<()> {
        let camera = Camera::new(Preset::Ov7725, 320, 240)?;
        let film = Film::new(&Design::default())?;
        println!(
            "| body | F, mN | markers' motion, px | shell off by, px | of |F|, % | centre of \
             pressure held, mN |"
        );
        for (number, case) in cases().iter().enumerate() {
            if self.only.is_some_and(|only| only != number) {
                continue;
            }
            if let Err(why) = self.compare(&film, &camera, case) {
                println!("{}: {why:#}", case.name);
            }
        }
        Ok(())
    }

    fn folder(&self, case: &Case) -> String {
        let name = case.name.replace(' ', "-");
        match self.stiffer {
            1.0 => name,
            times => format!("{name}-{times}"),
        }
    }

    fn compare(&self, film: &Film, camera: &Camera, case: &Case) -> Result<()> {
        let first = film.press_body(&case.body, case.force_n, &film.rest())?;
        let design = Design {
            tip_offset_mm: case.body.place_mm,
            tip_radius_mm: first.reach_mm[0].hypot(first.reach_mm[1]).min(4.0),
            ..Design::default()
        };
        let mesh = Mesh::new(&design, Cut::Bricks(1), self.fineness);
        let deck = Deck {
            design: &design,
            mesh: &mesh,
            body: &case.body,
            foot_mm: first.foot_mm,
            reach_mm: first.reach_mm[0].hypot(first.reach_mm[1]),
            stiffer: self.stiffer,
        };
        let program = Program {
            ccx: self.ccx.clone(),
            keep: self.keep.clone(),
        };
        let text = program.run(&self.folder(case), &deck.text())?;
        let pressed = Pressed::read(&mesh, &text, 1.0)?;
        let force_n = held_by_posts(&design, &pressed);
        let half = design.material.thickness_mm / 2.0;
        let theirs = seen(camera, |place| pressed.camera_side(place, half));
        let own = Case {
            force_n,
            ..Case { ..*case }
        };
        let touch = placed(film, &own, first.foot_mm)?;
        let shell = seen(camera, |place| film.displacement(&touch.state, place));
        let rest = seen(camera, |_| [0.0; 3]);
        let far = |a: &[[f64; 2]; 4], b: &[[f64; 2]; 4]| {
            let pairs = a.iter().zip(b);
            pairs
                .map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]))
                .fold(0.0, f64::max)
        };
        let size = |f: [f64; 3]| f.iter().map(|part| part * part).sum::<f64>().sqrt();
        println!(
            "| {} | {:.2?} of {:.2?} | {:.2} | {:.3} | {:+.2} | {:.2?} | foot {:.3?} {:.3?} |",
            case.name,
            force_n.map(|part| 1e3 * part),
            case.force_n.map(|part| 1e3 * part),
            far(&shell, &rest),
            far(&shell, &theirs),
            100.0 * (size(force_n) / size(case.force_n) - 1.0),
            touch.held_n.map(|part| 1e3 * part),
            first.foot_mm,
            touch.foot_mm,
        );
        Ok(())
    }
}

/// Returns the shell's press with a force whose foot ends over the same point.
fn placed(film: &Film, case: &Case, foot_mm: [f64; 3]) -> Result<Touch> {
    let mut body = case.body;
    let mut touch = film.press_body(&body, case.force_n, &film.rest())?;
    for _ in 0..TURNS {
        body.place_mm = [0, 1].map(|c| body.place_mm[c] + foot_mm[c] - touch.foot_mm[c]);
        touch = film.press_body(&body, case.force_n, &film.rest())?;
    }
    Ok(touch)
}

/// Returns the force of the body on CalculiX's film: what the posts do not let go, N.
fn held_by_posts(design: &Design, pressed: &Pressed<'_>) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for ([x, y], area) in design.post_points() {
        let [to_x, to_y, to_z] = pressed.at([x, y, 0.0]);
        for (sum, moved) in sum.iter_mut().zip([to_x - x, to_y - y, to_z]) {
            *sum += design.post_grip_n_per_mm3 * area * moved;
        }
    }
    sum
}

fn seen(camera: &Camera, moved: impl Fn([f64; 2]) -> [f64; 3]) -> [[f64; 2]; 4] {
    MARKERS.map(|disc| disc.centroid_px(&moved, camera))
}

fn cases() -> Vec<Case> {
    let straight = [0.0, 0.0, -0.1];
    let ball = |radius_mm, place_mm| Body::rigid(Shape::Sphere { radius_mm }, place_mm);
    let face = |place_mm| Body::rigid(Shape::Face { radius_mm: 2.0 }, place_mm);
    let bar = Shape::Cylinder {
        radius_mm: 0.8,
        length_mm: 6.0,
        ends: Ends::Rounded,
    };
    let case = |name, body, force_n| Case {
        name,
        body,
        force_n,
    };
    vec![
        case("ball of 10 mm in the middle", ball(5.0, [0.0; 2]), straight),
        case(
            "ball of 40 mm in the middle",
            ball(20.0, [0.0; 2]),
            straight,
        ),
        case("face of 2 mm in the middle", face([0.0; 2]), straight),
        case(
            "ball of 10 mm at 3 2",
            ball(5.0, [3.0, 2.0]),
            [-0.01, -0.01, -0.1],
        ),
        case(
            "face of 2 mm at 2 -1 tilted 4",
            Body {
                turned_deg: 30.0,
                tilt_deg: 4.0,
                ..face([2.0, -1.0])
            },
            [-0.01, 0.0, -0.1],
        ),
        case(
            "cylinder of 6 mm at 1 1 turned 30",
            Body {
                turned_deg: 30.0,
                ..Body::rigid(bar, [1.0, 1.0])
            },
            [-0.005, -0.005, -0.1],
        ),
    ]
}
