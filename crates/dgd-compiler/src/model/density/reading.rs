//! `noise`: the distribution of the readings of an output.
//!
//! | as written | readings y around the output w |
//! |---|---|
//! | `noise 0.01 [bar]` | normal, with this standard deviation |
//! | `noise σ`, a formula | normal; σ may read everything that outputs can read, parameters, and the output itself by name |
//! | `noise lognormal(σ)` | ln y is normal around ln w |
//! | `noise student(ν, σ)` | (y − w)/σ has Student's t distribution with ν degrees of freedom |
//!
//! A formula is evaluated by an extra output after those that the model declares, so that its derivatives are computed
//! like those of any output.

use dgd_signature::{Density, Distribution};

use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::{ExprId, Symbol};
use crate::model::check_units::unit_of;
use crate::model::expression::{NumberReading, OpenArguments, TypedExpr, not_finite};
use crate::model::resolver::ModelResolver;
use crate::model::{DeclarationHeader, Model, Output};
use crate::source::Span;
use crate::syntax::ast::{Attribute, AttributeKind, Expr, ExprKind};
use crate::syntax::visit::operands;
use crate::units::{Datum, Dimension, Unit};

/// The `noise` of an output.
pub(in crate::model) enum OutputNoise {
    /// Not declared.
    Silent,
    /// A standard deviation, SI.
    Known(f64),
    /// More than a number.
    Formula(DensityFormula),
}

/// A density whose σ is an expression.
pub(in crate::model) struct DensityFormula {
    distribution: Distribution,
    deviation: ExprId,
    unit: Unit,
}

/// An output with its noise, for messages and formulas.
pub(in crate::model) struct NoisyOutput<'a> {
    pub(in crate::model) name: &'a str,
    pub(in crate::model) value: TypedExpr,
    pub(in crate::model) unit: Unit,
}

/// `5 [%]`, for an output that is not a plain number itself.
fn part_of_value(expr: &Expr, unit: &Unit) -> Option<String> {
    let ExprKind::Number { text, unit: Some(own), .. } = &expr.kind else { return None };
    let is_part = own.read().is_ok_and(|own| own.dimension == Dimension::ONE);
    (is_part && unit.dimension != Dimension::ONE).then(|| format!("{text} [{}]", own.text))
}

impl<'a> ModelResolver<'a> {
    /// The noise of an output.
    pub(in crate::model) fn noise(
        &mut self,
        output: &NoisyOutput<'a>,
        attributes: &'a [Attribute],
        diagnostics: &mut Diagnostics,
    ) -> Result<OutputNoise, ErrorReported> {
        let written = attributes.iter().find_map(|attribute| match &attribute.kind {
            AttributeKind::Noise(expr) => Some(expr),
            _ => None,
        });
        let Some(expr) = written else { return Ok(OutputNoise::Silent) };
        if let ExprKind::Call { function, arguments } = &expr.kind
            && !self.lowering.scope.names.contains_key(function.text.as_str())
        {
            if let Some(dimensions) = &mut self.lowering.dimensions {
                dimensions.insert(expr.span, output.unit.dimension);
            }
            match (function.text.as_str(), arguments.as_slice()) {
                ("lognormal", [sigma]) => {
                    return self.lognormal(output, expr, sigma, diagnostics);
                }
                ("student", [freedom, sigma]) => {
                    return self.student(output, freedom, sigma, diagnostics);
                }
                (name @ ("lognormal" | "student"), _) => {
                    return Err(diagnostics.error(wrong_arguments(name, &output.unit, expr.span)));
                }
                _ => {}
            }
        }
        if let Some(part) = part_of_value(expr, &output.unit) {
            let NoisyOutput { name, unit, .. } = output;
            let message = format!("`{part}` is not a standard deviation in `{}`", unit.symbol);
            return Err(diagnostics.error(
                Diagnostic::new(Code::UnitsOfSides, expr.span, message)
                    .about(&part)
                    .help(format!("a part of the value is a product: `noise {part}*abs({name})`")),
            ));
        }
        let deviation = self.deviation(output, expr, &output.unit, diagnostics)?;
        // A σ that reads the output is a formula, whatever the output's value.
        let known = self.lowering.number(deviation).filter(|_| !reads(expr, output.name));
        Ok(match known {
            Some(known) => OutputNoise::Known(known),
            None => OutputNoise::Formula(DensityFormula {
                distribution: Distribution::Normal,
                deviation,
                unit: output.unit.of_differences(),
            }),
        })
    }

    fn lognormal(
        &mut self,
        output: &NoisyOutput<'a>,
        whole: &'a Expr,
        sigma: &'a Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<OutputNoise, ErrorReported> {
        if has_zero_of_its_own(&output.unit) {
            return Err(diagnostics.error(relative(output, whole.span)));
        }
        let unit = Unit::one();
        let deviation = self.deviation(output, sigma, &unit, diagnostics)?;
        Ok(OutputNoise::Formula(DensityFormula {
            distribution: Distribution::LogNormal,
            deviation,
            unit,
        }))
    }

