//! The system to be solved: M ẏ = f(t, y, u, p, z) with M(z) = diag(1 or 0), square and of index 1.
//!
//! z are the discrete numbers, which change at events only: the mode of each `modes` block, counted
//! from 0, then one for each condition on time, 1 if it holds and 0 if not.

mod assemble;
mod delays;
mod families;
mod hybrid;
mod index;
mod matching;
mod modes;
mod rates;
mod readers;
mod renumber;
mod rest;
mod start_equations;
pub mod text;
mod transfer;

use std::collections::BTreeMap;

use crate::expr::{ExprGraph, ExprId, Symbol};
use crate::model::{DeclarationHeader, Density, Input, Parameter, Smoothness, Variant};
use crate::source::Span;
use crate::units::Unit;

pub use assemble::assemble;
pub use dgd_signature::{
    AutomatonKind, Clock, Crossing, DelayedInput, DifferentiatedInput, JumpKind, Trigger,
};
pub(crate) use families::row_of;

/// `assemble` guarantees that
///
/// - there are as many rows as unknowns, row i of unknown i: ẏᵢ = fᵢ if it is differential, else 0 = fᵢ,
/// - the algebraic rows determine the algebraic unknowns structurally: the index is at most 1,
/// - both hold in every combination of modes, between which the rows choose by z,
/// - expressions are simplified and contain only times, parameters, inputs, unknowns and discrete numbers; comparisons
///   that parameters and time decide are discrete numbers,
/// - nothing in them is delayed: a delayed input is an input after the declared ones, a delayed unknown a symbol of its
///   own, and an output delayed as a whole an output with a delay.
///
/// A derivative that cannot be solved for row by row has become an algebraic unknown of its own, named `der(x)`; a
/// combination of derivatives that can be, the derivative of an unknown named after the combination. Equations that
/// only tied states together are kept along with their derivatives, and as many of the states have become algebraic; if
/// the choice of these states changes along a solution, an automaton of kind [`AutomatonKind::States`] makes it.
#[derive(Debug, Clone)]
pub struct Dae {
    /// The model's name.
    pub name: String,
    /// The model's doc comment.
    pub doc: Vec<String>,
    /// All expressions.
    pub graph: ExprGraph,
    /// Unknowns and their rows, as declared, then those that were added.
    pub unknowns: Vec<DaeUnknown>,
    /// Arrays of unknowns, after the single ones.
    pub arrays: Vec<DaeArray>,
    /// Their rows, ascending; together they are one row for each element.
    pub families: Vec<DaeFamily>,
    /// Parameters, as declared.
    pub parameters: Vec<Parameter>,
    /// Smoothness of tables, from `smooth`.
    pub smoothness: Vec<Smoothness>,
    /// Inputs, as declared.
    pub inputs: Vec<Input>,
    /// Distinct delays.
    pub delays: Vec<Delay>,
    /// Distinct delays that vary: of time, inputs and unknowns that are differential in every mode.
    pub varying_delays: Vec<Delay>,
    /// Inputs u after the declared ones: delayed copies of declared inputs.
    pub delayed_inputs: Vec<DelayedInput>,
    /// Delayed unknowns in equations.
    pub delayed_unknowns: Vec<DaeDelayedUnknown>,
    /// Inputs through which equations are differentiated: they must not jump.
    pub differentiated_inputs: Vec<DifferentiatedInput>,
    /// Whether a run begins at rest.
    pub starts_at_rest: bool,
    /// Equations that hold at the start in addition to the others.
    pub start_equations: Vec<DaeStartEquation>,
    /// Outputs; their values are expressions of `graph`.
    pub outputs: Vec<DaeOutput>,
    /// Distributions of the readings for which `noise` is more than a number.
    pub densities: Vec<Density>,
    /// Outputs for each element of an array, after the others.
    pub output_arrays: Vec<DaeOutputArray>,
    /// Names that the model gives to expressions.
    pub names: BTreeMap<ExprId, String>,
    /// Chosen variants.
    pub variants: Vec<Variant>,
    /// `modes` blocks, `when`s and saturations; the mode of the k-th is the k-th discrete number.
    pub automata: Vec<DaeAutomaton>,
    /// Jumps on entering modes.
    pub impulses: Impulses,
    /// Conditions on time; their discrete numbers follow those of the modes.
    pub time_conditions: Vec<TimeCondition>,
    /// Clocks, each of which replaces two conditions on time.
    pub clocks: Vec<Clock>,
    /// Labels of loops whose rows jump without events.
    pub unlocated: Vec<String>,
}

