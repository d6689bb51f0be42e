//! Program → Rust tokens: a module with the model's type, its named fields and its functions.
//!
//! Generated code is meant to be read. It refers only to `::core` and `::dgd::__runtime`, keeps the model's names, and
//! cites the source position of each equation. Its own names begin with an underscore, unlike any name of a model.

mod curves;
mod fields;
mod fragment;
mod function;
mod lanes;
mod literals;
mod loops;
mod row_docs;
mod signature;
mod taylor;

use proc_macro2::TokenStream;
use quote::quote;

use dgd_signature::Features;

use crate::program::Program;
use crate::source::SourceMap;
pub use literals::identifier;
use literals::{doc_attributes, index};

/// Models with at most this many unknowns, and this many sensitivities, keep their numbers in arrays on the stack. A
/// solver keeps about thirty arrays of sensitivities: 120 kB at most.
const MOST_UNKNOWNS_ON_STACK: usize = 24;
const MOST_SENSITIVITIES_ON_STACK: usize = 512;

/// The module of a program under this name; `sources` are its source files.
pub fn generate(program: &Program, module: &str, sources: &SourceMap) -> TokenStream {
    let module = identifier(module);
    let doc = doc_attributes(&program.source.doc);
    let structs = fields::structs(program);
    let signature = signature::signature(program);
    let curves = curves::statics(program);
    let system = system_impl(program, sources);
    quote! {
        #(#doc)*
        #[allow(
            non_snake_case,
            unused_variables,
            unused_doc_comments,
            dead_code,
            clippy::all,
            clippy::pedantic
        )]
        pub mod #module {
            #structs
            #signature
            #curves
            #system
        }
    }
}

fn system_impl(program: &Program, sources: &SourceMap) -> TokenStream {
    let n = program.n();
    let n_s = program.signature.directions.len();
    let on_stack = n <= MOST_UNKNOWNS_ON_STACK && n * n_s <= MOST_SENSITIVITIES_ON_STACK;
    let storage = |len: usize| {
        if on_stack {
            let len = index(len);
            quote!([f64; #len])
        } else {
            quote!(::dgd::__runtime::codegen::HeapNumbers)
        }
    };
    let vector = storage(n);
    let sensitivity = storage(n * n_s);
    let inputs = storage(program.signature.n_u());
    let jacobian = storage(program.signature.jacobian.len());
    let dgdy = storage(program.signature.sensitivity_jacobian.len());
    let factorisation = if on_stack {
        let n = index(n);
        quote!(::dgd::__runtime::linalg::FixedLu<#n>)
    } else {
        quote!(::dgd::__runtime::linalg::AutoLu)
    };
    let features = features(program);
    let functions = program
        .functions
        .iter()
        .filter(|function| program.computes(function.kind))
        .map(|function| function::method(program, function, sources));
    let taylor = taylor::methods(program);
    let lanes = on_stack.then(|| lanes::methods(program));
    let rest = program.signature.start_is_found().then(|| {
        quote! {
            fn find_start(
                problem: &::dgd::__runtime::Problem<'_, Self>,
                t: f64,
                options: &::dgd::__runtime::Options,
                y: &mut [f64],
                s: ::core::option::Option<&mut [f64]>,
            ) -> ::core::result::Result<(), ::dgd::__runtime::InitialError> {
                ::dgd::__runtime::linearize::find_start(problem, t, options, y, s)
            }
        }
    });
    quote! {
        #[automatically_derived]
        impl ::dgd::__runtime::System for Model {
            type Vector = #vector;
            type Sensitivity = #sensitivity;
            type Inputs = #inputs;
            type Jacobian = #jacobian;
            type SensitivityJacobian = #dgdy;

            #features

            #[inline]
            fn signature(&self) -> &::dgd::__runtime::signature::Signature {
                &SIGNATURE
            }

            #(#functions)*
            #taylor
        }

        #[automatically_derived]
        impl ::dgd::__runtime::SolvableSystem for Model {
            type Factorisation = #factorisation;

            fn integrate(
                problem: &::dgd::__runtime::Problem<'_, Self>,
                times: &[f64],
                options: &::dgd::__runtime::Options,
                wanted: ::dgd::__runtime::WantedResults<'_>,
            ) -> ::core::result::Result<::dgd::__runtime::Solution, ::dgd::__runtime::Failure> {
                ::dgd::__runtime::integrate::integrate(problem, times, options, wanted)
            }

            #rest

            #lanes
        }
    }
}

/// Flags that let a solver skip work that this model does not need.
fn features(program: &Program) -> TokenStream {
    let Features { events, past, algebraic, conserved } = program.features;
    quote! {
        const FEATURES: ::dgd::__runtime::signature::Features =
            ::dgd::__runtime::signature::Features {
                events: #events,
                past: #past,
                algebraic: #algebraic,
                conserved: #conserved,
            };
    }
}
