//! Parts of a model with independent modes: each has combinations of its own.
//!
//! A state whose derivative is given by one equation, in every mode, joins nothing: it counts as known. All other
//! unknowns of an equation belong together. If the index of a part has to be reduced, it joins the parts that it needs
//! derivatives from; and if impulses of its unknowns reach states of other parts, it joins these because jumps depend
//! on both.

use std::collections::{BTreeMap, BTreeSet};

use crate::dae::transfer::{TransferredEquation, TransferredModel};
use crate::expr::ExprGraph;
use crate::model::Model;

/// Equations and unknowns that are counted, reduced and matched separately.
#[derive(Debug, Clone, Default)]
pub(super) struct SystemPart {
    /// Positions of the equations, of all modes.
    pub(super) equations: BTreeSet<usize>,
    /// Declared unknowns.
    pub(super) unknowns: BTreeSet<u32>,
    /// Automata whose modes contain some of the equations.
    pub(super) automata: BTreeSet<usize>,
}

/// The parts of a model.
#[derive(Debug, Clone)]
pub(super) struct Partition {
    pub(super) parts: Vec<SystemPart>,
}

impl Partition {
    /// All equations in one part.
    pub(super) fn whole(model: &Model, equations: BTreeSet<usize>) -> Self {
        let unknowns = 0..u32::try_from(model.unknowns.len()).unwrap_or(u32::MAX);
        let automata = (0..model.automata.len()).collect();
        Partition { parts: vec![SystemPart { equations, unknowns: unknowns.collect(), automata }] }
    }

    /// The smallest parts of these equations.
    pub(super) fn finest(
        model: &Model,
        graph: &ExprGraph,
        transferred: &TransferredModel<'_>,
        of: &BTreeSet<usize>,
    ) -> Self {
        let all_equations = &transferred.equations;
        let automaton_of = automata_of(transferred);
        let known = known_states(model, all_equations, of, &automaton_of);
        let n = model.unknowns.len();
        let mut sets = DisjointSets::new(n + all_equations.len());
        for &e in of {
            let gives = match all_equations[e].derivatives[..] {
                [x] if known.contains(&x) => Some(x),
                _ => None,
            };
            if let Some(x) = gives {
                sets.join(x as usize, n + e);
                continue;
            }
            let read = all_equations[e].unknowns(graph, all_equations[e].rest).into_iter();
            let read = read.chain(all_equations[e].derivatives.iter().copied());
            for i in read.filter(|i| !known.contains(i)) {
                sets.join(i as usize, n + e);
            }
        }
        let mut parts: BTreeMap<usize, SystemPart> = BTreeMap::new();
        for i in 0..n {
            let part = parts.entry(sets.root(i)).or_default();
            part.unknowns.insert(u32::try_from(i).unwrap_or(u32::MAX));
        }
        for &e in of {
            let part = parts.entry(sets.root(n + e)).or_default();
            part.equations.insert(e);
            part.automata.extend(automaton_of.get(&e));
        }
        Partition { parts: parts.into_values().collect() }
    }

    /// The part of a declared unknown.
    pub(super) fn of_unknown(&self, i: u32) -> Option<usize> {
        self.parts.iter().position(|part| part.unknowns.contains(&i))
    }

    /// The part of an equation.
    pub(super) fn of_equation(&self, e: usize) -> Option<usize> {
        self.parts.iter().position(|part| part.equations.contains(&e))
    }

    /// Joins the parts of each pair.
    pub(super) fn join(&mut self, pairs: &BTreeSet<(usize, usize)>) {
        let mut sets = DisjointSets::new(self.parts.len());
        for (a, b) in pairs {
            sets.join(*a, *b);
        }
        let mut joined: BTreeMap<usize, SystemPart> = BTreeMap::new();
        for (position, part) in std::mem::take(&mut self.parts).into_iter().enumerate() {
            let target = joined.entry(sets.root(position)).or_default();
            target.equations.extend(part.equations);
            target.unknowns.extend(part.unknowns);
            target.automata.extend(part.automata);
        }
        self.parts = joined.into_values().collect();
    }
}

/// The automaton of each equation of a mode.
fn automata_of(transferred: &TransferredModel<'_>) -> BTreeMap<usize, usize> {
    let mut automaton_of = BTreeMap::new();
    for (automaton, modes) in transferred.of_modes.iter().enumerate() {
        for e in modes.iter().flat_map(|(begin, end)| *begin..*end) {
            automaton_of.insert(e, automaton);
        }
    }
    automaton_of
}

/// States whose derivative occurs in one equation only, in every mode.
fn known_states(
    model: &Model,
    all: &[TransferredEquation<'_>],
    of: &BTreeSet<usize>,
    automaton_of: &BTreeMap<usize, usize>,
) -> BTreeSet<u32> {
    let mut givers: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for &e in of {
        for x in &all[e].derivatives {
            givers.entry(*x).or_default().push(e);
        }
    }
    let is_known = |own: &[usize]| {
        let alone = own.iter().all(|e| all[*e].derivatives.len() == 1);
        let automata: BTreeSet<Option<usize>> =
            own.iter().map(|e| automaton_of.get(e).copied()).collect();
        alone
            && match automata.into_iter().collect::<Vec<_>>()[..] {
                [None] => own.len() == 1,
                [Some(k)] => {
                    let modes = &model.automata[k].modes;
                    // One in each mode; their equations are consecutive.
                    own.len() == modes.len() && modes_of(model, all, own, k).len() == modes.len()
                }
                _ => false,
            }
    };
    givers.into_iter().filter(|(_, own)| is_known(own)).map(|(x, _)| x).collect()
}

/// The modes of an automaton that contain these equations.
fn modes_of(
    model: &Model,
    all: &[TransferredEquation<'_>],
    own: &[usize],
    k: usize,
) -> BTreeSet<usize> {
    let spans: BTreeMap<_, usize> = model.automata[k]
        .modes
        .iter()
        .enumerate()
        .flat_map(|(mode, of)| of.equations.iter().map(move |equation| (equation.span, mode)))
        .collect();
    own.iter().filter_map(|e| spans.get(&all[*e].span).copied()).collect()
}

/// Disjoint sets of numbers (Galler and Fischer, Comm. ACM 7 (1964) 301–303).
struct DisjointSets {
    above: Vec<usize>,
}

impl DisjointSets {
    fn new(n: usize) -> Self {
        DisjointSets { above: (0..n).collect() }
    }

    fn root(&mut self, mut i: usize) -> usize {
        while self.above[i] != i {
            self.above[i] = self.above[self.above[i]];
            i = self.above[i];
        }
        i
    }

    /// Joins two sets; the smaller root stays, so the result follows the order of the file.
    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.above[a.max(b)] = a.min(b);
    }
}
