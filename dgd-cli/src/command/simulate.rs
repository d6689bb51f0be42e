//! `dgd simulate`: trajectories of states and outputs.

use dgd_runtime::{Observations, Solution};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::Rng;
use serde_json::json;

use super::over;
use crate::args::SimulateArgs;
use crate::console::Console;
use crate::failure::CommandError;
use crate::figure::{self, Line, Subject};
use crate::load::load;
use crate::plot::Text;
use crate::result::{self, NamedColumn};
use crate::run::{Reached, Run};

pub(crate) fn run(args: &SimulateArgs, console: Console<'_>) -> Result<(), CommandError> {
    if let Some(table) = &args.ensemble {
        return super::ensemble::run(args, table, console);
    }
    figure::verify_formats(&args.run.solve.plot)?;
    let loaded =
        load(&args.run.model, &args.run.choices, |_| dgd_compiler::pipeline::Directions::None)?;
    let run = Run::prepare(&args.run, loaded, console)?;
    if let Some(name) = &args.over {
        over::verify(name, run.signature())?;
    }
    let Reached { solution, mut observations, stopped } = run.simulate()?;
    if let Some(seed) = args.noise_seed {
        add_noise(&run, &mut observations, seed);
    }

    let columns = columns(&run, &solution, &observations);
    let details = json!({
        "model": run.signature().name,
        "rows": solution.len(),
        "method": run.options.method.name,
        "steps": solution.statistics.steps,
        "rejected": solution.statistics.rejected,
        "steps_per_sample": result::per_sample(&solution),
        "events": result::events(&solution),
    });
    if let Some(error) = stopped {
        return result::write_reached(console, &solution.times, &columns, details, &error);
    }
    let over = args.over.as_ref();
    let figure = over.and_then(|name| over::figure(name, &run, &columns, &solution, &observations));
    let over_time = || figure::panels(&subjects(&run, &solution, &observations));
    let figure = figure.unwrap_or_else(over_time);
    for path in &args.run.solve.plot {
        figure::save(&figure, path, console)?;
    }
    let drawn = !args.run.solve.plot.is_empty();
    result::write(console, &solution.times, &columns, &details, drawn)
}

/// Time series in the order promised: inputs, states, outputs; an output named like a state takes
/// its column.
fn columns(run: &Run, solution: &Solution, observations: &Observations) -> Vec<NamedColumn> {
    let signature = run.signature();
    let mut columns = Vec::new();
    for (i, input) in signature.inputs.iter().enumerate() {
        let values = run.input_values(solution, i);
        columns.push(NamedColumn::new(&input.name, &input.unit, values));
    }
    for (i, unknown) in signature.unknowns.iter().enumerate() {
        let shown_as_output = || signature.outputs.iter().any(|output| output.name == unknown.name);
        if !is_element(&unknown.name) && !shown_as_output() {
            let values = (0..solution.len()).map(|k| solution.y(k)[i]).collect();
            columns.push(NamedColumn::new(&unknown.name, &unknown.unit, values));
        }
    }
    for (i, output) in signature.outputs.iter().enumerate() {
        let values = (0..solution.len()).map(|k| observations.w(k)[i]).collect();
        columns.push(NamedColumn::new(&output.name, &output.unit, values));
    }
    columns
}

/// Whether this is an element of an array, and there may be many: outputs ask for those to be
/// shown.
pub(crate) fn is_element(unknown: &str) -> bool {
    unknown.ends_with(']')
}

/// Whether the model does not declare this: a derivative, a combination or a share, which the table
/// has and the figure leaves out.
pub(super) fn is_added(unknown: &str) -> bool {
    unknown.ends_with(')')
}

