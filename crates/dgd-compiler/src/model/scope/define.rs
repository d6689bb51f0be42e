//! Collects the names that the items of a model declare.

use std::collections::BTreeMap;

use super::place::{ArrayPlace, Vector};
use super::whole::NamedSizes;
use super::{FunctionDeclaration, ModelScope, NameDefinition, ScopeEntry, TableDeclaration};
use crate::diagnostics::{Code, Diagnostic, Diagnostics};
use crate::expr::intrinsics::IntrinsicId;
use crate::model::check_units::{UnitSpelling, unit_of_declaration};
use crate::source::Span;
use crate::syntax::ast::{
    ArrayKind, Expr, ExprKind, FormalArgument, Item, ItemKind, LocalLet, Name, StartRule,
    UnknownKind, VariantChoice, WrittenUnit,
};
use crate::syntax::visit;
use crate::units::Dimension;

impl<'a> ModelScope<'a> {
    /// Collects what the items declare.
    pub(in crate::model) fn collect(
        items: &[&'a Item],
        diagnostics: &mut Diagnostics,
    ) -> ModelScope<'a> {
        let mut scope = ModelScope {
            names: BTreeMap::new(),
            functions: Vec::new(),
            tables: Vec::new(),
            sizes: NamedSizes::new(),
            arrays: Vec::new(),
            loops: Vec::new(),
            let_arrays: Vec::new(),
            vectors: Vec::new(),
            n_scalars: [0; 3],
            outputs: BTreeMap::new(),
            second: Dimension::from_exponents([0, 0, 1, 0, 0, 0, 0]),
            spelling: UnitSpelling::default(),
        };
        for (name, definition) in [("time", NameDefinition::Time), ("pi", NameDefinition::Pi)] {
            let entry = ScopeEntry { definition, span: Span::default(), unit: None };
            scope.names.insert(name, entry);
        }
        let mut labels: BTreeMap<&str, Span> = BTreeMap::new();
        let mut automata: BTreeMap<&str, Span> = BTreeMap::new();
        let mut counts = [0u32; 4];
        let mut next = |kind: usize| {
            counts[kind] += 1;
            counts[kind] - 1
        };
        let mut lets = 0;
        let (mut arrays, mut let_arrays) = (0, 0);
        for item in items {
            let (name, definition, unit) = match &item.kind {
                ItemKind::Constant { name, unit, value } => {
                    (name, NameDefinition::Constant(next(0)), Some((unit, Some(value))))
                }
                ItemKind::Parameter { name, unit, value, .. } => {
                    (name, NameDefinition::Parameter(next(1)), Some((unit, Some(value))))
                }
                ItemKind::Input { name, unit, .. } => {
                    (name, NameDefinition::Input(next(2)), Some((unit, None)))
                }
                ItemKind::Unknown { declared, name, unit, start, .. } => {
                    let state = *declared != UnknownKind::Unknown;
                    let definition = NameDefinition::Unknown { index: next(3), state };
                    (name, definition, Some((unit, start.as_ref())))
                }
                ItemKind::Let { name, .. } => {
                    lets += 1;
                    (name, NameDefinition::Let(lets - 1), None)
                }
                ItemKind::Size { name, .. } => (name, NameDefinition::Size, None),
                ItemKind::Array { declared, name, unit, .. } if declared.is_unknown() => {
                    arrays += 1;
                    let state = *declared == ArrayKind::State;
                    (name, NameDefinition::Array { index: arrays - 1, state }, Some((unit, None)))
                }
                ItemKind::Array { declared, name, axes, unit, start, .. } => {
                    scope.vectors.push(Vector {
                        kind: *declared,
                        name,
                        axes,
                        value: start.as_ref(),
                        place: Ok(ArrayPlace::nowhere(name)),
                    });
                    (
                        name,
                        NameDefinition::Vector(scope.vectors.len() - 1),
                        Some((unit, start.as_ref())),
                    )
                }
                ItemKind::For { items, .. } => {
                    scope.collect_loop(items, &mut let_arrays, &mut labels, diagnostics);
                    continue;
                }
                ItemKind::Function { name, arguments, lets, body } => {
                    scope.functions.push(FunctionDeclaration {
                        name: &name.text,
                        arguments,
                        lets,
                        body,
                    });
                    check_function(name, arguments, lets, diagnostics);
                    (name, NameDefinition::Function(scope.functions.len() - 1), None)
                }
                ItemKind::Table { name, arguments, unit, points, attributes } => {
                    scope.tables.push(TableDeclaration {
                        name,
                        arguments,
                        unit: unit.as_ref(),
                        points,
                        attributes,
                    });
                    check_function(name, arguments, &[], diagnostics);
                    (name, NameDefinition::Table(scope.tables.len() - 1), None)
                }
                ItemKind::Output { name, unit, .. } => {
                    unique(&mut scope.outputs, name, "output", diagnostics);
                    // Invalid ones are reported with the output.
                    if let Some(Ok(unit)) = unit.as_ref().map(WrittenUnit::read) {
                        scope.spelling.learn(&unit);
                    }
                    continue;
                }
                ItemKind::Equation { label, .. }
                | ItemKind::Start(StartRule::Equation { label, .. }) => {
                    unique(&mut labels, label, "equation", diagnostics);
                    continue;
                }
                ItemKind::Modes { name, modes, .. } => {
                    unique(&mut automata, name, "`modes` block", diagnostics);
                    labels_of_modes(modes, &mut labels, diagnostics);
                    continue;
                }
                ItemKind::Import { .. }
                | ItemKind::Variant { .. }
                | ItemKind::Part { .. }
                | ItemKind::Binding { .. }
                | ItemKind::When(_)
                | ItemKind::Every { .. }
                | ItemKind::Unit { .. }
                | ItemKind::Start(StartRule::Steady)
                | ItemKind::Saturate { .. } => continue,
            };
            let unit = unit
                .map(|(unit, value)| unit_of_declaration(name, unit.as_ref(), value, diagnostics));
            if let Some(Ok(unit)) = &unit {
                scope.spelling.learn(unit);
            }
            scope.insert(name, ScopeEntry { definition, span: name.span, unit }, diagnostics);
        }
        scope.n_scalars = [counts[0], counts[1], counts[2]];
        scope.verify_points(diagnostics);
        scope
    }

