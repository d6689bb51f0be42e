//! Model → Dae: constants become numbers, derivatives are solved for, rows find their unknowns.

use std::collections::BTreeMap;

use super::delays;
use super::matching::maximum_matching;
use super::{Dae, Output, Unknown};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, Reported};
use crate::expr::{ExprId, Graph, Symbol};
use crate::model::Model;
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
/// # Errors
///
/// [`Reported`] where equations and unknowns do not match, or the index is above 1.
pub fn assemble(model: &Model, diagnostics: &mut Diagnostics) -> Result<Dae, Reported> {
    let mut graph = Graph::default();
    let mut transferred = transfer(model, &mut graph);
    let delays = delays::resolve(model, &mut graph, &mut transferred, diagnostics)?;
    let Transferred { equations, starts, outputs, names } = transferred;

    verify_counts(model, &graph, &equations, diagnostics)?;

    let n = model.unknowns.len();
    let mut rows: Vec<Option<Row>> = vec![None; n];
    let mut unknowns: Vec<Pending> = model
        .unknowns
        .iter()
        .zip(starts)
        .map(|(unknown, start)| Pending {
            name: unknown.declared.name.clone(),
            unit: unknown.declared.unit.clone(),
            doc: unknown.declared.doc.clone(),
            nominal: unknown.nominal,
            fixed: unknown.fixed,
            start,
        })
        .collect();

    // ẋ = f where an equation can be solved for ẋ alone.
    let mut users: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (e, equation) in equations.iter().enumerate() {
        for i in &equation.derivatives {
            users.entry(*i).or_default().push(e);
        }
    }
    let mut is_explicit = vec![false; equations.len()];
    for (&i, users) in &users {
        if let [e] = users[..]
            && equations[e].derivatives == [i]
            && let Some(rhs) = solve_for_derivative(&mut graph, equations[e].rest, i)
        {
            is_explicit[e] = true;
            rows[i as usize] = Some(Row { rhs, differential: true, equation: e });
        }
    }

    // Any other derivative becomes an algebraic unknown z with ẋ = z.
    let mut replaced: BTreeMap<u32, ExprId> = BTreeMap::new();
    for (&i, users) in &users {
        if rows[i as usize].is_some() {
            continue;
        }
        let of = &unknowns[i as usize];
        let rate = Pending {
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
            fixed: false,
            start: graph.constant(0.0),
        };
        let index = u32::try_from(unknowns.len()).unwrap_or(u32::MAX);
        let z = graph.symbol(Symbol::Unknown(index));
        unknowns.push(rate);
        rows.push(None);
        rows[i as usize] = Some(Row { rhs: z, differential: true, equation: users[0] });
        replaced.insert(i, z);
    }
    let algebraic_equations: Vec<(usize, ExprId)> = (0..equations.len())
        .filter(|e| !is_explicit[*e])
        .map(|e| {
            let rest = graph.substitute(equations[e].rest, |symbol| match symbol {
                Symbol::Derivative(i) => replaced.get(&i).copied(),
                _ => None,
            });
            (e, rest)
        })
        .collect();
    match_algebraic(&graph, &equations, &algebraic_equations, &unknowns, &mut rows, diagnostics)?;

    let mut dae_outputs = Vec::with_capacity(outputs.len());
    let late = outputs.into_iter().zip(delays.of_outputs);
    for (output, (value, delay)) in model.outputs.iter().zip(late) {
        let rate = |symbol| match symbol {
            Symbol::Derivative(i) => {
                let row = rows[i as usize].as_ref();
                row.and_then(|row| row.differential.then_some(row.rhs))
            }
            _ => None,
        };
        let value = graph.substitute(value, rate);
        if let Some(Symbol::Derivative(i)) =
            graph.symbols(value).into_iter().find(|symbol| matches!(symbol, Symbol::Derivative(_)))
        {
            let name = &unknowns[i as usize].name;
            diagnostics.error(
                Diagnostic::new(
                    Code::E406,
                    output.declared.span,
                    format!(
                        "output `{}` reads der({name}), which no equation gives",
                        output.declared.name
                    ),
                )
                .label(model.unknowns[i as usize].declared.span, "algebraic in this variant"),
            );
        }
        let declared = output.declared.clone();
        dae_outputs.push(Output { declared, value, noise: output.noise, delay });
    }
    diagnostics.check()?;

    let unknowns = unknowns
        .into_iter()
        .zip(rows)
        .map(|(unknown, row)| {
            let row = row.unwrap_or_else(|| unreachable!("every unknown has been matched"));
            Unknown {
                name: unknown.name,
                unit: unknown.unit,
                doc: unknown.doc,
                nominal: unknown.nominal,
                differential: row.differential,
                rhs: row.rhs,
                start: unknown.start,
                fixed: unknown.fixed,
                equation: equations[row.equation].label.to_owned(),
                span: equations[row.equation].span,
            }
        })
        .collect();
    Ok(Dae {
        name: model.name.clone(),
        doc: model.doc.clone(),
        graph,
        unknowns,
        parameters: model.parameters.clone(),
        inputs: model.inputs.clone(),
        delays: delays.delays,
        delayed_inputs: delays.inputs,
        outputs: dae_outputs,
        names,
        variants: model.variants.clone(),
    })
}

/// An unknown before its row is known.
struct Pending {
    name: String,
    unit: Unit,
    doc: Vec<String>,
    nominal: Option<f64>,
    fixed: bool,
    start: ExprId,
}

/// A row: ẏ = rhs or 0 = rhs.
#[derive(Clone)]
struct Row {
    rhs: ExprId,
    differential: bool,
    equation: usize,
}

/// Expressions of a model in the graph of its system.
pub(super) struct Transferred<'a> {
    pub(super) equations: Vec<Equation<'a>>,
    pub(super) starts: Vec<ExprId>,
    pub(super) outputs: Vec<ExprId>,
    pub(super) names: BTreeMap<ExprId, String>,
}

/// Everything into one simplified graph: equations, start values, outputs, names.
fn transfer<'a>(model: &'a Model, graph: &mut Graph) -> Transferred<'a> {
    let sides = model.equations.iter().flat_map(|e| [e.left, e.right]);
    let roots = sides
        .chain(model.unknowns.iter().map(|u| u.start))
        .chain(model.outputs.iter().map(|o| o.value));
    let nodes = model.graph.listed(roots);
    let built = graph.rebuild(&nodes, |graph, symbol| match symbol {
        Symbol::Constant(i) => graph.constant(model.constants[i as usize].value),
        other => graph.symbol(other),
    });
    let equations = model
        .equations
        .iter()
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
    let names = model
        .lets
        .iter()
        .filter_map(|l| built.get(&l.value).map(|id| (*id, l.name.clone())))
        .filter(|(id, _)| graph.node(*id).operands().next().is_some())
        .collect();
    let starts = model.unknowns.iter().map(|u| built[&u.start]).collect();
    let outputs = model.outputs.iter().map(|o| built[&o.value]).collect();
    Transferred { equations, starts, outputs, names }
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
    equations: &[Equation<'_>],
    diagnostics: &mut Diagnostics,
) -> Result<(), Reported> {
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
        "{n_equations} {} for {n_unknowns} {}",
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
                "nothing determines {unknown_names}, and no unknown is left for {equation_names}"
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
    algebraic: &[(usize, ExprId)],
    unknowns: &[Pending],
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
                "the index is above 1: {names} only ties states together, and {loose} follows \
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
