//! States and parameters row by row, one line out for each line in.

mod report;
mod rows;
mod settings;

use std::io::{self, Read, Write};

use dgd_compiler::pipeline::{CompiledStages, SensitivityDirections};
use dgd_identify::Total;
use dgd_identify::filter::{
    FilterError, FilterProblem, FilterSample, InnovationAlarm, RunningFilter, TrackedRow,
};
use dgd_page::Markup;
use dgd_plot::Figure;
use dgd_runtime::{Inputs, Problem, System, start_from_outputs};
use serde::{Serialize, Serializer};
use serde_json::{Value, json};

use crate::error::{ComputationError, OutputPart, UnusableFile, UsageError, WorkError};
use crate::model::Compilation;
use crate::output::page;
use crate::output::provenance::{self, DataFile, Provenance};
use crate::request::{SolverOptions, StartChoice, TrackRequest};
use crate::run::{densities, executable, options, with_method};
use crate::session::TaskContext;
use report::RowReport;
use rows::{TrackRows, UnreadableRow};
use settings::{OptionValues, TrackSettings};

/// An estimate whose uncertainty is still above this share of the initial one has learnt nothing.
const UNLEARNT: f64 = 0.9;

/// The format of the written rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum LineFormat {
    /// CSV with a header.
    Csv,
    /// One document: `settings`, and `rows` in a list.
    Document,
    /// One document per line: `settings`, then rows, and rows that were left out.
    Lines,
}

/// Estimates over time, with remarks.
#[non_exhaustive]
pub struct TrackingResult {
    /// The rows, if they were to be kept.
    pub rows: Vec<TrackedRow>,
    /// Number of rows.
    pub count: usize,
    /// Remarks on all rows.
    pub remarks: Vec<String>,
    /// The error that ended it before its last row.
    pub stopped: Option<WorkError>,
    /// Versions and digests of the inputs.
    pub provenance: Provenance,
    report: RowReport,
}

impl TrackingResult {
    /// Estimates with ± 2 standard deviations, then innovations with their expected ones, for the kept rows.
    pub fn figure(&self) -> Figure {
        self.report.figure(&self.rows)
    }

    /// The page of the figure, with the command that reproduces it.
    pub fn page(&self, command: &str) -> String {
        let kind = Markup::text("States and parameters, row by row");
        let headline = format!("{} rows tracked", self.count);
        let more: Vec<Markup> =
            self.remarks.iter().map(|words| Markup::prose(words).paragraph()).collect();
        let origin = page::origin(&self.provenance, command);
        page::of_figure("Tracked", &kind, &headline, &more, &self.figure(), &origin)
    }

    /// The kept rows, for programs.
    pub fn to_json(&self) -> Value {
        let rows: Vec<Value> = self.rows.iter().map(|row| self.report.json(row)).collect();
        json!({ "rows": rows })
    }
}

impl Serialize for TrackingResult {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.to_json().serialize(serializer)
    }
}

/// Tracks row by row: the estimates for a row are written before the next one is read. Rows come from `input`, or
/// otherwise from the file of the request.
///
/// # Errors
///
/// [`WorkError`] if it cannot begin; later errors are in the result.
pub fn track(
    request: &TrackRequest,
    input: Option<Box<dyn Read>>,
    session: TaskContext<'_>,
    out: &mut dyn Write,
    format: LineFormat,
) -> Result<TrackingResult, WorkError> {
    let estimator = settings::estimator(request)?;
    settings::verify_deviations(request)?;
    let mut compilation = Compilation::new(session.files);
    let options_of_model = compilation.options(&request.choices.starting(&request.solve))?;
    let (free, fixed) = compilation.sought(&request.sought);
    let directions = SensitivityDirections::Tracked { free, fixed };
    let apply = &request.choices.apply;
    let compiled =
        compilation.compile_text(&request.model, apply, &options_of_model, &directions)?;
    let compiled = match compiled {
        Ok(compiled) => compiled,
        Err(reported) => return Err(compilation.fail(reported)),
    };
    let of_model = provenance::of_model(&compilation.sources);
    let overrides = OptionValues::read(request, &mut compilation, &compiled);
    if compilation.diagnostics.check().is_err() {
        return Err(WorkError::diagnosed(&compilation.diagnostics, compilation.sources));
    }
    let Compilation { sources, diagnostics, .. } = &mut compilation;
    let rows = TrackRows::open(&compiled.dae, sources, diagnostics, request, input, session);
    let Some(rows) = rows else {
        return Err(WorkError::diagnosed(&compilation.diagnostics, compilation.sources));
    };

    let file = DataFile::new(&request.data, rows.digest());
    let provenance = Provenance::new(session, Some(of_model), vec![file]);
    session.spare(&compilation.sources)?;
    let system = executable(compiled.program.clone(), &request.solve)?;
    densities::refuse(system.signature(), "`dgd track`")?;
    let solve = with_method(options(&request.solve)?, &request.solve, system.signature());
    let p: Vec<f64> = system.signature().parameters.iter().map(|p| p.value).collect();
    let problem = FilterProblem {
        estimator,
        gate: request.gate,
        options: solve,
        ..FilterProblem::new(system.as_model(), &p)
    };
    TrackingInput { request, session, compiled: &compiled, problem, asked: overrides, provenance }
        .run(rows, out, format)
}

