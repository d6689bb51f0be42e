//! Checks functions and their derivatives at single points.

use std::cell::RefCell;

use dgd_runtime::{Direction, EvaluationPoint, Pattern, Signature, System, discrete_numbers};

use super::Finding;
use crate::case::Case;
use crate::prepared::Prepared;
use crate::random::Random;

/// A point at which a model is evaluated.
#[derive(Debug, Clone)]
pub(super) struct At {
    pub t: f64,
    pub y: Vec<f64>,
    pub u: Vec<f64>,
    pub p: Vec<f64>,
    pub z: Vec<f64>,
}

impl At {
    pub(super) fn point(&self) -> EvaluationPoint<'_> {
        EvaluationPoint { t: self.t, y: &self.y, u: &self.u, p: &self.p, z: &self.z }
    }
}

/// Sizes of the unknowns, SI.
pub(super) fn sizes(signature: &Signature, start: &[f64]) -> Vec<f64> {
    signature
        .unknowns
        .iter()
        .zip(start)
        .map(|(unknown, start)| {
            let size = unknown.nominal.unwrap_or(*start).abs();
            if size == 0.0 { unknown.unit.factor } else { size }
        })
        .collect()
}

/// Points near the initial values, in every mode.
pub(super) fn places(prepared: &Prepared, random: &mut Random) -> Vec<At> {
    let signature = prepared.signature();
    let system = &prepared.system;
    let p: Vec<f64> = prepared.p.iter().map(|p| p * random.between(0.9, 1.1)).collect();
    let t = random.between(0.1, 1.5);
    let random = RefCell::new(random);
    let inputs: Vec<f64> = (signature.inputs.iter())
        .map(|x| x.unit.offset + x.unit.factor * random.borrow_mut().between(-30.0, 30.0))
        .collect();
    let past = signature.past();
    let mut u = inputs.clone();
    u.extend(signature.delayed_inputs.iter().map(|late| inputs[late.input]));
    u.extend(signature.delayed_inputs.iter().map(|late| {
        signature.inputs[late.input].unit.factor * random.borrow_mut().between(-30.0, 30.0)
    }));
    u.resize(signature.n_u(), 0.0);
    let z = discrete_numbers(system, &p, t);
    let mut y = vec![0.0; signature.unknowns.len()];
    system.start(EvaluationPoint { t, y: &[], u: &u, p: &p, z: &z }, &mut y);
    let sizes = sizes(signature, &y);
    for (y, size) in y.iter_mut().zip(&sizes) {
        *y += size * random.borrow_mut().between(-1.0, 1.0);
    }
    for (k, late) in signature.delayed_unknowns.iter().enumerate() {
        let size = sizes[late.unknown];
        u[past.first + k] = 1.0;
        u[past.first + past.n_v + k] =
            y[late.unknown] + size * random.borrow_mut().between(-0.3, 0.3);
    }
    let first = At { t, y, u, p, z };
    let discrete = &signature.discrete;
    let mut places = vec![first.clone()];
    let conditions = std::iter::repeat_n(2, discrete.n_time_conditions);
    for (k, modes) in discrete.automata.iter().map(|a| a.modes.len()).chain(conditions).enumerate()
    {
        let mut place = first.clone();
        place.z[k] = random.borrow_mut().below(modes) as f64;
        places.push(place);
    }
    places.truncate(5);
    places
}

/// A derivative from differences, with an estimate of its error.
struct Difference {
    value: f64,
    error: f64,
}

/// The first derivative at zero, extrapolated from three central differences.
fn difference(f: impl Fn(f64) -> Vec<f64>, size: f64) -> Vec<Difference> {
    let h = 2e-3 * size;
    let central = |h: f64| -> Vec<f64> {
        f(h).iter().zip(f(-h)).map(|(high, low)| (high - low) / (2.0 * h)).collect()
    };
    let (a, b, c) = (central(h), central(h / 2.0), central(h / 4.0));
    let now = f(0.0);
    let (high, low) = (f(h / 4.0), f(-h / 4.0));
    (0..a.len())
        .map(|k| {
            let (ab, bc) = (b[k] + (b[k] - a[k]) / 3.0, c[k] + (c[k] - b[k]) / 3.0);
            let rounding = 1e-14 * now[k].abs() / (h / 4.0);
            // At a corner the two sides differ.
            let corner = 0.1 * (high[k] - 2.0 * now[k] + low[k]).abs() / (h / 4.0);
            let error = (bc - ab).abs() + (c[k] - b[k]).abs() / 3.0 + rounding + corner;
            Difference { value: bc, error }
        })
        .collect()
}