/// A `modes` block, or anything else that changes at events. Its equations are merged into the rows, so only its
/// transitions are left.
#[derive(Debug, Clone)]
pub struct DaeAutomaton {
    /// Its origin.
    pub kind: AutomatonKind,
    /// Its name.
    pub name: String,
    /// Names of its modes.
    pub modes: Vec<String>,
    /// The mode it starts in.
    pub start: usize,
    /// Its transitions.
    pub transitions: Vec<DaeTransition>,
}

/// A transition between modes, when the event function passes zero.
#[derive(Debug, Clone)]
pub struct DaeTransition {
    /// Position of the mode that it leaves.
    pub from: usize,
    /// Position of the mode that it enters.
    pub to: usize,
    /// The event function.
    pub event: ExprId,
    /// Direction of the zero crossing.
    pub crossing: Crossing,
    /// When it acts.
    pub trigger: Trigger,
    /// Unknowns that get a new value, and the values.
    pub resets: Vec<(Symbol, ExprId)>,
}

/// Jumps of single unknowns on entering modes: for each its kind, a [`JumpKind`] by the modes, and the remainder of the
/// constraint of its row; the matrix of the equations for jumps and impulses. Empty if no mode ties states together.
///
/// ```text
///   H d = −c(y):  d are the jumps of unknowns with a derivative, and the impulses of the others
/// ```
#[derive(Debug, Clone, Default)]
pub struct Impulses {
    /// Kinds as numbers.
    pub kinds: Vec<ExprId>,
    /// c; zero if the row has no constraint.
    pub rests: Vec<ExprId>,
    /// Nonzero entries of H; unknowns without an equation for their jump have no row.
    pub entries: Vec<JumpEntry>,
}

impl Impulses {
    /// Adds unknowns without an impulse, up to this number; nothing if there are no jumps.
    fn pad(&mut self, graph: &mut ExprGraph, n: usize) {
        if self.kinds.is_empty() {
            return;
        }
        let zero = graph.constant(0.0);
        self.kinds.resize(n, zero);
        self.rests.resize(n, zero);
    }
}

/// An entry of the matrix of jumps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JumpEntry {
    /// The unknown that has the row.
    pub row: usize,
    /// The unknown that jumps.
    pub column: usize,
    /// Its coefficient.
    pub value: ExprId,
}

impl Impulses {
    /// All expressions in it.
    pub(crate) fn expressions(&mut self) -> impl Iterator<Item = &mut ExprId> {
        let entries = self.entries.iter_mut().map(|entry| &mut entry.value);
        self.kinds.iter_mut().chain(&mut self.rests).chain(entries)
    }
}

/// A condition that switches once, at a time determined by parameters; or one of the two of a clock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimeCondition {
    /// The switching time; minus infinity if it never switches.
    pub at: ExprId,
    /// Its discrete number after switching, 0 or 1; before, the other one.
    pub after: ExprId,
}

/// 0 = r, which holds at the start and determines a start value.
#[derive(Debug, Clone)]
pub struct DaeStartEquation {
    /// Its label.
    pub name: String,
    /// Its place.
    pub span: Span,
    /// r.
    pub rest: ExprId,
    /// The state whose start value it determines; together, these equations determine all their states.
    pub unknown: usize,
}

/// A delay.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Delay {
    /// τ, s; of parameters only, unless it varies.
    pub tau: ExprId,
    /// Its source text.
    pub text: String,
}

