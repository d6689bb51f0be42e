//! Loads a model's file and the trees of all files that it imports.

use std::collections::BTreeMap;
use std::path::Path;

use super::ast::{Ast, ItemKind, TablePoints};
use super::parse::{UnreadableItem, parse_with_holes};
use super::{table_files, visit};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::sentence;
use crate::sentence::argument::Argument;
use crate::source::{SourceId, SourceMap, SourceText, Span};

/// File extension of imports, except for tables. No other files are read, so that a model cannot reveal the contents of
/// unrelated files.
const ENDING: &str = ".dgd";

/// Checks that a file has the name of a model, library, effect or table.
///
/// # Errors
///
/// The reason why it is not read.
pub fn verify_import(path: &Path) -> Result<(), String> {
    let name = path.file_name().map(|name| name.to_string_lossy());
    let is_named = |ending: &&str| name.as_ref().is_some_and(|name| name.ends_with(ending));
    if table_files::ENDINGS.iter().chain([&ENDING]).any(is_named) {
        return Ok(());
    }
    Err("only regular files called `*.dgd`, `*.csv` or `*.csv.gz` are read".to_owned())
}

/// Reads the imported file at a path; an error is the reason why it cannot be read, and quotes nothing of the file.
pub type ReadImport<'a> = dyn FnMut(&str) -> Result<String, String> + 'a;

/// The trees of files and of all their imports.
#[derive(Debug)]
pub struct LoadedFiles {
    /// The given files first, then their imports.
    pub asts: Vec<Ast>,
    /// Items that could not be read, and imports that failed.
    pub holes: Vec<UnreadableItem>,
}

/// Parses files and, once each, the libraries and models that they import directly or through others.
///
/// A path is relative to the importing file. Errors are reported, and valid items are returned nevertheless.
pub fn load(
    files: Vec<SourceText>,
    read: &mut ReadImport<'_>,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> LoadedFiles {
    let (asts, known, holes) = (Vec::new(), BTreeMap::new(), Vec::new());
    let mut loading = ImportLoader { asts, known, holes, read, sources, diagnostics };
    for file in files {
        let path = normalise(&file.name);
        let id = loading.sources.add(file);
        loading.known.insert(path, id);
        let ast = loading.parse(id);
        loading.asts.push(ast);
    }
    let mut next = 0;
    while next < loading.asts.len() {
        loading.read_tables(next);
        let imports = imports_of(&loading.asts[next]);
        let importer = loading.asts[next].source;
        let followed =
            imports.iter().filter_map(|import| loading.follow(importer, import)).collect();
        loading.asts[next].imports = followed;
        next += 1;
    }
    LoadedFiles { asts: loading.asts, holes: loading.holes }
}

/// `import "path"`
struct Import {
    path: String,
    span: Span,
}

fn imports_of(ast: &Ast) -> Vec<Import> {
    let import = |kind: &ItemKind| match kind {
        ItemKind::Import { path, path_span } => {
            Some(Import { path: path.clone(), span: *path_span })
        }
        _ => None,
    };
    ast.items.iter().filter_map(|item| import(&item.kind)).collect()
}

/// The files read so far, and the means to read more.
struct ImportLoader<'a, 'r> {
    asts: Vec<Ast>,
    /// Files by their normalised paths.
    known: BTreeMap<String, SourceId>,
    holes: Vec<UnreadableItem>,
    read: &'a mut ReadImport<'r>,
    sources: &'a mut SourceMap,
    diagnostics: &'a mut Diagnostics,
}

impl ImportLoader<'_, '_> {
    /// The imported file, which is read unless it has been before; `None` if it cannot be read.
    fn follow(&mut self, importer: SourceId, Import { path, span }: &Import) -> Option<SourceId> {
        let name = beside(self.sources, importer, path);
        if let Some(&id) = self.known.get(&name) {
            if id == importer {
                self.refuse(*span, format!("`{path}` is this file itself"));
            }
            return Some(id);
        }
        if !name.ends_with(ENDING) {
            let message = format!("cannot import `{path}`: its name does not end in `{ENDING}`");
            self.refuse(*span, message);
            return None;
        }
        let text = match (self.read)(&name) {
            Ok(text) => text,
            Err(reason) => {
                self.refuse(*span, format!("cannot read `{name}`: {reason}"));
                return None;
            }
        };
        let id = self.sources.add(SourceText { name: name.clone(), text });
        self.known.insert(name, id);
        let ast = self.parse(id);
        self.take(ast, path, *span);
        Some(id)
    }