/// A finding if a derivative disagrees with differences.
fn compare(what: &str, derivative: &[f64], found: &[Difference]) -> Option<Finding> {
    let largest =
        derivative.iter().fold(0.0f64, |m, d| if d.is_finite() { m.max(d.abs()) } else { m });
    for (row, (d, Difference { value, error })) in derivative.iter().zip(found).enumerate() {
        if !value.is_finite() || *error > 1e-3 * value.abs() + 1e-13 * largest {
            continue;
        }
        let allowed = 10.0 * error + 1e-6 * (d.abs() + value.abs()) + 1e-9 * largest;
        if d.is_nan() || (d - value).abs() > allowed {
            let detail = format!("{what}, row {row}: {d:e}, by differences {value:e} ± {error:e}");
            return Some(Finding::new("points", what, detail));
        }
    }
    None
}

fn column(pattern: &Pattern, values: &[f64], rows: usize, column: usize) -> Vec<f64> {
    let mut dense = vec![0.0; rows];
    for ((row, c), value) in pattern.positions().zip(values) {
        if c == column {
            dense[row] = *value;
        }
    }
    dense
}

pub(super) fn judge(_: &Case, prepared: &Prepared, findings: &mut Vec<Finding>) {
    let signature = prepared.signature();
    if !signature.varying_delays.is_empty() {
        return;
    }
    let system = &prepared.system;
    let mut random = Random::new(11);
    let (n, n_w) = (signature.unknowns.len(), signature.outputs.len());
    let n_s = signature.directions.len();
    let n_e = signature.discrete.transitions().count();
    let n_r: usize = signature.discrete.transitions().map(|(_, t)| t.resets.len()).sum();
    let n_c = signature.discrete.n_time_conditions;
    for at in places(prepared, &mut random) {
        let sizes = sizes(signature, &at.y);
        let f = |at: &At| {
            let mut f = vec![0.0; n + n_w];
            let (rows, outputs) = f.split_at_mut(n);
            system.rhs(at.point(), rows);
            system.outputs(at.point(), outputs);
            f
        };
        let events = |at: &At| {
            let (mut e, mut r) = (vec![0.0; n_e], vec![0.0; n_r]);
            let (mut times, mut after) = (vec![0.0; n_c], vec![0.0; n_c]);
            system.event_functions(at.point(), &mut e);
            system.resets(at.point(), &mut r);
            system.condition_times(at.point(), &mut times, &mut after);
            [e, r, times].concat()
        };
        let mut jacobian = vec![0.0; signature.jacobian.len()];
        let (mut rows, mut dfdt) = (vec![0.0; n], vec![0.0; n]);
        let udot = vec![0.0; signature.n_u()];
        system.linearize(at.point(), &udot, &mut rows, &mut jacobian, &mut dfdt);
        let [by_y, by_u, by_p] = &signature.output_jacobians;
        let (mut dwdy, mut dwdu) = (vec![0.0; by_y.len()], vec![0.0; by_u.len()]);
        let (mut dwdp, mut dwdt) = (vec![0.0; by_p.len()], vec![0.0; n_w]);
        system.output_jacobians(at.point(), &mut dwdy, &mut dwdu, &mut dwdp, &mut dwdt);
        for i in 0..n {
            let differences = difference(
                |dy| {
                    let mut moved = at.clone();
                    moved.y[i] += dy;
                    f(&moved)
                },
                sizes[i],
            );
            let analytic =
                [column(&signature.jacobian, &jacobian, n, i), column(by_y, &dwdy, n_w, i)];
            findings.extend(compare("df/dy", &analytic[0], &differences[..n]));
            findings.extend(compare("dw/dy", &analytic[1], &differences[n..]));
        }
        if n_c == 0 {
            let differences = difference(
                |dt| {
                    let mut moved = at.clone();
                    moved.t += dt;
                    f(&moved)
                },
                1.0,
            );
            let mut time_derivative = vec![0.0; n];
            system.time_derivative(at.point(), &mut time_derivative);
            findings.extend(compare("df/dt", &time_derivative, &differences[..n]));
            findings.extend(compare("dw/dt", &dwdt, &differences[n..]));
        }
        let n_u = signature.inputs.len() + signature.delayed_inputs.len();
        let mut input_jacobian = vec![0.0; signature.input_jacobian.len()];
        system.input_jacobian(at.point(), &mut input_jacobian);
        for k in 0..n_u {
            let size = if at.u[k] == 0.0 { 1.0 } else { at.u[k].abs() };
            let differences = difference(
                |du| {
                    let mut moved = at.clone();
                    moved.u[k] += du;
                    f(&moved)
                },
                size,
            );
            let analytic = [
                column(&signature.input_jacobian, &input_jacobian, n, k),
                column(by_u, &dwdu, n_w, k),
            ];
            findings.extend(compare("df/du", &analytic[0], &differences[..n]));
            findings.extend(compare("dw/du", &analytic[1], &differences[n..]));
        }
        // Along the directions, with sensitivities of the size of the unknowns.
        let mut s = vec![0.0; n * n_s];
        for (k, s) in s.iter_mut().enumerate() {
            let Direction::Parameter(p) = signature.directions[k / n] else { continue };
            let size = if at.p[p] == 0.0 { 1.0 } else { at.p[p].abs() };
            *s = random.between(-1.0, 1.0) * sizes[k % n] / size;
        }
        let (mut g, mut dw) = (vec![0.0; n * n_s], vec![0.0; n_w * n_s]);
        let mut w = vec![0.0; n_w];
        system.sensitivity_rhs(at.point(), &s, &mut rows, &mut g);
        system.output_sensitivities(at.point(), &s, &mut w, &mut dw);
        let mut dtimes = vec![0.0; n_c * n_s];
        let (mut dedt, mut drdt) = (vec![0.0; n_e], vec![0.0; n_r]);
        let discrete = &signature.discrete;
        let [by_y, by_theta] = [&discrete.event_jacobian, &discrete.event_directions];
        let (mut de, mut dedy) = (vec![0.0; by_theta.len()], vec![0.0; by_y.len()]);
        system.event_derivatives(at.point(), &udot, &mut de, &mut dedy, &mut dedt);
        let of_events = [(by_theta, de), (by_y, dedy)];
        let [by_y, by_theta] = [&discrete.reset_jacobian, &discrete.reset_directions];
        let (mut dr, mut drdy) = (vec![0.0; by_theta.len()], vec![0.0; by_y.len()]);
        system.reset_derivatives(at.point(), &udot, &mut dr, &mut drdy, &mut drdt);
        let of_resets = [(by_theta, dr), (by_y, drdy)];
        system.condition_time_sensitivities(at.point(), &mut dtimes);
        let (mut tau, mut dtau) =
            (vec![0.0; signature.delays.len()], vec![0.0; signature.delays.len() * n_s]);
        system.delays(at.point(), &mut tau);
        system.delay_sensitivities(at.point(), &mut dtau);
        let n_late = signature.delayed_inputs.len();
        for j in 0..n_s {
            let Direction::Parameter(p) = signature.directions[j] else { continue };
            let size = if at.p[p] == 0.0 { 1.0 } else { at.p[p].abs() };
            let moved = |d: f64| {
                let mut moved = at.clone();
                moved.p[p] += d;
                moved.y.iter_mut().zip(&s[j * n..]).for_each(|(y, s)| *y += s * d);
                for (k, late) in signature.delayed_inputs.iter().enumerate() {
                    let slope = at.u[signature.inputs.len() + n_late + k];
                    moved.u[signature.inputs.len() + k] -=
                        slope * dtau[j * signature.delays.len() + late.delay] * d;
                }
                moved
            };
            let differences = difference(|d| f(&moved(d)), size);
            findings.extend(compare("g", &g[j * n..(j + 1) * n], &differences[..n]));
            findings.extend(compare("dw/dθ", &dw[j * n_w..(j + 1) * n_w], &differences[n..]));
            let part = |matrix: &[f64], rows: usize| matrix[j * rows..(j + 1) * rows].to_vec();
            // ∂/∂θ + ∂/∂y S.
            let total = |[by_theta, by_y]: &[(&Pattern, Vec<f64>); 2], rows: usize| {
                let mut total = column(by_theta.0, &by_theta.1, rows, j);
                by_y.0.for_each(&by_y.1, |row, k, slope| total[row] += slope * s[j * n + k]);
                total
            };
            let analytic =
                [total(&of_events, n_e), total(&of_resets, n_r), part(&dtimes, n_c)].concat();
            let differences = difference(|d| events(&moved(d)), size);
            findings.extend(compare("de/dθ", &analytic, &differences));
        }
        if !findings.is_empty() {
            return;
        }
    }
}
