//! The arguments of a call.

use super::{ExprLowering, TypedExpr};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::model::check_units::ExprDimension;
use crate::source::Span;
use crate::syntax::ast::Name;
use crate::units::Unit;

/// The arguments of a call.
pub(super) struct CallArguments {
    pub(super) typed: Vec<TypedExpr>,
    pub(super) spans: Vec<Span>,
    pub(super) call: Span,
    /// Where the function is declared.
    pub(super) place: Span,
}

impl ExprLowering<'_> {
    /// Binds arguments of a function or a table, checking those with a unit.
    pub(super) fn bind(
        &self,
        called: &str,
        arguments: &[(&Name, Option<Unit>)],
        passed: &CallArguments,
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<TypedExpr>, ErrorReported> {
        let mut bound = Vec::with_capacity(passed.typed.len());
        let bindings = arguments.iter().zip(&passed.typed).zip(&passed.spans);
        for (((argument, unit), typed), span) in bindings {
            let mut typed = *typed;
            if let Some(unit) = unit {
                let wanted = ExprDimension::Of(unit.dimension);
                if typed.dim.unify(wanted).is_none() {
                    let dimension = typed.dim.dimension();
                    return Err(diagnostics.error(
                        Diagnostic::new(
                            Code::UnitsOfSides,
                            *span,
                            format!(
                                "`{called}` takes `{}` in `{}`, not {}",
                                argument.text,
                                unit.symbol,
                                self.scope.spelling.being(dimension)
                            ),
                        )
                        .about(called)
                        .about(&argument.text)
                        .here(self.scope.spelling.this_is(dimension))
                        .label(argument.span, format!("declared in `{}`", unit.symbol)),
                    ));
                }
                typed.dim = wanted;
            }
            bound.push(typed);
        }
        Ok(bound)
    }
}
