//! Constructors that simplify as they build, for `assemble` and the differentiator.
//!
//! The rules fold numbers, drop neutral elements, move signs outwards and recognise a handful of identities of real
//! functions. They may change the last bit of a result compared with the source; every back end runs the simplified
//! form, so all agree.

use super::curve::CurveId;
use super::graph::{Comparison, ExprGraph, ExprId, Node, Symbol, apply};
use super::intrinsics::{IntrinsicDefinition, IntrinsicId};
use crate::expr::hash::HashMap;

/// Integer powers up to this are products.
const LARGEST_PRODUCT: f64 = 16.0;

impl ExprGraph {
    fn fold(&mut self, node: Node) -> ExprId {
        if node.operands().all(|operand| self.value(operand).is_some()) {
            let value = apply(node, |id| self.value(id).unwrap_or(f64::NAN));
            return self.constant(value);
        }
        self.intern(node)
    }

    fn is(&self, id: ExprId, value: f64) -> bool {
        self.value(id) == Some(value)
    }

    /// −a
    pub fn negate(&mut self, a: ExprId) -> ExprId {
        match self.node(a) {
            Node::Negate(inner) => inner,
            // −(a − b) = b − a
            Node::Subtract(x, y) => self.subtract(y, x),
            // −(c x) = (−c) x
            Node::Multiply(x, y) if self.value(x).is_some() => {
                let minus = self.negate(x);
                self.multiply(minus, y)
            }
            _ => self.fold(Node::Negate(a)),
        }
    }

    /// a + b
    pub fn add(&mut self, a: ExprId, b: ExprId) -> ExprId {
        if self.is(a, 0.0) {
            return b;
        }
        if self.is(b, 0.0) {
            return a;
        }
        if a == b {
            let two = self.constant(2.0);
            return self.multiply(two, a);
        }
        match (self.node(a), self.node(b)) {
            (_, Node::Negate(b)) => self.subtract(a, b),
            (Node::Negate(a), _) => self.subtract(b, a),
            _ => self.fold(Node::Add(a, b)),
        }
    }

    /// a − b
    pub fn subtract(&mut self, a: ExprId, b: ExprId) -> ExprId {
        if self.is(b, 0.0) {
            return a;
        }
        if self.is(a, 0.0) {
            return self.negate(b);
        }
        if a == b {
            return self.constant(0.0);
        }
        match self.node(b) {
            Node::Negate(b) => self.add(a, b),
            _ => self.fold(Node::Subtract(a, b)),
        }
    }

    /// a b, with numbers in front.
    pub fn multiply(&mut self, a: ExprId, b: ExprId) -> ExprId {
        let (a, b) = match self.value(b) {
            Some(_) => (b, a),
            None => (a, b),
        };
        if let Some(c) = self.value(a) {
            if c == 0.0 {
                return self.constant(0.0);
            }
            if c == 1.0 {
                return b;
            }
            if c == -1.0 {
                return self.negate(b);
            }
        }
        match (self.node(a), self.node(b)) {
            (Node::Negate(a), Node::Negate(b)) => self.multiply(a, b),
            (Node::Negate(x), _) => {
                let product = self.multiply(x, b);
                self.negate(product)
            }
            (_, Node::Negate(y)) => {
                let product = self.multiply(a, y);
                self.negate(product)
            }
            // c (d x) = (c d) x
            (Node::Constant(_), Node::Multiply(x, y)) if self.value(x).is_some() => {
                let factor = self.multiply(a, x);
                self.multiply(factor, y)
            }
            // c (d / x) = (c d) / x
            (Node::Constant(_), Node::Divide(x, y)) if self.value(x).is_some() => {
                let numerator = self.multiply(a, x);
                self.divide(numerator, y)
            }
            // x sign(x) = |x|
            _ if self.is_call_of("sign", a, b) => self.call1("abs", b),
            _ if self.is_call_of("sign", b, a) => self.call1("abs", a),
            // (c x) |x| = c (x |x|): the signed square is one expression wherever it occurs. If c is |x| itself, it is
            // already in that form.
            (Node::Multiply(c, x), _) if c != b && self.is_call_of("abs", b, x) => {
                let square = self.multiply(x, b);
                self.multiply(c, square)
            }
            (_, Node::Multiply(c, x)) if c != a && self.is_call_of("abs", a, x) => {
                let square = self.multiply(x, a);
                self.multiply(c, square)
            }
            _ => self.fold(Node::Multiply(a, b)),
        }
    }

    /// Whether f is this function of x.
    pub(super) fn is_call_of(&self, name: &str, f: ExprId, x: ExprId) -> bool {
        matches!(self.node(f), Node::Call1(id, y) if y == x && id.get().name == name)
    }

