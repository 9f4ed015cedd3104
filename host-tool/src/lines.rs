//! Formats one line for each sample: for people, as JSON, or as CSV.

use hivtac_host::decimal::Decimal;
use hivtac_host::force_fields::{FORCE, Field, ForceJson, PLACE, TORQUE, contact_names};
use hivtac_host::shown::to_json;
use hivtac_host::truth::Truth;
use hivtac_terms::force::{Force, MOST_CONTACTS};
use hivtac_terms::status::Status;
use hivtac_wire::message::Sample;
use serde::Serialize;

/// The format of the printed samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Aligned columns with a header.
    Human,
    /// One JSON object a line.
    Json,
    /// Comma-separated values with a header line.
    Csv,
}

/// A sample and, when it is compared with a simulation, its true force (`Some(None)`: not found).
pub struct Row<'a> {
    /// The sample that the device sent.
    pub sample: &'a Sample,
    /// The true force, from the simulation.
    pub truth: Option<Option<Truth>>,
}

impl Format {
    /// The header above the first row; `None` for JSON. `truth` says whether the rows have a true
    /// force.
    pub fn header(self, truth: bool) -> Option<String> {
        match self {
            Format::Human => Some(human_header(truth)),
            Format::Json => None,
            Format::Csv => Some(csv_header(truth)),
        }
    }

    /// A row without a line end.
    pub fn row(self, row: &Row) -> String {
        match self {
            Format::Human => human_row(row),
            Format::Json => json_row(row),
            Format::Csv => csv_row(row),
        }
    }
}

/// The names of the bits that are set in a status.
fn names(status: Status) -> Vec<&'static str> {
    status.names().collect()
}

/// Whether `bit` (contact or slip) is set; `None` without a force.
fn known_bit(sample: &Sample, bit: Status) -> Option<bool> {
    let is_set = sample.status.contains(bit);
    sample.force.is_some().then_some(is_set)
}

fn human_header(truth: bool) -> String {
    let mut columns: Vec<[&str; 2]> = with_column(&FORCE).map(head).collect();
    columns.extend(with_column(&PLACE).map(head));
    columns.push(["contact", ""]);
    if truth {
        columns.extend([["true α", "°"], ["true β", "°"], ["true |F|", "mN"]]);
        columns.extend([["true x", "mm"], ["true y", "mm"]]);
    }
    let mut name = format!("{:>8}{:>8}{:>13}", "seq", "frame", "time");
    let mut unit = format!("{:>8}{:>8}{:>13}", "", "", "s");
    for [column_name, column_unit] in columns {
        name += &format!("{column_name:>9}");
        unit += &format!("{column_unit:>9}");
    }
    format!("{name}  status\n{}", unit.trim_end())
}

/// The fields that have a column for a person.
fn with_column<T>(fields: &[Field<T>]) -> impl Iterator<Item = &Field<T>> {
    fields.iter().filter(|field| !field.symbol.is_empty())
}

/// A field's symbol and unit, for a person.
fn head<T>(field: &Field<T>) -> [&'static str; 2] {
    [field.symbol, field.quantity.unit()]
}

fn human_row(row: &Row) -> String {
    let Sample {
        sequence,
        frame,
        time_us,
        status,
        force,
        ..
    } = row.sample;
    let time = Decimal::new(*time_us, 6);
    let mut line = format!("{sequence:>8}{frame:>8}{time:>13}");
    line += &human_force(force.as_ref());
    let contact = contact_text(known_bit(row.sample, Status::CONTACT));
    let contact = match status.contains(Status::SLIP) {
        true => "slips",
        false => contact,
    };
    line += &format!("{contact:>9}");
    if let Some(truth) = row.truth {
        line += &human_truth(truth);
    }
    let status = status_text(&names(*status), force.is_some());
    format!("{line}  {status}{}", human_parts(row.sample))
}

