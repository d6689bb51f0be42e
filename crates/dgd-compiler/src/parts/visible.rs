//! The models and libraries that a file sees: its imports, and those of its libraries.

use std::collections::{BTreeMap, BTreeSet};

use crate::diagnostics::{Code, Diagnostic, Diagnostics};
use crate::source::SourceId;
use crate::syntax::ast::{Ast, ItemKind};

/// The files of a compilation.
#[derive(Debug)]
pub(super) struct CompilationFiles<'a> {
    asts: &'a [Ast],
    position: BTreeMap<SourceId, usize>,
}

/// The libraries and models that a file sees.
#[derive(Debug, Default)]
pub(super) struct VisibleFiles<'a> {
    /// Libraries, nearest first.
    pub(super) libraries: Vec<&'a Ast>,
    /// Models by name.
    pub(super) models: BTreeMap<&'a str, &'a Ast>,
}

impl<'a> CompilationFiles<'a> {
    pub(super) fn new(asts: &'a [Ast]) -> CompilationFiles<'a> {
        let position = asts.iter().enumerate().map(|(i, ast)| (ast.source, i)).collect();
        CompilationFiles { asts, position }
    }

    fn get(&self, source: SourceId) -> Option<&'a Ast> {
        self.position.get(&source).map(|i| &self.asts[*i])
    }

    /// The libraries and models that a file sees. Of two models with one name the first is used.
    pub(super) fn visible(&self, of: &'a Ast, diagnostics: &mut Diagnostics) -> VisibleFiles<'a> {
        let mut visible = VisibleFiles::default();
        if let Some(header) = &of.model {
            visible.models.insert(&header.name.text, of);
        }
        let mut visited = BTreeSet::from([of.source]);
        let mut pending: Vec<&'a Ast> = vec![of];
        let mut next = 0;
        while let Some(file) = pending.get(next) {
            next += 1;
            for source in file.imports.iter().filter(|source| visited.insert(**source)) {
                let Some(ast) = self.get(*source) else { continue };
                match &ast.model {
                    Some(header) => {
                        let first = *visible.models.entry(&header.name.text).or_insert(ast);
                        if first.source != ast.source {
                            let message = format!("two models are called `{}`", header.name.text);
                            let diagnostic =
                                Diagnostic::new(Code::DuplicateName, header.name.span, message)
                                    .about(&header.name.text);
                            let place = first.model.as_ref().map(|header| header.name.span);
                            let first = place.unwrap_or(header.name.span);
                            diagnostics.error(diagnostic.label(first, "first here").help(
                                "rename one of them: a part says by its model's name what it is",
                            ));
                        }
                    }
                    None => pending.push(ast),
                }
            }
        }
        visible.libraries = pending.split_off(1);
        visible
    }

    /// The names of libraries that only parts see. They are derived from the file names, so that they do not clash with
    /// names of the whole. Libraries that the model sees have no name.
    pub(super) fn library_names(
        &self,
        of_model: &[&Ast],
        mut taken: BTreeSet<String>,
    ) -> BTreeMap<SourceId, String> {
        let mut names = BTreeMap::new();
        for ast in self.asts {
            let imports = ast.items.iter().filter_map(|item| match &item.kind {
                ItemKind::Import { path, .. } => Some(path),
                _ => None,
            });
            for (path, source) in imports.zip(&ast.imports) {
                let is_library = self.get(*source).is_some_and(|ast| ast.model.is_none());
                let is_shared = of_model.iter().any(|library| library.source == *source);
                if !is_library || is_shared || names.contains_key(source) {
                    continue;
                }
                let stem = stem(path);
                let numbered = (2..).map(|n| format!("{stem}_{n}"));
                let mut candidates = std::iter::once(stem.clone()).chain(numbered);
                let free = candidates.find(|name| !taken.contains(name));
                let name = free.unwrap_or_else(|| unreachable!("numbers do not end"));
                taken.insert(name.clone());
                names.insert(*source, name);
            }
        }
        names
    }
}

/// The name of a file without folder and extension, as a name of the language.
fn stem(path: &str) -> String {
    let file = path.rsplit('/').next().unwrap_or(path);
    let stem = file.split('.').next().unwrap_or(file);
    let mut name: String =
        stem.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) {
        name.insert_str(0, "lib");
    }
    name
}
