//! Tests of scene files: they follow `docs/scene-file.md`, and bad files give clear errors.

use std::collections::BTreeSet;

use hivtac_twin::{Format, Motion, Paint, Preset, Scene};

const DOCUMENT: &str = include_str!("../../docs/scene-file.md");

fn said_of(text: &str) -> String {
    Scene::from_toml(text).unwrap_err().to_string()
}

/// Returns the example of the document.
fn example() -> &'static str {
    let (_, rest) = DOCUMENT.split_once("```toml\n").unwrap();
    rest.split_once("```").unwrap().0
}

#[test]
fn an_empty_file_is_the_nominal_sensor_at_rest() {
    let nominal = Scene::preset("rest", Preset::Ov7725, 320, 240, 0).unwrap();
    assert_eq!(Scene::from_toml(""), Ok(nominal));
}

#[test]
fn the_documents_example_is_what_it_says() {
    let scene = Scene::from_toml(example()).unwrap();
    let options = scene.options();
    assert_eq!(options.missing, [false, false, true, false]);
    assert_eq!(options.mounting.shift_px, [1.5, -2.0]);
    assert_eq!(options.patches.len(), 2);
    assert_eq!(options.patches[0].paint, Paint::Glare);
    assert_eq!(options.shutter.readout_s, 0.0154);
    assert_eq!(
        (options.gain, options.white_balance),
        (0.8, [1.1, 1.0, 0.9])
    );
    let Motion::Press(press) = scene.motion() else {
        panic!("{:?}", scene.motion());
    };
    assert_eq!(
        (press.force_n, press.alpha_deg, press.beta_deg),
        (0.18, 5.0, -3.0)
    );
    assert_eq!(scene.frame(1, 1.0).truth.force.magnitude_n(), 0.18);
}

/// Returns the sections of the document with their rows: key, default.
fn documented() -> Vec<(String, Vec<(String, String)>)> {
    let (_, keys) = DOCUMENT.split_once("## Keys").unwrap();
    let sections = keys.split("\n### ").map(|section| {
        let name = section
            .lines()
            .next()
            .unwrap()
            .trim_matches(['`', '[', ']']);
        let rows = section.lines().filter_map(|line| {
            let cells: Vec<&str> = line.strip_prefix("| `")?.split(" | ").collect();
            let key = cells[0].trim_end_matches('`');
            Some((key.to_owned(), cells[1].trim_matches('`').to_owned()))
        });
        (name.to_owned(), rows.collect())
    });
    sections.collect()
}

/// Returns a file with one line in a section.
fn with_line(section: &str, line: &str) -> String {
    match section {
        "" => line.to_owned(),
        "marks.patch" | "room.thing" => format!("[[{section}]]\n{line}"),
        _ => format!("[{section}]\n{line}"),
    }
}

/// Returns the keys of a section, as the error for an unknown key lists them.
fn known(section: &str) -> BTreeSet<String> {
    let said = said_of(&with_line(section, "no_such_key = 1"));
    let (_, expected) = said.split_once("expected").expect(&said);
    let words = expected.split('`').skip(1).step_by(2);
    words.map(str::to_owned).collect()
}

#[test]
fn every_key_is_documented_and_every_documented_key_is_one() {
    let sections = documented();
    assert_eq!(sections.len(), 21);
    let names: BTreeSet<&str> = sections.iter().map(|(name, _)| name.as_str()).collect();
    for (name, rows) in &sections {
        let mut rows: BTreeSet<String> = rows.iter().map(|(key, _)| key.clone()).collect();
        // Tables in this section have a section of their own.
        let inner = |key: &String| match name.as_str() {
            "" => key.clone(),
            _ => format!("{name}.{key}"),
        };
        let known = known(name);
        rows.extend(
            known
                .iter()
                .filter(|key| names.contains(&*inner(key)))
                .cloned(),
        );
        assert_eq!(rows, known, "[{name}]");
    }
}

#[test]
fn documented_defaults_change_nothing() {
    let nominal = Scene::from_toml("").unwrap();
    for (section, rows) in documented() {
        for (key, default) in rows {
            if ["–", "the preset's"].contains(&&*default) || key == "jpeg_quality" {
                continue;
            }
            let line = format!("{key} = {}", default.replace('−', "-"));
            let text = with_line(&section, &line);
            let (text, expected) = match section.strip_prefix("load.") {
                None => (text, nominal.clone()),
                Some(motion) => {
                    let chosen = format!("[load]\nmotion = \"{motion}\"\n");
                    (chosen.clone() + &text, Scene::from_toml(&chosen).unwrap())
                }
            };
            // A scene is too long to be printed.
            assert!(Scene::from_toml(&text) == Ok(expected), "{text}");
        }
    }
}

