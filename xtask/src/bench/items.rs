//! The items that goals are set for, out of what the cases took.

use serde::{Serialize, Serializer};

use super::cases::{Work, multiplications};
use super::measure::{Cost, Measured};

/// What is measured of every frame: its stages, and the item's name.
const PARTS: [(&str, &[&str]); 2] = [
    ("threshold", &["threshold"]),
    ("blobs", &["dilation", "runs, labels, moments"]),
];

/// What `--json` prints.
#[derive(Serialize)]
pub struct Report<'i> {
    /// All of them.
    pub items: &'i [Item],
}

/// One measured item. Its three numbers are per frame, or per inference; those of `mac` are per
/// multiplication.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Item {
    /// `threshold`, `blobs`, `frame full`, `latency`, `network …`, `mac` or `table` (the
    /// threshold's, of 256 × 256 values); of a frame that is not the usual one, what it is follows
    /// after a comma.
    pub item: String,
    /// Columns and rows: `320x240`.
    pub frame: String,
    /// `rgb565`, `yuv422` or `mono`.
    pub format: String,
    /// Executed instructions, exact; also the cycles of a core that issues one at a time.
    #[serde(serialize_with = "plain")]
    pub instructions: f64,
    /// Cycles by LLVM's model of the Cortex-M7, in memory without wait states; none without LLVM.
    #[serde(serialize_with = "plain_option")]
    pub modelled_cycles: Option<f64>,
    /// Cycles of a core that always issues two.
    #[serde(serialize_with = "plain")]
    pub floor_cycles: f64,
}

/// A whole number without a decimal point.
fn plain<S: Serializer>(number: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    if number.fract() == 0.0 {
        serializer.serialize_u64(*number as u64)
    } else {
        serializer.serialize_f64(*number)
    }
}

fn plain_option<S: Serializer>(number: &Option<f64>, serializer: S) -> Result<S::Ok, S::Error> {
    match number {
        Some(number) => plain(number, serializer),
        None => serializer.serialize_none(),
    }
}

impl Item {
    /// What it is, in one line.
    pub fn label(&self) -> String {
        format!("{}, {} {}", self.item, self.frame, self.format)
    }

    /// Whether its numbers are for one multiplication.
    pub fn is_per_multiplication(&self) -> bool {
        self.item == "mac"
    }
}

/// All items of all cases.
pub fn of(measured: &[Measured]) -> Vec<Item> {
    measured.iter().flat_map(of_one).collect()
}

fn of_one(measured: &Measured) -> Vec<Item> {
    let make = |name: &str, cost: Cost| item(measured, name, cost, 1.0);
    match &measured.case.work {
        Work::Frame(special) => {
            let name = |name: &str| match special.as_str() {
                "" => name.to_owned(),
                special => format!("{name}, {special}"),
            };
            let parts = PARTS
                .iter()
                .map(|(part, stages)| (*part, measured.of(stages)));
            let whole = [
                ("frame full", measured.total()),
                ("latency", measured.last_band),
            ];
            let costs = parts.chain(whole);
            costs.map(|(part, cost)| make(&name(part), cost)).collect()
        }
        Work::Table => vec![make("table", measured.total())],
        Work::Steps(steps) => vec![make(&steps_of(*steps), measured.total())],
        Work::Network(widths) => {
            let names: Vec<String> = widths.iter().map(u64::to_string).collect();
            let mut items = vec![make(
                &format!("network {}", names.join("-")),
                measured.total(),
            )];
            // The loops of narrow layers say little about the loop.
            if widths.iter().any(|&width| width >= 128) {
                let count = multiplications(widths) as f64;
                items.push(item(measured, "mac", measured.inner_loop, count));
            }
            items
        }
    }
}

/// `network and 1 step`, `network and 2 steps`
pub fn steps_of(steps: u64) -> String {
    let plural = if steps == 1 { "" } else { "s" };
    format!("network and {steps} step{plural}")
}

fn item(measured: &Measured, name: &str, cost: Cost, count: f64) -> Item {
    // Whole cycles, or thousandths of them for one multiplication.
    let steps = if count > 1.0 { 1000.0 } else { 1.0 };
    let each = |number: f64| (number / count * steps).round() / steps;
    let instructions = cost.instructions as f64;
    Item {
        item: name.to_owned(),
        frame: measured.case.frame(),
        format: measured.case.format.clone(),
        instructions: each(instructions),
        modelled_cycles: cost.cycles.map(each),
        floor_cycles: each(instructions / 2.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_json_has_the_fields_that_are_documented() {
        let items = [Item {
            item: "frame full".to_owned(),
            frame: "320x240".to_owned(),
            format: "rgb565".to_owned(),
            instructions: 801_275.0,
            modelled_cycles: None,
            floor_cycles: 400_637.5,
        }];
        let text = serde_json::to_string(&Report { items: &items }).unwrap();
        let expected = concat!(
            r#"{"items":[{"item":"frame full","frame":"320x240","format":"rgb565","#,
            r#""instructions":801275,"modelled_cycles":null,"floor_cycles":400637.5}]}"#
        );
        assert_eq!(text, expected);
    }
}
