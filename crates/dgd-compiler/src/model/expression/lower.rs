//! Lowers parsed expressions to the graph, with their dimensions.

use super::element::ElementRead;
use super::quotient::quotient_for_derivative;
use super::{ExprLowering, NumberReading, OpenArguments, TypedExpr, not_finite};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::intrinsics::IntrinsicId;
use crate::expr::{ExprId, Node};
use crate::model::check_units::{ExprDimension, UnitSpelling, unit_of};
use crate::model::scope::open_index;
use crate::source::Span;
use crate::syntax::ast::{Expr, ExprKind, FactorSide, Sign};
use crate::units::{Unit, which_is_meant};

/// Limit on the nesting of function calls, including brackets.
const DEEPEST: usize = 512;

impl<'a> ExprLowering<'a> {
    /// An expression that is a number.
    pub(in crate::model) fn value(
        &mut self,
        expr: &'a Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        self.lower(expr, &OpenArguments::new(), diagnostics)
    }

    pub(in crate::model) fn lower(
        &mut self,
        expr: &'a Expr,
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        self.depth += 1;
        self.written += 1;
        let result = if self.depth > DEEPEST {
            Err(diagnostics.error(
                Diagnostic::new(Code::ModelTooLarge, expr.span, "expressions nest too deep here")
                    .help("give inner parts a `let` of their own"),
            ))
        } else {
            self.lower_kind(expr, arguments, diagnostics)
        };
        self.depth -= 1;
        if let (Some(dimensions), Ok(typed)) = (&mut self.dimensions, result) {
            dimensions.insert(expr.span, typed.dim.dimension());
        }
        result
    }

    fn lower_kind(
        &mut self,
        expr: &'a Expr,
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let span = expr.span;
        match &expr.kind {
            ExprKind::Number { value, unit, .. } => {
                self.literal(*value, unit.as_ref(), diagnostics)
            }
            ExprKind::Name(name) => self.name(name, span, arguments, diagnostics),
            ExprKind::Call { function, arguments: list } => {
                self.call(function, list, span, arguments, diagnostics)
            }
            ExprKind::Element(array, index) => {
                match self.read_element(array, index, false, arguments, diagnostics)? {
                    ElementRead::Value(element) => Ok(element),
                    ElementRead::Let(array, indices) => {
                        self.open_let(&array, indices, index.span, diagnostics)
                    }
                }
            }
            ExprKind::Reduce(reduction) => self.reduction(reduction, span, arguments, diagnostics),
            ExprKind::List(_) => Err(diagnostics.error(
                Diagnostic::new(
                    Code::ValueCount,
                    span,
                    "a list of values stands only for an array",
                )
                .help("write one value here"),
            )),
            ExprKind::Group(inner) => self.lower(inner, arguments, diagnostics),
            ExprKind::Negate(inner) => {
                // −5 °C is the temperature −5 °C, not minus 278.15 K.
                if let ExprKind::Number { value, unit, .. } = &inner.kind {
                    return self.literal(-value, unit.as_ref(), diagnostics);
                }
                let inner = self.lower(inner, arguments, diagnostics)?;
                Ok(TypedExpr { id: self.graph.intern(Node::Negate(inner.id)), dim: inner.dim })
            }
            ExprKind::Sum(terms) => self.sum(terms, arguments, diagnostics),
            ExprKind::Product(factors) => self.product(factors, arguments, diagnostics),
            ExprKind::Power(base, exponent) => {
                let base_typed = self.lower(base, arguments, diagnostics);
                let exponent_typed = self.lower(exponent, arguments, diagnostics);
                let (b, e) = (base_typed?, exponent_typed?);
                let value = self.number(e.id);
                let dim = self
                    .scope
                    .spelling
                    .power(b.locate(base.span), e.locate(exponent.span), value, span)
                    .map_err(|diagnostic| diagnostics.error(diagnostic))?;
                let id = self.graph.intern(Node::Call2(IntrinsicId::named("^"), b.id, e.id));
                Ok(TypedExpr { id, dim })
            }
            ExprKind::If(condition, then, otherwise) => {
                let condition = self.condition(condition, arguments, diagnostics);
                let a = self.lower(then, arguments, diagnostics);
                let b = self.lower(otherwise, arguments, diagnostics);
                let (condition, a, b) = (condition?, a?, b?);
                let dim = self
                    .scope
                    .spelling
                    .same("choose between", a.locate(then.span), b.locate(otherwise.span))
                    .map_err(|diagnostic| diagnostics.error(diagnostic))?;
                Ok(TypedExpr { id: self.graph.intern(Node::Select(condition, a.id, b.id)), dim })
            }
            ExprKind::Compare(..) | ExprKind::And(_) | ExprKind::Or(_) | ExprKind::Not(_) => {
                Err(diagnostics.error(
                    Diagnostic::new(
                        Code::ConditionAsNumber,
                        span,
                        "a number is needed here, not a condition",
                    )
                    .help("write `if condition then 1 else 0` to make a number of it"),
                ))
            }
        }
    }