/// An unknown x(t − τ).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DaeDelayedUnknown {
    /// The unknown x.
    pub unknown: Symbol,
    /// Position of τ among the delays, or among those that vary.
    pub delay: usize,
    /// Whether its delay varies.
    pub varies: bool,
}

/// An output w(t) = E(t − τ).
#[derive(Debug, Clone)]
pub struct DaeOutput {
    /// Name, place, unit, doc.
    pub declared: DeclarationHeader,
    /// E.
    pub value: ExprId,
    /// Standard deviation of the sensor's white noise, SI.
    pub noise: Option<f64>,
    /// Position of the delay τ; `None` means zero.
    pub delay: Option<usize>,
}

/// Outputs wᵢ = y₍first + i₎.
#[derive(Debug, Clone)]
pub struct DaeOutputArray {
    /// Name, place, unit, doc of the whole array.
    pub declared: DeclarationHeader,
    /// Index of the first.
    pub lower: i64,
    /// Position of the first unknown.
    pub first: usize,
    /// Number of outputs.
    pub count: u32,
    /// Standard deviation of the sensors' white noise, SI.
    pub noise: Option<f64>,
}

impl DaeOutputArray {
    /// Names of the outputs.
    pub fn names(&self) -> impl Iterator<Item = String> + '_ {
        let index = |i: u32| self.lower + i64::from(i);
        (0..self.count).map(move |i| format!("{}[{}]", self.declared.name, index(i)))
    }
}

/// An unknown and its row.
#[derive(Debug, Clone)]
pub struct DaeUnknown {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: Unit,
    /// Doc comment.
    pub doc: Vec<String>,
    /// Size for tolerances, SI.
    pub nominal: Option<f64>,
    /// Whether its row is ẏ = f in the initial modes; otherwise 0 = f.
    pub differential: bool,
    /// Its entry on the diagonal of M, 1 or 0, by the modes.
    pub mass: ExprId,
    /// f.
    pub rhs: ExprId,
    /// Start value; a guess if the unknown is algebraic.
    pub start: ExprId,
    /// Its history before the start, in terms of time and parameters; `None` means its start value.
    pub history: Option<ExprId>,
    /// Whether its start value is excluded from estimation.
    pub fixed: bool,
    /// Label of the equation of its row; all labels if it differs between modes.
    pub equation: String,
    /// Position of the equation of the initial modes.
    pub span: Span,
}

/// An array of unknowns.
#[derive(Debug, Clone)]
pub struct DaeArray {
    /// Its name.
    pub name: String,
    /// Unit of its elements.
    pub unit: Unit,
    /// Doc comment.
    pub doc: Vec<String>,
    /// Size for tolerances, SI.
    pub nominal: Option<f64>,
    /// Index of its first element.
    pub lower: i64,
    /// Position of its first element among all unknowns.
    pub first: usize,
    /// Number of elements.
    pub count: u32,
    /// Start value, swept over the elements.
    pub start: ExprId,
    /// History of the elements before the start, swept over the elements; `None` means their start values.
    pub history: Option<ExprId>,
}

/// Rows of consecutive elements with one expression. Symbols that move from row to row are
/// [`crate::expr::Symbol::Swept`] and [`crate::expr::Symbol::Counter`]; a family of one row contains neither.
#[derive(Debug, Clone)]
pub struct DaeFamily {
    /// Position of the first element among all unknowns.
    pub first: usize,
    /// Number of rows.
    pub count: u32,
    /// Whether the rows are ẏ = f; otherwise 0 = f.
    pub differential: bool,
    /// Their entry on the diagonal of M.
    pub mass: ExprId,
    /// f. No unknown occurs in it both as moving and as fixed.
    pub rhs: ExprId,
    /// Label of the equation that the rows come from.
    pub equation: String,
    /// First index of the equation's loop; none for a single equation.
    pub lower: Option<i64>,
    /// Position of the equation.
    pub span: Span,
}

impl DaeArray {
    /// Name of an element.
    pub fn element_name(&self, offset: u32) -> String {
        format!("{}[{}]", self.name, self.lower + i64::from(offset))
    }
}

