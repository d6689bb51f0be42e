//! Writes of a function with rows of arrays: single values one by one, families in loops.

use std::collections::BTreeMap;

use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};

use super::fragment::{CodeFragment, DEEPEST_PIECE, piece_of, place};
use super::literals::index;
use super::row_docs::{doc_of_row, family_doc};
use crate::program::{
    FunctionKind, Loop, LoopStore, Program, ProgramFunction, ProgramOperation, ValueId,
};
use crate::source::SourceMap;

/// Writes all results; `pieces` are those of the function's body.
pub(super) fn writes(
    program: &Program,
    function: &ProgramFunction,
    results: &[Ident],
    pieces: &mut BTreeMap<ValueId, CodeFragment>,
    sources: &SourceMap,
) -> TokenStream {
    let is_rhs = function.kind == FunctionKind::Rhs;
    let mut out = TokenStream::new();
    for (r, (values, name)) in function.results.iter().zip(results).enumerate() {
        let len = index(function.lengths[r]);
        out.extend(quote!(let #name = ::dgd::__runtime::codegen::fixed_mut::<#len>(#name);));
        for (i, value) in values.iter().enumerate() {
            let place = function.places[r].as_ref().map_or(i, |places| places[i]);
            let value = &pieces[value].tokens;
            let position = index(place);
            out.extend(if is_rhs {
                let doc = doc_of_row(program, place, sources);
                quote!(#[doc = #doc] let _row: f64 = #value; #name[#position] = _row;)
            } else {
                quote!(#name[#position] = #value;)
            });
        }
    }
    for part in &function.loops {
        let (head, body) = statements(part, function.body.len(), pieces);
        let stores = part.stores.iter().map(|LoopStore { result, first, by_round, value }| {
            let (name, at) = (&results[*result], place(*first, *by_round, part.count > 1));
            let value = &pieces[value].tokens;
            if is_rhs {
                let doc = family_doc(program, *first, part.rounds > 1, sources);
                quote!(#[doc = #doc] let _row: f64 = #value; #name[#at] = _row;)
            } else {
                quote!(#name[#at] = #value;)
            }
        });
        let passages = quote!(#(#body)* #(#stores)*);
        let passages = match part.count {
            1 => passages,
            count => {
                let count = index(count as usize);
                quote!(for _k in 0..#count { #passages })
            }
        };
        out.extend(match part.rounds {
            1 => passages,
            rounds => {
                let rounds = index(rounds as usize);
                quote!(for _r in 0..#rounds { #(#head)* #passages })
            }
        });
    }
    out
}

/// The operations of a loop's rounds and of its passages. A value used once is written inline, but the values of a
/// round are computed before its passages.
fn statements(
    part: &Loop,
    begin: usize,
    pieces: &mut BTreeMap<ValueId, CodeFragment>,
) -> (Vec<TokenStream>, Vec<TokenStream>) {
    let head = part.head.len();
    let mut uses = vec![0_u32; head + part.body.len()];
    for value in part.reads() {
        if let Some(own) = value.index().checked_sub(begin) {
            uses[own] += 1;
        }
    }
    if part.count > 1 {
        let of_passages = part.body.iter().flat_map(|operation| operation.operands());
        for value in of_passages.chain(part.stores.iter().map(|store| store.value)) {
            if let Some(own) = value.index().checked_sub(begin).filter(|own| *own < head) {
                uses[own] += 2;
            }
        }
    }
    let mut statements = Vec::new();
    let mut of_rounds = Vec::new();
    for (i, operation) in part.operations().enumerate() {
        if i == head {
            of_rounds = std::mem::take(&mut statements);
        }
        let value = ValueId((begin + i) as u32);
        let mut piece = piece_of(*operation, pieces);
        let is_leaf = matches!(operation, ProgramOperation::Counter | ProgramOperation::Round);
        if !is_leaf && (uses[i] > 1 || piece.depth > DEEPEST_PIECE) {
            let (name, tokens) = (format_ident!("_v{}", value.0), piece.tokens);
            statements.push(quote!(let #name = #tokens;));
            piece = CodeFragment::atom(quote!(#name));
        }
        pieces.insert(value, piece);
    }
    if part.body.is_empty() {
        return (statements, Vec::new());
    }
    (of_rounds, statements)
}
