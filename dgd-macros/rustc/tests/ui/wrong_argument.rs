//! Arguments have a form.

dgd::model!(tank.dgd);

fn main() {}
