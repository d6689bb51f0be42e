//! Initial uncertainties and noise, from the command line, the model or defaults; and their report.

use std::fmt::Write as _;

use dgd_compiler::argument::Argument;
use dgd_compiler::diagnostics::{Code, Diagnostic};
use dgd_compiler::model::ProcessNoise;
use dgd_compiler::pipeline::CompiledStages;
use dgd_compiler::syntax;
use dgd_compiler::syntax::ast::{Expr, ExprKind, Name};
use dgd_compiler::units::{Unit, read_unit};
use dgd_identify::filter::{
    FilterAlgorithm, FilterProblem, FilterSample, FilterTuning, SigmaSpread, usual_tuning,
};
use serde_json::{Value, json};

use super::failed;
use crate::error::{UsageError, WorkError, meant};
use crate::model::Compilation;
use crate::output::table::{push_table, significant};
use crate::request::{TrackRequest, TrackerKind};

/// Default forgetting factor per row.
const FORGETTING: f64 = 0.999;

const MINUTE: f64 = 60.0;

/// Source of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum NumberOrigin {
    Asked,
    Declared,
    Usual(&'static str),
}

impl NumberOrigin {
    fn text(self) -> &'static str {
        match self {
            NumberOrigin::Asked => "asked",
            NumberOrigin::Declared => "declared",
            NumberOrigin::Usual(text) => text,
        }
    }
}

/// A value given on the command line for a name, SI.
struct GivenValue {
    name: String,
    value: f64,
}

/// Values from the options that set them.
pub(super) struct OptionValues {
    process_noise: Vec<GivenValue>,
    start_std: Vec<GivenValue>,
    noise: Vec<GivenValue>,
    outputs: Vec<String>,
}

impl OptionValues {
    /// Reads the options; mistakes are reported.
    pub(super) fn read(
        request: &TrackRequest,
        compilation: &mut Compilation<'_>,
        compiled: &CompiledStages,
    ) -> Self {
        let dae = &compiled.dae;
        let states =
            dae.unknowns.iter().filter(|unknown| dae.graph.value(unknown.mass) != Some(0.0));
        let states = states.map(|unknown| (unknown.name.clone(), unknown.unit.clone()));
        // All elements of an array, or a single one.
        let states = states.chain(dae.arrays.iter().flat_map(|array| {
            let elements = (0..array.count)
                .filter(|k| dae.is_differential(array.first + *k as usize))
                .map(|k| array.element_name(k));
            let names: Vec<String> = elements.collect();
            let whole = (!names.is_empty()).then(|| array.name.clone());
            whole.into_iter().chain(names).map(|name| (name, array.unit.clone()))
        }));
        let parameters = dae.parameters.iter();
        let parameters = parameters
            .map(|parameter| (parameter.declared.name.clone(), parameter.declared.unit.clone()));
        let tracked: Vec<(String, Unit)> = states.chain(parameters).collect();
        let known = crate::run::recording::KnownColumns::from_dae(dae);
        let outputs: Vec<(String, Unit)> = known
            .outputs()
            .iter()
            .map(|output| (output.name.to_owned(), output.unit.clone()))
            .collect();
        let mut values =
            |argument: Argument, texts: &[String], known: &[(String, Unit)]| -> Vec<GivenValue> {
                texts.iter().filter_map(|text| given(compilation, argument, text, known)).collect()
            };
        let process_noise = values(Argument::ProcessNoise, &request.process_noise, &tracked);
        let start_std = values(Argument::StartStd, &request.start_std, &tracked);
        let noise = values(Argument::Noise, &request.noise, &outputs);
        for name in &request.outputs {
            let name = compilation.name(Argument::Outputs, name.trim());
            find(compilation, &name, &outputs, "output");
        }
        let outputs = request.outputs.iter().map(|name| name.trim().to_owned()).collect();
        OptionValues { process_noise, start_std, noise, outputs }
    }
}

