//! Every stage of the compiler against files: mistakes in `golden/fail/`, sound models in
//! `golden/pass/`, and `docs/errors.md`.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use dgd_compiler::codegen;
use dgd_compiler::diagnostics::codes::{CODES, CodeInfo};
use dgd_compiler::diagnostics::{Code, Diagnostics, render};
use dgd_compiler::effects::{self, Effect, EffectApplication, EffectBlending};
use dgd_compiler::model::{ModelOptions, Setting};
use dgd_compiler::pipeline::{CompiledStages, SensitivityDirections, compile_asts, load};
use dgd_compiler::program::FunctionKind;
use dgd_compiler::source::{SourceId, SourceMap, SourceText, Span};
use dgd_compiler::syntax::ast::Name;
use dgd_compiler::syntax::{parse, parse_setting, print};

use crate::golden::{Goldens, files};
use crate::inline;
use crate::support::root;

/// One compilation, with the choices that its first line may ask for:
/// `# options: --set c0=5 --variant flow=static --to c0 --apply effects/lag.dgd`.
struct Compilation {
    sources: SourceMap,
    diagnostics: Diagnostics,
}

impl Compilation {
    fn new() -> Self {
        Compilation { sources: SourceMap::default(), diagnostics: Diagnostics::default() }
    }

    fn argument(&mut self, flag: &str, text: &str) -> SourceId {
        self.sources.add(SourceText { name: format!("({flag})"), text: text.to_owned() })
    }

    fn name(&mut self, flag: &str, text: &str) -> Name {
        let source = self.argument(flag, text);
        let end = u32::try_from(text.len()).expect("a short argument");
        Name { text: text.to_owned(), span: Span { source, start: 0, end } }
    }

    fn choices(&mut self, text: &str) -> (ModelOptions, SensitivityDirections, Vec<String>) {
        let (mut options, mut directions) = (ModelOptions::default(), SensitivityDirections::All);
        let mut apply = Vec::new();
        let header = text.lines().next().and_then(|line| line.strip_prefix("# options: "));
        let mut words = header.unwrap_or_default().split_whitespace();
        while let (Some(flag), Some(value)) = (words.next(), words.next()) {
            match flag {
                "--set" => {
                    let source = self.argument(flag, value);
                    let (name, value) = parse_setting(source, &self.sources, &mut self.diagnostics)
                        .expect("a setting in a golden file parses");
                    options.settings.push(Setting { name, value });
                }
                "--variant" => {
                    let (variant, choice) = value.split_once('=').expect("NAME=CHOICE");
                    options.variants.push((self.name(flag, variant), self.name(flag, choice)));
                }
                "--to" => {
                    let names = value.split(',').map(|name| self.name(flag, name)).collect();
                    directions = SensitivityDirections::Named(names);
                }
                "--apply" => apply.push(value.to_owned()),
                _ => panic!("golden files know no option {flag}"),
            }
        }
        (options, directions, apply)
    }

    /// Reads `path/to/effect.dgd(argument)`.
    fn effect(&mut self, asked: &str, folder: &Path) -> Option<(Effect, Vec<Name>, Span)> {
        let (path, arguments) = asked.split_once('(').unwrap_or((asked, ""));
        let text = fs::read_to_string(folder.join(path)).expect("an effect");
        let id = self.sources.add(SourceText { name: path.to_owned(), text });
        let words = arguments.trim_end_matches(')').split(',').filter(|word| !word.is_empty());
        let arguments = words.map(|word| self.name("--apply", word)).collect();
        let ast = parse(id, &self.sources, &mut self.diagnostics).ok()?;
        let effect = Effect::read(ast, &mut self.diagnostics).ok()?;
        let span = self.name("--apply", asked).span;
        Some((effect, arguments, span))
    }

    /// Compiles a text, with effects where it asks for some; imports are read from `folder`. The text
    /// of the changed model comes with it.
    fn run(
        &mut self,
        name: &str,
        text: &str,
        folder: &Path,
    ) -> Option<(CompiledStages, Option<String>)> {
        let (options, directions, apply) = self.choices(text);
        let main = SourceText { name: name.to_owned(), text: text.to_owned() };
        let mut read =
            |path: &str| fs::read_to_string(folder.join(path)).map_err(|_| "not found".to_owned());
        let asts = load(main, &mut read, &mut self.sources, &mut self.diagnostics).ok()?;
        let asked: Vec<_> = apply.iter().map(|asked| self.effect(asked, folder)).collect();
        let asked: Vec<_> = asked.into_iter().collect::<Option<_>>()?;
        let applications: Vec<EffectApplication<'_>> = asked
            .iter()
            .map(|(effect, arguments, span)| EffectApplication {
                effect,
                arguments: arguments.clone(),
                span: *span,
            })
            .collect();
        let blending = EffectBlending::Applied;
        let applied = effects::apply(&asts, &applications, blending, &mut self.diagnostics).ok()?;
        let written = effects::write(&asts[0], &applied.asts[0], &applied.brought, &self.sources);
        let compiled =
            compile_asts(applied.asts, &options, &directions, &mut self.diagnostics).ok()?;
        Some((compiled, (!apply.is_empty()).then_some(written)))
    }

