//! A formula for what has no name, offered as a guess.
//!
//! ```text
//!   what is missing in each recording, around the trajectory that has it    (reconstruct)
//!   formulas of the model's names that look like it                         (regression, forms, formula)
//!   the model with each of them, fitted again: which follows the recordings (structure, fitted)
//! ```
//!
//! The regression finds forms. Which of them, and of what size, is for fits in which the model has the
//! formula: they know of no smoothing, of all that parameters and start values have taken over, and of
//! unknowns that only answer to what is missing. A formula that lets the model's errors stay as they are
//! was none.
//!
//! That it holds up on recordings which it was not chosen by makes it a description of them. Nothing
//! confirms the form: many agree over the range that was recorded.

mod forms;
mod formula;
mod regression;

use std::collections::BTreeMap;
use std::fmt::Write;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::effects::{Application, Effect, Reach};
use dgd_compiler::model::Model;
use dgd_compiler::source::{Source, Sources};
use dgd_compiler::syntax::parse;
use dgd_compiler::units::{Unit, parse_unit};
use dgd_identify::journal::{Digest, Forgetful};
use dgd_identify::{Recording, Unwatched};
use dgd_runtime::{Point, Problem, Solution, System, simulate};

use crate::fit::{Data, Fitted, StartPoint, WorkJournal, held_out_starts, whitened_square};
use crate::library::{BaseModel, Candidate, StructureId};
use crate::missing_input::{
    self, MissingInput, MissingTerms, PlaceKind, Simulated, UnknownInput, inputs_with, place_of,
    reconstruct, simulated, unknown_input,
};
use formula::{Factor, Shape, familiar, formula};
use regression::{Ranked, Trace, ranked};

/// Share of the errors' mean square that it may leave when it is in the model.
const LEFT: f64 = 0.7;
/// Simulations of the fits that formulas are compared by.
const COMPARED: usize = 12;
/// By how much a second term has to lower the logarithm of the error's mean square.
const SECOND_TERM: f64 = 0.7;
/// Times that an estimate is made again around its trajectory.
const ROUNDS: usize = 2;
/// Simulations of a fit with a formula.
const EVALUATIONS: usize = 40;
/// Names that are looked at.
const NAMES: usize = 24;

/// A formula of the model's names that looks like what is missing: a guess, which nothing confirms.
#[derive(Debug, Clone)]
pub struct Guess {
    /// The formula in the language, units included: to be added to the right-hand side of the equation, or
    /// to what the sensor reads.
    pub formula: String,
    /// Its terms, two at most.
    pub terms: Vec<GuessedTerm>,
    /// 1 − Σ w (d − formula)²/Σ w (d − d₀)² of what is missing, d, where the formula was not fitted to
    /// it: in the validation recordings, without any in tenths of the training recordings.
    pub r2_held_out: f64,
    /// Whether that is of validation recordings.
    pub is_of_recordings: bool,
    /// Mean square of the base model's errors over the noise, of validation recordings where there are any.
    pub left_before: f64,
    /// The same when the formula is in the model.
    pub left_after: f64,
}

/// A term of a [`Guess`].
#[derive(Debug, Clone)]
pub struct GuessedTerm {
    /// What the coefficient multiplies, its operator first: `* q*abs(q)`; empty for a constant.
    pub factor: String,
    /// The coefficient, SI, from a fit of the model with the formula in it.
    pub coefficient: f64,
    /// Its standard deviation; `None` where the data does not determine it.
    pub std: Option<f64>,
    /// Its unit.
    pub unit: dgd_runtime::Unit,
}

/// What a guess is made from.
pub(crate) struct Guessing<'a> {
    pub base: &'a BaseModel,
    pub sources: &'a Sources,
    pub model: &'a Model,
    pub fitted: &'a Fitted,
    pub data: &'a Data<'a>,
}

/// Where a formula goes.
struct Site<'a> {
    /// The equation's label or the output's name.
    name: &'a str,
    kind: PlaceKind,
    /// The unit that it is read in.
    unit: Unit,
    names: Vec<Factor>,
}

/// The model with a formula in it.
struct Inserted {
    after: Fitted,
    /// The coefficients' names in the model, and their units.
    names: Vec<String>,
    units: Vec<Unit>,
}

