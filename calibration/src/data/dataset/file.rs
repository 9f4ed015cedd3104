//! Reads and writes data sets as CSV files: one row per frame, after comment lines that describe
//! them.
//!
//! The first line names the format, the second holds [`About`] as JSON; both begin with `#`.
//! Features are exact decimals, so that reading returns the very integers that the pipeline
//! produced.

use std::fs;
use std::num::ParseIntError;
use std::path::Path;
use std::str::FromStr;

use anyhow::{Context, Result, bail, ensure};
use csv::StringRecord;
use hivtac_twin::film::Dots;

use super::{About, Dataset, Observation, Place, Row, check_down};
use crate::data::rest::{AFTER_COORDINATES, FeatureList, q16};

const FORMAT: &str =
    "# hivtac-dataset 2; forces in N in the film frame, features in px (area in px²), areas in px";
/// Columns of every data set, before and after [`PLACE_COLUMNS`].
const FIRST_COLUMNS: [&str; 5] = ["session", "pose", "fx_n", "fy_n", "fz_n"];
/// Columns of a data set in which at least some rows have a place of the tip.
const PLACE_COLUMNS: [&str; 2] = ["x_mm", "y_mm"];
/// Columns of a data set with presses at unknown places.
const FREE_COLUMNS: [&str; 1] = ["clock_n"];
/// Columns of the markers' rectangle, after their coordinates.
const RECT_COLUMNS: [&str; AFTER_COORDINATES] = ["rect_x_px", "rect_y_px", "rect_area_px2"];
/// The last column.
const STATUS_COLUMN: &str = "status";
/// Limits of numbers, ±: a force's component, N; a tip's coordinate, mm; a feature, px or px². Sums
/// and differences of such numbers stay far inside their types.
pub const LARGEST_N: f64 = 1e3;
const LARGEST_MM: f64 = 1e3;
const LARGEST_FEATURE: f64 = 1048576.0;
/// The largest area of a marker, px.
pub const LARGEST_AREA: u32 = 1 << 20;

const FORCE_AT: usize = 2;
const PLACE_AT: usize = FORCE_AT + 3;
const CLOCK_AT: usize = PLACE_AT + PLACE_COLUMNS.len();
/// The largest standard uncertainty of a direction, degrees.
const LARGEST_DEG: f64 = 90.0;

/// The columns of a data set, and where they are.
struct Columns {
    names: Vec<String>,
    /// Number of markers.
    markers: usize,
    knows_places: bool,
    has_free: bool,
}

impl Columns {
    fn of(about: &About) -> Self {
        let has_free = about.free.is_some();
        let knows_places = has_free || about.range.knows_places();
        let markers = about.conditions.markers;
        let places = PLACE_COLUMNS.iter().filter(|_| knows_places);
        let free = FREE_COLUMNS.iter().filter(|_| has_free);
        let before = FIRST_COLUMNS.iter().chain(places).chain(free);
        let mut names: Vec<String> = before.map(|name| (*name).to_owned()).collect();
        names.extend((0..markers).flat_map(|k| [format!("x{k}_px"), format!("y{k}_px")]));
        names.extend(RECT_COLUMNS.map(str::to_owned));
        names.extend((0..markers).map(|k| format!("area{k}_px")));
        names.push(STATUS_COLUMN.to_owned());
        Self {
            names,
            markers,
            knows_places,
            has_free,
        }
    }

    fn features_at(&self) -> usize {
        self.areas_at() - self.features()
    }

    /// Number of features.
    fn features(&self) -> usize {
        2 * self.markers + AFTER_COORDINATES
    }

    fn areas_at(&self) -> usize {
        self.status_at() - self.markers
    }

    fn status_at(&self) -> usize {
        self.names.len() - 1
    }
}

