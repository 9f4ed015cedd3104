//! The coverage of presses anywhere: which places and ranges of force are covered or missing, as
//! text and maps.

use std::fmt;

use hivtac_host::page::{Covered, Map};

/// Places along x and along y.
const SIDE: usize = 5;
/// Their reach from the film's middle, mm, and the margin beyond it in which a press counts for the
/// outermost place.
const REACH_MM: f64 = 4.0;
const BEYOND_MM: f64 = 0.8;
/// Ranges of |F|, mN; a larger force counts for the last.
const SIZES_MN: [[u32; 2]; 3] = [[20, 70], [70, 140], [140, 250]];
const SIZES: usize = SIZES_MN.len();
/// A place is covered in a range after this time, s.
const ENOUGH_S: f64 = 0.2;
/// If more than this part of a range is missing, the range is reported as missing everywhere.
const EVERYWHERE: f64 = 0.6;
/// Lines of the picture.
pub const PICTURE_LINES: usize = SIDE + 1;

/// The range and place for which a press counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell {
    size: usize,
    row: usize,
    column: usize,
}

impl Cell {
    /// The cell of a press with this force, N, at this place; `None` if it is too weak or too far
    /// out.
    pub fn of(place_mm: [f64; 2], force_n: f64) -> Option<Cell> {
        let [x, y] = place_mm;
        let within = |part: f64| part.abs() <= REACH_MM + BEYOND_MM;
        let force_mn = 1e3 * force_n;
        let size = SIZES_MN
            .iter()
            .rposition(|[least, _]| force_mn >= f64::from(*least))?;
        let index = |part: f64| {
            let steps = (part + REACH_MM) / (2.0 * REACH_MM) * SIDE as f64;
            (steps.max(0.0) as usize).min(SIDE - 1)
        };
        (within(x) && within(y)).then(|| Cell {
            size,
            row: index(y),
            column: index(x),
        })
    }

    fn all() -> impl Iterator<Item = Cell> {
        let places = |size| (0..SIDE * SIDE).map(move |place| (size, place / SIDE, place % SIDE));
        let cells = (0..SIZES).flat_map(places);
        cells.map(|(size, row, column)| Cell { size, row, column })
    }

    /// False for hard presses in a corner: they move a marker out of the picture.
    fn is_needed(&self) -> bool {
        let is_end = |index: usize| index == 0 || index == SIDE - 1;
        !(self.size == SIZES - 1 && is_end(self.row) && is_end(self.column))
    }
}

/// Pressed time of each place in each range.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coverage {
    seconds: [[[f64; SIDE]; SIDE]; SIZES],
}

/// Missing places in a range of |F|.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gap {
    size: usize,
    part: &'static str,
    /// Number of places.
    pub cells: usize,
    verb: &'static str,
}

/// Parts of the film, as the camera sees it: rows, columns, name.
const PARTS: [([usize; 2], [usize; 2], &str); 9] = [
    ([2, 2], [2, 2], "in the middle"),
    ([0, 1], [0, 1], "at the upper left"),
    ([0, 1], [3, 4], "at the upper right"),
    ([3, 4], [3, 4], "at the lower right"),
    ([3, 4], [0, 1], "at the lower left"),
    ([0, 1], [2, 2], "at the top"),
    ([2, 2], [3, 4], "at the right"),
    ([3, 4], [2, 2], "at the bottom"),
    ([2, 2], [0, 1], "at the left"),
];

impl Coverage {
    /// Adds a press of this length. Returns whether this made its place covered in its range.
    pub fn press(&mut self, cell: Cell, seconds: f64) -> bool {
        let was = self.is_covered(cell);
        self.seconds[cell.size][cell.row][cell.column] += seconds.max(0.0);
        !was && self.is_covered(cell)
    }

    /// Marks a place as covered in its range.
    pub fn mark(&mut self, cell: Cell) {
        self.press(cell, ENOUGH_S);
    }

    fn is_covered(&self, cell: Cell) -> bool {
        self.seconds[cell.size][cell.row][cell.column] >= ENOUGH_S
    }

    /// Number of needed places and ranges that are covered, and of all needed ones.
    pub fn count(&self) -> [usize; 2] {
        let wanted = || Cell::all().filter(Cell::is_needed);
        let covered = wanted().filter(|cell| self.is_covered(*cell));
        [covered.count(), wanted().count()]
    }

    /// Whether everything needed is covered.
    pub fn is_complete(&self) -> bool {
        let [covered, all] = self.count();
        covered == all
    }

