//! Arrays placed after the single unknowns: elements become unknowns, planned rows families.

use std::collections::{BTreeMap, BTreeSet};

use super::planned::{FamilyPlan, PlannedRows, elements_name};
use crate::dae::rates::{at_passage, family_of};
use crate::dae::transfer::TransferredModel;
use crate::dae::{Dae, DaeArray, DaeFamily, DaeOutputArray};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::{ExprGraph, ExprId, Symbol};
use crate::model::Model;
use crate::source::Span;

/// Properties of the equations after transfer.
pub(in crate::dae) struct RowOrigins {
    /// Label, place and first index of each equation.
    equations: Vec<(String, Span, Option<i64>)>,
    /// Initial values of arrays and their histories before the start.
    starts: Vec<(ExprId, Option<ExprId>)>,
}

impl RowOrigins {
    pub(in crate::dae) fn from_model(
        model: &Model,
        transferred: &TransferredModel<'_>,
    ) -> RowOrigins {
        let single = transferred.equations.len() - model.families.len();
        let equations = transferred.equations.iter().enumerate().map(|(e, equation)| {
            let lower = e.checked_sub(single).map(|f| model.families[f].lower);
            (equation.label.to_owned(), equation.span, lower)
        });
        let starts = transferred.starts.iter().copied().zip(transferred.histories.iter().copied());
        let starts = starts.skip(model.unknowns.len()).collect();
        RowOrigins { equations: equations.collect(), starts }
    }
}

/// The planned rows; elements are still numbered among those of all arrays.
pub(in crate::dae) fn families(
    graph: &mut ExprGraph,
    plan: &FamilyPlan,
    origins: &RowOrigins,
) -> Vec<DaeFamily> {
    let family = |row: &PlannedRows| {
        let (label, span, lower) = &origins.equations[row.equation];
        DaeFamily {
            first: row.first as usize,
            count: row.count,
            differential: row.differential,
            mass: graph.constant(f64::from(u8::from(row.differential))),
            rhs: passages(graph, row.rhs, row.from, row.count),
            equation: label.clone(),
            lower: lower.map(|lower| lower + i64::from(row.from)),
            span: *span,
        }
    };
    plan.rows.iter().map(family).collect()
}

/// Some passages of an expression whose elements have no final positions yet.
fn passages(graph: &mut ExprGraph, id: ExprId, from: u32, count: u32) -> ExprId {
    match count {
        1 => at_passage(graph, id, from),
        count => swept_from(graph, id, from, count),
    }
}

/// Gives an element that [`families`] determine a row of its own, and returns its position among them.
pub(in crate::dae) fn isolate(
    graph: &mut ExprGraph,
    families: &mut Vec<DaeFamily>,
    element: u32,
) -> Option<usize> {
    let (position, family) = family_of(families, element)?;
    let family = family.clone();
    let row = element - u32::try_from(family.first).unwrap_or(u32::MAX);
    let ends = [0, row, row + 1, family.count];
    let ends = ends.windows(2).map(|ends| (ends[0], ends[1] - ends[0]));
    let pieces = ends.filter(|(_, count)| *count > 0).map(|(from, count)| {
        let rhs = passages(graph, family.rhs, from, count);
        family.piece(from, count, rhs)
    });
    let pieces: Vec<DaeFamily> = pieces.collect();
    families.splice(position..=position, pieces);
    Some(position + usize::from(row > 0))
}

/// An element as an unknown after `n_single` others; any other symbol unchanged.
fn placed(symbol: Symbol, n_single: u32) -> Symbol {
    match symbol {
        Symbol::Element(i) => Symbol::Unknown(n_single + i),
        other => other,
    }
}

