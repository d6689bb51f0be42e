//! The files that a file sees: its libraries, the models of its parts, an effect's model.

use std::collections::{BTreeMap, BTreeSet};

use crate::source::{SourceId, SourceMap};
use crate::syntax::ast::{Ast, EffectTarget};

/// The files, by name.
pub(super) struct NamedFiles<'a> {
    asts: &'a [Ast],
    sources: &'a SourceMap,
    position: BTreeMap<SourceId, usize>,
}

impl<'a> NamedFiles<'a> {
    pub(super) fn new(asts: &'a [Ast], sources: &'a SourceMap) -> NamedFiles<'a> {
        let position = asts.iter().enumerate().map(|(i, ast)| (ast.source, i)).collect();
        NamedFiles { asts, sources, position }
    }

    fn get(&self, id: SourceId) -> Option<&'a Ast> {
        self.position.get(&id).map(|i| &self.asts[*i])
    }

    /// The files whose names a file reads as its own: libraries that it imports, directly or through others; for an
    /// effect, its model and the files seen by it; for a library, also the files that import it, nearest first.
    pub(super) fn seen_by(&self, ast: &'a Ast) -> Vec<SourceId> {
        let mut visible = self.libraries_of(ast);
        if let Some(model) = self.model_of_effect(ast) {
            visible.push(model.source);
            visible.extend(self.libraries_of(model));
        }
        if ast.model.is_none() && ast.effect.is_none() {
            for other in self.asts.iter().filter(|other| other.source != ast.source) {
                let libraries = self.libraries_of(other);
                if libraries.contains(&ast.source) {
                    visible.push(other.source);
                    visible.extend(libraries);
                }
            }
        }
        let mut once = BTreeSet::from([ast.source]);
        visible.retain(|id| once.insert(*id));
        visible
    }

    fn libraries_of(&self, ast: &'a Ast) -> Vec<SourceId> {
        let mut libraries = Vec::new();
        let mut pending = vec![ast];
        while let Some(file) = pending.pop() {
            for import in &file.imports {
                let library = self.get(*import).filter(|ast| ast.model.is_none());
                if let Some(library) = library
                    && !libraries.contains(import)
                {
                    libraries.push(*import);
                    pending.push(library);
                }
            }
        }
        libraries
    }

    /// The model of this name that a file imports, or else any model of this name.
    pub(super) fn model(&self, name: &str, of: SourceId) -> Option<SourceId> {
        let is_it = |ast: &&Ast| ast.model.as_ref().is_some_and(|model| model.name.text == name);
        let importer = self.get(of)?;
        let through = self.libraries_of(importer).into_iter().filter_map(|id| self.get(id));
        let files = std::iter::once(importer).chain(through);
        let mut imported = files.flat_map(|file| &file.imports).filter_map(|id| self.get(*id));
        let model_file = imported.find(is_it).or_else(|| self.nearest(name, importer));
        model_file.map(|ast| ast.source)
    }

    /// The model of a name whose path is nearest to a file.
    fn nearest(&self, name: &str, to: &Ast) -> Option<&'a Ast> {
        let path = &self.sources.get(to.source).name;
        let common = |ast: &&Ast| {
            let other = &self.sources.get(ast.source).name;
            path.split('/').zip(other.split('/')).take_while(|(a, b)| a == b).count()
        };
        let is_it = |ast: &&Ast| ast.model.as_ref().is_some_and(|model| model.name.text == name);
        // The first of several at the same distance.
        self.asts.iter().rev().filter(is_it).max_by_key(common)
    }

    /// The model of an effect.
    pub(super) fn model_of_effect(&self, ast: &Ast) -> Option<&'a Ast> {
        match &ast.effect.as_ref()?.target {
            EffectTarget::Model(name) => self.nearest(&name.text, ast),
            EffectTarget::Template(_) => None,
        }
    }
}
