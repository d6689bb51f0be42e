//! Finds the effects that hide one another if several are blended in with a weight of zero.
//!
//! Effects on one use are stacked: the model reads the value of the last. If that value does not read the old one, it
//! hides every effect that acts through the old value, although it changes nothing itself.
//!
//! ```text
//! replace mu by mu_max*S/(K_s + S + inh*S^2)     hides all effects that act through the model's own `mu`
//! replace mu by mu*(1 - Xm*X)                    hides nothing
//! ```

use std::collections::{BTreeMap, BTreeSet};

use super::declared::NameDeclarations;
use super::instance::{ChangeKind, EffectInstance};
use super::{EffectApplication, EffectBlending, units};
use crate::diagnostics::{Diagnostics, ErrorReported};
use crate::model::{ModelOptions, resolve};
use crate::parts;
use crate::syntax::ast::{Ast, Expr, ExprKind, ItemKind};
use crate::syntax::local::without_lets;
use crate::syntax::visit::{self, Namespace};

/// The names that an effect replaces in a model, and those that it hides there.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct EffectReach {
    replaced: BTreeSet<(Namespace, String)>,
    hidden: BTreeSet<(Namespace, String)>,
    /// It replaces an unknown, which any equation may help to determine.
    hides_everything: bool,
}

impl EffectReach {
    /// The reach of an application; `asts` are the model's tree and those of its imports.
    ///
    /// # Errors
    ///
    /// [`ErrorReported`] if the effect does not fit the model.
    ///
    /// # Panics
    ///
    /// If `asts` is empty: a compilation has a main file.
    pub fn find(
        asts: &[Ast],
        application: &EffectApplication<'_>,
    ) -> Result<EffectReach, ErrorReported> {
        let mut diagnostics = Diagnostics::default();
        let expanded = parts::expand(asts, &mut diagnostics)?;
        let mut declared = NameDeclarations::collect(&expanded.asts);
        if units::of_equations(application.effect)
            && let Ok(model) = resolve(asts, &ModelOptions::default(), &mut diagnostics)
        {
            declared.give_units(&model);
        }
        let mut diagnostics = Diagnostics::default();
        let instance = EffectInstance::new(
            application,
            &asts[0],
            &mut declared,
            EffectBlending::Null,
            &mut diagnostics,
        )?;
        let definitions = ModelDefinitions::collect(&expanded.asts);
        let mut reach = EffectReach::default();
        // A blend keeps the old value.
        let is_blended = instance.brought.blend.is_some();
        for change in &instance.changes {
            let (key, by, own) = match &change.kind {
                ChangeKind::Replace { name, by, .. } => {
                    ((Namespace::Value, name.text.clone()), by, &name.text)
                }
                ChangeKind::Output { output, own, by } => {
                    ((Namespace::Output, output.text.clone()), by, own)
                }
                ChangeKind::Add { .. } => continue,
            };
            reach.replaced.insert(key.clone());
            if !is_blended && !surely_reads(by, own) {
                reach.hides_everything |= definitions.unknowns.contains(&key);
                definitions.hide(key, &mut reach.hidden);
            }
        }
        Ok(reach)
    }

    /// Whether one of two effects hides the other, so that they cannot be blended in together.
    pub fn excludes(&self, other: &EffectReach) -> bool {
        let hides = |one: &EffectReach, other: &EffectReach| {
            one.hides_everything || !one.hidden.is_disjoint(&other.replaced)
        };
        hides(self, other) || hides(other, self)
    }
}

/// The definitions of a model's names.
#[derive(Debug, Default)]
struct ModelDefinitions {
    /// Names that `let`s, functions and outputs read.
    reads: BTreeMap<(Namespace, String), BTreeSet<String>>,
    unknowns: BTreeSet<(Namespace, String)>,
}

impl ModelDefinitions {
    fn collect(asts: &[Ast]) -> ModelDefinitions {
        let mut definitions = ModelDefinitions::default();
        for ast in asts {
            visit::items(&ast.items, &mut |item| match &item.kind {
                ItemKind::Let { name, value, .. } => {
                    let key = (Namespace::Value, name.text.clone());
                    collect(value, definitions.reads.entry(key).or_default());
                }
                ItemKind::Function { name, lets, body, .. } => {
                    let key = (Namespace::Value, name.text.clone());
                    collect(&without_lets(lets, body), definitions.reads.entry(key).or_default());
                }
                ItemKind::Output { name, value, .. } => {
                    let key = (Namespace::Output, name.text.clone());
                    let read = definitions.reads.entry(key).or_default();
                    match value {
                        Some(value) => collect(value, read),
                        None => {
                            read.insert(name.text.clone());
                        }
                    }
                }
                ItemKind::Unknown { name, .. } => {
                    definitions.unknowns.insert((Namespace::Value, name.text.clone()));
                }
                ItemKind::Array { declared, name, .. } => {
                    if declared.is_unknown() {
                        definitions.unknowns.insert((Namespace::Value, name.text.clone()));
                    }
                }
                ItemKind::Import { .. }
                | ItemKind::Table { .. }
                | ItemKind::Constant { .. }
                | ItemKind::Parameter { .. }
                | ItemKind::Input { .. }
                | ItemKind::Size { .. }
                | ItemKind::For { .. }
                | ItemKind::Equation { .. }
                | ItemKind::Variant { .. }
                | ItemKind::Modes { .. }
                | ItemKind::Part { .. }
                | ItemKind::Binding { .. }
                | ItemKind::When(_)
                | ItemKind::Every { .. }
                | ItemKind::Unit { .. }
                | ItemKind::Start(_)
                | ItemKind::Saturate { .. } => {}
            });
        }
        definitions
    }

