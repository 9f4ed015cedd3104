//! CalculiX's input deck: the film, its grips and the tip's load.

use std::fmt::Write;

use hivtac_shell::Design;

use super::mesh::{Cut, Mesh};

/// Points of the curve by which the load grows, and the first and largest step along it.
const GROWTH_POINTS: usize = 40;
const FIRST_STEP: f64 = 0.1;
const SMALLEST_STEP: f64 = 1e-3;
const LARGEST_STEP: f64 = 0.25;
/// What may be left over of the forces, in parts of the mean force (CalculiX's default is 0.005),
/// and the last correction in parts of the step's largest displacement (0.01).
const RESIDUAL: f64 = 1e-5;
const CORRECTION: f64 = 1e-3;

/// How the film answers to strain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Law {
    /// St Venant–Kirchhoff, isotropic.
    StVenant,
    /// The same, with the two shear moduli across the film so many times larger.
    StiffShear(f64),
    /// The same, that many times stiffer against a change of thickness, too, and without Poisson's
    /// ratio across the film: a shell that neither shears nor thins.
    StiffAcross(f64),
    /// Compressible neo-Hooke with the same moduli at rest.
    NeoHooke,
}

/// One press of a film.
pub struct Deck<'a> {
    /// The film, its grips and where the tip is.
    pub design: &'a Design,
    /// What it is cut into.
    pub mesh: &'a Mesh,
    /// What the film is made of.
    pub law: Law,
    /// The tip's force, N.
    pub force_n: [f64; 3],
}

