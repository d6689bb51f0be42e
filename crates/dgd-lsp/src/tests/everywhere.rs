//! Properties that must hold at every position of every model in the repository.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use dgd_compiler::source::{ColumnUnit, LineStarts, SourceId, Span};
use dgd_compiler::syntax::ast::{EffectTarget, Expr, ExprKind};
use dgd_compiler::syntax::visit::operands;
use serde_json::{Value, json};

use super::{Editor, address, edited, files, models};
use crate::analysis::{Analysis, analyse};
use crate::dimensions;
use crate::files::OpenDocuments;
use crate::places::path_of;

/// A file's analysis after a pause.
fn looked_at(path: &Path, files: &OpenDocuments) -> Analysis {
    let mut analysis = analyse(&path.display().to_string(), files);
    let others = analysis.other_variants(&mut || true).expect("nothing interrupts");
    analysis.add(others);
    analysis
}

/// Whether an expression is true or false.
fn is_condition(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Group(inner) => is_condition(inner),
        ExprKind::Compare(..) | ExprKind::And(_) | ExprKind::Or(_) | ExprKind::Not(_) => true,
        _ => false,
    }
}

/// The expressions with a derived dimension: not conditions, lists or arrays without an index; names, numbers and indices have
/// their own.
fn with_dimensions(expr: &Expr, spans: &mut Vec<Span>) {
    if matches!(&expr.kind, ExprKind::Number { .. } | ExprKind::Name(_)) {
        return;
    }
    if !is_condition(expr) && !matches!(&expr.kind, ExprKind::List(_)) {
        spans.push(expr.span);
    }
    if let ExprKind::Reduce(reduction) = &expr.kind {
        with_dimensions(&reduction.body, spans);
    } else if !matches!(&expr.kind, ExprKind::Element(..)) {
        for operand in operands(expr) {
            with_dimensions(operand, spans);
        }
    }
}

#[test]
fn the_dimension_of_every_expression_is_told() {
    let project = OpenDocuments::default();
    let (mut n, mut missing) = (0, Vec::new());
    for path in files() {
        let analysis = looked_at(&path, &project);
        // The arguments of a template are known only where it is applied.
        let effect = analysis.asts[0].effect.as_ref();
        if effect.is_some_and(|effect| matches!(effect.target, EffectTarget::Template(_))) {
            continue;
        }
        let dimensions = dimensions::all(&analysis);
        let mut spans = Vec::new();
        dimensions::expressions(&analysis.asts[0], &mut |expr| with_dimensions(expr, &mut spans));
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        n += spans.len();
        for span in spans.iter().filter(|span| !dimensions.contains_key(*span)) {
            let line = analysis.sources.line_column(*span).0;
            missing.push(format!("{name}:{line}: {}", analysis.sources.text(*span)));
        }
    }
    assert!(n > 1500, "{n}");
    assert!(missing.is_empty(), "{} of {n}:\n{}", missing.len(), missing.join("\n"));
}

/// Edits of documents by URI.
type Edits = BTreeMap<String, Vec<Value>>;

/// Renames every `nth` symbol of every file: returns rounds of edits that do not overlap, and the number of renamed
/// symbols.
fn renamed(nth: usize) -> (Vec<Edits>, usize) {
    let mut editor = Editor::new(&models(), "utf-16");
    let project =
        OpenDocuments { folders: vec![models().display().to_string()], ..OpenDocuments::default() };
    let mut rounds: Vec<(Edits, BTreeSet<String>)> = Vec::new();
    let (mut n_seen, mut n_renamed) = (0, 0);
    for path in files() {
        let (names, sources) = project.names(&path.display().to_string());
        let text = &sources.get(SourceId(0)).text;
        for (_, symbol) in names.symbols().filter(|(_, one)| one.declared.source == SourceId(0)) {
            n_seen += 1;
            if n_seen % nth != 0 {
                continue;
            }
            let (line, character) = LineStarts::from_text(text).position(
                text,
                symbol.declared.start as usize,
                ColumnUnit::Utf16,
            );
            let params = json!({
                "textDocument": { "uri": address(&path) },
                "position": { "line": line, "character": character },
                "newName": format!("κ_{n_seen}"),
            });
            let answer = editor.ask("textDocument/rename", params);
            let changes = answer["changes"].as_object();
            let changes = changes.unwrap_or_else(|| panic!("{}: {symbol:?}", path.display()));
            n_renamed += 1;
            let mut edits: Vec<(String, Value)> = Vec::new();
            for (uri, of_file) in changes {
                let of_uri = of_file.as_array().expect("edits").iter();
                edits.extend(of_uri.map(|edit| (uri.clone(), edit.clone())));
            }
            // A position that two symbols share, such as an output and the state that it reads, is changed in two
            // rounds.
            let place = |(uri, edit): &(String, Value)| format!("{uri} {}", edit["range"]);
            let is_free =
                |taken: &BTreeSet<String>| !edits.iter().any(|one| taken.contains(&place(one)));
            let free = rounds.iter().position(|(_, taken)| is_free(taken));
            let round = free.unwrap_or_else(|| {
                rounds.push(<_>::default());
                rounds.len() - 1
            });
            let (of_round, taken) = &mut rounds[round];
            for one in edits {
                taken.insert(place(&one));
                of_round.entry(one.0).or_default().push(one.1);
            }
        }
    }
    editor.end();
    (rounds.into_iter().map(|(edits, _)| edits).collect(), n_renamed)
}

