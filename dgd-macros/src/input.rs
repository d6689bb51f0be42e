//! What stands between the parentheses of `dgd::model!`.

use syn::parse::{Parse, ParseStream};
use syn::{Ident, LitStr, Token, bracketed};

/// The arguments of `dgd::model!`.
pub(crate) struct Input {
    /// Path of the file, relative to the crate's manifest.
    pub(crate) path: LitStr,
    /// `variant = choice`.
    pub(crate) variants: Vec<(Ident, Ident)>,
    /// `sensitivities = [a, b]`; all parameters without it.
    pub(crate) sensitivities: Option<Vec<Ident>>,
    /// `as name`.
    pub(crate) module: Option<Ident>,
}

impl Parse for Input {
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        let mut parsed =
            Input { path: input.parse()?, variants: Vec::new(), sensitivities: None, module: None };
        while !input.is_empty() {
            input.parse::<Token![,]>()?;
            if input.is_empty() {
                break;
            }
            if input.parse::<Option<Token![as]>>()?.is_some() {
                parsed.module = Some(input.parse()?);
                continue;
            }
            // Choices may be keywords of Rust: `flow = static`.
            let name: Ident = syn::ext::IdentExt::parse_any(input)?;
            input.parse::<Token![=]>()?;
            if name == "sensitivities" {
                let list;
                bracketed!(list in input);
                let names = list.parse_terminated(syn::ext::IdentExt::parse_any, Token![,])?;
                parsed.sensitivities = Some(names.into_iter().collect());
            } else {
                parsed.variants.push((name, syn::ext::IdentExt::parse_any(input)?));
            }
        }
        Ok(parsed)
    }
}
