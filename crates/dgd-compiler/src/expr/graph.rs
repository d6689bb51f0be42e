//! The expression graph: every distinct expression once, operands before their readers.
//!
//! Because a node can only refer to existing nodes, ascending [`ExprId`]s are a topological order: every pass over a
//! graph is a loop, and no expression is too deep for it.

pub use crate::syntax::ast::Comparison;

use super::curve::CurveId;
use super::intrinsics::{IntrinsicDefinition, IntrinsicId};
use crate::expr::hash::{HashMap, HashSet};

/// An expression of a [`ExprGraph`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ExprId(u32);

impl ExprId {
    /// Position in the graph.
    pub fn index(self) -> usize {
        self.0 as usize
    }

    /// The expression at a position.
    pub(super) fn from_position(position: usize) -> Self {
        Self(u32::try_from(position).expect("fewer than 2^32 expressions"))
    }
}

/// A symbol of an expression. The number is a position in the list of that kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Symbol {
    /// Seconds since the recording's first sample.
    Time,
    /// A constant of the model; none after `assemble`.
    Constant(u32),
    /// A parameter.
    Parameter(u32),
    /// An input.
    Input(u32),
    /// The slope of an input, du/dt.
    InputSlope(u32),
    /// An unknown.
    Unknown(u32),
    /// The derivative of an unknown; none after `assemble`.
    Derivative(u32),
    /// ∂yᵢ/∂θⱼ at position j n + i.
    Sensitivity(u32),
    /// A delayed symbol, by its position in the list of these; only inside `assemble`.
    Delayed(u32),
    /// A delayed unknown, by its position among those of a `Dae`.
    DelayedUnknown(u32),
    /// A property of a delayed unknown; none before `lower`.
    Past(DelayedValue, u32),
    /// An element of an array, counted through all arrays; none after `assemble`, which turns it into an unknown.
    Element(u32),
    /// In a family of rows, the element that is this one in the first row and the next in the next. Positions count all
    /// elements until `assemble`, all unknowns afterwards.
    Swept(u32),
    /// In a family of rows, the parameter that is this one in the first row and the next in the next, for this many
    /// rows.
    SweptParameter(u32, u32),
    /// In a family of rows, the input that is this one in the first row and the next in the next, for this many rows.
    SweptInput(u32, u32),
    /// The slope of the corresponding [`Symbol::SweptInput`].
    SweptInputSlope(u32, u32),
    /// The derivative of an element; none after `assemble`.
    ElementRate(u32),
    /// The derivative of the corresponding [`Symbol::Swept`]; none after `assemble`.
    SweptRate(u32),
    /// ∂yᵢ/∂θⱼ of the first row at position j n + i, of the next row at the next.
    SweptSensitivity(u32),
    /// The number of the row within its family, from zero.
    Counter,
    /// A number that changes at events only: the mode of a `modes` block, or whether a condition on time holds, 1 or 0.
    /// None before `assemble`.
    Discrete(u32),
}

impl Symbol {
    /// Whether it is an unknown or an element of an array, or the derivative of one.
    pub fn is_of_unknown(self) -> bool {
        matches!(
            self,
            Symbol::Unknown(_)
                | Symbol::Derivative(_)
                | Symbol::Element(_)
                | Symbol::ElementRate(_)
                | Symbol::Swept(_)
                | Symbol::SweptRate(_)
        )
    }

    /// A number for each symbol, in the order of symbols. Searches compute it once instead of comparing symbols.
    pub fn key(self) -> u128 {
        let packed = |kind: u128, a: u32, b: u32| kind << 64 | u128::from(a) << 32 | u128::from(b);
        match self {
            Symbol::Time => 0,
            Symbol::Constant(i) => packed(1, i, 0),
            Symbol::Parameter(i) => packed(2, i, 0),
            Symbol::Input(i) => packed(3, i, 0),
            Symbol::InputSlope(i) => packed(4, i, 0),
            Symbol::Unknown(i) => packed(5, i, 0),
            Symbol::Derivative(i) => packed(6, i, 0),
            Symbol::Sensitivity(i) => packed(7, i, 0),
            Symbol::Delayed(i) => packed(8, i, 0),
            Symbol::DelayedUnknown(i) => packed(9, i, 0),
            Symbol::Past(past, i) => packed(10, past as u32, i),
            Symbol::Element(i) => packed(11, i, 0),
            Symbol::Swept(i) => packed(12, i, 0),
            Symbol::SweptParameter(i, count) => packed(13, i, count),
            Symbol::SweptInput(i, count) => packed(14, i, count),
            Symbol::SweptInputSlope(i, count) => packed(15, i, count),
            Symbol::ElementRate(i) => packed(16, i, 0),
            Symbol::SweptRate(i) => packed(17, i, 0),
            Symbol::SweptSensitivity(i) => packed(18, i, 0),
            Symbol::Counter => packed(19, 0, 0),
            Symbol::Discrete(i) => packed(20, i, 0),
        }
    }
}

