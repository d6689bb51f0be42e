//! Section 3.6: the return flow meter's factor, from the riser's level alone.

use dgd_identify::regression::{
    FollowOptions, Followed, Forgetting, Normalisation, RegressionProblem, follow,
};

use crate::chapters::Fallible;
use crate::field::{Field, LPM, mean};
use crate::model::{Choices, Model};
use crate::page::{Finding, Section, claim, computed, measured, over_time, panel, per};

/// Recursive least squares of Table 3.1 along a recording.
pub(crate) fn followed(
    model: &Model,
    recording: dgd_identify::Recording,
    filter: f64,
    start_variance: f64,
    rate: f64,
) -> Fallible<Followed> {
    let recordings = [recording];
    let problem = RegressionProblem::new(&model.system, &model.p, &recordings);
    let forgetting = Forgetting { rate, limit: f64::INFINITY, normalisation: Normalisation::None };
    let time_constants = vec![filter];
    Ok(follow(&problem, &FollowOptions { time_constants, start_variance, forgetting })?)
}

/// Figs 3.11 and 3.12, and θ₁.
pub(crate) fn identify(field: &Field) -> Fallible<(Section, f64)> {
    let t = &field.times;
    let level = field.level();
    let model = Model::load("examples/thesis/riser_level.dgd", &Choices::default())?;
    let recording = model.recording(t, &field.columns(), &[("h_r", mean(&level[..30]))])?;
    let as_read = model.run(&recording)?.unknown("h_r")?;
    let last = level.len() - 1;
    let drift = as_read[last] - level[last];
    let runs_away = claim(
        drift.abs() > 10.0,
        format!("With flows as they are read the level runs away: by {drift:.1} m."),
    );
    let into: Vec<f64> =
        field.column("q_boost").iter().zip(field.column("q_tf")).map(|(a, b)| a + b).collect();
    let flows = |factor: f64| {
        let corrected: Vec<f64> = field.column("q_ssp").iter().map(|q| factor * q).collect();
        panel(
            "Flows",
            "lpm",
            vec![
                measured("return flow", t, per(&corrected, LPM)),
                computed("booster and top fill", t, per(&into, LPM)),
            ],
        )
    };
    let levels = |title: &str, simulated: Vec<f64>| {
        let lines =
            vec![measured("measured", t, level.clone()), computed("simulated", t, simulated)];
        panel(title, "m", lines)
    };
    let isolated = Finding {
        number: "3.11",
        title: "The riser's level alone, with flows as they are read",
        thesis: "The level drifts away from what is measured.",
        here: format!("In {:.0} s the level drifts away by {drift:.1} m.", t[last]),
        claims: vec![runs_away],
        figure: over_time(vec![levels("Riser level", as_read), flows(1.0)]),
    };

    let found = followed(&model, recording.clone(), 5.0, 10.0, 0.1)?;
    let times: Vec<f64> = found.times.iter().map(|(_, t)| *t).collect();
    let estimates: Vec<f64> = found.estimates.iter().map(|estimate| estimate[0]).collect();
    // With β = 0.1/s ten seconds are remembered: the mean of all of it but the beginning.
    let settled = times.partition_point(|t| *t < 200.0);
    let theta_1 = mean(&estimates[settled..]);
    let right = claim(
        (theta_1 - 0.951).abs() < 0.01,
        format!("The flow is corrected by 0.951 ± 0.01: {theta_1:.4}."),
    );
    let simulated = model.with(&[("theta_1", theta_1)])?.run(&recording)?.unknown("h_r")?;
    let left = simulated[last] - level[last];
    let cured = claim(
        left.abs() < 0.1 * drift.abs(),
        format!("That cures the drift: {left:.2} m are left of {drift:.1} m."),
    );
    let corrected = Finding {
        number: "3.12",
        title: "The level with the corrected flow",
        thesis: "Recursive least squares with Λ = 5s + 1, P₀ = 10 and β = 0.1 give θ₁ = 0.951, and the level follows.",
        here: format!("θ₁ = {theta_1:.4}; the level is off by {left:.2} m in the end."),
        claims: vec![right, cured],
        figure: over_time(vec![
            levels("Riser level", simulated),
            panel("Correction θ₁", "1", vec![computed("estimate", &times, estimates)]),
            flows(theta_1),
        ]),
    };
    Ok((Section { title: "3.6 Return flow", findings: vec![isolated, corrected] }, theta_1))
}
