//! One line for each sample: for people, as JSON, or as CSV.

use crate::decimal::{Millionths, Thousandths};
use crate::force_json::ForceJson;
use crate::truth::Truth;
use hivtac_wire::message::{Force, Sample};
use hivtac_wire::status::Status;
use serde::Serialize;

/// How samples are printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Aligned columns with a header.
    Human,
    /// One JSON object a line.
    Json,
    /// Comma-separated values with a header line.
    Csv,
}

/// A sample and, when it is compared with a simulation, its truth (`Some(None)`: not found).
pub struct Row<'a> {
    /// What the device sent.
    pub sample: &'a Sample,
    /// What it should have measured.
    pub truth: Option<Option<Truth>>,
}

impl Format {
    /// What stands above the first row; `truth` tells whether the rows have one.
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

/// Names, set bits only, of a status.
fn names(status: Status) -> Vec<&'static str> {
    status.names().collect()
}

fn human_header(truth: bool) -> String {
    let columns = |names: &[&str]| {
        names
            .iter()
            .map(|name| format!("{name:>9}"))
            .collect::<String>()
    };
    let mut name = format!("{:>8}{:>8}{:>13}", "seq", "frame", "time");
    let mut unit = format!("{:>8}{:>8}{:>13}", "", "", "s");
    name += &columns(&["α", "β", "|F|", "Fx", "Fy", "Fz"]);
    unit += &columns(&["°", "°", "mN", "mN", "mN", "mN"]);
    if truth {
        name += &columns(&["true α", "true β", "true |F|"]);
        unit += &columns(&["°", "°", "mN"]);
    }
    format!("{name}  status\n{unit}")
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
    let time = Millionths::from_u64(*time_us);
    let mut line = format!("{sequence:>8}{frame:>8}{time:>13}");
    line += &human_force(force.as_ref());
    if let Some(truth) = row.truth {
        line += &human_truth(truth);
    }
    let names = names(*status);
    let status = if names.is_empty() {
        "ok".to_owned()
    } else {
        names.join(" ")
    };
    format!("{line}  {status}")
}

/// Six columns: ° with three decimals, mN with three decimals; both exact.
fn human_force(force: Option<&Force>) -> String {
    let Some(force) = force else {
        return format!("{:>9}", "–").repeat(6);
    };
    let numbers = [force.alpha_mdeg, force.beta_mdeg, force.magnitude_un];
    let mut text: String = numbers.map(column).concat();
    text += &match force.cartesian_un {
        Some(vector) => vector.map(column).concat(),
        None => format!("{:>9}", "–").repeat(3),
    };
    text
}

fn column(thousandths: i32) -> String {
    format!("{:>9}", Thousandths::from_i32(thousandths))
}

fn human_truth(truth: Option<Truth>) -> String {
    match truth {
        Some(truth) => {
            let millinewtons = truth.magnitude_n * 1e3;
            format!(
                "{:>9.3}{:>9.3}{millinewtons:>9.3}",
                truth.alpha_deg, truth.beta_deg
            )
        }
        None => format!("{:>9}", "?").repeat(3),
    }
}

#[derive(Serialize)]
struct SampleJson {
    seq: u32,
    frame: u32,
    time_us: u64,
    force: Option<ForceJson>,
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
        force: sample.force.as_ref().map(ForceJson::from),
        status: names(sample.status),
        truth: row.truth,
    };
    to_json(&json)
}

/// A JSON object without a line end.
pub fn to_json(value: &impl Serialize) -> String {
    // Only maps with odd keys and failing `Serialize` implementations give an error; there are none here.
    serde_json::to_string(value).expect("plain data becomes JSON")
}

fn csv_header(truth: bool) -> String {
    let mut header = "seq,frame,time_us,alpha_deg,beta_deg,magnitude_n,x_n,y_n,z_n,\
                      direction_sigma_deg,magnitude_sigma_n,status"
        .to_owned();
    if truth {
        header += ",true_alpha_deg,true_beta_deg,true_magnitude_n,true_x_n,true_y_n,true_z_n";
    }
    header
}

/// Fields that are not there are empty; names of status bits are joined by `|`.
fn csv_row(row: &Row) -> String {
    let sample = row.sample;
    let mut fields = vec![
        sample.sequence.to_string(),
        sample.frame.to_string(),
        sample.time_us.to_string(),
    ];
    fields.extend(csv_force(sample.force.as_ref()));
    fields.push(names(sample.status).join("|"));
    if let Some(truth) = row.truth {
        fields.extend(csv_truth(truth));
    }
    fields.join(",")
}

fn csv_force(force: Option<&Force>) -> Vec<String> {
    let Some(force) = force else {
        return vec![String::new(); 8];
    };
    let angles =
        [force.alpha_mdeg, force.beta_mdeg].map(|angle| Thousandths::from_i32(angle).to_string());
    let vector = force
        .cartesian_un
        .map(|vector| vector.map(Millionths::from_i32));
    let vector = vector.map_or([const { String::new() }; 3], |vector| {
        vector.map(|n| n.to_string())
    });
    let mut fields = angles.to_vec();
    fields.push(Millionths::from_i32(force.magnitude_un).to_string());
    fields.extend(vector);
    fields.push(Thousandths::from_u64(force.direction_sigma_mdeg.into()).to_string());
    fields.push(Millionths::from_u64(force.magnitude_sigma_un.into()).to_string());
    fields
}

