//! CalculiX's input deck: the film, how it is mounted, its grips and the tip's load.

use std::fmt::Write;

use hivtac_shell::{DENSITY_KG_PER_M3, Design};

use super::mesh::{Cut, Mesh};

/// g, mm/s²; CalculiX's masses are in tonnes.
const GRAVITY_MM_PER_S2: f64 = 9_806.65;
const TONNE_PER_MM3: f64 = 1e-12;
/// What 1/D₂ and 1/D₃ of Yeoh's law are not to matter for.
const NO_HIGHER_BULK: f64 = 1e10;

/// Points of the curve by which the load grows, and the first and largest step along it.
const GROWTH_POINTS: usize = 40;
const FIRST_STEP: f64 = 0.1;
const SMALLEST_STEP: f64 = 1e-3;
const LARGEST_STEP: f64 = 0.25;
/// What may be left over of the forces, in parts of the mean force (CalculiX's default is 0.005),
/// and the last correction in parts of the step's largest displacement (0.01).
const RESIDUAL: f64 = 1e-5;
const CORRECTION: f64 = 1e-3;

/// Poisson's ratio of rubber here: `shell/` takes it for incompressible, CalculiX cannot.
pub const RUBBERS_POISSON: f64 = 0.499;

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
    /// Rubber with the same moduli at rest: C₁ (I₁−3) + C₂ (I₁−3)² of the isochoric part, and this
    /// C₂/C₁; 0 is compressible neo-Hooke.
    Rubber(f64),
}

impl Law {
    /// CalculiX's law of a film of this one.
    pub fn of(law: &hivtac_shell::Law) -> Law {
        if law.neo_hooke == 0.0 {
            Law::StVenant
        } else {
            Law::Rubber(law.stiffening)
        }
    }
}

/// A film that is mounted, and then pressed harder and harder.
pub struct Deck<'a> {
    /// The film, its grips and where the tip is.
    pub design: &'a Design,
    /// What it is cut into.
    pub mesh: &'a Mesh,
    /// What the film is made of.
    pub law: Law,
    /// The tip's largest force, N.
    pub force_n: [f64; 3],
    /// The presses, each in parts of it; the last is 1.
    pub sizes: &'a [f64],
}

