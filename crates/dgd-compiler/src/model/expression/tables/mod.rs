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
mod shown;
mod smooth;

use super::resolved_table::{ResolvedTable, TableTerm};
use super::{ExprLowering, TypedExpr};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::curve::TableCurve;
use crate::expr::{ExprId, Node, Symbol};
use crate::model::check_units::ExprDimension;
use crate::model::scope::TableDeclaration;
use crate::source::Span;
use crate::units::Unit;
use curves::CurveMaker;

pub(super) use points::{Ordinate, SiPoint, written};
pub(super) use smooth::verify_one_argument;

impl<'a> ExprLowering<'a> {
    /// The value of a table, the one at `index`, at its arguments, whose places are `spans`.
    pub(super) fn look_up(
        &mut self,
        index: usize,
        table: &ResolvedTable,
        arguments: &[TypedExpr],
        spans: &[Span],
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let ResolvedTable { terms, dimension, .. } = table;
        let curves = terms.first().into_iter().flat_map(|term| [Some(term.first), term.second]);
        for ((curve, x), span) in curves.flatten().zip(arguments).zip(spans) {
            self.verify_argument(curve.get(), self.scope.tables[index], x.id, *span, diagnostics)?;
        }
        let mut sum = None;
        for &TableTerm { first, second, ordinate } in terms {
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
        Ok(TypedExpr { id, dim: ExprDimension::Of(*dimension) })
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

    /// The terms of a table with these points.
    pub(super) fn terms_of_table(
        &self,
        table: TableDeclaration<'a>,
        units: &[Unit],
        points: &[SiPoint],
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<TableTerm>, ErrorReported> {
        let maker = CurveMaker::new(table, units);
        if units.len() == 1 {
            self.curve(table, &maker, points, diagnostics)
        } else {
            self.grid(table, &maker, points, diagnostics)
        }
    }
}
