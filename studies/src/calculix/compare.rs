//! Two films under the same press, and what one makes of the other's markers.

use anyhow::Result;
use hivtac_shell::{Contact, Design, Equilibrium, Film, Marker, markers};
use hivtac_twin::Camera;

/// Gauss–Newton steps at most, and how small they are (N, mm) at the end.
const MAX_STEPS: usize = 20;
const LAST_STEP: [f64; UNKNOWNS] = [1e-7, 1e-7, 1e-7, 1e-5, 1e-5];
/// The same of a factor.
const LAST_FACTOR_STEP: f64 = 1e-5;
/// Force (N) and place (mm) by which pixels are differentiated.
const UNITS: [f64; UNKNOWNS] = [1e-5, 1e-5, 1e-5, 1e-4, 1e-4];
/// Force and place; coordinates of the markers.
const UNKNOWNS: usize = 5;
const COORDINATES: usize = 8;

/// What is compared of a pressed film.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmObservation {
    /// Where the tip's disc went, mm.
    pub tip_mm: [f64; 3],
    /// The markers' motion and images.
    pub markers: [Marker; 4],
}

impl FilmObservation {
    /// The same motion since a film's rest, from the rest of another.
    pub fn rebased(&self, from: &FilmObservation, to: &FilmObservation) -> FilmObservation {
        FilmObservation {
            tip_mm: moved(self.tip_mm, from.tip_mm, to.tip_mm),
            markers: std::array::from_fn(|id| {
                let [own, from, to] = [self, from, to].map(|film| &film.markers[id]);
                Marker {
                    moved_mm: moved(own.moved_mm, from.moved_mm, to.moved_mm),
                    seen_px: moved(own.seen_px, from.seen_px, to.seen_px),
                }
            }),
        }
    }
}

fn moved<const N: usize>(at: [f64; N], from: [f64; N], to: [f64; N]) -> [f64; N] {
    std::array::from_fn(|k| at[k] - from[k] + to[k])
}

/// How far two films are apart.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Difference {
    /// Depth of the tip, the second less the first, µm.
    pub depth_um: f64,
    /// A marker's place in space: the largest and the root mean square, µm.
    pub space_um: [f64; 2],
    /// In the picture, px.
    pub picture_px: [f64; 2],
}

/// The press that the project's film takes for the markers of another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// |F| in parts of the true one.
    pub size: f64,
    /// How far its direction is off, degrees.
    pub direction_deg: f64,
    /// How far the place is off, mm.
    pub place_mm: f64,
    /// What no press explains of the eight coordinates, root mean square, px.
    pub left_px: f64,
}

/// The project's film with every force scaled by one factor.
#[derive(Clone, Debug, PartialEq)]
pub struct Scaled {
    /// What each force is multiplied by.
    pub factor: f64,
    /// The film under each of them.
    pub presses: Vec<FilmObservation>,
}

/// The project's film under a force.
///
/// # Errors
/// When it finds no equilibrium.
pub fn press(film: &mut Film, force_n: [f64; 3], place_mm: [f64; 2]) -> Result<Equilibrium> {
    film.move_tip(place_mm, film.design().tip_radius_mm)?;
    Ok(film.press(Contact::Force(force_n), &film.rest())?)
}

/// What is compared of the project's film.
pub fn seen(film: &Film, state: &Equilibrium, camera: &Camera) -> FilmObservation {
    FilmObservation {
        tip_mm: state.tip_mm,
        markers: markers(film, state, camera),
    }
}

/// How far the second film is from the first.
pub fn difference(first: &FilmObservation, second: &FilmObservation) -> Difference {
    let pairs = || first.markers.iter().zip(&second.markers);
    let space = pairs().map(|(a, b)| {
        let [x, y, z] = [0, 1, 2].map(|axis| b.moved_mm[axis] - a.moved_mm[axis]);
        1e3 * x.hypot(y).hypot(z)
    });
    let picture = pairs().map(|(a, b)| {
        let [x, y] = [0, 1].map(|axis| b.seen_px[axis] - a.seen_px[axis]);
        x.hypot(y)
    });
    Difference {
        depth_um: 1e3 * (first.tip_mm[2] - second.tip_mm[2]),
        space_um: largest_and_rms(space),
        picture_px: largest_and_rms(picture),
    }
}

