//! Reads thresholds from the command line.

use hivtac_terms::threshold::HsvBox;
use hivtac_terms::threshold::Mono;

/// Largest hue, saturation and value, each for both bounds.
const HIGHEST: [u8; 6] = [179, 179, 255, 255, 255, 255];

/// Reads `h0,h1,s0,s1,v0,v1` in OpenCV's 8-bit HSV (hue 0–179, h0 > h1 wraps through 0).
pub fn parse(text: &str) -> Result<HsvBox, String> {
    let fields: Vec<&str> = text.split(',').collect();
    let fields = <[&str; 6]>::try_from(fields).map_err(|fields| {
        format!(
            "{} numbers instead of six (h0,h1,s0,s1,v0,v1)",
            fields.len()
        )
    })?;
    let mut limits = [0; 6];
    for (limit, (field, highest)) in limits.iter_mut().zip(fields.into_iter().zip(HIGHEST)) {
        *limit = number(field, highest)?;
    }
    let box_ = HsvBox::of_limits(limits);
    ordered("saturation", box_.saturation_low, box_.saturation_high)?;
    ordered("value", box_.value_low, box_.value_high)?;
    Ok(box_)
}

/// Reads `l0,l1`: lowest and highest luma.
pub fn parse_luma(text: &str) -> Result<Mono, String> {
    let (low, high) = text
        .split_once(',')
        .ok_or_else(|| format!("{text:?} is not two numbers (l0,l1)"))?;
    let (low, high) = (number(low, 255)?, number(high, 255)?);
    ordered("luma", low, high)?;
    Ok(Mono { low, high })
}

fn number(text: &str, highest: u8) -> Result<u8, String> {
    match text.trim().parse() {
        Ok(number) if number <= highest => Ok(number),
        _ => Err(format!("{text:?} is no number from 0 to {highest}")),
    }
}

fn ordered(what: &str, low: u8, high: u8) -> Result<(), String> {
    match low <= high {
        true => Ok(()),
        false => Err(format!(
            "the lowest {what}, {low}, is above the highest, {high}"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn six_numbers_make_a_box() {
        let red = HsvBox {
            hue_low: 170,
            hue_high: 10,
            saturation_low: 100,
            saturation_high: 255,
            value_low: 45,
            value_high: 255,
        };
        assert_eq!(parse("170,10,100,255,45,255"), Ok(red));
        assert_eq!(parse("170, 10, 100, 255, 45, 255"), Ok(red));
    }

    #[test]
    fn two_numbers_make_a_range_of_luma() {
        assert_eq!(parse_luma("0, 88"), Ok(Mono { low: 0, high: 88 }));
        let error = |text| parse_luma(text).unwrap_err();
        assert_eq!(error("88"), "\"88\" is not two numbers (l0,l1)");
        assert_eq!(error("0,256"), "\"256\" is no number from 0 to 255");
        assert_eq!(error("9,8"), "the lowest luma, 9, is above the highest, 8");
    }

    #[test]
    fn anything_else_is_explained() {
        let error = |text| parse(text).unwrap_err();
        assert_eq!(
            error("1,2,3"),
            "3 numbers instead of six (h0,h1,s0,s1,v0,v1)"
        );
        assert_eq!(
            error("180,10,0,255,0,255"),
            "\"180\" is no number from 0 to 179"
        );
        assert_eq!(
            error("0,10,0,256,0,255"),
            "\"256\" is no number from 0 to 255"
        );
        assert_eq!(error("0,10,0,x,0,255"), "\"x\" is no number from 0 to 255");
        assert_eq!(
            error("0,10,9,8,0,255"),
            "the lowest saturation, 9, is above the highest, 8"
        );
    }
}
