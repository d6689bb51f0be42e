//! What the pages for users say: examples compile, or fail with the code they name; data files can be
//! read; command lines are understood; tables list what there is.
//!
//! A fenced block is marked by its language and, behind a comma, by what is special about it:
//!
//! | mark | the block |
//! |---|---|
//! | `dgd` | compiles: a whole model as it is, an effect applied to what it fits in the first whole model of its page, anything else within the first whole model of its page, where it takes the place of what is declared there under the same names |
//! | `dgd,fails E301` | gives this code and no other |
//! | `dgd,from PATH` | stands in that file, line by line |
//! | `csv`, `csv,fails E605` | is a recording of that model's inputs, or gives this code |
//! | `sh` | holds command lines; those of `dgd` are understood, and files that they name are there |

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::ops::Range;

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::effects::{Effect, EffectApplication, EffectBlending, apply, bind};
use dgd_compiler::expr::intrinsics::{INTRINSICS, UnitRule};
use dgd_compiler::model::{DeclarationHeader, Model, ModelOptions, resolve};
use dgd_compiler::pipeline::{SensitivityDirections, compile_asts, load};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::ast::{Ast, Item, ItemKind};
use dgd_compiler::syntax::{layout, parse, parse_what_is_sound};
use dgd_compiler::units::catalogue::{CATALOGUE, PREFIXES, Prefixes, UnitRow};
use dgd_compiler::units::{Datum, describe};
use dgd_data::{self as data, select};

use crate::golden::{Goldens, files};
use crate::support::{name, root};

/// A page in Markdown.
struct Page {
    /// Path from the root.
    name: String,
    text: String,
}

/// A fenced block of a page.
struct Block<'a> {
    page: &'a Page,
    language: &'a str,
    /// What is behind the comma: a word, and what it is about.
    mark: Option<(&'a str, &'a str)>,
    /// Where it lies in the page, fences excluded.
    place: Range<usize>,
}

fn pages() -> Vec<Page> {
    let folders = [root().to_owned(), root().join("docs"), root().join("examples/data/field")];
    let paths = folders.map(|folder| files(&folder, "md")).concat();
    let page = |path: std::path::PathBuf| Page {
        text: fs::read_to_string(&path).expect("a page"),
        name: path.strip_prefix(root()).expect("a path below the root").display().to_string(),
    };
    paths.into_iter().map(page).collect()
}

impl Page {
    fn blocks(&self) -> Vec<Block<'_>> {
        let mut blocks: Vec<Block<'_>> = Vec::new();
        let (mut at, mut open) = (0, false);
        for line in self.text.split_inclusive('\n') {
            if let Some(info) = line.strip_prefix("```") {
                open = !open;
                if open {
                    let (language, mark) = info.trim().split_once(',').unzip();
                    let mark = mark.map(|mark| mark.split_once(' ').unwrap_or((mark, "")));
                    let (language, start) = (language.unwrap_or(info.trim()), at + line.len());
                    blocks.push(Block { page: self, language, mark, place: start..start });
                } else if let Some(block) = blocks.last_mut() {
                    block.place.end = at;
                }
            }
            at += line.len();
        }
        assert!(!open, "{}: a block is not closed", self.name);
        blocks
    }

    /// The page with everything else blanked out, so that places stay what they are.
    fn only(&self, places: &[Range<usize>]) -> String {
        let mut bytes: Vec<u8> =
            self.text.bytes().map(|byte| if byte == b'\n' { byte } else { b' ' }).collect();
        for place in places {
            bytes[place.clone()].copy_from_slice(&self.text.as_bytes()[place.clone()]);
        }
        String::from_utf8(bytes).expect("pieces of a text")
    }

    /// The whole model into which the page's other examples go.
    fn model(&self) -> Option<Block<'_>> {
        self.blocks().into_iter().find(|block| block.language == "dgd" && block.is_whole())
    }
}