/// The inputs of a tracking run.
struct TrackingInput<'a> {
    request: &'a TrackRequest,
    session: TaskContext<'a>,
    compiled: &'a CompiledStages,
    problem: FilterProblem<'a>,
    asked: OptionValues,
    provenance: Provenance,
}

impl TrackingInput<'_> {
    fn run(
        mut self,
        mut rows: TrackRows<'_>,
        out: &mut dyn Write,
        format: LineFormat,
    ) -> Result<TrackingResult, WorkError> {
        let Some(first) = rows.next()? else {
            let path = self.request.data.clone();
            let SolverOptions { from, until, .. } = &self.request.solve;
            return Err(if from.is_some() || until.is_some() {
                UsageError::NothingBetween { path, what: "row" }.into()
            } else {
                UnusableFile::NoRow(path).into()
            });
        };
        let sample = FilterSample { t: first.t, u: &first.u, measured: &first.measured };
        self.set_start(sample, &rows.measured)?;
        let TrackingInput { asked, compiled, problem, .. } = &self;
        let settings = TrackSettings::new(asked, compiled, problem, sample, &rows.measured)?;
        let used: Vec<bool> = settings.tuning.noise.iter().map(Option::is_some).collect();
        let report = RowReport::new(problem, &used, rows.epoch());
        let (filter, row) =
            RunningFilter::begin(problem, &settings.tuning, sample).map_err(failed)?;
        self.session.remark(settings.text(problem));
        let mut output = RowReceiver {
            tracking: &self,
            report: &report,
            kept: Vec::new(),
            tally: RowStatistics::new(row.clone(), settings.tuning.start_stds()),
        };
        self.session.listener.begins(false);
        let ended = output.write(&settings, filter, row, rows, out, format);
        self.session.listener.ends();
        // The estimates so far are worth reporting.
        let remarks = output.tally.said(problem);
        let RowReceiver { kept, tally, .. } = output;
        Ok(TrackingResult {
            rows: kept,
            count: tally.rows,
            remarks,
            stopped: ended.err(),
            provenance: self.provenance.clone(),
            report,
        })
    }

    /// Initial values from the first row, if they are to be measured.
    fn set_start(&mut self, first: FilterSample<'_>, measured: &[bool]) -> Result<(), WorkError> {
        if self.request.solve.start != StartChoice::Measured {
            return Ok(());
        }
        let signature = self.problem.system.signature();
        let samples: Vec<Option<f64>> =
            first.measured.iter().map(|value| Some(*value).filter(|v| v.is_finite())).collect();
        if !measured.contains(&true) || samples.iter().all(Option::is_none) {
            return Err(UsageError::StartNotMeasured.into());
        }
        let outputs = signature.outputs.iter();
        let noise: Vec<f64> = outputs.map(|w| w.noise.unwrap_or(w.unit.factor)).collect();
        let inputs = Inputs::constant(first.u);
        let problem = Problem {
            system: &self.problem.system,
            p: self.problem.p,
            inputs: &inputs,
            start: &[],
        };
        let start = start_from_outputs(&problem, first.t, &samples, &noise, &self.problem.options);
        self.problem.start = start.map_err(ComputationError::MeasuredStart)?;
        Ok(())
    }
}

