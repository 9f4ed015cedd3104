//! Tests `hivtac serve` as far as possible without a receiver; `tests/python/test_serve.py` tests
//! what a receiver gets.

use crate::run::*;

/// The exit code and the text on standard error.
fn refused(options: &[&str]) -> (Option<i32>, String) {
    let finished = run(&[&["serve"], options].concat());
    assert_eq!(finished.stdout, "", "{finished:?}");
    (finished.code, finished.stderr)
}

#[test]
fn it_says_what_is_missing() {
    let (code, said) = refused(&[]);
    assert_eq!(code, Some(2));
    assert!(said.contains("--ros2|--foxglove|--rerun"), "{said}");
    for (options, word) in [
        (["--ros2", "--domain", "233"], "233 is not in 0..=232"),
        (["--foxglove", "--listen", "8765"], "--listen"),
        (["--foxglove", "--domain", "1"], "--ros2"),
    ] {
        let (code, said) = refused(&options);
        assert_eq!(code, Some(2), "{said}");
        assert!(said.contains(word), "{said}");
    }
}

/// A folder with a `python3` that does this, and what `serve --rerun` says with it on the path.
#[cfg(unix)]
fn with_python(script: &str, options: &[&str]) -> Finished {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let python = folder.path().join("python3");
    std::fs::write(&python, format!("#!/bin/sh\n{script}\n")).unwrap();
    std::fs::set_permissions(&python, std::fs::Permissions::from_mode(0o755)).unwrap();
    let path = format!("{}:/usr/bin:/bin", folder.path().display());
    run_with("PATH", &path, &[&["serve", "--rerun"], options].concat())
}

#[cfg(unix)]
#[test]
fn rerun_is_pythons_with_the_sensor_and_its_own_options() {
    let words = ["--port", "tcp:127.0.0.1:1", "--", "--save", "a b.rrd"];
    let finished = with_python("[ \"$1\" = -c ] || printf '%s|' \"$@\"; exit 0", &words);
    let passed = "-m|hivtac.rerun|--port|tcp:127.0.0.1:1|--save|a b.rrd|";
    assert_eq!((finished.code, finished.stdout.as_str()), (Some(0), passed));
    let lacking = "echo \"ModuleNotFoundError: No module named 'rerun'\" >&2; exit 1";
    let finished = with_python(lacking, &[]);
    assert_eq!(finished.code, Some(2), "{finished:?}");
    for part in ["No module named 'rerun'", "pip install \"hivtac[rerun]\""] {
        assert!(finished.stderr.contains(part), "{finished:?}");
    }
    for (options, why) in [
        (&["--foxglove"][..], "cannot be used with"),
        (&["--port", "a", "--port", "b"], "one sensor"),
    ] {
        let finished = with_python("exit 0", options);
        assert!(
            finished.code == Some(2) && finished.stderr.contains(why),
            "{finished:?}"
        );
    }
}

/// One line, before the search for a device.
#[cfg(not(any(feature = "ros2", feature = "foxglove")))]
#[test]
fn a_tool_that_was_built_without_it_says_how_to_build_it() {
    for feature in ["ros2", "foxglove"] {
        let (code, said) = refused(&[&format!("--{feature}"), "--port", "no-such-port"]);
        assert_eq!(code, Some(2), "{said}");
        let how = format!("cargo install --path host-tool --features {feature}\n");
        assert!(
            said.starts_with("hivtac: this hivtac was built without"),
            "{said}"
        );
        assert!(said.ends_with(&how) && said.lines().count() == 1, "{said}");
    }
    let words = ["serve", "--ros2", "--port", "no-such-port"];
    let said = run_with("RMW_IMPLEMENTATION", "rmw_zenoh_cpp", &words).stderr;
    let start = "hivtac: this hivtac was built without Zenoh, and RMW_IMPLEMENTATION is rmw_zenoh";
    assert!(said.starts_with(start), "{said}");
    assert!(said.ends_with("--features zenoh\n"), "{said}");
}
