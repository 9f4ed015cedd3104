//! Measures forces from frames of a film with eight dots, by area and force, and by faults of a
//! dot: tables of `docs/results/dots.md`.

use hivtac_calibration::forward::cholesky;
use hivtac_sensor::force::Force;
use hivtac_sensor::force::forward::{Column, Forward, Markers, Pose, UNKNOWNS};
use hivtac_sensor::pipeline::Sensor;
use hivtac_terms::status::Status;
use hivtac_twin::film::Dots;
use hivtac_twin::{Load, Options, Paint, Patch, Scene};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::layouts::{errors_and_limits, layout, model, nominal, scene, tared};

/// Tilts of a force along each axis, degrees.
const TILT_DEG: f64 = 8.0;
/// Millimetres of film by which a dot moves for 0.1 px of its image.
const TENTH_OF_A_PX_MM: f64 = 0.0058;

/// Number of presses whose bounds are averaged.
const PRESSES: u32 = 400;

/// Presses: the largest distance from the middle along each axis, mm, and forces, mN.
#[derive(Clone, Copy)]
struct Presses {
    within_mm: f64,
    force_mn: [f64; 2],
}

impl Presses {
    fn draw(self, random: &mut ChaCha8Rng) -> Load {
        let mut within = |most: f64| random.random_range(-most..most);
        let [alpha, beta] = [TILT_DEG; 2].map(&mut within);
        let place_mm = [self.within_mm; 2].map(&mut within);
        let [least, most] = self.force_mn;
        let force_n = 1e-3 * random.random_range(least..=most);
        let load = Load::from_angles(force_n, alpha, beta).unwrap();
        load.with_offset_mm(place_mm).unwrap()
    }
}

/// Counts and errors over frames.
#[derive(Default)]
struct Tally {
    frames: u32,
    /// Frames in which all dots are wholly seen.
    whole: u32,
    /// Frames with a force, and those of them that go on without a dot.
    forces: u32,
    without: u32,
    all: Errors,
    /// The errors of frames in which all dots count.
    with_all: Errors,
}

/// The errors of forces.
#[derive(Default)]
struct Errors {
    count: u32,
    /// Squared errors, and those within the stated 95 %.
    squares: [f64; 3],
    within: [u32; 3],
}

impl Errors {
    fn add(&mut self, force: &Force, load: &Load) {
        self.count += 1;
        let (errors, limits) = errors_and_limits(force, load);
        for (k, (error, limit)) in errors.into_iter().zip(limits).enumerate() {
            self.squares[k] += error * error;
            self.within[k] += u32::from(error <= limit);
        }
    }

    /// Root mean squares of the errors: direction, degrees, |F|, mN, and place, µm.
    fn rms(&self) -> [f64; 3] {
        let of = |k: usize, unit: f64| unit * (self.squares[k] / f64::from(self.count)).sqrt();
        [of(0, 1.0), of(1, 1e3), of(2, 1e3)]
    }

    /// Parts within the stated 95 %, in percent.
    fn percent_within(&self) -> [f64; 3] {
        let of = |part| 100.0 * f64::from(part) / f64::from(self.count);
        self.within.map(of)
    }

    /// The columns of a table's row.
    fn row(&self) -> String {
        let [direction_deg, force_mn, place_um] = self.rms();
        let [a, b, c] = self.percent_within();
        format!(
            "{direction_deg:.3}° | {force_mn:.3} mN | {place_um:.1} µm | {a:.0}, {b:.0}, {c:.0} %"
        )
    }
}

impl Tally {
    fn add(&mut self, sensor: &mut Sensor<'_>, scene: &Scene, load: &Load, number: u64) {
        let frame = scene.render_load(load, number).unwrap();
        sensor.forget_frame();
        let seen = sensor.measure_frame_closely(&frame.to_rgb565());
        let is_whole = |marker: &Option<hivtac_twin::MarkerTruth>| {
            marker.is_some_and(|marker| marker.visible == 1.0)
        };
        self.frames += 1;
        self.whole += u32::from(frame.truth.markers.iter().all(is_whole));
        let Some(force) = seen.force else {
            println!("  refused: {:?} under {load:?}", seen.status);
            return;
        };
        self.forces += 1;
        let is_without = seen.status.contains(Status::MARKER_LOST);
        self.without += u32::from(is_without);
        self.all.add(&force, load);
        if !is_without {
            self.with_all.add(&force, load);
        }
    }

    fn percent(&self, part: u32) -> f64 {
        100.0 * f64::from(part) / f64::from(self.frames)
    }

