//! Section 3.6: the return flow meter's factor, from the riser's level alone.

use dgd_identify::regression::{
    FollowOptions, Forgetting, Normalisation, ParameterPath, RegressionProblem, follow,
};

use crate::chapters::Fallible;
use crate::claims::claim;
use crate::field::{Field, LPM, mean};
use crate::model::{Choices, Model};
use crate::page::{Finding, Section, computed, ends, input, measured, over_time, panel, per};
use crate::verification::LEVEL;

/// Recursive least squares of Table 3.1 along a recording.
pub(crate) fn followed(
    model: &Model,
    recording: dgd_identify::Recording,
    filter: f64,
    start_variance: f64,
    rate: f64,
) -> Fallible<ParameterPath> {
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
    let half = as_read[last / 2] - level[last / 2];
    let runs_away = vec![
        claim(
            (0.02..0.06).contains(&(drift / LEVEL)),
            "The level drifts away, to the same side",
            "3.5 to 6 % by the axes",
            format!("{:.1} % ({drift:.1} m of {LEVEL} m)", 100.0 * drift / LEVEL),
        ),
        claim(
            (0.3..0.7).contains(&(half / drift)),
            "It drifts steadily, as a flow that is read wrong makes it",
            "a straight drift",
            format!("{:.0} % of it after half of the time", 100.0 * half / drift),
        ),
    ];
    let flows = |factor: f64| {
        let corrected: Vec<f64> = field.column("q_ssp").iter().map(|q| factor * q).collect();
        panel(
            "Flows",
            "lpm",
            vec![
                measured("return flow", t, per(&corrected, LPM)),
                input(1, "booster", t, per(field.column("q_boost"), LPM)),
                input(2, "top fill", t, per(field.column("q_tf"), LPM)),
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
        claims: runs_away,
        figure: over_time(vec![levels("Riser level", as_read), flows(1.0)]),
    };

    let found = followed(&model, recording.clone(), 5.0, 10.0, 0.1)?;
    let times: Vec<f64> = found.times.iter().map(|(_, t)| *t).collect();
    let estimates: Vec<f64> = found.estimates.iter().map(|estimate| estimate[0]).collect();
    // With β = 0.1/s ten seconds are remembered: the mean of all of it but the beginning.
    let settled = times.partition_point(|t| *t < 200.0);
    let theta_1 = mean(&estimates[settled..]);
    let (low, high) = ends(&estimates[settled..]);
    let simulated = model.with(&[("theta_1", theta_1)])?.run(&recording)?.unknown("h_r")?;
    let left = simulated[last] - level[last];
    let claims = vec![
        claim(
            (theta_1 - 0.951).abs() < 0.01,
            "θ₁ by recursive least squares",
            "0.951",
            format!("{theta_1:.4}"),
        ),
        claim(
            high - theta_1 < 0.06 && theta_1 - low < 0.06,
            "It fluctuates little",
            "small fluctuations",
            format!("between {low:.2} and {high:.2} after 200 s"),
        ),
        claim(
            left.abs() < 0.1 * drift.abs(),
            "The level follows with it",
            "follows",
            format!("{left:.2} m are left of {drift:.1} m"),
        ),
    ];
    let corrected = Finding {
        number: "3.12",
        title: "The level with the corrected flow",
        thesis: "Recursive least squares with Λ = 5s + 1, P₀ = 10 and β = 0.1 give θ₁ = 0.951, and the level follows.",
        here: format!("θ₁ = {theta_1:.4}; the level is off by {left:.2} m in the end."),
        claims,
        figure: over_time(vec![
            levels("Riser level", simulated),
            panel("Correction θ₁", "1", vec![computed("estimate", &times, estimates)]),
            flows(theta_1),
        ]),
    };
    Ok((Section { title: "3.6 Return flow", findings: vec![isolated, corrected] }, theta_1))
}
