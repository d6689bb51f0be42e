//! Converts names of columns to names of a model.

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::parse;

/// The valid name closest to a text, for this kind of item.
pub(super) fn identifier(text: &str, keyword: &str) -> String {
    let mut name = String::new();
    for c in text.trim().chars() {
        if c.is_alphanumeric() && is_name(&format!("a{c}"), keyword) {
            name.push(c);
        } else if !name.ends_with('_') {
            name.push('_');
        }
    }
    let name = name.trim_matches('_');
    if name.is_empty() {
        return "x".to_owned();
    }
    let begun = [name.to_owned(), format!("x_{name}"), format!("{name}_1")];
    let known = ["time", "pi", "der", "delay"];
    let free = |name: &&String| is_name(name, keyword) && !known.contains(&name.as_str());
    begun.iter().find(free).cloned().unwrap_or_else(|| "x".to_owned())
}

/// Whether a name is valid in the language.
fn is_name(name: &str, keyword: &str) -> bool {
    let text = if keyword == "model" {
        format!("model {name}\nlet a = 1\n")
    } else {
        format!("model m\n{keyword} {name} [1]\n")
    };
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let id = sources.add(SourceText { name: String::new(), text });
    parse(id, &sources, &mut diagnostics).is_ok()
}

/// The same names, with a number after duplicates.
pub(super) fn distinct(names: Vec<String>) -> Vec<String> {
    let mut distinct: Vec<String> = Vec::with_capacity(names.len());
    for name in names {
        let numbered = (2..).map(|n| format!("{name}_{n}"));
        let mut tried = std::iter::once(name.clone()).chain(numbered);
        let free = tried.find(|name| !distinct.contains(name));
        distinct.push(free.unwrap_or(name));
    }
    distinct
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_become_names() {
        for (text, name) in [
            ("q_boost", "q_boost"),
            ("Motor Speed (rpm)", "Motor_Speed_rpm"),
            ("p[1]", "p_1"),
            ("2nd", "x_2nd"),
            ("time", "x_time"),
            ("if", "x_if"),
            ("Δp", "Δp"),
            ("%", "x"),
            ("", "x"),
        ] {
            assert_eq!(identifier(text, "input"), name, "{text}");
        }
        let twice = distinct(["a", "b", "a"].map(str::to_owned).to_vec());
        assert_eq!(twice, ["a", "b", "a_2"]);
    }
}
