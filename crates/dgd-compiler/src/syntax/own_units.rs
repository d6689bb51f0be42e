//! Units that files declare, `unit stroke = 0.118 [l]`, resolved where they are used.
//!
//! A file sees the units that it declares and those of the libraries that it imports, directly or through others. A
//! part of a model keeps those of its own file, regardless of those of the whole.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use super::ast::{Ast, Expr, ExprKind, Item, ItemKind, Name};
use super::visit;
use crate::diagnostics::{Code, Diagnostic, Diagnostics};
use crate::source::{DeclaredUnit, SourceId, Span};
use crate::units::{OwnUnit, OwnUnits, describe, parse_unit};

/// The trees with every unit linked to the declarations of its file; the same trees if there are none.
pub(crate) fn known_where_used<'a>(
    asts: &'a [Ast],
    diagnostics: &mut Diagnostics,
) -> Cow<'a, [Ast]> {
    if !asts.iter().any(declares) {
        return Cow::Borrowed(asts);
    }
    let of_files = of_files(asts, diagnostics);
    let mut asts = asts.to_vec();
    for ast in &mut asts {
        let units = seen_by(&of_files, ast);
        for item in &mut ast.items {
            visit::units_of_item_mut(item, &mut |unit| {
                if unit.own.is_empty() {
                    unit.own = units.clone();
                }
            });
        }
    }
    Cow::Owned(asts)
}

/// The units that the first of the trees sees, and those of the others unless these clash.
pub fn all(asts: &[Ast]) -> OwnUnits {
    if !asts.iter().any(declares) {
        return OwnUnits::default();
    }
    let of_files = of_files(asts, &mut Diagnostics::default());
    let units = asts.iter().map(|ast| seen_by(&of_files, ast));
    units.fold(OwnUnits::default(), |all, units| all.and(&units))
}

/// [`all`] as numbers of units of the language.
pub fn declared(asts: &[Ast]) -> Vec<DeclaredUnit> {
    let one = |(symbol, unit): (&str, OwnUnit)| DeclaredUnit {
        symbol: symbol.to_owned(),
        value: unit.factor,
        unit: describe(unit.dimension),
    };
    all(asts).iter().map(one).collect()
}

/// Links units in an expression that belongs to no file.
pub(crate) fn know_in(expr: &mut Expr, own: &OwnUnits) {
    visit::units_of_expression_mut(expr, &mut |unit| unit.own = own.clone());
}

fn declares(ast: &Ast) -> bool {
    let mut any = false;
    visit::items(&ast.items, &mut |item| any |= matches!(item.kind, ItemKind::Unit { .. }));
    any
}

/// The declarations and imports of each file.
struct OfFile {
    declared: OwnUnits,
    imports: Vec<SourceId>,
    is_library: bool,
}

fn of_files(asts: &[Ast], diagnostics: &mut Diagnostics) -> BTreeMap<SourceId, OfFile> {
    let mut of_files: BTreeMap<SourceId, OfFile> = BTreeMap::new();
    let empty = |ast: &Ast| OfFile {
        declared: OwnUnits::default(),
        imports: ast.imports.clone(),
        is_library: ast.model.is_none(),
    };
    of_files.extend(asts.iter().map(|ast| (ast.source, empty(ast))));
    // Libraries come after the files that import them.
    for ast in asts.iter().rev() {
        let units = seen_by(&of_files, ast);
        let declared = declared_in(ast, &units, diagnostics);
        of_files.insert(ast.source, OfFile { declared, ..empty(ast) });
    }
    of_files
}

/// The declarations of a file and its libraries, the nearest first.
fn seen_by(of_files: &BTreeMap<SourceId, OfFile>, ast: &Ast) -> OwnUnits {
    let mut visited = BTreeSet::from([ast.source]);
    let mut pending = vec![ast.source];
    let mut units = OwnUnits::default();
    while let Some(source) = pending.pop() {
        let Some(file) = of_files.get(&source) else { continue };
        if source != ast.source && !file.is_library {
            continue;
        }
        units = units.and(&file.declared);
        pending.extend(file.imports.iter().filter(|import| visited.insert(**import)));
    }
    units
}

