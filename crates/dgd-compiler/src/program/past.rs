//! Delayed unknowns in a program, and their derivatives.
//!
//! x(t − τ) is read as `if held then value else present`: x is looked up at α = t − τ, or is the current value without
//! a delay. τ may depend on anything known at t. With x' = ẋ(α), x'' = ẍ(α), Xⱼ = ∂x/∂θⱼ and X'ⱼ its slope, both at α,
//! all of them inputs,
//!
//! ```text
//!   ∂value/∂w = x' ∂α/∂w            for w = t, y, u;  dvalue/dθⱼ = Xⱼ + x' ∂α/∂θⱼ
//!   ∂x'/∂w    = x'' ∂α/∂w,   ∂Xⱼ/∂w = X'ⱼ ∂α/∂w
//!   ∂present/∂y = 1,         ∂present/∂w = −ẋ ∂τ/∂w    with ẋ = f where x is differential, if τ = 0, else 0
//! ```
//!
//! The last is the effect of a change of a zero delay. Other delays read the present only at the start, before which
//! nothing changes.

use std::borrow::Cow;

use dgd_signature::PastLayout;

use super::derivation::Derivation;
use crate::dae::{self, Dae};
use crate::expr::graph::Comparison;
use crate::expr::hash::HashMap;
use crate::expr::{DelayedValue, ExprId, Symbol};

/// Position in u of the first number of a kind; there is one for each delayed unknown, or, for sensitivities, for each
/// direction and delayed unknown. `Present` has none.
pub(super) fn begin(layout: PastLayout, past: DelayedValue) -> usize {
    let numbers = match past {
        DelayedValue::Held => layout.held(),
        DelayedValue::Value => layout.values(),
        DelayedValue::Rate => layout.rates(),
        DelayedValue::Curvature => layout.curvatures(),
        DelayedValue::Sensitivity => layout.sensitivities(),
        DelayedValue::SensitivityRate => layout.sensitivity_rates(),
        DelayedValue::Present => return layout.first + layout.len(),
    };
    numbers.start
}

/// The system with its delayed unknowns written out in terms of past values.
pub(super) fn opened(dae: &Dae) -> Cow<'_, Dae> {
    if dae.delayed_unknowns.is_empty() {
        return Cow::Borrowed(dae);
    }
    let mut dae = dae.clone();
    let mut replacement = HashMap::default();
    let half = dae.graph.constant(0.5);
    for k in 0..u32::try_from(dae.delayed_unknowns.len()).unwrap_or(u32::MAX) {
        let [held, value, present] =
            [DelayedValue::Held, DelayedValue::Value, DelayedValue::Present]
                .map(|past| dae.graph.symbol(Symbol::Past(past, k)));
        let is_held = dae.graph.compare(Comparison::Greater, held, half);
        let opened = dae.graph.select(is_held, value, present);
        replacement.insert(dae.graph.symbol(Symbol::DelayedUnknown(k)), opened);
    }
    let names = std::mem::take(&mut dae.names);
    let mut graph = std::mem::take(&mut dae.graph);
    let mut roots: Vec<ExprId> = expressions(&mut dae).map(|expression| *expression).collect();
    roots.extend(names.keys());
    let built = graph.replace(roots, &replacement);
    for expression in expressions(&mut dae) {
        *expression = built[expression];
    }
    dae.names = names.into_iter().map(|(id, name)| (built[&id], name)).collect();
    dae.graph = graph;
    Cow::Owned(dae)
}

fn expressions(dae: &mut Dae) -> impl Iterator<Item = &mut ExprId> {
    let unknowns = dae.unknowns.iter_mut();
    let transitions = dae.automata.iter_mut().flat_map(|automaton| &mut automaton.transitions);
    unknowns
        .flat_map(|x| [&mut x.rhs, &mut x.mass, &mut x.start].into_iter().chain(&mut x.history))
        .chain(dae.families.iter_mut().map(|family| &mut family.rhs))
        .chain(dae.outputs.iter_mut().map(|output| &mut output.value))
        .chain(dae.start_equations.iter_mut().map(|equation| &mut equation.rest))
        .chain(dae.delays.iter_mut().chain(&mut dae.varying_delays).map(|delay| &mut delay.tau))
        .chain(dae.time_conditions.iter_mut().flat_map(|c| [&mut c.at, &mut c.after]))
        .chain(transitions.flat_map(|transition| {
            let resets = transition.resets.iter_mut().map(|(_, value)| value);
            std::iter::once(&mut transition.event).chain(resets)
        }))
        .chain(dae.impulses.expressions())
}

