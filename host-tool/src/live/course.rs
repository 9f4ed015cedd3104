//! A recorded course: forces in time from a CSV file, such as `hivtac monitor --csv` writes.

use super::hand::Press;
use hivtac_twin::Load;
use std::fmt;

/// Longest gap between two rows across which the force is interpolated, s.
const LONGEST_GAP_S: f64 = 0.5;

/// Forces at times, repeated for ever.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// Times from the first row on, and forces; at least one.
    rows: Vec<Row>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Row {
    time_s: f64,
    /// `None` where there was no force.
    force: Option<Force>,
    /// Each contact where there were two; `force` is their sum.
    contacts: Option<[Force; 2]>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Force {
    vector_n: [f64; 3],
    place_mm: [f64; 2],
}

impl Force {
    /// The force after a part of the way to another one.
    fn toward(self, after: Force, part: f64) -> Force {
        let between = |a: f64, b: f64| a + (b - a) * part;
        Force {
            vector_n: [0, 1, 2].map(|i| between(self.vector_n[i], after.vector_n[i])),
            place_mm: [0, 1].map(|i| between(self.place_mm[i], after.place_mm[i])),
        }
    }

    fn load(self) -> Option<Load> {
        let load = Load::from_vector(self.vector_n);
        load.and_then(|load| load.with_offset_mm(self.place_mm))
            .ok()
    }

    fn touch(self) -> Option<Press> {
        let load = self.load()?;
        let touch = Press {
            place_mm: load.offset_mm(),
            force_n: load.magnitude_n(),
            angles_deg: [load.alpha_deg(), load.beta_deg()],
        };
        touch.in_range()
    }
}

/// Why a text is no course.
#[derive(Clone, Debug, PartialEq)]
pub struct NoCourse {
    /// The line, counted from 1.
    pub line: usize,
    /// The reason, and possible values.
    pub why: String,
}

impl fmt::Display for NoCourse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.why)
    }
}

impl std::error::Error for NoCourse {}

/// The columns: one of the times, the force, and each of two contacts if there are such columns.
struct Columns {
    time: usize,
    /// Seconds in the unit of the time.
    unit_s: f64,
    force: Place,
    contacts: Option<[Place; 2]>,
}

/// The columns of a force, and of where it presses if there are such columns.
struct Place {
    force: [usize; 3],
    place: Option<[usize; 2]>,
}

impl Columns {
    fn of(header: &str) -> Result<Columns, NoCourse> {
        let names: Vec<&str> = header.trim().split(',').map(str::trim).collect();
        let column = |name: &str| names.iter().position(|it| *it == name);
        let needed = |name: &str| {
            column(name).ok_or_else(|| NoCourse {
                line: 1,
                why: format!(
                    "there is no column {name}: a course has time_us or time_s, x_n, y_n, z_n, \
                     and perhaps place_x_mm, place_y_mm"
                ),
            })
        };
        let (time, unit_s) = match column("time_s") {
            Some(time) => (time, 1.0),
            None => (needed("time_us")?, 1e-6),
        };
        let place = |of: &str| {
            let [x, y] = ["x", "y"].map(|axis| column(&format!("{of}place_{axis}_mm")));
            x.zip(y).map(Into::into)
        };
        let contact = |of: &str| {
            let [x, y, z] = ["x", "y", "z"].map(|axis| column(&format!("{of}{axis}_n")));
            let force = [x?, y?, z?];
            let place = place(of);
            Some(Place { force, place })
        };
        let force = [needed("x_n")?, needed("y_n")?, needed("z_n")?];
        let place = place("");
        Ok(Columns {
            time,
            unit_s,
            force: Place { force, place },
            contacts: contact("contact1_")
                .zip(contact("contact2_"))
                .map(Into::into),
        })
    }

    /// Reads a row; without a force where all of its fields are empty.
    fn row(&self, text: &str) -> Result<Row, String> {
        let fields: Vec<&str> = text.trim().split(',').map(str::trim).collect();
        let contacts = match &self.contacts {
            Some([first, second]) => first.read(&fields)?.zip(second.read(&fields)?),
            None => None,
        };
        Ok(Row {
            time_s: self.unit_s * number(&fields, self.time)?,
            force: self.force.read(&fields)?,
            contacts: contacts.map(Into::into),
        })
    }
}

impl Place {
    /// Reads a force; `None` where all of its fields are empty.
    fn read(&self, fields: &[&str]) -> Result<Option<Force>, String> {
        if self.force.iter().all(|at| field(fields, *at).is_empty()) {
            return Ok(None);
        }
        let [x, y, z] = self.force.map(|at| number(fields, at));
        let place_mm = match self.place {
            Some([x, y]) if !field(fields, x).is_empty() => {
                [number(fields, x)?, number(fields, y)?]
            }
            _ => [0.0; 2],
        };
        Ok(Some(Force {
            vector_n: [x?, y?, z?],
            place_mm,
        }))
    }
}

fn field<'a>(fields: &[&'a str], at: usize) -> &'a str {
    fields.get(at).copied().unwrap_or("")
}

fn number(fields: &[&str], at: usize) -> Result<f64, String> {
    let text = field(fields, at);
    let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
    value.ok_or_else(|| format!("\"{text}\" is not a number"))
}