    /// a / b; by a number it is a product with its reciprocal.
    pub fn divide(&mut self, a: ExprId, b: ExprId) -> ExprId {
        if self.is(a, 0.0) && !self.is(b, 0.0) {
            return a;
        }
        if let Some(c) = self.value(b)
            && (1.0 / c).is_normal()
        {
            if let Some(a) = self.value(a) {
                return self.constant(a / c);
            }
            let reciprocal = self.constant(1.0 / c);
            return self.multiply(reciprocal, a);
        }
        if a == b {
            return self.constant(1.0);
        }
        match (self.node(a), self.node(b)) {
            (Node::Negate(a), Node::Negate(b)) => self.divide(a, b),
            (Node::Negate(a), _) => {
                let quotient = self.divide(a, b);
                self.negate(quotient)
            }
            (_, Node::Negate(b)) => {
                let quotient = self.divide(a, b);
                self.negate(quotient)
            }
            // (c x) / b = c (x / b) would cost no less; x b / b = x
            (Node::Multiply(x, y), _) if y == b => x,
            (Node::Multiply(x, y), _) if x == b => y,
            _ => self.fold(Node::Divide(a, b)),
        }
    }

    /// f(arguments)
    pub fn call(&mut self, function: IntrinsicId, arguments: &[ExprId]) -> ExprId {
        let name = function.get().name;
        match (&function.get().definition, arguments) {
            (IntrinsicDefinition::One { .. }, &[x]) => match self.node(x) {
                // abs(−x) = abs(x), abs(abs(x)) = abs(x)
                Node::Negate(inner) if name == "abs" => self.call(function, &[inner]),
                Node::Call1(f, _) if name == "abs" && f == function => x,
                // Already a whole number.
                Node::Call1(f, _) if name == "floor" && f == function => x,
                _ => self.fold(Node::Call1(function, x)),
            },
            (IntrinsicDefinition::Two { .. }, &[x, y]) if name == "^" => {
                self.power_of(function, x, y)
            }
            // hypot(x, 0) = |x|, which has a corner.
            (IntrinsicDefinition::Two { .. }, &[x, y]) if name == "hypot" && self.is(y, 0.0) => {
                self.call1("abs", x)
            }
            (IntrinsicDefinition::Two { .. }, &[x, y]) if name == "hypot" && self.is(x, 0.0) => {
                self.call1("abs", y)
            }
            (IntrinsicDefinition::Two { .. }, &[x, y]) => self.fold(Node::Call2(function, x, y)),
            (IntrinsicDefinition::Expansion(arity, expand), of) if of.len() == *arity => {
                expand(self, of)
            }
            _ => unreachable!("the resolver checks the number of arguments"),
        }
    }

    /// A simplified call, by the name in the table.
    pub(crate) fn call1(&mut self, name: &str, x: ExprId) -> ExprId {
        self.call(IntrinsicId::named(name), &[x])
    }

    /// x^y, simplified.
    pub fn power(&mut self, x: ExprId, y: ExprId) -> ExprId {
        self.call(IntrinsicId::named("^"), &[x, y])
    }

    /// The derivative of a curve at x.
    pub(crate) fn slope_of_curve(&mut self, curve: CurveId, x: ExprId) -> ExprId {
        match curve.derivative() {
            Some(slope) => self.fold(Node::Curve(slope, x)),
            None => self.constant(0.0),
        }
    }

    /// x^y: products for small integers, a root for a half, and reciprocals of these for negative exponents.
    fn power_of(&mut self, function: IntrinsicId, x: ExprId, y: ExprId) -> ExprId {
        let Some(exponent) = self.value(y) else {
            return self.fold(Node::Call2(function, x, y));
        };
        if self.value(x).is_some() {
            return self.fold(Node::Call2(function, x, y));
        }
        let size = exponent.abs();
        let power = if size == 0.0 {
            return self.constant(1.0);
        } else if size <= LARGEST_PRODUCT && size.fract() == 0.0 {
            self.integer_power(x, size as u32)
        } else if size <= LARGEST_PRODUCT && size.fract() == 0.5 {
            let root = self.call1("sqrt", x);
            let whole = self.integer_power(x, size as u32);
            self.multiply(whole, root)
        } else {
            return self.fold(Node::Call2(function, x, y));
        };
        if exponent > 0.0 {
            return power;
        }
        let one = self.constant(1.0);
        self.divide(one, power)
    }

