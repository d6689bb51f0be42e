//! `dgd linearize`: the linear model close to a point of a run, or to a steady state.

use dgd_runtime::linearize::{LinearAt, OperatingPoint, linearize, steady_state};

use crate::args::{LinearizeArgs, Place, RunArgs, SolveArgs};
use crate::console::{Console, print};
use crate::failure::CommandError;
use crate::linear_report::LinearReport;
use crate::load::load;
use crate::result::{TableFormat, save_json, save_rows};
use crate::run::Run;

pub(crate) fn run(args: &LinearizeArgs, console: Console<'_>) -> Result<(), CommandError> {
    for (flag, is_given) in
        [("--plot", !args.solve.plot.is_empty()), ("--until", args.solve.until.is_some())]
    {
        if is_given {
            let message =
                format!("`linearize` does not take `{flag}`: its run ends where `--at` says");
            return Err(CommandError::Usage(message));
        }
    }
    if let Place::Time(t) = args.at
        && t < args.solve.from.unwrap_or(0.0)
    {
        let from = args.solve.from.unwrap_or(0.0);
        let message = format!("`--at {t}`: the run begins at {from} s, so it never gets there");
        return Err(CommandError::Usage(message));
    }
    let loaded = load(&args.model, &args.choices, |_| dgd_compiler::pipeline::Directions::None)?;
    let run = Run::prepare(&run_args(args), loaded, console)?;
    let from = run.times[0];
    let at = match args.at {
        Place::Time(t) => {
            OperatingPoint::reached(&run.problem(), from, t, &run.options).map_err(failed)?
        }
        Place::Steady => steady_state(&run.problem(), from, &run.options).map_err(failed)?,
        Place::Mean if args.data.is_none() => {
            return Err(CommandError::Usage(
                "`--at mean` needs the inputs of a recording: give one with `--data FILE`"
                    .to_owned(),
            ));
        }
        Place::Mean => {
            let until = run.times.last().map_or(from, |last| *last);
            run.inputs.cover(from, until).map_err(failed)?;
            let mean = LinearAt::Rest(run.inputs.mean(from, until));
            mean.point(&run.problem(), from, &run.options).map_err(failed)?
        }
    };
    let system = linearize(&run.problem(), &at).map_err(failed)?;
    let poles = system.poles().map_err(failed)?;
    let report = LinearReport::new(run.signature(), args.at, at, system, poles);
    match console.out() {
        Some(path) => {
            let format = console.table_format(path)?;
            match format {
                TableFormat::Csv | TableFormat::Parquet => {
                    save_rows(path, format, |out| report.write_csv(out))?;
                }
                TableFormat::Json => save_json(path, &report.to_json(), true)?,
                TableFormat::JsonLines => save_json(path, &report.to_json(), false)?,
            }
            console.remark(&format!("wrote {}", path.display()));
            if console.is_json() && !format.is_document() {
                return print(&format!("{:#}\n", report.to_json()));
            }
            Ok(())
        }
        None if console.is_json() => console.json(&report.to_json()),
        None => console.result(&report.to_text()),
    }
}

#[allow(clippy::needless_pass_by_value, reason = "errors are handed over so")]
fn failed(error: impl ToString) -> CommandError {
    CommandError::Computation(error.to_string())
}

/// The run that ends at the point.
fn run_args(args: &LinearizeArgs) -> RunArgs {
    let LinearizeArgs { model, choices, data, at, solve } = args;
    let until = match at {
        Place::Time(t) => Some(*t),
        // Without data nothing else says when the first time is, which is all that matters.
        Place::Steady | Place::Mean => data.is_none().then(|| solve.from.unwrap_or(0.0)),
    };
    RunArgs {
        model: model.clone(),
        choices: choices.clone(),
        data: data.clone(),
        every: None,
        solve: SolveArgs { until, ..solve.clone() },
    }
}