    /// Collects the declarations in a loop.
    fn collect_loop(
        &mut self,
        items: &'a [Item],
        let_arrays: &mut usize,
        labels: &mut BTreeMap<&'a str, Span>,
        diagnostics: &mut Diagnostics,
    ) {
        for item in items {
            match &item.kind {
                ItemKind::Equation { label, .. }
                | ItemKind::Start(StartRule::Equation { label, .. }) => {
                    unique(labels, label, "equation", diagnostics);
                }
                ItemKind::Let { name, .. } => {
                    let definition = NameDefinition::LetArray(*let_arrays);
                    *let_arrays += 1;
                    let entry = ScopeEntry { definition, span: name.span, unit: None };
                    self.insert(name, entry, diagnostics);
                }
                _ => {}
            }
        }
    }

    /// Checks that no other name is `pump_c0`, the name of `pump.c0` in generated code.
    fn verify_points(&self, diagnostics: &mut Diagnostics) {
        let values = self.names.iter().map(|(name, entry)| (*name, entry.span));
        let outputs = self.outputs.iter().map(|(name, span)| (*name, *span));
        let sets: [Vec<(&str, Span)>; 2] = [values.collect(), outputs.collect()];
        for names in sets.iter().filter(|names| names.iter().any(|(name, _)| name.contains('.'))) {
            let mut written: BTreeMap<String, (&str, Span)> = BTreeMap::new();
            for (name, span) in names {
                let Some((first, place)) = written.insert(name.replace('.', "_"), (name, *span))
                else {
                    continue;
                };
                let message = format!("`{first}` and `{name}` are one name in generated code");
                let meant = if first.contains('.') { first } else { name };
                diagnostics.error(
                    Diagnostic::new(Code::DuplicateName, *span, message).about(first).about(name)
                        .label(place, "the other one")
                        .help(format!(
                            "rename one of them, as `_` stands for the point there; or is `{meant}` meant?"
                        )),
                );
            }
        }
    }

