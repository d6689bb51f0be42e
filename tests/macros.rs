//! `dgd::model!` as rustc shows it: one error for a model with mistakes, none for its uses.

#[test]
fn mistakes_are_one_error_and_sound_models_run() {
    let cases = trybuild::TestCases::new();
    cases.pass("tests/ui/pass/*.rs");
    cases.compile_fail("tests/ui/*.rs");
}
