//! Names, numbers and comments of a model as tokens.

use proc_macro2::{Ident, Span, TokenStream};
use quote::quote;

/// A name of the model as an identifier of Rust.
pub fn identifier(name: &str) -> Ident {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    // Names of parts contain a point; names that differ only in it were refused earlier.
    if name.contains('.') && name.chars().all(|c| is_word(c) || c == '.') {
        return identifier(&name.replace('.', "_"));
    }
    // Unknowns that were added, `der(x)`, `share(1)` and `x - y`, need spelling out. No name of a model begins with
    // `_`.
    if !name.chars().all(is_word) {
        return Ident::new(&spelt_out(name), Span::call_site());
    }
    match name {
        // Neither raw identifiers nor, where they are bound, names of constants.
        "self" | "Self" | "super" | "crate" | "None" | "Some" | "Ok" | "Err" | "Model"
        | "SIGNATURE" => Ident::new(&format!("_{name}"), Span::call_site()),
        _ if is_keyword(name) => Ident::new_raw(name, Span::call_site()),
        _ => Ident::new(name, Span::call_site()),
    }
}

/// `_der_x` for `der(x)`, `_x_minus_y` for `x - y`.
fn spelt_out(name: &str) -> String {
    let mut words = String::new();
    for c in name.chars() {
        words.push_str(match c {
            '-' => "_minus_",
            '+' => "_plus_",
            '*' => "_times_",
            '/' => "_over_",
            c if c.is_alphanumeric() || c == '_' => {
                words.push(c);
                continue;
            }
            _ => "_",
        });
    }
    let words: Vec<&str> = words.split('_').filter(|word| !word.is_empty()).collect();
    format!("_{}", words.join("_"))
}

fn is_keyword(name: &str) -> bool {
    const KEYWORDS: &[&str] = &[
        "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "do",
        "dyn", "else", "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl", "in",
        "let", "loop", "macro", "match", "mod", "move", "mut", "override", "priv", "pub", "ref",
        "return", "static", "struct", "trait", "true", "try", "type", "typeof", "unsafe",
        "unsized", "use", "virtual", "where", "while", "yield",
    ];
    KEYWORDS.contains(&name)
}

/// A size or position without the type suffix that `quote` would add.
pub(super) fn index(value: usize) -> proc_macro2::Literal {
    proc_macro2::Literal::usize_unsuffixed(value)
}

/// A number as a Rust literal that reads back as the same bits.
pub(super) fn number(value: f64) -> TokenStream {
    let magnitude = value.abs();
    let token = if magnitude.is_finite() {
        let text = format!("{magnitude:?}");
        let literal: proc_macro2::Literal = text
            .parse()
            .unwrap_or_else(|_| unreachable!("`{text}` is how Rust prints a finite number"));
        quote!(#literal)
    } else if magnitude.is_nan() {
        quote!(f64::NAN)
    } else {
        quote!(f64::INFINITY)
    };
    if value.is_sign_negative() && !value.is_nan() { quote!(-#token) } else { token }
}

pub(super) fn doc_attributes(lines: &[String]) -> Vec<TokenStream> {
    lines
        .iter()
        .map(|line| {
            let line = format!(" {}", line.trim());
            quote!(#[doc = #line])
        })
        .collect()
}
