//! What a reader of TOML complains of, in the words of somebody who writes it.

/// Types of this program and what TOML calls them.
const TYPES: [(&str, &str); 10] = [
    ("i64", "an integer"),
    ("usize", "an integer ≥ 0"),
    ("u32", "an integer ≥ 0"),
    ("u8", "an integer ≥ 0"),
    ("f32", "a number"),
    ("f64", "a number"),
    ("a sequence", "an array"),
    ("a map", "a table"),
    ("floating point", "the number"),
    ("array of tables", "tables in [[double brackets]]"),
];

/// The message of an error of `toml`, in plain words and on one line, with the valid name nearest to one that is unknown.
pub(super) fn plain(message: &str) -> String {
    if message.contains("recursion") {
        return "arrays or tables nest too deeply".to_owned();
    }
    let message = message.replace('\n', ", ");
    if let Some((found, _)) = message.split_once(" as i128, expected ") {
        let found = found.replacen("invalid type: ", "found ", 1);
        return format!("{found}, expected an integer nearer to zero");
    }
    let message = match message.strip_prefix("invalid type: ") {
        Some(rest) => format!("found {rest}"),
        None => message,
    };
    if let Some((found, expected)) = message.split_once(", expected ")
        && found.starts_with("found ")
    {
        let known = TYPES.iter().find(|(ours, _)| *ours == expected);
        let expected = match known {
            Some((_, theirs)) => theirs,
            None if expected.starts_with("struct ") => "a table",
            None => expected,
        };
        let found = found.replacen("floating point", "the number", 1);
        return format!("{found}, expected {expected}");
    }
    match suggestion(&message) {
        Some(name) => format!("{message}, did you mean `{name}`?"),
        None => message,
    }
}

/// Of `names`, the one that `name` is a misspelling of, if it can be one.
pub(super) fn nearest<'a>(name: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let distance =
        |other: &str| strsim::damerau_levenshtein(&name.to_lowercase(), &other.to_lowercase());
    let candidates = names.into_iter().map(|other| (distance(other), other));
    let (distance, found) = candidates.min_by_key(|(distance, _)| *distance)?;
    (distance <= 1 + name.chars().count() / 4).then_some(found)
}

/// For "unknown field `a`, expected one of `b`, `c`": the name that was meant.
fn suggestion(message: &str) -> Option<&str> {
    let (found, expected) = message.split_once(", expected ")?;
    let name = found.strip_prefix("unknown ")?.split('`').nth(1)?;
    nearest(name, expected.split('`').skip(1).step_by(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn types_are_called_by_the_names_of_toml() {
        assert_eq!(
            plain("invalid type: floating point `8.0`, expected i64"),
            "found the number `8.0`, expected an integer"
        );
        assert_eq!(
            plain("invalid type: string \"much\", expected f32"),
            "found string \"much\", expected a number"
        );
        assert_eq!(
            plain("invalid type: integer `7`, expected struct Army"),
            "found integer `7`, expected a table"
        );
        assert_eq!(
            plain("invalid type: integer `77777777777777777777` as i128, expected i64"),
            "found integer `77777777777777777777`, expected an integer nearer to zero"
        );
    }

    #[test]
    fn a_misspelling_is_recognised_and_a_different_word_is_not() {
        let message = "unknown variant `Zerg`, expected one of `terran`, `protoss`, `zerg`";
        assert_eq!(plain(message), format!("{message}, did you mean `zerg`?"));
        let message = "unknown field `colour`, expected `damage` or `range`";
        assert_eq!(plain(message), message);
    }
}
