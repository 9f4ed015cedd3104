//! Tests wrong rest positions: `hivtac sense` must refuse them with the reason, or its force must
//! be within three stated standard uncertainties. The units are an unknown one, a calibrated one,
//! and one with a stretched film.

use crate::run::run;
use crate::sense::{Folder, MODEL, json_of, photograph};
use hivtac_twin::{DiscMotion, Frame, Load, Mounting, Options, Preset, Pressed, Scene};
use hivtac_wire::frame::CRC32;
use serde_json::Value;

/// A unit with a film stretched by 2.6 % along x and 2.4 % along y, computed by finite elements,
/// and its model after ten loads. `cargo run --profile tools -p hivtac-studies stretched` of commit
/// 93843376 wrote both.
static STRETCHED: &[u8] = include_bytes!("stretched/model.hvtm");
static FILM: &str = include_str!("stretched/film.json");

/// Forces during a tare, and the force that is measured afterwards, N.
const RESIDUAL_N: [f64; 5] = [5e-4, 1e-3, 1.5e-3, 2e-3, 1e-2];
const PRESS_N: f64 = 0.1;
/// Place of the presses, mm.
const PLACE_MM: [f64; 2] = [1.0, -0.5];
/// Motions of cameras: to the right and down, px, and relative growth of the picture.
const MOTIONS: [([f64; 2], f64); 5] = [
    ([0.1, 0.0], 0.0),
    ([0.0, 0.2], 0.0),
    ([0.3, 0.0], 0.0),
    ([-0.2, 0.2], 0.0),
    ([0.0, 0.0], 3e-3),
];
/// Largest error, in standard uncertainties.
const SIGMAS: f64 = 3.0;

/// A simulated unit and its model.
struct Unit {
    name: &'static str,
    model: Vec<u8>,
    options: Options,
    /// Its film under forces, N; `None` for the nominal film.
    film: Option<Vec<(f64, Pressed)>>,
}

fn units() -> [Unit; 3] {
    let nominal = |name, model| Unit {
        name,
        model,
        options: Options::default(),
        film: None,
    };
    [
        nominal("default", MODEL.to_vec()),
        nominal("calibrated", calibrated()),
        stretched(),
    ]
}

/// The built-in model as a calibrated unit's: origin, unit, and a matching checksum.
fn calibrated() -> Vec<u8> {
    let mut file = MODEL.to_vec();
    file[62] = 1;
    file[64..76].copy_from_slice(b"nominal-unit");
    let end = file.len() - 4;
    let crc = CRC32.checksum(&file[..end]);
    file[end..].copy_from_slice(&crc.to_le_bytes());
    file
}

fn stretched() -> Unit {
    let reported: Value = serde_json::from_str(FILM).unwrap();
    let glued_mm: [[f64; 2]; 4] = serde_json::from_value(reported["glued_mm"].clone()).unwrap();
    let mut options = Options {
        glued_mm: glued_mm.into(),
        mounting: Mounting {
            shift_px: serde_json::from_value(reported["shift_px"].clone()).unwrap(),
            roll_deg: reported["roll_deg"].as_f64().unwrap(),
        },
        ..Options::default()
    };
    options.lens.pitch_um = reported["pitch_um"].as_f64();
    let states = reported["states"].as_array().unwrap().iter();
    Unit {
        name: "stretched",
        model: STRETCHED.to_vec(),
        options,
        film: Some(states.map(state).collect()),
    }
}

/// A force, N, and the film under it.
fn state(reported: &Value) -> (f64, Pressed) {
    let force_n: [f64; 3] = serde_json::from_value(reported["force_n"].clone()).unwrap();
    let centres_mm: [[f64; 2]; 4] = serde_json::from_value(reported["centres_mm"].clone()).unwrap();
    let discs: [[[f64; 3]; 3]; 4] = serde_json::from_value(reported["discs"].clone()).unwrap();
    let pressed = Pressed {
        force_n,
        touches_mm: serde_json::from_value(reported["touches_mm"].clone()).unwrap(),
        centres_mm: centres_mm.into(),
        discs: discs
            .map(|[moved_mm, along_x, along_y]| DiscMotion {
                moved_mm,
                along_x,
                along_y,
            })
            .into(),
        ..Pressed::default()
    };
    (force_n[2].abs(), pressed)
}

