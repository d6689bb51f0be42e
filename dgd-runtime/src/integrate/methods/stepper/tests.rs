//! Orders, measured with equal steps and without error control.

use super::*;
use crate::codegen::taylor::MOST_ORDER;
use crate::integrate::methods::catalogue::METHODS;
use crate::signal::LimitSide;
use crate::system::Signature;
use crate::{Inputs, Problem, System};
use support::problems::{Logistic, LogisticDae};
use support::{Equations, Heaped, parameters};

#[path = "../../../../tests/support/mod.rs"]
mod support;

/// Unknowns, then sensitivities, at t.
type Exact = fn(f64) -> Vec<f64>;

fn logistic(t: f64) -> Vec<f64> {
    Logistic::solution(t, &parameters::<Logistic>()).to_vec()
}

fn algebraic(t: f64) -> Vec<f64> {
    let (y, s) = LogisticDae::solution(t, &parameters::<LogisticDae>());
    y.into_iter().chain(s).collect()
}

/// Slopes from differences at a distance δ. Their error is δ⁴/30 times a fifth derivative of a few units, plus ε/δ.
fn slopes(exact: Exact, t: f64) -> Vec<f64> {
    let delta = 1e-3;
    let value = |k: f64| exact(t + k * delta);
    let near = value(1.0).into_iter().zip(value(-1.0)).map(|(a, b)| a - b);
    let far = value(2.0).into_iter().zip(value(-2.0)).map(|(a, b)| a - b);
    near.zip(far).map(|(near, far)| (8.0 * near - far) / (12.0 * delta)).collect()
}

/// ∇ʲ of the exact solution at t and before, at distance h.
fn differences(exact: Exact, t: f64, h: f64, j: usize) -> Vec<f64> {
    if j == 0 {
        return exact(t);
    }
    let (now, before) = (differences(exact, t, h, j - 1), differences(exact, t - h, h, j - 1));
    now.into_iter().zip(before).map(|(a, b)| a - b).collect()
}

fn largest(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |largest, (a, b)| largest.max((a - b).abs()))
}

/// The largest errors of y and of S at the ends of equal steps to t = 2, and of both inside them.
fn errors<E: Equations>(kind: MethodKind, steps: u32, exact: Exact) -> [f64; 3] {
    let system = Heaped::of::<E>();
    let p = parameters::<E>();
    let inputs = Inputs::constant(&[0.0]);
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    // Makes Newton's method iterate to rounding.
    let tolerances = Tolerances { rtol: 1e-13, atol: 1e-13 };
    let segment = inputs.segment(inputs.segment_at(0.0, LimitSide::Right));
    let mut drive = InputCursor::new(&problem, segment, 0.0, 0, tolerances);
    let signature: &Signature = system.signature();
    let n = signature.unknowns.len();
    let mut mass = vec![0.0; n];
    signature.write_mass(&mut mass);
    let h = 2.0 / f64::from(steps);
    let (mut y, s) = (exact(0.0)[..n].to_vec(), exact(0.0)[n..].to_vec());
    let sizes = vec![1.0; n];

    let mut stepper = Stepper::new(&system, kind);
    if let MethodKind::Taylor(order) = kind {
        stepper.expansion = TaylorExpansion::new(&system, order.unwrap_or(MOST_ORDER), s.len() / n);
    }
    let mut d = SensitivityWorkspace::new(&system);
    d.s.copy_from_slice(&s);
    d.sizes.fill(1.0);
    let slopes = slopes(exact, 0.0);
    stepper.f.copy_from_slice(&slopes[..n]);
    d.g.copy_from_slice(&slopes[n..]);
    stepper.begin(h, Some(&mut d));
    if let MethodKind::Bdf(order) = kind {
        for j in 1..=order {
            let differences = differences(exact, 0.0, h, j);
            stepper.k[j].copy_from_slice(&differences[..n]);
            d.v[j].copy_from_slice(&differences[n..]);
        }
        stepper.history.change_order(order);
    }

    let mut statistics = Statistics::default();
    let mut worst = [0.0_f64; 3];
    let (mut inside, mut inside_s) = (vec![0.0; n], vec![0.0; s.len()]);
    for step in 0..steps {
        let t = f64::from(step) * h;
        let base = StepBase { system: &system, p: &p, z: &[], mass: &mass, t };
        if stepper.traits.wants_jacobian() {
            stepper.linearize(base, &mut drive, &y, Some((&mut d, StepEnd::Start)));
        }
        if stepper.traits.wants_series() {
            stepper.expand(base, &mut drive, &y, h, Some(&d));
        }
        let trial = StepTrial { base, y: &y, h, sizes: &sizes, tolerances };
        stepper.attempt(trial, &mut drive, Some(&mut d), &mut statistics).unwrap();
        stepper.prepare_dense(&y, Some(&mut d));
        stepper.interpolate(0.4, &y, &mut inside);
        stepper.interpolate_sensitivities(0.4, &d, &mut inside_s);
        stepper.advance(h, &mass, Some(&mut d));
        std::mem::swap(&mut y, &mut stepper.y_new);
        std::mem::swap(&mut d.s, &mut d.s_new);
        let (end, dense) = (exact(t + h), exact(t + 0.4 * h));
        let of_dense = largest(&inside, &dense[..n]).max(largest(&inside_s, &dense[n..]));
        let now = [largest(&y, &end[..n]), largest(&d.s, &end[n..]), of_dense];
        for (worst, now) in worst.iter_mut().zip(now) {
            *worst = worst.max(now);
        }
    }
    worst
}

