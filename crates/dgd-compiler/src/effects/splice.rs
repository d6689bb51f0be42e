//! Replaces the uses of a name by an expression.
//!
//! A use is a name, or a call, in the model's text or in an item of another effect; a sensor's effect does not change
//! the items of others. If an earlier effect has replaced the same name, a later one takes the earlier expression as
//! the old value.

use std::collections::{BTreeMap, BTreeSet};

use super::EffectBlending;
use super::blend::blended;
use crate::diagnostics::{Code, Diagnostic, Diagnostics};
use crate::source::{SourceId, Span};
use crate::syntax::ast::{EffectKind, Expr, ExprKind, Name};
use crate::syntax::visit;

/// Deeper expressions are refused because every later pass recurses over trees.
pub(super) const DEEPEST: usize = 256;

/// A model may grow by this many operands.
const LARGEST: usize = 200_000;

/// Places where effects have replaced a name: the name, and the place of the new expression.
pub(super) type ReplacedNames = BTreeMap<(String, Span), Replacement>;

/// A replacement of a name.
#[derive(Debug)]
pub(super) struct Replacement {
    /// The clause of the effect, and its kind.
    clause: Span,
    kind: EffectKind,
    /// Names added by its applications, one of which occurs in the expression: a template applied to several names puts
    /// expressions with the same place into all of them.
    marks: BTreeSet<String>,
}

/// A name and its replacement.
#[derive(Debug)]
pub(super) struct Splice<'a> {
    pub(super) name: &'a Name,
    /// A function's arguments within `by`.
    pub(super) arguments: &'a [Name],
    pub(super) by: &'a Expr,
    /// The clause.
    pub(super) clause: Span,
    pub(super) kind: EffectKind,
    /// The effect's own file.
    pub(super) own: SourceId,
    /// Files of the model and its libraries.
    pub(super) model: &'a [SourceId],
    pub(super) blending: EffectBlending,
    /// λ, if the effect is blended in.
    pub(super) blend: Option<&'a str>,
    /// Names that the application adds.
    pub(super) marks: BTreeSet<String>,
}

/// The results of splices so far.
#[derive(Debug, Default)]
pub(super) struct SpliceResults {
    pub(super) replaced: ReplacedNames,
    n_operands: usize,
}

impl SpliceResults {
    /// Counts the growth of a model.
    pub(super) fn grow(&mut self, by: &Expr) {
        self.n_operands = self.n_operands.saturating_add(size(by));
    }

    /// Whether a model has grown beyond its limit.
    pub(super) fn is_too_much(&self) -> bool {
        self.n_operands > LARGEST
    }
}

