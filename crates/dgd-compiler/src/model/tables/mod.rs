//! Tables: from points to curves, and calls of them.
//!
//! With the shapes used here, a curve is linear in its ordinates, so fitted ordinates need no curves of their own, and
//! a grid no curve of two arguments:
//!
//! ```text
//!   f(x)    = C(x) + Σ fⱼ Bⱼ(x)
//!   f(x, y) = Σ Cⱼ(x) Bⱼ(y)
//! ```
//!
//! C passes through the ordinates that are constant and through zero at the others, Cⱼ through those of one row of the
//! grid; Bⱼ is one at point j and zero at all others.

mod curves;
mod points;
mod smooth;

use super::Smoothness;
use super::check_units::ExprDimension;
use super::define::TableDeclaration;
use super::expression::{ExprLowering, TypedExpr, unit_of};
use super::resolve::ModelResolver;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::curve::{CurveId, TableCurve};
use crate::expr::{ExprId, Node, Symbol};
use crate::source::Span;
use crate::units::{Dimension, Unit};
use curves::CurveMaker;
use points::SiPoint;

/// A table whose points have been read: its value is the sum of these terms.
#[derive(Debug, Clone)]
pub(super) struct ResolvedTable {
    terms: Vec<TableTerm>,
    dimension: Dimension,
    smoothness: Vec<Smoothness>,
}

/// A product of curves of the first and of the second argument and of an ordinate.
#[derive(Debug, Clone, Copy)]
struct TableTerm {
    first: CurveId,
    second: Option<CurveId>,
    ordinate: Option<ExprId>,
}

impl<'a> ExprLowering<'a> {
    /// The value of a table at its arguments, whose places are `spans`.
    pub(super) fn look_up(
        &mut self,
        index: usize,
        arguments: &[TypedExpr],
        spans: &[Span],
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let ResolvedTable { terms, dimension, .. } = self.table(index, diagnostics)?;
        let curves = terms.first().into_iter().flat_map(|term| [Some(term.first), term.second]);
        for ((curve, x), span) in curves.flatten().zip(arguments).zip(spans) {
            self.verify_argument(curve.get(), self.scope.tables[index], x.id, *span, diagnostics)?;
        }
        let mut sum = None;
        for TableTerm { first, second, ordinate } in terms {
            let mut term = self.graph.intern(Node::Curve(first, arguments[0].id));
            if let Some(second) = second {
                let other = self.graph.intern(Node::Curve(second, arguments[1].id));
                term = self.graph.intern(Node::Multiply(term, other));
            }
            if let Some(ordinate) = ordinate {
                term = self.graph.intern(Node::Multiply(ordinate, term));
            }
            sum = Some(match sum {
                None => term,
                Some(sum) => self.graph.intern(Node::Add(sum, term)),
            });
        }
        let id = sum.unwrap_or_else(|| unreachable!("a table has a curve"));
        Ok(TypedExpr { id, dim: ExprDimension::Of(dimension) })
    }

    /// Checks an argument of a table outside of which runs are refused: a number must be inside, and an argument that
    /// moves with the index of a loop cannot be monitored.
    fn verify_argument(
        &self,
        curve: &TableCurve,
        table: TableDeclaration<'a>,
        x: ExprId,
        span: Span,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        let Some(limit) = &curve.limit else { return Ok(()) };
        let [low, high] = curve.ends;
        let is_beyond = self.number(x).is_some_and(|x| x < low || x > high);
        let sweeps = |symbol: &Symbol| {
            matches!(
                symbol,
                Symbol::Swept(_)
                    | Symbol::SweptParameter(..)
                    | Symbol::SweptInput(..)
                    | Symbol::Counter
            )
        };
        let message = if is_beyond {
            limit.clone()
        } else if self.graph.symbols(x).iter().any(sweeps) {
            format!("nothing watches whether an element leaves the table `{}`", table.name.text)
        } else {
            return Ok(());
        };
        let help =
            "say what the table is there: `beyond hold` or `beyond extend` behind its points";
        Err(diagnostics.error(
            Diagnostic::new(Code::ArgumentBeyondTable, span, message)
                .about(&table.name.text)
                .label(table.name.span, "declared here")
                .help(help),
        ))
    }

    /// The curves of a table, which are made once.
    fn table(
        &mut self,
        index: usize,
        diagnostics: &mut Diagnostics,
    ) -> Result<ResolvedTable, ErrorReported> {
        if let Some(done) = self.tables.get(&index) {
            return done.clone();
        }
        let table = self.scope.tables[index];
        let done = self.resolve_table(table, diagnostics);
        self.tables.insert(index, done.clone());
        done
    }

    fn resolve_table(
        &mut self,
        table: TableDeclaration<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<ResolvedTable, ErrorReported> {
        let units = table.arguments.iter().map(|argument| argument.unit.as_ref());
        let units: Vec<Result<Unit, ErrorReported>> =
            units.chain([table.unit]).map(|unit| unit_of(unit, diagnostics)).collect();
        let mut units: Vec<Unit> = units.into_iter().collect::<Result<_, _>>()?;
        let of_values = units.pop().unwrap_or_else(Unit::one);
        let points = self.points(table, &units, &of_values, diagnostics)?;
        let maker = CurveMaker::new(table, &units);
        let terms = if units.len() == 1 {
            self.curve(table, &maker, &points, diagnostics)?
        } else {
            self.grid(table, &maker, &points, diagnostics)?
        };
        let smoothness = self.smoothness(table, &points, &of_values, diagnostics)?;
        Ok(ResolvedTable { terms, dimension: of_values.dimension, smoothness })
    }
}

impl ModelResolver<'_> {
    /// Collects the smoothness of tables. Tables that nothing calls are also read, to find their errors.
    pub(super) fn smoothness_of_tables(&mut self, diagnostics: &mut Diagnostics) {
        for index in 0..self.lowering.scope.tables.len() {
            // Errors have been reported.
            let table = self.lowering.table(index, diagnostics);
            self.model.smoothness.extend(table.into_iter().flat_map(|table| table.smoothness));
        }
    }
}

/// Known ordinates; zero for the others.
fn known(lowering: &ExprLowering<'_>, point: &SiPoint) -> f64 {
    lowering.number(point.value).unwrap_or(0.0)
}
