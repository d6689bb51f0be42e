//! Guesses a formula for a discrepancy without a name.
//!
//! ```text
//!   the missing term in each recording, around the trajectory that has it   (reconstruct)
//!   formulas of the model's names that look like it                         (regression, forms, formula)
//!   the model with each of them, fitted again: which follows the recordings (structure, fitted)
//! ```
//!
//! The regression finds forms. Fits of the model with each formula decide between them and determine coefficients: they
//! are free of smoothing, of what parameters and start values have absorbed, and of unknowns that merely respond to the
//! missing term. A formula that does not reduce the model's errors is rejected.
//!
//! A formula that passes on recordings that did not choose it describes them. That does not confirm its form: many
//! forms agree over the recorded range.

mod forms;
mod formula;
mod law;
mod moments;
mod regression;
mod together;

use std::cmp::Ordering;
use std::collections::BTreeMap;

use dgd_compiler::model::Model;
use dgd_compiler::source::SourceMap;
use dgd_compiler::units::{Unit, parse_unit};
use dgd_identify::Recording;
use dgd_runtime::parallel::in_parallel;
use dgd_runtime::{EvaluationPoint, Problem, Solution, System, simulate};

use crate::fit::{FittedStructure, SearchData, StartPoint, as_far_as_readings, whitened_square};
use crate::library::{BaseModel, CarriedValues, EffectCandidate, StructureId};
use crate::missing_input::{
    self, FoundPlace, MissingTerms, PlaceKind, PlaceTrace, inputs_with, place_of,
};
pub(crate) use forms::{FORMS, FactorForm, FormConstant};
pub(crate) use formula::{FormulaFactor, FormulaShape, formula, literal, names, with_differences};
use law::{FittedTerm, FormulaConstants, law, ranges, text};
pub use law::{LawParameter, LawRange};
pub(crate) use law::{bounds, change, plain, read_effect};
use moments::InputTrace;
use regression::{RankedFormula, given, ranked};
use together::together;
pub use together::{CorrelatedQuantity, TraceCourse};

/// Fraction of the mean square error that may remain with the formula in the model.
const LEFT: f64 = 0.7;
/// Maximum number of simulations of the fits that compare formulas.
const COMPARED: usize = 12;
/// Maximum number of simulations of a fit with a formula.
const EVALUATIONS: usize = 40;
/// Maximum number of names considered.
const NAMES: usize = 24;

/// A formula of the model's names that resembles the missing term: a guess, not confirmed.
#[derive(Debug, Clone)]
pub struct FormulaGuess {
    /// The formula in the language, units included: to add to the right-hand side of the equation, or to the reading of
    /// the sensor.
    pub formula: String,
    /// Its terms, two at most.
    pub terms: Vec<GuessedTerm>,
    /// 1 − Σ w (d − formula)²/Σ w (d − d₀)² of the missing input d on data to which the formula was not fitted: the
    /// validation recordings, or tenths of the training recordings if there are none.
    pub r2_held_out: f64,
    /// Whether R² is from validation recordings.
    pub is_of_recordings: bool,
    /// Mean square of the base model's errors relative to the noise, on validation recordings if there are any.
    pub left_before: f64,
    /// That mean square with the formula in the model.
    pub left_after: f64,
    /// The formula as an effect file, which `--apply` takes.
    pub file: String,
    /// The parameters of that file.
    pub parameters: Vec<LawParameter>,
    /// Recorded ranges of its quantities, SI.
    pub ranges: Vec<LawRange>,
}

/// A term of a [`FormulaGuess`].
#[derive(Debug, Clone)]
pub struct GuessedTerm {
    /// The factor that the coefficient multiplies, with the operator: `* q*abs(q)`; empty for a constant.
    pub factor: String,
    /// The coefficient, SI, from a fit of the model with the formula in it.
    pub coefficient: f64,
    /// Its standard deviation; `None` if the data does not determine it.
    pub std: Option<f64>,
    /// Its unit.
    pub unit: dgd_runtime::Unit,
}

/// The data for a guess.
pub(crate) struct GuessData<'a> {
    pub base: &'a BaseModel,
    pub sources: &'a SourceMap,
    pub model: &'a Model,
    pub fitted: &'a FittedStructure,
    pub data: &'a SearchData<'a>,
    pub threads: usize,
}

/// The place of a formula.
struct FormulaSite<'a> {
    /// The equation's label or the output's name.
    name: &'a str,
    kind: PlaceKind,
    /// The unit of the formula's value.
    unit: Unit,
    names: Vec<FormulaFactor>,
}