/// The sizes and places of two contacts; empty unless they are resolved.
fn human_parts(sample: &Sample) -> String {
    let part = |force: &Force| {
        let size = FORCE[2].shown(force);
        let place = force.place.as_ref().map_or_else(String::new, |place| {
            let [x, y, _] = PLACE.map(|field| field.shown(place));
            format!(" at ({x}, {y}) mm")
        });
        format!("{size} mN{place}")
    };
    let parts: Vec<_> = sample.contacts.iter().map(part).collect();
    match parts.is_empty() {
        true => String::new(),
        false => format!(": {}", parts.join(", ")),
    }
}

/// Names of status bits for a person. Without contact and slip, which have columns of their own.
pub fn status_text(names: &[&str], has_force: bool) -> String {
    let other = |name: &&str| !["contact", "slip"].contains(name);
    let names: Vec<_> = names.iter().copied().filter(other).collect();
    if names.is_empty() {
        return if has_force { "ok" } else { "no force" }.to_owned();
    }
    names.join(" ")
}

/// Whether something touches the film, as text for a person.
pub fn contact_text(contact: Option<bool>) -> &'static str {
    match contact {
        Some(true) => "yes",
        Some(false) => "no",
        None => "–",
    }
}

/// A column for each field of a force and of its place, all exact.
fn human_force(force: Option<&Force>) -> String {
    columns(&FORCE, force) + &columns(&PLACE, force.and_then(|force| force.place.as_ref()))
}

/// A column without a value.
const NOTHING: &str = "        –";

fn columns<T>(fields: &[Field<T>], of: Option<&T>) -> String {
    let columns = with_column(fields).map(|field| match of {
        Some(of) => format!("{:>9}", field.shown(of)),
        None => NOTHING.to_owned(),
    });
    columns.collect()
}

fn human_truth(truth: Option<Truth>) -> String {
    let Some(truth) = truth else {
        return format!("{:>9}", "?").repeat(5);
    };
    let millinewtons = truth.magnitude_n * 1e3;
    let force = [truth.alpha_deg, truth.beta_deg, millinewtons];
    let mut text = force.map(|number| format!("{number:>9.3}")).concat();
    text += &match truth.place_mm() {
        Some(place) => place.map(|number| format!("{number:>9.3}")).concat(),
        None => NOTHING.repeat(2),
    };
    text
}

#[derive(Serialize)]
struct SampleJson {
    seq: u32,
    frame: u32,
    time_us: u64,
    force: Option<ForceJson>,
    contacts: Vec<ForceJson>,
    contact: Option<bool>,
    slip: Option<bool>,
    status: Vec<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    truth: Option<Option<Truth>>,
}

fn json_row(row: &Row) -> String {
    let sample = row.sample;
    let json = SampleJson {
        seq: sample.sequence,
        frame: sample.frame,
        time_us: sample.time_us,
        force: sample.force.map(ForceJson),
        contacts: sample
            .each_contact()
            .iter()
            .copied()
            .map(ForceJson)
            .collect(),
        contact: known_bit(sample, Status::CONTACT),
        slip: known_bit(sample, Status::SLIP),
        status: names(sample.status),
        truth: row.truth,
    };
    to_json(&json)
}

fn csv_header(truth: bool) -> String {
    let (force, place, torque) = (
        FORCE.map(|it| it.name),
        PLACE.map(|it| it.name),
        TORQUE.map(|it| it.name),
    );
    let mut names = vec!["seq", "frame", "time_us"];
    names.extend([&force[..], &place, &torque].concat());
    names.extend(["contact", "slip", "status"]);
    let mut header = names.join(",");
    header.extend(contact_names().iter().map(|name| format!(",{name}")));
    if truth {
        // The true force has no uncertainties.
        let names = force[..6].iter().chain(&place[..2]);
        header.extend(names.map(|name| format!(",true_{name}")));
    }
    header
}

