//! Figure 8 as a picture.

use super::Map;

/// Width and height of the picture, px.
const SIZE: [usize; 2] = [640, 530];
/// The map's left and top edge and its side, px.
const LEFT: f64 = 80.0;
const TOP: f64 = 70.0;
const SIDE: f64 = 400.0;
const BOTTOM: f64 = TOP + SIDE;
/// The colour bar's left edge and width, px. It is as high as the map.
const BAR: [f64; 2] = [505.0, 22.0];
/// Steps of the colour scale, and the R* at its end.
const LEVELS: usize = 40;
const LARGEST_R: f64 = 0.4;
/// The mean that eq. 25 prints.
const PAPER_MEAN: f64 = 0.2655;
/// Where Q has no maximum at a positive PM.
const NONE_COLOUR: &str = "#d9d9d9";
/// Corners of the colour scale: dark blue over green to yellow, lighter throughout (after
/// matplotlib's viridis).
const SCALE: [[f64; 3]; 5] = [
    [68.0, 1.0, 84.0],
    [59.0, 82.0, 139.0],
    [33.0, 145.0, 140.0],
    [94.0, 201.0, 98.0],
    [253.0, 231.0, 37.0],
];

impl Map {
    /// This map as an SVG picture with axes and a colour bar; the same text on every machine.
    ///
    /// Colours are steps of 0.01 from R* = 0 to 0.4, larger R* having the last; grey is where Q has
    /// no maximum at a positive PM. The bar is marked with the mean over positive values and with
    /// what the paper prints for it.
    pub fn to_svg(&self, title: &str) -> String {
        let [width, height] = SIZE;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"Helvetica, Arial, sans-serif\" font-size=\"13\">\n\
             <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n"
        );
        svg += &text([LEFT, 26.0], "start", &escape(title));
        svg += &text([LEFT, 54.0], "start", "grey: Q is largest at the centre");
        svg += &self.cells_svg();
        svg += &self.axes_svg();
        svg += &bar_svg();
        svg += &self.means_svg();
        svg + "</svg>\n"
    }

    /// One path for each colour, in units of a cell with PP' upward.
    fn cells_svg(&self) -> String {
        let cell = SIDE / self.cells() as f64;
        let mut svg = format!(
            "<g shape-rendering=\"crispEdges\" transform=\"translate({LEFT} {BOTTOM}) scale({cell} \
             -{cell})\">\n"
        );
        for level in (0..LEVELS).map(Some).chain([None]) {
            let path = self.path(level);
            if !path.is_empty() {
                let fill = level.map_or(NONE_COLOUR.to_owned(), colour);
                svg += &format!("<path fill=\"{fill}\" d=\"{path}\"/>\n");
            }
        }
        svg + "</g>\n"
    }

    /// The cells of one colour, neighbours in a row as one rectangle.
    fn path(&self, level: Option<usize>) -> String {
        let mut path = String::new();
        for (y, row) in self.best_r().chunks_exact(self.cells()).enumerate() {
            let mut x = 0;
            for run in row.chunk_by(|a, b| a.map(level_of) == b.map(level_of)) {
                let length = run.len();
                if run[0].map(level_of) == level {
                    path += &format!("M{x} {y}h{length}v1h-{length}z");
                }
                x += length;
            }
        }
        path
    }

    fn axes_svg(&self) -> String {
        let mut svg = frame([LEFT, SIDE]);
        for (tick, label) in ticks(self.extent_mm()) {
            let (x, y) = (LEFT + tick * SIDE, BOTTOM - tick * SIDE);
            svg += &line([x, BOTTOM, x, BOTTOM + 5.0]);
            svg += &text([x, BOTTOM + 20.0], "middle", &label);
            svg += &line([LEFT - 5.0, y, LEFT, y]);
            svg += &text([LEFT - 9.0, y + 4.5], "end", &label);
        }
        let middle = [LEFT + SIDE / 2.0, BOTTOM + 44.0];
        svg += &text(middle, "middle", "normal: depth of the marker z_m′, mm");
        let (x, y) = (LEFT - 46.0, TOP + SIDE / 2.0);
        svg += &format!("<g transform=\"translate({x} {y}) rotate(-90)\">\n");
        svg += &text([0.0, 0.0], "middle", "shear: drag of the centre PP′, mm");
        svg + "</g>\n"
    }

    /// The means, beside the colour bar: the larger above its mark, the other below.
    fn means_svg(&self) -> String {
        let (mean, x) = (self.mean().positive, BAR[0] + BAR[1]);
        let mean_is_larger = mean > PAPER_MEAN;
        let mark = |value: f64, name: &str, larger: bool| {
            let y = scale_y(value);
            let label = format!("{name} {value:.4}");
            let below = if larger { -3.0 } else { 13.0 };
            line([x, y, x + 90.0, y]) + &text([x + 6.0, y + below], "start", &label)
        };
        mark(mean, "mean", mean_is_larger) + &mark(PAPER_MEAN, "eq. 25", !mean_is_larger)
    }
}

