//! A tip that slides over the film.
//!
//! The sideways force is then μ times the normal one: what is looked for is its direction, and how far the tip has slid
//! along it over the film. The film's curves tell where the tip is pushed by such a force at such a place; the way of
//! the stage that carries it is that way and the slide.

use super::curves::{Curves, Pose};
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

/// Rounds after which the search has failed; it takes 3 to 5.
const ROUNDS: u32 = 40;
/// A slide is found when the stage's way is met to this part of its depth.
const CLOSE: f64 = 1e-6;

impl Gauge {
    /// The stage's way for a depth of 1.
    pub fn way(&self) -> f64 {
        let [x, y] = self.tangents;
        (1.0 + x * x + y * y).sqrt()
    }

    /// The size of the way of a tip that sticks.
    pub fn stuck_size(&self) -> f64 {
        libm::cbrt(self.force_n / MAX_STUCK_N).min(1.0)
    }

    /// The force on the film whose sideways part is this: what is left of the gauge's is normal.
    pub fn force_n(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        let [along_x, along_y] = self.tangents;
        [x, y, along_x * x + along_y * y - self.way() * self.force_n]
    }

    /// The film under a tip that slides, `sideways_n` being the sideways force if it stuck. `None` when the tip would
    /// have to slide backward, which is that it sticks.
    pub fn slide(&self, curves: &Curves, mu: f64, sideways_n: [f64; 2]) -> Option<Pressed> {
        let [x, y] = sideways_n;
        let size = (x * x + y * y).sqrt();
        let mut at = Slide {
            along: [x / size, y / size],
            slid_mm: 0.0,
        };
        for _ in 0..ROUNDS {
            let pose = self.pose(&at, mu);
            let [x, y, z] = curves.tip(&pose);
            let [ax, ay] = at.along;
            let missing = [
                -z * self.tangents[0] - x - at.slid_mm * ax,
                -z * self.tangents[1] - y - at.slid_mm * ay,
            ];
            let ahead = missing[0] * ax + missing[1] * ay;
            let aside = missing[1] * ax - missing[0] * ay;
            if ahead.abs().max(aside.abs()) < -CLOSE * z {
                return (at.slid_mm > 0.0).then(|| self.pressed(curves, &at, mu));
            }
            // The film goes along, by little: what is missing is slid, and turned towards.
            let way = (x * ax + y * ay) + at.slid_mm;
            let turn = (aside / way.max(-1e-3 * z)).clamp(-0.5, 0.5);
            let (sin, cos) = libm::sincos(turn);
            at = Slide {
                along: [cos * ax - sin * ay, sin * ax + cos * ay],
                slid_mm: at.slid_mm + ahead,
            };
        }
        None
    }

    fn normal_n(&self, at: &Slide, mu: f64) -> f64 {
        let [x, y] = self.tangents;
        let pull = x * at.along[0] + y * at.along[1];
        self.way() * self.force_n / (1.0 + mu * pull)
    }

    fn touches_mm(&self, at: &Slide) -> [f64; 2] {
        [0, 1].map(|c| self.offset_mm[c] + at.slid_mm * at.along[c])
    }

    fn pose(&self, at: &Slide, mu: f64) -> Pose {
        let size = libm::cbrt(self.normal_n(at, mu) / SLIP_N).min(1.0);
        let reach = Family::Slip.offset_mm(size);
        Pose {
            size,
            tilt: at.along.map(|part| mu * part),
            offset: self.touches_mm(at).map(|mm| (mm / reach).clamp(-1.0, 1.0)),
        }
    }

    fn pressed(&self, curves: &Curves, at: &Slide, mu: f64) -> Pressed {
        let answer = curves.at(&self.pose(at, mu));
        let normal = self.normal_n(at, mu);
        let [ax, ay] = at.along;
        Pressed {
            tip_mm: answer.tip,
            force_n: [mu * normal * ax, mu * normal * ay, -normal],
            touches_mm: self.touches_mm(at),
            discs: answer.discs,
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
