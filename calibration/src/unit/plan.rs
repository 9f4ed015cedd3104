//! The loads that a person puts on, in words.

use crate::data::collect::poses::{Pose, Task};

/// More loads tell hardly more of a unit (`docs/results/units.md`).
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
/// Those for another film in a unit whose camera and dots are known: its stiffness, its thickness
/// and where its middle is are left.
const SWAPPED: [([f64; 2], [f64; 2], u32); 3] = [
    ([0.0, 0.0], [0.0, 0.0], 200),
    ([0.0, 0.0], [3.0, 0.0], 100),
    ([0.0, 0.0], [0.0, 3.0], 100),
];
/// |F| that is asked for where nobody says, mN.
const USUAL_MN: u32 = 100;

/// A load to be put on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Planned {
    pub pose: Pose,
    /// About how much force, mN: the gauge says how much it was.
    pub force_mn: u32,
}

/// The usual ten.
pub fn usual() -> Vec<Planned> {
    of_list(&USUAL)
}

/// The three for a film that was swapped.
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

/// Those of a list.
pub fn of_poses(list: &[Pose]) -> Vec<Planned> {
    let planned = list.iter().map(|&pose| Planned {
        pose,
        force_mn: USUAL_MN,
    });
    planned.collect()
}

/// What a person is asked to do for each, in a take of so many seconds.
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

/// A pose for somebody who has a stage before them.
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
    fn loads_are_told_in_words_and_those_done_are_left_out() {
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
