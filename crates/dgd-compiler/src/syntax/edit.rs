//! Replaces values of declarations in a model's text; the rest, including comments, stays as it is.

use std::collections::BTreeMap;

use super::ast::{Ast, Item, ItemKind, Name, PartArgument, TablePoints, VariantChoice};
use crate::source::Span;

/// A new value for a declaration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NewValue {
    /// Place of the declared name: several choices of a variant may declare the same name.
    pub name: Span,
    /// Its name in the whole model: `c0`, or `pump.c0` if it belongs to a part.
    pub called: String,
    /// The new text of the value.
    pub text: String,
}

/// The text of a model file with new values of parameters, constants and start values, and new paths of imports.
///
/// `ast` is the parsed `text`. Missing start values are added, and values for declarations of a part become arguments
/// of the part. Values for names that are not declared in this file are ignored.
pub fn with_values(
    ast: &Ast,
    text: &str,
    values: &[NewValue],
    mut import: impl FnMut(&str) -> Option<String>,
) -> String {
    let mut edits = Vec::new();
    collect(&ast.items, values, &mut import, &mut edits);
    edits.sort_by_key(|(start, ..)| *start);
    let mut edited = String::with_capacity(text.len());
    let mut position = 0;
    for (start, end, replacement) in edits {
        edited.push_str(&text[position..start]);
        edited.push_str(&replacement);
        position = end;
    }
    edited.push_str(&text[position..]);
    edited
}

/// The indices of an array's element, and the text of its value.
pub type ElementText = (Vec<i64>, String);

/// The list of an array's values, with the last index varying fastest: `((1, 2), (3, 4))`.
pub fn list_of(elements: &[ElementText]) -> String {
    let mut values = Vec::new();
    let mut rest = elements;
    while let Some((indices, text)) = rest.first() {
        let Some(first) = indices.first() else { return text.clone() };
        let n = rest.iter().take_while(|(other, _)| other.first() == Some(first)).count();
        let inner: Vec<ElementText> =
            rest[..n].iter().map(|(of, text)| (of[1..].to_vec(), text.clone())).collect();
        values.push(list_of(&inner));
        rest = &rest[n..];
    }
    match &values[..] {
        // A single element has no list.
        [only] => only.clone(),
        _ => format!("({})", values.join(", ")),
    }
}

/// The array and the indices in an element's name, `k[2][3]`.
pub fn element_of(name: &str) -> Option<(&str, Vec<i64>)> {
    let (of, rest) = name.split_once('[')?;
    let inside = rest.strip_suffix(']')?;
    let indices: Option<Vec<i64>> =
        inside.split("][").map(|index| index.trim().parse().ok()).collect();
    Some((of, indices?))
}

/// First byte, end, and replacement.
type ByteEdit = (usize, usize, String);

fn collect(
    items: &[Item],
    values: &[NewValue],
    import: &mut impl FnMut(&str) -> Option<String>,
    edits: &mut Vec<ByteEdit>,
) {
    let value_of = |name: &Name| values.iter().rev().find(|value| value.name == name.span);
    for item in items {
        match &item.kind {
            ItemKind::Parameter { name, value, .. } | ItemKind::Constant { name, value, .. } => {
                edits.extend(value_of(name).map(|new| over(value.span, new.text.clone())));
            }
            ItemKind::Size { name, value } => {
                edits.extend(value_of(name).map(|new| over(value.span, new.text.clone())));
            }
            ItemKind::Array { name, axes, unit, start, .. } => {
                let Some(new) = value_of(name) else { continue };
                let ranges = axes.last().map_or(name.span, |axis| axis.range.span);
                let end = unit.as_ref().map_or(ranges, |unit| unit.span).end as usize;
                let added = || (end, end, format!(" = {}", new.text));
                let written = start.as_ref().map(|start| over(start.span, new.text.clone()));
                edits.push(written.unwrap_or_else(added));
            }
            ItemKind::Unknown { name, unit, start, .. } => {
                let Some(new) = value_of(name) else { continue };
                // A new start value is inserted after the unit.
                let end = unit.as_ref().map_or(name.span, |unit| unit.span).end as usize;
                let added = || (end, end, format!(" = {}", new.text));
                let written = start.as_ref().map(|start| over(start.span, new.text.clone()));
                edits.push(written.unwrap_or_else(added));
            }
            ItemKind::Part { name, model, arguments, .. } => {
                let (start, end) = (model.span.end, item.span.end);
                edits.extend(arguments_of(&name.text, arguments, start, end, values));
            }
            ItemKind::Import { path, path_span } => {
                edits.extend(import(path).map(|path| over(*path_span, format!("\"{path}\""))));
            }
            ItemKind::Table { points: TablePoints::File { path, path_span, .. }, .. } => {
                edits.extend(import(path).map(|path| over(*path_span, format!("\"{path}\""))));
            }
            ItemKind::Variant { choices, .. } => {
                for VariantChoice { items, .. } in choices {
                    collect(items, values, import, edits);
                }
            }
            ItemKind::Input { .. }
            | ItemKind::For { .. }
            | ItemKind::Let { .. }
            | ItemKind::Function { .. }
            | ItemKind::Table { .. }
            | ItemKind::Output { .. }
            | ItemKind::Equation { .. }
            | ItemKind::Modes { .. }
            | ItemKind::Binding { .. }
            | ItemKind::When(_)
            | ItemKind::Every { .. }
            | ItemKind::Unit { .. }
            | ItemKind::Start(_)
            | ItemKind::Saturate { .. } => {}
        }
    }
}

