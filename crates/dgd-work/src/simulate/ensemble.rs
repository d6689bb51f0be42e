//! Trajectories for many sets of parameters and initial values.

use std::io::{self, Write};
use std::sync::atomic::{AtomicUsize, Ordering};

use dgd_compiler::argument::Argument;
use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::pipeline::SensitivityDirections;
use dgd_data::write::{OutputColumn, write_header, write_rows};
use dgd_page::Markup;
use dgd_plot::{Envelope, Figure, MathText, Panel, PlotSeries, SeriesMeaning, SeriesStyle};
use dgd_runtime::ensemble::{Member, Trajectory, members_at_a_time};
use dgd_runtime::{IntegrateError, Statistics, Unit, side};
use serde_json::{Value, json};

use crate::error::{OutputPart, TaskEnd, UnusableFile, UsageError, WorkError};
use crate::model::sets::{self, ParameterSet};
use crate::model::{LoadedModel, load};
use crate::output::columns::{in_unit, is_added, is_element, is_share};
use crate::output::page;
use crate::output::provenance::DataFile;
use crate::request::{SimulateRequest, StartChoice};
use crate::run::ModelRun;
use crate::run::memory::{self, MemoryNeeds};
use crate::session::TaskContext;

/// Sets that a thread runs before their rows are written.
const BLOCK: usize = 64;
/// Failures reported one by one.
const MOST_TOLD: usize = 5;

/// A quantity in the result.
#[derive(Debug)]
struct ShownQuantity {
    name: String,
    unit: Unit,
    of: QuantitySource,
}

/// Source of a quantity.
#[derive(Debug, Clone, Copy)]
enum QuantitySource {
    Input(usize),
    Unknown(usize),
    Output(usize),
}

/// Time series in the order of a single run: inputs, states, outputs.
fn shown(run: &ModelRun) -> Vec<ShownQuantity> {
    let signature = run.signature();
    let one = |name: &str, unit: &Unit, of| ShownQuantity {
        name: name.to_owned(),
        unit: unit.clone(),
        of,
    };
    let inputs = signature.inputs.iter().enumerate();
    let is_output = |name: &str| signature.outputs.iter().any(|output| output.name == name);
    let unknowns = (signature.unknowns.iter().enumerate())
        .filter(|(_, unknown)| !is_element(&unknown.name) && !is_share(&unknown.name))
        .filter(|(_, unknown)| !is_output(&unknown.name));
    let outputs = signature.outputs.iter().enumerate();
    (inputs.map(|(i, input)| one(&input.name, &input.unit, QuantitySource::Input(i))))
        .chain(
            unknowns
                .map(|(i, unknown)| one(&unknown.name, &unknown.unit, QuantitySource::Unknown(i))),
        )
        .chain(
            outputs.map(|(i, output)| one(&output.name, &output.unit, QuantitySource::Output(i))),
        )
        .collect()
}

/// The runs of many sets, and their outcomes so far.
///
/// They are run block by block, so that memory holds no more of them than the caller keeps.
pub struct EnsembleRuns {
    run: ModelRun,
    sets: Vec<ParameterSet>,
    threads: usize,
    shown: Vec<ShownQuantity>,
    statistics: Statistics,
    written: usize,
    /// Numbers of failed sets, from 1, and the reasons.
    failed: Vec<(usize, String)>,
    /// Whether the ensemble was cancelled.
    is_interrupted: bool,
    /// Values of all quantities, in their units, after the number of the set and the time.
    gathered: Vec<Vec<f64>>,
    /// Values of sets for a figure, SI.
    drawn: Vec<Vec<Vec<f64>>>,
}

/// Values of an ensemble to keep in memory, whether or not they are written.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct EnsembleStorage {
    /// Values for [`EnsembleRuns::to_json`].
    pub columns: bool,
    /// Values for [`EnsembleRuns::figure`].
    pub figure: bool,
}

impl EnsembleStorage {
    /// Keeps these values.
    pub fn new(columns: bool, figure: bool) -> Self {
        EnsembleStorage { columns, figure }
    }
}

