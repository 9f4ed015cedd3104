//! Formats thresholds as text and JSON.

use hivtac_terms::threshold::Threshold;
use serde_json::{Value, json};

/// A threshold's pixel format and limits, for a person.
pub fn text(threshold: &Threshold) -> String {
    let format = threshold.format().name();
    match threshold {
        Threshold::Rgb565(it) => format!(
            "{format}, H {}–{}, S {}–{}, V {}–{}",
            it.hue_low,
            it.hue_high,
            it.saturation_low,
            it.saturation_high,
            it.value_low,
            it.value_high
        ),
        Threshold::Yuv422(it) => format!("{format}, Cr {}–255", it.cr_low),
        Threshold::Mono(it) => format!("{format}, luma {}–{}", it.low, it.high),
    }
}

/// A threshold as JSON: `format` and the limits by their names.
pub fn to_json(threshold: &Threshold) -> Value {
    let format = threshold.format().name();
    match threshold {
        Threshold::Rgb565(it) => json!({
            "format": format,
            "hue_low": it.hue_low,
            "hue_high": it.hue_high,
            "saturation_low": it.saturation_low,
            "saturation_high": it.saturation_high,
            "value_low": it.value_low,
            "value_high": it.value_high,
        }),
        Threshold::Yuv422(it) => json!({ "format": format, "cr_low": it.cr_low }),
        Threshold::Mono(it) => {
            json!({ "format": format, "luma_low": it.low, "luma_high": it.high })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hivtac_terms::threshold::{HsvBox, Mono, Yuv422};

    const ALL: [Threshold; 3] = [
        Threshold::Rgb565(HsvBox {
            hue_low: 1,
            hue_high: 2,
            saturation_low: 3,
            saturation_high: 4,
            value_low: 5,
            value_high: 6,
        }),
        Threshold::Yuv422(Yuv422 { cr_low: 162 }),
        Threshold::Mono(Mono { low: 7, high: 88 }),
    ];

    #[test]
    fn thresholds_are_reported_with_their_format() {
        let texts = ALL.map(|threshold| text(&threshold));
        let expected = [
            "rgb565, H 1–2, S 3–4, V 5–6",
            "yuv422, Cr 162–255",
            "mono, luma 7–88",
        ];
        assert_eq!(texts, expected);
        let values = ALL.map(|threshold| to_json(&threshold));
        assert_eq!(values[0]["saturation_high"], 4);
        assert_eq!(values[1], json!({ "format": "yuv422", "cr_low": 162 }));
        assert_eq!(values[2]["luma_high"], 88);
    }
}
