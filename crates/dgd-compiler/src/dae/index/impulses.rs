//! Impulses: the jumps of states on entering modes that tie them together, from the equations integrated over the
//! instant.
//!
//! ```text
//!   ẋ = r(x, z)        x⁺ − x⁻ = Σ ∂r/∂z Z        Z: integral of z over the instant
//!   0 = a(x, z)             0 = Σ ∂a/∂z Z
//!   0 = D c(x)              0 = c(x⁺)             if a constraint has been differentiated
//! ```
//!
//! Only unknowns that depend on differentiated constraints can be impulsive. The coefficients must be constant during
//! the instant: they read no impulsive unknown, and no state that an impulse moves. An unknown whose equation violates
//! that, such as a power, is left out; states that depend on it then have no known jump. If a constraint depends on it,
//! these modes have no rule.
//!
//! # Source
//!
//! S. Trenn, Switched differential algebraic equations, in: Dynamics and Control of Switched Electronic
//! Systems, Springer 2012, 189–216; A. Benveniste, B. Caillaud and M. Malandain, The mathematical
//! foundations of physical systems modeling languages, Annual Reviews in Control 50 (2020) 72–118.

use std::collections::{BTreeMap, BTreeSet};

use super::ModeSystems;
use super::explicit::ExplicitSystem;
use super::identity::samples;
use super::linear_derivatives::RemainingResidual;
use super::pantelides::ReducedSystem;
use crate::dae::matching::maximum_matching;
use crate::dae::modes::ModeCombinations;
use crate::dae::{Impulses, JumpEntry, JumpKind};
use crate::expr::{ExprGraph, ExprId, Symbol};
use crate::model::Model;

/// Pivots below this, in rows whose largest entry is one, are rounding errors.
const NOTHING: f64 = 1e-9;
/// Limit on the depth of substitutions in coefficients.
const MOST_OPENED: usize = 16;

/// The jumps on entering one combination of modes.
#[derive(Debug, Clone, Default)]
struct JumpRule {
    /// Kinds of all unknowns with a row or a derivative; others have none.
    kinds: BTreeMap<u32, JumpKind>,
    /// By row and column, which are numbers of unknowns.
    entries: BTreeMap<(u32, u32), ExprId>,
    /// Remainders of the constraints, by row.
    rests: BTreeMap<u32, ExprId>,
}

impl ModeSystems {
    /// The rules of all combinations of modes, merged into one; empty if no mode ties states together. `outside` are
    /// expressions of the rows of arrays.
    pub(in crate::dae) fn impulses(
        &self,
        model: &Model,
        graph: &mut ExprGraph,
        outside: &[ExprId],
    ) -> Impulses {
        let ties = |system: &ExplicitSystem| !system.reduced.constraints.is_empty();
        if model.automata.is_empty() || !self.explicit.iter().any(ties) {
            return Impulses::default();
        }
        let bounded = model.saturations.iter().filter_map(|saturation| match saturation.unknown {
            Symbol::Unknown(i) => Some(i),
            _ => None,
        });
        let bounded: BTreeSet<u32> = bounded.collect();
        let read_outside: BTreeSet<u32> =
            outside.iter().flat_map(|id| unknowns_in(graph, *id)).collect();
        let n = u32::try_from(self.variables.len()).unwrap_or(u32::MAX);
        let zero = graph.constant(0.0);
        let mut impulses = Impulses {
            kinds: vec![zero; n as usize],
            rests: vec![zero; n as usize],
            entries: Vec::new(),
        };
        for (part, (combinations, _)) in self.parts.iter().enumerate() {
            let systems = self.systems_of(part).iter();
            let rules: Vec<JumpRule> = systems
                .map(|system| {
                    let rule = ImpulseSystem::from_reduced(graph, &system.reduced).rule(
                        graph,
                        &read_outside,
                        &bounded,
                    );
                    rule.unwrap_or_else(|| without_jumps(&system.reduced))
                })
                .collect();
            let members = (0..n).filter(|i| self.part_of(*i) == part);
            merge(graph, combinations, &rules, members, &mut impulses);
        }
        impulses
    }

