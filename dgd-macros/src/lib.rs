//! `dgd::model!`, the proc-macro that compiles a `.dgd` file into Rust.

mod expand;
mod fallback;
mod input;

use std::path::{Path, PathBuf};

/// Compiles a `.dgd` file into a module with the model's type and its named fields.
///
/// ```text
/// dgd::model!("models/mud_circulation.dgd");
/// dgd::model!("models/mud_circulation.dgd", flow = static);
/// dgd::model!("models/mud_circulation.dgd", sensitivities = [c0, c2], as quasi_static);
/// dgd::model!("models/transmission_line.dgd", N = 1000);
/// ```
///
/// The path is relative to the crate's `Cargo.toml`; one that begins with `./` or `../` is relative to the Rust file.
/// It is followed, in any order, by:
///
/// - `VARIANT = CHOICE` picks a variant,
/// - `SIZE = NUMBER` sets the value of a `size`,
/// - `sensitivities = [NAMES]` chooses the parameters and states' start values for which sensitivities are generated,
///   elements of arrays too, as in `k[2]`;
///   without it, all parameters,
/// - `as NAME` names the module; without it, the module has the model's name.
///
/// The module holds `Model`, which implements `dgd::System`, and `Parameters`, `Inputs`,
/// `Unknowns` and `Outputs` with one named field each, in SI units; `Parameters::default()` has the
/// file's values. An edit of the file, or of a library that it imports, rebuilds the crate.
///
/// # Errors
///
/// Errors in the file give one compile error that shows file, line and caret of each. The module still exists, with the
/// fields that could be read but without physics, so that no errors about its uses follow.
#[proc_macro]
pub fn model(input: proc_macro::TokenStream) -> proc_macro::TokenStream {
    match syn::parse::<input::MacroInput>(input) {
        Ok(input) => expand::expand(&input, &folder(&input)).into(),
        Err(error) => error.to_compile_error().into(),
    }
}

/// The folder to which the path is relative.
fn folder(input: &input::MacroInput) -> PathBuf {
    let path = input.path.value();
    let beside = path.starts_with("./") || path.starts_with("../");
    // An editor's analysis may not know the file.
    let file = beside.then(|| input.path.span().unwrap().local_file()).flatten();
    match file.as_deref().and_then(Path::parent).map(std::path::absolute) {
        Some(Ok(folder)) => folder,
        Some(Err(_)) | None => std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default().into(),
    }
}
