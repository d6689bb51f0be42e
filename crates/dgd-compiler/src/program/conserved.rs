//! Finds sums that the equations conserve, so that solvers preserve them.
//!
//! Each row is written as a sum of monomials, products of powers of expressions that are not sums. A combination of
//! rows in which every monomial cancels is zero at every point, in all modes and for all inputs:
//!
//! ```text
//!   Σ cₖ ẏₖ = 0,   cₖ numbers
//! ```
//!
//! Cancellation only for certain values of parameters, or by identities of functions, is not detected.

use std::collections::{BTreeMap, BTreeSet};

use dgd_signature::Conserved;

use crate::dae::{Dae, DaeFamily};
use crate::expr::{ExprGraph, ExprId, Node, Symbol};

/// Larger systems are skipped: solvers preserve sums only if their matrices are dense.
const MOST_UNKNOWNS: usize = 32;
/// A product of sums with more terms than this is not multiplied out.
const MOST_TERMS: usize = 64;
/// Coefficients below this fraction of their terms have cancelled.
const ROUNDING: f64 = 1e-12;

/// Powers of expressions, ascending.
type Monomial = Vec<(ExprId, i32)>;
/// Coefficients of monomials.
type MonomialSum = BTreeMap<Monomial, f64>;

/// A combination of rows: its remaining terms, and the rows in it.
#[derive(Clone)]
struct RowCombination {
    rest: MonomialSum,
    of: BTreeMap<usize, f64>,
}

/// Combinations of at least two unknowns, each with a weight of one for an unknown that occurs in no other.
pub(super) fn conserved(dae: &Dae) -> Vec<Conserved> {
    let n = dae.unknowns.len() + dae.families.iter().map(|f| f.count as usize).sum::<usize>();
    if !(2..=MOST_UNKNOWNS).contains(&n) {
        return Vec::new();
    }
    let mut graph = dae.graph.clone();
    let mut known = BTreeMap::new();
    let mut reduced: Vec<(Monomial, RowCombination)> = Vec::new();
    let mut sums: Vec<BTreeMap<usize, f64>> = Vec::new();
    for (unknown, row) in rows(dae, &mut graph) {
        let rest = sum_of(&graph, row, &mut known);
        let mut combination = RowCombination { rest, of: BTreeMap::from([(unknown, 1.0)]) };
        for (pivot, other) in &reduced {
            if let Some(share) = combination.rest.get(pivot).copied() {
                combination.subtract(other, share / other.rest[pivot]);
                combination.rest.remove(pivot);
            }
        }
        let largest = combination.rest.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        match largest.map(|(monomial, _)| monomial.clone()) {
            Some(pivot) => reduced.push((pivot, combination)),
            None => sums.push(combination.of),
        }
    }
    // Each keeps an unknown that occurs in no other.
    for k in 0..sums.len() {
        let Some((name, share)) = largest(&sums[k]) else { continue };
        sums[k].values_mut().for_each(|c| *c /= share);
        let reduced = sums[k].clone();
        for (other, combination) in sums.iter_mut().enumerate() {
            if other != k
                && let Some(share) = combination.get(&name).copied()
            {
                add(combination, &reduced, -share);
                combination.remove(&name);
            }
        }
    }
    sums.retain(|combination| combination.len() > 1);
    sums.into_iter().map(|terms| Conserved { terms: terms.into_iter().collect() }).collect()
}

/// The weight of largest magnitude, the first of ties.
fn largest(combination: &BTreeMap<usize, f64>) -> Option<(usize, f64)> {
    let by_size =
        |a: &(&usize, &f64), b: &(&usize, &f64)| a.1.abs().total_cmp(&b.1.abs()).then(b.0.cmp(a.0));
    combination.iter().max_by(by_size).map(|(unknown, share)| (*unknown, *share))
}

impl RowCombination {
    /// Subtracts a multiple of another one.
    fn subtract(&mut self, other: &RowCombination, times: f64) {
        add(&mut self.rest, &other.rest, -times);
        add(&mut self.of, &other.of, -times);
    }
}

/// Adds a multiple, and removes terms that cancel to rounding error.
fn add<K: Ord + Clone>(to: &mut BTreeMap<K, f64>, other: &BTreeMap<K, f64>, times: f64) {
    for (key, value) in other {
        let term = value * times;
        let before = to.get(key).copied().unwrap_or(0.0);
        let after = before + term;
        if after.abs() <= ROUNDING * before.abs().max(term.abs()) {
            to.remove(key);
        } else {
            to.insert(key.clone(), after);
        }
    }
}

