//! Sums up the answers to the frames of a kind of press.

use hivtac_calibration::evaluation::errors::angle_deg;
use hivtac_sensor::force::forward::Strength;
use hivtac_sensor::force::forward::pair::{PairEstimate, Part};
use serde::Serialize;

use super::presses::{Kind, Press};

/// 95 of 100 normal errors are within this many standard uncertainties; of two axes, of the
/// uncertainty stated for both.
const WITHIN_95: [f64; 3] = [1.960, 1.731, 2.448];

/// The sensor's answer to a frame.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Whether one contact explains it, and whether one explains all dots but one only.
    is_one: [bool; 2],
    /// Whether two do.
    is_two: bool,
    /// Whether these are resolved.
    are_apart: bool,
    /// Errors of both and of their sum, if two needles press and two are found.
    errors: Option<[Error; 3]>,
    /// The standard uncertainties that noise alone leaves of both.
    bound: Option<[[f64; 3]; 2]>,
}

/// Errors of a force and its stated standard uncertainties: direction, degrees; |F|, mN; place, mm.
#[derive(Clone, Copy, Debug)]
struct Error {
    error: [f64; 3],
    sigma: [f64; 3],
}

/// The results for two needles.
#[derive(Serialize)]
pub struct PairRow {
    name: String,
    /// Percentages: taken for one contact; for one if a dot is left out; refused; resolved.
    missed: f64,
    without_a_dot: f64,
    refused: f64,
    apart: f64,
    /// Of each contact: root mean square and 90th percentile of direction, degrees, |F|, mN, and
    /// place, mm, of those that are resolved.
    each: Option<[[f64; 2]; 3]>,
    /// Of their sum: root mean squares, of all pairs that are found.
    sum: Option<[f64; 3]>,
    /// Percentages within the stated 95 %: direction, |F| and place of each, direction and |F| of
    /// the sum.
    within: Option<[f64; 5]>,
    /// Of each resolved contact, root mean squares of the stated uncertainty, and of that by noise
    /// alone, as in `each`.
    stated: Option<[f64; 3]>,
    by_noise: Option<[f64; 3]>,
}

/// The results for other presses than pairs.
#[derive(Serialize)]
pub struct OtherRow {
    name: String,
    frames: usize,
    /// Percentages: taken for one contact; for one if a dot is left out; for two; reported as two,
    /// as no dot need be left out; refused.
    one: f64,
    without_a_dot: f64,
    two: f64,
    found_two: f64,
    refused: f64,
}

impl Outcome {
    /// The outcome of a frame.
    pub fn new(
        press: &Press,
        strength: &Strength,
        is_one: [bool; 2],
        (both, bound): (Option<PairEstimate>, Option<PairEstimate>),
    ) -> Outcome {
        let found = both.filter(PairEstimate::is_explained);
        Outcome {
            is_one,
            is_two: found.is_some(),
            are_apart: found.is_some_and(|found| found.are_apart(strength)),
            errors: found.and_then(|found| errors(press, strength, &found)),
            bound: bound.and_then(|bound| {
                let [first, second] = bound.contacts(strength);
                Some([sigma(&first)?, sigma(&second)?])
            }),
        }
    }
}

impl Outcome {
    fn is_refused(&self) -> bool {
        !self.is_one[0] && !self.is_two
    }
}

