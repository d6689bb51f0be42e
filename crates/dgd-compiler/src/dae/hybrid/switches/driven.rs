//! Driven symbols: time, and unknowns whose rates do not depend on the rest of the solution, such as clocks and angles
//! at a given speed.

use std::collections::BTreeSet;

use crate::dae::Dae;
use crate::expr::{ExprId, Symbol};
use crate::model::{Interpolation, Model};

/// The driven unknowns.
pub(super) struct DrivenUnknowns {
    unknowns: BTreeSet<u32>,
    /// Those that are constant between events.
    still: BTreeSet<u32>,
    /// For each input, whether it changes between samples.
    is_linear: Vec<bool>,
}

impl DrivenUnknowns {
    pub(super) fn from_dae(dae: &Dae, model: &Model) -> Self {
        let inputs = model.inputs.iter().map(|input| input.interpolation);
        let delayed =
            dae.delayed_inputs.iter().map(|delayed| model.inputs[delayed.input].interpolation);
        let is_linear = inputs.chain(delayed).map(|of| of == Interpolation::Linear).collect();
        let none = BTreeSet::new();
        let mut driven = Self { unknowns: none.clone(), still: none, is_linear };
        let mut open: Vec<(u32, Vec<Symbol>)> = (0..)
            .zip(&dae.unknowns)
            .filter(|(_, unknown)| dae.graph.value(unknown.mass) == Some(1.0))
            .map(|(i, unknown)| (i, dae.graph.symbols(unknown.rhs)))
            .collect();
        loop {
            let n = open.len();
            open.retain(|(i, symbols)| {
                let is_driven = symbols.iter().all(|symbol| driven.is_given(*symbol));
                if is_driven {
                    driven.unknowns.insert(*i);
                    if dae.graph.value(dae.unknowns[*i as usize].rhs) == Some(0.0) {
                        driven.still.insert(*i);
                    }
                }
                !is_driven
            });
            if open.len() == n {
                return driven;
            }
        }
    }

    /// Whether a symbol does not depend on the rest of the solution.
    fn is_given(&self, symbol: Symbol) -> bool {
        match symbol {
            Symbol::Time | Symbol::Parameter(_) | Symbol::Discrete(_) | Symbol::Input(_) => true,
            Symbol::Unknown(i) => self.unknowns.contains(&i),
            _ => false,
        }
    }

    /// Whether an expression varies only by driven symbols. Inputs that vary are linear between samples, where steps
    /// end.
    pub(super) fn drives(&self, dae: &Dae, x: ExprId) -> bool {
        let symbols = dae.graph.symbols(x);
        let is_linear = |i: u32| self.is_linear.get(i as usize).copied().unwrap_or(false);
        let moves = |symbol: &Symbol| match symbol {
            Symbol::Time => true,
            Symbol::Unknown(i) => !self.still.contains(i),
            _ => false,
        };
        let is_given = |symbol: &Symbol| match symbol {
            Symbol::Input(i) => !is_linear(*i),
            other => self.is_given(*other),
        };
        symbols.iter().all(is_given) && symbols.iter().any(moves)
    }
}
