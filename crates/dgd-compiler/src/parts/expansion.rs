//! Expands a file into its items, including those of its parts.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use super::binding::{self, PartInput, WrittenBinding as Binding};
use super::expanded::ExpandedModel;
use super::flat_model::{FlatModel, InnerModel};
use super::instance::{PartInstance, instance};
use super::names::{declared, part_names, values};
use super::tied::tie;
use super::unknown::verify_names;
use super::visible::{CompilationFiles, VisibleFiles};
use super::written::{ChoicePath, WrittenPart, agree, collect};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported, suggestion};
use crate::source::{SourceId, Span};
use crate::syntax::ast::{Ast, Item, ItemKind, LoopCounter, Name};
use crate::syntax::rename::Renaming;
use crate::syntax::visit;

/// Limit on the nesting of parts.
const DEEPEST: usize = 64;

/// Limit on the total size of parts: bytes of text, plus [`EVERY_ITEM`] for each item.
const LARGEST: usize = 8 << 20;
/// Size of an item in addition to its text, bytes.
const EVERY_ITEM: usize = 128;

/// An expanded part, or a failed one.
struct ExpandedPart<'a> {
    written: WrittenPart<'a>,
    instance: Result<PartInstance, ErrorReported>,
}

pub(super) struct PartExpansion<'a, 'd> {
    asts: &'a [Ast],
    files: CompilationFiles<'a>,
    /// Names of libraries that only parts see.
    library_names: BTreeMap<SourceId, String>,
    done: BTreeMap<SourceId, Result<ExpandedModel, ErrorReported>>,
    /// The models that are being expanded, outermost first.
    open: Vec<&'a Ast>,
    size: usize,
    /// Inputs of the model's parts that are bound in pieces.
    in_pieces: BTreeSet<String>,
    /// Names that the model and its libraries declare.
    taken: BTreeSet<String>,
    diagnostics: &'d mut Diagnostics,
}

impl<'a, 'd> PartExpansion<'a, 'd> {
    pub(super) fn new(asts: &'a [Ast], diagnostics: &'d mut Diagnostics) -> Self {
        PartExpansion {
            asts,
            files: CompilationFiles::new(asts),
            library_names: BTreeMap::new(),
            done: BTreeMap::new(),
            open: Vec::new(),
            size: 0,
            in_pieces: BTreeSet::new(),
            taken: BTreeSet::new(),
            diagnostics,
        }
    }

    /// The trees of the model and the libraries, and the parts.
    pub(super) fn whole(mut self) -> Result<FlatModel<'static>, ErrorReported> {
        let main = &self.asts[0];
        let visible = self.files.visible(main, self.diagnostics);
        let taken = part_names(&main.items);
        self.library_names = self.files.library_names(&visible.libraries, taken);
        let mut whole = self.model(main, &visible)?;
        tie(&mut whole);

