//! Two misspelt units are one error, and uses of the module are none.

use dgd::{Inputs, Options, Problem, sensitivities};

dgd::model!("./misspelt.dgd");

fn main() -> Result<(), dgd::Error> {
    let p = misspelt::Parameters { k: 3.0 };
    let inputs = Inputs::none();
    let problem = Problem::new(&misspelt::Model, &p, &inputs).start("h", 1.0)?;
    let solution = sensitivities(&problem, &[0.0, 1.0], &Options::default())?;
    println!("{}", misspelt::Unknowns { h: solution.get("h")?[1] }.h);
    Ok(())
}
