use hivtac_calibration::unit_fit::{descent::*, load::*, numbers::*, problem::*, seen::View};
use hivtac_scene::{Camera, MARKERS, Preset};
use hivtac_shell::{Design, Film, Law};
use rand::{Rng, SeedableRng};
use std::time::Instant;

fn main() {
    let arg = |n: usize, d: f64| std::env::args().nth(n).map_or(d, |a| a.parse().unwrap());
    let (fineness, truth_fineness, seed, extra) = (arg(1, 0.4), arg(2, 0.7), arg(3, 1.0) as u64, arg(4, 0.0) as usize);
    let camera = Camera::new(Preset::Ov7725, 320, 240).unwrap();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut rng2 = rand_chacha::ChaCha8Rng::seed_from_u64(seed + 1000);
    let mut normal = move || (0..12).map(|_| rng.random_range(-0.5..0.5)).sum::<f64>();
    let mut u = move |a: f64, b: f64| rng2.random_range(a..b);
    let dots: Vec<[f64; 2]> = MARKERS.iter().map(|m| [m.centre_mm[0] + 0.1 * normal(), m.centre_mm[1] + 0.1 * normal()]).collect();
    let mut design = Design { fineness: truth_fineness, ..Design::default() };
    design.material.youngs_mpa *= 1.0 + 0.2 * normal();
    design.material.thickness_mm *= 1.0 + 0.1 * normal();
    for post in 0..4 { for axis in 0..2 { design.post_shift_mm[post][axis] = 0.3 * normal(); } }
    if arg(5, 1.0) > 0.0 {
        design.stretch = [u(-0.003, 0.03), u(-0.003, 0.03)];
        design.overhang_mm = if u(0.0, 1.0) < 0.33 { 0.0 } else { u(0.0, 8.0) };
        design.post_radius_mm = u(1.0, 3.0);
        design.law = Law { neo_hooke: if u(0.0, 1.0) < 0.33 { 0.0 } else { 1.0 }, stiffening: 0.0 };
        if u(0.0, 1.0) < 0.5 { design.law.stiffening = u(0.0, 0.2); }
        design.thickness_slope = [u(-0.05, 0.05), u(-0.05, 0.05)];
        design.thickness_curve = [u(-0.03, 0.03), u(-0.03, 0.03), u(-0.03, 0.03)];
        design.dot_stiffening = u(0.0, 1.0);
        design.dots_mm = dots.clone();
        design.down = [u(-0.5, 0.5), u(-0.5, 0.5), u(-0.7, 0.7)];
        design.tip_radius_mm = u(0.25, 1.0);
    }
    println!("{design:?}");
    let film = Film::new(&design).unwrap();
    let rest = film.rest();
    let made = Made { design: design.clone(), dots_mm: dots.clone(), rest_px: vec![[0.0; 2]; 4], roll_deg: 1.0, focal_px: 176.0, farther_mm: 0.0, middle_px: [160.0, 118.0], stage_mm: [0.05, -0.05] };
    let view = View { film: &film, camera: &camera, farther_mm: 0.0 };
    let mut see = |state: &hivtac_shell::Equilibrium, noise: f64| -> Vec<[f64; 2]> {
        dots.iter().map(|d| { let [x, y] = made.to_px(view.image(state, *d)); [made.middle_px[0] + x + noise * normal(), made.middle_px[1] + y + noise * normal()] }).collect()
    };
    let rest_px = see(&rest, 0.003);
    let mut loads = vec![(0.1, 0.0, 0.0, [0.0, 0.0]), (0.2, 0.0, 0.0, [0.0, 0.0]), (0.1, 8.0, 0.0, [0.0, 0.0]), (0.1, -8.0, 0.0, [0.0, 0.0]), (0.1, 0.0, 8.0, [0.0, 0.0]), (0.1, 0.0, -8.0, [0.0, 0.0]), (0.1, 0.0, 0.0, [3.0, 0.5]), (0.1, 0.0, 0.0, [-0.5, 3.0]), (0.1, 0.0, 0.0, [-3.0, -0.5]), (0.1, 0.0, 0.0, [0.5, -3.0])];
    for _ in 0..extra { loads.push((u(0.03, 0.2), u(-8.0, 8.0), u(-8.0, 8.0), [u(-4.0, 4.0), u(-4.0, 4.0)])); }
    let t = Instant::now();
    let known: Vec<KnownLoad> = loads.iter().map(|(f, a, b, p)| {
        let (a, b) = (f64::to_radians(*a), f64::to_radians(*b));
        let force = [f * a.sin() * b.cos(), f * b.sin(), -f * a.cos() * b.cos()];
        let state = press(&film, film.material_point(&rest, [p[0] + 0.05, p[1] - 0.05]), force, &rest).unwrap();
        KnownLoad { force_n: force, size_n: 1e-3, direction_rad: 1e-4, place_mm: *p, each_place_mm: 1e-3, seen_px: see(&state, 0.006), noise_px: 0.008 }
    }).collect();
    println!("truth {:?}", t.elapsed());
    let bench = Bench { focal_px: camera.focal_px(), middle_px: [159.5, 119.5], rest_px, noise_px: 0.008, dots_mm: MARKERS.iter().map(|m| m.centre_mm).collect(), camera, fineness };
    let problem = Problem { bench: &bench, loads: &known, priors: priors(4, 0.1) };
    let t = Instant::now();
    let found = problem.descend(problem.likeliest()).unwrap();
    println!("fit {:?} chi2 {}", t.elapsed(), found.at.square());
    for (k, p) in problem.priors.iter().enumerate() {
        if let Number::Film(_) = p.number { println!("{:?} {:.4} +- {:.4}", p.number, p.value(found.at.unknowns.numbers[k]), p.sigma * found.covariance[k][k].sqrt()); }
    }
    for r in found.at.residuals.iter().take(12) { println!("{:?}", r.iter().map(|x| (x * 10.0).round() / 10.0).collect::<Vec<_>>()); }
    if arg(6, 0.0) == 0.0 { return; }
    let t = Instant::now();
    let field = hivtac_calibration::unit_fit::field::Field::new(&problem, &found.at).unwrap();
    println!("field {:?} stiffness {:?}", t.elapsed(), field.stiffness_n());
    let t = Instant::now();
    let (mut sum, mut worst, mut n) = (0.0, 0.0_f64, 0.0);
    let fview = View { film: &found.at.film, camera: &problem.bench.camera, farther_mm: found.at.made.farther_mm };
    let (mut tsum, mut tn) = (0.0, 0.0);
    for _ in 0..20 {
        let mut u = || u(-1.0, 1.0);
        let pose = hivtac_film::reduced::Pose { size: 0.35 + 0.2 * u(), tilt: [0.15 * u(), 0.15 * u()], place_mm: [4.0 * u(), 4.0 * u()] };
        let state = press(&found.at.film, found.at.film.material_point(&found.at.rest, pose.place_mm), field.force_n(&pose), &found.at.rest).unwrap();
        let tstate = press(&film, film.material_point(&rest, pose.place_mm), field.force_n(&pose), &rest).unwrap();
        let values = field.terms().rows(&pose)[0].clone();
        for (k, dot) in found.at.made.dots_mm.iter().enumerate() {
            let [a, b] = [fview.image(&state, *dot), fview.image(&found.at.rest, *dot)];
            let [ta, tb] = [view.image(&tstate, dots[k]), view.image(&rest, dots[k])];
            let told = found.at.made.to_px([a[0] - b[0], a[1] - b[1]]);
            let truth = made.to_px([ta[0] - tb[0], ta[1] - tb[1]]);
            let coefficients = field.coefficients(*dot, pose.place_mm);
            for i in 0..2 {
                let told_table: f64 = values.iter().zip(&coefficients[i]).map(|(a, b)| a * b).sum();
                let off = 176.0 * (told_table - (a[i] - b[i]));
                sum += off * off; worst = worst.max(off.abs()); n += 1.0;
                tsum += (told[i] - truth[i]).powi(2); tn += 1.0;
            }
        }
    }
    println!("field off px rms {} worst {} ({:?}); fit off truth {}", (sum / n as f64).sqrt(), worst, t.elapsed(), (tsum / tn as f64).sqrt());
}