impl Block<'_> {
    fn text(&self) -> &str {
        &self.page.text[self.place.clone()]
    }

    fn line(&self) -> usize {
        1 + self.page.text[..self.place.start].matches('\n').count()
    }

    /// What is sound of it, by its places in the page.
    fn ast(&self) -> Ast {
        let mut sources = SourceMap::default();
        let text = self.page.only(std::slice::from_ref(&self.place));
        let source = sources.add(SourceText { name: self.page.name.clone(), text });
        parse_what_is_sound(source, &sources)
    }

    fn is_effect(&self) -> bool {
        self.ast().effect.is_some()
    }

    fn is_whole(&self) -> bool {
        self.ast().model.is_some()
    }

    /// The example as a model file.
    fn completed(&self) -> Result<String, String> {
        if self.is_whole() {
            return Ok(self.page.only(std::slice::from_ref(&self.place)));
        }
        let ast = self.ast();
        let declared: BTreeSet<_> = ast.items.iter().filter_map(declared_by).collect();
        let model = self.page.model().ok_or_else(|| {
            self.wrong("the page has no whole model; is this `dgd,from PATH`, part of a file?")
        })?;
        let mut kept = vec![self.place.clone()];
        let mut rest = model.place.clone();
        for item in &model.ast().items {
            if declared_by(item).is_some_and(|name| declared.contains(&name)) {
                kept.push(rest.start..item.span.start as usize);
                rest.start = item.span.end as usize;
            }
        }
        kept.push(rest);
        Ok(self.page.only(&kept))
    }

    /// Fails unless the codes are those that the block is marked with.
    fn judge(&self, diagnostics: &Diagnostics, sources: &SourceMap) -> Result<(), String> {
        let found = diagnostics.sorted();
        let codes: BTreeSet<String> = found.iter().map(|d| d.code.to_string()).collect();
        let expected = match self.mark {
            None => BTreeSet::new(),
            Some(("fails", code)) => BTreeSet::from([code.to_owned()]),
            Some((mark, _)) => return Err(self.wrong(&format!("there is no mark `{mark}`"))),
        };
        if codes == expected {
            return Ok(());
        }
        let shown = render::render(&found, sources, render::RenderStyle::Plain);
        Err(self.wrong(&format!("expected {expected:?}, found {codes:?}\n{shown}")))
    }

    fn wrong(&self, what: &str) -> String {
        format!("{}:{}: {what}", self.page.name, self.line())
    }
}

/// The name of an item, and which others it must differ from.
fn declared_by(item: &Item) -> Option<(&'static str, &str)> {
    if let Some(name) = item.kind.value_name() {
        return Some(("name", &name.text));
    }
    let (set, name) = match &item.kind {
        ItemKind::Output { name, .. } => ("output", name),
        ItemKind::Equation { label, .. } => ("equation", label),
        ItemKind::Variant { name, .. } => ("variant", name),
        ItemKind::Modes { name, .. } => ("modes", name),
        ItemKind::Part { name, .. } => ("part", name),
        ItemKind::Unit { name, .. } => ("unit", name),
        _ => return None,
    };
    Some((set, &name.text))
}