    /// x^n by repeated squaring.
    fn integer_power(&mut self, x: ExprId, n: u32) -> ExprId {
        match n {
            0 => self.constant(1.0),
            1 => x,
            _ => {
                let half = self.integer_power(x, n / 2);
                let square = self.multiply(half, half);
                if n.is_multiple_of(2) { square } else { self.multiply(square, x) }
            }
        }
    }

    /// a condition on two numbers
    pub fn compare(&mut self, comparison: Comparison, a: ExprId, b: ExprId) -> ExprId {
        self.fold(Node::Compare(comparison, a, b))
    }

    /// Both conditions: a constant one decides, or leaves it to the other.
    pub fn both(&mut self, a: ExprId, b: ExprId) -> ExprId {
        match (self.value(a), self.value(b)) {
            (Some(0.0), _) | (_, Some(0.0)) => self.constant(0.0),
            (Some(_), _) => b,
            (_, Some(_)) => a,
            _ => self.intern(Node::And(a, b)),
        }
    }

    /// Either condition.
    pub fn either(&mut self, a: ExprId, b: ExprId) -> ExprId {
        match (self.value(a), self.value(b)) {
            (Some(0.0), _) => b,
            (_, Some(0.0)) => a,
            (Some(_), _) | (_, Some(_)) => self.constant(1.0),
            _ => self.intern(Node::Or(a, b)),
        }
    }

    /// a if the condition holds, otherwise b
    pub fn select(&mut self, condition: ExprId, a: ExprId, b: ExprId) -> ExprId {
        match self.value(condition) {
            Some(truth) if truth != 0.0 => a,
            Some(_) => b,
            None if a == b => a,
            None => self.intern(Node::Select(condition, a, b)),
        }
    }

    /// x delayed by `tau`
    pub fn delay(&mut self, x: ExprId, tau: ExprId) -> ExprId {
        if self.is(tau, 0.0) || self.value(x).is_some() {
            return x;
        }
        self.intern(Node::Delay(x, tau))
    }

    /// The simplified expression of this node, whose operands are already simplified.
    pub fn simplified(&mut self, node: Node) -> ExprId {
        match node {
            Node::Constant(_) | Node::Symbol(_) => self.intern(node),
            Node::Negate(a) => self.negate(a),
            Node::Add(a, b) => self.add(a, b),
            Node::Subtract(a, b) => self.subtract(a, b),
            Node::Multiply(a, b) => self.multiply(a, b),
            Node::Divide(a, b) => self.divide(a, b),
            Node::Call1(f, a) => self.call(f, &[a]),
            Node::Call2(f, a, b) => self.call(f, &[a, b]),
            Node::And(a, b) => self.both(a, b),
            Node::Or(a, b) => self.either(a, b),
            Node::Compare(..) | Node::Not(_) | Node::Curve(..) => self.fold(node),
            Node::Select(c, a, b) => self.select(c, a, b),
            Node::Delay(x, tau) => self.delay(x, tau),
        }
    }
}

impl ExprGraph {
    /// The roots with their symbols replaced, simplified on the way.
    ///
    /// `nodes` are the nodes of the roots, operands first, perhaps of another graph; `leaf` gives the replacement of a
    /// symbol.
    pub fn rebuild(
        &mut self,
        nodes: &[(ExprId, Node)],
        mut leaf: impl FnMut(&mut ExprGraph, Symbol) -> ExprId,
    ) -> HashMap<ExprId, ExprId> {
        let mut built: HashMap<ExprId, ExprId> =
            HashMap::with_capacity_and_hasher(nodes.len(), <_>::default());
        for &(id, node) in nodes {
            let here = match node {
                Node::Symbol(symbol) => leaf(self, symbol),
                _ => self.simplified(node.map(|operand| built[&operand])),
            };
            built.insert(id, here);
        }
        built
    }

    /// An expression with some of its symbols replaced.
    pub fn substitute(
        &mut self,
        root: ExprId,
        replacement: impl Fn(Symbol) -> Option<ExprId>,
    ) -> ExprId {
        let nodes = self.listed([root]);
        let touched = |(_, node): &(ExprId, Node)| matches!(node, Node::Symbol(symbol) if replacement(*symbol).is_some());
        if !nodes.iter().any(touched) {
            return root;
        }
        let built = self.rebuild(&nodes, |graph, symbol| {
            replacement(symbol).unwrap_or_else(|| graph.symbol(symbol))
        });
        built[&root]
    }

