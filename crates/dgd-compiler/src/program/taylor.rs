//! Taylor series of solutions: recurrences for the coefficients of each order from the previous ones.
//!
//! Along a solution that begins at (t₀, y₀), with τ = (t − t₀)/h,
//!
//! ```text
//!   y(t₀ + τh) = Σₖ yₖ τᵏ,   y₍ₖ₊₁₎ = h fₖ/(k + 1)
//!   S(t₀ + τh) = Σₖ Sₖ τᵏ,   S₍ₖ₊₁₎ = h gₖ/(k + 1),   gₖ = Σₘ (∂f/∂y)ₘ S₍ₖ₋ₘ₎ + (∂f/∂θ)ₖ
//! ```
//!
//! Every expression of f has a series of its own. The coefficient of order 0 is its value; for higher orders there is a
//! [`Recurrence`] for each operation. Expressions of parameters, held inputs, slopes and discrete numbers are constant:
//! their only coefficient is their value, and a product with them is a scaling. Nested sums and scalings become one sum
//! of terms, whose factors are computed at the beginning. Conditions are evaluated at the beginning.
//!
//! A function φ of the language is its own recurrence by its derivative, v = φ(x) and d = φ'(x):
//!
//! ```text
//!   v̇ = d ẋ   ⇒   vₖ = (1/k) Σⱼ j xⱼ d₍ₖ₋ⱼ₎,   j = 1 … k
//! ```
//!
//! which reads d only up to order k − 1, so d may depend on v. [`OWN`] has shorter recurrences.
//!
//! # Source
//!
//! Griewank and Walther, Evaluating Derivatives, 2nd ed. (2008), ch. 13; Jorba and Zou, Experimental
//! Mathematics 14 (2005) 99–117, §2.

use std::collections::{BTreeMap, BTreeSet};

use dgd_signature::{Interpolation, PastLayout};

use super::expressions::SystemExpressions;
use super::operation::{ProgramOperation, ValueId};
use super::series::{
    ConstantFactor, MatrixEntry, NoTaylor, Recurrence, ScaledOperand, SharedSeries, TaylorSeries,
};
use crate::dae::Dae;
use crate::expr::hash::{HashMap, HashSet};
use crate::expr::intrinsics::{IntrinsicDefinition, IntrinsicId};
use crate::expr::{ExprGraph, ExprId, Node, Symbol};

/// Functions with a recurrence that is shorter than the one by their derivative.
const OWN: &[(&str, OwnRecurrence)] = &[
    ("sqrt", OwnRecurrence::Root),
    ("log", OwnRecurrence::Log),
    ("abs", OwnRecurrence::Magnitude),
    ("^", OwnRecurrence::Power),
];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum OwnRecurrence {
    Root,
    Log,
    Magnitude,
    Power,
}

fn own_recurrence(function: IntrinsicId) -> Option<OwnRecurrence> {
    let name = function.get().name;
    OWN.iter().find(|(of, _)| *of == name).map(|(_, own)| *own)
}

/// Why a system has no Taylor series, if that shows without derivatives.
pub(super) fn obstacle(dae: &Dae) -> Option<NoTaylor> {
    if !dae.arrays.is_empty() || !dae.families.is_empty() {
        Some(NoTaylor::Arrays)
    } else if !dae.delayed_unknowns.is_empty() {
        Some(NoTaylor::Delays)
    } else if dae.unknowns.iter().any(|unknown| dae.graph.value(unknown.mass) != Some(1.0)) {
        Some(NoTaylor::Algebraic)
    } else {
        None
    }
}

/// The Taylor series of a system with these derivatives.
pub(super) fn taylor(
    dae: &Dae,
    graph: &mut ExprGraph,
    names: &BTreeMap<ExprId, String>,
    derivatives: &SystemDerivatives,
) -> Result<TaylorSeries, NoTaylor> {
    let SystemDerivatives { f, jacobian, directions } = derivatives;
    let of_matrices = jacobian.iter().chain(directions).map(|entry| entry.value);
    if derivatives_go_on(graph, f.iter().copied().chain(of_matrices)) {
        return Err(NoTaylor::Functions);
    }
    Ok(TaylorSeries {
        unknowns: RecurrenceBuilder::new(graph, names, dae).series(f, &[], &[]),
        sensitivities: RecurrenceBuilder::new(graph, names, dae).series(f, jacobian, directions),
    })
}

