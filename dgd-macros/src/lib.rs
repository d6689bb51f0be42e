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
/// The path is relative to the crate's `Cargo.toml`; one that begins with `./` or `../` is relative
/// to the Rust file. Behind it, in any order:
///
/// - `VARIANT = CHOICE` picks a variant,
/// - `SIZE = NUMBER` gives a `size` another value,
/// - `sensitivities = [NAMES]` says to which parameters, and to which states' start values,
///   sensitivities are generated; to all parameters without it,
/// - `as NAME` names the module; it has the model's name without it.
///
/// The module holds `Model`, which implements `dgd::System`, and `Parameters`, `Inputs`,
/// `Unknowns` and `Outputs` with one named field each, in SI units; `Parameters::default()` has the
/// file's values. An edit of the file, or of a library that it imports, rebuilds the crate.
///
/// # Errors
///
/// Mistakes in the file are one compile error that shows file, line and caret of each. The module is
/// there all the same, with the fields that could be read and no physics, so that no error about
/// its uses follows.
#[proc_macro]
pub fn model(input: proc_macro::TokenStream) -> proc_macro::TokenStream {
    match syn::parse::<input::Input>(input) {
        Ok(input) => expand::expand(&input, &folder(&input)).into(),
        Err(error) => error.to_compile_error().into(),
    }
}

/// What the path is relative to.
fn folder(input: &input::Input) -> PathBuf {
    let path = input.path.value();
    let beside = path.starts_with("./") || path.starts_with("../");
    // An editor's analysis may not know the file.
    let file = beside.then(|| input.path.span().unwrap().local_file()).flatten();
    match file.as_deref().and_then(Path::parent).map(std::path::absolute) {
        Some(Ok(folder)) => folder,
        Some(Err(_)) | None => std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default().into(),
    }
}
