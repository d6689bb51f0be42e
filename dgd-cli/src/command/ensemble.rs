//! `dgd simulate --ensemble`: trajectories for many sets of parameters and start values.

use std::io::{self, Write};
use std::path::Path;

use dgd_compiler::diagnostics::Diagnostics;
use dgd_runtime::ensemble::{Ensemble, Member, Trajectory, Wanted, members_at_a_time, reduce};
use dgd_runtime::{Statistics, Unit, side};
use serde_json::{Value, json};

use super::simulate::{in_unit, is_added, is_element};
use crate::args::{SimulateArgs, Start};
use crate::console::{Console, print};
use crate::data::write::{Written, write_header, write_rows};
use crate::failure::CommandError;
use crate::figure;
use crate::load::{Loaded, load};
use crate::memory::{self, Needs};
use crate::plot::{Envelope, Figure, Panel, Series, Style, Text};
use crate::result::{self, TableFormat};
use crate::run::Run;
use crate::sets::{self, Set};

/// Sets that a thread runs before their rows are written.
const BLOCK: usize = 64;
/// Failures that are told one by one.
const MOST_TOLD: usize = 5;

pub(crate) fn run(
    args: &SimulateArgs,
    table: &Path,
    console: Console<'_>,
) -> Result<(), CommandError> {
    figure::verify_formats(&args.run.solve.plot)?;
    for (flag, is_given) in [
        ("--noise-seed", args.noise_seed.is_some()),
        ("--start measured", args.run.solve.start == Start::Measured),
    ] {
        if is_given {
            return Err(CommandError::Usage(format!("`{flag}` is for a single run")));
        }
    }
    let Loaded { compiled, mut sources, changed } =
        load(&args.run.model, &args.run.choices, |_| dgd_compiler::pipeline::Directions::None)?;
    let mut diagnostics = Diagnostics::default();
    let Ok(sets) = sets::read(table, &compiled.dae, &mut sources, &mut diagnostics) else {
        return Err(CommandError::diagnosed(&diagnostics, sources));
    };
    let run = Run::prepare(&args.run, Loaded { compiled, sources, changed }, console)?;

    let mut all = Runs::new(&run, &sets, console.threads());
    let keeps = !args.run.solve.plot.is_empty();
    let mut kept: Vec<Vec<Vec<f64>>> = Vec::new();
    let mut gathered: Vec<Vec<f64>> = Vec::new();
    let is_text = !console.is_json();
    let format = console.out().map(|path| console.table_format(path)).transpose()?;
    let is_document = format.map_or(!is_text, TableFormat::is_document);
    let is_kept = is_document || keeps || console.out().is_none();
    all.verify_memory(if is_kept { sets.len() } else { 0 })?;
    if let Some((path, format)) = console.out().zip(format).filter(|_| !is_document) {
        result::save_rows(path, format, |out| {
            all.write(out, |values| {
                if keeps {
                    kept.push(values);
                }
            })
        })?;
        console.remark(&format!("wrote {} ({} sets)", path.display(), all.written));
    } else if !is_document && !keeps {
        let mut text = Vec::new();
        all.write(&mut text, |_| {}).map_err(|error| CommandError::Found(error.to_string()))?;
        print(&String::from_utf8_lossy(&text))?;
    } else {
        all.each(|number, values| {
            if is_document {
                gather(&mut gathered, number, &run.times, &all_units(&run), &values);
            }
            if keeps {
                kept.push(values);
            }
            Ok(())
        })
        .map_err(|error| CommandError::Found(error.to_string()))?;
    }
    if keeps {
        let figure = figure(&run, &kept);
        for path in &args.run.solve.plot {
            figure::save(&figure, path, console)?;
        }
    }
    match console.out().filter(|_| is_document) {
        Some(path) => {
            let indented = format != Some(TableFormat::JsonLines);
            result::save_json(path, &all.details(&gathered), indented)?;
            console.remark(&format!("wrote {} ({} sets)", path.display(), all.written));
        }
        None if console.is_json() => print(&format!("{:#}\n", all.details(&gathered)))?,
        None => {}
    }
    all.verdict()
}

/// A quantity that is shown.
struct Shown {
    name: String,
    unit: Unit,
    of: Of,
}

/// What it is.
#[derive(Debug, Clone, Copy)]
enum Of {
    Input(usize),
    Unknown(usize),
    Output(usize),
}

/// Time series in the order of a single run: inputs, states, outputs.
fn shown(run: &Run) -> Vec<Shown> {
    let signature = run.signature();
    let one = |name: &str, unit: &Unit, of| Shown { name: name.to_owned(), unit: unit.clone(), of };
    let inputs = signature.inputs.iter().enumerate();
    let is_output = |name: &str| signature.outputs.iter().any(|output| output.name == name);
    let unknowns = (signature.unknowns.iter().enumerate())
        .filter(|(_, unknown)| !is_element(&unknown.name) && !is_output(&unknown.name));
    let outputs = signature.outputs.iter().enumerate();
    (inputs.map(|(i, input)| one(&input.name, &input.unit, Of::Input(i))))
        .chain(unknowns.map(|(i, unknown)| one(&unknown.name, &unknown.unit, Of::Unknown(i))))
        .chain(outputs.map(|(i, output)| one(&output.name, &output.unit, Of::Output(i))))
        .collect()
}

