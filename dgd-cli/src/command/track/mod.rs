//! `dgd track`: states and parameters row by row, one line out for each line in.

mod report;
mod rows;
mod settings;

use std::io::{self, Write};
use std::path::Path;

use dgd_compiler::pipeline::{Compiled, Directions};
use dgd_execute::Loaded;
use dgd_runtime::identify::filter::{
    Alarm, Filter, FilterError, FilterProblem, Row, Sample, Tracked,
};
use dgd_runtime::{Inputs, Problem, System, start_from_outputs};
use serde_json::json;

use crate::args::{SolveArgs, Start, TrackArgs};
use crate::console::Console;
use crate::failure::CommandError;
use crate::figure;
use crate::load::Compilation;
use crate::result::{TableFormat, save_rows};
use crate::run::{executable, options, with_method};
use report::Report;
use rows::{LeftOut, Rows};
use settings::{Asked, Settings};

/// An estimate that is still so uncertain, in parts of the first uncertainty, has learnt nothing.
const UNLEARNT: f64 = 0.9;

pub(crate) fn run(args: &TrackArgs, console: Console<'_>) -> Result<(), CommandError> {
    figure::verify_formats(&args.solve.plot)?;
    let estimator = settings::estimator(args)?;
    settings::verify_deviations(args)?;
    let mut compilation = Compilation::default();
    let options_of_model = compilation.options(&args.choices)?;
    let (free, fixed) = compilation.sought(&args.sought);
    let directions = Directions::Tracked { free, fixed };
    let apply = &args.choices.apply;
    let compiled = compilation.compile_text(&args.model, apply, &options_of_model, &directions)?;
    let compiled = match compiled {
        Ok(compiled) => compiled,
        Err(reported) => return Err(compilation.fail(reported)),
    };
    let asked = Asked::read(args, &mut compilation, &compiled);
    if compilation.diagnostics.check().is_err() {
        return Err(CommandError::diagnosed(&compilation.diagnostics, compilation.sources));
    }
    let Compilation { sources, diagnostics } = &mut compilation;
    let rows = Rows::open(&compiled.dae, sources, diagnostics, args, console);
    let Some(rows) = rows else {
        return Err(CommandError::diagnosed(&compilation.diagnostics, compilation.sources));
    };

    console.spare(&compilation.sources)?;
    let system = executable(compiled.program.clone(), &args.solve)?;
    let solve = with_method(options(&args.solve)?, &args.solve, system.signature());
    let p: Vec<f64> = system.signature().parameters.iter().map(|p| p.value).collect();
    let problem = FilterProblem {
        estimator,
        gate: args.gate,
        options: solve,
        ..FilterProblem::new(&system, &p)
    };
    Tracking { args, console, compiled: &compiled, problem, asked }.run(rows)
}

/// What a run works with.
struct Tracking<'a> {
    args: &'a TrackArgs,
    console: Console<'a>,
    compiled: &'a Compiled,
    problem: FilterProblem<'a, Loaded>,
    asked: Asked,
}

impl Tracking<'_> {
    fn run(mut self, mut rows: Rows<'_>) -> Result<(), CommandError> {
        let Some(first) = rows.next()? else {
            let data = self.args.data.display();
            let SolveArgs { from, until, .. } = &self.args.solve;
            return Err(if from.is_some() || until.is_some() {
                CommandError::Usage(format!("`{data}` has no row between `--from` and `--until`"))
            } else {
                CommandError::Found(format!("`{data}` has no row to track"))
            });
        };
        let sample = Sample { t: first.t, u: &first.u, measured: &first.measured };
        self.set_start(sample, &rows.measured)?;
        let Tracking { asked, compiled, problem, .. } = &self;
        let settings = Settings::new(asked, compiled, problem, sample, &rows.measured)?;
        let used: Vec<bool> = settings.tuning.noise.iter().map(Option::is_some).collect();
        let report = Report::new(problem, &used);
        let (filter, row) =
            Filter::begin(problem, &settings.tuning, sample).map_err(|error| failed(&error))?;
        self.console.remark(&settings.text(problem));
        let mut output = Output {
            tracking: &self,
            report: &report,
            kept: Vec::new(),
            tally: Tally::new(row.clone()),
        };
        let written = match self.console.out() {
            None => output.print(&settings, filter, row, rows),
            Some(path) => output.save(path, &settings, filter, row, rows),
        };
        // What was learnt until then is worth being told.
        output.tally.say(problem, self.console);
        for path in &self.args.solve.plot {
            figure::save(&report.figure(&output.kept), path, self.console)?;
        }
        written
    }

    /// Start values from the first row, with `--start measured`.
    fn set_start(&mut self, first: Sample<'_>, measured: &[bool]) -> Result<(), CommandError> {
        if self.args.solve.start != Start::Measured {
            return Ok(());
        }
        let signature = self.problem.system.signature();
        let samples: Vec<Option<f64>> =
            first.measured.iter().map(|value| Some(*value).filter(|v| v.is_finite())).collect();
        if !measured.contains(&true) || samples.iter().all(Option::is_none) {
            return Err(CommandError::Usage(
                "`--start measured` needs data with at least one output of the model in its first row"
                    .to_owned(),
            ));
        }
        let outputs = signature.outputs.iter();
        let noise: Vec<f64> = outputs.map(|w| w.noise.unwrap_or(w.unit.factor)).collect();
        let inputs = Inputs::constant(first.u);
        let problem =
            Problem { system: self.problem.system, p: self.problem.p, inputs: &inputs, start: &[] };
        let start = start_from_outputs(&problem, first.t, &samples, &noise, &self.problem.options);
        self.problem.start = start.map_err(|e| CommandError::Computation(e.to_string()))?;
        Ok(())
    }
}