    fn rendered(&self) -> String {
        render::render(&self.diagnostics.sorted(), &self.sources, render::RenderStyle::Plain)
    }

    fn codes(&self) -> Vec<String> {
        self.diagnostics.sorted().iter().map(|diagnostic| diagnostic.code.to_string()).collect()
    }
}

fn file_name(path: &Path) -> &str {
    path.file_name().and_then(|name| name.to_str()).expect("names of golden files are text")
}

#[test]
fn mistakes_are_shown_as_expected() {
    let folder = root().join("tests/golden/fail");
    let mut goldens = Goldens::default();
    for path in files(&folder, "dgd") {
        let text = fs::read_to_string(&path).expect("a golden file");
        let mut compilation = Compilation::new();
        let compiled = compilation.run(file_name(&path), &text, &folder);
        assert!(compiled.is_none(), "{} compiles", path.display());
        goldens.compare(&path.with_extension("stderr"), &compilation.rendered());
    }
    goldens.finish();
}

/// Codes shown in a text, as `error[E301]` or `note[E611]`.
fn codes_in(text: &str) -> BTreeSet<&str> {
    let levels = ["error[", "note["];
    let starts = levels.iter().flat_map(|level| text.match_indices(level));
    starts.filter_map(|(at, level)| text.get(at + level.len()..)?.get(..4)).collect()
}

#[test]
fn every_code_is_shown_by_a_golden_of_its_name_and_by_no_other() {
    let mut shown = BTreeSet::new();
    for folder in ["tests/golden/fail", "tests/golden/data", "tests/golden/notes"] {
        for path in files(&root().join(folder), "stderr") {
            let text = fs::read_to_string(&path).expect("a golden file");
            let codes: Vec<&str> = codes_in(&text).into_iter().collect();
            let own = file_name(&path).get(..4).expect("the name begins with a code");
            assert_eq!(codes, [own], "{}", path.display());
            shown.insert(own.to_owned());
        }
    }
    let known: BTreeSet<String> = CODES.iter().map(|info| info.code.to_string()).collect();
    assert_eq!(shown, known);
}

/// The functions in which a construct shows; of the other cases all that is generated is there to read.
const SNIPPETS: &[(&str, &[&str])] = &[
    ("arrays", &["rhs", "linearize", "start"]),
    ("dae_with_variant", &["rhs", "linearize"]),
    ("effects", &["rhs", "outputs", "taylor"]),
    ("functions_and_import", &["rhs", "event_functions", "outputs"]),
    ("index_reduction", &["rhs", "mass", "event_functions"]),
    ("parts", &["rhs", "linearize_lanes", "outputs"]),
];

