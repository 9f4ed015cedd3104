//! Direction of gravity on a sensor, in numbers and in words.

use hivtac_terms::down::{Direction, Down};

/// The direction of a vector of any length. The film's frame has x right and y down in the image,
/// and z away from the camera.
///
/// # Errors
/// When the vector is zero or not finite.
pub fn direction(vector: [f64; 3]) -> Result<Direction, String> {
    let largest = vector
        .iter()
        .fold(0.0_f64, |most, part| most.max(part.abs()));
    // Rejects NaN, too.
    if !(largest > 0.0 && vector.iter().all(|part| part.is_finite())) {
        let [x, y, z] = vector;
        return Err(format!(
            "({x}, {y}, {z}) has no direction: use a vector that points down, such as 0 0 -1"
        ));
    }
    let scaled = vector.map(|part| part / largest);
    let length = scaled.iter().map(|part| part * part).sum::<f64>().sqrt();
    Ok(Direction::of_unit(
        scaled.map(|part| (part / length) as f32),
    ))
}

/// Text for a person about the direction of gravity.
pub fn text(down: Down) -> String {
    match down {
        Down::Fixed => "fixed, as when the tare was taken".to_owned(),
        Down::Unknown => "none: it may be any, and uncertainties include that".to_owned(),
        Down::Told(direction) => {
            let [x, y, z] = direction.to_unit();
            format!("{x:.3} {y:.3} {z:.3}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_of_any_length_are_directions() {
        for vector in [[0.0, 0.6, -0.8], [0.0, 5.88, -7.84], [0.0, 6e-200, -8e-200]] {
            assert_eq!(direction(vector), Ok(Direction([0, 600, -800])));
        }
        for vector in [[0.0; 3], [f64::NAN, 0.0, 1.0], [f64::INFINITY, 0.0, 0.0]] {
            assert!(direction(vector).unwrap_err().contains("no direction"));
        }
    }

    #[test]
    fn it_is_reported_in_words() {
        assert_eq!(
            text(Down::Told(Direction([0, 600, -800]))),
            "0.000 0.600 -0.800"
        );
        assert!(text(Down::Fixed).contains("fixed") && text(Down::Unknown).contains("none"));
    }
}
