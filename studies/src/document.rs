//! Tables that commands write into documents.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};

/// Puts a text into a document, between its lines `<!-- NAME: begin … -->` and
/// `<!-- NAME: end -->`.
///
/// # Errors
/// When the document cannot be read or written, or has no such lines.
pub fn write_into(file: &Path, name: &str, text: &str) -> Result<()> {
    let shown = file.display();
    let before = fs::read_to_string(file).with_context(|| format!("cannot read {shown}"))?;
    let after = replaced(&before, name, text)
        .with_context(|| format!("{shown} has no lines `<!-- {name}: begin … -->` and end"))?;
    fs::write(file, after).with_context(|| format!("cannot write {shown}"))?;
    println!("wrote {shown}");
    Ok(())
}

/// The document with the text in its place; `None` when it has none.
pub(crate) fn replaced(document: &str, name: &str, text: &str) -> Option<String> {
    let begin = document.find(&format!("<!-- {name}: begin"))?;
    let start = begin + document[begin..].find("-->")? + "-->".len();
    let end = start + document[start..].find(&format!("<!-- {name}: end -->"))?;
    let (head, tail) = (&document[..start], &document[end..]);
    Some(format!("{head}\n\n{}\n\n{tail}", text.trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_lies_between_the_marks_changes() {
        let document = "one\n<!-- a: begin, by x -->\nold\n<!-- a: end -->\ntwo\n";
        let expected = document.replace("\nold\n", "\n\nnew\n\n");
        assert_eq!(replaced(document, "a", "new\n"), Some(expected.clone()));
        assert_eq!(replaced(&expected, "a", "new"), Some(expected));
        assert_eq!(replaced(document, "b", "new"), None);
    }
}
