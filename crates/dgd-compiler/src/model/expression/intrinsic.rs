//! Calls of the functions of the language.

use super::{ExprLowering, TypedExpr};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::ExprId;
use crate::expr::intrinsics::{INTRINSICS, IntrinsicId};
use crate::model::check_units::LocatedDimension;
use crate::source::Span;
use crate::syntax::ast::Name;

impl ExprLowering<'_> {
    /// A function of the language at these arguments, each with its place.
    pub(super) fn intrinsic(
        &mut self,
        intrinsic: IntrinsicId,
        arguments: &[(TypedExpr, Span)],
        call: Span,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let function = intrinsic.get();
        let dims: Vec<LocatedDimension> =
            arguments.iter().map(|(typed, span)| typed.locate(*span)).collect();
        let dim = self
            .scope
            .spelling
            .call(function.name, function.unit_rule, &dims, call)
            .map_err(|diagnostic| diagnostics.error(diagnostic))?;
        let ids: Vec<ExprId> = arguments.iter().map(|(typed, _)| typed.id).collect();
        Ok(TypedExpr { id: self.graph.intern_call(intrinsic, &ids), dim })
    }

    /// The error for a function that neither the language nor the model has.
    pub(super) fn unknown_function(
        &self,
        function: &Name,
        diagnostics: &mut Diagnostics,
    ) -> ErrorReported {
        let name = function.text.as_str();
        if let Some(said) = diagnostics.said(Code::UnknownFunction, function.span) {
            return said;
        }
        let known = INTRINSICS.iter().map(|i| i.name);
        let of_model = self.scope.function_names();
        let mut diagnostic = Diagnostic::new(
            Code::UnknownFunction,
            function.span,
            format!("there is no function `{name}`"),
        )
        .about(name);
        let known = known.chain(of_model).chain(["der", "delay"]);
        if let Some(near) = diagnostics.suggestion(name, known) {
            diagnostic.help = Some(format!("did you mean `{near}`?").into());
        }
        diagnostics.error(diagnostic)
    }
}
