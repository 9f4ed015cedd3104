use hivtac_calibration::data::dataset::{MarkerDetector, Recipe, Sensing};

use super::*;

/// The whole study, small, without OpenCV: the sensing with the paper's binary centroids stands in
/// for it.
#[test]
fn a_small_comparison_runs_and_goes_on_where_it_was() {
    let directory = tempfile::tempdir().unwrap();
    let args = PeersArgs {
        contacts: vec![Contact::Force],
        sizes: vec!["320x240".parse().unwrap(), "160x120".parse().unwrap()],
        preset: Preset::Paper,
        training: 2,
        test: 2,
        epochs: 12,
        hidden: vec![24, 24],
        our_epochs: 300,
        our_rounded_epochs: 30,
        folder: directory.path().into(),
        kept_frames: false,
        json: None,
        document: None,
    };
    let detector = |width, height| -> Result<Box<dyn MarkerDetector>> {
        let recipe = Recipe {
            preset: Preset::Paper,
            width,
            height,
            centroid: hivtac_terms::conditions::CentroidEstimator::BinaryMask,
            ..Recipe::default()
        };
        Ok(Box::new(Sensing::unmodelled(&recipe)?))
    };
    let comparisons = args.compare(&detector).unwrap();
    let [comparison] = &comparisons[..] else {
        panic!("one reading")
    };
    assert_eq!((comparison.test_frames, comparison.cells.len()), (142, 14));
    assert!(comparison.common_frames > 100, "{comparison:?}");
    let ours = |size: &str| {
        let mut cells = comparison.cells.iter();
        cells
            .find(|c| c.size == size && c.model == "64-64 int16")
            .unwrap()
    };
    assert!(ours("320x240").strong_direction_deg < 0.5, "{comparison:?}");
    assert!(ours("320x240").direction_deg < ours("160x120").direction_deg);
    let limits = &comparison.limits[0].1;
    assert_eq!(
        (comparison.limits.len(), limits.len()),
        (2, 0),
        "too few frames for a limit"
    );
    let text = table::markdown(&comparisons);
    assert!(text.contains("| 160x120 | the paper's |"), "{text}");

    let again = args.compare(&detector).unwrap();
    assert_eq!(table::markdown(&again), text);
    let blind = |_, _| -> Result<Box<dyn MarkerDetector>> { anyhow::bail!("nothing is rendered") };
    let kept = PeersArgs {
        kept_frames: true,
        ..args
    };
    assert_eq!(table::markdown(&kept.compare(&blind).unwrap()), text);
}
