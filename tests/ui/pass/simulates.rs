//! A generated model is solved; with k = 2/s the level is exp(-2) m after 1 s.

use dgd::{Inputs, Options, Problem, observe, simulate};

dgd::model!("../tank.dgd", roof = closed, sensitivities = []);

fn main() {
    let p: [f64; 1] = tank::Parameters::default().into();
    let inputs = Inputs::none();
    let problem = Problem { system: &tank::Model, p: &p, inputs: &inputs, start: &[] };
    let solution = simulate(&problem, &[0.0, 1.0], &Options::default()).expect("it is linear");
    let exact = (-2.0_f64).exp();
    assert!((solution.y(1)[0] - exact).abs() < 1e-5);
    assert!((observe(&problem, &solution).w(1)[0] - 1e4 * exact).abs() < 0.1);
}