/// The files of the repository with these edits.
fn changed(edits: &Edits) -> OpenDocuments {
    let mut changed =
        OpenDocuments { folders: vec![models().display().to_string()], ..OpenDocuments::default() };
    for (uri, of_file) in edits {
        let path = path_of(&uri.parse().expect("an address"));
        let text = fs::read_to_string(&path).expect("a file");
        changed.open.insert(path, edited(&text, &json!(of_file), ColumnUnit::Utf16));
    }
    changed
}

/// Errors in any file.
fn mistakes(project: &OpenDocuments) -> Vec<String> {
    let mut mistakes = Vec::new();
    for path in files() {
        let analysis = looked_at(&path, project);
        for one in analysis.diagnostics.iter().chain(&analysis.others) {
            let words = format!("{}: {}: {}", path.display(), one.code, one.message);
            mistakes.push(words);
        }
    }
    mistakes
}

#[test]
fn another_name_leaves_every_model_sound() {
    let (rounds, n) = renamed(29);
    assert!(n > 40, "{n}");
    for edits in rounds {
        let wrong = mistakes(&changed(&edits));
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }
}

/// `.ci/editors` calls it with a folder in `DGD_RENAMED`, where it writes all models, with other names for everything,
/// for `dgd check`.
#[test]
#[ignore = "some thousand requests: cargo test --release -p dgd-lsp every_name -- --ignored"]
fn every_name_can_be_another() {
    let (rounds, n) = renamed(1);
    println!("{n} names were changed");
    assert!(n > 1000, "{n}");
    let folder = std::env::var_os("DGD_RENAMED").map(PathBuf::from);
    for (round, edits) in rounds.iter().enumerate() {
        let project = changed(edits);
        if let Some(folder) = &folder {
            for path in files() {
                let text = project.read(&path.display().to_string()).expect("a text");
                let relative = path.strip_prefix(models()).expect("a model");
                let target = folder.join(round.to_string()).join(relative);
                fs::create_dir_all(target.parent().expect("a folder")).expect("a place to write");
                fs::write(target, text).expect("a place to write");
            }
        }
        let wrong = mistakes(&project);
        assert!(wrong.is_empty(), "round {round}:\n{}", wrong.join("\n"));
    }
}

#[test]
fn a_character_of_two_units_is_counted_as_two() {
    // U+1D70F takes two units in UTF-16 and four bytes in UTF-8. No name may have it.
    let text = "model m\nparameter τ [s] = 3\nstate x [m] = 1\nequation e: der(x) = -x/𝜏 + x/𝜏\n";
    for (encoding, places) in [("utf-8", [(24, 28), (33, 37)]), ("utf-16", [(24, 26), (31, 33)])] {
        let mut editor = Editor::new(&models(), encoding);
        let path = models().join("not saved.dgd");
        let diagnostics = editor.open(&path, text);
        let mut changes = Vec::new();
        for (one, (start, end)) in diagnostics.as_array().expect("mistakes").iter().zip(places) {
            let position = |character: u32| json!({ "line": 3, "character": character });
            let range = json!({ "start": position(start), "end": position(end) });
            assert_eq!(one["code"], "E101", "{diagnostics}");
            assert_eq!(one["range"], range, "{encoding}");
            changes.push(json!({ "range": range, "text": "τ" }));
        }
        // From the last to the first, so that none shifts another.
        changes.reverse();
        editor.change(&address(&path), 2, &json!(changes));
        assert_eq!(editor.wait_for(&address(&path)), json!([]));
        editor.end();
    }
}

#[test]
fn a_newer_keystroke_ends_the_look_at_other_choices() {
    let path = models().join("mud_circulation.dgd");
    let analysis = analyse(&path.display().to_string(), &OpenDocuments::default());
    let mut n_asked = 0;
    let mut first_only = || {
        n_asked += 1;
        n_asked < 2
    };
    assert!(analysis.other_variants(&mut first_only).is_none());
    assert_eq!(n_asked, 2, "it was looked at further");
    // The server continues with the newer text, and then reports its other choices.
    let mut editor = Editor::new(&models(), "utf-16");
    let path = models().join("not saved/choices.dgd");
    let text = |unit: &str| {
        format!(
            "model choices\nstate x [m] = 1\nvariant v {{\n  a {{ let r = 1 [m/s] }}\n  \
             b {{ let r = 1 [{unit}] }}\n}}\nequation e: der(x) = r\n"
        )
    };
    editor.open(&path, &text("m/s"));
    for (version, unit) in ["kg", "m/s", "m"].iter().enumerate() {
        editor.change(&address(&path), version + 2, &json!([{ "text": text(unit) }]));
    }
    let mut last = editor.wait_for(&address(&path));
    for _ in 0..4 {
        let Some(_) = editor.hears_within(std::time::Duration::from_secs(1)) else { break };
        last = editor.told[&address(&path)].clone();
    }
    assert_eq!(last[0]["code"], "E302", "{last}");
    let words = last[0]["message"].as_str().expect("a message");
    assert!(words.contains("`m`") && !words.contains("kg"), "{words}");
    editor.end();
}
