//! Measures forces from frames of a film with eight dots, by area and force, and by faults of a
//! dot: tables of `docs/results/dots.md`.

use hivtac_sensor::pipeline::Sensor;
use hivtac_terms::status::Status;
use hivtac_twin::film::Dots;
use hivtac_twin::{Load, Options, Paint, Patch, Scene};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::layouts::{errors_and_limits, layout, nominal, scene, tared};

/// Tilts of a force along each axis, degrees.
const TILT_DEG: f64 = 8.0;
/// Millimetres of film by which a dot moves for 0.1 px of its image.
const TENTH_OF_A_PX_MM: f64 = 0.0058;

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
    /// Squared errors, and those within the stated 95 %.
    squares: [f64; 3],
    within: [u32; 3],
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
        self.without += u32::from(seen.status.contains(Status::MARKER_LOST));
        let (errors, limits) = errors_and_limits(&force, load);
        for (k, (error, limit)) in errors.into_iter().zip(limits).enumerate() {
            self.squares[k] += error * error;
            self.within[k] += u32::from(error <= limit);
        }
    }

    /// Root mean squares of the errors: direction, degrees, |F|, mN, and place, µm.
    fn rms(&self) -> [f64; 3] {
        let of = |k: usize, unit: f64| unit * (self.squares[k] / f64::from(self.forces)).sqrt();
        [of(0, 1.0), of(1, 1e3), of(2, 1e3)]
    }

    fn percent(&self, part: u32) -> f64 {
        100.0 * f64::from(part) / f64::from(self.frames)
    }

    fn print(&self, name: &str) {
        let [direction_deg, force_mn, place_um] = self.rms();
        let [a, b, c] = self
            .within
            .map(|part| 100.0 * f64::from(part) / f64::from(self.forces));
        println!(
            "| {name} | {:.1} % | {:.1} % | {:.1} % | {direction_deg:.3}° | {force_mn:.3} mN | \
             {place_um:.1} µm | {a:.0}, {b:.0}, {c:.0} % |",
            self.percent(self.whole),
            self.percent(self.forces),
            self.percent(self.without),
        );
    }
}

/// Within an area, where dots leave the picture only under the largest forces.
#[test]
#[ignore = "slow: 3,600 frames"]
fn needles_within_8_mm() {
    let scene = nominal();
    let mut sensor = tared(&scene);
    for (within_mm, wanted) in [
        (4.0, [0.13, 0.08, 6.0]),
        (6.0, [0.16, 0.13, 9.0]),
        (8.0, [0.36, 0.58, 23.0]),
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
            let is_right = tally
                .rms()
                .iter()
                .zip(wanted)
                .all(|(rms, most)| *rms < most);
            assert!(force_mn != 100.0 || is_right, "{:?}", tally.rms());
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
        assert!(tally.percent(tally.forces) > 94.0, "{fault}");
        match fault {
            "none" => of_none = tally.rms(),
            // Little more is known less well.
            _ => assert!(tally.rms()[0] < 1.6 * of_none[0], "{fault}"),
        }
    }
}
