//! The sources of functions: expressions of a system, which become operations, and the numbers of results.

use dgd_signature::PastLayout;

use super::past::begin;
use super::{FunctionArgument, ProgramOperation, StridedPosition, ValueId};
use crate::dae::{self, Dae};
use crate::expr::{DelayedValue, ExprGraph, ExprId, Node, Symbol};

/// A number of a result, or one for each row of a family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ResultNumber {
    pub(super) value: ExprId,
    /// Its position, or that of the first row.
    pub(super) place: usize,
    /// Number of rows; `None` for a single number.
    pub(super) rows: Option<u32>,
    /// Its family, or its array, counted after the families; `None` for a single row.
    pub(super) family: Option<usize>,
}

/// A number, and the position of its result.
pub(super) type PlacedNumber = (usize, ResultNumber);

/// The expressions of a system as the source of functions.
#[derive(Clone, Copy)]
pub(super) struct SystemExpressions<'a> {
    pub(super) graph: &'a ExprGraph,
    pub(super) dae: &'a Dae,
    pub(super) past: PastLayout,
}

impl SystemExpressions<'_> {
    pub(super) fn node(&self, id: ExprId) -> Node {
        self.graph.node(id)
    }

    /// The operation of a symbol.
    pub(super) fn load(&self, node: Node) -> ProgramOperation {
        self.operation(node, |_| unreachable!("a symbol has no operands"))
    }

    /// The operation of a node; values are requested in the order of its operands.
    pub(super) fn operation(
        &self,
        node: Node,
        mut value: impl FnMut(ExprId) -> ValueId,
    ) -> ProgramOperation {
        let position = |i: usize| u32::try_from(i).unwrap_or(u32::MAX);
        let swept = |argument, first| {
            ProgramOperation::LoadSwept(argument, StridedPosition { first, by_round: 0 })
        };
        match node {
            Node::Constant(bits) => ProgramOperation::Constant(f64::from_bits(bits)),
            Node::Symbol(symbol) => match symbol {
                Symbol::Time => ProgramOperation::Time,
                Symbol::Parameter(i) => ProgramOperation::Load(FunctionArgument::P, i),
                Symbol::Input(i) => ProgramOperation::Load(FunctionArgument::U, i),
                Symbol::InputSlope(i) => ProgramOperation::Load(FunctionArgument::Udot, i),
                Symbol::Unknown(i) => ProgramOperation::Load(FunctionArgument::Y, i),
                Symbol::Sensitivity(i) => ProgramOperation::Load(FunctionArgument::S, i),
                Symbol::Discrete(i) => ProgramOperation::Load(FunctionArgument::Z, i),
                Symbol::Past(DelayedValue::Present, k) => {
                    let unknown = dae::position(self.dae.delayed_unknowns[k as usize].unknown);
                    ProgramOperation::Load(FunctionArgument::Y, position(unknown))
                }
                Symbol::Past(past, k) => ProgramOperation::Load(
                    FunctionArgument::U,
                    position(begin(self.past, past)) + k,
                ),
                Symbol::Swept(i) => swept(FunctionArgument::Y, i),
                Symbol::SweptSensitivity(i) => swept(FunctionArgument::S, i),
                Symbol::SweptParameter(i, _) => swept(FunctionArgument::P, i),
                Symbol::SweptInput(i, _) => swept(FunctionArgument::U, i),
                Symbol::SweptInputSlope(i, _) => swept(FunctionArgument::Udot, i),
                Symbol::Counter => ProgramOperation::Counter,
                Symbol::Constant(_)
                | Symbol::Derivative(_)
                | Symbol::Element(_)
                | Symbol::ElementRate(_)
                | Symbol::SweptRate(_)
                | Symbol::Delayed(_)
                | Symbol::DelayedUnknown(_) => {
                    unreachable!("a Dae holds no constants, no derivatives and nothing late")
                }
            },
            Node::Negate(a) => ProgramOperation::Negate(value(a)),
            Node::Add(a, b) => ProgramOperation::Add(value(a), value(b)),
            Node::Subtract(a, b) => ProgramOperation::Subtract(value(a), value(b)),
            Node::Multiply(a, b) => ProgramOperation::Multiply(value(a), value(b)),
            Node::Divide(a, b) => ProgramOperation::Divide(value(a), value(b)),
            Node::Call1(f, a) => ProgramOperation::Call1(f, value(a)),
            Node::Call2(f, a, b) => ProgramOperation::Call2(f, value(a), value(b)),
            Node::Curve(curve, a) => ProgramOperation::Curve(curve, value(a)),
            Node::Compare(c, a, b) => ProgramOperation::Compare(c, value(a), value(b)),
            Node::And(a, b) => ProgramOperation::And(value(a), value(b)),
            Node::Or(a, b) => ProgramOperation::Or(value(a), value(b)),
            Node::Not(a) => ProgramOperation::Not(value(a)),
            Node::Select(c, a, b) => ProgramOperation::Select(value(c), value(a), value(b)),
            Node::Delay(..) => unreachable!("a Dae holds no delays"),
        }
    }
}
