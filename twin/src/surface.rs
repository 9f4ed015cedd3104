//! The surface of the film that carries the markers.

use crate::film::DiscMotion;
use crate::film::Pressed;

/// A surface of the film. Where the film tilts, the two surfaces are shifted sideways from each
/// other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "file", derive(serde::Deserialize))]
#[cfg_attr(feature = "file", serde(rename_all = "kebab-case"))]
pub enum Surface {
    /// The one that the camera sees.
    #[default]
    CameraSide,
    /// The middle one: the only surface of a film without thickness.
    Middle,
}

/// Half the film's thickness, mm.
const HALF_THICKNESS_MM: f64 = 0.25;

impl Surface {
    /// Returns the motion of this surface, from that of the camera's side.
    pub(crate) fn of(self, pressed: Pressed) -> Pressed {
        match self {
            Surface::CameraSide => pressed,
            Surface::Middle => Pressed {
                discs: pressed.discs.map(middle),
                ..pressed
            },
        }
    }
}

/// Returns the middle surface's motion above a marker: half the thickness along the normal from the
/// camera's side.
fn middle(disc: DiscMotion) -> DiscMotion {
    let (x, y) = (disc.along_x[2], disc.along_y[2]);
    let length = (1.0 + x * x + y * y).sqrt();
    let turned = [-x / length, -y / length, 1.0 / length - 1.0];
    DiscMotion {
        moved_mm: std::array::from_fn(|i| disc.moved_mm[i] + HALF_THICKNESS_MM * turned[i]),
        ..disc
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Load;
    use crate::film::Film;

    #[test]
    fn the_middle_surface_is_half_the_thickness_away() {
        let film = Film::default();
        let apart = |force_n| {
            let pressed = film.press(&Load::from_angles(force_n, 0.0, 0.0).unwrap());
            let [a, b] = [Surface::CameraSide, Surface::Middle]
                .map(|surface| surface.of(pressed).discs[1].moved_mm);
            [b[0] - a[0], b[1] - a[1], b[2] - a[2]]
        };
        assert_eq!(apart(0.0), [0.0; 3], "nothing tilts at rest");
        // Marker 1 is on the right and at the top. The film rises outwards there, and its normal
        // leans towards the middle.
        let [x, y, z] = apart(0.2);
        assert!(x < -0.05 && y > 0.05, "{x} {y}");
        let length = (x * x + y * y + (z + 0.25) * (z + 0.25)).sqrt();
        assert!((length - 0.25).abs() < 1e-12);
    }
}