/// What the figure shows: the inputs, unit by unit; then each declared state and each output, with what was
/// measured of it.
fn subjects(run: &Run, solution: &Solution, observations: &Observations) -> Vec<Subject> {
    let signature = run.signature();
    let mut subjects: Vec<Subject> = Vec::new();
    for (i, input) in signature.inputs.iter().enumerate() {
        let line = Line {
            name: Text::name(&input.name),
            times: solution.times.clone(),
            values: in_unit(&run.input_values(solution, i), &input.unit),
            measured: false,
        };
        let unit = input.unit.symbol.to_string();
        let alike = subjects.iter_mut().find(|subject| subject.unit == unit);
        match alike {
            // Two lines and more are named by the legend.
            Some(subject) => {
                subject.title = Text::default();
                subject.lines.push(line);
            }
            None => {
                subjects.push(Subject { title: Text::name(&input.name), unit, lines: vec![line] });
            }
        }
    }
    for (i, unknown) in signature.unknowns.iter().enumerate() {
        if is_element(&unknown.name)
            || is_added(&unknown.name)
            || signature.outputs.iter().any(|output| output.name == unknown.name)
        {
            continue;
        }
        let values: Vec<f64> = (0..solution.len()).map(|k| solution.y(k)[i]).collect();
        subjects.push(Subject {
            title: Text::name(&unknown.name),
            unit: unknown.unit.symbol.to_string(),
            lines: vec![Line {
                name: Text::plain("simulated"),
                times: solution.times.clone(),
                values: in_unit(&values, &unknown.unit),
                measured: false,
            }],
        });
    }
    for (i, output) in signature.outputs.iter().enumerate() {
        let values: Vec<f64> = (0..solution.len()).map(|k| observations.w(k)[i]).collect();
        let mut lines = vec![Line {
            name: Text::plain("simulated"),
            times: solution.times.clone(),
            values: in_unit(&values, &output.unit),
            measured: false,
        }];
        if let Some(Some(samples)) = run.measured.outputs.get(i) {
            lines.push(Line {
                name: Text::plain("measured"),
                times: run.measured.times.clone(),
                values: in_unit(samples, &output.unit),
                measured: true,
            });
        }
        let (title, unit) = (Text::name(&output.name), output.unit.symbol.to_string());
        subjects.push(Subject { title, unit, lines });
    }
    subjects
}

pub(super) fn in_unit(values: &[f64], unit: &dgd_runtime::Unit) -> Vec<f64> {
    values.iter().map(|value| unit.from_si(*value)).collect()
}

/// Adds white noise of the declared size to each output that declares one.
///
/// Each output has a random stream of its own, so that its noise does not depend on the others.
fn add_noise(run: &Run, observations: &mut Observations, seed: u64) {
    let n_w = observations.n_w;
    for (i, output) in run.signature().outputs.iter().enumerate() {
        let Some(noise) = output.noise else { continue };
        let mut random = Pcg64::new(u128::from(seed), i as u128);
        for value in observations.w.iter_mut().skip(i).step_by(n_w) {
            *value += noise * standard_normal(&mut random);
        }
    }
}

/// A normal deviate of mean 0 and variance 1, by Box and Muller, Ann. Math. Stat. 29 (1958) 610.
fn standard_normal(random: &mut Pcg64) -> f64 {
    // Two uniform numbers in (0, 1], 53 bits each.
    let mut uniform = || ((random.next_u64() >> 11) + 1) as f64 / (1u64 << 53) as f64;
    let (radius, angle) = (uniform(), uniform());
    (-2.0 * radius.ln()).sqrt() * (std::f64::consts::TAU * angle).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deviates_have_mean_zero_and_variance_one() {
        let mut random = Pcg64::new(7, 0);
        let n = 100_000;
        let sample: Vec<f64> = (0..n).map(|_| standard_normal(&mut random)).collect();
        let mean = sample.iter().sum::<f64>() / f64::from(n);
        let variance = sample.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / f64::from(n);
        // Five standard errors: 1/√n of the mean, √(2/n) of the variance.
        assert!(mean.abs() < 5.0 / f64::from(n).sqrt(), "mean {mean}");
        assert!((variance - 1.0).abs() < 5.0 * (2.0 / f64::from(n)).sqrt(), "variance {variance}");
    }
}
