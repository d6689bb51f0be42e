//! `delay(x, tau)`: the value of `x` a time `tau` ago.

use super::{ExprLowering, TypedExpr};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::{ExprId, Node, Symbol};
use crate::model::check_units::ExprDimension;
use crate::source::Span;

impl ExprLowering<'_> {
    /// The delay of an expression by a constant or parametric time; `span` is the place of the time.
    pub(super) fn delayed(
        &mut self,
        x: TypedExpr,
        tau: TypedExpr,
        span: Span,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        if tau.dim.unify(ExprDimension::Of(self.scope.second)).is_none() {
            let dimension = tau.dim.dimension();
            let message =
                format!("a delay is a time, but this is {}", self.scope.spelling.being(dimension));
            return Err(diagnostics.error(
                Diagnostic::new(Code::UnitsOfSides, span, message)
                    .here(self.scope.spelling.this_is(dimension))
                    .help("give it in a unit of time: `delay(x, 3 [s])`"),
            ));
        }
        // Quantities that differ from row to row are delayed in equations of their own.
        let of_rows = |s: &Symbol| {
            matches!(
                s,
                Symbol::SweptParameter(..)
                    | Symbol::SweptInput(..)
                    | Symbol::Swept(_)
                    | Symbol::SweptRate(_)
            )
        };
        let is_of_rows = |id: ExprId| self.graph.symbols(id).iter().any(of_rows);
        let counts = self.graph.symbols(tau.id).contains(&Symbol::Counter);
        self.strided |= is_of_rows(x.id) || is_of_rows(tau.id) || counts;
        if let Some((what, help)) = self.cannot_be_followed(x.id, tau.id) {
            return Err(
                diagnostics.error(Diagnostic::new(Code::InvalidDelay, span, what).help(help))
            );
        }
        Ok(TypedExpr { id: self.graph.intern(Node::Delay(x.id, tau.id)), dim: x.dim })
    }

    /// The reason why a varying or nested delay is not supported, and a remedy.
    fn cannot_be_followed(&self, x: ExprId, tau: ExprId) -> Option<(String, &'static str)> {
        // An argument of a function that is checked separately has no name in the model.
        let moves = |s: &Symbol| {
            let may = matches!(s, Symbol::Time | Symbol::Input(_) | Symbol::Unknown(_));
            may && self.scope.quoted_name(*s).is_some()
        };
        let varies = |id: ExprId| self.graph.symbols(id).iter().any(moves);
        let delays = |id: ExprId| {
            let nodes = self.graph.listed([id]).into_iter();
            nodes.filter_map(|(_, node)| match node {
                Node::Delay(_, tau) => Some(tau),
                _ => None,
            })
        };
        if delays(x).any(varies) {
            let what = "this delays what is late by a time that varies".to_owned();
            return Some((what, "declare an `unknown` that equals what is late, and delay that"));
        }
        let reads = |symbol: &Symbol| matches!(symbol, Symbol::Derivative(_));
        let symbols = self.graph.symbols(tau);
        if let Some(culprit) = symbols.into_iter().find(reads) {
            let culprit = self.scope.quoted_name(culprit)?;
            let what = format!("this delay depends on the derivative of {culprit}");
            return Some((what, "use states, inputs, time, parameters and constants"));
        }
        let of_array = |symbol: &Symbol| {
            matches!(
                symbol,
                Symbol::Element(_)
                    | Symbol::Swept(_)
                    | Symbol::ElementRate(_)
                    | Symbol::SweptRate(_)
            )
        };
        if self.graph.symbols(tau).iter().any(of_array) {
            let what = "this delay depends on an element of an array".to_owned();
            return Some((what, "use single states, inputs, time, parameters and constants"));
        }
        if !varies(tau) {
            return None;
        }
        if delays(tau).next().is_some() {
            let what = "this delay depends on something that is late itself".to_owned();
            return Some((what, "use states, inputs, time, parameters and constants"));
        }
        if delays(x).next().is_some() {
            let what = "this delay varies, and what it delays is late already".to_owned();
            return Some((what, "declare an `unknown` that equals what is late, and delay that"));
        }
        let input = self.graph.symbols(x).into_iter().find(|s| matches!(s, Symbol::Input(_)))?;
        let input = self.scope.quoted_name(input)?;
        let what = format!("this delay varies during a run, but {input} is an input");
        Some((
            what,
            "delay an input by constants and parameters, or declare an `unknown` that equals it",
        ))
    }
}

/// The error for another number of arguments than two.
pub(super) fn wrong_count(n: usize, span: Span) -> Diagnostic {
    Diagnostic::new(Code::ArgumentCount, span, format!("`delay` takes 2 arguments, not {n}"))
        .help("write what is late and by how much: `delay(x, 3 [s])`")
}
