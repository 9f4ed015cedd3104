//! The numbers in which units differ, and their priors before any load.

use hivtac_shell::{Change, Design};
use hivtac_twin::units::{FOCAL, MARKER_MM, MIDDLE_PX, POST_MM, ROLL_DEG};

use super::own_film::{FoundNumber, OwnFilm};
use super::problem::Bench;

/// Standard deviations of the pixel grid's effect on a marker at rest, px, and of the camera's
/// distance from the film beyond the nominal one, mm.
const REST_PX: f64 = 0.006;
const DISTANCE_MM: f64 = 0.1;

/// Standard deviation of gravity along the film, g, of a unit that may be held in any orientation.
const SIDEWAYS: f64 = 0.6;
/// Standard deviation of each component of a known direction of gravity, g: a degree.
const DOWN: f64 = 0.02;

/// The overhang over which its effect on the film falls by a factor of e, mm.
const OVERHANG_MM: f64 = 2.0;

/// A number of a unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Number {
    /// Of the film: ln of Young's modulus, thickness and grip over the nominal ones;
    /// exp(−mm/[`OVERHANG_MM`]) of an overhang; all others in the unit of the change.
    Film(Change),
    /// Distance of a marker from its nominal place along x or y, mm.
    Marker(usize, usize),
    /// Effect of the pixel grid on a marker at rest along x or y, px.
    Rest(usize, usize),
    /// The camera's roll, x towards y, degrees.
    Roll,
    /// ln of the focal length over the nominal one.
    Focal,
    /// Distance of the camera from the film beyond the nominal one, mm.
    Distance,
    /// Where the camera's axis meets the picture, minus the nominal point, px.
    Middle(usize),
    /// The stage's zero on the film along x or y, mm.
    Stage(usize),
}

/// A number with its mean and its standard deviation among units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    pub number: Number,
    pub mean: f64,
    pub sigma: f64,
    /// Least and largest value.
    pub range: [f64; 2],
}

impl Number {
    /// Whether it stays the same when the unit gets another film.
    fn stays(self) -> bool {
        use Number::{Film, Focal, Middle, Roll};
        matches!(
            self,
            Roll | Focal | Middle(_) | Film(Change::Post(..) | Change::PostRadius | Change::Grip)
        )
    }

    /// Its name, with its unit.
    pub fn name(self) -> String {
        let along = |axis: usize| ["x", "y", "z"][axis];
        match self {
            Number::Film(change) => match change {
                Change::Force(_) | Change::Place(_) => "load".into(),
                Change::Youngs => "film's Young's modulus, ln".into(),
                Change::Thickness => "film's thickness, ln".into(),
                Change::Grip => "posts' grip, ln".into(),
                Change::TipRadius => "tip's radius, mm".into(),
                Change::Post(post, axis) => format!("post {post}, {}, mm", along(axis)),
                Change::Stretch(axis) => format!("film's stretch along {}", along(axis)),
                Change::NeoHooke => "part of neo-Hooke's law".into(),
                Change::Stiffening => "stiffening, C2/C1".into(),
                Change::ThicknessSlope(axis) => format!("thickness's slope along {}", along(axis)),
                Change::ThicknessCurve(k) => format!("thickness's curve {}", ["xx", "xy", "yy"][k]),
                Change::DotStiffening => "dots' stiffness in parts of the film's".into(),
                Change::Down(axis) => format!("gravity along {}, g", along(axis)),
                Change::PostRadius => "posts' radius, mm".into(),
                Change::Overhang => "overhang, exp(-mm/2)".into(),
            },
            Number::Marker(k, axis) => format!("marker {k}, {}, mm", along(axis)),
            Number::Rest(k, axis) => format!("pixel grid at rest, marker {k}, {}, px", along(axis)),
            Number::Roll => "camera's roll, °".into(),
            Number::Focal => "focal length, ln".into(),
            Number::Distance => "camera's distance beyond the nominal one, mm".into(),
            Number::Middle(axis) => format!("optical axis, {}, px", along(axis)),
            Number::Stage(axis) => format!("stage's zero, {}, mm", along(axis)),
        }
    }
}