/// Checks that errors fall like h^order, and between step ends like h^dense, within 0.15 of the exponent, if steps are
/// halved.
fn verify<E: Equations>(name: &str, kind: MethodKind, orders: [u32; 2], steps: u32, exact: Exact) {
    let [order, dense] = orders;
    let coarse = errors::<E>(kind, steps, exact);
    let fine = errors::<E>(kind, 2 * steps, exact);
    for (k, (what, order)) in [("y", order), ("S", order), ("dense", dense)].iter().enumerate() {
        let observed = (coarse[k] / fine[k]).log2();
        let distance = (observed - f64::from(*order)).abs();
        assert!(distance < 0.15, "{name}, {what}: order {observed} and not {order}");
    }
}

#[test]
fn every_method_has_its_order() {
    for method in METHODS {
        let (name, kind, order) = (method.name, method.kind, method.order);
        match kind {
            MethodKind::Bdf(most) => {
                for order in 1..=most {
                    let kind = MethodKind::Bdf(order);
                    let name = format!("{name} of order {order}");
                    let order = u32::try_from(order).unwrap();
                    verify::<Logistic>(&name, kind, [order, order], 128, logistic);
                    verify::<LogisticDae>(&name, kind, [order, order], 128, algebraic);
                }
            }
            MethodKind::Explicit(_) => {
                verify::<Logistic>(name, kind, [order, order], 64, logistic);
            }
            // Beyond these, errors are rounding.
            MethodKind::Taylor(_) => {
                for order in 2..=8 {
                    let kind = MethodKind::Taylor(Some(order));
                    let name = format!("{name} of order {order}");
                    let order = u32::try_from(order).unwrap();
                    verify::<Logistic>(&name, kind, [order, order], 16, logistic);
                }
            }
            MethodKind::Esdirk(_) => {
                verify::<Logistic>(name, kind, [order, order], 32, logistic);
                verify::<LogisticDae>(name, kind, [order, order], 32, algebraic);
            }
            MethodKind::Rosenbrock(tableau) => {
                let dense = tableau.dense_order + 1;
                verify::<Logistic>(name, kind, [order, dense], 128, logistic);
                // Between step ends, algebraic unknowns are one order less accurate.
                verify::<LogisticDae>(name, kind, [order, dense - 1], 128, algebraic);
            }
        }
    }
}