    fn sum(
        &mut self,
        terms: &'a [(Sign, Expr)],
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let mut sum: Option<Result<(TypedExpr, Span), ErrorReported>> = None;
        for (sign, term) in terms {
            let typed = self.lower(term, arguments, diagnostics);
            sum = Some(match (sum, typed) {
                (None, typed) => typed.map(|typed| (typed, term.span)),
                (Some(Err(reported)), _) | (Some(Ok(_)), Err(reported)) => Err(reported),
                (Some(Ok((total, total_span))), Ok(typed)) => {
                    let doing = if *sign == Sign::Plus { "add" } else { "subtract" };
                    self.scope
                        .spelling
                        .same(doing, total.locate(total_span), typed.locate(term.span))
                        .map_err(|diagnostic| diagnostics.error(diagnostic))
                        .map(|dim| {
                            let node = match sign {
                                Sign::Plus => Node::Add(total.id, typed.id),
                                Sign::Minus => Node::Subtract(total.id, typed.id),
                            };
                            let id = self.graph.intern(node);
                            (TypedExpr { id, dim }, total_span.join(term.span))
                        })
                }
            });
        }
        let sum = sum.unwrap_or_else(|| unreachable!("a sum has terms"));
        sum.map(|(typed, _)| typed)
    }

    fn product(
        &mut self,
        factors: &'a [(FactorSide, Expr)],
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let is_known = |name: &str| {
            arguments.contains_key(name)
                || self.scope.names.contains_key(name)
                || open_index(&self.indices, name).is_some()
        };
        if let Some(mistake) = quotient_for_derivative(factors, &self.scope, &is_known) {
            return Err(diagnostics.error(mistake));
        }
        let mut product: Option<Result<TypedExpr, ErrorReported>> = None;
        for (factor, expr) in factors {
            let typed = self.lower(expr, arguments, diagnostics);
            product = Some(match (product, typed) {
                (None, typed) => typed,
                (Some(Err(reported)), _) | (Some(Ok(_)), Err(reported)) => Err(reported),
                (Some(Ok(total)), Ok(typed)) => {
                    let over = *factor == FactorSide::Over;
                    UnitSpelling::product(total.dim, typed.dim, over, expr.span)
                        .map_err(|diagnostic| diagnostics.error(diagnostic))
                        .map(|dim| {
                            let node = match factor {
                                FactorSide::Times => Node::Multiply(total.id, typed.id),
                                FactorSide::Over => Node::Divide(total.id, typed.id),
                            };
                            TypedExpr { id: self.graph.intern(node), dim }
                        })
                }
            });
        }
        product.unwrap_or_else(|| unreachable!("a product has factors"))
    }

    /// A condition outside of functions.
    pub(in crate::model) fn truth(
        &mut self,
        expr: &'a Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<ExprId, ErrorReported> {
        self.condition(expr, &OpenArguments::new(), diagnostics)
    }

    fn condition(
        &mut self,
        expr: &'a Expr,
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<ExprId, ErrorReported> {
        let mut chain = |this: &mut Self, parts: &'a [Expr], join: fn(ExprId, ExprId) -> Node| {
            let mut joined: Option<Result<ExprId, ErrorReported>> = None;
            for part in parts {
                let part = this.condition(part, arguments, diagnostics);
                joined = Some(match (joined, part) {
                    (None, part) => part,
                    (Some(Ok(a)), Ok(b)) => Ok(this.graph.intern(join(a, b))),
                    (Some(Err(reported)), _) | (_, Err(reported)) => Err(reported),
                });
            }
            joined.unwrap_or_else(|| unreachable!("a chain has parts"))
        };
        match &expr.kind {
            ExprKind::And(parts) => chain(self, parts, Node::And),
            ExprKind::Or(parts) => chain(self, parts, Node::Or),
            ExprKind::Not(inner) => {
                let inner = self.condition(inner, arguments, diagnostics)?;
                Ok(self.graph.intern(Node::Not(inner)))
            }
            ExprKind::Group(inner) => self.condition(inner, arguments, diagnostics),
            ExprKind::Compare(comparison, left, right) => {
                let a = self.lower(left, arguments, diagnostics);
                let b = self.lower(right, arguments, diagnostics);
                let (a, b) = (a?, b?);
                self.scope
                    .spelling
                    .same("compare", a.locate(left.span), b.locate(right.span))
                    .map_err(|diagnostic| diagnostics.error(diagnostic))?;
                Ok(self.graph.intern(Node::Compare(*comparison, a.id, b.id)))
            }
            ExprKind::Number { .. }
            | ExprKind::Name(_)
            | ExprKind::Call { .. }
            | ExprKind::Element(..)
            | ExprKind::Reduce(_)
            | ExprKind::List(_)
            | ExprKind::Negate(_)
            | ExprKind::Sum(_)
            | ExprKind::Product(_)
            | ExprKind::Power(..)
            | ExprKind::If(..) => Err(diagnostics.error(
                Diagnostic::new(
                    Code::ConditionAsNumber,
                    expr.span,
                    "a condition is needed here, not a number",
                )
                .help("compare it with something, such as `> 0`"),
            )),
        }
    }

