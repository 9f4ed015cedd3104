//! The simulated HiVTac sensor: the loads, the film's answer to them, and the camera's frames.
//!
//! ```text
//! load → film → marker discs in space → fisheye
//!      → coverage of pixels → light → noise → pixels
//! ```
//!
//! Every frame comes with its [`Truth`]: the force and the true centroids. Frames are pure
//! functions of scene, seed, frame number and load, with the same bytes on every machine.
//! Transcendental functions come from `libm` only, no operations are fused, and the noise generator
//! is the crate's own.
//!
//! ```
//! use hivtac_twin::{Preset, Scene};
//!
//! let scene = Scene::preset("demo", Preset::Ov7725, 320, 240, 1)?;
//! let frame = scene.frame(7, 7.0 / 30.0);
//! assert_eq!(frame.pixels.len(), 320 * 240);
//! assert!(frame.truth.force.magnitude_n() > 0.02);
//! # Ok::<(), hivtac_twin::SceneError>(())
//! ```
//!
//! | file | subject |
//! |---|---|
//! | [`film`] | the film's displacement under a load, by tables |
//! | `camera` | presets, equidistant fisheye |
//! | `disc`, `coverage` | the image of a disc: outline, area, centroid; the part of each pixel that it covers |
//! | `options` | the conditions that make a frame harder or easier, and their ranges |
//! | `light`, `patch`, `lens` | light and colours; things on the film; projection, focus, mounting, shutter |
//! | `room`, `mirror` | what a film shows that lets light through, and one that is glossy |
//! | `exposure` | the place of a disc while its rows are exposed |
//! | `noise`, `bayer` | seeded sensor noise; pixels that see one colour each |
//! | `format`, `jpeg`, `frame` | RGB565, YUV422, mono and JPEG; the frame and the truth |
//! | `view` | the motion of a disc, so that the camera sees it where the film has it |
//! | `mechanics`, `surface` | the film as it is, or simplified |
//! | `creep` | the film's memory of earlier loads |
//! | `motion`, `scene` | loads in time; the scene itself |
//! | [`units`] | how exactly units are built, and units drawn so |
//! | `file` | scenes from TOML files |
//! | `hard_cases` | scenes in which markers are hard to find (feature `jpeg`) |

mod bayer;
mod camera;
mod coverage;
mod creep;
mod disc;
mod error;
mod exposure;
#[cfg(feature = "file")]
mod file;
pub mod film;
mod format;
mod frame;
#[cfg(feature = "jpeg")]
pub mod hard_cases;
#[cfg(feature = "jpeg")]
mod jpeg;
mod lens;
mod light;
mod mechanics;
mod mirror;
mod motion;
mod noise;
mod options;
mod patch;
mod room;
mod scene;
mod surface;
pub mod units;
mod view;

pub use camera::{Camera, FILM_DISTANCE_MM, FOCAL_LENGTH_MM, PresetCamera};
pub use creep::{Creep, Memory};
pub use disc::{Disc, MARKERS};
pub use error::SceneError;
pub use film::{
    Contact, DiscMotion, Dots, FilmError, HALF_SIDE_MM, Layout, Load, MARKER_RADIUS_MM,
    MARKER_REST_MM, Pressed,
};
pub use format::Format;
#[cfg(feature = "jpeg")]
pub use format::JPEG_QUALITY;
pub use frame::{Frame, MarkerTruth, Truth};
pub use hivtac_terms::geometry::Preset;
pub use lens::{Discs, Lens, Mounting, Projection, Shutter};
pub use mechanics::{Mechanics, Stiffness};
pub use motion::{Catch, Drag, Grasp, Motion, Press, Vibration};
pub use options::{OV5640_NOISE, Options, Salt};
pub use patch::{Paint, Patch, Specks};
pub use room::Room;
pub use scene::Scene;
pub use surface::Surface;
pub use view::{disc_motion, seen_motion};