impl Prior {
    /// With a range of four standard deviations.
    fn about(number: Number, mean: f64, sigma: f64) -> Prior {
        Prior {
            number,
            mean,
            sigma,
            range: [mean - 4.0 * sigma, mean + 4.0 * sigma],
        }
    }

    /// The same with mean 0.
    pub fn about_zero(number: Number, sigma: f64) -> Prior {
        Prior::about(number, 0.0, sigma)
    }

    /// Takes the value and uncertainty that an earlier fit found as the prior.
    fn narrow(&mut self, known: &OwnFilm) {
        let name = self.number.name();
        let found = known.numbers.iter().find(|found| found.name == name);
        if let Some(FoundNumber { value, sigma, .. }) = found {
            let [least, largest] = self.range;
            self.mean = value.clamp(least, largest);
            self.sigma = sigma.clamp(1e-3 * self.sigma, self.sigma);
        }
    }

    /// Limits a value, in standard deviations from the mean, to the range.
    pub fn within(&self, part: f64) -> f64 {
        let [least, largest] = self.range.map(|end| (end - self.mean) / self.sigma);
        part.clamp(least, largest)
    }

    /// The value at `part` standard deviations from the mean, within the range.
    pub fn value(&self, part: f64) -> f64 {
        let [least, largest] = self.range;
        (self.mean + self.sigma * part).clamp(least, largest)
    }
}

/// A film's numbers: mean, standard deviation, least and largest value.
const FILM: [(Change, [f64; 4]); 17] = [
    (Change::Youngs, [0.0, 0.3, -1.2, 1.2]),
    (Change::Thickness, [0.0, 0.1, -0.35, 0.35]),
    (Change::Stretch(0), [0.01, 0.01, -0.006, 0.045]),
    (Change::Stretch(1), [0.01, 0.01, -0.006, 0.045]),
    (Change::Overhang, [0.45, 0.4, 0.014, 1.0]),
    (Change::PostRadius, [1.8, 0.5, 0.9, 3.2]),
    (Change::Grip, [0.0, 0.7, -2.0, 2.0]),
    (Change::NeoHooke, [0.5, 0.4, 0.0, 1.0]),
    (Change::Stiffening, [0.05, 0.08, 0.0, 0.4]),
    (Change::ThicknessSlope(0), [0.0, 0.04, -0.15, 0.15]),
    (Change::ThicknessSlope(1), [0.0, 0.04, -0.15, 0.15]),
    (Change::ThicknessCurve(0), [0.0, 0.02, -0.08, 0.08]),
    (Change::ThicknessCurve(1), [0.0, 0.02, -0.08, 0.08]),
    (Change::ThicknessCurve(2), [0.0, 0.02, -0.08, 0.08]),
    (Change::DotStiffening, [0.4, 0.4, 0.0, 2.5]),
    (Change::TipRadius, [0.5, 0.25, 0.25, 2.0]),
    (Change::Down(2), [0.0, 0.6, -1.2, 1.2]),
];

/// Prior knowledge of how a film is made and mounted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Like the simulated sensor's: even, weightless, without stretch, cut at its holes.
    Nominal,
    /// As people make and mount them.
    Real,
}

impl Family {
    /// Whether its films differ in this change.
    fn differs_in(self, change: Change) -> bool {
        use Change::{Grip, Thickness, TipRadius, Youngs};
        match self {
            Family::Nominal => matches!(change, Youngs | Thickness | Grip | TipRadius),
            Family::Real => true,
        }
    }
}

