//! The rows of one combination of modes: derivatives are solved for, the other equations find their
//! algebraic unknowns.

use std::collections::{BTreeMap, BTreeSet};

use super::Unknown;
use super::counts::{more_places, quoted};
use super::matching::maximum_matching;
use super::transfer::Equation;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, Reported};
use crate::expr::{ExprId, Graph, Symbol};

/// The equations that hold in a combination of modes, and what they give at once.
pub(super) struct Explicit {
    /// How messages speak of the combination.
    pub(super) context: String,
    /// Positions among all equations.
    pub(super) equations: Vec<usize>,
    /// ẋ = f by this equation.
    pub(super) solved: BTreeMap<u32, (ExprId, usize)>,
    /// Derivatives that no equation gives alone, with an equation that they occur in.
    pub(super) implicit: BTreeMap<u32, usize>,
}

/// The algebraic unknown that stands for a derivative.
pub(super) struct Rate {
    pub(super) index: usize,
    /// An equation that it occurs in.
    pub(super) equation: usize,
}

/// A row: ẏ = rhs or 0 = rhs.
#[derive(Clone)]
pub(super) struct Row {
    pub(super) rhs: ExprId,
    pub(super) differential: bool,
    pub(super) equation: usize,
}

/// ẋ = f where an equation can be solved for ẋ alone.
pub(super) fn solve_for_derivatives(
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
            && let Some(rhs) = solve_for_derivative(graph, equations[e].rest, Symbol::Derivative(i))
        {
            system.solved.insert(i, (rhs, e));
        } else {
            system.implicit.insert(i, users[0]);
        }
    }
    system
}

/// The rows of one combination of modes, in the order of the unknowns.
pub(super) fn rows_of(
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

/// f in ẋ = f, where 0 = r − l is a ẋ + b with a free of derivatives: f = −b/a.
pub(super) fn solve_for_derivative(
    graph: &mut Graph,
    rest: ExprId,
    rate: Symbol,
) -> Option<ExprId> {
    let gradient = graph.gradient(rest, |s| (s == rate).then_some(0));
    let [(_, a)] = gradient[..] else { return None };
    let is_rate = |s: &Symbol| {
        matches!(s, Symbol::Derivative(_) | Symbol::ElementRate(_) | Symbol::SweptRate(_))
    };
    if graph.symbols(a).iter().any(is_rate) {
        return None;
    }
    let zero = graph.constant(0.0);
    let b = graph.substitute(rest, |s| (s == rate).then_some(zero));
    let minus_a = graph.negate(a);
    Some(graph.divide(b, minus_a))
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
