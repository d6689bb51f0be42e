//! The equations of a model's text.

use dgd_compiler::model::typeset::formula::{FormulaLine, lines};
use dgd_compiler::model::typeset::mathml;

use super::DiscoverySubject;
use super::diff::{ChangedLine, merged};
use crate::error::WorkError;
use crate::model::Compilation;

/// A typeset line of equations.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct TypesetEquation {
    /// As MathML.
    pub(super) formula: String,
    /// The label of an equation; empty for anything else.
    pub(super) label: String,
}

/// The equations of a model before and after, with the variants of the command line, in one list.
pub(super) fn changed(
    subject: &DiscoverySubject<'_>,
    after: &str,
) -> Result<Vec<ChangedLine<TypesetEquation>>, WorkError> {
    let (before, after) = (typeset(subject, subject.base)?, typeset(subject, after)?);
    Ok(merged(&before, &after, |equation| format!("{} {}", equation.label, equation.formula)))
}

fn typeset(subject: &DiscoverySubject<'_>, text: &str) -> Result<Vec<TypesetEquation>, WorkError> {
    let mut compilation = Compilation::new(subject.files);
    let options = compilation.options(subject.choices)?;
    let (asts, model) = match compilation.resolve(subject.model, text.to_owned(), &options) {
        Ok(resolved) => resolved,
        Err(reported) => return Err(compilation.fail(reported)),
    };
    let equation = |line: &FormulaLine| {
        let label = match line {
            FormulaLine::Equation { label, .. } => label.clone().unwrap_or_default(),
            FormulaLine::Mode(_) | FormulaLine::Transition(_) | FormulaLine::Bound { .. } => {
                String::new()
            }
        };
        TypesetEquation { formula: mathml::write(line), label }
    };
    Ok(lines(&asts, &model).iter().map(equation).collect())
}
