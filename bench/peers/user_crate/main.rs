//! A user's program: simulates a model, takes its sensitivities, and fits it.

use dgd::{Options, Problem, Recording, fit, sensitivities, simulate};

dgd::model!("./mud_circulation.dgd");
use mud_circulation::{Model, Parameters};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let lpm = 1e-3 / 60.0;
    let times: Vec<f64> = (0..600).map(f64::from).collect();
    let speed: Vec<f64> = times.iter().map(|t| 0.53 + 0.01 * (t / 60.0).sin()).collect();
    let (boost, fill) = (vec![1850.0 * lpm; 600], vec![300.0 * lpm; 600]);
    let samples: [(&str, &[f64]); 3] = [("w_ssp", &speed), ("q_boost", &boost), ("q_tf", &fill)];
    let inputs = dgd::inputs(&Model, &times, &samples)?;
    let options = Options::default();

    let true_p = Parameters { c0: 281.0, ..Parameters::default() };
    let problem = Problem::new(&Model, &true_p, &inputs);
    let truth = simulate(&problem, &times, &options)?;
    let run = sensitivities(&problem, &times, &options)?;
    println!("level {} m, by c0 {}", truth.get("h_r")?[599], run.sensitivity("h_r", "c0")?[599]);

    let recording = Recording::new(&times, &inputs).measured("p_in", truth.get("p_in")?);
    let fitted = fit(&Model, &Parameters::default(), &[recording], &["c0"], &options)?;
    println!("c0 {} m", fitted.get("c0")?.value);
    Ok(())
}
