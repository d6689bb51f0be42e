//! The sources of functions: expressions of a system, which become operations, and the numbers of results.

use dgd_signature::PastLayout;

use super::past::begin;
use super::{Argument, Operation, Place, ValueId};
use crate::dae::{self, Dae};
use crate::expr::{ExprId, Graph, Node, Past, Symbol};

/// A number of a result, or one for each row of a family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Number {
    pub(super) value: ExprId,
    /// Its position, or that of the first row.
    pub(super) place: usize,
    /// Number of rows; `None` for a single number.
    pub(super) rows: Option<u32>,
    /// Its family, or its array, counted after the families; `None` for a single row.
    pub(super) family: Option<usize>,
}

/// A number, and the position of its result.
pub(super) type Given = (usize, Number);

/// The expressions of a system as the source of functions.
#[derive(Clone, Copy)]
pub(super) struct Expressions<'a> {
    pub(super) graph: &'a Graph,
    pub(super) dae: &'a Dae,
    pub(super) past: PastLayout,
}

impl Expressions<'_> {
    pub(super) fn node(&self, id: ExprId) -> Node {
        self.graph.node(id)
    }

    /// The operation of a symbol.
    pub(super) fn load(&self, node: Node) -> Operation {
        self.operation(node, |_| unreachable!("a symbol has no operands"))
    }

    /// The operation of a node; values are requested in the order of its operands.
    pub(super) fn operation(
        &self,
        node: Node,
        mut value: impl FnMut(ExprId) -> ValueId,
    ) -> Operation {
        let position = |i: usize| u32::try_from(i).unwrap_or(u32::MAX);
        let swept = |argument, first| Operation::LoadSwept(argument, Place { first, by_round: 0 });
        match node {
            Node::Constant(bits) => Operation::Constant(f64::from_bits(bits)),
            Node::Symbol(symbol) => match symbol {
                Symbol::Time => Operation::Time,
                Symbol::Parameter(i) => Operation::Load(Argument::P, i),
                Symbol::Input(i) => Operation::Load(Argument::U, i),
                Symbol::InputSlope(i) => Operation::Load(Argument::Udot, i),
                Symbol::Unknown(i) => Operation::Load(Argument::Y, i),
                Symbol::Sensitivity(i) => Operation::Load(Argument::S, i),
                Symbol::Discrete(i) => Operation::Load(Argument::Z, i),
                Symbol::Past(Past::Present, k) => {
                    let unknown = dae::position(self.dae.delayed_unknowns[k as usize].unknown);
                    Operation::Load(Argument::Y, position(unknown))
                }
                Symbol::Past(past, k) => {
                    Operation::Load(Argument::U, position(begin(self.past, past)) + k)
                }
                Symbol::Swept(i) => swept(Argument::Y, i),
                Symbol::SweptSensitivity(i) => swept(Argument::S, i),
                Symbol::SweptParameter(i, _) => swept(Argument::P, i),
                Symbol::SweptInput(i, _) => swept(Argument::U, i),
                Symbol::SweptInputSlope(i, _) => swept(Argument::Udot, i),
                Symbol::Counter => Operation::Counter,
                Symbol::Constant(_)
                | Symbol::Derivative(_)
                | Symbol::Element(_)
                | Symbol::ElementRate(_)
                | Symbol::SweptRate(_)
                | Symbol::Late(_)
                | Symbol::DelayedUnknown(_) => {
                    unreachable!("a Dae holds no constants, no derivatives and nothing late")
                }
            },
            Node::Negate(a) => Operation::Negate(value(a)),
            Node::Add(a, b) => Operation::Add(value(a), value(b)),
            Node::Subtract(a, b) => Operation::Subtract(value(a), value(b)),
            Node::Multiply(a, b) => Operation::Multiply(value(a), value(b)),
            Node::Divide(a, b) => Operation::Divide(value(a), value(b)),
            Node::Call1(f, a) => Operation::Call1(f, value(a)),
            Node::Call2(f, a, b) => Operation::Call2(f, value(a), value(b)),
            Node::Curve(curve, a) => Operation::Curve(curve, value(a)),
            Node::Compare(c, a, b) => Operation::Compare(c, value(a), value(b)),
            Node::And(a, b) => Operation::And(value(a), value(b)),
            Node::Or(a, b) => Operation::Or(value(a), value(b)),
            Node::Not(a) => Operation::Not(value(a)),
            Node::Select(c, a, b) => Operation::Select(value(c), value(a), value(b)),
            Node::Delay(..) => unreachable!("a Dae holds no delays"),
        }
    }
}