impl Course {
    /// Reads a course from CSV with a header. Times increase. A row without a force is rest, and so
    /// is a force that does not press.
    ///
    /// # Errors
    /// The first line that cannot be read.
    pub fn parse(text: &str) -> Result<Course, NoCourse> {
        let mut lines = (1..).zip(text.lines());
        let (_, header) = lines.next().unwrap_or((1, ""));
        let columns = Columns::of(header)?;
        let mut rows: Vec<Row> = Vec::new();
        for (line, text) in lines.filter(|(_, text)| !text.trim().is_empty()) {
            let row = columns.row(text).map_err(|why| NoCourse { line, why })?;
            if rows.last().is_some_and(|last| row.time_s <= last.time_s) {
                let why = "its time is not after the line before".to_owned();
                return Err(NoCourse { line, why });
            }
            rows.push(row);
        }
        let Some(first_s) = rows.first().map(|row| row.time_s) else {
            let why = "there is no row after the header".to_owned();
            return Err(NoCourse { line: 1, why });
        };
        rows.iter_mut().for_each(|row| row.time_s -= first_s);
        Ok(Course { rows })
    }

    /// Returns the load at a time, s. After its last row the course begins anew.
    pub fn load(&self, time_s: f64) -> Load {
        let pressed = self.between(time_s, |row| row.force);
        pressed.and_then(Force::load).unwrap_or(Load::REST)
    }

    /// Returns each of two touches at a time, s; `None` unless there are two.
    pub fn touches(&self, time_s: f64) -> Option<[Press; 2]> {
        let contact = |nth: usize| {
            self.between(time_s, |row| Some(row.contacts?[nth]))?
                .touch()
        };
        Some([contact(0)?, contact(1)?])
    }

    /// The value at a time, interpolated between the rows around it.
    fn between(&self, time_s: f64, of: impl Fn(&Row) -> Option<Force>) -> Option<Force> {
        let length_s = self.rows.last().map_or(0.0, |row| row.time_s);
        let at_s = match length_s > 0.0 && time_s > 0.0 {
            true => time_s % length_s,
            false => 0.0,
        };
        let next = self.rows.partition_point(|row| row.time_s <= at_s);
        let from = self.rows.get(next.checked_sub(1)?)?;
        let force = of(from)?;
        let to = self.rows.get(next).unwrap_or(from);
        let step_s = to.time_s - from.time_s;
        let after = of(to).filter(|_| step_s > 0.0 && step_s <= LONGEST_GAP_S);
        Some(match after {
            Some(after) => force.toward(after, (at_s - from.time_s) / step_s),
            None => force,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "frame,time_us,x_n,y_n,z_n,place_x_mm,place_y_mm\n\
                        7,1000000,,,,,\n\
                        8,1100000,0.00,0,-0.1,1,0\n\
                        9,1200000,0.02,0,-0.2,2,0\n\
                        10,3000000,0,0,-0.1,0,0\n";

    #[test]
    fn forces_are_interpolated_and_repeated() {
        let course = Course::parse(TEXT).unwrap();
        assert_eq!(course.load(0.05), Load::REST);
        let half = course.load(0.15);
        assert!((half.vector_n()[2] + 0.15).abs() < 1e-9, "{half:?}");
        assert!((half.offset_mm()[0] - 1.5).abs() < 1e-9, "{half:?}");
        // A long gap is no ramp.
        assert!((course.load(1.0).vector_n()[2] + 0.2).abs() < 1e-9);
        assert!(
            (course.load(2.15).vector_n()[2] + 0.15).abs() < 1e-9,
            "again"
        );
    }

    #[test]
    fn two_contacts_are_two_touches() {
        let course = Course::parse(
            "time_s,x_n,y_n,z_n,contact1_x_n,contact1_y_n,contact1_z_n,contact1_place_x_mm,\
             contact1_place_y_mm,contact2_x_n,contact2_y_n,contact2_z_n,contact2_place_x_mm,\
             contact2_place_y_mm\n\
             0,0,0,-0.1,0,0,-0.1,1,0,,,,,\n\
             1,0,0,-0.2,0,0,-0.08,-2,1,0,0,-0.12,2,0\n\
             1.2,0,0,-0.1,0,0,-0.04,-2,1,0,0,-0.06,2,0\n",
        )
        .unwrap();
        assert_eq!(course.touches(0.5), None);
        let [first, second] = course.touches(1.1).unwrap();
        assert_eq!(first.place_mm, [-2.0, 1.0]);
        assert!((first.force_n - 0.06).abs() < 1e-9, "{first:?}");
        assert!((second.force_n - 0.09).abs() < 1e-9, "{second:?}");
        assert!((course.load(1.1).magnitude_n() - 0.15).abs() < 1e-9);
    }

    #[test]
    fn what_is_no_course_is_named() {
        let said = |text: &str| Course::parse(text).unwrap_err().to_string();
        assert!(said("").contains("line 1: there is no column time_us"));
        assert!(said("time_s,x_n,y_n,z_n\n").contains("no row"));
        assert!(said("time_s,x_n,y_n,z_n\n0,a,0,0\n").contains("line 2: \"a\" is not a number"));
        let back = said("time_s,x_n,y_n,z_n\n1,0,0,0\n1,0,0,0\n");
        assert!(back.contains("line 3: its time"), "{back}");
        assert!(said("time_s,x_n,y_n,z_n\ninf,0,0,0\n").contains("line 2"));
    }
}
