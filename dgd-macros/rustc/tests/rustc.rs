//! `dgd::model!` as rustc shows it: one error for a model with mistakes, none for its uses.
//!
//! Sound models are compiled and run by the other tests.

#[test]
fn a_mistake_in_a_model_is_one_error() {
    trybuild::TestCases::new().compile_fail("tests/ui/*.rs");
}
