//! Tests `hivtac view --twin` in a real browser: a press by pointer events, compared with the
//! truth.

use std::env;
use std::path::PathBuf;
use std::process::Command;

use crate::view::{View, part};
use hivtac_tests::artifact;
use hivtac_tests::browser::Browser;
use serde_json::Value;

pub const PAGE: [u32; 2] = [1280, 1000];
/// Half the side of the film that the page shows, mm.
const FILM_MM: f64 = 5.0;
/// Frames of a press that are compared.
const FRAMES: usize = 40;

impl View {
    /// Serves the twin's page.
    fn start() -> View {
        let mut tool = Command::new(artifact::named_by("HIVTAC_TOOL"));
        let (process, address) = artifact::ready(tool.args(["view", "--twin"]));
        View { process, address }
    }
}

/// Returns the place in the page, px, of a place on the film, mm.
fn on_page(browser: &mut Browser, [x, y]: [f64; 2]) -> [f64; 2] {
    let film = part("film");
    browser
        .value(&format!("{film}.scrollIntoView({{block: 'center'}})"))
        .unwrap();
    let sides = ["left", "top", "width", "height"].map(|side| {
        let side = format!("{film}.getBoundingClientRect().{side}");
        browser.value(&side).unwrap().as_f64().unwrap()
    });
    let [left, top, width, height] = sides;
    let at = |mm: f64, start: f64, length: f64| start + (mm / FILM_MM + 1.0) / 2.0 * length;
    [at(x, left, width), at(y, top, height)]
}

/// Returns the page's comparison once its truth meets a condition.
fn compared(browser: &mut Browser, condition: &str) -> Value {
    let compared = format!("{}.dataset.compared", part("truth"));
    let is = format!(
        "(() => {{ const shown = {compared}; if (!shown) return null; \
         const {{ truth, force, frame }} = JSON.parse(shown); \
         return ({condition}) ? shown : null; }})()"
    );
    let shown = browser.until(&is).unwrap();
    serde_json::from_str(shown.as_str().unwrap()).unwrap()
}

/// Returns |sensed − true| over the stated standard uncertainty, of |F|, both angles and both
/// coordinates of the place.
fn ratios(shown: &Value) -> Vec<f64> {
    let (truth, force) = (&shown["truth"], &shown["force"]);
    let number = |value: &Value| value.as_f64().unwrap();
    let one_axis = number(&force["directionSigma"]) * std::f64::consts::FRAC_1_SQRT_2;
    let ratio =
        |own: &Value, sensed: &Value, sigma: f64| (number(own) - number(sensed)).abs() / sigma;
    let (place, sensed) = (&truth["place"], &force["place"]);
    let place_sigma = number(&sensed["sigma"]);
    vec![
        ratio(
            &truth["magnitude"],
            &force["magnitude"],
            number(&force["magnitudeSigma"]),
        ),
        ratio(&truth["alpha"], &force["alpha"], one_axis),
        ratio(&truth["beta"], &force["beta"], one_axis),
        ratio(&place["x"], &sensed["x"], place_sigma),
        ratio(&place["y"], &sensed["y"], place_sigma),
    ]
}

#[test]
#[ignore = "slow, and needs Chromium: run by cargo xtask test --all"]
fn a_press_by_the_pointer_is_read_within_three_sigma() {
    let view = View::start();
    let mut browser = Browser::open(&view.address, PAGE).unwrap();
    press(&mut browser, "view-twin.png");
}

/// Presses the film of a page by the pointer, and compares the sensed force with the truth. It
/// keeps a screenshot of this name in `HIVTAC_SCREENSHOTS`.
pub fn press(browser: &mut Browser, screenshot: &str) {
    browser
        .until(&format!("{} && !{}.hidden", part("truth"), part("truth")))
        .unwrap();
    compared(browser, "truth.magnitude === 0");
    let at = on_page(browser, [1.5, -1.0]);
    browser.pointer("mousePressed", at, false).unwrap();
    let steady = "truth.magnitude > 99.9 && force !== null";
    let mut all = Vec::new();
    let mut last = 0.0;
    for _ in 0..FRAMES {
        let shown = compared(browser, &format!("{steady} && frame > {last}"));
        last = shown["frame"].as_f64().unwrap();
        let place = &shown["truth"]["place"];
        for (axis, expected) in [("x", 1.5), ("y", -1.0)] {
            let off = (place[axis].as_f64().unwrap() - expected).abs();
            assert!(off < 0.05, "{shown}");
        }
        all.extend(ratios(&shown));
    }
    let within = all.iter().filter(|ratio| **ratio < 3.0).count();
    assert!(
        within * 100 >= all.len() * 98,
        "{within} of {}: {all:?}",
        all.len()
    );
    // The wheel presses harder, Shift tilts, and the end of the press releases the film.
    browser.wheel(at, -100.0).unwrap();
    compared(browser, "truth.magnitude > 104.9");
    let beside = on_page(browser, [2.5, -1.0]);
    browser.pointer("mouseMoved", beside, true).unwrap();
    let tilted = compared(browser, "truth.alpha > 3.9");
    assert!(
        (tilted["truth"]["place"]["x"].as_f64().unwrap() - 1.5).abs() < 0.05,
        "{tilted}"
    );
    if let Some(folder) = env::var_os("HIVTAC_SCREENSHOTS").map(PathBuf::from) {
        browser.keep(&folder.join(screenshot)).unwrap();
    }
    browser.pointer("mouseReleased", beside, false).unwrap();
    compared(browser, "truth.magnitude === 0");
}
