//! The motion of a small disc of the film.

/// The motion of the film around a marker: at (x, y) mm from the marker's centre it is `moved_mm +
/// along_x · x + along_y · y`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DiscMotion {
    /// Mean over the disc, mm, film frame. With its x and y the centroid of the disc's image is
    /// where the full solution has it: within 0.002 mm of the mean.
    pub moved_mm: [f64; 3],
    /// Slope along x, mm per mm.
    pub along_x: [f64; 3],
    /// Slope along y, mm per mm.
    pub along_y: [f64; 3],
}

impl DiscMotion {
    /// Returns the displacement of the film at (x, y) mm from the marker's centre.
    pub fn at(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        std::array::from_fn(|k| self.moved_mm[k] + self.along_x[k] * x + self.along_y[k] * y)
    }
}