        let mut asts = vec![Ast { items: whole.items, ..main.clone() }];
        for library in self.asts.iter().filter(|ast| whole.libraries.contains(&ast.source)) {
            let mut items = library.items.clone();
            if self.library_names.contains_key(&library.source) {
                let visible = self.files.visible(library, self.diagnostics);
                let mut names = self.foreign_names(&visible);
                self.library_names_of(library, &mut names);
                for item in &mut items {
                    names.rename_item(item);
                }
                verify_names(&mut items, library, &visible, &self.library_names, self.diagnostics);
            }
            asts.push(Ast { items, ..library.clone() });
        }
        self.diagnostics.check()?;
        let ExpandedModel { parts, lengths, .. } = whole;
        Ok(FlatModel { asts: Cow::Owned(asts), parts, lengths })
    }

    /// A model with its parts expanded.
    fn model(
        &mut self,
        ast: &'a Ast,
        visible: &VisibleFiles<'a>,
    ) -> Result<ExpandedModel, ErrorReported> {
        let outer = std::mem::take(self.diagnostics);
        let whole = self.sound_model(ast, visible);
        let problems = std::mem::replace(self.diagnostics, outer);
        for diagnostic in problems.sorted() {
            self.diagnostics.error(diagnostic.clone());
        }
        problems.check().map(|()| whole)
    }

    /// A model with its parts expanded, valid only if nothing is reported.
    fn sound_model(&mut self, ast: &'a Ast, visible: &VisibleFiles<'a>) -> ExpandedModel {
        let mut items = ast.items.clone();
        let is_main = self.open.is_empty();
        self.open.push(ast);
        if !is_main {
            let mut names = self.foreign_names(visible);
            for (namespace, name) in declared(&mut items) {
                names.insert(namespace, name.clone(), name);
            }
            for item in &mut items {
                names.rename_item(item);
            }
        }
        let mut whole = ExpandedModel {
            libraries: visible.libraries.iter().map(|library| library.source).collect(),
            ..ExpandedModel::default()
        };
        let (mut parts, mut bindings) = (Vec::new(), Vec::new());
        collect(&items, &mut ChoicePath::new(), &mut parts, &mut bindings);
        let in_pieces = binding::in_pieces(&bindings);
        let taken = taken_by(&items, visible);
        self.verify_parts(&items, &parts);
        let placed: Vec<ExpandedPart<'_>> = parts
            .into_iter()
            .map(|written| {
                let mut instance = self.part(&written, visible, &taken, &mut whole);
                if let Ok(instance) = &mut instance {
                    binding::as_unknowns(&mut instance.items, &in_pieces);
                    // An input that is bound in some choices only stays an input for the others.
                    instance.remove_inputs(&|input| {
                        bindings.iter().any(|b| b.input.text == input && b.is_there_with(&written))
                    });
                }
                ExpandedPart { written, instance }
            })
            .collect();
        binding::verify_once(&bindings, self.diagnostics);
        (self.in_pieces, self.taken) = (in_pieces, taken);
        let n_items =
            |placed: &ExpandedPart<'_>| placed.instance.as_ref().map_or(0, |i| i.items.len());
        whole.lengths = placed.iter().map(n_items).collect();
        let mut used = 0;
        whole.items = self.in_place(&items, &mut ChoicePath::new(), &placed, &mut used);
        visit::items(&whole.items, &mut |item| whole.size += EVERY_ITEM + length(item.span));
        if !is_main && self.diagnostics.check().is_ok() {
            verify_names(&mut whole.items, ast, visible, &self.library_names, self.diagnostics);
        }
        self.open.pop();
        whole
    }

    /// One part, with the names of the enclosing model.
    fn part(
        &mut self,
        written: &WrittenPart<'_>,
        visible: &VisibleFiles<'a>,
        taken: &BTreeSet<String>,
        whole: &mut ExpandedModel,
    ) -> Result<PartInstance, ErrorReported> {
        let WrittenPart { item, name, model, .. } = written;
        let Some(ast) = visible.models.get(model.text.as_str()).copied() else {
            let message = format!("there is no model `{}`", model.text);
            let help = match suggestion(&model.text, visible.models.keys().copied()) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("import it: `import \"{}.dgd\"`", model.text),
            };
            return Err(self.diagnostics.error(
                Diagnostic::new(Code::UnknownName, model.span, message)
                    .about(&model.text)
                    .help(help),
            ));
        };
        self.verify_nesting(ast, model)?;
        if !self.done.contains_key(&ast.source) {
            let visible = self.files.visible(ast, self.diagnostics);
            let inner = self.model(ast, &visible);
            self.done.insert(ast.source, inner);
        }
        let inner = self.done[&ast.source].clone()?;
        self.size += inner.size;
        if self.size > LARGEST {
            let message = "the parts of this model come to more text than can be compiled";
            return Err(self.diagnostics.error(Diagnostic::new(
                Code::ModelTooLarge,
                model.span,
                message,
            )));
        }
        whole.libraries.extend(&inner.libraries);
        whole.parts.push(InnerModel {
            name: name.text.clone(),
            model: model.text.clone(),
            doc: item.doc.clone(),
            span: name.span,
        });
        whole.parts.extend(inner.parts.iter().map(|part| InnerModel {
            name: format!("{}.{}", name.text, part.name),
            ..part.clone()
        }));
        instance(written, inner, taken, &mut whole.set, self.diagnostics)
    }

    /// Checks that no model contains itself, and that the nesting of parts is limited.
    fn verify_nesting(&mut self, ast: &'a Ast, model: &Name) -> Result<(), ErrorReported> {
        if let Some(first) = self.open.iter().position(|open| open.source == ast.source) {
            let chain = self.open[first..].iter().chain([&ast]);
            let names = chain.filter_map(|ast| ast.model.as_ref());
            let names: Vec<String> =
                names.map(|header| format!("`{}`", header.name.text)).collect();
            let message = format!("`{}` contains itself: {}", model.text, names.join(" → "));
            return Err(self.diagnostics.error(
                Diagnostic::new(Code::RecursiveModel, model.span, message).about(&model.text),
            ));
        }
        if self.open.len() > DEEPEST {
            let message = format!("parts are nested more than {DEEPEST} deep");
            return Err(self.diagnostics.error(Diagnostic::new(
                Code::ModelTooLarge,
                model.span,
                message,
            )));
        }
        Ok(())
    }

    /// The declarations of the libraries that a file sees, with their names in the whole.
    fn foreign_names(&self, visible: &VisibleFiles<'_>) -> Renaming {
        let mut names = Renaming::default();
        for library in &visible.libraries {
            self.library_names_of(library, &mut names);
        }
        names
    }

    /// Adds the names of a library's declarations in the whole.
    fn library_names_of(&self, library: &Ast, names: &mut Renaming) {
        if let Some(prefix) = self.library_names.get(&library.source) {
            for (namespace, name) in declared(&mut library.items.clone()) {
                let new = format!("{prefix}.{name}");
                names.insert(namespace, name, new);
            }
        }
    }

    /// Checks that parts have names of their own.
    fn verify_parts(&mut self, items: &[Item], parts: &[WrittenPart<'_>]) {
        let values = values(items);
        for (i, part) in parts.iter().enumerate() {
            let name = part.name;
            let same = |other: &&WrittenPart<'_>| {
                other.name.text == name.text && agree(&other.path, &part.path)
            };
            let first = parts[..i].iter().find(same).map(|first| first.name.span);
            if let Some(first) = first.or_else(|| values.get(name.text.as_str()).copied()) {
                let message = format!("`{}` is declared twice", name.text);
                self.diagnostics.error(
                    Diagnostic::new(Code::DuplicateName, name.span, message)
                        .about(&name.text)
                        .label(first, "also here"),
                );
            }
        }
    }

    /// The items with parts and bindings replaced; parts are taken in the order of `collect`.
    fn in_place(
        &mut self,
        items: &[Item],
        path: &mut ChoicePath,
        placed: &[ExpandedPart<'_>],
        used: &mut usize,
    ) -> Vec<Item> {
        let mut replaced = Vec::with_capacity(items.len());
        for item in items {
            match &item.kind {
                ItemKind::Part { .. } => {
                    if let Ok(instance) = &placed[*used].instance {
                        replaced.extend(instance.items.iter().cloned());
                    }
                    *used += 1;
                }
                ItemKind::Binding { input, indices, value } => {
                    let counters: &[LoopCounter] = &[];
                    let written = Binding { item, input, indices, value, counters };
                    replaced.extend(self.bound(&written, path, placed));
                }
                ItemKind::For { counters, items } => {
                    let one = |item: &Item| match &item.kind {
                        ItemKind::Binding { input, indices, value } => {
                            let written = Binding { item, input, indices, value, counters };
                            self.bound(&written, path, placed)
                        }
                        _ => Some(item.clone()),
                    };
                    let items = items.iter().filter_map(one).collect();
                    let kind = ItemKind::For { counters: counters.clone(), items };
                    replaced.push(Item { kind, ..item.clone() });
                }
                ItemKind::Variant { name, choices } => {
                    let mut choices = choices.clone();
                    for (i, choice) in choices.iter_mut().enumerate() {
                        path.push((name.text.clone(), i));
                        choice.items = self.in_place(&choice.items, path, placed, used);
                        path.pop();
                    }
                    let kind = ItemKind::Variant { name: name.clone(), choices };
                    replaced.push(Item { kind, ..item.clone() });
                }
                _ => replaced.push(item.clone()),
            }
        }
        replaced
    }

    /// The item that replaces a binding, if that is valid.
    fn bound(
        &mut self,
        written: &Binding<'_>,
        path: &ChoicePath,
        placed: &[ExpandedPart<'_>],
    ) -> Option<Item> {
        let input = written.input;
        let socket = self.socket(input, path, placed).ok()?;
        match written.item(&socket, self.in_pieces.contains(&input.text), &self.taken) {
            Ok(item) => Some(item),
            Err(diagnostic) => {
                self.diagnostics.error(diagnostic);
                None
            }
        }
    }

    /// The input that is bound.
    fn socket(
        &mut self,
        input: &Name,
        path: &ChoicePath,
        placed: &[ExpandedPart<'_>],
    ) -> Result<PartInput, ErrorReported> {
        let (part, _) = input.text.split_once('.').unwrap_or((&input.text, ""));
        let mut candidates = placed.iter().filter(|p| p.written.name.text == part);
        let found_part = candidates.find(|p| agree(&p.written.path, path));
        let Some(ExpandedPart { written, instance }) = found_part else {
            let message = format!("there is no part `{part}`");
            let known = placed.iter().map(|p| p.written.name.text.as_str());
            let help = match suggestion(part, known) {
                Some(near) => format!("did you mean `{near}`?"),
                None => "only inputs of parts are bound; `let` gives a value a name".to_owned(),
            };
            let diagnostic =
                Diagnostic::new(Code::UnknownName, input.span, message).about(part).help(help);
            return Err(self.diagnostics.error(diagnostic));
        };
        let instance = instance.as_ref().map_err(|reported| *reported)?;
        if let Some(socket) = instance.inputs.get(&input.text) {
            return Ok(socket.clone());
        }
        let is_declared = instance.values.contains(&input.text);
        let (code, message) = if is_declared {
            (Code::MisusedName, format!("`{}` is no input of part `{part}`", input.text))
        } else {
            (Code::UnknownName, format!("part `{part}` has no input `{}`", input.text))
        };
        let near = suggestion(&input.text, instance.inputs.keys().map(String::as_str));
        let inputs: Vec<&str> = instance.inputs.keys().map(String::as_str).collect();
        let help = match near {
            Some(near) => format!("did you mean `{near}`?"),
            None if is_declared => format!(
                "values are given where the part is declared: `part {part}: {}(… = …)`",
                written.model.text
            ),
            None if inputs.is_empty() => "its model has no inputs".to_owned(),
            None => format!("there is `{}`", inputs.join("`, `")),
        };
        let diagnostic = Diagnostic::new(code, input.span, message).about(part).about(&input.text);
        Err(self.diagnostics.error(diagnostic.help(help)))
    }
}

/// Names declared by a model and the libraries that it sees; no index may have one.
fn taken_by(items: &[Item], visible: &VisibleFiles<'_>) -> BTreeSet<String> {
    let libraries = visible.libraries.iter().map(|library| library.items.as_slice());
    libraries.chain([items]).flat_map(|items| values(items).into_keys()).collect()
}

fn length(span: Span) -> usize {
    (span.end - span.start) as usize
}
