//! What a run of the demo amounts to: rate, latency, and errors against the truth.

use std::collections::HashMap;

use anyhow::{Context, Result, ensure};
use serde::Serialize;
use serde_json::Value;

/// |F| from which a direction counts, N.
const DIRECTION_FLOOR_N: f64 = 0.05;

/// One run.
#[derive(Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Samples shown.
    pub frames: usize,
    /// Samples a second, by the device's times.
    pub rate_hz: f64,
    /// Mean time from the middle of a frame's exposure to the last byte of its sample on USB,
    /// simulated.
    pub latency_ms: f64,
    /// Mean angle between the force and the true one, of frames with true |F| ≥ 50 mN.
    pub direction_deg: Option<f64>,
    /// Root mean square error of |F|.
    pub magnitude_mn: Option<f64>,
    /// Root mean square distance of the place from the true one.
    pub place_um: Option<f64>,
}

impl Summary {
    /// Of the host tool's JSON lines with their truth, and the rig's logs of truth and arrivals.
    ///
    /// # Errors
    /// When one of them cannot be read, or has nothing of what the others tell of.
    pub fn of(samples: &str, truth: &str, arrivals: &str) -> Result<Summary> {
        let samples = parsed(samples).context("the host tool's lines")?;
        ensure!(samples.len() > 1, "the rig gave {} samples", samples.len());
        let times: Vec<f64> = samples.iter().map(|line| number(line, "time_us")).collect();
        let span_s = (times[times.len() - 1] - times[0]) * 1e-6;
        Ok(Summary {
            frames: samples.len(),
            rate_hz: (times.len() - 1) as f64 / span_s,
            latency_ms: latency_ms(&samples, truth, arrivals)?,
            direction_deg: mean(samples.iter().filter_map(direction_deg)),
            magnitude_mn: root_mean(samples.iter().filter_map(magnitude_mn)),
            place_um: root_mean(samples.iter().filter_map(place_um)),
        })
    }
}

/// Mean latency of the frames that both logs tell of, ms.
///
/// # Errors
/// When there is none among the samples.
pub fn latency_ms(samples: &[Value], truth: &str, arrivals: &str) -> Result<f64> {
    let exposed = times(truth).context("the truth log")?;
    let arrived = times(arrivals).context("the log of arrivals")?;
    let latency_s = |sample: &Value| {
        let frame = sample["frame"].as_u64()?;
        Some(arrived.get(&frame)? - exposed.get(&frame)?)
    };
    let mean = mean(samples.iter().filter_map(latency_s));
    Ok(1e3 * mean.context("no sample's arrival is in the log")?)
}

/// Frames a second that samples arrived of, by the middles of their exposures.
///
/// # Errors
/// When there are fewer than two.
pub fn rate_hz(truth: &str, arrivals: &str) -> Result<f64> {
    let exposed = times(truth).context("the truth log")?;
    let arrived = times(arrivals).context("the log of arrivals")?;
    let mut times: Vec<f64> = (arrived.keys())
        .filter_map(|frame| exposed.get(frame).copied())
        .collect();
    times.sort_by(f64::total_cmp);
    let span_s = times
        .last()
        .zip(times.first())
        .map(|(last, first)| last - first);
    let span_s = span_s.filter(|span_s| *span_s > 0.0);
    Ok((times.len() - 1) as f64 / span_s.context("fewer than two samples arrived")?)
}

/// Lines of JSON.
pub fn parsed(lines: &str) -> Result<Vec<Value>> {
    let line = |line| serde_json::from_str(line).with_context(|| format!("reading `{line}`"));
    lines.lines().map(line).collect()
}

/// When, by frame.
fn times(log: &str) -> Result<HashMap<u64, f64>> {
    let lines = parsed(log)?;
    let time = |line: &Value| Some((line["frame"].as_u64()?, line["time_s"].as_f64()?));
    Ok(lines.iter().filter_map(time).collect())
}

fn number(line: &Value, key: &str) -> f64 {
    line[key].as_f64().unwrap_or(f64::NAN)
}

fn vector(of: &Value) -> Option<[f64; 3]> {
    Some([
        of["x_n"].as_f64()?,
        of["y_n"].as_f64()?,
        of["z_n"].as_f64()?,
    ])
}

fn direction_deg(line: &Value) -> Option<f64> {
    let [a, b] = [vector(&line["force"])?, vector(&line["truth"])?];
    if line["truth"]["magnitude_n"].as_f64()? < DIRECTION_FLOOR_N {
        return None;
    }
    let dot: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    let cross = [(1, 2), (2, 0), (0, 1)].map(|(i, j)| a[i] * b[j] - a[j] * b[i]);
    let sine = cross.iter().map(|c| c * c).sum::<f64>().sqrt();
    Some(sine.atan2(dot).to_degrees())
}

fn magnitude_mn(line: &Value) -> Option<f64> {
    let [found, true_n] = ["force", "truth"].map(|of| line[of]["magnitude_n"].as_f64());
    Some((found? - true_n?) * 1e3)
}

fn place_um(line: &Value) -> Option<f64> {
    let along = |key: &str| Some(line["force"][key].as_f64()? - line["truth"][key].as_f64()?);
    Some(along("place_x_mm")?.hypot(along("place_y_mm")?) * 1e3)
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let values: Vec<f64> = values.collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

fn root_mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    mean(values.map(|value| value * value)).map(f64::sqrt)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(frame: u64, time_us: u64, x_n: f64, place: &str) -> String {
        let load = |magnitude_n: f64, x_n: f64, place: &str| {
            let place = format!(r#""place_x_mm":{place},"place_y_mm":{place}"#);
            format!(r#"{{"magnitude_n":{magnitude_n},"x_n":{x_n},"y_n":0.0,"z_n":-0.1,{place}}}"#)
        };
        let (force, truth) = (load(0.101, x_n, place), load(0.1, 0.0, "0.0"));
        format!(r#"{{"frame":{frame},"time_us":{time_us},"force":{force},"truth":{truth}}}"#)
    }

    const TRUTH: &str = "{\"frame\":7,\"time_s\":0.1}\n{\"frame\":8,\"time_s\":0.106}";
    const ARRIVALS: &str = "{\"frame\":7,\"time_s\":0.105}\n{\"frame\":8,\"time_s\":0.113}";

    #[test]
    fn errors_rate_and_latency_are_those_of_the_logs() {
        let lines = [sample(7, 1000, 0.0, "0.003"), sample(8, 7000, 0.1, "0.004")].join("\n");
        let summary = Summary::of(&lines, TRUTH, ARRIVALS).unwrap();
        assert_eq!(summary.frames, 2);
        for (found, expected) in [
            (summary.rate_hz, 1.0 / 0.006),
            (summary.latency_ms, 6.0),
            (summary.direction_deg.unwrap(), 22.5),
            (summary.magnitude_mn.unwrap(), 1.0),
            (summary.place_um.unwrap(), 5.0),
        ] {
            assert!((found - expected).abs() < 1e-9, "{found} for {expected}");
        }
    }

    #[test]
    fn what_no_sample_tells_is_null_and_what_must_be_there_is_missed() {
        let lines = [sample(7, 1000, 0.0, "null"), sample(8, 7000, 0.0, "null")].join("\n");
        assert_eq!(Summary::of(&lines, TRUTH, ARRIVALS).unwrap().place_um, None);
        assert!(Summary::of(&lines, TRUTH, "").is_err());
        assert!(Summary::of(&sample(7, 1, 0.0, "null"), TRUTH, ARRIVALS).is_err());
    }
}