/// Checks that standard deviations have valid signs.
///
/// # Errors
///
/// One of them is negative, or zero where that is not allowed.
pub(super) fn verify_deviations(request: &TrackRequest) -> Result<(), WorkError> {
    let arguments = [
        (Argument::ProcessNoise, &request.process_noise, true),
        (Argument::StartStd, &request.start_std, false),
        (Argument::Noise, &request.noise, false),
    ];
    for (argument, texts, takes_zero) in arguments {
        for text in texts {
            let value = text.split_once('=').map_or("", |(_, value)| value.trim());
            // Anything else that is not a number is reported later with its place.
            let Ok(value) = value.split(['[', ' ']).next().unwrap_or_default().parse::<f64>()
            else {
                continue;
            };
            if !(value.is_finite() && (value > 0.0 || value == 0.0 && takes_zero)) {
                let given = argument.with(text);
                return Err(UsageError::Deviation { given, takes_zero }.into());
            }
        }
    }
    Ok(())
}

/// Declared process noise of a state, SI.
fn declared_rate(
    compiled: &CompiledStages,
    problem: &FilterProblem<'_>,
    state: &str,
) -> Option<f64> {
    match compiled.model.process_noise(state)? {
        ProcessNoise::Known(rate) => Some(rate),
        ProcessNoise::Parameter(i) => Some(problem.p[i as usize]),
    }
}

/// Reads `NAME=VALUE`, with the value in the declared unit or in a given one.
fn given(
    compilation: &mut Compilation<'_>,
    argument: Argument,
    text: &str,
    known: &[(String, Unit)],
) -> Option<GivenValue> {
    let source = compilation.argument(argument, text);
    let Compilation { sources, diagnostics, .. } = compilation;
    let (name, value) = syntax::parse_setting(source, sources, diagnostics).ok()?;
    let what = if argument == Argument::Noise { "output" } else { "state and no parameter" };
    let unit = find(compilation, &name, known, what)?;
    let Compilation { sources, diagnostics, .. } = compilation;
    let Expr { kind: ExprKind::Number { value: number, unit: own, .. }, span } = &value else {
        let message = "a number is needed here, with a unit or without";
        diagnostics.error(Diagnostic::new(Code::UnknownName, value.span, message));
        return None;
    };
    let unit_of_value = match own {
        None => unit.clone(),
        Some(own) => match read_unit(&own.text, own.span, sources) {
            Ok(own) => own,
            Err(diagnostic) => {
                diagnostics.error(*diagnostic);
                return None;
            }
        },
    };
    if unit_of_value.dimension != unit.dimension {
        let message = format!(
            "`{}` is in `{}`, which does not convert to `{}`",
            name.text, unit.symbol, unit_of_value.symbol
        );
        diagnostics.error(Diagnostic::new(Code::UnitsOfSides, *span, message));
        return None;
    }
    // A deviation has no offset.
    Some(GivenValue { name: name.text, value: number * unit_of_value.factor })
}

/// The unit of a name, if there is one.
fn find<'a>(
    compilation: &mut Compilation<'_>,
    name: &Name,
    known: &'a [(String, Unit)],
    what: &str,
) -> Option<&'a Unit> {
    let declared = known.iter().find(|(known, _)| *known == name.text);
    if declared.is_none() {
        let names: Vec<&str> = known.iter().map(|(name, _)| name.as_str()).collect();
        let message = format!("no {what} is called `{}`", name.text);
        let help = meant(&name.text, &names);
        compilation
            .diagnostics
            .error(Diagnostic::new(Code::UnknownName, name.span, message).help(help));
    }
    declared.map(|(_, unit)| unit)
}

/// The estimator with its options.
pub(super) fn estimator(request: &TrackRequest) -> Result<FilterAlgorithm, WorkError> {
    match request.estimator {
        TrackerKind::Ekf | TrackerKind::Ukf if request.forgetting.is_some() => {
            Err(UsageError::ForgettingInFilter.into())
        }
        TrackerKind::Recursive if !request.process_noise.is_empty() => {
            Err(UsageError::ProcessNoiseInRecursion.into())
        }
        TrackerKind::Ekf => Ok(FilterAlgorithm::ExtendedKalman),
        TrackerKind::Ukf => Ok(FilterAlgorithm::Unscented(SigmaSpread::default())),
        TrackerKind::Recursive => Ok(FilterAlgorithm::Recursive {
            forgetting_factor: request.forgetting.unwrap_or(FORGETTING),
            most_covariance: 1.0,
        }),
    }
}