/// Where rows go.
struct Output<'a> {
    tracking: &'a Tracking<'a>,
    report: &'a Report,
    /// Rows for a figure.
    kept: Vec<Row>,
    tally: Tally,
}

impl Output<'_> {
    /// Tracks to standard output; what ends it is the last line of what programs read there.
    fn print(
        &mut self,
        settings: &Settings,
        filter: Filter<'_, Loaded>,
        row: Row,
        rows: Rows<'_>,
    ) -> Result<(), CommandError> {
        let mut out = io::stdout().lock();
        let is_json = self.tracking.console.is_json();
        let format = if is_json { TableFormat::JsonLines } else { TableFormat::Csv };
        let ended = self.write(settings, filter, row, rows, (&mut out, format));
        match ended {
            Err(error) if self.tracking.console.is_json() => {
                let line = writeln!(out, "{}", json!({ "error": error.to_string() }));
                is_gone(line.and_then(|()| out.flush()))?;
                Err(error.written())
            }
            ended => ended,
        }
    }

    /// Tracks into a file that appears whole or not at all.
    fn save(
        &mut self,
        path: &Path,
        settings: &Settings,
        filter: Filter<'_, Loaded>,
        row: Row,
        rows: Rows<'_>,
    ) -> Result<(), CommandError> {
        let mut failed = None;
        let format = self.tracking.console.table_format(path)?;
        let written = save_rows(path, format, |out| {
            self.write(settings, filter, row, rows, (out, format)).map_err(|error| {
                failed = Some(error);
                io::Error::other("tracking ended")
            })
        });
        if let Some(error) = failed {
            return Err(error);
        }
        written?;
        let rows = self.tally.rows;
        self.tracking.console.remark(&format!("wrote {} ({rows} rows)", path.display()));
        Ok(())
    }

    /// Tracks, one line for each row, each there before the next row is read. A document has the rows in a list.
    fn write(
        &mut self,
        settings: &Settings,
        mut filter: Filter<'_, Loaded>,
        first: Row,
        mut rows: Rows<'_>,
        (out, format): (&mut dyn Write, TableFormat),
    ) -> Result<(), CommandError> {
        let Tracking { console, problem, .. } = self.tracking;
        let head = match format {
            TableFormat::Csv | TableFormat::Parquet => self.report.header(out),
            TableFormat::JsonLines => {
                writeln!(out, "{}", json!({ "settings": settings.json(problem) }))
            }
            TableFormat::Json => {
                write!(out, "{{\"settings\":{},\n\"rows\":[", settings.json(problem))
            }
        };
        let mut row = first;
        let mut gone = is_gone(head)?;
        let mut left_out = rows.take_left_out();
        loop {
            for LeftOut { line, reason } in &left_out {
                if format == TableFormat::JsonLines && !gone {
                    let told = json!({ "left_out": { "line": line, "reason": reason } });
                    gone = is_gone(writeln!(out, "{told}"))?;
                }
            }
            if !gone {
                let line = match format {
                    TableFormat::Csv | TableFormat::Parquet => self.report.line(&row, out),
                    TableFormat::JsonLines => writeln!(out, "{}", self.report.json(&row)),
                    TableFormat::Json => {
                        let comma = if self.tally.rows == 0 { "" } else { "," };
                        write!(out, "{comma}\n{}", self.report.json(&row))
                    }
                };
                gone = is_gone(line.and_then(|()| out.flush()))?;
            }
            // Nobody reads any more.
            if gone {
                return Ok(());
            }
            self.tally.take(&row, *console);
            if !self.tracking.args.solve.plot.is_empty() {
                self.kept.push(row);
            }
            let Some(next) = rows.next()? else { break };
            left_out = rows.take_left_out();
            let sample = Sample { t: next.t, u: &next.u, measured: &next.measured };
            row = filter.step(sample).map_err(|error| failed(&error))?;
        }
        self.tally.missing = filter.missing_inputs().to_vec();
        self.tally.left_out = rows.n_left_out;
        let ended = match format {
            TableFormat::Csv | TableFormat::Parquet => Ok(()),
            TableFormat::JsonLines => {
                rows.take_left_out().iter().try_for_each(|LeftOut { line, reason }| {
                    writeln!(out, "{}", json!({ "left_out": { "line": line, "reason": reason } }))
                })
            }
            TableFormat::Json => writeln!(out, "\n]}}"),
        };
        is_gone(ended).map(drop)
    }
}

