//! The approximate motion of the film between tip, markers and posts.
//!
//! The film follows the tip by a share that depends only on the place relative to the tip. The
//! difference that remains at the markers is spread around them. Close to a marker the film moves
//! as the marker does. A film by the tables of the whole film moves as they say.

use crate::film::whole::WholeFilm;
use crate::film::{Dots, HALF_SIDE_MM, MARKER_REST_MM, Pressed};

/// Within this distance of a marker's centre, in parts of its radius, the film moves as the marker
/// does. The marker's rim, drawn as a polygon, is inside.
const OWN: f64 = 1.05;
/// Beyond this distance, in parts of the radius, the motion is the one of tip and markers together.
const OTHERS: f64 = 4.0;

/// Returns the distance from a marker's centre, mm, up to which the film's motion depends on that
/// of the marker with this radius, on a film by the tables of the whole film.
pub fn reach_mm(radius_mm: f64) -> f64 {
    OTHERS * radius_mm
}

pub fn displacement(pressed: &Pressed, rest_mm: [f64; 2]) -> [f64; 3] {
    let k = nearest(pressed, rest_mm);
    let centre = pressed.centres_mm[k];
    let from = [rest_mm[0] - centre[0], rest_mm[1] - centre[1]];
    let away = length(from);
    let own = pressed.discs[k].at(from);
    let [own_mm, others_mm] = [OWN, OTHERS].map(|part| part * pressed.radius_mm);
    if away <= own_mm {
        return own;
    }
    if away >= others_mm {
        return rough(pressed, rest_mm);
    }
    let rough = rough(pressed, rest_mm);
    let part = smooth((away - own_mm) / (others_mm - own_mm));
    std::array::from_fn(|c| own[c] + part * (rough[c] - own[c]))
}

fn nearest(pressed: &Pressed, [x, y]: [f64; 2]) -> usize {
    let away = |k: &usize| {
        let [a, b] = pressed.centres_mm[*k];
        length([x - a, y - b])
    };
    let dots = 0..pressed.centres_mm.len();
    dots.min_by(|a, b| away(a).total_cmp(&away(b)))
        .unwrap_or_default()
}

fn rough(pressed: &Pressed, rest_mm: [f64; 2]) -> [f64; 3] {
    // The motion beyond the posts is unknown.
    let place = rest_mm.map(|part| part.clamp(-HALF_SIDE_MM, HALF_SIDE_MM));
    if let Some(pose) = &pressed.whole {
        return WholeFilm::nominal().displacement(pose, place);
    }
    let (of_tip, of_markers) = (share(from_tip(pressed, place)), spread(pressed, place));
    let at_markers = pressed
        .centres_mm
        .map(|centre| share(from_tip(pressed, centre)));
    let component = |c: usize| {
        let discs = pressed.discs.iter().zip(at_markers).zip(of_markers);
        let left = discs
            .map(|((disc, share), part)| part * (disc.moved_mm[c] - share * pressed.tip_mm[c]));
        of_tip * pressed.tip_mm[c] + left.sum::<f64>()
    };
    std::array::from_fn(component)
}

/// Maps a place to coordinates relative to the tip, in which the film's border is as far away as it
/// is from the middle.
fn from_tip(pressed: &Pressed, place: [f64; 2]) -> [f64; 2] {
    std::array::from_fn(|c| {
        let tip = pressed.touches_mm[c];
        let away = place[c] - tip;
        let free = HALF_SIDE_MM - away.signum() * tip;
        away * HALF_SIDE_MM / free
    })
}

/// Estimates the depth at a place from the depth at the markers.
pub fn from_markers(at_markers: f64, place: [f64; 2]) -> f64 {
    at_markers * share(place) / share([MARKER_REST_MM; 2])
}

