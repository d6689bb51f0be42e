//! Model → Dae: constants become numbers, derivatives are solved for, rows find their unknowns.

use std::collections::{BTreeMap, BTreeSet};

use super::delays;
use super::matching::maximum_matching;
use super::modes::{Combinations, in_modes};
use super::time_conditions::time_conditions;
use super::{Automaton, Dae, Output, TimeCondition, Transition, Unknown};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, Reported};
use crate::expr::{ExprId, Graph, Symbol};
use crate::model::{self, Model};
use crate::source::Span;
use crate::units::Unit;

/// An equation as l − r with r − l kept: 0 = r − l.
pub(super) struct Equation<'a> {
    pub(super) label: &'a str,
    pub(super) span: Span,
    /// r − l.
    pub(super) rest: ExprId,
    /// Derivatives that occur in it.
    derivatives: Vec<u32>,
}

/// Brings a model to the form M ẏ = f.
///
/// Every combination of modes is brought there by itself; the rows then choose between them.
///
/// # Errors
///
/// [`Reported`] where equations and unknowns do not match, or the index is above 1.
pub fn assemble(model: &Model, diagnostics: &mut Diagnostics) -> Result<Dae, Reported> {
    let combinations = Combinations::of(model, diagnostics)?;
    let mut graph = Graph::default();
    let mut transferred = transfer(model, &mut graph);
    // First delays, as a condition on a time that is past switches at a time of its own.
    let delays = delays::resolve(model, &mut graph, &mut transferred, diagnostics)?;
    let time_conditions = transferred.take_time_conditions(&mut graph, model.automata.len());
    let equations = &transferred.equations;

    let mut systems: Vec<Explicit> = Vec::new();
    for modes in combinations.iter() {
        let system = Explicit {
            context: in_modes(model, &modes),
            equations: transferred.holding(&modes),
            solved: BTreeMap::new(),
            implicit: BTreeMap::new(),
        };
        verify_counts(model, &graph, equations, &system, diagnostics)?;
        systems.push(solve_for_derivatives(&mut graph, equations, system));
    }

    // A derivative that no equation gives alone becomes an algebraic unknown z with ẋ = z.
    let mut unknowns = declared_unknowns(model, transferred.starts);
    let mut rates: BTreeMap<u32, Rate> = BTreeMap::new();
    for (&i, &equation) in systems.iter().flat_map(|system| &system.implicit) {
        rates.entry(i).or_insert(Rate { index: 0, equation });
    }
    for (i, rate) in &mut rates {
        rate.index = unknowns.len();
        unknowns.push(rate_of(&unknowns[*i as usize], &mut graph));
    }

    let mut rows: Vec<Vec<Row>> = vec![Vec::new(); unknowns.len()];
    for system in &systems {
        let one = rows_of(&mut graph, equations, system, &rates, &unknowns, diagnostics)?;
        for (all, row) in rows.iter_mut().zip(one) {
            all.push(row);
        }
    }

    let start = combinations.start(model);
    let mut slopes: Vec<Option<ExprId>> = Vec::new();
    let mut complete = Vec::new();
    for (unknown, rows) in unknowns.into_iter().zip(rows) {
        let values = rows.iter().map(|row| row.rhs).collect();
        let rhs = combinations.merge(&mut graph, values);
        let masses = rows.iter().map(|row| f64::from(u8::from(row.differential)));
        let masses = masses.map(|mass| graph.constant(mass)).collect();
        slopes.push(rows.iter().all(|row| row.differential).then_some(rhs));
        complete.push(Unknown {
            mass: combinations.merge(&mut graph, masses),
            differential: rows[start].differential,
            rhs,
            equation: labels(equations, &rows),
            span: equations[rows[start].equation].span,
            ..unknown
        });
    }

    let rate = |symbol| match symbol {
        Symbol::Derivative(i) => slopes[i as usize],
        _ => None,
    };
    let mut reader = DerivativeReader { model, rate, graph: &mut graph, diagnostics };
    let mut outputs = Vec::with_capacity(model.outputs.len());
    let late = transferred.outputs.into_iter().zip(delays.of_outputs);
    for (output, (value, delay)) in model.outputs.iter().zip(late) {
        let declared = output.declared.clone();
        let what = || format!("output `{}`", declared.name);
        let value = reader.open(value, declared.span, &what);
        outputs.push(Output { declared, value, noise: output.noise, delay });
    }
    let automata = model
        .automata
        .iter()
        .zip(transferred.transitions)
        .map(|(automaton, transitions)| automaton_of(automaton, transitions, &mut reader))
        .collect();
    diagnostics.check()?;

    Ok(Dae {
        name: model.name.clone(),
        doc: model.doc.clone(),
        graph,
        unknowns: complete,
        parameters: model.parameters.clone(),
        inputs: model.inputs.clone(),
        delays: delays.delays,
        delayed_inputs: delays.inputs,
        outputs,
        names: transferred.names,
        variants: model.variants.clone(),
        automata,
        time_conditions,
    })
}

