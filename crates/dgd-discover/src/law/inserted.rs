//! The model with terms in it, fitted by simulation.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use dgd_compiler::source::SourceMap;
use dgd_compiler::units::{Unit, parse_unit};
use dgd_identify::Recording;
use dgd_runtime::System;

use super::columns::LawDraft;
use super::proposed::{FitOrigin, ProposedTerms};
use super::search::LawSearch;
use crate::fit::{FittedStructure, SearchData, StartPoint};
use crate::guess::{
    FormulaFactor, FormulaShape, LawParameter, LawRange, bounds, change, formula, literal, names,
    plain, read_effect,
};
use crate::library::{CarriedValues, EffectCandidate, ModelStructure, StructureId};
use crate::missing_input::MissingPlace;

/// Maximum number of simulations of a fit that begins, and of one that is finished. If states are not read, a fit turns
/// along valleys, and its first steps do not predict where it ends.
const BEGINNING: usize = 15;
pub(super) const EVALUATIONS: usize = 60;

/// Fits that leave this many times as much as the best one, or as noise, after a few simulations are not finished.
pub(super) const HOPEFUL: f64 = 10.0;

/// A term that an equation or a parameter lacked.
#[derive(Debug, Clone)]
pub struct LawTerm {
    /// The equation to whose right-hand side it belongs, or the parameter to which it is added.
    pub target: String,
    /// The term in the language, units included.
    pub formula: String,
    /// Its coefficient, then its inner constant, if it has one.
    pub coefficients: Vec<LawParameter>,
}

/// Terms in the model, fitted.
#[derive(Debug, Clone)]
pub(crate) struct FittedTerms {
    written: Vec<TermText>,
    names: Vec<FormulaFactor>,
    pub(crate) fitted: FittedStructure,
    /// Sources with the effect's text.
    pub(crate) sources: SourceMap,
    /// Recorded ranges of the names that the terms read.
    pub(crate) ranges: Vec<LawRange>,
}

/// A term in the effect's text, with the names and units of its constants.
#[derive(Debug, Clone)]
struct TermText {
    place: MissingPlace,
    shape: FormulaShape,
    coefficient: InsertedConstant,
    inner: Option<InsertedConstant>,
}

#[derive(Debug, Clone)]
struct InsertedConstant {
    /// Its name in the effect, then in the model.
    name: String,
    unit: Unit,
    /// Where its fit starts, SI.
    value: f64,
}

