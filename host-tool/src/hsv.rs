//! Thresholds on the command line.

use hivtac_sensing::threshold;
use hivtac_wire::message::HsvBox;

/// From `h0,h1,s0,s1,v0,v1` in OpenCV's 8-bit HSV (hue 0–179, h0 > h1 wraps through 0).
pub fn parse(text: &str) -> Result<HsvBox, String> {
    let fields: Vec<&str> = text.split(',').collect();
    let [
        hue_low,
        hue_high,
        saturation_low,
        saturation_high,
        value_low,
        value_high,
    ] = <[&str; 6]>::try_from(fields).map_err(|fields| {
        format!(
            "{} numbers instead of six (h0,h1,s0,s1,v0,v1)",
            fields.len()
        )
    })?;
    let box_ = HsvBox {
        hue_low: number(hue_low, 179)?,
        hue_high: number(hue_high, 179)?,
        saturation_low: number(saturation_low, 255)?,
        saturation_high: number(saturation_high, 255)?,
        value_low: number(value_low, 255)?,
        value_high: number(value_high, 255)?,
    };
    ordered("saturation", box_.saturation_low, box_.saturation_high)?;
    ordered("value", box_.value_low, box_.value_high)?;
    Ok(box_)
}

/// The same for the sensing code.
pub fn for_sensing(threshold: HsvBox) -> threshold::HsvBox {
    threshold::HsvBox {
        hue_low: threshold.hue_low,
        hue_high: threshold.hue_high,
        saturation_low: threshold.saturation_low,
        saturation_high: threshold.saturation_high,
        value_low: threshold.value_low,
        value_high: threshold.value_high,
    }
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
