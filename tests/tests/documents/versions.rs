//! Packages that are not cargo's have the workspace's version.

use std::fs;

use hivtac_tests::workspaces::{packages, root};

#[test]
fn packages_for_robots_have_the_workspaces_version() {
    let all = packages();
    let tool = all.iter().find(|package| package["name"] == "hivtac");
    let version = tool.unwrap()["version"].as_str().unwrap();
    let said = [
        (
            "host-tool/lerobot/pyproject.toml",
            format!("\nversion = \"{version}\"\n"),
        ),
        (
            "host-tool/lerobot/pyproject.toml",
            format!("\"hivtac=={version}\""),
        ),
        (
            "ros2/hivtac_ros2_control/package.xml",
            format!("<version>{version}</version>"),
        ),
    ];
    for (file, line) in said {
        let text = fs::read_to_string(root().join(file)).unwrap();
        assert!(text.contains(&line), "{file} needs {line:?}");
    }
}
