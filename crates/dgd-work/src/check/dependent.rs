//! Linearly dependent algebraic equations: together they determine fewer unknowns than there are equations.

use dgd_compiler::diagnostics::{Code, Diagnostic};
use dgd_compiler::model::Model;
use dgd_compiler::pipeline::CompiledStages;
use dgd_compiler::source::Span;
use dgd_execute::{Engine, LoadedSystem};
use dgd_runtime::signature::number::short;
use dgd_runtime::{DependentEquations, Signature, System, dependent_equations};

/// Larger sets are not listed by name.
const MOST_NAMED: usize = 6;

/// A note for each dependent set of equations, for the choices with which the model is compiled.
pub(super) fn notes(compiled: &CompiledStages) -> Vec<Diagnostic> {
    let system = LoadedSystem::with_engine(compiled.program.clone(), Engine::Interpreter);
    let signature = system.signature();
    let p: Vec<f64> = signature.parameters.iter().map(|parameter| parameter.value).collect();
    let dependent = dependent_equations(&system, &p);
    dependent.iter().filter_map(|one| note(one, signature, &compiled.model)).collect()
}

fn note(one: &DependentEquations, signature: &Signature, model: &Model) -> Option<Diagnostic> {
    let labels: Vec<String> =
        one.equations.iter().map(|(row, _)| signature.equations.get(*row).to_string()).collect();
    let unknowns: Vec<String> =
        one.unknowns.iter().map(|i| signature.unknowns.name(*i).into_owned()).collect();
    let places: Vec<Option<Span>> = labels.iter().map(|label| place(label, model)).collect();
    let (first, at) = places.iter().enumerate().find_map(|(k, place)| Some((k, (*place)?)))?;
    let (equations, open) = (listed(&labels), listed(&unknowns));
    let message = match labels.len() {
        1 => format!("the equation {equations} does not determine {open}: it reads it nowhere"),
        _ => format!(
            "the equations {equations} are linearly dependent, so they do not determine {open}"
        ),
    };
    let help = match &one.equations[..] {
        [_, (_, factor)] if one.is_constant => {
            // Σ factor · equation = 0. An equation times −1 is the same equation.
            let times = short((1.0 / factor).abs(), 4);
            let (first, second) = (&labels[0], &labels[1]);
            format!(
                "in {open}, `{second}` is {times} times `{first}`: write what else holds in place of one of them"
            )
        }
        _ => format!("write what else holds of {open} in place of one of them"),
    };
    let others = places.iter().zip(&labels).enumerate().filter(|(k, _)| *k != first);
    let diagnostic = Diagnostic::new(Code::DependentEquations, at, message).help(help);
    Some(others.fold(diagnostic, |diagnostic, (_, (place, label))| match place {
        Some(span) if *span != at => diagnostic.label(*span, format!("`{label}` is here")),
        _ => diagnostic,
    }))
}

/// Span of an equation; for a member of a family, the span of the family.
fn place(label: &str, model: &Model) -> Option<Span> {
    let family = label.split('[').next().unwrap_or(label);
    let families = model.families.iter().map(|family| &family.equation);
    let mut equations = model.all_equations().chain(families);
    equations
        .find(|equation| equation.label == label || equation.label == family)
        .map(|found| found.span)
}

fn listed(names: &[String]) -> String {
    let named: Vec<String> =
        names.iter().take(MOST_NAMED).map(|name| format!("`{name}`")).collect();
    match (named.as_slice(), names.len().saturating_sub(MOST_NAMED)) {
        ([one], 0) => one.clone(),
        ([all @ .., last], 0) => format!("{} and {last}", all.join(", ")),
        (all, more) => format!("{} and {more} more", all.join(", ")),
    }
}
