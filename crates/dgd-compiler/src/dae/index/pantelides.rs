//! Index reduction: equations that only tie states together are differentiated until every
//! algebraic unknown has an equation.
//!
//! ```text
//!   ẋ = f(x, z),  0 = g(x, z):   D e = ∂e/∂x f + ∂e/∂z ż + ∂e/∂t + ∂e/∂u u̇
//! ```
//!
//! Equations are matched to algebraic unknowns z one after another. If no augmenting path starts at an equation, the
//! equations that the search has visited overdetermine their unknowns: each is kept as a constraint and replaced by its
//! derivative, and ż replaces each z among them.
//!
//! # Source
//!
//! C. C. Pantelides, The consistent initialization of differential-algebraic systems, SIAM J. Sci. Stat. Comput. 9
//! (1988) 213–231, algorithm 4.1; here, derivatives that equations give directly (`linear_derivatives`) are
//! substituted.

use std::collections::{BTreeMap, BTreeSet};

use super::identity::is_constant;
use super::linear_derivatives::{DerivativeRate, RemainingResidual, SolvedDerivatives};
use super::partition::SystemPart;
use super::variables::UnknownList;
use crate::dae::matching::maximum_matching;
use crate::dae::transfer::TransferredEquation;
use crate::expr::{ExprGraph, ExprId, Node, Symbol};
use crate::model::{Input, Interpolation};

/// Mechanical and control systems need no more differentiations.
const MOST_DERIVATIVES: u32 = 8;

/// A system of index 1 whose states are not chosen yet.
#[derive(Debug, Default)]
pub(super) struct ReducedSystem {
    /// Derivatives of all unknowns that have one.
    pub(super) rates: BTreeMap<u32, DerivativeRate>,
    /// Those whose derivative only a differentiated equation needs.
    pub(super) following: BTreeSet<u32>,
    /// Unknowns without a derivative; as many equations determine them.
    pub(super) unknowns: Vec<u32>,
    pub(super) algebraic: Vec<RemainingResidual>,
    /// Declared inputs through which equations were differentiated, each with one of these equations.
    pub(super) differentiated: BTreeMap<usize, usize>,
    /// Equations between the unknowns with a derivative; each derived constraint follows its origin.
    pub(super) constraints: Vec<RemainingResidual>,
}

/// Why an equation cannot be differentiated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Obstacle {
    /// It reads an input that jumps.
    Held(usize),
    /// It reads the slope of an input, which jumps.
    Slope(usize),
    /// It reads a function that jumps.
    Jump(&'static str),
    /// It reads a delayed unknown, whose derivative may jump.
    Delayed,
    /// It reads an element of an array.
    Element,
    /// It reads an unknown of another part.
    Foreign(u32),
    /// None of its derivatives contains an unknown that it could determine.
    NoUnknown,
}

/// An equation that cannot be reduced.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ReductionRefusal {
    pub(super) equation: usize,
    pub(super) obstacle: Obstacle,
    /// Unknowns that it would have to determine.
    pub(super) wanting: Vec<u32>,
    /// Elements of arrays that would have to be differentiated.
    pub(super) elements: Vec<u32>,
}

/// Slopes of inputs.
pub(super) struct InputSlopes<'a> {
    pub(super) inputs: &'a [Input],
    /// The declared input of each delayed one.
    pub(super) delayed: Vec<usize>,
}

impl InputSlopes<'_> {
    /// The declared input of an input that equations read.
    fn declared(&self, i: u32) -> usize {
        let i = i as usize;
        i.checked_sub(self.inputs.len()).map_or(i, |position| self.delayed[position])
    }
}

/// Reduces the index to 1; `in_use` are the unknowns of the part in these modes.
pub(super) fn reduce(
    graph: &mut ExprGraph,
    solved: SolvedDerivatives,
    in_use: &[u32],
    part: &SystemPart,
    variables: &mut UnknownList,
    equations: &[TransferredEquation<'_>],
    slopes: &InputSlopes<'_>,
) -> Result<ReducedSystem, ReductionRefusal> {
    let SolvedDerivatives { rates, algebraic } = solved;
    let mut reduction = PantelidesReduction {
        graph,
        equations,
        part,
        variables,
        slopes,
        columns: in_use.iter().copied().filter(|i| !rates.contains_key(i)).collect(),
        of_row: Vec::new(),
        reduced: ReducedSystem { rates, algebraic, ..ReducedSystem::default() },
    };
    reduction.match_what_can_be();
    for row in 0..reduction.of_row.len() {
        while reduction.of_row[row].is_none() {
            if let Err(met) = reduction.augment(row) {
                reduction.differentiate(row, met)?;
            }
        }
    }
    let mut reduced = ReducedSystem { unknowns: reduction.columns, ..reduction.reduced };
    reduced.constraints.sort_by_key(|constraint| (constraint.order, constraint.equation));
    Ok(reduced)
}

struct PantelidesReduction<'a> {
    graph: &'a mut ExprGraph,
    equations: &'a [TransferredEquation<'a>],
    part: &'a SystemPart,
    variables: &'a mut UnknownList,
    slopes: &'a InputSlopes<'a>,
    /// Unknowns without a derivative.
    columns: Vec<u32>,
    /// The unknown that each algebraic equation is matched to.
    of_row: Vec<Option<u32>>,
    reduced: ReducedSystem,
}

