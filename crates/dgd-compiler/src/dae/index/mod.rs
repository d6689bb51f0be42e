//! The systems of all combinations of modes, of index at most 1, and the rows that combine them.
//!
//! | file | contents |
//! |---|---|
//! | `linear_derivatives` | solves equations for derivatives |
//! | `partition` | parts with independent modes |
//! | `pantelides` | differentiates equations until the index is at most 1 |
//! | `dummy_derivatives` | finds the states that constraints can make algebraic |
//! | `state_selection` | chooses among them along a solution |
//! | `explicit` | turns each equation into a row |
//! | `impulses` | jumps of states on entering modes that tie them together |
//! | `variables` | declared unknowns, and those that these steps add |
//! | `identity`, `typical` | values of expressions, identically or at the start |
//! | `refusal` | errors for equations that cannot be differentiated |

mod dummy_derivatives;
mod explicit;
mod identity;
mod impulses;
mod linear_derivatives;
mod pantelides;
mod partition;
mod refusal;
mod state_selection;
mod typical;
mod variables;

use std::collections::BTreeSet;

use self::dummy_derivatives::blocks_of;
use self::explicit::{ExplicitRow, RowAssignment, rows_of};
use self::linear_derivatives::{SolvedDerivatives, solve_for_derivatives};
use self::pantelides::{InputSlopes, Obstacle, ReductionRefusal, reduce};
use self::partition::{Partition, SystemPart};
use self::refusal::{no_choice, refuse, verify_bounds};
use self::typical::TypicalValues;
use self::variables::UnknownList;
use crate::dae::matching::verify_counts;
use crate::dae::modes::{ModeCombinations, in_modes, select};
use crate::dae::transfer::{TransferredEquation, TransferredModel};
use crate::dae::{DaeAutomaton, DaeUnknown, DelayedInput, DifferentiatedInput};
use crate::diagnostics::{Diagnostics, ErrorReported};
use crate::expr::{ExprGraph, ExprId, Node, Symbol};
use crate::model::Model;

pub(super) use explicit::ExplicitSystem;
pub(super) use linear_derivatives::solve_for_derivative;
pub(super) use state_selection::StateSelections;

/// Up to this many combinations of modes form one part; with more, the model is split into parts.
const TOGETHER: usize = 1024;

/// One system for each combination of the modes of each part, over common unknowns.
pub(super) struct ModeSystems {
    partition: Partition,
    /// Combinations of modes of each part, and the position of its first system.
    parts: Vec<(ModeCombinations, usize)>,
    /// Part by part, in the order of the combinations.
    pub(super) explicit: Vec<ExplicitSystem>,
    variables: UnknownList,
    typical: TypicalValues,
}

impl ModeSystems {
    /// Counts the equations of every combination, solves them for derivatives and reduces the index.
    /// Equations that are `taken` determine elements of arrays. Arrays whose elements would have to be
    /// differentiated are added to `tied`, and the failure is reported.
    pub(super) fn reduced(
        model: &Model,
        graph: &mut ExprGraph,
        transferred: &mut TransferredModel<'_>,
        delayed: &[DelayedInput],
        taken: &BTreeSet<usize>,
        tied: &mut BTreeSet<usize>,
        diagnostics: &mut Diagnostics,
    ) -> Result<ModeSystems, ErrorReported> {
        let histories = std::mem::take(&mut transferred.histories);
        let typical = TypicalValues::from_model(model, graph, &transferred.starts);
        let last = transferred.equations.len() - model.families.len();
        let equations: BTreeSet<usize> = (0..last).filter(|e| !taken.contains(e)).collect();
        let all_modes = ModeCombinations::enumerate(model, 0..model.automata.len());
        let is_whole = all_modes.is_some_and(|modes| modes.len() <= TOGETHER);
        let mut partition = if is_whole {
            Partition::whole(model, equations)
        } else {
            let counted = verify_each_mode(model, graph, transferred, &equations, diagnostics);
            let single: Vec<usize> = equations.iter().copied().collect();
            let all_equations = &transferred.equations;
            counted
                .inspect_err(|_| tie_what_is_read(model, graph, all_equations, &single, tied))?;
            Partition::finest(model, graph, transferred, &equations)
        };
        let delayed = delayed.iter().map(|delayed| delayed.input).collect();
        let slopes = InputSlopes { inputs: &model.inputs, delayed };
        let reduction = IndexReduction { model, transferred, slopes, typical: &typical, is_whole };
        loop {
            let starts = transferred.starts.clone();
            let mut variables = UnknownList::declared(model, starts, histories.clone());
            let mut joins = BTreeSet::new();
            let (mut parts, mut explicit) = (Vec::new(), Vec::new());
            for (position, part) in partition.parts.iter().enumerate() {
                let Some(combinations) =
                    ModeCombinations::enumerate(model, part.automata.iter().copied())
                else {
                    return Err(ModeCombinations::too_many(model, diagnostics));
                };
                let first = explicit.len();
                for modes in combinations.iter() {
                    let parts_modes =
                        PartModes { partition: &partition, part: position, modes: &modes };
                    let reduced = reduction.run(
                        graph,
                        parts_modes,
                        &mut variables,
                        tied,
                        &mut joins,
                        diagnostics,
                    )?;
                    // Parts that need unknowns of another are joined with it first.
                    let Some(system) = reduced else { break };
                    explicit.push(system);
                }
                parts.push((combinations, first));
            }
            let systems = ModeSystems {
                partition: partition.clone(),
                parts,
                explicit,
                variables,
                typical: typical.clone(),
            };
            if joins.is_empty() {
                joins = systems.joined_by_impulses(graph);
            }
            if joins.is_empty() {
                return Ok(systems);
            }
            partition.join(&joins);
        }
    }

