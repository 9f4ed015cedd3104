//! A tip that the film sticks to, or that slides over it: the film by the tip's travel.

use super::curves::{Curves, Pose};
use super::{Family, MAX_DEPTH_MM, Pressed};

/// Curves by travel, of one of the two families that have such.
#[derive(Clone, Copy, Debug)]
pub struct Travel<'a> {
    pub curves: &'a Curves,
    pub family: Family,
}

/// A tip's travel from where it touches the film, mm.
#[derive(Clone, Copy, Debug)]
struct Way {
    depth_mm: f64,
    sideways_mm: [f64; 2],
    touches_mm: [f64; 2],
}

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

impl Gauge {
    fn along(&self, force_n: [f64; 3]) -> f64 {
        let [x, y] = self.tangents;
        (x * force_n[0] + y * force_n[1] - force_n[2]) / (1.0 + x * x + y * y).sqrt()
    }

    /// The stage at a depth, whose tip has slid over the film.
    fn way(&self, depth_mm: f64, slid_mm: [f64; 2]) -> Way {
        let pair = |f: fn(f64, f64, f64) -> f64, a: [f64; 2]| {
            std::array::from_fn(|c| f(depth_mm, a[c], slid_mm[c]))
        };
        Way {
            depth_mm,
            sideways_mm: pair(|depth, tangent, slid| depth * tangent - slid, self.tangents),
            touches_mm: pair(|_, offset, slid| offset + slid, self.offset_mm),
        }
    }
}

impl Travel<'_> {
    fn pose(&self, way: &Way) -> Pose {
        let depth_mm = way.depth_mm.clamp(1e-9, MAX_DEPTH_MM);
        let size = depth_mm / MAX_DEPTH_MM;
        let tangents = way.sideways_mm.map(|mm| mm / depth_mm);
        let offset = way.touches_mm.map(|mm| mm / self.family.offset_mm());
        Pose {
            size,
            tilt: self.family.tilt(size, tangents).map(part),
            offset: offset.map(part),
        }
    }

    fn force_n(&self, way: &Way) -> [f64; 3] {
        self.curves.tip(&self.pose(way))
    }

    fn pressed(&self, way: &Way) -> Pressed {
        let answer = self.curves.at(&self.pose(way));
        let [x, y] = way.sideways_mm;
        Pressed {
            tip_mm: [x, y, -way.depth_mm],
            force_n: answer.tip,
            touches_mm: way.touches_mm,
            discs: answer.discs,
        }
    }

    /// The film under a tip that it sticks to; `None` when it would go deeper than the curves.
    pub fn stick(&self, gauge: &Gauge) -> Option<Pressed> {
        self.depth_mm(gauge).map(|depth| self.stuck(gauge, depth))
    }

    /// The film stuck to a tip at a depth.
    pub fn stuck(&self, gauge: &Gauge, depth_mm: f64) -> Pressed {
        self.pressed(&gauge.way(depth_mm, [0.0; 2]))
    }

    /// How deep the tip goes: regula falsi (Illinois) on the cube root of the force, which is nearly a line.
    fn depth_mm(&self, gauge: &Gauge) -> Option<f64> {
        let gap = |depth_mm: f64| {
            let force = gauge.along(self.force_n(&gauge.way(depth_mm, [0.0; 2])));
            libm::cbrt(force) - libm::cbrt(gauge.force_n)
        };
        let (mut low, mut high) = (0.0, MAX_DEPTH_MM);
        let (mut at_low, mut at_high) = (-libm::cbrt(gauge.force_n), gap(high));
        if at_high < 0.0 {
            return None;
        }
        let mut last_was_low = None;
        for _ in 0..STEPS {
            let middle = (low * at_high - high * at_low) / (at_high - at_low);
            let at_middle = gap(middle);
            if at_middle.abs() < 1e-12 || high - low < 1e-9 {
                return Some(middle);
            }
            if at_middle < 0.0 {
                (low, at_low) = (middle, at_middle);
                at_high *= if last_was_low == Some(true) { 0.5 } else { 1.0 };
            } else {
                (high, at_high) = (middle, at_middle);
                at_low *= if last_was_low == Some(false) {
                    0.5
                } else {
                    1.0
                };
            }
            last_was_low = Some(at_middle < 0.0);
        }
        Some((low + high) / 2.0)
    }

    /// The film under a tip that slides: from a tip that would stick, `stuck`, to where the sideways force is `mu` times
    /// the normal one, the tip having slid along it. `None` when no such state is found within the curves.
    pub fn slide(&self, gauge: &Gauge, mu: f64, stuck: &Pressed) -> Option<Pressed> {
        let [x, y, z] = stuck.force_n;
        let left = mu * -z / (x * x + y * y).sqrt();
        let depth = -stuck.tip_mm[2];
        let slid = [0, 1].map(|c| (1.0 - left) * stuck.tip_mm[c]);
        let mut at = [depth, slid[0], slid[1]];
        for _ in 0..STEPS {
            let gap = self.sliding_gap(gauge, mu, at);
            if gap.iter().all(|part| part.abs() < 1e-10) {
                let [depth, x, y] = at;
                return (depth <= MAX_DEPTH_MM).then(|| self.pressed(&gauge.way(depth, [x, y])));
            }
            let slopes = [0, 1, 2].map(|k| {
                let mut beside = at;
                beside[k] += SLOPE_STEP_MM;
                let there = self.sliding_gap(gauge, mu, beside);
                [0, 1, 2].map(|row| (there[row] - gap[row]) / SLOPE_STEP_MM)
            });
            let step = solve(slopes, gap)?;
            // At most a part of the way at once: the curves are smooth, but not lines.
            let size = step.iter().fold(0.0_f64, |most, part| most.max(part.abs()));
            let share = (0.1 * depth / size).min(1.0);
            at = [0, 1, 2].map(|k| at[k] - share * step[k]);
        }
        None
    }

    /// What is missing of: the gauge's force, the friction ratio, and a slide along the sideways force; N.
    fn sliding_gap(&self, gauge: &Gauge, mu: f64, [depth, sx, sy]: [f64; 3]) -> [f64; 3] {
        let force = self.force_n(&gauge.way(depth, [sx, sy]));
        let [x, y, z] = force;
        let sideways = (x * x + y * y).sqrt();
        [
            gauge.along(force) - gauge.force_n,
            sideways + mu * z,
            (sx * y - sy * x) / depth,
        ]
    }
}

