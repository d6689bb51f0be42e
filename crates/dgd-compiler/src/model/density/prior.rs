//! `prior`: the density of a parameter before a fit.

use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::display::number;
use crate::model::expression::NumberReading;
use crate::model::resolver::ModelResolver;
use crate::model::{Parameter, PriorDensity};
use crate::source::Span;
use crate::syntax::ast::{Expr, PriorLaw};
use crate::units::Unit;

impl<'a> ModelResolver<'a> {
    /// Its density; locations and scales are in the unit of the parameter.
    pub(in crate::model) fn prior(
        &mut self,
        law: PriorLaw,
        [first, second]: [&'a Expr; 2],
        unit: &Unit,
        diagnostics: &mut Diagnostics,
    ) -> Result<PriorDensity, ErrorReported> {
        let what = |k: usize| format!("{} of a prior", law.numbers()[k]);
        Ok(match law {
            PriorLaw::Normal => {
                let mean = self.lowering.known(first, unit, NumberReading::Value, diagnostics)?;
                let std = self.lowering.positive(second, unit, &what(1), diagnostics)?;
                PriorDensity::Normal { mean, std }
            }
            PriorLaw::LogNormal => {
                verify_nothing_is_zero(law, unit, first.span, diagnostics)?;
                let median = self.lowering.positive(first, unit, &what(0), diagnostics);
                let sigma = self.lowering.positive(second, &Unit::one(), &what(1), diagnostics)?;
                PriorDensity::LogNormal { median: median?, sigma }
            }
            PriorLaw::Uniform => {
                let lower = self.lowering.known(first, unit, NumberReading::Value, diagnostics);
                let upper = self.lowering.known(second, unit, NumberReading::Value, diagnostics)?;
                let lower = lower?;
                if lower >= upper {
                    let message = "the ends of this prior leave nothing between them";
                    let span = Span { end: second.span.end, ..first.span };
                    return Err(diagnostics.error(
                        Diagnostic::new(Code::ReversedBounds, span, message)
                            .help("write the smaller end first"),
                    ));
                }
                PriorDensity::Uniform { lower, upper }
            }
            PriorLaw::Laplace => {
                let median = self.lowering.known(first, unit, NumberReading::Value, diagnostics)?;
                let scale = self.lowering.positive(second, unit, &what(1), diagnostics)?;
                PriorDensity::Laplace { median, scale }
            }
            PriorLaw::Gamma => {
                verify_nothing_is_zero(law, unit, second.span, diagnostics)?;
                let shape = self.lowering.positive(first, &Unit::one(), &what(0), diagnostics);
                let scale = self.lowering.positive(second, unit, &what(1), diagnostics)?;
                let shape = shape?;
                if shape < 1.0 {
                    let message = "below a shape of 1 this density is largest at zero, without end";
                    return Err(diagnostics.error(
                        Diagnostic::new(Code::ReversedBounds, first.span, message)
                            .help("write a shape of 1 or more"),
                    ));
                }
                PriorDensity::Gamma { shape, scale }
            }
        })
    }
}

/// Refuses a density of positive values in a unit with an offset.
fn verify_nothing_is_zero(
    law: PriorLaw,
    unit: &Unit,
    span: Span,
    diagnostics: &mut Diagnostics,
) -> Result<(), ErrorReported> {
    if unit.offset == 0.0 {
        return Ok(());
    }
    let message = format!(
        "a prior `{}` is of what begins at nothing, and `{}` has a zero of its own",
        law.word(),
        unit.symbol
    );
    let help = format!("declare the parameter in `{}`", unit.of_differences().symbol);
    Err(diagnostics.error(Diagnostic::new(Code::NoiseRelativeToOffset, span, message).help(help)))
}

/// Narrows the bounds of a parameter to the support of its prior, and checks that its value lies there.
pub(in crate::model) fn within_support(
    parameter: &mut Parameter,
    value: Span,
    prior: Span,
    diagnostics: &mut Diagnostics,
) -> Result<(), ErrorReported> {
    let (lower, upper) = match parameter.prior {
        Some(PriorDensity::Uniform { lower, upper }) => (lower, upper),
        Some(PriorDensity::LogNormal { .. } | PriorDensity::Gamma { .. }) => (0.0, f64::INFINITY),
        Some(PriorDensity::Normal { .. } | PriorDensity::Laplace { .. }) | None => return Ok(()),
    };
    let begins_at_zero = upper == f64::INFINITY;
    parameter.lower = parameter.lower.max(lower);
    parameter.upper = parameter.upper.min(upper);
    let is_within = parameter.value >= lower && parameter.value <= upper;
    if is_within && !(begins_at_zero && parameter.value == 0.0) {
        return Ok(());
    }
    let unit = &parameter.declared.unit;
    let message = format!(
        "`{}` = {} {} is where its prior is zero",
        parameter.declared.name,
        number(unit.from_si(parameter.value)),
        unit.symbol
    );
    Err(diagnostics.error(
        Diagnostic::new(Code::ValueOutOfBounds, value, message)
            .about(&parameter.declared.name)
            .label(prior, "the prior is declared here"),
    ))
}
