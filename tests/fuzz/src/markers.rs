//! Markers and rest positions for attacks, with values that frames may show.

use arbitrary::{Result, Unstructured};
use hivtac_sensor::force::rest::Rest;
use hivtac_terms::marker::Marker;
use hivtac_terms::units::Px;

/// The longest side of a frame, px.
const SIDE: i32 = 800;

/// Returns four markers anywhere on the largest frame.
pub fn anywhere(input: &mut Unstructured<'_>) -> Result<[Marker; 4]> {
    let mut markers = [Marker {
        x: Px(0),
        y: Px(0),
        area: 1,
    }; 4];
    for marker in &mut markers {
        let mut coordinate = || {
            input
                .int_in_range(0..=(SIDE << Px::FRACTION_BITS) - 1)
                .map(Px)
        };
        (marker.x, marker.y) = (coordinate()?, coordinate()?);
        marker.area = input.int_in_range(1..=(SIDE * SIDE) as u32)?;
    }
    Ok(markers)
}

/// Returns four markers near those of a rest position.
pub fn near(rest: &Rest, input: &mut Unstructured<'_>) -> Result<[Marker; 4]> {
    let mut markers = rest.markers().array();
    for marker in &mut markers {
        for Px(coordinate) in [&mut marker.x, &mut marker.y] {
            // The shift is up to eight pixels.
            let moved = *coordinate + 16 * i32::from(input.arbitrary::<i16>()?);
            *coordinate = moved.clamp(0, (SIDE << Px::FRACTION_BITS) - 1);
        }
        marker.area = marker.area.saturating_add(input.arbitrary::<u8>()?.into());
    }
    Ok(markers)
}
