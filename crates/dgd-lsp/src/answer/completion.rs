//! Completion at the cursor.

use std::path::Path;

use dgd_compiler::expr::display::number;
use dgd_compiler::expr::intrinsics::INTRINSICS;
use dgd_compiler::names::{NamedItem, SymbolKind};
use dgd_compiler::source::{SourceId, SourceMap};
use dgd_compiler::syntax::ast::{EffectKind, ReductionOperation, SlotKind};
use dgd_compiler::syntax::own_units;
use dgd_compiler::units::catalogue::CATALOGUE;
use lsp_types::{CompletionItem, CompletionItemKind, CompletionParams};

use super::context::AnswerContext;

/// Words that begin an item, and attributes that end one.
const KEYWORDS: [&str; 25] = [
    "model",
    "effect",
    "import",
    "constant",
    "parameter",
    "input",
    "state",
    "unknown",
    "held",
    "unit",
    "size",
    "let",
    "function",
    "table",
    "equation",
    "output",
    "variant",
    "modes",
    "for",
    "part",
    "when",
    "every",
    "saturate",
    "start steady",
    "start equation",
];
/// Words that begin a clause of an effect.
const CLAUSES: [&str; 5] = ["kind", "form", "null", "replace", "add"];
/// Words that begin a line within a `modes` block and after a `when`.
const IN_BLOCKS: [&str; 2] = ["start", "reset"];
const ATTRIBUTES: [&str; 24] = [
    "in",
    "log",
    "fixed",
    "guess",
    "nominal",
    "prior normal",
    "prior lognormal",
    "prior uniform",
    "prior laplace",
    "prior gamma",
    "hold",
    "linear",
    "noise",
    "noise lognormal",
    "noise student",
    "history",
    "exact",
    "pchip",
    "natural",
    "cubic",
    "beyond refuse",
    "beyond hold",
    "beyond extend",
    "smooth",
];

