//! The films that are mounted, and how each is pressed.

use hivtac_shell::Design;

use super::super::deck::{Law, RUBBERS_POISSON};
use super::super::presses::STIFFER;

/// Where the tip meets every film, mm from the middle.
pub const PLACE_MM: [f64; 2] = [2.0, -1.0];
/// Its largest force, N, and the presses in parts of it.
pub const FORCE_N: [f64; 3] = [0.024, 0.012, -0.12];
/// See there.
pub const SIZES: [f64; 3] = [1.0 / 12.0, 1.0 / 3.0, 1.0];

/// C₂/C₁ of rubber that stiffens as Yeoh's.
const YEOH: f64 = 0.3;

/// Films that CalculiX also keeps from shearing and thinning.
const STIFF_ACROSS: [&str; 6] = [FLAT, STRETCHED, SLACK, HANGING, OVERHANGING, UNEVEN];
const FLAT: &str = "flat, as it was cut";
const STRETCHED: &str = "stretched by 3 %";
const SLACK: &str = "slack by 0.3 %, its weight towards the camera";
const HANGING: &str = "its weight towards the camera";
const OVERHANGING: &str = "overhang of 6 mm";
const UNEVEN: &str = "±10 % of thickness along x";

/// A film of a name.
#[derive(Clone)]
pub struct MountedFilm {
    /// What is particular about it.
    pub name: &'static str,
    /// The film.
    pub design: Design,
    /// Its law in CalculiX.
    pub law: Law,
}

impl MountedFilm {
    /// Whether CalculiX's film is kept from shearing and thinning, as the project's is.
    pub fn is_stiff_across(&self) -> bool {
        matches!(self.law, Law::StiffAcross(_))
    }

    /// What it is called on the terminal.
    pub fn job(&self) -> String {
        let kept = if self.is_stiff_across() {
            ", neither shear nor thinning"
        } else {
            ""
        };
        format!("{}{kept}", self.name)
    }
}

/// All of them; the first is flat as it was cut.
pub fn films() -> Vec<MountedFilm> {
    let mut films = films_that_shear();
    for name in STIFF_ACROSS {
        let film = films.iter().find(|film| film.name == name);
        films.extend(film.map(|film| MountedFilm {
            law: Law::StiffAcross(STIFFER),
            ..film.clone()
        }));
    }
    films
}

fn films_that_shear() -> Vec<MountedFilm> {
    let heavy = |down| Design {
        down,
        ..Design::default()
    };
    let cut = |overhang_mm, post_radius_mm| Design {
        overhang_mm,
        post_radius_mm,
        ..Design::default()
    };
    vec![
        film(FLAT, Design::default()),
        film("stretched by 1.2 %", stretched([0.012; 2])),
        film(STRETCHED, stretched([0.03; 2])),
        film("stretched by 3 % along x alone", stretched([0.03, 0.0])),
        film(
            SLACK,
            Design {
                stretch: [-0.003; 2],
                ..heavy([0.0, 0.0, -1.0])
            },
        ),
        film(
            "flat, Poisson's ratio of rubber",
            Design {
                law: hivtac_shell::Law::default(),
                ..rubber(0.0, [0.0; 2])
            },
        ),
        film("neo-Hooke", rubber(0.0, [0.0; 2])),
        film("neo-Hooke, stretched by 3 %", rubber(0.0, [0.03; 2])),
        film(
            "neo-Hooke, stretched by 3 %, a fifth as thick and five times as stiff",
            thin(rubber(0.0, [0.03; 2])),
        ),
        film("Yeoh", rubber(YEOH, [0.0; 2])),
        film("Yeoh, stretched by 3 %", rubber(YEOH, [0.03; 2])),
        film(HANGING, heavy([0.0, 0.0, -1.0])),
        film("its weight away from the camera", heavy([0.0, 0.0, 1.0])),
        film("its weight along x", heavy([1.0, 0.0, 0.0])),
        film("cut at its holes, posts of 1 mm", cut(0.0, 1.0)),
        film("cut at its holes, posts of 3 mm", cut(0.0, 3.0)),
        film("overhang of 6 mm, posts of 1 mm", cut(6.0, 1.0)),
        film(OVERHANGING, cut(6.0, 1.5)),
        film("overhang of 6 mm, posts of 3 mm", cut(6.0, 3.0)),
        film(
            UNEVEN,
            Design {
                thickness_slope: [0.1, 0.0],
                ..Design::default()
            },
        ),
        film(
            "twice as stiff on its dots",
            Design {
                dot_stiffening: 1.0,
                ..Design::default()
            },
        ),
        film(
            "all at once",
            Design {
                overhang_mm: 6.0,
                thickness_slope: [0.05, -0.05],
                down: [0.6, 0.0, -0.8],
                ..rubber(YEOH, [0.015, 0.008])
            },
        ),
    ]
}

fn film(name: &'static str, design: Design) -> MountedFilm {
    let design = Design {
        tip_offset_mm: PLACE_MM,
        ..design
    };
    MountedFilm {
        name,
        law: Law::of(&design.law),
        design,
    }
}

fn stretched(stretch: [f64; 2]) -> Design {
    Design {
        stretch,
        ..Design::default()
    }
}

fn rubber(stiffening: f64, stretch: [f64; 2]) -> Design {
    let mut design = Design {
        law: hivtac_shell::Law {
            neo_hooke: 1.0,
            stiffening,
        },
        ..stretched(stretch)
    };
    design.material.poisson = RUBBERS_POISSON;
    design
}

/// A film of the same membrane stiffness that hardly bends.
fn thin(mut design: Design) -> Design {
    design.material.thickness_mm /= 5.0;
    design.material.youngs_mpa *= 5.0;
    design
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn films_can_be_and_have_names_of_their_own() {
        let films = films();
        assert_eq!(films[0].design.stretch, [0.0; 2]);
        for (index, film) in films.iter().enumerate() {
            film.design.check().unwrap();
            let other = |other: &MountedFilm| other.job() != film.job();
            assert!(films[..index].iter().all(other));
        }
        let stiff = films.iter().filter(|film| film.is_stiff_across());
        assert_eq!(stiff.count(), STIFF_ACROSS.len());
        assert_eq!(SIZES[SIZES.len() - 1], 1.0);
    }
}
