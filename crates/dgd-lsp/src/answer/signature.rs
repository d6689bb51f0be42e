//! The arguments of the call at the cursor.

use dgd_compiler::expr::intrinsics::INTRINSICS;
use dgd_compiler::syntax::ast::ItemKind;
use dgd_compiler::syntax::visit;
use lsp_types::{
    ParameterInformation, ParameterLabel, SignatureHelp, SignatureHelpParams, SignatureInformation,
};

use super::context::AnswerContext;

/// The function whose parentheses are open at the cursor, and the current argument.
pub(super) fn signature(
    params: &SignatureHelpParams,
    context: &AnswerContext<'_>,
) -> Option<SignatureHelp> {
    let byte = context.byte(params.text_document_position_params.position);
    let before = &context.text()[..byte];
    let line = &before[before.rfind('\n').map_or(0, |at| at + 1)..];
    let (mut closed, mut argument, mut open) = (0, 0, None);
    for (at, c) in line.char_indices().rev() {
        match c {
            ')' => closed += 1,
            '(' if closed > 0 => closed -= 1,
            '(' => {
                open = Some(at);
                break;
            }
            ',' if closed == 0 => argument += 1,
            _ => {}
        }
    }
    let head = line[..open?].trim_end();
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let start = head
        .rfind(|c| !is_word(c))
        .map_or(0, |at| at + head[at..].chars().next().map_or(1, char::len_utf8));
    let name = &head[start..];
    let (arguments, doc) = arguments_of(name, context)?;
    let parameter = |label: &String| ParameterInformation {
        label: ParameterLabel::Simple(label.clone()),
        documentation: None,
    };
    Some(SignatureHelp {
        signatures: vec![SignatureInformation {
            label: format!("{name}({})", arguments.join(", ")),
            documentation: Some(lsp_types::Documentation::String(doc)),
            parameters: Some(arguments.iter().map(parameter).collect()),
            active_parameter: Some(argument),
        }],
        active_signature: Some(0),
        active_parameter: Some(argument),
    })
}

/// The arguments of a function, with their units, and its documentation.
fn arguments_of(name: &str, context: &AnswerContext<'_>) -> Option<(Vec<String>, String)> {
    let analysis = context.analysis?;
    let mut declaration = None;
    for ast in &analysis.asts {
        visit::items(&ast.items, &mut |item| {
            let (ItemKind::Function { name: own, arguments, .. }
            | ItemKind::Table { name: own, arguments, .. }) = &item.kind
            else {
                return;
            };
            if own.text == name && declaration.is_none() {
                let shown = arguments.iter().map(|argument| match &argument.unit {
                    Some(unit) => format!("{} [{}]", argument.name.text, unit.text),
                    None => argument.name.text.clone(),
                });
                declaration = Some((shown.collect(), item.doc.join("\n")));
            }
        });
    }
    let plain = |all: &[&str]| all.iter().map(ToString::to_string).collect();
    declaration.or_else(|| match name {
        "der" => Some((plain(&["state"]), "the derivative to time of a state".to_owned())),
        "delay" => Some((plain(&["value", "time"]), "what it was so long ago".to_owned())),
        _ => {
            let function = INTRINSICS.iter().find(|function| function.name == name)?;
            let arguments = ["x", "y", "z"];
            let n = function.definition.arity().min(arguments.len());
            Some((plain(&arguments[..n]), function.doc.to_owned()))
        }
    })
}
