//! Renders the camera's picture: the scene, its disturbances, and what presses it.

use super::calibrated::CalibratedFilm;
use super::camera::{Camera, Kind};
use super::course::Course;
use super::hand::{Following, Hand, Press};
use super::pair::{self, PairFilm};
use hivtac_terms::threshold::PixelFormat;
use hivtac_twin::{Format, Frame, Load, Paint, Patch, Scene, SceneError, Shutter, Truth};

/// The light's reflection under `glare`: on the edge of marker 0, where it cuts a part off.
const GLARE: Patch = Patch {
    centre_mm: [-3.5, -3.9],
    radius_mm: 0.25,
    paint: Paint::Glare,
};
/// Number of frames after which the drift's next step comes: a scene takes as long to shift as to
/// render.
const DRIFT_EVERY: u32 = 64;

/// Disturbances of the camera's view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disturbances {
    /// A reflection on a marker.
    pub glare: bool,
    /// Brightness of the light, 1 is nominal, once the camera has found its exposure.
    pub dim: f64,
    /// Shift of the picture, px a minute along x, as of a camera that warms up.
    pub drift_px: f64,
}

impl Default for Disturbances {
    fn default() -> Self {
        Self {
            glare: false,
            dim: 1.0,
            drift_px: 0.0,
        }
    }
}

/// The press without a hand.
#[derive(Clone, Debug)]
pub enum Presses {
    /// The scene's own motion.
    Scene,
    /// A recorded course.
    Course(Course),
}

/// A frame as the camera took it.
#[derive(Clone, Debug)]
pub struct Shot {
    /// Pixels as they lie in the device's memory.
    pub words: Vec<u16>,
    /// The truth, in the middle of the exposure.
    pub truth: Truth,
}

/// The view of a camera.
#[derive(Debug)]
pub struct Eye {
    /// The scene as it was given.
    given: Scene,
    /// The scene as it is seen now.
    scene: Scene,
    seen: Seen,
    disturbances: Disturbances,
    presses: Presses,
    /// Two fingers.
    following: [Following; 2],
    /// The film under both together, if known.
    pair: Option<PairFilm>,
    /// The film of a calibrated unit in place of the scene's.
    calibrated: Option<CalibratedFilm>,
}

/// The values on which the rendered scene depends.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Seen {
    format: Format,
    brightness: f64,
    shifted_px: f64,
}

