//! Section 3.4: friction of the return line.

use dgd_identify::regression::{
    RegressionFit, RegressionMethod, RegressionProblem, RowOf, regress,
};

use crate::chapters::Fallible;
use crate::field::{BAR, Field, LPM, slopes};
use crate::model::{Choices, Model};
use crate::page::{Finding, Section, claim, computed, dots, measured, over, over_time, panel, per};

/// A sample is steady where the flow changes more slowly than this, m³/s².
const STEADY: f64 = 0.6 * LPM;

/// Half the width of the window in which it does, samples.
const HALF: usize = 30;

/// Coefficients of q, q², q³ and q⁴, SI, of readings.
pub(crate) type Polynomial = [f64; 4];

/// Where the flow is steady.
pub(crate) fn steady(field: &Field) -> Vec<usize> {
    let slopes = slopes(&field.times, field.column("q_ssp"), HALF);
    (0..field.len()).filter(|k| slopes[*k].abs() <= STEADY).collect()
}

/// Values at some samples.
pub(crate) fn at(values: &[f64], samples: &[usize]) -> Vec<f64> {
    samples.iter().map(|k| values[*k]).collect()
}

/// A regression of one output on a table of rows.
pub(crate) fn fitted(
    model: &Model,
    columns: &[(&str, &[f64])],
    method: RegressionMethod,
) -> Fallible<RegressionFit> {
    let rows: Vec<f64> = (0..columns[0].1.len()).map(|k| k as f64).collect();
    let recordings = [model.recording(&rows, columns, &[])?];
    let problem = RegressionProblem::new(&model.system, &model.p, &recordings);
    Ok(regress(&problem, method)?)
}

/// R² and mean squared error, SI², of the one output.
pub(crate) fn quality(fit: &RegressionFit) -> (f64, f64) {
    let row = fit.rows.iter().find(|row| matches!(row.of, RowOf::Output(_)));
    row.map_or((f64::NAN, f64::NAN), |row| {
        (row.r_squared.unwrap_or(f64::NAN), row.mean_squared_error)
    })
}

/// Root mean square of the errors of the parabola through the origin that fits best.
fn about_a_parabola(x: &[f64], y: &[f64]) -> f64 {
    let pairs = || x.iter().zip(y);
    let size =
        pairs().map(|(x, y)| x * x * y).sum::<f64>() / pairs().map(|(x, _)| x.powi(4)).sum::<f64>();
    let squares: f64 = pairs().map(|(x, y)| (y - size * x * x).powi(2)).sum();
    (squares / x.len() as f64).sqrt()
}