impl DaeFamily {
    /// Some of its rows, with their expression.
    fn piece(&self, from: u32, count: u32, rhs: ExprId) -> DaeFamily {
        DaeFamily {
            first: self.first + from as usize,
            count,
            rhs,
            lower: self.lower.map(|lower| lower + i64::from(from)),
            equation: self.equation.clone(),
            ..*self
        }
    }

    /// Label of the equation of one row.
    pub fn label(&self, row: u32) -> String {
        match self.lower {
            Some(lower) => format!("{}[{}]", self.equation, lower + i64::from(row)),
            None => self.equation.clone(),
        }
    }
}

/// The position of an unknown.
pub(crate) fn position(unknown: Symbol) -> usize {
    match unknown {
        Symbol::Unknown(i) => i as usize,
        _ => unreachable!("elements are unknowns, and nothing else is late or reset"),
    }
}

impl Dae {
    /// Whether the outputs at one time depend only on the inputs at that time: there are no states and no delays, and
    /// time itself is not read.
    pub fn is_static(&self) -> bool {
        let moves = self.unknowns.iter().any(|unknown| unknown.differential)
            || self.families.iter().any(|family| self.graph.value(family.mass) != Some(0.0));
        let n_delays = self.delays.len() + self.varying_delays.len();
        !moves
            && n_delays == 0
            && !self.automata.iter().any(|automaton| automaton.kind.is_declared())
            && !self.graph.has_symbol(Symbol::Time)
    }

