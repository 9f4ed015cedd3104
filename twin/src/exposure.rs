//! The images of discs in one frame: their places while their rows are exposed, and their blur.

use crate::camera::centre;
use crate::disc::Outline;
use crate::film::{Dots, Film, Pressed};
use crate::lens::Discs;
use crate::mirror;
use crate::{Camera, Disc, FILM_DISTANCE_MM, Lens, Load, MarkerTruth, Mechanics, Shutter};

/// All that decides the places of discs in a picture.
pub(crate) struct Exposure<'a, L: Fn(f64) -> Load> {
    pub(crate) film: &'a Film,
    pub(crate) mechanics: &'a Mechanics,
    pub(crate) camera: &'a Camera,
    pub(crate) lens: &'a Lens,
    pub(crate) shutter: &'a Shutter,
    /// The load at a time in seconds, relative to the frame's time.
    pub(crate) load: L,
    /// The film at the frame's time.
    pub(crate) now: Pressed,
    /// Displacement of the film's points at that time, mm, of a film that `now` describes too
    /// coarsely. Then the shutter takes no time.
    pub(crate) exactly: Option<&'a dyn Fn([f64; 2]) -> [f64; 3]>,
    /// The motion of each marker, mm, if it is not the film's.
    pub(crate) moved: Option<&'a Dots<[f64; 3]>>,
}

/// The image of one disc.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Image {
    /// The disc's outlines during the exposure, at least one.
    pub(crate) outlines: Vec<Outline>,
    /// Standard deviation of the blur.
    pub(crate) blur_px: f64,
}

impl<L: Fn(f64) -> Load> Exposure<'_, L> {
    /// Returns the image of a disc.
    pub(crate) fn image(&self, disc: &Disc) -> Image {
        let now = self.outline(disc, |rest| self.displacement(rest));
        let still =
            self.exactly.is_some() || self.moved.is_some() || *self.shutter == Shutter::default();
        let outlines = match still {
            true => vec![now],
            false => self.smeared(disc, &now),
        };
        Image {
            outlines,
            blur_px: self.blur_px(disc),
        }
    }

    /// Returns the image of a disc far behind the film, where it is seen on the film at rest.
    pub(crate) fn far_image(&self, disc: &Disc) -> Image {
        Image {
            outlines: vec![disc.image(|_| [0.0; 3], self.camera)],
            blur_px: self.lens.blur_px_at(f64::INFINITY, self.camera.focal_px()),
        }
    }

    /// Returns the film's reflections of the LEDs of a board at this distance behind the pinhole,
    /// mm, at the frame's time. A lens that is in focus on the film blurs them as objects at twice
    /// its distance.
    pub(crate) fn leds(&self, board_mm: f64) -> [Image; 4] {
        let far_mm = 2.0 * FILM_DISTANCE_MM + board_mm;
        let blur_px = self.lens.blur_px_at(far_mm, self.camera.focal_px());
        let leds = mirror::images(board_mm, |rest| self.displacement(rest), self.camera);
        leds.map(|outline| Image {
            outlines: vec![outline],
            blur_px,
        })
    }

    /// Returns the outlines during the exposure of the row in which the disc appears at the frame's
    /// time.
    fn smeared(&self, disc: &Disc, now: &Outline) -> Vec<Outline> {
        let (_, [_, row]) = now.area_and_centroid();
        let height = f64::from(self.camera.height());
        let row = row.clamp(0.0, height - 1.0);
        let below = (row - centre(self.camera.height())) / height;
        let instants = self.shutter.instants(below);
        let pressed = instants.map(|time_s| {
            let load = (self.load)(time_s);
            self.mechanics.seen_around(self.film, &load, disc)
        });
        pressed
            .map(|film| self.outline(disc, |rest| film.displacement(rest)))
            .collect()
    }

    /// Returns the displacement of a point of the film at the frame's time, mm.
    fn displacement(&self, rest_mm: [f64; 2]) -> [f64; 3] {
        match (self.exactly, self.moved) {
            (Some(exactly), _) => exactly(rest_mm),
            (None, Some(moved)) => moved.at(self.nearest(rest_mm)),
            (None, None) => self.now.displacement(rest_mm),
        }
    }

    /// Returns the marker that is nearest to a point of the film.
    fn nearest(&self, [x, y]: [f64; 2]) -> usize {
        let squares = self.film.markers_mm().into_iter().map(|[to_x, to_y]| {
            let (x, y) = (to_x - x, to_y - y);
            x * x + y * y
        });
        let nearest = squares.enumerate().min_by(|a, b| a.1.total_cmp(&b.1));
        nearest.map_or(0, |(id, _)| id)
    }

    fn outline(&self, disc: &Disc, film: impl Fn([f64; 2]) -> [f64; 3]) -> Outline {
        let outline = disc.image(&film, self.camera);
        match self.lens.discs {
            Discs::Whole => outline,
            Discs::ByCentre => {
                let [x, y] = self.camera.project(centre_mm(disc, film));
                let (_, [from_x, from_y]) = outline.area_and_centroid();
                outline.moved([x - from_x, y - from_y])
            }
        }
    }

    fn blur_px(&self, disc: &Disc) -> f64 {
        if self.lens.aperture_mm == 0.0 {
            return self.lens.blur_px;
        }
        let [_, _, z] = centre_mm(disc, |rest| self.displacement(rest));
        self.lens
            .blur_px_at(FILM_DISTANCE_MM + z, self.camera.focal_px())
    }
}

/// Returns the position of a disc's centre on a pressed film, mm.
fn centre_mm(disc: &Disc, film: impl Fn([f64; 2]) -> [f64; 3]) -> [f64; 3] {
    let [x, y] = disc.centre_mm;
    let [dx, dy, dz] = film([x, y]);
    [x + dx, y + dy, dz]
}

impl Image {
    /// Returns the image's mean area and centroid. Returns `None` if no part of it is in the frame.
    pub(crate) fn truth(&self, camera: &Camera) -> Option<MarkerTruth> {
        let (mut area, mut inside, mut moment) = (0.0, 0.0, [0.0; 2]);
        for outline in &self.outlines {
            let (part, [x, y]) = outline.area_and_centroid();
            area += part;
            moment = [moment[0] + part * x, moment[1] + part * y];
            inside += outline.clipped(camera.width(), camera.height(), 0.0).area();
        }
        let visible = inside / area;
        (visible > 0.0).then_some(MarkerTruth {
            centroid_px: moment.map(|sum| sum / area),
            area_px2: area / self.outlines.len() as f64,
            visible: visible.min(1.0),
        })
    }
}
