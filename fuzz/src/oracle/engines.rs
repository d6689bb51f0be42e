//! Compares interpreter and native code bit by bit.

use dgd_runtime::taylor::MOST_ORDER;
use dgd_runtime::{SolvableSystem, System};

use super::Finding;
use super::points::{At, places};
use crate::case::Case;
use crate::prepared::Prepared;
use crate::random::Random;

/// Bits of a number; all NaNs count as equal, since the payload of a result is unspecified.
fn bits_of(x: f64) -> u64 {
    if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() }
}

pub(super) fn judge(_: &Case, prepared: &Prepared, findings: &mut Vec<Finding>) {
    if let Err(refused) = prepared.native.compile() {
        findings.push(Finding::new("engines", "no native code", refused.to_string()));
        return;
    }
    if prepared.native.signature() != prepared.system.signature() {
        findings.push(Finding::new("engines", "signature", "the signatures differ"));
    }
    let mut random = Random::new(17);
    for (round, at) in places(prepared, &mut random).into_iter().enumerate() {
        let mut points = vec![at.clone()];
        if round == 0 {
            points.extend(special_places(&at));
        }
        for at in points {
            let (a, b) = (bits(&prepared.system, &at), bits(&prepared.native, &at));
            let apart = a.iter().zip(&b).position(|(a, b)| a != b);
            if let Some(function) = apart {
                let detail = format!("array {function} at {at:?}");
                findings.push(Finding::new("engines", format!("array {function}"), detail));
                return;
            }
        }
    }
}

