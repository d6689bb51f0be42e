//! Start values: the symbols that they may read, and start values of the states that a part reads through its inputs.

use std::collections::BTreeMap;

use super::expression::not_finite;
use super::resolver::ModelResolver;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::{ExprId, Node, Symbol};
use crate::syntax::ast::{Expr, Name};

impl ModelResolver<'_> {
    /// Checks that a start value reads only quantities that are known before the unknowns. Start values of a part may
    /// also read states outside the part, by their start values.
    pub(super) fn check_start(
        &self,
        start: ExprId,
        name: &Name,
        expr: &Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        let graph = &self.lowering.graph;
        let depends = |s: &Symbol| match s {
            Symbol::Unknown(_) | Symbol::Element(_) => !self.is_outer_state(*s, name),
            Symbol::Time => true,
            other => other.is_of_unknown(),
        };
        let culprit = graph.symbols(start).into_iter().find(depends);
        if culprit.is_some() || self.reads_past(start) {
            let culprit = culprit.and_then(|symbol| self.lowering.scope.quoted_name(symbol));
            let culprit = culprit.unwrap_or_else(|| "an unknown".to_owned());
            return Err(diagnostics.error(
                Diagnostic::new(
                    Code::StartReadsUnknown,
                    expr.span,
                    format!("this start value depends on {culprit}, which is not known before"),
                )
                .help("use parameters, constants and inputs, which are known at the start"),
            ));
        }
        match self.lowering.number(start) {
            Some(value) if !value.is_finite() => {
                Err(diagnostics.error(not_finite(value, expr.span)))
            }
            _ => Ok(()),
        }
    }

    /// Whether a symbol is a state outside the part that holds this name. A part reads such states only
    /// through its inputs and arguments.
    fn is_outer_state(&self, symbol: Symbol, name: &Name) -> bool {
        let scope = &self.lowering.scope;
        let Some((part, _)) = name.text.rsplit_once('.') else { return false };
        let of_part =
            |other: &str| other.strip_prefix(part).is_some_and(|behind| behind.starts_with('.'));
        let other = scope.quoted_name(symbol).unwrap_or_default();
        scope.is_state(symbol) && !of_part(other.trim_matches('`'))
    }

    /// Whether an expression reads an earlier value of an unknown.
    pub(super) fn reads_past(&self, id: ExprId) -> bool {
        let graph = &self.lowering.graph;
        let is_unknown = |s: &Symbol| matches!(s, Symbol::Unknown(_) | Symbol::Element(_));
        graph.reachable([id]).into_iter().any(|id| match graph.node(id) {
            Node::Delay(x, _) => graph.symbols(x).iter().any(is_unknown),
            _ => false,
        })
    }

    /// Substitutes the start values of states in start values.
    pub(super) fn open_starts(
        &mut self,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        let mut open: BTreeMap<usize, Vec<usize>> = (0..self.n_starts())
            .map(|i| (i, self.needed(self.start(i))))
            .filter(|(_, needed)| !needed.is_empty())
            .collect();
        while !open.is_empty() {
            let ready =
                open.iter().find(|(_, needed)| needed.iter().all(|i| !open.contains_key(i)));
            let Some((&i, _)) = ready else {
                return Err(diagnostics.error(self.circle(&open)));
            };
            open.remove(&i);
            let opened = self.opened(i);
            *self.start_mut(i) = opened;
        }
        Ok(())
    }

    /// Single unknowns, then arrays.
    fn n_starts(&self) -> usize {
        self.model.unknowns.len() + self.model.arrays.len()
    }

    fn start(&self, i: usize) -> ExprId {
        let n = self.model.unknowns.len();
        if i < n { self.model.unknowns[i].start } else { self.model.arrays[i - n].unknown.start }
    }

    fn start_mut(&mut self, i: usize) -> &mut ExprId {
        let n = self.model.unknowns.len();
        if i < n {
            &mut self.model.unknowns[i].start
        } else {
            &mut self.model.arrays[i - n].unknown.start
        }
    }

    /// The position of the start value of a symbol, and the element in it.
    fn place(&self, symbol: Symbol) -> Option<(usize, u32)> {
        match symbol {
            Symbol::Unknown(i) => Some((i as usize, 0)),
            Symbol::Element(i) => {
                let array = self.model.arrays.partition_point(|array| array.first <= i) - 1;
                let k = i - self.model.arrays[array].first;
                Some((self.model.unknowns.len() + array, k))
            }
            _ => None,
        }
    }

    fn needed(&self, start: ExprId) -> Vec<usize> {
        let symbols = self.lowering.graph.symbols(start);
        symbols.into_iter().filter_map(|symbol| self.place(symbol)).map(|(i, _)| i).collect()
    }

    /// A start value with those that it needs substituted.
    fn opened(&mut self, i: usize) -> ExprId {
        let start = self.start(i);
        let mut values: BTreeMap<Symbol, ExprId> = BTreeMap::new();
        for symbol in self.lowering.graph.symbols(start) {
            let Some((needed, k)) = self.place(symbol) else { continue };
            let value = self.start(needed);
            let graph = &mut self.lowering.graph;
            let mut at_k: BTreeMap<Symbol, ExprId> = BTreeMap::new();
            for symbol in graph.symbols(value) {
                let now = match symbol {
                    Symbol::Counter => graph.constant(f64::from(k)),
                    Symbol::SweptParameter(first, _) => graph.symbol(Symbol::Parameter(first + k)),
                    Symbol::SweptInput(first, _) => graph.symbol(Symbol::Input(first + k)),
                    _ => continue,
                };
                at_k.insert(symbol, now);
            }
            let opened = graph.substitute(value, |symbol| at_k.get(&symbol).copied());
            values.insert(symbol, opened);
        }
        self.lowering.graph.substitute(start, |symbol| values.get(&symbol).copied())
    }

    /// The error for start values that depend on each other.
    fn circle(&self, open: &BTreeMap<usize, Vec<usize>>) -> Diagnostic {
        let declared = |i: usize| {
            let n = self.model.unknowns.len();
            let array = |i: usize| &self.model.arrays[i - n].unknown;
            if i < n { &self.model.unknowns[i].declared } else { &array(i).declared }
        };
        // Every open value depends on an open one, so following the dependencies ends in a cycle.
        let next = |i: usize| {
            let open_needed = open[&i].iter().copied().find(|needed| open.contains_key(needed));
            open_needed.unwrap_or(i)
        };
        let first = open.keys().next().copied().unwrap_or(0);
        let on_circle = (0..open.len()).fold(first, |i, _| next(i));
        let mut names = vec![format!("`{}`", declared(on_circle).name)];
        let mut i = next(on_circle);
        while i != on_circle {
            names.push(format!("`{}`", declared(i).name));
            i = next(i);
        }
        names.push(names[0].clone());
        let message = format!("start values depend on each other: {}", names.join(" → "));
        Diagnostic::new(Code::CircularDefinition, declared(on_circle).span, message)
            .help("give one of them a value of its own where its part is declared")
    }
}