/// The equations that hold in a combination of modes, and what they give at once.
struct Explicit {
    /// How messages speak of the combination.
    context: String,
    /// Positions among all equations.
    equations: Vec<usize>,
    /// ẋ = f by this equation.
    solved: BTreeMap<u32, (ExprId, usize)>,
    /// Derivatives that no equation gives alone, with an equation that they occur in.
    implicit: BTreeMap<u32, usize>,
}

/// The algebraic unknown that stands for a derivative.
struct Rate {
    index: usize,
    /// An equation that it occurs in.
    equation: usize,
}

/// A row: ẏ = rhs or 0 = rhs.
#[derive(Clone)]
struct Row {
    rhs: ExprId,
    differential: bool,
    equation: usize,
}

/// ẋ = f where an equation can be solved for ẋ alone.
fn solve_for_derivatives(
    graph: &mut Graph,
    equations: &[Equation<'_>],
    mut system: Explicit,
) -> Explicit {
    let mut users: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for &e in &system.equations {
        for i in &equations[e].derivatives {
            users.entry(*i).or_default().push(e);
        }
    }
    for (i, users) in users {
        if let [e] = users[..]
            && equations[e].derivatives == [i]
            && let Some(rhs) = solve_for_derivative(graph, equations[e].rest, i)
        {
            system.solved.insert(i, (rhs, e));
        } else {
            system.implicit.insert(i, users[0]);
        }
    }
    system
}

/// The rows of one combination of modes, in the order of the unknowns.
fn rows_of(
    graph: &mut Graph,
    equations: &[Equation<'_>],
    system: &Explicit,
    rates: &BTreeMap<u32, Rate>,
    unknowns: &[Unknown],
    diagnostics: &mut Diagnostics,
) -> Result<Vec<Row>, Reported> {
    let mut rows: Vec<Option<Row>> = vec![None; unknowns.len()];
    for (&i, &(rhs, equation)) in &system.solved {
        rows[i as usize] = Some(Row { rhs, differential: true, equation });
    }
    for (&i, rate) in rates {
        let symbol = Symbol::Unknown(u32::try_from(rate.index).unwrap_or(u32::MAX));
        let z = graph.symbol(symbol);
        if let Some(&equation) = system.implicit.get(&i) {
            rows[i as usize] = Some(Row { rhs: z, differential: true, equation });
        } else {
            // Other modes need it: 0 = ẋ − z, and 0 = −z where x is algebraic.
            let slope = system.solved.get(&i).map(|(rhs, _)| *rhs);
            let slope = slope.unwrap_or_else(|| graph.constant(0.0));
            let rhs = graph.subtract(slope, z);
            rows[rate.index] = Some(Row { rhs, differential: false, equation: rate.equation });
        }
    }
    let solved: BTreeSet<usize> = system.solved.values().map(|(_, equation)| *equation).collect();
    let replaced: BTreeMap<u32, ExprId> = system
        .implicit
        .keys()
        .map(|i| {
            let index = u32::try_from(rates[i].index).unwrap_or(u32::MAX);
            (*i, graph.symbol(Symbol::Unknown(index)))
        })
        .collect();
    let algebraic: Vec<(usize, ExprId)> = system
        .equations
        .iter()
        .filter(|e| !solved.contains(e))
        .map(|&e| {
            let rest = graph.substitute(equations[e].rest, |symbol| match symbol {
                Symbol::Derivative(i) => replaced.get(&i).copied(),
                _ => None,
            });
            (e, rest)
        })
        .collect();
    match_algebraic(
        graph,
        equations,
        (&algebraic, &system.context),
        unknowns,
        &mut rows,
        diagnostics,
    )?;
    Ok(rows
        .into_iter()
        .map(|row| row.unwrap_or_else(|| unreachable!("every unknown has been matched")))
        .collect())
}

/// Labels of the equations of an unknown's rows, each once.
fn labels(equations: &[Equation<'_>], rows: &[Row]) -> String {
    let mut labels: Vec<&str> = Vec::new();
    for row in rows {
        let label = equations[row.equation].label;
        if !labels.contains(&label) {
            labels.push(label);
        }
    }
    labels.join(" / ")
}

/// The unknowns as declared, their rows still open.
fn declared_unknowns(model: &Model, starts: Vec<ExprId>) -> Vec<Unknown> {
    let unknowns = model.unknowns.iter().zip(starts);
    unknowns
        .map(|(unknown, start)| Unknown {
            name: unknown.declared.name.clone(),
            unit: unknown.declared.unit.clone(),
            doc: unknown.declared.doc.clone(),
            nominal: unknown.nominal,
            differential: false,
            mass: start,
            rhs: start,
            start,
            fixed: unknown.fixed,
            equation: String::new(),
            span: unknown.declared.span,
        })
        .collect()
}

/// The unknown `der(x)` of an unknown x, its row still open.
fn rate_of(of: &Unknown, graph: &mut Graph) -> Unknown {
    let zero = graph.constant(0.0);
    Unknown {
        name: format!("der({})", of.name),
        unit: Unit {
            symbol: format!("{}/s", of.unit.symbol),
            dimension: of.unit.dimension,
            offset: 0.0,
            datum: None,
            ..of.unit
        },
        doc: Vec::new(),
        nominal: None,
        differential: false,
        mass: zero,
        rhs: zero,
        start: zero,
        fixed: false,
        equation: String::new(),
        span: of.span,
    }
}

/// Puts the rows' right-hand sides in the place of derivatives.
struct DerivativeReader<'a, F> {
    model: &'a Model,
    rate: F,
    graph: &'a mut Graph,
    diagnostics: &'a mut Diagnostics,
}

impl<F: Fn(Symbol) -> Option<ExprId>> DerivativeReader<'_, F> {
    /// The expression without derivatives; `what` reads it.
    fn open(&mut self, value: ExprId, span: Span, what: &dyn Fn() -> String) -> ExprId {
        let opened = self.graph.substitute(value, &self.rate);
        let symbols = self.graph.symbols(opened);
        let left = symbols.into_iter().find(|symbol| matches!(symbol, Symbol::Derivative(_)));
        if let Some(Symbol::Derivative(i)) = left {
            let unknown = &self.model.unknowns[i as usize].declared;
            let scope =
                if self.model.automata.is_empty() { "variant" } else { "variant or a mode" };
            let message =
                format!("{} reads der({}), which no equation gives", what(), unknown.name);
            self.diagnostics.error(
                Diagnostic::new(Code::E406, span, message)
                    .label(unknown.span, format!("algebraic in this {scope}")),
            );
        }
        opened
    }
}

fn automaton_of<F: Fn(Symbol) -> Option<ExprId>>(
    automaton: &model::Automaton,
    values: Vec<(ExprId, Vec<ExprId>)>,
    reader: &mut DerivativeReader<'_, F>,
) -> Automaton {
    let transitions = automaton.transitions.iter().zip(values).map(|(transition, values)| {
        let (event, resets) = values;
        let what = || format!("a transition of `{}`", automaton.name);
        let event = reader.open(event, transition.span, &what);
        let resets =
            transition.resets.iter().zip(resets).map(|(reset, value)| {
                (reset.unknown as usize, reader.open(value, reset.span, &what))
            });
        Transition {
            from: transition.from,
            to: transition.to,
            crossing: transition.crossing,
            event,
            resets: resets.collect(),
        }
    });
    let transitions = transitions.collect();
    Automaton {
        name: automaton.name.clone(),
        modes: automaton.modes.iter().map(|mode| mode.name.clone()).collect(),
        start: automaton.start,
        transitions,
    }
}

/// A model's expressions in the graph of its `Dae`.
pub(super) struct Transferred<'a> {
    /// Those that always hold, then those of the modes, block by block.
    pub(super) equations: Vec<Equation<'a>>,
    common: usize,
    /// For each block and mode, where its equations begin and end.
    of_modes: Vec<Vec<(usize, usize)>>,
    pub(super) starts: Vec<ExprId>,
    pub(super) outputs: Vec<ExprId>,
    /// For each block and transition, left − right and the values of its resets.
    pub(super) transitions: Vec<Vec<(ExprId, Vec<ExprId>)>>,
    pub(super) names: BTreeMap<ExprId, String>,
}

