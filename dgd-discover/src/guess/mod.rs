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
mod together;

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::effects::Effect;
use dgd_compiler::model::Model;
use dgd_compiler::source::{Source, Sources};
use dgd_compiler::syntax::parse;
use dgd_compiler::units::{Unit, parse_unit};
use dgd_identify::Recording;
use dgd_runtime::{Point, Problem, Solution, System, simulate};

use crate::fit::{Data, Fitted, StartPoint, held_out_starts, whitened_square};
use crate::library::{BaseModel, Candidate, StructureId};
use crate::missing_input::{
    self, FoundPlace, MissingTerms, PlaceKind, PlaceTrace, inputs_with, place_of,
};
use formula::{Factor, Shape, familiar, formula, literal};
use regression::{Ranked, Trace, ranked};
use together::together;
pub use together::{Course, Together};

/// Share of the errors' mean square that it may leave when it is in the model.
const LEFT: f64 = 0.7;
/// Simulations of the fits that formulas are compared by.
const COMPARED: usize = 12;
/// By how much a second term has to lower the logarithm of the error's mean square.
const SECOND_TERM: f64 = 0.7;
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
    /// The formula as an effect file, which `--apply` takes.
    pub file: String,
    /// Over what the quantities in it were recorded, SI.
    pub ranges: Vec<LawRange>,
}

/// The range of a quantity within which a formula was compared with recordings.
#[derive(Debug, Clone)]
pub struct LawRange {
    /// The quantity.
    pub name: String,
    /// Its unit; of a temperature that of differences.
    pub unit: dgd_runtime::Unit,
    /// Its least value, SI.
    pub low: f64,
    /// Its largest value, SI.
    pub high: f64,
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

/// A place along all recordings: what formulas and names are compared with.
pub(crate) struct Followed<'a> {
    site: Site<'a>,
    train: Vec<Trace>,
    held_out: Vec<Trace>,
}

impl Followed<'_> {
    /// Quantities that what is missing goes together with, the closest first.
    pub(crate) fn together(&self) -> Vec<Together> {
        together(&self.train, &self.held_out, &self.site.names)
    }
}

/// The model with a formula in it.
struct Inserted {
    after: Fitted,
    /// The coefficients' names in the model, and their units.
    names: Vec<String>,
    units: Vec<Unit>,
}

