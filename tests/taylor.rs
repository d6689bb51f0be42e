//! Taylor series: coefficients against repeated symbolic differentiation, and solutions against known
//! ones.

mod support;

use dgd::taylor::{MOST_ORDER, Terms};
use dgd::{Point, System, discrete_numbers};
use dgd_compiler::dae::Dae;
use dgd_compiler::expr::{ExprId, Graph, Symbol};
use dgd_compiler::program::Direction;
use dgd_execute::Interpreted;
use support::{Noise, compiled, every_variant, input_values, model_files};

/// Coefficients of y and S at a point, order by order; S row by row.
fn coefficients(
    system: &impl System,
    at: Point<'_>,
    udot: &[f64],
    s0: &[f64],
    h: f64,
    order: usize,
) -> (Vec<f64>, Vec<f64>) {
    let signature = system.signature();
    let (n, n_s) = (signature.unknowns.len(), signature.directions.len());
    let kept = system.taylor_series().expect("a model with series");
    let mut work: Vec<Terms> = vec![[f64::NAN; MOST_ORDER + 1]; kept.sensitivities];
    let (mut y, mut s) = (vec![f64::NAN; (order + 1) * n], vec![f64::NAN; (order + 1) * n * n_s]);
    s[..s0.len()].copy_from_slice(s0);
    system.sensitivity_taylor(at, udot, h, order, &mut work, &mut y, &mut s);
    let mut alone = vec![f64::NAN; y.len()];
    let mut work: Vec<Terms> = vec![[f64::NAN; MOST_ORDER + 1]; kept.unknowns];
    system.taylor(at, udot, h, order, &mut work, &mut alone);
    assert_eq!(alone, y, "with and without sensitivities");
    (y, s)
}

/// de/dt along solutions.
fn along(graph: &mut Graph, dae: &Dae, e: ExprId) -> ExprId {
    let n = dae.unknowns.len();
    let (n_u, n_late) = (dae.inputs.len(), dae.delayed_inputs.len());
    let gradient = graph.gradient(e, |symbol| match symbol {
        Symbol::Unknown(i) => Some(i as usize),
        Symbol::Time => Some(n),
        Symbol::Input(i) if (i as usize) < n_u + n_late => Some(n + 1 + i as usize),
        _ => None,
    });
    let mut sum = graph.constant(0.0);
    for (position, slope) in gradient {
        let term = if position < n {
            graph.multiply(slope, dae.unknowns[position].rhs)
        } else if position == n {
            slope
        } else {
            let udot = graph.symbol(Symbol::InputSlope((position - n - 1) as u32));
            graph.multiply(slope, udot)
        };
        sum = graph.add(sum, term);
    }
    sum
}

