//! dgd::model!, the proc-macro that compiles a .dgd file into Rust.