/// The errors of two contacts, in the order that fits better, and of their sum.
fn errors(press: &Press, strength: &Strength, found: &PairEstimate) -> Option<[Error; 3]> {
    let [first, second] = press.needles[..] else {
        return None;
    };
    let [one, other] = found.contacts(strength);
    let far = |part: &Part, place_mm: [f64; 2]| {
        let [x, y] = [0, 1].map(|i| f64::from(part.place_mm[i]) - place_mm[i]);
        x.hypot(y)
    };
    let is_exchanged =
        far(&one, first.0) + far(&other, second.0) > far(&one, second.0) + far(&other, first.0);
    let [one, other] = if is_exchanged {
        [other, one]
    } else {
        [one, other]
    };
    let [first_n, second_n] = [first, second].map(|(_, force_n)| length(force_n));
    let sum_n = [0, 1, 2].map(|i| first.1[i] + second.1[i]);
    let middle = |i: usize| (first_n * first.0[i] + second_n * second.0[i]) / (first_n + second_n);
    let middle_mm = [0, 1].map(middle);
    let error = |part: &Part, (place_mm, force_n): ([f64; 2], [f64; 3])| {
        let sigma = sigma(part)?;
        let vector = part.force_n.map(f64::from);
        Some(Error {
            error: [
                angle_deg(vector, force_n).unwrap_or(180.0),
                1e3 * (length(vector) - length(force_n)).abs(),
                far(part, place_mm),
            ],
            sigma,
        })
    };
    Some([
        error(&one, first)?,
        error(&other, second)?,
        error(&found.sum(strength), (middle_mm, sum_n))?,
    ])
}

/// Standard uncertainties: direction, degrees; |F|, mN; place along an axis, mm.
fn sigma(part: &Part) -> Option<[f64; 3]> {
    let sigma = part.sigma?;
    Some([
        f64::from(sigma.direction).to_degrees(),
        1e3 * f64::from(sigma.magnitude_n),
        f64::from(sigma.place_mm),
    ])
}

fn length(vector: [f64; 3]) -> f64 {
    vector.iter().map(|part| part * part).sum::<f64>().sqrt()
}

fn percent<T>(all: &[T], is: impl Fn(&T) -> bool) -> f64 {
    100.0 * all.iter().filter(|one| is(one)).count() as f64 / all.len().max(1) as f64
}

fn rms(of: &[f64]) -> f64 {
    (of.iter().map(|own| own * own).sum::<f64>() / of.len().max(1) as f64).sqrt()
}

fn ninetieth(of: &[f64]) -> f64 {
    let mut sorted = of.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted
        .get(sorted.len() * 9 / 10)
        .copied()
        .unwrap_or(f64::NAN)
}

impl Error {
    fn is_within(&self, k: usize) -> bool {
        let most = [WITHIN_95[1], WITHIN_95[0], WITHIN_95[2]];
        self.error[k] <= most[k] * self.sigma[k]
    }
}

impl PairRow {
    /// The head of the table.
    pub const HEAD: &str = "| forces | apart | missed | a dot left out | refused | resolved | \
                            direction of each (90 %) | \\|F\\| of each | place of each | \
                            sum: direction, \\|F\\| | within the stated 95 %: each; sum |\n\
                            |--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n";

    /// The results of a kind.
    pub fn of(kind: Kind, outcomes: &[Outcome]) -> PairRow {
        let of_pairs: Vec<&[Error; 3]> = outcomes
            .iter()
            .filter_map(|own| own.errors.as_ref())
            .collect();
        let apart = outcomes.iter().filter(|own| own.are_apart);
        let of_apart: Vec<&Error> = apart
            .filter_map(|own| own.errors.as_ref())
            .flat_map(|all| &all[..2])
            .collect();
        let sums: Vec<&Error> = of_pairs.iter().map(|all| &all[2]).collect();
        let parts = |of: &[&Error], k: usize| of.iter().map(|own| own.error[k]).collect::<Vec<_>>();
        let each = |k: usize| {
            let parts = parts(&of_apart, k);
            [rms(&parts), ninetieth(&parts)]
        };
        // Of the place an uncertainty is along one axis, an error along both.
        let whole = [1.0, 1.0, std::f64::consts::SQRT_2];
        let spread = |of: &[[f64; 3]]| {
            let of = |k: usize| rms(&of.iter().map(|own| whole[k] * own[k]).collect::<Vec<_>>());
            (!of_apart.is_empty()).then(|| [0, 1, 2].map(of))
        };
        let stated: Vec<[f64; 3]> = of_apart.iter().map(|own| own.sigma).collect();
        let apart = outcomes.iter().filter(|own| own.are_apart);
        let bounds: Vec<[f64; 3]> = apart.filter_map(|own| own.bound).flatten().collect();
        let within = |of: &[&Error], k: usize| percent(of, |own| own.is_within(k));
        PairRow {
            name: kind.to_string(),
            missed: percent(outcomes, |own| own.is_one[0]),
            without_a_dot: percent(outcomes, |own| own.is_one[1]),
            refused: percent(outcomes, Outcome::is_refused),
            apart: percent(outcomes, |own| own.are_apart),
            each: (!of_apart.is_empty()).then(|| [0, 1, 2].map(each)),
            sum: (!sums.is_empty()).then(|| [0, 1, 2].map(|k| rms(&parts(&sums, k)))),
            stated: spread(&stated),
            by_noise: spread(&bounds),
            within: (!of_apart.is_empty()).then(|| {
                let each = [0, 1, 2].map(|k| within(&of_apart, k));
                let sum = [0, 1].map(|k| within(&sums, k));
                [each[0], each[1], each[2], sum[0], sum[1]]
            }),
        }
    }