/// The kinds of completions at a position in a line.
enum CompletionKinds {
    /// Words of the language.
    Words(Vec<&'static str>),
    /// Names declared as one of these kinds, visible to the file.
    Kinds(&'static [SymbolKind], &'static [&'static str]),
    /// Models of the project.
    Models,
    /// Files that can be imported.
    Files,
    /// Names that an expression can read, functions and attributes.
    Expression,
}

pub(super) fn completion(
    params: &CompletionParams,
    context: &AnswerContext<'_>,
) -> Vec<CompletionItem> {
    let byte = context.byte(params.text_document_position.position);
    let before = &context.text()[..byte];
    let line = &before[before.rfind('\n').map_or(0, |at| at + 1)..];
    if line.rfind('[') > line.rfind(']') {
        return units(context);
    }
    let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
    let word = line
        .rfind(|c| !is_word(c))
        .map_or(line, |at| &line[at + line[at..].chars().next().map_or(1, char::len_utf8)..]);
    let (names, sources) = context.files.names(&context.path);
    let has_part = word.rsplit_once('.').filter(|_| !line.contains('"'));
    if let Some((part, _)) = has_part {
        let members = names.members_of(SourceId(0), part);
        return members.into_iter().map(|id| of_symbol(names.symbol(id))).collect();
    }
    let is_effect = context.analysis.is_some_and(|analysis| analysis.asts[0].effect.is_some());
    match wanted(&line[..line.len() - word.len()], is_effect) {
        CompletionKinds::Words(words) => keywords(&words),
        CompletionKinds::Kinds(kinds, words) => {
            let in_sight = names.in_sight_of(SourceId(0)).into_iter().map(|id| names.symbol(id));
            let items = in_sight.filter(|symbol| kinds.contains(&symbol.kind)).map(of_symbol);
            items.chain(keywords(words)).collect()
        }
        CompletionKinds::Models => {
            let models = names.symbols().map(|(_, symbol)| symbol);
            models.filter(|one| one.kind == SymbolKind::Model).map(of_symbol).collect()
        }
        CompletionKinds::Files => files(&sources, &context.path),
        CompletionKinds::Expression => {
            let readable = names.readable_in(SourceId(0));
            let items = readable.into_iter().map(|id| of_symbol(names.symbol(id)));
            items.chain(functions()).chain(attributes()).collect()
        }
    }
}

/// The completions after the beginning of a line.
fn wanted(line: &str, is_effect: bool) -> CompletionKinds {
    const READ: &[SymbolKind] = &[
        SymbolKind::Constant,
        SymbolKind::Parameter,
        SymbolKind::Input,
        SymbolKind::State,
        SymbolKind::Unknown,
        SymbolKind::Let,
        SymbolKind::Function,
        SymbolKind::Argument,
        SymbolKind::Part,
    ];
    let words: Vec<&str> = line.split_whitespace().collect();
    match words.as_slice() {
        [] if is_effect => CompletionKinds::Words([&KEYWORDS[2..], &CLAUSES, &IN_BLOCKS].concat()),
        [] => CompletionKinds::Words([&KEYWORDS[..], &IN_BLOCKS].concat()),
        ["effect", .., last] if last.ends_with(':') => {
            CompletionKinds::Words(SlotKind::ALL.iter().map(|(word, _)| *word).collect())
        }
        ["effect", _, "on"] => CompletionKinds::Models,
        ["effect", _] => CompletionKinds::Words(vec!["on"]),
        ["part", .., last] if last.ends_with(':') => CompletionKinds::Models,
        ["import", ..] => CompletionKinds::Files,
        ["kind"] => CompletionKinds::Words(EffectKind::ALL.iter().map(|(word, _)| *word).collect()),
        ["null"] => CompletionKinds::Kinds(&[SymbolKind::Parameter], &[]),
        ["replace"] => CompletionKinds::Kinds(READ, &["output"]),
        ["replace", "output"] => CompletionKinds::Kinds(&[SymbolKind::Output], &[]),
        ["replace", .., "in"] | ["add", .., "to"] => {
            CompletionKinds::Kinds(&[SymbolKind::Equation, SymbolKind::Argument], &[])
        }
        ["replace", _] => CompletionKinds::Words(vec!["in", "by"]),
        ["replace", "output", _] | ["replace", _, "in", _] => CompletionKinds::Words(vec!["by"]),
        ["when", .., "rises"] => CompletionKinds::Words(vec!["above"]),
        ["when", .., "falls"] => CompletionKinds::Words(vec!["below"]),
        _ => CompletionKinds::Expression,
    }
}

fn keywords(words: &[&str]) -> Vec<CompletionItem> {
    words.iter().map(|word| item(word, CompletionItemKind::KEYWORD, None)).collect()
}

fn functions() -> impl Iterator<Item = CompletionItem> {
    let others = ["der", "delay"].iter().map(|word| item(word, CompletionItemKind::FUNCTION, None));
    let functions = INTRINSICS.iter().filter(|function| function.name != "^");
    let functions = functions.map(|f| item(f.name, CompletionItemKind::FUNCTION, Some(f.doc)));
    // `min` and `max` are functions of two, too.
    let is_other = |word: &str| !INTRINSICS.iter().any(|function| function.name == word);
    let over = ReductionOperation::ALL.iter().filter(move |(word, _)| is_other(word));
    let over = over.map(|(word, kind)| {
        item(word, CompletionItemKind::FUNCTION, Some(&format!("{} over indices", kind.noun())))
    });
    others.chain(functions).chain(over)
}

fn attributes() -> impl Iterator<Item = CompletionItem> {
    ATTRIBUTES.iter().map(|word| item(word, CompletionItemKind::PROPERTY, None))
}

/// The other files below the folder of a document, with their paths for `import`.
fn files(sources: &SourceMap, path: &str) -> Vec<CompletionItem> {
    let Some(folder) = Path::new(path).parent() else { return Vec::new() };
    let others = sources.iter().map(|source| Path::new(&source.name));
    let below = others.filter(|other| *other != Path::new(path));
    let below = below.filter_map(|other| other.strip_prefix(folder).ok());
    below.map(|below| item(&below.display().to_string(), CompletionItemKind::FILE, None)).collect()
}

/// The units that the document and its libraries declare, then those of the language.
fn units(context: &AnswerContext<'_>) -> Vec<CompletionItem> {
    let declared = context.analysis.map_or_else(Vec::new, |a| own_units::declared(&a.asts));
    let items = declared.iter().map(|unit| {
        let detail = format!("{} {}", number(unit.value), unit.unit);
        item(&unit.symbol, CompletionItemKind::UNIT, Some(&detail))
    });
    let known = CATALOGUE.iter();
    items
        .chain(known.map(|row| item(row.symbol, CompletionItemKind::UNIT, Some(row.doc))))
        .collect()
}

fn item(label: &str, kind: CompletionItemKind, detail: Option<&str>) -> CompletionItem {
    CompletionItem {
        label: label.to_owned(),
        kind: Some(kind),
        detail: detail.map(str::to_owned),
        ..Default::default()
    }
}

fn of_symbol(symbol: &NamedItem) -> CompletionItem {
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
