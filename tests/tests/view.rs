//! The page of `hivtac view` in a real browser, before the firmware in the rig.

use std::env;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use crate::rig::{Rig, TIMEOUT_S};
use hivtac_tests::artifact;
use hivtac_tests::browser::Browser;
use serde_json::Value;

const PAGE: [u32; 2] = [1280, 1000];
/// How the page looks at the film to begin with, radians: turned about z, and from above.
const YAW: f64 = -0.5;
const PITCH: f64 = 0.5;

/// A tool that serves its page. Killed when it is dropped.
struct View {
    process: Child,
    address: String,
}

impl View {
    /// Of the port `sensor` in a folder.
    fn of(folder: &Path) -> View {
        let mut process = Command::new(artifact::named_by("HIVTAC_TOOL"))
            .args([
                "view",
                "--timeout",
                &TIMEOUT_S.to_string(),
                "--port",
                "sensor",
            ])
            .current_dir(folder)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut said = String::new();
        let stdout = process.stdout.take().unwrap();
        BufReader::new(stdout).read_line(&mut said).unwrap();
        let address = said.trim().strip_prefix("ready ");
        View {
            address: address.expect("an address").to_owned(),
            process,
        }
    }
}

impl Drop for View {
    fn drop(&mut self) {
        // Fails only when it has ended already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn rig(link: &Path) -> Rig {
    let link = link.to_str().unwrap();
    Rig::start(&["--scene", "demo", "--seed", "5", "--pty-link", link]).unwrap()
}

/// Where screenshots go when they are asked for.
fn screenshots() -> Option<PathBuf> {
    env::var_os("HIVTAC_SCREENSHOTS").map(PathBuf::from)
}

/// A part of the page, as an expression.
fn part(name: &str) -> String {
    format!("document.querySelector('[data-is=\"{name}\"]')")
}

/// The angle of a vector of the film on the screen, y down.
fn on_screen([x, y, z]: [f64; 3]) -> f64 {
    let right = x * YAW.cos() - y * YAW.sin();
    let away = x * YAW.sin() + y * YAW.cos();
    (-(z * PITCH.cos() + away * PITCH.sin())).atan2(right)
}

fn numbers(value: &Value) -> Vec<f64> {
    let numbers = value.as_array().unwrap().iter();
    numbers.map(|number| number.as_f64().unwrap()).collect()
}

/// The arrow's vector, and its ends on the screen, are those of the true force of its frame.
fn check_arrow(browser: &mut Browser, rig: &Rig) {
    let shown = format!("{}?.dataset.shown", part("arrow"));
    let shown = browser.until(&shown).unwrap();
    let shown: Value = serde_json::from_str(shown.as_str().unwrap()).unwrap();
    let truth = rig.truth().unwrap();
    let truth = truth.iter().find(|truth| truth["frame"] == shown["frame"]);
    let truth = truth.expect("a frame of the rig");
    let force = ["x_n", "y_n", "z_n"].map(|name| 1e3 * truth[name].as_f64().unwrap());
    let [vector, from, to] = ["vector", "from", "to"].map(|name| numbers(&shown[name]));
    let size = force.iter().map(|part| part * part).sum::<f64>().sqrt();
    for (part, (own, true_part)) in vector.iter().zip(force).enumerate() {
        // A few tenths of a degree, and a force that changes while it is exposed.
        let most = 1.0 + 0.03 * size;
        assert!((own - true_part).abs() < most, "{part}: {shown} {truth}");
    }
    let angle = (to[1] - from[1]).atan2(to[0] - from[0]);
    let off = (angle - on_screen(force))
        .sin()
        .atan2((angle - on_screen(force)).cos());
    assert!(off.to_degrees().abs() < 6.0, "{off}: {shown} {truth}");
}

/// Waits for a picture that was read with this lowest saturation; gives how many pixels passed.
fn passed_at(browser: &mut Browser, saturation: u32) -> u64 {
    let picture = part("picture");
    let passed = format!(
        "{picture}.dataset.limits?.split(',')[2] === '{saturation}' && {picture}.dataset.passed"
    );
    let passed = browser.until(&passed).unwrap();
    passed.as_str().unwrap().parse().unwrap()
}

fn check_sliders(browser: &mut Browser) {
    let before = passed_at(browser, 100);
    assert!((400..3000).contains(&before), "four dots: {before}");
    // By keyboard: chosen, and moved to its end.
    let slider = "document.querySelector('[data-limit=\"lowest saturation\"]')";
    browser.value(&format!("{slider}.focus()")).unwrap();
    browser.key("End", 35).unwrap();
    assert_eq!(passed_at(browser, 255), 0);
    let light = "document.querySelector('[data-light=\"model_mismatch\"]')?.className";
    assert_eq!(browser.until(light).unwrap(), "bad");
    let button = "document.querySelector('[data-do=\"model_threshold\"]')";
    browser.value(&format!("{button}.click()")).unwrap();
    let after = passed_at(browser, 100);
    assert!((400..3000).contains(&after), "{after}");
    assert_eq!(browser.value(&format!("{slider}.value")).unwrap(), "100");
}

fn check_lost_and_back(browser: &mut Browser, first: Rig, link: &Path) {
    let connection = "document.querySelector('[data-light=\"connection\"]').className";
    assert_eq!(browser.value(connection).unwrap(), "good");
    drop(first);
    browser.until(&format!("{connection} === 'bad'")).unwrap();
    assert_eq!(
        browser
            .value(&format!("{}.textContent", part("magnitude")))
            .unwrap(),
        "–"
    );
    // The link is left behind by what was killed.
    let _ = std::fs::remove_file(link);
    let second = rig(link);
    browser.until(&format!("{connection} === 'good'")).unwrap();
    check_arrow(browser, &second);
}

#[test]
#[ignore = "slow, and needs Chromium: run by cargo xtask test --all"]
fn the_page_shows_the_truth_and_does_what_it_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("sensor");
    let first = rig(&link);
    let view = View::of(folder.path());
    let mut browser = Browser::open(&view.address, PAGE).unwrap();
    (0..5).for_each(|_| check_arrow(&mut browser, &first));
    // A dash until frames came for long enough.
    let rate = format!("{}.textContent.startsWith('156.')", part("rate"));
    browser.until(&rate).unwrap();
    check_sliders(&mut browser);
    browser.value("document.activeElement.blur()").unwrap();
    browser
        .until(&format!("{}.dataset.shown", part("arrow")))
        .unwrap();
    for scheme in ["light", "dark"] {
        browser.colours(scheme).unwrap();
        let back = browser
            .value("getComputedStyle(document.body).backgroundColor")
            .unwrap();
        let is_dark = back == "rgb(22, 22, 21)";
        assert_eq!(is_dark, scheme == "dark", "{back}");
        if let Some(folder) = screenshots() {
            // With the next drawing in these colours.
            std::thread::sleep(std::time::Duration::from_millis(300));
            browser
                .keep(&folder.join(format!("view-{scheme}.png")))
                .unwrap();
        }
    }
    check_lost_and_back(&mut browser, first, &link);
    let (host, _) = view.address.trim_end_matches('/').rsplit_once('/').unwrap();
    let wrong = format!("{host}/{}/", "0".repeat(32));
    let mut stranger = Browser::open(&wrong, PAGE).unwrap();
    let refused = stranger.until("document.body?.innerText").unwrap();
    assert!(
        refused.as_str().unwrap().contains("Open the whole address"),
        "{refused}"
    );
}