impl LawSearch<'_> {
    /// The model with a set of terms, fitted from the states of the sighting; `None` if that fails.
    pub(super) fn insert(
        &self,
        places: &[MissingPlace],
        proposed: &ProposedTerms,
    ) -> Option<FittedTerms> {
        let LawSearch { base, fitted, data, model, .. } = self;
        let names = names(model);
        let mut written = self.written(places, &names, &proposed.draft)?;
        let mut sources = self.sources.clone();
        let effect = read_effect("law.dgd", text(&model.name, &names, &written), &mut sources)?;
        let candidate = EffectCandidate::new(&effect, &[], false);
        let structure =
            base.structure(std::slice::from_ref(&candidate), StructureId::one(0)).ok()?;
        let brought: BTreeMap<String, String> =
            structure.brought.first()?.names.iter().cloned().collect();
        let mut point = StartPoint::default();
        for constant in written.iter_mut().flat_map(TermText::constants_mut) {
            if let Some(called) = brought.get(&constant.name) {
                constant.name.clone_from(called);
            }
            point.set(std::iter::once((constant.name.clone(), constant.value)));
        }
        let data = data.not_kept();
        let starts = &proposed.sighting.starts;
        let after = match proposed.begin {
            FitOrigin::Alone(r) => self.begun_alone(structure, starts, point, r)?,
            FitOrigin::All => {
                let from = CarriedValues { starts: starts.clone(), ..fitted.values.clone() };
                let is_hidden = fitted.has_hidden_states(&data);
                let evaluations = if is_hidden { EVALUATIONS } else { BEGINNING };
                FittedStructure::new(structure, &from, &[point], &data, evaluations).ok()?
            }
        };
        let reads: BTreeSet<usize> =
            written.iter().flat_map(|own| own.shape.reads(&names)).collect();
        let recorded = proposed.sighting.ranges();
        let ranges = reads.into_iter().map(|i| {
            let FormulaFactor { name, unit, .. } = &names[i];
            let [low, high] = recorded[i];
            LawRange { name: name.clone(), unit: plain(unit), low, high }
        });
        let ranges = ranges.collect();
        Some(FittedTerms { written, names, fitted: after, sources, ranges })
    }

    /// Fits a structure to one recording, whose coefficients serve to find start values of the others, and then to all.
    fn begun_alone(
        &self,
        structure: ModelStructure,
        starts: &[BTreeMap<String, f64>],
        point: StartPoint,
        r: usize,
    ) -> Option<FittedStructure> {
        let LawSearch { fitted, data, .. } = self;
        let data = data.not_kept();
        let others: Vec<Recording> = (data.train.iter().enumerate())
            .filter(|(other, _)| *other != r)
            .map(|(_, recording)| recording.clone())
            .collect();
        let mut data_alone = SearchData {
            train: &data.train[r..=r],
            valid: &others,
            counts_from: Vec::new(),
            ..data.clone()
        };
        let from = CarriedValues { starts: starts.to_vec(), ..fitted.values.clone() };
        let alone =
            FittedStructure::new(structure, &from, &[point], &data_alone, EVALUATIONS).ok()?;
        if alone.mean_square() > HOPEFUL {
            return None;
        }
        data_alone.counts_from = alone.counts_from(&data_alone, EVALUATIONS);
        let mut all_starts = alone.held_out_starts(&data_alone, EVALUATIONS)?;
        let system = &alone.structure.system;
        all_starts.insert(r, alone.values.starts(system, 0));
        let from = CarriedValues::collect(system, &alone.p, &all_starts);
        let points = [StartPoint::default()];
        FittedStructure::new(alone.structure.clone(), &from, &points, &data, EVALUATIONS).ok()
    }

    fn written(
        &self,
        places: &[MissingPlace],
        names: &[FormulaFactor],
        draft: &LawDraft,
    ) -> Option<Vec<TermText>> {
        let model = self.model;
        let taken = &self.fitted.structure.system.signature().parameters;
        let mut free = (1..).map(|i| format!("law_{i}"));
        let mut free = free.by_ref().filter(|name| !taken.iter().any(|p| *p.name == **name));
        let mut terms = Vec::new();
        for (place, shape, value) in &draft.terms {
            let place = &places[*place];
            let whole = parse_unit(&place.unit).ok()?.dimension;
            let unit = shape.unit(names, &model.familiar(whole), model)?;
            let coefficient = InsertedConstant { name: free.next()?, unit, value: *value };
            let inner = shape.inner_unit(names).zip(shape.inner);
            let inner = inner.and_then(|(unit, value)| {
                Some(InsertedConstant { name: free.next()?, unit: unit.clone(), value })
            });
            let (place, shape) = (place.clone(), shape.clone());
            terms.push(TermText { place, shape, coefficient, inner });
        }
        Some(terms)
    }
}

impl TermText {
    fn constants_mut(&mut self) -> impl Iterator<Item = &mut InsertedConstant> {
        std::iter::once(&mut self.coefficient).chain(&mut self.inner)
    }
}

impl FittedTerms {
    /// The fit continued to its end.
    pub(super) fn finished(&self, data: &SearchData<'_>) -> FittedTerms {
        let after = self.fitted.continued(&data.not_kept(), EVALUATIONS);
        FittedTerms { fitted: after.unwrap_or_else(|_| self.fitted.clone()), ..self.clone() }
    }

    /// The draft that it was made from, with the constants of the fit.
    pub(super) fn draft(&self, from: &LawDraft) -> LawDraft {
        let mut draft = from.clone();
        for ((_, shape, coefficient), term) in draft.terms.iter_mut().zip(self.terms(&self.fitted))
        {
            *coefficient = term.coefficients[0].value;
            shape.inner = term.coefficients.get(1).map(|inner| inner.value);
        }
        draft
    }

    /// Σ ε² + k ln N of the training recordings, plus twice the complexity of the terms.
    pub(crate) fn cost(&self) -> f64 {
        let complexity: u32 = self.written.iter().map(|own| own.shape.complexity()).sum();
        self.fitted.criterion() + 2.0 * f64::from(complexity)
    }

    /// Complexity for a reader: that of its forms, and each constant.
    pub(super) fn complexity(&self) -> u32 {
        let constants = |own: &TermText| 1 + u32::from(own.inner.is_some());
        self.written.iter().map(|own| own.shape.complexity() + constants(own)).sum()
    }

