//! A whole sweep, very small.

use super::plan::CENTROIDS;
use super::table::Reach;
use super::*;

fn tiny() -> Plan {
    let all = Estimator::all();
    Plan {
        sizes: vec![[320, 240]],
        estimators: vec![all[0].clone(), all[2].clone()],
        paper_sizes: Vec::new(),
        rows: 150,
        seeds: 2,
        epochs: [2, 1],
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
    let closed_form = |centroid: usize| {
        let of_it = results
            .finished
            .iter()
            .find(|f| f.task.estimator.hidden.is_empty() && f.task.centroid == CENTROIDS[centroid]);
        of_it.unwrap().figures[1].1
    };
    let (binary, weighted) = (closed_form(0), closed_form(1));
    assert!(
        weighted.frames > 20 && weighted.frames <= 30,
        "{weighted:?}"
    );
    assert!(
        weighted.strong_direction_deg < 0.6 * binary.strong_direction_deg,
        "{weighted:?} {binary:?}"
    );
    assert!(weighted.strong_direction_deg < 0.4 && weighted.force_rmse_mn < 1.0);
    let (_, seen) = results.seen[0];
    assert_eq!(
        (seen.frames, seen.rejected, seen.windows_differ),
        (150, [0; 2], [0; 2])
    );

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
    let bytes = fs::read(folder.join("models/default.hvtm")).unwrap();
    let model = hivtac_sensing::model::Model::parse(&bytes).unwrap();
    assert_eq!(model.conditions.centroid, picked.centroid.to_model());
    let hidden: Vec<String> = picked
        .estimator
        .hidden
        .iter()
        .map(usize::to_string)
        .collect();
    let name = format!("closed form + 11-{}-3 ov7725", hidden.join("-"));
    assert!(picked.estimator.closed_form, "{picked}");
    assert_eq!(model.name().as_str(), name);
}