/// Completes a system whose single unknowns and [`families`] are complete.
pub(in crate::dae) fn place(
    mut dae: Dae,
    model: &Model,
    origins: &RowOrigins,
    diagnostics: &mut Diagnostics,
) -> Result<Dae, ErrorReported> {
    if model.arrays.is_empty() {
        return Ok(dae);
    }
    let n_single = u32::try_from(dae.unknowns.len()).unwrap_or(u32::MAX);
    let n_elements: u32 = model.arrays.iter().map(|array| array.count).sum();
    if n_single.checked_add(n_elements).is_none() {
        let span = model.arrays[0].unknown.declared.span;
        let message = "the model has too many unknowns";
        return Err(diagnostics.error(Diagnostic::new(Code::NotAKnownWholeNumber, span, message)));
    }
    let mut rates = ElementRates { model, opened: BTreeMap::new() };
    rates.open(&mut dae, diagnostics);
    diagnostics.check()?;

    let place = |graph: &mut ExprGraph, id: ExprId| {
        graph.substitute(id, |symbol| match symbol {
            Symbol::ElementRate(i) => rates.opened.get(&i).copied(),
            _ => None,
        })
    };
    each_expression(&mut dae, &mut |graph, id| {
        let opened = place(graph, id);
        behind(graph, opened, n_single)
    });

    for delayed in &mut dae.delayed_unknowns {
        delayed.unknown = placed(delayed.unknown, n_single);
    }
    let transitions = dae.automata.iter_mut().flat_map(|automaton| &mut automaton.transitions);
    for (unknown, _) in transitions.flat_map(|transition| &mut transition.resets) {
        *unknown = placed(*unknown, n_single);
    }
    for mut whole in std::mem::take(&mut dae.families) {
        whole.rhs = behind(&mut dae.graph, whole.rhs, n_single);
        whole.first += n_single as usize;
        dae.families.extend(disjoint(&mut dae.graph, &whole));
    }
    for (array, (start, history)) in model.arrays.iter().zip(&origins.starts) {
        let declared = &array.unknown.declared;
        dae.arrays.push(DaeArray {
            name: declared.name.clone(),
            unit: declared.unit.clone(),
            doc: declared.doc.clone(),
            nominal: array.unknown.nominal,
            lower: array.lower,
            first: (n_single + array.first) as usize,
            count: array.count,
            start: swept_from(&mut dae.graph, *start, 0, array.count),
            history: history.map(|id| swept_from(&mut dae.graph, id, 0, array.count)),
        });
    }
    for output in &model.output_arrays {
        let array = &model.arrays[output.array];
        dae.output_arrays.push(DaeOutputArray {
            declared: output.declared.clone(),
            lower: array.lower,
            first: (n_single + array.first) as usize,
            count: array.count,
            noise: output.noise,
        });
    }
    Ok(dae)
}

/// Visits every expression of the single rows, outputs, start equations and transitions.
fn each_expression(dae: &mut Dae, change: &mut dyn FnMut(&mut ExprGraph, ExprId) -> ExprId) {
    let graph = &mut dae.graph;
    for unknown in &mut dae.unknowns {
        unknown.rhs = change(graph, unknown.rhs);
        unknown.mass = change(graph, unknown.mass);
        unknown.start = change(graph, unknown.start);
    }
    for output in &mut dae.outputs {
        output.value = change(graph, output.value);
    }
    for equation in &mut dae.start_equations {
        equation.rest = change(graph, equation.rest);
    }
    for transition in dae.automata.iter_mut().flat_map(|automaton| &mut automaton.transitions) {
        transition.event = change(graph, transition.event);
        for (_, value) in &mut transition.resets {
            *value = change(graph, *value);
        }
    }
    for expression in dae.impulses.expressions() {
        *expression = change(graph, *expression);
    }
    let names = std::mem::take(&mut dae.names);
    dae.names = names.into_iter().map(|(id, name)| (change(graph, id), name)).collect();
}

/// Elements as unknowns after `n_single` others.
fn behind(graph: &mut ExprGraph, id: ExprId, n_single: u32) -> ExprId {
    let symbols = graph.symbols(id);
    let mut replaced = BTreeMap::new();
    for symbol in symbols {
        let placed = match symbol {
            Symbol::Element(_) => placed(symbol, n_single),
            Symbol::Swept(i) => Symbol::Swept(n_single + i),
            _ => continue,
        };
        replaced.insert(symbol, graph.symbol(placed));
    }
    graph.substitute(id, |symbol| replaced.get(&symbol).copied())
}

/// The expression of one row, elements by their positions among all unknowns.
pub(crate) fn row_of(graph: &mut ExprGraph, id: ExprId, row: u32) -> ExprId {
    swept_from(graph, id, row, 1)
}