/// Figs 3.5 to 3.7, and the polynomial of fourth order.
pub(crate) fn identify(tests: &Field) -> Fallible<(Section, Polynomial)> {
    let (t, q) = (&tests.times, tests.column("q_ssp"));
    let loss = tests.friction();
    let steady = steady(tests);
    let (q_steady, loss_steady) = (at(q, &steady), at(&loss, &steady));
    let window = |k: &usize| (1000.0..3000.0).contains(&t[*k]);
    let shown: Vec<usize> = (0..t.len()).filter(window).collect();
    let shown_steady: Vec<usize> = steady.iter().copied().filter(window).collect();
    let range = |values: &[f64]| {
        let (least, most) = values
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| (low.min(*q), high.max(*q)));
        most - least
    };
    let covers = claim(
        steady.len() < t.len() * 9 / 10 && range(&q_steady) > 0.9 * range(q),
        format!(
            "What is left out are transients, not flows: steady samples go over {:.0} % of the range.",
            100.0 * range(&q_steady) / range(q)
        ),
    );
    let steady_flow = Finding {
        number: "3.5",
        title: "Steady flow, part of the pump tests",
        thesis: "Samples at which |dq/dt| ≤ ε are extracted.",
        here: format!(
            "{} of {} samples change by less than {:.1} lpm/s.",
            steady.len(),
            t.len(),
            STEADY / LPM
        ),
        claims: vec![covers],
        figure: over_time(vec![panel(
            "Return flow",
            "lpm",
            vec![
                measured("measured", &at(t, &shown), per(&at(q, &shown), LPM)),
                dots("steady", &at(t, &shown_steady), per(&at(q, &shown_steady), LPM)),
            ],
        )]),
    };
    let spreads = [about_a_parabola(&q_steady, &loss_steady), about_a_parabola(q, &loss)];
    let on_a_curve = claim(
        spreads[0] < spreads[1] && spreads[1] < 0.1 * range(&loss),
        format!(
            "Friction grows as the square of the flow: steady samples lie within {:.2} bar of it, all within {:.2} \
             bar, root mean square.",
            spreads[0] / BAR,
            spreads[1] / BAR
        ),
    );
    let all_points = Finding {
        number: "3.6",
        title: "Friction of the return line over the flow",
        thesis: "Steady samples lie on a curve; all samples scatter about it.",
        here: "Steady samples lie on a curve; all samples spread wider, as the flow meter lags."
            .into(),
        claims: vec![on_a_curve],
        figure: over(
            "Return flow",
            "lpm",
            vec![panel(
                "ΔP − ΔG",
                "bar",
                vec![
                    dots("all samples", &per(q, LPM), per(&loss, BAR)),
                    dots("steady", &per(&q_steady, LPM), per(&loss_steady, BAR)),
                ],
            )],
        ),
    };

    let order =
        |order: &str, free: &[&str], q: &[f64], loss: &[f64]| -> Fallible<(RegressionFit, Model)> {
            let variants = [("order", order)];
            let choices = Choices { variants: &variants, free, ..Choices::default() };
            let mut model = Model::load("examples/thesis/return_line.dgd", &choices)?;
            let columns = [("q_ssp", q), ("dp", loss)];
            let fit = fitted(&model, &columns, RegressionMethod::LeastSquares)?;
            model.p.clone_from(&fit.p);
            Ok((fit, model))
        };
    let names = ["F1", "F2", "F3", "F4"];
    let grid: Vec<f64> = (0..=100)
        .map(|k| f64::from(k) * 0.01 * q.iter().fold(0.0, |a: f64, b| a.max(*b)))
        .collect();
    let (mut panels, mut said, mut found) = (Vec::new(), Vec::new(), [0.0; 4]);
    let mut qualities = Vec::new();
    for (name, free, title) in
        [("second", &names[..2], "Second order"), ("fourth", &names[..], "Fourth order")]
    {
        let (of_steady, model) = order(name, free, &q_steady, &loss_steady)?;
        let (of_all, model_of_all) = order(name, free, q, &loss)?;
        let curve = |model: &Model| -> Fallible<Vec<f64>> {
            let rows: Vec<f64> = (0..grid.len()).map(|k| k as f64).collect();
            Ok(per(
                &model.run(&model.recording(&rows, &[("q_ssp", &grid)], &[])?)?.output("dp")?,
                BAR,
            ))
        };
        panels.push(panel(
            title,
            "bar",
            vec![
                dots("steady samples", &per(&q_steady, LPM), per(&loss_steady, BAR)),
                computed("fitted to steady samples", &per(&grid, LPM), curve(&model)?),
                computed("fitted to all", &per(&grid, LPM), curve(&model_of_all)?),
            ],
        ));
        let (r_squared, mse) = quality(&of_steady);
        said.push(format!(
            "{}: R² {r_squared:.4}, MSE {:.2e} bar² (all samples: R² {:.4})",
            title,
            mse / (BAR * BAR),
            quality(&of_all).0
        ));
        qualities.push((r_squared, mse));
        for (place, parameter) in found.iter_mut().zip(names) {
            *place = of_steady.p[model.parameter(parameter)?];
        }
    }
    let better = claim(
        qualities[0].0 < qualities[1].0 && qualities[1].1 < qualities[0].1,
        format!(
            "Friction of fourth order fits better than of second: R² {:.5} and {:.5}.",
            qualities[1].0, qualities[0].0
        ),
    );
    let polynomials = Finding {
        number: "3.7",
        title: "Friction of the return line, fitted",
        thesis: "Second order: R² 0.9929, MSE 0.0504 bar². Fourth order: R² 0.9946, MSE 0.0388 bar².",
        here: format!("{}.", said.join(". ")),
        claims: vec![better],
        figure: over("Return flow", "lpm", panels),
    };
    let findings = vec![steady_flow, all_points, polynomials];
    Ok((Section { title: "3.4 Friction", findings }, found))
}
