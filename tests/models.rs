//! Every model in `models/`, in every variant: its derivatives, and generated Rust against the
//! interpreter and against machine code made at run time.

mod support;

use std::cell::RefCell;
use std::path::Path;

use dgd_execute::InterpretedSystem;
use dgd_runtime::system::{DelayedUnknown, PastLayout};
use dgd_runtime::taylor::MOST_ORDER;
use dgd_runtime::{Direction, EvaluationPoint, Pattern, SolvableSystem, System, discrete_numbers};
use support::{
    Noise, bits_of, compiled, every_variant, input_values, interpreted, model_files, native,
};

/// A place at which a model is evaluated.
#[derive(Debug, Clone)]
struct At {
    t: f64,
    y: Vec<f64>,
    u: Vec<f64>,
    p: Vec<f64>,
    z: Vec<f64>,
}

/// Parameters beside what is declared, where a factor is often one.
const OFF: f64 = 1.01;

impl At {
    /// Near the start values, inputs of a few units, parameters near what is declared: zeros and ones
    /// are moved, so that no derivative is tested where a term vanishes by accident.
    fn near_start(system: &impl SolvableSystem, noise: &mut Noise) -> At {
        let signature = system.signature();
        let p: Vec<f64> = signature
            .parameters
            .iter()
            .map(|x| if x.value == 0.0 { 0.1 * x.unit.factor } else { OFF * x.value })
            .collect();
        let noise = RefCell::new(noise);
        let u = input_values(
            signature,
            |_, x| x.unit.offset + x.unit.factor * (20.0 + 2.0 * noise.borrow_mut().next()),
            |_, x| x.unit.factor * noise.borrow_mut().next(),
        );
        let noise = noise.into_inner();
        let mut y = vec![0.0; signature.unknowns.len()];
        let z = discrete_numbers(system, &p, 0.3);
        system.start(EvaluationPoint { t: 0.0, y: &[], u: &u, p: &p, z: &z }, &mut y);
        for (y, unknown) in y.iter_mut().zip(signature.unknowns.iter()) {
            let size = unknown.nominal.unwrap_or(if *y == 0.0 { unknown.unit.factor } else { *y });
            *y += 0.05 * size.abs() * (1.5 + 0.5 * noise.next());
        }
        At { t: 0.3, y, u, p, z }
    }

    fn point(&self) -> EvaluationPoint<'_> {
        EvaluationPoint { t: self.t, y: &self.y, u: &self.u, p: &self.p, z: &self.z }
    }
}

/// When each delayed unknown is looked up.
fn looked_up(system: &impl SolvableSystem, at: &At) -> Vec<f64> {
    let signature = system.signature();
    let mut tau = vec![0.0; signature.delays.len()];
    let mut varying = vec![0.0; signature.varying_delays.len()];
    system.delays(at.point(), &mut tau);
    system.varying_delays(at.point(), &mut varying);
    let tau =
        |read: &DelayedUnknown| if read.varies { varying[read.delay] } else { tau[read.delay] };
    signature.delayed_unknowns.iter().map(|read| at.t - tau(read)).collect()
}

/// A place that was moved, with what is known of delayed unknowns moved to where they are looked up
/// there.
fn followed(system: &impl SolvableSystem, from: &At, mut moved: At) -> At {
    let PastLayout { first, n_v, n_s } = system.signature().past();
    let times = looked_up(system, from).into_iter().zip(looked_up(system, &moved));
    let u = &mut moved.u[first..];
    for (k, (before, after)) in times.enumerate() {
        let dt = after - before;
        let [value, rate, curvature] = [1, 2, 3].map(|row| row * n_v + k);
        u[value] += (u[rate] + 0.5 * u[curvature] * dt) * dt;
        u[rate] += u[curvature] * dt;
        for j in 0..n_s {
            u[(4 + j) * n_v + k] += u[(4 + n_s + j) * n_v + k] * dt;
        }
    }
    moved
}

/// A derivative found by differences.
#[derive(Clone, Copy)]
struct Difference {
    value: f64,
    /// What the extrapolation estimates its error to be.
    error: f64,
    /// What rounding of the function alone can do to it.
    rounding: f64,
}