/// New arguments of a part; if it has none so far they are inserted between these places.
fn arguments_of(
    part: &str,
    arguments: &[PartArgument],
    start: u32,
    end: u32,
    values: &[NewValue],
) -> Vec<ByteEdit> {
    let member = |called: &str| called.strip_prefix(part)?.strip_prefix('.').map(str::to_owned);
    // Of two values for one name the last is used.
    let mut wanted: BTreeMap<String, &str> = values
        .iter()
        .filter_map(|value| Some((member(&value.called)?, value.text.as_str())))
        .collect();
    let mut edits: Vec<ByteEdit> = Vec::new();
    for PartArgument { name, value } in arguments {
        edits.extend(wanted.remove(&name.text).map(|text| over(value.span, text.to_owned())));
    }
    let more: Vec<String> =
        wanted.into_iter().map(|(name, text)| format!("{name} = {text}")).collect();
    match (more.as_slice(), arguments.last()) {
        ([], _) => {}
        (more, Some(last)) => {
            let end = last.value.span.end as usize;
            edits.push((end, end, format!(", {}", more.join(", "))));
        }
        (more, None) => {
            edits.push((start as usize, end as usize, format!("({})", more.join(", "))));
        }
    }
    edits
}

fn over(span: Span, text: String) -> ByteEdit {
    (span.start as usize, span.end as usize, text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostics::Diagnostics;
    use crate::source::{SourceMap, SourceText};
    use crate::syntax::parse;

    const TEXT: &str = "\
model tank                                # of the first rig
import \"lib/a.dgd\"
parameter k [m] = 2*3 [m]  in 0 .. 9      /// gain
variant v {
  a { parameter b [s] = 1  fixed }
  b { parameter b [s] = 2 }
}
state x [m]   # no start
state y = (1
  + 2)        # two lines
";

    fn edited(wanted: &[(&str, usize, &str)]) -> String {
        let mut sources = SourceMap::default();
        let source = sources.add(SourceText { name: "a".into(), text: TEXT.into() });
        let ast = parse(source, &sources, &mut Diagnostics::default()).expect("it parses");
        let values: Vec<NewValue> = wanted
            .iter()
            .map(|(declaration, skip, value)| {
                let start = TEXT.find(declaration).expect("a declaration") + skip;
                let start = u32::try_from(start).expect("a short text");
                let name = Span { source, start, end: start + 1 };
                NewValue { name, called: String::new(), text: (*value).into() }
            })
            .collect();
        with_values(&ast, TEXT, &values, |path| Some(format!("../{path}")))
    }

    #[test]
    fn only_the_values_change() {
        let text = edited(&[
            ("state y", 6, "7"),
            ("state x", 6, "0.5"),
            ("parameter k", 10, "3.25"),
            ("parameter b [s] = 2", 10, "9"),
        ]);
        let expected = TEXT
            .replace("= 2*3 [m]  in", "= 3.25  in")
            .replace("b [s] = 2", "b [s] = 9")
            .replace("x [m]   #", "x [m] = 0.5   #")
            .replace("(1\n  + 2)", "7")
            .replace("lib/a.dgd", "../lib/a.dgd");
        assert_eq!(text, expected);
    }

    #[test]
    fn lists_hold_lists_for_each_outer_index() {
        let elements = |names: &[&str]| -> Vec<ElementText> {
            let element =
                |name: &&str| (element_of(name).expect("an element").1, (*name).to_owned());
            names.iter().map(element).collect()
        };
        assert_eq!(list_of(&elements(&["k[1]", "k[2]"])), "(k[1], k[2])");
        let names = ["a[-1][1]", "a[-1][2]", "a[0][1]", "a[0][2]"];
        assert_eq!(list_of(&elements(&names)), "((a[-1][1], a[-1][2]), (a[0][1], a[0][2]))");
        assert_eq!(list_of(&elements(&["k[1]"])), "k[1]");
        assert_eq!(element_of("k"), None);
        assert_eq!(element_of("k[i]"), None);
    }

    #[test]
    fn what_a_part_declares_becomes_its_argument() {
        let text =
            "model m\npart a: tank\npart b: tank()\npart c: tank(k = 2, x = 1 +\n  2)  # remark\n";
        let mut sources = SourceMap::default();
        let source = sources.add(SourceText { name: "a".into(), text: text.into() });
        let ast = parse(source, &sources, &mut Diagnostics::default()).expect("it parses");
        let value = |called: &str, text: &str| NewValue {
            name: Span::default(),
            called: called.into(),
            text: text.into(),
        };
        let values = [
            value("a.k", "1"),
            value("a.k", "3"),
            value("b.inner.k", "4"),
            value("b.x", "5"),
            value("c.x", "6"),
            value("c.v", "7"),
            value("ab.k", "8"),
        ];
        let expected = "model m\npart a: tank(k = 3)\npart b: tank(inner.k = 4, x = 5)\n\
                        part c: tank(k = 2, x = 6, v = 7)  # remark\n";
        assert_eq!(with_values(&ast, text, &values, |_| None), expected);
    }
}
