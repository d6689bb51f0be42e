//! The model's type, and its parameters, inputs, unknowns and outputs as named fields.

use proc_macro2::{Ident, Span, TokenStream};
use quote::quote;

use super::{doc_attributes, identifier, number};
use crate::expr::display;
use crate::program::Program;
use crate::units::Unit;

/// One field.
struct Field<'a> {
    name: &'a str,
    unit: &'a Unit,
    doc: &'a [String],
    default: f64,
}

pub(super) fn structs(program: &Program) -> TokenStream {
    let parameters: Vec<Field<'_>> = program
        .parameters
        .iter()
        .map(|p| Field { name: &p.name, unit: &p.unit, doc: &p.doc, default: p.value })
        .collect();
    let inputs: Vec<Field<'_>> = program
        .inputs
        .iter()
        .map(|x| Field { name: &x.name, unit: &x.unit, doc: &x.doc, default: 0.0 })
        .collect();
    let unknowns: Vec<Field<'_>> = program
        .unknowns
        .iter()
        .map(|x| Field { name: &x.name, unit: &x.unit, doc: &x.doc, default: 0.0 })
        .collect();
    let outputs: Vec<Field<'_>> = program
        .outputs
        .iter()
        .map(|x| Field { name: &x.name, unit: &x.unit, doc: &x.doc, default: 0.0 })
        .collect();
    let parameters = structure("Parameters", "Parameters p; the default is the model file's.", &parameters);
    let inputs = structure("Inputs", "Inputs u.", &inputs);
    let unknowns = structure("Unknowns", "Unknowns y.", &unknowns);
    let outputs = structure("Outputs", "Outputs w.", &outputs);
    let doc = format!(" The model `{}`.", program.name);
    quote! {
        #[doc = #doc]
        #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
        pub struct Model;

        #parameters
        #inputs
        #unknowns
        #outputs
    }
}

fn structure(name: &str, about: &str, fields: &[Field<'_>]) -> TokenStream {
    let name = Ident::new(name, Span::call_site());
    let about = format!(" {about} All in SI units.");
    let len = fields.len();
    let names: Vec<Ident> = fields.iter().map(|field| identifier(field.name)).collect();
    let docs = fields.iter().map(field_doc);
    let defaults = fields.iter().map(|field| number(field.default));
    quote! {
        #[doc = #about]
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct #name {
            #(#docs pub #names: f64,)*
        }

        #[automatically_derived]
        impl ::core::default::Default for #name {
            fn default() -> Self {
                #name { #(#names: #defaults,)* }
            }
        }

        #[automatically_derived]
        impl ::core::convert::From<#name> for [f64; #len] {
            fn from(named: #name) -> [f64; #len] {
                [#(named.#names,)*]
            }
        }

        #[automatically_derived]
        impl ::core::convert::From<[f64; #len]> for #name {
            fn from([#(#names,)*]: [f64; #len]) -> #name {
                #name { #(#names,)* }
            }
        }
    }
}

fn field_doc(field: &Field<'_>) -> TokenStream {
    let mut lines = field.doc.to_vec();
    let unit = if field.unit.factor == 1.0 && field.unit.offset == 0.0 {
        format!("[{}]", field.unit.symbol)
    } else {
        format!("in SI; the model file has it in [{}], each {} SI", field.unit.symbol, display::number(field.unit.factor))
    };
    match lines.last_mut() {
        Some(last) => *last = format!("{last} {unit}"),
        None => lines.push(unit),
    }
    let attributes = doc_attributes(&lines);
    quote!(#(#attributes)*)
}