    /// A number that must be constant.
    pub(in crate::model) fn known(
        &mut self,
        expr: &'a Expr,
        unit: &Unit,
        reading: NumberReading,
        diagnostics: &mut Diagnostics,
    ) -> Result<f64, ErrorReported> {
        let typed = self.in_unit(expr, unit, reading, &OpenArguments::new(), diagnostics)?;
        match self.number(typed.id) {
            Some(value) if value.is_finite() => Ok(value),
            Some(value) => Err(diagnostics.error(not_finite(value, expr.span))),
            None => {
                let culprit = self.first_unknown(typed.id, |_| true);
                Err(diagnostics.error(
                    Diagnostic::new(
                        Code::ValueNotConstant,
                        expr.span,
                        format!("this must be known before a run, but it depends on {culprit}"),
                    )
                    .help("use numbers and constants here"),
                ))
            }
        }
    }

    /// A size that must be constant and positive.
    pub(in crate::model) fn positive(
        &mut self,
        expr: &'a Expr,
        unit: &Unit,
        what: &str,
        diagnostics: &mut Diagnostics,
    ) -> Result<f64, ErrorReported> {
        let value = self.known(expr, unit, NumberReading::Size, diagnostics)?;
        if value > 0.0 {
            return Ok(value);
        }
        let message = format!("the {what} must be above zero");
        Err(diagnostics.error(Diagnostic::new(Code::SizeNotPositive, expr.span, message)))
    }

    /// A declared value: plain numbers are in the declared unit, anything else must have its dimension. Inside a
    /// function its arguments are available.
    pub(in crate::model) fn in_unit(
        &mut self,
        expr: &'a Expr,
        unit: &Unit,
        reading: NumberReading,
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let typed = self.lower(expr, arguments, diagnostics)?;
        let number = self.number(typed.id);
        let is_plain = is_plain(expr, &|name| self.scope.names.contains_key(name));
        if let (true, Some(number)) = (is_plain, number) {
            let si = match reading {
                NumberReading::Value => unit.to_si(number),
                NumberReading::Size => number * unit.factor,
            };
            let id = self.graph.constant(si);
            return Ok(TypedExpr { id, dim: ExprDimension::Of(unit.dimension) });
        }
        if typed.dim.unify(ExprDimension::Of(unit.dimension)).is_none() {
            let dimension = typed.dim.dimension();
            return Err(diagnostics.error(
                Diagnostic::new(
                    Code::UnitsOfSides,
                    expr.span,
                    format!(
                        "declared in `{}`, but the value is {}",
                        unit.symbol,
                        self.scope.spelling.being(dimension)
                    ),
                )
                .here(self.scope.spelling.this_is(dimension))
                .maybe_help(which_is_meant(dimension, unit.dimension)),
            ));
        }
        // A size with a unit of its own: 0.5 °C is half a kelvin.
        if let (
            NumberReading::Size,
            crate::syntax::ast::ExprKind::Number { value, unit: Some(own), .. },
        ) = (reading, &expr.kind)
        {
            let unit_of_value = unit_of(Some(own), diagnostics)?;
            let id = self.graph.constant(value * unit_of_value.factor);
            return Ok(TypedExpr { id, dim: typed.dim });
        }
        Ok(typed)
    }
}

/// Whether a declared value consists of plain numbers, and so is in the declared unit. Functions declared by the model,
/// `is_own`, may read anything.
fn is_plain(expr: &Expr, is_own: &dyn Fn(&str) -> bool) -> bool {
    let is_plain = |expr: &Expr| is_plain(expr, is_own);
    match &expr.kind {
        ExprKind::Number { unit, .. } => unit.is_none(),
        ExprKind::Name(name) => name == "pi",
        ExprKind::Call { function, arguments } => {
            let is_known = IntrinsicId::find(&function.text).is_some() && !is_own(&function.text);
            is_known && arguments.iter().all(is_plain)
        }
        ExprKind::Group(inner) | ExprKind::Negate(inner) | ExprKind::Not(inner) => is_plain(inner),
        ExprKind::Sum(terms) => terms.iter().all(|(_, term)| is_plain(term)),
        ExprKind::Product(factors) => factors.iter().all(|(_, factor)| is_plain(factor)),
        ExprKind::Power(base, exponent) => is_plain(base) && is_plain(exponent),
        ExprKind::If(condition, holds, fails) => {
            [condition, holds, fails].into_iter().all(|part| is_plain(part.as_ref()))
        }
        ExprKind::Compare(_, left, right) => is_plain(left) && is_plain(right),
        ExprKind::And(parts) | ExprKind::Or(parts) => parts.iter().all(is_plain),
        ExprKind::List(values) => values.iter().all(is_plain),
        ExprKind::Element(..) | ExprKind::Reduce(_) => false,
    }
}
