//! `docs/models/`: a page for each model of the repository, made from its file, and one of all places
//! where these files depart from the thesis.
//!
//! `UPDATE_GOLDEN=1 cargo test --test compiler model_pages` writes them anew.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use dgd_compiler::model::typeset::markdown;

use crate::golden::{Goldens, files};
use crate::support::{compiled, root};

/// The models, and their pages.
fn pages() -> Vec<(String, String, Vec<String>)> {
    let page = |path: PathBuf| {
        let name = path.file_stem().expect("a file").to_string_lossy().into_owned();
        let compiled = compiled(&path, &[]);
        let shown = format!("models/{name}.dgd");
        let commands = dgd_cli::run_commands(Path::new(&shown), &compiled.model);
        let doc = compiled.model.doc.clone();
        (name, markdown::write(&compiled.asts, &compiled.model, &commands), doc)
    };
    files(&root().join("models"), "dgd").into_iter().map(page).collect()
}

#[test]
fn pages_are_those_of_the_files() {
    let folder = root().join("docs/models");
    let mut goldens = Goldens::default();
    let mut list = "# Models\n\nA page for each, made from its file in `models/` by `dgd emit --stage markdown`. \
        [Where they depart from the thesis](departures.md) is on one page, with the reasons.\n\n\
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
        let is_list = name == "README.md" || name == "departures.md";
        assert!(is_list || known.contains(&name), "{name} is of no model");
    }
}

/// Where the files of a folder and of those in it depart from the thesis: file, from what, and how and why.
fn departures(folder: &Path) -> Vec<(String, String, String)> {
    let mut found = Vec::new();
    for path in files(folder, "dgd") {
        let shown = path.strip_prefix(root()).expect("a file of the repository");
        let shown = shown.to_string_lossy().replace('\\', "/");
        let text = std::fs::read_to_string(&path).expect("a file");
        for paragraph in paragraphs(&text) {
            let Some(departure) = paragraph.strip_prefix("Departs from ") else { continue };
            let (from, how) = departure.split_once(": ").expect("from what: how, because why");
            assert!(how.contains("because "), "{shown}: why it departs from {from}");
            found.push((shown.clone(), from.to_owned(), how.to_owned()));
        }
    }
    let inner =
        std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("one").path());
    let mut inner: Vec<PathBuf> = inner.filter(|path| path.is_dir()).collect();
    inner.sort();
    found.extend(inner.iter().flat_map(|folder| departures(folder)));
    found
}

/// A sentence in a table of Markdown; between backticks nothing but a bar is special.
fn escaped(text: &str) -> String {
    let escape = |(k, part): (usize, &str)| {
        let part = part.replace('|', "\\|");
        if k % 2 == 1 { part } else { part.replace('*', "\\*").replace('_', "\\_") }
    };
    text.split('`').enumerate().map(escape).collect::<Vec<_>>().join("`")
}

/// Paragraphs of a file's doc comments, each in one line.
fn paragraphs(text: &str) -> Vec<String> {
    let mut found = vec![String::new()];
    for line in text.lines() {
        match line.trim_start().strip_prefix("///").map(str::trim) {
            None | Some("") => found.push(String::new()),
            Some(line) => {
                let paragraph = found.last_mut().expect("one at least");
                if !paragraph.is_empty() {
                    paragraph.push(' ');
                }
                paragraph.push_str(line);
            }
        }
    }
    found
}

#[test]
fn departures_from_the_thesis_are_on_one_page() {
    let departures = departures(&root().join("models"));
    let mut page = "# Where the models depart from the thesis\n\nOf S. Haukanes, *State and Parameter Identification \
        Applied to Dual Gradient Drilling with Water Based Mud* (NTNU, 2015), by its equations and sections. Made from the \
        paragraphs of the files' comments that begin with \"Departs from\"; all else is meant to be as printed.\n\n\
        | from | in | how, and why |\n|---|---|---|\n"
        .to_owned();
    for (file, from, how) in &departures {
        let _ = writeln!(page, "| {from} | [{file}](../../{file}) | {} |", escaped(how));
    }
    let mut goldens = Goldens::default();
    goldens.compare(&root().join("docs/models/departures.md"), &page);
    goldens.finish();
    // Those that are known to be needed.
    for (file, from) in [
        ("models/u_tube_drill_string.dgd", "section 2.5"),
        ("models/parts/pressurised_line.dgd", "section 2.5 and 3.11"),
        ("models/mud_circulation_u_tubing.dgd", "3.14"),
        ("models/parts/pi_controller.dgd", "2.31"),
    ] {
        let is_there = departures.iter().any(|(in_file, of, _)| in_file == file && of == from);
        assert!(is_there, "{file} does not say how it departs from {from}");
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
