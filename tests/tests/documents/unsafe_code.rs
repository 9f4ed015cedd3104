//! Tests that `docs/unsafe.md` lists every file that contains `unsafe`, with the count.

use std::collections::BTreeMap;
use std::fs;

use hivtac_tests::workspaces::{files, root, table_rows};
use proc_macro2::{TokenStream, TokenTree};

/// Counts the keyword in these tokens, without comments and strings: blocks, functions,
/// implementations, foreign functions and attributes.
fn count(tokens: TokenStream) -> usize {
    let one = |token: TokenTree| match token {
        TokenTree::Group(group) => count(group.stream()),
        TokenTree::Ident(word) => usize::from(word == "unsafe"),
        TokenTree::Punct(_) | TokenTree::Literal(_) => 0,
    };
    tokens.into_iter().map(one).sum()
}

fn in_source(name: &str) -> usize {
    let text = fs::read_to_string(root().join(name)).unwrap();
    let tokens = text.parse();
    count(tokens.unwrap_or_else(|error| panic!("{name}: {error}")))
}

/// Returns the sources that contain the keyword, with the count.
fn in_sources() -> BTreeMap<String, usize> {
    let all = files(".rs").into_iter();
    let counted = all.map(|name| (in_source(&name), name));
    let with = counted.filter(|&(count, _)| count > 0);
    with.map(|(count, name)| (name, count)).collect()
}

/// Returns the document's rows that name a file: file, count, reason.
fn listed(text: &str) -> BTreeMap<String, (usize, &str)> {
    let rows = table_rows(text).into_iter();
    let rows = rows.filter(|cells| cells[0].starts_with('`'));
    rows.map(|cells| {
        let [name, count, why] = cells[..] else {
            panic!("a row has three cells: {cells:?}");
        };
        let count = count.parse().unwrap_or_else(|_| panic!("{name}: {count}"));
        (name.replace('`', ""), (count, why))
    })
    .collect()
}

#[test]
fn every_file_with_unsafe_is_listed_with_its_count_and_reason() {
    let text = fs::read_to_string(root().join("docs/unsafe.md")).unwrap();
    let (listed, found) = (listed(&text), in_sources());
    for (name, count) in &found {
        let row = listed.get(name);
        let row = row.unwrap_or_else(|| panic!("docs/unsafe.md lacks `{name}` | {count} |"));
        assert_eq!(row.0, *count, "docs/unsafe.md counts {name} otherwise");
        assert!(
            row.1.len() > 20,
            "docs/unsafe.md gives no reason for {name}"
        );
    }
    for name in listed.keys() {
        assert!(found.contains_key(name), "{name} has no `unsafe`");
    }
}

#[test]
fn comments_and_strings_do_not_count() {
    let source = r##"
        //! unsafe
        /// unsafe
        #[unsafe(no_mangle)]
        fn f() { /* unsafe */ let _ = "unsafe"; unsafe { g() } }
        macro_rules! m { () => { unsafe { g() } } }
        unsafe impl Send for S {}
    "##;
    assert_eq!(count(source.parse().unwrap()), 4);
}
