//! Expressions in the notation of formulas, for the names of events.

use std::collections::BTreeMap;

use crate::dae::Dae;
use crate::dae::text::symbol_name;
use crate::expr::display::listing;
use crate::expr::{ExprId, Symbol};
use crate::model::Model;

/// An expression in the notation of formulas, if it is short.
pub(super) fn written(dae: &Dae, model: &Model, e: ExprId) -> String {
    let listing = listing(&dae.graph, &[e], &BTreeMap::new(), &|symbol| match symbol {
        Symbol::Element(i) => model.element_name(i),
        Symbol::DelayedUnknown(k) => match dae.delayed_unknowns[k as usize].unknown {
            Symbol::Element(i) => dae.name_of_delayed(k as usize, &model.element_name(i)),
            _ => symbol_name(dae, symbol),
        },
        other => symbol_name(dae, other),
    });
    let text = if listing.lines.is_empty() { listing.roots[0].as_str() } else { "…" };
    text.replace(',', " and")
}
