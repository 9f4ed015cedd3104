//! Numbers for people.

/// With a comma after each three digits.
pub fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// A number that is not negative, with a comma after each three digits, and with up to three
/// decimals if it has some.
pub fn decimal(number: f64) -> String {
    let thousandths = (number * 1000.0).round() as u64;
    let whole = grouped(thousandths / 1000);
    match thousandths % 1000 {
        0 => whole,
        rest => format!("{whole}.{rest:03}")
            .trim_end_matches('0')
            .to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_grouped() {
        for (number, text) in [
            (0, "0"),
            (999, "999"),
            (1_000, "1,000"),
            (12_345_678, "12,345,678"),
        ] {
            assert_eq!(grouped(number), text);
        }
    }

    #[test]
    fn decimals_are_shown_where_there_are_some() {
        for (number, text) in [
            (0.0, "0"),
            (1_234.5, "1,234.5"),
            (0.578_4, "0.578"),
            (99.999_9, "100"),
        ] {
            assert_eq!(decimal(number), text);
        }
    }
}
