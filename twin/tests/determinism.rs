//! Tests that a frame has the same bytes in every run and on every machine.

use hivtac_twin::{Format, Frame, Mounting, Options, Paint, Patch, Preset, Scene};

/// Returns FNV-1a over the pixels.
fn checksum(frame: &Frame) -> u64 {
    let words = frame.pixels.iter().flat_map(|pixel| pixel.to_le_bytes());
    let bytes = words.chain(frame.mono.iter().copied());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}

fn demo(preset: Preset, width: u32, seed: u64) -> Scene {
    Scene::preset("demo", preset, width, width / 4 * 3, seed).unwrap()
}

/// Returns one checksum over twelve frames of the demo.
fn film_strip(scene: &Scene) -> u64 {
    let frames = (0..12).map(|n| scene.frame(n, n as f64 / 30.0));
    frames.fold(0, |sum, frame| sum.rotate_left(5) ^ checksum(&frame))
}

#[test]
fn frames_are_these_bytes_everywhere() {
    let strips = [
        (Preset::Paper, 320),
        (Preset::Paper, 800),
        (Preset::Ov7725, 320),
        (Preset::Ov7725, 800),
    ]
    .map(|(preset, width)| film_strip(&demo(preset, width, 1)));
    let expected = [
        0x2b5c_2ee8_1669_c4c3,
        0x8048_2006_839e_9224,
        0xe16e_0251_984c_4aa3,
        0x794a_f60b_fb9f_1ef9,
    ];
    assert_eq!(strips, expected, "{strips:#018x?}");
}

#[test]
fn other_formats_are_these_bytes_everywhere() {
    let formats = [
        (Format::Yuv422, 0xf739_a950_30ca_badf),
        (Format::Mono, 0x8b27_25d6_e5b1_09b4),
        #[cfg(feature = "jpeg")]
        (Format::Jpeg { quality: 85 }, 0x3ca0_3e4a_c806_d686),
    ];
    let (strips, expected): (Vec<u64>, Vec<u64>) = formats
        .into_iter()
        .map(|(format, expected)| {
            let options = Options {
                format,
                ..Options::default()
            };
            let scene = demo(Preset::Ov7725, 320, 1).with_options(options).unwrap();
            (film_strip(&scene), expected)
        })
        .unzip();
    assert_eq!(strips, expected, "{strips:#018x?}");
}

#[test]
fn hard_frames_are_these_bytes_everywhere() {
    let options = Options {
        gain: 0.4,
        gradient: [0.3, -0.2],
        falloff: 0.5,
        noise: 10.0,
        missing: [false, false, true, false].into(),
        patches: vec![Patch {
            centre_mm: [1.5, -3.0],
            radius_mm: 1.9,
            paint: Paint::Red,
        }],
        mounting: Mounting {
            shift_px: [3.25, -7.5],
            roll_deg: 4.0,
        },
        ..Options::default()
    };
    let strip = film_strip(&demo(Preset::Ov7725, 320, 7).with_options(options).unwrap());
    assert_eq!(strip, 0xbbeb_e05c_f687_1a3d, "{strip:#018x}");
}

#[test]
fn truth_is_the_same_with_and_without_a_picture() {
    let scene = demo(Preset::Ov7725, 320, 3);
    for number in 0..30 {
        let time_s = number as f64 / 30.0;
        let frame = scene.frame(number, time_s);
        assert_eq!(frame.truth, scene.truth(time_s));
        assert_eq!(
            scene.render_load(&frame.truth.force, number).unwrap(),
            frame
        );
    }
}

#[test]
fn noise_differs_by_seed_and_by_frame() {
    let frame = |seed, number| checksum(&demo(Preset::Ov7725, 160, seed).frame(number, 0.0));
    let sums = [frame(1, 0), frame(1, 1), frame(2, 0), frame(2, 1)];
    for (i, a) in sums.iter().enumerate() {
        assert!(!sums[..i].contains(a), "frames {sums:x?}");
    }
    assert_eq!(frame(1, 1), sums[1]);
}