/// The priors of a unit's numbers. `stage_mm` is the standard uncertainty of the stage's zero. With
/// `from`, the fit of the unit's old film, its camera and posts are known from there.
pub fn priors(family: Family, bench: &Bench, stage_mm: f64, from: Option<&OwnFilm>) -> Vec<Prior> {
    let film = FILM.iter();
    let film = film.filter(|(change, _)| family.differs_in(*change));
    let film = film.map(|(change, [mean, sigma, least, largest])| Prior {
        number: Number::Film(*change),
        mean: *mean,
        sigma: *sigma,
        range: [*least, *largest],
    });
    let mut all: Vec<Prior> = film.collect();
    let mut add = |number, sigma| all.push(Prior::about_zero(number, sigma));
    for axis in [0, 1] {
        if family == Family::Real {
            add(Number::Film(Change::Down(axis)), SIDEWAYS);
        }
        add(Number::Middle(axis), MIDDLE_PX);
        add(Number::Stage(axis), stage_mm);
        for post in 0..4 {
            add(Number::Film(Change::Post(post, axis)), POST_MM);
        }
        for dot in 0..bench.dots_mm.len() {
            add(Number::Marker(dot, axis), MARKER_MM);
            add(Number::Rest(dot, axis), REST_PX);
        }
    }
    add(Number::Roll, ROLL_DEG);
    add(Number::Focal, FOCAL);
    add(Number::Distance, DISTANCE_MM);
    if let Some(down) = bench.down {
        all.retain(|prior| !matches!(prior.number, Number::Film(Change::Down(_))));
        all.extend(
            (0..3).map(|axis| Prior::about(Number::Film(Change::Down(axis)), down[axis], DOWN)),
        );
    }
    for prior in &mut all {
        if let Some(known) = from.filter(|_| prior.number.stays()) {
            prior.narrow(known);
        }
    }
    all
}

/// Sets a number of the film.
pub fn set(design: &mut Design, change: Change, value: f64) {
    let nominal = Design::default();
    match change {
        Change::Force(_) | Change::Place(_) => {}
        Change::Youngs => {
            design.material.youngs_mpa = nominal.material.youngs_mpa * libm::exp(value)
        }
        Change::Thickness => {
            design.material.thickness_mm = nominal.material.thickness_mm * libm::exp(value);
        }
        Change::Grip => design.post_grip_n_per_mm3 = nominal.post_grip_n_per_mm3 * libm::exp(value),
        Change::Post(post, axis) => design.post_shift_mm[post][axis] = value,
        Change::TipRadius => design.tip_radius_mm = value,
        Change::Stretch(axis) => design.stretch[axis] = value,
        Change::NeoHooke => design.law.neo_hooke = value,
        Change::Stiffening => design.law.stiffening = value,
        Change::ThicknessSlope(axis) => design.thickness_slope[axis] = value,
        Change::ThicknessCurve(k) => design.thickness_curve[k] = value,
        Change::DotStiffening => design.dot_stiffening = value,
        Change::Down(axis) => design.down[axis] = value,
        Change::PostRadius => design.post_radius_mm = value,
        Change::Overhang => design.overhang_mm = -OVERHANG_MM * libm::log(value),
    }
}

/// Derivative of a change by its number.
pub fn per_number(design: &Design, change: Change) -> f64 {
    match change {
        Change::Thickness => design.material.thickness_mm,
        Change::Overhang => -OVERHANG_MM * libm::exp(design.overhang_mm / OVERHANG_MM),
        _ => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_overhang_is_what_its_number_says() {
        const STEP: f64 = 1e-6;
        let mut design = Design::default();
        let mut overhang_mm = |value: f64| {
            set(&mut design, Change::Overhang, value);
            (design.overhang_mm, per_number(&design, Change::Overhang))
        };
        assert_eq!(overhang_mm(1.0).0, 0.0);
        let ((here, rate), (there, _)) = (overhang_mm(0.3), overhang_mm(0.3 + STEP));
        assert!((here - 2.408).abs() < 1e-3, "{here}");
        assert!(((there - here) / STEP - rate).abs() < 1e-4, "{rate}");
    }
}
