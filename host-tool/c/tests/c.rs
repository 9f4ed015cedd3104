//! Builds programs of C and C++ with the header and both libraries, and runs them on the simulated
//! sensor.

#![cfg(unix)]

use hivtac_host::live::camera::Kind;
use hivtac_host::live::device::Device;
use hivtac_host::live::eye::{Disturbances, Eye, Presses};
use hivtac_host::live::hand::Hand;
use hivtac_host::live::line::Tcp;
use hivtac_host::live::run::{Clock, Shared, device_id};
use hivtac_twin::Scene;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A press that stays.
const PRESSED: &str = "[film]\noffset_mm = [1.5, -1.0]\n[load]\nmotion = \"press\"\n[load.press]\n\
                       force_n = 0.12\nalpha_deg = 5.0\nbeta_deg = -4.0\nstart_s = 0.0\n\
                       rise_s = 0.05\nhold_s = 600.0\n";
const REST: &str = "[load]\nmotion = \"rest\"\n";

/// Runs a simulated sensor until the test ends; returns its port.
fn twin(scene: &str) -> String {
    let (kind, scene) = (Kind::Ov7725, Scene::from_toml(scene).unwrap());
    let layout = scene.options().layout;
    let undisturbed = Disturbances {
        glare: false,
        dim: 1.0,
        drift_px: 0.0,
    };
    let eye = Eye::new(kind, scene, Presses::Scene, undisturbed, Hand::default()).unwrap();
    let shared = Shared::new(Device::new(kind, layout, device_id(kind, 0), 1.0));
    let mut clock = Clock::new(shared.clone(), eye);
    std::thread::spawn(move || clock.run(|| false, |_| ()));
    let tcp = Tcp::listen(0).unwrap();
    let port = tcp.port();
    std::thread::spawn(move || tcp.serve(&shared));
    format!("tcp:127.0.0.1:{port}")
}

/// Where cargo puts the libraries that it builds with this test.
fn libraries() -> PathBuf {
    std::env::current_exe().unwrap().parent().unwrap().into()
}

/// Compiles a program of C; a warning fails.
fn compile(source: &str, into: &Path, libraries: &[&str]) {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut compiler = compiler("CC", "cc");
    compiler
        .args(["-std=c11", "-pedantic"])
        .arg(here.join(source));
    built(compiler.args(libraries), into);
}

/// A compiler with this package's header.
fn compiler(variable: &str, name: &str) -> Command {
    let mut compiler = Command::new(std::env::var(variable).unwrap_or_else(|_| name.into()));
    let header = Path::new(env!("CARGO_MANIFEST_DIR")).join("include");
    compiler
        .args(["-Wall", "-Wextra", "-Werror", "-I"])
        .arg(header);
    compiler
}

fn built(compiler: &mut Command, into: &Path) {
    compiler.args(["-lm", "-lpthread", "-ldl", "-o"]).arg(into);
    let output = compiler.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{compiler:?}: {said}");
}

fn run(program: &Path, port: &str) -> (Output, String) {
    // Cargo's path may lead to the library of an earlier build.
    let mut program = Command::new(program);
    let program = program.arg(port).env_remove("LD_LIBRARY_PATH");
    let output = program.output().unwrap();
    let printed = String::from_utf8(output.stdout.clone()).unwrap();
    (output, printed)
}

/// Forces of lines as `frame 7: FX FY FZ N at X Y m, contact 1, sigma S N`.
fn felt(printed: &str) -> Vec<[f64; 7]> {
    let numbers = |line: &str| {
        let (_, said) = line.split_once(": ")?;
        let words = said.split([' ', ',']);
        let numbers: Vec<f64> = words.filter_map(|word| word.parse().ok()).collect();
        <[f64; 7]>::try_from(numbers).ok()
    };
    printed.lines().filter_map(numbers).collect()
}