    fn insert(&mut self, name: &'a Name, entry: ScopeEntry, diagnostics: &mut Diagnostics) {
        match self.names.get(name.text.as_str()) {
            None => {
                self.names.insert(&name.text, entry);
            }
            Some(ScopeEntry { definition: NameDefinition::Time | NameDefinition::Pi, .. }) => {
                diagnostics.error(
                    Diagnostic::new(
                        Code::DuplicateName,
                        name.span,
                        format!("`{}` has a meaning in every model", name.text),
                    )
                    .about(&name.text)
                    .help("choose another name"),
                );
            }
            Some(earlier) => {
                diagnostics.error(
                    Diagnostic::new(
                        Code::DuplicateName,
                        name.span,
                        format!("`{}` is declared twice", name.text),
                    )
                    .about(&name.text)
                    .label(earlier.span, "first here"),
                );
            }
        }
    }
}

/// Checks the names of a function and its arguments.
fn check_function(
    name: &Name,
    arguments: &[FormalArgument],
    lets: &[LocalLet],
    diagnostics: &mut Diagnostics,
) {
    let is_taken = |function: IntrinsicId| !function.get().yields;
    if name.text == "der" || IntrinsicId::find(&name.text).is_some_and(is_taken) {
        diagnostics.error(
            Diagnostic::new(
                Code::DuplicateName,
                name.span,
                format!("`{}` is a function of the language", name.text),
            )
            .about(&name.text)
            .help("choose another name"),
        );
    }
    let mut spans_by_name = BTreeMap::new();
    for argument in arguments {
        unique(&mut spans_by_name, &argument.name, "argument", diagnostics);
    }
    for (i, local) in lets.iter().enumerate() {
        unique(&mut spans_by_name, &local.name, "value", diagnostics);
        let early = lets[i..]
            .iter()
            .find_map(|later| read_of(&later.name.text, &local.value).map(|place| (later, place)));
        if let Some((later, place)) = early {
            let message = format!("`{}` is read before its own line", later.name.text);
            diagnostics.error(
                Diagnostic::new(Code::CircularDefinition, place, message)
                    .about(&later.name.text)
                    .label(later.name.span, "declared here")
                    .help("a `let` of a function reads those above it"),
            );
        }
    }
}

/// The place where a value reads a name.
fn read_of(name: &str, expr: &Expr) -> Option<Span> {
    if matches!(&expr.kind, ExprKind::Name(read) if read == name) {
        return Some(expr.span);
    }
    visit::operands(expr).into_iter().find_map(|operand| read_of(name, operand))
}

/// Labels in a `modes` block. Modes exclude each other, so another mode may use the same label.
fn labels_of_modes<'a>(
    modes: &'a [VariantChoice],
    labels: &mut BTreeMap<&'a str, Span>,
    diagnostics: &mut Diagnostics,
) {
    let common = labels.clone();
    for mode in modes {
        let mut labels_of_mode = common.clone();
        for item in &mode.items {
            if let ItemKind::Equation { label, .. } = &item.kind {
                unique(&mut labels_of_mode, label, "equation", diagnostics);
            }
        }
        labels.extend(labels_of_mode);
    }
}

fn unique<'a>(
    seen: &mut BTreeMap<&'a str, Span>,
    name: &'a Name,
    what: &str,
    diagnostics: &mut Diagnostics,
) {
    match seen.get(name.text.as_str()) {
        None => {
            seen.insert(&name.text, name.span);
        }
        Some(first) => {
            diagnostics.error(
                Diagnostic::new(
                    Code::DuplicateName,
                    name.span,
                    format!("two {what}s are called `{}`", name.text),
                )
                .about(&name.text)
                .label(*first, "first here"),
            );
        }
    }
}
