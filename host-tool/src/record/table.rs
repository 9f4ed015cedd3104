//! Writes a recording as CSV: a row for each sample, units in the names of the columns.

use crate::lines::{Format, Row};
use hivtac_host::clock::Clock;
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
    /// Tells when frames were exposed.
    clock: Clock,
}

impl Table {
    /// Begins a file with its header, which has column, row and area of each of the markers.
    pub fn create(file: File, markers: usize) -> io::Result<Table> {
        let header = Format::Csv.header(false).unwrap_or_default();
        let columns = (0..markers).map(|id| format!("x{id}_px,y{id}_px,area{id}_px"));
        let columns = columns.collect::<Vec<_>>().join(",");
        let rows = format!("host_time_s,exposed_time_s,{header},{columns}\n");
        let mut table = Table {
            file,
            rows,
            markers,
            clock: Clock::default(),
        };
        table.flush()?;
        Ok(table)
    }

    /// Keeps a sample that was received at `now_ns`, ns since 1970; other messages have no row.
    pub fn message(&mut self, message: &DeviceMessage, now_ns: u64) {
        match message {
            DeviceMessage::Sample(sample) => self.sample(sample, now_ns),
            DeviceMessage::Stats(stats) => self.clock.latency(stats.latency_us),
            _ => (),
        }
    }

    fn sample(&mut self, sample: &Sample, now_ns: u64) {
        let exposed_ns = self.clock.stamp_ns(sample.time_us, now_ns);
        let [came, exposed] = [now_ns, exposed_ns].map(seconds);
        let row = Format::Csv.row(&Row {
            sample,
            truth: None,
        });
        let columns = self.columns(sample);
        self.rows += &format!("{came},{exposed},{row},{columns}\n");
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

/// A time in seconds, with microseconds.
fn seconds(ns: u64) -> String {
    let (s, us) = (ns / 1_000_000_000, ns / 1_000 % 1_000_000);
    format!("{s}.{us:06}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::force::ContactList;
    use hivtac_terms::marker::MarkerList;
    use hivtac_terms::status::Status;
    use hivtac_wire::message::Stats;

    #[test]
    fn a_row_has_when_its_frame_was_exposed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        let mut table = Table::create(File::create(&path).unwrap(), 4).unwrap();
        let stats = Stats {
            latency_us: 4_500,
            ..Stats::default()
        };
        table.message(&DeviceMessage::Stats(stats), 1_700_000_000_000_000_000);
        for (frame, delay_ns) in [(1, 0), (2, 3_000_000), (3, 1_000_000)] {
            let time_us = 6_400 * u64::from(frame);
            let sample = Sample {
                sequence: frame,
                frame,
                time_us,
                status: Status::MARKERS_MISSING,
                force: None,
                contacts: ContactList::default(),
                markers: MarkerList::default(),
            };
            let came_ns = 1_700_000_000_004_500_000 + 1_000 * time_us + delay_ns;
            table.message(&DeviceMessage::Sample(sample), came_ns);
        }
        table.finish().unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let times = |line: &str| {
            let mut columns = line.split(',');
            [columns.next(), columns.next()].map(|it| it.unwrap().to_owned())
        };
        let times: Vec<_> = text.lines().map(times).collect();
        let wanted = [
            ["host_time_s", "exposed_time_s"],
            ["1700000000.010900", "1700000000.006400"],
            ["1700000000.020300", "1700000000.012800"],
            ["1700000000.024700", "1700000000.019200"],
        ];
        assert_eq!(times, wanted);
    }
}
