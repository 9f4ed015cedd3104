//! Draws plots as SVG: axes with numbers, lines and points. All text from outside passes through
//! [`escaped`].

use std::fmt::Write;

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 400.0;
/// Left, right, top, bottom; px.
const MARGIN: [f64; 4] = [70.0, 16.0, 34.0, 48.0];
/// Colours that colour-blind readers can distinguish (Okabe and Ito 2008).
pub const COLOURS: [&str; 6] = [
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9",
];

/// One axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// The quantity, with its unit.
    pub label: String,
    /// Its ends.
    pub range: [f64; 2],
}

impl Axis {
    /// An axis over all of `values`, with a least width.
    pub fn over(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let (low, high) = values
            .into_iter()
            .filter(|v| v.is_finite())
            .fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
        let range = match low < high {
            true => [low, high],
            false if low > high => [0.1, 1.0],
            false => [low - 0.5, high + 0.5],
        };
        Self {
            label: label.into(),
            range,
        }
    }

    /// Position of a number between the ends, 0 to 1; `None` outside.
    fn place(&self, value: f64) -> Option<f64> {
        let [low, high] = self.range;
        let part = (value - low) / (high - low);
        (part.is_finite() && (-1e-9..=1.0 + 1e-9).contains(&part)).then_some(part)
    }

    /// Numbers to write along the axis.
    fn ticks(&self) -> Vec<f64> {
        let [low, high] = self.range;
        let step = nice_step((high - low) / 6.0);
        let first = (low / step - 1e-9).ceil() as i64;
        let last = (high / step + 1e-9).floor() as i64;
        (first..=last).map(|i| i as f64 * step).collect()
    }
}

/// 1, 2 or 5 times a power of ten, at least `step`.
fn nice_step(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    let factor = [1.0, 2.0, 5.0]
        .into_iter()
        .find(|f| f * power >= step * (1.0 - 1e-9));
    factor.unwrap_or(10.0) * power
}

/// A plot under construction.
pub struct Plot {
    x: Axis,
    y: Axis,
    title: String,
    body: String,
    legend: Vec<(String, &'static str)>,
}

impl Plot {
    /// An empty plot.
    pub fn new(title: &str, x: Axis, y: Axis) -> Self {
        Self {
            x,
            y,
            title: title.into(),
            body: String::new(),
            legend: Vec::new(),
        }
    }

    fn at(&self, x: f64, y: f64) -> Option<(f64, f64)> {
        let [left, right, top, bottom] = MARGIN;
        let (x, y) = (self.x.place(x)?, self.y.place(y)?);
        Some((
            left + x * (WIDTH - left - right),
            HEIGHT - bottom - y * (HEIGHT - top - bottom),
        ))
    }

    /// Adds a colour to the legend.
    pub fn name(&mut self, name: &str, colour: &'static str) {
        self.legend.push((name.into(), colour));
    }

    /// A line through points; points outside the axes interrupt it.
    pub fn line(&mut self, points: &[(f64, f64)], colour: &str) {
        let placed: Vec<_> = points.iter().map(|&(x, y)| self.at(x, y)).collect();
        for part in placed.split(Option::is_none).filter(|part| part.len() > 1) {
            let mut path = String::new();
            for (x, y) in part.iter().flatten() {
                let _ = write!(path, "{x:.1},{y:.1} ");
            }
            let _ = writeln!(
                self.body,
                r#"<polyline points="{}" fill="none" stroke="{colour}" stroke-width="1.5"/>"#,
                path.trim_end()
            );
        }
    }

