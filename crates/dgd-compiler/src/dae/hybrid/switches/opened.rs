//! Surfaces in algebraic unknowns that follow directly from others: `sign(T)` with `T = 0.8 - x` changes where 0.8 − x
//! does, which has a rate.

use std::collections::BTreeMap;

use super::surfaces::is_smooth;
use crate::dae::Dae;
use crate::expr::{ExprId, Symbol};

/// Limit on the depth of substitutions.
const MOST_OPENED: usize = 16;

/// The surface in terms of differential unknowns, if equations give the algebraic ones directly and without a switch.
pub(super) fn opened(dae: &mut Dae, e: ExprId) -> Option<ExprId> {
    let mut e = e;
    for _ in 0..MOST_OPENED {
        let mut values = BTreeMap::new();
        for symbol in dae.graph.symbols(e) {
            let Symbol::Unknown(i) = symbol else { continue };
            if dae.graph.value(dae.unknowns[i as usize].mass) != Some(1.0) {
                values.insert(symbol, given(dae, i)?);
            }
        }
        if values.is_empty() {
            return Some(e);
        }
        e = dae.graph.substitute(e, |symbol| values.get(&symbol).copied());
    }
    None
}

/// The value of an algebraic unknown from its row, 0 = a x + b with a of parameters only.
fn given(dae: &mut Dae, i: u32) -> Option<ExprId> {
    let unknown = &dae.unknowns[i as usize];
    let rhs = unknown.rhs;
    if dae.graph.value(unknown.mass) != Some(0.0) || !is_smooth(&dae.graph, rhs) {
        return None;
    }
    let this = Symbol::Unknown(i);
    let graph = &mut dae.graph;
    let gradient = graph.gradient(rhs, |symbol| (symbol == this).then_some(0));
    let [(_, a)] = gradient[..] else { return None };
    if !graph.symbols(a).iter().all(|symbol| matches!(symbol, Symbol::Parameter(_))) {
        return None;
    }
    let zero = graph.constant(0.0);
    let b = graph.substitute(rhs, |symbol| (symbol == this).then_some(zero));
    let minus = graph.negate(a);
    Some(graph.divide(b, minus))
}
