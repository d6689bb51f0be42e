//! P5: 6000 s at 1 Hz, inputs that change every second.
//!
//! The fastest variant found: one solver, stopped at each sample, where the derivatives are rewritten for the new
//! inputs, because the solver would use the old ones. The step is carried over, unless a fixed first step after each
//! sample is faster.

use diffsol::{OdeBuilder, OdeSolverMethod, OdeSolverStopReason};
use peers_problems::request::{Answer, Failure, Request, Sample};
use peers_problems::two_state::{AREA, SIZES, TwoState, WIDTH};

use crate::two_state::{Matrix, Now, Solver, row_at_rest};

/// Steps `$solver` from sample to sample.
macro_rules! follow {
    ($now:expr, $recording:expr, $solver:expr, $first_step:expr, $sensitivities:expr) => {{
        let mut solver = $solver?;
        let mut rows = vec![row_at_rest(); $recording.len()];
        for k in 0..$recording.len() - 1 {
            let model = model_at($recording[k]);
            $now.model.set(model);
            if k > 0 {
                let state = solver.state_mut();
                let ydot = model.rhs(rows[k][0], rows[k][1]);
                state.dy.batch_as_mut_slice(0).copy_from_slice(&ydot);
                if $sensitivities {
                    for (j, sdot) in slopes(&model, &rows[k]).iter().enumerate() {
                        state.ds.batch_as_mut_slice(j).copy_from_slice(sdot);
                    }
                }
                if let Some(h) = $first_step {
                    *state.h = h;
                }
            }
            solver.set_stop_time((k + 1) as f64)?;
            while !matches!(solver.step()?, OdeSolverStopReason::TstopReached) {}
            let state = solver.state();
            let row = &mut rows[k + 1];
            row[..2].copy_from_slice(state.y.batch_as_slice(0));
            if $sensitivities {
                for (j, s) in row[2..].chunks_exact_mut(2).enumerate() {
                    s.copy_from_slice(state.s.batch_as_slice(j));
                }
            }
        }
        let steps = solver.get_statistics().number_of_steps;
        Ok((rows, steps))
    }};
}

pub(crate) fn solve(request: &Request) -> Result<(), Failure> {
    let recording = request.recording()?;
    let now = Now::new(model_at(recording[0]));
    let restart = || {
        now.model.set(model_at(recording[0]));
        now.restart();
        OdeBuilder::<Matrix>::new().p([1.0; 5]).rtol(request.rtol).atol(request.atol(SIZES))
    };
    let plain =
        || restart().rhs_implicit(now.rhs(), now.jacobian_times()).init(now.start(), 2).build();
    let with = || {
        restart()
            .sens_rtol(request.rtol)
            .sens_atol(request.atol(SIZES))
            .rhs_sens_implicit(now.rhs(), now.jacobian_times(), now.by_theta_times())
            .init_sens(now.start(), now.start_times(), 2)
            .build()
    };
    let first = first_step(request);
    let sensitivities = request.with_sensitivities();
    let width = if sensitivities { WIDTH } else { 2 };
    let answer = |(rows, steps): (Vec<[f64; WIDTH]>, usize)| {
        Answer::new(rows.iter().flat_map(|row| &row[..width]).copied().collect(), steps)
    };
    macro_rules! run {
        ($problem:expr, $method:ident, $sensitivities:expr) => {
            request.measure(
                || {
                    let problem = $problem()?;
                    follow!(now, recording, problem.$method::<Solver>(), first, $sensitivities)
                },
                answer,
            )
        };
    }
    match (sensitivities, request.method.as_str()) {
        (false, "bdf") => run!(plain, bdf, false),
        (false, "tr_bdf2") => run!(plain, tr_bdf2, false),
        (false, "esdirk34") => run!(plain, esdirk34, false),
        (true, "bdf") => run!(with, bdf_sens, true),
        (true, "tr_bdf2") => run!(with, tr_bdf2_sens, true),
        (true, "esdirk34") => run!(with, esdirk34_sens, true),
        (_, method) => Err(format!("no {method} for the recording").into()),
    }
}

/// The first step after a sample, if a fixed one is faster than carrying over the last one, s.
fn first_step(request: &Request) -> Option<f64> {
    let loose = request.rtol >= 1e-4;
    match (request.method.as_str(), request.with_sensitivities(), loose) {
        ("bdf", false, true) | ("tr_bdf2", false, false) => Some(0.5),
        ("bdf", false, false) | ("tr_bdf2" | "esdirk34", true, false) => Some(0.1),
        ("bdf", true, _) => Some(0.01),
        _ => None,
    }
}

fn model_at(sample: Sample) -> TwoState {
    TwoState { w: sample.w, q_out: sample.q_b + sample.q_tf, ..TwoState::start() }
}

/// Ṡ = ∂f/∂y S + ∂f/∂θ, parameter by parameter.
fn slopes(model: &TwoState, row: &[f64; WIDTH]) -> [[f64; 2]; 5] {
    let [by_h, by_q] = model.slopes(row[1]);
    let by_theta = model.by_theta(row[0], row[1]);
    std::array::from_fn(|j| {
        let (s_h, s_q) = (row[2 + 2 * j], row[3 + 2 * j]);
        [s_q / AREA, by_h * s_h + by_q * s_q + by_theta[j]]
    })
}
