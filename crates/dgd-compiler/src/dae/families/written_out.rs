//! Arrays written out: elements of some arrays become single unknowns, and loops that read these arrays as wholes
//! become single equations.
//!
//! Index reduction chooses states and differentiates equations one by one. Arrays that take part in it are written out
//! first; all others stay as they are.

use std::collections::{BTreeMap, BTreeSet};

use crate::expr::{ExprGraph, ExprId, Symbol};
use crate::model::{Array, Equation, Family, Model, Output, OutputArray, Unknown};

/// The model with the arrays at these positions written out. Single unknowns, equations and outputs keep their
/// positions; new ones follow them.
pub(in crate::dae) fn written_out(model: &Model, arrays: &BTreeSet<usize>) -> Model {
    let mut changed = model.clone();
    let places = ElementPositions::new(model, arrays);
    for (position, array) in model.arrays.iter().enumerate() {
        if arrays.contains(&position) {
            let elements = (0..array.count).map(|k| element(&mut changed.graph, array, k));
            changed.unknowns.extend(elements.collect::<Vec<Unknown>>());
        }
    }
    let kept = model.arrays.iter().enumerate().filter(|(position, _)| !arrays.contains(position));
    changed.arrays = kept
        .map(|(_, array)| Array { first: array.first - places.gone(array.first), ..array.clone() })
        .collect();
    let (loops, whole): (Vec<&Family>, Vec<&Family>) =
        model.families.iter().partition(|family| places.sweeps(&model.graph, &family.equation));
    changed.families = whole.into_iter().cloned().collect();
    for family in loops {
        let passages = (0..family.count).map(|k| passage(&mut changed.graph, family, k));
        changed.equations.extend(passages.collect::<Vec<Equation>>());
    }
    write_outputs(&mut changed, model, arrays);
    places.put(&mut changed);
    changed
}

/// An element as an unknown of its own, while elements in its expressions keep their old positions. Like an element's,
/// its start value is estimated on request only.
fn element(graph: &mut ExprGraph, array: &Array, k: u32) -> Unknown {
    let mut unknown = array.unknown.clone();
    unknown.declared.name = format!("{}[{}]", unknown.declared.name, array.lower + i64::from(k));
    unknown.start = at_passage(graph, unknown.start, k);
    unknown.history = unknown.history.map(|history| at_passage(graph, history, k));
    unknown.fixed = true;
    unknown
}

/// The equation of one index.
fn passage(graph: &mut ExprGraph, family: &Family, k: u32) -> Equation {
    let equation = &family.equation;
    Equation {
        label: format!("{}[{}]", equation.label, family.lower + i64::from(k)),
        left: at_passage(graph, equation.left, k),
        right: at_passage(graph, equation.right, k),
        ..equation.clone()
    }
}

/// Replaces the outputs of whole arrays by one output for each element.
fn write_outputs(own: &mut Model, model: &Model, arrays: &BTreeSet<usize>) {
    own.output_arrays.clear();
    for output in &model.output_arrays {
        if !arrays.contains(&output.array) {
            let gone = arrays.iter().filter(|position| **position < output.array).count();
            own.output_arrays.push(OutputArray { array: output.array - gone, ..output.clone() });
            continue;
        }
        let Array { first, count, lower, .. } = model.arrays[output.array];
        for k in 0..count {
            let mut declared = output.declared.clone();
            declared.name = format!("{}[{}]", declared.name, lower + i64::from(k));
            let value = own.graph.symbol(Symbol::Element(first + k));
            own.outputs.push(Output { declared, value, noise: output.noise });
        }
    }
}

/// An expression in one passage of its loop.
fn at_passage(graph: &mut ExprGraph, id: ExprId, k: u32) -> ExprId {
    replaced(graph, id, |graph, symbol| {
        Some(match symbol {
            Symbol::Swept(i) => graph.symbol(Symbol::Element(i + k)),
            Symbol::SweptRate(i) => graph.symbol(Symbol::ElementRate(i + k)),
            Symbol::SweptParameter(i, _) => graph.symbol(Symbol::Parameter(i + k)),
            Symbol::SweptInput(i, _) => graph.symbol(Symbol::Input(i + k)),
            Symbol::Counter => graph.constant(f64::from(k)),
            _ => return None,
        })
    })
}

fn replaced(
    graph: &mut ExprGraph,
    id: ExprId,
    mut by: impl FnMut(&mut ExprGraph, Symbol) -> Option<ExprId>,
) -> ExprId {
    let mut replacement = BTreeMap::new();
    for symbol in graph.symbols(id) {
        if let Some(other) = by(graph, symbol) {
            replacement.insert(symbol, other);
        }
    }
    graph.substitute(id, |symbol| replacement.get(&symbol).copied())
}

