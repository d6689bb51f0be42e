//! What a user's program does with a model: simulate it, take its sensitivities, fit it.

use dgd::identify::{Noise, OutputErrorProblem, Recording, fit};
use dgd::{
    Column, Inputs, Interpolation, Options, Problem, System, simulate, simulate_with_sensitivities,
};

dgd::model!("./mud_circulation.dgd");
use mud_circulation::{Model, Parameters};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let lpm = 1e-3 / 60.0;
    let times: Vec<f64> = (0..600).map(f64::from).collect();
    let speed: Vec<f64> = times.iter().map(|t| 0.53 + 0.01 * (t / 60.0).sin()).collect();
    let (boost, fill) = (vec![1850.0 * lpm; 600], vec![300.0 * lpm; 600]);
    let inputs = Inputs::recorded(
        &times,
        &[
            Column { name: "w_ssp", interpolation: Interpolation::Hold, values: &speed },
            Column { name: "q_boost", interpolation: Interpolation::Linear, values: &boost },
            Column { name: "q_tf", interpolation: Interpolation::Hold, values: &fill },
        ],
    )?;
    let options = Options::default();

    let true_p: [f64; 6] = Parameters { c0: 281.0, ..Parameters::default() }.into();
    let problem = Problem { system: &Model, p: &true_p, inputs: &inputs, start: &[] };
    let truth = simulate(&problem, &times, &options)?;
    let levels: Vec<f64> = (0..times.len()).map(|k| truth.y(k)[0]).collect();
    let solution = simulate_with_sensitivities(&problem, &times, &options)?;
    println!("level {} m, its first sensitivity {}", levels[599], solution.s(599)[0]);

    // Suction pressure is what the level lacks of the pump's depth.
    let pressures = levels.iter().map(|level| 1120.0 * 9.81 * (307.0 - level)).collect();
    let recordings = [Recording::new(times, inputs, vec![None, Some(pressures), None, None])];
    let p: [f64; 6] = Parameters::default().into();
    let mut to_fit = OutputErrorProblem {
        noise: vec![None, Some(Noise::Known(1e3)), None, None],
        ..OutputErrorProblem::new(&Model, &p, &recordings)
    };
    let parameters = Model.signature().parameters.iter();
    to_fit.free = parameters.map(|parameter| parameter.name == "c0").collect();
    println!("c0 {} m", fit(&to_fit)?.p[1]);
    Ok(())
}