/// Whether a function whose derivatives never close is applied to a varying argument.
fn derivatives_go_on(graph: &ExprGraph, roots: impl Iterator<Item = ExprId>) -> bool {
    let [lgamma, polygamma] = ["lgamma", "polygamma"].map(IntrinsicId::named);
    if !graph.calls(lgamma) && !graph.calls(polygamma) {
        return false;
    }
    let moves = |x: ExprId| {
        let moving = |s: &Symbol| !matches!(s, Symbol::Parameter(_) | Symbol::Discrete(_));
        graph.symbols(x).iter().any(moving)
    };
    graph.listed(roots).into_iter().any(|(_, node)| match node {
        Node::Call1(function, x) => function == lgamma && moves(x),
        Node::Call2(function, _, x) => function == polygamma && moves(x),
        _ => false,
    })
}

/// A non-zero of a matrix, as an expression.
pub(super) struct NonZero {
    pub(super) row: usize,
    pub(super) column: usize,
    pub(super) value: ExprId,
}

/// f, and the non-zeros of ∂f/∂y and ∂f/∂θ.
pub(super) struct SystemDerivatives {
    pub(super) f: Vec<ExprId>,
    pub(super) jacobian: Vec<NonZero>,
    pub(super) directions: Vec<NonZero>,
}

/// A varying expression as φ(x): pairs of x and φ'(x).
type ChainSlopes = Vec<(ExprId, ExprId)>;

/// Recurrence of a varying value, before sums are gathered.
#[derive(Debug, Clone)]
enum ContinuedRecurrence {
    By(Recurrence),
    Sum(Vec<ScaledOperand>),
}

struct RecurrenceBuilder<'a> {
    graph: &'a mut ExprGraph,
    names: &'a BTreeMap<ExprId, String>,
    dae: &'a Dae,
    moving: HashSet<ExprId>,
    /// Those that are linear in time.
    lines: HashSet<ExprId>,
    /// Functions with a recurrence by their derivatives.
    slopes: HashMap<ExprId, ChainSlopes>,
    body: Vec<ProgramOperation>,
    values: HashMap<ExprId, ValueId>,
    recurrences: BTreeMap<ValueId, ContinuedRecurrence>,
    /// Quotients that recurrences also need: c/a by the bits of c, and a.
    quotients: HashMap<(u64, ValueId), ValueId>,
    /// Positions of the two products in the recurrence of functions of two arguments.
    parts: HashMap<ExprId, [ValueId; 2]>,
}

impl<'a> RecurrenceBuilder<'a> {
    fn new(graph: &'a mut ExprGraph, names: &'a BTreeMap<ExprId, String>, dae: &'a Dae) -> Self {
        RecurrenceBuilder {
            graph,
            names,
            dae,
            moving: HashSet::default(),
            lines: HashSet::default(),
            slopes: HashMap::default(),
            body: Vec::new(),
            values: HashMap::default(),
            recurrences: BTreeMap::new(),
            quotients: HashMap::default(),
            parts: HashMap::default(),
        }
    }

