//! Expands `let`s and functions in an equation if they use a name.

use std::collections::{BTreeMap, BTreeSet};

use super::splice::{Splice, SpliceResults, is_derivative, substitute, too_large};
use crate::diagnostics::{Code, Diagnostic, Diagnostics};
use crate::syntax::ast::{Ast, Expr, ExprKind, FormalArgument, Item, ItemKind};
use crate::syntax::local::without_lets;
use crate::syntax::visit;

/// Limit on the nesting of operands, `let`s and functions that are expanded.
const DEEPEST: usize = 256;

/// The choices of variants that contain an item: variant and choice, outermost first.
pub(super) type VariantPath = Vec<(String, usize)>;

/// A `let` or a function of the model.
#[derive(Debug, Clone)]
struct ExpandableDefinition {
    path: VariantPath,
    arguments: Vec<FormalArgument>,
    value: Expr,
}

/// All definitions that can be expanded, by name.
#[derive(Debug, Default)]
pub(super) struct ExpandableDefinitions {
    all: BTreeMap<String, Vec<ExpandableDefinition>>,
}

impl ExpandableDefinitions {
    /// The current definitions of a model and its libraries.
    pub(super) fn collect(asts: &[Ast]) -> ExpandableDefinitions {
        let mut definitions = ExpandableDefinitions::default();
        for ast in asts {
            definitions.collect_items(&ast.items, &mut VariantPath::new());
        }
        definitions
    }

    fn collect_items(&mut self, items: &[Item], path: &mut VariantPath) {
        for item in items {
            let (name, arguments, value) = match &item.kind {
                ItemKind::Let { name, value, .. } => (name, &[][..], value.clone()),
                ItemKind::Function { name, arguments, lets, body } => {
                    (name, arguments.as_slice(), without_lets(lets, body))
                }
                ItemKind::Variant { name, choices } => {
                    for (i, choice) in choices.iter().enumerate() {
                        path.push((name.text.clone(), i));
                        self.collect_items(&choice.items, path);
                        path.pop();
                    }
                    continue;
                }
                ItemKind::Import { .. }
                | ItemKind::Constant { .. }
                | ItemKind::Parameter { .. }
                | ItemKind::Input { .. }
                | ItemKind::Unknown { .. }
                | ItemKind::Output { .. }
                | ItemKind::Table { .. }
                | ItemKind::Equation { .. }
                | ItemKind::Modes { .. }
                | ItemKind::Part { .. }
                | ItemKind::Binding { .. }
                | ItemKind::When(_)
                | ItemKind::Every { .. }
                | ItemKind::Unit { .. }
                | ItemKind::Start(_)
                | ItemKind::Saturate { .. }
                | ItemKind::Size { .. }
                | ItemKind::Array { .. }
                | ItemKind::For { .. } => continue,
            };
            let definition =
                ExpandableDefinition { path: path.clone(), arguments: arguments.to_vec(), value };
            self.all.entry(name.text.clone()).or_default().push(definition);
        }
    }
}

/// Expands an equation's expressions for one splice.
pub(super) struct ExpressionExpansion<'a> {
    splice: &'a Splice<'a>,
    definitions: &'a ExpandableDefinitions,
    /// The choices that contain the equation.
    path: &'a VariantPath,
    /// Names whose definitions lead to a use.
    leading: BTreeSet<&'a str>,
}

