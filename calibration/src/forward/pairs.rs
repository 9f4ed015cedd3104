//! Solves the film under two contacts at once, and under each alone.

use anyhow::Result;
use hivtac_shell::{Design, Equilibrium, Film, Patch};
use hivtac_twin::film::Layout;
use hivtac_twin::film::reduced::NOMINAL_RADIUS_MM;
use hivtac_twin::{Camera, Disc, Frame, Load, Preset, Scene};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::in_focal_lengths;

/// Two needles that press at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// Their forces, N.
    pub forces_n: [[f64; 3]; 2],
    /// Their places, mm.
    pub places_mm: [[f64; 2]; 2],
}

/// The ranges of drawn pairs: both forces together, N; the part of one of them; the distance, mm;
/// tilts along each axis, degrees; places along each axis, mm.
const TOGETHER_N: [f64; 2] = [0.04, 0.22];
const PART: [f64; 2] = [0.15, 0.85];
const APART_MM: [f64; 2] = [0.5, 9.0];
const TILT_DEG: f64 = 9.0;
const REACH_MM: f64 = 6.0;
/// The largest distance from the middle that a tip's disc reaches, mm.
const TIP_REACH_MM: f64 = 6.5;
/// Steps for slopes: of a force, N, and of a place, mm.
const FORCE_STEP_N: f64 = 1e-4;
const PLACE_STEP_MM: f64 = 1e-2;

/// Images of dots, focal lengths from where they rest.
pub type Images = Vec<[f64; 2]>;

/// A motion of dots, with its slopes by the numbers of a contact.
#[derive(Clone, Debug)]
pub struct Motion {
    /// The motion, focal lengths.
    pub moved: Images,
    /// Its slopes, focal lengths per N or mm.
    pub slopes: Vec<Images>,
}

/// A pair with the motion of dots: by the pair, and the mean of single contacts by their parts,
/// each with the size of both. Slopes are by the components of both forces, then of both places.
#[derive(Clone, Debug)]
pub struct SolvedPair {
    /// The pair.
    pub pair: Pair,
    /// The motion under both.
    pub both: Motion,
    /// The mean of the motions under one.
    pub mean: Motion,
}

/// A needle's place, mm, and its force, N.
type Needle = ([f64; 2], [f64; 3]);

impl Pair {
    /// Draws pair `number` of a seed.
    pub fn draw(seed: u64, number: u64) -> Pair {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(number);
        loop {
            let mut between = |[from, to]: [f64; 2]| random.random_range(from..to);
            let (together_n, part) = (between(TOGETHER_N), between(PART));
            let middle_mm = [(); 2].map(|()| between([-REACH_MM, REACH_MM]));
            let (apart_mm, turn) = (between(APART_MM), between([0.0, std::f64::consts::TAU]));
            let tilts = [(); 4].map(|()| between([-TILT_DEG, TILT_DEG]).to_radians().tan());
            let half = [0.5 * apart_mm * turn.cos(), 0.5 * apart_mm * turn.sin()];
            let places_mm = [1.0, -1.0].map(|way| [0, 1].map(|i| middle_mm[i] + way * half[i]));
            if places_mm.iter().flatten().any(|part| part.abs() > REACH_MM) {
                continue;
            }
            let force_n = |size_n: f64, [x, y]: [f64; 2]| {
                let whole = (x * x + y * y + 1.0).sqrt();
                [x, y, -1.0].map(|part| size_n * part / whole)
            };
            let [a, b, c, d] = tilts;
            return Pair {
                forces_n: [
                    force_n(part * together_n, [a, b]),
                    force_n((1.0 - part) * together_n, [c, d]),
                ],
                places_mm,
            };
        }
    }

    /// The parts of both forces.
    fn parts(&self) -> [f64; 2] {
        let sizes_n = self.forces_n.map(length);
        sizes_n.map(|size_n| size_n / (sizes_n[0] + sizes_n[1]))
    }

