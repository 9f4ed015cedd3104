//! Tests that the sensing gives the same bits on a Cortex-M7, emulated by QEMU, and on this
//! computer; with all tests, on a Cortex-M55, too.

use hivtac_sensor::force::features::Features;
use hivtac_sensor::force::forward::MOST_STEPS;
use hivtac_sensor::force::layer::MAX_WIDTH;
use hivtac_sensor::force::model::{Model, OutputKind};
use hivtac_sensor::force::rest::Rest;
use hivtac_terms::fixed::Q;
use hivtac_terms::marker::Marker;
use hivtac_terms::threshold::{ByteOrder, HsvBox, PixelFormat, Threshold};
use hivtac_terms::threshold::{Mono, Yuv422};
use hivtac_terms::units::Px;
use hivtac_tests::models::{self, Weights};
use hivtac_tests::pictures::{self, Random};
use hivtac_tests::qemu::{self, Core};
use hivtac_tests::script::Script;
use hivtac_twin::{Dots, Format, Load, Options, Preset, Scene};

/// Runs a script on this computer and on each emulated core, and compares their output, byte for
/// byte. Returns the text for further checks.
fn same_on_all(script: &Script) -> String {
    let host = qemu::run_on_host(script).unwrap();
    for core in Core::wanted() {
        let emulated = qemu::run(core, script).unwrap();
        if let Some(difference) = qemu::first_difference(&host, &emulated) {
            panic!("host (left) and {core:?} (right) differ at {difference}");
        }
    }
    assert!(!host.is_empty(), "the script printed nothing");
    host
}

fn red(script: &mut Script, order: ByteOrder) {
    script.threshold(HsvBox::RED, order);
}

fn loads() -> Vec<Load> {
    let mut loads = vec![Load::REST];
    for newtons in [0.01, 0.05, 0.1, 0.2] {
        for (alpha, beta) in [(0.0, 0.0), (8.0, -6.0), (-8.0, 6.0)] {
            loads.push(Load::from_angles(newtons, alpha, beta).unwrap());
        }
    }
    loads
}

/// The other tests leave the Cortex-M55 out if nothing names its image.
#[test]
#[ignore = "all tests: its target is one more download"]
fn the_cortex_m55_is_among_the_cores() {
    assert!(Core::wanted().contains(&Core::M55));
}

#[test]
fn frames_of_the_scene_give_the_same_forces() {
    let scene = Scene::preset("rest", Preset::Ov7725, 320, 240, 7).unwrap();
    let frames: Vec<_> = (0..)
        .zip(loads())
        .map(|(number, load)| scene.render_load(&load, number).unwrap().pixels)
        .collect();
    let frames: Vec<&[u16]> = frames.iter().map(Vec::as_slice).collect();
    let mut script = Script::new();
    for output in [
        OutputKind::ForceVector,
        OutputKind::AnglesMagnitude,
        OutputKind::ForceAndPlace,
    ] {
        let widths = [11, 64, 64, output.count() as u16];
        script.model(&models::file(&widths, Weights::Random, output, 3));
        for order in [ByteOrder::Native, ByteOrder::Swapped] {
            red(&mut script, order);
            script.sense(320, &frames);
        }
    }
    script.model(&models::weighted_file(
        PixelFormat::Rgb565,
        &[11, 64, 64, 3],
        Weights::Random,
        OutputKind::ForceVector,
        3,
    ));
    script.sense(320, &frames);
    let text = same_on_all(&script);
    let forces = text
        .lines()
        .filter(|line| line.contains("force: Some"))
        .count();
    assert_eq!(forces, 7 * frames.len(), "every frame has a force:\n{text}");
}