    /// Pairs of parts in which impulses of one pass through the other on their way to states.
    pub(super) fn joined_by_impulses(&self, graph: &ExprGraph) -> BTreeSet<(usize, usize)> {
        let mut joins = BTreeSet::new();
        if self.parts.len() == 1 {
            return joins;
        }
        let systems = |part: usize| self.systems_of(part).iter().map(|system| &system.reduced);
        for part in 0..self.parts.len() {
            let instants = systems(part).map(|reduced| ImpulseSystem::from_reduced(graph, reduced));
            let impulsive: BTreeSet<u32> = instants.flat_map(|instant| instant.impulsive).collect();
            if impulsive.is_empty() {
                continue;
            }
            let reads = |other: usize, of: &BTreeSet<u32>| {
                let rows = |reduced: &ReducedSystem| {
                    reduced.algebraic.iter().map(|row| row.rest).collect::<Vec<_>>()
                };
                systems(other).flat_map(rows).any(|id| reads_any(graph, id, of))
            };
            let moves = |other: usize, of: &BTreeSet<u32>| {
                let mut rates = systems(other).flat_map(|reduced| reduced.rates.values());
                rates.any(|rate| reads_any(graph, rate.value, of))
            };
            let algebraic = |other: usize| -> BTreeSet<u32> {
                systems(other).flat_map(|reduced| reduced.unknowns.iter().copied()).collect()
            };
            // Forwards: the unknowns that impulses may reach.
            let mut reached: Vec<usize> = Vec::new();
            let mut emitted = impulsive;
            loop {
                let is_new = |other: &usize| *other != part && !reached.contains(other);
                let next =
                    (0..self.parts.len()).filter(is_new).find(|other| reads(*other, &emitted));
                let Some(next) = next else { break };
                emitted.extend(algebraic(next));
                reached.push(next);
            }
            // Backwards: the unknowns between these and a state.
            let others = (0..self.parts.len()).filter(|other| *other != part);
            let mut needed: Vec<usize> = others.filter(|other| moves(*other, &emitted)).collect();
            loop {
                let leads = |other: &usize| {
                    let others_algebraic = algebraic(*other);
                    !needed.contains(other)
                        && needed.iter().any(|later| {
                            moves(*later, &others_algebraic) || reads(*later, &others_algebraic)
                        })
                };
                let Some(next) = reached.iter().copied().find(leads) else { break };
                needed.push(next);
            }
            joins.extend(needed.into_iter().map(|other| (part, other)));
        }
        joins
    }
}

fn reads_any(graph: &ExprGraph, id: ExprId, of: &BTreeSet<u32>) -> bool {
    unknowns_in(graph, id).iter().any(|i| of.contains(i))
}

/// Adds the rules of all combinations of a part, merged into one; `own` are its unknowns.
fn merge(
    graph: &mut ExprGraph,
    combinations: &ModeCombinations,
    rules: &[JumpRule],
    own: impl Iterator<Item = u32>,
    impulses: &mut Impulses,
) {
    let zero = graph.constant(0.0);
    for i in own {
        let kind = |rule: &JumpRule| rule.kinds.get(&i).copied().unwrap_or(JumpKind::None);
        let of_modes = rules.iter().map(|rule| graph.constant(kind(rule).number())).collect();
        impulses.kinds[i as usize] = combinations.merge(graph, of_modes);
        let rest = |rule: &JumpRule| rule.rests.get(&i).copied().unwrap_or(zero);
        impulses.rests[i as usize] = combinations.merge(graph, rules.iter().map(rest).collect());
    }
    let places: BTreeSet<(u32, u32)> =
        rules.iter().flat_map(|rule| rule.entries.keys().copied()).collect();
    for place in places {
        let value = |rule: &JumpRule| rule.entries.get(&place).copied().unwrap_or(zero);
        let value = combinations.merge(graph, rules.iter().map(value).collect());
        let (row, column) = (place.0 as usize, place.1 as usize);
        impulses.entries.push(JumpEntry { row, column, value });
    }
}

/// Modes in which unknowns with a derivative keep their values.
fn without_jumps(reduced: &ReducedSystem) -> JumpRule {
    let states = reduced.rates.keys().filter(|x| !reduced.following.contains(x));
    let kinds = states.map(|x| (*x, JumpKind::Kept)).collect();
    JumpRule { kinds, ..JumpRule::default() }
}

fn unknowns_in(graph: &ExprGraph, id: ExprId) -> Vec<u32> {
    let unknown = |symbol| match symbol {
        Symbol::Unknown(i) => Some(i),
        _ => None,
    };
    graph.symbols(id).into_iter().filter_map(unknown).collect()
}