#[test]
fn errors_name_line_key_value_and_what_is_possible() {
    let cases: [(&str, &[&str]); 25] = [
        ("[light]\ngian = 1", &["line 2", "gian", "`gain`"]),
        ("[ligth]\ngain = 1", &["line 1", "ligth", "`light`"]),
        (
            "seed = 1\n[light]\n\ngain = 5.5",
            &["line 4, light.gain", "5.5", "0 to 4"],
        ),
        (
            "[light]\nwhite_balance = [1.0, 4.5, 1.0]",
            &["line 2, light.white_balance", "4.5"],
        ),
        ("[light]\ngain = \"much\"", &["line 2", "much", "f64"]),
        ("[light]\ngain = nan", &["gain", "NaN", "0 to 4"]),
        (
            "[camera]\nwidth = 321",
            &["line 2, camera.width", "321×240", "4:3"],
        ),
        (
            "[camera]\npreset = \"ov7670\"",
            &["line 2", "ov7670", "`paper`"],
        ),
        (
            "[camera]\njpeg_quality = 50",
            &["line 2, camera.jpeg_quality", "rgb565"],
        ),
        (
            "[camera]\nformat = \"jpeg\"\njpeg_quality = 0",
            &["line 3, camera.jpeg_quality", "1 to 100"],
        ),
        (
            "[marks]\nmissing = [4]",
            &["line 2, marks.missing", "0 to 3"],
        ),
        (
            "[[marks.patch]]\nradius_mm = 0.5\ncentre_mm = [1, 1]\npaint = \
             \"red\"\n[[marks.patch]]\nradius_mm = 0\ncentre_mm = [1, 1]\npaint = \"red\"",
            &["line 6, marks.patch.radius_mm", "0.01 to 10"],
        ),
        (
            "[load]\nmotion = \"drag\"\n[load.press]\nforce_n = 0.1",
            &["line 3, load.press", "load.motion is \"press\""],
        ),
        (
            "[load]\nmotion = \"press\"\npress.force_n = 0.99",
            &["line 1, load", "press less"],
        ),
        (
            "[load]\nmotion = \"vibration\"\nvibration.amplitude_n = 0.2",
            &["line 3, load.vibration.amplitude_n", "0 to 0.1"],
        ),
        ("[light\ngain = 1", &["line 1"]),
        (
            "[film]\nunit.thickness = 3",
            &["line 1, film", "0.7 to 1.3"],
        ),
        (
            "[film]\ncreep.parts = [0.05, 0.16]",
            &["line 2, film.creep.parts", "0 to 0.15"],
        ),
        (
            "[film]\ncreep.parts = [0.1, 0.1]\n[load]\nmotion = \"press\"\npress.force_n = 0.24",
            &["line 3, load", "0.251", "press less"],
        ),
        ("[film]\ncontact = \"glue\"", &["line 2", "glue", "stick"]),
        (
            "[room]\ntransmission = 1.5",
            &["line 2, room.transmission", "0 to 1"],
        ),
        (
            "[room]\nbrightness = 2",
            &["line 1, room", "give a `transmission`"],
        ),
        (
            "[[room.thing]]\ncentre_mm = [0, 0]\nradius_mm = 11\npaint = \"red\"\n[room]\n\
             transmission = 0.5",
            &["line 3, room.thing.radius_mm", "0.01 to 10"],
        ),
        (
            "[light]\nboard_leds_mm = 1",
            &["line 2, light.board_leds_mm", "4 to 30"],
        ),
        (
            "[camera]\npreset = \"mt9v034\"\nbayer = true",
            &["line 3, camera.bayer", "without colours"],
        ),
    ];
    for (text, words) in cases {
        let said = said_of(text);
        for word in words {
            assert!(said.contains(word), "{text}\n{said}\nwithout {word}");
        }
    }
}

#[test]
fn formats_by_name() {
    let format = |line: &str| {
        let scene = Scene::from_toml(&format!("[camera]\n{line}")).unwrap();
        scene.options().format
    };
    assert_eq!(format("format = \"yuv422\""), Format::Yuv422);
    assert_eq!(format("format = \"mono\""), Format::Mono);
    let quality = 85;
    assert_eq!(format("format = \"jpeg\""), Format::Jpeg { quality });
}

/// The picture of an OV5640 is that of an OV7725 but for its noise, which a file may set.
#[test]
fn an_ov5640_is_an_ov7725_with_more_noise() {
    let scene = |text: &str| Scene::from_toml(text).unwrap();
    let [usual, other] = ["ov7725", "ov5640"].map(|name| {
        let scene = scene(&format!("[camera]\npreset = \"{name}\"\n"));
        (scene.camera().focal_px(), scene.options().noise)
    });
    assert_eq!([usual, other], [(175.0, 2.5), (175.0, 4.0)]);
    let set = scene("[camera]\npreset = \"ov5640\"\n[noise]\nnoise = 1.0\n");
    assert_eq!(set.options().noise, 1.0);
}
