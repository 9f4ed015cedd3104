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

/// Images of dots, focal lengths from where they rest.
pub type Images = Vec<[f64; 2]>;

/// A pair with the motion of dots: by the pair, and the mean of single contacts by their parts,
/// each with the size of both.
#[derive(Clone, Debug)]
pub struct SolvedPair {
    /// The pair.
    pub pair: Pair,
    /// The motion under both.
    pub both: Images,
    /// The mean of the motions under one.
    pub mean: Images,
}

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

    /// Solves a pair.
    ///
    /// # Errors
    /// If the film finds no equilibrium.
    fn both(&self, pair: &Pair) -> Result<Images> {
        let mut patches = Vec::new();
        for (place, force) in pair.places_mm.iter().zip(pair.forces_n) {
            patches.push((Patch::tip(*place, NOMINAL_RADIUS_MM)?, force));
        }
        self.pressed(&patches)
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
        let both = self.both(pair)?;
        let sizes_n = pair.forces_n.map(length);
        let together_n = sizes_n[0] + sizes_n[1];
        let mut mean = vec![[0.0; 2]; both.len()];
        for k in [0, 1] {
            let part = sizes_n[k] / together_n;
            let force_n = pair.forces_n[k].map(|own| own / part);
            let place_mm = pair.places_mm[k];
            let state = self
                .film
                .press_force(place_mm, force_n, &self.film.rest())?;
            for (mean, own) in mean.iter_mut().zip(self.seen(&state)) {
                for (mean, own) in mean.iter_mut().zip(own) {
                    *mean += part * own;
                }
            }
        }
        Ok(SolvedPair {
            pair: *pair,
            both,
            mean,
        })
    }
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

    type Needle = ([f64; 2], [f64; 3]);
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

        /// What the sensor makes of a frame under needles: its status, and two contacts.
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
    fn two_needles_are_told_from_one_and_from_three() {
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
