//! Switches whose surface jumps where another switch changes: `sign((if x > 1 then x else 0) - 2)`.
//!
//! While a solution slides along the inner surface, x = 1, a share of the rows on each side acts, each with its own
//! outer switch. So the inner condition is brought to the front of such rows: row = if e > 0 then row on e > 0 else row
//! on e < 0.

use super::affected::ExpressionReaders;
use super::surfaces::{SurfaceKind, surfaces};
use crate::dae::Dae;
use crate::dae::hybrid::smoothness::{Continuity, SwitchSigns, SymbolSizes, on_side, passage};
use crate::expr::graph::Comparison;
use crate::expr::hash::HashMap;
use crate::expr::{ExprId, Node};
use crate::model::Model;

/// Each condition that is brought to the front at most doubles a row.
const MOST_CONDITIONS: usize = 6;

/// Brings inner conditions to the front of the rows.
pub(super) fn take_apart(dae: &mut Dae, model: &Model) {
    for _ in 0..MOST_CONDITIONS {
        let Some((e, signs, rows)) = inner(dae, model) else { return };
        let n_single = dae.unknowns.len();
        for row in rows {
            let graph = &mut dae.graph;
            let rhs = match row.checked_sub(n_single) {
                None => &mut dae.unknowns[row].rhs,
                Some(family) => &mut dae.families[family].rhs,
            };
            let zero = graph.constant(0.0);
            let is_above = graph.compare(Comparison::Greater, e, zero);
            let sides = [1.0, -1.0].map(|side| on_side(graph, *rhs, &signs, side));
            *rhs = graph.select(is_above, sides[0], sides[1]);
        }
    }
}

/// The first surface across which that of another switch jumps, and the rows that read both.
fn inner(dae: &mut Dae, model: &Model) -> Option<(ExprId, SwitchSigns, Vec<usize>)> {
    let roots: Vec<ExprId> = dae.rows().collect();
    let candidates = surfaces(dae, model, &roots, SurfaceKind::Common);
    let of_switches: HashMap<ExprId, usize> = candidates
        .iter()
        .enumerate()
        .flat_map(|(k, surface)| surface.signs.keys().map(move |id| (*id, k)))
        .collect();
    let chooses = |id: &ExprId| match dae.graph.node(*id) {
        Node::Compare(..) => true,
        Node::Call1(function, _) => function.get().name == "sign",
        _ => false,
    };
    let mut readers: Option<ExpressionReaders> = None;
    let (mut trial, sizes) = (dae.graph.clone(), SymbolSizes::estimate(dae, model));
    for outer in candidates.iter().filter(|outer| outer.signs.keys().any(chooses)) {
        let mut within: Vec<usize> = dae
            .graph
            .reachable([outer.e])
            .iter()
            .filter_map(|id| of_switches.get(id).copied())
            .collect();
        within.sort_unstable();
        within.dedup();
        for k in within {
            let (e, signs) = (candidates[k].e, &candidates[k].signs);
            if passage(&mut trial, &sizes, outer.e, e, signs) < Continuity::Jump {
                continue;
            }
            let readers = readers.get_or_insert_with(|| ExpressionReaders::from_dae(dae));
            let (_, outer_rows) = readers.affected(&outer.signs);
            let (_, mut rows) = readers.affected(signs);
            rows.retain(|row| outer_rows.contains(row));
            return Some((e, signs.clone(), rows));
        }
    }
    None
}