/// Bits of everything that a system computes at a point.
pub(crate) fn bits(system: &impl SolvableSystem, at: &At) -> Vec<Vec<u64>> {
    let signature = system.signature();
    let (n, n_w) = (signature.unknowns.len(), signature.outputs.len());
    let (n_s, n_j) = (signature.directions.len(), signature.jacobian.len());
    let numbers = |n: usize| vec![0.0; n];
    let mut noise = Random::new(23);
    let udot: Vec<f64> = at.u.iter().map(|u| u * noise.between(-1.0, 1.0)).collect();
    let s: Vec<f64> = (0..n * n_s).map(|_| noise.between(-1.0, 1.0)).collect();
    let point = at.point();
    let mut results: Vec<Vec<f64>> = Vec::new();

    let mut f = numbers(n);
    system.rhs(point, &mut f);
    results.push(f.clone());
    let (mut jacobian, mut dfdt) = (numbers(n_j), numbers(n));
    system.linearize(point, &udot, &mut f, &mut jacobian, &mut dfdt);
    results.extend([f.clone(), jacobian.clone(), dfdt.clone()]);
    let mut g = numbers(n * n_s);
    system.sensitivity_rhs(point, &s, &mut f, &mut g);
    results.extend([f.clone(), g.clone()]);
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
    results.extend([f, jacobian, dfdt, g, dgdy, dgdt]);
    let mut values = numbers(signature.parameter_jacobian.len());
    system.parameter_jacobian(point, &mut values);
    results.push(values);
    let mut values = numbers(signature.input_jacobian.len());
    system.input_jacobian(point, &mut values);
    results.push(values);
    let mut values = numbers(n);
    system.time_derivative(point, &mut values);
    results.push(values);
    let [by_y, by_u, by_p] = &signature.output_jacobians;
    let (mut dwdy, mut dwdu) = (numbers(by_y.len()), numbers(by_u.len()));
    let (mut dwdp, mut dwdt) = (numbers(by_p.len()), numbers(n_w));
    system.output_jacobians(point, &mut dwdy, &mut dwdu, &mut dwdp, &mut dwdt);
    let (mut w, mut dw) = (numbers(n_w), numbers(n_w * n_s));
    system.outputs(point, &mut w);
    results.extend([dwdy, dwdu, dwdp, dwdt, w.clone()]);
    system.output_sensitivities(point, &s, &mut w, &mut dw);
    let (mut y0, mut s0) = (numbers(n), numbers(n * n_s));
    system.start(point, &mut y0);
    system.start_sensitivities(point, &mut s0);
    let mut tau = numbers(signature.delays.len());
    let mut dtau = numbers(signature.delays.len() * n_s);
    system.delays(point, &mut tau);
    system.delay_sensitivities(point, &mut dtau);
    results.extend([w, dw, y0, s0, tau, dtau]);
    let n_starts = signature.start_equations.len();
    let (mut rest, mut drest) = (numbers(n_starts), numbers(n_starts * n_s));
    let mut drestdy = numbers(n_starts * n);
    system.start_equations(point, &mut rest);
    system.start_equation_sensitivities(point, &s, &mut drest, &mut drestdy);
    results.extend([rest, drest, drestdy]);
    let n_v = signature.delayed_unknowns.len();
    let (mut x, mut rate, mut curvature) = (numbers(n_v), numbers(n_v), numbers(n_v));
    system.histories(point, &mut x, &mut rate, &mut curvature);
    let (mut past_s, mut s_rate) = (numbers(n_v * n_s), numbers(n_v * n_s));
    system.history_sensitivities(point, &mut past_s, &mut s_rate);
    results.extend([x, rate, curvature, past_s, s_rate]);
    let n_tau = signature.varying_delays.len();
    let (mut tau, mut dtau) = (numbers(n_tau), numbers(n_tau * n_s));
    let (mut dtaudy, mut dtaudt) = (numbers(n_tau * n), numbers(n_tau));
    system.varying_delays(point, &mut tau);
    system.varying_delay_sensitivities(point, &udot, &s, &mut dtau, &mut dtaudy, &mut dtaudt);
    results.extend([tau, dtau, dtaudy, dtaudt]);

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
    results.extend([mass, e, r, times, after, dtimes]);
    let (mut de, mut dedt) = (numbers(discrete.event_directions.len()), numbers(n_e));
    let mut dedy = numbers(discrete.event_jacobian.len());
    system.event_derivatives(point, &udot, &mut de, &mut dedy, &mut dedt);
    let (mut dr, mut drdt) = (numbers(discrete.reset_directions.len()), numbers(n_r));
    let mut drdy = numbers(discrete.reset_jacobian.len());
    system.reset_derivatives(point, &udot, &mut dr, &mut drdy, &mut drdt);
    results.extend([de, dedy, dedt, dr, drdy, drdt]);
    let (n_h, n_single) = (discrete.jump_jacobian.len(), signature.unknowns.single.len());
    if n_h > 0 {
        let (mut kinds, mut rests, mut h) = (numbers(n_single), numbers(n_single), numbers(n_h));
        system.jumps(point, &mut kinds, &mut rests, &mut h);
        let (mut drests, mut drestsdt) = (numbers(n_single * n_s), numbers(n_single));
        let (mut dh, mut dhdt) = (numbers(n_h * n_s), numbers(n_h));
        system.jump_sensitivities(point, &udot, &s, &mut drests, &mut drestsdt, &mut dh, &mut dhdt);
        results.extend([kinds, rests, h, drests, drestsdt, dh, dhdt]);
    }
    if let Ok(kept) = system.taylor_series() {
        const ORDER: usize = 12;
        let terms = vec![[0.0; MOST_ORDER + 1]; kept.unknowns.max(kept.sensitivities)];
        let (mut y, mut s_series) = (numbers((ORDER + 1) * n), numbers((ORDER + 1) * n * n_s));
        system.taylor(point, &udot, 0.01, ORDER, &mut terms.clone(), &mut y);
        results.push(y.clone());
        if n_s > 0 {
            s_series[..n * n_s].copy_from_slice(&s);
            let kept = &mut terms.clone();
            system.sensitivity_taylor(point, &udot, 0.01, ORDER, kept, &mut y, &mut s_series);
            results.extend([y, s_series]);
        }
    }
    results.iter().map(|values| values.iter().map(|x| bits_of(*x)).collect()).collect()
}

/// Checks that a generated Rust model agrees with the interpreter on a case.
///
/// # Errors
///
/// The point and the function that disagree.
pub(crate) fn generated_agrees(case: &Case, generated: &impl SolvableSystem) -> Result<(), String> {
    let prepared = Prepared::new(case).map_err(|finding| finding.detail)?;
    if generated.signature() != prepared.system.signature() {
        return Err("the signatures differ".to_owned());
    }
    let mut random = Random::new(17);
    let places = places(&prepared, &mut random);
    let special: Vec<At> = places.first().map(special_places).unwrap_or_default();
    for at in places.iter().chain(&special) {
        let (a, b) = (bits(&prepared.system, at), bits(generated, at));
        if let Some(function) = a.iter().zip(&b).position(|(a, b)| a != b) {
            return Err(format!("array {function} at {at:?}"));
        }
    }
    Ok(())
}

/// Special values of functions.
const SPECIAL: [f64; 8] =
    [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -0.0, f64::MIN_POSITIVE, 1e-310, -1e300];

/// The same point with one number of each array replaced by a special one.
fn special_places(at: &At) -> Vec<At> {
    let arrays: [fn(&mut At) -> &mut Vec<f64>; 3] =
        [|at| &mut at.y, |at| &mut at.u, |at| &mut at.p];
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