/// Rows and unknowns visited by a failed search.
struct VisitedNodes {
    rows: Vec<usize>,
    unknowns: Vec<u32>,
}

impl PantelidesReduction<'_> {
    fn match_what_can_be(&mut self) {
        let incidence: Vec<Vec<usize>> = (0..self.reduced.algebraic.len())
            .map(|row| {
                let unknowns = self.unknowns_of(row);
                unknowns.iter().filter_map(|i| self.columns.binary_search(i).ok()).collect()
            })
            .collect();
        let matching = maximum_matching(&incidence, self.columns.len());
        self.of_row =
            matching.of_row.iter().map(|column| column.map(|c| self.columns[c])).collect();
    }

    /// Unknowns without a derivative in an algebraic equation, ascending.
    fn unknowns_of(&self, row: usize) -> Vec<u32> {
        let RemainingResidual { rest, equation, .. } = self.reduced.algebraic[row];
        let mut unknowns = self.equations[equation].unknowns(self.graph, rest);
        unknowns
            .retain(|i| !self.reduced.rates.contains_key(i) && self.variables.is_of(*i, self.part));
        unknowns
    }

    /// Matches a row by a shortest augmenting path, or returns the visited rows and unknowns.
    fn augment(&mut self, row: usize) -> Result<(), VisitedNodes> {
        let holder: BTreeMap<u32, usize> = self
            .of_row
            .iter()
            .enumerate()
            .filter_map(|(row, unknown)| unknown.map(|unknown| (unknown, row)))
            .collect();
        let mut rows = vec![row];
        // The row from which each unknown was reached.
        let mut from: BTreeMap<u32, usize> = BTreeMap::new();
        let mut next = 0;
        while let Some(&at) = rows.get(next) {
            next += 1;
            for unknown in self.unknowns_of(at) {
                if from.contains_key(&unknown) {
                    continue;
                }
                from.insert(unknown, at);
                let Some(other) = holder.get(&unknown) else {
                    self.flip(row, unknown, &from);
                    return Ok(());
                };
                rows.push(*other);
            }
        }
        rows.sort_unstable();
        Err(VisitedNodes { rows, unknowns: from.into_keys().collect() })
    }

    /// Shifts the matching along the path from a row to a free unknown.
    fn flip(&mut self, start: usize, free: u32, from: &BTreeMap<u32, usize>) {
        let mut unknown = free;
        loop {
            let row = from[&unknown];
            let Some(earlier) = self.of_row[row].replace(unknown) else { return };
            if row == start {
                return;
            }
            unknown = earlier;
        }
    }

    /// Replaces the visited equations by their derivatives.
    fn differentiate(&mut self, row: usize, met: VisitedNodes) -> Result<(), ReductionRefusal> {
        let origin = self.reduced.algebraic[row];
        for &unknown in &met.unknowns {
            let rate = self.variables.rate_of(unknown, origin.equation, self.graph);
            let value = self.graph.symbol(Symbol::Unknown(rate));
            self.reduced.following.insert(unknown);
            self.reduced.rates.insert(unknown, DerivativeRate { value, equation: origin.equation });
            self.columns.push(rate);
            for matched in self.of_row.iter_mut().filter(|matched| **matched == Some(unknown)) {
                *matched = Some(rate);
            }
        }
        self.columns.retain(|i| !met.unknowns.contains(i));
        for row in met.rows {
            let RemainingResidual { rest, equation, order } = self.reduced.algebraic[row];
            let derivative = self.along_time(rest, equation);
            let derivative =
                derivative.map_err(|obstacle| self.refusal(equation, obstacle, rest))?;
            let reads_unknowns =
                self.graph.symbols(derivative).iter().any(|s| matches!(s, Symbol::Unknown(_)));
            if !reads_unknowns || order == MOST_DERIVATIVES {
                return Err(self.refusal(equation, Obstacle::NoUnknown, rest));
            }
            self.reduced.constraints.push(self.reduced.algebraic[row]);
            self.reduced.algebraic[row] =
                RemainingResidual { rest: derivative, equation, order: order + 1 };
        }
        Ok(())
    }

    /// The refusal of an equation, with the unknowns that lack one.
    fn refusal(&self, equation: usize, obstacle: Obstacle, rest: ExprId) -> ReductionRefusal {
        let taken = |i: &u32| self.of_row.contains(&Some(*i));
        let wanting = self.columns.iter().copied().filter(|i| !taken(i)).collect();
        let elements = self.graph.symbols(rest).into_iter().filter_map(|symbol| match symbol {
            Symbol::Element(i) => Some(i),
            _ => None,
        });
        ReductionRefusal { equation, obstacle, wanting, elements: elements.collect() }
    }

    /// The total time derivative D e.
    fn along_time(&mut self, e: ExprId, equation: usize) -> Result<ExprId, Obstacle> {
        let moving = self.moving_inputs(e)?;
        for i in &moving {
            let declared = self.slopes.declared(*i);
            self.reduced.differentiated.entry(declared).or_insert(equation);
        }
        let n = self.variables.len();
        let gradient = self.graph.gradient(e, |symbol| match symbol {
            Symbol::Unknown(i) => Some(i as usize + 1),
            Symbol::Input(i) => moving.contains(&i).then_some(n + 1 + i as usize),
            Symbol::Time => Some(0),
            _ => None,
        });
        let mut sum = self.graph.constant(0.0);
        for (position, slope) in gradient {
            let term = match position.checked_sub(1) {
                None => slope,
                Some(unknown) if unknown < n => {
                    let unknown = u32::try_from(unknown).unwrap_or(u32::MAX);
                    // The search has visited every unknown of the part.
                    let rate = self.reduced.rates.get(&unknown);
                    let rate = rate.ok_or(Obstacle::Foreign(unknown))?;
                    self.graph.multiply(slope, rate.value)
                }
                Some(input) => {
                    let input = u32::try_from(input - n).unwrap_or(u32::MAX);
                    let udot = self.graph.symbol(Symbol::InputSlope(input));
                    self.graph.multiply(slope, udot)
                }
            };
            sum = self.graph.add(sum, term);
        }
        Ok(sum)
    }

    /// The inputs in an expression, if it is differentiable along time.
    fn moving_inputs(&self, e: ExprId) -> Result<Vec<u32>, Obstacle> {
        let mut inputs = Vec::new();
        for (_, node) in self.graph.listed([e]) {
            match node {
                Node::Symbol(Symbol::Input(i)) => {
                    let declared = self.slopes.declared(i);
                    if self.slopes.inputs[declared].interpolation == Interpolation::Hold {
                        return Err(Obstacle::Held(declared));
                    }
                    inputs.push(i);
                }
                Node::Symbol(Symbol::InputSlope(i)) => {
                    return Err(Obstacle::Slope(self.slopes.declared(i)));
                }
                Node::Symbol(Symbol::DelayedUnknown(_)) => return Err(Obstacle::Delayed),
                Node::Symbol(Symbol::Element(_)) => return Err(Obstacle::Element),
                Node::Select(condition, ..) if !is_constant(self.graph, condition) => {
                    return Err(Obstacle::Jump("if"));
                }
                Node::Call1(function, x)
                    if function.get().name == "sign" && !is_constant(self.graph, x) =>
                {
                    return Err(Obstacle::Jump("sign"));
                }
                Node::Call1(function, x)
                    if function.get().name == "floor" && !is_constant(self.graph, x) =>
                {
                    return Err(Obstacle::Jump("floor"));
                }
                Node::Curve(curve, x) if curve.get().smooth < 1 && !is_constant(self.graph, x) => {
                    return Err(Obstacle::Jump("table"));
                }
                // A count of ticks: conditions on time compare their numbers.
                node if !matches!(node, Node::Compare(..)) && reads_count(self.graph, node) => {
                    return Err(Obstacle::Jump("floor"));
                }
                _ => {}
            }
        }
        Ok(inputs)
    }
}

/// Whether a discrete number is an operand.
fn reads_count(graph: &ExprGraph, node: Node) -> bool {
    node.operands().any(|operand| matches!(graph.node(operand), Node::Symbol(Symbol::Discrete(_))))
}