fn csv_truth(truth: Option<Truth>) -> Vec<String> {
    match truth {
        Some(t) => [t.alpha_deg, t.beta_deg, t.magnitude_n, t.x_n, t.y_n, t.z_n]
            .map(|number| number.to_string())
            .to_vec(),
        None => vec![String::new(); 6],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(force: Option<Force>, status: Status) -> Sample {
        Sample {
            sequence: 41,
            frame: 42,
            time_us: 1_400_000,
            status,
            force,
            markers: None,
        }
    }

    fn force(cartesian_un: Option<[i32; 3]>) -> Force {
        Force {
            alpha_mdeg: -5000,
            beta_mdeg: 2500,
            magnitude_un: 100_000,
            cartesian_un,
            direction_sigma_mdeg: 480,
            magnitude_sigma_un: 900,
        }
    }

    fn truth() -> Truth {
        serde_json::from_str(
            r#"{"frame":42,"time_us":1,"alpha_deg":-5.25,"beta_deg":2.5,"magnitude_n":0.1015,"x_n":-0.01,"y_n":0.004,"z_n":-0.1}"#,
        )
        .unwrap()
    }

    fn lines(format: Format, sample: &Sample, truth: Option<Option<Truth>>) -> String {
        let header = format.header(truth.is_some()).unwrap_or_default();
        format!("{header}\n{}", format.row(&Row { sample, truth }))
    }

    #[test]
    fn a_person_sees_aligned_columns() {
        let sample = sample(
            Some(force(Some([-8707, 4362, -99_525]))),
            Status::MODEL_SIMULATED,
        );
        let expected = "     seq   frame         time        α        β      |F|       Fx       Fy       Fz   true α   true β true |F|  status
                            s        °        °       mN       mN       mN       mN        °        °       mN
      41      42     1.400000   -5.000    2.500  100.000   -8.707    4.362  -99.525   -5.250    2.500  101.500  model_simulated";
        assert_eq!(lines(Format::Human, &sample, Some(Some(truth()))), expected);
    }

    #[test]
    fn a_person_sees_what_is_missing() {
        let sample = sample(None, Status::MARKERS_MISSING | Status::FRAME_DROPPED);
        let row = Format::Human.row(&Row {
            sample: &sample,
            truth: Some(None),
        });
        let expected = "      41      42     1.400000        –        –        –        –        –        –        ?        ?        ?  markers_missing frame_dropped";
        assert_eq!(row, expected);
    }

    #[test]
    fn json_has_every_digit_and_null() {
        let whole = sample(
            Some(force(Some([-8707, 4362, -99_525]))),
            Status::MODEL_SIMULATED,
        );
        assert_eq!(
            Format::Json.row(&Row {
                sample: &whole,
                truth: None
            }),
            concat!(
                r#"{"seq":41,"frame":42,"time_us":1400000,"force":{"alpha_deg":-5.000,"beta_deg":2.500,"#,
                r#""magnitude_n":0.100000,"x_n":-0.008707,"y_n":0.004362,"z_n":-0.099525,"#,
                r#""direction_sigma_deg":0.480,"magnitude_sigma_n":0.000900},"status":["model_simulated"]}"#
            )
        );
        let without = sample(None, Status::IMAGE_DARK);
        assert_eq!(
            Format::Json.row(&Row {
                sample: &without,
                truth: Some(None)
            }),
            r#"{"seq":41,"frame":42,"time_us":1400000,"force":null,"status":["image_dark"],"truth":null}"#
        );
    }

    #[test]
    fn json_of_a_force_without_a_vector() {
        let sample = sample(Some(force(None)), Status::default());
        let row = Format::Json.row(&Row {
            sample: &sample,
            truth: Some(Some(truth())),
        });
        assert!(row.contains(r#""x_n":null,"y_n":null,"z_n":null"#), "{row}");
        assert!(row.ends_with(
            r#""status":[],"truth":{"alpha_deg":-5.25,"beta_deg":2.5,"magnitude_n":0.1015,"x_n":-0.01,"y_n":0.004,"z_n":-0.1}}"#
        ), "{row}");
    }

    #[test]
    fn csv_has_as_many_fields_in_every_row() {
        let rows = [
            sample(
                Some(force(Some([-8707, 4362, -99_525]))),
                Status::MODEL_SIMULATED,
            ),
            sample(Some(force(None)), Status::default()),
            sample(None, Status::MARKERS_MISSING | Status::FRAME_DROPPED),
        ];
        for truth in [None, Some(None), Some(Some(truth()))] {
            let commas = |line: &str| line.matches(',').count();
            let header = commas(&Format::Csv.header(truth.is_some()).unwrap());
            for sample in &rows {
                assert_eq!(commas(&Format::Csv.row(&Row { sample, truth })), header);
            }
        }
        assert_eq!(
            Format::Csv.row(&Row {
                sample: &rows[0],
                truth: None
            }),
            "41,42,1400000,-5.000,2.500,0.100000,-0.008707,0.004362,-0.099525,0.480,0.000900,model_simulated"
        );
        assert_eq!(
            Format::Csv.row(&Row {
                sample: &rows[2],
                truth: Some(Some(truth()))
            }),
            "41,42,1400000,,,,,,,,,markers_missing|frame_dropped,-5.25,2.5,0.1015,-0.01,0.004,-0.1"
        );
    }
}
