//! Parses the arguments of `dgd::model!`.

use std::fmt::Write as _;

use syn::ext::IdentExt;
use syn::parse::{Parse, ParseStream};
use syn::token::Bracket;
use syn::{Ident, LitInt, LitStr, Token, bracketed};

/// The arguments of `dgd::model!`.
pub(crate) struct MacroInput {
    /// Path of the file, relative to the crate's manifest.
    pub(crate) path: LitStr,
    /// `variant = choice`.
    pub(crate) variants: Vec<(String, String)>,
    /// `SIZE = number`.
    pub(crate) sizes: Vec<(String, String)>,
    /// `sensitivities = [a, b]`; `None` means all parameters.
    pub(crate) sensitivities: Option<Vec<String>>,
    /// `as name`.
    pub(crate) module: Option<Ident>,
}

impl Parse for MacroInput {
    fn parse(input: ParseStream<'_>) -> syn::Result<Self> {
        let mut parsed = MacroInput {
            path: input.parse()?,
            variants: Vec::new(),
            sizes: Vec::new(),
            sensitivities: None,
            module: None,
        };
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
            let name = dotted(input)?;
            input.parse::<Token![=]>()?;
            if name == "sensitivities" {
                let list;
                bracketed!(list in input);
                let names = list.parse_terminated(element, Token![,])?;
                parsed.sensitivities = Some(names.into_iter().collect());
            } else if input.peek(LitInt) {
                let size: LitInt = input.parse()?;
                parsed.sizes.push((name, size.base10_digits().to_owned()));
            } else {
                parsed.variants.push((name, dotted(input)?));
            }
        }
        Ok(parsed)
    }
}

/// A name of the model or an element of an array, `T[2]`.
fn element(input: ParseStream<'_>) -> syn::Result<String> {
    let mut name = dotted(input)?;
    while input.peek(Bracket) {
        let index;
        bracketed!(index in input);
        let sign = if index.parse::<Option<Token![-]>>()?.is_some() { "-" } else { "" };
        let digits = index.parse::<LitInt>()?;
        let _ = write!(name, "[{sign}{}]", digits.base10_digits());
    }
    Ok(name)
}

/// A name of the model, with dots for a part's: `pump.flow`.
fn dotted(input: ParseStream<'_>) -> syn::Result<String> {
    let mut name = Ident::parse_any(input)?.unraw().to_string();
    while input.parse::<Option<Token![.]>>()?.is_some() {
        name.push('.');
        name.push_str(&Ident::parse_any(input)?.unraw().to_string());
    }
    Ok(name)
}
