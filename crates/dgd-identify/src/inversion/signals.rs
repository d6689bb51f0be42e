//! Chooses the readings that give the unknowns of an equation.
//!
//! The simplest first, one by one: an output, or another algebraic equation, that reads a single unknown without a
//! source so far becomes its source. Several outputs that read equally few unknowns are all used, weighted by their
//! noise. Further equations are not used because they may be wrong. If none reads a single unknown, all equations are
//! solved together.

use dgd_runtime::Pattern;

use super::{InversionError, InversionProblem};
use crate::regression::known::SensorEquations;

/// An unknown that the equation reads.
#[derive(Debug, Clone, PartialEq)]
pub struct InvertedSignal {
    /// Position of the unknown.
    pub unknown: usize,
    /// Its sources.
    pub sources: Vec<SignalSource>,
}

/// A source of an unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SignalSource {
    /// The output at this position.
    Output(usize),
    /// The equation at this position, from unknowns with sources.
    Equation(usize),
    /// All measured values, with all algebraic equations.
    Together,
}

/// An equation, and the sources of its unknowns.
pub(super) struct ChosenSources {
    pub(super) equation: usize,
    /// All unknowns that it reads.
    pub(super) needs: Vec<usize>,
    pub(super) signals: Vec<InvertedSignal>,
    pub(super) sensors: SensorEquations,
}

pub(super) fn choose(problem: &InversionProblem<'_>) -> Result<ChosenSources, InversionError> {
    let signature = problem.system.signature();
    let rows: Vec<usize> = rows_of(&signature.input_jacobian, problem.input);
    if rows.is_empty() {
        return Err(InversionError::Unread);
    }
    let past = signature.past();
    for row in &rows {
        let mut reads = signature.input_jacobian.positions().filter(|(r, _)| r == row);
        if let Some((_, column)) = reads.find(|(_, column)| past.values().contains(column)) {
            let delayed = &signature.delayed_unknowns[column - past.values().start];
            let unknown = signature.unknowns.name(delayed.unknown).to_string();
            return Err(InversionError::Late { unknown });
        }
    }
    let sources = SourceOptions::new(problem, &rows);
    let known = sources.one_by_one();
    let chosen = |row: usize, given: &[Vec<SignalSource>]| {
        let needs = sources.needs(row);
        needs.iter().all(|i| !given[*i].is_empty()).then(|| sources.chosen(row, needs, given))
    };
    if let Some(found) = rows.iter().find_map(|row| chosen(*row, &known)) {
        return Ok(found);
    }
    let together = sources.together(known);
    if let Some(found) = rows.iter().find_map(|row| chosen(*row, &together)) {
        return Ok(found);
    }
    let needs = sources.needs(rows[0]);
    let open = needs.into_iter().filter(|i| together[*i].is_empty());
    let unknowns = open.map(|i| signature.unknowns.name(i).to_string()).collect();
    Err(InversionError::NotMeasured { unknowns })
}

fn rows_of(pattern: &Pattern, column: usize) -> Vec<usize> {
    let mut rows: Vec<usize> =
        pattern.positions().filter(|(_, c)| *c == column).map(|(row, _)| row).collect();
    rows.sort_unstable();
    rows.dedup();
    rows
}

fn reads(pattern: &Pattern, row: usize) -> Vec<usize> {
    let mut unknowns: Vec<usize> =
        pattern.positions().filter(|(r, _)| *r == row).map(|(_, column)| column).collect();
    unknowns.sort_unstable();
    unknowns.dedup();
    unknowns
}

/// Possible sources, with the unknowns that each reads.
struct SourceOptions<'a> {
    problem: &'a InversionProblem<'a>,
    all: Vec<(SignalSource, Vec<usize>)>,
}

impl<'a> SourceOptions<'a> {
    /// Measured outputs, and algebraic equations other than those with the missing term.
    fn new(problem: &'a InversionProblem<'a>, own: &[usize]) -> Self {
        let signature = problem.system.signature();
        let is_measured = |i: &usize| {
            let samples = problem.recording.measured[*i].as_ref();
            problem.noise[*i].is_some_and(|std| std > 0.0)
                && samples.is_some_and(|samples| samples.iter().any(|w| w.is_finite()))
        };
        let [of_outputs, by_input, _] = &signature.output_jacobians;
        let is_spoilt = rows_of(by_input, problem.input);
        let outputs = (0..signature.outputs.len())
            .filter(|i| is_measured(i) && !is_spoilt.contains(i))
            .map(|i| (SignalSource::Output(i), reads(of_outputs, i)));
        let has_modes = !signature.discrete.automata.is_empty();
        let equations = (0..signature.unknowns.len())
            .filter(|i| !own.contains(i) && (has_modes || !signature.unknowns.is_differential(*i)))
            .map(|i| (SignalSource::Equation(i), reads(&signature.jacobian, i)));
        let candidates = outputs.chain(equations).collect();
        SourceOptions { problem, all: candidates }
    }

