//! Simulates a device like the firmware: a record with its settings and with the blob in use, and
//! sectors for two blobs.

use core::ops::Range;

use hivtac_portable::storage::{Log, PAYLOAD_LIMIT, SaveError, blob};

use crate::mock::{Cells, Cut, Mock, powered};

/// The sectors of blobs.
const SLOTS: [Range<u32>; 2] = [2..4, 4..6];

/// The data of a device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Kept {
    pub settings: Vec<u8>,
    pub model: Option<Vec<u8>>,
}

/// An action of the user.
#[derive(Clone, Debug)]
pub enum Action {
    Set(Vec<u8>),
    Update(Vec<u8>),
    Reset,
}

impl Kept {
    pub fn after(&self, action: &Action) -> Self {
        let mut kept = self.clone();
        match action {
            Action::Set(settings) => kept.settings = settings.clone(),
            Action::Update(model) => kept.model = Some(model.clone()),
            Action::Reset => kept = Self::default(),
        }
        kept
    }
}

/// Slot, length and sum of a blob, and the settings.
#[derive(Clone, Default)]
struct Record {
    blob: Option<(u8, u16, u32)>,
    settings: Vec<u8>,
}

impl Record {
    fn bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        let (slot, length, sum) = self.blob.unwrap_or((2, 0, 0));
        bytes.push(slot);
        bytes.extend(length.to_le_bytes());
        bytes.extend(sum.to_le_bytes());
        bytes.extend(&self.settings);
        bytes
    }

    fn of(bytes: &[u8]) -> Self {
        let (blob, settings) = bytes.split_at(7);
        let length = u16::from_le_bytes([blob[1], blob[2]]);
        let sum = u32::from_le_bytes([blob[3], blob[4], blob[5], blob[6]]);
        Self {
            blob: (blob[0] < 2).then_some((blob[0], length, sum)),
            settings: settings.to_vec(),
        }
    }
}

fn sum(bytes: &[u8]) -> u32 {
    (bytes.iter()).fold(1, |sum: u32, byte| {
        sum.wrapping_mul(16_777_619) ^ u32::from(*byte)
    })
}

pub struct Device<'c> {
    log: Log<Mock<'c>>,
    record: Record,
}

impl<'c> Device<'c> {
    /// Starts the device; returns `None` if the power fails meanwhile.
    pub fn start(cells: &'c mut Cells, cut: Option<Cut>) -> Option<Self> {
        let mut payload = [0; PAYLOAD_LIMIT];
        let (log, length) = Log::open(Mock::new(cells, cut), &mut payload);
        let record = length.map_or_else(Record::default, |length| Record::of(&payload[..length]));
        let mut device = Self { log, record };
        if !device.log.is_settled() {
            let record = device.record.clone();
            // Worn flash keeps its data.
            let _ = powered(device.save(record))?;
        }
        Some(device)
    }

    /// Returns its data, including the blob.
    pub fn kept(&mut self) -> Kept {
        let model = self.record.blob.map(|(slot, length, expected)| {
            let mut bytes = vec![0; usize::from(length)];
            let sectors = SLOTS[usize::from(slot)].clone();
            blob::read(self.log.flash(), sectors, &mut bytes).expect("a blob that is named reads");
            assert_eq!(sum(&bytes), expected, "a blob that is named is whole");
            bytes
        });
        Kept {
            settings: self.record.settings.clone(),
            model,
        }
    }

    /// Performs an action; returns `None` if the power fails meanwhile.
    pub fn act(&mut self, action: &Action) -> Option<Result<(), SaveError>> {
        powered(async {
            let mut record = self.record.clone();
            match action {
                Action::Set(settings) => record.settings = settings.clone(),
                Action::Reset => record = Record::default(),
                Action::Update(model) => {
                    let slot = 1 - record.blob.map_or(1, |(slot, ..)| slot);
                    let sectors = SLOTS[usize::from(slot)].clone();
                    let written = self.log.write_blob(sectors, model).await;
                    written.map_err(|_| SaveError::Worn)?;
                    record.blob = Some((slot, model.len() as u16, sum(model)));
                }
            }
            self.save(record).await
        })
    }

    async fn save(&mut self, record: Record) -> Result<(), SaveError> {
        self.log.save(&record.bytes()).await?;
        self.record = record;
        Ok(())
    }

    pub fn failures(&self) -> u32 {
        self.log.failures()
    }

    pub fn erases(&self) -> u32 {
        self.log.erases()
    }
}