/// Three frames of one needle on eight dots, then three of two.
#[test]
fn frames_of_eight_dots_give_the_same_contacts() {
    let scene = Scene::preset("rest", Preset::Ov7725, 320, 240, 7).unwrap();
    let with_dots = |moved_mm| {
        let options = Options {
            layout: "8v".parse().unwrap(),
            moved_mm,
            ..scene.options().clone()
        };
        scene.clone().with_options(options).unwrap()
    };
    let load = Load::from_angles(0.1, 4.0, -3.0).unwrap();
    let load = load.with_offset_mm([1.5, -2.25]).unwrap();
    let one = with_dots(None);
    let two = with_dots(Some(Dots::of(models::UNDER_TWO_MM)));
    let one = (0..3).map(|number| one.render_load(&load, number).unwrap().pixels);
    let two = (3..6).map(|number| two.frame(number, 1.0).pixels);
    let frames: Vec<_> = one.chain(two).collect();
    let frames: Vec<&[u16]> = frames.iter().map(Vec::as_slice).collect();
    let mut script = Script::new();
    script.model(&models::eight_dots());
    red(&mut script, ByteOrder::Swapped);
    script.sense(320, &frames);
    let text = same_on_all(&script);
    let count = |what: &str| text.lines().filter(|line| line.contains(what)).count();
    assert_eq!(count("force: Some"), frames.len(), "{text}");
    assert_eq!(count("contacts: []"), 3, "{text}");
}

#[test]
fn frames_without_a_force_give_the_same_reasons() {
    let missing = Options {
        missing: [false, true, false, false].into(),
        ..Options::default()
    };
    let dark = Options {
        gain: 0.2,
        ..Options::default()
    };
    let mut frames = vec![
        pictures::plain(320, 240, pictures::RED),
        pictures::plain(320, 240, pictures::BLACK),
        pictures::checkerboard(320, 240),
        pictures::discs_on_borders(320, 240, 6),
        pictures::noise(320, 240, 5),
    ];
    for options in [missing, dark] {
        let scene = Scene::preset("static", Preset::Ov7725, 320, 240, 11).unwrap();
        frames.push(scene.with_options(options).unwrap().frame(1, 1.0).pixels);
    }
    let frames: Vec<&[u16]> = frames.iter().map(Vec::as_slice).collect();
    let mut script = Script::new();
    red(&mut script, ByteOrder::Swapped);
    script.sense(320, &frames);
    script.model(&models::file(
        &[11, 64, 64, 3],
        Weights::Random,
        OutputKind::ForceVector,
        3,
    ));
    script.sense(320, &frames);
    let text = same_on_all(&script);
    assert!(
        !text.contains("force: Some"),
        "no such frame has a force:\n{text}"
    );
}

#[test]
fn blobs_of_extreme_pictures_are_the_same() {
    let mut script = Script::new();
    script.weighted_threshold(HsvBox::RED, ByteOrder::Native);
    for (width, height) in [
        (320, 240),
        (800, 600),
        (1, 1),
        (31, 7),
        (33, 2),
        (800, 1),
        (1, 800),
    ] {
        let pictures = [
            pictures::plain(width, height, pictures::RED),
            pictures::plain(width, height, pictures::BLACK),
            pictures::checkerboard(width, height),
            pictures::stripes(width, height),
            pictures::comb(width, height),
            pictures::discs_on_borders(width, height, 6),
            pictures::noise(width, height, 1),
            pictures::salted(pictures::plain(width, height, 0), 5, 2),
        ];
        for (pixels, dilations) in pictures.iter().zip([0, 2, 0, 0, 0, 2, 0, 3]) {
            script.scan(width, pixels, dilations, 1);
            script.scan(width, pixels, 1, 1);
        }
    }
    let text = same_on_all(&script);
    // All pixels are red, 800 × 600, with one dilation or none: Σx² is the largest of all moments.
    let sum_xx: u64 = 600 * (0..800_u64).map(|x| x * x).sum::<u64>();
    assert!(text.contains(&format!("sum_xx: {sum_xx}")), "{text}");
}

#[test]
fn every_pixel_value_passes_the_same_thresholds() {
    let values: Vec<u16> = (0..=u16::MAX).collect();
    let narrow = HsvBox {
        hue_low: 50,
        hue_high: 70,
        ..HsvBox::RED
    };
    let mut script = Script::new();
    for hsv_box in [HsvBox::RED, narrow] {
        for order in [ByteOrder::Native, ByteOrder::Swapped] {
            script.threshold(hsv_box, order);
            for half in values.chunks(256 * 128) {
                script.scan(256, half, 0, 1);
            }
        }
    }
    same_on_all(&script);
}