/// dF/dx at x by Ridders' extrapolation of central differences (Adv. Eng. Softw. 4 (1982) 75–76).
fn difference(f: &dyn Fn(f64) -> Vec<f64>, x: f64, size: f64) -> Vec<Difference> {
    const ROWS: usize = 10;
    let mut h = 0.02 * size;
    let central = |h: f64| -> Vec<f64> {
        f(x + h).iter().zip(f(x - h)).map(|(high, low)| (high - low) / (2.0 * h)).collect()
    };
    let mut table: Vec<Vec<Vec<f64>>> = vec![vec![central(h)]];
    let n = table[0][0].len();
    let mut best = vec![Difference { value: f64::NAN, error: f64::INFINITY, rounding: 0.0 }; n];
    for row in 1..ROWS {
        h /= 1.5;
        let mut entries = vec![central(h)];
        let mut factor = 1.5f64 * 1.5;
        for column in 1..=row {
            let entry: Vec<f64> = (0..n)
                .map(|k| {
                    (entries[column - 1][k] * factor - table[row - 1][column - 1][k])
                        / (factor - 1.0)
                })
                .collect();
            for k in 0..n {
                let error = (entry[k] - entries[column - 1][k])
                    .abs()
                    .max((entry[k] - table[row - 1][column - 1][k]).abs());
                if error < best[k].error {
                    best[k] = Difference { value: entry[k], error, rounding: 0.0 };
                }
            }
            entries.push(entry);
            factor *= 1.5 * 1.5;
        }
        table.push(entries);
    }
    // The smallest step's difference, with ten roundings for what cancels inside the function.
    for (best, value) in best.iter_mut().zip(f(x)) {
        best.rounding = 10.0 * f64::EPSILON * value.abs() / h;
    }
    best
}

/// Compares one column of derivatives with differences.
fn compare(what: &str, derivative: &[f64], difference: &[Difference]) {
    assert_eq!(derivative.len(), difference.len(), "{what}");
    let largest = derivative.iter().fold(0.0f64, |largest, d| largest.max(d.abs()));
    for (row, (d, found)) in derivative.iter().zip(difference).enumerate() {
        let Difference { value, error, rounding } = found;
        // The extrapolation's own estimate with a factor for its optimism, and 1e-7 for the
        // rounding of differences of functions that cancel.
        let allowed = 10.0 * error + rounding + 1e-7 * d.abs();
        assert!(
            (d - value).abs() <= allowed,
            "{what}, row {row}: derivative {d:e}, difference {value:e} ± {error:e}"
        );
        assert!(
            *error <= (1e-5 * largest).max(*rounding),
            "{what}, row {row}: the difference is unsure, {error:e}"
        );
    }
}

fn dense(pattern: &Pattern, values: &[f64], rows: usize, column: usize) -> Vec<f64> {
    let mut dense = vec![0.0; rows];
    for ((row, c), value) in pattern.positions().zip(values) {
        if c == column {
            dense[row] = *value;
        }
    }
    dense
}

/// A matrix by its non-zeros.
type Matrix<'a> = (&'a Pattern, &'a [f64]);

/// The numbers of a place that are moved.
type Moved = fn(&mut At) -> &mut Vec<f64>;

