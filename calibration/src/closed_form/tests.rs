use super::*;
use hivtac_sensing::closed_form::MAX_KNOTS;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const REST: [f64; INPUTS] = [
    100.0, 60.0, 220.0, 60.0, 220.0, 180.0, 100.0, 180.0, 160.0, 120.0, 14_400.0,
];

/// Where the markers are under a force on a made-up film: F_z = −0.2·ρ², 60 px of shift per newton.
fn features(force: [f64; 3]) -> [f64; INPUTS] {
    let radius = 40.0 * (-force[2] / 0.2).sqrt();
    let directions = directions(&REST).unwrap();
    let mut features = REST;
    for k in 0..4 {
        for axis in 0..2 {
            features[2 * k + axis] += radius * directions[k][axis] + 60.0 * force[axis];
        }
    }
    features
}

fn rows(count: usize, seed: u64) -> Vec<([f64; INPUTS], [f64; 3])> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut row = || {
        let size: f64 = random.random_range(0.005..0.2);
        let force = [
            size * random.random_range(-0.17..0.17),
            size * random.random_range(-0.14..0.14),
            -size,
        ];
        (features(force), force)
    };
    // Beyond the largest radius there is no answer: one load is the largest.
    let largest = [0.03, 0.02, -0.2];
    (1..count)
        .map(|_| row())
        .chain([(features(largest), largest)])
        .collect()
}

fn worst_n(form: &ClosedForm) -> f64 {
    let error = |(features, force): &([f64; INPUTS], [f64; 3])| {
        let found = form.force_n(features, &REST);
        found
            .iter()
            .zip(force)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f64::max)
    };
    rows(500, 99).iter().map(error).fold(0.0, f64::max)
}

#[test]
fn a_film_of_its_kind_is_found_exactly() {
    let many = fit(&REST, &rows(400, 1), Effort::Many).unwrap();
    assert!(worst_n(&many) < 1e-6, "{}", worst_n(&many));
    let few = fit(&REST, &rows(10, 1), Effort::Few).unwrap();
    assert!(worst_n(&few) < 1e-4, "{}", worst_n(&few));
}

#[test]
fn loads_that_say_too_little_are_refused() {
    let straight = ([0.01, 0.02, 0.1, 0.2]).map(|f| (features([0.0, 0.0, -f]), [0.0, 0.0, -f]));
    let error = fit(&REST, &straight, Effort::Few).unwrap_err().to_string();
    assert!(error.contains("tilted"), "{error}");
    assert!(fit(&REST, &[(REST, [0.0; 3])], Effort::Few).is_err());
    assert!(directions(&[7.0; INPUTS]).is_err());
}

#[test]
fn the_chip_gives_the_same_forces() {
    let form = fit(&REST, &rows(400, 1), Effort::Many).unwrap();
    let spec = form.to_chip().unwrap();
    assert!(spec.knots.len() <= MAX_KNOTS && spec.knots.len() > KNOTS / 2);
    assert_eq!(spec.knots[0][0], 0);
    let step = f64::from(1_u32 << spec.step_bits) / 65_536.0;
    let last = (spec.knots.len() - 1) as f64 * step;
    assert!(last >= form.radius_px && last < form.radius_px + step);
    for (i, knot) in spec.knots.iter().enumerate() {
        let [g, h, k] = form.curves((i as f64 * step / form.radius_px).min(1.0));
        assert!((f64::from(knot[0]) / 1e6 - g).abs() < 1e-6);
        assert!((f64::from(knot[1]) / 256e6 - h).abs() < 1e-8);
        assert!((f64::from(knot[2]) / 256e6 - k).abs() < 1e-8);
    }
}

#[test]
fn what_the_chip_cannot_hold_is_refused() {
    let form = fit(&REST, &rows(400, 1), Effort::Many).unwrap();
    let refused = |change: fn(&mut ClosedForm), words: &str| {
        let mut form = form.clone();
        change(&mut form);
        let error = form.to_chip().unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    };
    refused(|f| f.h[0] = 1e3, "too steep");
    refused(|f| f.g[0] = f64::NAN, "finite");
    refused(|f| f.radius_px = 0.0, "radius_px");
    refused(|f| f.radius_px = 1e5, "8000 px");
    refused(|f| f.directions[1] = [1.0, 1.0], "unit");
    let mut falling = form.clone();
    falling.g = vec![1.0, -0.9];
    let knots = falling.to_chip().unwrap().knots;
    assert!(knots.windows(2).all(|pair| pair[0][0] <= pair[1][0]));
}