    /// The missing places, the largest gap first.
    pub fn gaps(&self) -> Vec<Gap> {
        let mut gaps: Vec<Gap> = (0..SIZES).flat_map(|size| self.gaps_of(size)).collect();
        gaps.sort_by_key(|gap| std::cmp::Reverse(gap.cells));
        gaps
    }

    fn gaps_of(&self, size: usize) -> Vec<Gap> {
        let of_size = || Cell::all().filter(move |cell| cell.size == size && cell.is_needed());
        let missing: Vec<Cell> = of_size().filter(|cell| !self.is_covered(*cell)).collect();
        if missing.len() as f64 > EVERYWHERE * of_size().count() as f64 {
            return vec![self.gap(size, "everywhere", &missing)];
        }
        let parts = PARTS.iter().map(|(rows, columns, name)| {
            let is_inside = |cell: &&Cell| {
                (rows[0]..=rows[1]).contains(&cell.row)
                    && (columns[0]..=columns[1]).contains(&cell.column)
            };
            let inside: Vec<Cell> = missing.iter().filter(is_inside).copied().collect();
            self.gap(size, name, &inside)
        });
        parts.filter(|gap| gap.cells > 0).collect()
    }

    /// Advice for missing places of a range depends on the other ranges that were pressed there.
    fn gap(&self, size: usize, part: &'static str, cells: &[Cell]) -> Gap {
        let is_covered_in = |sizes: std::ops::Range<usize>| {
            let covered = |size: usize| {
                let mut at = cells.iter().map(|cell| Cell { size, ..*cell });
                at.any(|cell| self.is_covered(cell))
            };
            sizes.into_iter().any(covered)
        };
        let verb = match (is_covered_in(0..size), is_covered_in(size + 1..SIZES)) {
            (true, false) => "press harder",
            (false, true) => "press more lightly",
            _ => "press",
        };
        Gap {
            size,
            part,
            cells: cells.len(),
            verb,
        }
    }

    /// The next action, in a sentence; `None` when all is covered.
    pub fn advice(&self) -> Option<String> {
        self.gaps().first().map(Gap::to_string)
    }

    /// The missing places, for the end of a take; `None` when all is covered.
    pub fn missing(&self) -> Option<String> {
        let gaps = self.gaps();
        let words = gaps.iter().take(MOST_GAPS).map(|gap| {
            let [least, most] = SIZES_MN[gap.size];
            format!("{least}–{most} mN {}", gap.part)
        });
        let words: Vec<String> = words.collect();
        let more = match gaps.len().saturating_sub(MOST_GAPS) {
            0 => String::new(),
            more => format!(", and {more} more"),
        };
        (!words.is_empty()).then(|| format!("missing: {}{more}", words.join(", ")))
    }

    /// A map of each range, as the camera sees the film, with the present press.
    pub fn maps(&self, now: Option<Cell>) -> Vec<Map> {
        let of_size = |size: usize| {
            let row = |row: usize| {
                let place = |column: usize| self.covered(Cell { size, row, column });
                (0..SIDE).map(place).collect()
            };
            let [least, most] = SIZES_MN[size];
            let here = now.filter(|cell| cell.size == size);
            Map {
                name: format!("{least}–{most} mN"),
                places: (0..SIDE).map(row).collect(),
                pressed: here.map(|cell| [cell.row, cell.column]),
            }
        };
        (0..SIZES).map(of_size).collect()
    }

    fn covered(&self, cell: Cell) -> Covered {
        let seconds = self.seconds[cell.size][cell.row][cell.column];
        match self.is_covered(cell) {
            true => Covered::Covered,
            false if seconds > 0.0 => Covered::Begun,
            false if cell.is_needed() => Covered::Missing,
            false => Covered::Unneeded,
        }
    }

    /// The maps side by side, for a terminal.
    pub fn picture(&self, now: Option<Cell>) -> [String; PICTURE_LINES] {
        let mut lines: [String; PICTURE_LINES] = Default::default();
        for map in self.maps(now) {
            lines[0] += &format!("{:<13}", map.name);
            for (row, (line, places)) in lines.iter_mut().skip(1).zip(&map.places).enumerate() {
                for (column, place) in places.iter().enumerate() {
                    line.push(sign(*place, map.pressed == Some([row, column])));
                    line.push(' ');
                }
                line.push_str("   ");
            }
        }
        lines.map(|line| line.trim_end().to_owned())
    }
}

fn sign(place: Covered, is_pressed: bool) -> char {
    match (is_pressed, place) {
        (true, Covered::Covered) => '●',
        (true, _) => '○',
        (false, Covered::Covered) => '█',
        (false, Covered::Begun) => '▒',
        (false, Covered::Missing) => '·',
        (false, Covered::Unneeded) => ' ',
    }
}