/// Every derivative of a system at a point against differences of what it is the derivative of.
fn check_derivatives(system: &InterpretedSystem, at: &At, label: &str) {
    let signature = system.signature().clone();
    let (n, n_w) = (signature.unknowns.len(), signature.outputs.len());
    let (n_u, n_s) = (signature.n_u(), signature.directions.len());
    let (n_tau, n_late) = (signature.delays.len(), signature.delayed_inputs.len());
    let late = signature.inputs.len();
    let size = |value: f64| if value == 0.0 { 1.0 } else { value.abs() };
    let moved_parameter = |j: usize| match signature.directions[j] {
        Direction::Parameter(position) => position,
        Direction::Start(_) => unreachable!("the models are compiled with their parameters only"),
    };
    let f = |at: &At| {
        let mut f = vec![0.0; n];
        system.rhs(at.point(), &mut f);
        f
    };
    let w = |at: &At| {
        let mut w = vec![0.0; n_w];
        system.outputs(at.point(), &mut w);
        w
    };
    assert!(f(at).iter().chain(&w(at)).all(|x| x.is_finite()), "{label}: finite at {:?}", at.y);

    let mut jacobian = vec![0.0; signature.jacobian.len()];
    let mut dfdt = vec![0.0; n];
    let mut noise = Noise::new(5);
    let mut udot: Vec<f64> = at.u.iter().map(|u| 0.01 * size(*u) * noise.next()).collect();
    // Slopes of delayed inputs are inputs that do not change between the points where inputs kink.
    udot[late + n_late..].fill(0.0);
    let past = signature.past();
    system.linearize(at.point(), &udot, &mut vec![0.0; n], &mut jacobian, &mut dfdt);
    let [by_y, by_u, by_p] = &signature.output_jacobians;
    let (mut dwdy, mut dwdu) = (vec![0.0; by_y.len()], vec![0.0; by_u.len()]);
    let (mut dwdp, mut dwdt) = (vec![0.0; by_p.len()], vec![0.0; n_w]);
    system.output_jacobians(at.point(), &mut dwdy, &mut dwdu, &mut dwdp, &mut dwdt);

    let mut parameter_jacobian = vec![0.0; signature.parameter_jacobian.len()];
    system.parameter_jacobian(at.point(), &mut parameter_jacobian);
    let mut input_jacobian = vec![0.0; signature.input_jacobian.len()];
    system.input_jacobian(at.point(), &mut input_jacobian);
    let cases: [(&str, Moved, [Matrix<'_>; 2]); 3] = [
        ("y", |at| &mut at.y, [(&signature.jacobian, &jacobian), (by_y, &dwdy)]),
        ("u", |at| &mut at.u, [(&signature.input_jacobian, &input_jacobian), (by_u, &dwdu)]),
        (
            "p",
            |at| &mut at.p,
            [(&signature.parameter_jacobian, &parameter_jacobian), (by_p, &dwdp)],
        ),
    ];
    for (array, moved, [(f_pattern, f_values), (w_pattern, w_values)]) in cases {
        for column in 0..moved(&mut at.clone()).len() {
            let x = moved(&mut at.clone())[column];
            let shifted = |x: f64| {
                let mut shifted = at.clone();
                moved(&mut shifted)[column] = x;
                // Derivatives to y are those of the whole, to u and p those where u is fixed.
                if array == "y" { followed(system, at, shifted) } else { shifted }
            };
            let what = |of: &str| format!("{label}: d{of}/d{array}[{column}]");
            let found = difference(&|x| f(&shifted(x)), x, size(x));
            compare(&what("f"), &dense(f_pattern, f_values, n, column), &found);
            let found = difference(&|x| w(&shifted(x)), x, size(x));
            compare(&what("w"), &dense(w_pattern, w_values, n_w, column), &found);
        }
    }

    // Along time, with the inputs moving.
    let moving = |dt: f64, udot: &[f64]| {
        let mut at = at.clone();
        at.t += dt;
        at.u.iter_mut().zip(udot).for_each(|(u, udot)| *u += udot * dt);
        at
    };
    let moving_on = |dt: f64| {
        let moved = moving(dt, &udot);
        followed(system, at, moved)
    };
    let still = vec![0.0; n_u];
    let mut time_derivative = vec![0.0; n];
    system.time_derivative(at.point(), &mut time_derivative);
    compare(
        &format!("{label}: df/dt"),
        &time_derivative,
        &difference(&|dt| f(&moving(dt, &still)), 0.0, 1.0),
    );
    compare(
        &format!("{label}: df/dt along the inputs"),
        &dfdt,
        &difference(&|dt| f(&moving_on(dt)), 0.0, 1.0),
    );
    compare(&format!("{label}: dw/dt"), &dwdt, &difference(&|dt| w(&moving(dt, &still)), 0.0, 1.0));

    let tau = |at: &At| {
        let mut tau = vec![0.0; n_tau];
        system.delays(at.point(), &mut tau);
        tau
    };
    let mut dtau = vec![0.0; n_tau * n_s];
    system.delay_sensitivities(at.point(), &mut dtau);
    // Inputs depend on θ: v(t) = u(t − τ) has ∂v/∂θ = −v̇ ∂τ/∂θ; a late unknown depends on
    // Also θ itself.
    let move_inputs = |at: &mut At, j: usize, step: f64| {
        for (position, input) in signature.delayed_inputs.iter().enumerate() {
            let slope = at.u[late + n_late + position];
            at.u[late + position] -= slope * dtau[j * n_tau + input.delay] * step;
        }
        for k in 0..past.n_v {
            let number = |row: usize| past.first + row * past.n_v + k;
            at.u[number(1)] += at.u[number(4 + j)] * step;
        }
    };

    // g = df/dy S + df/dθ is the derivative of f along (S_j, e_j); the same of w.
    let s: Vec<f64> = (0..n * n_s).map(|k| size(at.y[k % n]) * noise.next()).collect();
    let along = |j: usize, dx: f64| {
        let mut moved = at.clone();
        let parameter = moved_parameter(j);
        let step = size(at.p[parameter]);
        moved.p[parameter] += step * dx;
        moved.y.iter_mut().zip(&s[j * n..]).for_each(|(y, s)| *y += s * dx);
        let mut moved = followed(system, at, moved);
        move_inputs(&mut moved, j, step * dx);
        moved
    };
    // Sensitivities are per unit of θ; here θ moves by its size, so S is S θ.
    let unscaled: Vec<f64> =
        (0..n * n_s).map(|k| s[k] / size(at.p[moved_parameter(k / n)])).collect();
    let g_at = |at: &At| {
        let (mut f, mut g) = (vec![0.0; n], vec![0.0; n * n_s]);
        system.sensitivity_rhs(at.point(), &unscaled, &mut f, &mut g);
        g
    };
    let g = g_at(at);
    let (mut w_now, mut dw) = (vec![0.0; n_w], vec![0.0; n_w * n_s]);
    system.output_sensitivities(at.point(), &unscaled, &mut w_now, &mut dw);
    assert_eq!(w_now, w(at), "{label}: outputs with and without sensitivities");
    for j in 0..n_s {
        let step = size(at.p[moved_parameter(j)]);
        let scaled = |values: &[f64]| values.iter().map(|v| v * step).collect::<Vec<f64>>();
        let found = difference(&|dx| f(&along(j, dx)), 0.0, 1.0);
        compare(&format!("{label}: g, direction {j}"), &scaled(&g[j * n..(j + 1) * n]), &found);
        let found = difference(&|dx| w(&along(j, dx)), 0.0, 1.0);
        let columns = scaled(&dw[j * n_w..(j + 1) * n_w]);
        compare(&format!("{label}: dw, direction {j}"), &columns, &found);
    }

    // dg/dy and dg/dt, and the fused function against its parts.
    let mut dgdy = vec![0.0; signature.sensitivity_jacobian.len()];
    let (mut f2, mut j2) = (vec![0.0; n], vec![0.0; jacobian.len()]);
    let (mut dfdt2, mut g2, mut dgdt) = (vec![0.0; n], vec![0.0; n * n_s], vec![0.0; n * n_s]);
    system.sensitivity_linearize(
        at.point(),
        &udot,
        &unscaled,
        &mut f2,
        &mut j2,
        &mut dfdt2,
        &mut g2,
        &mut dgdy,
        &mut dgdt,
    );
    assert_eq!((&f2, &j2, &dfdt2, &g2), (&f(at), &jacobian, &dfdt, &g), "{label}: fused");
    for column in 0..n {
        let shifted = |x: f64| {
            let mut shifted = at.clone();
            shifted.y[column] = x;
            followed(system, at, shifted)
        };
        let found = difference(&|x| g_at(&shifted(x)), at.y[column], size(at.y[column]));
        let derivative = dense(&signature.sensitivity_jacobian, &dgdy, n * n_s, column);
        compare(&format!("{label}: dg/dy[{column}]"), &derivative, &found);
    }
    let found = difference(&|dt| g_at(&moving_on(dt)), 0.0, 1.0);
    compare(&format!("{label}: dg/dt"), &dgdt, &found);

    // Start values.
    let y0 = |at: &At| {
        let mut y = vec![0.0; n];
        system.start(at.point(), &mut y);
        y
    };
    let mut s0 = vec![0.0; n * n_s];
    system.start_sensitivities(at.point(), &mut s0);
    for j in 0..n_s {
        let parameter = moved_parameter(j);
        let shifted = |x: f64| {
            let mut at = at.clone();
            let step = x - at.p[parameter];
            at.p[parameter] = x;
            move_inputs(&mut at, j, step);
            at
        };
        let found = difference(&|x| tau(&shifted(x)), at.p[parameter], size(at.p[parameter]));
        let column = &dtau[j * n_tau..(j + 1) * n_tau];
        compare(&format!("{label}: dtau, direction {j}"), column, &found);
        let found = difference(&|x| y0(&shifted(x)), at.p[parameter], size(at.p[parameter]));
        compare(&format!("{label}: dy0, direction {j}"), &s0[j * n..(j + 1) * n], &found);
    }
}

/// The same place in every mode of every automaton, and with every condition on time switched.
fn in_every_mode(system: &InterpretedSystem, at: &At) -> Vec<At> {
    let discrete = &system.signature().discrete;
    let conditions = std::iter::repeat_n(2, discrete.n_time_conditions);
    let sizes = discrete.automata.iter().map(|a| a.modes.len()).chain(conditions);
    let mut places = vec![at.clone()];
    for (k, size) in sizes.enumerate() {
        for value in 0..size {
            let mut place = at.clone();
            place.z[k] = value as f64;
            places.push(place);
        }
    }
    places
}

#[test]
fn derivatives_of_every_model_agree_with_differences() {
    for path in model_files() {
        for choices in every_variant(&path) {
            let choices: Vec<(&str, &str)> =
                choices.iter().map(|(v, c)| (v.as_str(), c.as_str())).collect();
            let system = InterpretedSystem::new(compiled(&path, &choices).program);
            let mut noise = Noise::new(11);
            for _ in 0..3 {
                let at = At::near_start(&system, &mut noise);
                let label = format!("{} {choices:?}", path.display());
                for at in in_every_mode(&system, &at) {
                    check_derivatives(&system, &at, &label);
                    check_event_derivatives(&system, &at, &label);
                }
            }
        }
    }
}

/// Event functions, resets and times of conditions against differences, with `s` as sensitivities.
fn check_event_derivatives(system: &InterpretedSystem, at: &At, label: &str) {
    let signature = system.signature().clone();
    let discrete = &signature.discrete;
    let (n, n_s) = (signature.unknowns.len(), signature.directions.len());
    let n_e = discrete.transitions().count();
    let n_r: usize = discrete.transitions().map(|(_, t)| t.resets.len()).sum();
    let n_c = discrete.n_time_conditions;
    let size = |value: f64| if value == 0.0 { 1.0 } else { value.abs() };
    let mut noise = Noise::new(7);
    let mut udot: Vec<f64> = at.u.iter().map(|u| 0.01 * size(*u) * noise.next()).collect();
    // Slopes of inputs, behind the inputs, are constant; what is known of the past has its own.
    udot[signature.inputs.len() + signature.delayed_inputs.len()..].fill(0.0);
    // As large as y is for each direction's own size: a step of a parameter of 1e9 by a part of it is
    // not to move y by 1e6 times itself.
    let own_size = |direction: &Direction| match *direction {
        Direction::Parameter(p) => size(at.p[p]),
        Direction::Start(_) => 1.0,
    };
    let s: Vec<f64> = (0..n * n_s)
        .map(|k| size(at.y[k % n]) / own_size(&signature.directions[k / n]) * noise.next())
        .collect();

    let values = |at: &At| {
        let (mut e, mut r) = (vec![0.0; n_e], vec![0.0; n_r]);
        let (mut times, mut after) = (vec![0.0; n_c], vec![0.0; n_c]);
        system.event_functions(at.point(), &mut e);
        system.resets(at.point(), &mut r);
        system.condition_times(at.point(), &mut times, &mut after);
        [e, r, times].concat()
    };
    let mut dtimes = vec![0.0; n_c * n_s];
    let (mut de, mut dr) =
        (vec![0.0; discrete.event_directions.len()], vec![0.0; discrete.reset_directions.len()]);
    let (mut dedy, mut drdy) =
        (vec![0.0; discrete.event_jacobian.len()], vec![0.0; discrete.reset_jacobian.len()]);
    let (mut dedt, mut drdt) = (vec![0.0; n_e], vec![0.0; n_r]);
    system.event_derivatives(at.point(), &udot, &mut de, &mut dedy, &mut dedt);
    system.reset_derivatives(at.point(), &udot, &mut dr, &mut drdy, &mut drdt);
    // ∂/∂θ + ∂/∂y S.
    let total = |by_theta: (&Pattern, &[f64]), by_y: (&Pattern, &[f64]), rows: usize, j: usize| {
        let mut total = dense(by_theta.0, by_theta.1, rows, j);
        by_y.0.for_each(by_y.1, |row, k, slope| total[row] += slope * s[j * n + k]);
        total
    };
    system.condition_time_sensitivities(at.point(), &mut dtimes);

    for j in 0..n_s {
        let Direction::Parameter(p) = signature.directions[j] else { continue };
        let moved = |step: f64| {
            let mut moved = at.clone();
            moved.p[p] += step;
            moved.y.iter_mut().zip(&s[j * n..]).for_each(|(y, s)| *y += s * step);
            values(&followed(system, at, moved))
        };
        let found = difference(&moved, 0.0, 0.01 * size(at.p[p]));
        let column = |matrix: &[f64], rows: usize| matrix[j * rows..(j + 1) * rows].to_vec();
        let of_events =
            total((&discrete.event_directions, &de), (&discrete.event_jacobian, &dedy), n_e, j);
        let of_resets =
            total((&discrete.reset_directions, &dr), (&discrete.reset_jacobian, &drdy), n_r, j);
        let columns = [of_events, of_resets, column(&dtimes, n_c)].concat();
        compare(&format!("{label}: events, direction {j}"), &columns, &found);
    }
    for i in 0..n {
        let moved = |step: f64| {
            let mut moved = at.clone();
            moved.y[i] += step;
            values(&followed(system, at, moved))
        };
        let columns = [
            dense(&discrete.event_jacobian, &dedy, n_e, i),
            dense(&discrete.reset_jacobian, &drdy, n_r, i),
            vec![0.0; n_c],
        ];
        let found = difference(&moved, 0.0, size(at.y[i]));
        compare(&format!("{label}: events, y[{i}]"), &columns.concat(), &found);
    }
    let moved = |step: f64| {
        let mut moved = at.clone();
        moved.t += step;
        moved.u.iter_mut().zip(&udot).for_each(|(u, udot)| *u += udot * step);
        values(&followed(system, at, moved))
    };
    let found = difference(&moved, 0.0, 1.0);
    compare(&format!("{label}: events, t"), &[dedt, drdt, vec![0.0; n_c]].concat(), &found);
}

/// Bits of everything that a system computes at a place.
fn bits(system: &impl SolvableSystem, at: &At) -> Vec<Vec<u64>> {
    let signature = system.signature();
    let (n, n_w) = (signature.unknowns.len(), signature.outputs.len());
    let (n_s, n_j) = (signature.directions.len(), signature.jacobian.len());
    let numbers = |n: usize| vec![0.0; n];
    let mut noise = Noise::new(23);
    let udot: Vec<f64> = at.u.iter().map(|u| u * noise.next()).collect();
    let s: Vec<f64> = (0..n * n_s).map(|_| noise.next()).collect();
    let point = at.point();
    let mut all: Vec<Vec<f64>> = Vec::new();

    let mut f = numbers(n);
    system.rhs(point, &mut f);
    all.push(f.clone());
    let (mut jacobian, mut dfdt) = (numbers(n_j), numbers(n));
    system.linearize(point, &udot, &mut f, &mut jacobian, &mut dfdt);
    all.extend([f.clone(), jacobian.clone(), dfdt.clone()]);
    let mut g = numbers(n * n_s);
    system.sensitivity_rhs(point, &s, &mut f, &mut g);
    all.extend([f.clone(), g.clone()]);
    let (mut dgdy, mut dgdt) = (numbers(signature.sensitivity_jacobian.len()), numbers(n * n_s));
    system.sensitivity_linearize(
        point,
        &udot,
        &s,
        &mut f,
        &mut jacobian,
        &mut dfdt,
        &mut g,
        &mut dgdy,
        &mut dgdt,
    );
    all.extend([f, jacobian, dfdt, g, dgdy, dgdt]);
    let mut values = numbers(signature.parameter_jacobian.len());
    system.parameter_jacobian(point, &mut values);
    all.push(values);
    let mut values = numbers(signature.input_jacobian.len());
    system.input_jacobian(point, &mut values);
    all.push(values);
    let mut values = numbers(n);
    system.time_derivative(point, &mut values);
    all.push(values);
    let [by_y, by_u, by_p] = &signature.output_jacobians;
    let (mut dwdy, mut dwdu) = (numbers(by_y.len()), numbers(by_u.len()));
    let (mut dwdp, mut dwdt) = (numbers(by_p.len()), numbers(n_w));
    system.output_jacobians(point, &mut dwdy, &mut dwdu, &mut dwdp, &mut dwdt);
    let (mut w, mut dw) = (numbers(n_w), numbers(n_w * n_s));
    system.outputs(point, &mut w);
    all.extend([dwdy, dwdu, dwdp, dwdt, w.clone()]);
    system.output_sensitivities(point, &s, &mut w, &mut dw);
    let (mut y0, mut s0) = (numbers(n), numbers(n * n_s));
    system.start(point, &mut y0);
    system.start_sensitivities(point, &mut s0);
    let mut tau = numbers(signature.delays.len());
    let mut dtau = numbers(signature.delays.len() * n_s);
    system.delays(point, &mut tau);
    system.delay_sensitivities(point, &mut dtau);
    all.extend([w, dw, y0, s0, tau, dtau]);
    let n_starts = signature.start_equations.len();
    let (mut rest, mut drest) = (numbers(n_starts), numbers(n_starts * n_s));
    let mut drestdy = numbers(n_starts * n);
    system.start_equations(point, &mut rest);
    system.start_equation_sensitivities(point, &s, &mut drest, &mut drestdy);
    all.extend([rest, drest, drestdy]);
    let n_v = signature.delayed_unknowns.len();
    let (mut x, mut rate, mut curvature) = (numbers(n_v), numbers(n_v), numbers(n_v));
    system.histories(point, &mut x, &mut rate, &mut curvature);
    let (mut past_s, mut s_rate) = (numbers(n_v * n_s), numbers(n_v * n_s));
    system.history_sensitivities(point, &mut past_s, &mut s_rate);
    all.extend([x, rate, curvature, past_s, s_rate]);
    let n_tau = signature.varying_delays.len();
    let (mut tau, mut dtau) = (numbers(n_tau), numbers(n_tau * n_s));
    let (mut dtaudy, mut dtaudt) = (numbers(n_tau * n), numbers(n_tau));
    system.varying_delays(point, &mut tau);
    system.varying_delay_sensitivities(point, &udot, &s, &mut dtau, &mut dtaudy, &mut dtaudt);
    all.extend([tau, dtau, dtaudy, dtaudt]);

    let discrete = &signature.discrete;
    let (n_e, n_c) = (discrete.transitions().count(), discrete.n_time_conditions);
    let n_r: usize = discrete.transitions().map(|(_, t)| t.resets.len()).sum();
    let (mut mass, mut e, mut r) = (numbers(n), numbers(n_e), numbers(n_r));
    let (mut times, mut after, mut dtimes) = (numbers(n_c), numbers(n_c), numbers(n_c * n_s));
    system.mass(point, &mut mass);
    system.event_functions(point, &mut e);
    system.resets(point, &mut r);
    system.condition_times(point, &mut times, &mut after);
    system.condition_time_sensitivities(point, &mut dtimes);
    all.extend([mass, e, r, times, after, dtimes]);
    let (mut de, mut dedt) = (numbers(discrete.event_directions.len()), numbers(n_e));
    let mut dedy = numbers(discrete.event_jacobian.len());
    system.event_derivatives(point, &udot, &mut de, &mut dedy, &mut dedt);
    let (mut dr, mut drdt) = (numbers(discrete.reset_directions.len()), numbers(n_r));
    let mut drdy = numbers(discrete.reset_jacobian.len());
    system.reset_derivatives(point, &udot, &mut dr, &mut drdy, &mut drdt);
    all.extend([de, dedy, dedt, dr, drdy, drdt]);
    let (n_h, n_single) = (discrete.jump_jacobian.len(), signature.unknowns.single.len());
    if n_h > 0 {
        let (mut kinds, mut rests, mut h) = (numbers(n_single), numbers(n_single), numbers(n_h));
        system.jumps(point, &mut kinds, &mut rests, &mut h);
        let (mut drests, mut drestsdt) = (numbers(n_single * n_s), numbers(n_single));
        let (mut dh, mut dhdt) = (numbers(n_h * n_s), numbers(n_h));
        system.jump_sensitivities(point, &udot, &s, &mut drests, &mut drestsdt, &mut dh, &mut dhdt);
        all.extend([kinds, rests, h, drests, drestsdt, dh, dhdt]);
    }
    if let Ok(kept) = system.taylor_series() {
        const ORDER: usize = 12;
        let terms = vec![[0.0; MOST_ORDER + 1]; kept.unknowns.max(kept.sensitivities)];
        let (mut y, mut s_series) = (numbers((ORDER + 1) * n), numbers((ORDER + 1) * n * n_s));
        system.taylor(point, &udot, 0.01, ORDER, &mut terms.clone(), &mut y);
        all.push(y.clone());
        if n_s > 0 {
            s_series[..n * n_s].copy_from_slice(&s);
            let kept = &mut terms.clone();
            system.sensitivity_taylor(point, &udot, 0.01, ORDER, kept, &mut y, &mut s_series);
            all.extend([y, s_series]);
        }
    }
    all.iter().map(|values| values.iter().map(|x| bits_of(*x)).collect()).collect()
}

/// Numbers at which functions do something special.
const SPECIAL: [f64; 8] =
    [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -0.0, f64::MIN_POSITIVE, 1e-310, -1e300];

/// The same place with one number of each array replaced by a special one.
fn special_places(at: &At) -> Vec<At> {
    let arrays: [Moved; 3] = [|at| &mut at.y, |at| &mut at.u, |at| &mut at.p];
    let mut places = Vec::new();
    for moved in arrays {
        for k in 0..moved(&mut at.clone()).len() {
            for special in SPECIAL {
                let mut place = at.clone();
                moved(&mut place)[k] = special;
                places.push(place);
            }
        }
    }
    places
}

/// Generated Rust, the interpreter and native code give the same signature and the same bits.
fn check_agreement(generated: &impl SolvableSystem, path: &str, choices: &[(&str, &str)]) {
    let interpreted = interpreted(path, choices);
    let native = native(path, choices);
    assert_eq!(generated.signature(), interpreted.signature(), "{path} {choices:?}");
    assert_eq!(native.signature(), interpreted.signature(), "{path} {choices:?}");
    let check = |at: &At| {
        let expected = bits(&interpreted, at);
        let label = || format!("{path} {choices:?} at {at:?}");
        assert_eq!(bits(generated, at), expected, "generated: {}", label());
        assert_eq!(bits(&native, at), expected, "native: {}", label());
    };
    assert_eq!(generated.taylor_series(), interpreted.taylor_series(), "{path} {choices:?}");
    let mut noise = Noise::new(17);
    for round in 0..20 {
        let at = At::near_start(&interpreted, &mut noise);
        for at in in_every_mode(&interpreted, &at) {
            check(&at);
            if round == 0 {
                special_places(&at).iter().for_each(check);
            }
        }
    }
}

/// A name with the points in it, as text.
macro_rules! dotted {
    ($first:ident $(. $rest:ident)*) => { concat!(stringify!($first) $(, ".", stringify!($rest))*) };
}

/// Compiles each model of the list with `dgd::model!` and compares it with the interpreter and with
/// native code.
macro_rules! agreement {
    ($($name:ident: $path:literal $(, $($variant:ident).+ = $choice:ident)*;)*) => {
        $(mod $name {
            dgd::model!($path $(, $($variant).+ = $choice)*, as generated);
        })*

        const COMPARED: &[(&str, &[(&str, &str)])] =
            &[$(($path, &[$((dotted!($($variant).+), stringify!($choice))),*])),*];

        #[test]
        fn generated_rust_interpreter_and_native_code_give_the_same_bits() {
            $(check_agreement(
                &$name::generated::Model,
                $path,
                &[$((dotted!($($variant).+), stringify!($choice))),*],
            );)*
        }
    };
}

agreement! {
    battery_pack: "models/battery_pack.dgd";
    bench_two_state: "models/bench_two_state.dgd";
    bench_two_state_static: "models/bench_two_state.dgd", flow = static;
    booster_line: "models/booster_line.dgd";
    booster_line_sealed: "models/booster_line.dgd", top = sealed;
    chemical_akzo_nobel: "models/test_set/chemical_akzo_nobel.dgd";
    chemostat: "models/chemostat.dgd";
    compartments: "models/compartments.dgd";
    controlled_level: "models/controlled_level.dgd";
    cstr: "models/cstr.dgd";
    delayed_sensor: "models/delayed_sensor.dgd";
    dragged_load: "models/dragged_load.dgd";
    dual_gradient_drilling: "models/dual_gradient_drilling.dgd";
    dual_gradient_drilling_static: "models/dual_gradient_drilling.dgd", line.flow = static;
    every_intrinsic: "models/every_intrinsic.dgd";
    filling_pump: "models/filling_pump.dgd";
    friction: "models/friction.dgd";
    heated_plate: "models/heated_plate.dgd";
    heated_rooms: "models/heated_rooms.dgd";
    heating_main: "models/heating_main.dgd";
    hires: "models/test_set/hires.dgd";
    lines_of_the_well: "models/lines_of_the_well.dgd";
    medical_akzo_nobel: "models/medical_akzo_nobel.dgd";
    more_intrinsics: "models/more_intrinsics.dgd";
    mud_circulation: "models/mud_circulation.dgd";
    mud_circulation_static: "models/mud_circulation.dgd", flow = static;
    mud_circulation_by_level: "models/mud_circulation.dgd", inertia = by_level;
    mud_circulation_u_tubing: "models/mud_circulation_u_tubing.dgd";
    mud_circulation_u_tubing_static: "models/mud_circulation_u_tubing.dgd", flow = static;
    mud_circulation_u_tubing_by_level: "models/mud_circulation_u_tubing.dgd", inertia = by_level;
    night_setback: "models/night_setback.dgd";
    oregonator: "models/test_set/oregonator.dgd";
    pack_of_cells: "models/pack_of_cells.dgd";
    pendulum: "models/pendulum.dgd";
    pendulum_cartesian: "models/pendulum_cartesian.dgd";
    rigid_tanks: "models/rigid_tanks.dgd";
    pipe_flow: "models/pipe_flow.dgd";
    pollution: "models/test_set/pollution.dgd";
    predator_prey: "models/predator_prey.dgd";
    pump_speed_step: "models/pump_speed_step.dgd";
    pump_speed_step_static: "models/pump_speed_step.dgd", flow = static;
    rc_circuit: "models/rc_circuit.dgd";
    remote_level: "models/remote_level.dgd";
    repeated_doses: "models/repeated_doses.dgd";
    rested_cell: "models/rested_cell.dgd";
    robertson: "models/robertson.dgd";
    robertson_dae: "models/robertson.dgd", form = dae;
    sampled_level: "models/sampled_level.dgd";
    subsea_pump: "models/subsea_pump.dgd";
    subsea_pump_power: "models/subsea_pump.dgd", pump.law = power;
    subsea_pump_theory: "models/subsea_pump.dgd", pump.law = theory;
    tank_with_weir: "models/tank_with_weir.dgd";
    transmission_line: "models/transmission_line.dgd";
    transmission_line_quadratic: "models/transmission_line.dgd", friction = quadratic;
    transmission_line_inlet: "models/transmission_line.dgd", inlet = pressure;
    transmission_line_outlet: "models/transmission_line.dgd", outlet = flow;
    transistor_amplifier: "models/test_set/transistor_amplifier.dgd";
    tube_passes: "models/tube_passes.dgd";
    two_tanks: "models/two_tanks.dgd";
    u_tube_drill_string: "models/u_tube_drill_string.dgd";
    van_der_pol: "models/van_der_pol.dgd";
}

/// Every model is in the list, with each of its own choices; a choice of a part is one in some model that
/// has the part.
#[test]
fn the_list_of_compared_models_is_complete() {
    let own_name = |variant: &str| variant.rsplit('.').next().unwrap_or(variant).to_owned();
    for path in model_files() {
        let file = path.file_name().expect("a file").to_string_lossy().into_owned();
        for choices in every_variant(&path) {
            let compared = COMPARED.iter().any(|(compared, compared_choices)| {
                let same_file =
                    Path::new(compared).file_name().is_some_and(|name| name == file.as_str());
                let of_part = choices.iter().any(|(variant, _)| variant.contains('.'));
                compared_choices.len() == choices.len()
                    && compared_choices.iter().zip(&choices).all(|((v, c), (v2, c2))| {
                        if of_part { own_name(v) == own_name(v2) } else { v == v2 && c == c2 }
                    })
                    && (same_file || of_part)
            });
            assert!(compared, "`{file}` {choices:?} is missing in the list of `agreement!`");
        }
    }
}