    /// Reads the files of a tree's tables.
    fn read_tables(&mut self, k: usize) {
        let importer = self.asts[k].source;
        let mut items = std::mem::take(&mut self.asts[k].items);
        visit::items_mut(&mut items, &mut |item| {
            let Some(TablePoints::File { path, path_span, .. }) =
                table_files::file_of(&mut item.kind)
            else {
                return;
            };
            let (path, span) = (path.clone(), *path_span);
            let points = self.table_file(importer, &path, span).and_then(|file| {
                table_files::points(&item.kind, file, self.sources, self.diagnostics)
            });
            if let Some(TablePoints::File { rows, .. }) = table_files::file_of(&mut item.kind) {
                *rows = Some(points);
            }
        });
        self.asts[k].items = items;
    }

    /// The file of a table, which is read unless it has been before.
    fn table_file(
        &mut self,
        importer: SourceId,
        path: &str,
        span: Span,
    ) -> Result<SourceId, ErrorReported> {
        let name = beside(self.sources, importer, path);
        if let Some(&id) = self.known.get(&name) {
            return Ok(id);
        }
        let refused = |message: String| Diagnostic::new(Code::UnusableImport, span, message);
        if !table_files::ENDINGS.iter().any(|ending| name.ends_with(ending)) {
            let message =
                format!("cannot read `{path}`: its name does not end in `.csv` or `.csv.gz`");
            return Err(self.diagnostics.error(refused(message)));
        }
        let text = (self.read)(&name).map_err(|reason| {
            self.diagnostics.error(refused(format!("cannot read `{name}`: {reason}")))
        })?;
        let id = self.sources.add(SourceText { name: name.clone(), text });
        self.known.insert(name, id);
        Ok(id)
    }

    fn parse(&mut self, id: SourceId) -> Ast {
        let (ast, holes) = parse_with_holes(id, self.sources, self.diagnostics);
        self.holes.extend(holes);
        ast
    }

    /// Adds the tree of a library or a model.
    fn take(&mut self, mut ast: Ast, path: &str, span: Span) {
        if let Some(effect) = &ast.effect {
            let name = &effect.name.text;
            let message = format!("`{path}` is an effect, `{name}`, not a library or a model");
            self.holes.push(UnreadableItem::import(span));
            self.diagnostics.error(
                Diagnostic::new(Code::UnusableImport, span, message)
                    .help(sentence!["an effect is taken into a model with ", Argument::Apply]),
            );
            return;
        }
        if ast.model.is_none() {
            verify_library(&mut ast, self.diagnostics);
        }
        self.asts.push(ast);
    }

    fn refuse(&mut self, span: Span, message: String) {
        self.holes.push(UnreadableItem::import(span));
        self.diagnostics.error(Diagnostic::new(Code::UnusableImport, span, message));
    }
}

/// Reports and removes items of a library that belong to a single model.
fn verify_library(ast: &mut Ast, diagnostics: &mut Diagnostics) {
    ast.items.retain(|item| {
        let is_allowed = matches!(
            item.kind,
            ItemKind::Import { .. }
                | ItemKind::Constant { .. }
                | ItemKind::Unit { .. }
                | ItemKind::Let { .. }
                | ItemKind::Function { .. }
                | ItemKind::Table { .. }
        );
        if !is_allowed {
            diagnostics.error(
                Diagnostic::new(Code::UnusableImport, item.span, "this cannot stand in a library").help(
                    "a library has constants, units, `let`s, functions and tables; a model file begins with `model NAME`",
                ),
            );
        }
        is_allowed
    });
}

/// The path of an import relative to the importing file.
fn beside(sources: &SourceMap, source: SourceId, path: &str) -> String {
    let folder = sources.get(source).name.rsplit_once('/').map_or("", |(folder, _)| folder);
    if folder.is_empty() || path.starts_with('/') {
        normalise(path)
    } else {
        normalise(&format!("{folder}/{path}"))
    }
}

/// Removes `.` and resolves `..`.
fn normalise(path: &str) -> String {
    let mut parts: Vec<&str> = Vec::new();
    for part in path.split('/') {
        match (part, parts.last()) {
            (".", _) => {}
            ("..", Some(last)) if *last != ".." && !last.is_empty() => {
                parts.pop();
            }
            _ => parts.push(part),
        }
    }
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::normalise;

    #[test]
    fn paths_are_taken_as_a_file_system_would() {
        assert_eq!(normalise("models/./lib/../lib/friction.dgd"), "models/lib/friction.dgd");
        assert_eq!(normalise("../a/../../b"), "../../b");
        assert_eq!(normalise("/a/../b"), "/b");
    }
}
