//! A load that was put on, and what is known of it.

/// Unknowns of a load: its force along and across what is told (3), its place (2).
pub const UNKNOWNS: usize = 5;

/// A load that was put on, what is known of its force and place, and what was seen of it.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownLoad {
    /// The force as it is told, N; F_z < 0.
    pub force_n: [f64; 3],
    /// Standard uncertainty of its size, N, > 0.
    pub size_n: f64,
    /// Standard uncertainty of its direction, on each of the two axes across it, rad, > 0.
    pub direction_rad: f64,
    /// Where it is told that the tip touches the film, mm.
    pub place_mm: [f64; 2],
    /// Standard uncertainty of each coordinate of the place, mm, > 0.
    pub each_place_mm: f64,
    /// Where markers were seen, mean of some frames, px.
    pub seen_px: Vec<[f64; 2]>,
    /// Standard uncertainty of each of these coordinates, px, > 0.
    pub noise_px: f64,
}

/// A force, N, and a place, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressed {
    pub force_n: [f64; 3],
    pub place_mm: [f64; 2],
}

impl KnownLoad {
    /// The force and the place so many standard uncertainties beside what is told.
    pub fn at(&self, parts: &[f64; UNKNOWNS]) -> Pressed {
        let directions = self.directions();
        let mut force_n = self.force_n;
        for (direction, part) in directions.iter().zip(parts) {
            for (sum, along) in force_n.iter_mut().zip(direction) {
                *sum += part * along;
            }
        }
        Pressed {
            force_n,
            place_mm: [0, 1].map(|i| self.place_mm[i] + self.each_place_mm * parts[3 + i]),
        }
    }

    /// What a standard uncertainty of each of the force's unknowns adds to it, N.
    pub fn directions(&self) -> [[f64; 3]; 3] {
        let [x, y, z] = self.force_n;
        let size = (x * x + y * y + z * z).sqrt();
        let along = [x / size, y / size, z / size];
        // Two unit vectors across a force that is not along x.
        let side = along[1].hypot(along[2]);
        let first = [0.0, -along[2] / side, along[1] / side];
        let second = [
            side,
            -along[0] * along[1] / side,
            -along[0] * along[2] / side,
        ];
        let turn = size * self.direction_rad;
        [
            along.map(|part| self.size_n * part),
            first.map(|part| turn * part),
            second.map(|part| turn * part),
        ]
    }
}