/// These functions of generated methods.
fn snippet(rust: syn::File, functions: &[&str]) -> String {
    fn collect(items: Vec<syn::Item>, found: &mut Vec<syn::ImplItem>) {
        for item in items {
            match item {
                syn::Item::Mod(inner) => {
                    collect(inner.content.map_or(Vec::new(), |(_, items)| items), found);
                }
                syn::Item::Impl(methods) => found.extend(methods.items),
                _ => {}
            }
        }
    }
    let mut all = Vec::new();
    collect(rust.items, &mut all);
    let position = |item: &syn::ImplItem| match item {
        syn::ImplItem::Fn(function) => functions.iter().position(|name| function.sig.ident == name),
        _ => None,
    };
    all.retain(|item| position(item).is_some());
    all.sort_by_key(position);
    assert_eq!(all.len(), functions.len(), "{functions:?}");
    prettyplease::unparse(&syn::parse_quote!(impl System for Model { #(#all)* }))
}

#[test]
fn stages_of_sound_models_are_as_expected() {
    let mut goldens = Goldens::default();
    let cases = fs::read_dir(root().join("tests/golden/pass")).expect("the folder is there");
    for case in cases {
        let folder = case.expect("a readable folder").path();
        let text = fs::read_to_string(folder.join("model.dgd")).expect("a model in every case");
        let mut compilation = Compilation::new();
        let (compiled, written) = compilation
            .run("model.dgd", &text, &folder)
            .unwrap_or_else(|| panic!("{}: {}", folder.display(), compilation.rendered()));
        let trees: Vec<String> = compiled.asts.iter().map(print::print).collect();
        let program = &compiled.program;
        let tokens = codegen::generate(program, &program.signature.name, &compilation.sources);
        let rust = syn::parse2(tokens).expect("generated tokens are items of Rust");
        if let Some(written) = written {
            goldens.compare(&folder.join("written.dgd"), &written);
        }
        let case = folder.file_name().unwrap_or_default().to_string_lossy();
        let rust = match SNIPPETS.iter().find(|(name, _)| *name == case) {
            Some((_, functions)) => ("snippet.rs", snippet(rust, functions)),
            None => ("expanded.rs", prettyplease::unparse(&rust)),
        };
        for (name, stage) in [
            ("ast.txt", trees.join("\n")),
            ("model.txt", dgd_compiler::model::text::write(&compiled.model)),
            ("dae.txt", dgd_compiler::dae::text::write(&compiled.dae)),
            ("program.txt", program.to_string()),
            rust,
        ] {
            goldens.compare(&folder.join(name), &stage);
        }
    }
    goldens.finish();
}

/// `docs/errors.md`, from the table of codes.
fn errors_page() -> String {
    let mut page = String::from(
        "# Mistakes and what to do about them\n\n\
         Every mistake that `dgd` finds in a model or a data file has a code. `dgd explain CODE` \
         prints what this page says about it.\n",
    );
    let stages =
        ["Syntax", "Names", "Units", "Structure", "Values", "Data files"].iter().zip('1'..);
    for (title, digit) in stages {
        let _ = write!(page, "\n## {title}\n");
        for info in CODES.iter().filter(|info| info.code.to_string()[1..].starts_with(digit)) {
            let explanation = info.explanation.trim();
            let _ = write!(page, "\n### {}: {}\n\n{explanation}\n", info.code, info.title);
        }
    }
    page
}

#[test]
fn the_page_of_errors_is_up_to_date() {
    let mut goldens = Goldens::default();
    goldens.compare(&root().join("docs/errors.md"), &errors_page());
    goldens.finish();
}

/// The examples of an explanation, completed to models.
fn examples(info: &CodeInfo) -> (String, String) {
    let (_, examples) = info.explanation.split_once("\nWrong:\n\n").expect("a wrong example");
    let (wrong, right) = examples.split_once("\nRight:\n\n").expect("a right example");
    let model = |text: &str| {
        let lines: Vec<&str> = text.lines().map(|line| line.get(4..).unwrap_or("")).collect();
        let text = lines.join("\n");
        if text.contains("model ") { text } else { format!("model example\n\n{text}\n") }
    };
    (model(wrong), model(right))
}

/// E207 is explained by a command, E217 and E411 are notes of `dgd check`, E211 by the beginning of a long model, E409 by a number, effects
/// by files of theirs.
fn has_whole_examples(code: Code) -> bool {
    let others = [
        Code::UnknownVariant,
        Code::ModelTooLarge,
        Code::EffectMismatch,
        Code::IncompleteEffect,
        Code::ConflictingEffects,
        Code::UnreadParameter,
        Code::TooManyModes,
        Code::DependentEquations,
    ];
    (Code::UnknownName..Code::UnreadableFile).contains(&code) && !others.contains(&code)
}

#[test]
fn examples_of_explanations_are_wrong_and_right_as_they_say() {
    let folder = root().join("tests/golden/examples");
    for info in CODES.iter().filter(|info| has_whole_examples(info.code)) {
        let (wrong, right) = examples(info);
        let mut compilation = Compilation::new();
        compilation.run("wrong.dgd", &wrong, &folder);
        let codes: BTreeSet<String> = compilation.codes().into_iter().collect();
        assert_eq!(codes, BTreeSet::from([info.code.to_string()]), "{}", compilation.rendered());

        let mut compilation = Compilation::new();
        let compiled = compilation.run("right.dgd", &right, &folder);
        assert!(compiled.is_some(), "{}: {}", info.code, compilation.rendered());
    }
}

/// A quotient by a parameter becomes a product on the way to a program; it keeps its name.
#[test]
fn names_stay_with_what_becomes_a_product() {
    let model = "model m
        parameter tau [s] = 2
        state x [1] = 1
        let rate = (1 - x)/tau
        equation level: der(x) = rate + 0.1 [1/s]*x";
    let program = inline::compiled(model).program;
    for kind in [FunctionKind::Rhs, FunctionKind::Linearize, FunctionKind::SensitivityRhs] {
        let function = program.functions.iter().find(|function| function.kind == kind);
        let names = &function.expect("a function of each kind").names;
        assert!(names.iter().any(|(_, name)| name == "rate"), "{kind:?}: {names:?}");
    }
    let series = &program.taylor.as_ref().expect("a series").unknowns;
    assert!(series.names.iter().any(|(_, name)| name == "rate"), "{:?}", series.names);
}