impl Transferred<'_> {
    /// Positions of the equations that hold in these modes.
    fn holding(&self, modes: &[usize]) -> Vec<usize> {
        let of_modes = self.of_modes.iter().zip(modes).map(|(block, mode)| block[*mode]);
        (0..self.common).chain(of_modes.flat_map(|(begin, end)| begin..end)).collect()
    }

    /// Puts discrete numbers, from position `first` on, in the place of conditions on time.
    fn take_time_conditions(&mut self, graph: &mut Graph, first: usize) -> Vec<TimeCondition> {
        let roots: Vec<ExprId> = self.expressions().map(|expression| *expression).collect();
        let (conditions, replacement) = time_conditions(graph, roots.iter().copied(), first);
        if !conditions.is_empty() {
            let roots: Vec<ExprId> = roots.into_iter().chain(self.names.keys().copied()).collect();
            let replaced = graph.replace(roots, &replacement);
            for expression in self.expressions() {
                *expression = replaced[expression];
            }
            let names = std::mem::take(&mut self.names);
            self.names = names.into_iter().map(|(id, name)| (replaced[&id], name)).collect();
        }
        conditions
    }

    /// Everything but the names.
    fn expressions(&mut self) -> impl Iterator<Item = &mut ExprId> {
        let transitions = self.transitions.iter_mut().flatten();
        let equations = self.equations.iter_mut().map(|equation| &mut equation.rest);
        equations
            .chain(&mut self.starts)
            .chain(&mut self.outputs)
            .chain(transitions.flat_map(|(event, resets)| std::iter::once(event).chain(resets)))
    }
}

