//! Common parts of commands that run a model once: data, initial values, times, the simulation itself.

pub(crate) mod densities;
pub(crate) mod equations;
pub(crate) mod jumps;
pub(crate) mod keeping;
pub(crate) mod memory;
pub(crate) mod recording;
pub(crate) mod reservations;
pub(crate) mod under_way;

use std::collections::BTreeSet;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::model::{Automaton, AutomatonOrigin, Model, Transition};
use dgd_compiler::program::Program;
use dgd_compiler::source::SourceMap;
use dgd_data::Epoch;
use dgd_execute::Engine;
use dgd_runtime::integrate::catalogue::AUTOMATIC;
use dgd_runtime::linearize::rest;
use dgd_runtime::{
    Failure, Inputs, IntegrateError, Observations, Options, OtherMethod, Problem, Signature,
    Solution, Steps, System, automatic_method, choose_per_sample, consistent_start, find_method,
    method_to_begin, observe, simulate, simulate_observed, simulate_with_sensitivities,
};

use crate::error::{ComputationError, Interruption, UsageError, WorkError};
use crate::model::LoadedModel;
use crate::output::columns::is_element;
use crate::output::conserved::combination;
use crate::output::provenance::{DataFile, Provenance};
use crate::request::{RunRequest, SolverOptions, StartChoice};
use crate::session::TaskContext;
pub use recording::MeasuredOutputs;
use recording::{RunRecording, TimeColumnRule};

/// Rows of a run without a data file or `--every`.
const DEFAULT_ROWS: u32 = 1000;

/// Most rows a run may have; more is a mistyped `--every`.
const MOST_ROWS: f64 = 1e8;

/// A model ready to run on its data.
pub(crate) struct ModelRun {
    pub system: dgd_execute::LoadedSystem,
    /// Parameters, SI.
    pub p: Vec<f64>,
    pub inputs: Inputs,
    /// Initial values that replace the model's.
    pub start: Vec<(usize, f64)>,
    /// Times of the rows.
    pub times: Vec<f64>,
    /// The timestamp of time zero, if the data has timestamps.
    pub epoch: Option<Epoch>,
    /// Measured outputs in the data.
    pub measured: MeasuredOutputs,
    pub options: Options,
    /// Versions and digests of the inputs.
    pub provenance: Provenance,
}

impl ModelRun {
    /// Reads the data, builds the inputs, and determines times and initial values.
    pub(crate) fn prepare(
        args: &RunRequest,
        loaded: LoadedModel,
        session: TaskContext<'_>,
    ) -> Result<ModelRun, WorkError> {
        let watched = session.listener.watched();
        let options = Options { watched, ..options(&args.solve)? };
        let LoadedModel { compiled, mut sources, digest, .. } = loaded;
        session.spare(&sources)?;
        let mut diagnostics = Diagnostics::default();
        let recording = match &args.data {
            None => None,
            Some(path) => {
                let read = RunRecording::read(
                    path,
                    &args.solve.rename,
                    &compiled.dae,
                    TimeColumnRule::Time,
                    &mut sources,
                    &mut diagnostics,
                    session,
                );
                match read {
                    Some(recording) => Some(recording),
                    None => return Err(WorkError::diagnosed(&diagnostics, sources)),
                }
            }
        };
        let conditions = conditions(&compiled.model, &sources);
        let states = jumps::declared_states(&compiled.model);
        let system = executable(compiled.program, &args.solve)?;
        let signature = system.signature();
        let options = with_method(options, &args.solve, signature);
        let p: Vec<f64> = signature.parameters.iter().map(|parameter| parameter.value).collect();
        let inputs = match &recording {
            Some(recording) => recording.inputs(signature)?,
            None if signature.inputs.is_empty() => Inputs::none(),
            None => return Err(needs_data(signature)),
        };
        let times = times(args, recording.as_ref())?;
        let data = args.data.iter().zip(&recording);
        let data = data.map(|(path, recording)| DataFile::new(path, recording.digest)).collect();
        let provenance = Provenance::new(session, Some(digest), data);
        let epoch = recording.as_ref().and_then(|recording| recording.epoch);
        let measured = recording.map(|recording| recording.measured).unwrap_or_default();
        let start = Vec::new();
        let mut run =
            ModelRun { system, p, inputs, start, times, epoch, measured, options, provenance };
        if args.solve.start == StartChoice::Measured {
            let ModelRun { times, measured, options, .. } = &run;
            run.start = measured_start(&run.problem(), times[0], measured, options)?;
        }
        run.options = with_method_per_sample(run.options, &args.solve, &run.problem(), &run.times)?;
        run.options = with_method_to_begin(
            run.options,
            &args.solve,
            [(run.problem(), run.times[0])],
            session,
        );
        run.tell_of_the_start(&conditions, &states, session);
        run.tell_what_is_kept(session);
        Ok(run)
    }