/// The rows of unknowns that are differential in every mode, those of loops one by one.
fn rows(dae: &Dae, graph: &mut ExprGraph) -> Vec<(usize, ExprId)> {
    let single = dae.unknowns.iter().enumerate();
    let single = single.filter(|(_, x)| x.differential && dae.graph.value(x.mass) == Some(1.0));
    let mut rows: Vec<(usize, ExprId)> = single.map(|(i, x)| (i, x.rhs)).collect();
    for family in dae.families.iter().filter(|family| family.differential) {
        for k in 0..family.count {
            rows.push((family.first + k as usize, row_of(graph, family, k)));
        }
    }
    rows
}

fn row_of(graph: &mut ExprGraph, family: &DaeFamily, k: u32) -> ExprId {
    let symbols: BTreeSet<Symbol> = graph.symbols(family.rhs).into_iter().collect();
    let mut replaced = BTreeMap::new();
    for symbol in symbols {
        let now = match symbol {
            Symbol::Swept(i) => graph.symbol(Symbol::Unknown(i + k)),
            Symbol::SweptParameter(i, _) => graph.symbol(Symbol::Parameter(i + k)),
            Symbol::SweptInput(i, _) => graph.symbol(Symbol::Input(i + k)),
            Symbol::Counter => graph.constant(f64::from(k)),
            _ => continue,
        };
        replaced.insert(symbol, now);
    }
    graph.substitute(family.rhs, |symbol| replaced.get(&symbol).copied())
}

/// An expression as a sum of monomials; `known` stores those of its subexpressions.
fn sum_of(
    graph: &ExprGraph,
    root: ExprId,
    known: &mut BTreeMap<ExprId, MonomialSum>,
) -> MonomialSum {
    for (id, node) in graph.listed([root]) {
        if known.contains_key(&id) {
            continue;
        }
        let atom = || MonomialSum::from([(vec![(id, 1)], 1.0)]);
        let sum = match node {
            Node::Constant(_) => {
                let value = graph.value(id).unwrap_or(f64::NAN);
                if value == 0.0 {
                    MonomialSum::new()
                } else {
                    MonomialSum::from([(Vec::new(), value)])
                }
            }
            Node::Negate(a) => scaled(&known[&a], -1.0),
            Node::Add(a, b) => added(&known[&a], &known[&b], 1.0),
            Node::Subtract(a, b) => added(&known[&a], &known[&b], -1.0),
            Node::Multiply(a, b) => product(&known[&a], &known[&b]).unwrap_or_else(atom),
            Node::Divide(a, b) => {
                let inverse = inverse(&known[&b], b);
                product(&known[&a], &inverse).unwrap_or_else(atom)
            }
            _ => atom(),
        };
        known.insert(id, sum);
    }
    known[&root].clone()
}

fn scaled(sum: &MonomialSum, by: f64) -> MonomialSum {
    sum.iter().map(|(monomial, c)| (monomial.clone(), c * by)).collect()
}

fn added(a: &MonomialSum, b: &MonomialSum, times: f64) -> MonomialSum {
    let mut sum = a.clone();
    add(&mut sum, b, times);
    sum
}

/// The product, if it has few terms.
fn product(a: &MonomialSum, b: &MonomialSum) -> Option<MonomialSum> {
    if a.len() * b.len() > MOST_TERMS {
        return None;
    }
    let mut sum = MonomialSum::new();
    for (left, c) in a {
        for (right, d) in b {
            let mut powers: BTreeMap<ExprId, i32> = left.iter().copied().collect();
            for (id, power) in right {
                *powers.entry(*id).or_default() += power;
            }
            let monomial: Monomial = powers.into_iter().filter(|(_, power)| *power != 0).collect();
            add(&mut sum, &MonomialSum::from([(monomial, c * d)]), 1.0);
        }
    }
    Some(sum)
}

/// 1/b; a sum of several terms is inverted as a whole.
fn inverse(sum: &MonomialSum, b: ExprId) -> MonomialSum {
    let mut terms = sum.iter();
    match (terms.next(), terms.next()) {
        (Some((monomial, c)), None) => {
            let inverted = monomial.iter().map(|(id, power)| (*id, -power)).collect();
            MonomialSum::from([(inverted, 1.0 / c)])
        }
        _ => MonomialSum::from([(vec![(b, -1)], 1.0)]),
    }
}
