//! So is the parameter of a sensitivity.

dgd::model!("./tank.dgd", sensitivities = [kk], as other);

fn main() {
    let _ = other::Parameters::default();
}
