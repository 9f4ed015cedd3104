//! Full solutions as text: one line each, whole numbers in the units of `STATE` and
//! `FIRST`; lines with # are notes.
//!
//! `state,size,steepness,turn` and 69 numbers: the tip's vector and its changes by offset along x and y; then for each marker
//! its mean, its changes by offset along x and y, its slopes along x and y. `bend,size,steepness,turn` and 105: the tip's
//! coefficients ([`Bend`]), then each marker's. A vector is its x, y and z.

use std::fmt::{self, Display, Write as _};
use std::str::FromStr;

use super::{Bend, Shift, Solved, State, Way};
use crate::SceneError;
use crate::film::curves::{Answer, DiscMotion};

type V3 = [f64; 3];

/// What 1 is of a tip's vector (N, N, mm), of a marker's mean (mm) and of a slope; and of their changes per mm.
struct Units {
    tip: V3,
    moved: V3,
    slope: V3,
}

const STATE: Units = Units {
    tip: [1e-6, 1e-6, 1e-4],
    moved: [1e-4; 3],
    slope: [1e-3; 3],
};
const FIRST: Units = Units {
    tip: [1e-5, 1e-5, 1e-4],
    moved: [1e-4; 3],
    ..STATE
};

impl Display for Solved {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (way, state) in &self.states {
            let mut line = begin("state", way);
            write_vectors(&mut line, &vectors_of_state(state))?;
            writeln!(f, "{line}")?;
        }
        for (way, bend) in &self.bends {
            let mut line = begin("bend", way);
            write_vectors(&mut line, &vectors_of_bend(bend))?;
            writeln!(f, "{line}")?;
        }
        Ok(())
    }
}

fn begin(name: &str, way: &Way) -> String {
    format!("{name},{},{},{}", way.size, way.steepness, way.turn_deg)
}

fn write_vectors(line: &mut String, vectors: &[(V3, V3)]) -> fmt::Result {
    for (vector, units) in vectors {
        for (value, unit) in vector.iter().zip(units) {
            write!(line, ",{}", (value / unit).round() as i64)?;
        }
    }
    Ok(())
}

fn vectors_of_state(state: &State) -> Vec<(V3, V3)> {
    let State { answer, by_offset } = state;
    let mut vectors = vec![(answer.tip, STATE.tip)];
    vectors.extend(by_offset.iter().map(|shift| (shift.tip, FIRST.tip)));
    for (k, disc) in answer.discs.iter().enumerate() {
        vectors.push((disc.moved_mm, STATE.moved));
        vectors.extend(
            by_offset
                .iter()
                .map(|shift| (shift.moved_mm[k], FIRST.moved)),
        );
        vectors.extend([disc.along_x, disc.along_y].map(|slope| (slope, STATE.slope)));
    }
    vectors
}

fn vectors_of_bend(bend: &Bend) -> Vec<(V3, V3)> {
    let tips = bend.iter().map(|shift| (shift.tip, STATE.tip));
    let of_marker = |k: usize| {
        bend.iter()
            .map(move |shift| (shift.moved_mm[k], STATE.moved))
    };
    tips.chain((0..4).flat_map(of_marker)).collect()
}

impl FromStr for Solved {
    type Err = SceneError;

    fn from_str(text: &str) -> Result<Solved, SceneError> {
        let mut solved = Solved::default();
        for (number, line) in text.lines().enumerate() {
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let read = line.split_once(',').and_then(|(name, rest)| {
                match name {
                    "state" => solved.states.push(read(rest, state)?),
                    "bend" => solved.bends.push(read(rest, bend)?),
                    _ => return None,
                }
                Some(())
            });
            read.ok_or_else(|| {
                SceneError::Curves(format!(
                    "line {} is no full solution: expected `state` or `bend`, size, steepness, turn and 69 or 105 whole \
                     numbers",
                    number + 1
                ))
            })?;
        }
        Ok(solved)
    }
}

/// A way, then what `of` makes of vectors; nothing may follow.
fn read<T>(
    rest: &str,
    of: impl Fn(&mut dyn FnMut(V3) -> Option<V3>) -> Option<T>,
) -> Option<(Way, T)> {
    let mut words = rest.split(',');
    let mut place = || {
        words
            .next()?
            .parse()
            .ok()
            .filter(|part: &f64| part.is_finite())
    };
    let way = Way {
        size: place()?,
        steepness: place()?,
        turn_deg: place()?,
    };
    let mut vector = |units: V3| {
        let mut vector = [0.0; 3];
        for (value, unit) in vector.iter_mut().zip(units) {
            *value = f64::from(words.next()?.parse::<i32>().ok()?) * unit;
        }
        Some(vector)
    };
    let value = of(&mut vector)?;
    words.next().is_none().then_some((way, value))
}

fn state(vector: &mut dyn FnMut(V3) -> Option<V3>) -> Option<State> {
    let mut answer = Answer {
        tip: vector(STATE.tip)?,
        ..Answer::default()
    };
    let mut by_offset = [Shift::default(); 2];
    for shift in &mut by_offset {
        shift.tip = vector(FIRST.tip)?;
    }
    for k in 0..4 {
        let moved_mm = vector(STATE.moved)?;
        for shift in &mut by_offset {
            shift.moved_mm[k] = vector(FIRST.moved)?;
        }
        answer.discs[k] = DiscMotion {
            moved_mm,
            along_x: vector(STATE.slope)?,
            along_y: vector(STATE.slope)?,
        };
    }
    Some(State { answer, by_offset })
}

fn bend(vector: &mut dyn FnMut(V3) -> Option<V3>) -> Option<Bend> {
    let mut bend = Bend::default();
    for shift in &mut bend {
        shift.tip = vector(STATE.tip)?;
    }
    for k in 0..4 {
        for shift in &mut bend {
            shift.moved_mm[k] = vector(STATE.moved)?;
        }
    }
    Some(bend)
}
