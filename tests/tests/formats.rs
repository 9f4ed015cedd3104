//! Tests of markers in frames of the scene's other pixel formats.

use hivtac_sensor::markers::scanner::{ScanSettings, Scanner};
use hivtac_sensor::markers::tables::Pixels;
use hivtac_terms::threshold::{Mono, Yuv422};
use hivtac_twin::{Format, Frame, Load, Options, Preset, Scene};

fn frame(format: Format, load: &Load) -> Frame {
    let options = Options {
        format,
        ..Options::default()
    };
    let scene = Scene::preset("rest", Preset::Ov7725, 320, 240, 7).unwrap();
    let scene = scene.with_options(options).unwrap();
    scene.render_load(load, 3).unwrap()
}

/// Returns the largest error of the four weighted centroids, px.
fn worst_error(pixels: &impl Pixels, rows: &[u16], frame: &Frame) -> f64 {
    let mut scanner = Box::new(Scanner::<64>::new());
    let settings = ScanSettings {
        width: 320,
        height: 240,
        dilations: 1,
        min_area: 40,
        weighted: true,
        max_runs: u32::MAX,
        cleaned: false,
    };
    scanner.begin(settings).unwrap();
    rows.chunks(7 * pixels.row_length(320))
        .for_each(|band| scanner.push_rows(pixels, band));
    let blobs = scanner.finish(pixels).blobs;
    assert_eq!(blobs.len(), 4);
    let errors = frame.truth.markers.iter().map(|truth| {
        let [x, y] = truth.unwrap().centroid_px;
        let found = blobs.iter().filter_map(|blob| blob.weighted_centroid());
        let distances = found.map(|(bx, by)| (bx.to_f64() - x).hypot(by.to_f64() - y));
        distances.fold(f64::INFINITY, f64::min)
    });
    errors.fold(0.0, f64::max)
}

#[test]
fn yuv422_and_mono_show_the_same_markers() {
    for newtons in [0.0, 0.05, 0.2] {
        let load = Load::from_angles(newtons, 4.0, -3.0).unwrap();
        let yuv = frame(Format::Yuv422, &load);
        let error = worst_error(&Yuv422::RED, &yuv.pixels, &yuv);
        assert!(error < 0.5, "YUV422 at {newtons} N: {error} px");
        let mono = frame(Format::Mono, &load);
        let error = worst_error(&Mono::DARK, &mono.words(), &mono);
        assert!(error < 0.15, "mono at {newtons} N: {error} px");
    }
}