/// The units that a file declares, ordered so that each needs only earlier ones.
fn declared_in(ast: &Ast, seen: &OwnUnits, diagnostics: &mut Diagnostics) -> OwnUnits {
    let mut waiting: Vec<(&Name, &Expr)> = Vec::new();
    visit::items(&ast.items, &mut |item: &Item| {
        if let ItemKind::Unit { name, value } = &item.kind {
            waiting.push((name, value));
        }
    });
    let mut known: BTreeMap<String, (OwnUnit, Span)> = BTreeMap::new();
    loop {
        let before = waiting.len();
        let names: Vec<&str> = waiting.iter().map(|(name, _)| name.text.as_str()).collect();
        let names: Vec<String> = names.into_iter().map(str::to_owned).collect();
        waiting.retain(|(name, value)| {
            let declared_units =
                known.iter().map(|(symbol, (unit, _))| (symbol.clone(), *unit)).collect();
            let units = OwnUnits::new(declared_units).and(seen);
            let others = names.iter().filter(|other| **other != name.text);
            match value_of(name, value, &units, others, diagnostics) {
                UnitValue::Known(unit) => {
                    take(name, unit, &mut known, diagnostics);
                    false
                }
                UnitValue::Wrong => false,
                UnitValue::Waits => true,
            }
        });
        if waiting.is_empty() || waiting.len() == before {
            break;
        }
    }
    for (name, _) in waiting {
        let message = format!("the unit `{}` depends on itself", name.text);
        diagnostics
            .error(Diagnostic::new(Code::CircularDefinition, name.span, message).about(&name.text));
    }
    OwnUnits::new(known.into_iter().map(|(symbol, (unit, _))| (symbol, unit)).collect())
}

/// The value of a unit.
enum UnitValue {
    Known(OwnUnit),
    /// It depends on a unit that is not resolved yet.
    Waits,
    /// An error that has been reported.
    Wrong,
}

fn value_of<'n>(
    name: &Name,
    expr: &Expr,
    own: &OwnUnits,
    mut others: impl Iterator<Item = &'n String>,
    diagnostics: &mut Diagnostics,
) -> UnitValue {
    let mut wrong = |diagnostic: Diagnostic| {
        diagnostics.error(diagnostic);
        UnitValue::Wrong
    };
    if parse_unit(&name.text).is_ok() {
        let message = format!("`{}` is a unit of the language", name.text);
        return wrong(
            Diagnostic::new(Code::DuplicateName, name.span, message)
                .about(&name.text)
                .help("choose another name"),
        );
    }
    let ExprKind::Number { value, unit, .. } = &expr.kind else {
        unreachable!("the parser lets only numbers be units")
    };
    if *value <= 0.0 {
        let message = "a unit must be above zero";
        return wrong(Diagnostic::new(Code::SizeNotPositive, expr.span, message).about(&name.text));
    }
    let Some(written) = unit else {
        return UnitValue::Known(OwnUnit::from_unit(*value, &crate::units::Unit::one()));
    };
    let text = &written.text;
    match crate::units::parse_unit_with(text, own) {
        Ok(unit) => UnitValue::Known(OwnUnit::from_unit(*value, &unit)),
        Err(_) if others.any(|other| mentions(text, other)) || mentions(text, &name.text) => {
            UnitValue::Waits
        }
        Err(error) => wrong(error.locate(text, written.span)),
    }
}

/// Whether a symbol occurs in a unit.
fn mentions(text: &str, symbol: &str) -> bool {
    text.split(|c: char| !(c.is_alphanumeric() || c == '_')).any(|word| word == symbol)
}

/// Adds a unit; equal declarations count as one.
fn take(
    name: &Name,
    unit: OwnUnit,
    known: &mut BTreeMap<String, (OwnUnit, Span)>,
    diagnostics: &mut Diagnostics,
) {
    match known.get(&name.text) {
        Some((first, _)) if *first == unit => {}
        Some((_, place)) => {
            let message = format!("the unit `{}` is declared twice", name.text);
            diagnostics.error(
                Diagnostic::new(Code::DuplicateName, name.span, message)
                    .about(&name.text)
                    .label(*place, "first here"),
            );
        }
        None => {
            known.insert(name.text.clone(), (unit, name.span));
        }
    }
}
