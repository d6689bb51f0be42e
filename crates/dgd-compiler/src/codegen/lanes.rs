//! The functions at several points at once: loops, of fixed sizes, over those for one point.

use proc_macro2::TokenStream;
use quote::quote;

use super::literals::index;
use crate::program::Program;

/// Methods of `SolvableSystem` for ensembles; none for models with discrete numbers, which ensembles do not support.
pub(super) fn methods(program: &Program) -> TokenStream {
    let signature = &program.signature;
    if !signature.discrete.is_empty() {
        return TokenStream::new();
    }
    let [n, n_u, n_p] = [program.n(), signature.n_u(), signature.parameters.len()].map(index);
    let n_w = index(signature.outputs.len());
    let places = index(signature.jacobian.len());
    let lanes = quote!(::dgd::__runtime::ensemble::lanes);
    quote! {
        #[inline(always)]
        fn rhs_lanes(&self, _at: #lanes::LanePoint<'_>, _f: &mut [#lanes::Lanes]) {
            #lanes::rhs::<Self, #n, #n_u, #n_p>(self, _at, _f);
        }

        #[inline(always)]
        fn linearize_lanes(
            &self,
            _at: #lanes::LanePoint<'_>,
            _udot: &[#lanes::Lanes],
            _f: &mut [#lanes::Lanes],
            _jacobian: &mut [#lanes::Lanes],
            _dfdt: &mut [#lanes::Lanes],
        ) {
            #lanes::linearize::<Self, #n, #n_u, #n_p, #places>(
                self, _at, _udot, _f, _jacobian, _dfdt,
            );
        }

        #[inline(always)]
        fn outputs_lanes(&self, _at: #lanes::LanePoint<'_>, _w: &mut [#lanes::Lanes]) {
            #lanes::outputs::<Self, #n, #n_u, #n_p, #n_w>(self, _at, _w);
        }
    }
}
