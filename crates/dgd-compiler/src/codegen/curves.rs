//! Curves of tables as constants.

use std::collections::BTreeMap;

use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};

use super::literals::number;
use crate::expr::curve::CurveId;
use crate::program::{Loop, Program, ProgramOperation};

/// The curves that the functions of a program evaluate.
pub(super) fn statics(program: &Program) -> TokenStream {
    let of_functions = program.functions.iter().flat_map(|function| {
        let of_loops = function.loops.iter().flat_map(Loop::operations);
        function.body.iter().chain(of_loops)
    });
    let of_series = program
        .taylor
        .iter()
        .flat_map(|taylor| taylor.unknowns.body.iter().chain(&taylor.sensitivities.body));
    let mut curves: BTreeMap<Ident, CurveId> = BTreeMap::new();
    for operation in of_functions.chain(of_series) {
        if let ProgramOperation::Curve(curve, _) = operation {
            curves.insert(name(*curve), *curve);
        }
    }
    let statics = curves.into_iter().map(|(name, curve)| {
        let doc = format!(" `{}`", curve.get().name);
        let curve = &curve.get().curve;
        let knots = curve.knots.iter().map(|knot| number(*knot));
        let pieces = curve.pieces.iter().map(|piece| {
            let coefficients = piece.iter().map(|coefficient| number(*coefficient));
            quote!([#(#coefficients),*])
        });
        quote! {
            #[doc = #doc]
            static #name: ::dgd::__runtime::signature::Curve = ::dgd::__runtime::signature::Curve {
                knots: ::dgd::__runtime::signature::List::Borrowed(&[#(#knots),*]),
                pieces: ::dgd::__runtime::signature::List::Borrowed(&[#(#pieces),*]),
            };
        }
    });
    quote!(#(#statics)*)
}

/// A curve's name in generated code; equal curves share one.
pub(super) fn name(curve: CurveId) -> Ident {
    format_ident!("_CURVE_{:016X}", curve.digest())
}