/// Checks that lines have the force of `PRESSED`.
fn check(printed: &str) {
    let felt = felt(printed);
    assert!(felt.len() > 10, "{printed}");
    let (alpha, beta) = (5.0_f64.to_radians(), (-4.0_f64).to_radians());
    let direction = [
        alpha.sin() * beta.cos(),
        beta.sin(),
        -alpha.cos() * beta.cos(),
    ];
    for [x, y, z, right, down, contact, sigma] in felt {
        let parts = [x, y, z].into_iter().zip(direction);
        for (found, part) in parts {
            assert!((found - 0.12 * part).abs() < 12e-3, "{found} {part}");
        }
        let beside = (right - 1.5e-3).hypot(down + 1.0e-3);
        assert!(beside < 0.3e-3, "{right} {down}");
        assert!(contact == 1.0 && sigma > 0.0 && sigma < 0.02, "{sigma}");
    }
}

#[test]
fn the_example_prints_true_forces_with_either_library() {
    let folder = tempfile::tempdir().unwrap();
    let place = libraries();
    let port = twin(PRESSED);
    let (archive, shared) = (place.join("libhivtac.a"), format!("-L{}", place.display()));
    let path = format!("-Wl,-rpath,{}", place.display());
    let ways: [&[&str]; 2] = [&[archive.to_str().unwrap()], &[&shared, &path, "-lhivtac"]];
    for (number, way) in ways.iter().enumerate() {
        let program = folder.path().join(format!("forces{number}"));
        compile("examples/forces.c", &program, way);
        let (output, printed) = run(&program, &port);
        assert!(output.status.success(), "{output:?}");
        check(&printed);
    }
    let nobody = run(&folder.path().join("forces0"), "tcp:127.0.0.1:1").0;
    let said = String::from_utf8_lossy(&nobody.stderr);
    assert!(nobody.status.code() == Some(1) && said.contains("127.0.0.1:1"));
}

#[test]
fn what_cannot_be_is_reported_and_nothing_crashes() {
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("edges");
    let archive = libraries().join("libhivtac.a");
    compile("tests/edges.c", &program, &[archive.to_str().unwrap()]);
    let (output, _) = run(&program, &twin(REST));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
}

/// The part for ros2_control, with headers that stand in for those of ROS 2.
#[test]
#[ignore = "needs a C++ compiler"]
fn a_sensor_of_ros2_control_has_true_states() {
    let ros2 = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../ros2/hivtac_ros2_control");
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("on_twin");
    let mut compiler = compiler("CXX", "c++");
    compiler.arg("-std=c++17");
    for include in ["include", "test/stand_in"] {
        compiler.arg("-I").arg(ros2.join(include));
    }
    for source in ["src/sensor.cpp", "test/on_twin.cpp"] {
        compiler.arg(ros2.join(source));
    }
    built(compiler.arg(libraries().join("libhivtac.a")), &program);
    let (output, printed) = run(&program, &twin(PRESSED));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    check(&printed);
}

/// The package as its users build it; skipped without ROS 2.
#[test]
#[ignore = "needs CMake, and ROS 2 with ros2_control"]
fn the_sensor_of_ros2_control_builds_where_ros_2_is_sourced() {
    if std::env::var_os("AMENT_PREFIX_PATH").is_none() {
        return eprintln!("not tried: ROS 2 is not sourced here");
    }
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = tempfile::tempdir().unwrap();
    let named = |name: &str, path: PathBuf| format!("-D{name}={}", path.display());
    let mut configure = Command::new("cmake");
    configure
        .arg("-S")
        .arg(here.join("../../ros2/hivtac_ros2_control"));
    configure.arg("-B").arg(folder.path());
    configure.arg(named("HIVTAC_LIBRARY", libraries().join("libhivtac.a")));
    configure.arg(named("HIVTAC_INCLUDE", here.join("include")));
    let mut build = Command::new("cmake");
    for command in [&mut configure, build.arg("--build").arg(folder.path())] {
        let output = command.output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{command:?}: {said}");
    }
}
