//! Where Rust source has raw strings: text that is kept as it stands, with no way to break a line.

use std::collections::BTreeSet;

/// The lines, from 1, in which a raw string begins, goes on or ends.
pub fn lines(source: &str) -> BTreeSet<usize> {
    let mut found = BTreeSet::new();
    let (mut rest, mut line) = (source, 1);
    while !rest.is_empty() {
        let raw = raw_string(rest);
        let (token, after) = rest.split_at(raw.unwrap_or_else(|| other(rest)));
        let last = line + token.matches('\n').count();
        if raw.is_some() {
            found.extend(line..=last);
        }
        (rest, line) = (after, last);
    }
    found
}

/// Bytes of the raw string that the source begins with.
fn raw_string(source: &str) -> Option<usize> {
    let mut prefixes = ["r", "br", "cr"].into_iter();
    let marked = prefixes.find_map(|prefix| source.strip_prefix(prefix))?;
    let quoted = marked.trim_start_matches('#');
    let inside = quoted.strip_prefix('"')?;
    let end = format!("\"{}", &marked[..marked.len() - quoted.len()]);
    Some(source.len() - inside.len() + through(inside, &end))
}

/// Bytes of whatever else the source begins with: a comment, a string, a character, a word or a
/// sign. A comment in `/* … */` ends at the first `*/`.
fn other(source: &str) -> usize {
    let is_sign = |c: char| !c.is_alphanumeric() && c != '_';
    let word = source.find(is_sign).unwrap_or(source.len());
    if word > 0 {
        return word;
    }
    if source.starts_with("//") {
        return through(source, "\n");
    }
    let after = |mark: &str| source.strip_prefix(mark);
    if let Some(comment) = after("/*") {
        return 2 + through(comment, "*/");
    }
    if let Some(inside) = after("\"") {
        return 1 + closing(inside, '"');
    }
    match after("'") {
        Some(inside) if is_character(inside) => 1 + closing(inside, '\''),
        _ => source.chars().next().map_or(0, char::len_utf8),
    }
}

/// Whether what follows `'` is a character rather than the name of a lifetime.
fn is_character(inside: &str) -> bool {
    inside.starts_with('\\') || inside.chars().nth(1) == Some('\'')
}

/// Bytes up to the end of the first `end`; all when there is none.
fn through(text: &str, end: &str) -> usize {
    text.find(end).map_or(text.len(), |at| at + end.len())
}

/// Bytes up to the end of the first `mark` that is not escaped; all when there is none.
fn closing(inside: &str, mark: char) -> usize {
    let mut escaped = false;
    let closes = |c: char| {
        let plain = !escaped;
        escaped = plain && c == '\\';
        plain && c == mark
    };
    inside.find(closes).map_or(inside.len(), |at| at + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(source: &str) -> Vec<usize> {
        lines(source).into_iter().collect()
    }

    #[test]
    fn every_line_of_a_raw_string_is_found_and_the_next_is_not() {
        assert_eq!(found("a\nb(r\"c\nd\n\"); e\nf"), [2, 3, 4]);
        assert_eq!(found("r#\"\n\" \"#\n\"#\""), [1, 2]);
        assert_eq!(found("br##\"\"#\n\"##\ncr\"\"\n"), [1, 2, 3]);
    }

    #[test]
    fn other_strings_and_comments_are_none() {
        assert!(found("\"a\nb r\" + \"c\"\n").is_empty());
        assert!(found("\"\\\" r\\\"\\\\\" + b\"\"").is_empty());
        assert!(found("// r\"\n/// r#\"\n/* r\"\n*/ 1").is_empty());
        assert!(found("r#type + r + colour\"\"").is_empty());
    }

    #[test]
    fn characters_open_no_string_and_lifetimes_no_character() {
        assert_eq!(found("'\"'\nr\"\"\n'\\''\n'\\\\' 'é'"), [2]);
        assert_eq!(found("&'a str\n&'r str\nr\"'\""), [3]);
    }
}