    /// The mean of single contacts by their parts.
    fn mean(&self, [first, second]: &[Motion; 2]) -> Motion {
        let [a, b] = self.parts();
        let together_n: f64 = self.forces_n.map(length).iter().sum();
        // The slope of the mean by the first contact's part: as it grows, its single force falls.
        let mut by_part = vec![(1.0, &first.moved), (-1.0, &second.moved)];
        for axis in 0..3 {
            by_part.push((-self.forces_n[0][axis] / a, &first.slopes[axis]));
            by_part.push((self.forces_n[1][axis] / b, &second.slopes[axis]));
        }
        let by_part = sum(&by_part);
        let mut slopes = Vec::new();
        for (number, (own, per_n)) in [(first, b), (second, -a)].into_iter().enumerate() {
            let force_n = self.forces_n[number];
            for axis in 0..3 {
                let grows = per_n * force_n[axis] / length(force_n) / together_n;
                slopes.push(sum(&[(1.0, &own.slopes[axis]), (grows, &by_part)]));
            }
        }
        for (own, part) in [(first, a), (second, b)] {
            slopes.extend(own.slopes[3..].iter().map(|slope| sum(&[(part, slope)])));
        }
        Motion {
            moved: sum(&[(a, &first.moved), (b, &second.moved)]),
            slopes,
        }
    }
}

/// The nominal film with a mesh, and its camera.
pub struct PairFilm {
    film: Film,
    camera: Camera,
    discs: Vec<Disc>,
}

impl PairFilm {
    /// The film with the dots at these places, mm.
    ///
    /// # Errors
    /// If the fineness is out of range.
    pub fn new(places_mm: &[[f64; 2]], fineness: f64) -> Result<PairFilm> {
        let design = Design {
            tip_radius_mm: NOMINAL_RADIUS_MM,
            tip_reach_mm: TIP_REACH_MM,
            fineness,
            gauss_points: 2,
            ..Design::default()
        };
        Ok(PairFilm {
            film: Film::new(&design)?,
            camera: Camera::new(Preset::Ov7725, 320, 240)?,
            discs: places_mm.iter().map(|place| Disc::marker(*place)).collect(),
        })
    }

    fn seen(&self, state: &Equilibrium) -> Images {
        let image = |disc: &Disc| {
            let there = disc.centroid_px(|rest| self.film.displacement(state, rest), &self.camera);
            let here = disc.centroid_px(|_| [0.0; 3], &self.camera);
            let [there, here] = [there, here].map(|px| in_focal_lengths(px, &self.camera));
            [there[0] - here[0], there[1] - here[1]]
        };
        self.discs.iter().map(image).collect()
    }

    /// Solves forces, N, that are spread over patches.
    ///
    /// # Errors
    /// If the film finds no equilibrium.
    pub fn pressed(&self, patches: &[(Patch, [f64; 3])]) -> Result<Images> {
        Ok(self.seen(&self.film.press_patches(patches, &self.film.rest())?))
    }

    /// A frame of a scene's camera under forces, N, that are spread over patches. The number
    /// selects its noise; its truth has no load.
    ///
    /// # Errors
    /// If the film finds no equilibrium.
    pub fn frame(
        &self,
        scene: &Scene,
        patches: &[(Patch, [f64; 3])],
        number: u64,
    ) -> Result<Frame> {
        let state = self.film.press_patches(patches, &self.film.rest())?;
        let moved = |rest| self.film.displacement(&state, rest);
        Ok(scene.render_film(moved, &Load::REST, number))
    }

    /// Solves a pair, and single contacts at its places.
    ///
    /// # Errors
    /// If the film finds no equilibrium.
    pub fn solved(&self, pair: &Pair) -> Result<SolvedPair> {
        let needles = [0, 1].map(|k| (pair.places_mm[k], pair.forces_n[k]));
        let parts = pair.parts();
        let [first, second] = [0, 1].map(|k| {
            let force_n = pair.forces_n[k].map(|own| own / parts[k]);
            self.needles(&[(pair.places_mm[k], force_n)])
        });
        Ok(SolvedPair {
            pair: *pair,
            both: self.needles(&needles)?,
            mean: pair.mean(&[first?, second?]),
        })
    }

