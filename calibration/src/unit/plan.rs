//! Plans the loads that a person applies, with instructions.

use crate::data::collect::poses::{Pose, Task};

/// More loads hardly improve a unit's fit (`docs/results/units.md`).
pub const MOST_LOADS: usize = 10;

/// The usual loads: α and β in degrees, x and y in mm, and |F| in mN. One weak and one strong in
/// the middle, then tilted to each side, then off the middle to each side.
const USUAL: [([f64; 2], [f64; 2], u32); MOST_LOADS] = [
    ([0.0, 0.0], [0.0, 0.0], 100),
    ([0.0, 0.0], [0.0, 0.0], 200),
    ([8.0, 0.0], [0.0, 0.0], 100),
    ([-8.0, 0.0], [0.0, 0.0], 100),
    ([0.0, 8.0], [0.0, 0.0], 100),
    ([0.0, -8.0], [0.0, 0.0], 100),
    ([0.0, 0.0], [3.0, 0.0], 100),
    ([0.0, 0.0], [-3.0, 0.0], 100),
    ([0.0, 0.0], [0.0, 3.0], 100),
    ([0.0, 0.0], [0.0, -3.0], 100),
];
/// Loads for a new film in a unit with known camera and dots. They determine its stiffness, its
/// thickness and where its middle is.
const SWAPPED: [([f64; 2], [f64; 2], u32); 3] = [
    ([0.0, 0.0], [0.0, 0.0], 200),
    ([0.0, 0.0], [3.0, 0.0], 100),
    ([0.0, 0.0], [0.0, 3.0], 100),
];
/// The requested |F| where a list gives none, mN: of all loads, but of one that is strong. Loads of
/// one size say little about other sizes.
const USUAL_MN: u32 = 100;
const STRONG_MN: u32 = 200;

/// A planned load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Planned {
    pub pose: Pose,
    /// Approximate force, mN; the gauge measures the actual one.
    pub force_mn: u32,
}

/// The usual ten loads.
pub fn usual() -> Vec<Planned> {
    of_list(&USUAL)
}

/// The three loads for a swapped film.
pub fn swapped() -> Vec<Planned> {
    of_list(&SWAPPED)
}

fn of_list(list: &[([f64; 2], [f64; 2], u32)]) -> Vec<Planned> {
    let planned = list
        .iter()
        .map(|&(angles_deg, place_mm, force_mn)| Planned {
            pose: Pose {
                angles_deg,
                place_mm: Some(place_mm),
            },
            force_mn,
        });
    planned.collect()
}

/// Loads at the poses of a list. The strong one is at the pose nearest to straight down on the
/// middle, the last of equal ones.
pub fn of_poses(list: &[Pose]) -> Vec<Planned> {
    let mut planned: Vec<Planned> = (list.iter())
        .map(|&pose| Planned {
            pose,
            force_mn: USUAL_MN,
        })
        .collect();
    let off = |it: &Planned| {
        let place_mm = it.pose.place_mm.unwrap_or_default();
        let parts = it.pose.angles_deg.iter().chain(&place_mm);
        parts.map(|part| part * part).sum::<f64>()
    };
    let strong = planned
        .iter_mut()
        .rev()
        .min_by(|a, b| off(a).total_cmp(&off(b)));
    if let Some(strong) = strong {
        strong.force_mn = STRONG_MN;
    }
    planned
}

/// The instructions for each load, in takes of this many seconds.
pub fn tasks(planned: &[Planned], seconds: f64) -> Vec<Task> {
    let all = planned.len();
    let task = |(number, it): (usize, &Planned)| Task {
        pose: it.pose,
        set: format!(
            "\nLoad {number} of {all}: {}.\nSet that, the tip just off the film, and press Enter \
             (`done` to end for now).",
            words(&it.pose)
        ),
        press: format!(
            "press down to about {} mN, hold it still for a good second, and let go",
            it.force_mn
        ),
        seconds,
        must_be_felt: true,
    };
    (1..).zip(planned).map(task).collect()
}

/// A pose in words, for a person with a stage.
fn words(pose: &Pose) -> String {
    let [alpha, beta] = pose.angles_deg;
    let tilt = match pose.angles_deg {
        [0.0, 0.0] => "the film level".to_owned(),
        _ => format!("the film tilted by α = {alpha}°, β = {beta}°"),
    };
    let place = match pose.place_mm {
        None => "the tip anywhere".to_owned(),
        Some([0.0, 0.0]) => "the tip over its middle".to_owned(),
        Some([x, y]) => format!("the tip {x} mm along x and {y} mm along y off its middle"),
    };
    format!("{tilt}, {place}")
}

#[cfg(test)]
mod tests {
    use crate::data::collect::poses;

    use super::*;

    #[test]
    fn one_load_of_a_list_is_strong() {
        let poses = |list: &[Planned]| list.iter().map(|it| it.pose).collect::<Vec<_>>();
        assert_eq!(of_poses(&poses(&usual())), usual());
        let tilted = of_poses(&poses(&usual()[2..]));
        let strong: Vec<bool> = tilted.iter().map(|it| it.force_mn == STRONG_MN).collect();
        // A place is 3 mm off, a tilt is 8°.
        assert_eq!(
            strong,
            [false, false, false, false, false, false, false, true]
        );
        assert!(of_poses(&[]).is_empty());
    }

    #[test]
    fn loads_are_reported_in_words_and_those_done_are_left_out() {
        let planned = usual();
        let done = [planned[0].pose, planned[2].pose];
        let left = poses::left(&planned, &done, |it| it.pose);
        assert_eq!(left.len(), 8);
        assert_eq!(
            left[0].force_mn, 200,
            "the first of the two in the middle is done"
        );
        assert_eq!(swapped().len(), 3);
        let tasks = tasks(&planned, 8.0);
        assert!(
            tasks[0]
                .set
                .contains("Load 1 of 10: the film level, the tip over its middle")
        );
        assert!(tasks[1].press.contains("200 mN"));
        assert!(tasks[3].set.contains("α = -8°, β = 0°"), "{}", tasks[3].set);
        assert!(tasks[9].set.contains("Load 10 of 10"), "{}", tasks[9].set);
        assert!(tasks[9].set.contains("0 mm along x and -3 mm along y"));
    }
}