/// Number of gaps that are named at the end.
const MOST_GAPS: usize = 4;

impl fmt::Display for Gap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [least, most] = SIZES_MN[self.size];
        write!(f, "{} {} ({least}–{most} mN)", self.verb, self.part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A coverage of everything except some cells.
    fn all_but(is_left_out: impl Fn(&Cell) -> bool) -> Coverage {
        let mut coverage = Coverage::default();
        let cells = Cell::all().filter(|cell| !is_left_out(cell));
        cells.for_each(|cell| coverage.mark(cell));
        coverage
    }

    #[test]
    fn presses_count_where_they_are() {
        let cell = |x, y, force_n| Cell::of([x, y], force_n);
        let at = |size, row, column| Some(Cell { size, row, column });
        assert_eq!(cell(0.0, 0.0, 0.1), at(1, 2, 2));
        assert_eq!(cell(-3.9, 3.9, 0.25), at(2, 4, 0));
        assert_eq!(cell(4.5, -4.5, 0.4), at(2, 0, 4));
        assert_eq!(cell(0.0, 0.0, 0.019), None, "too weak");
        assert_eq!(cell(0.0, 5.0, 0.1), None, "too far out");
        assert_eq!(cell(f64::NAN, 0.0, 0.1), None);
        assert_eq!(cell(0.0, 0.0, f64::NAN), None);
    }

    #[test]
    fn a_place_is_covered_after_a_while_and_once() {
        let mut coverage = Coverage::default();
        let cell = Cell::of([0.0, 0.0], 0.1).unwrap();
        assert!(!coverage.press(cell, 0.15));
        assert_eq!(coverage.picture(None)[3].chars().nth(17), Some('▒'));
        assert!(coverage.press(cell, 0.15));
        assert!(!coverage.press(cell, 0.15));
        assert_eq!(coverage.count(), [1, 71]);
        assert_eq!(coverage.picture(Some(cell))[3].chars().nth(17), Some('●'));
    }

    #[test]
    fn what_is_missing_is_named() {
        let none = Coverage::default();
        assert_eq!(none.advice().unwrap(), "press everywhere (20–70 mN)");
        let weak_only = all_but(|cell| cell.size > 0);
        let words = weak_only.missing().unwrap();
        assert_eq!(
            words,
            "missing: 70–140 mN everywhere, 140–250 mN everywhere"
        );
        assert_eq!(
            weak_only.advice().unwrap(),
            "press harder everywhere (70–140 mN)"
        );
        let corner = all_but(|cell| cell.size == 2 && cell.row > 2 && cell.column < 2);
        assert_eq!(
            corner.advice().unwrap(),
            "press harder at the lower left (140–250 mN)"
        );
        let weak = all_but(|cell| cell.size == 0 && cell.row == 2 && cell.column == 2);
        assert_eq!(
            weak.advice().unwrap(),
            "press more lightly in the middle (20–70 mN)"
        );
        let full = all_but(|_| false);
        assert!(full.is_complete() && full.advice().is_none() && full.missing().is_none());
        let but_corners = all_but(|cell| !cell.is_needed());
        assert!(but_corners.is_complete(), "hard presses in corners");
    }

    #[test]
    fn the_picture_shows_ranges_beside_each_other() {
        let corner = all_but(|cell| cell.size == 2 && cell.row > 2 && cell.column < 2);
        let picture = corner.picture(Cell::of([0.0, -4.0], 0.1)).join("\n");
        let expected = "\
20–70 mN     70–140 mN    140–250 mN
█ █ █ █ █    █ █ ● █ █    █ █ █ █ █
█ █ █ █ █    █ █ █ █ █    █ █ █ █ █
█ █ █ █ █    █ █ █ █ █    █ █ █ █ █
█ █ █ █ █    █ █ █ █ █    · · █ █ █
█ █ █ █ █    █ █ █ █ █      · █ █ █";
        assert_eq!(picture, expected);
    }

    proptest! {
        #[test]
        fn gaps_are_exactly_what_is_missing(
            presses in proptest::collection::vec((-5.0..5.0, -5.0..5.0, 0.0..0.3), 0..200)
        ) {
            let mut coverage = Coverage::default();
            for (x, y, force_n) in presses {
                if let Some(cell) = Cell::of([x, y], force_n) {
                    coverage.mark(cell);
                }
            }
            let [covered, all] = coverage.count();
            let missing: usize = coverage.gaps().iter().map(|gap| gap.cells).sum();
            prop_assert_eq!(covered + missing, all);
            prop_assert_eq!(coverage.is_complete(), coverage.advice().is_none());
        }
    }
}