/// The largest number's size, and the root mean square.
pub fn largest_and_rms(numbers: impl Iterator<Item = f64>) -> [f64; 2] {
    let (mut largest, mut squares, mut count) = (0f64, 0.0, 0.0);
    for number in numbers {
        largest = largest.max(number.abs());
        squares += number * number;
        count += 1.0;
    }
    [largest, (squares / f64::max(count, 1.0)).sqrt()]
}

/// The press (force and place) with which the project's film comes nearest to the markers seen, by
/// Gauss–Newton from the true one.
///
/// # Errors
/// When the film finds no equilibrium on the way, or the steps do not end.
pub fn read(
    design: &Design,
    camera: &Camera,
    seen: &FilmObservation,
    force_n: [f64; 3],
    place_mm: [f64; 2],
) -> Result<Reading> {
    let mut film = Film::new(design)?;
    let mut found = [force_n[0], force_n[1], force_n[2], place_mm[0], place_mm[1]];
    let mut state = film.rest();
    for _ in 0..MAX_STEPS {
        let [fx, fy, fz, x, y] = found;
        film.move_tip([x, y], film.design().tip_radius_mm)?;
        state = film.press(Contact::Force([fx, fy, fz]), &state)?;
        let here = pixels(&markers(&film, &state, camera));
        let target = pixels(&seen.markers);
        let gap: [f64; COORDINATES] = std::array::from_fn(|i| target[i] - here[i]);
        let step = least_squares(&slopes(&film, &state, camera, &here)?, &gap);
        for (sum, part) in found.iter_mut().zip(step) {
            *sum += part;
        }
        if step
            .iter()
            .zip(LAST_STEP)
            .all(|(part, last)| part.abs() < last)
        {
            return Ok(reading(
                &found,
                force_n,
                place_mm,
                largest_and_rms(gap.into_iter())[1],
            ));
        }
    }
    anyhow::bail!("no press of the film comes nearest to the markers")
}

/// The factor by which forces are to be scaled so that the film comes nearest to the markers seen
/// in all presses together, by Gauss–Newton from 1.
///
/// # Errors
/// When the film finds no equilibrium on the way, or the steps do not end.
pub fn scale(
    film: &Film,
    camera: &Camera,
    forces_n: &[[f64; 3]],
    targets: &[FilmObservation],
) -> Result<Scaled> {
    let mut factor = 1.0;
    for _ in 0..MAX_STEPS {
        let (mut state, mut presses) = (film.rest(), Vec::new());
        let (mut along, mut squares) = (0.0, 0.0);
        for (force_n, target) in forces_n.iter().zip(targets) {
            let force = force_n.map(|part| factor * part);
            state = film.press(Contact::Force(force), &state)?;
            let found = seen(film, &state, camera);
            let here = pixels(&found.markers);
            let slopes = slopes(film, &state, camera, &here)?;
            let target = pixels(&target.markers);
            for i in 0..COORDINATES {
                let slope: f64 = (0..3).map(|axis| force_n[axis] * slopes[axis][i]).sum();
                along += slope * (target[i] - here[i]);
                squares += slope * slope;
            }
            presses.push(found);
        }
        let step = along / squares;
        if step.abs() < LAST_FACTOR_STEP {
            return Ok(Scaled { factor, presses });
        }
        factor += step;
    }
    anyhow::bail!("no factor brings the film nearest to the markers")
}

fn reading(
    [fx, fy, fz, x, y]: &[f64; UNKNOWNS],
    [tx, ty, tz]: [f64; 3],
    [px, py]: [f64; 2],
    left_px: f64,
) -> Reading {
    let [found, given] = [[*fx, *fy, *fz], [tx, ty, tz]].map(|[x, y, z]| x.hypot(y).hypot(z));
    let along = (fx * tx + fy * ty + fz * tz) / (found * given);
    Reading {
        size: found / given,
        direction_deg: along.min(1.0).acos().to_degrees(),
        place_mm: (x - px).hypot(y - py),
        left_px,
    }
}

fn pixels(markers: &[Marker; 4]) -> [f64; COORDINATES] {
    std::array::from_fn(|i| markers[i / 2].seen_px[i % 2])
}

/// How each coordinate follows force and place: px per N, px per mm.
fn slopes(
    film: &Film,
    state: &Equilibrium,
    camera: &Camera,
    here: &[f64; COORDINATES],
) -> Result<[[f64; COORDINATES]; UNKNOWNS]> {
    let responses = film.responses(state)?;
    Ok(std::array::from_fn(|k| {
        let beside = film.beside(state, &responses[k], UNITS[k]);
        let there = pixels(&markers(film, &beside, camera));
        std::array::from_fn(|i| (there[i] - here[i]) / UNITS[k])
    }))
}

