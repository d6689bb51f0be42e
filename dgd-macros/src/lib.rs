//! `dgd::model!`, the proc-macro that compiles a `.dgd` file into Rust.

mod expand;
mod fallback;
mod input;

/// Compiles a `.dgd` file into a module with the model's type and its named fields.
///
/// ```text
/// dgd::model!("models/mud_circulation.dgd");
/// dgd::model!("models/mud_circulation.dgd", flow = static);
/// dgd::model!("models/mud_circulation.dgd", sensitivities = [c0, c2], as quasi_static);
/// ```
///
/// The path is relative to the crate's `Cargo.toml`. Behind it, in any order:
///
/// - `VARIANT = CHOICE` picks a variant,
/// - `sensitivities = [NAMES]` restricts the parameters to which sensitivities are generated; all
///   of them without it,
/// - `as NAME` names the module; it has the model's name without it.
///
/// The module holds `Model`, which implements `dgd::System`, and `Parameters`, `Inputs`,
/// `Unknowns` and `Outputs` with one named field each, in SI units; `Parameters::default()` has the
/// file's values. An edit of the file, or of a library that it imports, rebuilds the crate.
///
/// # Errors
///
/// A mistake in the file is one compile error that shows file, line and caret.
#[proc_macro]
pub fn model(input: proc_macro::TokenStream) -> proc_macro::TokenStream {
    match syn::parse::<input::Input>(input) {
        Ok(input) => expand::expand(&input).into(),
        Err(error) => error.to_compile_error().into(),
    }
}
