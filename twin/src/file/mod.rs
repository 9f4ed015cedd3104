//! Reads scenes from TOML files (`docs/scene-file.md`).

mod sections;

use toml::de::{DeTable, DeValue};

use self::sections::SceneFile;
use crate::{Scene, SceneError};

impl Scene {
    /// Returns the scene that a TOML text describes, as `docs/scene-file.md` defines it. Keys that
    /// the text omits have their defaults.
    ///
    /// # Errors
    /// [`SceneError::File`], with the line, if the text is not TOML, has an unknown key, or has an
    /// impossible value.
    pub fn from_toml(text: &str) -> Result<Scene, SceneError> {
        let file: SceneFile =
            toml::from_str(text).map_err(|error| SceneError::File(error.to_string()))?;
        file.scene()
            .map_err(|error| SceneError::File(located(text, &error)))
    }
}

/// Formats an error, with the line of its cause if that can be found.
fn located(text: &str, error: &SceneError) -> String {
    let place = match error {
        SceneError::Option { name, value, .. } => find(text, name, Some(*value)),
        SceneError::Size { .. } => find(text, "width", None).or(find(text, "height", None)),
        SceneError::Key { key, .. } => find(text, key, None),
        SceneError::Film(_) => find(text, "load", None).or(find(text, "film", None)),
        _ => None,
    };
    match place {
        Some(Place { path, line }) => format!("line {line}, {path}: {error}"),
        None => error.to_string(),
    }
}

/// The place of a key in a file.
struct Place {
    /// The key's name, preceded by the names of its tables.
    path: String,
    /// Counted from 1.
    line: usize,
}

/// Returns the first key with a name. If a value is given, the key's text must contain that value.
fn find(text: &str, name: &str, value: Option<f64>) -> Option<Place> {
    let table = DeTable::parse(text).ok()?;
    let mut found = Vec::new();
    collect(table.get_ref(), "", name, &mut found);
    let has_value = |written: &str| value.is_none_or(|value| numbers(written).any(|n| n == value));
    let (path, place, _) = found
        .into_iter()
        .find(|(_, _, span)| has_value(&text[span.clone()]))?;
    let line = text[..place.start].matches('\n').count() + 1;
    Some(Place { path, line })
}

type Span = std::ops::Range<usize>;

/// Collects all keys with a name in a table and its inner tables: path, and spans of key and value.
fn collect(table: &DeTable<'_>, path: &str, name: &str, found: &mut Vec<(String, Span, Span)>) {
    for (key, value) in table {
        let path = match path {
            "" => key.get_ref().to_string(),
            _ => format!("{path}.{}", key.get_ref()),
        };
        if key.get_ref() == name {
            found.push((path.clone(), key.span(), value.span()));
        }
        match value.get_ref() {
            DeValue::Table(inner) => collect(inner, &path, name, found),
            DeValue::Array(entries) => {
                let tables = entries
                    .iter()
                    .filter_map(|entry| entry.get_ref().as_table());
                tables.for_each(|inner| collect(inner, &path, name, found));
            }
            _ => {}
        }
    }
}

/// Iterates over the numbers in the text of a value.
fn numbers(written: &str) -> impl Iterator<Item = f64> {
    let parts = written.split(|c: char| "[], \t\r\n".contains(c));
    parts.filter_map(|part| part.replace('_', "").parse().ok())
}