    fn series(
        mut self,
        f: &[ExprId],
        jacobian: &[NonZero],
        directions: &[NonZero],
    ) -> SharedSeries {
        let entries = jacobian.iter().chain(directions).map(|entry| entry.value);
        let mut roots: Vec<ExprId> = f.iter().copied().chain(entries).collect();
        self.rewrite_powers(&mut roots);
        let order = self.close(&roots);

        let mut names = Vec::new();
        for &id in &order {
            let value = self.place(id);
            if let Some(name) = self.names.get(&id) {
                names.push((value, name.clone()));
            }
        }
        for &id in &order {
            if !self.moving.contains(&id) {
                continue;
            }
            let recurrence = self.recurrence(id);
            self.recurrences.insert(self.values[&id], recurrence);
        }
        let results: Vec<ValueId> = roots.iter().map(|root| self.values[root]).collect();
        let terms = self.gather(&results);
        let kept = self.kept(&roots[f.len()..f.len() + jacobian.len()]);
        let mut values = roots.iter().map(|root| self.values[root]);
        let f = values.by_ref().take(f.len()).collect();
        let mut entries = |all: &[NonZero]| -> Vec<MatrixEntry> {
            let named = all.iter().zip(values.by_ref());
            named.map(|(at, value)| MatrixEntry { row: at.row, column: at.column, value }).collect()
        };
        let (jacobian, directions) = (entries(jacobian), entries(directions));
        let recurrences = (0..self.body.len()).map(|i| match self.recurrences.get(&value_at(i)) {
            Some(ContinuedRecurrence::By(recurrence)) => Some(*recurrence),
            Some(ContinuedRecurrence::Sum(_)) | None => None,
        });
        let recurrences = recurrences.collect();
        let has_branches = order.iter().any(|id| self.branches(*id));
        SharedSeries {
            body: self.body,
            names,
            recurrences,
            terms,
            kept,
            has_branches,
            f,
            jacobian,
            directions,
        }
    }

    /// x^y with a varying exponent is exp(y log x).
    fn rewrite_powers(&mut self, roots: &mut [ExprId]) {
        let nodes = self.graph.listed(roots.iter().copied());
        self.find_moving(nodes.iter().map(|(id, _)| *id));
        let rewritten = |moving: &HashSet<ExprId>, node: Node| match node {
            Node::Call2(f, x, y)
                if own_recurrence(f) == Some(OwnRecurrence::Power) && moving.contains(&y) =>
            {
                Some((x, y))
            }
            _ => None,
        };
        if !nodes.iter().any(|(_, node)| rewritten(&self.moving, *node).is_some()) {
            return;
        }
        let mut built: HashMap<ExprId, ExprId> =
            HashMap::with_capacity_and_hasher(nodes.len(), <_>::default());
        for (id, node) in nodes {
            let here = if let Some((x, y)) = rewritten(&self.moving, node) {
                let log = self.graph.call1("log", built[&x]);
                let exponent = self.graph.multiply(built[&y], log);
                self.graph.call1("exp", exponent)
            } else {
                self.graph.simplified(node.map(|operand| built[&operand]))
            };
            built.insert(id, here);
        }
        for root in roots {
            *root = built[root];
        }
    }

    /// All subexpressions of the roots and of the slopes of their functions, operands first.
    fn close(&mut self, roots: &[ExprId]) -> Vec<ExprId> {
        let mut wanted: Vec<ExprId> = roots.to_vec();
        loop {
            let order = self.graph.reachable(wanted.iter().copied());
            self.find_moving(order.iter().copied());
            let mut grows = false;
            for &id in &order {
                if !self.moving.contains(&id) || self.slopes.contains_key(&id) {
                    continue;
                }
                let slopes = self.slopes_of(id);
                wanted.extend(slopes.iter().map(|(_, slope)| *slope));
                grows |= !slopes.is_empty();
                self.slopes.insert(id, slopes);
            }
            if !grows {
                return order;
            }
        }
    }

    /// The slopes of a function without a recurrence of its own, with respect to its varying arguments.
    fn slopes_of(&mut self, id: ExprId) -> ChainSlopes {
        let slopes = match self.graph.node(id) {
            Node::Call1(f, x) if own_recurrence(f).is_none() => match f.get().definition {
                IntrinsicDefinition::One { derivative, .. } => vec![(x, derivative(self.graph, x))],
                IntrinsicDefinition::Two { .. } | IntrinsicDefinition::Expansion(..) => Vec::new(),
            },
            Node::Call2(f, x, y) if own_recurrence(f).is_none() => match f.get().definition {
                IntrinsicDefinition::Two { derivative, .. } => {
                    let [by_x, by_y] = derivative(self.graph, x, y);
                    vec![(x, by_x), (y, by_y)]
                }
                IntrinsicDefinition::One { .. } | IntrinsicDefinition::Expansion(..) => Vec::new(),
            },
            Node::Curve(curve, x) => vec![(x, self.graph.slope_of_curve(curve, x))],
            _ => Vec::new(),
        };
        slopes.into_iter().filter(|(argument, _)| self.moving.contains(argument)).collect()
    }

