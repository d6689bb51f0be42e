//! A riser's level under a controller that is written in Rust, around a model that is not.
//!
//! The pump's speed is held for ten seconds at a time and set by a proportional–integral law on the
//! riser pressure (Haukanes 2015, 2.31), while the booster flow is stopped and started again. Run
//! with `cargo run --release --example level_control`.

use dgd_runtime::{EvaluationPoint, Inputs, Options, Problem, System, simulate};

dgd::model!("models/mud_circulation.dgd");
use mud_circulation::{Inputs as Controls, Model, Outputs, Parameters, Unknowns};

/// Time between two settings of the pump, s.
const PERIOD: f64 = 10.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let p: [f64; 6] = Parameters { c0: 281.0, ..Parameters::default() }.into();
    let lpm = 1e-3 / 60.0;
    let (gain, integral_time) = (2e-7, 200.0);
    let reference = 30e5;

    let mut y: [f64; 2] = Unknowns { h_r: 50.0, q_ssp: 2100.0 * lpm }.into();
    let mut speed = 0.53;
    let mut last_error = None;
    println!("  time   speed   booster   pressure   level");
    println!("     s       %       lpm        bar       m");
    for period in 0..180 {
        let t = f64::from(period) * PERIOD;
        let q_boost = if (600.0..1000.0).contains(&t) { 0.0 } else { 1800.0 * lpm };
        let u: [f64; 3] = Controls { w_ssp: speed, q_boost, q_tf: 300.0 * lpm }.into();

        let mut w = [0.0; 4];
        Model.outputs(EvaluationPoint { t, y: &y, u: &u, p: &p, z: &[] }, &mut w);
        let Outputs { p_r, .. } = w.into();
        if period % 10 == 0 {
            let (boost, bar) = (q_boost / lpm, p_r / 1e5);
            println!("{t:>6} {:>7.1} {boost:>9.0} {bar:>10.2} {:>7.1}", speed * 100.0, y[0]);
        }

        // ω = K (e + 1/T ∫ e) in its velocity form; too much pressure wants more speed.
        let error = p_r - reference;
        let change = error - last_error.unwrap_or(error) + error * PERIOD / integral_time;
        speed = (speed + gain * change).clamp(0.0, 1.0);
        last_error = Some(error);

        let u: [f64; 3] = Controls { w_ssp: speed, q_boost, q_tf: 300.0 * lpm }.into();
        let inputs = Inputs::constant(&u);
        let start = [(0, y[0]), (1, y[1])];
        let problem = Problem { system: &Model, p: &p, inputs: &inputs, start: &start };
        let solution = simulate(&problem, &[t, t + PERIOD], &Options::default())?;
        y.copy_from_slice(solution.y(1));
    }
    Ok(())
}