    /// Hides a name and the names that define it.
    fn hide(&self, key: (Namespace, String), hidden: &mut BTreeSet<(Namespace, String)>) {
        let mut open = vec![key];
        while let Some(key) = open.pop() {
            if hidden.insert(key.clone()) {
                let read = self.reads.get(&key).into_iter().flatten();
                open.extend(read.map(|name| (Namespace::Value, name.clone())));
            }
        }
    }
}

/// Names that an expression reads or calls.
fn collect(expr: &Expr, names: &mut BTreeSet<String>) {
    match &expr.kind {
        ExprKind::Name(name) => {
            names.insert(name.clone());
        }
        ExprKind::Call { function, .. } => {
            names.insert(function.text.clone());
        }
        _ => {}
    }
    for operand in visit::operands(expr) {
        collect(operand, names);
    }
}

/// Whether an expression reads a name regardless of its conditions.
fn surely_reads(expr: &Expr, name: &str) -> bool {
    match &expr.kind {
        ExprKind::Name(own) => own == name,
        ExprKind::If(_, a, b) => surely_reads(a, name) && surely_reads(b, name),
        ExprKind::Call { function, .. } if function.text == name => true,
        _ => visit::operands(expr).into_iter().any(|operand| surely_reads(operand, name)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Effect;
    use crate::source::{SourceMap, SourceText};
    use crate::syntax::parse;

    const REACTOR: &str = "\
model reactor
parameter m [1/s] = 1
parameter K [1] = 1
state s [1] = 1
unknown f [1]
let mu = m*s/(K + s)
let rate = 2*mu
equation substrate: der(s) = -rate
equation flow: f = s
output s
output r [1/s] = rate
";

    /// Whether two effects exclude each other, given their clauses; each adds `a`, which is zero at its null.
    fn exclude(one: &str, other: &str) -> bool {
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let mut parsed = |text: String| {
            let id = sources.add(SourceText { name: "test.dgd".to_owned(), text });
            parse(id, &sources, &mut diagnostics).expect("it is sound")
        };
        let model = [parsed(REACTOR.to_owned())];
        let [one, other] = [one, other].map(|clauses| {
            let kind = if clauses.contains("output") { "sensor" } else { "plant" };
            parsed(format!("effect e on reactor\nkind {kind}\nparameter a [1] = 0\n{clauses}\n"))
        });
        let mut reach = |ast: Ast| {
            let effect = Effect::read(ast, &mut diagnostics).expect("an effect");
            let span = effect.name.span;
            let application = EffectApplication { effect: &effect, arguments: Vec::new(), span };
            EffectReach::find(&model, &application).expect("it fits")
        };
        let (one, other) = (reach(one), reach(other));
        assert_eq!(one.excludes(&other), other.excludes(&one));
        one.excludes(&other)
    }

    #[test]
    fn what_does_not_read_the_old_value_hides_what_acts_through_it() {
        let haldane = "null a = 0\nreplace mu by m*s/(K + s + a*s^2)";
        let contois = "null a = 0\nreplace mu by m*s/(K + s + a)";
        let factor = "null a = 0\nreplace mu by mu*(1 + a)";
        assert!(exclude(haldane, contois));
        assert!(exclude(haldane, factor));
        assert!(!exclude(factor, factor));
        // Through a `let` in its definition, and not next to it or after it.
        assert!(exclude(haldane, "null a = 0\nreplace K by K*(1 + a)"));
        assert!(!exclude(haldane, "null a = 0\nreplace rate by rate*(1 + a)"));
        assert!(exclude("null a = 0\nreplace rate by 2*(1 + a)*m*s/(K + s)", haldane));
        assert!(!exclude(haldane, "null a = 0\nadd a*m to substrate"));
        // Without a null it is blended in, which keeps the old value.
        assert!(!exclude("replace mu by m*s/(K + s + a*s^2)", factor));
    }

    #[test]
    fn the_old_value_must_be_read_whatever_conditions_are() {
        let factor = "null a = 0\nreplace mu by mu*(1 + a)";
        let one_way = "null a = 0\nreplace mu by if s > 1 then mu else m*s/(K + s + a)";
        let both_ways = "null a = 0\nreplace mu by if s > 1 then mu else mu/(1 + a)";
        assert!(exclude(one_way, factor));
        assert!(!exclude(both_ways, factor));
    }

    #[test]
    fn readings_hide_readings_and_unknowns_hide_everything() {
        let offset = "null a = 0\nreplace output r by r + a*m";
        let other = "null a = 0\nreplace output r by 2*m*s/(K + s)*(1 + a)";
        assert!(exclude(offset, other));
        assert!(!exclude(offset, offset));
        assert!(!exclude(offset, "null a = 0\nreplace output s by s*(1 + a)"));
        let unknown = "null a = 0\nreplace f by s*(1 + a)";
        assert!(exclude(unknown, "null a = 0\nadd a*m to substrate"));
    }
}