impl Guessing<'_> {
    /// The formula that looks most like a missing input; `None` where no simple one does.
    pub(crate) fn guess(&self, missing: &MissingInput) -> Option<Guess> {
        let Guessing { base, model, fitted, data, .. } = *self;
        let terms = MissingTerms::new(model, base.engine, &mut Diagnostics::default()).ok()?;
        let place = place_of(&terms, missing)?;
        let site = self.site(&terms, place)?;
        let system = &fitted.structure.system;
        let trace = |recording: &Recording, start: &[(usize, f64)]| {
            self.trace(&terms, place, &site, recording, start)
        };
        let train: Vec<Trace> = (data.train.iter().enumerate())
            .filter_map(|(r, recording)| trace(recording, &fitted.values.starts(system, r)))
            .collect();
        let starts = held_out_starts(&fitted.structure, &fitted.p, data, EVALUATIONS);
        let held_out: Vec<Trace> = (data.valid.iter().zip(starts.iter().flatten()))
            .filter_map(|(recording, start)| trace(recording, start))
            .collect();
        if train.is_empty() || held_out.len() < data.valid.len() {
            return None;
        }
        let is_preferred = |shape: &Shape| {
            let dimension = shape.coefficient(&site.names, site.unit.dimension);
            let mut known = (model.parameters.iter()).map(|p| p.declared.unit.dimension);
            dimension.is_some_and(|own| {
                own == Unit::one().dimension || known.any(|dimension| dimension == own)
            })
        };
        let names = [model.inputs.len().min(site.names.len()), site.names.len()];
        let all = ranked(&train, &held_out, names, &is_preferred);
        let compared = all.iter().filter_map(|ranked| {
            let inserted = self.in_the_model(&site, ranked, COMPARED)?;
            let (sum, n) = inserted.after.error;
            let cost = SECOND_TERM * ranked.terms.len() as f64;
            Some(((sum / n as f64).ln() + cost, ranked))
        });
        // The first of equals, which is the simplest.
        let best = compared.reduce(|best, other| if other.0 < best.0 { other } else { best });
        let (_, ranked) = best?;
        self.told(&site, ranked, self.in_the_model(&site, ranked, EVALUATIONS)?)
    }

    fn site<'a>(&self, terms: &'a MissingTerms, place: usize) -> Option<Site<'a>> {
        let model = self.model;
        let place = &terms.places()[place];
        let unit = match place.kind {
            PlaceKind::Equation => familiar(parse_unit(&place.unit).ok()?.dimension, model),
            PlaceKind::Output => {
                let output = model.outputs.iter().find(|o| o.declared.name == place.name)?;
                output.declared.unit.of_differences()
            }
        };
        let inputs = model.inputs.iter().map(|input| &input.declared);
        let unknowns = model.unknowns.iter().map(|unknown| &unknown.declared);
        let factor = |declared: &dgd_compiler::model::Declared| Factor {
            name: declared.name.clone(),
            unit: declared.unit.of_differences(),
        };
        let names = inputs.chain(unknowns).take(NAMES).map(factor).collect();
        Some(Site { name: &place.name, kind: place.kind, unit, names })
    }

    /// What is missing at a place in one recording, around the trajectory that has it.
    fn trace(
        &self,
        terms: &MissingTerms,
        place: usize,
        site: &Site<'_>,
        recording: &Recording,
        start: &[(usize, f64)],
    ) -> Option<Trace> {
        let Guessing { fitted, data, .. } = *self;
        let Simulated { deviations, residuals, .. } =
            simulated(terms, fitted, data, recording, start)?;
        let mut found = unknown_input(&deviations, place, &residuals, &data.noise)?;
        let n_w = terms.system().signature().outputs.len();
        let reading = |(k, i): (usize, usize)| {
            recording.measured[i].as_ref().map_or(f64::NAN, |measured| measured[k])
        };
        let readings = (0..recording.times.len()).flat_map(|k| (0..n_w).map(move |i| (k, i)));
        let measured: Vec<f64> = readings.map(reading).collect();
        let around = missing_input::Recording {
            p: &fitted.p,
            inputs: &recording.inputs,
            start,
            times: &recording.times,
            measured: &measured,
            noise: &data.noise,
        };
        for _ in 0..ROUNDS {
            match reconstruct(terms, &around, place, &found, &data.options) {
                Ok(Some(again)) if again.intensity > 0.0 => found = again,
                // The estimate goes as far as the linearisation does.
                Ok(_) | Err(_) => break,
            }
        }
        if found.intensity == 0.0 {
            return None;
        }
        self.along(terms, place, site, &around, &found)
    }

    /// Names and the equation's parameters along the trajectory that has what is missing.
    fn along(
        &self,
        terms: &MissingTerms,
        place: usize,
        site: &Site<'_>,
        recording: &missing_input::Recording<'_>,
        found: &UnknownInput,
    ) -> Option<Trace> {
        let Guessing { fitted, data, .. } = *self;
        let system = terms.system();
        let signature = system.signature();
        let inputs = inputs_with(terms, recording, place, &found.estimate).ok()?;
        let (p, start) = (recording.p, recording.start);
        let problem = Problem { system, p, inputs: &inputs, start };
        let trajectory = simulate(&problem, recording.times, &data.options).ok()?;

        let own = signature.inputs.len() - terms.places().len();
        let positions: BTreeMap<&str, usize> = (signature.inputs.iter().take(own).enumerate())
            .map(|(i, input)| (&*input.name, i))
            .collect();
        let n_inputs = self.model.inputs.len();
        let mut names = vec![Vec::with_capacity(trajectory.len()); site.names.len()];
        let free: Vec<usize> = (fitted.estimates.iter())
            .filter(|estimate| estimate.recording.is_none())
            .filter_map(|e| signature.parameters.iter().position(|p| p.name == e.name))
            .collect();
        let mut parameters = match site.kind {
            PlaceKind::Equation => vec![Vec::with_capacity(trajectory.len()); free.len()],
            PlaceKind::Output => Vec::new(),
        };
        let unknowns: Vec<String> =
            signature.unknowns.iter().map(|unknown| unknown.name.to_string()).collect();
        let mut u = vec![0.0; signature.inputs.len()];
        let mut by_u = vec![0.0; signature.input_jacobian.len()];
        let mut by_p = vec![0.0; signature.parameter_jacobian.len()];
        for k in 0..trajectory.len() {
            let at = at(&trajectory, k, &inputs, p, &mut u);
            for (i, (values, factor)) in names.iter_mut().zip(&site.names).enumerate() {
                let value = if i < n_inputs {
                    at.u[*positions.get(factor.name.as_str())?]
                } else {
                    at.y[unknowns.iter().position(|name| *name == factor.name)?]
                };
                values.push(value);
            }
            if parameters.is_empty() {
                continue;
            }
            // (∂f/∂p)/(∂f/∂d) of the row that has d, times p.
            system.input_jacobian(at, &mut by_u);
            system.parameter_jacobian(at, &mut by_p);
            let of_d = (signature.input_jacobian.positions().zip(&by_u))
                .filter(|((_, column), _)| *column == own + place)
                .map(|((row, _), value)| (row, *value))
                .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
            for (values, parameter) in parameters.iter_mut().zip(&free) {
                let by_own = of_d.map(|(row, by_d)| {
                    let entries = signature.parameter_jacobian.positions().zip(&by_p);
                    let own = entries.filter(|(at, _)| *at == (row, *parameter));
                    own.map(|(_, value)| value).sum::<f64>() / by_d * p[*parameter].abs()
                });
                values.push(by_own.unwrap_or(f64::NAN));
            }
        }
        let mut std = found.std.clone();
        let typical = dgd_screen::noise::median(&mut std)?;
        Some(Trace {
            times: found.times.clone(),
            value: found.estimate.clone(),
            std: found.std.clone(),
            resolved: 2.0 * typical * typical / found.intensity,
            names,
            parameters,
        })
    }

    /// The model with a formula, fitted; `None` where it cannot be.
    fn in_the_model(
        &self,
        site: &Site<'_>,
        ranked: &Ranked,
        evaluations: usize,
    ) -> Option<Inserted> {
        let Guessing { base, model, fitted, data, .. } = *self;
        let units = (ranked.terms.iter())
            .map(|(shape, _)| shape.unit(&site.names, &site.unit, model))
            .collect::<Option<Vec<Unit>>>()?;
        let mut names = Vec::new();
        let mut number = 0;
        while names.len() < ranked.terms.len() {
            number += 1;
            let name = format!("guess_{number}");
            if fitted.structure.system.signature().parameters.iter().all(|p| p.name != name) {
                names.push(name);
            }
        }
        let effect = self.effect(&text(model, site, ranked, &units, &names))?;
        let application =
            Application { effect: &effect, arguments: Vec::new(), span: effect.name.span };
        let (onsets, delays) = (Vec::new(), Vec::new());
        let reach = Reach::default();
        let candidate = Candidate { application, onsets, delays, is_generic: false, reach };
        let structure =
            base.structure(std::slice::from_ref(&candidate), StructureId::one(0)).ok()?;
        let own = |name: &str| {
            let brought = structure.brought.first()?;
            let found = brought.names.iter().find(|(own, _)| own == name);
            found.map(|(_, name)| name.clone())
        };
        let brought = names.iter().map(|name| own(name)).collect::<Option<Vec<String>>>()?;

        let data = Self::not_kept(data);
        let suggested = brought.iter().cloned().zip(ranked.terms.iter().map(|(_, c)| *c));
        let values: Vec<(String, f64)> = suggested.collect();
        let at_nothing = brought.iter().map(|name| (name.clone(), 0.0)).collect();
        let point = [StartPoint { values, at_nothing }];
        let after = Fitted::new(structure, &fitted.values, &point, &data, evaluations).ok()?;
        Some(Inserted { after, names: brought, units })
    }

    /// All that is said of a formula; `None` where it leaves the errors as they were.
    fn told(&self, site: &Site<'_>, ranked: &Ranked, inserted: Inserted) -> Option<Guess> {
        let Guessing { fitted, data, .. } = *self;
        let Inserted { mut after, names, units } = inserted;
        let data = &Self::not_kept(data);
        after.know_correlations(data);
        after.hold_out(data, EVALUATIONS);
        let (left_before, left_after) = (left(fitted, data)?, left(&after, data)?);
        if left_after.is_nan() || left_after >= LEFT * left_before {
            return None;
        }

        let estimate = |name: &String| {
            after.estimates.iter().find(|e| e.recording.is_none() && e.name == *name)
        };
        let fitted_terms = names.iter().map(estimate).collect::<Option<Vec<_>>>()?;
        let shapes = ranked.terms.iter().map(|(shape, _)| shape);
        let with_units = fitted_terms.iter().zip(&units).zip(shapes.clone());
        let all: Vec<(f64, &Unit, &Shape)> =
            with_units.clone().map(|((e, unit), shape)| (e.value, unit, shape)).collect();
        let terms = with_units.map(|((estimate, unit), shape)| GuessedTerm {
            factor: shape.text(&site.names).trim_start().to_owned(),
            coefficient: estimate.value,
            std: estimate.std,
            unit: dgd_runtime::Unit {
                symbol: unit.symbol.clone().into(),
                factor: unit.factor,
                offset: 0.0,
            },
        });
        Some(Guess {
            formula: formula(&all, &site.names),
            terms: terms.collect(),
            r2_held_out: ranked.r2,
            is_of_recordings: !data.valid.is_empty(),
            left_before,
            left_after,
        })
    }

    /// Data whose fits are not kept: their keys know a structure by the positions of its candidates.
    fn not_kept<'b>(data: &Data<'b>) -> Data<'b> {
        let keeping =
            WorkJournal { journal: &Forgetful, watch: &Unwatched, request: Digest::EMPTY };
        Data { keeping, own_weights: false, ..data.clone() }
    }

    /// An effect from its text.
    fn effect(&self, text: &str) -> Option<Effect> {
        let mut sources = self.sources.clone();
        let mut diagnostics = Diagnostics::default();
        let id = sources.add(Source { name: "guess.dgd".to_owned(), text: text.to_owned() });
        let ast = parse(id, &sources, &mut diagnostics).ok()?;
        Effect::read(ast, &mut diagnostics).ok()
    }
}

