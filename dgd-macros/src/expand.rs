//! From the macro's arguments to the generated module, or to one compile error.

use std::path::{Path, PathBuf};

use dgd_compiler::codegen;
use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{Directions, compile};
use dgd_compiler::source::{Source, SourceId, Sources, Span};
use dgd_compiler::syntax::ast::Name;
use proc_macro2::TokenStream;
use quote::{quote, quote_spanned};
use syn::Ident;

use crate::fallback;
use crate::input::Input;

pub(crate) fn expand(input: &Input) -> TokenStream {
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let path = input.path.value();
    let text = match read(&root, &path) {
        Ok(text) => text,
        Err(reason) => {
            let message = format!("cannot read `{path}`: {reason}");
            return failure(input, &root, &Sources::default(), &message);
        }
    };

    let mut sources = Sources::default();
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
        settings: Vec::new(),
    };
    let directions = match &input.sensitivities {
        None => Directions::All,
        Some(names) => {
            Directions::Named(names.iter().map(|name| argument(name, &mut sources)).collect())
        }
    };
    let compiled = compile(
        Source { name: path, text },
        &options,
        &directions,
        &mut |path| read(&root, path),
        &mut sources,
        &mut diagnostics,
    );
    match compiled {
        Ok(compiled) => {
            let name = input.module.as_ref().map(ToString::to_string);
            let name = name.as_deref().unwrap_or(&compiled.program.name);
            let module = codegen::generate(&compiled.program, name, &sources);
            let tracked = track(&root, &sources);
            quote!(#module #tracked)
        }
        Err(_) => {
            let message = render::render(&diagnostics.sorted(), &sources, render::Style::Plain);
            failure(input, &root, &sources, &message)
        }
    }
}

/// An argument of the macro as a name with a place of its own.
fn argument(ident: &Ident, sources: &mut Sources) -> Name {
    let text = ident.to_string();
    let end = u32::try_from(text.len()).unwrap_or(u32::MAX);
    let source: SourceId =
        sources.add(Source { name: "dgd::model!".to_owned(), text: text.clone() });
    Name { text, span: Span { source, start: 0, end } }
}

fn read(root: &Path, path: &str) -> Result<String, String> {
    std::fs::read_to_string(root.join(path)).map_err(|error| error.to_string())
}

/// One error that shows the rendered diagnostics, and a stub so that no other follows from it.
fn failure(input: &Input, root: &Path, sources: &Sources, message: &str) -> TokenStream {
    let span = input.path.span();
    let error = quote_spanned!(span=> ::core::compile_error!(#message););
    let stub = fallback::stub(input);
    let tracked = track(root, sources);
    quote!(#error #stub #tracked)
}

/// Makes cargo rebuild when one of the files changes.
fn track(root: &Path, sources: &Sources) -> TokenStream {
    let files = sources
        .iter()
        .map(|source| root.join(&source.name))
        .filter(|path| path.is_file())
        .map(|path| path.to_string_lossy().into_owned());
    quote!(#(const _: &[u8] = ::core::include_bytes!(#files);)*)
}
