//! Turns the macro's arguments into the generated module, or one compile error.

use std::io::Read as _;
use std::path::Path;

use dgd_compiler::codegen;
use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::{ModelOptions, Setting};
use dgd_compiler::pipeline::{SensitivityDirections, compile};
use dgd_compiler::source::{SourceId, SourceMap, SourceText, Span};
use dgd_compiler::syntax::ast::Name;
use dgd_compiler::syntax::imports::verify_import;
use dgd_compiler::syntax::parse_setting;
use flate2::read::MultiGzDecoder;
use proc_macro2::TokenStream;
use quote::{quote, quote_spanned};

use crate::fallback;
use crate::input::MacroInput;

/// The module of the model at `input.path` in `folder`.
pub(crate) fn expand(input: &MacroInput, folder: &Path) -> TokenStream {
    let path = input.path.value();
    let text = match read(folder, &path) {
        Ok(text) => text,
        Err(reason) => {
            let message = format!("cannot read `{path}`: {reason}");
            return failure(input, folder, "", &SourceMap::default(), &message);
        }
    };

    let mut sources = SourceMap::default();
    let mut diagnostics = Diagnostics::default();
    // The arguments are a source of their own, so that a diagnostic can point into them.
    let options = ModelOptions {
        variants: input
            .variants
            .iter()
            .map(|(variant, choice)| {
                (argument(variant, &mut sources), argument(choice, &mut sources))
            })
            .collect(),
        settings: input
            .sizes
            .iter()
            .filter_map(|(name, number)| size(name, number, &mut sources, &mut diagnostics))
            .collect(),
        ..ModelOptions::default()
    };
    let directions = match &input.sensitivities {
        None => SensitivityDirections::All,
        Some(names) => SensitivityDirections::Named(
            names.iter().map(|name| argument(name, &mut sources)).collect(),
        ),
    };
    let compiled = compile(
        SourceText { name: path.clone(), text: text.clone() },
        &options,
        &directions,
        &mut |path| read(folder, path),
        &mut sources,
        &mut diagnostics,
    );
    let Ok(compiled) = compiled else {
        let shown = render::render(&diagnostics.sorted(), &sources, render::RenderStyle::Plain);
        let message = format!("`{path}` cannot be compiled\n\n{}", shown.trim_end());
        return failure(input, folder, &text, &sources, &message);
    };
    let name = input.module.as_ref().map(ToString::to_string);
    let name = name.as_deref().unwrap_or(&compiled.program.signature.name);
    let module = codegen::generate(&compiled.program, name, &sources);
    let tracked = track(folder, &sources);
    quote!(#module #tracked)
}

/// An argument of the macro as a name with its own span.
fn argument(name: &str, sources: &mut SourceMap) -> Name {
    let text = name.to_owned();
    let end = u32::try_from(text.len()).unwrap_or(u32::MAX);
    let source: SourceId =
        sources.add(SourceText { name: "dgd::model!".to_owned(), text: text.clone() });
    Name { text, span: Span { source, start: 0, end } }
}

/// A size with the number given in the macro; errors go to the diagnostics.
fn size(
    name: &str,
    number: &str,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Option<Setting> {
    let text = format!("{name} = {number}");
    let source = sources.add(SourceText { name: "dgd::model!".to_owned(), text });
    let (name, value) = parse_setting(source, sources, diagnostics).ok()?;
    Some(Setting { name, value })
}

/// Reads an imported file, whose name the compiler has checked. Only regular files: others may block or never end.
fn read(folder: &Path, path: &str) -> Result<String, String> {
    let path = folder.join(path);
    let target = path.canonicalize().map_err(|error| error.to_string())?;
    verify_import(if target.is_file() { &target } else { Path::new("") })?;
    if target.extension().is_some_and(|ending| ending == "gz") {
        let mut text = String::new();
        let file = std::fs::File::open(target).map_err(|error| error.to_string())?;
        let read = MultiGzDecoder::new(file).read_to_string(&mut text);
        return read.map(|_| text).map_err(|error| error.to_string());
    }
    std::fs::read_to_string(target).map_err(|error| error.to_string())
}

/// One error with the rendered diagnostics, and a stub so that no further errors follow.
fn failure(
    input: &MacroInput,
    folder: &Path,
    text: &str,
    sources: &SourceMap,
    message: &str,
) -> TokenStream {
    let span = input.path.span();
    let error = quote_spanned!(span=> ::core::compile_error!(#message););
    let stub = fallback::stub(input, text, &mut |path| read(folder, path));
    let tracked = track(folder, sources);
    quote!(#error #stub #tracked)
}

/// Makes cargo rebuild when one of the files changes.
fn track(folder: &Path, sources: &SourceMap) -> TokenStream {
    let files = sources
        .iter()
        .map(|source| folder.join(&source.name))
        .filter(|path| path.is_file())
        .map(|path| path.to_string_lossy().into_owned());
    quote!(#(const _: &[u8] = ::core::include_bytes!(#files);)*)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_is_given_by_the_macro() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models");
        let arguments = "\"transmission_line.dgd\", N = 37, as line";
        let input = syn::parse_str(arguments).expect("arguments of the macro");
        let tokens = expand(&input, &folder).to_string();
        assert!(tokens.contains("pub p : [f64 ; 37]"), "{tokens}");
        let input = syn::parse_str("\"transmission_line.dgd\", M = 37").expect("arguments");
        assert!(expand(&input, &folder).to_string().contains("compile_error"));
    }

    #[test]
    fn an_edit_of_the_file_or_of_what_it_imports_rebuilds() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../models");
        let input = syn::parse_str("\"pipe_flow.dgd\"").expect("arguments of the macro");
        let tokens = expand(&input, &folder).to_string();
        for file in ["pipe_flow.dgd", "lib/friction.dgd"] {
            let path = folder.join(file).display().to_string();
            let tracked = quote!(::core::include_bytes!(#path)).to_string();
            assert!(tokens.contains(&tracked), "no {tracked}");
        }
    }
}