fn all_units(run: &Run) -> Vec<Unit> {
    shown(run).into_iter().map(|shown| shown.unit).collect()
}

/// All sets, and what became of them.
struct Runs<'a> {
    run: &'a Run,
    sets: &'a [Set],
    threads: usize,
    shown: Vec<Shown>,
    statistics: Statistics,
    written: usize,
    /// Numbers of sets, from 1, and why they failed.
    failed: Vec<(usize, String)>,
}

impl<'a> Runs<'a> {
    fn new(run: &'a Run, sets: &'a [Set], threads: usize) -> Self {
        let statistics = Statistics::default();
        let shown = shown(run);
        Self { run, sets, threads, shown, statistics, written: 0, failed: Vec::new() }
    }

    /// Refuses an ensemble that needs more memory than is free, and holds the results of so many sets at the
    /// end.
    fn verify_memory(&self, held: usize) -> Result<(), CommandError> {
        let signature = self.run.signature();
        let n = signature.unknowns.len();
        let needs = Needs {
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

    /// Runs all sets, and gives `take` the number of each and the values of all that is shown.
    fn each(
        &mut self,
        mut take: impl FnMut(usize, Vec<Vec<f64>>) -> io::Result<()>,
    ) -> io::Result<()> {
        let Self { run, sets, threads, .. } = *self;
        let (times, options) = (&run.times, &run.options);
        let inputs: Vec<Vec<f64>> =
            (0..run.signature().inputs.len()).map(|i| input_values(run, i)).collect();
        let block = BLOCK * threads.max(1);
        for (k, sets) in sets.chunks(block).enumerate() {
            let members: Vec<Member<'_>> = sets
                .iter()
                .map(|set| Member { p: &set.p, inputs: &run.inputs, start: &set.start })
                .collect();
            let ensemble = Ensemble { system: &run.system, members: &members };
            let shown = &self.shown;
            let values = |trajectory: &Trajectory<'_>, of: Of| match of {
                Of::Input(i) => inputs[i].clone(),
                Of::Unknown(i) => trajectory.unknown(i).to_vec(),
                Of::Output(i) => trajectory.output(i).to_vec(),
            };
            let outcomes = reduce(&ensemble, times, options, Wanted::Values, threads, |_, one| {
                one.map_err(|failure| failure.error.to_string()).map(|trajectory| {
                    let all = shown.iter().map(|shown| values(&trajectory, shown.of));
                    (all.collect::<Vec<_>>(), trajectory.statistics)
                })
            });
            for (i, outcome) in outcomes.into_iter().enumerate() {
                let number = k * block + i + 1;
                match outcome {
                    Ok((values, statistics)) => {
                        self.statistics.steps += statistics.steps;
                        self.statistics.rejected += statistics.rejected;
                        self.written += 1;
                        take(number, values)?;
                    }
                    Err(error) => self.failed.push((number, error)),
                }
            }
        }
        Ok(())
    }

    /// Writes the rows of all sets as CSV: the number of the set, then what a single run has.
    fn write(
        &mut self,
        out: &mut (impl Write + ?Sized),
        mut keep: impl FnMut(Vec<Vec<f64>>),
    ) -> io::Result<()> {
        let units: Vec<(String, Unit)> =
            self.shown.iter().map(|shown| (shown.name.clone(), shown.unit.clone())).collect();
        let (plain, seconds) = (unit("1"), unit("s"));
        let times = &self.run.times;
        let columns =
            |numbers: &'_ [f64],
             values: &'_ [Vec<f64>],
             write: &mut dyn FnMut(&[Written<'_>]) -> io::Result<()>| {
                let mut columns = vec![
                    Written { name: "set", unit: &plain, values: numbers },
                    Written { name: "time", unit: &seconds, values: times },
                ];
                for ((name, unit), values) in units.iter().zip(values) {
                    columns.push(Written { name, unit, values });
                }
                write(&columns)
            };
        let empty = vec![Vec::new(); units.len()];
        columns(&[], &empty, &mut |columns| write_header(out, columns))?;
        self.each(|number, values| {
            let numbers = vec![number as f64; times.len()];
            columns(&numbers, &values, &mut |columns| write_rows(out, columns))?;
            keep(values);
            Ok(())
        })
    }

    /// What programs are told.
    fn details(&self, gathered: &[Vec<f64>]) -> Value {
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
        if let ([set, time, rest @ ..], Some(details)) = (gathered, details.as_object_mut()) {
            let columns: Vec<Value> = (self.shown.iter().zip(rest))
                .map(|(shown, values)| {
                    json!({ "name": shown.name, "unit": shown.unit.symbol, "values": values })
                })
                .collect();
            details.insert("set".to_owned(), json!(set));
            details.insert("time".to_owned(), json!(time));
            details.insert("columns".to_owned(), json!(columns));
        }
        details
    }

    /// An error where sets failed.
    fn verdict(&self) -> Result<(), CommandError> {
        if self.failed.is_empty() {
            return Ok(());
        }
        let mut lines =
            vec![format!("{} of {} sets could not be run", self.failed.len(), self.sets.len())];
        let told = self.failed.iter().take(MOST_TOLD);
        lines.extend(told.map(|(set, error)| format!("  set {set}: {error}")));
        if self.failed.len() > MOST_TOLD {
            lines.push("  …".to_owned());
        }
        // Those that could are written, and JSON says which could not.
        Err(CommandError::Stopped(lines.join("\n")))
    }
}

fn unit(symbol: &'static str) -> Unit {
    Unit { symbol: symbol.into(), factor: 1.0, offset: 0.0 }
}

/// The i-th input at all times, SI.
fn input_values(run: &Run, i: usize) -> Vec<f64> {
    let mut u = vec![0.0; run.inputs.len()];
    (0..run.times.len())
        .map(|k| {
            run.inputs.value(run.times[k], side(&run.times, k), &mut u);
            u[i]
        })
        .collect()
}

/// Adds the rows of a set: its number, the times, then all that is shown in its unit.
fn gather(
    gathered: &mut Vec<Vec<f64>>,
    number: usize,
    times: &[f64],
    units: &[Unit],
    values: &[Vec<f64>],
) {
    gathered.resize(units.len() + 2, Vec::new());
    gathered[0].extend(times.iter().map(|_| number as f64));
    gathered[1].extend_from_slice(times);
    for ((column, unit), values) in gathered[2..].iter_mut().zip(units).zip(values) {
        column.extend(in_unit(values, unit));
    }
}

/// One panel for each state and output: where half and nine tenths of the sets are.
fn figure(run: &Run, sets: &[Vec<Vec<f64>>]) -> Figure {
    let mut panels = Vec::new();
    for (j, Shown { name, unit, of }) in shown(run).iter().enumerate() {
        if is_added(name) {
            continue;
        }
        let mut panel = Panel {
            title: Text::name(name),
            y_label: Text::default().with_unit(&unit.symbol),
            ..Panel::default()
        };
        let times = &run.times;
        let line = |name: &str, y: Vec<f64>, style| Series {
            name: Text::plain(name),
            style,
            x: times.clone(),
            y,
        };
        if let Of::Input(i) = of {
            panel.series.push(line(name, in_unit(&input_values(run, *i), unit), Style::Line));
            panels.push(panel);
            continue;
        }
        let quantiles = quantiles(sets, j, times.len());
        let [low, lower, middle, upper, high] = quantiles.map(|values| in_unit(&values, unit));
        panel.series.push(line("median", middle, Style::Line));
        // Grey, and in the colour of the line.
        for (name, around, low, high) in
            [("90 %", None, low, high), ("50 %", Some(0), lower, upper)]
        {
            let name = Text::plain(name);
            panel.envelopes.push(Envelope { name, around, x: times.clone(), low, high });
        }
        if let Of::Output(i) = of
            && let Some(Some(samples)) = run.measured.outputs.get(*i)
        {
            panel.series.push(Series {
                name: Text::plain("measured"),
                style: Style::ThinLine,
                x: run.measured.times.clone(),
                y: in_unit(samples, unit),
            });
        }
        panels.push(panel);
    }
    Figure::new(Text::plain("Time").with_unit("s"), panels)
}

/// Fractions of the sets that are below the edges of the bands.
const FRACTIONS: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

/// Quantiles of a quantity over all sets, at each time: between two sets along a straight line.
fn quantiles(sets: &[Vec<Vec<f64>>], quantity: usize, times: usize) -> [Vec<f64>; 5] {
    let mut all = [const { Vec::new() }; 5];
    let mut sorted: Vec<f64> = Vec::with_capacity(sets.len());
    for k in 0..times {
        sorted.clear();
        sorted.extend(sets.iter().map(|set| set[quantity][k]));
        sorted.sort_unstable_by(f64::total_cmp);
        for (values, fraction) in all.iter_mut().zip(FRACTIONS) {
            let place = fraction * sorted.len().saturating_sub(1) as f64;
            let (below, part) = (place.floor() as usize, place.fract());
            let value = |k: usize| sorted.get(k).copied().unwrap_or(f64::NAN);
            let between = if part > 0.0 { part * (value(below + 1) - value(below)) } else { 0.0 };
            values.push(value(below) + between);
        }
    }
    all
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