/// Whether the reader went away, which is not an error.
fn is_gone(written: io::Result<()>) -> Result<bool, CommandError> {
    match written {
        Ok(()) => Ok(false),
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(true),
        Err(error) => Err(CommandError::Found(format!("cannot write a row: {error}"))),
    }
}

/// What there is to say of all rows.
struct Tally {
    first: Row,
    last: Row,
    rows: usize,
    failures: usize,
    rejected: usize,
    samples: usize,
    squares: f64,
    missing: Vec<usize>,
    /// Rows that could not be read.
    left_out: usize,
}

impl Tally {
    fn new(row: Row) -> Self {
        Tally {
            first: row.clone(),
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

    /// Counts a row, and says at once what cannot wait.
    fn take(&mut self, row: &Row, console: Console<'_>) {
        self.rows += 1;
        self.samples += row.samples;
        self.squares += row.normalised_square;
        let innovations = row.innovations.iter().flatten();
        self.rejected += innovations.filter(|innovation| !innovation.used).count();
        if let Some(failure) = &row.failure {
            self.failures += 1;
            console
                .remark(&format!("at t = {} s the model was left where it was: {failure}", row.t));
        }
        match row.alarm {
            Some(Alarm::Diverged { ratio, rows }) => console.remark(&format!(
                "at t = {} s the innovations of the last {rows} rows are {ratio:.1} times as large as \
                 expected: the filter has lost its way, or the model or the noise is not right",
                row.t
            )),
            Some(Alarm::Recovered) => {
                console.remark(&format!("at t = {} s the innovations are as expected again", row.t));
            }
            None => {}
        }
        self.last = row.clone();
    }

    /// Says what the data says nothing about, and whether innovations were as expected.
    fn say(&self, problem: &FilterProblem<'_, Loaded>, console: Console<'_>) {
        let signature = problem.system.signature();
        if self.samples > 0 {
            let ratio = (self.squares / self.samples as f64).sqrt();
            console.remark(&format!(
                "{} rows, {} samples; innovations {ratio:.2} times as large as expected",
                self.rows, self.samples
            ));
        } else {
            console.remark(&format!("{} rows, none with a sample that was used", self.rows));
        }
        if self.rejected > 0 {
            console.remark(&format!("samples beyond the gate, not used: {}", self.rejected));
        }
        if self.left_out > 0 {
            console.remark(&format!("rows that could not be read, left out: {}", self.left_out));
        }
        if self.failures > 0 {
            console.remark(&format!("rows that could not be evaluated: {}", self.failures));
        }
        for (input, missing) in signature.inputs.iter().zip(&self.missing) {
            if *missing > 0 {
                console.remark(&format!(
                    "rows without input `{}`, which kept its last value: {missing}",
                    input.name
                ));
            }
        }
        let names = problem.states().into_iter().map(|i| signature.unknowns.name(i));
        let parameters = problem.parameters().into_iter();
        let names = names.chain(parameters.map(|i| signature.parameters[i].name.clone()));
        let all = |row: &Row| -> Vec<Tracked> {
            row.states.iter().chain(&row.parameters).copied().collect()
        };
        let (first, last) = (all(&self.first), all(&self.last));
        let unlearnt: Vec<String> = names
            .zip(first.iter().zip(&last))
            .filter(|(_, (first, last))| first.std > 0.0 && last.std >= UNLEARNT * first.std)
            .map(|(name, _)| format!("`{name}`"))
            .collect();
        if self.rows > 1 && !unlearnt.is_empty() {
            console.remark(&format!("the data says little about {}", unlearnt.join(", ")));
        }
    }
}

/// A filter that cannot begin or go on as the end of the command.
fn failed(error: &FilterError) -> CommandError {
    let message = error.to_string();
    match error {
        FilterError::NothingTracked | FilterError::Option(_) | FilterError::NothingMeasured => {
            CommandError::Usage(message)
        }
        FilterError::Inputs(_) | FilterError::FirstInput { .. } => CommandError::Found(message),
        FilterError::NotFollowed { .. }
        | FilterError::NoDirection { .. }
        | FilterError::Free(_)
        | FilterError::Start(_)
        | FilterError::Stuck { .. } => CommandError::Computation(message),
    }
}