    /// Reports the conditions that hold from the start, and therefore do nothing yet, and the declared initial values
    /// that do not hold.
    fn tell_of_the_start(
        &self,
        conditions: &[String],
        states: &BTreeSet<String>,
        session: TaskContext<'_>,
    ) {
        let may_drop = jumps::may_be_dropped(self.signature(), states);
        let looks = may_drop || !conditions.is_empty();
        if !looks || !session.listener.hears_remarks() {
            return;
        }
        // The run itself reports why it cannot start.
        let Ok(start) = consistent_start(&self.problem(), self.times[0], &self.options) else {
            return;
        };
        for condition in start.waiting.iter().filter_map(|k| conditions.get(*k)) {
            session.remark(format!(
                "note: `{condition}` holds at the start already, and acts only after it has been false"
            ));
        }
        if may_drop {
            jumps::tell_what_is_dropped(self.signature(), states, &self.start, &start, session);
        }
    }

    /// Reports conserved quantities: a start in steady state keeps their declared totals.
    fn tell_what_is_kept(&self, session: TaskContext<'_>) {
        if !self.signature().starts_at_rest || !session.listener.hears_remarks() {
            return;
        }
        // The run itself reports why it cannot start.
        let Ok(found) = rest(&self.problem(), self.times[0], &self.options) else { return };
        let kept: Vec<(String, String)> =
            found.conserved.iter().map(|own| combination(self.signature(), own)).collect();
        match kept.as_slice() {
            [] => {}
            [(formula, value)] => session.remark(format!(
                "note: the equations conserve `{formula}`, which keeps its declared value, {value}"
            )),
            several => {
                let values =
                    several.iter().map(|(formula, value)| format!("`{formula}` = {value}"));
                let values = values.collect::<Vec<_>>().join(", ");
                session.remark(format!(
                    "note: the equations conserve what follows, which keeps its declared values: {values}"
                ));
            }
        }
    }

    pub(crate) fn problem(&self) -> Problem<'_, dgd_execute::LoadedSystem> {
        Problem { system: &self.system, p: &self.p, inputs: &self.inputs, start: &self.start }
    }

    /// First and last time, s.
    pub(crate) fn span(&self) -> [f64; 2] {
        let or_zero = |time: Option<&f64>| time.copied().unwrap_or(0.0);
        [or_zero(self.times.first()), or_zero(self.times.last())]
    }

    pub(crate) fn signature(&self) -> &Signature {
        self.system.signature()
    }

    /// The i-th input at the times of a solution, SI.
    pub(crate) fn input_values(&self, solution: &Solution, i: usize) -> Vec<f64> {
        let mut u = vec![0.0; self.inputs.len()];
        let value = |k: usize| {
            self.inputs.value(solution.times[k], solution.side(k), &mut u);
            u[i]
        };
        (0..solution.len()).map(value).collect()
    }

    /// Number of unknowns that are not elements of arrays, which come first.
    pub(crate) fn single_unknowns(&self) -> usize {
        let unknowns = self.signature().unknowns.iter().enumerate();
        unknowns.filter(|(_, x)| !is_element(&x.name)).last().map_or(0, |(last, _)| last + 1)
    }

    /// Runs the model and evaluates its outputs. Elements of arrays, which come after all other unknowns, are dropped
    /// once the outputs are computed.
    pub(crate) fn simulate(&self) -> Result<PartialRun, WorkError> {
        self.simulate_with(&[])
    }

    /// The same, keeping these elements of arrays after the single unknowns.
    pub(crate) fn simulate_with(&self, elements: &[usize]) -> Result<PartialRun, WorkError> {
        let single = self.single_unknowns();
        self.verify_memory(single + elements.len(), 0)?;
        let (problem, times, options) = (self.problem(), &self.times, &self.options);
        self.finish(if single < self.signature().unknowns.len() {
            let chosen: Vec<usize> = (0..single).chain(elements.iter().copied()).collect();
            simulate_observed(&problem, &chosen, times, options)
        } else {
            simulate(&problem, times, options)
        })
    }

    /// Refuses a run that needs more memory than is free, with `kept` unknowns and `n_s` directions.
    fn verify_memory(&self, kept: usize, n_s: usize) -> Result<(), WorkError> {
        let signature = self.signature();
        let n = signature.unknowns.len();
        let keeps_all =
            outputs_are_delayed(signature) || matches!(self.options.steps, Steps::PerSample(_));
        let kept = if keeps_all { n } else { kept };
        let needs = memory::MemoryNeeds {
            unknowns: n,
            kept,
            outputs: signature.outputs.len(),
            inputs: signature.inputs.len(),
            directions: n_s,
            rows: self.times.len(),
        };
        memory::verify("the run", &needs.demands())
    }

    /// The same with sensitivities.
    pub(crate) fn simulate_with_sensitivities(&self) -> Result<PartialRun, WorkError> {
        let signature = self.signature();
        self.verify_memory(signature.unknowns.len(), signature.directions.len())?;
        self.finish(simulate_with_sensitivities(&self.problem(), &self.times, &self.options))
    }

    fn finish(&self, result: Result<Solution, Failure>) -> Result<PartialRun, WorkError> {
        let (solution, stopped) = match result {
            Ok(solution) => (solution, None),
            Err(Failure { error: IntegrateError::Stopped { .. }, partial })
                if partial.is_empty() =>
            {
                return Err(Interruption::NoRow.into());
            }
            Err(Failure { error, partial }) if partial.is_empty() => {
                return Err(ComputationError::Integration(error).into());
            }
            Err(Failure { error, partial }) => (*partial, Some(error)),
        };
        let observations = observe(&self.problem(), &solution);
        Ok(PartialRun { solution, observations, stopped })
    }
}