impl EnsembleRuns {
    /// Reads model, sets and data.
    pub(super) fn prepare(
        request: &SimulateRequest,
        session: TaskContext<'_>,
    ) -> Result<EnsembleRuns, WorkError> {
        let Some(table) = &request.ensemble else {
            return Err(UsageError::NoSets.into());
        };
        let is_measured = request.run.solve.start == StartChoice::Measured;
        for (given, is_given) in [
            (Argument::NoiseSeed.into(), request.noise_seed.is_some()),
            (Argument::Start.with("measured"), is_measured),
        ] {
            if is_given {
                return Err(UsageError::OfSingleRun(given).into());
            }
        }
        let choices = request.run.choices.starting(&request.run.solve);
        let mut loaded = load(&request.run.model, &choices, &SensitivityDirections::None, session)?;
        let mut diagnostics = Diagnostics::default();
        let LoadedModel { compiled, sources, .. } = &mut loaded;
        let Ok(sets) = sets::read(session.files, table, &compiled.dae, sources, &mut diagnostics)
        else {
            return Err(WorkError::diagnosed(&diagnostics, loaded.sources));
        };
        let mut run = ModelRun::prepare(&request.run, loaded, session)?;
        run.provenance.data.push(DataFile::new(table, sets.digest));
        let shown = shown(&run);
        Ok(EnsembleRuns {
            run,
            sets: sets.all,
            threads: session.threads,
            shown,
            statistics: Statistics::default(),
            written: 0,
            failed: Vec::new(),
            is_interrupted: false,
            gathered: Vec::new(),
            drawn: Vec::new(),
        })
    }

    /// Number of sets.
    pub fn sets(&self) -> usize {
        self.sets.len()
    }

    /// Number of sets run successfully so far.
    pub fn done(&self) -> usize {
        self.written
    }

    /// Runs all sets, and keeps the requested values. After a cancellation, the finished sets are kept.
    ///
    /// # Errors
    ///
    /// It needs more memory than is free.
    pub fn run(
        &mut self,
        hold: EnsembleStorage,
        session: TaskContext<'_>,
    ) -> Result<(), WorkError> {
        self.verify_memory(self.sets.len())?;
        self.each(hold, session, |_, _| Ok(()))
            .map_err(|error| UnusableFile::Output { what: OutputPart::Row, error }.into())
    }

    /// Refuses an ensemble that needs more memory than is free, with the results of `held` sets in memory at the end.
    ///
    /// # Errors
    ///
    /// The required memory, and advice on reducing it.
    pub fn verify_memory(&self, held: usize) -> Result<(), WorkError> {
        let signature = self.run.signature();
        let n = signature.unknowns.len();
        let needs = MemoryNeeds {
            unknowns: n,
            kept: n,
            outputs: signature.outputs.len(),
            inputs: signature.inputs.len(),
            directions: 0,
            rows: self.run.times.len(),
        };
        let block = (BLOCK * self.threads.max(1)).min(self.sets.len());
        let at_a_time = members_at_a_time(signature) * self.threads.max(1);
        let packed = at_a_time.min(self.sets.len());
        let demands = needs.demands_of_ensemble(packed, block + held, self.shown.len());
        memory::verify("the ensemble", &demands)
    }

