//! `dgd sensitivity`: derivatives of states and outputs to parameters over time.

use dgd_compiler::diagnostics::{Code, Diagnostic};
use dgd_compiler::pipeline::Directions;
use dgd_runtime::{Direction, Observations, Signature, Solution, Unit};
use serde_json::json;

use crate::args::SensitivityArgs;
use crate::console::Console;
use crate::failure::{CommandError, meant};
use crate::figure::{self, Line, Subject};
use crate::load::{Compilation, Loaded};
use crate::plot::Text;
use crate::result::{self, NamedColumn, quotient};
use crate::run::{Reached, Run};
use crate::verify;

/// Something that can be differentiated.
#[derive(Debug, Clone, Copy)]
enum Of {
    /// An unknown, by its position.
    Unknown(usize),
    /// An output, by its position.
    Output(usize),
}

pub(crate) fn run(args: &SensitivityArgs, console: Console<'_>) -> Result<(), CommandError> {
    figure::verify_formats(&args.run.solve.plot)?;
    let (loaded, of) = load(args)?;
    let run = Run::prepare(&args.run, loaded, console)?;
    let Reached { solution, observations, stopped } = run.simulate_with_sensitivities()?;
    for undefined in &solution.undefined {
        console.remark(&format!("note: {undefined}"));
    }
    let report = (args.verify_sensitivities && stopped.is_none())
        .then(|| {
            let compared = compared(args, &run, &of);
            verify::against_differences(&run, &solution, &observations, &compared)
        })
        .transpose()?;

    let pairs = pairs(&run, &solution, &observations, &of, args.scaled);
    let columns: Vec<NamedColumn> = pairs.iter().map(Pair::column).collect();
    let mut details = json!({
        "model": run.signature().name,
        "rows": solution.len(),
        "method": run.options.method.name,
        "steps": solution.statistics.steps,
        "rejected": solution.statistics.rejected,
        "steps_per_sample": result::per_sample(&solution),
        "events": result::events(&solution),
        "undefined": solution.undefined.iter().map(|stretch| json!({
            "from": stretch.from,
            "until": stretch.until,
            "equation": stretch.equation,
        })).collect::<Vec<_>>(),
    });
    if let Some(error) = stopped {
        return result::write_reached(console, &solution.times, &columns, details, &error);
    }
    if !args.run.solve.plot.is_empty() {
        let subjects = subjects(&run, &solution, &observations, &of, &pairs);
        let figure = figure::panels(&subjects);
        for path in &args.run.solve.plot {
            figure::save(&figure, path, console)?;
        }
    }
    if let (Some(report), Some(details)) = (&report, details.as_object_mut()) {
        details.insert("verification".to_owned(), report.to_json());
    }
    let drawn = !args.run.solve.plot.is_empty() || report.is_some();
    result::write(console, &solution.times, &columns, &details, drawn)?;
    match report {
        Some(report) => report.conclude(console),
        None => Ok(()),
    }
}

/// What is compared with differences: what `--of` asks for, or all there is.
fn compared(args: &SensitivityArgs, run: &Run, of: &[Of]) -> Vec<verify::Of> {
    if args.of.is_empty() {
        return verify::Of::all(run.signature());
    }
    let compared = of.iter().map(|of| match *of {
        Of::Unknown(i) => verify::Of::Unknown(i),
        Of::Output(i) => verify::Of::Output(i),
    });
    compared.collect()
}

/// Compiles the model with sensitivities to `--to` and finds what `--of` names.
fn load(args: &SensitivityArgs) -> Result<(Loaded, Vec<Of>), CommandError> {
    let mut compilation = Compilation::default();
    let options = compilation.options(&args.run.choices)?;
    let directions = if args.to.is_empty() {
        Directions::All
    } else {
        Directions::Named(
            args.to.iter().map(|name| compilation.name("--to", name.trim())).collect(),
        )
    };
    let apply = &args.run.choices.apply;
    let (compiled, changed) =
        match compilation.compile(&args.run.model, apply, &options, &directions)? {
            Ok(compiled) => compiled,
            Err(reported) => return Err(compilation.fail(reported)),
        };

    let program = &compiled.program;
    let (unknowns, outputs) = (program.unknown_names(), program.output_names());
    let unknown = |name: &str| unknowns.iter().position(|x| x == name);
    let output = |name: &str| outputs.iter().position(|x| x == name);
    let mut of = Vec::new();
    for name in &args.of {
        let name = compilation.name("--of", name.trim());
        let found = unknown(&name.text).map(Of::Unknown);
        if let Some(found) = found.or_else(|| output(&name.text).map(Of::Output)) {
            of.push(found);
            continue;
        }
        let message = format!("no state and no output is called `{}`", name.text);
        let names = program.unknowns.iter().map(|x| x.name.as_str());
        // An output may bear the name of its unknown.
        let others = outputs.iter().map(String::as_str);
        let known: Vec<&str> = names.chain(others.filter(|name| unknown(name).is_none())).collect();
        let help = meant(&name.text, &known);
        let diagnostic = Diagnostic::new(Code::E201, name.span, message).help(help);
        compilation.diagnostics.error(diagnostic);
    }
    if compilation.diagnostics.check().is_err() {
        return Err(CommandError::diagnosed(&compilation.diagnostics, compilation.sources));
    }
    if of.is_empty() {
        of.extend((0..program.unknowns.len()).map(Of::Unknown));
        // An output that reads its unknown says the same in another unit.
        let others = outputs.iter().enumerate();
        let single = program.unknowns.len();
        let is_new = |name: &str| unknown(name).is_none_or(|i| i >= single);
        of.extend(others.filter(|(_, x)| is_new(x)).map(|(i, _)| Of::Output(i)));
    }
    Ok((Loaded { compiled, sources: compilation.sources, changed }, of))
}

