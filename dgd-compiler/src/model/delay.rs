//! `delay(x, tau)`: what `x` was a time `tau` ago.

use super::check_units::{Dim, being, this_is};
use super::expression::{Arguments, Lowering, Typed};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, Reported};
use crate::expr::{Node, Symbol};
use crate::source::Span;
use crate::syntax::ast::Expr;

impl<'a> Lowering<'a> {
    /// The delay of an expression by a time that constants and parameters give.
    pub(super) fn delay(
        &mut self,
        list: &'a [Expr],
        span: Span,
        arguments: &Arguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<Typed, Reported> {
        let [x_expr, tau_expr] = list else {
            let n = list.len();
            return Err(diagnostics.error(
                Diagnostic::new(Code::E204, span, format!("`delay` takes 2 arguments, not {n}"))
                    .help("write what is late and by how much: `delay(x, 3 [s])`"),
            ));
        };
        let x = self.lower(x_expr, arguments, diagnostics);
        let tau = self.lower(tau_expr, arguments, diagnostics);
        let (x, tau) = (x?, tau?);
        if tau.dim.with(Dim::Of(self.scope.second)).is_none() {
            let found = tau.dim.dimension();
            let message = format!("a delay is a time, but this is {}", being(found));
            return Err(diagnostics.error(
                Diagnostic::new(Code::E302, tau_expr.span, message)
                    .here(this_is(found))
                    .help("give it in a unit of time: `delay(x, 3 [s])`"),
            ));
        }
        if self.graph.symbols(tau.id).contains(&Symbol::Counter) {
            let message = "this delay depends on the loop's index";
            return Err(diagnostics.error(
                Diagnostic::new(Code::E215, tau_expr.span, message)
                    .help("use constants and parameters, which are the same for all rows"),
            ));
        }
        let varies = |symbol: &Symbol| match symbol {
            Symbol::Time
            | Symbol::Input(_)
            | Symbol::Unknown(_)
            | Symbol::Derivative(_)
            | Symbol::Element(_)
            | Symbol::Swept(_)
            | Symbol::ElementRate(_)
            | Symbol::SweptRate(_) => {
                // An argument of a function that is checked by itself has no name in the model.
                self.scope.quoted_name(*symbol)
            }
            Symbol::Constant(_)
            | Symbol::Parameter(_)
            | Symbol::InputSlope(_)
            | Symbol::Sensitivity(_)
            | Symbol::SweptSensitivity(_)
            | Symbol::Counter
            | Symbol::Discrete(_)
            | Symbol::Late(_)
            | Symbol::DelayedUnknown(_)
            | Symbol::Past(..) => None,
        };
        if let Some(culprit) = self.graph.symbols(tau.id).iter().find_map(varies) {
            let message = format!("this delay depends on {culprit}, so it varies during a run");
            return Err(diagnostics.error(
                Diagnostic::new(Code::E215, tau_expr.span, message)
                    .help("use constants and parameters, which are the same at all times"),
            ));
        }
        Ok(Typed { id: self.graph.intern(Node::Delay(x.id, tau.id)), dim: x.dim })
    }
}