/// Refuses a fit or search on this many threads that needs more memory than is free.
pub(crate) fn verify_memory_of_fit(
    what: &str,
    signature: &Signature,
    recordings: &[dgd_identify::Recording],
    threads: usize,
    keeps_derivatives: bool,
) -> Result<(), WorkError> {
    let rows = recordings.iter().map(|recording| recording.times.len()).max().unwrap_or(0);
    let n_s = signature.directions.len();
    let keeps = keeps_derivatives || outputs_are_delayed(signature);
    let n = signature.unknowns.len();
    let needs = memory::MemoryNeeds {
        unknowns: n,
        kept: n,
        outputs: signature.outputs.len(),
        inputs: signature.inputs.len(),
        directions: if keeps { n_s } else { 0 },
        rows,
    };
    let side_by_side = threads.clamp(1, recordings.len().max(1));
    memory::verify(what, &needs.demands_of_fit(side_by_side, recordings.len(), n_s))
}

/// Whether a run keeps all unknowns because of delayed outputs.
fn outputs_are_delayed(signature: &Signature) -> bool {
    signature.outputs.iter().any(|output| output.delay.is_some())
}

/// The conditions of a model's transitions as written, in order.
fn conditions(model: &Model, sources: &SourceMap) -> Vec<String> {
    let text = |automaton: &Automaton, transition: &Transition| match automaton.origin {
        AutomatonOrigin::When => format!("when {}", automaton.name),
        AutomatonOrigin::Every => format!("every {}", automaton.name),
        AutomatonOrigin::Modes => {
            let span = transition.span;
            let text = &sources.get(span.source).text[span.start as usize..span.end as usize];
            let head = text.split('{').next().unwrap_or(text);
            head.split_whitespace().collect::<Vec<_>>().join(" ")
        }
    };
    let automata = model.automata.iter();
    automata.flat_map(|a| a.transitions.iter().map(move |t| text(a, t))).collect()
}

/// A run as far as it got.
pub(crate) struct PartialRun {
    pub solution: Solution,
    pub observations: Observations,
    /// Why it did not reach the end.
    pub stopped: Option<IntegrateError>,
}

fn needs_data(signature: &Signature) -> WorkError {
    let inputs: Vec<String> = signature
        .inputs
        .iter()
        .map(|input| format!("{} [{}]", input.name, input.unit.symbol))
        .collect();
    UsageError::NeedsData { model: signature.name.to_string(), inputs }.into()
}

/// Loads a program with the requested engine.
pub(crate) fn executable(
    program: Program,
    args: &SolverOptions,
) -> Result<dgd_execute::LoadedSystem, WorkError> {
    let engine = args.engine;
    let system = dgd_execute::LoadedSystem::with_engine(program, engine);
    if engine == Engine::Native {
        system.compile().map_err(ComputationError::NativeCode)?;
    }
    Ok(system)
}

/// Integration options.
pub(crate) fn options(args: &SolverOptions) -> Result<Options, WorkError> {
    let mut options = Options {
        rtol: args.rtol,
        atol: args.atol.unwrap_or(args.rtol),
        steps: args.steps,
        ..Options::default()
    };
    if args.method != AUTOMATIC {
        let method = find_method(&args.method);
        options.method = method.map_err(UsageError::UnknownMethod)?;
    }
    options.verify().map_err(ComputationError::Options)?;
    Ok(options)
}

