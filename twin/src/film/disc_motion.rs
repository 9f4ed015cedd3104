//! How a small disc of the film moves.

/// How the film around a marker moves: by `moved_mm + along_x · x + along_y · y` at (x, y) mm from
/// its centre.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DiscMotion {
    /// Mean over the disc, mm, film frame. Its x and y put the centroid of the disc's image where
    /// the full solution has it: within 0.002 mm of the mean.
    pub moved_mm: [f64; 3],
    /// Slope along x, mm per mm.
    pub along_x: [f64; 3],
    /// Slope along y, mm per mm.
    pub along_y: [f64; 3],
}

impl DiscMotion {
    /// The displacement of the film at (x, y) mm from the marker's centre.
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        std::array::from_fn(|k| self.moved_mm[k] + self.along_x[k] * x + self.along_y[k] * y)
    }
}