/// Receives the rows.
struct RowReceiver<'a> {
    tracking: &'a TrackingInput<'a>,
    report: &'a RowReport,
    /// Rows kept for a figure.
    kept: Vec<TrackedRow>,
    tally: RowStatistics,
}

impl RowReceiver<'_> {
    /// Tracks, one line for each row, each written before the next row is read. A document has the rows in a list.
    fn write(
        &mut self,
        settings: &TrackSettings,
        mut filter: RunningFilter<'_>,
        first: TrackedRow,
        mut rows: TrackRows<'_>,
        out: &mut dyn Write,
        format: LineFormat,
    ) -> Result<(), WorkError> {
        let TrackingInput { session, problem, .. } = self.tracking;
        let mut document = settings.json(problem);
        let start = rows.epoch().and_then(|epoch| epoch.stamp(0.0));
        if let (Some(start), Some(document)) = (start, document.as_object_mut()) {
            document.insert("start".to_owned(), json!(start));
        }
        self.tracking.provenance.push_json(&mut document);
        let head = match format {
            LineFormat::Csv => self.report.header(out),
            LineFormat::Lines => {
                writeln!(out, "{}", json!({ "settings": document }))
            }
            LineFormat::Document => {
                write!(out, "{{\"settings\":{document},\n\"rows\":[")
            }
        };
        let mut row = first;
        let mut gone = is_gone(head)?;
        let mut left_out = rows.take_left_out();
        loop {
            for UnreadableRow { line, reason } in &left_out {
                if format == LineFormat::Lines && !gone {
                    let document = json!({ "left_out": { "line": line, "reason": reason } });
                    gone = is_gone(writeln!(out, "{document}"))?;
                }
            }
            if !gone {
                let line = match format {
                    LineFormat::Csv => self.report.line(&row, out),
                    LineFormat::Lines => writeln!(out, "{}", self.report.json(&row)),
                    LineFormat::Document => {
                        let comma = if self.tally.rows == 0 { "" } else { "," };
                        write!(out, "{comma}\n{}", self.report.json(&row))
                    }
                };
                gone = is_gone(line.and_then(|()| out.flush()))?;
            }
            // The reader is gone.
            if gone {
                return Ok(());
            }
            self.tally.take(&row, *session);
            if let Some(most) = rows.most() {
                session.advanced("rows", self.tally.rows, Total::AtMost(most));
            }
            if self.tracking.request.keeps_rows {
                self.kept.push(row);
            }
            let Some(next) = rows.next()? else { break };
            left_out = rows.take_left_out();
            let sample = FilterSample { t: next.t, u: &next.u, measured: &next.measured };
            row = filter.step(sample).map_err(failed)?;
        }
        self.tally.missing = filter.missing_inputs().to_vec();
        self.tally.left_out = rows.n_left_out;
        let ended = match format {
            LineFormat::Csv => Ok(()),
            LineFormat::Lines => {
                rows.take_left_out().iter().try_for_each(|UnreadableRow { line, reason }| {
                    writeln!(out, "{}", json!({ "left_out": { "line": line, "reason": reason } }))
                })
            }
            LineFormat::Document => writeln!(out, "\n]}}"),
        };
        is_gone(ended).map(drop)
    }
}

/// Whether the reader went away, which is not an error.
fn is_gone(written: io::Result<()>) -> Result<bool, WorkError> {
    match written {
        Ok(()) => Ok(false),
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(true),
        Err(error) => Err(UnusableFile::Output { what: OutputPart::Row, error }.into()),
    }
}

/// Statistics of all rows, for remarks.
struct RowStatistics {
    /// Standard deviations of states and parameters before the first correction, SI.
    first: Vec<f64>,
    last: TrackedRow,
    rows: usize,
    failures: usize,
    rejected: usize,
    samples: usize,
    squares: f64,
    missing: Vec<usize>,
    /// Number of unreadable rows.
    left_out: usize,
}

