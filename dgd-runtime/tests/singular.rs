//! Points where the algebraic equations lose their slope.

mod support;

use dgd_runtime::{
    Column, Inputs, Interpolation, Options, Problem, simulate, simulate_with_sensitivities,
};
use support::parameters;
use support::problems::{Tank, TankStacked};

fn options(tolerance: f64) -> Options {
    Options { rtol: tolerance, atol: tolerance, max_steps: 10_000, ..Options::default() }
}

#[test]
fn the_states_arrive_and_stay_at_rest() {
    let system = TankStacked::new();
    let p = parameters::<Tank>();
    let inputs = Inputs::constant(&[0.0]);
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let times: Vec<f64> = (0..=240).map(|k| 0.25 * f64::from(k)).collect();
    for tolerance in [1e-4, 1e-5, 1e-6, 1e-7, 1e-8] {
        let solution = simulate(&problem, &times, &options(tolerance)).unwrap_or_else(|e| {println!("{e} {:?}", e.partial.statistics); e.partial});
        println!("{tolerance:e} {:?}", solution.statistics);
        let (mut e0, mut e1) = (0.0_f64, 0.0_f64);
        for (k, &t) in solution.times.iter().enumerate() {
            let [h, q] = Tank::solution(t, &p);
            e0 = e0.max((solution.y(k)[0] - h).abs());
            e1 = e1.max((solution.y(k)[1] - q).abs());
        }
        println!("{e0:e} {e1:e} {:?}", solution.y(solution.len()-1));
    }
}

#[test]
fn sensitivities_end_where_the_slope_does() {
    let system = TankStacked::new();
    let p = parameters::<Tank>();
    let inputs = Inputs::constant(&[0.0]);
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let times: Vec<f64> = (0..=240).map(|k| 0.25 * f64::from(k)).collect();
    let arrival = Tank::arrival(&p);
    for tolerance in [1e-4, 1e-5, 1e-6, 1e-7, 1e-8] {
        let solution = simulate_with_sensitivities(&problem, &times, &options(tolerance)).unwrap_or_else(|e| {println!("{e} {:?}", e.partial.statistics); e.partial});
        println!("{tolerance:e} {:?} {:?} {arrival}", solution.statistics, solution.undefined);
        let mut e = 0.0_f64;
        for (k, &t) in solution.times.iter().enumerate() {
            let s = solution.s(k);
            if t < arrival - 0.01 {
                let exact = Tank::sensitivity_to_a(t, &p);
                e = e.max((s[0] - exact[0]).abs()).max((s[1] - exact[1]).abs());
            }
        }
        println!("{e:e}");
    }
}
