//! The reference table, and how far the model is from it in `f32` and `f64`.

use hivtac_studies::paper_model::{
    Design, NormalPress, OutOfDomain, PinholeDistance, Real, disp_s_mm,
};

/// A row of `table.csv`. Fields that do not belong to a quantity are 0.
pub struct Row {
    pub quantity: &'static str,
    pub d_ph: Option<PinholeDistance>,
    pub pm: f64,
    pub epsilon: f64,
    pub d_ph_mm: f64,
    pub z: f64,
    pub shear: f64,
    /// `None` where Q has no maximum at a positive PM.
    pub value: Option<f64>,
}

/// All rows, in the order of the file.
pub fn rows() -> Vec<Row> {
    let lines = include_str!("table.csv").lines().skip(1);
    lines.map(row).collect()
}

fn row(line: &'static str) -> Row {
    let fields: Vec<&str> = line.split(',').collect();
    assert_eq!(fields.len(), 8, "{line}");
    let number = |index: usize| match fields[index] {
        "" => 0.0,
        text => text.parse().unwrap_or_else(|_| panic!("{line}")),
    };
    Row {
        quantity: fields[0],
        d_ph: reading(fields[1]),
        pm: number(2),
        epsilon: number(3),
        d_ph_mm: number(4),
        z: number(5),
        shear: number(6),
        value: (fields[7] != "none").then(|| number(7)),
    }
}

fn reading(name: &str) -> Option<PinholeDistance> {
    match name {
        "slant" => Some(PinholeDistance::Slant),
        "axial" => Some(PinholeDistance::Axial),
        "" => None,
        other => panic!("no D_ph reading is called {other}"),
    }
}

impl Row {
    /// The row's press, for eqs. 15–17.
    pub fn press<T: Real>(&self) -> NormalPress<T> {
        NormalPress {
            pm_mm: T::of(self.pm),
            z_mm: T::of(self.z),
            d_ph_mm: T::of(self.d_ph_mm),
            epsilon_mm: T::of(self.epsilon),
        }
    }

    /// What the model says in precision `T`.
    pub fn computed<T: Real>(&self) -> Result<Option<T>, OutOfDomain> {
        let focal = T::of(2.1);
        let [pm, z, shear] = [self.pm, self.z, self.shear].map(T::of);
        let design = || Design::<T>::paper(self.d_ph.expect("a reading of D_ph"));
        let value = match self.quantity {
            "r_m" => self.press().r_m_mm(focal)?,
            "r_m_pressed" => self.press().r_m_pressed_mm(focal)?,
            "disp_n" => self.press().disp_n_mm(focal)?,
            "disp_s" => disp_s_mm(pm, T::of(self.d_ph_mm), shear)?,
            "d_ph" => design().d_ph_mm(pm)?,
            "quality" => design().quality_mm(pm, z, shear)?,
            "best_r" => return design().best_r(z, shear),
            other => panic!("no function computes {other} row by row"),
        };
        Ok(Some(value))
    }

    /// How far the model is from the row in precision `T`: of R*, |Δ(R*²)|, otherwise the relative
    /// error. Infinite when one of the two is no maximum and the other is.
    pub fn error<T: Real>(&self) -> f64 {
        let computed = self.computed::<T>().unwrap_or_else(|why| panic!("{why}"));
        match (computed.map(T::to_f64), self.value) {
            (None, None) => 0.0,
            (Some(got), Some(want)) if self.quantity == "best_r" => (got * got - want * want).abs(),
            (Some(got), Some(want)) => relative_error(got, want),
            _ => f64::INFINITY,
        }
    }

    /// The relative error of the second line of eq. 17 in `f32`, taken as it stands.
    pub fn error_of_second_line(&self) -> f64 {
        let [pm, epsilon, d_ph, z] =
            [self.pm, self.epsilon, self.d_ph_mm, self.z].map(|value| value as f32);
        let angle = libm::atanf((pm + epsilon) / (d_ph - z)) - libm::atanf(pm / d_ph);
        relative_error(f64::from(2.1 * angle), self.value.expect("a disp_N"))
    }
}

/// |got / want − 1|, and 0 or infinite where `want` is 0.
pub fn relative_error(got: f64, want: f64) -> f64 {
    match (got == want, want == 0.0) {
        (true, _) => 0.0,
        (false, true) => f64::INFINITY,
        (false, false) => ((got - want) / want).abs(),
    }
}

/// Number of rows, and the largest error in `f64` and in `f32`, of one quantity.
pub fn largest_errors(rows: &[Row], quantity: &str) -> (usize, f64, f64) {
    let of_it: Vec<&Row> = rows.iter().filter(|row| row.quantity == quantity).collect();
    let largest = |error: fn(&Row) -> f64| of_it.iter().map(|row| error(row)).fold(0.0, f64::max);
    (
        of_it.len(),
        largest(Row::error::<f64>),
        largest(Row::error::<f32>),
    )
}

/// The largest relative error of R* itself in precision `T`, over the rows where it is at least
/// `at_least`: below, it rises from 0 as a square root does.
pub fn error_of_r<T: Real>(rows: &[Row], at_least: f64) -> f64 {
    let optima = rows.iter().filter(|row| row.quantity == "best_r");
    let errors = optima.filter_map(|row| {
        let want = row.value.filter(|r| *r >= at_least)?;
        let got = row.computed::<T>().ok().flatten().map_or(0.0, T::to_f64);
        Some(relative_error(got, want))
    });
    errors.fold(0.0, f64::max)
}
