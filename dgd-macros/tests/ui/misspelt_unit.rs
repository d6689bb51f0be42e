//! Two misspelt units are one error, and uses of the module are none.

use dgd::{Inputs, Options, Problem, simulate_with_sensitivities};

dgd::model!("./misspelt.dgd");

fn main() {
    let p: [f64; 1] = misspelt::Parameters { k: 3.0 }.into();
    let inputs = Inputs::none();
    let problem = Problem { system: &misspelt::Model, p: &p, inputs: &inputs, start: &[(0, 1.0)] };
    let solution = simulate_with_sensitivities(&problem, &[0.0, 1.0], &Options::default());
    let y: [f64; 1] = solution.unwrap().y(1).try_into().unwrap();
    println!("{}", misspelt::Unknowns::from(y).h);
}