/// Everything into one simplified graph.
fn transfer<'a>(model: &'a Model, graph: &mut Graph) -> Transferred<'a> {
    let transitions = || model.automata.iter().flat_map(|automaton| &automaton.transitions);
    let sides = model.all_equations().flat_map(|e| [e.left, e.right]);
    let roots = sides
        .chain(model.unknowns.iter().map(|u| u.start))
        .chain(model.outputs.iter().map(|o| o.value))
        .chain(transitions().flat_map(|t| [t.left, t.right]))
        .chain(transitions().flat_map(|t| t.resets.iter().map(|reset| reset.value)));
    let nodes = model.graph.listed(roots);
    let built = graph.rebuild(&nodes, |graph, symbol| match symbol {
        Symbol::Constant(i) => graph.constant(model.constants[i as usize].value),
        other => graph.symbol(other),
    });
    let equations = model
        .all_equations()
        .map(|equation| {
            let rest = graph.subtract(built[&equation.right], built[&equation.left]);
            let derivatives = graph
                .symbols(rest)
                .into_iter()
                .filter_map(|symbol| match symbol {
                    Symbol::Derivative(i) => Some(i),
                    _ => None,
                })
                .collect();
            Equation { label: &equation.label, span: equation.span, rest, derivatives }
        })
        .collect();
    let common = model.equations.len();
    let mut begin = common;
    let mut of_modes = Vec::new();
    for automaton in &model.automata {
        let ranges = automaton.modes.iter().map(|mode| {
            let end = begin + mode.equations.len();
            (std::mem::replace(&mut begin, end), end)
        });
        of_modes.push(ranges.collect());
    }
    let mut transitions = Vec::new();
    for automaton in &model.automata {
        let values = automaton.transitions.iter().map(|transition| {
            let event = graph.subtract(built[&transition.left], built[&transition.right]);
            (event, transition.resets.iter().map(|reset| built[&reset.value]).collect())
        });
        transitions.push(values.collect());
    }
    let names = model
        .lets
        .iter()
        .filter_map(|l| built.get(&l.value).map(|id| (*id, l.name.clone())))
        .filter(|(id, _)| graph.node(*id).operands().next().is_some())
        .collect();
    Transferred {
        equations,
        common,
        of_modes,
        starts: model.unknowns.iter().map(|u| built[&u.start]).collect(),
        outputs: model.outputs.iter().map(|o| built[&o.value]).collect(),
        transitions,
        names,
    }
}

