//! A film that CalculiX solves, as a scene shows it.

use anyhow::Result;
use hivtac_shell::{Design, Film, pressed_on};
use hivtac_twin::film::Pressed;
use hivtac_twin::{Disc, Load};

use super::Solver;
use super::deck::{Deck, Law};
use super::mesh::{Cut, Mesh};
use super::program::Program;
use super::results;

/// The steps in which a press grows, in parts of its force.
const SIZES: [f64; 3] = [1.0 / 12.0, 1.0 / 3.0, 1.0];

/// A mounted film of CalculiX's bricks. Presses are solved as they are asked for, each on a mesh
/// that is fine at its tip.
pub struct CalculixFilm {
    program: Program,
    fineness: f64,
    design: Design,
    law: Law,
    /// The project's film of this design: how thick it is where it is flat and mounted.
    flat: Film,
    rest: Solved,
}

/// A mesh, and what CalculiX printed of it.
struct Solved {
    mesh: Mesh,
    text: String,
    mounted: f64,
}

impl CalculixFilm {
    /// A film of a design, its dots included, at rest.
    ///
    /// # Errors
    /// When CalculiX is not installed or finds no rest position.
    pub fn new(solver: &Solver, design: Design) -> Result<Self> {
        let law = Law::of(&design.law);
        let flat = Film::new(&Design {
            fineness: 0.25,
            ..design.clone()
        })?;
        let program = solver.program();
        let unpressed = Design {
            tip_offset_mm: [0.0; 2],
            ..design.clone()
        };
        // CalculiX has no step without a load.
        let rest = Solved::new(
            &program,
            &unpressed,
            law,
            [0.0, 0.0, -1e-9],
            solver.fineness,
        )?;
        Ok(Self {
            program,
            fineness: solver.fineness,
            law,
            flat,
            rest,
            design,
        })
    }

    /// The film under a load; its first four dots.
    ///
    /// # Errors
    /// When CalculiX finds no equilibrium.
    pub fn press(&self, load: &Load) -> Result<Pressed> {
        let rest = self.rest.at_rest()?;
        let half_mm = |point| self.flat.half_thickness_mm(point);
        let resting = |point| rest.camera_side(point, half_mm(point));
        let discs = self.design.dots_mm.iter().copied().map(Disc::marker);
        if load.magnitude_n() == 0.0 {
            return Ok(pressed_on(resting, discs)?);
        }
        let design = Design {
            tip_offset_mm: material_point(resting, load.offset_mm()),
            ..self.design.clone()
        };
        let solved = Solved::new(
            &self.program,
            &design,
            self.law,
            load.vector_n(),
            self.fineness,
        )?;
        let (before, after) = (solved.at_rest()?, solved.pressed()?);
        // Another mesh has a rest position of its own.
        let moved = |point| {
            let half_mm = half_mm(point);
            let (from, to) = (
                before.camera_side(point, half_mm),
                after.camera_side(point, half_mm),
            );
            let rests = resting(point);
            [0, 1, 2].map(|axis| rests[axis] + to[axis] - from[axis])
        };
        Ok(Pressed {
            force_n: load.vector_n(),
            touches_mm: load.offset_mm(),
            ..pressed_on(moved, discs)?
        })
    }
}

impl Solved {
    fn new(
        program: &Program,
        design: &Design,
        law: Law,
        force_n: [f64; 3],
        fineness: f64,
    ) -> Result<Self> {
        let mesh = Mesh::new(design, Cut::Bricks(1), fineness);
        let deck = Deck {
            design,
            mesh: &mesh,
            law,
            force_n,
            sizes: &SIZES,
        };
        let text = deck.text();
        let mounted = deck.mounted();
        let name = super::folder(&format!("{force_n:?} {:?}", design.tip_offset_mm));
        let text = program.run(&name, &text)?;
        Ok(Self {
            mesh,
            text,
            mounted,
        })
    }

    fn at_rest(&self) -> Result<results::Pressed<'_>> {
        match self.mounted {
            0.0 => Ok(results::Pressed::cut(&self.mesh)),
            end => results::Pressed::read(&self.mesh, &self.text, end),
        }
    }

    fn pressed(&self) -> Result<results::Pressed<'_>> {
        results::Pressed::read(&self.mesh, &self.text, self.mounted + 1.0)
    }
}

/// The point of the flat mounted film whose camera side is at (x, y) mm.
fn material_point(moved: impl Fn([f64; 2]) -> [f64; 3], lab_mm: [f64; 2]) -> [f64; 2] {
    let mut point = lab_mm;
    for _ in 0..20 {
        let [x, y, _] = moved(point);
        point = [lab_mm[0] - x, lab_mm[1] - y];
    }
    point
}
