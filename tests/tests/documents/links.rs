//! Every relative link of a document leads to a file, and to a heading that is there.

use std::fs;

use hivtac_tests::workspaces::{files, root};

/// The targets of a text's links, without those of code blocks and of the web.
fn links(text: &str) -> Vec<&str> {
    let mut is_code = false;
    let prose = text.lines().filter(|line| {
        let fence = line.trim_start().starts_with("```");
        is_code ^= fence;
        !is_code && !fence
    });
    let targets = prose.flat_map(|line| line.split("](").skip(1));
    let targets = targets.filter_map(|rest| rest.split(')').next());
    targets.filter(|target| !target.contains("://")).collect()
}

/// The anchors of a document's headings, as GitHub makes them.
fn anchors(text: &str) -> Vec<String> {
    let headings = text.lines().filter(|line| line.starts_with('#'));
    let anchor = |heading: &str| {
        let words = heading.trim_start_matches('#').trim().to_lowercase();
        let kept = words
            .chars()
            .filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect()
    };
    headings.map(anchor).collect()
}

#[test]
fn every_link_leads_somewhere() {
    let mut broken = Vec::new();
    let mut count = 0;
    // Templates are pages of another folder.
    let documents = files(".md").into_iter();
    for file in documents.filter(|file| !file.starts_with("studies/src/")) {
        let text = fs::read_to_string(root().join(&file)).unwrap();
        for target in links(&text) {
            count += 1;
            let (path, anchor) = target.split_once('#').unwrap_or((target, ""));
            let there = match path {
                "" => root().join(&file),
                path => root().join(&file).with_file_name(path),
            };
            let has_anchor = || {
                let text = fs::read_to_string(&there).unwrap_or_default();
                anchors(&text).iter().any(|own| own == anchor)
            };
            if !there.exists() || !(anchor.is_empty() || has_anchor()) {
                broken.push(format!("{file}: {target}"));
            }
        }
    }
    assert!(count > 100, "the test can see links");
    assert!(broken.is_empty(), "{broken:#?}");
}
