//! Applies effects to a model's trees.
//!
//! Each application becomes an instance with names of the model. All instances add their items; then they make their
//! changes: first those of the plant, which see the model as its author wrote it, then those of sensors, which see the
//! current values of the outputs, and finally those of inputs, which reach everything that reads an input, including
//! start values and other effects.

use super::blend::{blended, times};
use super::declared::NameDeclarations;
use super::instance::{AppliedChange, ChangeKind, EffectInstance};
use super::open::{ExpandableDefinitions, ExpressionExpansion, VariantPath};
use super::splice::{DEEPEST, Splice, SpliceResults, depth, substitute, too_large};
use super::{EffectApplication, EffectBlending, ModelWithEffects, signs, units};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported, suggestion};
use crate::model::{ModelOptions, resolve};
use crate::parts::{self, FlatModel};
use crate::source::SourceId;
use crate::syntax::ast::{
    Ast, EffectKind, Expr, ExprKind, Item, ItemKind, Name, Sign, WrittenUnit,
};
use crate::syntax::print::parenthesise;
use crate::syntax::visit::{self, ExprRole, ItemPart, Namespace};

/// Applies effects to a model; `asts` are its tree and those of its imports.
///
/// The changed trees pass through the later stages like those of any model. Libraries and parts are unchanged, unless
/// an effect changes an item of one: then the model contains its items itself.
///
/// # Errors
///
/// [`ErrorReported`] if an effect does not fit the model or another effect. Terms that it adds to an equation are
/// checked later like any other, with places in the effect's file.
///
/// # Panics
///
/// If `asts` is empty: a compilation has a main file.
pub fn apply(
    asts: &[Ast],
    applications: &[EffectApplication<'_>],
    blending: EffectBlending,
    diagnostics: &mut Diagnostics,
) -> Result<ModelWithEffects, ErrorReported> {
    let expanded = parts::expand(asts, diagnostics)?;
    let mut problems = Diagnostics::default();
    let mut declared = NameDeclarations::collect(&expanded.asts);
    if applications.iter().any(|application| units::of_equations(application.effect)) {
        // Errors of the model itself are reported elsewhere.
        let model = resolve(asts, &ModelOptions::default(), &mut Diagnostics::default());
        if let Ok(model) = model {
            declared.give_units(&model);
        }
    }
    let mut instances = Vec::with_capacity(applications.len());
    for application in applications {
        // Each application reports its own errors; the next is independent of them.
        let instance =
            EffectInstance::new(application, &asts[0], &mut declared, blending, &mut problems);
        instances.extend(instance.ok());
    }
    let mut splicing = SplicedModel {
        model: asts.iter().map(|ast| ast.source).collect(),
        asts: expanded.asts.to_vec(),
        declared,
        blending,
        done: SpliceResults::default(),
    };
    if problems.check().is_ok() {
        for instance in &instances {
            splicing.asts[0].items.extend(instance.items.iter().cloned());
        }
        for kind in [EffectKind::Plant, EffectKind::Sensor, EffectKind::Input] {
            for instance in ordered(instances.iter().filter(|one| one.kind == kind).collect()) {
                splicing.change(instance, &mut problems);
            }
        }
    }
    for diagnostic in problems.sorted() {
        diagnostics.error(diagnostic.clone());
    }
    problems.check()?;
    let brought = instances.into_iter().map(|instance| instance.brought).collect();
    Ok(ModelWithEffects { asts: splicing.finished(asts, &expanded), brought })
}

/// Applications in an order in which each finds the names that it changes already declared; in the given order if no
/// such order exists.
fn ordered(mut left: Vec<&EffectInstance>) -> Vec<&EffectInstance> {
    let mut order = Vec::with_capacity(left.len());
    while !left.is_empty() {
        let waits = |one: &&EffectInstance| {
            let mut others = left.iter().filter(|other| !std::ptr::eq(**other, *one));
            others.any(|other| one.replaced().any(|name| other.mentions(name)))
        };
        let next = left.iter().position(|one| !waits(one)).unwrap_or(0);
        order.push(left.remove(next));
    }
    order
}

/// A model that is being changed.
struct SplicedModel {
    asts: Vec<Ast>,
    /// The files of the model, its libraries and its parts.
    model: Vec<SourceId>,
    declared: NameDeclarations,
    blending: EffectBlending,
    done: SpliceResults,
}

impl SplicedModel {
    /// The trees with the parentheses that they need.
    fn finished(mut self, before: &[Ast], expanded: &FlatModel<'_>) -> Vec<Ast> {
        let same = self.asts[1..] == expanded.asts[1..];
        let folded = same.then(|| parts::fold(before, expanded, &self.asts[0].items)).flatten();
        match folded {
            Some(items) => {
                self.asts[0].items = items;
                self.asts.truncate(1);
                self.asts.extend_from_slice(&before[1..]);
            }
            None => self.take_libraries_in(),
        }
        let model = self.model;
        for item in &mut self.asts[0].items {
            visit::parts_mut(item, &mut |part| {
                if let ItemPart::Expr(_, expr) = part {
                    signs::tidy(expr, &model);
                    parenthesise(expr);
                }
            });
        }
        self.asts
    }

    /// Replaces the first import by the items of all libraries.
    fn take_libraries_in(&mut self) {
        let is_import = |item: &Item| matches!(item.kind, ItemKind::Import { .. });
        let libraries = self.asts.split_off(1);
        let main = &mut self.asts[0];
        let position = main.items.iter().position(is_import).unwrap_or(0);
        main.items.retain(|item| !is_import(item));
        main.imports.clear();
        let items = libraries.into_iter().flat_map(|library| library.items);
        main.items.splice(position..position, items.filter(|item| !is_import(item)));
    }

    /// Makes the changes of one application.
    fn change(&mut self, instance: &EffectInstance, diagnostics: &mut Diagnostics) {
        let readings: Vec<(&str, Expr)> = instance
            .readings
            .iter()
            .filter_map(|(slot, output)| Some((slot.as_str(), self.reading(output, diagnostics)?)))
            .collect();
        let values: Vec<(&str, &Expr)> = readings.iter().map(|(slot, e)| (*slot, e)).collect();
        self.read_outputs(instance, &values);
        for change in &instance.changes {
            let mut change = change.clone();
            if !matches!(change.kind, ChangeKind::Output { .. }) {
                substitute(change.kind.expression_mut(), &values);
            }
            self.make(instance, &change, diagnostics);
        }
    }

    /// Replaces the names of outputs in the items of an application by the outputs' values.
    fn read_outputs(&mut self, instance: &EffectInstance, values: &[(&str, &Expr)]) {
        if values.is_empty() {
            return;
        }
        for item in &mut self.asts[0].items {
            if item.span.source == instance.brought.source
                && instance.items.iter().any(|own| own == item)
            {
                visit::parts_mut(item, &mut |part| {
                    if let ItemPart::Expr(_, expr) = part {
                        substitute(expr, values);
                    }
                });
            }
        }
    }

    /// The current value of an output.
    fn reading(&self, output: &Name, diagnostics: &mut Diagnostics) -> Option<Expr> {
        let mut values: Vec<Expr> = Vec::new();
        visit::items(&self.asts[0].items, &mut |item| {
            if let ItemKind::Output { name, value, .. } = &item.kind
                && name.text == output.text
            {
                values.push(read_by(name, value.as_ref()));
            }
        });
        if let [one] = values.as_slice() {
            return Some(one.clone());
        }
        let message = format!("output `{}` is not declared once", output.text);
        diagnostics.error(Diagnostic::new(Code::EffectMismatch, output.span, message));
        None
    }

    fn make(
        &mut self,
        instance: &EffectInstance,
        change: &AppliedChange,
        diagnostics: &mut Diagnostics,
    ) {
        match &change.kind {
            ChangeKind::Replace { name, arguments, equation, by } => {
                let model = self.model.clone();
                let brought = &instance.brought;
                let parameters = brought.names.iter().map(|(_, name)| name);
                let marks = parameters.chain(&brought.blend).cloned().collect();
                let splice = Splice {
                    name,
                    arguments,
                    by,
                    clause: change.span,
                    kind: instance.kind,
                    own: brought.source,
                    model: &model,
                    blending: self.blending,
                    blend: brought.blend.as_deref(),
                    marks,
                };
                self.replace(&splice, equation.as_ref(), diagnostics);
            }
            ChangeKind::Output { output, own, by } => {
                let blend = instance.brought.blend.as_deref();
                self.replace_output(output, own, by, blend, diagnostics);
            }
            ChangeKind::Add { equation, value } => {
                let blend = instance.brought.blend.as_deref();
                self.add(equation, value, blend, diagnostics);
            }
        }
    }

    fn replace(
        &mut self,
        splice: &Splice<'_>,
        equation: Option<&Name>,
        diagnostics: &mut Diagnostics,
    ) {
        let name = splice.name;
        let is_known = matches!(name.text.as_str(), "time" | "pi")
            || self.declared.get(Namespace::Value, &name.text).is_some();
        if !is_known {
            let known = self.declared.names_in(Namespace::Value);
            let message = format!("nothing is called `{}`", name.text);
            diagnostics.error(unknown(name, message, known));
            return;
        }
        let n_uses = match equation {
            None => self.replace_everywhere(splice, diagnostics),
            Some(label) => match self.replace_in(splice, label, diagnostics) {
                Some(n_uses) => n_uses,
                None => return,
            },
        };
        if n_uses == 0 && diagnostics.check().is_ok() {
            let message = match equation {
                None => format!("nothing uses `{}`, so there is nothing to replace", name.text),
                Some(label) => format!("equation `{}` does not use `{}`", label.text, name.text),
            };
            let span = equation.map_or(name.span, |label| label.span);
            let diagnostic = Diagnostic::new(Code::EffectMismatch, span, message);
            let declared = equation.and_then(|l| self.declared.get(Namespace::Equation, &l.text));
            diagnostics.error(match declared {
                Some(declared) => diagnostic.label(declared.span, "the equation"),
                None => diagnostic,
            });
        }
    }

    /// Replaces a name in equations, `let`s, functions and outputs; an input also in start values.
    fn replace_everywhere(&mut self, splice: &Splice<'_>, diagnostics: &mut Diagnostics) -> usize {
        let mut n_uses = 0;
        for ast in &mut self.asts {
            let unit = self.declared.unit(Namespace::Value, &splice.name.text);
            visit::items_mut(&mut ast.items, &mut |item| read_explicitly(item, splice, unit));
            for item in &mut ast.items {
                visit::parts_mut(item, &mut |part| {
                    let ItemPart::Expr(place, expr) = part else { return };
                    let hidden: Vec<&str> = match place {
                        ExprRole::Declaration | ExprRole::Noise(_) => return,
                        ExprRole::Start if splice.kind != EffectKind::Input => return,
                        ExprRole::Body(_, arguments) => {
                            arguments.iter().map(|argument| argument.name.text.as_str()).collect()
                        }
                        ExprRole::Start
                        | ExprRole::Let(_)
                        | ExprRole::Output(_)
                        | ExprRole::Left(_)
                        | ExprRole::Right(_)
                        | ExprRole::Transition => Vec::new(),
                    };
                    n_uses += splice.replace(expr, &hidden, &mut self.done, diagnostics);
                });
            }
        }
        n_uses
    }

    /// Replaces a name in equations of one label; `None` if there is no such equation.
    fn replace_in(
        &mut self,
        splice: &Splice<'_>,
        label: &Name,
        diagnostics: &mut Diagnostics,
    ) -> Option<usize> {
        self.verify_equation(label, diagnostics).ok()?;
        let definitions = ExpandableDefinitions::collect(&self.asts);
        let done = &mut self.done;
        let mut n_uses = 0;
        equations_mut(&mut self.asts[0].items, &mut VariantPath::new(), &mut |path, own, sides| {
            if own.text != label.text {
                return;
            }
            let opening = ExpressionExpansion::new(splice, &definitions, path, done);
            for side in sides {
                opening.open(side, done, diagnostics);
                n_uses += splice.replace(side, &[], done, diagnostics);
            }
        });
        Some(n_uses)
    }

    fn replace_output(
        &mut self,
        output: &Name,
        own: &str,
        by: &Expr,
        blend: Option<&str>,
        diagnostics: &mut Diagnostics,
    ) {
        let unit = self.declared.unit(Namespace::Output, &output.text).cloned();
        let mut n_outputs = 0;
        visit::items_mut(&mut self.asts[0].items, &mut |item| {
            let ItemKind::Output { name, unit: declared, value, .. } = &mut item.kind else {
                return;
            };
            if name.text != output.text {
                return;
            }
            n_outputs += 1;
            let old = read_by(name, value.as_ref());
            if value.is_none() && declared.is_none() {
                declared.clone_from(&unit);
            }
            let mut new = by.clone();
            substitute(&mut new, &[(own, &old)]);
            *value = Some(match blend {
                None => new,
                Some(blend) => blended(old, new, blend, by.span),
            });
            if value.as_ref().is_some_and(|value| depth(value) > DEEPEST) {
                diagnostics.error(too_large(by.span));
                *value = None;
            }
        });
        if n_outputs == 0 {
            let message = format!("there is no output `{}`", output.text);
            diagnostics.error(unknown(output, message, self.declared.names_in(Namespace::Output)));
        }
    }

    fn add(
        &mut self,
        label: &Name,
        value: &Expr,
        blend: Option<&str>,
        diagnostics: &mut Diagnostics,
    ) {
        if self.verify_equation(label, diagnostics).is_err() {
            return;
        }
        let value = match blend {
            None => value.clone(),
            Some(blend) => times(blend, value.clone()),
        };
        equations_mut(
            &mut self.asts[0].items,
            &mut VariantPath::new(),
            &mut |_, own, [_, right]| {
                if own.text == label.text {
                    add_term(right, &value);
                }
            },
        );
    }

    fn verify_equation(
        &self,
        label: &Name,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        if self.declared.get(Namespace::Equation, &label.text).is_some() {
            return Ok(());
        }
        let message = format!("there is no equation `{}`", label.text);
        let known = self.declared.names_in(Namespace::Equation);
        Err(diagnostics.error(unknown(label, message, known)))
    }
}

fn unknown<'a>(name: &Name, message: String, known: impl Iterator<Item = &'a str>) -> Diagnostic {
    let near = suggestion(&name.text, known).map(|near| format!("did you mean `{near}`?"));
    Diagnostic::new(Code::UnknownName, name.span, message).maybe_help(near)
}