/// What the curves hold for.
fn part(value: f64) -> f64 {
    value.clamp(-1.0, 1.0)
}

/// Steps after which a search has failed; it takes 5 to 10.
const STEPS: u32 = 60;
const SLOPE_STEP_MM: f64 = 1e-6;

/// x with Σ columns[k] · x_k = side, by Cramer's rule; `None` when there is none.
fn solve([a, b, c]: [[f64; 3]; 3], side: [f64; 3]) -> Option<[f64; 3]> {
    let whole = determinant(a, b, c);
    let parts = [
        determinant(side, b, c),
        determinant(a, side, c),
        determinant(a, b, side),
    ];
    let answer = parts.map(|part| part / whole);
    answer.iter().all(|part| part.is_finite()).then_some(answer)
}

fn determinant(a: [f64; 3], b: [f64; 3], c: [f64; 3]) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
        + a[2] * (b[0] * c[1] - b[1] * c[0])
}

#[cfg(test)]
mod tests {
    use super::*;
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
            mu in 0.1..1.0,
        ) {
            let load = load(size_n, alpha, beta, [x, y], Contact::Slip { mu });
            let film = Film::default();
            prop_assert_eq!(film.check(&load), Ok(()));
            let pressed = film.press(&load);
            let [fx, fy, fz] = pressed.force_n;
            let sideways = libm::hypot(fx, fy);
            prop_assert!(sideways <= -mu * fz + 2e-4, "{} {}", sideways, -mu * fz);
            prop_assert!((along(&load, pressed.force_n) - size_n).abs() < 1e-8);
            let slid = [pressed.touches_mm[0] - x, pressed.touches_mm[1] - y];
            if slid != [0.0; 2] {
                prop_assert!((sideways + mu * fz).abs() < 1e-8);
                prop_assert!((slid[0] * fy - slid[1] * fx).abs() < 1e-6);
            }
            let [lx, _, lz] = load.vector_n();
            let [tx, _, tz] = pressed.tip_mm;
            prop_assert!((tx + slid[0] - tz * lx / lz).abs() < 1e-9, "the stage's way");
        }
    }

    #[test]
    fn slipping_begins_where_sticking_ends() {
        let film = Film::default();
        let slip = Contact::Slip { mu: 0.6 };
        let shift = |contact, alpha| {
            let pressed = film.press(&load(0.2, alpha, 0.0, [0.0; 2], contact));
            pressed
                .discs
                .iter()
                .map(|disc| disc.moved_mm[0])
                .sum::<f64>()
                / 4.0
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
    fn too_hard_is_refused_and_drawn_at_the_limit() {
        let film = Film::default();
        for contact in [Contact::Stick, Contact::Slip { mu: 0.6 }] {
            let hard = load(0.6, 5.0, 0.0, [0.0; 2], contact);
            let error = film.check(&hard).unwrap_err().to_string();
            assert!(error.contains("deeper than 7 mm"), "{error}");
            assert_eq!(film.press(&hard).tip_mm[2], -MAX_DEPTH_MM);
        }
    }
}
