//! Expressions in the graph, with their dimensions.
//!
//! | file | contents |
//! |---|---|
//! | `lower` | lowers expressions |
//! | `call` | functions, `let`s of loops, reductions and tables, whose texts are lowered at each use |
//! | `arguments`, `intrinsic`, `delay` | calls whose arguments have been lowered |
//! | `named`, `element` | names, and elements of arrays |
//! | `reduce` | sums and other reductions, from their terms |
//! | `tables/`, `resolved_table` | tables, from their points |
//! | `quotient` | derivatives that are written like quotients |

mod arguments;
mod call;
mod delay;
mod element;
mod intrinsic;
mod lower;
mod named;
mod quotient;
mod reduce;
mod resolved_table;
mod tables;

use std::collections::BTreeMap;

use super::check_units::{ExprDimension, LocatedDimension};
use super::scope::{LoopIndex, ModelScope};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::{ExprGraph, ExprId, Node, Symbol};
use crate::source::Span;
use crate::units::Dimension;
use resolved_table::ResolvedTable;

/// Limit on the operations that sums and loops are written out to: later stages need some hundred bytes for each.
const MOST_WRITTEN: usize = 2_000_000;

/// Whether a number is a value, including the offset of its unit, or a size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::model) enum NumberReading {
    /// 20 °C is 293.15 K.
    Value,
    /// 20 °C is 20 K.
    Size,
}

/// An expression in the graph and its dimension.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::model) struct TypedExpr {
    pub(in crate::model) id: ExprId,
    pub(in crate::model) dim: ExprDimension,
}

impl TypedExpr {
    pub(in crate::model) fn locate(self, span: Span) -> LocatedDimension {
        LocatedDimension { dim: self.dim, span }
    }
}

/// The arguments of an open function by name.
pub(in crate::model) type OpenArguments<'a> = BTreeMap<&'a str, TypedExpr>;

/// Lowers expressions into a graph.
pub(in crate::model) struct ExprLowering<'a> {
    pub(in crate::model) scope: ModelScope<'a>,
    pub(in crate::model) graph: ExprGraph,
    /// `let`s evaluated so far; an error proves that a failed one was reported.
    pub(in crate::model) lets: BTreeMap<&'a str, Result<TypedExpr, ErrorReported>>,
    /// Values of constants evaluated so far, by position.
    pub(in crate::model) constants: BTreeMap<u32, f64>,
    /// Tables read so far, by position.
    tables: BTreeMap<usize, Result<ResolvedTable, ErrorReported>>,
    /// Results of calls, so that equal calls are expanded once.
    pub(in crate::model) calls:
        BTreeMap<(&'a str, Vec<TypedExpr>), Result<TypedExpr, ErrorReported>>,
    /// Functions being expanded, innermost last.
    pub(in crate::model) open: Vec<&'a str>,
    /// Proof that too many calls have been reported, which happens once.
    exhausted: Option<ErrorReported>,
    depth: usize,
    /// Expressions lowered so far, counted as often as sums and loops write them out.
    written: usize,
    /// Terms of the sum that is being written out, including those of nested sums.
    pub(in crate::model) terms: usize,
    pub(in crate::model) within_reduction: bool,
    /// The open indices, innermost last; one of these may move.
    pub(in crate::model) indices: Vec<LoopIndex<'a>>,
    /// Whether an element that moves by more than one has been read.
    pub(in crate::model) strided: bool,
    /// Dimensions of expressions by place, if requested.
    pub(in crate::model) dimensions: Option<BTreeMap<Span, Dimension>>,
    /// `let`s of loops, by name and indices.
    pub(in crate::model) opened_lets:
        BTreeMap<(&'a str, Vec<LoopIndex<'a>>), Result<TypedExpr, ErrorReported>>,
}

impl<'a> ExprLowering<'a> {
    pub(in crate::model) fn new(scope: ModelScope<'a>) -> Self {
        ExprLowering {
            scope,
            graph: ExprGraph::default(),
            lets: BTreeMap::new(),
            constants: BTreeMap::new(),
            tables: BTreeMap::new(),
            calls: BTreeMap::new(),
            open: Vec::new(),
            exhausted: None,
            depth: 0,
            written: 0,
            terms: 0,
            within_reduction: false,
            indices: Vec::new(),
            strided: false,
            dimensions: None,
            opened_lets: BTreeMap::new(),
        }
    }

    /// The value of an expression of constants; `None` if it reads anything else.
    pub(in crate::model) fn number(&self, id: ExprId) -> Option<f64> {
        if let Node::Constant(bits) = self.graph.node(id) {
            return Some(f64::from_bits(bits));
        }
        let known = |symbol: &Symbol| matches!(symbol, Symbol::Constant(i) if self.constants.contains_key(i));
        self.graph.symbols(id).iter().all(known).then(|| {
            self.graph.evaluate(id, &|symbol| match symbol {
                Symbol::Constant(i) => self.constants[&i],
                _ => f64::NAN,
            })
        })
    }

    /// Refuses to write out more at this place if the model would become too large.
    pub(in crate::model) fn verify_size(
        &self,
        place: Span,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        if self.written <= MOST_WRITTEN {
            return Ok(());
        }
        if let Some(said) = diagnostics.said(Code::ModelTooLarge, place) {
            return Err(said);
        }
        let message = format!(
            "the sums and loops of this model write out more than {MOST_WRITTEN} operations"
        );
        Err(diagnostics.error(Diagnostic::new(Code::ModelTooLarge, place, message).help(
            "add up in a loop: `equation add[i]: total[i] = total[i-1] + …`, of an array of `unknown`s",
        )))
    }

    /// The first relevant symbol that an expression depends on.
    pub(in crate::model) fn first_unknown(
        &self,
        id: ExprId,
        matters: impl Fn(Symbol) -> bool,
    ) -> String {
        let mut symbols = self.graph.symbols(id).into_iter().filter(|symbol| matters(*symbol));
        let name = symbols.find_map(|symbol| self.scope.quoted_name(symbol));
        name.unwrap_or_else(|| "a constant that is in error".to_owned())
    }
}

/// The error for a value that is infinite or not a number.
pub(in crate::model) fn not_finite(value: f64, span: Span) -> Diagnostic {
    let message = format!("this comes to {value}, which is not a finite number");
    Diagnostic::new(Code::ValueNotConstant, span, message)
}
