//! A tip that slides over the film.
//!
//! The sideways force is then μ times the normal one: what is looked for is its direction, and how far the tip has slid
//! along it over the film. The film's curves tell where the tip is pushed by such a force at such a place; the way of
//! the stage that carries it is that way and the slide.

use super::curves::{Curves, Pose};
use super::stuck::{Placed, Stuck};
use super::{Family, MAX_STUCK_N, Pressed, SLIP_N};

/// What a gauge on the tip's stage holds: the stage's direction and the force along it.
#[derive(Clone, Copy, Debug)]
pub struct Gauge {
    /// Sideways travel over depth of the stage.
    pub tangents: [f64; 2],
    /// The force along the stage's way, N.
    pub force_n: f64,
    /// Where the tip first touches the film, mm.
    pub offset_mm: [f64; 2],
}

/// A slide: the direction of the sideways force, of length 1, and how far the tip has slid along it, mm.
#[derive(Clone, Copy, Debug)]
struct Slide {
    along: [f64; 2],
    slid_mm: f64,
}

/// Rounds after which the search has failed; it takes 2 or 3.
const ROUNDS: u32 = 40;
/// A slide is found when the stage's way was met to this part of its depth: the last step leaves a hundredth of it.
const CLOSE: f64 = 1e-6;
/// A tip that a start has slide by more than this part of its depth cannot stick.
const SURE: f64 = 0.002;

/// Where the search for a slide begins.
#[derive(Clone, Copy, Debug)]
pub struct Start {
    mu: f64,
    size: f64,
    slide: Slide,
    /// How much of the stage's way a slide makes up for, mm per mm: it takes the film along.
    gain: f64,
    depth_mm: f64,
}

impl Start {
    /// Whether the tip slides for certain, whatever a film that sticks to it would do.
    pub fn is_sure(&self) -> bool {
        self.slide.slid_mm > SURE * self.depth_mm
    }
}

impl Gauge {
    /// The stage's way for a depth of 1.
    pub fn way(&self) -> f64 {
        let [x, y] = self.tangents;
        (1.0 + x * x + y * y).sqrt()
    }

    /// The force on the film whose sideways part is this: what is left of the gauge's is normal.
    pub fn force_n(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        let [along_x, along_y] = self.tangents;
        [x, y, along_x * x + along_y * y - self.way() * self.force_n]
    }

