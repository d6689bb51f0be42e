//! The choice of a variant is looked up.

dgd::model!("./tank.dgd", roof = close);

fn main() {
    let _ = tank::Parameters { k: 3.0 };
}
