//! The simulated HiVTac sensor: what presses the film, how the film gives, what the camera sees of it.
//!
//! ```text
//! load → film → marker discs in space → fisheye → coverage of pixels → light → noise → RGB565
//! ```
//!
//! Every frame comes with its [`Truth`]: the force and the true centroids. Frames are pure functions of scene, seed,
//! frame number and load, and the same bytes on every machine: transcendental functions come from `libm` only,
//! nothing is fused, and the noise generator is the crate's own.
//!
//! ```
//! use hivtac_scene::{Preset, Scene};
//!
//! let scene = Scene::preset("demo", Preset::Ov7725, 320, 240, 1)?;
//! let frame = scene.frame(7, 7.0 / 30.0);
//! assert_eq!(frame.pixels.len(), 320 * 240);
//! assert!(frame.truth.force.magnitude_n() > 0.02);
//! # Ok::<(), hivtac_scene::SceneError>(())
//! ```
//!
//! | file | subject |
//! |---|---|
//! | `load` | the force on the film and its convention |
//! | `film` | where a point of the film goes under a load: the stand-in film behind the trait [`Film`] |
//! | `camera` | presets, equidistant fisheye |
//! | `disc`, `coverage` | the image of a disc: outline, area, centroid; the part of each pixel that it covers |
//! | `options`, `light` | what makes a frame hard: gain, gradient, falloff, missing markers, patches, mounting |
//! | `noise`, `frame` | seeded sensor noise; RGB565 and the truth |
//! | `motion`, `scene` | loads in time; the scene itself |

mod camera;
mod coverage;
mod disc;
mod error;
mod film;
mod frame;
mod light;
mod load;
mod motion;
mod noise;
mod options;
pub mod paper;
mod scene;

pub use camera::{Camera, FILM_DISTANCE_MM, FOCAL_LENGTH_MM, Preset};
pub use disc::{Disc, MARKER_RADIUS_MM, MARKER_REST_MM, MARKERS};
pub use error::SceneError;
pub use film::{Film, HALF_SIDE_MM, StandInFilm};
pub use frame::{Frame, MarkerTruth, Truth};
pub use load::Load;
pub use options::{Mounting, Options, Paint, Patch};
pub use scene::Scene;