/// The missing term at a place along all recordings, with which formulas and names are compared.
pub(crate) struct MissingCourse<'a> {
    site: FormulaSite<'a>,
    /// Initial parameters and start values of fits.
    values: CarriedValues,
    train: Vec<InputTrace>,
    held_out: Vec<InputTrace>,
}

impl MissingCourse<'_> {
    /// Quantities that correlate with the missing term, the closest first.
    pub(crate) fn together(&self) -> Vec<CorrelatedQuantity> {
        together(&self.train, &self.held_out, &self.site.names)
    }
}

/// The model with a formula in it.
struct ModelWithFormula {
    after: FittedStructure,
    /// The coefficients' names in the model, and their units.
    names: Vec<String>,
    units: Vec<Unit>,
    /// Names in the model of the inner constants, for each term that has one.
    inner: Vec<Option<String>>,
}

impl GuessData<'_> {
    /// The missing term at a place along all recordings; `None` if one of them cannot be simulated with it.
    pub(crate) fn followed<'b>(
        &self,
        terms: &'b MissingTerms,
        found: &FoundPlace,
    ) -> Option<MissingCourse<'b>> {
        let data = self.data;
        let place = place_of(terms, &found.missing.place)?;
        let site = self.site(terms, place)?;
        // A sensor's error is compared with the base model's own parameters. Terms, parameters and inputs are compared
        // with the changed parameters, as is everything if the base model diverges.
        let is_beside_the_base = site.kind == PlaceKind::Output && !found.is_followed();
        let (of_train, of_valid) = if is_beside_the_base {
            self.alone(terms, place)
        } else {
            (found.train.clone(), found.valid.clone())
        };
        let p = if is_beside_the_base { &self.fitted.p } else { &found.p };
        let traces = |recordings: &[Recording], traces: &[PlaceTrace]| -> Vec<InputTrace> {
            let both = recordings.iter().zip(traces);
            both.filter_map(|(recording, trace)| {
                self.along(terms, place, &site, recording, p, trace)
            })
            .collect()
        };
        let train = traces(data.train, &of_train);
        let held_out = traces(data.valid, &of_valid);
        let is_whole = !train.is_empty() && held_out.len() == data.valid.len();
        let values =
            if is_beside_the_base { self.fitted.values.clone() } else { self.values_of(found) };
        is_whole.then_some(MissingCourse { site, values, train, held_out })
    }

    /// Parameters and start values that belong to a place's traces.
    fn values_of(&self, found: &FoundPlace) -> CarriedValues {
        let signature = self.fitted.structure.system.signature();
        let parameters = signature.parameters.iter().zip(&found.p);
        let unknowns: Vec<String> =
            signature.unknowns.iter().map(|unknown| unknown.name.to_string()).collect();
        let start = |trace: &PlaceTrace| {
            trace.start.iter().map(|(i, value)| (unknowns[*i].clone(), *value)).collect()
        };
        CarriedValues {
            p: parameters.map(|(parameter, value)| (parameter.name.to_string(), *value)).collect(),
            starts: found.train.iter().map(start).collect(),
        }
    }

    /// For each place, the formula that best resembles the missing term there; `None` if no simple one does.
    pub(crate) fn guesses(&self, places: &[&MissingCourse<'_>]) -> Vec<Option<FormulaGuess>> {
        let ranked = self.in_parallel(places.len(), |own, i| own.ranked(places[i]));
        let candidates: Vec<(usize, &RankedFormula)> = (ranked.iter().enumerate())
            .flat_map(|(place, forms)| forms.iter().map(move |form| (place, form)))
            .collect();
        let prices = self.in_parallel(candidates.len(), |own, k| {
            let (place, form) = candidates[k];
            let MissingCourse { site, values, .. } = places[place];
            let after = own.in_the_model(site, values, form, COMPARED)?.after;
            Some(after.mean_square().ln() + form.cost)
        });
        let best = |place: usize| {
            let of_place = candidates.iter().zip(&prices).filter(|((of, _), _)| *of == place);
            let priced = of_place.filter_map(|((_, form), price)| Some(((*price)?, *form)));
            // The first on a tie.
            let best = priced.reduce(|best, other| if other.0 < best.0 { other } else { best });
            best.map(|(_, form)| form)
        };
        self.in_parallel(places.len(), |own, i| {
            let (MissingCourse { site, values, train, .. }, form) = (places[i], best(i)?);
            own.told(site, form, train, own.in_the_model(site, values, form, EVALUATIONS)?)
        })
    }

    /// A law at a place as a formula; `None` if it does not reduce the errors.
    pub(crate) fn of_law(
        &self,
        place: &MissingCourse<'_>,
        terms: &[(FormulaShape, f64)],
    ) -> Option<FormulaGuess> {
        let MissingCourse { site, values, train, held_out } = place;
        let form = given(train, held_out, terms);
        self.told(site, &form, train, self.in_the_model(site, values, &form, EVALUATIONS)?)
    }

    /// Runs work on several threads, each with a fitted model of its own.
    fn in_parallel<T: Send>(
        &self,
        count: usize,
        work: impl Fn(&GuessData<'_>, usize) -> T + Sync,
    ) -> Vec<T> {
        let GuessData { base, sources, model, data, threads, .. } = *self;
        in_parallel(self.fitted, count, threads, |fitted, i| {
            work(&GuessData { base, sources, model, fitted, data, threads }, i)
        })
    }

    /// Formulas that resemble the missing term at a place.
    fn ranked(&self, followed: &MissingCourse<'_>) -> Vec<RankedFormula> {
        let model = self.model;
        let MissingCourse { site, train, held_out, .. } = followed;
        let is_preferred = |shape: &FormulaShape| {
            let dimension = shape.coefficient(&site.names, site.unit.dimension);
            let mut known = (model.parameters.iter()).map(|p| p.declared.unit.dimension);
            dimension.is_some_and(|own| {
                own == Unit::one().dimension || known.any(|dimension| dimension == own)
            })
        };
        let plain = site.names.iter().filter(|name| name.difference.is_none()).count();
        let plain = plain.min(NAMES);
        let names = [(model.inputs.len() + 1).min(plain), plain];
        ranked(train, held_out, names, &is_preferred)
    }

    /// Traces of a place in the training and in the validation recordings, each estimated alone; empty if one cannot be
    /// estimated.
    fn alone(&self, terms: &MissingTerms, place: usize) -> (Vec<PlaceTrace>, Vec<PlaceTrace>) {
        let GuessData { fitted, data, .. } = *self;
        let trace_of = |recording: &Recording, start: &[(usize, f64)]| {
            missing_input::alone(terms, fitted, data, place, recording, start)
        };
        let system = &fitted.structure.system;
        let train: Option<Vec<PlaceTrace>> = (data.train.iter().enumerate())
            .map(|(r, recording)| trace_of(recording, &fitted.values.starts(system, r)))
            .collect();
        let starts = fitted.held_out_starts(data, EVALUATIONS);
        let valid: Option<Vec<PlaceTrace>> = (data.valid.iter().zip(starts.iter().flatten()))
            .map(|(recording, start)| trace_of(recording, start))
            .collect();
        (train.unwrap_or_default(), valid.unwrap_or_default())
    }

    fn site<'a>(&self, terms: &'a MissingTerms, place: usize) -> Option<FormulaSite<'a>> {
        let model = self.model;
        let place = &terms.places()[place];
        let unit = match place.kind {
            PlaceKind::Equation => model.familiar(parse_unit(&place.unit).ok()?.dimension),
            PlaceKind::Output => {
                let output = model.outputs.iter().find(|o| o.declared.name == place.name)?;
                output.declared.unit.of_differences()
            }
            PlaceKind::Parameter => {
                let parameter = model.parameters.iter().find(|p| p.declared.name == place.name)?;
                parameter.declared.unit.of_differences()
            }
            PlaceKind::Input => {
                let input = model.inputs.iter().find(|input| input.declared.name == place.name)?;
                input.declared.unit.of_differences()
            }
        };
        Some(FormulaSite { name: &place.name, kind: place.kind, unit, names: names(model) })
    }

    /// Values of the names, and of the equation's parameters, along the trajectory with the missing term.
    fn along(
        &self,
        terms: &MissingTerms,
        place: usize,
        site: &FormulaSite<'_>,
        recording: &Recording,
        p: &[f64],
        found: &PlaceTrace,
    ) -> Option<InputTrace> {
        let GuessData { fitted, data, .. } = *self;
        let system = terms.system();
        let signature = system.signature();
        let around = missing_input::ReconstructedRecording {
            p,
            inputs: &recording.inputs,
            start: &found.start,
            times: &found.times,
            measured: &[],
            noise: &data.noise,
        };
        let inputs = inputs_with(terms, &around, place, &found.d).ok()?;
        let problem = Problem { system, p, inputs: &inputs, start: &found.start };
        let trajectory = match &found.followed {
            Some(followed) => followed.clone(),
            None => simulate(&problem, &found.times, &data.options).ok()?,
        };

        let first_place = signature.inputs.len() - terms.places().len();
        let positions: BTreeMap<&str, usize> =
            (signature.inputs.iter().take(first_place).enumerate())
                .map(|(i, input)| (&*input.name, i))
                .collect();
        let n_inputs = self.model.inputs.len();
        let plain: Vec<&FormulaFactor> =
            site.names.iter().filter(|name| name.difference.is_none()).collect();
        let mut names = vec![Vec::with_capacity(trajectory.len()); plain.len()];
        let free: Vec<usize> = (fitted.estimates.iter())
            .filter(|estimate| estimate.recording.is_none())
            .filter_map(|e| signature.parameters.iter().position(|p| p.name == e.name))
            .collect();
        let mut parameters = match site.kind {
            PlaceKind::Equation => vec![Vec::with_capacity(trajectory.len()); free.len()],
            PlaceKind::Parameter | PlaceKind::Input | PlaceKind::Output => Vec::new(),
        };
        let unknowns: Vec<String> =
            signature.unknowns.iter().map(|unknown| unknown.name.to_string()).collect();
        let mut u = vec![0.0; signature.inputs.len()];
        let mut by_u = vec![0.0; signature.input_jacobian.len()];
        let mut by_p = vec![0.0; signature.parameter_jacobian.len()];
        for k in 0..trajectory.len() {
            let point = sample_point(&trajectory, k, &inputs, p, &mut u);
            for (i, (values, factor)) in names.iter_mut().zip(&plain).enumerate() {
                let value = match i.cmp(&n_inputs) {
                    Ordering::Less => point.u[*positions.get(factor.name.as_str())?],
                    Ordering::Equal => point.t,
                    Ordering::Greater => {
                        point.y[unknowns.iter().position(|name| *name == factor.name)?]
                    }
                };
                values.push(value);
            }
            if parameters.is_empty() {
                continue;
            }
            // (∂f/∂p)/(∂f/∂d) of the row that contains d, times p.
            system.input_jacobian(point, &mut by_u);
            system.parameter_jacobian(point, &mut by_p);
            let of_d = (signature.input_jacobian.positions().zip(&by_u))
                .filter(|((_, column), _)| *column == first_place + place)
                .map(|((row, _), value)| (row, *value))
                .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
            for (values, parameter) in parameters.iter_mut().zip(&free) {
                let by_own = of_d.map(|(row, by_d)| {
                    let entries = signature.parameter_jacobian.positions().zip(&by_p);
                    let matching = entries.filter(|(position, _)| *position == (row, *parameter));
                    matching.map(|(_, value)| value).sum::<f64>() / by_d * p[*parameter].abs()
                });
                values.push(by_own.unwrap_or(f64::NAN));
            }
        }
        with_differences(&site.names, &mut names);
        Some(InputTrace {
            times: found.times.clone(),
            value: found.d.clone(),
            std: found.std.clone(),
            resolved: found.resolved,
            names,
            parameters,
        })
    }

    /// The fitted model with a formula; `None` if that fails.
    fn in_the_model(
        &self,
        site: &FormulaSite<'_>,
        from: &CarriedValues,
        ranked: &RankedFormula,
        evaluations: usize,
    ) -> Option<ModelWithFormula> {
        let GuessData { base, model, fitted, data, .. } = *self;
        let units = (ranked.terms.iter())
            .map(|(shape, _)| shape.unit(&site.names, &site.unit, model))
            .collect::<Option<Vec<Unit>>>()?;
        let parameters = &fitted.structure.system.signature().parameters;
        let is_taken = |name: &str| parameters.iter().any(|p| p.name == name);
        let terms = ranked.terms.iter().zip(&units);
        let terms = terms.map(|((shape, value), unit)| (shape, *value, unit));
        let constants = FormulaConstants::named("guess", terms, is_taken);
        let mut sources = self.sources.clone();
        let effect = read_effect("guess.dgd", text(model, site, &constants), &mut sources)?;
        let candidate = EffectCandidate::new(&effect, &[], false);
        let structure =
            base.structure(std::slice::from_ref(&candidate), StructureId::one(0)).ok()?;
        let name_in_model = |name: &str| {
            let brought = structure.brought.first()?;
            let entry = brought.names.iter().find(|(own, _)| own == name);
            entry.map(|(_, name)| name.clone())
        };
        let names = (constants.terms.iter())
            .map(|term| name_in_model(&term.name))
            .collect::<Option<Vec<String>>>()?;
        let inner: Vec<Option<String>> =
            constants.terms.iter().map(|term| name_in_model(term.inner.as_ref()?)).collect();

        let data = data.not_kept();
        let suggested = names.iter().cloned().zip(ranked.terms.iter().map(|(_, c)| *c));
        let values: Vec<(String, f64)> = suggested.collect();
        let at_nothing = names.iter().map(|name| (name.clone(), 0.0)).collect();
        let mut point = StartPoint { values, at_nothing, ..StartPoint::default() };
        let of_terms = inner.iter().zip(&ranked.terms);
        point.set(of_terms.filter_map(|(name, (shape, _))| Some((name.clone()?, shape.inner?))));
        let after = FittedStructure::new(structure, from, &[point], &data, evaluations).ok()?;
        Some(ModelWithFormula { after, names, units, inner })
    }

    /// The report on a formula; `None` if it does not reduce the errors.
    fn told(
        &self,
        site: &FormulaSite<'_>,
        ranked: &RankedFormula,
        train: &[InputTrace],
        inserted: ModelWithFormula,
    ) -> Option<FormulaGuess> {
        let GuessData { fitted, data, .. } = *self;
        let ModelWithFormula { mut after, names, units, inner } = inserted;
        let data = &data.not_kept();
        after.know_correlations(data);
        after.hold_out(data, EVALUATIONS);
        let (left_before, left_after) = (left(fitted, data)?, left(&after, data)?);
        if left_after.is_nan() || left_after >= LEFT * left_before {
            return None;
        }

        let estimate = |name: &String| {
            after.estimates.iter().find(|e| e.recording.is_none() && e.name == *name)
        };
        let mut terms = Vec::new();
        for ((((shape, _), name), unit), inner) in
            ranked.terms.iter().zip(&names).zip(&units).zip(&inner)
        {
            let of_inner = inner.as_ref().and_then(estimate);
            let inner = of_inner.map(|inner| inner.value).or(shape.inner);
            let shape = FormulaShape { inner, ..shape.clone() };
            let (own, std_of_inner) = (estimate(name)?, of_inner.and_then(|inner| inner.std));
            terms.push(FittedTerm { shape, value: own.value, std: own.std, std_of_inner, unit });
        }
        let coefficients: Vec<(f64, &Unit, &FormulaShape)> =
            terms.iter().map(|term| (term.value, term.unit, &term.shape)).collect();
        let ranges = ranges(site, ranked, train);
        let formula = formula(&coefficients, &site.names);
        let is_taken = |name: &str| self.model.parameters.iter().any(|p| p.declared.name == name);
        let constants = FormulaConstants::of_law(&terms, is_taken);
        Some(FormulaGuess {
            file: law(self.model, site, &constants, &formula, &ranges),
            formula,
            parameters: constants.told(&site.names),
            ranges,
            terms: terms.iter().map(|term| term.told(&site.names)).collect(),
            r2_held_out: ranked.r2,
            is_of_recordings: !data.valid.is_empty(),
            left_before,
            left_after,
        })
    }
}

/// The unknowns, inputs and parameters at a sample.
fn sample_point<'a>(
    trajectory: &'a Solution,
    k: usize,
    inputs: &dgd_runtime::Inputs,
    p: &'a [f64],
    u: &'a mut [f64],
) -> EvaluationPoint<'a> {
    let t = trajectory.times[k];
    inputs.value(t, trajectory.side(k), u);
    EvaluationPoint { t, y: trajectory.y(k), u, p, z: trajectory.z(k) }
}

/// Mean square of the errors relative to the noise, on validation recordings if there are any; if the model diverges
/// from the readings, the variance of these instead.
fn left(fitted: &FittedStructure, data: &SearchData<'_>) -> Option<f64> {
    let (recordings, residuals) = if data.valid.is_empty() {
        (data.train, fitted.residuals(data))
    } else {
        (data.valid, fitted.held_out_residuals(data)?)
    };
    let residuals = as_far_as_readings(recordings, residuals);
    let (sum, n) = whitened_square(recordings, &residuals, &data.noise);
    (n > 0).then(|| sum / n as f64)
}