    /// The rows of single unknowns, then those of families.
    fn rows(&self) -> impl Iterator<Item = ExprId> + '_ {
        let families = self.families.iter().map(|family| family.rhs);
        self.unknowns.iter().map(|unknown| unknown.rhs).chain(families)
    }

    /// Visits all expressions that may depend on more than parameters.
    fn each_expression(&mut self, visit: &mut dyn FnMut(&mut ExprGraph, &mut ExprId)) {
        let graph = &mut self.graph;
        for unknown in &mut self.unknowns {
            visit(graph, &mut unknown.mass);
            visit(graph, &mut unknown.rhs);
            visit(graph, &mut unknown.start);
        }
        for family in &mut self.families {
            visit(graph, &mut family.rhs);
        }
        for output in &mut self.outputs {
            visit(graph, &mut output.value);
        }
        for equation in &mut self.start_equations {
            visit(graph, &mut equation.rest);
        }
        for transition in self.automata.iter_mut().flat_map(|a| &mut a.transitions) {
            visit(graph, &mut transition.event);
            for (_, value) in &mut transition.resets {
                visit(graph, value);
            }
        }
        for condition in &mut self.time_conditions {
            visit(graph, &mut condition.at);
            visit(graph, &mut condition.after);
        }
        for expression in self.impulses.expressions() {
            visit(graph, expression);
        }
    }

    /// Number of unknowns, elements of arrays included.
    pub fn n(&self) -> usize {
        self.unknowns.len() + self.arrays.iter().map(|array| array.count as usize).sum::<usize>()
    }

    /// For each array of outputs, the position of its first among all outputs.
    pub fn first_of_output_arrays(&self) -> impl Iterator<Item = usize> + '_ {
        self.output_arrays.iter().scan(self.outputs.len(), |next, array| {
            let first = *next;
            *next += array.count as usize;
            Some(first)
        })
    }

    /// The unknowns with a name: a single one, an element, or all elements of an array.
    pub fn positions(&self, name: &str) -> Vec<usize> {
        // An array that is written out consists of single unknowns.
        let is_it = |other: &str| {
            let rest = other.strip_prefix(name);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('['))
        };
        let single = self.unknowns.iter().enumerate().filter(|(_, unknown)| is_it(&unknown.name));
        let single = single.map(|(i, _)| i);
        let of_array = |array: &DaeArray| -> Vec<usize> {
            // An array with several indices is one array for each row.
            let rest = array.name.strip_prefix(name);
            if rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('[')) {
                return (0..array.count as usize).map(|k| array.first + k).collect();
            }
            let index = name.strip_prefix(array.name.as_str()).and_then(|index| {
                index.strip_prefix('[')?.strip_suffix(']')?.trim().parse::<i64>().ok()
            });
            let offset = index.and_then(|index| index.checked_sub(array.lower));
            let offset = offset.and_then(|offset| usize::try_from(offset).ok());
            let element = offset.filter(|offset| *offset < array.count as usize);
            element.map(|offset| array.first + offset).into_iter().collect()
        };
        single.chain(self.arrays.iter().flat_map(of_array)).collect()
    }

    /// Unknowns and arrays with a history, by name.
    pub(crate) fn histories(&self) -> impl Iterator<Item = (&str, ExprId)> {
        let single = self.unknowns.iter().map(|unknown| (&unknown.name, unknown.history));
        let arrays = self.arrays.iter().map(|array| (&array.name, array.history));
        single.chain(arrays).filter_map(|(name, history)| Some((name.as_str(), history?)))
    }

    /// The history of an unknown and the row in it, the first for a single one.
    pub(crate) fn history(&self, i: usize) -> Option<(ExprId, u32)> {
        if let Some(unknown) = self.unknowns.get(i) {
            return unknown.history.map(|history| (history, 0));
        }
        let after = self.arrays.partition_point(|array| array.first <= i);
        let array = &self.arrays[after.checked_sub(1)?];
        Some((array.history?, u32::try_from(i - array.first).ok()?))
    }

    /// The family of an element, and its row there.
    pub(crate) fn family_of(&self, i: usize) -> Option<(&DaeFamily, u32)> {
        let after = self.families.partition_point(|family| family.first <= i);
        let family = &self.families[after.checked_sub(1)?];
        let row = u32::try_from(i - family.first).ok()?;
        (row < family.count).then_some((family, row))
    }

    /// Whether an unknown's row is ẏ = f.
    pub fn is_differential(&self, i: usize) -> bool {
        if let Some(unknown) = self.unknowns.get(i) {
            return unknown.differential;
        }
        self.family_of(i).is_some_and(|(family, _)| family.differential)
    }

    /// Name of the i-th unknown.
    ///
    /// # Panics
    ///
    /// If there is no such unknown.
    pub fn unknown_name(&self, i: usize) -> String {
        let after = self.arrays.partition_point(|array| array.first <= i);
        match after.checked_sub(1).map(|array| &self.arrays[array]) {
            Some(array) => array.element_name(u32::try_from(i - array.first).unwrap_or(u32::MAX)),
            None => self.unknowns[i].name.clone(),
        }
    }

    /// Name of the i-th input: declared, delayed or the slope of a delayed one.
    ///
    /// # Panics
    ///
    /// If there is no such input.
    pub fn input_name(&self, i: usize) -> String {
        let name = |i: usize| &self.inputs[i].declared.name;
        match i.checked_sub(self.inputs.len()) {
            None => name(i).clone(),
            Some(position) if position >= self.delayed_inputs.len() => {
                let base = self.inputs.len() + position - self.delayed_inputs.len();
                format!("der({})", self.input_name(base))
            }
            Some(position) => {
                let DelayedInput { input, delay } = self.delayed_inputs[position];
                format!("delay({}, {})", name(input), self.delays[delay].text)
            }
        }
    }

    /// Name of the i-th delayed unknown.
    ///
    /// # Panics
    ///
    /// If there is no such delayed unknown.
    pub fn delayed_unknown_name(&self, i: usize) -> String {
        self.name_of_delayed(i, &self.unknown_name(position(self.delayed_unknowns[i].unknown)))
    }

    /// Name of the i-th delayed unknown, given the name of the unknown.
    fn name_of_delayed(&self, i: usize, name: &str) -> String {
        format!("delay({name}, {})", self.delay_of(self.delayed_unknowns[i]).text)
    }

    /// The delay of a delayed unknown.
    pub fn delay_of(&self, delayed: DaeDelayedUnknown) -> &Delay {
        let list = if delayed.varies { &self.varying_delays } else { &self.delays };
        &list[delayed.delay]
    }
}
