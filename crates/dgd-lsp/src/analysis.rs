//! The compiler's analysis of a document: errors, the model, dimensions of expressions.

use std::collections::BTreeMap;
use std::path::Path;

use dgd_compiler::dae::assemble;
use dgd_compiler::diagnostics::{Diagnostic, Diagnostics, ErrorReported};
use dgd_compiler::effects::{Effect, EffectApplication, EffectBlending, apply};
use dgd_compiler::model::{Model, ModelOptions, resolve, resolve_noting};
use dgd_compiler::pipeline::further_mistakes;
use dgd_compiler::source::{SourceMap, SourceText, Span};
use dgd_compiler::syntax::ast::{Ast, EffectTarget, Name};
use dgd_compiler::syntax::imports::{self, LoadedFiles};
use dgd_compiler::syntax::parse;
use dgd_compiler::units::Dimension;

use crate::files::OpenDocuments;

/// A document with the first choice of each variant, as far as it can be analysed.
pub(crate) struct Analysis {
    /// Sources, with the document itself first.
    pub(crate) sources: SourceMap,
    pub(crate) asts: Vec<Ast>,
    pub(crate) model: Option<Model>,
    /// Dimensions of expressions, by span.
    pub(crate) dimensions: BTreeMap<Span, Dimension>,
    pub(crate) diagnostics: Vec<Diagnostic>,
    /// Errors in choices other than the first, once these are analysed.
    pub(crate) others: Vec<Diagnostic>,
}

/// Results for choices other than the first.
pub(crate) struct OtherChoices {
    diagnostics: Vec<Diagnostic>,
    dimensions: BTreeMap<Span, Dimension>,
}

/// Analyses the file at a path.
pub(crate) fn analyse(path: &str, files: &OpenDocuments) -> Analysis {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let main = SourceText { name: path.to_owned(), text: files.read(path).unwrap_or_default() };
    let mut read = |path: &str| files.read(path);
    let LoadedFiles { asts, holes } =
        imports::load(vec![main], &mut read, &mut sources, &mut diagnostics);
    let mut dimensions = BTreeMap::new();
    let options = ModelOptions::default();
    let mut model = None;
    if asts[0].effect.is_some() {
        if diagnostics.check().is_ok() {
            effect(path, &asts[0], files, &mut sources, &mut dimensions, &mut diagnostics);
        }
    } else if asts[0].model.is_some() {
        let is_sound = diagnostics.check().is_ok();
        if !is_sound {
            further_mistakes(&asts, &holes, &options, &mut diagnostics);
        }
        let mut problems = Diagnostics::default();
        model = resolve_noting(&asts, &options, Some(&mut dimensions), &mut problems).ok();
        if let Some(model) = model.as_ref().filter(|_| is_sound) {
            let _: Result<_, ErrorReported> = assemble(model, &mut problems);
        }
        if is_sound {
            take(&problems, &mut diagnostics);
        }
    } else if diagnostics.check().is_ok() {
        library(&asts, &mut sources, &mut dimensions, &mut diagnostics);
    }
    let diagnostics = diagnostics.sorted().into_iter().cloned().collect();
    Analysis { sources, asts, model, dimensions, diagnostics, others: Vec::new() }
}

fn take(from: &Diagnostics, to: &mut Diagnostics) {
    for diagnostic in from.sorted() {
        to.error(diagnostic.clone());
    }
}

/// Checks a library by itself: its functions, constants and `let`s, as in a model without other items.
fn library(
    asts: &[Ast],
    sources: &mut SourceMap,
    dimensions: &mut BTreeMap<Span, Dimension>,
    diagnostics: &mut Diagnostics,
) {
    let mut problems = Diagnostics::default();
    let main = SourceText { name: String::new(), text: "model library".to_owned() };
    let Ok(main) = parse(sources.add(main), sources, &mut problems) else { return };
    let trees: Vec<Ast> = std::iter::once(main).chain(asts.iter().cloned()).collect();
    let _: Result<_, ErrorReported> =
        resolve_noting(&trees, &ModelOptions::default(), Some(dimensions), &mut problems);
    // A library does not need the other items that a model must have.
    let is_own =
        |one: &&&Diagnostic| one.labels.first().is_some_and(|l| l.span.source == asts[0].source);
    for diagnostic in problems.sorted().iter().filter(is_own) {
        diagnostics.error((*diagnostic).clone());
    }
}

/// Checks an effect, together with its model if that is in the folder above.
fn effect(
    path: &str,
    ast: &Ast,
    files: &OpenDocuments,
    sources: &mut SourceMap,
    dimensions: &mut BTreeMap<Span, Dimension>,
    diagnostics: &mut Diagnostics,
) {
    let Ok(effect) = Effect::read(ast.clone(), diagnostics) else { return };
    let EffectTarget::Model(name) = &effect.target else { return };
    let above = Path::new(path).ancestors().skip(2).take(2);
    let mut candidates = above.map(|f| f.join(format!("{}.dgd", name.text)).display().to_string());
    let Some(model) = candidates.find(|path| files.is_file(path)) else { return };
    let main = SourceText { name: model.clone(), text: files.read(&model).unwrap_or_default() };
    let (mut read, mut own) = (|path: &str| files.read(path), Diagnostics::default());
    let LoadedFiles { asts, .. } = imports::load(vec![main], &mut read, sources, &mut own);
    // Errors of the model are reported in its own file.
    if own.check().is_err() || resolve(&asts, &ModelOptions::default(), &mut own).is_err() {
        return;
    }
    let application =
        EffectApplication { effect: &effect, arguments: Vec::new(), span: effect.name.span };
    let _: Result<_, ErrorReported> =
        apply(&asts, &[application], EffectBlending::Applied, diagnostics)
            .and_then(|applied| {
                let options = ModelOptions::default();
                resolve_noting(&applied.asts, &options, Some(dimensions), diagnostics)
            })
            .and_then(|model| assemble(&model, diagnostics));
}

impl Analysis {
    /// Errors in choices other than the first, one at a time, and dimensions in them; `None` once `goes_on` is false
    /// because newer work is waiting.
    pub(crate) fn other_variants(&self, goes_on: &mut dyn FnMut() -> bool) -> Option<OtherChoices> {
        let (mut own, mut dimensions) = (Diagnostics::default(), BTreeMap::new());
        for variant in self.model.iter().flat_map(|model| &model.variants) {
            for (_, choice) in
                variant.choices.iter().enumerate().filter(|(i, _)| *i != variant.chosen)
            {
                if !goes_on() {
                    return None;
                }
                let name = |text: &str| Name { text: text.to_owned(), span: Span::default() };
                let variants = vec![(name(&variant.name), name(choice))];
                let options = ModelOptions { variants, ..ModelOptions::default() };
                let noted = Some(&mut dimensions);
                let _: Result<_, ErrorReported> =
                    resolve_noting(&self.asts, &options, noted, &mut own)
                        .and_then(|model| assemble(&model, &mut own));
            }
        }
        Some(OtherChoices { diagnostics: own.sorted().into_iter().cloned().collect(), dimensions })
    }

    /// Adds the results of other choices.
    pub(crate) fn add(&mut self, OtherChoices { diagnostics, dimensions }: OtherChoices) {
        self.others = diagnostics;
        for (span, dimension) in dimensions {
            self.dimensions.entry(span).or_insert(dimension);
        }
    }
}
