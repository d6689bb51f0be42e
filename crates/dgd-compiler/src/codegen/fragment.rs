//! Code for one operation, from that of its operands.

use std::collections::BTreeMap;

use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};

use super::literals::number;
use super::{curves, literals};
use crate::expr::graph::Comparison;
use crate::expr::intrinsics::IntrinsicDefinition;
use crate::program::{FunctionArgument, ProgramOperation, StridedPosition, ValueId};

/// Expressions nest up to this many operations in one statement.
pub(super) const DEEPEST_PIECE: usize = 8;

/// How tightly a piece of code binds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum TokenPrecedence {
    Any,
    Sum,
    Product,
    Unary,
    Atom,
}

/// Code for a value, not yet bound to a name.
#[derive(Clone)]
pub(super) struct CodeFragment {
    pub(super) tokens: TokenStream,
    tightness: TokenPrecedence,
    pub(super) depth: usize,
}

impl CodeFragment {
    pub(super) fn atom(tokens: TokenStream) -> CodeFragment {
        CodeFragment { tokens, tightness: TokenPrecedence::Atom, depth: 0 }
    }

    fn at_least(&self, least: TokenPrecedence) -> TokenStream {
        let tokens = &self.tokens;
        if self.tightness >= least { tokens.clone() } else { quote!((#tokens)) }
    }
}

/// Code for an operation on pieces.
pub(super) fn piece_of(
    operation: ProgramOperation,
    pieces: &BTreeMap<ValueId, CodeFragment>,
) -> CodeFragment {
    let depth = operation.operands().map(|v| pieces[&v].depth + 1).max().unwrap_or(0);
    let infix = |a: ValueId, operator: TokenStream, b: ValueId, own, right| {
        let (a, b) = (pieces[&a].at_least(own), pieces[&b].at_least(right));
        CodeFragment { tokens: quote!(#a #operator #b), tightness: own, depth }
    };
    let any = |value: ValueId| &pieces[&value].tokens;
    let atom = |tokens| CodeFragment { tokens, tightness: TokenPrecedence::Atom, depth };
    match operation {
        ProgramOperation::Constant(value) => {
            let tightness = if value.is_sign_negative() {
                TokenPrecedence::Unary
            } else {
                TokenPrecedence::Atom
            };
            CodeFragment { tokens: number(value), tightness, depth }
        }
        ProgramOperation::Time => atom(quote!(_at.t)),
        ProgramOperation::Load(argument, index) => {
            let (array, index) = (array(argument), literals::index(index as usize));
            atom(quote!(#array[#index]))
        }
        ProgramOperation::LoadSwept(argument, StridedPosition { first, by_round })
        | ProgramOperation::LoadRound(argument, StridedPosition { first, by_round }) => {
            let by_passage = matches!(operation, ProgramOperation::LoadSwept(..));
            let position = place(first as usize, by_round as isize, by_passage);
            let array = array(argument);
            atom(quote!(#array[#position]))
        }
        ProgramOperation::Counter => atom(quote!((_k as f64))),
        ProgramOperation::Round => atom(quote!((_r as f64))),
        ProgramOperation::Negate(a) => {
            let a = pieces[&a].at_least(TokenPrecedence::Atom);
            CodeFragment { tokens: quote!(-#a), tightness: TokenPrecedence::Unary, depth }
        }
        ProgramOperation::Add(a, b) => {
            infix(a, quote!(+), b, TokenPrecedence::Sum, TokenPrecedence::Product)
        }
        ProgramOperation::Subtract(a, b) => {
            infix(a, quote!(-), b, TokenPrecedence::Sum, TokenPrecedence::Product)
        }
        ProgramOperation::Multiply(a, b) => {
            infix(a, quote!(*), b, TokenPrecedence::Product, TokenPrecedence::Unary)
        }
        ProgramOperation::Divide(a, b) => {
            infix(a, quote!(/), b, TokenPrecedence::Product, TokenPrecedence::Unary)
        }
        ProgramOperation::Call1(f, a) => {
            let path = rust_path(f.get().definition.rust_path());
            let a = any(a);
            atom(quote!(#path(#a)))
        }
        ProgramOperation::Call2(f, a, b) => {
            let path = rust_path(f.get().definition.rust_path());
            let (a, b) = (any(a), any(b));
            atom(quote!(#path(#a, #b)))
        }
        ProgramOperation::Curve(curve, a) => {
            let (name, a) = (curves::name(curve), any(a));
            atom(quote!(#name.value(#a)))
        }
        ProgramOperation::Compare(comparison, a, b) => {
            let (a, b) = (any(a), any(b));
            let operator = match comparison {
                Comparison::Less => quote!(<),
                Comparison::LessEqual => quote!(<=),
                Comparison::Greater => quote!(>),
                Comparison::GreaterEqual => quote!(>=),
            };
            atom(quote!((#a #operator #b)))
        }
        ProgramOperation::And(a, b) => {
            let (a, b) = (any(a), any(b));
            atom(quote!((#a && #b)))
        }
        ProgramOperation::Or(a, b) => {
            let (a, b) = (any(a), any(b));
            atom(quote!((#a || #b)))
        }
        ProgramOperation::Not(a) => {
            let a = pieces[&a].at_least(TokenPrecedence::Atom);
            CodeFragment { tokens: quote!(!#a), tightness: TokenPrecedence::Unary, depth }
        }
        ProgramOperation::Select(c, a, b) => {
            let (c, a, b) = (any(c), any(a), any(b));
            CodeFragment {
                tokens: quote!(if #c { #a } else { #b }),
                tightness: TokenPrecedence::Any,
                depth,
            }
        }
    }
}

impl IntrinsicDefinition {
    /// The function that generated code calls.
    fn rust_path(&self) -> &'static str {
        match self {
            IntrinsicDefinition::One { rust_path, .. }
            | IntrinsicDefinition::Two { rust_path, .. } => rust_path,
            IntrinsicDefinition::Expansion(..) => {
                unreachable!("an expansion is expanded before it is called")
            }
        }
    }
}

/// `::core::primitive::f64::tanh` as tokens.
fn rust_path(path: &str) -> TokenStream {
    path.parse().unwrap_or_else(|_| unreachable!("`{path}` is a path"))
}

pub(super) fn array(argument: FunctionArgument) -> Ident {
    format_ident!("_{}", argument.symbol())
}

/// A position in a loop, which advances with the rounds and optionally with the passages.
pub(super) fn place(first: usize, by_round: isize, by_passage: bool) -> TokenStream {
    let step = literals::index(by_round.unsigned_abs());
    let first = (first > 0).then(|| {
        let first = literals::index(first);
        quote!(#first)
    });
    let of_round =
        (by_round > 0).then(|| if by_round == 1 { quote!(_r) } else { quote!(#step * _r) });
    let of_passage = by_passage.then(|| quote!(_k));
    let sum = [first, of_round, of_passage].into_iter().flatten();
    let place = sum.reduce(|sum, term| quote!(#sum + #term)).unwrap_or_else(|| quote!(0));
    if by_round < 0 { quote!(#place - #step * _r) } else { place }
}