    /// Solves needles that press at once. Slopes are by the components of all forces, then of all
    /// places.
    fn needles(&self, needles: &[Needle]) -> Result<Motion> {
        let tip = |place_mm| Patch::tip(place_mm, NOMINAL_RADIUS_MM);
        let (mut patches, mut by_forces, mut by_places) = (Vec::new(), Vec::new(), Vec::new());
        for (place_mm, force_n) in needles {
            patches.push((tip(*place_mm)?, *force_n));
            for axis in 0..3 {
                let mut step_n = [0.0; 3];
                step_n[axis] = FORCE_STEP_N;
                by_forces.push(vec![(tip(*place_mm)?, step_n)]);
            }
            for axis in 0..2 {
                let mut beside = [*place_mm; 2];
                beside[0][axis] -= PLACE_STEP_MM;
                beside[1][axis] += PLACE_STEP_MM;
                let [back_n, forth_n] = [-0.5, 0.5].map(|half| force_n.map(|part| half * part));
                by_places.push(vec![(tip(beside[0])?, back_n), (tip(beside[1])?, forth_n)]);
            }
        }
        let state = self.film.press_patches(&patches, &self.film.rest())?;
        let steps = [FORCE_STEP_N].repeat(by_forces.len()).into_iter();
        let steps = steps.chain([PLACE_STEP_MM].repeat(by_places.len()));
        let loads = [by_forces, by_places].concat();
        let answers = self.film.answers_to_patches(&state, &loads)?;
        let slopes = answers.iter().zip(steps).map(|(answer, step)| {
            let [back, forth] =
                [-1.0, 1.0].map(|way| self.seen(&self.film.beside(&state, answer, way)));
            sum(&[(-0.5 / step, &back), (0.5 / step, &forth)])
        });
        Ok(Motion {
            slopes: slopes.collect(),
            moved: self.seen(&state),
        })
    }
}

/// A sum of motions, each times a factor.
fn sum(terms: &[(f64, &Images)]) -> Images {
    let mut sum = Images::new();
    for (factor, images) in terms {
        sum.resize(images.len(), [0.0; 2]);
        for (sum, image) in sum.iter_mut().zip(images.iter()) {
            for (sum, part) in sum.iter_mut().zip(image) {
                *sum += factor * part;
            }
        }
    }
    sum
}

fn length(vector: [f64; 3]) -> f64 {
    vector.iter().map(|part| part * part).sum::<f64>().sqrt()
}