/// The unknowns, inputs and parameters at a sample.
fn at<'a>(
    trajectory: &'a Solution,
    k: usize,
    inputs: &dgd_runtime::Inputs,
    p: &'a [f64],
    u: &'a mut [f64],
) -> Point<'a> {
    let t = trajectory.times[k];
    inputs.value(t, trajectory.side(k), u);
    Point { t, y: trajectory.y(k), u, p, z: trajectory.z(k) }
}

/// The formula as an effect, its coefficients as parameters.
fn text(
    model: &Model,
    site: &Site<'_>,
    ranked: &Ranked,
    units: &[Unit],
    names: &[String],
) -> String {
    let mut parameters = String::new();
    let mut sum = Vec::new();
    for (((shape, coefficient), unit), name) in ranked.terms.iter().zip(units).zip(names) {
        let value = coefficient / unit.factor;
        // Writing to a string cannot fail.
        let _ = writeln!(parameters, "parameter {name} [{}] = {value:e}", unit.symbol);
        sum.push(format!("{name}{}", shape.text(&site.names)));
    }
    let (model, place, sum) = (&model.name, site.name, sum.join(" + "));
    let (kind, change) = match site.kind {
        PlaceKind::Equation => ("plant", format!("add {sum} to {place}")),
        PlaceKind::Output => ("sensor", format!("replace output {place} by {place} + {sum}")),
    };
    format!("effect guess on {model}\nkind {kind}\n\n{parameters}\n{change}\n")
}

/// Mean square of the errors over the noise, on validation recordings where there are any.
fn left(fitted: &Fitted, data: &Data<'_>) -> Option<f64> {
    let (sum, n) = if data.valid.is_empty() {
        whitened_square(data.train, &fitted.residuals(data), &data.noise)
    } else {
        whitened_square(data.valid, &fitted.held_out_residuals(data)?, &data.noise)
    };
    (n > 0).then(|| sum / n as f64)
}
