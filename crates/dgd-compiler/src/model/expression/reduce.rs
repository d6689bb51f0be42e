//! `sum(… for i in 1..N)` and other reductions, from the values for all indices.

use super::{ExprLowering, OpenArguments, TypedExpr};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::Node;
use crate::expr::intrinsics::IntrinsicId;
use crate::model::check_units::{ExprDimension, UnitSpelling};
use crate::source::Span;
use crate::syntax::ast::{Name, Reduction, ReductionOperation};

/// Limit on the terms of a reduction, including nested ones: each is an expression of its own.
const MOST_TERMS: usize = 100_000;

impl<'a> ExprLowering<'a> {
    /// The reduction of these values.
    pub(super) fn reduced(
        &mut self,
        reduction: &Reduction,
        terms: &[TypedExpr],
        span: Span,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let word = reduction.kind.word();
        let Some((first, others)) = terms.split_first() else {
            return match reduction.kind {
                ReductionOperation::Sum => {
                    Ok(TypedExpr { id: self.graph.constant(0.0), dim: ExprDimension::Zero })
                }
                ReductionOperation::Product => {
                    Ok(TypedExpr { id: self.graph.constant(1.0), dim: ExprDimension::ONE })
                }
                ReductionOperation::Least
                | ReductionOperation::Greatest
                | ReductionOperation::Mean => {
                    let message =
                        format!("there is no `{word}` of nothing: no index is in the range");
                    Err(diagnostics.error(
                        Diagnostic::new(Code::NotAKnownWholeNumber, span, message)
                            .help("let the range have an index"),
                    ))
                }
            };
        };
        let mut total = *first;
        for term in others {
            let dim = if reduction.kind == ReductionOperation::Product {
                UnitSpelling::product(total.dim, term.dim, false, reduction.body.span)
            } else {
                let span = reduction.body.span;
                self.scope.spelling.same("add", total.locate(span), term.locate(span))
            };
            let dim = dim.map_err(|diagnostic| diagnostics.error(diagnostic))?;
            let id = match reduction.kind {
                ReductionOperation::Sum | ReductionOperation::Mean => {
                    self.graph.intern(Node::Add(total.id, term.id))
                }
                ReductionOperation::Product => self.graph.intern(Node::Multiply(total.id, term.id)),
                ReductionOperation::Least | ReductionOperation::Greatest => {
                    self.graph.intern_call(IntrinsicId::named(word), &[total.id, term.id])
                }
            };
            total = TypedExpr { id, dim };
        }
        if reduction.kind == ReductionOperation::Mean {
            let count = self.graph.constant(terms.len() as f64);
            total.id = self.graph.intern(Node::Divide(total.id, count));
        }
        Ok(total)
    }

    /// Counts a term of a reduction that has `terms` so far.
    pub(super) fn count_term(
        &mut self,
        reduction: &Reduction,
        terms: usize,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        self.terms += 1;
        if self.terms > MOST_TERMS {
            if let Some(said) = diagnostics.said(Code::NotAKnownWholeNumber, reduction.body.span) {
                return Err(said);
            }
            let word = reduction.kind.word();
            let with = if self.terms > terms + 1 { ", with those around it" } else { "" };
            let message = format!("this `{word}` has more than {MOST_TERMS} terms{with}");
            return Err(diagnostics.error(
                Diagnostic::new(Code::NotAKnownWholeNumber, reduction.body.span, message).help(
                    "add up in a loop: `equation add[i]: total[i] = total[i-1] + …`, of an array \
                     of `unknown`s",
                ),
            ));
        }
        Ok(())
    }

    /// Checks that the index of a sum has a name of its own.
    pub(super) fn verify_free(
        &self,
        index: &Name,
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        if self.scope.names.contains_key(index.text.as_str()) {
            self.scope.verify_index(index, diagnostics);
            return diagnostics.check();
        }
        let what = if self.indices.iter().any(|open| open.name == index.text) {
            "another index"
        } else if arguments.contains_key(index.text.as_str()) {
            "an argument"
        } else {
            return Ok(());
        };
        let message = format!("the index `{}` has the name of {what}", index.text);
        Err(diagnostics.error(
            Diagnostic::new(Code::DuplicateName, index.span, message)
                .about(&index.text)
                .help("choose another name"),
        ))
    }
}
