//! `smooth`: the expected deviation of a table's points from the lines between their neighbours.
//!
//! ```text
//!   dᵢ = yᵢ − (yᵢ₋₁ (xᵢ₊₁ − xᵢ) + yᵢ₊₁ (xᵢ − xᵢ₋₁))/(xᵢ₊₁ − xᵢ₋₁)     normal, of mean 0, at each inner point
//! ```
//!
//! If the values y are sums of parameters, this is a prior of Σ w p; constant values enter its mean.
//!
//! Source: Rue, Held, Gaussian Markov Random Fields (2005) §3.4, random walks of second order.

use std::collections::BTreeMap;

use super::super::ExprLowering;
use super::points::SiPoint;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::{ExprId, Node, Symbol};
use crate::model::Smoothness;
use crate::model::scope::TableDeclaration;
use crate::source::Span;

/// Σ weight · parameter + rest.
#[derive(Debug, Clone, Default)]
struct AffineSum {
    weights: BTreeMap<u32, f64>,
    rest: f64,
}

impl AffineSum {
    fn number(rest: f64) -> Self {
        Self { rest, ..Self::default() }
    }

    fn parameter(position: u32) -> Self {
        Self { weights: [(position, 1.0)].into(), rest: 0.0 }
    }

    fn plus(mut self, factor: f64, other: &Self) -> Self {
        for (parameter, weight) in &other.weights {
            *self.weights.entry(*parameter).or_default() += factor * weight;
        }
        self.rest += factor * other.rest;
        self
    }

    fn times(&self, factor: f64) -> Self {
        Self::default().plus(factor, self)
    }

    fn is_finite(&self) -> bool {
        self.rest.is_finite() && self.weights.values().all(|weight| weight.is_finite())
    }
}

impl<'a> ExprLowering<'a> {
    /// The smoothness of a table's parameters with this standard deviation; `span` is the place of the clause.
    pub(in crate::model::expression) fn smoothness(
        &self,
        table: TableDeclaration<'a>,
        points: &[SiPoint],
        (std, span): (f64, Span),
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<Smoothness>, ErrorReported> {
        let name = &table.name.text;
        let is_known = |point: &SiPoint| self.number(point.value).is_some();
        let message = if points.iter().all(is_known) {
            format!("no value of `{name}` is a parameter, so that `smooth` says nothing")
        } else if points.len() < 3 {
            format!("`smooth` needs three points at least, and `{name}` has two")
        } else {
            let values = points.iter().map(|point| self.affine(point, diagnostics));
            let values: Vec<Result<AffineSum, ErrorReported>> = values.collect();
            let values: Vec<AffineSum> = values.into_iter().collect::<Result<_, _>>()?;
            let x: Vec<f64> = points.iter().map(|point| point.at[0]).collect();
            let inner = x.windows(3).zip(values.windows(3));
            // Not applied across a step.
            let inner = inner.filter(|(x, _)| x[0] < x[1] && x[1] < x[2]);
            let rows = inner.filter_map(|(x, y)| of_point(name, x, y, std));
            return Ok(rows.collect());
        };
        Err(diagnostics.error(
            Diagnostic::new(Code::SmoothWithoutFittedValues, span, message)
                .about(name)
                .help("leave `smooth` out"),
        ))
    }

    /// A value as a sum of parameters.
    fn affine(
        &self,
        point: &SiPoint,
        diagnostics: &mut Diagnostics,
    ) -> Result<AffineSum, ErrorReported> {
        let mut forms: BTreeMap<ExprId, AffineSum> = BTreeMap::new();
        for id in self.graph.reachable([point.value]) {
            let form = match self.graph.node(id) {
                _ if self.number(id).is_some() => self.number(id).map(AffineSum::number),
                Node::Symbol(Symbol::Parameter(i)) => Some(AffineSum::parameter(i)),
                Node::Negate(a) => Some(forms[&a].times(-1.0)),
                Node::Add(a, b) => Some(forms[&a].clone().plus(1.0, &forms[&b])),
                Node::Subtract(a, b) => Some(forms[&a].clone().plus(-1.0, &forms[&b])),
                Node::Multiply(a, b) => match (self.number(a), self.number(b)) {
                    (Some(factor), _) => Some(forms[&b].times(factor)),
                    (None, Some(factor)) => Some(forms[&a].times(factor)),
                    (None, None) => None,
                },
                Node::Divide(a, b) => self.number(b).map(|divisor| forms[&a].times(1.0 / divisor)),
                Node::Constant(_)
                | Node::Symbol(_)
                | Node::Call1(..)
                | Node::Call2(..)
                | Node::Curve(..)
                | Node::Compare(..)
                | Node::And(..)
                | Node::Or(..)
                | Node::Not(_)
                | Node::Select(..)
                | Node::Delay(..) => None,
            };
            let Some(form) = form.filter(AffineSum::is_finite) else {
                let message =
                    "values of a table with `smooth` are sums of parameters, and this one is not";
                return Err(diagnostics.error(
                    Diagnostic::new(Code::SmoothWithoutFittedValues, point.span, message)
                        .help("write a parameter, or a sum of some with constant factors"),
                ));
            };
            forms.insert(id, form);
        }
        Ok(forms.remove(&point.value).unwrap_or_default())
    }
}

/// Checks that a table with `smooth` has one argument.
pub(in crate::model::expression) fn verify_one_argument(
    table: TableDeclaration<'_>,
    span: Span,
    diagnostics: &mut Diagnostics,
) -> Result<(), ErrorReported> {
    let Some(second) = table.arguments.get(1) else { return Ok(()) };
    let message = "`smooth` is for tables of one argument";
    Err(diagnostics.error(
        Diagnostic::new(Code::SmoothWithoutFittedValues, span, message)
            .label(second.name.span, "this is another")
            .help("leave `smooth` out: values of a grid are not fitted"),
    ))
}

/// The smoothness at the second of three points; `None` if all of them are constant.
fn of_point(table: &str, x: &[f64], y: &[AffineSum], std: f64) -> Option<Smoothness> {
    let width = x[2] - x[0];
    let deviation = y[1].clone().plus(-(x[2] - x[1]) / width, &y[0]);
    let AffineSum { weights, rest } = deviation.plus(-(x[1] - x[0]) / width, &y[2]);
    let weights: Vec<(u32, f64)> =
        weights.into_iter().filter(|(_, weight)| *weight != 0.0).collect();
    let mean = -rest;
    (!weights.is_empty()).then(|| Smoothness { table: table.to_owned(), weights, mean, std })
}
