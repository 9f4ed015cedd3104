//! R* over the plane of presses and shears: Figure 8 and eq. 25.

use super::{Design, OutOfDomain};

/// The mean of R*(z_m', PP') over a map (eq. 25), in the readings that the paper leaves open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanBestR {
    /// Over the part of the map where Q has a maximum at a positive PM: the paper's "real positive
    /// values". 0 when there is no such part.
    pub positive: f64,
    /// Over the whole map, with 0 where there is no such maximum.
    pub with_zeros: f64,
    /// The part of the map where there is one, 0 to 1.
    pub positive_share: f64,
}

/// R* in the middles of equal cells over z_m', PP' ∈ [0, a/2]: the data of Figure 8.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    extent_mm: f64,
    cells: usize,
    best_r: Vec<Option<f64>>,
}

impl Map {
    /// The map of a design with `cells` × `cells` cells, 1 to 4096 along each axis.
    ///
    /// # Errors
    /// When `cells` is outside its range or a measure of the design is outside its domain; when a/2
    /// reaches to the pinhole.
    pub fn new(design: &Design<f64>, cells: usize) -> Result<Map, OutOfDomain> {
        if !(1..=4096).contains(&cells) {
            return Err(OutOfDomain {
                quantity: "the number of cells",
                value: cells as f64,
                domain: "1 to 4096".to_owned(),
            });
        }
        let mut map = Map {
            extent_mm: design.half_side_mm / 2.0,
            cells,
            best_r: Vec::with_capacity(cells * cells),
        };
        for number in 0..cells * cells {
            let (z, shear) = (map.middle_mm(number % cells), map.middle_mm(number / cells));
            map.best_r.push(design.best_r(z, shear)?);
        }
        Ok(map)
    }

    /// The end of both axes, a/2, mm.
    pub fn extent_mm(&self) -> f64 {
        self.extent_mm
    }

    /// Cells along each axis.
    pub fn cells(&self) -> usize {
        self.cells
    }

    /// R* of each cell, `None` where Q has no maximum at a positive PM. Cell (i, j), at
    /// [`middle_mm`](Self::middle_mm) i along z_m' and j along PP', is number j·cells + i.
    pub fn best_r(&self) -> &[Option<f64>] {
        &self.best_r
    }

    /// The middle of cell `index` along either axis, mm.
    pub fn middle_mm(&self, index: usize) -> f64 {
        (index as f64 + 0.5) / self.cells as f64 * self.extent_mm
    }

    /// The mean of R* over this map, each cell standing for its area.
    pub fn mean(&self) -> MeanBestR {
        let sum: f64 = self.best_r.iter().flatten().sum();
        let positive = self.best_r.iter().flatten().count() as f64;
        let all = self.best_r.len() as f64;
        MeanBestR {
            positive: if positive > 0.0 { sum / positive } else { 0.0 },
            with_zeros: sum / all,
            positive_share: positive / all,
        }
    }
}

impl Design<f64> {
    /// Eq. 25: the mean of R*(z_m', PP') over z_m', PP' ∈ [0, a/2], by `cells` × `cells` cells.
    ///
    /// 700 cells are within 2e-5 of the integral.
    ///
    /// # Where the paper is ambiguous
    /// The paper prints 0.2655. For its design the integral is
    ///
    /// | D_ph | over positive values | with zeros | positive |
    /// |---|---|---|---|
    /// | slant (eq. 23) | 0.2609 | 0.2548 | 97.6 % |
    /// | axial | 0.3546 | 0.3462 | 97.6 % |
    ///
    /// The first is what the paper describes; a marker there is 0.09 mm nearer to the centre than
    /// at 0.2655. No reading that was tried gives 0.2655: `docs/paper-model.md` has the list.
    ///
    /// # Errors
    /// As [`Map::new`].
    pub fn mean_best_r(&self, cells: usize) -> Result<MeanBestR, OutOfDomain> {
        Ok(Map::new(self, cells)?.mean())
    }
}