#[test]
fn other_formats_pass_the_same_thresholds() {
    let thresholds = [0, 1, 127, 128, 162, 254, 255]
        .map(|cr_low| Threshold::Yuv422(Yuv422 { cr_low }))
        .into_iter()
        .chain(
            [(0, 88), (0, 0), (0, 255), (255, 255), (36, 141), (128, 129)]
                .map(|(low, high)| Threshold::Mono(Mono { low, high })),
        );
    let mut script = Script::new();
    // Every byte at every place of a word of pixels, then random words; rows with whole and partial
    // words of the mask.
    let places = (0..4).flat_map(|place| (0..256_u32).map(move |byte| byte << (8 * place)));
    let every: Vec<u16> = places
        .chain((0..256).map(|byte| byte * 0x0101_0101))
        .flat_map(|word| [word as u16, (word >> 16) as u16])
        .collect();
    for threshold in thresholds {
        script.weighted_threshold(threshold, ByteOrder::Native);
        let words = |width: u16| threshold.format().row_length(width);
        script.scan(64, &every, 0, 1);
        for width in (2..=136).step_by(2).chain([320, 638, 640, 798, 800]) {
            let noise = pictures::noise(width, 3, u64::from(width));
            script.scan(width, &noise[..3 * words(width)], 0, 1);
        }
        for pixel in [0, 0xffff, 0xff00, 0x00ff] {
            let plain = pictures::plain(320, 240, pixel);
            script.scan(320, &plain[..240 * words(320)], 1, 1);
        }
    }
    same_on_all(&script);
}

#[test]
fn frames_in_other_formats_give_the_same_forces() {
    let mut script = Script::new();
    let formats = [
        (Format::Yuv422, PixelFormat::Yuv422),
        (Format::Mono, PixelFormat::Mono),
    ];
    for (rendered, format) in formats {
        let options = Options {
            format: rendered,
            ..Options::default()
        };
        let scene = Scene::preset("rest", Preset::Ov7725, 320, 240, 7).unwrap();
        let scene = scene.with_options(options).unwrap();
        let frames: Vec<_> = (0..)
            .zip(loads())
            .map(|(number, load)| {
                let frame = scene.render_load(&load, number).unwrap();
                frame.words().into_owned()
            })
            .collect();
        let frames: Vec<&[u16]> = frames.iter().map(Vec::as_slice).collect();
        let (widths, weights) = (&[11, 64, 64, 3], Weights::Random);
        let output = OutputKind::ForceVector;
        script.model(&models::weighted_file(format, widths, weights, output, 3));
        script.threshold(Threshold::red(format), ByteOrder::Swapped);
        script.sense(320, &frames);
        // A model of one format does not measure frames of another format.
        script.model(&models::file(widths, weights, output, 3));
        script.sense(320, &frames);
    }
    let text = same_on_all(&script);
    let count = |what: &str| text.lines().filter(|line| line.contains(what)).count();
    assert_eq!(count("force: Some"), 2 * loads().len(), "{text}");
    assert_eq!(count("force: None"), 2 * loads().len(), "{text}");
}

#[test]
fn networks_give_the_same_outputs() {
    let mut script = Script::new();
    let mut random = Random::new(17);
    let kinds = [OutputKind::ForceVector, OutputKind::AnglesMagnitude];
    let small = [
        &[11, 3][..],
        &[11, 64, 64, 3],
        &[11, 1, 37, 3],
        &[11, 512, 512, 3],
        // A block of columns, one less and one more, and incomplete groups of rows.
        &[11, 31, 32, 33, 15, 16, 17, 3],
    ];
    let papers = &[11, 512, 512, 512, 3][..];
    let int8 = [Weights::Random, Weights::Extreme];
    let int16 = [Weights::Wide, Weights::WideExtreme];
    let sets = [(&int8, &small[..]), (&int16, &small), (&int8, &[papers])];
    for (weights, widths) in sets {
        for (&weights, &widths) in weights
            .iter()
            .flat_map(|w| widths.iter().map(move |widths| (w, widths)))
        {
            script.model(&models::file(widths, weights, kinds[widths.len() % 2], 23));
            for _ in 0..8 {
                script.network(&moved(&mut random, 1 << 18), &models::rest());
            }
            script.network(&moved(&mut random, i64::from(i32::MAX)), &models::rest());
            script.network(&models::rest(), &moved(&mut random, i64::from(i32::MAX)));
        }
    }
    let text = same_on_all(&script);
    assert!(
        text.contains("input_saturated: true"),
        "no input met its limit:\n{text}"
    );
    assert!(
        text.contains("input_saturated: false"),
        "every input met its limit:\n{text}"
    );
}

