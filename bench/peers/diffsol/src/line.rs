//! P3: the line, with sparse faer matrices.
//!
//! Set-up colours the Jacobian from a dense sweep, so its time and memory grow with the square of the number of cells.

use diffsol::{
    FaerSparseLU, FaerSparseMat, OdeBuilder, OdeSolverMethod, OdeSolverStopReason, Vector,
};
use peers_problems::line::{END, Line};
use peers_problems::request::{Answer, Failure, Request, check_memory};

/// Steps through `$problem` and reads p₁ at whole seconds.
macro_rules! solve {
    ($problem:expr, $method:ident) => {{
        let problem = $problem?;
        let mut solver = problem.$method::<FaerSparseLU<f64>>()?;
        let mut y = solver.state().y.clone();
        let mut pressures = vec![y.get_index(0)];
        solver.set_stop_time(f64::from(END))?;
        let mut next = 1;
        loop {
            let reason = solver.step()?;
            while next <= END && f64::from(next) <= solver.state().t {
                solver.interpolate_inplace(f64::from(next), &mut y)?;
                pressures.push(y.get_index(0));
                next += 1;
            }
            if matches!(reason, OdeSolverStopReason::TstopReached) {
                break;
            }
        }
        Ok((pressures, solver.get_statistics().number_of_steps))
    }};
}

pub(crate) fn solve(request: &Request) -> Result<(), Failure> {
    let cells = request.size().ok_or("how many cells?")?;
    check_memory(100 * (cells as u64).pow(2))?;
    let line = Line::new(cells);
    let rtol = request.rtol;
    let atol: Vec<f64> = (0..cells).flat_map(|_| [1e6 * rtol, 1e-2 * rtol]).collect();
    let problem = || {
        OdeBuilder::<FaerSparseMat<f64>>::new()
            .rtol(rtol)
            .atol(atol.iter().copied())
            .rhs_implicit(
                move |y: &[f64], _p: &[f64], t, ydot: &mut [f64]| line.rhs(t, y, ydot),
                move |y: &[f64], _p: &[f64], _t, v: &[f64], result: &mut [f64]| {
                    line.jacobian_times(y, v, result);
                },
            )
            .init(move |_p: &[f64], _t, y: &mut [f64]| line.start(y), line.states())
            .build()
    };
    let answer = |(values, steps)| Answer::new(values, steps);
    match request.method.as_str() {
        "tr_bdf2" => request.measure(|| solve!(problem(), tr_bdf2), answer),
        "esdirk34" => request.measure(|| solve!(problem(), esdirk34), answer),
        method => Err(format!("no {method} for the line").into()),
    }
}
