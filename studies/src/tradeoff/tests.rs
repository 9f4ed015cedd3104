//! A whole sweep, very small.

use super::plan::{CENTROIDS, Estimator, Numbers};
use super::table::Reach;
use super::*;

fn tiny() -> Plan {
    let all = Estimator::all();
    Plan {
        sizes: vec![[320, 240]],
        estimators: all[..2].to_vec(),
        paper_sizes: Vec::new(),
        rows: 1_200,
        seeds: 2,
        epochs: [40, 5],
        ..Plan::default()
    }
}

#[test]
fn a_sweep_finds_what_is_known_of_centroids_and_goes_on_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let (file, work) = (
        folder.path().join("results.jsonl"),
        folder.path().join("work"),
    );
    let mut results = Results::open(&file, Some(&tiny())).unwrap();
    sweep(&mut results, &work, |_| ()).unwrap();
    assert_eq!(results.finished.len(), CENTROIDS.len() * 2 * 2);
    let smallest = |centroid: usize, steps: usize| {
        let of_it = results
            .finished
            .iter()
            .find(|f| f.task.estimator.hidden == [16; 2] && f.task.centroid == CENTROIDS[centroid]);
        let (numbers, taken, figures) = of_it.unwrap().figures[1 + steps];
        assert_eq!((numbers, usize::from(taken)), (Numbers::Int16, steps));
        figures
    };
    let (alone, binary, weighted) = (smallest(1, 0), smallest(0, 1), smallest(1, 1));
    assert!(
        weighted.frames > 140 && weighted.frames <= 240,
        "{weighted:?}"
    );
    assert!(alone.looks == 0.0 && weighted.looks >= 2.0, "{weighted:?}");
    assert!(
        weighted.strong_direction_deg < 0.2 * alone.strong_direction_deg
            && weighted.place_rmse_um < 30.0,
        "{weighted:?} {alone:?}"
    );
    assert!(
        weighted.strong_direction_deg < 0.6 * binary.strong_direction_deg,
        "{weighted:?} {binary:?}"
    );
    assert!(
        weighted.strong_direction_deg < 0.4 && weighted.force_rmse_mn < 1.0,
        "{weighted:?}"
    );
    let (_, seen) = results.seen[0];
    assert_eq!(seen.frames, 1_200);
    // Some tips far from the middle push a marker out of the picture.
    let few = |rejected: usize| rejected > 0 && rejected * 100 < 8 * seen.frames;
    assert!(seen.rejected.into_iter().all(few), "{seen:?}");

    // Without its last training it finds the same again, from the same frames.
    let text = fs::read_to_string(&file).unwrap();
    let cut = text.trim_end().rfind('\n').unwrap() + 1;
    fs::write(&file, &text[..cut]).unwrap();
    let mut results = Results::open(&file, None).unwrap();
    sweep(&mut results, &work, |_| ()).unwrap();
    assert_eq!(fs::read_to_string(&file).unwrap(), text);
}

#[test]
fn the_committed_results_pick_the_default_model() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let costs = Costs::load(&folder.join("tradeoff/costs.json")).unwrap();
    let results = Results::open(&folder.join("tradeoff/results.jsonl"), None).unwrap();
    let missing = results
        .plan
        .sizes
        .iter()
        .flat_map(|&size| results.missing(size));
    assert_eq!(missing.count(), 0);
    let all = configurations(&results, &costs).unwrap();
    let picked = best(&all, &Limits::default()).unwrap();
    assert_eq!(picked.reach(), Reach::Firmware);
    let bytes = fs::read(folder.join("../calibration/models/default.hvtm")).unwrap();
    let model = hivtac_sensor::force::model::Model::parse(&bytes).unwrap();
    assert_eq!(model.conditions.centroid, picked.centroid);
    let name = format!("11-{}-5 ov7725", picked.estimator);
    assert_eq!(model.name().as_str(), name);
    assert_eq!(model.forward.map_or(0, |film| film.steps), picked.steps);
}