impl Of {
    fn name_and_unit(self, signature: &Signature) -> (String, &Unit) {
        match self {
            Of::Unknown(i) => (signature.unknowns.name(i).into_owned(), signature.unknowns.unit(i)),
            Of::Output(i) => (signature.outputs[i].name.to_string(), &signature.outputs[i].unit),
        }
    }

    /// Its values in SI.
    fn values(self, solution: &Solution, observations: &Observations) -> Vec<f64> {
        let at = |k| match self {
            Of::Unknown(i) => solution.y(k)[i],
            Of::Output(i) => observations.w(k)[i],
        };
        (0..solution.len()).map(at).collect()
    }

    /// Its derivatives to the j-th direction, SI.
    fn derivatives(self, solution: &Solution, observations: &Observations, j: usize) -> Vec<f64> {
        let at = |k| match self {
            Of::Unknown(i) => solution.s(k)[j * solution.n + i],
            Of::Output(i) => observations.dw(k)[j * observations.n_w + i],
        };
        (0..solution.len()).map(at).collect()
    }
}

/// The derivative of one thing to one parameter.
struct Pair {
    of: String,
    to: String,
    scaled: bool,
    unit: Unit,
    /// SI.
    values: Vec<f64>,
}

impl Pair {
    fn column(&self) -> NamedColumn {
        let derivative = format!("d({})/d({})", self.of, self.to);
        let name = if self.scaled { format!("{}*{derivative}", self.to) } else { derivative };
        NamedColumn { name, unit: self.unit.clone(), values: self.values.clone() }
    }

    fn title(&self) -> Text {
        let derivative = Text::derivative(&self.of, &self.to);
        if self.scaled {
            Text::name(&self.to).then(Text::plain(" ")).then(derivative)
        } else {
            derivative
        }
    }
}

fn pairs(
    run: &Run,
    solution: &Solution,
    observations: &Observations,
    of: &[Of],
    scaled: bool,
) -> Vec<Pair> {
    let signature = run.signature();
    let mut pairs = Vec::new();
    for of in of {
        let (name, unit) = of.name_and_unit(signature);
        for (j, direction) in signature.directions.iter().enumerate() {
            let mut values = of.derivatives(solution, observations, j);
            let unit = if scaled {
                let size = match *direction {
                    Direction::Parameter(i) => run.p[i],
                    Direction::Start(i) => solution.y(0)[i],
                };
                for value in &mut values {
                    *value *= size;
                }
                Unit { offset: 0.0, ..unit.clone() }
            } else {
                quotient(unit, signature.direction_unit(j))
            };
            let (of, to) = (name.clone(), signature.direction_name(j).into_owned());
            pairs.push(Pair { of, to, scaled, unit, values });
        }
    }
    pairs
}

/// For each thing its own trajectory, then its derivatives.
fn subjects(
    run: &Run,
    solution: &Solution,
    observations: &Observations,
    of: &[Of],
    pairs: &[Pair],
) -> Vec<Subject> {
    let signature = run.signature();
    let n_s = signature.directions.len();
    let line = |values: Vec<f64>| {
        let (times, name) = (solution.times.clone(), Text::default());
        vec![Line { name, times, values, measured: false }]
    };
    let mut subjects = Vec::new();
    for (i, of) in of.iter().enumerate() {
        let (name, unit) = of.name_and_unit(signature);
        let values = of.values(solution, observations);
        subjects.push(Subject {
            title: Text::name(&name),
            unit: unit.symbol.to_string(),
            lines: line(values.iter().map(|v| unit.from_si(*v)).collect()),
        });
        for pair in &pairs[i * n_s..(i + 1) * n_s] {
            subjects.push(Subject {
                title: pair.title(),
                unit: pair.unit.symbol.to_string(),
                lines: line(pair.values.iter().map(|v| v / pair.unit.factor).collect()),
            });
        }
    }
    subjects
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Cli, Command};
    use clap::Parser;

    /// Verifies a run's sensitivities, each multiplied by a number and moved by another, in units of its
    /// largest.
    fn verified(factor: f64, off: f64) -> Result<(), CommandError> {
        let manifest = env!("CARGO_MANIFEST_DIR");
        let [model, data] =
            ["model.dgd", "good.csv"].map(|file| format!("{manifest}/../tests/golden/data/{file}"));
        let line = ["dgd", "--quiet", "sensitivity", &model, "--data", &data];
        let cli = Cli::try_parse_from(line).expect("a command line");
        let console = Console::new(&cli.global);
        let Command::Sensitivity(args) = &cli.command else { panic!("it is `sensitivity`") };
        let (loaded, of) = load(args)?;
        let run = Run::prepare(&args.run, loaded, console)?;
        let mut reached = run.simulate_with_sensitivities()?;
        let s = &mut reached.solution.s;
        let largest = s.iter().fold(0.0, |largest: f64, s| largest.max(s.abs()));
        for s in s.iter_mut() {
            *s = factor * *s + off * largest;
        }
        let Reached { solution, observations, .. } = reached;
        let compared = compared(args, &run, &of);
        verify::against_differences(&run, &solution, &observations, &compared)?.conclude(console)
    }

    #[test]
    fn derivatives_that_are_wrong_are_found() {
        assert!(verified(1.0, 0.0).is_ok());
        for (factor, off) in [(1.01, 0.0), (-1.0, 0.0), (0.0, 0.0), (1.0, 0.01)] {
            let found = verified(factor, off);
            assert!(matches!(found, Err(CommandError::Stopped(_))), "{factor} {off}: {found:?}");
        }
    }
}