    fn student(
        &mut self,
        output: &NoisyOutput<'a>,
        freedom: &'a Expr,
        sigma: &'a Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<OutputNoise, ErrorReported> {
        let what = "number of degrees of freedom";
        let freedom = self.lowering.positive(freedom, &Unit::one(), what, diagnostics);
        let deviation = self.deviation(output, sigma, &output.unit, diagnostics)?;
        Ok(OutputNoise::Formula(DensityFormula {
            distribution: Distribution::Student { freedom: freedom? },
            deviation,
            unit: output.unit.of_differences(),
        }))
    }

    /// σ, in a unit. A constant one must be positive.
    fn deviation(
        &mut self,
        output: &NoisyOutput<'a>,
        expr: &'a Expr,
        unit: &Unit,
        diagnostics: &mut Diagnostics,
    ) -> Result<ExprId, ErrorReported> {
        let locals = OpenArguments::from([(output.name, output.value)]);
        let typed = self.lowering.in_unit(expr, unit, NumberReading::Size, &locals, diagnostics)?;
        match self.lowering.number(typed.id) {
            Some(value) if !value.is_finite() => {
                return Err(diagnostics.error(not_finite(value, expr.span)));
            }
            Some(value) if value <= 0.0 => {
                let message = "the noise must be above zero";
                return Err(diagnostics.error(Diagnostic::new(
                    Code::SizeNotPositive,
                    expr.span,
                    message,
                )));
            }
            Some(value) => return Ok(self.lowering.graph.constant(value)),
            None => {}
        }
        if has_zero_of_its_own(&output.unit) {
            let moves = |symbol: &Symbol| {
                !matches!(
                    symbol,
                    Symbol::Constant(_) | Symbol::Parameter(_) | Symbol::Input(_) | Symbol::Time
                )
            };
            let reads_itself = reads(expr, output.name);
            if reads_itself || self.lowering.graph.symbols(typed.id).iter().any(moves) {
                return Err(diagnostics.error(relative(output, expr.span)));
            }
        }
        verify_differences(expr, diagnostics)?;
        Ok(typed.id)
    }
}

impl Model {
    /// Adds the outputs that evaluate the formulas, after all others.
    pub(in crate::model) fn add_deviations(&mut self, formulas: Vec<(usize, DensityFormula)>) {
        for (output, DensityFormula { distribution, deviation, unit }) in formulas {
            let DeclarationHeader { name, span, .. } = &self.outputs[output].declared;
            let declared = DeclarationHeader {
                name: format!("std({name})"),
                span: *span,
                unit,
                doc: vec![format!("Standard deviation of the readings of `{name}`.")],
            };
            self.densities.push(Density { output, deviation: self.outputs.len(), distribution });
            self.outputs.push(Output { declared, value: deviation, noise: None });
        }
    }
}

/// Refuses 0.5 °C in a formula, which would be 273.65 K.
fn verify_differences(expr: &Expr, diagnostics: &mut Diagnostics) -> Result<(), ErrorReported> {
    if let ExprKind::Number { unit: Some(written), text, .. } = &expr.kind {
        let unit = unit_of(Some(written), diagnostics)?;
        if unit.offset != 0.0 {
            let differences = unit.of_differences().symbol;
            let message = format!(
                "`{}` has a zero of its own, and a standard deviation is a difference",
                unit.symbol
            );
            return Err(diagnostics.error(
                Diagnostic::new(Code::NoiseRelativeToOffset, expr.span, message)
                    .help(format!("write `{text} [{differences}]`")),
            ));
        }
    }
    for operand in operands(expr) {
        verify_differences(operand, diagnostics)?;
    }
    Ok(())
}

/// Whether a unit has an offset: °C, barg.
fn has_zero_of_its_own(unit: &Unit) -> bool {
    unit.offset != 0.0 || unit.datum == Some(Datum::Gauge)
}

/// Whether an expression reads a name.
fn reads(expr: &Expr, name: &str) -> bool {
    let here = matches!(&expr.kind, ExprKind::Name(read) if read == name);
    here || operands(expr).into_iter().any(|operand| reads(operand, name))
}

fn relative(output: &NoisyOutput<'_>, span: Span) -> Diagnostic {
    let symbol = &output.unit.symbol;
    let from_zero = match output.unit.datum {
        Some(_) => format!("{}a", output.unit.of_differences().symbol),
        None => "K".to_owned(),
    };
    let message = format!(
        "this noise is relative to `{}`, whose unit `{symbol}` has a zero of its own",
        output.name
    );
    Diagnostic::new(Code::NoiseRelativeToOffset, span, message).about(output.name).help(format!(
        "declare the output in a unit that begins at nothing: `{} [{from_zero}]`",
        output.name
    ))
}

fn wrong_arguments(name: &str, unit: &Unit, span: Span) -> Diagnostic {
    let (expected, example) = match name {
        "lognormal" => ("1 argument", "lognormal(0.1)".to_owned()),
        _ => ("2 arguments", format!("student(4, 0.1 [{}])", unit.of_differences().symbol)),
    };
    Diagnostic::new(Code::ArgumentCount, span, format!("`{name}` takes {expected}"))
        .about(name)
        .help(format!("write `noise {example}`"))
}