impl Deck<'_> {
    /// The deck's text.
    pub fn text(&self) -> String {
        let sections = [self.film(), self.material(), self.grips(), self.steps()];
        sections.concat()
    }

    /// When the film has been mounted: 0 of one that is flat as it was cut.
    pub fn mounted(&self) -> f64 {
        let Design { stretch, down, .. } = self.design;
        if *stretch == [0.0; 2] && *down == [0.0; 3] {
            0.0
        } else {
            1.0
        }
    }

    /// When each press has come to its end: depths grow about evenly.
    pub fn ends(&self) -> Vec<f64> {
        let ends = self.sizes.iter().map(|size| self.mounted() + size.cbrt());
        ends.collect()
    }

    /// Which elements are on dots that stiffen the film, and how many times stiffer they are.
    fn dots(&self) -> (Vec<bool>, f64) {
        let stiffening = self.design.dot_stiffening;
        if stiffening == 0.0 {
            return (vec![false; self.mesh.elements.len()], 1.0);
        }
        let (on_dots, larger) = self.mesh.on_dots(self.design);
        (on_dots, 1.0 + stiffening / larger)
    }

    /// The sets of elements with how many times stiffer they are.
    fn sets(&self) -> Vec<(&'static str, f64)> {
        let (on_dots, times) = self.dots();
        let dots = on_dots.contains(&true).then_some(("DOTS", times));
        [("FILM", 1.0)].into_iter().chain(dots).collect()
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
        let (on_dots, _) = self.dots();
        for (set, _) in self.sets() {
            line(&mut text, format_args!("*ELEMENT,TYPE={kind},ELSET={set}"));
            for (index, nodes) in self.mesh.elements.iter().enumerate() {
                if on_dots[index] != (set == "DOTS") {
                    continue;
                }
                let names: Vec<String> = nodes.iter().map(|node| (node + 1).to_string()).collect();
                let rows: Vec<String> = names.chunks(10).map(|row| row.join(",")).collect();
                line(
                    &mut text,
                    format_args!("{},{}", index + 1, rows.join(",\n")),
                );
            }
        }
        text
    }

    fn material(&self) -> String {
        let sets = self.sets().into_iter();
        sets.map(|(set, times)| self.material_of(set, times))
            .collect()
    }

    fn material_of(&self, set: &str, times: f64) -> String {
        let (e, nu) = (
            times * self.design.material.youngs_mpa,
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
            Law::Rubber(stiffening) => {
                let (c10, d1) = (shear / 2.0, 6.0 * (1.0 - 2.0 * nu) / e);
                if stiffening == 0.0 {
                    format!("*HYPERELASTIC,NEO HOOKE\n{c10:.12e},{d1:.12e}\n")
                } else {
                    let c20 = stiffening * c10;
                    format!(
                        "*HYPERELASTIC,YEOH\n{c10:.12e},{c20:.12e},0.,{d1:.12e},\
                         {NO_HIGHER_BULK:e},{NO_HIGHER_BULK:e}\n"
                    )
                }
            }
        };
        let density = DENSITY_KG_PER_M3 * TONNE_PER_MM3;
        let section = match self.mesh.cut {
            Cut::Bricks(_) => format!("*SOLID SECTION,ELSET={set},MATERIAL={set}\n"),
            Cut::Shells => {
                let thickness = self.design.material.thickness_mm;
                format!("*SHELL SECTION,ELSET={set},MATERIAL={set}\n{thickness}\n")
            }
        };
        format!("*MATERIAL,NAME={set}\n{law}*DENSITY\n{density:e}\n{section}")
    }

    /// A node on springs for each point of the posts, tied to the middle surface there. All springs
    /// are alike; a larger part of a post is tied with a larger weight: a node that moves √c times
    /// as far stores c times the energy. They do not pull where the film is flat and mounted: one
    /// more node, which moves by the stretch, is a part of each tie.
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
        let ([along_x, along_y], mount) = (self.design.stretch, self.mount());
        let mounted = self.design.stretch != [0.0; 2];
        if mounted {
            line(&mut text, format_args!("*NODE\n{mount},0.,0.,0."));
        }
        for (index, ([x, y], area)) in points.iter().enumerate() {
            let place = self.mesh.place([*x, *y, 0.0]);
            let times = (area / mean_mm2).sqrt();
            let cut = [x / (1.0 + along_x), y / (1.0 + along_y), 0.0];
            for (axis, from) in cut.into_iter().enumerate() {
                let own = (nodes + index + 1, -1.0);
                let film = place
                    .iter()
                    .map(|(node, weight)| (node + 1, times * weight));
                let post = (mount, if mounted { -times * from } else { 0.0 });
                let terms = [own].into_iter().chain(film).chain([post]);
                tie(&mut text, axis, terms);
            }
        }
        text
    }

    /// The number of the node that moves by the stretch along x and y.
    fn mount(&self) -> usize {
        self.mesh.nodes.len() + self.design.post_points().len() + 1
    }

    fn steps(&self) -> String {
        let (mounted, ends) = (self.mounted(), self.ends());
        let mut text = self.growth();
        if mounted > 0.0 {
            text += &step(mounted, &self.mounting());
        }
        let loads = self.loads();
        let begins = [mounted].into_iter().chain(ends.iter().copied());
        for (index, (begin, end)) in begins.zip(&ends).enumerate() {
            // Loads stay: later steps only follow them farther.
            text += &step(end - begin, if index == 0 { &loads } else { "" });
        }
        text
    }

    /// The load grows by the cube of time from when the film is mounted, so that a membrane's depth
    /// grows evenly.
    fn growth(&self) -> String {
        let even = (0..=GROWTH_POINTS).map(|point| point as f64 / GROWTH_POINTS as f64);
        let presses = self.sizes.iter().map(|size| size.cbrt());
        let mut times: Vec<f64> = even.chain(presses).collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        let mut text = String::from("*AMPLITUDE,NAME=CUBE,TIME=TOTAL TIME\n");
        for time in times {
            let at = self.mounted() + time;
            line(&mut text, format_args!("{at:.9},{:.9e}", time.powi(3)));
        }
        text
    }

    /// Weight and stretch grow evenly.
    fn mounting(&self) -> String {
        let mut text = String::new();
        for (axis, part) in self.design.stretch.iter().enumerate() {
            if self.design.stretch != [0.0; 2] {
                let axis = axis + 1;
                line(
                    &mut text,
                    format_args!("*BOUNDARY\n{},{axis},{axis},{part:.9e}", self.mount()),
                );
            }
        }
        let [x, y, z] = self.design.down;
        let g = x.hypot(y).hypot(z);
        if g > 0.0 {
            let size = g * GRAVITY_MM_PER_S2;
            for (set, _) in self.sets() {
                let [x, y, z] = [x, y, z].map(|part| part / g);
                line(
                    &mut text,
                    format_args!("*DLOAD\n{set},GRAV,{size:e},{x:.9},{y:.9},{z:.9}"),
                );
            }
        }
        text
    }

    fn loads(&self) -> String {
        let mut text = String::from("*CLOAD,AMPLITUDE=CUBE\n");
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
        text
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

/// A step that takes so much time, with what is new in it.
fn step(time: f64, news: &str) -> String {
    let first = FIRST_STEP.min(time);
    format!(
        "*STEP,NLGEOM,INC=200\n*STATIC\n{first},{time:.9},{SMALLEST_STEP},{LARGEST_STEP}\n\
         *CONTROLS,PARAMETERS=FIELD\n{RESIDUAL},{CORRECTION},,,{RESIDUAL},1e-5,1e-3,1e-8\n\
         {news}*NODE PRINT,NSET=ALL,FREQUENCY=1000\nU\n*END STEP\n"
    )
}

/// An equation along one axis: nodes, counted from 1, with their weights add up to nothing. What
/// weighs nothing is left out.
fn tie(text: &mut String, axis: usize, terms: impl Iterator<Item = (usize, f64)>) {
    let axis = axis + 1;
    let terms: Vec<String> = terms
        .filter(|(_, weight)| *weight != 0.0)
        .map(|(node, weight)| format!("{node},{axis},{weight:.12e}"))
        .collect();
    line(text, format_args!("*EQUATION\n{}", terms.len()));
    for row in terms.chunks(4) {
        line(text, format_args!("{}", row.join(",")));
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
        written_of(&Design::default(), cut, law)
    }

    fn written_of(design: &Design, cut: Cut, law: Law) -> String {
        let design = Design {
            tip_offset_mm: [1.0, 2.0],
            ..design.clone()
        };
        let mesh = Mesh::new(&design, cut, 0.5);
        Deck {
            design: &design,
            mesh: &mesh,
            law,
            force_n: [0.01, 0.0, -0.05],
            sizes: &[0.125, 1.0],
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
        assert!(text.contains("*ELASTIC\n1,0.49\n*DENSITY\n1.07e-9\n*SOLID SECTION"));
        let text = written(Cut::Shells, Law::StiffShear(10.0));
        assert!(text.contains("*SHELL SECTION,ELSET=FILM,MATERIAL=FILM\n0.5\n"));
        let numbers: Vec<f64> = section(&text, "*ELASTIC").flatten().collect();
        assert!((numbers[8] - 10.0 * numbers[6]).abs() < 1e-9);
        let text = written(Cut::Bricks(1), Law::StiffAcross(10.0));
        let numbers: Vec<f64> = section(&text, "*ELASTIC").flatten().collect();
        assert_eq!(numbers[..6], [1.0, 1.0, 10.0, 0.49, 0.0, 0.0]);
        for (law, of_bulk) in [(Law::Rubber(0.0), 1), (Law::Rubber(0.3), 3)] {
            let text = written(Cut::Bricks(1), law);
            let numbers: Vec<f64> = section(&text, "*HYPERELASTIC").flatten().collect();
            let (shear, bulk) = (2.0 * numbers[0], 2.0 / numbers[of_bulk]);
            let youngs = 9.0 * bulk * shear / (3.0 * bulk + shear);
            assert!((youngs - 1.0).abs() < 1e-9);
        }
    }

    /// Where the film is flat and mounted, no spring pulls: its node has not moved.
    #[test]
    fn springs_rest_where_the_film_is_mounted() {
        let design = Design {
            stretch: [0.03, -0.01],
            ..Design::default()
        };
        let text = written_of(&design, Cut::Bricks(1), Law::StVenant);
        let mesh = Mesh::new(
            &Design {
                tip_offset_mm: [1.0, 2.0],
                ..design.clone()
            },
            Cut::Bricks(1),
            0.5,
        );
        let count = mesh.nodes.len();
        let mount = count + design.post_points().len() + 1;
        let moved = |node: usize, axis: usize| match (node, axis) {
            (_, 2) => 0.0,
            (node, axis) if node == mount => design.stretch[axis],
            (node, axis) if node <= count => mesh.nodes[node - 1][axis] * design.stretch[axis],
            _ => 0.0,
        };
        let mut equations = 0;
        for equation in text.split("*EQUATION\n").skip(1) {
            let words = equation.split(['\n', ',']).skip(1);
            let numbers: Vec<f64> = words.map_while(|word| word.parse().ok()).collect();
            let terms = numbers.chunks(3);
            let sum: f64 = terms
                .map(|term| term[2] * moved(term[0] as usize, term[1] as usize - 1))
                .sum();
            assert!(sum.abs() < 1e-9, "{sum} in {equation}");
            equations += 1;
        }
        assert_eq!(equations, 3 * design.post_points().len());
        assert!(text.contains(&format!("*BOUNDARY\n{mount},1,1,3.000000000e-2\n")));
    }

    #[test]
    fn a_film_is_mounted_before_it_is_pressed() {
        let steps = |design: &Design| {
            let text = written_of(design, Cut::Bricks(1), Law::StVenant);
            let times = text.split("*STATIC\n").skip(1).map(|step| {
                let words: Vec<f64> = step
                    .lines()
                    .next()
                    .unwrap()
                    .split(',')
                    .map(|word| word.parse().unwrap())
                    .collect();
                words[1]
            });
            (times.collect::<Vec<f64>>(), text)
        };
        assert_eq!(steps(&Design::default()).0, [0.5, 0.5]);
        let (times, text) = steps(&Design {
            down: [0.0, 0.6, -0.8],
            dot_stiffening: 1.0,
            ..Design::default()
        });
        assert_eq!(times, [1.0, 0.5, 0.5]);
        for set in ["FILM", "DOTS"] {
            assert!(text.contains(&format!(
                "{set},GRAV,9.80665e3,0.000000000,0.600000000,-0.8"
            )));
        }
        let moduli: Vec<f64> = text
            .split("*ELASTIC\n")
            .skip(1)
            .map(|law| law.split(',').next().unwrap().parse().unwrap())
            .collect();
        assert!(
            moduli[0] == 1.0 && (1.8..2.3).contains(&moduli[1]),
            "{moduli:?}"
        );
    }

    #[test]
    fn no_line_is_longer_than_calculix_reads() {
        for cut in [Cut::Bricks(2), Cut::Shells] {
            assert!(
                written(cut, Law::Rubber(0.0))
                    .lines()
                    .all(|line| line.len() <= 132)
            );
        }
    }
}