    fn print(&self, name: &str) {
        println!(
            "| {name} | {:.1} % | {:.1} % | {:.1} % | {} |",
            self.percent(self.whole),
            self.percent(self.forces),
            self.percent(self.without),
            self.all.row(),
        );
        if (1..self.forces).contains(&self.with_all.count) {
            println!("  of which with all dots: {}", self.with_all.row());
        }
    }
}

/// Within an area, where dots leave the picture only under the largest forces.
#[test]
#[ignore = "slow: 3,600 frames"]
fn needles_within_8_mm() {
    let scene = nominal();
    let mut sensor = tared(&scene);
    for (within_mm, wanted) in [
        (4.0, [0.11, 0.06, 5.0]),
        (6.0, [0.16, 0.13, 9.0]),
        (8.0, [0.34, 0.53, 21.0]),
    ] {
        for force_mn in [50.0, 100.0, 200.0] {
            let presses = Presses {
                within_mm,
                force_mn: [force_mn; 2],
            };
            let mut random = ChaCha8Rng::seed_from_u64(within_mm as u64);
            let mut tally = Tally::default();
            for number in 0..400 {
                let load = presses.draw(&mut random);
                tally.add(&mut sensor, &scene, &load, number);
            }
            tally.print(&format!("±{within_mm} mm | {force_mn} mN"));
            let rms = tally.all.rms();
            let is_right = rms.iter().zip(wanted).all(|(rms, most)| *rms < most);
            assert!(force_mn != 100.0 || is_right, "{rms:?}");
            let within = tally.all.percent_within();
            assert!(within.iter().all(|part| *part > 90.0), "{within:?}");
        }
    }
}

/// Applies a fault to a dot after the tare.
fn apply(options: &mut Options, fault: &str, dot: usize) {
    let moved = |times: f64| {
        let mut glued_mm = Dots::defaults(8);
        glued_mm[dot] = [0.6, 0.8].map(|part| times * TENTH_OF_A_PX_MM * part);
        glued_mm
    };
    match fault {
        "a dot is covered" => options.missing = Dots::from_fn(8, |other| other == dot),
        "glare of 0.1 mm on a dot's rim" => {
            let (sin, cos) = (dot as f64).sin_cos();
            let [x, y] = layout().centres_mm()[dot];
            let far_mm = layout().diameter_mm() / 2.0;
            options.patches.push(Patch {
                centre_mm: [x + far_mm * cos, y + far_mm * sin],
                radius_mm: 0.1,
                paint: Paint::Glare,
            });
        }
        "a dot moved by 0.1 px" => options.glued_mm = moved(1.0),
        "a dot moved by 0.5 px" => options.glued_mm = moved(5.0),
        _ => {}
    }
}

/// A dot that is lost or lies, each in turn.
#[test]
#[ignore = "slow: 4,000 frames"]
fn faults_of_a_dot() {
    let presses = Presses {
        within_mm: 4.0,
        force_mn: [50.0, 200.0],
    };
    let mut of_none = [f64::INFINITY; 3];
    for fault in [
        "none",
        "a dot is covered",
        "glare of 0.1 mm on a dot's rim",
        "a dot moved by 0.1 px",
        "a dot moved by 0.5 px",
    ] {
        let mut tally = Tally::default();
        for dot in 0..8 {
            let mut sensor = tared(&nominal());
            let scene = scene(|options| apply(options, fault, dot));
            let mut random = ChaCha8Rng::seed_from_u64(dot as u64);
            for number in 0..100 {
                let load = presses.draw(&mut random);
                tally.add(&mut sensor, &scene, &load, 1_000 * dot as u64 + number);
            }
        }
        tally.print(fault);
        assert!(tally.percent(tally.forces) > 98.0, "{fault}");
        let within = tally.all.percent_within();
        assert!(
            within.iter().all(|part| *part > 90.0),
            "{fault}: {within:?}"
        );
        match fault {
            "none" => of_none = tally.all.rms(),
            // Little more is known less well.
            _ => assert!(tally.all.rms()[0] < 1.6 * of_none[0], "{fault}"),
        }
    }
}

