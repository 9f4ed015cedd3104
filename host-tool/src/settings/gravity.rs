//! Reads the direction of gravity from the command line.

use hivtac_host::down::direction;
use hivtac_host::failure::{Failure, Kind};
use hivtac_terms::down::Down;

/// Reads a direction of three numbers, `none` or `fixed`.
///
/// # Errors
/// When the words have another form.
pub fn down(words: &[String]) -> Result<Down, Failure> {
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let parsed = match words.as_slice() {
        ["none"] => Ok(Down::Unknown),
        ["fixed"] => Ok(Down::Fixed),
        numbers => {
            let parts: Result<Vec<f64>, _> = numbers.iter().map(|part| part.parse()).collect();
            let vector: Option<[f64; 3]> = parts.ok().and_then(|parts| parts.try_into().ok());
            let usage = "down is X Y Z, none or fixed: such as 0 0 -1".to_owned();
            vector.ok_or(usage).and_then(direction).map(Down::Told)
        }
    };
    parsed.map_err(|why| Failure::new(Kind::Usage, why))
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::down::Direction;

    #[test]
    fn down_is_a_vector_or_a_word() {
        let of = |words: &str| {
            let words: Vec<String> = words.split(' ').map(str::to_owned).collect();
            down(&words).map_err(|failure| failure.to_string())
        };
        assert_eq!(of("0 0.6 -0.8"), Ok(Down::Told(Direction([0, 600, -800]))));
        assert_eq!(
            (of("none"), of("fixed")),
            (Ok(Down::Unknown), Ok(Down::Fixed))
        );
        for (words, said) in [("0 0", "X Y Z"), ("up", "X Y Z"), ("0 0 0", "no direction")] {
            assert!(of(words).unwrap_err().contains(said), "{words}");
        }
    }
}
