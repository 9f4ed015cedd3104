//! The film under two needles, as the sensing's own model has it.
//!
//! The film's tables have one contact. Under two, film and dots move by the mean of two single
//! motions, and the dots also by the network of `hivtac_sensor::force::forward::pair`. So the live
//! twin has the sensing's own model of two contacts, without its errors; `docs/results/touches.md`
//! has those, by finite elements.

use super::hand::{MOST_N, Press};
use hivtac_sensor::force::forward::pair::{Both, Interaction};
use hivtac_sensor::force::forward::{Column, Forward, Pose};
use hivtac_sensor::force::model::Model;
use hivtac_twin::{Disc, Layout, Load, Scene};

/// How far from its middle a dot moves as one, mm.
const DOT_MM: f64 = 1.0;
/// Step for the slopes of a dot's image, mm.
const STEP_MM: f64 = 0.01;
/// Corrections of a dot's shift, each from the slopes where the last one led.
const CORRECTIONS: usize = 2;

/// The film with these dots under two contacts.
#[derive(Clone, Debug)]
pub struct PairFilm {
    forward: Forward<'static>,
    interaction: Interaction<'static>,
    dots_mm: Vec<[f64; 2]>,
}

impl PairFilm {
    /// That of a model; `None` if two contacts on its layout are not known.
    pub fn of(model: &'static [u8], layout: Layout) -> Option<PairFilm> {
        let forward = Model::parse(model).ok()?.forward?;
        let interaction = Interaction::of_layout(&forward.rest_image)?;
        Some(PairFilm {
            forward,
            interaction,
            dots_mm: layout.centres_mm().into_iter().collect(),
        })
    }

    /// Returns the motion of a point of the scene's film, mm, under two touches; `None` if the film
    /// cannot take them.
    pub fn displacement(
        &self,
        scene: &Scene,
        touches: [Press; 2],
    ) -> Option<impl Fn([f64; 2]) -> [f64; 3]> {
        let together_n = touches[0].force_n + touches[1].force_n;
        if together_n <= 0.0 {
            return None;
        }
        let part = touches[0].force_n / together_n;
        let [first, second] = touches.map(|touch| {
            let whole = Press {
                force_n: together_n,
                ..touch
            };
            scene.pressed(&load(whole)?).ok()
        });
        let (first, second) = (first?, second?);
        let alone = move |rest: [f64; 2]| [&first, &second].map(|film| film.displacement(rest));
        let mean = move |[a, b]: [[f64; 3]; 2]| -> [f64; 3] {
            [0, 1, 2].map(|i| part * a[i] + (1.0 - part) * b[i])
        };
        let shifts = self.shifts(scene, touches, (&alone, &mean))?;
        let dots_mm = self.dots_mm.clone();
        Some(move |rest: [f64; 2]| {
            let [x, y, z] = mean(alone(rest));
            let near = |dot: &[f64; 2]| libm::hypot(rest[0] - dot[0], rest[1] - dot[1]) < DOT_MM;
            let [right, down] = dots_mm
                .iter()
                .position(near)
                .map_or([0.0; 2], |id| shifts[id]);
            [x + right, y + down, z]
        })
    }

    /// The shift of each dot along the film, mm, that moves its image from the mean of the single
    /// contacts' images as the network says. The image of the mean film is elsewhere: a picture
    /// of a mean is no mean of pictures.
    fn shifts(
        &self,
        scene: &Scene,
        touches: [Press; 2],
        (alone, mean): (
            &impl Fn([f64; 2]) -> [[f64; 3]; 2],
            &impl Fn([[f64; 3]; 2]) -> [f64; 3],
        ),
    ) -> Option<Vec<[f64; 2]>> {
        let moved = self.moved(touches)?;
        let camera = scene.camera();
        let shifts = self.dots_mm.iter().enumerate().map(|(id, dot)| {
            let disc = Disc::marker(*dot);
            let [a, b] = [0, 1].map(|which| disc.centroid_px(|rest| alone(rest)[which], camera));
            let wanted = [0, 1].map(|axis| {
                let [mean_px, ..] = mean([[a[axis]; 3], [b[axis]; 3]]);
                mean_px + f64::from(moved.at(2 * id + axis)) * camera.focal_px()
            });
            let at = |[right, down]: [f64; 2]| {
                let shifted = |rest| {
                    let [x, y, z] = mean(alone(rest));
                    [x + right, y + down, z]
                };
                disc.centroid_px(shifted, camera)
            };
            (0..CORRECTIONS).fold([0.0; 2], |[right, down], _| {
                let here = at([right, down]);
                let px = [0, 1].map(|axis| wanted[axis] - here[axis]);
                let [x, y] = step(here, |[x, y]| at([right + x, down + y]), px);
                [right + x, down + y]
            })
        });
        Some(shifts.collect())
    }

    /// The motion of the images that the network adds, focal lengths.
    fn moved(&self, touches: [Press; 2]) -> Option<Column> {
        let [first, second] = touches.map(|touch| {
            let force_n = load(touch)?.vector_n().map(|part| part as f32);
            let place_mm = touch.place_mm.map(|part| part as f32);
            let Forward {
                stiffness, limits, ..
            } = &self.forward;
            Some(Pose::of_force(force_n, place_mm, stiffness, limits))
        });
        let both = Both::new([first?, second?], &self.forward);
        Some(self.interaction.moved(&both))
    }
}