/// Uncertainties and noise, with their sources.
pub(super) struct TrackSettings {
    pub tuning: FilterTuning,
    estimator: FilterAlgorithm,
    /// For states, then for parameters: sources of the initial uncertainty and of the process noise.
    origins: Vec<[NumberOrigin; 2]>,
    noise: Vec<Option<NumberOrigin>>,
}

impl TrackSettings {
    /// # Errors
    ///
    /// An output in use declares no noise, or initial values are missing.
    pub(super) fn new(
        asked: &OptionValues,
        compiled: &CompiledStages,
        problem: &FilterProblem<'_>,
        first: FilterSample<'_>,
        measured: &[bool],
    ) -> Result<Self, WorkError> {
        let signature = problem.system.signature();
        let mut tuning = usual_tuning(problem, first).map_err(failed)?;
        let usual =
            [NumberOrigin::Usual("10 % of its size"), NumberOrigin::Usual("0.1 % of its size")];
        let usual_parameter = [NumberOrigin::Usual("30 %"), NumberOrigin::Usual("10 % in an hour")];
        let mut origins = Vec::new();
        let find = |given: &[GivenValue], name: &str| {
            let is_it = |given: &&GivenValue| {
                let rest = name.strip_prefix(given.name.as_str());
                rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('['))
            };
            given.iter().rev().find(is_it).map(|given| given.value)
        };
        let states = problem.states().into_iter().map(|i| signature.unknowns.name(i));
        let parameters = problem.parameters();
        let named = parameters.iter().map(|i| signature.parameters[*i].name.clone());
        let priors = parameters.iter().map(|i| compiled.dae.parameters[*i].prior);
        let walks = tuning.states.iter_mut().chain(&mut tuning.parameters);
        let n_states = problem.states().len();
        let priors = std::iter::repeat_n(None, n_states).chain(priors);
        for (k, ((name, walk), prior)) in states.chain(named).zip(walks).zip(priors).enumerate() {
            let mut origin = if k < n_states { usual } else { usual_parameter };
            if let Some(prior) = prior {
                (walk.start, origin[0]) = (prior.std(), NumberOrigin::Declared);
            }
            if let Some(value) = find(&asked.start_std, &name) {
                (walk.start, origin[0]) = (value, NumberOrigin::Asked);
            }
            if let Some(rate) = declared_rate(compiled, problem, &name).filter(|_| k < n_states) {
                (walk.rate, origin[1]) = (rate, NumberOrigin::Declared);
            }
            if let Some(value) = find(&asked.process_noise, &name) {
                (walk.rate, origin[1]) = (value / MINUTE.sqrt(), NumberOrigin::Asked);
            }
            origins.push(origin);
        }