    /// Points of a radius in px.
    pub fn points(&mut self, points: &[(f64, f64)], radius: f64, colour: &str) {
        let _ = writeln!(self.body, r#"<g fill="{colour}" fill-opacity="0.5">"#);
        let placed: Vec<_> = points.iter().filter_map(|&(x, y)| self.at(x, y)).collect();
        for (x, y) in placed {
            let _ = writeln!(
                self.body,
                r#"<circle cx="{x:.1}" cy="{y:.1}" r="{radius}"/>"#
            );
        }
        self.body.push_str("</g>\n");
    }

    /// A filled rectangle between two corners, clipped at the axes' ends.
    pub fn rectangle(&mut self, from: (f64, f64), to: (f64, f64), colour: &str, hint: &str) {
        let cut = |axis: &Axis, v: f64| v.clamp(axis.range[0], axis.range[1]);
        let corner = |p: (f64, f64)| self.at(cut(&self.x, p.0), cut(&self.y, p.1));
        let (Some((x0, y0)), Some((x1, y1))) = (corner(from), corner(to)) else {
            return;
        };
        let _ = writeln!(
            self.body,
            r#"<rect x="{:.1}" y="{:.1}" width="{:.1}" height="{:.1}" fill="{colour}"><title>{}</title></rect>"#,
            x0.min(x1),
            y0.min(y1),
            (x1 - x0).abs(),
            (y1 - y0).abs(),
            escaped(hint)
        );
    }

    /// The finished picture.
    pub fn to_svg(&self) -> String {
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
             width=\"{WIDTH}\" height=\"{HEIGHT}\" font-family=\"sans-serif\" font-size=\"12\">\n\
             <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>\n"
        );
        self.frame(&mut svg);
        svg.push_str(&self.body);
        let [left, ..] = MARGIN;
        for (i, (name, colour)) in self.legend.iter().enumerate() {
            let y = MARGIN[2] + 16.0 + 16.0 * i as f64;
            let x = WIDTH - MARGIN[1] - 190.0;
            let _ = writeln!(
                svg,
                r#"<rect x="{x}" y="{:.1}" width="10" height="10" fill="{colour}"/><text x="{:.1}" y="{y:.1}">{}</text>"#,
                y - 9.0,
                x + 15.0,
                escaped(name)
            );
        }
        let _ = writeln!(
            svg,
            r#"<text x="{left}" y="20" font-size="14">{}</text></svg>"#,
            escaped(&self.title)
        );
        svg
    }

    fn frame(&self, svg: &mut String) {
        let [left, right, top, bottom] = MARGIN;
        let (end, floor) = (WIDTH - right, HEIGHT - bottom);
        for tick in self.x.ticks() {
            if let Some((x, _)) = self.at(tick, self.y.range[0]) {
                let _ = writeln!(
                    svg,
                    r##"<path d="M{x:.1} {top}V{floor}" stroke="#ddd"/><text x="{x:.1}" y="{}" text-anchor="middle">{}</text>"##,
                    floor + 16.0,
                    number(tick)
                );
            }
        }
        for tick in self.y.ticks() {
            if let Some((_, y)) = self.at(self.x.range[0], tick) {
                let _ = writeln!(
                    svg,
                    r##"<path d="M{left} {y:.1}H{end}" stroke="#ddd"/><text x="{}" y="{:.1}" text-anchor="end">{}</text>"##,
                    left - 6.0,
                    y + 4.0,
                    number(tick)
                );
            }
        }
        let middle = (top + floor) / 2.0;
        let _ = writeln!(
            svg,
            "<path d=\"M{left} {top}V{floor}H{end}\" stroke=\"black\" fill=\"none\"/>\n\
             <text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n\
             <text x=\"16\" y=\"{middle}\" text-anchor=\"middle\" transform=\"rotate(-90 16 \
             {middle})\">{}</text>",
            (left + end) / 2.0,
            HEIGHT - 10.0,
            escaped(&self.x.label),
            escaped(&self.y.label)
        );
    }
}

fn number(value: f64) -> String {
    let rounded = (value * 1e9).round() / 1e9;
    if rounded != 0.0 && (rounded.abs() < 1e-3 || rounded.abs() >= 1e5) {
        format!("{value:.0e}")
    } else {
        format!("{rounded}")
    }
}

/// Text with the special characters of SVG and HTML escaped.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot() -> Plot {
        Plot::new(
            "a < b",
            Axis::over("x", [0.0, 10.0]),
            Axis::over("y & z", [0.02, 3.0]),
        )
    }

    #[test]
    fn axes_hold_their_values() {
        assert_eq!(Axis::over("", [0.02, f64::NAN, 3.0]).range, [0.02, 3.0]);
        assert_eq!(Axis::over("", [-0.1, 0.1]).ticks().len(), 5);
        assert_eq!(Axis::over("", [5.0]).range, [4.5, 5.5]);
        assert_eq!(Axis::over("", []).range, [0.1, 1.0]);
    }

    #[test]
    fn lines_stop_at_what_has_no_place() {
        let mut plot = plot();
        plot.line(
            &[(0.0, 1.0), (1.0, 1.0), (2.0, 0.0), (3.0, 1.0), (4.0, 2.0)],
            COLOURS[0],
        );
        assert_eq!(plot.to_svg().matches("<polyline").count(), 2);
    }

    #[test]
    fn text_is_escaped() {
        let mut plot = plot();
        plot.name("<script>", COLOURS[1]);
        let svg = plot.to_svg();
        assert!(svg.contains("a &lt; b") && svg.contains("y &amp; z") && !svg.contains("<script>"));
    }
}