    /// Records which of these expressions vary, operands first, and which are linear.
    fn find_moving(&mut self, order: impl Iterator<Item = ExprId>) {
        for id in order {
            let node = self.graph.node(id);
            let moves = |a: &ExprId| self.moving.contains(a);
            let does = match node {
                Node::Symbol(symbol) => self.symbol(symbol).is_some(),
                // Conditions are evaluated at the beginning.
                Node::Constant(_)
                | Node::Compare(..)
                | Node::And(..)
                | Node::Or(..)
                | Node::Not(_)
                | Node::Delay(..) => false,
                Node::Call1(f, a) => moves(&a) && !self.is_flat(f, a),
                Node::Curve(curve, a) => moves(&a) && curve.derivative().is_some(),
                Node::Select(_, a, b) => moves(&a) || moves(&b),
                Node::Negate(_)
                | Node::Add(..)
                | Node::Subtract(..)
                | Node::Multiply(..)
                | Node::Divide(..)
                | Node::Call2(..) => node.operands().any(|a| self.moving.contains(&a)),
            };
            if !does {
                continue;
            }
            self.moving.insert(id);
            let line = |a: &ExprId| !self.moving.contains(a) || self.lines.contains(a);
            let is_line = match node {
                Node::Symbol(symbol) => !matches!(symbol, Symbol::Unknown(_)),
                Node::Negate(_) | Node::Add(..) | Node::Subtract(..) => {
                    node.operands().all(|a| line(&a))
                }
                Node::Multiply(a, b) => {
                    line(&a) && line(&b) && !(self.moving.contains(&a) && self.moving.contains(&b))
                }
                Node::Divide(a, b) => line(&a) && !self.moving.contains(&b),
                _ => false,
            };
            if is_line {
                self.lines.insert(id);
            }
        }
    }

    /// Whether a function is piecewise constant in its argument.
    fn is_flat(&mut self, f: IntrinsicId, a: ExprId) -> bool {
        match f.get().definition {
            IntrinsicDefinition::One { derivative, .. } if own_recurrence(f).is_none() => {
                let slope = derivative(self.graph, a);
                self.graph.value(slope) == Some(0.0)
            }
            _ => false,
        }
    }

    /// Whether an expression or its slope jumps where its varying operands do not; or its domain ends there, unlike its
    /// series.
    fn branches(&mut self, id: ExprId) -> bool {
        match self.graph.node(id) {
            Node::Compare(_, a, b) => self.moving.contains(&a) || self.moving.contains(&b),
            Node::Call1(f, a) => {
                // The series of a root passes a double zero of its argument, and is its negative afterwards.
                let ends = matches!(f.get().name, "sqrt" | "asin" | "acos" | "acosh");
                let jumps = own_recurrence(f) == Some(OwnRecurrence::Magnitude);
                (ends || jumps || self.is_flat(f, a)) && self.moving.contains(&a)
            }
            Node::Curve(_, a) => self.moving.contains(&a),
            Node::Call2(f, a, exponent) if own_recurrence(f) == Some(OwnRecurrence::Power) => {
                let is_whole = self.graph.value(exponent).is_some_and(|y| y.fract() == 0.0);
                !is_whole && self.moving.contains(&a)
            }
            _ => false,
        }
    }

    /// Recurrence of a symbol: unknowns, time, and linear inputs between samples.
    fn symbol(&self, symbol: Symbol) -> Option<Recurrence> {
        match symbol {
            Symbol::Unknown(i) => Some(Recurrence::Unknown(i)),
            Symbol::Time => Some(Recurrence::Time),
            Symbol::Input(i) => {
                let (inputs, delayed) = (&self.dae.inputs, &self.dae.delayed_inputs);
                let position = i as usize;
                let input = match position.checked_sub(inputs.len()) {
                    None => Some(position),
                    // The slopes of the delayed inputs follow these.
                    Some(position) => delayed.get(position).map(|delayed| delayed.input),
                };
                (inputs[input?].interpolation == Interpolation::Linear)
                    .then_some(Recurrence::Input(i))
            }
            _ => None,
        }
    }

    fn push(&mut self, operation: ProgramOperation) -> ValueId {
        let value = value_at(self.body.len());
        self.body.push(operation);
        value
    }