impl Derivation<'_> {
    /// The nonzero ∂root/∂(symbols numbered by `wanted`), positions ascending, including the effect of these symbols on
    /// the times at which delayed values are read.
    pub(super) fn gradient(
        &mut self,
        root: ExprId,
        wanted: &dyn Fn(Symbol) -> Option<usize>,
    ) -> Vec<(usize, ExprId)> {
        if self.dae.delayed_unknowns.is_empty() {
            return self.graph.gradient(root, wanted);
        }
        let mut past: Vec<(DelayedValue, u32)> = self
            .graph
            .symbols(root)
            .into_iter()
            .filter_map(|symbol| match symbol {
                Symbol::Past(past, k) => Some((past, k)),
                _ => None,
            })
            .collect();
        past.retain(|(past, _)| {
            !matches!(
                past,
                DelayedValue::Held | DelayedValue::Curvature | DelayedValue::SensitivityRate
            )
        });
        let slopes = self.graph.gradient(root, |symbol| match symbol {
            Symbol::Past(kind, k) => past.iter().position(|other| *other == (kind, k)),
            _ => None,
        });
        let mut sums = self.graph.gradient(root, wanted).into_iter().collect();
        for (position, slope) in slopes {
            let (kind, k) = past[position];
            for (place, part) in self.of_past(kind, k, wanted) {
                let part = self.graph.multiply(slope, part);
                self.accumulate(&mut sums, place, part);
            }
        }
        sums.retain(|_, sum| self.graph.value(*sum) != Some(0.0));
        sums.into_iter().collect()
    }

    /// The derivatives of one past value.
    fn of_past(
        &mut self,
        kind: DelayedValue,
        k: u32,
        wanted: &dyn Fn(Symbol) -> Option<usize>,
    ) -> Vec<(usize, ExprId)> {
        let n_v = self.dae.delayed_unknowns.len();
        let delayed = self.dae.delayed_unknowns[k as usize % n_v];
        let tau = self.dae.delay_of(delayed).tau;
        let mut sums = std::collections::BTreeMap::new();
        let rate = match kind {
            DelayedValue::Value => self.graph.symbol(Symbol::Past(DelayedValue::Rate, k)),
            DelayedValue::Rate => self.graph.symbol(Symbol::Past(DelayedValue::Curvature, k)),
            DelayedValue::Sensitivity => {
                self.graph.symbol(Symbol::Past(DelayedValue::SensitivityRate, k))
            }
            DelayedValue::Present => {
                if let Some(place) = wanted(delayed.unknown) {
                    sums.insert(place, self.graph.constant(1.0));
                }
                let rate = self.rate(dae::position(delayed.unknown));
                let rate =
                    rate.unwrap_or_else(|| self.graph.symbol(Symbol::Past(DelayedValue::Rate, k)));
                let zero = self.graph.constant(0.0);
                let is_late = self.graph.compare(Comparison::Greater, tau, zero);
                self.graph.select(is_late, zero, rate)
            }
            DelayedValue::Held | DelayedValue::Curvature | DelayedValue::SensitivityRate => {
                return Vec::new();
            }
        };
        // α = t − τ; the present value is at t whatever t is.
        if kind != DelayedValue::Present
            && let Some(place) = wanted(Symbol::Time)
        {
            sums.insert(place, rate);
        }
        for (place, slope) in self.gradient(tau, wanted) {
            let part = self.graph.multiply(rate, slope);
            let part = self.graph.negate(part);
            self.accumulate(&mut sums, place, part);
        }
        sums.into_iter().collect()
    }

    /// ẏᵢ if it is differential in every mode.
    fn rate(&mut self, i: usize) -> Option<ExprId> {
        let dae = self.dae;
        let Some((family, row)) = dae.family_of(i) else {
            let unknown = &dae.unknowns[i];
            return (self.graph.value(unknown.mass) == Some(1.0)).then_some(unknown.rhs);
        };
        let rhs = family.rhs;
        family.differential.then(|| dae::row_of(&mut self.graph, rhs, row))
    }

    /// Adds the contribution of past values, which depend on θ themselves, to ∂root/∂θ: slope · Xⱼ.
    pub(super) fn add_past_sensitivities(
        &mut self,
        root: ExprId,
        sums: &mut std::collections::BTreeMap<usize, ExprId>,
    ) {
        let n_v = self.dae.delayed_unknowns.len();
        let value = |symbol| match symbol {
            Symbol::Past(DelayedValue::Value, k) => Some(k as usize),
            _ => None,
        };
        for (k, slope) in self.gradient(root, &value) {
            for j in 0..self.directions.len() {
                let position = u32::try_from(j * n_v + k).unwrap_or(u32::MAX);
                let s = self.graph.symbol(Symbol::Past(DelayedValue::Sensitivity, position));
                let part = self.graph.multiply(slope, s);
                self.accumulate(sums, j, part);
            }
        }
    }
}