/// The system of one combination of modes, with the unknowns that impulses can reach.
struct ImpulseSystem<'a> {
    reduced: &'a ReducedSystem,
    /// The equation of each unknown without a derivative.
    row_of: BTreeMap<u32, RemainingResidual>,
    /// Unknowns without a derivative that may be impulsive.
    impulsive: BTreeSet<u32>,
    /// Unknowns with a derivative that may jump.
    jumping: BTreeSet<u32>,
}

impl<'a> ImpulseSystem<'a> {
    fn from_reduced(graph: &ExprGraph, reduced: &'a ReducedSystem) -> Self {
        let position: BTreeMap<u32, usize> =
            reduced.unknowns.iter().enumerate().map(|(column, i)| (*i, column)).collect();
        let incidence: Vec<Vec<usize>> = reduced
            .algebraic
            .iter()
            .map(|row| {
                let unknowns = unknowns_in(graph, row.rest);
                unknowns.iter().filter_map(|i| position.get(i).copied()).collect()
            })
            .collect();
        let matching = maximum_matching(&incidence, reduced.unknowns.len());
        let pairs = reduced.algebraic.iter().zip(&matching.of_row);
        let row_of: BTreeMap<u32, RemainingResidual> = pairs
            .filter_map(|(row, column)| column.map(|column| (reduced.unknowns[column], *row)))
            .collect();
        let differentiated = row_of.iter().filter(|(_, row)| row.order > 0);
        let mut impulsive: BTreeSet<u32> = differentiated.map(|(z, _)| *z).collect();
        spread(graph, &row_of, &mut impulsive);
        let reads = |id: ExprId| unknowns_in(graph, id).iter().any(|i| impulsive.contains(i));
        let jumping = reduced.rates.iter().filter(|(_, rate)| reads(rate.value));
        let jumping = jumping.map(|(x, _)| *x).collect();
        ImpulseSystem { reduced, row_of, impulsive, jumping }
    }

    /// The rule; `None` if a constraint depends on a quantity whose jump is unknown.
    fn rule(
        &self,
        graph: &mut ExprGraph,
        outside: &BTreeSet<u32>,
        bounded: &BTreeSet<u32>,
    ) -> Option<JumpRule> {
        let mut rule = without_jumps(self.reduced);
        if self.impulsive.is_empty() {
            return Some(rule);
        }
        // Rows of arrays would need rules of their own.
        if self.impulsive.iter().any(|z| outside.contains(z)) {
            return None;
        }
        let mut coefficients: BTreeMap<u32, Vec<(u32, ExprId)>> = BTreeMap::new();
        let mut unknown_jumps: BTreeSet<u32> = BTreeSet::new();
        for z in &self.impulsive {
            let row = self.row_of[z];
            if row.order > 0 {
                continue;
            }
            match self.coefficients(graph, row.rest) {
                Some(own) => drop(coefficients.insert(*z, own)),
                None => drop(unknown_jumps.insert(*z)),
            }
        }
        spread(graph, &self.row_of, &mut unknown_jumps);
        let mut lost: BTreeSet<u32> = BTreeSet::new();
        for x in &self.jumping {
            let rate = self.reduced.rates[x].value;
            let reads_lost = unknowns_in(graph, rate).iter().any(|z| unknown_jumps.contains(z));
            let known =
                self.coefficients(graph, rate).filter(|_| !reads_lost && !bounded.contains(x));
            match known {
                Some(known) => drop(coefficients.insert(*x, known)),
                None => drop(lost.insert(*x)),
            }
        }
        let one = graph.constant(1.0);
        for x in &self.jumping {
            let follows = self.reduced.following.contains(x);
            if lost.contains(x) {
                if !follows {
                    rule.kinds.insert(*x, JumpKind::Lost);
                }
                continue;
            }
            let kind = if follows { JumpKind::Following } else { JumpKind::Forced };
            rule.kinds.insert(*x, kind);
            rule.entries.insert((*x, *x), one);
            for (z, g) in &coefficients[x] {
                let minus = graph.negate(*g);
                rule.entries.insert((*x, *z), minus);
            }
        }
        for z in self.impulsive.difference(&unknown_jumps) {
            rule.kinds.insert(*z, JumpKind::Impulse);
            let row = self.row_of[z];
            if row.order == 0 {
                rule.entries.extend(coefficients[z].iter().map(|(k, a)| ((*z, *k), *a)));
                continue;
            }
            let constraint = self.constraint_below(row)?;
            rule.rests.insert(*z, constraint);
            for (x, slope) in Self::slopes(graph, constraint) {
                if lost.contains(&x) {
                    return None;
                }
                if self.jumping.contains(&x) {
                    rule.entries.insert((*z, x), slope);
                }
            }
        }
        // The impulse of a constraint must be determined by known quantities.
        if unknown_jumps.iter().any(|z| self.row_of[z].order > 0) {
            return None;
        }
        self.find_conserved(graph, &mut rule);
        Some(rule)
    }

