//! The sign with which a balance counts added terms.

use dgd_compiler::expr::{ExprId, Node, Symbol};
use dgd_compiler::model::Model;

/// How a term added to the right-hand side of an equation affects the state, if the derivative of one of `states`
/// occurs in it once: 1 if it flows into the state, −1 if out of it. Symbolic coefficients count as positive, like
/// masses and volumes. `None` if no such derivative occurs, or if it is inside a function.
pub(crate) fn direction(
    model: &Model,
    equation: &str,
    is_state: impl Fn(usize) -> bool,
) -> Option<f64> {
    let equation = model.equations.iter().find(|known| known.label == equation)?;
    let sign = |side: ExprId| sign(model, side, &is_state);
    match (sign(equation.left), sign(equation.right)) {
        (Some(sign), None) => Some(sign),
        (None, Some(sign)) => Some(-sign),
        _ => None,
    }
}

fn sign(model: &Model, of: ExprId, is_state: &impl Fn(usize) -> bool) -> Option<f64> {
    let sign = |of: ExprId| sign(model, of, is_state);
    let of_number = |other: ExprId| factor(model, other);
    match model.graph.node(of) {
        Node::Symbol(Symbol::Derivative(state)) => is_state(state as usize).then_some(1.0),
        Node::Negate(a) => Some(-sign(a)?),
        Node::Add(a, b) => one(sign(a), sign(b)),
        Node::Subtract(a, b) => one(sign(a), sign(b).map(|sign| -sign)),
        Node::Multiply(a, b) => {
            one(sign(a).map(|sign| sign * of_number(b)), sign(b).map(|sign| sign * of_number(a)))
        }
        Node::Divide(a, b) => Some(sign(a)? * of_number(b)),
        _ => None,
    }
}

/// The sign of a coefficient, as far as it is known.
fn factor(model: &Model, of: ExprId) -> f64 {
    match model.graph.node(of) {
        Node::Constant(bits) => f64::from_bits(bits).signum(),
        Node::Negate(a) => -factor(model, a),
        Node::Multiply(a, b) | Node::Divide(a, b) => factor(model, a) * factor(model, b),
        _ => 1.0,
    }
}

/// The only value of two; `None` for none or both.
fn one(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    match (a, b) {
        (Some(sign), None) | (None, Some(sign)) => Some(sign),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use dgd_compiler::diagnostics::Diagnostics;
    use dgd_compiler::model::{ModelOptions, resolve};
    use dgd_compiler::source::{SourceMap, SourceText};
    use dgd_compiler::syntax::parse;

    use super::*;

    #[test]
    fn what_is_added_comes_into_a_state_on_the_left_and_leaves_one_on_the_right() {
        let of = |equation: &str| {
            let text = format!(
                "model tank\nparameter A [m^2] = 2\ninput q [m^3/s]\nstate h [m] = 1\nstate g [m] = 1\n\
                 equation level: {equation}\nequation other: der(g) = h/(1 [s])\n"
            );
            let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
            let id = sources.add(SourceText { name: "test.dgd".to_owned(), text });
            let ast = parse(id, &sources, &mut diagnostics).expect("it can be read");
            let options = ModelOptions::default();
            let model = resolve(&[ast], &options, &mut diagnostics).expect("a model");
            let h = model.unknowns.iter().position(|unknown| unknown.declared.name == "h");
            direction(&model, "level", |state| Some(state) == h)
        };
        for (equation, expected) in [
            ("A*der(h) = q", Some(1.0)),
            ("q = A*der(h)", Some(-1.0)),
            ("-A*der(h) = q", Some(-1.0)),
            ("0 [m^3/s] = q - A*der(h)", Some(1.0)),
            ("q - A*der(h)/2 = 0 [m^3/s]", Some(-1.0)),
            ("abs(A*der(h)) = q", None),
        ] {
            assert_eq!(of(equation), expected, "{equation}");
        }
    }
}
