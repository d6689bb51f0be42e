//! What somebody who has never used the crate writes first, from the names alone.

use std::path::Path;

use dgd::{Error, LinearizationPoint, Options, Problem, Recording};
use dgd_compiler::pipeline::SensitivityDirections;
use dgd_execute::InterpretedSystem;

use crate::support::compiled_text;

dgd::model!("models/pump_speed_step.dgd");
use pump_speed_step::{Model, Parameters};

/// The step of the thesis' Fig 3.1.
fn step() -> Result<dgd::Inputs, Error> {
    let speed = [10.0 / 1.1, 10.0];
    // In another order than the model's.
    dgd::inputs(&Model, &[0.0, 50.0], &[("q_in", &[0.02, 0.02]), ("omega", &speed)])
}

fn times() -> Vec<f64> {
    (0..=1000).map(f64::from).collect()
}

#[test]
fn a_run_is_read_by_name() -> Result<(), Error> {
    let inputs = step()?;
    let p = Parameters { c0: 0.4, ..Default::default() };
    let problem = Problem::new(&Model, &p, &inputs).start("h", 12.0)?;
    let solution = dgd::simulate(&problem, &times(), &Options::default().rtol(1e-8))?;
    assert_eq!(solution.get("h")?[0], 12.0);
    assert_eq!(solution.get("q")?.len(), solution.times().len());
    let names: Vec<&str> = solution.names().collect();
    assert_eq!(names, ["h", "q"]);

    let by_bdf = Options::default().rtol(1e-8).method(dgd::method("bdf")?);
    let other = dgd::simulate(&problem, &times(), &by_bdf)?;
    let (a, b) = (solution.get("h")?[1000], other.get("h")?[1000]);
    assert!((a - b).abs() < 1e-4, "{a} and {b}");
    Ok(())
}

#[test]
fn sensitivities_have_two_names() -> Result<(), Error> {
    let inputs = step()?;
    let run = |c0: f64| -> Result<f64, Error> {
        let p = Parameters { c0, ..Default::default() };
        let problem = Problem::new(&Model, &p, &inputs);
        let solution = dgd::simulate(&problem, &times(), &Options::default().rtol(1e-9))?;
        Ok(solution.get("h")?[1000])
    };
    let problem = Problem::new(&Model, &Parameters::default(), &inputs);
    let run_with = dgd::sensitivities(&problem, &times(), &Options::default().rtol(1e-9))?;
    let difference = (run(0.39 + 1e-4)? - run(0.39 - 1e-4)?) / 2e-4;
    let derivative = run_with.sensitivity("h", "c0")?[1000];
    assert!((derivative - difference).abs() < 1e-3 * difference.abs(), "{derivative} {difference}");
    Ok(())
}

#[test]
fn a_fit_finds_what_a_recording_was_made_with() -> Result<(), Error> {
    let inputs = step()?;
    let truth = Parameters { c0: 0.392, F: 5.6e8, ..Default::default() };
    let made =
        dgd::simulate(&Problem::new(&Model, &truth, &inputs), &times(), &Options::default())?;
    let recording = Recording::new(&times(), &inputs)
        .measured("h", made.get("h")?)
        .measured("q", made.get("q")?);
    let options = Options::default();
    let fit = dgd::fit(&Model, &Parameters::default(), &[recording], &["c0", "F"], &options)?;
    assert!(fit.is_converged(), "{:?}", fit.termination());
    assert!((fit.get("c0")?.value - 0.392).abs() < 1e-4, "{:?}", fit.get("c0")?);
    assert!(fit.rms("h", 0)?.is_some_and(|rms| rms < 1e-3));
    // It goes on with what was found.
    let found = Problem::new(&Model, fit.parameters(), &inputs);
    assert!(dgd::simulate(&found, &times(), &options).is_ok());
    Ok(())
}