/// A missing field is empty; names of status bits are joined by `|`.
fn csv_row(row: &Row) -> String {
    let sample = row.sample;
    let mut fields = vec![
        sample.sequence.to_string(),
        sample.frame.to_string(),
        sample.time_us.to_string(),
    ];
    fields.extend(csv_force(sample.force.as_ref()));
    for bit in [Status::CONTACT, Status::SLIP] {
        fields.push(field(known_bit(sample, bit)));
    }
    fields.push(names(sample.status).join("|"));
    let contacts = sample.each_contact();
    fields.extend((0..MOST_CONTACTS).flat_map(|number| csv_force(contacts.get(number))));
    if let Some(truth) = row.truth {
        fields.extend(csv_truth(truth));
    }
    fields.join(",")
}

fn csv_force(force: Option<&Force>) -> Vec<String> {
    let place = force.and_then(|force| force.place.as_ref());
    let torque = force.and_then(|force| force.torque.as_ref());
    let force = FORCE.map(|it| field(force.map(|force| it.decimal(force))));
    let place = PLACE.map(|it| field(place.map(|place| it.decimal(place))));
    let torque = TORQUE.map(|it| field(torque.map(|torque| it.decimal(torque))));
    [&force[..], &place, &torque].concat()
}

/// The value as text; empty for `None`.
fn field(value: Option<impl ToString>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}

