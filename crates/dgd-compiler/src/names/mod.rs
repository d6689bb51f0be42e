//! Names and their uses: declarations and reads, in all files of a project.
//!
//! Unlike stage 2, which resolves names within parts and chosen variants only, this covers the whole text: every choice
//! of every variant, parts by the files of their models, and effects with their models. It serves editors: the symbol
//! under the cursor, and its other uses.
//!
//! | file | contents |
//! |---|---|
//! | `declare` | names that the items of a file declare |
//! | `files` | files that a file sees |
//! | `read` | names that expressions and clauses read |

mod declare;
mod files;
mod read;

use std::collections::BTreeMap;

use crate::source::{SourceId, SourceMap, Span};
use crate::syntax::ast::Ast;

/// The position of a symbol in [`NameTable::symbols`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SymbolId(pub usize);

/// The kind of a symbol.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum SymbolKind {
    /// `model NAME`
    Model,
    /// `effect NAME`
    Effect,
    /// `constant`
    Constant,
    /// `parameter`
    Parameter,
    /// `input`
    Input,
    /// `state`, single or an array
    State,
    /// `unknown`, single or an array
    Unknown,
    /// `size`
    Size,
    /// `let`, also in a loop
    Let,
    /// `function`
    Function,
    /// `output`
    Output,
    /// The label of an equation
    Equation,
    /// `variant`
    Variant,
    /// A choice of a variant
    Choice,
    /// `modes`
    Modes,
    /// One of the modes
    Mode,
    /// `part`
    Part,
    /// An argument of a function or of a template
    Argument,
    /// The index of a loop or of an array
    Index,
}

/// A named item.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NamedItem {
    /// Its declared name.
    pub name: String,
    /// Its kind.
    pub kind: SymbolKind,
    /// Place of its first declaration.
    pub declared: Span,
}

/// An occurrence of a symbol.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct NameUse {
    /// The place; `pump.c0` has two, one for the part and one for its member.
    pub span: Span,
    /// The symbol.
    pub symbol: SymbolId,
    /// Whether it is a declaration.
    pub declares: bool,
}

/// All symbols of some files, and all their uses.
#[derive(Debug, Clone, Default)]
pub struct NameTable {
    symbols: Vec<NamedItem>,
    /// Ordered by place.
    uses: Vec<NameUse>,
    scopes: BTreeMap<SourceId, FileScope>,
    /// For each file, the files whose names it reads as its own.
    seen: BTreeMap<SourceId, Vec<SourceId>>,
}

/// The declarations of one file.
#[derive(Debug, Clone, Default)]
struct FileScope {
    model: Option<SymbolId>,
    values: BTreeMap<String, SymbolId>,
    outputs: BTreeMap<String, SymbolId>,
    equations: BTreeMap<String, SymbolId>,
    variants: BTreeMap<String, SymbolId>,
    /// By variant and choice, and by block and mode.
    choices: BTreeMap<(String, String), SymbolId>,
    modes: BTreeMap<String, SymbolId>,
    /// Parts, with the name of the model of each.
    parts: BTreeMap<String, (SymbolId, String)>,
    /// Arguments of a template.
    slots: BTreeMap<String, SymbolId>,
}

impl FileScope {
    /// The symbol that expressions read by a name.
    fn value(&self, name: &str) -> Option<SymbolId> {
        self.values.get(name).or_else(|| self.slots.get(name)).copied()
    }

    /// The symbol that expressions read by a name, or else an output, a variant or an argument of that name.
    fn any(&self, name: &str) -> Option<SymbolId> {
        let symbol = [&self.values, &self.slots, &self.outputs, &self.variants]
            .into_iter()
            .find_map(|names| names.get(name));
        symbol.copied()
    }
}

impl NameTable {
    /// The names of files that were loaded together.
    pub fn collect(asts: &[Ast], sources: &SourceMap) -> NameTable {
        let mut names = NameTable::default();
        for ast in asts {
            names.declare(ast);
        }
        let files = files::NamedFiles::new(asts, sources);
        for ast in asts {
            names.seen.insert(ast.source, files.seen_by(ast));
        }
        for ast in asts {
            read::read(ast, &files, &mut names, sources);
        }
        names.uses.sort_unstable();
        names.uses.dedup_by_key(|one| (one.span, one.symbol));
        names
    }

