//! The order in which constants and `let`s are evaluated.

use std::collections::BTreeMap;

use super::ModelScope;
use super::names::names_in;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::syntax::ast::{ArrayKind, Expr, Item, ItemKind, Name};

/// Constants and `let`s, ordered so that each needs only earlier ones.
///
/// A cycle is reported with its chain; its members are left out.
pub(in crate::model) fn in_order<'a>(
    items: &[&'a Item],
    scope: &ModelScope<'a>,
    replaced: &BTreeMap<&str, &'a Expr>,
    diagnostics: &mut Diagnostics,
) -> Vec<(&'a Item, Result<(), ErrorReported>)> {
    let mut values: Vec<(&'a Item, &'a Name, &'a Expr)> = Vec::new();
    for item in items {
        if let ItemKind::Constant { name, value, .. }
        | ItemKind::Let { name, value, .. }
        | ItemKind::Array { declared: ArrayKind::Constant, name, start: Some(value), .. } =
            &item.kind
        {
            let value = replaced.get(name.text.as_str()).copied().unwrap_or(value);
            values.push((item, name, value));
        }
    }
    let position: BTreeMap<&str, usize> =
        values.iter().enumerate().map(|(i, (_, name, _))| (name.text.as_str(), i)).collect();
    let bodies: BTreeMap<&str, Vec<&str>> = scope
        .functions
        .iter()
        .map(|function| (function.name, function.names()))
        .chain(scope.tables.iter().map(|table| (table.name.text.as_str(), table.names())))
        .chain(scope.let_arrays.iter().map(|array| {
            let mut names = Vec::new();
            names_in(array.value, &mut names);
            names.retain(|n| array.counters.iter().all(|counter| counter.index.text != *n));
            (array.name, names)
        }))
        .collect();

    // The values that each value needs, also through the functions that it calls.
    let needs: Vec<Vec<usize>> = values
        .iter()
        .map(|(_, _, value)| {
            let mut pending = Vec::new();
            names_in(value, &mut pending);
            let mut visited = std::collections::BTreeSet::new();
            let mut needed = Vec::new();
            while let Some(name) = pending.pop() {
                if !visited.insert(name) {
                    continue;
                }
                needed.extend(position.get(name).copied());
                if let Some(names) = bodies.get(name) {
                    pending.extend(names.iter().copied());
                }
            }
            needed.sort_unstable();
            needed
        })
        .collect();

    // Depth first, without recursion; a value met again while it is on the path closes a cycle.
    let mut state = vec![VisitState::New; values.len()];
    let mut order = Vec::with_capacity(values.len());
    for start in 0..values.len() {
        if state[start] != VisitState::New {
            continue;
        }
        let mut path = vec![(start, 0)];
        state[start] = VisitState::Open;
        while let Some((value, next)) = path.last_mut() {
            let value = *value;
            let Some(&needed) = needs[value].get(*next) else {
                if state[value] == VisitState::Open {
                    order.push((values[value].0, Ok(())));
                    state[value] = VisitState::Done;
                }
                path.pop();
                continue;
            };
            *next += 1;
            match state[needed] {
                VisitState::New => {
                    state[needed] = VisitState::Open;
                    path.push((needed, 0));
                }
                VisitState::Done | VisitState::Failed => {}
                VisitState::Open => {
                    let from = path.iter().position(|(v, _)| *v == needed).unwrap_or(0);
                    let cycle: Vec<usize> = path[from..].iter().map(|(v, _)| *v).collect();
                    let reported = report_cycle(&cycle, &values, diagnostics);
                    for v in cycle {
                        if state[v] == VisitState::Open {
                            order.push((values[v].0, Err(reported)));
                            state[v] = VisitState::Failed;
                        }
                    }
                }
            }
        }
    }
    order
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum VisitState {
    New,
    Open,
    Done,
    Failed,
}

fn report_cycle(
    cycle: &[usize],
    values: &[(&Item, &Name, &Expr)],
    diagnostics: &mut Diagnostics,
) -> ErrorReported {
    let chain: Vec<String> =
        cycle.iter().chain(cycle.first()).map(|v| format!("`{}`", values[*v].1.text)).collect();
    let first = values[cycle[0]].1;
    let shown = if chain.len() > 8 {
        format!("{} → … → {}", chain[..3].join(" → "), chain[chain.len() - 2..].join(" → "))
    } else {
        chain.join(" → ")
    };
    let mut diagnostic = Diagnostic::new(
        Code::CircularDefinition,
        first.span,
        format!("`{}` depends on itself: {shown}", first.text),
    )
    .about(&first.text)
    .help("an unknown that an equation determines can depend on itself; a `let` cannot");
    for v in cycle.iter().skip(1).take(3) {
        diagnostic = diagnostic.label(values[*v].1.span, "through this");
    }
    diagnostics.error(diagnostic)
}