/// The same with the method that suits the model, unless one was named.
pub(crate) fn with_method(
    options: Options,
    args: &SolverOptions,
    signature: &Signature,
) -> Options {
    if args.method == AUTOMATIC {
        Options { method: automatic_method(signature), ..options }
    } else {
        options
    }
}

/// The same with the method that suits fixed steps per sample, if those are requested and no method is named.
pub(crate) fn with_method_per_sample(
    options: Options,
    args: &SolverOptions,
    problem: &Problem<'_, dgd_execute::LoadedSystem>,
    times: &[f64],
) -> Result<Options, WorkError> {
    if args.method != AUTOMATIC || !matches!(options.steps, Steps::PerSample(_)) {
        return Ok(options);
    }
    let choice =
        choose_per_sample(problem, times, &options).map_err(ComputationError::Integration)?;
    Ok(Options { method: choice.method, ..options })
}

/// The same with a method that can start these runs, if none was named and the one that suits the model cannot. It is
/// chosen before the first run, for all of them.
pub(crate) fn with_method_to_begin<'a>(
    options: Options,
    args: &SolverOptions,
    runs: impl IntoIterator<Item = (Problem<'a, dgd_execute::LoadedSystem>, f64)>,
    session: TaskContext<'_>,
) -> Options {
    if args.method != AUTOMATIC || matches!(options.steps, Steps::PerSample(_)) {
        return options;
    }
    let other = runs.into_iter().find_map(|(problem, t)| method_to_begin(&problem, t, &options));
    let Some(OtherMethod { method, equation, t }) = other else { return options };
    session.remark(format!(
        "note: `{}` cannot begin at t = {t} s, where a derivative of equation `{equation}` is not \
         finite; the method is `{}`",
        options.method.name, method.name
    ));
    Options { method, ..options }
}

/// Times of the rows: the data's, or equidistant.
fn times(args: &RunRequest, recording: Option<&RunRecording>) -> Result<Vec<f64>, WorkError> {
    let sampled = recording.map(|recording| recording.times.as_slice());
    let first = args.solve.from.or(sampled.and_then(|t| t.first().copied())).unwrap_or(0.0);
    let Some(last) = args.solve.until.or(sampled.and_then(|t| t.last().copied())) else {
        return Err(UsageError::NoEnd.into());
    };
    if first > last {
        return Err(UsageError::EndsBeforeBegin { last, first }.into());
    }
    let every = match (args.every, sampled) {
        (Some(every), _) => every,
        (None, Some(sampled)) => {
            let mut times: Vec<f64> =
                sampled.iter().copied().filter(|t| (first..=last).contains(t)).collect();
            if times.first() != Some(&first) {
                times.insert(0, first);
            }
            if times.last() != Some(&last) {
                times.push(last);
            }
            return Ok(times);
        }
        (None, None) => (last - first) / f64::from(DEFAULT_ROWS),
    };
    if first == last {
        return Ok(vec![first]);
    }
    let rows = (last - first) / every;
    if rows > MOST_ROWS {
        return Err(UsageError::TooManyRows { every, rows, most: MOST_ROWS }.into());
    }
    // A final step shorter than rounding is left out.
    let whole = (rows + 1e-9).floor();
    let mut times: Vec<f64> = (0..=whole as u64).map(|k| first + k as f64 * every).collect();
    match times.last_mut() {
        Some(end) if (last - *end).abs() <= 1e-9 * every => *end = last,
        _ => times.push(last),
    }
    Ok(times)
}

/// Initial values that make the first simulated outputs equal to the first measured ones.
///
/// Gauss–Newton on w(y₀) = w_measured(t₀), weighted by the outputs' noise, with the shortest correction (in units of
/// each unknown's size) if the outputs do not determine all states.
pub(crate) fn measured_start(
    problem: &Problem<'_, dgd_execute::LoadedSystem>,
    t: f64,
    measured: &MeasuredOutputs,
    options: &Options,
) -> Result<Vec<(usize, f64)>, WorkError> {
    let signature = problem.system.signature();
    let row = measured.times.partition_point(|sample| *sample < t);
    let first: Vec<Option<f64>> = measured
        .outputs
        .iter()
        .map(|samples| samples.as_ref()?.get(row).copied().filter(|value| value.is_finite()))
        .collect();
    if first.iter().all(Option::is_none) {
        return Err(UsageError::StartNotMeasured.into());
    }
    let noise: Vec<f64> =
        signature.outputs.iter().map(|output| output.noise.unwrap_or(output.unit.factor)).collect();
    Ok(dgd_runtime::start_from_outputs(problem, t, &first, &noise, options)
        .map_err(ComputationError::MeasuredStart)?)
}
