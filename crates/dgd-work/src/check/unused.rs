//! Parameters that nothing in the model reads, for any choice of its variants.

use dgd_compiler::diagnostics::{Code, Diagnostic};
use dgd_compiler::names::{NameTable, SymbolKind};
use dgd_compiler::source::SourceMap;
use dgd_compiler::syntax::ast::Ast;

/// A note for each such parameter of the main file.
pub(super) fn notes(asts: &[Ast], sources: &SourceMap) -> Vec<Diagnostic> {
    let Some(main) = asts.first() else { return Vec::new() };
    let names = NameTable::collect(asts, sources);
    let unused = names.symbols().filter(|(id, symbol)| {
        symbol.kind == SymbolKind::Parameter
            && symbol.declared.source == main.source
            && names.uses_of(*id).all(|one| one.declares)
    });
    let note =
        |name: &str| format!("nothing reads the parameter `{name}`, so no fit can estimate it");
    unused
        .map(|(_, symbol)| {
            Diagnostic::new(Code::UnreadParameter, symbol.declared, note(&symbol.name))
                .help("use it in an equation, or take it out")
        })
        .collect()
}
