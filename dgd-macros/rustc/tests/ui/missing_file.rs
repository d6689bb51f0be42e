//! A file that is not there is named.

dgd::model!("./nowhere.dgd");

fn main() {
    let _ = nowhere::Model;
}