fn bar_svg() -> String {
    let [left, width] = BAR;
    let height = SIDE / LEVELS as f64;
    let mut svg = String::new();
    for level in 0..LEVELS {
        let (y, fill) = (BOTTOM - (level + 1) as f64 * height, colour(level));
        svg += &format!(
            "<rect x=\"{left}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"{fill}\" \
             shape-rendering=\"crispEdges\"/>\n"
        );
    }
    svg += &frame(BAR);
    for label in ["0", "0.1", "0.2", "0.3", "0.4"] {
        let y = scale_y(label.parse().expect("a number"));
        svg += &line([left + width, y, left + width + 5.0, y]);
        svg += &text([left + width + 9.0, y + 4.5], "start", label);
    }
    svg + &text([left, TOP - 16.0], "start", "R* = PM / PN")
}

/// Where an R* is on the colour bar, px from the top of the picture.
fn scale_y(r: f64) -> f64 {
    BOTTOM - (r / LARGEST_R).min(1.0) * SIDE
}

fn level_of(r: f64) -> usize {
    ((r / LARGEST_R * LEVELS as f64) as usize).min(LEVELS - 1)
}

fn colour(level: usize) -> String {
    let place = (level as f64 + 0.5) / LEVELS as f64 * (SCALE.len() - 1) as f64;
    let (corner, part) = (place as usize, place - place.floor());
    let [r, g, b] = [0, 1, 2].map(|channel| {
        let (from, to) = (SCALE[corner][channel], SCALE[corner + 1][channel]);
        (from + part * (to - from)).round() as u8
    });
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// Round values from 0 to `extent`, at most nine: where on the axis, 0 to 1, and its label.
fn ticks(extent: f64) -> Vec<(f64, String)> {
    let powers = -6..=6;
    let steps = powers.flat_map(|power| [1.0, 2.0, 5.0].map(|digit| (digit, power)));
    let Some((step, power)) = steps
        .map(|(digit, power)| (digit * libm::exp10(f64::from(power)), power))
        .find(|(step, _)| extent / step <= 8.0)
    else {
        return Vec::new();
    };
    let decimals = usize::try_from(-power).unwrap_or(0);
    let count = (extent / step + 1e-9) as usize;
    let label = |k: usize| format!("{:.decimals$}", k as f64 * step);
    (0..=count)
        .map(|k| (k as f64 * step / extent, label(k)))
        .collect()
}

/// The outline of something as high as the map, from its left edge and width.
fn frame([left, width]: [f64; 2]) -> String {
    format!(
        "<rect x=\"{left}\" y=\"{TOP}\" width=\"{width}\" height=\"{SIDE}\" fill=\"none\" \
         stroke=\"#333333\"/>\n"
    )
}

fn line([x1, y1, x2, y2]: [f64; 4]) -> String {
    format!("<path d=\"M{x1:.2} {y1:.2}L{x2:.2} {y2:.2}\" stroke=\"#333333\"/>\n")
}

fn text([x, y]: [f64; 2], anchor: &str, content: &str) -> String {
    format!("<text x=\"{x:.2}\" y=\"{y:.2}\" text-anchor=\"{anchor}\">{content}</text>\n")
}

fn escape(content: &str) -> String {
    content.replace('&', "&amp;").replace('<', "&lt;")
}

#[cfg(test)]
mod tests {
    use super::super::{Design, PinholeDistance};
    use super::*;

    fn map(cells: usize) -> Map {
        Map::new(&Design::paper(PinholeDistance::Slant), cells).unwrap()
    }

    /// Cells that the paths of `svg` cover: the sum of the lengths of their rectangles.
    fn covered(svg: &str) -> usize {
        svg.lines()
            .filter(|line| line.contains("h-"))
            .flat_map(|line| line.split("h-").skip(1))
            .map(|rest| rest[..rest.find('z').unwrap()].parse::<usize>().unwrap())
            .sum()
    }

    #[test]
    fn every_cell_is_painted_once() {
        for cells in [1, 7, 50] {
            assert_eq!(covered(&map(cells).to_svg("t")), cells * cells);
        }
    }

    #[test]
    fn grey_is_where_there_is_no_maximum() {
        let map = map(50);
        let grey = map.best_r().iter().filter(|r| r.is_none()).count();
        assert!(grey > 0);
        let path = format!("<path d=\"{}\"", map.path(None));
        assert_eq!(covered(&path), grey);
    }

    #[test]
    fn the_scale_ends_in_its_corners() {
        assert_eq!(
            [0.0, 0.005, 0.015, 0.4, 0.9].map(level_of),
            [0, 0, 1, 39, 39]
        );
        assert_eq!(colour(0), "#440557");
        assert_eq!(colour(LEVELS - 1), "#f5e628");
    }

    #[test]
    fn ticks_are_round() {
        let labels = |extent| ticks(extent).into_iter().map(|(_, label)| label);
        assert!(labels(7.0).eq(["0", "1", "2", "3", "4", "5", "6", "7"]));
        assert!(labels(0.5).eq(["0.0", "0.1", "0.2", "0.3", "0.4", "0.5"]));
        assert!(labels(30.0).eq(["0", "5", "10", "15", "20", "25", "30"]));
        assert_eq!(ticks(7.0)[7].0, 1.0);
    }

    #[test]
    fn a_title_is_text() {
        assert!(map(1).to_svg("a < b & c").contains(">a &lt; b &amp; c<"));
    }
}