    /// The constraint whose derivative a row is.
    fn constraint_below(&self, row: RemainingResidual) -> Option<ExprId> {
        let below = |other: &&RemainingResidual| {
            other.equation == row.equation && other.order + 1 == row.order
        };
        self.reduced.constraints.iter().find(below).map(|constraint| constraint.rest)
    }

    /// ∂e/∂x of the unknowns with a derivative.
    fn slopes(graph: &mut ExprGraph, e: ExprId) -> Vec<(u32, ExprId)> {
        let unknowns: Vec<u32> = unknowns_in(graph, e);
        let gradient = graph.gradient(e, |symbol| match symbol {
            Symbol::Unknown(i) => unknowns.iter().position(|other| *other == i),
            _ => None,
        });
        gradient.into_iter().map(|(at, slope)| (unknowns[at], slope)).collect()
    }

    /// ∂e/∂z of the impulsive unknowns, if these derivatives are constant during the instant.
    fn coefficients(&self, graph: &mut ExprGraph, e: ExprId) -> Option<Vec<(u32, ExprId)>> {
        let slopes = Self::slopes(graph, e).into_iter();
        let slopes: Vec<(u32, ExprId)> =
            slopes.filter(|(z, _)| self.impulsive.contains(z)).collect();
        slopes.into_iter().map(|(z, slope)| Some((z, self.still(graph, slope)?))).collect()
    }

    /// An expression of states, inputs, time and parameters that is constant during the instant; unknowns that follow
    /// from these are substituted.
    fn still(&self, graph: &mut ExprGraph, id: ExprId) -> Option<ExprId> {
        let mut id = id;
        for _ in 0..MOST_OPENED {
            let mut opened: BTreeMap<u32, ExprId> = BTreeMap::new();
            for symbol in graph.symbols(id) {
                match symbol {
                    Symbol::Unknown(i) if self.impulsive.contains(&i) => return None,
                    Symbol::Unknown(i) if self.jumping.contains(&i) => return None,
                    Symbol::Unknown(i) if self.reduced.rates.contains_key(&i) => {}
                    Symbol::Unknown(i) => {
                        let value = self.value_of(graph, i)?;
                        opened.insert(i, value);
                    }
                    Symbol::Time
                    | Symbol::Parameter(_)
                    | Symbol::Input(_)
                    | Symbol::InputSlope(_)
                    | Symbol::Discrete(_) => {}
                    _ => return None,
                }
            }
            if opened.is_empty() {
                return Some(id);
            }
            id = graph.substitute(id, |symbol| match symbol {
                Symbol::Unknown(i) => opened.get(&i).copied(),
                _ => None,
            });
        }
        None
    }

    /// The value of an unknown if its own equation gives it directly.
    fn value_of(&self, graph: &mut ExprGraph, z: u32) -> Option<ExprId> {
        let rest = self.row_of.get(&z)?.rest;
        let is_own = |symbol: Symbol| symbol == Symbol::Unknown(z);
        let gradient = graph.gradient(rest, |symbol| is_own(symbol).then_some(0));
        let [(_, by)] = gradient[..] else { return None };
        if graph.symbols(by).into_iter().any(is_own) {
            return None;
        }
        let zero = graph.constant(0.0);
        let others = graph.substitute(rest, |symbol| is_own(symbol).then_some(zero));
        let minus = graph.negate(by);
        Some(graph.divide(others, minus))
    }