#[test]
fn a_linear_model_is_labelled() -> Result<(), Error> {
    let inputs = step()?;
    let problem = Problem::new(&Model, &Parameters::default(), &inputs);
    let options = Options::default();
    let at_rest = dgd::linearize(&problem, LinearizationPoint::Steady(60.0), &options)?;
    assert_eq!(at_rest.states(), ["h", "q"]);
    assert_eq!(at_rest.inputs(), ["omega", "q_in"]);
    assert_eq!(at_rest.outputs(), ["h", "q"]);
    // A_r ḣ = q − q_in: no number but 1/A_r.
    let area = std::f64::consts::FRAC_PI_4 * (19.75 * 0.0254_f64).powi(2);
    assert!((at_rest.a()[0][1] * area - 1.0).abs() < 1e-9);
    assert!((at_rest.b()[0][1] * area + 1.0).abs() < 1e-9);
    assert!(at_rest.poles()?.iter().all(|(real, _)| *real < 0.0));
    let on_the_way =
        dgd::linearize(&problem, LinearizationPoint::Run { from: 0.0, until: 100.0 }, &options)?;
    assert_ne!(on_the_way.a(), at_rest.a());
    Ok(())
}

#[test]
fn an_ensemble_gives_what_its_members_give_alone() -> Result<(), Error> {
    let inputs = step()?;
    let options = Options::default();
    let problems: Vec<_> = (0..20)
        .map(|k| Parameters { c0: 0.38 + 1e-3 * f64::from(k), ..Default::default() })
        .map(|p| Problem::new(&Model, &p, &inputs))
        .collect();
    let many = dgd::ensemble(&problems, &times(), &options);
    assert_eq!(many.len(), problems.len());
    for (problem, member) in problems.iter().zip(many) {
        let (member, alone) = (member?, dgd::simulate(problem, &times(), &options)?);
        // Both to the tolerance, which is 1e-6 of the level and of its size.
        let differs = |(a, b): (&f64, &f64)| (a - b).abs() > 1e-4;
        assert!(!member.get("h")?.iter().zip(alone.get("h")?).any(differs));
    }
    Ok(())
}

#[test]
fn another_model_in_an_ensemble_is_run_as_itself() -> Result<(), Error> {
    let falling = |rate: f64| {
        let text = format!("model fall\nstate x [m] = 1\nequation e: der(x) = -{rate}*x/1 [s]\n");
        let compiled =
            compiled_text(Path::new("fall.dgd"), text, (&[], &[]), &SensitivityDirections::None);
        InterpretedSystem::new(compiled.program)
    };
    let (slow, fast) = (falling(1.0), falling(2.0));
    let inputs = dgd::Inputs::none();
    let problems = [&slow, &fast].map(|model| Problem::new(model, [], &inputs));
    let ends: Result<Vec<f64>, Error> = dgd::ensemble(&problems, &[0.0, 1.0], &Options::default())
        .into_iter()
        .map(|solution| Ok(solution?.get("x")?[1]))
        .collect();
    let ends = ends?;
    assert!((ends[0] - (-1.0_f64).exp()).abs() < 1e-4, "{ends:?}");
    assert!((ends[1] - (-2.0_f64).exp()).abs() < 1e-4, "{ends:?}");
    Ok(())
}

#[test]
fn what_is_wrong_is_said_by_name() -> Result<(), Error> {
    let said = |error: Error| error.to_string();
    let inputs = step()?;
    let problem = Problem::new(&Model, &Parameters::default(), &inputs);
    let solution = dgd::simulate(&problem, &[0.0, 1.0], &Options::default())?;
    assert_eq!(
        said(solution.get("level").unwrap_err()),
        "the model has no state or output `level`; it has `h`, `q`"
    );
    assert_eq!(
        said(dgd::inputs(&Model, &[0.0], &[("omega", &[1.0])]).unwrap_err()),
        "the input `q_in` has no samples"
    );
    assert_eq!(
        said(
            dgd::simulate(&Problem::new(&Model, [1.0, 2.0], &inputs), &[0.0], &Options::default())
                .unwrap_err()
        ),
        "parameters: 2 numbers where 5 are expected"
    );
    assert_eq!(
        said(solution.sensitivity("h", "c0").unwrap_err()),
        "the run has no sensitivity to `c0`: `dgd::sensitivities` computes them"
    );
    Ok(())
}
