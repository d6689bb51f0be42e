//! A line that cannot be read is one error, and uses of what the others declare are none.

dgd::model!("./unread.dgd");

fn main() {
    let _ = unread::Parameters { k: 3.0 };
}