    /// The part of an unknown.
    fn part_of(&self, i: u32) -> usize {
        let part = match self.variables.addition(i) {
            Some(addition) => self.partition.of_equation(addition.equation),
            None => self.partition.of_unknown(i),
        };
        part.unwrap_or_else(|| unreachable!("every unknown is in a part"))
    }

    /// The systems of a part, in the order of its combinations.
    fn systems_of(&self, part: usize) -> &[ExplicitSystem] {
        let (combinations, first) = &self.parts[part];
        &self.explicit[*first..first + combinations.len()]
    }

    /// The inputs through which equations have been differentiated, each once.
    pub(super) fn differentiated_inputs(
        &self,
        equations: &[TransferredEquation<'_>],
    ) -> Vec<DifferentiatedInput> {
        let mut inputs: Vec<DifferentiatedInput> = Vec::new();
        let differentiated = self.explicit.iter().flat_map(|s| &s.reduced.differentiated);
        for (&input, &equation) in differentiated {
            if inputs.iter().all(|other| other.input != input) {
                let equation = equations[equation].label.to_owned().into();
                inputs.push(DifferentiatedInput { input, equation });
            }
        }
        inputs
    }

    /// The unknowns with their rows, which depend on the modes; `selecting` are the automata of the selections.
    pub(super) fn rows(
        &self,
        model: &Model,
        graph: &mut ExprGraph,
        equations: &[TransferredEquation<'_>],
        selections: &StateSelections,
        selecting: &[DaeAutomaton],
        diagnostics: &mut Diagnostics,
    ) -> Vec<DaeUnknown> {
        let n = u32::try_from(self.variables.len()).unwrap_or(u32::MAX);
        let mut unknowns_by_part: Vec<Vec<u32>> = vec![Vec::new(); self.parts.len()];
        (0..n).for_each(|i| unknowns_by_part[self.part_of(i)].push(i));
        let mut places: Vec<Vec<RowAssignment>> = vec![Vec::new(); self.variables.len()];
        for (part, unknowns) in unknowns_by_part.iter().enumerate() {
            for system in self.systems_of(part) {
                for (i, place) in rows_of(graph, system, &self.variables, equations, unknowns) {
                    places[i as usize].push(place);
                }
            }
        }
        verify_bounds(model, graph, equations, &self.explicit, &places, diagnostics);
        let start_modes = ModeCombinations::start_modes(model);
        let automata = model.automata.len();
        let unknowns = (0..n).zip(self.variables.unknowns.iter().cloned()).zip(places);
        unknowns
            .map(|((i, unknown), places)| {
                let (combinations, first) = &self.parts[self.part_of(i)];
                let start = combinations.position(&start_modes);
                let mut merge = |value: &mut dyn FnMut(&mut ExprGraph, &ExplicitRow) -> ExprId| {
                    let values = places.iter().enumerate().map(|(combination, place)| {
                        let rows = place.rows().iter();
                        let values: Vec<ExprId> = rows.map(|row| value(graph, row)).collect();
                        let RowAssignment::Chosen(block, _) = place else { return values[0] };
                        match selections.automaton_of(first + combination, *block) {
                            Some(k) => select(graph, automata + k, &values),
                            None => values[0],
                        }
                    });
                    let values = values.collect();
                    combinations.merge(graph, values)
                };
                let rhs = merge(&mut |_, row| row.rhs);
                let mass =
                    merge(&mut |graph, row| graph.constant(f64::from(u8::from(row.differential))));
                let at_start = match &places[start] {
                    RowAssignment::Fixed(row) => row,
                    RowAssignment::Chosen(block, rows) => {
                        let automaton = selections.automaton_of(first + start, *block);
                        &rows[automaton.map_or(0, |k| selecting[k].start)]
                    }
                };
                DaeUnknown {
                    mass,
                    differential: at_start.differential,
                    rhs,
                    equation: labels(equations, places.iter().flat_map(RowAssignment::rows)),
                    span: equations[at_start.equation].span,
                    ..unknown
                }
            })
            .collect()
    }

    /// ẏ of each unknown whose derivative is given in all modes.
    pub(super) fn rates(&self, graph: &mut ExprGraph) -> Vec<Option<ExprId>> {
        let mut rate_of = |i: u32| {
            let part = self.part_of(i);
            let systems = self.systems_of(part).iter();
            let rates = systems.map(|s| s.reduced.rates.get(&i).map(|r| r.value));
            let rates = rates.collect::<Option<Vec<ExprId>>>()?;
            Some(self.parts[part].0.merge(graph, rates))
        };
        let unknowns = 0..u32::try_from(self.variables.len()).unwrap_or(u32::MAX);
        unknowns.map(&mut rate_of).collect()
    }
}

/// Context for reducing every combination of modes.
struct IndexReduction<'a> {
    model: &'a Model,
    transferred: &'a TransferredModel<'a>,
    slopes: InputSlopes<'a>,
    typical: &'a TypicalValues,
    /// Whether the whole model is one part.
    is_whole: bool,
}

/// A combination of the modes of a part.
#[derive(Clone, Copy)]
struct PartModes<'a> {
    partition: &'a Partition,
    part: usize,
    modes: &'a [usize],
}