    /// Runs all sets, and calls `take` with the number of each and the values of all quantities.
    fn each(
        &mut self,
        hold: EnsembleStorage,
        session: TaskContext<'_>,
        mut take: impl FnMut(usize, &[Vec<f64>]) -> io::Result<()>,
    ) -> io::Result<()> {
        let Self { run, sets, threads, shown, .. } = self;
        let (run, threads, shown) = (&*run, *threads, &*shown);
        let (times, options) = (&run.times, &run.options);
        let inputs: Vec<Vec<f64>> =
            (0..run.signature().inputs.len()).map(|i| input_values(run, i)).collect();
        let block = BLOCK * threads.max(1);
        let (done, all) = (AtomicUsize::new(0), sets.len());
        session.listener.begins(false);
        for (k, sets) in sets.chunks(block).enumerate() {
            let members: Vec<Member<'_>> = sets
                .iter()
                .map(|set| Member { p: &set.p, inputs: &run.inputs, start: &set.start })
                .collect();
            let values = |trajectory: &Trajectory<'_>, of: QuantitySource| match of {
                QuantitySource::Input(i) => inputs[i].clone(),
                QuantitySource::Unknown(i) => trajectory.unknown(i).to_vec(),
                QuantitySource::Output(i) => trajectory.output(i).to_vec(),
            };
            let outcomes =
                run.system.reduce_members(&members, times, options, threads, |_, one| {
                    let trajectory = one.map_err(|failure| failure.error)?;
                    let done = done.fetch_add(1, Ordering::Relaxed) + 1;
                    let count = dgd_identify::Total::Exactly(all);
                    session.advanced("sets", done, count);
                    let columns = shown.iter().map(|shown| values(&trajectory, shown.of));
                    Ok((columns.collect::<Vec<_>>(), trajectory.statistics))
                });
            for (i, outcome) in outcomes.into_iter().enumerate() {
                let number = k * block + i + 1;
                match outcome {
                    Ok((values, statistics)) => {
                        self.statistics.steps += statistics.steps;
                        self.statistics.rejected += statistics.rejected;
                        self.written += 1;
                        take(number, &values)?;
                        if hold.columns {
                            gather(&mut self.gathered, number, times, shown, &values);
                        }
                        if hold.figure {
                            self.drawn.push(values);
                        }
                    }
                    Err(IntegrateError::Stopped { .. }) => self.is_interrupted = true,
                    Err(error) => self.failed.push((number, error.to_string())),
                }
            }
            if self.is_interrupted {
                break;
            }
        }
        session.listener.ends();
        Ok(())
    }

    /// Runs all sets and writes their rows as CSV: the number of the set, then the columns of a single run.
    ///
    /// # Errors
    ///
    /// Those of `out`.
    pub fn write_csv(
        &mut self,
        out: &mut (impl Write + ?Sized),
        hold: EnsembleStorage,
        session: TaskContext<'_>,
    ) -> io::Result<()> {
        let units: Vec<(String, Unit)> =
            self.shown.iter().map(|shown| (shown.name.clone(), shown.unit.clone())).collect();
        let (plain, seconds) = (unit("1"), unit("s"));
        let (times, epoch) = (self.run.times.clone(), self.run.epoch);
        let columns =
            |numbers: &'_ [f64],
             values: &'_ [Vec<f64>],
             write: &mut dyn FnMut(&[OutputColumn<'_>]) -> io::Result<()>| {
                let mut columns = vec![
                    OutputColumn::new("set", &plain, numbers),
                    OutputColumn { epoch, ..OutputColumn::new("time", &seconds, &times) },
                ];
                for ((name, unit), values) in units.iter().zip(values) {
                    columns.push(OutputColumn::new(name, unit, values));
                }
                write(&columns)
            };
        let empty = vec![Vec::new(); units.len()];
        columns(&[], &empty, &mut |columns| write_header(out, columns))?;
        self.each(hold, session, |number, values| {
            let numbers = vec![number as f64; times.len()];
            columns(&numbers, values, &mut |columns| write_rows(out, columns))
        })
    }

    /// For programs: the outcomes of the sets, and the columns if they were kept.
    pub fn to_json(&self) -> Value {
        let failed: Vec<Value> = (self.failed.iter())
            .map(|(set, error)| json!({ "set": set, "error": error }))
            .collect();
        let mut details = json!({
            "model": self.run.signature().name,
            "sets": self.sets.len(),
            "rows": self.run.times.len() * self.written,
            "method": self.run.options.method.name,
            "steps": self.statistics.steps,
            "rejected": self.statistics.rejected,
            "failed": failed,
        });
        self.run.provenance.push_json(&mut details);
        if let ([set, time, rest @ ..], Some(details)) =
            (self.gathered.as_slice(), details.as_object_mut())
        {
            let columns: Vec<Value> = (self.shown.iter().zip(rest))
                .map(|(shown, values)| {
                    json!({ "name": shown.name, "unit": shown.unit.symbol, "values": values })
                })
                .collect();
            if let Some(start) = self.run.epoch.and_then(|epoch| epoch.stamp(0.0)) {
                details.insert("start".to_owned(), json!(start));
            }
            details.insert("set".to_owned(), json!(set));
            details.insert("time".to_owned(), json!(time));
            details.insert("columns".to_owned(), json!(columns));
        }
        details
    }

    /// The outcome: a failure if sets failed.
    pub fn ended(&self) -> TaskEnd {
        if self.is_interrupted {
            let (done, all) = (self.written, self.sets.len());
            let words = format!(
                "stopped by Ctrl-C: the result has the {done} of {all} sets that were done"
            );
            return TaskEnd::Interrupted(words.into());
        }
        if self.failed.is_empty() {
            return TaskEnd::Done;
        }
        let mut lines =
            vec![format!("{} of {} sets could not be run", self.failed.len(), self.sets.len())];
        let listed = self.failed.iter().take(MOST_TOLD);
        lines.extend(listed.map(|(set, error)| format!("  set {set}: {error}")));
        if self.failed.len() > MOST_TOLD {
            lines.push("  …".to_owned());
        }
        // The successful sets are written, and the JSON lists the failed ones.
        TaskEnd::Stopped(lines.join("\n").into())
    }

    /// Its page, with the command that reproduces it.
    pub fn page(&self, command: &str) -> String {
        let model = &self.run.signature().name;
        let kind = Markup::text("Ensemble of the model ").then(&Markup::code(model));
        let (sets, failed) = (self.sets.len(), self.failed.len());
        let headline = match failed {
            0 => format!("{sets} sets simulated"),
            n => format!("{} of {sets} sets simulated; {n} failed", sets - n),
        };
        let note = Markup::text(
            "The median of the sets at each time, and where half and nine tenths of them are.",
        );
        let origin = page::origin(&self.run.provenance, command);
        let title = format!("{model}: ensemble");
        page::of_figure(&title, &kind, &headline, &[note.paragraph()], &self.figure(), &origin)
    }

    /// One panel for each state and output with the 50 % and 90 % bands of the kept sets.
    pub fn figure(&self) -> Figure {
        figure(&self.run, &self.drawn)
    }
}