    /// The head of the table of uncertainties.
    pub const BOUNDS: &str = "| forces | apart | error of each | stated σ | σ by noise alone |\n\
                              |--:|--:|--:|--:|--:|\n";

    /// A line of that table; empty if none are resolved.
    pub fn bounds(&self) -> String {
        let parts = self.each.zip(self.stated).zip(self.by_noise);
        parts.map_or(String::new(), |((each, stated), by_noise)| {
            let [error, stated, by_noise] = [each.map(|[rms, _]| rms), stated, by_noise].map(
                |[direction, magnitude, place]| {
                    format!("{direction:.2}°, {magnitude:.2} mN, {place:.3} mm")
                },
            );
            format!("| {} | {error} | {stated} | {by_noise} |\n", self.name)
        })
    }

    /// A line of the table.
    pub fn line(&self) -> String {
        let PairRow {
            name,
            missed,
            without_a_dot,
            refused,
            apart,
            ..
        } = self;
        let [direction, magnitude, place] = match self.each {
            None => ["–", "–", "–"].map(String::from),
            Some([direction, magnitude, place]) => [
                format!("{:.2}° ({:.1}°)", direction[0], direction[1]),
                format!("{:.2} mN", magnitude[0]),
                format!("{:.3} mm", place[0]),
            ],
        };
        let sum = match self.sum {
            None => "–".into(),
            Some([direction, magnitude, _]) => format!("{direction:.2}°, {magnitude:.2} mN"),
        };
        let within = match self.within {
            None => "–".into(),
            Some([a, b, c, d, e]) => format!("{a:.0}, {b:.0}, {c:.0}; {d:.0}, {e:.0} %"),
        };
        format!(
            "| {name} | {missed:.0} % | {without_a_dot:.0} % | {refused:.0} % | {apart:.0} % | {direction} | {magnitude} \
             | {place} | {sum} | {within} |\n"
        )
    }
}

impl OtherRow {
    /// The head of the table.
    pub const HEAD: &str = "| press | frames | one contact | a dot left out | two contacts | \
                            reported as two | refused |\n|---|--:|--:|--:|--:|--:|--:|\n";

    /// The results of a kind.
    pub fn of(kind: Kind, outcomes: &[Outcome]) -> OtherRow {
        OtherRow {
            name: kind.to_string(),
            frames: outcomes.len(),
            one: percent(outcomes, |own| own.is_one[0]),
            without_a_dot: percent(outcomes, |own| own.is_one[1]),
            two: percent(outcomes, |own| own.is_two),
            found_two: percent(outcomes, |own| own.is_two && !own.is_one[1]),
            refused: percent(outcomes, Outcome::is_refused),
        }
    }

    /// A line of the table.
    pub fn line(&self) -> String {
        let OtherRow {
            name,
            one,
            without_a_dot,
            two,
            found_two,
            refused,
            frames,
        } = self;
        format!(
            "| {name} | {frames} | {one:.1} % | {without_a_dot:.1} % | {two:.1} % | \
             {found_two:.1} % | {refused:.1} % |\n"
        )
    }
}
