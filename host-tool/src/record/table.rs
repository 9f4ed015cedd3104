//! Writes a recording as CSV: a row for each sample, units in the names of the columns.

use crate::lines::{Format, Row};
use hivtac_wire::message::{DeviceMessage, Sample};
use std::fs::File;
use std::io;

/// The file that is being written.
pub struct Table {
    file: File,
    /// Whole rows that are not on the disk yet.
    rows: String,
    /// Number of markers that have columns.
    markers: usize,
}

impl Table {
    /// Begins a file with its header, which has column, row and area of each of the markers.
    pub fn create(file: File, markers: usize) -> io::Result<Table> {
        let header = Format::Csv.header(false).unwrap_or_default();
        let columns = (0..markers).map(|id| format!("x{id}_px,y{id}_px,area{id}_px"));
        let columns = columns.collect::<Vec<_>>().join(",");
        let rows = format!("host_time_s,{header},{columns}\n");
        let mut table = Table {
            file,
            rows,
            markers,
        };
        table.flush()?;
        Ok(table)
    }

    /// Keeps a sample that was received at `now_ns`, ns since 1970; ignores other messages.
    pub fn message(&mut self, message: &DeviceMessage, now_ns: u64) -> io::Result<()> {
        if let DeviceMessage::Sample(sample) = message {
            let (s, us) = (now_ns / 1_000_000_000, now_ns / 1_000 % 1_000_000);
            let row = Format::Csv.row(&Row {
                sample,
                truth: None,
            });
            self.rows += &format!("{s}.{us:06},{row},{}\n", self.columns(sample));
        }
        Ok(())
    }

    /// Writes all rows kept until now to the disk.
    pub fn flush(&mut self) -> io::Result<()> {
        crate::output::write_whole(&mut self.file, self.rows.as_bytes())?;
        self.rows.clear();
        Ok(())
    }

    /// Ends the file.
    pub fn finish(mut self) -> io::Result<File> {
        self.flush()?;
        Ok(self.file)
    }

    /// The columns of the markers; empty ones if the sample has none, or those of another film.
    fn columns(&self, sample: &Sample) -> String {
        if sample.markers.len() != self.markers {
            return ",".repeat(3 * self.markers.max(1) - 1);
        }
        let numbers = sample.markers.iter().map(|marker| {
            let [x, y] = [marker.x, marker.y].map(|px| px.to_f64());
            format!("{x:.5},{y:.5},{}", marker.area)
        });
        numbers.collect::<Vec<_>>().join(",")
    }
}