    /// The tip's place between the solutions of a film that sticks to it.
    #[inline(always)]
    pub fn placed<'a>(&self, stuck: &'a Stuck) -> Placed<'a> {
        let size = libm::cbrt(self.force_n / MAX_STUCK_N).min(1.0);
        stuck.placed(size, self.tangents, self.offset_mm)
    }

    /// Whether friction holds a tip that sticks.
    pub fn is_held(&self, placed: &Placed<'_>, mu: f64) -> bool {
        let [x, y, _] = placed.tip();
        let [_, _, z] = self.force_n([x, y]);
        (x * x + y * y).sqrt() <= mu * -z
    }

    /// The film under a tip that sticks.
    pub fn stuck(&self, placed: &Placed<'_>) -> Pressed {
        let answer = placed.answer();
        let [x, y, z] = answer.tip;
        Pressed {
            tip_mm: [-z * self.tangents[0], -z * self.tangents[1], z],
            force_n: self.force_n([x, y]),
            touches_mm: self.offset_mm,
            discs: answer.discs,
        }
    }

    /// The film under a tip that slides from a start. `None` when the tip would have to slide backward, which is that it
    /// sticks.
    pub fn slide(&self, curves: &Curves, start: &Start) -> Option<Pressed> {
        let mut at = start.slide;
        let mut pose = self.pose(&at, start.mu, start.size);
        for _ in 0..ROUNDS {
            let [x, y, z] = curves.tip(&pose);
            let (missing, way) = self.missing(&at, [x, y, z]);
            let [ahead, aside] = missing;
            at = at.after(ahead / start.gain, (aside / way).clamp(-0.5, 0.5));
            pose = self.pose(&at, start.mu, pose.size);
            if ahead.abs().max(aside.abs()) < -CLOSE * z {
                return (at.slid_mm > 0.0).then(|| self.pressed(curves, &at, &pose, start.mu, z));
            }
        }
        None
    }

    /// Where the search for a slide begins: by the first terms of the tip's curves.
    pub fn start(&self, curves: &Curves, mu: f64) -> Start {
        let [tx, ty] = self.tangents;
        let steep = (tx * tx + ty * ty).sqrt();
        let size = libm::cbrt(self.normal_n(mu * steep) / SLIP_N).min(1.0);
        let lead = curves.lead(size);
        let by_touch = lead.by_offset / Family::Slip.offset_mm(size);
        let [x, y] = [0, 1].map(|c| -lead.z * self.tangents[c] - by_touch * self.offset_mm[c]);
        let way = (x * x + y * y).sqrt();
        let gain = 1.0 + by_touch;
        Start {
            mu,
            size,
            gain,
            depth_mm: -lead.z,
            slide: Slide {
                along: if way > 0.0 {
                    [x / way, y / way]
                } else {
                    [1.0, 0.0]
                },
                slid_mm: (way - mu * lead.by_tilt) / gain,
            },
        }
    }

    /// What is missing of the stage's way along the force and across it, and how far the tip is from where it began.
    fn missing(&self, at: &Slide, [x, y, z]: [f64; 3]) -> ([f64; 2], f64) {
        let [ax, ay] = at.along;
        let [mx, my] = [
            -z * self.tangents[0] - x - at.slid_mm * ax,
            -z * self.tangents[1] - y - at.slid_mm * ay,
        ];
        let way = (x * ax + y * ay) + at.slid_mm;
        ([mx * ax + my * ay, my * ax - mx * ay], way.max(-1e-3 * z))
    }

    /// The normal force, the friction's pull along the stage's way being so much of it.
    fn normal_n(&self, pull: f64) -> f64 {
        self.way() * self.force_n / (1.0 + pull)
    }

    fn pull(&self, at: &Slide, mu: f64) -> f64 {
        mu * (self.tangents[0] * at.along[0] + self.tangents[1] * at.along[1])
    }

    fn touches_mm(&self, at: &Slide) -> [f64; 2] {
        [0, 1].map(|c| self.offset_mm[c] + at.slid_mm * at.along[c])
    }

    /// The pose of a slide, whose size is near a known one.
    fn pose(&self, at: &Slide, mu: f64, near: f64) -> Pose {
        let cube = self.normal_n(self.pull(at, mu)) / SLIP_N;
        // Newton's method for the cube root: a start within 1 % ends within 1e-8.
        let better = |root: f64| (2.0 * root + cube / (root * root)) / 3.0;
        let size = better(better(near)).min(1.0);
        let reach = Family::Slip.offset_mm(size);
        Pose {
            size,
            tilt: at.along.map(|part| mu * part),
            offset: self.touches_mm(at).map(|mm| (mm / reach).clamp(-1.0, 1.0)),
        }
    }

    /// The film with the slide found, the tip being at depth −z: its way is the stage's less the slide.
    fn pressed(&self, curves: &Curves, at: &Slide, pose: &Pose, mu: f64, z: f64) -> Pressed {
        let normal = self.normal_n(self.pull(at, mu));
        let [ax, ay] = at.along;
        let [x, y] = [0, 1].map(|c| -z * self.tangents[c] - at.slid_mm * at.along[c]);
        Pressed {
            tip_mm: [x, y, z],
            force_n: [mu * normal * ax, mu * normal * ay, -normal],
            touches_mm: self.touches_mm(at),
            discs: curves.discs(pose),
        }
    }
}