/// Runs a check on the blocks of a language and fails with all that is wrong.
fn check_blocks(language: &str, check: impl Fn(&Block<'_>) -> Result<(), String>) {
    let mut wrong = Vec::new();
    let mut n_blocks = 0;
    for page in pages() {
        for block in page.blocks().iter().filter(|block| block.language == language) {
            n_blocks += 1;
            wrong.extend(check(block).err());
        }
    }
    assert!(n_blocks > 0, "no page has a block of `{language}`");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Compiles an example in one choice of its variants; libraries are those beside the models.
fn compiled(
    block: &Block<'_>,
    variants: &[(&str, &str)],
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<Option<Model>, String> {
    let text = match block.page.model() {
        Some(model) if block.is_effect() => model.completed()?,
        Some(_) | None => block.completed()?,
    };
    let main = SourceText { name: block.page.name.clone(), text };
    let folder = block.page.name.rsplit_once('/').map_or("", |(folder, _)| folder);
    let mut read = |path: &str| {
        let path = path.strip_prefix(folder).unwrap_or(path).trim_start_matches('/');
        fs::read_to_string(root().join("models").join(path)).map_err(|error| error.to_string())
    };
    let variants = variants.iter().map(|(variant, choice)| (name(variant), name(choice))).collect();
    let options = ModelOptions { variants, ..ModelOptions::default() };
    let Ok(mut asts) = load(main, &mut read, sources, diagnostics) else { return Ok(None) };
    if block.is_effect() {
        let Some(changed) = with_effect(block, &asts, &options, sources, diagnostics) else {
            return Ok(None);
        };
        asts = changed;
    }
    let compiled = compile_asts(asts, &options, &SensitivityDirections::All, diagnostics).ok();
    Ok(compiled.map(|compiled| compiled.model))
}

/// The trees of a model with the effect of a block applied to the first that it fits.
fn with_effect(
    block: &Block<'_>,
    asts: &[Ast],
    options: &ModelOptions,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Option<Vec<Ast>> {
    let text = block.page.only(std::slice::from_ref(&block.place));
    let id = sources.add(SourceText { name: block.page.name.clone(), text });
    let effect = Effect::read(parse(id, sources, diagnostics).ok()?, diagnostics).ok()?;
    let lists = bind(&effect, &resolve(asts, options, diagnostics).ok()?);
    let arguments = lists.first()?.iter().map(|argument| name(argument)).collect();
    let span = effect.name.span;
    let application = EffectApplication { effect: &effect, arguments, span };
    apply(asts, &[application], EffectBlending::Applied, diagnostics)
        .ok()
        .map(|applied| applied.asts)
}

/// Compiles an example in one choice of its variants, and judges what comes of it.
fn check_model(block: &Block<'_>, variants: &[(&str, &str)]) -> Result<Option<Model>, String> {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let model = compiled(block, variants, &mut sources, &mut diagnostics)?;
    block.judge(&diagnostics, &sources)?;
    Ok(model)
}

/// Checks that the lines of a block stand in a file, in this order.
fn check_excerpt(block: &Block<'_>, path: &str) -> Result<(), String> {
    let file = fs::read_to_string(root().join(path))
        .map_err(|error| block.wrong(&format!("{path}: {error}")))?;
    let mut lines = file.lines();
    block.text().lines().filter(|line| !line.trim().is_empty()).try_for_each(|line| {
        let found = lines.any(|other| other.trim() == line.trim());
        found.then_some(()).ok_or_else(|| block.wrong(&format!("not so in {path}: {line}")))
    })
}

#[test]
fn examples_compile_or_fail_as_they_say() {
    check_blocks("dgd", |block| {
        if let Some(("from", path)) = block.mark {
            return check_excerpt(block, path);
        }
        let model = check_model(block, &[])?;
        for variant in model.iter().flat_map(|model| &model.variants) {
            for choice in variant.choices.iter().skip(1) {
                check_model(block, &[(variant.name.as_str(), choice.as_str())])?;
            }
        }
        Ok(())
    });
}

#[test]
fn examples_are_laid_out_canonically() {
    check_blocks("dgd", |block| {
        if block.mark.is_some() {
            return Ok(());
        }
        let mut sources = SourceMap::default();
        let text = block.text().to_owned();
        let source = sources.add(SourceText { name: block.page.name.clone(), text });
        match layout::format(source, &sources, &mut Diagnostics::default()) {
            Ok(text) if text == block.text() => Ok(()),
            Ok(text) => Err(block.wrong(&format!("`dgd fmt` lays this out as\n{text}"))),
            Err(_) => Err(block.wrong("`dgd fmt` cannot read this")),
        }
    });
}

#[test]
fn data_files_can_be_read_or_fail_as_they_say() {
    check_blocks("csv", |block| {
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let example = block.page.model().ok_or_else(|| block.wrong("of which model?"))?;
        if let Some(model) = compiled(&example, &[], &mut sources, &mut diagnostics)? {
            read_recording(block, &model, &mut sources, &mut diagnostics);
        }
        block.judge(&diagnostics, &sources)
    });
}

/// Reads a block as a recording of the model's inputs and outputs.
fn read_recording(
    block: &Block<'_>,
    model: &Model,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) {
    fn selected(declared: &DeclarationHeader) -> select::DeclaredColumn<'_> {
        select::DeclaredColumn {
            name: &declared.name,
            unit: &declared.unit,
            place: Some(declared.span),
        }
    }
    let text = block.page.only(std::slice::from_ref(&block.place));
    let Ok(table) = data::read_from(&block.page.name, text.as_bytes(), sources, diagnostics) else {
        return;
    };
    let inputs: Vec<_> = model.inputs.iter().map(|input| selected(&input.declared)).collect();
    let outputs: Vec<_> = model.outputs.iter().map(|output| selected(&output.declared)).collect();
    // The diagnostics say what is wrong.
    let _ = table.recording(diagnostics);
    let _ = select::inputs(&table, &inputs, diagnostics);
    let _ = select::measured(&table, &outputs, diagnostics);
}

/// The words of a command line; quotes hold blanks together.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut quote = None;
    for c in line.chars() {
        match (quote, c) {
            (None, '\'' | '"') => quote = Some(c),
            (Some(open), _) if c == open => quote = None,
            (None, ' ') => words.push(String::new()),
            _ => words.last_mut().expect("a word has begun").push(c),
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

#[test]
fn command_lines_are_understood() {
    check_blocks("sh", |block| {
        let joined = block.text().replace("\\\n", "");
        joined.lines().try_for_each(|line| {
            let line = line.trim_end_matches("&&").trim_end();
            let own = ["dgd ", "cargo run --release -- "];
            let Some(arguments) = own.iter().find_map(|start| line.strip_prefix(start)) else {
                return Ok(());
            };
            let arguments = words(arguments);
            dgd_cli::verify_arguments(&arguments)
                .map_err(|error| block.wrong(&format!("{line}\n{error}")))?;
            let missing = arguments.iter().find(|word| {
                let is_ours = ["models/", "examples/"].iter().any(|start| word.starts_with(start));
                // A contender of `compare` has choices behind its file.
                let file = dgd_work::compare::model_of(word);
                is_ours && !root().join(file).exists()
            });
            missing.map_or(Ok(()), |path| Err(block.wrong(&format!("there is no {path}"))))
        })
    });
}

#[test]
fn links_lead_somewhere() {
    let mut wrong = Vec::new();
    for page in pages() {
        let folder = root().join(&page.name).parent().expect("a page lies in a folder").to_owned();
        for (_, link) in page.text.match_indices("](").filter_map(|(at, open)| {
            page.text[at + open.len()..].split_once(')').map(|(link, _)| (at, link))
        }) {
            let path = link.split('#').next().unwrap_or_default();
            if !link.contains("://") && !folder.join(path).exists() {
                wrong.push(format!("{}: there is no {link}", page.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_tables_of_effects_have_what_lies_beside_the_models_and_the_templates() {
    let page = fs::read_to_string(root().join("docs/discovery.md")).expect("a page");
    let row = |line: &str| {
        let cells = line.strip_prefix("| `")?;
        let (names, rest) = cells.split_once("` | ")?;
        let (kind, _) = rest.split_once(" | ")?;
        let is_effect = ["plant", "sensor", "input"].contains(&kind);
        let each = |name: &str| (name.to_owned(), kind.to_owned());
        is_effect.then(|| names.split("`, `").map(each).collect::<Vec<_>>())
    };
    let listed: BTreeSet<_> = page.lines().filter_map(row).flatten().collect();
    let mut found = BTreeSet::new();
    let effects = root().join("models/effects");
    let inside = fs::read_dir(&effects).expect("the folder of effects");
    let forms = inside.map(|entry| entry.expect("an entry").path()).filter(|path| path.is_dir());
    let templates =
        fs::read_dir(root().join("crates/dgd-discover/templates")).expect("the templates");
    let templates = templates.map(|entry| entry.expect("an entry").path());
    let folders = forms.chain([effects.clone()]).chain(templates);
    for file in folders.flat_map(|folder| files(&folder, "dgd")) {
        let text = fs::read_to_string(&file).expect("an effect");
        let word = |start: &str| {
            let rest = text.lines().find_map(|line| line.strip_prefix(start));
            let end = |c: char| !c.is_alphanumeric() && c != '_';
            rest.and_then(|rest| rest.split(end).next()).unwrap_or_default().to_owned()
        };
        found.insert((word("effect "), word("kind ")));
    }
    assert_eq!(listed, found);
}

/// A factor to six digits; what is exact stands in the last column.
fn six_digits(x: f64) -> String {
    let rounded: f64 = format!("{x:.5e}").parse().expect("a number");
    if (1e-3..1e6).contains(&rounded) { rounded.to_string() } else { format!("{rounded:e}") }
}

fn unit_line(row: &UnitRow) -> String {
    let code = |spelling: &str| format!("`{spelling}`");
    let spellings: Vec<String> = row.spellings().map(code).collect();
    let prefixes = match row.prefixes {
        Prefixes::Allowed => "yes",
        Prefixes::None => "",
    };
    let (up, down) = row.factor;
    let base = describe(row.dimension);
    // 60 m, 0.01, 0.1 /s
    let base = base.strip_prefix('1').unwrap_or(&base);
    let mut si = format!("{} {base}", six_digits(up / down)).trim_end().to_owned();
    if row.offset != 0.0 {
        let _ = write!(si, ", from {} {base}", six_digits(row.offset));
    }
    let datum = match row.datum {
        Some(Datum::Absolute) => "; absolute",
        Some(Datum::Gauge) => "; gauge",
        None => "",
    };
    let spellings = spellings.join(", ");
    format!("| {spellings} | {prefixes} | {si} | {}{datum} |\n", row.doc)
}

/// `docs/reference.md`, from the tables of units and functions.
fn reference_page() -> String {
    let mut page = String::from(
        "# Units and functions\n\n\
         [language.md](language.md) says how they are used.\n\n\
         ## Units\n\n\
         The SI value of a unit is rounded to six digits here; the compiler uses the exact \
         definition.\n\n\
         | unit | SI prefixes | in SI | is |\n|---|---|---|---|\n",
    );
    for row in CATALOGUE {
        page += &unit_line(row);
    }
    page += "\nThe prefixes:\n\n| prefix | factor |\n|---|---|\n";
    for same in PREFIXES.chunk_by(|a, b| (a.1, a.2) == (b.1, b.2)) {
        let spellings: Vec<String> =
            same.iter().map(|(symbol, ..)| format!("`{symbol}`")).collect();
        let _ = writeln!(page, "| {} | {:e} |", spellings.join(", "), same[0].1 / same[0].2);
    }
    page += "\n## Functions\n\nA function that a model declares replaces one that is marked with \\*.\n\n| function | units | is |\n|---|---|---|\n";
    for function in INTRINSICS {
        let name = function.name;
        let call = match (function.unit_rule, function.definition.arity()) {
            (UnitRule::Power, _) => format!("x{name}y"),
            (_, 1) => format!("{name}(x)"),
            (_, 2) => format!("{name}(x, y)"),
            (_, _) => format!("{name}(x, y, z)"),
        };
        let units = match function.unit_rule {
            UnitRule::Dimensionless => "plain number to plain number",
            UnitRule::Same if function.definition.arity() == 1 => "any, which it keeps",
            UnitRule::Same => "all of one, which it keeps",
            UnitRule::Root => "any, to its root",
            UnitRule::Any => "any, to a plain number",
            UnitRule::Ratio => "all of one, to a plain number",
            UnitRule::Power => "y a plain number, and a constant where x has a unit",
        };
        let later = if function.yields { " \\*" } else { "" };
        let _ = writeln!(page, "| `{call}`{later} | {units} | {} |", function.doc);
    }
    page
}

#[test]
fn the_page_of_units_and_functions_is_up_to_date() {
    let mut goldens = Goldens::default();
    goldens.compare(&root().join("docs/reference.md"), &reference_page());
    goldens.finish();
}