/// The part of the tip's depth that a place has under a straight press, from the full solution at
/// 0.02 and 0.25 N (within 0.03). It is 1 at the tip, 0.70 and 0.67 at the markers, 0.36 and 0.39
/// in the middle of an edge, 0 at the posts.
fn share(place: [f64; 2]) -> f64 {
    let [a, b] = place.map(|part| part / HALF_SIDE_MM);
    let (r, corner) = (length([a, b]), a * a * b * b);
    let along = 1.0 - 0.849 * r + 0.1398 * r * r + 0.0677 * r * r * r;
    (along - 0.883 * corner + 0.3006 * corner * r * r).max(0.0)
}

/// The part of each marker at a place: 1 at the marker itself, 0 at the others, at the tip and at
/// the film's border.
fn spread(pressed: &Pressed, place: [f64; 2]) -> Dots<f64> {
    let near = |from: [f64; 2]| length([place[0] - from[0], place[1] - from[1]]);
    // From the markers outwards the part falls to 0 at the border.
    let border = place.map(|part| {
        let [own, marker] =
            [part, MARKER_REST_MM].map(|part| 1.0 - (part / HALF_SIDE_MM) * (part / HALF_SIDE_MM));
        (own / marker).clamp(0.0, 1.0)
    });
    let weigh = |k: usize| {
        let centre = pressed.centres_mm[k];
        // With the tip under a marker, only the marker's own area is left to it.
        let apart = |from: [f64; 2]| length([centre[0] - from[0], centre[1] - from[1]]);
        let clear =
            smooth((near(pressed.touches_mm) / apart(pressed.touches_mm).max(0.1)).min(1.0));
        let others = (0..pressed.centres_mm.len())
            .filter(|other| *other != k)
            .map(|other| {
                let other = pressed.centres_mm[other];
                (near(other) / apart(other)).min(1.0)
            });
        let far = (near(centre) / MARKER_REST_MM).min(2.0);
        clear * others.map(smooth).product::<f64>() * (1.0 - smooth(far / 2.0))
    };
    Dots::from_fn(pressed.centres_mm.len(), |k| {
        weigh(k) * border[0] * border[1]
    })
}

/// A smooth step from 0 to 1 with slope 0 at both ends.
fn smooth(part: f64) -> f64 {
    part * part * (3.0 - 2.0 * part)
}

fn length([x, y]: [f64; 2]) -> f64 {
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Film, Load, MARKER_CENTRES_MM};

    fn pressed() -> Pressed {
        let load = Load::from_angles(0.2, 8.0, -5.0).unwrap();
        Film::default().press(&load)
    }

    fn close(a: [f64; 3], b: [f64; 3], tolerance: f64) {
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() <= tolerance, "{a} {b}");
        }
    }

    #[test]
    fn markers_move_by_their_discs_and_the_tip_by_its_own() {
        let pressed = pressed();
        for (disc, centre) in pressed.discs.iter().zip(MARKER_CENTRES_MM) {
            close(displacement(&pressed, centre), disc.moved_mm, 0.0);
            let [x, y] = centre;
            close(
                displacement(&pressed, [x + 0.3, y - 0.4]),
                disc.at([0.3, -0.4]),
                1e-15,
            );
            close(rough(&pressed, centre), disc.moved_mm, 1e-12);
        }
        close(displacement(&pressed, [0.0; 2]), pressed.tip_mm, 1e-12);
    }

    #[test]
    fn posts_stay_and_nothing_is_torn() {
        let pressed = pressed();
        close(displacement(&pressed, [14.0, -14.0]), [0.0; 3], 0.01);
        for (i, j) in (-300..=300).flat_map(|i| (-300..=300).step_by(7).map(move |j| (i, j))) {
            let at = [f64::from(i) * 0.05, f64::from(j) * 0.05];
            let here = displacement(&pressed, at);
            close(displacement(&pressed, [at[0] + 0.01, at[1]]), here, 0.02);
            close(
                displacement(&pressed, [at[1], at[0] + 0.01]),
                displacement(&pressed, [at[1], at[0]]),
                0.02,
            );
        }
    }
}