/// A scene that a camera cannot have.
#[derive(Clone, Debug, PartialEq)]
pub enum NotSeen {
    /// Its frames have another size: its own, then the camera's.
    Size([u32; 2], [u16; 2]),
    /// A key of the scene that the camera's settings replace.
    Key(&'static str),
    /// The scene is impossible with the disturbances.
    Scene(SceneError),
}

impl std::fmt::Display for NotSeen {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            NotSeen::Size([width, height], [own_width, own_height]) => write!(
                f,
                "its frames are {width} × {height}, and this camera's are {own_width} × \
                 {own_height}: leave width and height out, or choose another --camera"
            ),
            NotSeen::Key(key) => write!(
                f,
                "the camera's settings say what its `{key}` is: leave that out"
            ),
            NotSeen::Scene(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for NotSeen {}

impl Eye {
    /// The view of a camera of this kind.
    ///
    /// # Errors
    /// Why the camera cannot have this scene.
    pub fn new(
        kind: Kind,
        scene: Scene,
        presses: Presses,
        disturbances: Disturbances,
        hand: Hand,
    ) -> Result<Eye, NotSeen> {
        let size = [scene.camera().width(), scene.camera().height()];
        if size != kind.size().map(u32::from) {
            return Err(NotSeen::Size(size, kind.size()));
        }
        let usual = kind.options();
        if scene.options().format != usual.format {
            return Err(NotSeen::Key("format"));
        }
        if scene.options().shutter != Shutter::default() {
            return Err(NotSeen::Key("shutter"));
        }
        let mut options = scene.options().clone();
        if disturbances.glare {
            options.patches.push(GLARE);
        }
        let given = scene.with_options(options).map_err(NotSeen::Scene)?;
        let seen = Seen {
            format: given.options().format,
            brightness: 1.0,
            shifted_px: 0.0,
        };
        let layout = given.options().layout;
        let eye = Eye {
            scene: given.clone(),
            given,
            seen,
            disturbances,
            presses,
            following: [0, 1].map(|finger| Following::new(hand.clone(), finger)),
            pair: PairFilm::of(kind.model(layout), layout),
            calibrated: None,
        };
        // A drift that leaves the range of mountings would end the view later.
        Ok(eye)
    }

    /// The same view of a calibrated unit's film, which two fingers press as one.
    pub fn with_film(self, film: CalibratedFilm) -> Eye {
        Eye {
            pair: None,
            calibrated: Some(film),
            ..self
        }
    }

    /// The brightness of the light on the film.
    pub fn light(&self) -> f64 {
        self.disturbances.dim
    }

    /// Takes a frame, the middle of whose exposure is at a time in seconds. Its number selects its
    /// noise.
    pub fn shot(&mut self, camera: &Camera, number: u32, time_s: f64) -> Shot {
        self.look(camera, number, time_s);
        let shutter = camera.shutter();
        let scene = &self.scene;
        let number = u64::from(number);
        let [first, second] = self.following.each_mut();
        let hand = [first.advance(time_s), second.advance(time_s)];
        if let Some(frame) = self.both(number, time_s) {
            return taken(frame);
        }
        let own = |load: &dyn Fn(f64) -> Load| match &self.calibrated {
            None => scene.frame_under(&shutter, number, load),
            Some(film) => film.frame(scene, &shutter, number, load),
        };
        let finger = |nth: usize| own(&|after_s| self.following[nth].load(after_s));
        let frame = match (&self.presses, hand) {
            (_, [true, _]) => finger(0),
            (_, [_, true]) => finger(1),
            (Presses::Scene, _) if self.calibrated.is_some() => {
                own(&|after_s| scene.motion().load(time_s + after_s))
            }
            (Presses::Scene, _) => Ok(scene.frame_by(&shutter, number, time_s)),
            (Presses::Course(course), _) => own(&|after_s| course.load(time_s + after_s)),
        };
        // A load beyond the film's tables counts as no load.
        let frame = frame.or_else(|_| own(&|_| Load::REST));
        let frame = frame.unwrap_or_else(|_| scene.frame_by(&shutter, number, time_s));
        taken(frame)
    }

    /// The frame under two touches; `None` if there are not two, or the film is not known under
    /// both: then the first finger presses alone, or the course's sum.
    fn both(&self, number: u64, time_s: f64) -> Option<Frame> {
        let touches = pair::in_range(self.touches(time_s)?);
        let moved = (self.pair.as_ref()?).displacement(&self.scene, touches)?;
        let sum = pair::sum(touches);
        Some(self.scene.render_film(moved, &sum, number))
    }

    /// Both touches of two fingers, or of the course when no finger presses.
    fn touches(&self, time_s: f64) -> Option<[Press; 2]> {
        let [first, second] = &self.following;
        match (first.touch(), second.touch(), &self.presses) {
            (Some(first), Some(second), _) => Some([first, second]),
            (None, None, Presses::Course(course)) => course.touches(time_s),
            _ => None,
        }
    }

    /// Makes the scene that the camera sees now, if it is another one.
    fn look(&mut self, camera: &Camera, number: u32, time_s: f64) {
        let seen = Seen {
            format: match camera.pixels {
                PixelFormat::Rgb565 => Format::Rgb565,
                PixelFormat::Yuv422 => Format::Yuv422,
                PixelFormat::Mono => Format::Mono,
            },
            brightness: camera.brightness(self.disturbances.dim),
            shifted_px: match number % DRIFT_EVERY {
                0 => self.disturbances.drift_px * time_s / 60.0,
                _ => self.seen.shifted_px,
            },
        };
        if seen == self.seen {
            return;
        }
        self.seen = seen;
        let mut options = self.given.options().clone();
        options.format = seen.format;
        options.gain = (options.gain * seen.brightness).min(4.0);
        let [x, _] = &mut options.mounting.shift_px;
        // The range of a mounting.
        *x = (*x + seen.shifted_px).clamp(-200.0, 200.0);
        if let Ok(scene) = self.given.clone().with_options(options) {
            self.scene = scene;
        }
    }
}

/// A frame as it lies in the device's memory.
fn taken(frame: Frame) -> Shot {
    let words = match frame.format {
        // The camera sends the high byte first.
        Format::Rgb565 => frame
            .pixels
            .iter()
            .map(|pixel| pixel.swap_bytes())
            .collect(),
        _ => frame.words().into_owned(),
    };
    Shot {
        words,
        truth: frame.truth,
    }
}
