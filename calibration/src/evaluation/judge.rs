//! The model's answers beside the truth.

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

/// One answer with its truth. Angles in degrees, forces in N.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// (F_x, F_y, F_z) that pressed, as labelled.
    pub truth: [f64; 3],
    /// α, β and |F| that pressed.
    pub truth_polar: [f64; 3],
    /// α, β and |F| that the model gives.
    pub found_polar: [f64; 3],
    /// The angle between both forces.
    pub direction_deg: f64,
    /// The standard uncertainty of the direction that came with the force, degrees.
    pub direction_sigma_deg: f64,
    /// The standard uncertainty of |F| that came with it, N.
    pub magnitude_sigma_n: f64,
    /// Where the tip was, mm, where that is known.
    pub tip_mm: Option<[f64; 2]>,
    /// Where the model says it was, and the standard uncertainty of each coordinate, mm.
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
    /// What the frames are, in words.
    pub frames: String,
    /// Whether they were measured with a unit rather than simulated.
    pub measured: bool,
    /// The contact reading.
    pub contact: Contact,
    /// Frames with a force and an answer, warnings included.
    pub judged: Vec<Judged>,
    /// Frames without an answer, by status.
    pub rejected: BTreeMap<String, usize>,
}

impl Evaluation {
    /// Runs a model on the rows of a data set that show a force, as the chip would, each session
    /// tared.
    ///
    /// # Errors
    /// When the bytes are no model, it is for other conditions than the data's, or there is no such
    /// row.
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

/// The answers to all rows, each session tared on its own frames without force; those that the chip
/// sends without a force are counted by status.
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
    // An answer without size has no direction: it is as far off as one can be on average.
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
