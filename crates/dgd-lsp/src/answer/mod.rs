//! Requests and their answers, a file for each kind.

mod completion;
mod context;
mod conversions;
mod fixes;
mod hover;
mod names;
mod signature;
mod text;

use lsp_types::request::{
    CodeActionRequest, CodeLensRequest, Completion, DocumentSymbolRequest, FoldingRangeRequest,
    Formatting, GotoDefinition, HoverRequest, InlayHintRequest, PrepareRenameRequest, References,
    Rename, Request as _, SemanticTokensFullRequest, SignatureHelpRequest,
};
use lsp_types::{
    CodeActionProviderCapability, CodeLensOptions, CompletionOptions, HoverProviderCapability,
    OneOf, PositionEncodingKind, RenameOptions, SemanticTokensFullOptions, SemanticTokensLegend,
    SemanticTokensOptions, ServerCapabilities, SignatureHelpOptions, TextDocumentSyncCapability,
    TextDocumentSyncKind, Uri, WorkDoneProgressOptions,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::places;

pub(crate) use context::AnswerContext;
pub(crate) use fixes::{crashed, diagnostics};

/// The capabilities of this server.
pub(crate) fn capabilities(encoding: PositionEncodingKind) -> ServerCapabilities {
    let words = |all: &[&str]| Some(all.iter().map(ToString::to_string).collect());
    let legend = SemanticTokensLegend {
        token_types: text::TOKEN_TYPES.to_vec(),
        token_modifiers: Vec::new(),
    };
    ServerCapabilities {
        position_encoding: Some(encoding),
        text_document_sync: Some(TextDocumentSyncCapability::Kind(
            TextDocumentSyncKind::INCREMENTAL,
        )),
        hover_provider: Some(HoverProviderCapability::Simple(true)),
        definition_provider: Some(OneOf::Left(true)),
        references_provider: Some(OneOf::Left(true)),
        rename_provider: Some(OneOf::Right(RenameOptions {
            prepare_provider: Some(true),
            work_done_progress_options: WorkDoneProgressOptions::default(),
        })),
        completion_provider: Some(CompletionOptions {
            trigger_characters: words(&[".", "[", "\"", ":"]),
            ..CompletionOptions::default()
        }),
        signature_help_provider: Some(SignatureHelpOptions {
            trigger_characters: words(&["(", ","]),
            ..Default::default()
        }),
        document_symbol_provider: Some(OneOf::Left(true)),
        folding_range_provider: Some(true.into()),
        document_formatting_provider: Some(OneOf::Left(true)),
        code_lens_provider: Some(CodeLensOptions { resolve_provider: Some(false) }),
        inlay_hint_provider: Some(OneOf::Left(true)),
        code_action_provider: Some(CodeActionProviderCapability::Simple(true)),
        semantic_tokens_provider: Some(
            SemanticTokensOptions {
                legend,
                full: Some(SemanticTokensFullOptions::Bool(true)),
                ..Default::default()
            }
            .into(),
        ),
        ..Default::default()
    }
}

/// The path of the document of a request.
pub(crate) fn document(params: &Value) -> Option<String> {
    let uri = params.get("textDocument")?.get("uri")?;
    Some(places::path_of(&serde_json::from_value::<Uri>(uri.clone()).ok()?))
}

/// An answer as JSON, or an error.
type JsonAnswer = Result<Value, String>;

/// The answer to a request; `None` for an unknown method.
pub(crate) fn answer(
    method: &str,
    params: Value,
    context: &AnswerContext<'_>,
) -> Option<JsonAnswer> {
    Some(match method {
        HoverRequest::METHOD => with(params, |params| Ok(hover::hover(&params, context))),
        SignatureHelpRequest::METHOD => {
            with(params, |params| Ok(signature::signature(&params, context)))
        }
        GotoDefinition::METHOD => with(params, |params| Ok(names::definition(&params, context))),
        References::METHOD => with(params, |params| Ok(names::references(&params, context))),
        PrepareRenameRequest::METHOD => with(params, |params| Ok(names::prepare(&params, context))),
        Rename::METHOD => with(params, |params| names::rename(&params, context)),
        Completion::METHOD => with(params, |params| Ok(completion::completion(&params, context))),
        DocumentSymbolRequest::METHOD => json(text::symbols(context)),
        FoldingRangeRequest::METHOD => json(text::folding(context)),
        Formatting::METHOD => json(text::formatting(context)),
        SemanticTokensFullRequest::METHOD => json(text::semantic_tokens(context)),
        CodeLensRequest::METHOD => json(text::lenses(context)),
        InlayHintRequest::METHOD => json(hover::inlay_hints(context)),
        CodeActionRequest::METHOD => with(params, |params| Ok(fixes::actions(&params, context))),
        #[cfg(test)]
        "dgd/panic" => panic!("as asked"),
        _ => return None,
    })
}

fn with<P: DeserializeOwned, R: Serialize>(
    params: Value,
    answer: impl FnOnce(P) -> Result<R, String>,
) -> JsonAnswer {
    let params = serde_json::from_value(params).map_err(|error| error.to_string())?;
    json(answer(params)?)
}

fn json(answer: impl Serialize) -> JsonAnswer {
    serde_json::to_value(answer).map_err(|error| error.to_string())
}