impl Dataset {
    /// Writes the data set.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn save(&self, path: &Path) -> Result<()> {
        fs::write(path, self.to_text()?).with_context(|| format!("cannot write {}", path.display()))
    }

    /// The text of the data set's file.
    ///
    /// # Errors
    /// When a value cannot be written as text.
    pub fn to_text(&self) -> Result<Vec<u8>> {
        let mut text = opening(&self.about)?.into_bytes();
        text.extend(lines(&self.about, &self.rows)?);
        Ok(text)
    }

    /// Reads a data set.
    ///
    /// # Errors
    /// When the file cannot be read, or is not a data set; names the line.
    pub fn load(path: &Path) -> Result<Self> {
        let text =
            fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        Self::parse(&text).with_context(|| format!("{} is not a usable data set", path.display()))
    }

    /// Parses the text of a data set.
    ///
    /// # Errors
    /// When it is not a data set; names the line.
    pub fn parse(text: &str) -> Result<Self> {
        let mut lines = text.lines();
        let first = lines.next().unwrap_or_default();
        ensure!(first == FORMAT, "line 1 is not `{FORMAT}`");
        let about = lines
            .next()
            .and_then(|line| line.strip_prefix("# "))
            .context("line 2 says nothing about it")?;
        let about: About = serde_json::from_str(about).context("line 2")?;
        about.conditions.layout().context("line 2")?;
        if let Some(down) = &about.down {
            check_down(down).context("line 2")?;
        }
        if let Some(free) = &about.free {
            ensure!(
                free.direction_deg > 0.0 && free.direction_deg <= LARGEST_DEG,
                "line 2: direction_deg is {}: above 0 and up to {LARGEST_DEG} it must be",
                free.direction_deg
            );
        }
        let columns = Columns::of(&about);
        let mut table = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .from_reader(text.as_bytes());
        ensure!(
            table.headers()?.iter().eq(columns.names.iter()),
            "the columns are not {}",
            columns.names.join(",")
        );
        let rows = table.records().map(|record| {
            let record = record?;
            let line = record.position().map_or(0, csv::Position::line);
            let row = Record {
                record: &record,
                columns: &columns,
            }
            .row();
            row.with_context(|| format!("line {line}"))
        });
        Ok(Self {
            about,
            rows: rows.collect::<Result<_>>()?,
        })
    }
}

/// The lines before the rows.
pub(super) fn opening(about: &About) -> Result<String> {
    Ok(format!(
        "{FORMAT}\n# {}\n{}\n",
        serde_json::to_string(about)?,
        Columns::of(about).names.join(",")
    ))
}

/// The lines of a data set's rows.
pub(super) fn lines(about: &About, rows: &[Row]) -> Result<Vec<u8>> {
    let columns = Columns::of(about);
    let mut table = csv::Writer::from_writer(Vec::new());
    for row in rows {
        table.write_record(fields(row, &columns))?;
    }
    Ok(table.into_inner()?)
}

fn fields(row: &Row, columns: &Columns) -> Vec<String> {
    let Place { session, pose } = row.place;
    let mut fields = vec![
        session.to_string(),
        pose.map_or(String::new(), |pose| pose.to_string()),
    ];
    fields.extend(row.force_n.iter().map(f64::to_string));
    if columns.knows_places {
        let part = |axis: usize| {
            row.tip_mm
                .map_or(String::new(), |tip| tip[axis].to_string())
        };
        fields.extend([0, 1].map(part));
    }
    if columns.has_free {
        fields.push(row.clock_n.map_or(String::new(), |n| n.to_string()));
    }
    match &row.seen {
        Ok(seen) => {
            let features = seen.features_q16.iter().map(|number| number.to_f64());
            fields.extend(features.map(|number| number.to_string()));
            fields.extend(seen.areas_px.iter().map(u32::to_string));
            fields.push(String::new());
        }
        Err(status) => {
            fields.resize(columns.status_at(), String::new());
            fields.push(status.clone());
        }
    }
    fields
}

/// A line to be parsed into a row.
struct Record<'a> {
    record: &'a StringRecord,
    columns: &'a Columns,
}