    /// Adds an expression to the body, with the quotients that its recurrence reads.
    fn place(&mut self, id: ExprId) -> ValueId {
        let node = self.graph.node(id);
        if self.slopes.get(&id).is_some_and(|slopes| slopes.len() == 2) {
            let parts = [(); 2].map(|()| self.push(ProgramOperation::Constant(0.0)));
            self.parts.insert(id, parts);
        }
        let values = &self.values;
        let past = PastLayout { first: 0, n_v: 0, n_s: 0 };
        let expressions = SystemExpressions { graph: self.graph, dae: self.dae, past };
        let operation = expressions.operation(node, |operand| values[&operand]);
        let value = self.push(operation);
        self.values.insert(id, value);
        if self.moving.contains(&id) {
            match node {
                Node::Divide(_, b) => {
                    self.quotient(1.0, self.values[&b]);
                }
                Node::Call1(f, _) if own_recurrence(f) == Some(OwnRecurrence::Root) => {
                    self.quotient(0.5, value);
                }
                Node::Call1(f, a) if own_recurrence(f) == Some(OwnRecurrence::Log) => {
                    self.quotient(1.0, self.values[&a]);
                }
                Node::Call2(f, a, _) if own_recurrence(f) == Some(OwnRecurrence::Power) => {
                    self.quotient(1.0, self.values[&a]);
                }
                _ => {}
            }
        }
        value
    }

    /// c/a.
    fn quotient(&mut self, numerator: f64, a: ValueId) -> ValueId {
        let key = (numerator.to_bits(), a);
        if let Some(value) = self.quotients.get(&key) {
            return *value;
        }
        let numerator = self.push(ProgramOperation::Constant(numerator));
        let value = self.push(ProgramOperation::Divide(numerator, a));
        self.quotients.insert(key, value);
        value
    }

    /// Recurrence of a varying expression.
    fn recurrence(&mut self, id: ExprId) -> ContinuedRecurrence {
        use ConstantFactor::{MinusOne, Of, One};
        let moving = |a: ExprId| self.moving.contains(&a).then(|| self.values[&a]);
        let value = |a: ExprId| self.values[&a];
        let only = |a: Option<ValueId>| {
            a.unwrap_or_else(|| unreachable!("an expression moves because an operand does"))
        };
        ContinuedRecurrence::By(match self.graph.node(id) {
            Node::Symbol(symbol) => self
                .symbol(symbol)
                .unwrap_or_else(|| unreachable!("{symbol:?} is not among those that move")),
            Node::Negate(a) => return ContinuedRecurrence::Sum(vec![(MinusOne, value(a))]),
            Node::Add(a, b) => {
                let terms = [moving(a), moving(b)].into_iter().flatten();
                return ContinuedRecurrence::Sum(terms.map(|a| (One, a)).collect());
            }
            Node::Subtract(a, b) => {
                let terms = [(One, moving(a)), (MinusOne, moving(b))];
                let terms = terms.into_iter().filter_map(|(factor, a)| Some((factor, a?)));
                return ContinuedRecurrence::Sum(terms.collect());
            }
            Node::Multiply(a, b) => match (moving(a), moving(b)) {
                (Some(x), Some(y)) if x == y => Recurrence::Square(x),
                (Some(x), Some(y)) if self.lines.contains(&a) => Recurrence::MultiplyLine(x, y),
                (Some(x), Some(y)) if self.lines.contains(&b) => Recurrence::MultiplyLine(y, x),
                (Some(x), Some(y)) => Recurrence::Multiply(x, y),
                (Some(x), None) => return ContinuedRecurrence::Sum(vec![(Of(value(b)), x)]),
                (None, y) => return ContinuedRecurrence::Sum(vec![(Of(value(a)), only(y))]),
            },
            Node::Divide(a, b) => match (moving(a), moving(b)) {
                (numerator, Some(b)) => Recurrence::Divide(numerator, b, self.quotient(1.0, b)),
                (numerator, None) => {
                    let (b, numerator) = (value(b), only(numerator));
                    return ContinuedRecurrence::Sum(vec![(Of(self.quotient(1.0, b)), numerator)]);
                }
            },
            Node::Select(c, a, b) => Recurrence::Select(value(c), moving(a), moving(b)),
            Node::Call1(f, a) => match own_recurrence(f) {
                Some(OwnRecurrence::Root) => {
                    Recurrence::Root(value(a), self.quotient(0.5, self.values[&id]))
                }
                Some(OwnRecurrence::Log) => {
                    Recurrence::Log(value(a), self.quotient(1.0, self.values[&a]))
                }
                Some(OwnRecurrence::Magnitude) => Recurrence::Magnitude(value(a)),
                Some(OwnRecurrence::Power) | None => return self.by_slopes(id),
            },
            Node::Curve(..) => return self.by_slopes(id),
            Node::Call2(f, a, b) => match own_recurrence(f) {
                Some(OwnRecurrence::Power) => {
                    let (a, b) = (value(a), value(b));
                    Recurrence::Power(a, b, self.quotient(1.0, a))
                }
                _ => return self.by_slopes(id),
            },
            Node::Constant(_)
            | Node::Compare(..)
            | Node::And(..)
            | Node::Or(..)
            | Node::Not(_)
            | Node::Delay(..) => unreachable!("these do not move"),
        })
    }

