//! P1, P2 and P4: a jump of the speed at 100 s, where the solver restarts.

use diffsol::{
    NalgebraContext, NalgebraVec, OdeBuilder, OdeEquations, OdeEquationsImplicitSens,
    OdeSolverMethod, SensitivitiesOdeSolverMethod,
};
use peers_problems::request::{Answer, Failure, Request};
use peers_problems::two_state::{SETS, SIZES, STRETCHES, TwoState, WIDTH, ensemble};

use crate::two_state::{Matrix, Now, Solver, mass};

/// A row for each output, and the steps of the solver.
type Run = (Vec<[f64; WIDTH]>, usize);

/// Common part of all problems.
macro_rules! builder {
    ($request:expr) => {
        OdeBuilder::<Matrix>::new()
            .p([1.0; 5])
            .rtol($request.rtol)
            .atol($request.atol(SIZES))
            .sens_rtol($request.rtol)
            .sens_atol($request.atol(SIZES))
    };
}

/// Solves `$problem` interval by interval; `$read` reads a solver's outputs.
macro_rules! solve {
    ($now:expr, $problem:expr, $method:ident, $read:expr) => {{
        let problem = $problem;
        let (mut rows, mut steps) = (Vec::with_capacity(1001), 0);
        $now.restart();
        for (from, to, w) in STRETCHES {
            problem.t0 = f64::from(from);
            $now.model.set(TwoState { w, ..$now.model.get() });
            let mut solver = problem.$method::<Solver>()?;
            // The outputs of the first interval include its start.
            let first = if from == 0 { 0 } else { from + 1 };
            let times: Vec<f64> = (first..=to).map(f64::from).collect();
            $read(&mut solver, &times, &mut rows)?;
            steps += solver.get_statistics().number_of_steps;
            $now.start.set(rows[rows.len() - 1]);
        }
        Ok((rows, steps))
    }};
}

/// P1a, P2a.
pub(crate) fn states(request: &Request) -> Result<(), Failure> {
    let now = Now::new(TwoState::start());
    let ode = || {
        builder!(request).rhs_implicit(now.rhs(), now.jacobian_times()).init(now.start(), 2).build()
    };
    let dae = || {
        builder!(request)
            .rhs_implicit(now.rhs(), now.jacobian_times())
            .mass(mass)
            .init(now.start(), 2)
            .build()
    };
    let answer = |(rows, steps): Run| {
        Answer::new(rows.iter().flat_map(|row| &row[..2]).copied().collect(), steps)
    };
    match (request.case.as_str(), request.method.as_str()) {
        ("p1a", "bdf") => request.measure(|| solve!(now, &mut ode()?, bdf, read_states), answer),
        ("p1a", "tr_bdf2") => {
            request.measure(|| solve!(now, &mut ode()?, tr_bdf2, read_states), answer)
        }
        ("p1a", "esdirk34") => {
            request.measure(|| solve!(now, &mut ode()?, esdirk34, read_states), answer)
        }
        ("p2a", "bdf") => request.measure(|| solve!(now, &mut dae()?, bdf, read_states), answer),
        ("p2a", "tr_bdf2") => {
            request.measure(|| solve!(now, &mut dae()?, tr_bdf2, read_states), answer)
        }
        ("p2a", "esdirk34") => {
            request.measure(|| solve!(now, &mut dae()?, esdirk34, read_states), answer)
        }
        (case, method) => Err(format!("no {method} for {case}").into()),
    }
}

