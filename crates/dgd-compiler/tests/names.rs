//! Renames every symbol of every model, in all its uses; afterwards all files must be as valid as before.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use dgd_compiler::dae::assemble;
use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::effects::{Effect, EffectApplication, EffectBlending, apply, bind};
use dgd_compiler::model::{ModelOptions, resolve};
use dgd_compiler::names::NameTable;
use dgd_compiler::pipeline::load;
use dgd_compiler::source::{SourceId, SourceMap, SourceText, Span};
use dgd_compiler::syntax::ast::Name;
use dgd_compiler::syntax::{imports, parse};

type Texts = BTreeMap<PathBuf, String>;

/// All files in a folder and its subfolders.
fn collect(folder: &Path, all: &mut Texts) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            collect(&path, all);
        } else if path.extension().is_some_and(|ending| ending == "dgd") {
            let text = fs::read_to_string(&path).expect("a text");
            all.insert(path, text);
        }
    }
}

fn models() -> Texts {
    let mut all = Texts::new();
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    collect(&package.ancestors().nth(2).expect("the repository").join("models"), &mut all);
    all
}

fn names_of(texts: &Texts) -> (NameTable, SourceMap, Vec<PathBuf>) {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let source = |(path, text): (&PathBuf, &String)| SourceText {
        name: path.display().to_string(),
        text: text.clone(),
    };
    let files: Vec<SourceText> = texts.iter().map(source).collect();
    let mut read = |path: &str| Err(format!("{path} is not among the files"));
    let loaded = imports::load(files, &mut read, &mut sources, &mut diagnostics);
    let shown = render::render(&diagnostics.sorted(), &sources, render::RenderStyle::Plain);
    assert!(diagnostics.check().is_ok(), "{shown}");
    let names = NameTable::collect(&loaded.asts, &sources);
    (names, sources, texts.keys().cloned().collect())
}

/// Checks one model in all its variants, one choice at a time, and the effects on it; skipped if the model, its imports
/// and its effects are unchanged.
fn check(texts: &Texts, changed: &BTreeSet<PathBuf>, path: &Path) -> Result<(), String> {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let main = SourceText { name: path.display().to_string(), text: texts[path].clone() };
    let mut read = |path: &str| texts.get(Path::new(path)).cloned().ok_or_else(String::new);
    let asts = load(main, &mut read, &mut sources, &mut diagnostics);
    let is_reached = sources.iter().any(|source| changed.contains(Path::new(&source.name)));
    let effects = path.parent().expect("a folder").join("effects");
    let is_affected = is_reached || changed.iter().any(|path| path.starts_with(&effects));
    if let Ok(asts) = &asts
        && asts[0].model.is_some()
        && is_affected
    {
        let model = resolve(asts, &ModelOptions::default(), &mut diagnostics);
        if let Ok(model) = &model {
            let _ = assemble(model, &mut diagnostics);
            for variant in &model.variants {
                for choice in &variant.choices {
                    let variants = vec![(name(&variant.name), name(choice))];
                    let options = ModelOptions { variants, ..ModelOptions::default() };
                    let _ = resolve(asts, &options, &mut diagnostics);
                }
            }
            for (effect, text) in texts.iter().filter(|(path, _)| path.starts_with(&effects)) {
                if !is_reached && !changed.contains(effect) {
                    continue;
                }
                let name = effect.display().to_string();
                let id = sources.add(SourceText { name, text: text.clone() });
                let Ok(ast) = parse(id, &sources, &mut diagnostics) else { continue };
                let Ok(effect) = Effect::read(ast, &mut diagnostics) else { continue };
                let Some(arguments) = bind(&effect, model).into_iter().next() else { continue };
                let arguments = arguments.iter().map(|text| self::name(text)).collect();
                let application =
                    EffectApplication { effect: &effect, arguments, span: Span::default() };
                let applied =
                    apply(asts, &[application], EffectBlending::Applied, &mut diagnostics);
                let _ = applied.and_then(|applied| {
                    resolve(&applied.asts, &ModelOptions::default(), &mut diagnostics)
                });
            }
        }
    }
    let shown = render::render(&diagnostics.sorted(), &sources, render::RenderStyle::Plain);
    diagnostics.check().map_err(|_| shown)
}

