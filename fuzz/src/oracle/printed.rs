//! A printed model reads back as the same model.

use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::ast::Ast;
use dgd_compiler::syntax::places::without_places;
use dgd_compiler::syntax::print::print;
use dgd_compiler::syntax::{layout, parse};

use super::Finding;
use crate::case::Case;
use crate::prepared::Prepared;

fn read(text: &str) -> Option<Ast> {
    let mut sources = SourceMap::default();
    let id = sources.add(SourceText { name: "m.dgd".to_owned(), text: text.to_owned() });
    parse(id, &sources, &mut Diagnostics::default()).ok().map(|ast| without_places(&ast))
}

fn laid_out(text: &str) -> Option<String> {
    let mut sources = SourceMap::default();
    let id = sources.add(SourceText { name: "m.dgd".to_owned(), text: text.to_owned() });
    layout::format(id, &sources, &mut Diagnostics::default()).ok()
}

pub(super) fn judge(case: &Case, _: &Prepared, findings: &mut Vec<Finding>) {
    for text in std::iter::once(&case.model).chain(case.files.values()) {
        let Some(ast) = read(text) else {
            findings.push(Finding::new("printed", "not read", text.clone()));
            continue;
        };
        let printed = print(&ast);
        if read(&printed).as_ref() != Some(&ast) {
            findings.push(Finding::new("printed", "print", printed));
        }
        let once = laid_out(text);
        let twice = once.as_deref().and_then(laid_out);
        if once.is_none() || once != twice {
            let text = format!("{}\n{}", once.unwrap_or_default(), twice.unwrap_or_default());
            findings.push(Finding::new("printed", "layout is not idempotent", text));
        } else if once.as_deref().and_then(read).as_ref() != Some(&ast) {
            findings.push(Finding::new("printed", "layout", once.unwrap_or_default()));
        }
    }
}
