//! The unknowns of a system: those that the model declares, and those that index reduction adds.

use std::collections::BTreeMap;

use super::partition::SystemPart;
use crate::dae::DaeUnknown;
use crate::expr::display::listing;
use crate::expr::{ExprGraph, ExprId, Symbol};
use crate::model::Model;
use crate::units::Unit;

/// Names of combinations longer than this are replaced by the equation's.
const LONGEST_NAME: usize = 40;

/// Meaning of an unknown that is not declared.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum AuxiliaryKind {
    /// The derivative of an unknown.
    RateOf(u32),
    /// Σ c x, with c of parameters only.
    Combination(Vec<(u32, ExprId)>),
}

/// An unknown that is not declared.
#[derive(Debug, Clone)]
pub(super) struct AuxiliaryUnknown {
    pub(super) what: AuxiliaryKind,
    /// The equation that needs it first.
    pub(super) equation: usize,
}

/// All unknowns, without rows yet.
pub(super) struct UnknownList {
    pub(super) unknowns: Vec<DaeUnknown>,
    declared: usize,
    additions: Vec<AuxiliaryUnknown>,
    ids: BTreeMap<AuxiliaryKind, u32>,
}

impl UnknownList {
    /// The unknowns as declared.
    pub(super) fn declared(
        model: &Model,
        starts: Vec<ExprId>,
        histories: Vec<Option<ExprId>>,
    ) -> Self {
        let unknowns: Vec<DaeUnknown> = model
            .unknowns
            .iter()
            .zip(starts)
            .zip(histories)
            .map(|((unknown, start), history)| DaeUnknown {
                name: unknown.declared.name.clone(),
                unit: unknown.declared.unit.clone(),
                doc: unknown.declared.doc.clone(),
                nominal: unknown.nominal,
                differential: false,
                mass: start,
                rhs: start,
                start,
                history,
                fixed: unknown.fixed,
                equation: String::new(),
                span: unknown.declared.span,
            })
            .collect();
        let declared = unknowns.len();
        UnknownList { unknowns, declared, additions: Vec::new(), ids: BTreeMap::new() }
    }

    pub(super) fn len(&self) -> usize {
        self.unknowns.len()
    }

    /// The meaning of an added unknown; `None` for a declared one.
    pub(super) fn addition(&self, variable: u32) -> Option<&AuxiliaryUnknown> {
        (variable as usize).checked_sub(self.declared).map(|position| &self.additions[position])
    }

    /// Whether an unknown belongs to a part.
    pub(super) fn is_of(&self, variable: u32, part: &SystemPart) -> bool {
        match self.addition(variable) {
            Some(addition) => part.equations.contains(&addition.equation),
            None => part.unknowns.contains(&variable),
        }
    }

    /// The unknown `der(x)` of an unknown x.
    pub(super) fn rate_of(&mut self, of: u32, equation: usize, graph: &mut ExprGraph) -> u32 {
        let what = AuxiliaryKind::RateOf(of);
        if let Some(id) = self.ids.get(&what) {
            return *id;
        }
        let x = &self.unknowns[of as usize];
        let zero = graph.constant(0.0);
        let unknown = DaeUnknown {
            name: format!("der({})", x.name),
            unit: Unit {
                symbol: format!("{}/s", x.unit.symbol),
                dimension: x.unit.dimension,
                offset: 0.0,
                datum: None,
                ..x.unit
            },
            doc: Vec::new(),
            nominal: None,
            differential: false,
            mass: zero,
            rhs: zero,
            start: zero,
            history: None,
            fixed: false,
            equation: String::new(),
            span: x.span,
        };
        self.add(what, unknown, equation)
    }

    /// The unknown Σ c x; its initial value follows from those of the x. `label` is the equation that determines its
    /// derivative.
    pub(super) fn combination(
        &mut self,
        terms: Vec<(u32, ExprId)>,
        equation: usize,
        label: &str,
        graph: &mut ExprGraph,
    ) -> u32 {
        let value = sum(graph, &terms, |graph, i| graph.symbol(Symbol::Unknown(i)));
        let what = AuxiliaryKind::Combination(terms);
        if let Some(id) = self.ids.get(&what) {
            return *id;
        }
        let AuxiliaryKind::Combination(terms) = &what else { unreachable!("just made") };
        let start = sum(graph, terms, |_, i| self.unknowns[i as usize].start);
        let first = &self.unknowns[terms.first().map_or(0, |(i, _)| *i as usize)];
        let text = listing(graph, &[value], &BTreeMap::new(), &|symbol| match symbol {
            Symbol::Unknown(i) => self.unknowns[i as usize].name.clone(),
            _ => "…".to_owned(),
        });
        let text = text.roots[0].clone();
        let is_short = text.len() <= LONGEST_NAME && !text.contains('…');
        let name = if is_short { text } else { format!("state of {label}") };
        let unknown = DaeUnknown {
            name,
            unit: Unit { offset: 0.0, datum: None, ..first.unit.clone() },
            doc: Vec::new(),
            nominal: first.nominal,
            differential: false,
            mass: start,
            rhs: start,
            start,
            history: None,
            fixed: terms.iter().all(|(i, _)| self.unknowns[*i as usize].fixed),
            equation: String::new(),
            span: first.span,
        };
        self.add(what, unknown, equation)
    }

    fn add(&mut self, what: AuxiliaryKind, mut unknown: DaeUnknown, equation: usize) -> u32 {
        while self.unknowns.iter().any(|other| other.name == unknown.name) {
            // In other modes this equation combines other unknowns.
            unknown.name.push_str(" again");
        }
        let id = u32::try_from(self.unknowns.len()).unwrap_or(u32::MAX);
        self.unknowns.push(unknown);
        self.additions.push(AuxiliaryUnknown { what: what.clone(), equation });
        self.ids.insert(what, id);
        id
    }
}

/// Σ c x
pub(super) fn sum(
    graph: &mut ExprGraph,
    terms: &[(u32, ExprId)],
    mut x: impl FnMut(&mut ExprGraph, u32) -> ExprId,
) -> ExprId {
    let zero = graph.constant(0.0);
    terms.iter().fold(zero, |sum, (i, coefficient)| {
        let x = x(graph, *i);
        let term = graph.multiply(*coefficient, x);
        graph.add(sum, term)
    })
}
