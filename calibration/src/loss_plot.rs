//! The losses of a training as a picture, as they come.

use crate::plot::{Axis, COLOURS, Plot, Scale};
use crate::train::Progress;

/// Losses so far.
#[derive(Clone, Debug, Default)]
pub struct LossPlot {
    passes: Vec<Progress>,
}

impl LossPlot {
    /// Takes a finished pass.
    pub fn add(&mut self, progress: Progress) {
        self.passes.push(progress);
    }

    /// The picture: loss on training and held-out rows by pass, floats and rounded passes apart.
    pub fn to_svg(&self) -> String {
        let losses = self.passes.iter().flat_map(|p| [p.loss, p.held_out]);
        let epochs = self.passes.last().map_or(1, |p| p.epochs) as f64;
        let y = Axis::over("mean squared error, standardized", losses, Scale::Log);
        let x = Axis::over("pass over the data", [0.0, epochs], Scale::Linear);
        let mut plot = Plot::new("Training", x, y);
        let mut colours = COLOURS.into_iter();
        for (phase, rounded) in [("floats", false), ("rounded", true)] {
            for (rows, held_out) in [("training", false), ("held-out", true)] {
                let passes = self.passes.iter().filter(|p| p.rounded == rounded);
                let loss = |p: &Progress| if held_out { p.held_out } else { p.loss };
                let points: Vec<_> = passes.map(|p| (p.epoch as f64, loss(p))).collect();
                let colour = colours.next().unwrap_or("black");
                if points.iter().any(|(_, loss)| loss.is_finite()) {
                    plot.line(&points, colour);
                    plot.name(&format!("{phase}, {rows} rows"), colour);
                }
            }
        }
        plot.to_svg()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_there_is_is_drawn() {
        let mut plot = LossPlot::default();
        assert!(plot.to_svg().contains("</svg>"));
        for epoch in 1..=4 {
            let loss = 1.0 / epoch as f64;
            plot.add(Progress {
                epoch,
                epochs: 10,
                rounded: epoch > 2,
                loss,
                held_out: f64::NAN,
            });
        }
        let svg = plot.to_svg();
        assert_eq!(svg.matches("<polyline").count(), 2, "{svg}");
        assert!(svg.contains("rounded, training rows") && !svg.contains("held-out"));
    }
}
