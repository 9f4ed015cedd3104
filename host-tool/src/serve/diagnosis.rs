//! Diagnoses a device, for `/diagnostics`.

use hivtac_host::page::State;
use hivtac_host::page::lights::{self, Light};
use hivtac_host::ros::{Diagnosis, Level};
use hivtac_host::shown::{shown, unit_number};
use hivtac_terms::status::Status;

/// The diagnosis of a device from its state and the status bits of the samples since the last
/// diagnosis. `since` is `None` if there were no samples.
pub fn diagnose(state: &State, since: Option<Status>, not_published: u64) -> Diagnosis {
    let hello = &state.hello;
    let name = match hello.name.as_str() {
        "" => unit_number(&hello.device_id),
        name => shown(name),
    };
    let (level, message) = verdict(state.trouble.as_deref(), since);
    Diagnosis {
        level,
        name: format!("hivtac: {name}"),
        message,
        hardware_id: unit_number(&hello.device_id),
        values: values(state, since, not_published),
    }
}

/// The worst severity, and its remedy.
fn verdict(trouble: Option<&str>, since: Option<Status>) -> (Level, String) {
    if let Some(trouble) = trouble {
        return (Level::Error, shown(trouble));
    }
    let Some(status) = since else {
        return (Level::Stale, "no sample came so far".to_owned());
    };
    let lights = lights::of(status).into_iter();
    // A bit without advice is not a fault: a light touch has no direction, for example.
    let faults: Vec<Light> = lights.filter(|light| !light.advice.is_empty()).collect();
    let Some(worst) = faults.iter().map(|light| light.level).max() else {
        return (Level::Ok, "good".to_owned());
    };
    let level = match worst {
        lights::Level::Good => Level::Ok,
        lights::Level::Warning => Level::Warn,
        lights::Level::Bad => Level::Error,
    };
    let worst = faults.iter().filter(|light| light.level == worst);
    let words = worst.map(|light| format!("{}: {}", light.meaning, light.advice));
    (level, words.collect::<Vec<_>>().join("; "))
}

fn values(state: &State, since: Option<Status>, not_published: u64) -> Vec<(&'static str, String)> {
    let hello = &state.hello;
    let status: Vec<_> = since.iter().flat_map(|status| status.names()).collect();
    let model = hello.model.as_ref().map(|model| shown(&model.name));
    let mut values = vec![
        ("port", shown(&state.port)),
        ("board", shown(&hello.board)),
        ("firmware", shown(&hello.firmware)),
        ("model", model.unwrap_or_else(|| "none".to_owned())),
        ("status", status.join(" ")),
        ("frames_lost", state.tally.lost().to_string()),
        ("connections", (state.tally.reconnections() + 1).to_string()),
        ("samples_not_published", not_published.to_string()),
    ];
    let rate = state
        .rate_hz()
        .map(|rate| ("rate_hz", format!("{rate:.1}")));
    let latency = state
        .stats
        .map(|stats| ("latency_us", stats.latency_us.to_string()));
    values.extend(rate.into_iter().chain(latency));
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_of_the_worst_that_was_there_is_reported() {
        let warning = Status::NOT_CALIBRATED | Status::TARE_MISSING | Status::CONTACT;
        let (level, message) = verdict(None, Some(warning));
        assert_eq!(level, Level::Warn);
        assert!(message.starts_with("no rest position"), "{message}");
        assert!(
            message.contains("take a tare; the model is of a simulated"),
            "{message}"
        );
        let (level, message) = verdict(None, Some(warning | Status::MARKERS_MISSING));
        assert_eq!(level, Level::Error);
        assert!(message.starts_with("fewer markers are seen"), "{message}");
        assert!(!message.contains("no rest position"), "{message}");
        let good = (Level::Ok, "good".to_owned());
        assert_eq!(verdict(None, Some(Status::CONTACT)), good);
        assert_eq!(
            verdict(None, Some(Status::SLIP | Status::DIRECTION_UNRELIABLE)),
            good
        );
        assert_eq!(verdict(None, None).0, Level::Stale);
        let lost = verdict(Some("cable\u{1b}[2J"), Some(Status::CONTACT));
        assert_eq!(lost, (Level::Error, r"cable\u{1b}[2J".to_owned()));
    }
}