/// The same expression from a later passage on; with one passage left, without moving symbols.
fn swept_from(graph: &mut ExprGraph, id: ExprId, from: u32, count: u32) -> ExprId {
    if from == 0 && count > 1 {
        return id;
    }
    let mut replaced = BTreeMap::new();
    for symbol in graph.symbols(id) {
        let later = match symbol {
            Symbol::Swept(i) if count == 1 => graph.symbol(Symbol::Unknown(i + from)),
            Symbol::Swept(i) => graph.symbol(Symbol::Swept(i + from)),
            Symbol::SweptParameter(i, _) if count == 1 => graph.symbol(Symbol::Parameter(i + from)),
            Symbol::SweptParameter(i, _) => graph.symbol(Symbol::SweptParameter(i + from, count)),
            Symbol::SweptInput(i, _) if count == 1 => graph.symbol(Symbol::Input(i + from)),
            Symbol::SweptInput(i, _) => graph.symbol(Symbol::SweptInput(i + from, count)),
            Symbol::Counter => {
                let passed = graph.constant(f64::from(from));
                if count == 1 {
                    passed
                } else {
                    let counter = graph.symbol(Symbol::Counter);
                    graph.add(counter, passed)
                }
            }
            _ => continue,
        };
        replaced.insert(symbol, later);
    }
    graph.substitute(id, |symbol| replaced.get(&symbol).copied())
}

/// Splits a family where an unknown, parameter or input that every row reads is the one that moves with the row.
///
/// Afterwards each of them is one symbol in a row, so that each derivative is one expression at one place.
fn disjoint(graph: &mut ExprGraph, family: &DaeFamily) -> Vec<DaeFamily> {
    let symbols = graph.symbols(family.rhs);
    let mut cuts = BTreeSet::from([0, family.count]);
    for moving in &symbols {
        for still in &symbols {
            let ((Symbol::Swept(first), Symbol::Unknown(i))
            | (Symbol::SweptParameter(first, _), Symbol::Parameter(i))
            | (Symbol::SweptInput(first, _), Symbol::Input(i))) = (moving, still)
            else {
                continue;
            };
            if let Some(passage) = i.checked_sub(*first).filter(|k| *k < family.count) {
                cuts.extend([passage, passage + 1]);
            }
        }
    }
    let cuts: Vec<u32> = cuts.into_iter().collect();
    cuts.windows(2)
        .map(|ends| {
            let (from, count) = (ends[0], ends[1] - ends[0]);
            let rhs = swept_from(graph, family.rhs, from, count);
            family.piece(from, count, rhs)
        })
        .collect()
}

/// Derivatives of elements that outputs, start equations and transitions read: the rows' right-hand sides.
struct ElementRates<'a> {
    model: &'a Model,
    opened: BTreeMap<u32, ExprId>,
}

impl ElementRates<'_> {
    fn open(&mut self, dae: &mut Dae, diagnostics: &mut Diagnostics) {
        let mut read: Vec<(ExprId, Span)> =
            dae.outputs.iter().map(|output| (output.value, output.declared.span)).collect();
        read.extend(dae.start_equations.iter().map(|equation| (equation.rest, equation.span)));
        let spans = self.model.automata.iter().flat_map(|automaton| &automaton.transitions);
        let transitions = dae.automata.iter().flat_map(|automaton| &automaton.transitions);
        for (transition, written) in transitions.zip(spans) {
            let resets = transition.resets.iter().map(|(_, value)| *value);
            let values = [transition.event].into_iter().chain(resets);
            read.extend(values.map(|value| (value, written.span)));
        }
        for (value, span) in read {
            for symbol in dae.graph.symbols(value) {
                let Symbol::ElementRate(i) = symbol else { continue };
                if self.opened.contains_key(&i) {
                    continue;
                }
                let row = family_of(&dae.families, i).filter(|(_, family)| family.differential);
                let Some((_, family)) = row else {
                    let name = elements_name(self.model, i, 1);
                    let message = format!("no equation gives der({name})");
                    diagnostics.error(Diagnostic::new(Code::UndeterminedDerivative, span, message));
                    continue;
                };
                let passage = i - u32::try_from(family.first).unwrap_or(u32::MAX);
                let rhs = at_passage(&mut dae.graph, family.rhs, passage);
                self.opened.insert(i, rhs);
            }
        }
    }
}
