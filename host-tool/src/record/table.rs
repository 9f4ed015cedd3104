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
}

/// Column, row and area of each marker.
const MARKERS: &str = "x0_px,y0_px,area0_px,x1_px,y1_px,area1_px,\
                       x2_px,y2_px,area2_px,x3_px,y3_px,area3_px";

impl Table {
    /// Begins a file with its header.
    pub fn create(file: File) -> io::Result<Table> {
        let header = Format::Csv.header(false).unwrap_or_default();
        let rows = format!("host_time_s,{header},{MARKERS}\n");
        let mut table = Table { file, rows };
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
            self.rows += &format!("{s}.{us:06},{row},{}\n", markers(sample));
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
}

fn markers(sample: &Sample) -> String {
    let Some(markers) = &sample.markers else {
        return ",".repeat(11);
    };
    let numbers = markers.map(|marker| {
        let [x, y] = [marker.x, marker.y].map(|px| px.to_f64());
        format!("{x:.5},{y:.5},{}", marker.area)
    });
    numbers.join(",")
}
