//! The paper's analytic model of the film (HiVTac, *Sensors* 2022, Sections 3 and 4, eqs. 13–25):
//! how far a marker is seen to move, and where it should sit so that presses and shears are both
//! seen well.
//!
//! | paper | here |
//! |---|---|
//! | eqs. 5–13, P'M'·sin φ and ε | [`stretched_projection_mm`] |
//! | eq. 14, r = f·θ | [`image_radius_mm`] |
//! | eqs. 15–17, r_M, r_M', disp_N | [`NormalPress`] |
//! | eqs. 18–20, the sheared film | [`shear_stretch`], [`sheared_position_mm`] |
//! | eqs. 21–22, disp_S | [`disp_s_mm`] |
//! | eq. 23, D_ph | [`PinholeDistance`], [`Design::d_ph_mm`] |
//! | eq. 24, Q | [`Design::quality_mm`] |
//! | R*(z, PP') | [`Design::best_r`] |
//! | eq. 25, its mean | [`Design::mean_best_r`] |
//! | Figure 8 | [`Map`], [`Map::to_svg`] |
//!
//! Lengths are in mm, angles in radians. The paper's z is a *depth*: positive towards the camera,
//! opposite to the z of the film frame. Everything is generic over `f32` and `f64` ([`Real`]), but
//! the mean and the map, which are `f64`. Values outside a function's domain, and values that are
//! no number, are an [`OutOfDomain`].
//!
//! The model is a guide to where markers go, not the film that scenes use. Where the paper is
//! ambiguous or wrong, the item's documentation says so; `docs/paper-model.md` collects it with
//! numbers.
//!
//! ```
//! use hivtac_studies::paper_model::{Design, PinholeDistance};
//!
//! let design = Design::<f64>::paper(PinholeDistance::Slant);
//! let r = design.best_r(3.5, 3.5)?.expect("a maximum away from the centre");
//! assert!((r - 0.2814).abs() < 1e-4);
//! # Ok::<(), hivtac_studies::paper_model::OutOfDomain>(())
//! ```

mod design;
mod displacement;
mod domain;
mod figure8;
mod map;
mod optimum;
mod real;
mod shear;

pub use design::{Design, PinholeDistance};
pub use displacement::{NormalPress, image_radius_mm, stretched_projection_mm};
pub use domain::OutOfDomain;
pub use map::{Map, MeanBestR};
pub use real::Real;
pub use shear::{disp_s_mm, shear_stretch, sheared_position_mm};