    /// All symbols, in the order in which the files declare them.
    pub fn symbols(&self) -> impl Iterator<Item = (SymbolId, &NamedItem)> {
        self.symbols.iter().enumerate().map(|(i, symbol)| (SymbolId(i), symbol))
    }

    /// A symbol.
    pub fn symbol(&self, id: SymbolId) -> &NamedItem {
        &self.symbols[id.0]
    }

    /// The use that contains a byte of a source, or ends there.
    pub fn find_at(&self, source: SourceId, byte: u32) -> Option<&NameUse> {
        let is_there = |one: &&NameUse| {
            one.span.source == source && one.span.start <= byte && byte <= one.span.end
        };
        // Of two adjacent ones, the second.
        self.uses.iter().rev().find(is_there)
    }

    /// All uses of a symbol, ordered by place.
    pub fn uses_of(&self, symbol: SymbolId) -> impl Iterator<Item = &NameUse> {
        self.uses.iter().filter(move |one| one.symbol == symbol)
    }

    /// All uses in one source, ordered by place.
    pub fn uses_in(&self, source: SourceId) -> impl Iterator<Item = &NameUse> {
        self.uses.iter().filter(move |one| one.span.source == source)
    }

    /// Names that expressions of a file can read: its own, then those of its libraries and, for an effect, of its
    /// model.
    pub fn readable_in(&self, source: SourceId) -> Vec<SymbolId> {
        let others = self.seen.get(&source).into_iter().flatten();
        let scopes = std::iter::once(&source).chain(others).filter_map(|id| self.scopes.get(id));
        let mut symbols = Vec::new();
        for scope in scopes {
            symbols.extend(scope.values.values().chain(scope.slots.values()));
            symbols.extend(scope.parts.values().map(|(id, _)| id));
        }
        symbols
    }

    /// All declarations of a file and of those that it sees, including labels of equations and outputs.
    pub fn in_sight_of(&self, source: SourceId) -> Vec<SymbolId> {
        let others = self.seen.get(&source).into_iter().flatten();
        let scopes = std::iter::once(&source).chain(others).filter_map(|id| self.scopes.get(id));
        let mut symbols = self.readable_in(source);
        for scope in scopes {
            symbols.extend(scope.equations.values().chain(scope.outputs.values()));
            symbols.extend(scope.variants.values());
        }
        symbols
    }

    /// Names that can follow a part's name and a point.
    pub fn members_of(&self, source: SourceId, part: &str) -> Vec<SymbolId> {
        let Some(scope) = self.model_of_part(source, part) else { return Vec::new() };
        let members = scope.values.values().chain(scope.outputs.values());
        members.chain(scope.parts.values().map(|(id, _)| id)).copied().collect()
    }

    /// The scope of a part's model; `well.pump` is a part of a part.
    fn model_of_part(&self, source: SourceId, part: &str) -> Option<&FileScope> {
        let seen_files = self.seen.get(&source).into_iter().flatten();
        let mut scope = std::iter::once(&source)
            .chain(seen_files)
            .filter_map(|id| self.scopes.get(id))
            .find(|scope| part.split('.').next().is_some_and(|p| scope.parts.contains_key(p)))?;
        for part in part.split('.') {
            let (_, model) = scope.parts.get(part)?;
            scope = self.scopes.values().find(|scope| self.is_model(scope, model))?;
        }
        Some(scope)
    }

    fn is_model(&self, scope: &FileScope, name: &str) -> bool {
        scope.model.is_some_and(|id| self.symbol(id).name == name)
    }

    fn add(&mut self, name: &str, kind: SymbolKind, declared: Span) -> SymbolId {
        self.symbols.push(NamedItem { name: name.to_owned(), kind, declared });
        let id = SymbolId(self.symbols.len() - 1);
        self.uses.push(NameUse { span: declared, symbol: id, declares: true });
        id
    }
}