/// The value of an output: by default the unknown of its name.
fn read_by(name: &Name, value: Option<&Expr>) -> Expr {
    let unknown = || Expr { span: name.span, kind: ExprKind::Name(name.text.clone()) };
    value.cloned().unwrap_or_else(unknown)
}

/// Writes out the value of an output that has the replaced name.
fn read_explicitly(item: &mut Item, splice: &Splice<'_>, unit: Option<&WrittenUnit>) {
    if let ItemKind::Output { name, unit: declared, value: value @ None, .. } = &mut item.kind
        && name.text == splice.name.text
        && splice.can_replace(name.span)
    {
        *value = Some(read_by(name, None));
        if declared.is_none() {
            *declared = unit.cloned();
        }
    }
}

/// Visits every equation, with the choices that contain it.
fn equations_mut(
    items: &mut [Item],
    path: &mut VariantPath,
    visit: &mut dyn FnMut(&VariantPath, &Name, [&mut Expr; 2]),
) {
    for item in items {
        match &mut item.kind {
            ItemKind::Equation { label, left, right, .. } => visit(path, label, [left, right]),
            ItemKind::Variant { name, choices } => {
                for (i, choice) in choices.iter_mut().enumerate() {
                    path.push((name.text.clone(), i));
                    equations_mut(&mut choice.items, path, visit);
                    path.pop();
                }
            }
            ItemKind::Modes { modes, .. } => {
                for mode in modes {
                    equations_mut(&mut mode.items, path, visit);
                }
            }
            ItemKind::For { items, .. } => equations_mut(items, path, visit),
            ItemKind::Import { .. }
            | ItemKind::Constant { .. }
            | ItemKind::Parameter { .. }
            | ItemKind::Input { .. }
            | ItemKind::Unknown { .. }
            | ItemKind::Size { .. }
            | ItemKind::Array { .. }
            | ItemKind::Let { .. }
            | ItemKind::Function { .. }
            | ItemKind::Table { .. }
            | ItemKind::Output { .. }
            | ItemKind::Part { .. }
            | ItemKind::Binding { .. }
            | ItemKind::When(_)
            | ItemKind::Every { .. }
            | ItemKind::Unit { .. }
            | ItemKind::Start(_)
            | ItemKind::Saturate { .. } => {}
        }
    }
}

/// Adds a term, or the terms of a sum.
fn add_term(right: &mut Expr, value: &Expr) {
    let span = right.span;
    let terms = match &value.kind {
        ExprKind::Sum(terms) => terms.clone(),
        ExprKind::Negate(term) => vec![(Sign::Minus, (**term).clone())],
        _ => vec![(Sign::Plus, value.clone())],
    };
    if let ExprKind::Sum(all) = &mut right.kind {
        all.extend(terms);
        return;
    }
    let first = right.clone();
    let signed = std::iter::once((Sign::Plus, first)).chain(terms).collect();
    *right = Expr { span, kind: ExprKind::Sum(signed) };
}
