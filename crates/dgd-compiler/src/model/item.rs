//! Parameters, unknowns, outputs and equations: one item at a time.

use super::DeclarationHeader;
use super::check_units::{ExprDimension, unit_of};
use super::density::prior::within_support;
use super::density::reading::{NoisyOutput, OutputNoise};
use super::expression::{NumberReading, TypedExpr};
use super::resolver::ModelResolver;
use super::scope::NameDefinition;
use super::{Equation, Output, Parameter, Unknown};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::{ExprId, Symbol};
use crate::source::Span;
use crate::syntax::ast::{Attribute, AttributeKind, Expr, ExprKind, Item, Name, WrittenUnit};
use crate::units::{Unit, which_is_meant};

/// The declaration of an unknown, or of an array of unknowns.
pub(super) struct UnknownDeclaration<'a> {
    pub(super) name: &'a Name,
    pub(super) state: bool,
    /// The value set from outside, or else the declared one.
    pub(super) start: Option<&'a Expr>,
    pub(super) attributes: &'a [Attribute],
}

impl<'a> ModelResolver<'a> {
    pub(super) fn parameter(
        &mut self,
        declared: DeclarationHeader,
        expr: &'a Expr,
        attributes: &'a [Attribute],
        diagnostics: &mut Diagnostics,
    ) -> Result<Parameter, ErrorReported> {
        let unit = declared.unit.clone();
        let value = self.lowering.known(expr, &unit, NumberReading::Value, diagnostics);

        let mut parameter = Parameter {
            declared,
            value: 0.0,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            log: false,
            fixed: false,
            nominal: None,
            prior: None,
        };
        let (mut bounds_span, mut prior_span) = (None, None);
        for attribute in attributes {
            match &attribute.kind {
                AttributeKind::Bounds(lower, upper) => {
                    bounds_span = Some(attribute.span);
                    if let Some(lower) = lower {
                        parameter.lower =
                            self.lowering.known(lower, &unit, NumberReading::Value, diagnostics)?;
                    }
                    if let Some(upper) = upper {
                        parameter.upper =
                            self.lowering.known(upper, &unit, NumberReading::Value, diagnostics)?;
                    }
                }
                AttributeKind::Log => parameter.log = true,
                AttributeKind::Fixed => parameter.fixed = true,
                AttributeKind::Nominal(nominal) => {
                    parameter.nominal = Some(self.lowering.positive(
                        nominal,
                        &unit,
                        "nominal size",
                        diagnostics,
                    )?);
                }
                AttributeKind::Prior(law, first, second) => {
                    let prior = self.prior(*law, [first, second], &unit, diagnostics)?;
                    parameter.prior = Some(prior);
                    prior_span = Some(attribute.span);
                }
                AttributeKind::Guess
                | AttributeKind::Hold
                | AttributeKind::Linear
                | AttributeKind::Noise(_)
                | AttributeKind::History(_)
                | AttributeKind::Exact
                | AttributeKind::Shape(_)
                | AttributeKind::Beyond(_)
                | AttributeKind::Smooth(_) => {}
            }
        }
        parameter.value = value?;
        check_bounds(&parameter, expr.span, bounds_span, diagnostics)?;
        if let Some(span) = prior_span {
            within_support(&mut parameter, expr.span, span, diagnostics)?;
        }
        Ok(parameter)
    }