/// The new positions of elements.
struct ElementPositions {
    /// First elements of the arrays that are written out, their numbers, and their first unknowns.
    runs: Vec<(u32, u32, u32)>,
}

impl ElementPositions {
    fn new(model: &Model, arrays: &BTreeSet<usize>) -> Self {
        let mut next = u32::try_from(model.unknowns.len()).unwrap_or(u32::MAX);
        let runs = arrays.iter().map(|position| {
            let Array { first, count, .. } = model.arrays[*position];
            let unknown = next;
            next = next.saturating_add(count);
            (first, count, unknown)
        });
        ElementPositions { runs: runs.collect() }
    }

    /// The unknown that an element has become.
    fn unknown(&self, element: u32) -> Option<u32> {
        let run =
            self.runs.iter().find(|(first, count, _)| (*first..first + count).contains(&element));
        run.map(|(first, _, unknown)| unknown + (element - first))
    }

    /// Number of elements before this one that are written out.
    fn gone(&self, element: u32) -> u32 {
        let before = self.runs.iter().filter(|(first, ..)| *first < element);
        before.map(|(_, count, _)| count).sum()
    }

    /// Whether the equation of a loop moves along an array that is written out.
    fn sweeps(&self, graph: &ExprGraph, equation: &Equation) -> bool {
        let sides = [equation.left, equation.right];
        sides.into_iter().flat_map(|side| graph.symbols(side)).any(|symbol| match symbol {
            Symbol::Swept(i) | Symbol::SweptRate(i) => self.unknown(i).is_some(),
            _ => false,
        })
    }

    fn symbol(&self, symbol: Symbol) -> Option<Symbol> {
        Some(match symbol {
            Symbol::Element(i) => match self.unknown(i) {
                Some(unknown) => Symbol::Unknown(unknown),
                None => Symbol::Element(i - self.gone(i)),
            },
            Symbol::ElementRate(i) => match self.unknown(i) {
                Some(unknown) => Symbol::Derivative(unknown),
                None => Symbol::ElementRate(i - self.gone(i)),
            },
            Symbol::Swept(i) => Symbol::Swept(i - self.gone(i)),
            Symbol::SweptRate(i) => Symbol::SweptRate(i - self.gone(i)),
            _ => return None,
        })
    }

    /// Moves elements to their new positions throughout a model.
    fn put(&self, model: &mut Model) {
        let mut graph = std::mem::take(&mut model.graph);
        for id in expressions(model) {
            *id = replaced(&mut graph, *id, |graph, symbol| {
                self.symbol(symbol).map(|symbol| graph.symbol(symbol))
            });
        }
        model.graph = graph;
        let resets = model.automata.iter_mut().flat_map(|automaton| &mut automaton.transitions);
        let resets = resets.flat_map(|transition| &mut transition.resets);
        let reset = resets.map(|reset| &mut reset.unknown);
        let bounded = model.saturations.iter_mut().map(|saturation| &mut saturation.unknown);
        for unknown in reset.chain(bounded) {
            *unknown = self.symbol(*unknown).unwrap_or(*unknown);
        }
    }
}

/// All expressions of a model.
fn expressions(model: &mut Model) -> Vec<&mut ExprId> {
    let mut expressions: Vec<&mut ExprId> = Vec::new();
    let arrays = model.arrays.iter_mut().map(|array| &mut array.unknown);
    for unknown in model.unknowns.iter_mut().chain(arrays) {
        expressions.push(&mut unknown.start);
        expressions.extend(&mut unknown.history);
    }
    expressions.extend(model.lets.iter_mut().map(|own| &mut own.value));
    expressions.extend(model.outputs.iter_mut().map(|output| &mut output.value));
    let families = model.families.iter_mut().map(|family| &mut family.equation);
    let mut equations: Vec<&mut Equation> =
        model.equations.iter_mut().chain(families).chain(&mut model.start_equations).collect();
    for automaton in &mut model.automata {
        equations.extend(automaton.modes.iter_mut().flat_map(|mode| &mut mode.equations));
        expressions.extend(automaton.period.iter_mut().flatten());
        for transition in &mut automaton.transitions {
            expressions.extend([&mut transition.left, &mut transition.right]);
            expressions.extend(transition.resets.iter_mut().map(|reset| &mut reset.value));
        }
    }
    for equation in equations {
        expressions.extend([&mut equation.left, &mut equation.right]);
    }
    expressions.extend(model.saturations.iter_mut().map(|saturation| &mut saturation.bound));
    expressions
}