        let mut noise = Vec::with_capacity(measured.len());
        let mut without = Vec::new();
        for (i, output) in signature.outputs.iter().enumerate() {
            let wanted =
                asked.outputs.is_empty() || asked.outputs.iter().any(|o| *o == output.name);
            let sigma = &mut tuning.noise[i];
            if !(wanted && measured[i]) {
                *sigma = None;
                noise.push(None);
                continue;
            }
            let mut origin = NumberOrigin::Declared;
            if let Some(value) = find(&asked.noise, &output.name) {
                (*sigma, origin) = (Some(value), NumberOrigin::Asked);
            }
            if sigma.is_none() {
                without.push(output.name.to_string());
            }
            noise.push(Some(origin));
        }
        if let Some(first) = without.first() {
            let mut outputs = signature.outputs.iter();
            let output = outputs.find(|output| output.name == first.as_str());
            let unit = output.map_or_else(String::new, |output| output.unit.symbol.to_string());
            return Err(UsageError::FilterWithoutNoise { outputs: without, unit }.into());
        }
        Ok(TrackSettings { tuning, estimator: problem.estimator, origins, noise })
    }

    fn name(&self) -> &'static str {
        match self.estimator {
            FilterAlgorithm::ExtendedKalman => "extended Kalman filter",
            FilterAlgorithm::Unscented(_) => "unscented Kalman filter",
            FilterAlgorithm::Recursive { .. } => "recursive prediction error",
        }
    }

    /// As text.
    pub(super) fn text(&self, problem: &FilterProblem<'_>) -> String {
        let recursive = matches!(self.estimator, FilterAlgorithm::Recursive { .. });
        let mut text = format!("{}\n", self.name());
        if let FilterAlgorithm::Recursive { forgetting_factor, .. } = self.estimator {
            let _ = writeln!(
                text,
                "forgetting factor {forgetting_factor}: a memory of {:.0} rows; the covariance of the \
                 parameters never grows beyond the first one",
                1.0 / (1.0 - forgetting_factor)
            );
        }
        let mut rows = vec![
            ["tracked", "unit", "std at first", "why", "strays in a minute", "why"]
                .map(str::to_owned)
                .to_vec(),
        ];
        for (k, (name, unit, factor)) in Self::tracked(problem).into_iter().enumerate() {
            let walk = self.walk(k);
            let number = |value: f64| significant(value / factor.abs(), 3);
            let mut row =
                vec![name, unit, number(walk.start), self.origins[k][0].text().to_owned()];
            if !recursive {
                row.push(number(walk.rate * MINUTE.sqrt()));
                row.push(self.origins[k][1].text().to_owned());
            }
            rows.push(row);
        }
        if recursive {
            rows[0].truncate(4);
        }
        push_table(&mut text, &rows);
        let outputs = problem.system.signature().outputs.iter().zip(&self.tuning.noise);
        let noise: Vec<String> = outputs
            .zip(&self.noise)
            .filter_map(|((output, sigma), origin)| {
                let sigma = significant((*sigma)? / output.unit.factor.abs(), 3);
                let unit = &output.unit.symbol;
                Some(format!("{} {sigma} {unit} ({})", output.name, (*origin)?.text()))
            })
            .collect();
        let _ = write!(text, "noise: {}", noise.join(", "));
        text
    }

    /// For programs.
    pub(super) fn json(&self, problem: &FilterProblem<'_>) -> Value {
        let mut result = serde_json::Map::new();
        result.insert("estimator".to_owned(), json!(self.name()));
        if let FilterAlgorithm::Recursive { forgetting_factor, .. } = self.estimator {
            result.insert("forgetting_factor".to_owned(), json!(forgetting_factor));
        }
        let tracked =
            Self::tracked(problem).into_iter().enumerate().map(|(k, (name, unit, factor))| {
                let (walk, origin) = (self.walk(k), self.origins[k]);
                let entry = json!({
                    "unit": unit,
                    "start_std": walk.start / factor.abs(),
                    "start_std_from": origin[0].text(),
                    "strays_in_a_minute": walk.rate * MINUTE.sqrt() / factor.abs(),
                    "strays_from": origin[1].text(),
                });
                (name, entry)
            });
        result.insert("tracked".to_owned(), tracked.collect::<serde_json::Map<_, _>>().into());
        let outputs = problem.system.signature().outputs.iter().zip(&self.tuning.noise);
        let noise = outputs.zip(&self.noise).filter_map(|((output, sigma), origin)| {
            let unit = &output.unit;
            let entry = json!({
                "unit": unit.symbol,
                "std": (*sigma)? / unit.factor.abs(),
                "from": (*origin)?.text(),
            });
            Some((output.name.to_string(), entry))
        });
        result.insert("noise".to_owned(), noise.collect::<serde_json::Map<_, _>>().into());
        result.into()
    }

    fn walk(&self, k: usize) -> dgd_identify::filter::RandomWalk {
        let states = &self.tuning.states;
        states.get(k).copied().unwrap_or_else(|| self.tuning.parameters[k - states.len()])
    }

    /// Names, symbols and factors of the tracked quantities.
    fn tracked(problem: &FilterProblem<'_>) -> Vec<(String, String, f64)> {
        let signature = problem.system.signature();
        let entry = |name: &str, unit: &dgd_runtime::Unit| {
            (name.to_owned(), unit.symbol.to_string(), unit.factor)
        };
        let states = problem.states().into_iter();
        let states = states.map(|i| entry(&signature.unknowns.name(i), signature.unknowns.unit(i)));
        let parameters = problem.parameters().into_iter();
        let parameters =
            parameters.map(|i| entry(&signature.parameters[i].name, &signature.parameters[i].unit));
        states.chain(parameters).collect()
    }
}