/// The Cramér–Rao bound of a press without a dot: variances of direction, |F| and place. The noise
/// of each dot, px, is away from the axis and across.
fn bound(forward: &Forward<'_>, pose: &Pose, lost: Option<usize>, noise_px: &Markers) -> [f64; 3] {
    let nowhere = Markers::defaults(forward.tables.dots());
    let slopes = (forward.tables.predict(pose, &forward.limits, &nowhere)).slopes;
    let [focal_per_px, _] = forward.per_px.unwrap();
    let white = |column: &Column| {
        let dots = column.as_chunks::<2>().0.iter().enumerate();
        let dots = dots.filter(|(dot, _)| Some(*dot) != lost);
        let parts = dots.flat_map(|(dot, [x, y])| {
            let ([c, s], [away, across]) = (forward.rest_image.away(dot), noise_px[dot]);
            [(c * x + s * y) / away, (c * y - s * x) / across]
        });
        parts.map(|part| f64::from(part / focal_per_px)).collect()
    };
    let columns: Vec<Vec<f64>> = slopes.iter().map(white).collect();
    let product = |a: &Vec<f64>, b: &Vec<f64>| a.iter().zip(b).map(|(a, b)| a * b).sum();
    let row = |a: &Vec<f64>| columns.iter().map(|b| product(a, b)).collect();
    let factor = cholesky(columns.iter().map(row).collect());
    let variance = |unknown: usize| {
        let mut column = [0.0; UNKNOWNS];
        for k in 0..UNKNOWNS {
            let before: f64 = (0..k).map(|j| factor[k][j] * column[j]).sum();
            column[k] = (f64::from(u8::from(k == unknown)) - before) / factor[k][k];
        }
        column.iter().map(|part| part * part).sum::<f64>()
    };
    let per_size_n = f64::from(forward.stiffness.per_size_n(pose.size));
    [
        variance(1) + variance(2),
        per_size_n * per_size_n * variance(0),
        variance(3) + variance(4),
    ]
}

/// The roots of the mean bounds of presses of 100 mN within an area: direction, degrees, |F|, mN,
/// and place, µm.
fn bounds(
    within_mm: f64,
    lost: Option<usize>,
    noise_px: impl Fn(&Forward<'_>) -> Markers,
) -> [f64; 3] {
    let forward = model().forward.unwrap();
    let noise_px = noise_px(&forward);
    let presses = Presses {
        within_mm,
        force_mn: [100.0; 2],
    };
    let mut random = ChaCha8Rng::seed_from_u64(within_mm as u64);
    let mut sums = [0.0; 3];
    for _ in 0..PRESSES {
        let load = presses.draw(&mut random);
        let pose = Pose::of_force(
            load.vector_n().map(|part| part as f32),
            load.offset_mm().map(|part| part as f32),
            &forward.stiffness,
            &forward.limits,
        );
        let more = bound(&forward, &pose, lost, &noise_px);
        sums = [0, 1, 2].map(|k| sums[k] + more[k] / f64::from(PRESSES));
    }
    let [direction, force, place] = sums.map(f64::sqrt);
    [direction.to_degrees(), 1e3 * force, 1e3 * place]
}

/// The same noise of each coordinate, px, as in the tables of given centroids.
fn equal(forward: &Forward<'_>) -> Markers {
    Markers::filled(forward.tables.dots(), [0.011; 2])
}

/// That of frames: dots beside the axis are seen less exactly.
fn of_frames(forward: &Forward<'_>) -> Markers {
    let [away, across] = forward.noise.at_rest_px;
    (forward.rest_image.grain()).map(|grain| [away * grain[0], across * grain[1]])
}

/// What a lost dot costs even the best estimate: one of a corner much of what is known of |F|, one
/// of the middle a little of the direction.
#[test]
fn seven_dots_know_less_of_a_force_than_eight() {
    let [direction, force, _] = bounds(4.0, None, equal);
    let mut squares = [0.0; 2];
    for dot in 0..8 {
        let without = bounds(4.0, Some(dot), equal);
        let times = [without[0] / direction, without[1] / force];
        println!("without dot {dot}: {times:.2?} times for direction and |F|");
        squares = [0, 1].map(|k| squares[k] + times[k] * times[k] / 8.0);
    }
    let times = squares.map(f64::sqrt);
    println!("without any one: {times:.2?} times");
    assert!((1.1..1.2).contains(&times[0]) && (1.4..1.5).contains(&times[1]));
}

#[test]
fn dots_beside_the_axis_know_less_than_their_noise_in_the_middle_says() {
    for within_mm in [4.0, 6.0, 8.0] {
        let [same, seen] = [
            bounds(within_mm, None, equal),
            bounds(within_mm, None, of_frames),
        ];
        println!("±{within_mm} mm: 0.011 px each {same:.4?}, as in frames {seen:.4?}");
        assert!(same.iter().zip(seen).all(|(same, seen)| *same < seen));
    }
}