    /// Whether it has the same terms as another law, with any constants.
    pub(super) fn has_terms_of(&self, other: &Self) -> bool {
        let is_same =
            |a: &TermText, b: &TermText| a.place == b.place && a.shape.factors == b.shape.factors;
        let has = |own: &TermText| other.written.iter().any(|of| is_same(own, of));
        self.written.len() == other.written.len() && self.written.iter().all(has)
    }

    /// The terms with the constants of a fit.
    pub(crate) fn terms(&self, fitted: &FittedStructure) -> Vec<LawTerm> {
        let parameter = |constant: &InsertedConstant| {
            let InsertedConstant { name, unit, value } = constant;
            let value = fitted.values.p.get(name).copied().unwrap_or(*value);
            let estimate =
                fitted.estimates.iter().find(|e| e.recording.is_none() && e.name == *name);
            LawParameter {
                name: name.clone(),
                value,
                std: estimate.and_then(|e| e.std),
                unit: plain(unit),
            }
        };
        let term = |own: &TermText| {
            let TermText { place, shape, coefficient, inner } = own;
            let constants = std::iter::once(coefficient).chain(inner);
            let coefficients: Vec<LawParameter> = constants.map(parameter).collect();
            let inner = coefficients.get(1).map(|inner| inner.value);
            let shape = FormulaShape { inner, ..shape.clone() };
            let formula =
                formula(&[(coefficients[0].value, &coefficient.unit, &shape)], &self.names);
            LawTerm { target: place.name.clone(), formula, coefficients }
        };
        self.written.iter().map(term).collect()
    }

    /// The base model with the parameters and start values of this fit.
    pub(super) fn parameters_for(&self, base: &FittedStructure) -> FittedStructure {
        let values = self.fitted.values.clone();
        let p = values.parameters(&base.structure.system);
        // It does not run away where the base model does.
        let train = self.fitted.train.clone();
        FittedStructure { values, p, train, ..base.clone() }
    }

    /// Its shapes with their coefficients, if all belong to one place.
    pub(crate) fn all_in(&self, place: &MissingPlace) -> Option<Vec<(FormulaShape, f64)>> {
        let terms = self.terms(&self.fitted);
        let shape = |(own, term): (&TermText, &LawTerm)| {
            let inner = term.coefficients.get(1).map(|inner| inner.value);
            (FormulaShape { inner, ..own.shape.clone() }, term.coefficients[0].value)
        };
        let is_only_there = self.written.iter().all(|own| own.place == *place);
        is_only_there.then(|| self.written.iter().zip(&terms).map(shape).collect())
    }

    /// The equations that it changes.
    pub(crate) fn targets(&self) -> BTreeSet<&str> {
        self.written.iter().map(|own| own.place.name.as_str()).collect()
    }

    /// The terms with their equations, code between backticks.
    pub(super) fn formula(&self) -> String {
        let terms = self.terms(&self.fitted).into_iter();
        let texts: Vec<String> =
            terms.map(|term| format!("`{}` in `{}`", term.formula, term.target)).collect();
        texts.join(" and ")
    }
}

/// The terms as an effect.
fn text(model: &str, names: &[FormulaFactor], written: &[TermText]) -> String {
    let (mut parameters, mut nulls) = (String::new(), String::new());
    let mut sums: Vec<(&MissingPlace, Vec<String>)> = Vec::new();
    let declared = |constant: &InsertedConstant, bounds: &str| {
        let InsertedConstant { name, unit, value } = constant;
        format!("parameter {name} [{}] = {}{bounds}\n", unit.symbol, literal(value / unit.factor))
    };
    for TermText { place, shape, coefficient, inner } in written {
        parameters += &declared(coefficient, "");
        // Writing to a string cannot fail.
        let _ = writeln!(nulls, "null {} = 0", coefficient.name);
        if let Some(inner) = inner {
            parameters += &declared(inner, &bounds(shape, inner.value, &inner.unit));
        }
        let inner = inner.as_ref().map_or("", |inner| &inner.name);
        let term = format!("{}{}", coefficient.name, shape.text_with(names, inner));
        match sums.iter_mut().find(|(own, _)| *own == place) {
            Some((_, sum)) => sum.push(term),
            None => sums.push((place, vec![term])),
        }
    }
    let change = |(place, sum): &(&MissingPlace, Vec<String>)| {
        let (_, change) = change(place.kind, &place.name, &sum.join(" + "));
        change + "\n"
    };
    let changes: String = sums.iter().map(change).collect();
    format!("effect law on {model}\nkind plant\n\n{parameters}{nulls}\n{changes}")
}