/// The step that closes the gap best: normal equations, solved by elimination.
fn least_squares(
    slopes: &[[f64; COORDINATES]; UNKNOWNS],
    gap: &[f64; COORDINATES],
) -> [f64; UNKNOWNS] {
    let dot = |a: &[f64; COORDINATES], b: &[f64; COORDINATES]| -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    };
    let mut rows: [[f64; UNKNOWNS + 1]; UNKNOWNS] = std::array::from_fn(|r| {
        std::array::from_fn(|c| dot(&slopes[r], slopes.get(c).unwrap_or(gap)))
    });
    for pivot in 0..UNKNOWNS {
        let own = rows[pivot];
        for (_, row) in rows.iter_mut().enumerate().filter(|(r, _)| *r != pivot) {
            let times = row[pivot] / own[pivot];
            row.iter_mut()
                .zip(own)
                .for_each(|(sum, part)| *sum -= times * part);
        }
    }
    std::array::from_fn(|k| rows[k][UNKNOWNS] / rows[k][k])
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_shell::paper_camera;

    fn coarse() -> Design {
        Design {
            fineness: 0.5,
            ..Design::default()
        }
    }

    #[test]
    fn a_film_reads_its_own_markers() {
        let (design, camera) = (coarse(), paper_camera().unwrap());
        let (force_n, place_mm) = ([0.01, -0.005, -0.05], [1.0, 2.0]);
        let mut film = Film::new(&design).unwrap();
        let state = press(&mut film, force_n, place_mm).unwrap();
        let seen = seen(&film, &state, &camera);
        let reading = read(&design, &camera, &seen, [0.0, 0.0, -0.06], [0.8, 2.1]).unwrap();
        let size = 0.06 / 0.01f64.hypot(0.005).hypot(0.05);
        assert!((reading.size * size - 1.0).abs() < 1e-5);
        assert!((reading.place_mm - 0.2f64.hypot(0.1)).abs() < 1e-4);
        assert!(reading.left_px < 1e-3);
        let middle = press(&mut film, [0.0, 0.0, -0.05], [0.0; 2]).unwrap();
        let seen = super::seen(&film, &middle, &camera);
        let reading = read(&design, &camera, &seen, [0.0, 0.0, -0.06], [0.0; 2]).unwrap();
        assert!(
            (reading.size - 0.05 / 0.06).abs() < 1e-5,
            "symmetry moves no place"
        );
    }

    #[test]
    fn a_softer_film_is_the_same_under_larger_forces() {
        let camera = paper_camera().unwrap();
        let film = Film::new(&coarse()).unwrap();
        let forces_n = [[0.0, 0.0, -0.01], [0.01, 0.0, -0.05]];
        let softer = forces_n.map(|force_n| {
            let force = Contact::Force(force_n.map(|part| 1.1 * part));
            let state = film.press(force, &film.rest()).unwrap();
            seen(&film, &state, &camera)
        });
        let scaled = scale(&film, &camera, &forces_n, &softer).unwrap();
        assert!((scaled.factor - 1.1).abs() < 1e-4, "{}", scaled.factor);
        for (one, other) in scaled.presses.iter().zip(&softer) {
            assert!(difference(one, other).picture_px[0] < 1e-2);
        }
    }

    #[test]
    fn differences_are_distances() {
        let at = |x: f64, px: f64, depth: f64| FilmObservation {
            tip_mm: [0.0, 0.0, -depth],
            markers: [Marker {
                moved_mm: [x, 0.0, 2.0 * x],
                seen_px: [px, 10.0],
            }; 4],
        };
        let found = difference(&at(1.0, 5.0, 2.0), &at(1.001, 5.5, 2.002));
        assert!((found.depth_um - 2.0).abs() < 1e-9);
        assert!((found.space_um[0] - 5f64.sqrt()).abs() < 1e-9);
        assert_eq!(found.picture_px, [0.5, 0.5]);
        let rebased = at(3.0, 8.0, 2.0).rebased(&at(1.0, 5.0, 1.0), &at(0.5, 4.0, 0.5));
        assert_eq!(rebased.markers[0].moved_mm, [2.5, 0.0, 5.0]);
        assert_eq!(rebased.markers[3].seen_px, [7.0, 10.0]);
        assert_eq!(rebased.tip_mm[2], -1.5);
    }
}