impl PartModes<'_> {
    fn part(&self) -> &SystemPart {
        &self.partition.parts[self.part]
    }

    /// Records that this part needs the part of another unknown.
    fn join(&self, variables: &UnknownList, i: u32, joins: &mut BTreeSet<(usize, usize)>) {
        let other = match variables.addition(i) {
            Some(addition) => self.partition.of_equation(addition.equation),
            None => self.partition.of_unknown(i),
        };
        joins.extend(other.map(|other| (self.part, other)));
    }
}

impl IndexReduction<'_> {
    /// The system of the equations of a part in one combination, its states not yet chosen; `None` if the part has to be
    /// joined with another one.
    fn run(
        &self,
        graph: &mut ExprGraph,
        own: PartModes<'_>,
        variables: &mut UnknownList,
        tied: &mut BTreeSet<usize>,
        joins: &mut BTreeSet<(usize, usize)>,
        diagnostics: &mut Diagnostics,
    ) -> Result<Option<ExplicitSystem>, ErrorReported> {
        let IndexReduction { model, transferred, ref slopes, typical, is_whole } = *self;
        let equations = &transferred.equations;
        let part = own.part();
        let automata = part.automata.iter().copied();
        let mut modes = ModeCombinations::start_modes(model);
        for (automaton, mode) in automata.clone().zip(own.modes) {
            modes[automaton] = *mode;
        }
        let holding = transferred.holding(&modes).into_iter();
        let holding: Vec<usize> = holding.filter(|e| part.equations.contains(e)).collect();
        let context = &in_modes(model, automata, own.modes);
        if is_whole {
            let counted = verify_counts(model, graph, equations, &holding, context, diagnostics);
            counted.inspect_err(|_| tie_what_is_read(model, graph, equations, &holding, tied))?;
        }
        let solved = solve_for_derivatives(graph, equations, &holding, variables);
        let in_use = in_use(graph, part, variables, &solved);
        let reduced = match reduce(graph, solved, &in_use, part, variables, equations, slopes) {
            Ok(reduced) => reduced,
            Err(ReductionRefusal { obstacle: Obstacle::Foreign(i), .. }) => {
                own.join(variables, i, joins);
                return Ok(None);
            }
            Err(refusal) => {
                tied.extend(refusal.elements.iter().map(|i| array_of(model, *i)));
                return Err(refuse(model, equations, variables, context, &refusal, diagnostics));
            }
        };
        if reduced.algebraic.len() < reduced.unknowns.len() {
            // Equations of other parts determine the rest.
            let before = joins.len();
            for (other, part) in own.partition.parts.iter().enumerate() {
                let mut reads =
                    part.equations.iter().flat_map(|e| graph.symbols(equations[*e].rest));
                if other != own.part
                    && reads.any(|symbol| match symbol {
                        Symbol::Unknown(i) => reduced.unknowns.contains(&i),
                        _ => false,
                    })
                {
                    joins.insert((own.part, other));
                }
            }
            if joins.len() == before {
                verify_counts(model, graph, equations, &holding, context, diagnostics)?;
            }
            return Ok(None);
        }
        let blocks = blocks_of(graph, &reduced, variables, &|symbol| typical.value(symbol));
        let blocks = blocks.map_err(|rows| {
            let rows = rows.into_iter().map(|row| &reduced.constraints[row]);
            no_choice(equations, rows, context, diagnostics)
        })?;
        Ok(Some(ExplicitSystem { reduced, blocks }))
    }
}