/// A property of x(t − τ), by the position k of the delayed unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum DelayedValue {
    /// 1 if the value comes from the history of x, 0 without a delay, where it is x itself.
    Held,
    /// x(t − τ).
    Value,
    /// ẋ(t − τ).
    Rate,
    /// ẍ(t − τ).
    Curvature,
    /// ∂x/∂θⱼ at t − τ, at position j n_v + k.
    Sensitivity,
    /// The slope of ∂x/∂θⱼ at t − τ, at position j n_v + k.
    SensitivityRate,
    /// x(t), for a delay of zero.
    Present,
}

/// One operation on earlier expressions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Node {
    /// A number, by its bits.
    Constant(u64),
    /// A symbol.
    Symbol(Symbol),
    /// −a
    Negate(ExprId),
    /// a + b
    Add(ExprId, ExprId),
    /// a − b
    Subtract(ExprId, ExprId),
    /// a b
    Multiply(ExprId, ExprId),
    /// a / b
    Divide(ExprId, ExprId),
    /// f(a)
    Call1(IntrinsicId, ExprId),
    /// f(a, b)
    Call2(IntrinsicId, ExprId, ExprId),
    /// The curve of a table at a
    Curve(CurveId, ExprId),
    /// A condition: a < b and the like.
    Compare(Comparison, ExprId, ExprId),
    /// Both conditions.
    And(ExprId, ExprId),
    /// Either condition.
    Or(ExprId, ExprId),
    /// Not the condition.
    Not(ExprId),
    /// The second if the condition (first) holds, otherwise the third.
    Select(ExprId, ExprId, ExprId),
    /// The first expression delayed by the second, s; none after `assemble`.
    Delay(ExprId, ExprId),
}

impl Node {
    /// Whether its value may jump although its operands are continuous and no comparison changes: a rounded number, an
    /// angle, or a table with steps.
    pub fn steps(self) -> bool {
        match self {
            Node::Call1(function, _) => matches!(function.get().name, "floor" | "ceil" | "round"),
            Node::Call2(function, ..) => matches!(function.get().name, "atan2" | "mod"),
            Node::Curve(curve, _) => curve.get().smooth < 0,
            _ => false,
        }
    }

    /// The expressions it reads, in order.
    pub fn operands(self) -> impl Iterator<Item = ExprId> {
        let [a, b, c] = match self {
            Node::Constant(_) | Node::Symbol(_) => [None; 3],
            Node::Negate(a) | Node::Call1(_, a) | Node::Curve(_, a) | Node::Not(a) => {
                [Some(a), None, None]
            }
            Node::Add(a, b)
            | Node::Subtract(a, b)
            | Node::Multiply(a, b)
            | Node::Divide(a, b)
            | Node::Call2(_, a, b)
            | Node::Compare(_, a, b)
            | Node::And(a, b)
            | Node::Or(a, b)
            | Node::Delay(a, b) => [Some(a), Some(b), None],
            Node::Select(a, b, c) => [Some(a), Some(b), Some(c)],
        };
        [a, b, c].into_iter().flatten()
    }
}

/// A growing set of expressions, each stored once.
#[derive(Debug, Clone, Default)]
pub struct ExprGraph {
    nodes: Vec<Node>,
    ids: HashMap<Node, ExprId>,
}

impl ExprGraph {
    /// The node of an expression.
    pub fn node(&self, id: ExprId) -> Node {
        self.nodes[id.index()]
    }

    /// Number of expressions.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether the graph contains this symbol.
    pub fn has_symbol(&self, symbol: Symbol) -> bool {
        self.ids.contains_key(&Node::Symbol(symbol))
    }

    /// Whether the graph calls this function.
    pub(crate) fn calls(&self, function: IntrinsicId) -> bool {
        let is_call = |node: &Node| match node {
            Node::Call1(other, _) | Node::Call2(other, ..) => *other == function,
            _ => false,
        };
        self.nodes.iter().any(is_call)
    }

    /// Whether it contains no expressions.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The expression with this node, without simplification.
    pub fn intern(&mut self, node: Node) -> ExprId {
        // a + b and b + a are one expression, in the order first seen.
        let swapped = match node {
            Node::Add(a, b) => Some(Node::Add(b, a)),
            Node::Multiply(a, b) => Some(Node::Multiply(b, a)),
            _ => None,
        };
        if let Some(id) = swapped.and_then(|node| self.ids.get(&node)) {
            return *id;
        }
        let next = ExprId(u32::try_from(self.nodes.len()).expect("fewer than 2^32 expressions"));
        *self.ids.entry(node).or_insert_with(|| {
            self.nodes.push(node);
            next
        })
    }

