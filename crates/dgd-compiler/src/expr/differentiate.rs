//! Symbolic derivatives, by reverse accumulation over the part of the graph a root is made of.
//!
//! The adjoint of an expression e is ∂root/∂e. Going from the root to its operands, an operand o of e gains adjoint(e)
//! · ∂e/∂o. One sweep gives the derivatives to all symbols; its cost and the number of nodes that it adds are
//! proportional to the size of the root.

use super::graph::{ExprGraph, ExprId, Node, Symbol};
use super::intrinsics::IntrinsicDefinition;
use crate::expr::hash::HashMap;

impl ExprGraph {
    /// The nonzero ∂root/∂symbol for every symbol that `wanted` gives a position: (position, derivative), positions
    /// ascending.
    pub fn gradient(
        &mut self,
        root: ExprId,
        wanted: impl Fn(Symbol) -> Option<usize>,
    ) -> Vec<(usize, ExprId)> {
        let order = self.reachable([root]);

        // Only expressions that depend on a wanted symbol get an adjoint.
        let mut depends: HashMap<ExprId, bool> =
            HashMap::with_capacity_and_hasher(order.len(), <_>::default());
        for &id in &order {
            let node = self.node(id);
            let does = match node {
                Node::Symbol(symbol) => wanted(symbol).is_some(),
                _ => node.operands().any(|operand| depends[&operand]),
            };
            depends.insert(id, does);
        }

        let one = self.constant(1.0);
        let mut adjoints: HashMap<ExprId, ExprId> = [(root, one)].into_iter().collect();
        let mut derivatives = Vec::new();
        for &id in order.iter().rev() {
            if !depends[&id] {
                continue;
            }
            let Some(adjoint) = adjoints.remove(&id) else { continue };
            if let Node::Symbol(symbol) = self.node(id)
                && let Some(position) = wanted(symbol)
            {
                if self.value(adjoint) != Some(0.0) {
                    derivatives.push((position, adjoint));
                }
                continue;
            }
            for (operand, part) in self.partials(id, adjoint, &|operand| depends[&operand]) {
                let sum = match adjoints.get(&operand) {
                    Some(&earlier) => self.add(earlier, part),
                    None => part,
                };
                adjoints.insert(operand, sum);
            }
        }
        derivatives.sort_unstable_by_key(|(position, _)| *position);
        derivatives
    }

    /// The contributions of an expression with this adjoint to the adjoints of its operands.
    fn partials(
        &mut self,
        id: ExprId,
        adjoint: ExprId,
        depends: &dyn Fn(ExprId) -> bool,
    ) -> Vec<(ExprId, ExprId)> {
        let mut parts = Vec::with_capacity(2);
        match self.node(id) {
            // Conditions are constant between switches.
            Node::Constant(_)
            | Node::Symbol(_)
            | Node::Compare(..)
            | Node::And(..)
            | Node::Or(..)
            | Node::Not(_) => {}
            Node::Negate(a) => {
                let part = self.in_its_branch(adjoint, ExprGraph::negate);
                parts.push((a, part));
            }
            Node::Add(a, b) => parts.extend([(a, adjoint), (b, adjoint)]),
            Node::Subtract(a, b) => {
                parts.push((a, adjoint));
                if depends(b) {
                    let part = self.in_its_branch(adjoint, ExprGraph::negate);
                    parts.push((b, part));
                }
            }
            // d(x |x|)/dx = 2 |x|
            Node::Multiply(x, abs) | Node::Multiply(abs, x) if self.is_call_of("abs", abs, x) => {
                let two = self.constant(2.0);
                let slope = self.multiply(two, abs);
                parts.push((x, self.chained(adjoint, slope)));
            }
            Node::Multiply(a, b) => {
                if depends(a) {
                    parts.push((a, self.chained(adjoint, b)));
                }
                if depends(b) {
                    parts.push((b, self.chained(adjoint, a)));
                }
            }
            // ∂(a/b)/∂a = 1/b, ∂(a/b)/∂b = −(a/b)/b
            Node::Divide(a, b) => {
                let over_b = self.in_its_branch(adjoint, |g, adjoint| g.divide(adjoint, b));
                if depends(a) {
                    parts.push((a, over_b));
                }
                if depends(b) {
                    let part = self.in_its_branch(over_b, |g, over_b| {
                        let part = g.multiply(over_b, id);
                        g.negate(part)
                    });
                    parts.push((b, part));
                }
            }
            Node::Call1(function, a) => {
                if let IntrinsicDefinition::One { derivative, .. } = &function.get().definition {
                    let slope = derivative(self, a);
                    parts.push((a, self.chained(adjoint, slope)));
                }
            }
            Node::Call2(function, a, b) => {
                if let IntrinsicDefinition::Two { derivative, .. } = &function.get().definition {
                    let slopes = derivative(self, a, b);
                    for (operand, slope) in [a, b].into_iter().zip(slopes) {
                        if depends(operand) {
                            parts.push((operand, self.chained(adjoint, slope)));
                        }
                    }
                }
            }
            Node::Curve(curve, a) => {
                let slope = self.slope_of_curve(curve, a);
                parts.push((a, self.chained(adjoint, slope)));
            }
            Node::Delay(..) => unreachable!("delays are resolved before derivatives are taken"),
            Node::Select(condition, a, b) => {
                let zero = self.constant(0.0);
                if depends(a) {
                    parts.push((a, self.select(condition, adjoint, zero)));
                }
                if depends(b) {
                    parts.push((b, self.select(condition, zero, adjoint)));
                }
            }
        }
        parts.retain(|(operand, _)| depends(*operand));
        parts
    }

    /// An operand's contribution: the adjoint times the slope.
    fn chained(&mut self, adjoint: ExprId, slope: ExprId) -> ExprId {
        self.in_its_branch(adjoint, |g, adjoint| g.multiply(adjoint, slope))
    }

    /// The result of `act` on an adjoint, or zero if the adjoint is zero because its branch was not chosen: there
    /// slopes may be NaN, and zero times an infinite one is not zero.
    fn in_its_branch(
        &mut self,
        adjoint: ExprId,
        act: impl FnOnce(&mut ExprGraph, ExprId) -> ExprId,
    ) -> ExprId {
        let mut choices = Vec::new();
        let mut inner = adjoint;
        while let Node::Select(condition, a, b) = self.node(inner) {
            if self.value(b) == Some(0.0) {
                choices.push((condition, true));
                inner = a;
            } else if self.value(a) == Some(0.0) {
                choices.push((condition, false));
                inner = b;
            } else {
                break;
            }
        }
        let mut part = act(self, inner);
        for (condition, if_true) in choices.into_iter().rev() {
            let zero = self.constant(0.0);
            let (a, b) = if if_true { (part, zero) } else { (zero, part) };
            part = self.select(condition, a, b);
        }
        part
    }
}
