//! Finds and replaces values of parameters in the text of a model.

use std::collections::BTreeMap;
use std::error::Error;
use std::fmt;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::source::{SourceMap, SourceText, Span};
use dgd_compiler::syntax::ast::{
    ArrayAxis, ArrayKind, Ast, Expr, ExprKind, Item, ItemKind, VariantChoice,
};
use dgd_compiler::syntax::parse;

/// The values of a text's parameters.
#[derive(Debug)]
pub struct ParameterValues {
    text: String,
    /// The span of each value.
    places: BTreeMap<String, Span>,
}

impl ParameterValues {
    /// The values in the text of a model with these choices of variants; empty for a text with errors.
    pub fn read(text: &str, variant: &BTreeMap<String, String>) -> ParameterValues {
        let mut places = BTreeMap::new();
        if let Some(ast) = parsed(text) {
            collect(&ast.items, variant, &mut places);
        }
        ParameterValues { text: text.to_owned(), places }
    }

    /// The parameters whose values are in the text.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.places.keys().map(String::as_str)
    }

    /// The text with other values, each in the declared unit of its parameter. Everything else is unchanged; text after
    /// a value in its line keeps its column if there is room.
    ///
    /// # Errors
    ///
    /// [`CannotWrite`]; nothing is changed.
    pub fn write(&self, values: &BTreeMap<String, f64>) -> Result<String, CannotWrite> {
        let mut edits = Vec::new();
        for (name, value) in values {
            let Some(span) = self.places.get(name) else {
                return Err(CannotWrite::Elsewhere(name.clone()));
            };
            if !value.is_finite() {
                return Err(CannotWrite::NotFinite(name.clone()));
            }
            edits.push((*span, written(*value)));
        }
        edits.sort_by_key(|(span, _)| std::cmp::Reverse(span.start));
        let mut text = self.text.clone();
        for (span, value) in edits {
            replace(&mut text, span, value);
        }
        // If a valid text became invalid, that would be our bug.
        if parsed(&text).is_none() { Err(CannotWrite::NotSound) } else { Ok(text) }
    }
}

/// Why values cannot be written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CannotWrite {
    /// The parameter is not declared in the file.
    Elsewhere(String),
    /// The value is not a number.
    NotFinite(String),
    /// The resulting text would not be valid.
    NotSound,
}

impl fmt::Display for CannotWrite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CannotWrite::Elsewhere(name) => write!(
                f,
                "`{name}` is not declared in the opened file, so its value is not written there"
            ),
            CannotWrite::NotFinite(name) => write!(f, "the value of `{name}` is not a number"),
            CannotWrite::NotSound => f.write_str("the changed text could not be read again"),
        }
    }
}

impl Error for CannotWrite {}

fn parsed(text: &str) -> Option<Ast> {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let source = SourceText { name: String::new(), text: text.to_owned() };
    let id = sources.add(source);
    parse(id, &sources, &mut diagnostics).ok()
}

fn collect(
    items: &[Item],
    variant: &BTreeMap<String, String>,
    places: &mut BTreeMap<String, Span>,
) {
    for item in items {
        match &item.kind {
            ItemKind::Parameter { name, value, .. } => {
                places.insert(name.text.clone(), value.span);
            }
            ItemKind::Array {
                declared: ArrayKind::Parameter,
                name,
                axes,
                start: Some(value),
                ..
            } => of_list(&name.text, axes, value, places),
            ItemKind::Variant { name, choices } => {
                let wanted = variant.get(&name.text);
                let is_chosen =
                    |choice: &&VariantChoice| wanted.is_some_and(|w| *w == choice.name.text);
                let chosen = choices.iter().find(is_chosen).or(choices.first());
                collect(chosen.map_or(&[], |choice| &choice.items), variant, places);
            }
            _ => {}
        }
    }
}

/// The values of an array's elements, where each has its own and the first index is a number.
fn of_list(name: &str, axes: &[ArrayAxis], value: &Expr, places: &mut BTreeMap<String, Span>) {
    let Some((axis, inner)) = axes.split_first() else {
        places.insert(name.to_owned(), value.span);
        return;
    };
    let ExprKind::List(values) = &value.kind else { return };
    let ExprKind::Number { value: lower, .. } = axis.range.lower.kind else { return };
    for (k, value) in values.iter().enumerate() {
        of_list(&format!("{name}[{}]", lower + k as f64), inner, value, places);
    }
}

/// A number in model notation, with all of its digits.
fn written(value: f64) -> String {
    match value.abs() {
        size if size != 0.0 && !(1e-4..1e6).contains(&size) => format!("{value:e}"),
        _ => value.to_string(),
    }
}

