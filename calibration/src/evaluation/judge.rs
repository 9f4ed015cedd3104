//! Compares a model's answers with the truth.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use anyhow::{Result, anyhow, ensure};
use hivtac_sensor::force::model::Model;
use hivtac_sensor::force::{Force, Place};
use hivtac_terms::status::Status;
use hivtac_twin::Contact;

use crate::data::conditions::OriginName;
use crate::data::dataset::{Dataset, Row, reasons};
use crate::data::loads::{from_polar, polar};
use crate::evaluation::answer::Chip;
use crate::evaluation::errors::angle_deg;

/// One answer with its truth; angles in degrees, forces in N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// The labelled force (F_x, F_y, F_z).
    pub truth: [f64; 3],
    /// α, β and |F| of the labelled force.
    pub truth_polar: [f64; 3],
    /// α, β and |F| of the model's answer.
    pub found_polar: [f64; 3],
    /// The angle between both forces.
    pub direction_deg: f64,
    /// Stated standard uncertainty of the direction, degrees.
    pub direction_sigma_deg: f64,
    /// Stated standard uncertainty of |F|, N.
    pub magnitude_sigma_n: f64,
    /// The tip's place, mm, if known.
    pub tip_mm: Option<[f64; 2]>,
    /// The model's place, and the standard uncertainty of each coordinate, mm.
    pub found_place: Option<([f64; 2], f64)>,
    /// The session.
    pub session: usize,
    /// The pose among the paper's.
    pub pose: Option<usize>,
}

/// All answers to a data set.
#[derive(Clone, Debug)]
pub struct Evaluation {
    /// The model's name and identity.
    pub model: String,
    /// Description of the frames, in words.
    pub frames: String,
    /// True for frames of a real unit, false for simulated ones.
    pub measured: bool,
    /// The contact reading.
    pub contact: Contact,
    /// Frames with a force and an answer, including those with a warning.
    pub judged: Vec<Judged>,
    /// Frames without an answer, by status.
    pub rejected: BTreeMap<String, usize>,
}

impl Evaluation {
    /// Runs a model on the rows of a data set that show a force, as the chip would, each session
    /// tared.
    ///
    /// # Errors
    /// When the bytes are not a model, its conditions differ from the data's, or there are no such
    /// rows.
    pub fn of(model: &[u8], dataset: &Dataset) -> Result<Self> {
        let model =
            Model::parse(model).map_err(|error| anyhow!("not a usable model file: {error}"))?;
        let about = &dataset.about;
        ensure!(
            about.conditions.to_model()? == model.conditions,
            "the model is for other conditions than the data set's: {:?} and {:?}",
            model.conditions,
            about.conditions
        );
        let unseen = dataset.rejected().into_iter();
        let mut rejected = unseen
            .map(|(status, count)| (status.to_owned(), count))
            .collect();
        let judged = judge(&model, dataset, &mut rejected)?;
        ensure!(
            !judged.is_empty(),
            "the data set has no accepted frame with a force"
        );
        Ok(Self {
            model: format!("{} (CRC {:08x})", model.name(), model.crc()),
            frames: format!(
                "{}; {} session(s), data seed {}",
                about.scene, about.sessions, about.seed
            ),
            measured: about.conditions.origin != OriginName::Simulated,
            contact: about.conditions.contact,
            judged,
            rejected,
        })
    }
}

/// The answers to all rows, each session tared on its own frames without force. Answers without a
/// force are counted by status.
fn judge(
    model: &Model<'_>,
    dataset: &Dataset,
    rejected: &mut BTreeMap<String, usize>,
) -> Result<Vec<Judged>> {
    let mut chips = BTreeMap::new();
    let mut judged = Vec::new();
    for row in &dataset.rows {
        let Ok(seen) = &row.seen else { continue };
        if row.force_n == [0.0; 3] {
            continue;
        }
        let chip: &mut Chip<'_> = match chips.entry(row.place.session) {
            Entry::Occupied(tared) => tared.into_mut(),
            Entry::Vacant(other) => {
                let rest = dataset.session_rest(row.place.session)?;
                other.insert(Chip::new(*model, &rest)?)
            }
        };
        let (force, status) = chip.force(seen)?;
        if status.intersects(Status::NO_FORCE) {
            *rejected.entry(reasons(status)).or_default() += 1;
        } else {
            judged.push(compare(row, &force));
        }
    }
    Ok(judged)
}

fn compare(row: &Row, force: &Force) -> Judged {
    let (truth, stands) = (row.force_n, row.place);
    let found_polar = [
        f64::from(force.alpha.0) / 1e3,
        f64::from(force.beta.0) / 1e3,
        f64::from(force.magnitude.0) / 1e6,
    ];
    // An answer of size 0 has no direction: its error counts as 90°, the mean over all directions.
    let direction_deg = angle_deg(from_polar(found_polar), truth).unwrap_or(90.0);
    Judged {
        truth,
        truth_polar: polar(truth),
        found_polar,
        direction_deg,
        direction_sigma_deg: f64::from(force.direction_sigma.0) / 1e3,
        magnitude_sigma_n: f64::from(force.magnitude_sigma.0) / 1e6,
        tip_mm: row.tip_mm,
        found_place: force.place.as_ref().map(place_mm),
        session: stands.session,
        pose: stands.pose,
    }
}

/// A place and the standard uncertainty of its coordinates, mm.
fn place_mm(place: &Place) -> ([f64; 2], f64) {
    let found = [place.x, place.y].map(|part| f64::from(part.0) / 1e3);
    (found, f64::from(place.sigma.0) / 1e3)
}