    /// A call without simplification; an expansion is expanded.
    pub fn intern_call(&mut self, function: IntrinsicId, arguments: &[ExprId]) -> ExprId {
        match (&function.get().definition, arguments) {
            (IntrinsicDefinition::One { .. }, &[x]) => self.intern(Node::Call1(function, x)),
            (IntrinsicDefinition::Two { .. }, &[x, y]) => self.intern(Node::Call2(function, x, y)),
            (IntrinsicDefinition::Expansion(arity, expand), of) if of.len() == *arity => {
                expand(self, of)
            }
            _ => unreachable!("the resolver checks the number of arguments"),
        }
    }

    /// A number.
    pub fn constant(&mut self, value: f64) -> ExprId {
        self.intern(Node::Constant(value.to_bits()))
    }

    /// A symbol.
    pub fn symbol(&mut self, symbol: Symbol) -> ExprId {
        self.intern(Node::Symbol(symbol))
    }

    /// The number, if the expression is one.
    pub fn value(&self, id: ExprId) -> Option<f64> {
        match self.node(id) {
            Node::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    /// All subexpressions of the roots, including these, operands first.
    ///
    /// The time is proportional to the number of results, up to sorting.
    pub fn reachable(&self, roots: impl IntoIterator<Item = ExprId>) -> Vec<ExprId> {
        let mut visited = HashSet::default();
        let mut pending: Vec<ExprId> = roots.into_iter().collect();
        let mut reachable = Vec::new();
        while let Some(id) = pending.pop() {
            if visited.insert(id) {
                reachable.push(id);
                pending.extend(self.node(id).operands());
            }
        }
        reachable.sort_unstable();
        reachable
    }

    /// The symbols in an expression, ascending.
    pub fn symbols(&self, root: ExprId) -> Vec<Symbol> {
        match self.node(root) {
            Node::Symbol(symbol) => return vec![symbol],
            Node::Constant(_) => return Vec::new(),
            _ => {}
        }
        let mut symbols: Vec<Symbol> = self
            .reachable([root])
            .into_iter()
            .filter_map(|id| match self.node(id) {
                Node::Symbol(symbol) => Some(symbol),
                _ => None,
            })
            .collect();
        symbols.sort_unstable();
        symbols
    }

    /// The value of an expression, given the values of its symbols.
    pub fn evaluate(&self, root: ExprId, symbol: &dyn Fn(Symbol) -> f64) -> f64 {
        let order = self.reachable([root]);
        let mut values: HashMap<ExprId, f64> =
            HashMap::with_capacity_and_hasher(order.len(), <_>::default());
        for id in order {
            let node = self.node(id);
            let value = match node {
                Node::Symbol(s) => symbol(s),
                _ => apply(node, |operand| values[&operand]),
            };
            values.insert(id, value);
        }
        values[&root]
    }
}

/// The value of a node other than a symbol; conditions are 1 or 0.
pub fn apply(node: Node, value: impl Fn(ExprId) -> f64) -> f64 {
    let truth = |condition: bool| f64::from(u8::from(condition));
    match node {
        Node::Constant(bits) => f64::from_bits(bits),
        Node::Symbol(symbol) => unreachable!("{symbol:?} has no value of its own"),
        Node::Negate(a) => -value(a),
        Node::Add(a, b) => value(a) + value(b),
        Node::Subtract(a, b) => value(a) - value(b),
        Node::Multiply(a, b) => value(a) * value(b),
        Node::Divide(a, b) => value(a) / value(b),
        Node::Call1(f, a) => f.value1(value(a)),
        Node::Call2(f, a, b) => f.value2(value(a), value(b)),
        Node::Curve(curve, a) => curve.value(value(a)),
        Node::Compare(comparison, a, b) => truth(comparison.holds(value(a), value(b))),
        Node::And(a, b) => truth(value(a) != 0.0 && value(b) != 0.0),
        Node::Or(a, b) => truth(value(a) != 0.0 || value(b) != 0.0),
        Node::Not(a) => truth(value(a) == 0.0),
        Node::Select(c, a, b) => {
            if value(c) == 0.0 {
                value(b)
            } else {
                value(a)
            }
        }
        // An expression that can be evaluated here is constant in time.
        Node::Delay(a, _) => value(a),
    }
}

impl Comparison {
    /// Whether the comparison of two numbers is true.
    #[inline]
    pub fn holds(self, a: f64, b: f64) -> bool {
        match self {
            Comparison::Less => a < b,
            Comparison::LessEqual => a <= b,
            Comparison::Greater => a > b,
            Comparison::GreaterEqual => a >= b,
        }
    }
}