impl Record<'_> {
    fn row(&self) -> Result<Row> {
        let place = Place {
            session: self.whole(0)?,
            pose: self.filled(1).then(|| self.whole(1)).transpose()?,
        };
        let mut force_n = [0.0; 3];
        for (i, component) in force_n.iter_mut().enumerate() {
            *component = self.number(FORCE_AT + i, LARGEST_N)?;
        }
        let seen = match &self.record[self.columns.status_at()] {
            "" => Ok(self.observation()?),
            status => Err(status.to_owned()),
        };
        Ok(Row {
            place,
            force_n,
            tip_mm: self.tip()?,
            clock_n: self.clock()?,
            seen,
        })
    }

    fn clock(&self) -> Result<Option<f64>> {
        let is_said = self.columns.has_free && self.filled(CLOCK_AT);
        is_said
            .then(|| {
                let clock_n = self.number(CLOCK_AT, LARGEST_N)?;
                ensure!(clock_n >= 0.0, "column clock_n: {clock_n} is below 0");
                Ok(clock_n)
            })
            .transpose()
    }

    fn tip(&self) -> Result<Option<[f64; 2]>> {
        let places = PLACE_AT..PLACE_AT + 2;
        if !self.columns.knows_places || places.clone().all(|column| !self.filled(column)) {
            return Ok(None);
        }
        Ok(Some([
            self.number(places.start, LARGEST_MM)?,
            self.number(places.start + 1, LARGEST_MM)?,
        ]))
    }

    fn observation(&self) -> Result<Observation> {
        let mut seen = Observation {
            features_q16: FeatureList::defaults(self.columns.features()),
            areas_px: Dots::defaults(self.columns.markers),
        };
        for (i, feature) in seen.features_q16.iter_mut().enumerate() {
            let number = self.number(self.columns.features_at() + i, LARGEST_FEATURE)?;
            *feature = q16(number);
        }
        for (i, area) in seen.areas_px.iter_mut().enumerate() {
            let column = self.columns.areas_at() + i;
            *area = self.whole(column)?;
            ensure!(
                *area <= LARGEST_AREA,
                "column {}: {area} is more than {LARGEST_AREA}",
                self.columns.names[column]
            );
        }
        Ok(seen)
    }

    fn filled(&self, column: usize) -> bool {
        !self.record[column].is_empty()
    }

    fn whole<T: FromStr<Err = ParseIntError>>(&self, column: usize) -> Result<T> {
        let text = &self.record[column];
        text.parse()
            .with_context(|| format!("column {}: `{text}`", self.columns.names[column]))
    }

    /// A number within ±`most`.
    fn number(&self, column: usize, most: f64) -> Result<f64> {
        let (text, name) = (&self.record[column], &self.columns.names[column]);
        match text.parse::<f64>() {
            Ok(value) if value.abs() <= most => Ok(value),
            Ok(value) if value.is_finite() => {
                bail!("column {name}: `{text}` is beyond ±{most}")
            }
            _ => bail!("column {name}: `{text}` is not a finite number"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::example;
    use super::*;
    use hivtac_terms::fixed::Q;

    fn saved(dataset: &Dataset) -> String {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("data.csv");
        dataset.save(&path).unwrap();
        assert_eq!(Dataset::load(&path).unwrap(), *dataset);
        fs::read_to_string(path).unwrap()
    }

    #[test]
    fn what_is_written_is_read() {
        let text = saved(&example());
        for words in [
            "force",
            "ov7725",
            "\"seed\":3",
            "made up",
            "fx_n",
            "rect_area_px2",
            "markers_missing",
        ] {
            assert!(text.contains(words), "no `{words}` in:\n{text}");
        }
    }

    /// A data set of eight dots has columns of each, and says so.
    #[test]
    fn eight_dots_come_back() {
        let mut dataset = example();
        dataset.about.conditions.markers = 8;
        for seen in dataset
            .rows
            .iter_mut()
            .filter_map(|row| row.seen.as_mut().ok())
        {
            seen.features_q16 = FeatureList::from_fn(19, |i| Q::from_bits(i as i64));
            seen.areas_px = Dots::from_fn(8, |i| 190 + i as u32);
        }
        let text = saved(&dataset);
        assert!(text.contains("\"markers\":8"), "{text}");
        assert!(text.contains(",x7_px,y7_px,rect_x_px,"), "{text}");
        assert!(text.contains(",190,191,192,193,194,195,196,197,"), "{text}");
        let none = text.replace("\"markers\":8", "\"markers\":7");
        let error = format!("{:#}", Dataset::parse(&none).unwrap_err());
        assert!(error.contains("line 2: 7 markers"), "{error}");
    }

    #[test]
    fn places_have_columns_of_their_own_and_come_back() {
        assert!(!saved(&example()).contains("_mm,"));
        let mut dataset = example();
        dataset.about.range.place_mm = 4.2;
        dataset.rows[2].tip_mm = Some([-0.1, 4.2]);
        let text = saved(&dataset);
        assert!(text.contains("fz_n,x_mm,y_mm,x0_px"), "{text}");
        assert!(text.contains("0,,0,0.1,-0.1,-0.1,4.2,"), "{text}");
        let half = text.replace("-0.1,-0.1,4.2,", "-0.1,-0.1,,");
        let error = format!("{:#}", Dataset::parse(&half).unwrap_err());
        assert!(error.contains("column y_mm"), "{error}");
    }

    #[test]
    fn rows_with_and_without_a_place_come_back() {
        let mut dataset = example();
        dataset.about.free = Some(super::super::Free { direction_deg: 3.0 });
        dataset.rows[2].tip_mm = Some([0.0, 0.0]);
        dataset.rows[3].clock_n = Some(0.000_25);
        let text = saved(&dataset);
        assert!(text.contains("fz_n,x_mm,y_mm,clock_n,x0_px"), "{text}");
        assert!(text.contains("\"free\":{\"direction_deg\":3.0}"), "{text}");
        assert!(text.contains("0,,0,0.1,-0.1,0,0,,"), "{text}");
        assert!(text.contains("0,,0,0,-0.1,,,0.00025,"), "{text}");
        let free: Vec<bool> = dataset
            .rows
            .iter()
            .map(|row| dataset.is_free(row))
            .collect();
        assert_eq!(free, [false, false, false, true]);
        let (known, left_out) = dataset.without_free();
        assert_eq!((known.rows.len(), left_out), (3, 1));
        let refused = |bad: String, words: &str| {
            let error = format!("{:#}", Dataset::parse(&bad).unwrap_err());
            assert!(error.contains(words), "{error}");
        };
        refused(
            text.replace(",0.00025,", ",-1,"),
            "column clock_n: -1 is below",
        );
        refused(
            text.replace("deg\":3.0", "deg\":0.0"),
            "line 2: direction_deg",
        );
    }

    #[test]
    fn bad_files_are_refused_with_the_place() {
        let text = saved(&example());
        let refused = |bad: String, words: &str| {
            let error = format!("{:#}", Dataset::parse(&bad).unwrap_err());
            assert!(error.contains(words), "{error}");
        };
        refused(String::new(), "line 1");
        refused(text.replace("dataset 2", "dataset 9"), "line 1");
        refused(text.replace("\"seed\":3", "\"sead\":3"), "line 2");
        refused(text.replace("area3_px", "area4_px"), "columns");
        refused(
            text.replace("0,,0,0,0,", "0,,0,zero,0,"),
            "line 4: column fy_n: `zero`",
        );
        refused(text.replace("0,,0,0,0,", "0,,0,inf,0,"), "column fy_n");
        refused(
            text.replace("0,,0,0,0,", "x,,0,0,0,"),
            "column session: `x`",
        );
        refused(
            text.replace("0,,0,0,0,", "0,-1,0,0,0,"),
            "column pose: `-1`",
        );
        refused(text.replace(",200,200,", ",200,2.5,"), "column area");
        refused(text.replace("markers_missing", "a,b"), "line: 7");
    }

    #[test]
    fn numbers_that_no_frame_has_are_refused() {
        let refused = |change: &dyn Fn(&mut Row), words: &str| {
            let mut dataset = example();
            change(&mut dataset.rows[0]);
            let text = String::from_utf8(dataset.to_text().unwrap()).unwrap();
            let error = format!("{:#}", Dataset::parse(&text).unwrap_err());
            assert!(error.contains(words), "{error}");
        };
        let feature = |row: &mut Row, i: usize| {
            row.seen.as_mut().unwrap().features_q16[i] = Q::from_bits(i64::MAX / 2);
        };
        refused(&|row| feature(row, 0), "column x0_px");
        refused(&|row| feature(row, 10), "column rect_area_px2");
        refused(&|row| row.force_n[1] = 1e200, "column fy_n");
        let area = |row: &mut Row| row.seen.as_mut().unwrap().areas_px[3] = u32::MAX;
        refused(&area, "column area3_px");
    }
}