fn csv_truth(truth: Option<Truth>) -> Vec<String> {
    let Some(t) = truth else {
        return vec![String::new(); 8];
    };
    let force = [t.alpha_deg, t.beta_deg, t.magnitude_n, t.x_n, t.y_n, t.z_n];
    let mut fields = force.map(|number| number.to_string()).to_vec();
    fields.extend([t.place_x_mm, t.place_y_mm].map(field));
    fields
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::force::{ContactList, Place, Torque};
    use hivtac_terms::marker::MarkerList;
    use hivtac_terms::units::{
        MicroNewtons, Micrometres, MilliDegrees, NanoNewtonMetres, SignedMicrometres,
        UnsignedMicroNewtons, UnsignedMilliDegrees, UnsignedNanoNewtonMetres,
    };

    fn sample(force: Option<Force>, status: Status) -> Sample {
        Sample {
            sequence: 41,
            frame: 42,
            time_us: 1_400_000,
            status,
            force,
            contacts: ContactList::default(),
            markers: MarkerList::default(),
        }
    }

    const PLACE: Place = Place {
        x: SignedMicrometres(1250),
        y: SignedMicrometres(-7),
        sigma: Micrometres(85),
    };

    const TORQUE: Torque = Torque {
        z: NanoNewtonMetres(-21_000),
        sigma: UnsignedNanoNewtonMetres(3_100),
    };

    /// Without a place it has no torque.
    fn force(place: Option<Place>) -> Force {
        Force {
            alpha: MilliDegrees(-5000),
            beta: MilliDegrees(2500),
            magnitude: MicroNewtons(100_000),
            cartesian: [-8707, 4362, -99_525].map(MicroNewtons),
            direction_sigma: UnsignedMilliDegrees(480),
            magnitude_sigma: UnsignedMicroNewtons(900),
            place,
            torque: place.map(|_| TORQUE),
        }
    }

    fn with_place() -> Sample {
        sample(
            Some(force(Some(PLACE))),
            Status::NOT_CALIBRATED | Status::CONTACT,
        )
    }

    const TRUTH: &str = r#"{"frame":42,"time_us":1,"alpha_deg":-5.25,"beta_deg":2.5,"magnitude_n":0.1015,"x_n":-0.01,"y_n":0.004,"z_n":-0.1}"#;

    fn truth() -> Truth {
        serde_json::from_str(TRUTH).unwrap()
    }

    fn truth_with_place() -> Truth {
        let place = r#","place_x_mm":1.2504,"place_y_mm":-0.5}"#;
        serde_json::from_str(&TRUTH.replace('}', place)).unwrap()
    }

    fn row(format: Format, sample: &Sample, truth: Option<Option<Truth>>) -> String {
        format.row(&Row { sample, truth })
    }

    fn lines(format: Format, sample: &Sample, truth: Option<Option<Truth>>) -> String {
        let header = format.header(truth.is_some()).unwrap_or_default();
        format!("{header}\n{}", row(format, sample, truth))
    }

    #[test]
    fn a_person_sees_aligned_columns() {
        let expected = r"     seq   frame         time        α        β      |F|       Fx       Fy       Fz  place x  place y  place ±  contact   true α   true β true |F|   true x   true y  status
                            s        °        °       mN       mN       mN       mN       mm       mm       mm                 °        °       mN       mm       mm
      41      42     1.400000   -5.000    2.500  100.000   -8.707    4.362  -99.525    1.250   -0.007    0.085      yes   -5.250    2.500  101.500    1.250   -0.500  not_calibrated";
        let truth = Some(Some(truth_with_place()));
        assert_eq!(lines(Format::Human, &with_place(), truth), expected);
    }

    #[test]
    fn a_person_sees_what_is_missing() {
        let without = sample(None, Status::MARKERS_MISSING | Status::FRAME_DROPPED);
        let dashes = "        –".repeat(10);
        assert_eq!(
            row(Format::Human, &without, Some(None)),
            format!(
                "      41      42     1.400000{dashes}{}  markers_missing frame_dropped",
                "        ?".repeat(5)
            )
        );
        let without_place = sample(Some(force(None)), Status::default());
        let expected = r"      41      42     1.400000   -5.000    2.500  100.000   -8.707    4.362  -99.525        –        –        –       no   -5.250    2.500  101.500        –        –  ok";
        let truth = Some(Some(truth()));
        assert_eq!(row(Format::Human, &without_place, truth), expected);
    }

    #[test]
    fn a_person_is_reported_that_there_is_no_force_though_nothing_says_why() {
        let line = row(Format::Human, &sample(None, Status::default()), None);
        assert!(line.ends_with("        –  no force"), "{line}");
    }

    #[test]
    fn a_person_is_reported_of_a_contact_once() {
        let pressed = sample(Some(force(None)), Status::CONTACT);
        let line = row(Format::Human, &pressed, None);
        assert!(line.ends_with("      yes  ok"), "{line}");
        let slipping = sample(Some(force(None)), Status::CONTACT | Status::SLIP);
        let line = row(Format::Human, &slipping, None);
        assert!(line.ends_with("    slips  ok"), "{line}");
    }

    #[test]
    fn json_has_every_digit_and_null() {
        assert_eq!(
            row(Format::Json, &with_place(), None),
            concat!(
                r#"{"seq":41,"frame":42,"time_us":1400000,"force":{"alpha_deg":-5.000,"#,
                r#""beta_deg":2.500,"magnitude_n":0.100000,"x_n":-0.008707,"y_n":0.004362,"#,
                r#""z_n":-0.099525,"direction_sigma_deg":0.480,"magnitude_sigma_n":0.000900,"#,
                r#""place_x_mm":1.250,"place_y_mm":-0.007,"place_sigma_mm":0.085,"#,
                r#""torque_z_nm":-0.000021000,"torque_sigma_nm":0.000003100},"#,
                r#""contacts":[{"alpha_deg":-5.000,"#,
                r#""beta_deg":2.500,"magnitude_n":0.100000,"x_n":-0.008707,"y_n":0.004362,"#,
                r#""z_n":-0.099525,"direction_sigma_deg":0.480,"magnitude_sigma_n":0.000900,"#,
                r#""place_x_mm":1.250,"place_y_mm":-0.007,"place_sigma_mm":0.085,"#,
                r#""torque_z_nm":-0.000021000,"torque_sigma_nm":0.000003100}],"#,
                r#""contact":true,"slip":false,"status":["not_calibrated","contact"]}"#
            )
        );
        let without = sample(None, Status::IMAGE_DARK);
        assert_eq!(
            row(Format::Json, &without, Some(None)),
            concat!(
                r#"{"seq":41,"frame":42,"time_us":1400000,"force":null,"contacts":[],"#,
                r#""contact":null,"slip":null,"status":["image_dark"],"truth":null}"#
            )
        );
    }

    #[test]
    fn json_without_a_place_or_a_contact() {
        let sample = sample(Some(force(None)), Status::default());
        let line = row(Format::Json, &sample, Some(Some(truth())));
        let end = concat!(
            r#""place_x_mm":null,"place_y_mm":null,"place_sigma_mm":null,"#,
            r#""torque_z_nm":null,"torque_sigma_nm":null},"contacts":[],"#,
            r#""contact":false,"slip":false,"status":[],"truth":{"alpha_deg":-5.25,"beta_deg":2.5,"magnitude_n":0.1015,"#,
            r#""x_n":-0.01,"y_n":0.004,"z_n":-0.1,"place_x_mm":null,"place_y_mm":null}}"#
        );
        assert!(line.ends_with(end), "{line}");
    }

    /// The force is the sum; the line has the contacts, too.
    #[test]
    fn two_contacts_are_reported_each() {
        let mut two = with_place();
        two.status |= Status::TWO_CONTACTS;
        let one = force(Some(PLACE));
        let other = Force {
            magnitude: MicroNewtons(20_000),
            ..force(None)
        };
        two.contacts = ContactList::from([one, other]);
        let line = row(Format::Human, &two, None);
        let end = "not_calibrated two_contacts: 100.000 mN at (1.250, -0.007) mm, 20.000 mN";
        assert!(line.ends_with(end), "{line}");
        let line = row(Format::Json, &two, None);
        let json: serde_json::Value = serde_json::from_str(&line).unwrap();
        assert_eq!(json["contacts"][0], json["force"]);
        assert_eq!(json["contacts"][1]["magnitude_n"], 0.02);
        let line = row(Format::Csv, &two, None);
        assert!(
            line.ends_with(",0.020000,-0.008707,0.004362,-0.099525,0.480,0.000900,,,,,"),
            "{line}"
        );
    }

    #[test]
    fn csv_has_as_many_fields_in_every_row() {
        let rows = [
            with_place(),
            sample(Some(force(None)), Status::default()),
            sample(None, Status::MARKERS_MISSING | Status::FRAME_DROPPED),
        ];
        let truths = [truth(), truth_with_place()].map(|truth| Some(Some(truth)));
        for truth in [None, Some(None)].into_iter().chain(truths) {
            let commas = |line: &str| line.matches(',').count();
            let header = commas(&Format::Csv.header(truth.is_some()).unwrap());
            for sample in &rows {
                assert_eq!(commas(&row(Format::Csv, sample, truth)), header);
            }
        }
    }

    #[test]
    fn csv_fields_that_are_not_there_are_empty() {
        let contact = "-5.000,2.500,0.100000,-0.008707,0.004362,-0.099525,0.480,0.000900";
        let placed = "1.250,-0.007,0.085,-0.000021000,0.000003100";
        let force_of_all = format!("41,42,1400000,{contact}");
        let none = ",".repeat(12);
        assert_eq!(
            row(Format::Csv, &with_place(), Some(Some(truth_with_place()))),
            format!(
                "{force_of_all},{placed},true,false,not_calibrated|contact,\
                 {contact},{placed},{none},-5.25,2.5,0.1015,-0.01,0.004,-0.1,1.2504,-0.5"
            )
        );
        let without_place = sample(Some(force(None)), Status::default());
        assert_eq!(
            row(Format::Csv, &without_place, None),
            format!("{force_of_all},,,,,,false,false,,{none},{none}")
        );
        let without = sample(None, Status::MARKERS_MISSING | Status::FRAME_DROPPED);
        assert_eq!(
            row(Format::Csv, &without, Some(Some(truth()))),
            format!(
                "41,42,1400000,,,,,,,,,,,,,,,,markers_missing|frame_dropped,{none},{none},\
                 -5.25,2.5,0.1015,-0.01,0.004,-0.1,,"
            )
        );
    }
}