/// The shift along the film, mm, that moves an image by `px`, from the slopes of `at`, the image's
/// place after a shift; `here` is its place without one.
pub(super) fn step(here: [f64; 2], at: impl Fn([f64; 2]) -> [f64; 2], px: [f64; 2]) -> [f64; 2] {
    let slope = |there: [f64; 2]| [0, 1].map(|axis| (there[axis] - here[axis]) / STEP_MM);
    let [a, c] = slope(at([STEP_MM, 0.0]));
    let [b, d] = slope(at([0.0, STEP_MM]));
    let whole = a * d - b * c;
    [
        (d * px[0] - b * px[1]) / whole,
        (a * px[1] - c * px[0]) / whole,
    ]
}

/// The load of a touch.
fn load(touch: Press) -> Option<Load> {
    let [alpha, beta] = touch.angles_deg;
    let load = Load::from_angles(touch.force_n, alpha, beta).ok()?;
    load.with_offset_mm(touch.place_mm).ok()
}

/// The sum of two touches as one load in their middle, for the truth; no load without any.
pub fn sum(touches: [Press; 2]) -> Load {
    let sum = || {
        let [first, second] = touches.map(|touch| load(touch).map(|load| load.vector_n()));
        let (first, second) = (first?, second?);
        let together_n = touches[0].force_n + touches[1].force_n;
        let part = touches[0].force_n / together_n;
        let [a, b] = touches.map(|touch| touch.place_mm);
        let middle_mm = [0, 1].map(|i| part * a[i] + (1.0 - part) * b[i]);
        let load = Load::from_vector([0, 1, 2].map(|i| first[i] + second[i])).ok()?;
        load.with_offset_mm(middle_mm).ok()
    };
    sum().unwrap_or(Load::REST)
}

/// Two touches whose forces are together in range.
pub fn in_range(touches: [Press; 2]) -> [Press; 2] {
    let together_n = touches[0].force_n + touches[1].force_n;
    let part = (MOST_N / together_n.max(MOST_N)).min(1.0);
    touches.map(|touch| Press {
        force_n: part * touch.force_n,
        ..touch
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::live::camera::Kind;
    use crate::live::device::Device;
    use crate::live::eye::{Disturbances, Eye, Presses};
    use crate::live::hand::Hand;
    use crate::live::tested::Tested;
    use hivtac_terms::contact_shape::ContactShape;
    use hivtac_terms::status::Status;
    use hivtac_wire::message::{Request, Sample};

    const LEFT: Press = Press {
        place_mm: [-2.5, 1.0],
        force_n: 0.05,
        angles_deg: [2.0, -1.0],
    };
    const RIGHT: Press = Press {
        place_mm: [1.5, -0.5],
        force_n: 0.06,
        angles_deg: [0.0, 3.0],
    };

    /// The samples of frames under two fingers.
    fn samples(count: u32) -> Vec<Sample> {
        let (kind, layout) = (Kind::Ov7725, "8v".parse().unwrap());
        let scene = kind.scene("rest", layout, 1).unwrap();
        let hand = Hand::at_once();
        let usual = Disturbances::default();
        let eye = Eye::new(kind, scene, Presses::Scene, usual, hand.clone()).unwrap();
        let mut tested = Tested::new(Device::new(kind, layout, [0; 12], 1.0), eye);
        tested.greet();
        tested.ask(1, Request::SetContactShape(ContactShape::Needle));
        tested.ask(1, Request::Start);
        hand.set([Some(LEFT), Some(RIGHT)]);
        (0..count).map(|_| tested.sample()).collect()
    }

    #[test]
    fn two_fingers_are_two_contacts() {
        let samples = samples(200);
        let reported = |sample: &&Sample| sample.status.contains(Status::TWO_CONTACTS);
        let first = samples.iter().position(|sample| reported(&sample)).unwrap();
        assert!((20..180).contains(&first), "{first}");
        assert!(samples[first..].iter().all(|sample| reported(&sample)));
        let last = samples.last().unwrap();
        let mut contacts = last.each_contact().to_vec();
        contacts.sort_by_key(|contact| contact.place.unwrap().x);
        assert_eq!(contacts.len(), 2, "{last:?}");
        for (contact, touch) in contacts.iter().zip([LEFT, RIGHT]) {
            let place = contact.place.unwrap();
            let off = |um: i32, mm: f64| (1e-3 * f64::from(um) - mm).abs();
            assert!(off(place.x.0, touch.place_mm[0]) < 0.3, "{contact:?}");
            assert!(off(place.y.0, touch.place_mm[1]) < 0.3, "{contact:?}");
            let off_n = 1e-6 * f64::from(contact.magnitude.0) - touch.force_n;
            assert!(off_n.abs() < 0.006, "{contact:?}");
        }
        let sum = last.force.unwrap();
        assert!((sum.magnitude.0 - 110_000).abs() < 2_000, "{sum:?}");
    }
}