/// Every possible width of a layer, as its rows and as its columns: it covers the remainders of
/// blocks and of groups of rows, with each number at its limit.
#[test]
fn layers_of_every_width_give_the_same_outputs() {
    let mut script = Script::new();
    let mut random = Random::new(41);
    for weights in [Weights::Extreme, Weights::WideExtreme] {
        for width in 1..=MAX_WIDTH as u16 {
            let file = models::file(&[11, width, 3], weights, OutputKind::ForceVector, 5);
            script.model(&file);
            script.network(&moved(&mut random, 1 << 18), &models::rest());
        }
    }
    same_on_all(&script);
}

/// The kernels cannot read the file at this place, but the model still runs.
#[test]
fn networks_of_files_at_any_place_give_the_same_outputs() {
    let mut script = Script::new();
    let mut random = Random::new(31);
    for weights in [Weights::Random, Weights::Wide] {
        let file = models::file(&[11, 40, 21, 3], weights, OutputKind::ForceVector, 5);
        for offset in 0..4 {
            script.model_at(offset, &file);
            script.network(&moved(&mut random, 1 << 18), &models::rest());
        }
    }
    same_on_all(&script);
}

/// Single precision gives the same bits: for markers moved by presses, and anywhere in a picture.
#[test]
fn steps_lead_to_the_same_forces() {
    let mut script = Script::new();
    let mut random = Random::new(41);
    let rest = Model::parse(&models::anywhere(1)).unwrap().rest;
    for steps in 1..=MOST_STEPS {
        script.model(&models::anywhere(steps));
        for farthest in [1 << 10, 1 << 16, 6 << 16, 40 << 16, 400 << 16] {
            for _ in 0..6 {
                script.press(&pressed(&mut random, &rest, farthest), &rest);
            }
        }
    }
    let text = same_on_all(&script);
    let count = |what: &str| text.lines().filter(|line| line.contains(what)).count();
    assert_eq!(count("Force {"), 3 * 5 * 6, "{text}");
}

/// Returns markers of any size that moved away from the middle, or are anywhere.
fn pressed(random: &mut Random, rest: &Rest, farthest: i64) -> [Marker; 4] {
    let outward = random.between(0, farthest);
    core::array::from_fn(|k| {
        let (x, y) = rest.features.centroids[k];
        let mut moved = |at: Px, sign: i64| {
            let by = sign * outward + random.between(-farthest / 8, farthest / 8);
            let there = i64::from(at.0) + by;
            Px(there.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32)
        };
        let (x, y) = (
            moved(x, if k == 1 || k == 2 { 1 } else { -1 }),
            moved(y, if k >= 2 { 1 } else { -1 }),
        );
        let area = random.between(1, 800) as u32;
        Marker { x, y, area }
    })
}

#[test]
fn force_conversions_are_the_same() {
    let mut script = Script::new();
    let mut random = Random::new(29);
    let ends = [i32::MIN, -90_000, -1, 0, 1, 90_000, i32::MAX];
    for a in ends {
        for b in ends {
            for c in ends {
                script.force([a, b, c]);
            }
        }
    }
    for _ in 0..2_000 {
        script.force([0; 3].map(|_| random.between(-250_000, 250_000) as i32));
    }
    same_on_all(&script);
}

/// Returns features that differ from the rest position by up to `distance`, in 1/65,536 px.
fn moved(random: &mut Random, distance: i64) -> Features {
    let rest = models::rest().to_array();
    let limit = |bits: i64| bits.clamp(i64::from(i32::MIN), i64::from(i32::MAX));
    Features::from_array(rest.map(|number| {
        let bits = number.bits() + random.between(-distance, distance);
        Q::from_bits(limit(bits))
    }))
}