impl RowStatistics {
    fn new(row: TrackedRow, first: Vec<f64>) -> Self {
        RowStatistics {
            first,
            last: row,
            rows: 0,
            failures: 0,
            rejected: 0,
            samples: 0,
            squares: 0.0,
            missing: Vec::new(),
            left_out: 0,
        }
    }

    /// Counts a row, and reports urgent remarks at once.
    fn take(&mut self, row: &TrackedRow, session: TaskContext<'_>) {
        self.rows += 1;
        if self.samples + row.samples == 0 {
            self.first = stds(row).collect();
        }
        self.samples += row.samples;
        self.squares += row.normalised_square;
        let innovations = row.innovations.iter().flatten();
        self.rejected += innovations.filter(|innovation| !innovation.used).count();
        if let Some(failure) = &row.failure {
            self.failures += 1;
            session
                .remark(format!("at t = {} s the model was left where it was: {failure}", row.t));
        }
        match row.alarm {
            Some(InnovationAlarm::Diverged { ratio, rows }) => session.remark(format!(
                "at t = {} s the innovations of the last {rows} rows are {ratio:.1} times as large as \
                 expected: the filter has lost its way, or the model or the noise is not right",
                row.t
            )),
            Some(InnovationAlarm::Recovered) => {
                session.remark(format!("at t = {} s the innovations are as expected again", row.t));
            }
            None => {}
        }
        self.last = row.clone();
    }

    /// Remarks on undetermined estimates, and on innovations that differ from their expected size.
    fn said(&self, problem: &FilterProblem<'_>) -> Vec<String> {
        let mut remarks = Vec::new();
        let signature = problem.system.signature();
        if self.samples > 0 {
            let ratio = (self.squares / self.samples as f64).sqrt();
            remarks.push(format!(
                "{} rows, {} samples; innovations {ratio:.2} times as large as expected",
                self.rows, self.samples
            ));
        } else {
            remarks.push(format!("{} rows, none with a sample that was used", self.rows));
        }
        if self.rejected > 0 {
            remarks.push(format!("samples beyond the gate, not used: {}", self.rejected));
        }
        if self.left_out > 0 {
            remarks.push(format!("rows that could not be read, left out: {}", self.left_out));
        }
        if self.failures > 0 {
            remarks.push(format!("rows that could not be evaluated: {}", self.failures));
        }
        for (input, missing) in signature.inputs.iter().zip(&self.missing) {
            if *missing > 0 {
                remarks.push(format!(
                    "rows without input `{}`, which kept its last value: {missing}",
                    input.name
                ));
            }
        }
        let names = problem.states().into_iter().map(|i| signature.unknowns.name(i));
        let parameters = problem.parameters().into_iter();
        let names = names.chain(parameters.map(|i| signature.parameters[i].name.clone()));
        let unlearnt: Vec<String> = names
            .zip(self.first.iter().zip(stds(&self.last)))
            .filter(|(_, (first, last))| **first > 0.0 && *last >= UNLEARNT * **first)
            .map(|(name, _)| format!("`{name}`"))
            .collect();
        if self.rows > 1 && !unlearnt.is_empty() {
            remarks.push(format!("the data says little about {}", unlearnt.join(", ")));
        }
        remarks
    }
}

/// Standard deviations of states, then parameters, SI.
fn stds(row: &TrackedRow) -> impl Iterator<Item = f64> {
    row.states.iter().chain(&row.parameters).map(|tracked| tracked.std)
}

/// Converts a filter error into the error that ends the command.
fn failed(error: FilterError) -> WorkError {
    match error {
        FilterError::NothingTracked | FilterError::Option(_) | FilterError::NothingMeasured => {
            UsageError::Filter(error).into()
        }
        FilterError::Inputs(_) | FilterError::FirstInput { .. } => {
            UnusableFile::Filter(error).into()
        }
        FilterError::Length(_)
        | FilterError::NotFollowed { .. }
        | FilterError::NoDirection { .. }
        | FilterError::Free(_)
        | FilterError::Start(_)
        | FilterError::Stuck { .. } => ComputationError::Filter(error).into(),
    }
}
