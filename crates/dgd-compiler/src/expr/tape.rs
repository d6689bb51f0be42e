//! Evaluates expressions at many points; their operands are found once.

use super::graph::{ExprGraph, ExprId, Node, Symbol, apply};

/// Some expressions with all their subexpressions, operands first.
#[derive(Debug, Clone)]
pub struct Tape<const N: usize> {
    ids: Vec<ExprId>,
    /// Operands are positions on the tape.
    steps: Vec<Node>,
    roots: [usize; N],
}

impl<const N: usize> Tape<N> {
    /// The tape of these expressions.
    pub fn from_roots(graph: &ExprGraph, roots: [ExprId; N]) -> Self {
        let ids = graph.reachable(roots);
        let position = |id: ExprId| {
            ids.binary_search(&id).unwrap_or_else(|_| unreachable!("operands are reachable"))
        };
        let step =
            |id: &ExprId| graph.node(*id).map(|operand| ExprId::from_position(position(operand)));
        let steps = ids.iter().map(step).collect();
        let roots = roots.map(position);
        Self { ids, steps, roots }
    }

    /// The symbols on it, ascending.
    pub fn symbols(&self) -> Vec<Symbol> {
        let symbol = |step: &Node| match step {
            Node::Symbol(symbol) => Some(*symbol),
            _ => None,
        };
        let mut symbols: Vec<Symbol> = self.steps.iter().filter_map(symbol).collect();
        symbols.sort_unstable();
        symbols
    }

    /// The values of the roots. `values` receives those of all expressions, by position.
    pub fn evaluate(&self, symbol: impl Fn(Symbol) -> f64, values: &mut Vec<f64>) -> [f64; N] {
        values.clear();
        for step in &self.steps {
            let value = match *step {
                Node::Symbol(s) => symbol(s),
                node => apply(node, |operand| values[operand.index()]),
            };
            values.push(value);
        }
        self.roots.map(|root| values[root])
    }

    /// The positions of a symbol and of all expressions that depend on it.
    pub fn readers(&self, symbol: Symbol) -> Vec<usize> {
        let mut reads = Vec::with_capacity(self.steps.len());
        for step in &self.steps {
            let is_symbol = *step == Node::Symbol(symbol);
            reads.push(is_symbol || step.operands().any(|operand| reads[operand.index()]));
        }
        (0..reads.len()).filter(|at| reads[*at]).collect()
    }

    /// The values of the roots after changes at these positions only.
    pub fn evaluate_again(
        &self,
        positions: &[usize],
        symbol: impl Fn(Symbol) -> f64,
        values: &mut [f64],
    ) -> [f64; N] {
        for &at in positions {
            values[at] = match self.steps[at] {
                Node::Symbol(s) => symbol(s),
                node => apply(node, |operand| values[operand.index()]),
            };
        }
        self.roots.map(|root| values[root])
    }

    /// The position of an expression on the tape.
    pub fn position(&self, id: ExprId) -> Option<usize> {
        self.ids.binary_search(&id).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tape_has_the_values_of_its_graph() {
        let mut graph = ExprGraph::default();
        let (x, y) = (graph.symbol(Symbol::Unknown(0)), graph.symbol(Symbol::Unknown(1)));
        let product = graph.multiply(x, y);
        let root = graph.call1("exp", product);
        let unused = graph.add(root, x);
        let other = graph.subtract(product, y);
        let tape = Tape::from_roots(&graph, [root, other]);
        assert_eq!(tape.symbols(), [Symbol::Unknown(0), Symbol::Unknown(1)]);
        assert_eq!(tape.position(unused), None);
        let value = |symbol| if symbol == Symbol::Unknown(0) { 0.5 } else { -3.0 };
        let mut all = Vec::new();
        assert_eq!(tape.evaluate(value, &mut all), [(-1.5_f64).exp(), 1.5]);
        assert_eq!(tape.position(product).map(|at| all[at]), Some(-1.5));
        for root in [root, other] {
            let again = tape.position(root).map(|at| all[at]);
            assert_eq!(again, Some(graph.evaluate(root, &value)));
        }
        // Another x; its readers are all but y.
        let other_value = |symbol| if symbol == Symbol::Unknown(0) { 2.0 } else { -3.0 };
        let moving = tape.readers(Symbol::Unknown(0));
        assert_eq!(moving.len(), all.len() - 1);
        let again = tape.evaluate_again(&moving, other_value, &mut all);
        assert_eq!(again, [root, other].map(|root| graph.evaluate(root, &other_value)));
    }
}
