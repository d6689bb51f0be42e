//! What stands in for a model that has mistakes: its types without its fields.

use proc_macro2::{Ident, Span, TokenStream};
use quote::quote;

use crate::input::Input;

/// A module with the names that a user imports, so that rustc reports the model's own mistake and
/// not that its module is missing.
pub(crate) fn stub(input: &Input) -> TokenStream {
    let module = input.module.clone().or_else(|| {
        let path = input.path.value();
        let stem = std::path::Path::new(&path).file_stem()?.to_str()?.to_owned();
        syn::parse_str::<Ident>(&stem).ok()
    });
    let module = module.unwrap_or_else(|| Ident::new("model", Span::call_site()));
    quote! {
        #[allow(missing_docs, dead_code)]
        pub mod #module {
            #[derive(Debug, Clone, Copy, Default)]
            pub struct Model;
            #[derive(Debug, Clone, Copy, Default)]
            pub struct Parameters;
            #[derive(Debug, Clone, Copy, Default)]
            pub struct Inputs;
            #[derive(Debug, Clone, Copy, Default)]
            pub struct Unknowns;
            #[derive(Debug, Clone, Copy, Default)]
            pub struct Outputs;
        }
    }
}