/// The places of a layout's dots, then of the layout mirrored in the diagonal, mm.
pub fn places_and_mirrored(layout: &Layout) -> Vec<[f64; 2]> {
    let places = layout.centres_mm();
    let mirrored = places.iter().map(|[x, y]| [*y, *x]);
    places.iter().copied().chain(mirrored).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::errors::angle_deg;
    use crate::forward::{layout_scene, rest_of, untared};
    use hivtac_sensor::force::forward::Drift;
    use hivtac_sensor::force::model::Model;
    use hivtac_sensor::force::{Force, TwoContacts};
    use hivtac_sensor::pipeline::Sensor;
    use hivtac_terms::contact_shape::ContactShape;
    use hivtac_terms::status::Status;

    const MODEL: &[u8] = include_bytes!("../../models/8v/default.hvtm");

    const LEFT: Needle = ([-2.5, 1.0], [0.003, -0.002, -0.05]);
    const RIGHT: Needle = ([1.5, 0.5], [-0.001, 0.004, -0.05]);
    const THIRD: Needle = ([0.0, -3.5], [0.0, 0.0, -0.05]);

    struct Bench<'m> {
        film: PairFilm,
        scene: Scene,
        sensor: Box<Sensor<'m>>,
    }

    impl<'m> Bench<'m> {
        fn new(model: &Model<'m>) -> Bench<'m> {
            let layout: Layout = "8v".parse().unwrap();
            let scene = layout_scene(layout).unwrap();
            let mut sensor = untared(model).unwrap();
            let rest = rest_of(&mut sensor, &scene, 1_000).unwrap();
            sensor.set_tare(Some(rest), Drift::NONE);
            Bench {
                film: PairFilm::new(&layout.centres_mm(), 0.7).unwrap(),
                scene,
                sensor,
            }
        }

        /// The sensor's answer to a frame under needles: its status, and two contacts.
        fn seen(&mut self, needles: &[Needle]) -> (Status, Option<TwoContacts>) {
            let needle =
                |(place, force): &Needle| (Patch::tip(*place, NOMINAL_RADIUS_MM).unwrap(), *force);
            let patches: Vec<_> = needles.iter().map(needle).collect();
            let frame = self.film.frame(&self.scene, &patches, 7).unwrap();
            let seen = self.sensor.measure_frame_closely(&frame.to_rgb565());
            (seen.status, self.sensor.two_contacts(&seen))
        }
    }

    fn is_near(force: &Force, force_n: [f64; 3], [most_deg, most_mn]: [f64; 2]) {
        let found_n = force.cartesian.map(|part| 1e-6 * f64::from(part.0));
        let direction_deg = angle_deg(found_n, force_n).unwrap();
        let off_mn = 1e3 * (length(found_n) - length(force_n)).abs();
        assert!(
            direction_deg < most_deg && off_mn < most_mn,
            "{force:?} {force_n:?}"
        );
    }

    /// Frames of the simulated camera: one needle is one contact, two are two, three are neither.
    #[test]
    fn two_needles_are_distinguished_from_one_and_from_three() {
        let model = Model::parse(MODEL).unwrap();
        let mut bench = Bench::new(&model);
        let (status, two) = bench.seen(&[LEFT]);
        assert!(
            !status.contains(Status::UNEXPLAINED) && two.is_none(),
            "{status:?}"
        );
        let (status, two) = bench.seen(&[LEFT, RIGHT, THIRD]);
        assert!(
            status.intersects(Status::NO_FORCE) && two.is_none(),
            "{two:?}"
        );
        let (status, two) = bench.seen(&[LEFT, RIGHT]);
        assert!(status.contains(Status::UNEXPLAINED), "{status:?}");
        let TwoContacts { sum, each, .. } = two.unwrap();
        is_near(&sum, [0, 1, 2].map(|i| LEFT.1[i] + RIGHT.1[i]), [1.0, 1.0]);
        let mut each = each.unwrap();
        each.sort_by_key(|force| force.place.unwrap().x);
        for (force, (place_mm, force_n)) in each.iter().zip([LEFT, RIGHT]) {
            is_near(force, force_n, [5.0, 3.0]);
            let place = force.place.unwrap();
            let off = |of: i32, mm: f64| (1e-3 * f64::from(of) - mm).abs();
            assert!(off(place.x.0, place_mm[0]) < 0.2 && off(place.y.0, place_mm[1]) < 0.2);
        }
        // A wide contact would be taken for two.
        bench.sensor.set_contact_shape(ContactShape::Unknown);
        assert!(bench.seen(&[LEFT, RIGHT]).1.is_none());
    }

    /// By each force's z and each place's x, of both and of the mean.
    #[test]
    fn slopes_are_differences() {
        let film = PairFilm::new(&[[2.5, 0.0], [-7.0, 4.5]], 0.4).unwrap();
        let pair = Pair {
            forces_n: [LEFT.1, RIGHT.1],
            places_mm: [LEFT.0, RIGHT.0],
        };
        let here = film.solved(&pair).unwrap();
        for (number, step) in [(2, 1e-4), (5, 1e-4), (6, 1e-2), (8, 1e-2)] {
            let [back, forth] = [-step, step].map(|step| {
                let mut pair = pair;
                match number {
                    0..6 => pair.forces_n.as_flattened_mut()[number] += step,
                    _ => pair.places_mm.as_flattened_mut()[number - 6] += step,
                }
                film.solved(&pair).unwrap()
            });
            let all = [&back, &forth, &here];
            for [back, forth, here] in [all.map(|of| &of.both), all.map(|of| &of.mean)] {
                for (dot, slope) in here.slopes[number].iter().enumerate() {
                    for axis in 0..2 {
                        let off = forth.moved[dot][axis] - back.moved[dot][axis];
                        let (difference, slope) = (off / (2.0 * step), slope[axis]);
                        let limit = 1e-3 * slope.abs() + 1e-5;
                        assert!(
                            (difference - slope).abs() < limit,
                            "{number} {dot} {axis}: {difference} {slope}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn draws_are_within_their_ranges() {
        for number in 0..50 {
            let pair = Pair::draw(1, number);
            assert_eq!(pair, Pair::draw(1, number));
            let together_n: f64 = pair.forces_n.map(length).iter().sum();
            assert!((TOGETHER_N[0]..TOGETHER_N[1]).contains(&together_n));
            assert!(
                pair.places_mm
                    .iter()
                    .flatten()
                    .all(|part| part.abs() <= REACH_MM)
            );
        }
    }
}