/// P1b, P2b.
pub(crate) fn sensitivities(request: &Request) -> Result<(), Failure> {
    let now = Now::new(TwoState::start());
    let ode = || {
        builder!(request)
            .rhs_sens_implicit(now.rhs(), now.jacobian_times(), now.by_theta_times())
            .init_sens(now.start(), now.start_times(), 2)
            .build()
    };
    let dae = || {
        builder!(request)
            .rhs_sens_implicit(now.rhs(), now.jacobian_times(), now.by_theta_times_static())
            .mass(mass)
            .init_sens(now.start(), now.start_times(), 2)
            .build()
    };
    let answer = |(rows, steps): Run| Answer::new(rows.into_iter().flatten().collect(), steps);
    match (request.case.as_str(), request.method.as_str()) {
        ("p1b", "bdf") => request.measure(|| solve!(now, &mut ode()?, bdf_sens, read_all), answer),
        ("p1b", "tr_bdf2") => {
            request.measure(|| solve!(now, &mut ode()?, tr_bdf2_sens, read_all), answer)
        }
        ("p1b", "esdirk34") => {
            request.measure(|| solve!(now, &mut ode()?, esdirk34_sens, read_all), answer)
        }
        ("p2b", "bdf") => request.measure(|| solve!(now, &mut dae()?, bdf_sens, read_all), answer),
        ("p2b", "tr_bdf2") => {
            request.measure(|| solve!(now, &mut dae()?, tr_bdf2_sens, read_all), answer)
        }
        ("p2b", "esdirk34") => {
            request.measure(|| solve!(now, &mut dae()?, esdirk34_sens, read_all), answer)
        }
        (case, method) => Err(format!("no {method} for {case}").into()),
    }
}

/// P4: the mean level over all sets and outputs.
pub(crate) fn ensemble_of_sets(request: &Request) -> Result<(), Failure> {
    let now = Now::new(TwoState::start());
    let ode = || {
        builder!(request).rhs_implicit(now.rhs(), now.jacobian_times()).init(now.start(), 2).build()
    };
    let mut problem = ode()?;
    let mut one = || -> Result<Run, Failure> {
        match request.method.as_str() {
            "bdf" => solve!(now, &mut problem, bdf, read_states),
            "esdirk34" => solve!(now, &mut problem, esdirk34, read_states),
            method => Err(format!("no {method} for p4").into()),
        }
    };
    request.measure(
        || {
            let (mut sum, mut steps) = (0.0, 0);
            for p in ensemble(SETS) {
                now.model.set(TwoState { p, ..TwoState::start() });
                let (rows, taken) = one()?;
                sum += rows.iter().map(|row| row[0]).sum::<f64>();
                steps += taken;
            }
            Ok((sum / (SETS * 1001) as f64, steps))
        },
        |(mean, steps)| Answer::new(vec![mean], steps),
    )
}

fn read_states<'a, E, S>(
    solver: &mut S,
    times: &[f64],
    rows: &mut Vec<[f64; WIDTH]>,
) -> Result<(), Failure>
where
    E: OdeEquations<T = f64, M = Matrix, V = NalgebraVec<f64>, C = NalgebraContext> + 'a,
    S: OdeSolverMethod<'a, E>,
{
    let (y, _) = solver.solve_dense(times)?;
    for k in 0..times.len() {
        let mut row = [0.0; WIDTH];
        row[0] = y[(0, k)];
        row[1] = y[(1, k)];
        rows.push(row);
    }
    Ok(())
}

fn read_all<'a, E, S>(
    solver: &mut S,
    times: &[f64],
    rows: &mut Vec<[f64; WIDTH]>,
) -> Result<(), Failure>
where
    E: OdeEquationsImplicitSens<T = f64, M = Matrix, V = NalgebraVec<f64>, C = NalgebraContext>
        + 'a,
    S: SensitivitiesOdeSolverMethod<'a, E>,
{
    let (y, s, _) = solver.solve_dense_sensitivities(times)?;
    for k in 0..times.len() {
        let mut row = [0.0; WIDTH];
        row[0] = y[(0, k)];
        row[1] = y[(1, k)];
        for (row, s) in row[2..].chunks_exact_mut(2).zip(&s) {
            row[0] = s[(0, k)];
            row[1] = s[(1, k)];
        }
        rows.push(row);
    }
    Ok(())
}