    /// v̇ = Σ dᵢ ẋᵢ.
    fn by_slopes(&mut self, id: ExprId) -> ContinuedRecurrence {
        let slopes = self.slopes[&id].clone();
        let parts: Vec<ContinuedRecurrence> = slopes
            .iter()
            .map(|(argument, slope)| {
                let (x, d) = (self.values[argument], self.values[slope]);
                if self.moving.contains(slope) {
                    ContinuedRecurrence::By(Recurrence::Chain(x, d))
                } else {
                    ContinuedRecurrence::Sum(vec![(ConstantFactor::Of(d), x)])
                }
            })
            .collect();
        match <[ContinuedRecurrence; 2]>::try_from(parts) {
            // The parts precede v.
            Ok(parts) => {
                let places = self.parts[&id];
                self.recurrences.extend(places.into_iter().zip(parts));
                ContinuedRecurrence::Sum(places.map(|part| (ConstantFactor::One, part)).to_vec())
            }
            Err(mut one) => one
                .pop()
                .unwrap_or_else(|| unreachable!("a function moves because an argument does")),
        }
    }

    /// Turns nested sums into one sum each, and returns the terms of all.
    ///
    /// A sum that only one other sum reads becomes part of that sum.
    fn gather(&mut self, results: &[ValueId]) -> Vec<ScaledOperand> {
        let mut readers: HashMap<ValueId, usize> = HashMap::default();
        let mut pinned: HashSet<ValueId> = results.iter().copied().collect();
        for recurrence in self.recurrences.values() {
            match recurrence {
                ContinuedRecurrence::Sum(terms) => {
                    for (_, value) in terms {
                        *readers.entry(*value).or_insert(0) += 1;
                    }
                }
                ContinuedRecurrence::By(recurrence) => pinned.extend(recurrence.operands()),
            }
        }
        let mut inner: HashMap<ValueId, Vec<ScaledOperand>> = HashMap::default();
        for (value, recurrence) in &self.recurrences {
            if let ContinuedRecurrence::Sum(terms) = recurrence
                && readers.get(value) == Some(&1)
                && !pinned.contains(value)
            {
                inner.insert(*value, terms.clone());
            }
        }
        let sums: Vec<(ValueId, Vec<ScaledOperand>)> = (self.recurrences.iter())
            .filter_map(|(value, recurrence)| match recurrence {
                ContinuedRecurrence::Sum(terms) => Some((*value, terms.clone())),
                ContinuedRecurrence::By(_) => None,
            })
            .collect();
        let mut listed = Vec::new();
        for (sum, terms) in sums {
            if inner.contains_key(&sum) {
                self.recurrences.remove(&sum);
                continue;
            }
            let first = listed.len();
            listed.extend(self.flattened(terms, &inner));
            let linear = Recurrence::Linear { first, count: listed.len() - first };
            self.recurrences.insert(sum, ContinuedRecurrence::By(linear));
        }
        listed
    }