impl Guessing<'_> {
    /// A place along all recordings; `None` where one of them cannot be simulated with what is missing.
    pub(crate) fn followed<'b>(
        &self,
        terms: &'b MissingTerms,
        found: &FoundPlace,
    ) -> Option<Followed<'b>> {
        let data = self.data;
        let place = place_of(terms, &found.missing.place)?;
        let site = self.site(terms, place)?;
        // A term of an equation, or a sensor's error, is compared beside the base model's own parameters: the regression
        // has what these would put there. What a parameter or an input does is known beside the changed ones.
        let is_beside_the_base = matches!(site.kind, PlaceKind::Equation | PlaceKind::Output);
        let (of_train, of_valid) = if is_beside_the_base {
            self.alone(terms, place)
        } else {
            (found.train.clone(), found.valid.clone())
        };
        let p = if is_beside_the_base { &self.fitted.p } else { &found.p };
        let traces = |recordings: &[Recording], traces: &[PlaceTrace]| -> Vec<Trace> {
            let both = recordings.iter().zip(traces);
            both.filter_map(|(recording, trace)| {
                self.along(terms, place, &site, recording, p, trace)
            })
            .collect()
        };
        let train = traces(data.train, &of_train);
        let held_out = traces(data.valid, &of_valid);
        let is_whole = !train.is_empty() && held_out.len() == data.valid.len();
        is_whole.then_some(Followed { site, train, held_out })
    }

    /// The formula that looks most like what is missing; `None` where no simple one does.
    pub(crate) fn guess(&self, followed: &Followed<'_>) -> Option<Guess> {
        let model = self.model;
        let Followed { site, train, held_out } = followed;
        let is_preferred = |shape: &Shape| {
            let dimension = shape.coefficient(&site.names, site.unit.dimension);
            let mut known = (model.parameters.iter()).map(|p| p.declared.unit.dimension);
            dimension.is_some_and(|own| {
                own == Unit::one().dimension || known.any(|dimension| dimension == own)
            })
        };
        let names = [(model.inputs.len() + 1).min(site.names.len()), site.names.len()];
        let all = ranked(train, held_out, names, &is_preferred);
        let compared = all.iter().filter_map(|ranked| {
            let inserted = self.in_the_model(site, ranked, COMPARED)?;
            let (sum, n) = inserted.after.error;
            let cost = SECOND_TERM * ranked.terms.len() as f64;
            Some(((sum / n as f64).ln() + cost, ranked))
        });
        // The first of equals, which is the simplest.
        let best = compared.reduce(|best, other| if other.0 < best.0 { other } else { best });
        let (_, ranked) = best?;
        self.told(site, ranked, train, self.in_the_model(site, ranked, EVALUATIONS)?)
    }

    /// Traces of a place in the training and in the validation recordings, each by itself; none where one has none.
    fn alone(&self, terms: &MissingTerms, place: usize) -> (Vec<PlaceTrace>, Vec<PlaceTrace>) {
        let Guessing { fitted, data, .. } = *self;
        let of = |recording: &Recording, start: &[(usize, f64)]| {
            missing_input::alone(terms, fitted, data, place, recording, start)
        };
        let system = &fitted.structure.system;
        let train: Option<Vec<PlaceTrace>> = (data.train.iter().enumerate())
            .map(|(r, recording)| of(recording, &fitted.values.starts(system, r)))
            .collect();
        let starts = held_out_starts(&fitted.structure, &fitted.p, data, EVALUATIONS);
        let valid: Option<Vec<PlaceTrace>> = (data.valid.iter().zip(starts.iter().flatten()))
            .map(|(recording, start)| of(recording, start))
            .collect();
        (train.unwrap_or_default(), valid.unwrap_or_default())
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
            PlaceKind::Parameter => {
                let own = model.parameters.iter().find(|p| p.declared.name == place.name)?;
                own.declared.unit.of_differences()
            }
            PlaceKind::Input => {
                let own = model.inputs.iter().find(|input| input.declared.name == place.name)?;
                own.declared.unit.of_differences()
            }
        };
        let inputs = model.inputs.iter().map(|input| &input.declared);
        let unknowns = model.unknowns.iter().map(|unknown| &unknown.declared);
        let factor = |declared: &dgd_compiler::model::Declared| Factor {
            name: declared.name.clone(),
            unit: declared.unit.of_differences(),
        };
        let time = Factor { name: "time".to_owned(), unit: parse_unit("s").ok()? };
        let names = inputs.map(factor).chain([time]).chain(unknowns.map(factor));
        let names = names.take(NAMES).collect();
        Some(Site { name: &place.name, kind: place.kind, unit, names })
    }

    /// Names and the equation's parameters along the trajectory that has what is missing.
    fn along(
        &self,
        terms: &MissingTerms,
        place: usize,
        site: &Site<'_>,
        recording: &Recording,
        p: &[f64],
        found: &PlaceTrace,
    ) -> Option<Trace> {
        let Guessing { fitted, data, .. } = *self;
        let system = terms.system();
        let signature = system.signature();
        let around = missing_input::Recording {
            p,
            inputs: &recording.inputs,
            start: &found.start,
            times: &found.times,
            measured: &[],
            noise: &data.noise,
        };
        let inputs = inputs_with(terms, &around, place, &found.d).ok()?;
        let problem = Problem { system, p, inputs: &inputs, start: &found.start };
        let trajectory = simulate(&problem, &found.times, &data.options).ok()?;

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
            PlaceKind::Parameter | PlaceKind::Input | PlaceKind::Output => Vec::new(),
        };
        let unknowns: Vec<String> =
            signature.unknowns.iter().map(|unknown| unknown.name.to_string()).collect();
        let mut u = vec![0.0; signature.inputs.len()];
        let mut by_u = vec![0.0; signature.input_jacobian.len()];
        let mut by_p = vec![0.0; signature.parameter_jacobian.len()];
        for k in 0..trajectory.len() {
            let at = at(&trajectory, k, &inputs, p, &mut u);
            for (i, (values, factor)) in names.iter_mut().zip(&site.names).enumerate() {
                let value = match i.cmp(&n_inputs) {
                    Ordering::Less => at.u[*positions.get(factor.name.as_str())?],
                    Ordering::Equal => at.t,
                    Ordering::Greater => {
                        at.y[unknowns.iter().position(|name| *name == factor.name)?]
                    }
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
        Some(Trace {
            times: found.times.clone(),
            value: found.d.clone(),
            std: found.std.clone(),
            resolved: found.resolved,
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
        let values: Vec<f64> = ranked.terms.iter().map(|(_, value)| *value).collect();
        let nothing = vec![None; values.len()];
        let effect = self.effect(&text(model, site, ranked, &values, &units, &names, &nothing))?;
        let candidate = Candidate::new(&effect, &[], false);
        let structure =
            base.structure(std::slice::from_ref(&candidate), StructureId::one(0)).ok()?;
        let own = |name: &str| {
            let brought = structure.brought.first()?;
            let found = brought.names.iter().find(|(own, _)| own == name);
            found.map(|(_, name)| name.clone())
        };
        let brought = names.iter().map(|name| own(name)).collect::<Option<Vec<String>>>()?;

        let data = data.not_kept();
        let suggested = brought.iter().cloned().zip(ranked.terms.iter().map(|(_, c)| *c));
        let values: Vec<(String, f64)> = suggested.collect();
        let at_nothing = brought.iter().map(|name| (name.clone(), 0.0)).collect();
        let point = [StartPoint { values, at_nothing }];
        let after = Fitted::new(structure, &fitted.values, &point, &data, evaluations).ok()?;
        Some(Inserted { after, names: brought, units })
    }

    /// All that is said of a formula; `None` where it leaves the errors as they were.
    fn told(
        &self,
        site: &Site<'_>,
        ranked: &Ranked,
        train: &[Trace],
        inserted: Inserted,
    ) -> Option<Guess> {
        let Guessing { fitted, data, .. } = *self;
        let Inserted { mut after, names, units } = inserted;
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
        let ranges = ranges(site, ranked, train);
        let formula = formula(&all, &site.names);
        let stds: Vec<Option<f64>> = fitted_terms.iter().map(|e| e.std).collect();
        let file = self.law(site, ranked, &all, &stds, &formula, &ranges);
        Some(Guess {
            formula,
            file,
            ranges,
            terms: terms.collect(),
            r2_held_out: ranked.r2,
            is_of_recordings: !data.valid.is_empty(),
            left_before,
            left_after,
        })
    }

    /// The formula as an effect file, with standard deviations and the ranges that it was compared over.
    fn law(
        &self,
        site: &Site<'_>,
        ranked: &Ranked,
        terms: &[(f64, &Unit, &Shape)],
        stds: &[Option<f64>],
        formula: &str,
        ranges: &[LawRange],
    ) -> String {
        let place = match site.kind {
            PlaceKind::Equation => format!("the equation `{}` lacks", site.name),
            PlaceKind::Parameter => format!("the parameter `{}` changes by", site.name),
            PlaceKind::Input => format!("the input `{}` acts more by", site.name),
            PlaceKind::Output => format!("the sensor `{}` reads more by", site.name),
        };
        let mut doc = format!(
            "/// A formula found in recordings: {place} `{formula}`.\n///\n/// It describes them and is not \
             confirmed."
        );
        let within: Vec<String> = ranges.iter().map(LawRange::words).collect();
        if !within.is_empty() {
            let _ = write!(doc, " It was compared with them for {}.", within.join(", "));
        }
        let own = |name: &str| self.model.parameters.iter().any(|p| p.declared.name == name);
        let numbers = (1..).map(|i| format!("law_{i}")).filter(|name| !own(name));
        let names: Vec<String> = numbers.take(terms.len()).collect();
        let units: Vec<Unit> = terms.iter().map(|(_, unit, _)| (*unit).clone()).collect();
        let values: Vec<f64> = terms.iter().map(|(value, ..)| *value).collect();
        let text = text(self.model, site, ranked, &values, &units, &names, stds);
        format!("{doc}\n{text}").replacen("effect guess on", "effect law on", 1)
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
    values: &[f64],
    units: &[Unit],
    names: &[String],
    stds: &[Option<f64>],
) -> String {
    let mut parameters = String::new();
    let mut sum = Vec::new();
    let terms = ranked.terms.iter().zip(values).zip(units).zip(names).zip(stds);
    for (((((shape, _), value), unit), name), std) in terms {
        let value = literal(value / unit.factor);
        // Writing to a string cannot fail.
        let _ = write!(parameters, "parameter {name} [{}] = {value}", unit.symbol);
        if let Some(std) = std {
            let _ = write!(parameters, "    /// ± {}", literal(std / unit.factor));
        }
        parameters.push('\n');
        sum.push(format!("{name}{}", shape.text(&site.names)));
    }
    for name in names {
        let _ = writeln!(parameters, "null {name} = 0");
    }
    let (model, place, sum) = (&model.name, site.name, sum.join(" + "));
    let (kind, change) = match site.kind {
        PlaceKind::Equation => ("plant", format!("add {sum} to {place}")),
        PlaceKind::Parameter => ("plant", format!("replace {place} by {place} + {sum}")),
        PlaceKind::Input => ("input", format!("replace {place} by {place} + {sum}")),
        PlaceKind::Output => ("sensor", format!("replace output {place} by {place} + {sum}")),
    };
    format!("effect guess on {model}\nkind {kind}\n\n{parameters}\n{change}\n")
}

/// Ranges of the names that a formula has, in the training recordings.
fn ranges(site: &Site<'_>, ranked: &Ranked, train: &[Trace]) -> Vec<LawRange> {
    let used = ranked.terms.iter().flat_map(|(shape, _)| shape.forms().map(|(name, _)| name));
    let used: BTreeSet<usize> = used.collect();
    let range = |name: usize| {
        let values = train.iter().flat_map(|trace| trace.names[name].iter().copied());
        let (low, high) = values
            .filter(|value| value.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        let Factor { name, unit } = &site.names[name];
        let unit = dgd_runtime::Unit {
            symbol: unit.symbol.clone().into(),
            factor: unit.factor,
            offset: 0.0,
        };
        LawRange { name: name.clone(), unit, low, high }
    };
    used.into_iter().map(range).collect()
}

impl LawRange {
    fn words(&self) -> String {
        let [low, high] = [self.low, self.high].map(|x| literal(x / self.unit.factor));
        format!("`{}` between {low} and {high} {}", self.name, self.unit.symbol)
    }
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