fn name(text: &str) -> Name {
    Name { text: text.to_owned(), span: Span::default() }
}

/// The texts with some places replaced; the places are ordered.
fn replaced(texts: &Texts, paths: &[PathBuf], edits: &[(Span, String)]) -> Texts {
    let mut changed = texts.clone();
    for (span, new) in edits.iter().rev() {
        let text = changed.get_mut(&paths[span.source.0 as usize]).expect("a file");
        text.replace_range(span.start as usize..span.end as usize, new);
    }
    changed
}

/// The errors in any of the files.
fn mistakes(texts: &Texts, paths: &[PathBuf], edits: &[(Span, String)]) -> Vec<String> {
    let path_of = |(span, _): &(Span, String)| paths[span.source.0 as usize].clone();
    let changed: BTreeSet<PathBuf> = edits.iter().map(path_of).collect();
    let wrong = |path: &PathBuf| check(texts, &changed, path).err();
    texts.keys().filter_map(|path| Some(format!("{}: {}", path.display(), wrong(path)?))).collect()
}

#[test]
fn a_symbol_that_is_renamed_everywhere_leaves_every_model_sound() {
    let texts = models();
    let (names, sources, paths) = names_of(&texts);
    let (mut failed, mut n_renamed) = (Vec::new(), 0);
    // All symbols of one file at a time, each with a new unique name.
    let mut groups: BTreeMap<SourceId, Vec<_>> = BTreeMap::new();
    for (id, symbol) in names.symbols() {
        groups.entry(symbol.declared.source).or_default().push((id, symbol));
    }
    for (source, symbols) in groups {
        let mut edits: Vec<(Span, String)> = Vec::new();
        for (k, (id, symbol)) in symbols.iter().enumerate() {
            n_renamed += 1;
            for one in names.uses_of(*id) {
                assert_eq!(sources.text(one.span), symbol.name, "a use is the name itself");
                edits.push((one.span, format!("renamed{k}_{}", symbol.name.replace('.', "_"))));
            }
        }
        edits.sort();
        let wrong = mistakes(&replaced(&texts, &paths, &edits), &paths, &edits);
        if let Some(first) = wrong.first() {
            let path = paths[source.0 as usize].display();
            failed.push(format!("{path}, {} symbols: {first}", symbols.len()));
        }
    }
    println!("{n_renamed} symbols were renamed");
    assert!(n_renamed > 1000, "{n_renamed}");
    assert!(failed.is_empty(), "{} failed:\n{}", failed.len(), failed.join("\n"));
}

#[test]
fn a_name_that_is_not_followed_is_noticed() {
    // Checks that the test above can fail: omitting any use of a state breaks something.
    let texts = models();
    let (names, _, paths) = names_of(&texts);
    let file = paths.iter().position(|path| path.ends_with("mud_circulation.dgd"));
    let source = SourceId(file.expect("the model") as u32);
    let mut all = names.symbols().filter(|(_, symbol)| symbol.declared.source == source);
    let (id, _) = all.find(|(_, symbol)| symbol.name == "h_r").expect("the riser's level");
    let edits: Vec<(Span, String)> =
        names.uses_of(id).map(|one| (one.span, "level".to_owned())).collect();
    assert!(edits.iter().any(|(span, _)| span.source != source), "effects name it, too");
    for left_out in 0..edits.len() {
        let mut some = edits.clone();
        some.remove(left_out);
        let changed = replaced(&texts, &paths, &some);
        assert!(!mistakes(&changed, &paths, &some).is_empty(), "{left_out}");
    }
}
