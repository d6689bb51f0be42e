//! One function of a program as a method of `System`.

use std::collections::{BTreeMap, BTreeSet};

use proc_macro2::{Ident, Span, TokenStream};
use quote::{format_ident, quote};

use dgd_signature::Signature;

use super::fragment::{CodeFragment, DEEPEST_PIECE, array, piece_of};
use super::literals::{identifier, index};
use super::loops;
use super::row_docs::doc_of_row;
use crate::program::{
    FunctionArgument, FunctionKind, Loop, Program, ProgramFunction, ProgramOperation, ResultKind,
    SharedSeries, ValueId,
};
use crate::source::SourceMap;

pub(super) fn method(
    program: &Program,
    function: &ProgramFunction,
    sources: &SourceMap,
) -> TokenStream {
    let spec = function.kind.spec();
    let name = Ident::new(spec.name, Span::call_site());
    let extra = spec.extra.iter().map(|argument| {
        let name = array(*argument);
        quote!(#name: &[f64],)
    });
    let results: Vec<Ident> = spec.results.iter().map(|kind| result_name(*kind)).collect();
    let bound_arrays = bind_arrays(program, function);
    let mut body = StatementWriter::new(program, function).statements();
    let body_statements = std::mem::take(&mut body.statements);
    if !function.loops.is_empty() || function.places.iter().any(Option::is_some) {
        let writes = loops::writes(program, function, &results, &mut body.pieces, sources);
        return quote! {
            #[inline]
            fn #name(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, #(#extra)* #(#results: &mut [f64]),*) {
                #(#bound_arrays)*
                #(#body_statements)*
                #writes
            }
        };
    }
    let writes = function.results.iter().zip(&results).map(|(values, name)| {
        let n = values.len();
        let len = index(n);
        if function.kind == FunctionKind::Rhs {
            // One statement for each equation, with its source position.
            let rows = values.iter().enumerate().map(|(i, value)| {
                let doc = doc_of_row(program, i, sources);
                let row = format_ident!("_row_{}", i);
                let value = &body.pieces[value].tokens;
                quote!(#[doc = #doc] let #row: f64 = #value;)
            });
            let rows: Vec<TokenStream> = rows.collect();
            let names = (0..n).map(|i| format_ident!("_row_{}", i));
            return quote! { #(#rows)* *::dgd::__runtime::codegen::fixed_mut::<#len>(#name) = [#(#names),*]; };
        }
        let values = values.iter().map(|value| &body.pieces[value].tokens);
        quote!(*::dgd::__runtime::codegen::fixed_mut::<#len>(#name) = [#(#values),*];)
    });
    quote! {
        #[inline]
        fn #name(&self, _at: ::dgd::__runtime::EvaluationPoint<'_>, #(#extra)* #(#results: &mut [f64]),*) {
            #(#bound_arrays)*
            #(#body_statements)*
            #(#writes)*
        }
    }
}

fn bind_arrays(program: &Program, function: &ProgramFunction) -> Vec<TokenStream> {
    let of_loops = function.loops.iter().flat_map(Loop::operations);
    bind_arrays_of(program, function.body.iter().chain(of_loops))
}

/// `let _y: &[f64; 2] = fixed(_at.y);` for each array that is read.
pub(super) fn bind_arrays_of<'a>(
    program: &Program,
    operations: impl Iterator<Item = &'a ProgramOperation>,
) -> Vec<TokenStream> {
    let arrays: BTreeSet<FunctionArgument> = operations
        .filter_map(|operation| match operation {
            ProgramOperation::Load(argument, _)
            | ProgramOperation::LoadSwept(argument, _)
            | ProgramOperation::LoadRound(argument, _) => Some(*argument),
            _ => None,
        })
        .collect();
    let read = |argument: FunctionArgument| arrays.contains(&argument);
    let (n, signature) = (program.n(), &program.signature);
    [
        (FunctionArgument::Y, quote!(_at.y), n),
        (FunctionArgument::U, quote!(_at.u), signature.n_u()),
        (FunctionArgument::P, quote!(_at.p), signature.parameters.len()),
        (FunctionArgument::Udot, quote!(_udot), signature.n_u()),
        (FunctionArgument::S, quote!(_s), n * signature.directions.len()),
        (FunctionArgument::Z, quote!(_at.z), signature.discrete.len()),
    ]
    .into_iter()
    .filter(|(argument, _, _)| read(*argument))
    .map(|(argument, from, len)| {
        let (name, len) = (array(argument), index(len));
        quote!(let #name = ::dgd::__runtime::codegen::fixed::<#len>(#from);)
    })
    .collect()
}

fn result_name(kind: ResultKind) -> Ident {
    let name = match kind {
        ResultKind::F => "_f",
        ResultKind::Jacobian | ResultKind::JumpJacobian => "_jacobian",
        ResultKind::Dfdt => "_dfdt",
        ResultKind::G => "_g",
        ResultKind::Dgdy => "_dgdy",
        ResultKind::Dgdt => "_dgdt",
        ResultKind::ParameterJacobian | ResultKind::InputJacobian | ResultKind::TimeDerivative => {
            "_values"
        }
        ResultKind::W => "_w",
        ResultKind::Dwdy => "_dwdy",
        ResultKind::Dwdu => "_dwdu",
        ResultKind::Dwdp => "_dwdp",
        ResultKind::Dwdt => "_dwdt",
        ResultKind::Dw => "_dw",
        ResultKind::Y0 => "_y0",
        ResultKind::S0 => "_s0",
        ResultKind::StartRest => "_rest",
        ResultKind::StartRestSensitivities => "_drest",
        ResultKind::StartRestJacobian => "_drestdy",
        ResultKind::Tau | ResultKind::VaryingTau => "_tau",
        ResultKind::Dtau | ResultKind::VaryingDtau => "_dtau",
        ResultKind::Mass => "_mass",
        ResultKind::ConditionTimes => "_times",
        ResultKind::ConditionAfter => "_after",
        ResultKind::ConditionTimeSensitivities => "_dtimes",
        ResultKind::Events => "_e",
        ResultKind::EventDirections => "_de",
        ResultKind::EventJacobian => "_dedy",
        ResultKind::EventSlopes => "_dedt",
        ResultKind::Resets => "_r",
        ResultKind::ResetDirections => "_dr",
        ResultKind::ResetJacobian => "_drdy",
        ResultKind::ResetSlopes => "_drdt",
        ResultKind::JumpKinds => "_kinds",
        ResultKind::JumpRests => "_rests",
        ResultKind::JumpRestSensitivities => "_drests",
        ResultKind::JumpRestSlopes => "_drestsdt",
        ResultKind::JumpJacobianSensitivities => "_djacobian",
        ResultKind::JumpJacobianSlopes => "_djacobiandt",
        ResultKind::VaryingTauJacobian => "_dtaudy",
        ResultKind::VaryingTauSlopes => "_dtaudt",
        ResultKind::History => "_history",
        ResultKind::HistoryRate => "_history_rate",
        ResultKind::HistoryCurvature => "_history_curvature",
        ResultKind::HistorySensitivities => "_history_s",
        ResultKind::HistorySensitivityRates => "_history_s_rate",
    };
    Ident::new(name, Span::call_site())
}

/// Turns operations into statements; a value used once is written inline.
pub(super) struct StatementWriter<'a> {
    program: &'a Program,
    operations: &'a [ProgramOperation],
    uses: Vec<u32>,
    names: BTreeMap<ValueId, &'a str>,
}

pub(super) struct Statements {
    pub(super) statements: Vec<TokenStream>,
    pub(super) pieces: BTreeMap<ValueId, CodeFragment>,
}

impl<'a> StatementWriter<'a> {
    fn new(program: &'a Program, function: &'a ProgramFunction) -> Self {
        let mut uses = uses(&function.body);
        for value in function.results.iter().flatten() {
            uses[value.index()] += 1;
        }
        // Operands of a loop are computed once, before it.
        for part in &function.loops {
            for value in part.reads() {
                if let Some(uses) = uses.get_mut(value.index()) {
                    *uses += 2;
                }
            }
        }
        Self::named(program, &function.body, uses, &function.names)
    }

    /// The operations of a series; `read` holds the operands of its recurrences and results, each computed once.
    pub(super) fn of_series(
        program: &'a Program,
        series: &'a SharedSeries,
        read: impl Iterator<Item = ValueId>,
    ) -> Self {
        let mut uses = uses(&series.body);
        for value in read {
            uses[value.index()] += 2;
        }
        Self::named(program, &series.body, uses, &series.names)
    }

    fn named(
        program: &'a Program,
        operations: &'a [ProgramOperation],
        uses: Vec<u32>,
        names: &'a [(ValueId, String)],
    ) -> Self {
        let names = names.iter().map(|(value, name)| (*value, name.as_str())).collect();
        StatementWriter { program, operations, uses, names }
    }

    pub(super) fn statements(&self) -> Statements {
        let mut statements = Vec::new();
        let mut pieces: BTreeMap<ValueId, CodeFragment> = BTreeMap::new();
        for (i, operation) in self.operations.iter().enumerate() {
            let value = ValueId(i as u32);
            let piece = piece_of(*operation, &pieces);
            let name = match operation {
                ProgramOperation::Constant(_)
                | ProgramOperation::Time
                | ProgramOperation::LoadSwept(..)
                | ProgramOperation::LoadRound(..)
                | ProgramOperation::Counter
                | ProgramOperation::Round => None,
                ProgramOperation::Load(argument, index) => {
                    self.load_name(*argument, *index as usize)
                }
                _ => match self.names.get(&value) {
                    Some(name) => Some(identifier(name)),
                    None if self.uses[i] > 1 || piece.depth > DEEPEST_PIECE => {
                        Some(format_ident!("_v{}", i))
                    }
                    None => None,
                },
            };
            let piece = match name {
                None => piece,
                Some(name) => {
                    let tokens = piece.tokens;
                    statements.push(quote!(let #name = #tokens;));
                    CodeFragment::atom(quote!(#name))
                }
            };
            pieces.insert(value, piece);
        }
        Statements { statements, pieces }
    }

    /// Name of an input: declared, delayed, the slope of a delayed one, or one for a delayed unknown.
    fn input_name(&self, index: usize) -> Ident {
        let signature = &self.program.signature;
        let Signature { inputs, delayed_inputs, .. } = signature;
        let input_name = |delayed: usize| &inputs[delayed_inputs[delayed].input].name;
        if let Some(past) = index.checked_sub(signature.past().first) {
            return format_ident!("_past_{}", past);
        }
        match index.checked_sub(inputs.len()) {
            None => identifier(&inputs[index].name),
            Some(delayed) => match delayed.checked_sub(delayed_inputs.len()) {
                None => format_ident!("_{}_late_{}", input_name(delayed), delayed),
                Some(delayed) => format_ident!("_{}_late_{}_slope", input_name(delayed), delayed),
            },
        }
    }

    /// Name of the variable that holds a number of an argument.
    fn load_name(&self, argument: FunctionArgument, index: usize) -> Option<Ident> {
        match argument {
            FunctionArgument::Y => {
                let single = &self.program.signature.unknowns.single;
                single.get(index).map(|unknown| identifier(&unknown.name))
            }
            FunctionArgument::U => Some(self.input_name(index)),
            FunctionArgument::P => Some(identifier(&self.program.signature.parameters[index].name)),
            FunctionArgument::Udot | FunctionArgument::S | FunctionArgument::Z => None,
        }
    }
}

/// How often each value is an operand.
fn uses(operations: &[ProgramOperation]) -> Vec<u32> {
    let mut uses = vec![0; operations.len()];
    for operand in operations.iter().flat_map(|operation| operation.operands()) {
        uses[operand.index()] += 1;
    }
    uses
}