fn unit(symbol: &'static str) -> Unit {
    Unit { symbol: symbol.into(), factor: 1.0, offset: 0.0 }
}

/// The i-th input at all times, SI.
fn input_values(run: &ModelRun, i: usize) -> Vec<f64> {
    let mut u = vec![0.0; run.inputs.len()];
    (0..run.times.len())
        .map(|k| {
            run.inputs.value(run.times[k], side(&run.times, k), &mut u);
            u[i]
        })
        .collect()
}

/// Adds the rows of a set: its number, the times, then all quantities in their units.
fn gather(
    gathered: &mut Vec<Vec<f64>>,
    number: usize,
    times: &[f64],
    shown: &[ShownQuantity],
    values: &[Vec<f64>],
) {
    gathered.resize(shown.len() + 2, Vec::new());
    gathered[0].extend(times.iter().map(|_| number as f64));
    gathered[1].extend_from_slice(times);
    for ((column, shown), values) in gathered[2..].iter_mut().zip(shown).zip(values) {
        column.extend(in_unit(values, &shown.unit));
    }
}

/// One panel for each state and output with the 50 % and 90 % bands of the sets.
fn figure(run: &ModelRun, sets: &[Vec<Vec<f64>>]) -> Figure {
    let mut panels = Vec::new();
    for (j, ShownQuantity { name, unit, of }) in shown(run).iter().enumerate() {
        if is_added(name) {
            continue;
        }
        let mut panel = Panel {
            title: MathText::name(name),
            y_label: MathText::default().with_unit(&unit.symbol),
            ..Panel::default()
        };
        let times = &run.times;
        let line = |meaning, name: &str, y: Vec<f64>| PlotSeries {
            meaning,
            ..PlotSeries::new(MathText::plain(name), SeriesStyle::Line, times.clone(), y)
        };
        if let QuantitySource::Input(i) = of {
            let values = in_unit(&input_values(run, *i), unit);
            panel.series.push(line(SeriesMeaning::Input(*i), name, values));
            panels.push(panel);
            continue;
        }
        let quantiles = quantiles(sets, j, times.len());
        let [low, lower, middle, upper, high] = quantiles.map(|values| in_unit(&values, unit));
        panel.series.push(line(SeriesMeaning::Simulated, "median", middle));
        // The outer band in grey, the inner one in the colour of the line.
        for (name, around, low, high) in
            [("90 %", None, low, high), ("50 %", Some(0), lower, upper)]
        {
            let name = MathText::plain(name);
            panel.envelopes.push(Envelope { name, around, x: times.clone(), low, high });
        }
        if let QuantitySource::Output(i) = of
            && let Some(Some(samples)) = run.measured.outputs.get(*i)
        {
            let (x, y) = (run.measured.times.clone(), in_unit(samples, unit));
            panel.series.push(PlotSeries {
                meaning: SeriesMeaning::Measured,
                ..PlotSeries::new(MathText::plain("measured"), SeriesStyle::ThinLine, x, y)
            });
        }
        panels.push(panel);
    }
    Figure::new(MathText::plain("Time").with_unit("s"), panels)
}

/// Probabilities of the quantiles at the edges of the bands.
const FRACTIONS: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

/// Quantiles of a quantity over all sets at each time, interpolated linearly.
fn quantiles(sets: &[Vec<Vec<f64>>], quantity: usize, times: usize) -> [Vec<f64>; 5] {
    let mut quantiles = [const { Vec::new() }; 5];
    let mut sorted: Vec<f64> = Vec::with_capacity(sets.len());
    for k in 0..times {
        sorted.clear();
        sorted.extend(sets.iter().map(|set| set[quantity][k]));
        sorted.sort_unstable_by(f64::total_cmp);
        for (values, fraction) in quantiles.iter_mut().zip(FRACTIONS) {
            let place = fraction * sorted.len().saturating_sub(1) as f64;
            let (below, part) = (place.floor() as usize, place.fract());
            let value = |k: usize| sorted.get(k).copied().unwrap_or(f64::NAN);
            let between = if part > 0.0 { part * (value(below + 1) - value(below)) } else { 0.0 };
            values.push(value(below) + between);
        }
    }
    quantiles
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_lie_between_the_sets() {
        let sets: Vec<Vec<Vec<f64>>> =
            [3.0, 1.0, 2.0, 0.0, 4.0].map(|x| vec![vec![x, -x]]).to_vec();
        let [low, lower, middle, _, high] = quantiles(&sets, 0, 2);
        assert_eq!((lower, middle), (vec![1.0, -3.0], vec![2.0, -2.0]));
        // 0.05 · 4 intervals.
        assert!((low[0] - 0.2).abs() < 1e-12 && (high[1] + 0.2).abs() < 1e-12);
    }
}
