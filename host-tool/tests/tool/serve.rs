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
    assert!(said.contains("--ros2|--foxglove"), "{said}");
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
}