    /// The roots with some expressions in them replaced, simplified on the way.
    pub fn replace(
        &mut self,
        roots: impl IntoIterator<Item = ExprId>,
        replacement: &HashMap<ExprId, ExprId>,
    ) -> HashMap<ExprId, ExprId> {
        let mut built: HashMap<ExprId, ExprId> = HashMap::default();
        for (id, node) in self.listed(roots) {
            let here = match replacement.get(&id) {
                Some(other) => *other,
                None => self.simplified(node.map(|operand| built[&operand])),
            };
            built.insert(id, here);
        }
        built
    }

    /// The subexpressions of the roots, operands first, with their nodes.
    pub fn listed(&self, roots: impl IntoIterator<Item = ExprId>) -> Vec<(ExprId, Node)> {
        self.reachable(roots).into_iter().map(|id| (id, self.node(id))).collect()
    }
}

impl Node {
    /// The same operation on other operands.
    #[must_use]
    pub fn map(self, mut f: impl FnMut(ExprId) -> ExprId) -> Node {
        match self {
            Node::Constant(_) | Node::Symbol(_) => self,
            Node::Negate(a) => Node::Negate(f(a)),
            Node::Add(a, b) => Node::Add(f(a), f(b)),
            Node::Subtract(a, b) => Node::Subtract(f(a), f(b)),
            Node::Multiply(a, b) => Node::Multiply(f(a), f(b)),
            Node::Divide(a, b) => Node::Divide(f(a), f(b)),
            Node::Call1(i, a) => Node::Call1(i, f(a)),
            Node::Call2(i, a, b) => Node::Call2(i, f(a), f(b)),
            Node::Curve(curve, a) => Node::Curve(curve, f(a)),
            Node::Compare(c, a, b) => Node::Compare(c, f(a), f(b)),
            Node::And(a, b) => Node::And(f(a), f(b)),
            Node::Or(a, b) => Node::Or(f(a), f(b)),
            Node::Not(a) => Node::Not(f(a)),
            Node::Select(c, a, b) => Node::Select(f(c), f(a), f(b)),
            Node::Delay(x, tau) => Node::Delay(f(x), f(tau)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn graph() -> (ExprGraph, ExprId, ExprId) {
        let mut g = ExprGraph::default();
        let (x, y) = (g.symbol(Symbol::Unknown(0)), g.symbol(Symbol::Unknown(1)));
        (g, x, y)
    }

    #[test]
    fn equal_expressions_are_one() {
        let (mut g, x, y) = graph();
        assert_eq!(g.add(x, y), g.add(y, x));
        let (one, two) = (g.multiply(x, y), g.multiply(y, x));
        assert_eq!(g.subtract(one, two), g.constant(0.0));
    }

    #[test]
    fn the_slope_of_x_abs_x_is_two_abs_x() {
        let (mut g, x, _) = graph();
        let abs = g.call1("abs", x);
        let product = g.multiply(x, abs);
        let gradient = g.gradient(product, |s| (s == Symbol::Unknown(0)).then_some(0));
        let two = g.constant(2.0);
        assert_eq!(gradient, vec![(0, g.multiply(two, abs))]);
    }

    #[test]
    fn a_number_times_its_size_twice_is_one_expression() {
        let (mut g, x, y) = graph();
        let abs = g.call1("abs", x);
        for factors in [[abs, x, abs], [x, abs, abs], [abs, abs, x], [y, x, abs]] {
            let [a, b, c] = factors;
            let (left, right) = (g.multiply(a, b), g.multiply(b, c));
            for product in [g.multiply(left, c), g.multiply(a, right)] {
                let value = g.evaluate(product, &|_| -2.0);
                assert_eq!(value, if factors[0] == y { 8.0 } else { -8.0 });
            }
        }
    }

    #[test]
    fn powers_with_small_exponents_need_no_pow() {
        let (mut g, x, _) = graph();
        for (exponent, value) in [(3.0, 8.0), (-2.0, 0.25), (0.5, 2f64.sqrt()), (2.5, 32f64.sqrt())]
        {
            let e = g.constant(exponent);
            let power = g.power(x, e);
            let pow_calls = g
                .reachable([power])
                .iter()
                .filter(|id| matches!(g.node(**id), Node::Call2(..)))
                .count();
            assert_eq!(pow_calls, 0);
            let found = g.evaluate(power, &|_| 2.0);
            // At most three roundings.
            assert!((found - value).abs() <= 3.0 * f64::EPSILON * value);
        }
    }

    #[test]
    fn signs_move_out_without_end() {
        let (mut g, x, y) = graph();
        let product = g.multiply(x, y);
        let minus = g.negate(product);
        assert_eq!(g.negate(minus), product);
        let minus_one = g.constant(-1.0);
        assert_eq!(g.multiply(minus_one, product), minus);
    }
}