impl Deck<'_> {
    /// The deck's text.
    pub fn text(&self) -> String {
        let sections = [self.film(), self.material(), self.grips(), self.step()];
        sections.concat()
    }

    fn film(&self) -> String {
        let mut text = String::from("*NODE,NSET=ALL\n");
        for (index, [x, y, z]) in self.mesh.nodes.iter().enumerate() {
            line(
                &mut text,
                format_args!("{},{x:.12e},{y:.12e},{z:.12e}", index + 1),
            );
        }
        let kind = self.mesh.element_type();
        line(&mut text, format_args!("*ELEMENT,TYPE={kind},ELSET=FILM"));
        for (index, nodes) in self.mesh.elements.iter().enumerate() {
            let names: Vec<String> = nodes.iter().map(|node| (node + 1).to_string()).collect();
            let rows: Vec<String> = names.chunks(10).map(|row| row.join(",")).collect();
            line(
                &mut text,
                format_args!("{},{}", index + 1, rows.join(",\n")),
            );
        }
        text
    }

    fn material(&self) -> String {
        let (e, nu) = (
            self.design.material.youngs_mpa,
            self.design.material.poisson,
        );
        let shear = e / (2.0 * (1.0 + nu));
        let layered = |[e_across, nu, nu_across]: [f64; 3], shear: f64, across: f64| {
            format!(
                "*ELASTIC,TYPE=ENGINEERING CONSTANTS\n\
                 {e},{e},{e_across},{nu},{nu_across},{nu_across},{shear:.12e},{across:.12e}\n\
                 {across:.12e}\n"
            )
        };
        let law = match self.law {
            Law::StVenant => format!("*ELASTIC\n{e},{nu}\n"),
            Law::StiffShear(times) => layered([e, nu, nu], shear, times * shear),
            Law::StiffAcross(times) => layered([times * e, nu, 0.0], shear, times * shear),
            // C10 = G/2 and D1 = 2/K.
            Law::NeoHooke => {
                let (c10, d1) = (shear / 2.0, 6.0 * (1.0 - 2.0 * nu) / e);
                format!("*HYPERELASTIC,NEO HOOKE\n{c10:.12e},{d1:.12e}\n")
            }
        };
        let section = match self.mesh.cut {
            Cut::Bricks(_) => "*SOLID SECTION,ELSET=FILM,MATERIAL=RUBBER\n".to_owned(),
            Cut::Shells => {
                let thickness = self.design.material.thickness_mm;
                format!("*SHELL SECTION,ELSET=FILM,MATERIAL=RUBBER\n{thickness}\n")
            }
        };
        format!("*MATERIAL,NAME=RUBBER\n{law}{section}")
    }

    /// A node on springs for each point of the posts, tied to the middle surface there. All springs
    /// are alike; a larger part of a post is tied with a larger weight: a node that moves √c times
    /// as far stores c times the energy.
    fn grips(&self) -> String {
        let points = self.design.post_points();
        let mean_mm2 = points.iter().map(|(_, area)| area).sum::<f64>() / points.len() as f64;
        let stiffness = mean_mm2 * self.design.post_grip_n_per_mm3;
        let (nodes, elements) = (self.mesh.nodes.len(), self.mesh.elements.len());
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
            let set = format_args!("*SPRING,ELSET={set}\n{}\n{stiffness:.12e}", axis + 1);
            line(&mut text, set);
        }
        for (index, ([x, y], area)) in points.iter().enumerate() {
            let place = self.mesh.place([*x, *y, 0.0]);
            tie(&mut text, nodes + index, &place, (area / mean_mm2).sqrt());
        }
        text
    }

    /// The load grows by the cube of time, so that a membrane's depth grows evenly.
    fn step(&self) -> String {
        let mut text = String::from("*AMPLITUDE,NAME=CUBE\n");
        for point in 0..=GROWTH_POINTS {
            let time = point as f64 / GROWTH_POINTS as f64;
            line(&mut text, format_args!("{time},{:.9e}", time.powi(3)));
        }
        line(
            &mut text,
            format_args!(
                "*STEP,NLGEOM,INC=200\n*STATIC\n{FIRST_STEP},1.,{SMALLEST_STEP},{LARGEST_STEP}\n\
                 *CONTROLS,PARAMETERS=FIELD\n{RESIDUAL},{CORRECTION},,,{RESIDUAL},1e-5,1e-3,1e-8\n\
                 *CLOAD,AMPLITUDE=CUBE"
            ),
        );
        for (node, share) in self.shares().into_iter().enumerate() {
            for (axis, force) in self.force_n.iter().enumerate() {
                if share * force != 0.0 {
                    let part = share * force;
                    line(
                        &mut text,
                        format_args!("{},{},{part:.12e}", node + 1, axis + 1),
                    );
                }
            }
        }
        text + "*NODE PRINT,NSET=ALL,FREQUENCY=1000\nU\n*END STEP\n"
    }

    /// Each node's share of the tip's force, at the middle surface.
    fn shares(&self) -> Vec<f64> {
        let mut shares = vec![0.0; self.mesh.nodes.len()];
        for ([x, y], share) in self.design.tip_points() {
            for (node, weight) in self.mesh.place([x, y, 0.0]) {
                shares[node] += share * weight;
            }
        }
        shares
    }
}

/// Has a node (counted from 0) move `times` as far as a place of the film.
fn tie(text: &mut String, node: usize, place: &[(usize, f64)], times: f64) {
    let place: Vec<_> = place.iter().filter(|(_, weight)| *weight != 0.0).collect();
    for axis in 1..=3 {
        let own = format!("{},{axis},-1.", node + 1);
        let others = place
            .iter()
            .map(|(node, weight)| format!("{},{axis},{:.12e}", node + 1, times * weight));
        let terms: Vec<String> = [own].into_iter().chain(others).collect();
        line(text, format_args!("*EQUATION\n{}", terms.len()));
        for row in terms.chunks(4) {
            line(text, format_args!("{}", row.join(",")));
        }
    }
}

