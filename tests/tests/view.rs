//! Tests of the page of `hivtac view`, and of the page of a recording, in a real browser, with the
//! firmware in the rig.

use std::env;
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use crate::rig::{Rig, TIMEOUT_S, set_needle};
use hivtac_tests::artifact;
use hivtac_tests::browser::Browser;
use serde_json::Value;

const PAGE: [u32; 2] = [1280, 1000];
/// The page's initial view of the film, radians: turned about z, and from above.
const YAW: f64 = -0.5;
const PITCH: f64 = 0.5;

/// A press that stays: its place is in the second row and the last column but one, its force in the
/// last range of forces.
const STAYS: &str = "[film]\noffset_mm = [2.2, -1.5]\n[load]\nmotion = \"press\"\n[load.press]\n\
                     force_n = 0.18\nstart_s = 1.2\nrise_s = 0.3\nhold_s = 60.0\n";

/// A tool that serves its page; killed when it is dropped.
pub struct View {
    pub process: Child,
    pub address: String,
}

impl View {
    /// Serves the page of the port `sensor` in a folder.
    fn of(folder: &Path) -> View {
        let mut tool = Command::new(artifact::named_by("HIVTAC_TOOL"));
        tool.args(["view", "--port", "sensor", "--timeout"]);
        tool.arg(TIMEOUT_S.to_string()).current_dir(folder);
        let (process, address) = artifact::ready(&mut tool);
        View { process, address }
    }
}

impl View {
    /// Records presses anywhere from the port `sensor` in a folder, and serves the recording's
    /// page.
    fn of_recording(folder: &Path) -> View {
        let record = ["collect", "record", "--into", "unit", "--port", "sensor"];
        let mut process = Command::new(artifact::named_by("HIVTAC_CALIBRATE"))
            .args(record)
            .args(["--timeout", "60", "--rest-seconds", "0.3"])
            .args(["--free", "60", "--view"])
            .current_dir(folder)
            .stdin(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut said = BufReader::new(process.stderr.take().unwrap()).lines();
        let address = said.find_map(|line| {
            let line = line.ok()?;
            let (_, address) = line.split_once("in a browser: ")?;
            Some(address.to_owned())
        });
        // The tool's later output is not used; it is drained to keep the tool running.
        std::thread::spawn(move || said.for_each(drop));
        let mut stdin = process.stdin.take().unwrap();
        stdin.write_all(b"\n\n").unwrap();
        View {
            address: address.expect("an address"),
            process,
        }
    }
}

impl Drop for View {
    fn drop(&mut self) {
        // Fails only if the tool has already ended.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn rig(link: &Path) -> Rig {
    let link = link.to_str().unwrap();
    Rig::start(&["--scene", "demo", "--seed", "1", "--pty-link", link]).unwrap()
}

/// Returns the folder for screenshots; `None` if none are wanted.
fn screenshots() -> Option<PathBuf> {
    env::var_os("HIVTAC_SCREENSHOTS").map(PathBuf::from)
}

/// Returns a part of the page, as an expression.
pub fn part(name: &str) -> String {
    format!("document.querySelector('[data-is=\"{name}\"]')")
}

/// Returns the angle on the screen of a vector of the film, y down.
fn on_screen([x, y, z]: [f64; 3]) -> f64 {
    let right = x * YAW.cos() - y * YAW.sin();
    let away = x * YAW.sin() + y * YAW.cos();
    (-(z * PITCH.cos() + away * PITCH.sin())).atan2(right)
}

fn numbers(value: &Value) -> Vec<f64> {
    let numbers = value.as_array().unwrap().iter();
    numbers.map(|number| number.as_f64().unwrap()).collect()
}

/// Checks that the arrow's vector and its ends on the screen are those of its frame's true force.
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
        // A few tenths of a degree, and the change of the force during its exposure.
        let most = 1.0 + 0.03 * size;
        assert!((own - true_part).abs() < most, "{part}: {shown} {truth}");
    }
    let angle = (to[1] - from[1]).atan2(to[0] - from[0]);
    let off = (angle - on_screen(force))
        .sin()
        .atan2((angle - on_screen(force)).cos());
    assert!(off.to_degrees().abs() < 6.0, "{off}: {shown} {truth}");
}

/// Waits for a picture that was read with this lowest saturation. Returns the number of accepted
/// pixels.
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
    // By keyboard: the slider is focused, and moved to its end.
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
    // The killed tool leaves its link behind.
    let _ = std::fs::remove_file(link);
    let second = rig(link);
    browser.until(&format!("{connection} === 'good'")).unwrap();
    check_arrow(browser, &second);
}

#[test]
#[ignore = "slow, and needs Chromium: run by cargo xtask test --all"]
fn the_page_shows_the_truth_and_does_what_it_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("sensor");
    let first = rig(&link);
    set_needle(&first).unwrap();
    let view = View::of(folder.path());
    let mut browser = Browser::open(&view.address, PAGE).unwrap();
    (0..5).for_each(|_| check_arrow(&mut browser, &first));
    // The page shows a dash until frames have come for long enough.
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
            // The next drawing is in these colours.
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

#[test]
#[ignore = "slow, and needs Chromium: run by cargo xtask test --all"]
fn the_page_of_a_recording_shows_what_is_covered() {
    let folder = tempfile::tempdir().unwrap();
    let [link, scene] = ["sensor", "press.toml"].map(|name| folder.path().join(name));
    fs::write(&scene, STAYS).unwrap();
    let [scene, link] = [&scene, &link].map(|path| path.to_str().unwrap());
    let _rig = Rig::start(&["--scene", scene, "--pty-link", link]).unwrap();
    let view = View::of_recording(folder.path());
    let mut browser = Browser::open(&view.address, PAGE).unwrap();
    let place = format!("{}?.children[2]?.rows[1].cells[3].className", part("maps"));
    let is = |classes: &str| format!("{place} === '{classes}'");
    browser.until(&is("covered pressed")).unwrap();
    let all = format!("{}.querySelectorAll('.pressed').length", part("maps"));
    assert_eq!(browser.value(&all).unwrap(), 1);
    let text = |name: &str| format!("{}.textContent", part(name));
    let line = browser.value(&text("covered")).unwrap();
    let line = line.as_str().unwrap();
    assert!(
        line.contains(" of 71 covered") && line.contains("press"),
        "{line}"
    );
    let now = browser.value(&text("pressed")).unwrap();
    assert!(now.as_str().unwrap().contains("mN at x +2."), "{now}");
    for name in ["buttons", "camera"] {
        let hidden = format!("{}.hidden", part(name));
        assert_eq!(browser.value(&hidden).unwrap(), true, "{name}");
    }
    if let Some(folder) = screenshots() {
        browser.keep(&folder.join("coverage.png")).unwrap();
    }
}
