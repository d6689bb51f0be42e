//! What can be written at the cursor, and the arguments of a call.

use dgd_compiler::expr::intrinsics::INTRINSICS;
use dgd_compiler::names::{Symbol, SymbolKind};
use dgd_compiler::source::SourceId;
use dgd_compiler::syntax::ast::ItemKind;
use dgd_compiler::syntax::visit;
use dgd_compiler::units::catalogue::CATALOGUE;
use lsp_types::{
    CompletionItem, CompletionItemKind, CompletionParams, ParameterInformation, ParameterLabel,
    SignatureHelp, SignatureHelpParams, SignatureInformation,
};

use super::Context;

/// Words that begin an item, and attributes that end one.
const KEYWORDS: [&str; 18] = [
    "model",
    "effect",
    "import",
    "constant",
    "parameter",
    "input",
    "state",
    "unknown",
    "size",
    "let",
    "function",
    "equation",
    "output",
    "variant",
    "modes",
    "part",
    "when",
    "saturate",
];
const ATTRIBUTES: [&str; 10] = [
    "in",
    "log",
    "fixed",
    "nominal",
    "prior normal",
    "hold",
    "linear",
    "noise",
    "history",
    "exact",
];

pub(super) fn completion(params: &CompletionParams, context: &Context<'_>) -> Vec<CompletionItem> {
    let byte = context.byte(params.text_document_position.position);
    let before = &context.text()[..byte];
    let line = &before[before.rfind('\n').map_or(0, |at| at + 1)..];
    if line.rfind('[') > line.rfind(']') {
        return units();
    }
    let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
    let word = line
        .rfind(|c| !is_word(c))
        .map_or(line, |at| &line[at + line[at..].chars().next().map_or(1, char::len_utf8)..]);
    let (names, _) = context.files.names(&context.path);
    if let Some((part, _)) = word.rsplit_once('.') {
        let members = names.members_of(SourceId(0), part);
        return members.into_iter().map(|id| of_symbol(names.symbol(id))).collect();
    }
    let plain = |kind| move |label: &str| item(label, kind, None);
    if line.trim() == word {
        return KEYWORDS.iter().map(|word| plain(CompletionItemKind::KEYWORD)(word)).collect();
    }
    if line.trim_start().starts_with("effect ") {
        let models = names.symbols().map(|(_, symbol)| symbol);
        return models.filter(|one| one.kind == SymbolKind::Model).map(of_symbol).collect();
    }
    let readable = names.readable_in(SourceId(0));
    let own = readable.into_iter().map(|id| of_symbol(names.symbol(id)));
    let functions = INTRINSICS.iter().filter(|function| function.name != "^");
    let functions = functions.map(|f| item(f.name, CompletionItemKind::FUNCTION, Some(f.doc)));
    let attributes = ATTRIBUTES.iter().map(|word| plain(CompletionItemKind::PROPERTY)(word));
    let others = ["der", "delay"].iter().map(|word| plain(CompletionItemKind::FUNCTION)(word));
    own.chain(functions).chain(others).chain(attributes).collect()
}

fn units() -> Vec<CompletionItem> {
    CATALOGUE.iter().map(|row| item(row.symbol, CompletionItemKind::UNIT, Some(row.doc))).collect()
}

fn item(label: &str, kind: CompletionItemKind, detail: Option<&str>) -> CompletionItem {
    CompletionItem {
        label: label.to_owned(),
        kind: Some(kind),
        detail: detail.map(str::to_owned),
        ..Default::default()
    }
}

fn of_symbol(symbol: &Symbol) -> CompletionItem {
    let kind = match symbol.kind {
        SymbolKind::Model | SymbolKind::Effect | SymbolKind::Part => CompletionItemKind::MODULE,
        SymbolKind::Constant | SymbolKind::Size => CompletionItemKind::CONSTANT,
        SymbolKind::Function => CompletionItemKind::FUNCTION,
        SymbolKind::Equation => CompletionItemKind::EVENT,
        SymbolKind::Variant | SymbolKind::Modes => CompletionItemKind::ENUM,
        SymbolKind::Choice | SymbolKind::Mode => CompletionItemKind::ENUM_MEMBER,
        SymbolKind::Parameter
        | SymbolKind::Input
        | SymbolKind::State
        | SymbolKind::Unknown
        | SymbolKind::Let
        | SymbolKind::Output
        | SymbolKind::Argument
        | SymbolKind::Index => CompletionItemKind::VARIABLE,
    };
    item(&symbol.name, kind, Some(&format!("{:?}", symbol.kind).to_lowercase()))
}

/// The function whose parentheses are open at the cursor, and which argument is being written.
pub(super) fn signature(
    params: &SignatureHelpParams,
    context: &Context<'_>,
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

/// The arguments of a function, with their units, and what it is.
fn arguments_of(name: &str, context: &Context<'_>) -> Option<(Vec<String>, String)> {
    let analysis = context.analysis?;
    let mut found = None;
    for ast in &analysis.asts {
        visit::items(&ast.items, &mut |item| {
            let ItemKind::Function { name: own, arguments, .. } = &item.kind else { return };
            if own.text == name && found.is_none() {
                let shown = arguments.iter().map(|argument| match &argument.unit {
                    Some(unit) => format!("{} [{}]", argument.name.text, unit.text),
                    None => argument.name.text.clone(),
                });
                found = Some((shown.collect(), item.doc.join("\n")));
            }
        });
    }
    let plain = |all: &[&str]| all.iter().map(ToString::to_string).collect();
    found.or_else(|| match name {
        "der" => Some((plain(&["state"]), "the derivative to time of a state".to_owned())),
        "delay" => Some((plain(&["value", "time"]), "what it was so long ago".to_owned())),
        _ => {
            let function = INTRINSICS.iter().find(|function| function.name == name)?;
            let arguments = ["x", "y"];
            let n = function.definition.arity().min(arguments.len());
            Some((plain(&arguments[..n]), function.doc.to_owned()))
        }
    })
}