/// f in ẋ = f, where 0 = r − l is a ẋ + b with a free of derivatives: f = −b/a.
fn solve_for_derivative(graph: &mut Graph, rest: ExprId, i: u32) -> Option<ExprId> {
    let gradient = graph.gradient(rest, |s| (s == Symbol::Derivative(i)).then_some(0));
    let [(_, a)] = gradient[..] else { return None };
    if graph.symbols(a).iter().any(|s| matches!(s, Symbol::Derivative(_))) {
        return None;
    }
    let zero = graph.constant(0.0);
    let b = graph.substitute(rest, |s| (s == Symbol::Derivative(i)).then_some(zero));
    let minus_a = graph.negate(a);
    Some(graph.divide(b, minus_a))
}

/// As many equations as unknowns, each with something to say about one of its own.
fn verify_counts(
    model: &Model,
    graph: &Graph,
    all: &[Equation<'_>],
    system: &Explicit,
    diagnostics: &mut Diagnostics,
) -> Result<(), Reported> {
    let equations: Vec<&Equation<'_>> = system.equations.iter().map(|e| &all[*e]).collect();
    let context = &system.context;
    let incidence: Vec<Vec<usize>> = equations
        .iter()
        .map(|equation| {
            let mut unknowns: Vec<usize> = graph
                .symbols(equation.rest)
                .into_iter()
                .filter_map(|symbol| match symbol {
                    Symbol::Unknown(i) | Symbol::Derivative(i) => Some(i as usize),
                    _ => None,
                })
                .collect();
            unknowns.sort_unstable();
            unknowns.dedup();
            unknowns
        })
        .collect();
    let mut empty = None;
    for (equation, unknowns) in equations.iter().zip(&incidence) {
        if unknowns.is_empty() {
            empty = Some(
                diagnostics.error(
                    Diagnostic::new(
                        Code::E405,
                        equation.span,
                        format!("equation `{}` determines nothing", equation.label),
                    )
                    .here("no unknown is left in it")
                    .help("it holds always or never; leave it out, or let it read a state"),
                ),
            );
        }
    }
    empty.map_or(Ok(()), Err)?;

    let matching = maximum_matching(&incidence, model.unknowns.len());
    let free_equations: Vec<usize> = matching.free_rows().collect();
    let free_unknowns: Vec<usize> = matching.free_columns().collect();
    let (n_equations, n_unknowns) = (equations.len(), model.unknowns.len());
    let equation_names = quoted(free_equations.iter().map(|e| equations[*e].label));
    let unknown_names =
        quoted(free_unknowns.iter().map(|u| model.unknowns[*u].declared.name.as_str()));
    let counts = format!(
        "{n_equations} {} for {n_unknowns} {}{context}",
        plural(n_equations, "equation"),
        plural(n_unknowns, "unknown")
    );
    if free_equations.is_empty() && free_unknowns.is_empty() {
        return Ok(());
    }
    if n_equations > n_unknowns {
        let first = &equations[free_equations[0]];
        let diagnostic = Diagnostic::new(
            Code::E401,
            first.span,
            format!("too many equations, {counts}: no unknown is left for {equation_names}"),
        )
        .help("leave out what has been said already, or declare the unknown that is missing");
        return Err(diagnostics.error(more_places(
            diagnostic,
            free_equations.iter().skip(1).map(|e| equations[*e].span),
            "this one too",
        )));
    }
    let first = &model.unknowns[free_unknowns[0]].declared;
    let others = free_unknowns.iter().skip(1).map(|u| model.unknowns[*u].declared.span);
    let diagnostic = if n_equations < n_unknowns {
        Diagnostic::new(
            Code::E402,
            first.span,
            format!("too few equations, {counts}: nothing determines {unknown_names}"),
        )
        .help("add an equation that determines it, or declare it as an input")
    } else {
        let spare = free_equations.iter().map(|e| equations[*e].span);
        let diagnostic = Diagnostic::new(
            Code::E403,
            first.span,
            format!(
                "nothing determines {unknown_names}, and no unknown is left for \
                 {equation_names}{context}"
            ),
        )
        .help("the counts match, but several equations determine the same unknowns");
        more_places(diagnostic, spare, "one too many for the unknowns in it")
    };
    Err(diagnostics.error(more_places(diagnostic, others, "nor this")))
}

/// Gives the algebraic unknowns the equations that determine them.
fn match_algebraic(
    graph: &Graph,
    equations: &[Equation<'_>],
    (algebraic, context): (&[(usize, ExprId)], &str),
    unknowns: &[Unknown],
    rows: &mut [Option<Row>],
    diagnostics: &mut Diagnostics,
) -> Result<(), Reported> {
    let columns: Vec<usize> = (0..rows.len()).filter(|i| rows[*i].is_none()).collect();
    let mut position = vec![None; rows.len()];
    for (column, unknown) in columns.iter().enumerate() {
        position[*unknown] = Some(column);
    }
    let incidence: Vec<Vec<usize>> = algebraic
        .iter()
        .map(|(_, rest)| {
            graph
                .symbols(*rest)
                .into_iter()
                .filter_map(|symbol| match symbol {
                    Symbol::Unknown(i) => position[i as usize],
                    _ => None,
                })
                .collect()
        })
        .collect();
    let matching = maximum_matching(&incidence, columns.len());
    let free: Vec<usize> = matching.free_rows().map(|row| algebraic[row].0).collect();
    if let Some(first) = free.first() {
        let names = quoted(free.iter().map(|e| equations[*e].label));
        let loose = quoted(matching.free_columns().map(|c| unknowns[columns[c]].name.as_str()));
        let diagnostic = Diagnostic::new(
            Code::E404,
            equations[*first].span,
            format!(
                "the index is above 1{context}: {names} only ties states together, and {loose} follows \
                 from no equation without differentiating it"
            ),
        )
        .help("replace the equation by its derivative with respect to time");
        let others = free.iter().skip(1).map(|e| equations[*e].span);
        return Err(diagnostics.error(more_places(diagnostic, others, "this one too")));
    }
    for ((e, rest), column) in algebraic.iter().zip(&matching.of_row) {
        let unknown = columns[column.unwrap_or_else(|| unreachable!("no row is free"))];
        rows[unknown] = Some(Row { rhs: *rest, differential: false, equation: *e });
    }
    Ok(())
}

/// At most this many places and names are shown of a long list.
const MOST_SHOWN: usize = 5;

fn quoted<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.collect();
    let mut shown: Vec<String> =
        names.iter().take(MOST_SHOWN).map(|name| format!("`{name}`")).collect();
    if names.len() > MOST_SHOWN {
        shown.push(format!("{} more", names.len() - MOST_SHOWN));
    }
    shown.join(", ")
}

fn more_places(
    diagnostic: Diagnostic,
    spans: impl Iterator<Item = Span>,
    text: &str,
) -> Diagnostic {
    spans.take(MOST_SHOWN - 1).fold(diagnostic, |diagnostic, span| diagnostic.label(span, text))
}

fn plural(n: usize, noun: &str) -> String {
    if n == 1 { noun.to_owned() } else { format!("{noun}s") }
}
