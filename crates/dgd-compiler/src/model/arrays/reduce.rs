//! `sum(… for i in 1..N)` and other reductions: the values for all indices, one after another.

use super::whole::{IndexExtent, LoopIndex, extent_within};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::Node;
use crate::expr::intrinsics::IntrinsicId;
use crate::model::check_units::{ExprDimension, UnitSpelling};
use crate::model::expression::{ExprLowering, OpenArguments, TypedExpr};
use crate::source::Span;
use crate::syntax::ast::{LoopCounter, Reduction, ReductionOperation};

/// Limit on the terms of a reduction, including nested ones: each is an expression of its own.
const MOST_TERMS: usize = 100_000;

impl<'a> ExprLowering<'a> {
    pub(in crate::model) fn reduction(
        &mut self,
        reduction: &'a Reduction,
        span: Span,
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let mut terms = Vec::new();
        let open = self.indices.len();
        let is_outermost = !std::mem::replace(&mut self.within_reduction, true);
        if is_outermost {
            self.terms = 0;
        }
        let done = self.terms(reduction, &reduction.counters, arguments, &mut terms, diagnostics);
        self.indices.truncate(open);
        self.within_reduction = !is_outermost;
        done?;
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

    /// The values for all indices, the last varying fastest.
    fn terms(
        &mut self,
        reduction: &'a Reduction,
        counters: &'a [LoopCounter],
        arguments: &OpenArguments<'a>,
        terms: &mut Vec<TypedExpr>,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        let Some((LoopCounter { index, range }, inner)) = counters.split_first() else {
            self.terms += 1;
            if self.terms > MOST_TERMS {
                if let Some(said) =
                    diagnostics.said(Code::NotAKnownWholeNumber, reduction.body.span)
                {
                    return Err(said);
                }
                let word = reduction.kind.word();
                let with = if self.terms > terms.len() + 1 { ", with those around it" } else { "" };
                let message = format!("this `{word}` has more than {MOST_TERMS} terms{with}");
                return Err(diagnostics.error(
                    Diagnostic::new(Code::NotAKnownWholeNumber, reduction.body.span, message).help(
                        "add up in a loop: `equation add[i]: total[i] = total[i-1] + …`, of an array \
                         of `unknown`s",
                    ),
                ));
            }
            self.verify_size(reduction.body.span, diagnostics)?;
            terms.push(self.lower(&reduction.body, arguments, diagnostics)?);
            return Ok(());
        };
        self.verify_free(index, arguments, diagnostics)?;
        let IndexExtent { lower, count } =
            extent_within(range, &self.scope.sizes, &self.indices, diagnostics)?;
        let open = self.indices.len();
        for passage in 0..i64::from(count) {
            self.indices.truncate(open);
            self.indices.push(LoopIndex { name: &index.text, first: lower + passage, count: 1 });
            self.terms(reduction, inner, arguments, terms, diagnostics)?;
        }
        self.indices.truncate(open);
        Ok(())
    }
}