    /// Unknowns of a compiled equation: those that it reads, and the one whose derivative it gives.
    fn needs(&self, row: usize) -> Vec<usize> {
        let signature = self.problem.system.signature();
        let mut needs = reads(&signature.jacobian, row);
        if signature.unknowns.is_differential(row) && !needs.contains(&row) {
            needs.push(row);
        }
        needs.sort_unstable();
        needs
    }

    fn one_by_one(&self) -> Vec<Vec<SignalSource>> {
        let n = self.problem.system.signature().unknowns.len();
        let mut known: Vec<Vec<SignalSource>> = vec![Vec::new(); n];
        loop {
            let is_open = |i: &&usize| known[**i].is_empty();
            let single = self.all.iter().filter_map(|(source, reads)| {
                let mut open = reads.iter().filter(is_open);
                let only = *open.next()?;
                open.next().is_none().then_some((reads.len(), *source, only))
            });
            let single: Vec<(usize, SignalSource, usize)> = single.collect();
            // The simplest; readings before equations of the same complexity.
            let rank = |(reads, source, _): &(usize, SignalSource, usize)| {
                (*reads, !matches!(source, SignalSource::Output(_)))
            };
            let Some(first) = single.iter().map(rank).min() else { return known };
            for (_, source, only) in single.iter().filter(|one| rank(one) == first) {
                // An additional equation would be a contradiction, not a reading.
                if first.1 && !known[*only].is_empty() {
                    continue;
                }
                known[*only].push(*source);
            }
        }
    }

    /// Adds the sources that all equations together may be.
    fn together(&self, mut given: Vec<Vec<SignalSource>>) -> Vec<Vec<SignalSource>> {
        let mut read = vec![false; given.len()];
        let mut count = 0;
        for (_, reads) in &self.all {
            let open: Vec<usize> = reads.iter().copied().filter(|i| given[*i].is_empty()).collect();
            count += usize::from(!open.is_empty());
            for i in open {
                read[i] = true;
            }
        }
        // Fewer equations than unknowns determine only some of them; the samples decide which.
        if count > 0 {
            for (own, _) in
                given.iter_mut().zip(&read).filter(|(own, read)| **read && own.is_empty())
            {
                own.push(SignalSource::Together);
            }
        }
        given
    }

    fn chosen(
        &self,
        equation: usize,
        needs: Vec<usize>,
        given: &[Vec<SignalSource>],
    ) -> ChosenSources {
        // Sources of the unknowns of the equation, and sources of these.
        let mut wanted = needs.clone();
        let mut used: Vec<SignalSource> = Vec::new();
        let mut k = 0;
        while k < wanted.len() {
            for source in &given[wanted[k]] {
                if !used.contains(source) {
                    used.push(*source);
                    let entry = self.all.iter().find(|(own, _)| own == source);
                    for i in entry.iter().flat_map(|(_, reads)| reads) {
                        if !wanted.contains(i) {
                            wanted.push(*i);
                        }
                    }
                }
            }
            k += 1;
        }
        let everything = used.contains(&SignalSource::Together);
        let is_used = |source: &SignalSource| everything || used.contains(source);
        let used_source = |(source, _): &(SignalSource, Vec<usize>)| Some(*source).filter(is_used);
        let used: Vec<SignalSource> = self.all.iter().filter_map(used_source).collect();
        let outputs = used.iter().filter_map(|source| match source {
            SignalSource::Output(i) => Some((*i, self.problem.noise[*i].unwrap_or(1.0))),
            SignalSource::Equation(_) | SignalSource::Together => None,
        });
        let equations = used.iter().filter_map(|source| match source {
            SignalSource::Equation(i) => Some(*i),
            SignalSource::Output(_) | SignalSource::Together => None,
        });
        let sensors = SensorEquations {
            outputs: outputs.collect(),
            equations: equations.collect(),
            free: Vec::new(),
        };
        let signal = |i: &usize| InvertedSignal { unknown: *i, sources: given[*i].clone() };
        let signals = needs.iter().map(signal).collect();
        ChosenSources { equation, needs, signals, sensors }
    }
}
