//! Equations that hold by definition.

use dgd_compiler::expr::{Node, Symbol};
use dgd_compiler::model::Model;

/// Whether an equation defines one unknown as the derivative of another, `der(h) = v`, without a factor.
pub(super) fn is_kinematic(model: &Model, label: &str) -> bool {
    let mut equations = model.all_equations().filter(|equation| equation.label == label);
    equations.any(|equation| {
        let sides = [equation.left, equation.right].map(|side| model.graph.node(side));
        matches!(
            sides,
            [Node::Symbol(Symbol::Derivative(_)), Node::Symbol(Symbol::Unknown(_))]
                | [Node::Symbol(Symbol::Unknown(_)), Node::Symbol(Symbol::Derivative(_))]
        )
    })
}