    /// The terms of a sum, with inner sums replaced by their terms.
    fn flattened(
        &mut self,
        terms: Vec<ScaledOperand>,
        inner: &HashMap<ValueId, Vec<ScaledOperand>>,
    ) -> Vec<ScaledOperand> {
        let mut pending = terms;
        let mut flat: BTreeMap<ValueId, ConstantFactor> = BTreeMap::new();
        while let Some((factor, value)) = pending.pop() {
            if let Some(terms) = inner.get(&value) {
                for (own, value) in terms {
                    let product = self.product(factor, *own);
                    pending.push((product, *value));
                }
            } else {
                let sum = match flat.get(&value) {
                    Some(earlier) => self.sum(*earlier, factor),
                    None => factor,
                };
                flat.insert(value, sum);
            }
        }
        // In the order in which values become available: no term waits for a later one.
        let mut terms: Vec<ScaledOperand> =
            flat.into_iter().map(|(value, factor)| (factor, value)).collect();
        terms.sort_by_key(|(_, value)| !self.is_of_symbol(*value));
        terms
    }

    /// Whether the series of a value is available before those of expressions.
    fn is_of_symbol(&self, value: ValueId) -> bool {
        use Recurrence::{Input, Time, Unknown};
        matches!(
            self.recurrences.get(&value),
            Some(ContinuedRecurrence::By(Unknown(_) | Input(_) | Time))
        )
    }

    fn product(&mut self, a: ConstantFactor, b: ConstantFactor) -> ConstantFactor {
        match (a, b) {
            (ConstantFactor::One, other) | (other, ConstantFactor::One) => other,
            (ConstantFactor::MinusOne, ConstantFactor::MinusOne) => ConstantFactor::One,
            (ConstantFactor::MinusOne, ConstantFactor::Of(a))
            | (ConstantFactor::Of(a), ConstantFactor::MinusOne) => {
                ConstantFactor::Of(self.push(ProgramOperation::Negate(a)))
            }
            (ConstantFactor::Of(a), ConstantFactor::Of(b)) => {
                ConstantFactor::Of(self.push(ProgramOperation::Multiply(a, b)))
            }
        }
    }

    fn sum(&mut self, a: ConstantFactor, b: ConstantFactor) -> ConstantFactor {
        let [a, b] = [a, b].map(|factor| match factor {
            ConstantFactor::One => self.push(ProgramOperation::Constant(1.0)),
            ConstantFactor::MinusOne => self.push(ProgramOperation::Constant(-1.0)),
            ConstantFactor::Of(value) => value,
        });
        ConstantFactor::Of(self.push(ProgramOperation::Add(a, b)))
    }

    /// Numbers for the values that recurrences read at earlier orders, including the `entries` of a matrix that is
    /// multiplied by series.
    fn kept(&self, entries: &[ExprId]) -> Vec<Option<usize>> {
        let mut wanted: BTreeSet<ValueId> = BTreeSet::new();
        for (value, recurrence) in &self.recurrences {
            let ContinuedRecurrence::By(recurrence) = recurrence else { continue };
            match *recurrence {
                Recurrence::Multiply(a, b)
                | Recurrence::MultiplyLine(a, b)
                | Recurrence::Chain(a, b) => wanted.extend([a, b]),
                Recurrence::Square(a) | Recurrence::Magnitude(a) => wanted.extend([a]),
                Recurrence::Divide(_, a, _) | Recurrence::Log(a, _) | Recurrence::Power(a, ..) => {
                    wanted.extend([a, *value]);
                }
                Recurrence::Root(..) => wanted.extend([*value]),
                Recurrence::Time
                | Recurrence::Input(_)
                | Recurrence::Unknown(_)
                | Recurrence::Linear { .. }
                | Recurrence::Select(..) => {}
            }
        }
        let moving = entries.iter().filter(|entry| self.moving.contains(entry));
        wanted.extend(moving.map(|entry| self.values[entry]));
        let mut kept = vec![None; self.body.len()];
        for (number, value) in wanted.into_iter().enumerate() {
            kept[value.index()] = Some(number);
        }
        kept
    }
}

fn value_at(position: usize) -> ValueId {
    ValueId(u32::try_from(position).unwrap_or(u32::MAX))
}