impl Splice<'_> {
    /// Whether the effect can replace a name at this place.
    pub(super) fn can_replace(&self, span: Span) -> bool {
        match self.kind {
            EffectKind::Input | EffectKind::Plant => span.source != self.own,
            EffectKind::Sensor => self.model.contains(&span.source),
        }
    }

    /// Whether this is a use of the name, and not its derivative.
    pub(super) fn is_use(&self, expr: &Expr, hidden: &[&str], replaced: &ReplacedNames) -> bool {
        if self.earlier(expr, replaced).is_some() {
            return true;
        }
        let is_it = |name: &str| name == self.name.text && !hidden.contains(&name);
        match &expr.kind {
            ExprKind::Name(name) => is_it(name) && self.can_replace(expr.span),
            ExprKind::Call { function, .. } => {
                is_it(&function.text) && self.can_replace(function.span)
            }
            _ => false,
        }
    }

    /// The effect that has replaced the name here and acts before this one.
    fn earlier<'r>(&self, expr: &Expr, replaced: &'r ReplacedNames) -> Option<&'r Replacement> {
        let earlier = replaced.get(&(self.name.text.clone(), expr.span));
        let stands_here = |earlier: &&Replacement| {
            earlier.marks.is_empty() || mentions(expr, &|name| earlier.marks.contains(name))
        };
        // Input effects act before all others because the replacement of an input is not an input.
        let acts = |earlier: &&Replacement| {
            self.kind != EffectKind::Input || earlier.kind == EffectKind::Input
        };
        earlier.filter(acts).filter(stands_here)
    }

    /// Replaces the uses in an expression and returns their number.
    pub(super) fn replace(
        &self,
        expr: &mut Expr,
        hidden: &[&str],
        done: &mut SpliceResults,
        diagnostics: &mut Diagnostics,
    ) -> usize {
        if let Some(&Replacement { clause, kind, .. }) = self.earlier(expr, &done.replaced) {
            let plants = (kind, self.kind) == (EffectKind::Plant, EffectKind::Plant);
            if self.blending == EffectBlending::Applied && plants {
                let message =
                    format!("two plant effects replace `{}` at one place", self.name.text);
                diagnostics.error(
                    Diagnostic::new(Code::ConflictingEffects, self.clause, message)
                        .label(clause, "the other one"),
                );
                return 1;
            }
            self.put(expr, &[], done, diagnostics);
            return 1;
        }
        if matches!(expr.kind, ExprKind::Name(_)) {
            let is_use = self.is_use(expr, hidden, &done.replaced);
            if is_use {
                self.put(expr, &[], done, diagnostics);
            }
            return usize::from(is_use);
        }
        if is_derivative(expr) {
            return 0;
        }
        let mut n_uses = 0;
        for operand in visit::operands_mut(expr) {
            n_uses += self.replace(operand, hidden, done, diagnostics);
        }
        if self.is_use(expr, hidden, &done.replaced)
            && let ExprKind::Call { arguments, .. } = &mut expr.kind
        {
            let arguments = std::mem::take(arguments);
            self.put_call(expr, arguments, done, diagnostics);
            n_uses += 1;
        }
        n_uses
    }

    /// Replaces a call whose arguments have been removed from it.
    fn put_call(
        &self,
        expr: &mut Expr,
        given: Vec<Expr>,
        done: &mut SpliceResults,
        diagnostics: &mut Diagnostics,
    ) {
        let call = Expr {
            span: expr.span,
            kind: ExprKind::Call { function: self.name.clone(), arguments: given.clone() },
        };
        *expr = call;
        if let (ExprKind::Name(other), true) = (&self.by.kind, self.arguments.is_empty()) {
            // `replace f by g`
            let function = Name { text: other.clone(), span: self.by.span };
            let new =
                Expr { span: self.by.span, kind: ExprKind::Call { function, arguments: given } };
            self.stand_in(expr, new, done);
        } else if self.arguments.len() == given.len() {
            self.put(expr, &given, done, diagnostics);
        } else {
            let (n_given, n_named) = (given.len(), self.arguments.len());
            let names: Vec<String> = (1..=n_given).map(|i| format!("x{i}")).collect();
            let call = format!("{}({})", self.name.text, names.join(", "));
            let message = format!(
                "function `{}` takes {n_given} argument{}, but {n_named} {} named here",
                self.name.text,
                if n_given == 1 { "" } else { "s" },
                if n_named == 1 { "is" } else { "are" },
            );
            diagnostics.error(
                Diagnostic::new(Code::ArgumentCount, self.name.span, message)
                    .help(format!("write `replace {call} by …`")),
            );
        }
    }

    /// Replaces a use by the new expression, with the use as its old value.
    fn put(
        &self,
        expr: &mut Expr,
        given: &[Expr],
        done: &mut SpliceResults,
        diagnostics: &mut Diagnostics,
    ) {
        let values: Vec<(&str, &Expr)> =
            self.arguments.iter().map(|name| name.text.as_str()).zip(given).collect();
        let mut new = self.by.clone();
        let is_plain_use = matches!(expr.kind, ExprKind::Name(_) | ExprKind::Call { .. })
            && self.earlier(expr, &done.replaced).is_none();
        if is_plain_use {
            substitute(&mut new, &values);
        } else {
            let mut values = values;
            values.push((&self.name.text, expr));
            substitute(&mut new, &values);
        }
        new.span = self.by.span;
        self.stand_in(expr, new, done);
        if depth(expr) > DEEPEST || done.is_too_much() {
            diagnostics.error(too_large(self.clause));
            *expr = self.by.clone();
        }
    }

    /// old + λ (new − old), or new.
    fn stand_in(&self, expr: &mut Expr, new: Expr, done: &mut SpliceResults) {
        let span = self.by.span;
        done.grow(&new);
        *expr = match self.blend {
            None => new,
            Some(blend) => blended(expr.clone(), new, blend, span),
        };
        let (clause, kind) = (self.clause, self.kind);
        let marks = BTreeSet::new();
        let here = done.replaced.entry((self.name.text.clone(), span));
        let here = here.or_insert(Replacement { clause, kind, marks });
        (here.clause, here.kind) = (clause, kind);
        here.marks.extend(self.marks.iter().cloned());
    }
}

/// Whether an expression reads or calls one of some names.
pub(super) fn mentions(expr: &Expr, is_one: &dyn Fn(&str) -> bool) -> bool {
    let is_it = match &expr.kind {
        ExprKind::Name(name) => is_one(name),
        ExprKind::Call { function, .. } => is_one(&function.text),
        _ => false,
    };
    is_it || visit::operands(expr).into_iter().any(|operand| mentions(operand, is_one))
}

/// The error for a model that grows beyond its limit.
pub(super) fn too_large(span: Span) -> Diagnostic {
    Diagnostic::new(
        Code::ModelTooLarge,
        span,
        "the model becomes too large when this is put into it",
    )
    .help("name parts of the expressions with `let`, or replace the name everywhere")
}

/// Whether this is `der(x)`: a derivative is not its state, and stays.
pub(super) fn is_derivative(expr: &Expr) -> bool {
    matches!(&expr.kind, ExprKind::Call { function, .. } if function.text == "der")
}

/// Replaces names by values.
pub(super) fn substitute(expr: &mut Expr, values: &[(&str, &Expr)]) {
    if let ExprKind::Name(name) = &expr.kind {
        if let Some((_, value)) = values.iter().find(|(known, _)| known == name) {
            *expr = (*value).clone();
        }
        return;
    }
    if is_derivative(expr) {
        return;
    }
    for operand in visit::operands_mut(expr) {
        substitute(operand, values);
    }
}

/// Depth of an expression.
pub(super) fn depth(expr: &Expr) -> usize {
    1 + visit::operands(expr).into_iter().map(depth).max().unwrap_or(0)
}

/// Number of nodes of an expression.
fn size(expr: &Expr) -> usize {
    1 + visit::operands(expr).into_iter().map(size).sum::<usize>()
}
