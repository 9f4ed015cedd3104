//! The fields of a marker in JSON.

use hivtac_terms::marker::Marker;
use serde::Serialize;

/// A marker: its number, its centroid and its pixels in the mask.
#[derive(Serialize)]
pub struct MarkerJson {
    /// Its number.
    pub id: usize,
    /// Its centroid, px to the right.
    pub x: f64,
    /// Its centroid, px down.
    pub y: f64,
    /// Its pixels in the mask.
    pub area: u32,
}

impl MarkerJson {
    /// The markers of a sample.
    pub fn all(markers: &[Marker]) -> Vec<MarkerJson> {
        let markers = markers.iter().enumerate();
        markers
            .map(|(id, marker)| MarkerJson {
                id,
                x: marker.x.to_f64(),
                y: marker.y.to_f64(),
                area: marker.area,
            })
            .collect()
    }
}
