//! Names and numbers in expressions.

use super::{ExprLowering, OpenArguments, TypedExpr};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::intrinsics::IntrinsicId;
use crate::expr::{Node, Symbol};
use crate::model::check_units::{ExprDimension, unit_of};
use crate::model::scope::{LoopIndex, NameDefinition, open_index};
use crate::source::Span;
use crate::syntax::ast::WrittenUnit;

impl<'a> ExprLowering<'a> {
    /// A name on its own.
    pub(super) fn name(
        &mut self,
        name: &'a str,
        span: Span,
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        if let Some(typed) = arguments.get(name) {
            return Ok(*typed);
        }
        if let Some(index) = open_index(&self.indices, name) {
            return Ok(self.index_value(index));
        }
        let Some(entry) = self.scope.names.get(name) else {
            return Err(self.unknown_name(name, span, arguments, diagnostics));
        };
        let (symbol, unit) = match entry.definition {
            NameDefinition::Time => (Symbol::Time, self.scope.second),
            NameDefinition::Pi => {
                let id = self.graph.constant(std::f64::consts::PI);
                return Ok(TypedExpr { id, dim: ExprDimension::ONE });
            }
            NameDefinition::Let(_) => {
                return self.lets.get(name).copied().unwrap_or_else(|| {
                    unreachable!("`let`s are done in an order in which each needs earlier ones")
                });
            }
            NameDefinition::Function(_) | NameDefinition::Table(_) => {
                let noun = entry.definition.noun();
                return Err(diagnostics.error(
                    Diagnostic::new(Code::MisusedName, span, format!("`{name}` is {noun}"))
                        .about(name)
                        .help(format!("call it: `{name}(…)`")),
                ));
            }
            NameDefinition::Size => {
                let size = self.scope.sizes.get(name).copied();
                let size = size.unwrap_or_else(|| unreachable!("sizes are worked out first"))?;
                return Ok(TypedExpr {
                    id: self.graph.constant(size as f64),
                    dim: ExprDimension::ONE,
                });
            }
            NameDefinition::Array { .. }
            | NameDefinition::Vector(_)
            | NameDefinition::LetArray(_) => {
                return Err(diagnostics.error(
                    Diagnostic::new(Code::ArrayAsNumber, span, format!("`{name}` is an array"))
                        .about(name)
                        .label(entry.span, "declared here")
                        .help(format!("say which element: `{name}[…]`")),
                ));
            }
            NameDefinition::Constant(i) => (Symbol::Constant(i), self.scope.dimension(name)?),
            NameDefinition::Parameter(i) => (Symbol::Parameter(i), self.scope.dimension(name)?),
            NameDefinition::Input(i) => (Symbol::Input(i), self.scope.dimension(name)?),
            NameDefinition::Unknown { index, .. } => {
                (Symbol::Unknown(index), self.scope.dimension(name)?)
            }
        };
        Ok(TypedExpr { id: self.graph.symbol(symbol), dim: ExprDimension::Of(unit) })
    }

    pub(super) fn unknown_name(
        &self,
        name: &str,
        span: Span,
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> ErrorReported {
        if let Some(place) = self.scope.outputs.get(name) {
            return diagnostics.error(
                Diagnostic::new(
                    Code::MisusedName,
                    span,
                    format!("`{name}` is an output, which cannot be read inside the model"),
                )
                .about(name)
                .label(*place, "declared here")
                .help("give what it reads a `let`, and use that in both places"),
            );
        }
        // For names that a function reads from outside, the error is reported at the function.
        let known_error = [Code::UnknownName, Code::CircularDefinition]
            .into_iter()
            .find_map(|code| diagnostics.said(code, span));
        if let Some(known_error) = known_error {
            return known_error;
        }
        let candidates = arguments.keys().copied().chain(self.scope.names.keys().copied());
        let near = || diagnostics.suggestion(name, candidates);
        let mut diagnostic =
            Diagnostic::new(Code::UnknownName, span, format!("nothing is called `{name}`"))
                .about(name);
        if name == "delay" || IntrinsicId::find(name).is_some() {
            diagnostic.code = Code::MisusedName;
            diagnostic.message = format!("`{name}` is a function");
            diagnostic.help = Some(format!("call it: `{name}(…)`").into());
        } else if let Some(near) = near() {
            diagnostic.help = Some(format!("did you mean `{near}`?").into());
        }
        diagnostics.error(diagnostic)
    }

    /// The index of an open loop as a number.
    fn index_value(&mut self, index: LoopIndex<'a>) -> TypedExpr {
        let first = self.graph.constant(index.first as f64);
        let id = if index.count > 1 {
            let counter = self.graph.symbol(Symbol::Counter);
            self.graph.intern(Node::Add(counter, first))
        } else {
            first
        };
        TypedExpr { id, dim: ExprDimension::ONE }
    }

    /// A number with its unit.
    pub(super) fn literal(
        &mut self,
        value: f64,
        unit: Option<&'a WrittenUnit>,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let (value, dim) = match unit {
            None if value == 0.0 => (0.0, ExprDimension::Zero),
            None => (value, ExprDimension::ONE),
            Some(written) => {
                let unit = unit_of(Some(written), diagnostics)?;
                (unit.to_si(value), ExprDimension::Of(unit.dimension))
            }
        };
        Ok(TypedExpr { id: self.graph.constant(value), dim })
    }
}
