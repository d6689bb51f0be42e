//! The model's type, and its parameters, inputs, unknowns and outputs as named fields.

use proc_macro2::{Ident, Span, TokenStream};
use quote::quote;

use dgd_signature::Unit;

use super::literals::{doc_attributes, identifier, index, number};
use crate::program::{Program, QuantityDescription};
use crate::units::describe;

/// One field.
struct GeneratedField<'a> {
    name: &'a str,
    unit: &'a Unit,
    told: &'a QuantityDescription,
    default: f64,
}

pub(super) fn structs(program: &Program) -> TokenStream {
    let Program { signature, source, .. } = program;
    let field = |((name, unit, default), told)| GeneratedField { name, unit, told, default };
    let parameters = signature.parameters.iter().map(|p| (&*p.name, &p.unit, p.value));
    let parameters: Vec<GeneratedField<'_>> =
        parameters.zip(&source.parameters).map(field).collect();
    let inputs = signature.inputs.iter().map(|x| (&*x.name, &x.unit, 0.0));
    let inputs: Vec<GeneratedField<'_>> = inputs.zip(&source.inputs).map(field).collect();
    let unknowns = signature.unknowns.single.iter().map(|x| (&*x.name, &x.unit, 0.0));
    let unknowns: Vec<GeneratedField<'_>> = unknowns.zip(&source.unknowns).map(field).collect();
    let outputs = program.single_outputs().iter().map(|x| (&*x.name, &x.unit, 0.0));
    let outputs: Vec<GeneratedField<'_>> = outputs.zip(&source.outputs).map(field).collect();
    let parameters =
        structure("Parameters", "Parameters p; the default is the model file's.", &parameters);
    let inputs = structure("Inputs", "Inputs u.", &inputs);
    let arrays = signature.unknowns.arrays.iter().map(|x| (&*x.name, &x.unit, x.count));
    let arrays = array_fields(unknowns.len(), arrays.zip(&source.arrays));
    let unknowns = structure_with_arrays("Unknowns", "Unknowns y.", &unknowns, &arrays);
    let arrays = program.output_arrays.iter().map(|x| (&*x.name, &x.unit, x.count));
    let arrays = array_fields(outputs.len(), arrays.zip(&source.output_arrays));
    let outputs = structure_with_arrays("Outputs", "Outputs w.", &outputs, &arrays);
    let doc = format!(" The model `{}`.", signature.name);
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

fn structure(name: &str, about: &str, fields: &[GeneratedField<'_>]) -> TokenStream {
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
        impl ::core::convert::From<&#name> for ::dgd::__runtime::codegen::HeapNumbers {
            fn from(named: &#name) -> ::dgd::__runtime::codegen::HeapNumbers {
                <[f64; #len]>::from(*named).to_vec()
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
    field: GeneratedField<'a>,
    /// Position of its first element.
    first: usize,
    count: usize,
}

/// Arrays one after the other, from a position on.
fn array_fields<'a>(
    mut next: usize,
    arrays: impl Iterator<Item = ((&'a str, &'a Unit, usize), &'a QuantityDescription)>,
) -> Vec<ArrayField<'a>> {
    let field = |((name, unit, count), told)| {
        let first = next;
        next += count;
        ArrayField { field: GeneratedField { name, unit, told, default: 0.0 }, first, count }
    };
    arrays.map(field).collect()
}

/// A structure with single fields, then arrays.
fn structure_with_arrays(
    name: &str,
    about: &str,
    single: &[GeneratedField<'_>],
    all: &[ArrayField<'_>],
) -> TokenStream {
    if all.is_empty() {
        return structure(name, about, single);
    }
    let structure = Ident::new(name, Span::call_site());
    let about = format!(" {about} All in SI units.");
    let len = index(single.len() + all.iter().map(|array| array.count).sum::<usize>());
    let names: Vec<Ident> = single.iter().map(|field| identifier(field.name)).collect();
    let docs = single.iter().map(field_doc);
    let positions: Vec<_> = (0..single.len()).map(index).collect();
    let arrays: Vec<Ident> = all.iter().map(|array| identifier(array.field.name)).collect();
    let array_docs = all.iter().map(|array| field_doc(&array.field));
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
        impl ::core::convert::From<&#structure> for ::dgd::__runtime::codegen::HeapNumbers {
            fn from(named: &#structure) -> ::dgd::__runtime::codegen::HeapNumbers {
                <[f64; #len]>::from(*named).to_vec()
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

fn field_doc(field: &GeneratedField<'_>) -> TokenStream {
    let mut lines = field.told.doc.clone();
    let si = describe(field.told.dimension);
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
