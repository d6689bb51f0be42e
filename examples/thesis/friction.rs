//! Section 3.4: friction of the return line.

use dgd_identify::regression::{
    RegressionFit, RegressionMethod, RegressionProblem, RowOf, regress,
};

use crate::chapters::Fallible;
use crate::claims::claim;
use crate::field::{BAR, Field, LPM, mean, slopes};
use crate::model::{Choices, Model};
use crate::page::{
    Finding, Section, chosen, computed, measured, over, over_time, panel, per, points, range, rms,
};

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
    rms(&pairs().map(|(x, y)| y - size * x * x).collect::<Vec<f64>>())
}

/// The power of x with which y grows: the slope of their logarithms.
fn exponent(x: &[f64], y: &[f64]) -> f64 {
    let both = x.iter().zip(y).filter(|(x, y)| **x > 0.0 && **y > 0.0);
    let (x, y): (Vec<f64>, Vec<f64>) = both.map(|(x, y)| (x.ln(), y.ln())).unzip();
    let (x_mean, y_mean) = (mean(&x), mean(&y));
    let cross: f64 = x.iter().zip(&y).map(|(x, y)| (x - x_mean) * (y - y_mean)).sum();
    cross / x.iter().map(|x| (x - x_mean).powi(2)).sum::<f64>()
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
    let kept = steady.len() as f64 / t.len() as f64;
    let covers = vec![
        claim(
            (0.1..0.9).contains(&kept),
            "Samples in transients are left out",
            "those with |dq/dt| ≤ ε are kept",
            format!("{:.0} % are kept", 100.0 * kept),
        ),
        claim(
            range(&q_steady) > 0.9 * range(q),
            "Flows are not: steady samples go over all of them",
            "from low to high flow",
            format!("over {:.0} % of the range", 100.0 * range(&q_steady) / range(q)),
        ),
    ];
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
        claims: covers,
        figure: over_time(vec![panel(
            "Return flow",
            "lpm",
            vec![
                measured("measured", &at(t, &shown), per(&at(q, &shown), LPM)),
                chosen("steady", &at(t, &shown_steady), per(&at(q, &shown_steady), LPM)),
            ],
        )]),
    };
    let spreads = [about_a_parabola(&q_steady, &loss_steady), about_a_parabola(q, &loss)];
    let power = exponent(&q_steady, &loss_steady);
    let on_a_curve = vec![
        claim(
            (1.7..2.1).contains(&power),
            "Friction grows with the square of the flow",
            "looks quadratic",
            format!("with its power of {power:.2}"),
        ),
        claim(
            spreads[0] < 0.05 * range(&loss) && spreads[1] < 0.1 * range(&loss),
            "All samples lie about the curve on which the steady ones lie",
            "transients spread no wider",
            format!(
                "steady {:.2} bar, all {:.2} bar about a parabola",
                spreads[0] / BAR,
                spreads[1] / BAR
            ),
        ),
    ];
    let all_points = Finding {
        number: "3.6",
        title: "Friction of the return line over the flow",
        thesis: "Steady samples lie on a curve; all samples scatter about it.",
        here: "Steady samples lie on a curve; all samples spread wider, as the flow meter lags."
            .into(),
        claims: on_a_curve,
        figure: over(
            "Return flow",
            "lpm",
            vec![panel(
                "ΔP − ΔG",
                "bar",
                vec![
                    points("all samples", &per(q, LPM), per(&loss, BAR)),
                    chosen("steady", &per(&q_steady, LPM), per(&loss_steady, BAR)),
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
                points("steady samples", &per(&q_steady, LPM), per(&loss_steady, BAR)),
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
    let gain = 1.0 - qualities[1].1 / qualities[0].1;
    let better = vec![
        claim(
            qualities[0].0 < qualities[1].0 && (0.1..0.5).contains(&gain),
            "The fourth order fits better than the second, somewhat",
            "MSE 23 % less",
            format!("MSE {:.0} % less", 100.0 * gain),
        ),
        claim(
            qualities[0].0 > 0.99,
            "The second order is nearly enough",
            "R² 0.9929 and 0.9946",
            format!("R² {:.5} and {:.5}", qualities[0].0, qualities[1].0),
        ),
    ];
    let polynomials = Finding {
        number: "3.7",
        title: "Friction of the return line, fitted",
        thesis: "Second order: R² 0.9929, MSE 0.0504 bar². Fourth order: R² 0.9946, MSE 0.0388 bar².",
        here: format!("{}.", said.join(". ")),
        claims: better,
        figure: over("Return flow", "lpm", panels),
    };
    let findings = vec![steady_flow, all_points, polynomials];
    Ok((Section { title: "3.4 Friction", findings }, found))
}