    /// Marks the states in a sum that impulses conserve: those that no choice of impulses, subject to the equations
    /// between them, moves by themselves.
    fn find_conserved(&self, graph: &ExprGraph, rule: &mut JumpRule) {
        let of_kind = |kind: JumpKind| {
            let of_kind = rule.kinds.iter().filter(move |(_, other)| **other == kind);
            of_kind.map(|(i, _)| *i).collect::<Vec<u32>>()
        };
        let (states, impulses) = (of_kind(JumpKind::Forced), of_kind(JumpKind::Impulse));
        let entry = |row: u32, column: u32| {
            rule.entries.get(&(row, column)).map_or(0.0, |value| samples(graph, *value)[0])
        };
        // Rows: equations between impulses, then the effect of each impulse on each state.
        let between = impulses.iter().filter(|z| self.row_of[z].order == 0);
        let between: Vec<Vec<f64>> =
            between.map(|row| impulses.iter().map(|z| entry(*row, *z)).collect()).collect();
        let (between, sizes) = of_one_size(between, impulses.len());
        let mut free = null_space(between, impulses.len());
        for v in &mut free {
            v.iter_mut().zip(&sizes).for_each(|(v, size)| *v /= size);
        }
        // A row for each free combination of impulses: its effect on the states.
        let moves: Vec<Vec<f64>> = free
            .iter()
            .map(|z| {
                let effect =
                    |x: &u32| impulses.iter().zip(z).map(|(k, z)| entry(*x, *k) * z).sum::<f64>();
                states.iter().map(effect).collect()
            })
            .collect();
        let (moves, _) = of_one_size(moves, states.len());
        let kept = null_space(moves, states.len());
        for (position, x) in states.iter().enumerate() {
            if kept.iter().any(|sum| sum[position].abs() > NOTHING) {
                rule.kinds.insert(*x, JumpKind::Shared);
            }
        }
    }
}

/// Adds the unknowns whose equations read one of these.
fn spread(
    graph: &ExprGraph,
    row_of: &BTreeMap<u32, RemainingResidual>,
    reached: &mut BTreeSet<u32>,
) {
    let reads: Vec<(u32, Vec<u32>)> =
        row_of.iter().map(|(z, row)| (*z, unknowns_in(graph, row.rest))).collect();
    loop {
        let next = reads.iter().filter(|(z, own)| {
            !reached.contains(z) && own.iter().any(|other| reached.contains(other))
        });
        let next: Vec<u32> = next.map(|(z, _)| *z).collect();
        if next.is_empty() {
            return;
        }
        reached.extend(next);
    }
}

/// The matrix with columns scaled by their largest entries, and these scales, so that tests for zero do not depend on
/// units.
fn of_one_size(mut rows: Vec<Vec<f64>>, n: usize) -> (Vec<Vec<f64>>, Vec<f64>) {
    let mut sizes = vec![1.0; n];
    for (column, size) in sizes.iter_mut().enumerate() {
        let largest = rows.iter().fold(0.0_f64, |largest, row| largest.max(row[column].abs()));
        if largest > 0.0 {
            *size = largest;
            for row in &mut rows {
                row[column] /= largest;
            }
        }
    }
    (rows, sizes)
}

/// A basis of the solutions of A v = 0, each with largest entry one.
fn null_space(mut rows: Vec<Vec<f64>>, n: usize) -> Vec<Vec<f64>> {
    for row in &mut rows {
        let largest = row.iter().fold(0.0_f64, |largest, a| largest.max(a.abs()));
        if largest > 0.0 {
            for a in row.iter_mut() {
                *a /= largest;
            }
        }
    }
    let mut pivots: Vec<usize> = Vec::new();
    for column in 0..n {
        let first = pivots.len();
        let size = |row: &usize| rows[*row][column].abs();
        let Some(best) = (first..rows.len()).max_by(|a, b| size(a).total_cmp(&size(b))) else {
            break;
        };
        if size(&best) <= NOTHING {
            continue;
        }
        rows.swap(first, best);
        let pivot = rows[first].clone();
        for (_, row) in rows.iter_mut().enumerate().filter(|(k, _)| *k != first) {
            let factor = row[column] / pivot[column];
            for (a, p) in row.iter_mut().zip(&pivot) {
                *a -= factor * p;
            }
        }
        pivots.push(column);
    }
    let free = (0..n).filter(|column| !pivots.contains(column));
    free.map(|column| {
        let mut v = vec![0.0; n];
        v[column] = 1.0;
        for (row, pivot) in pivots.iter().enumerate() {
            v[*pivot] = -rows[row][column] / rows[row][*pivot];
        }
        let largest = v.iter().fold(0.0_f64, |largest, a| largest.max(a.abs()));
        for a in &mut v {
            *a /= largest;
        }
        v
    })
    .collect()
}