/// The coefficients of every model that has series, against derivatives that the compiler takes one
/// after the other, and their derivatives to unknowns and parameters.
#[test]
fn coefficients_are_repeated_derivatives() {
    const ORDER: usize = 6;
    let mut compared = 0;
    for path in model_files() {
        for choices in every_variant(&path) {
            let choices: Vec<(&str, &str)> =
                choices.iter().map(|(v, c)| (v.as_str(), c.as_str())).collect();
            let compiled = compiled(&path, &choices);
            let (dae, program) = (&compiled.dae, &compiled.program);
            if program.taylor.is_err() {
                continue;
            }
            compared += 1;
            let directions = program.directions.clone();
            let system = Interpreted::new(program.clone());
            let signature = system.signature();
            let (n, n_s) = (signature.unknowns.len(), signature.directions.len());
            let label = format!("{} {choices:?}", path.display());

            let mut noise = Noise::new(29);
            let p: Vec<f64> = signature
                .parameters
                .iter()
                .map(|x| if x.value == 0.0 { 0.1 * x.unit.factor } else { x.value })
                .collect();
            let mut numbers = Vec::new();
            let u = input_values(
                signature,
                |_, x| x.unit.offset + x.unit.factor * (20.0 + 2.0 * noise.next()),
                |_, x| {
                    numbers.push(x.unit.factor);
                    0.01 * x.unit.factor
                },
            );
            let linear = |i: usize| match i.checked_sub(signature.inputs.len()) {
                None => Some(i),
                Some(late) => signature.delayed_inputs.get(late).map(|late| late.input),
            };
            let udot: Vec<f64> = (0..u.len())
                .map(|i| match linear(i).map(|i| signature.inputs[i].interpolation) {
                    Some(dgd::Interpolation::Linear) => 0.01 * u[i].abs() * (1.0 + noise.next()),
                    _ => 0.0,
                })
                .collect();
            let z = discrete_numbers(&system, &p, 0.3);
            let mut y = vec![0.0; n];
            system.start(Point { t: 0.3, y: &[], u: &u, p: &p, z: &z }, &mut y);
            for (y, unknown) in y.iter_mut().zip(signature.unknowns.iter()) {
                let size =
                    unknown.nominal.unwrap_or(if *y == 0.0 { unknown.unit.factor } else { *y });
                *y += 0.05 * size.abs() * (1.5 + 0.5 * noise.next());
            }
            let s0: Vec<f64> = (0..n * n_s).map(|k| y[k / n_s].abs() * noise.next()).collect();
            let at = Point { t: 0.3, y: &y, u: &u, p: &p, z: &z };
            let mut f = vec![0.0; n];
            system.rhs(at, &mut f);
            // A step in which unknowns change by a hundredth.
            let rate = y.iter().zip(&f).fold(0.0_f64, |rate, (y, f)| rate.max((f / y).abs()));
            let h = 0.01 / rate;
            let (found, found_s) = coefficients(&system, at, &udot, &s0, h, ORDER);

            let mut graph = dae.graph.clone();
            let value = |symbol: Symbol| match symbol {
                Symbol::Unknown(i) => y[i as usize],
                Symbol::Time => 0.3,
                Symbol::Input(i) => u[i as usize],
                Symbol::InputSlope(i) => udot[i as usize],
                Symbol::Parameter(i) => p[i as usize],
                Symbol::Discrete(i) => z[i as usize],
                other => panic!("{label}: {other:?} in a model with series"),
            };
            for i in 0..n {
                let mut derivative = dae.unknowns[i].rhs;
                let mut factor = h;
                for k in 1..=ORDER {
                    let expected = factor * graph.evaluate(derivative, &value);
                    let computed = found[k * n + i];
                    // Rounding: derivatives of many terms that cancel, relative to the size of the terms,
                    // which shrink by about a hundredth from order to order where nothing cancels.
                    let size = y[i].abs() * 0.01_f64.powi(k as i32);
                    let allowed = 1e-9 * expected.abs() + 1e-7 * size;
                    assert!(
                        (computed - expected).abs() <= allowed,
                        "{label}: order {k} of {}: {computed:e}, {expected:e}",
                        signature.unknowns[i].name
                    );
                    if dae.delayed_inputs.is_empty() {
                        let gradient = graph.gradient(derivative, |symbol| match symbol {
                            Symbol::Unknown(i) => Some(i as usize),
                            Symbol::Parameter(i) => Some(n + i as usize),
                            _ => None,
                        });
                        for (j, direction) in directions.iter().enumerate() {
                            let mut expected = 0.0;
                            let mut size = 0.0;
                            for (position, slope) in &gradient {
                                let along = match direction {
                                    _ if *position < n => s0[position * n_s + j],
                                    Direction::Parameter(p) if n + p == *position => 1.0,
                                    _ => continue,
                                };
                                let term = factor * graph.evaluate(*slope, &value) * along;
                                expected += term;
                                size += term.abs();
                            }
                            let computed = found_s[(k * n + i) * n_s + j];
                            assert!(
                                (computed - expected).abs() <= 1e-9 * size,
                                "{label}: order {k} of {} to {}: {computed:e}, {expected:e}",
                                signature.unknowns[i].name,
                                signature.direction_name(j)
                            );
                        }
                    }
                    derivative = along(&mut graph, dae, derivative);
                    factor *= h / (k + 1) as f64;
                }
            }
        }
    }
    assert!(compared >= 10, "only {compared} models have series");
}