    pub(super) fn unknown(
        &mut self,
        item: &Item,
        declaration: &UnknownDeclaration<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<Unknown, ErrorReported> {
        let UnknownDeclaration { name, state, start, attributes } = *declaration;
        let declared = self.declared(item, name)?;
        let unit = declared.unit.clone();
        let start = match start {
            // Zero in the declared unit: 273.15 K for °C.
            None => self.lowering.graph.constant(unit.to_si(0.0)),
            Some(expr) => {
                let typed = self.in_unit(expr, &unit, NumberReading::Value, diagnostics)?;
                self.check_start(typed.id, name, expr, diagnostics)?;
                typed.id
            }
        };
        let mut nominal = None;
        let (mut fixed, mut guess) = (false, false);
        let (mut history, mut noise) = (None, None);
        for attribute in attributes {
            match &attribute.kind {
                AttributeKind::Nominal(expr) => {
                    nominal =
                        Some(self.lowering.positive(expr, &unit, "nominal size", diagnostics)?);
                }
                AttributeKind::Fixed => fixed = true,
                AttributeKind::Guess => guess = true,
                AttributeKind::History(expr) => {
                    let typed = self.in_unit(expr, &unit, NumberReading::Value, diagnostics)?;
                    self.check_history(typed.id, expr, diagnostics)?;
                    history = Some(typed.id);
                }
                AttributeKind::Noise(expr) => {
                    noise = Some(self.process_noise(expr, &unit, diagnostics)?);
                }
                AttributeKind::Bounds(..)
                | AttributeKind::Log
                | AttributeKind::Prior(..)
                | AttributeKind::Hold
                | AttributeKind::Linear
                | AttributeKind::Exact
                | AttributeKind::Shape(_)
                | AttributeKind::Beyond(_)
                | AttributeKind::Smooth(_) => {}
            }
        }
        Ok(Unknown { declared, state, start, fixed, guess, nominal, history, noise })
    }

    /// Checks that a history reads only time and parameters.
    fn check_history(
        &self,
        history: ExprId,
        expr: &Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        let is_input = |s: &Symbol| matches!(s, Symbol::Input(_) | Symbol::SweptInput(..));
        let depends = |symbol: &Symbol| symbol.is_of_unknown() || is_input(symbol);
        let symbols = self.lowering.graph.symbols(history);
        let Some(symbol) = symbols.into_iter().find(depends) else { return Ok(()) };
        let culprit = self.lowering.scope.quoted_name(symbol);
        let culprit = culprit.unwrap_or_else(|| "an unknown".to_owned());
        let message =
            format!("this history depends on {culprit}, of which nothing earlier is known");
        Err(diagnostics.error(
            Diagnostic::new(Code::StartReadsUnknown, expr.span, message)
                .help("use `time`, parameters and constants"),
        ))
    }

    pub(super) fn output(
        &mut self,
        item: &Item,
        name: &'a Name,
        unit: Option<&'a WrittenUnit>,
        value: Option<&'a Expr>,
        attributes: &'a [Attribute],
        diagnostics: &mut Diagnostics,
    ) -> Result<Output, ErrorReported> {
        let own_unit = unit.map(|unit| unit_of(Some(unit), diagnostics)).transpose()?;
        if let Some(array) = value.and_then(|value| self.whole_array(value)) {
            let message = format!("`{array}` is an array, but `{}` is a single output", name.text);
            let span = value.map_or(name.span, |value| value.span);
            return Err(diagnostics
                .error(Diagnostic::new(Code::ArrayAsNumber, span, message).about(array).about(&name.text).help(format!(
                "write `output {array}` for an output of each element, or read one, `{array}[…]`"
            ))));
        }
        let (value, unit) = match value {
            Some(expr) => {
                let unit = own_unit.unwrap_or_else(Unit::one);
                (self.in_unit(expr, &unit, NumberReading::Value, diagnostics)?.id, unit)
            }
            None => self.unknown_read(name, own_unit, diagnostics)?,
        };
        let typed = TypedExpr { id: value, dim: ExprDimension::Of(unit.dimension) };
        let read = NoisyOutput { name: &name.text, value: typed, unit: unit.clone() };
        let noise = match self.noise(&read, attributes, diagnostics)? {
            OutputNoise::Silent => None,
            OutputNoise::Known(noise) => Some(noise),
            OutputNoise::Formula(formula) => {
                self.formulas.push((self.model.outputs.len(), formula));
                None
            }
        };
        let declared = DeclarationHeader {
            name: name.text.clone(),
            span: name.span,
            unit,
            doc: item.doc.clone(),
        };
        Ok(Output { declared, value, noise })
    }

    /// The array of unknowns that an expression refers to as a whole.
    fn whole_array(&self, value: &'a Expr) -> Option<&'a str> {
        let ExprKind::Name(name) = &value.kind else { return None };
        let entry = self.lowering.scope.names.get(name.as_str())?;
        matches!(entry.definition, NameDefinition::Array { .. }).then_some(name.as_str())
    }

    /// The value of an output without `=`: the unknown of its name.
    fn unknown_read(
        &mut self,
        name: &Name,
        own_unit: Option<Unit>,
        diagnostics: &mut Diagnostics,
    ) -> Result<(ExprId, Unit), ErrorReported> {
        let entry = self.lowering.scope.names.get(name.text.as_str()).cloned();
        let Some(entry) = entry else {
            return Err(diagnostics.error(
                Diagnostic::new(
                    Code::UnknownName,
                    name.span,
                    format!("output `{}` reads nothing: no unknown has its name", name.text),
                )
                .about(&name.text)
                .help(format!("say what it reads: `output {} = …`", name.text)),
            ));
        };
        let NameDefinition::Unknown { index, .. } = entry.definition else {
            let unit = own_unit.map(|unit| format!(" [{}]", unit.symbol)).unwrap_or_default();
            return Err(diagnostics.error(
                Diagnostic::new(
                    Code::MisusedName,
                    name.span,
                    format!(
                        "output `{}` reads nothing: `{}` is {}, not an unknown",
                        name.text,
                        name.text,
                        entry.definition.noun()
                    ),
                )
                .about(&name.text)
                .label(entry.span, "declared here")
                .help(format!("write `output {0}{unit} = {0}`", name.text)),
            ));
        };
        let declared = entry.unit.unwrap_or_else(|| Ok(Unit::one()))?;
        let unit = unit_read(name, own_unit, &declared, entry.span, diagnostics)?;
        Ok((self.lowering.graph.symbol(Symbol::Unknown(index)), unit))
    }

    pub(super) fn equation(
        &mut self,
        item: &Item,
        label: &Name,
        [left, right]: [&'a Expr; 2],
        attributes: &[Attribute],
        diagnostics: &mut Diagnostics,
    ) -> Result<Equation, ErrorReported> {
        let a = self.lowering.value(left, diagnostics);
        let b = self.lowering.value(right, diagnostics);
        let (a, b) = (a?, b?);
        let Some(dim) = a.dim.unify(b.dim) else {
            let (l, r) = (a.dim.dimension(), b.dim.dimension());
            return Err(diagnostics.error(
                Diagnostic::new(
                    Code::UnitsOfSides,
                    left.span,
                    format!(
                        "the sides of equation `{}` are {} and {}",
                        label.text,
                        self.lowering.scope.spelling.being(l),
                        self.lowering.scope.spelling.being(r)
                    ),
                )
                .about(&label.text)
                .here(self.lowering.scope.spelling.this_is(l))
                .label(right.span, self.lowering.scope.spelling.this_is(r))
                .maybe_help(which_is_meant(l, r)),
            ));
        };
        Ok(Equation {
            label: label.text.clone(),
            span: item.span,
            doc: item.doc.clone(),
            left: a.id,
            right: b.id,
            dimension: dim.dimension(),
            is_exact: attributes.iter().any(|a| a.kind == AttributeKind::Exact),
        })
    }
}

/// The unit of an output that reads an unknown: its own, or the unknown's.
pub(super) fn unit_read(
    name: &Name,
    own: Option<Unit>,
    declared: &Unit,
    declared_at: Span,
    diagnostics: &mut Diagnostics,
) -> Result<Unit, ErrorReported> {
    let unit = own.unwrap_or_else(|| declared.clone());
    if unit.dimension == declared.dimension {
        return Ok(unit);
    }
    let message = format!(
        "output `{}` is declared in `{}`, but the unknown is in `{}`",
        name.text, unit.symbol, declared.symbol
    );
    Err(diagnostics.error(
        Diagnostic::new(Code::UnitsOfSides, name.span, message)
            .about(&name.text)
            .label(declared_at, "the unknown is declared here")
            .maybe_help(which_is_meant(unit.dimension, declared.dimension)),
    ))
}

fn check_bounds(
    parameter: &Parameter,
    value_span: Span,
    bounds_span: Option<Span>,
    diagnostics: &mut Diagnostics,
) -> Result<(), ErrorReported> {
    let Parameter { declared, value, lower, upper, .. } = parameter;
    let shown = |si: f64| crate::expr::display::number(declared.unit.from_si(si));
    let mut sound = Ok(());
    if let Some(span) = bounds_span {
        let empty = match (lower, upper) {
            (l, u) if l > u => {
                let unit = &declared.unit.symbol;
                Some(format!("from {} {unit} to {} {unit}", shown(*l), shown(*u)))
            }
            _ => None,
        };
        if let Some(range) = empty {
            sound = Err(diagnostics.error(
                Diagnostic::new(
                    Code::ReversedBounds,
                    span,
                    format!("the bounds of `{}` leave nothing: {range}", declared.name),
                )
                .about(&declared.name)
                .help("write the smaller bound first"),
            ));
        } else if value < lower || value > upper {
            let (bound, side) = if value < lower { (lower, "below") } else { (upper, "above") };
            sound = Err(diagnostics.error(
                Diagnostic::new(
                    Code::ValueOutOfBounds,
                    value_span,
                    format!(
                        "`{}` = {} {u} is {side} its bound of {} {u}",
                        declared.name,
                        shown(*value),
                        shown(*bound),
                        u = declared.unit.symbol,
                    ),
                )
                .about(&declared.name)
                .label(span, "bounds declared here"),
            ));
        }
    }
    if parameter.log && *value <= 0.0 {
        sound = Err(diagnostics.error(
            Diagnostic::new(
                Code::LogOfNonPositive,
                value_span,
                format!(
                    "`{}` is estimated by its logarithm, so it must be above zero",
                    declared.name
                ),
            )
            .about(&declared.name)
            .help("leave out `log`, or give a positive value"),
        ));
    }
    sound
}