impl Slide {
    /// The slide after a step along it, mm, and a turn by an angle of this tangent.
    fn after(&self, ahead_mm: f64, turn: f64) -> Slide {
        let [ax, ay] = self.along;
        let length = (1.0 + turn * turn).sqrt();
        Slide {
            along: [(ax - turn * ay) / length, (ay + turn * ax) / length],
            slid_mm: self.slid_mm + ahead_mm,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::film::Film;
    use crate::{Contact, Load};
    use proptest::prelude::*;

    fn load(size_n: f64, alpha: f64, beta: f64, offset_mm: [f64; 2], contact: Contact) -> Load {
        let load = Load::from_angles(size_n, alpha, beta).unwrap();
        let load = load.with_contact(contact).unwrap();
        load.with_offset_mm(offset_mm).unwrap()
    }

    fn along(load: &Load, vector: [f64; 3]) -> f64 {
        let parts = vector.iter().zip(load.vector_n());
        parts.map(|(a, b)| a * b).sum::<f64>() / load.magnitude_n()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]
        #[test]
        fn a_tip_that_sticks_goes_its_way_until_the_gauge_reads_the_force(
            size_n in 1e-6..0.25, alpha in -12.0..12.0, beta in -10.0..10.0, x in -0.25..0.25, y in -0.25..0.25,
        ) {
            let load = load(size_n, alpha, beta, [x, y], Contact::Stick);
            let film = Film::default();
            prop_assert_eq!(film.check(&load), Ok(()));
            let pressed = film.press(&load);
            prop_assert!((along(&load, pressed.force_n) - size_n).abs() < 1e-9);
            let way = along(&load, pressed.tip_mm);
            for (tip, part) in pressed.tip_mm.iter().zip(load.vector_n()) {
                prop_assert!((tip - way * part / size_n).abs() < 1e-9);
            }
            prop_assert_eq!(pressed.touches_mm, [x, y]);
        }

        #[test]
        fn a_tip_that_slides_keeps_ratio_direction_and_gauge(
            size_n in 1e-4..0.25, alpha in -12.0..12.0, beta in -10.0..10.0, x in -0.25..0.25, y in -0.25..0.25,
            mu in 0.05..1.0,
        ) {
            let load = load(size_n, alpha, beta, [x, y], Contact::Slip { mu });
            let film = Film::default();
            prop_assert_eq!(film.check(&load), Ok(()));
            let pressed = film.press(&load);
            let [fx, fy, fz] = pressed.force_n;
            let sideways = libm::hypot(fx, fy);
            // Where curves of two families meet, the ratio of a tip that just sticks may be a little high.
            prop_assert!(sideways <= -mu * fz + 1e-3, "{} {}", sideways, -mu * fz);
            prop_assert!((along(&load, pressed.force_n) - size_n).abs() < 1e-8);
            let slid = [pressed.touches_mm[0] - x, pressed.touches_mm[1] - y];
            if slid != [0.0; 2] {
                prop_assert!((sideways + mu * fz).abs() < 1e-8);
                prop_assert!((slid[0] * fy - slid[1] * fx).abs() < 1e-6);
            }
            let [lx, _, lz] = load.vector_n();
            let [tx, _, tz] = pressed.tip_mm;
            prop_assert!((tx + slid[0] - tz * lx / lz).abs() < 1e-5, "the stage's way");
        }
    }

    /// Of loads of the whole domain that stick, the one whose start slides farthest.
    #[test]
    fn a_tip_that_sticks_has_no_sure_start() {
        let film = Film::default();
        let stuck = film.stick.as_ref().unwrap();
        let mut farthest = (0.0, None);
        for k in 0..100_000 {
            let part = |base: f64| (f64::from(k) * base).fract();
            let [x, y, ox, oy] = [0.414_213_56, 0.732_050_81, 0.236_067_98, 0.645_751_31]
                .map(|base| 2.0 * part(base) - 1.0);
            let mu = 0.05 + 0.95 * part(0.316_624_79);
            // Many slight ones.
            let size_n = 0.3 * libm::pow(2e-4 / 0.3, part(0.605_551_28));
            let load = load(
                size_n,
                12.0 * x,
                11.5 * y,
                [0.25 * ox, 0.25 * oy],
                Contact::Stick,
            );
            let gauge = crate::film::gauge(&load);
            let start = gauge.start(&film.slip, mu);
            if gauge.is_held(&gauge.placed(stuck), mu) {
                let slid = start.slide.slid_mm / start.depth_mm;
                if slid > farthest.0 {
                    farthest = (slid, Some((load, mu)));
                }
            }
        }
        println!("{farthest:?}");
        assert!(farthest.0 < 0.5 * super::SURE, "{farthest:?}");
    }

    #[test]
    fn slipping_begins_where_sticking_ends() {
        let film = Film::default();
        let slip = Contact::Slip { mu: 0.6 };
        let shift = |contact, alpha| {
            let pressed = film.press(&load(0.2, alpha, 0.0, [0.0; 2], contact));
            let discs = pressed.discs.iter();
            discs.map(|disc| disc.moved_mm[0]).sum::<f64>() / 4.0
        };
        assert_eq!(shift(slip, 1.0), shift(Contact::Stick, 1.0));
        let mut last = shift(slip, 0.0);
        for step in 1..=120 {
            let now = shift(slip, 0.1 * f64::from(step));
            // 0.005 mm a step are 0.2 px.
            assert!(
                now > last - 0.002 && now < last + 0.01,
                "{last} {now} at step {step}"
            );
            last = now;
        }
        assert!(shift(slip, 10.0) < 0.6 * shift(Contact::Stick, 10.0));
    }

    #[test]
    fn a_slight_slide_is_in_proportion() {
        let film = Film::default();
        let press = |size_n| {
            let slip = Contact::Slip { mu: 0.3 };
            film.press(&load(size_n, 9.0, -4.0, [0.1, 0.0], slip))
        };
        let (whole, half) = (press(1.9999e-4), press(1e-4));
        let next = press(2.0001e-4);
        for c in 0..3 {
            assert!((half.tip_mm[c] * 2.0 - whole.tip_mm[c]).abs() < 1e-4);
            assert!((next.tip_mm[c] - whole.tip_mm[c]).abs() < 1e-4);
        }
    }

    #[test]
    fn too_hard_is_refused_and_drawn_at_the_limit() {
        let film = Film::default();
        for contact in [Contact::Stick, Contact::Slip { mu: 0.6 }] {
            let [most, hard] = [0.3, 0.6].map(|size_n| load(size_n, 5.0, 0.0, [0.0; 2], contact));
            let error = film.check(&hard).unwrap_err().to_string();
            assert!(error.contains("|F| is 0.6 N"), "{error}");
            assert_eq!(film.press(&hard).discs, film.press(&most).discs);
        }
    }
}