/// Counts the equations in the initial modes, and with each block in each of its other modes.
fn verify_each_mode(
    model: &Model,
    graph: &ExprGraph,
    transferred: &TransferredModel<'_>,
    counted: &BTreeSet<usize>,
    diagnostics: &mut Diagnostics,
) -> Result<(), ErrorReported> {
    let verify = |modes: &[usize], context: &str, diagnostics: &mut Diagnostics| {
        let holding = transferred.holding(modes).into_iter();
        let holding: Vec<usize> = holding.filter(|e| counted.contains(e)).collect();
        verify_counts(model, graph, &transferred.equations, &holding, context, diagnostics)
    };
    let start = ModeCombinations::start_modes(model);
    verify(&start, "", diagnostics)?;
    for (k, automaton) in model.automata.iter().enumerate() {
        for mode in (0..automaton.modes.len()).filter(|mode| *mode != start[k]) {
            let mut modes = start.clone();
            modes[k] = mode;
            let context = in_modes(model, std::iter::once(k), &[mode]);
            verify(&modes, &context, diagnostics)?;
        }
    }
    Ok(())
}

/// Adds the arrays that single equations read: these may prevent the match.
fn tie_what_is_read(
    model: &Model,
    graph: &ExprGraph,
    equations: &[TransferredEquation<'_>],
    single: &[usize],
    tied: &mut BTreeSet<usize>,
) {
    let symbols = single.iter().flat_map(|e| graph.symbols(equations[*e].rest));
    let elements = symbols.filter_map(|symbol| match symbol {
        Symbol::Element(i) | Symbol::ElementRate(i) => Some(i),
        _ => None,
    });
    tied.extend(elements.map(|i| array_of(model, i)));
}

/// The position of the array that holds an element.
fn array_of(model: &Model, element: u32) -> usize {
    model.arrays.partition_point(|array| array.first <= element).saturating_sub(1)
}

/// The unknowns of a part in a combination of modes: the declared ones, and those that its equations have added.
fn in_use(
    graph: &ExprGraph,
    part: &SystemPart,
    variables: &UnknownList,
    solved: &SolvedDerivatives,
) -> Vec<u32> {
    let rests = solved.algebraic.iter().map(|residual| residual.rest);
    let read = graph.reachable(rests.chain(solved.rates.values().map(|rate| rate.value)));
    let read = read.into_iter().filter_map(|id| match graph.node(id) {
        Node::Symbol(Symbol::Unknown(i)) => Some(i),
        _ => None,
    });
    let added = read.chain(solved.rates.keys().copied()).filter(|i| variables.is_of(*i, part));
    let mut used: Vec<u32> = part.unknowns.iter().copied().chain(added).collect();
    used.sort_unstable();
    used.dedup();
    used
}

/// Labels of the equations of an unknown's rows, each once and in an order that does not depend on the file.
fn labels<'a>(
    equations: &[TransferredEquation<'_>],
    rows: impl Iterator<Item = &'a ExplicitRow>,
) -> String {
    let mut labels: Vec<String> = Vec::new();
    for row in rows {
        let mut label = equations[row.equation].label.to_owned();
        for _ in 0..row.order {
            label = format!("der({label})");
        }
        if !labels.contains(&label) {
            labels.push(label);
        }
    }
    labels.sort_unstable();
    labels.join(" / ")
}
