//! The tables of `docs/results/performance.md`, written by the commands that measure them.

use std::fs;

use anyhow::{Context, Result};

use crate::workspace;

/// Puts `text` between the lines `<!-- NAME: begin … -->` and `<!-- NAME: end -->`.
///
/// # Errors
/// When the document cannot be read or written, or has no such lines.
pub fn write(name: &str, text: &str) -> Result<()> {
    let file = workspace::folder("docs/results/performance.md");
    let before =
        fs::read_to_string(&file).with_context(|| format!("reading {}", file.display()))?;
    let after = replaced(&before, name, text)
        .with_context(|| format!("{} has no place for `{name}`", file.display()))?;
    fs::write(&file, after).with_context(|| format!("writing {}", file.display()))?;
    eprintln!("wrote {}", file.display());
    Ok(())
}

fn replaced(document: &str, name: &str, text: &str) -> Option<String> {
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
        let document = "one\n<!-- a: begin, by x -->\nold\n<!-- a: end -->\ntwo\n<!-- b: begin \
                        -->\nkept\n<!-- b: end -->\n";
        let expected = document.replace("\nold\n", "\n\nnew\n\n");
        assert_eq!(replaced(document, "a", "new\n"), Some(expected.clone()));
        assert_eq!(replaced(&expected, "a", "new"), Some(expected));
        assert_eq!(replaced(document, "c", "new"), None);
    }
}
