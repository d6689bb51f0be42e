//! The model's type, and its parameters, inputs, unknowns and outputs as named fields.

use proc_macro2::{Ident, Span, TokenStream};
use quote::quote;

use super::{doc_attributes, identifier, index, number};
use crate::model::Declared;
use crate::program::Program;
use crate::units::{Unit, describe};

/// One field.
struct Field<'a> {
    name: &'a str,
    unit: &'a Unit,
    doc: &'a [String],
    default: f64,
}

impl<'a> Field<'a> {
    fn declared(declared: &'a Declared, default: f64) -> Self {
        Field { name: &declared.name, unit: &declared.unit, doc: &declared.doc, default }
    }
}

pub(super) fn structs(program: &Program) -> TokenStream {
    let parameters: Vec<Field<'_>> =
        program.parameters.iter().map(|p| Field::declared(&p.declared, p.value)).collect();
    let inputs: Vec<Field<'_>> =
        program.inputs.iter().map(|x| Field::declared(&x.declared, 0.0)).collect();
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
    let parameters =
        structure("Parameters", "Parameters p; the default is the model file's.", &parameters);
    let inputs = structure("Inputs", "Inputs u.", &inputs);
    let unknowns = if program.arrays.is_empty() {
        structure("Unknowns", "Unknowns y.", &unknowns)
    } else {
        let arrays = program.arrays.iter().map(|array| ArrayField {
            name: &array.name,
            unit: &array.unit,
            doc: &array.doc,
            first: array.first,
            count: array.count as usize,
        });
        structure_with_arrays("Unknowns", "Unknowns y.", &unknowns, &arrays.collect::<Vec<_>>())
    };
    let outputs = if program.output_arrays.is_empty() {
        structure("Outputs", "Outputs w.", &outputs)
    } else {
        let arrays = program.output_arrays.iter().map(|array| ArrayField {
            name: &array.name,
            unit: &array.unit,
            doc: &array.doc,
            first: array.first,
            count: array.count as usize,
        });
        structure_with_arrays("Outputs", "Outputs w.", &outputs, &arrays.collect::<Vec<_>>())
    };
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
    let len = index(fields.len());
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

/// A field that is an array.
struct ArrayField<'a> {
    name: &'a str,
    unit: &'a Unit,
    doc: &'a [String],
    /// Position of its first element.
    first: usize,
    count: usize,
}

/// A structure with single fields, then arrays.
fn structure_with_arrays(
    name: &str,
    about: &str,
    single: &[Field<'_>],
    all: &[ArrayField<'_>],
) -> TokenStream {
    let structure = Ident::new(name, Span::call_site());
    let about = format!(" {about} All in SI units.");
    let len = index(single.len() + all.iter().map(|array| array.count).sum::<usize>());
    let names: Vec<Ident> = single.iter().map(|field| identifier(field.name)).collect();
    let docs = single.iter().map(field_doc);
    let positions: Vec<_> = (0..single.len()).map(index).collect();
    let arrays: Vec<Ident> = all.iter().map(|array| identifier(array.name)).collect();
    let array_docs = all.iter().map(|array| {
        let ArrayField { name, unit, doc, .. } = array;
        field_doc(&Field { name, unit, doc, default: 0.0 })
    });
    let counts: Vec<_> = all.iter().map(|array| index(array.count)).collect();
    let begins: Vec<_> = all.iter().map(|array| index(array.first)).collect();
    let ends: Vec<_> = all.iter().map(|array| index(array.first + array.count)).collect();
    quote! {
        #[doc = #about]
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct #structure {
            #(#docs pub #names: f64,)*
            #(#array_docs pub #arrays: [f64; #counts],)*
        }

        #[automatically_derived]
        impl ::core::default::Default for #structure {
            fn default() -> Self {
                #structure { #(#names: 0.0,)* #(#arrays: [0.0; #counts],)* }
            }
        }

        #[automatically_derived]
        impl ::core::convert::From<#structure> for [f64; #len] {
            fn from(named: #structure) -> [f64; #len] {
                let mut all = [0.0; #len];
                #(all[#positions] = named.#names;)*
                #(all[#begins..#ends].copy_from_slice(&named.#arrays);)*
                all
            }
        }

        #[automatically_derived]
        impl ::core::convert::From<[f64; #len]> for #structure {
            fn from(all: [f64; #len]) -> #structure {
                #structure {
                    #(#names: all[#positions],)*
                    #(#arrays: *::dgd::__runtime::codegen::fixed::<#counts>(&all[#begins..#ends]),)*
                }
            }
        }
    }
}

fn field_doc(field: &Field<'_>) -> TokenStream {
    let mut lines = field.doc.to_vec();
    let si = describe(field.unit.dimension);
    let unit = if field.unit.symbol == si {
        format!("[{si}]")
    } else {
        format!("[{si}], declared in {}", field.unit.symbol)
    };
    if lines.is_empty() {
        lines.push(unit);
    } else {
        lines.extend([String::new(), unit]);
    }
    let attributes = doc_attributes(&lines);
    quote!(#(#attributes)*)
}
