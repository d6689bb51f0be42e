//! The rules of units for sums, comparisons, products and calls, one function each.

mod misplaced;
mod written;

use std::collections::BTreeMap;

use crate::diagnostics::{Code, Diagnostic};
use crate::expr::intrinsics::UnitRule;
use crate::source::Span;
use crate::units::{Dimension, Exponent, Unit, describe, which_is_meant};

pub(super) use misplaced::unit_of_declaration;
pub(super) use written::unit_of;

/// The dimension of an expression.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum ExprDimension {
    /// A literal zero, which has every dimension.
    Zero,
    /// This one.
    Of(Dimension),
}

impl ExprDimension {
    pub(super) const ONE: ExprDimension = ExprDimension::Of(Dimension::ONE);

    /// As a dimension; a zero counts as a plain number.
    pub(super) fn dimension(self) -> Dimension {
        match self {
            ExprDimension::Zero => Dimension::ONE,
            ExprDimension::Of(dimension) => dimension,
        }
    }

    /// The common dimension of two, if they agree.
    pub(super) fn unify(self, other: ExprDimension) -> Option<ExprDimension> {
        match (self, other) {
            (ExprDimension::Zero, any) | (any, ExprDimension::Zero) => Some(any),
            (a, b) => (a == b).then_some(a),
        }
    }
}

/// The dimension of an expression, with the expression's place.
#[derive(Debug, Clone, Copy)]
pub(super) struct LocatedDimension {
    pub(super) dim: ExprDimension,
    pub(super) span: Span,
}

/// The model's spelling of its units: a torque declared in N*m is not reported in J.
#[derive(Debug, Clone, Default)]
pub(super) struct UnitSpelling(BTreeMap<Dimension, String>);

impl UnitSpelling {
    /// Records the unit of a declaration; the first of each dimension is used if it is coherent.
    pub(super) fn learn(&mut self, unit: &Unit) {
        if unit.factor == 1.0 && unit.offset == 0.0 && unit.datum.is_none() {
            self.0.entry(unit.dimension).or_insert_with(|| unit.symbol.clone());
        }
    }

    fn unit(&self, dimension: Dimension) -> String {
        self.0.get(&dimension).cloned().unwrap_or_else(|| describe(dimension))
    }

    /// A dimension in a sentence.
    fn named(&self, dimension: Dimension) -> String {
        if dimension == Dimension::ONE {
            "a plain number".to_owned()
        } else {
            format!("`{}`", self.unit(dimension))
        }
    }

    /// A completion of "this is …".
    pub(super) fn being(&self, dimension: Dimension) -> String {
        if dimension == Dimension::ONE {
            "a plain number".to_owned()
        } else {
            format!("in `{}`", self.unit(dimension))
        }
    }

    /// A note about the dimension at a place.
    pub(super) fn this_is(&self, dimension: Dimension) -> String {
        format!("this is {}", self.being(dimension))
    }

    /// Checks that two quantities have the same unit; `doing` completes "cannot …".
    pub(super) fn same(
        &self,
        doing: &str,
        one: LocatedDimension,
        other: LocatedDimension,
    ) -> Result<ExprDimension, Diagnostic> {
        one.dim.unify(other.dim).ok_or_else(|| {
            let (a, b) = (one.dim.dimension(), other.dim.dimension());
            let message = format!("cannot {doing} {} and {}", self.named(a), self.named(b));
            Diagnostic::new(Code::IncompatibleUnits, other.span, message)
                .here(self.this_is(b))
                .label(one.span, self.this_is(a))
                .maybe_help(which_is_meant(a, b))
        })
    }

    /// A product or quotient.
    pub(super) fn product(
        a: ExprDimension,
        b: ExprDimension,
        over: bool,
        span: Span,
    ) -> Result<ExprDimension, Diagnostic> {
        let (a, b) = match (a, b) {
            (ExprDimension::Zero, _) => return Ok(ExprDimension::Zero),
            (_, ExprDimension::Zero) if !over => return Ok(ExprDimension::Zero),
            (ExprDimension::Of(a), b) => (a, b.dimension()),
        };
        let result = if over { a.divide(b) } else { a.times(b) };
        result.map(ExprDimension::Of).ok_or_else(|| too_large(span))
    }

    /// A power, if its exponent is a constant number.
    pub(super) fn power(
        &self,
        base: LocatedDimension,
        exponent: LocatedDimension,
        value: Option<f64>,
        span: Span,
    ) -> Result<ExprDimension, Diagnostic> {
        let LocatedDimension { dim: base, span: base_span } = base;
        let LocatedDimension { dim: exponent, span: exponent_span } = exponent;
        if exponent.dimension() != Dimension::ONE {
            return Err(Diagnostic::new(
                Code::PowerWithUnit,
                exponent_span,
                "an exponent must be a plain number",
            )
            .here(self.this_is(exponent.dimension())));
        }
        if base == ExprDimension::Zero && value.is_some_and(|value| value > 0.0) {
            return Ok(ExprDimension::Zero);
        }
        let base = base.dimension();
        if base == Dimension::ONE {
            return Ok(ExprDimension::ONE);
        }
        let Some(value) = value else {
            return Err(Diagnostic::new(
                Code::PowerWithUnit,
                base_span,
                format!("{} to a power that is not a number has no unit", self.named(base)),
            )
            .here(self.this_is(base))
            .label(exponent_span, "this varies")
            .help("divide the base by a reference value, so that it becomes a plain number"));
        };
        let fraction = Exponent::from_f64(value).ok_or_else(|| {
            Diagnostic::new(
                Code::PowerWithUnit,
                exponent_span,
                format!("{} to the power {value} has no unit", self.named(base)),
            )
            .label(base_span, self.this_is(base))
            .help("divide the base by a reference value, so that it becomes a plain number")
        })?;
        base.power(fraction).map(ExprDimension::Of).ok_or_else(|| too_large(span))
    }

    /// A call of a built-in function.
    pub(super) fn call(
        &self,
        name: &str,
        rule: UnitRule,
        arguments: &[LocatedDimension],
        span: Span,
    ) -> Result<ExprDimension, Diagnostic> {
        match rule {
            UnitRule::Any => Ok(ExprDimension::ONE),
            UnitRule::Dimensionless => {
                for LocatedDimension { dim, span } in arguments {
                    if dim.dimension() != Dimension::ONE {
                        return Err(Diagnostic::new(
                            Code::ArgumentWithUnit,
                            *span,
                            format!(
                                "`{name}` needs a plain number, not {}",
                                self.named(dim.dimension())
                            ),
                        )
                        .about(name)
                        .here(self.this_is(dim.dimension())));
                    }
                }
                Ok(ExprDimension::ONE)
            }
            UnitRule::Root => {
                if arguments[0].dim == ExprDimension::Zero {
                    return Ok(ExprDimension::Zero);
                }
                let half = Exponent::new(1, 2).unwrap_or(Exponent::ZERO);
                let root = arguments[0].dim.dimension().power(half);
                root.map(ExprDimension::Of).ok_or_else(|| too_large(span))
            }
            UnitRule::Same | UnitRule::Ratio => {
                let mut common = arguments[0];
                for argument in &arguments[1..] {
                    common.dim = self.same("compare", common, *argument)?;
                }
                Ok(if rule == UnitRule::Same { common.dim } else { ExprDimension::ONE })
            }
            UnitRule::Power => unreachable!("`^` is no call"),
        }
    }
}

fn too_large(span: Span) -> Diagnostic {
    Diagnostic::new(Code::PowerWithUnit, span, "the exponents of this unit are too large")
}