fn line(text: &mut String, words: std::fmt::Arguments<'_>) {
    // Writing to a string never fails.
    let _ = writeln!(text, "{words}");
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(cut: Cut, law: Law) -> String {
        let design = Design {
            tip_offset_mm: [1.0, 2.0],
            ..Design::default()
        };
        let mesh = Mesh::new(&design, cut, 0.5);
        let force_n = [0.01, 0.0, -0.05];
        let (design, mesh) = (&design, &mesh);
        Deck {
            design,
            mesh,
            law,
            force_n,
        }
        .text()
    }

    /// The lines between a line that begins so and the next keyword.
    fn section<'t>(text: &'t str, keyword: &'t str) -> impl Iterator<Item = Vec<f64>> + 't {
        let lines = text
            .lines()
            .skip_while(move |line| !line.starts_with(keyword))
            .skip(1);
        let own = lines.take_while(|line| !line.starts_with('*'));
        own.map(|line| {
            line.split(',')
                .filter_map(|word| word.parse().ok())
                .collect()
        })
    }

    #[test]
    fn nodal_loads_add_up_to_the_force() {
        for cut in [Cut::Bricks(1), Cut::Bricks(2), Cut::Shells] {
            let text = written(cut, Law::StVenant);
            let mut sum = [0.0; 4];
            section(&text, "*CLOAD").for_each(|load| sum[load[1] as usize] += load[2]);
            for (part, force) in sum[1..].iter().zip([0.01, 0.0, -0.05]) {
                assert!((part - force).abs() < 1e-12, "{cut:?} {sum:?}");
            }
        }
    }

    /// Pulled evenly, the springs hold the film by grip times area.
    #[test]
    fn grips_add_up_to_the_posts() {
        let text = written(Cut::Bricks(1), Law::StVenant);
        let stiffness = section(&text, "*SPRING,ELSET=GRIP3").nth(1).unwrap()[0];
        let mut held = 0.0;
        for equation in text.split("*EQUATION\n").skip(1) {
            let words = equation.split(['\n', ',']).skip(1);
            let numbers: Vec<f64> = words.map_while(|word| word.parse().ok()).collect();
            let weight: f64 = numbers.chunks(3).skip(1).map(|term| term[2]).sum();
            if numbers[1] == 3.0 {
                held += stiffness * weight * weight;
            }
        }
        let posts = std::f64::consts::PI * 1.5 * 1.5 * 20.0;
        assert!((held / posts - 1.0).abs() < 1e-6, "{held} {posts}");
    }

    #[test]
    fn laws_have_the_films_moduli() {
        let text = written(Cut::Bricks(1), Law::StVenant);
        assert!(text.contains("*ELASTIC\n1,0.49\n*SOLID SECTION"));
        let text = written(Cut::Shells, Law::StiffShear(10.0));
        assert!(text.contains("*SHELL SECTION,ELSET=FILM,MATERIAL=RUBBER\n0.5\n"));
        let numbers: Vec<f64> = section(&text, "*ELASTIC").flatten().collect();
        assert!((numbers[8] - 10.0 * numbers[6]).abs() < 1e-9);
        let text = written(Cut::Bricks(1), Law::StiffAcross(10.0));
        let numbers: Vec<f64> = section(&text, "*ELASTIC").flatten().collect();
        assert_eq!(numbers[..6], [1.0, 1.0, 10.0, 0.49, 0.0, 0.0]);
        let text = written(Cut::Bricks(1), Law::NeoHooke);
        let numbers: Vec<f64> = section(&text, "*HYPERELASTIC").flatten().collect();
        let (shear, bulk) = (2.0 * numbers[0], 2.0 / numbers[1]);
        let youngs = 9.0 * bulk * shear / (3.0 * bulk + shear);
        assert!((youngs - 1.0).abs() < 1e-9);
    }

    #[test]
    fn no_line_is_longer_than_calculix_reads() {
        for cut in [Cut::Bricks(2), Cut::Shells] {
            assert!(
                written(cut, Law::NeoHooke)
                    .lines()
                    .all(|line| line.len() <= 132)
            );
        }
    }
}
