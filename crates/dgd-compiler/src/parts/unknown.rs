//! Undeclared names in a part's model: declarations of the whole do not extend to parts.

use std::collections::{BTreeMap, BTreeSet};

use super::names::declared;
use super::visible::VisibleFiles;
use crate::diagnostics::{Code, Diagnostic, Diagnostics};
use crate::expr::intrinsics::IntrinsicId;
use crate::source::{SourceId, Span};
use crate::syntax::ast::{Ast, Expr, ExprKind, Item, ItemKind};
use crate::syntax::visit::{self, ExprRole, ItemPart, Namespace};

/// Reports every name in the text of a file that is declared neither by its items, nor by a library that it sees, nor
/// by the language. Items of parts are among those of a model.
pub(super) fn verify_names(
    items: &mut [Item],
    ast: &Ast,
    visible: &VisibleFiles<'_>,
    library_names: &BTreeMap<SourceId, String>,
    diagnostics: &mut Diagnostics,
) {
    let mut known: BTreeSet<String> = BTreeSet::from(["time".to_owned(), "pi".to_owned()]);
    let is_value = |(namespace, name)| (namespace == Namespace::Value).then_some(name);
    known.extend(declared(items).into_iter().filter_map(is_value));
    for library in &visible.libraries {
        let prefix = library_names.get(&library.source);
        let names = declared(&mut library.items.clone()).into_iter().filter_map(is_value);
        known.extend(names.map(|name| match prefix {
            Some(prefix) => format!("{prefix}.{name}"),
            None => name,
        }));
    }
    visit::items(items, &mut |item| match &item.kind {
        ItemKind::For { counters, .. } => {
            known.extend(counters.iter().map(|counter| counter.index.text.clone()));
        }
        ItemKind::Array { axes, .. } => {
            let indices = axes.iter().filter_map(|axis| axis.index.as_ref());
            known.extend(indices.map(|index| index.text.clone()));
        }
        _ => {}
    });
    // Outputs cannot be read either, but have their own message.
    let outputs: BTreeSet<String> = declared(items)
        .into_iter()
        .filter_map(|(namespace, name)| (namespace == Namespace::Output).then_some(name))
        .collect();
    let mut names: Vec<(String, Span, bool)> = Vec::new();
    for item in items.iter_mut() {
        visit::parts_mut(item, &mut |part| {
            let ItemPart::Expr(place, expr) = part else { return };
            let hidden: Vec<&str> = match place {
                ExprRole::Body(_, arguments) => {
                    arguments.iter().map(|argument| argument.name.text.as_str()).collect()
                }
                ExprRole::Noise(own) => {
                    vec![own.text.as_str(), "lognormal", "student"]
                }
                _ => Vec::new(),
            };
            unknown(expr, ast.source, &known, &hidden, &mut names);
        });
    }
    for (name, span, is_call) in names {
        let message = match (is_call, outputs.contains(&name)) {
            (true, _) => format!("there is no function `{name}`"),
            (false, true) => {
                format!("`{name}` is an output, which cannot be read inside the model")
            }
            (false, false) => format!("nothing is called `{name}`"),
        };
        let code = match (is_call, outputs.contains(&name)) {
            (true, _) => Code::UnknownFunction,
            (false, true) => Code::MisusedName,
            (false, false) => Code::UnknownName,
        };
        let help = match diagnostics.suggestion(&name, known.iter().map(String::as_str)) {
            Some(near) => format!("did you mean `{near}`?"),
            None => {
                "a part and its libraries know what they declare and import themselves".to_owned()
            }
        };
        diagnostics.error(Diagnostic::new(code, span, message).about(&name).help(help));
    }
}

fn unknown(
    expr: &Expr,
    source: SourceId,
    known: &BTreeSet<String>,
    hidden: &[&str],
    found: &mut Vec<(String, Span, bool)>,
) {
    let is_elsewhere = expr.span.source != source;
    let is_known = |name: &str| is_elsewhere || known.contains(name) || hidden.contains(&name);
    let is_built_in =
        |name: &str| matches!(name, "der" | "delay") || IntrinsicId::find(name).is_some();
    match &expr.kind {
        // A function of the language without arguments gets its own message later.
        ExprKind::Name(name) if !is_known(name) && !is_built_in(name) => {
            found.push((name.clone(), expr.span, false));
        }
        ExprKind::Call { function, .. }
            if !is_known(&function.text) && !is_built_in(&function.text) =>
        {
            found.push((function.text.clone(), function.span, true));
        }
        _ => {}
    }
    let mut hidden = hidden.to_vec();
    if let ExprKind::Reduce(reduction) = &expr.kind {
        hidden.extend(reduction.counters.iter().map(|counter| counter.index.text.as_str()));
    }
    for operand in visit::operands(expr) {
        unknown(operand, source, known, &hidden, found);
    }
}
