//! `docs/models/`: a page for each model of the repository, made from its file.
//!
//! `UPDATE_GOLDEN=1 cargo test --test compiler model_pages` writes them anew.

use std::fmt::Write as _;
use std::path::PathBuf;

use dgd_compiler::model::typeset::markdown;

use crate::golden::{Goldens, files};
use crate::support::{compiled, root};

/// The models, and their pages.
fn pages() -> Vec<(String, String, Vec<String>)> {
    let page = |path: PathBuf| {
        let name = path.file_stem().expect("a file").to_string_lossy().into_owned();
        let compiled = compiled(&path, &[]);
        let shown = format!("models/{name}.dgd");
        let doc = compiled.model.doc.clone();
        (name, markdown::write(&compiled.asts, &compiled.model, &shown), doc)
    };
    files(&root().join("models"), "dgd").into_iter().map(page).collect()
}

#[test]
fn pages_are_those_of_the_files() {
    let folder = root().join("docs/models");
    let mut goldens = Goldens::default();
    let mut list = "# Models\n\nA page for each, made from its file in `models/` by `dgd emit --stage markdown`.\n\n\
        | model | is |\n|---|---|\n"
        .to_owned();
    let pages = pages();
    for (name, page, doc) in &pages {
        goldens.compare(&folder.join(format!("{name}.md")), page);
        // The first sentence.
        let lines: Vec<&str> = doc.iter().map(|line| line.trim()).collect();
        let about = lines.join(" ");
        let about = about.split_once(". ").map_or(about.trim_end_matches('.'), |(first, _)| first);
        let _ = writeln!(list, "| [{name}]({name}.md) | {about}. |");
    }
    goldens.compare(&folder.join("README.md"), &list);
    goldens.finish();

    let known: Vec<String> = pages.iter().map(|(name, ..)| format!("{name}.md")).collect();
    for path in files(&folder, "md") {
        let name = path.file_name().expect("a file").to_string_lossy().into_owned();
        assert!(name == "README.md" || known.contains(&name), "{name} is of no model");
    }
}

/// What stands between `$` and `` ` ``, and in fences.
fn formulas(page: &str) -> Vec<&str> {
    let inline = page.split("$`").skip(1).map(|rest| rest.split("`$").next().unwrap_or(rest));
    let fenced = page.split("```math\n").skip(1).map(|rest| {
        let (inner, _) = rest.split_once("\n```").expect("the fence is closed");
        inner
    });
    inline.chain(fenced).collect()
}

#[test]
fn formulas_are_balanced() {
    let mut seen = 0;
    for (name, page, _) in pages() {
        for formula in formulas(&page) {
            seen += 1;
            let count = |part: &str| formula.matches(part).count();
            let mut depth = 0_i32;
            for (i, c) in formula.char_indices() {
                let is_escaped = formula[..i].ends_with('\\') && !formula[..i].ends_with("\\\\");
                depth += match c {
                    '{' if !is_escaped => 1,
                    '}' if !is_escaped => -1,
                    _ => 0,
                };
                assert!(depth >= 0, "{name}: {formula}");
            }
            assert_eq!(depth, 0, "{name}: {formula}");
            assert_eq!(count("\\left"), count("\\right"), "{name}: {formula}");
            assert_eq!(count("\\begin{"), count("\\end{"), "{name}: {formula}");
            assert!(!formula.contains('$') && !formula.contains("{}"), "{name}: {formula}");
        }
        for line in page.lines().filter(|line| line.starts_with("| ")) {
            let bars = line.matches('|').count() - line.matches("\\|").count();
            let heads = page.lines().filter(|line| line.starts_with("|---"));
            assert!(
                heads.into_iter().any(|head| head.matches('|').count() == bars),
                "{name}: a row of another length: {line}"
            );
        }
    }
    assert!(seen > 300, "{seen} formulas");
}
