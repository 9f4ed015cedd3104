//! CalculiX's input deck: the film, its grips, and the body that is lowered on it.

use std::fmt::Write;

use hivtac_shell::{Body, Design};

use super::mesh::Mesh;
use super::solid::Solid;

/// Pressure per penetration, N/mm³.
const CONTACT_N_PER_MM3: f64 = 50.0;
/// Clearance of the body before the first step, mm.
pub const CLEAR_MM: f64 = 0.002;
/// Distance from the foot within which the film may touch, beyond the body's own, mm.
const MARGIN_MM: f64 = 1.0;

/// A film on which a body is lowered.
pub struct Deck<'a> {
    /// The film, and where its elements are small.
    pub design: &'a Design,
    /// What it is cut into.
    pub mesh: &'a Mesh,
    /// The body.
    pub body: &'a Body,
    /// Where the body's foot ends, mm, film frame. It comes straight down.
    pub foot_mm: [f64; 3],
    /// How far from the foot the film may touch, mm.
    pub reach_mm: f64,
    /// How many times stiffer the film is against shear across it and thinning: 1 is isotropic.
    pub stiffer: f64,
}

impl Deck<'_> {
    /// The deck's text.
    pub fn text(&self) -> String {
        let solid = Solid::new(self.body);
        let lowest = solid
            .nodes
            .iter()
            .map(|node| node[2])
            .fold(f64::INFINITY, f64::min);
        let half = self.design.material.thickness_mm / 2.0;
        let from = half + CLEAR_MM - lowest;
        [
            self.film(),
            self.solid(&solid, from),
            self.material(),
            self.grips(solid.nodes.len(), solid.bricks.len()),
            self.step(from),
        ]
        .concat()
    }

    fn film(&self) -> String {
        let mut text = String::from("*NODE,NSET=ALL\n");
        for (index, [x, y, z]) in self.mesh.nodes.iter().enumerate() {
            line(
                &mut text,
                format_args!("{},{x:.12e},{y:.12e},{z:.12e}", index + 1),
            );
        }
        line(&mut text, format_args!("*ELEMENT,TYPE=C3D20R,ELSET=FILM"));
        for (index, nodes) in self.mesh.elements.iter().enumerate() {
            let names: Vec<String> = nodes.iter().map(|node| (node + 1).to_string()).collect();
            let rows: Vec<String> = names.chunks(10).map(|row| row.join(",")).collect();
            line(
                &mut text,
                format_args!("{},{}", index + 1, rows.join(",\n")),
            );
        }
        text += "*SURFACE,NAME=OUTER,TYPE=ELEMENT\n";
        for (index, nodes) in self.mesh.elements.iter().enumerate() {
            let middle =
                |c: usize| nodes.iter().map(|k| self.mesh.nodes[*k][c]).sum::<f64>() / 20.0;
            let far = (middle(0) - self.foot_mm[0]).hypot(middle(1) - self.foot_mm[1]);
            if far < self.reach_mm + MARGIN_MM {
                line(&mut text, format_args!("{},S2", index + 1));
            }
        }
        text
    }

    fn solid(&self, solid: &Solid, from: f64) -> String {
        let (nodes, elements) = (self.mesh.nodes.len(), self.mesh.elements.len());
        let mut text = String::from("*NODE,NSET=BODY\n");
        for (index, [x, y, z]) in solid.nodes.iter().enumerate() {
            let at = [x + self.foot_mm[0], y + self.foot_mm[1], z + from];
            let number = nodes + index + 1;
            line(
                &mut text,
                format_args!("{number},{:.9e},{:.9e},{:.9e}", at[0], at[1], at[2]),
            );
        }
        text += "*ELEMENT,TYPE=C3D8,ELSET=SOLID\n";
        for (index, brick) in solid.bricks.iter().enumerate() {
            let names = brick.map(|node| (nodes + node + 1).to_string()).join(",");
            line(&mut text, format_args!("{},{names}", elements + index + 1));
        }
        text += "*SURFACE,NAME=TOUCHES,TYPE=ELEMENT\n";
        for index in 0..solid.bricks.len() {
            line(&mut text, format_args!("{},S1", elements + index + 1));
        }
        text
    }

    fn material(&self) -> String {
        let (e, nu) = (
            self.design.material.youngs_mpa,
            self.design.material.poisson,
        );
        let shear = e / (2.0 * (1.0 + nu));
        let law = match self.stiffer {
            1.0 => format!("*ELASTIC\n{e},{nu}\n"),
            times => {
                let (e_across, across) = (times * e, times * shear);
                format!(
                    "*ELASTIC,TYPE=ENGINEERING CONSTANTS\n{e},{e},{e_across},{nu},0.,0.,\
                     {shear:.12e},{across:.12e}\n{across:.12e}\n"
                )
            }
        };
        format!(
            "*MATERIAL,NAME=FILM\n{law}*SOLID SECTION,ELSET=FILM,MATERIAL=FILM\n\
             *MATERIAL,NAME=HARD\n*ELASTIC\n1.,0.3\n*SOLID SECTION,ELSET=SOLID,MATERIAL=HARD\n\
             *SURFACE INTERACTION,NAME=TOUCH\n*SURFACE BEHAVIOR,PRESSURE-OVERCLOSURE=LINEAR\n\
             {CONTACT_N_PER_MM3}\n\
             *CONTACT PAIR,INTERACTION=TOUCH,TYPE=SURFACE TO SURFACE\nOUTER,TOUCHES\n"
        )
    }

    /// A node on springs for each point of the posts, tied to the middle surface there. All springs
    /// are alike; a larger part of a post is tied with a larger weight.
    fn grips(&self, solid_nodes: usize, solid_bricks: usize) -> String {
        let points = self.design.post_points();
        let mean_mm2 = points.iter().map(|(_, area)| area).sum::<f64>() / points.len() as f64;
        let stiffness = mean_mm2 * self.design.post_grip_n_per_mm3;
        let nodes = self.mesh.nodes.len() + solid_nodes;
        let elements = self.mesh.elements.len() + solid_bricks;
        let mut text = String::from("*NODE\n");
        for (index, ([x, y], _)) in points.iter().enumerate() {
            line(
                &mut text,
                format_args!("{},{x:.12e},{y:.12e},0.", nodes + index + 1),
            );
        }
        for axis in 0..3 {
            let set = format!("GRIP{}", axis + 1);
            line(&mut text, format_args!("*ELEMENT,TYPE=SPRING1,ELSET={set}"));
            for index in 0..points.len() {
                let element = elements + axis * points.len() + index + 1;
                line(&mut text, format_args!("{element},{}", nodes + index + 1));
            }
            let spring = format_args!("*SPRING,ELSET={set}\n{}\n{stiffness:.12e}", axis + 1);
            line(&mut text, spring);
        }
        for (index, ([x, y], area)) in points.iter().enumerate() {
            let place = self.mesh.place([*x, *y, 0.0]);
            let times = (area / mean_mm2).sqrt();
            for axis in 1..=3 {
                let own = format!("{},{axis},-1.", nodes + index + 1);
                let film = place.iter().filter(|(_, weight)| *weight != 0.0);
                let film =
                    film.map(|(node, part)| format!("{},{axis},{:.12e}", node + 1, times * part));
                let terms: Vec<String> = [own].into_iter().chain(film).collect();
                line(&mut text, format_args!("*EQUATION\n{}", terms.len()));
                for row in terms.chunks(4) {
                    line(&mut text, format_args!("{}", row.join(",")));
                }
            }
        }
        text
    }

    fn step(&self, from: f64) -> String {
        format!(
            "*STEP,NLGEOM,INC=400\n*STATIC\n0.01,1.,1e-5,0.1\n\
             *BOUNDARY\nBODY,1,2,0.\nBODY,3,3,{:.9e}\n\
             *NODE PRINT,NSET=ALL,FREQUENCY=1000\nU\n*END STEP\n",
            self.foot_mm[2] - from
        )
    }
}

fn line(text: &mut String, words: std::fmt::Arguments<'_>) {
    // Writing to a string never fails.
    let _ = writeln!(text, "{words}");
}