impl<'a> ExpressionExpansion<'a> {
    pub(super) fn new(
        splice: &'a Splice<'a>,
        definitions: &'a ExpandableDefinitions,
        path: &'a VariantPath,
        done: &SpliceResults,
    ) -> ExpressionExpansion<'a> {
        let mut opening =
            ExpressionExpansion { splice, definitions, path, leading: BTreeSet::new() };
        opening.leading = opening.leading_names(done);
        opening
    }

    /// The definitions of a name that can be active together with the equation.
    fn definitions_of(&self, name: &str) -> Vec<&'a ExpandableDefinition> {
        let candidates = self.definitions.all.get(name).map_or(&[][..], Vec::as_slice);
        let agrees = |definition: &&ExpandableDefinition| {
            definition.path.iter().all(|(variant, choice)| {
                self.path.iter().all(|(other, chosen)| other != variant || chosen == choice)
            })
        };
        candidates.iter().filter(agrees).collect()
    }

    /// Names whose definitions use the replaced name, directly or through others.
    fn leading_names(&self, done: &SpliceResults) -> BTreeSet<&'a str> {
        let mut users: BTreeMap<&str, Vec<&'a str>> = BTreeMap::new();
        let mut pending: Vec<&'a str> = Vec::new();
        for name in self.definitions.all.keys().filter(|name| **name != self.splice.name.text) {
            for definition in self.definitions_of(name) {
                let hidden: Vec<&str> =
                    definition.arguments.iter().map(|a| a.name.text.as_str()).collect();
                let mut read = BTreeSet::new();
                if self.uses(&definition.value, &hidden, done, &mut read) {
                    pending.push(name);
                }
                for other in read {
                    users.entry(other).or_default().push(name);
                }
            }
        }
        let mut leading = BTreeSet::new();
        while let Some(name) = pending.pop() {
            if leading.insert(name) {
                pending.extend(users.get(name).into_iter().flatten());
            }
        }
        leading
    }

    /// Whether an expression uses the replaced name itself; collects the other names that it reads.
    fn uses(
        &self,
        expr: &'a Expr,
        hidden: &[&str],
        done: &SpliceResults,
        read: &mut BTreeSet<&'a str>,
    ) -> bool {
        if self.splice.is_use(expr, hidden, &done.replaced) {
            return true;
        }
        if is_derivative(expr) {
            return false;
        }
        match &expr.kind {
            ExprKind::Name(name) if !hidden.contains(&name.as_str()) => {
                read.insert(name);
            }
            ExprKind::Call { function, .. } => {
                read.insert(&function.text);
            }
            _ => {}
        }
        let mut any = false;
        for operand in visit::operands(expr) {
            any |= self.uses(operand, hidden, done, read);
        }
        any
    }

    /// Replaces names and calls that lead to a use by their definitions.
    pub(super) fn open(
        &self,
        expr: &mut Expr,
        done: &mut SpliceResults,
        diagnostics: &mut Diagnostics,
    ) {
        self.open_within(expr, 0, done, diagnostics);
    }

    fn open_within(
        &self,
        expr: &mut Expr,
        nesting: usize,
        done: &mut SpliceResults,
        diagnostics: &mut Diagnostics,
    ) {
        if nesting > DEEPEST || done.is_too_much() {
            diagnostics.error(too_large(self.splice.clause));
            return;
        }
        if is_derivative(expr) {
            return;
        }
        let name = match &expr.kind {
            ExprKind::Name(name) => Some(name.clone()),
            ExprKind::Call { function, .. } => Some(function.text.clone()),
            _ => None,
        };
        // The expression inserted here by an earlier effect counts as one use.
        if !self.splice.is_use(expr, &[], &done.replaced) || name.is_some() {
            for operand in visit::operands_mut(expr) {
                self.open_within(operand, nesting + 1, done, diagnostics);
            }
        }
        let Some(name) = name.filter(|name| self.leading.contains(name.as_str())) else { return };
        let [definition] = self.definitions_of(&name)[..] else {
            let replaced = &self.splice.name.text;
            let message = format!(
                "`{name}`, through which the equation uses `{replaced}`, is defined more than once"
            );
            diagnostics.error(
                Diagnostic::new(Code::EffectMismatch, self.splice.clause, message)
                    .label(expr.span, "used here")
                    .help(format!("to replace `{replaced}` everywhere, leave out `in`")),
            );
            return;
        };
        let mut opened = definition.value.clone();
        if let ExprKind::Call { arguments: given, .. } = &expr.kind {
            if given.len() != definition.arguments.len() {
                return; // reported when names are looked up
            }
            let names = definition.arguments.iter().map(|argument| argument.name.text.as_str());
            substitute(&mut opened, &names.zip(given).collect::<Vec<_>>());
        }
        done.grow(&opened);
        self.open_within(&mut opened, nesting + 1, done, diagnostics);
        *expr = opened;
    }
}
