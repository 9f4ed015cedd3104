//! Shape of what presses the film, as a word and in words.

use hivtac_terms::contact_shape::ContactShape;
use hivtac_terms::units::Micrometres;

/// Reads `needle`, `round:R`, `flat:R` or `unknown`, with a radius R in mm. It is rounded to
/// micrometres.
///
/// # Errors
/// When it is another word, or the radius is missing, not a number, or not in
/// [`ContactShape::RADII`].
pub fn parse(text: &str) -> Result<ContactShape, String> {
    match text.split_once(':') {
        None => match text {
            "needle" => Ok(ContactShape::Needle),
            "unknown" => Ok(ContactShape::Unknown),
            "round" | "flat" => Err(format!("{text} needs a radius in mm, such as {text}:2")),
            _ => Err(no_shape(text)),
        },
        Some(("round", number)) => radius(number).map(ContactShape::Round),
        Some(("flat", number)) => radius(number).map(ContactShape::Flat),
        Some((word @ ("needle" | "unknown"), _)) => Err(format!("{word} has no radius")),
        Some((word, _)) => Err(no_shape(word)),
    }
}

fn no_shape(word: &str) -> String {
    format!("{word:?} is no shape: use needle, round:R, flat:R or unknown, with a radius R in mm")
}

/// Reads a radius in mm.
fn radius(text: &str) -> Result<Micrometres, String> {
    let number: f64 = text
        .parse()
        .map_err(|_| format!("{text:?} is no radius: use a number of mm, such as 2"))?;
    let [low, high] = [ContactShape::RADII.start(), ContactShape::RADII.end()].map(millimetres);
    match (low..=high).contains(&number) {
        true => Ok(Micrometres((1e3 * number).round() as u32)),
        false => Err(format!(
            "a radius of {text} mm is out of range: {low} to {high} mm"
        )),
    }
}

fn millimetres(radius: &Micrometres) -> f64 {
    f64::from(radius.0) / 1e3
}

/// Text for a person about the contact's shape.
pub fn text(shape: ContactShape) -> String {
    match shape {
        ContactShape::Needle => "needle, a tip like the model's".to_owned(),
        ContactShape::Round(radius) => {
            format!(
                "round, a soft or rounded tip of {} mm radius",
                millimetres(&radius)
            )
        }
        ContactShape::Flat(radius) => {
            format!("flat, a rigid face of {} mm radius", millimetres(&radius))
        }
        ContactShape::Unknown => {
            "unknown: it may be any up to 4 mm, and uncertainties include that".to_owned()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_read() {
        for (word, shape) in [
            ("needle", ContactShape::Needle),
            ("round:0.25", ContactShape::Round(Micrometres(250))),
            ("round:1.5", ContactShape::Round(Micrometres(1_500))),
            ("flat:4", ContactShape::Flat(Micrometres(4_000))),
            ("flat:2.0004", ContactShape::Flat(Micrometres(2_000))),
            ("unknown", ContactShape::Unknown),
        ] {
            assert_eq!(parse(word), Ok(shape));
        }
    }

    #[test]
    fn what_is_no_shape_says_why() {
        for (word, said) in [
            ("round:0.1", "0.1 mm is out of range: 0.25 to 4 mm"),
            ("flat:4.001", "out of range"),
            ("flat:-2", "out of range"),
            ("flat:nan", "out of range"),
            ("round", "round needs a radius in mm, such as round:2"),
            ("flat:x", "\"x\" is no radius"),
            ("flat:", "\"\" is no radius"),
            ("flat:2 mm", "is no radius"),
            ("ball:2", "\"ball\" is no shape: use needle, round:R"),
            ("", "is no shape"),
            ("needle:1", "needle has no radius"),
        ] {
            let error = parse(word).unwrap_err();
            assert!(error.contains(said), "{word}: {error}");
        }
    }

    #[test]
    fn it_is_reported_in_words() {
        let flat = text(ContactShape::Flat(Micrometres(2_500)));
        assert_eq!(flat, "flat, a rigid face of 2.5 mm radius");
        let round = text(ContactShape::Round(Micrometres(250)));
        assert_eq!(round, "round, a soft or rounded tip of 0.25 mm radius");
        assert!(text(ContactShape::Needle).starts_with("needle, "));
        assert!(text(ContactShape::default()).starts_with("unknown: "));
    }
}