impl Unit {
    /// A frame under a straight force, with a camera that shifted, px, and whose picture grew.
    fn frame(&self, force_n: f64, ([right, down], larger): ([f64; 2], f64), number: u64) -> Frame {
        let mut options = self.options.clone();
        let [x, y] = options.mounting.shift_px;
        options.mounting.shift_px = [x + right, y + down];
        options.lens.pitch_um = Some(options.lens.pitch_um.unwrap_or(12.0) / (1.0 + larger));
        let scene = Scene::preset("rest", Preset::Ov7725, 320, 240, 1).unwrap();
        let scene = scene.with_options(options).unwrap();
        let load = match force_n {
            0.0 => Load::REST,
            _ => Load::from_angles(force_n, 0.0, 0.0).unwrap(),
        };
        let load = load.with_offset_mm(PLACE_MM).unwrap();
        let Some(film) = &self.film else {
            return scene.render_load(&load, number).unwrap();
        };
        let near = |(of_n, _): &&(f64, Pressed)| (of_n - force_n).abs() < 1e-6;
        let (_, pressed) = film.iter().find(near).expect("a force of the film's");
        scene.render_pressed(*pressed, &load, number)
    }

    /// The result of `hivtac sense` for a press after a tare.
    fn sense(&self, tare: &Frame, press: &Frame) -> Result<Value, String> {
        let folder = Folder::new();
        let model = folder.path("model.hvtm");
        std::fs::write(&model, &self.model).unwrap();
        let [tare, press] = [("tare.png", tare), ("press.png", press)]
            .map(|(name, frame)| folder.save(name, &photograph(frame)));
        let sense = [
            "sense", "--json", "--model", &model, "--tare", &tare, &press,
        ];
        let done = run(&sense);
        match done.code {
            Some(0) => Ok(json_of(&done)),
            _ => Err(done.stderr),
        }
    }
}

/// The force that a refusal names, mN.
fn millinewtons(why: &str) -> Option<f64> {
    let (_, by) = why.split_once("looks touched, by ")?;
    by.split_once(" mN")?.0.parse().ok()
}

/// The error of the press in stated standard uncertainties, for the part with the largest.
fn off(found: &Value) -> f64 {
    let force = &found["force"];
    assert!(force.is_object(), "{found}");
    let number = |name: &str| force[name].as_f64().unwrap();
    let direction_deg = number("alpha_deg").hypot(number("beta_deg"));
    let place_mm = (number("place_x_mm") - PLACE_MM[0]).hypot(number("place_y_mm") - PLACE_MM[1]);
    let parts = [
        direction_deg / number("direction_sigma_deg"),
        (number("magnitude_n") - PRESS_N).abs() / number("magnitude_sigma_n"),
        place_mm / number("place_sigma_mm"),
    ];
    parts.into_iter().fold(0.0, f64::max)
}

/// Silicone that has not recovered, or a finger. With a calibration the tare is refused, with the
/// force that it looks like. Without one 10 mN are refused, and smaller forces are covered.
#[test]
fn a_tare_of_a_pressed_film_is_refused_or_covered() {
    for unit in units() {
        let press = unit.frame(PRESS_N, ([0.0; 2], 0.0), 2);
        for force_n in RESIDUAL_N {
            let tare = unit.frame(force_n, ([0.0; 2], 0.0), 1);
            let at = format!("{}, {} mN", unit.name, 1e3 * force_n);
            match unit.sense(&tare, &press) {
                Ok(found) => {
                    let is_known = unit.name == "calibrated" || force_n == 1e-2;
                    assert!(!is_known && off(&found) < SIGMAS, "{at}: {found}");
                }
                Err(why) => {
                    let looks_like = 1e-3 * millinewtons(&why).unwrap_or_else(|| panic!("{why}"));
                    assert!((looks_like / force_n - 1.0).abs() < 0.3, "{at}: {why}");
                }
            }
        }
    }
}

/// Cameras that moved after the tare, and before it.
#[test]
fn a_camera_that_moved_is_covered_or_tared() {
    for unit in units() {
        for motion in MOTIONS {
            let press = unit.frame(PRESS_N, motion, 2);
            let at = format!("{}, {motion:?}", unit.name);
            for of in [([0.0; 2], 0.0), motion] {
                let tare = unit.frame(0.0, of, 1);
                let found = unit
                    .sense(&tare, &press)
                    .unwrap_or_else(|why| panic!("{at}: {why}"));
                let off = off(&found);
                assert!(off < SIGMAS, "{at}, tared at {of:?}: {off} σ, {found}");
            }
        }
    }
}