/// Replaces a value. Spaces after it compensate for the difference in length, but at least one remains.
fn replace(text: &mut String, span: Span, value: String) {
    let (start, mut end) = (span.start as usize, span.end as usize);
    let before = text[start..end].chars().count();
    let behind = text[end..].len() - text[end..].trim_start_matches(' ').len();
    let is_last = matches!(text[end + behind..].chars().next(), None | Some('\r' | '\n'));
    let mut value = value;
    let after = value.len();
    if behind > 0 && !is_last {
        if after > before {
            end += (after - before).min(behind - 1);
        } else {
            value.push_str(&" ".repeat(before - after));
        }
    }
    text.replace_range(start..end, &value);
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "/// A tank.\nmodel tank\n\n\
        parameter A [m^2]  = 2         in 0.1 .. 10   /// cross-section\n\
        parameter k [1/s]  = 2 * 0.05  in 0 ..        # twice\n\
        state h [m] = 1\n\
        variant flow {\n  laminar { parameter K = 1e-3 }   # by hand\n  free { parameter K = 5 }\n}\n\
        equation level: A/A*der(h) = -k*h*K\n";

    fn values(all: &[(&str, f64)]) -> BTreeMap<String, f64> {
        all.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect()
    }

    #[test]
    fn values_change_and_all_else_stays_where_it_is() {
        let own = ParameterValues::read(TEXT, &BTreeMap::new());
        assert_eq!(own.names().collect::<Vec<_>>(), ["A", "K", "k"]);
        let changed = own.write(&values(&[("A", 1.25), ("k", 1.5e-7), ("K", -0.0625)]));
        let expected = TEXT
            .replace("= 2         in", "= 1.25      in")
            .replace("= 2 * 0.05  in", "= 1.5e-7    in")
            .replace("K = 1e-3", "K = -0.0625");
        assert_eq!(changed, Ok(expected));
        assert_eq!(own.write(&BTreeMap::new()).as_deref(), Ok(TEXT));
        // The value of the chosen alternative.
        let free =
            ParameterValues::read(TEXT, &BTreeMap::from([("flow".to_owned(), "free".to_owned())]));
        assert_eq!(free.write(&values(&[("K", 6.0)])), Ok(TEXT.replace("K = 5", "K = 6")));
    }

    #[test]
    fn elements_change_where_each_has_a_value() {
        let text = "model m\nparameter k[0..1] = (2, 3)\nparameter r[1..2] = 5\n\
                    parameter a[1..2][1..2] = ((1, 2), 7)\n";
        let own = ParameterValues::read(text, &BTreeMap::new());
        assert_eq!(own.names().collect::<Vec<_>>(), ["a[1][1]", "a[1][2]", "k[0]", "k[1]"]);
        let changed = own.write(&values(&[("k[1]", 4.0), ("a[1][2]", 9.0)]));
        assert_eq!(changed, Ok(text.replace("(2, 3)", "(2, 4)").replace("(1, 2)", "(1, 9)")));
        assert_eq!(
            own.write(&values(&[("r[1]", 4.0)])),
            Err(CannotWrite::Elsewhere("r[1]".into()))
        );
    }

    #[test]
    fn a_long_value_takes_the_room_there_is() {
        let own = ParameterValues::read(TEXT, &BTreeMap::new());
        let changed = own.write(&values(&[("k", 0.123_456_789_012_345)])).expect("it is there");
        assert!(changed.contains("= 0.123456789012345 in 0 ..        # twice"), "{changed}");
    }

    #[test]
    fn what_stands_elsewhere_or_is_no_number_is_refused() {
        let own = ParameterValues::read(TEXT, &BTreeMap::new());
        let refused = own.write(&values(&[("A", 1.0), ("F_b", 2.0)]));
        assert_eq!(refused, Err(CannotWrite::Elsewhere("F_b".to_owned())));
        let refused = own.write(&values(&[("A", f64::NAN)]));
        assert_eq!(refused, Err(CannotWrite::NotFinite("A".to_owned())));
        assert_eq!(
            ParameterValues::read("model a\nparameter", &BTreeMap::new()).names().count(),
            0
        );
    }

    #[test]
    fn what_is_written_is_read_with_all_digits() {
        for value in [0.0, 1.0, -2.5e-9, 1.1e8, 6.02e23, 0.1 + 0.2, 1e-4, 999_999.9] {
            assert_eq!(written(value).parse(), Ok(value));
        }
    }
}
