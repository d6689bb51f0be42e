//! Twice twelve models that were written from descriptions alone, each time by someone who had read `docs/language.md` once.
//! Nine and ten compiled at once, one of the latter two does by now; of the others the messages say how the line should stand.

use std::path::{Path, PathBuf};

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{SensitivityDirections, compile};
use dgd_compiler::source::{SourceMap, SourceText};

use crate::support::root;

fn folder() -> PathBuf {
    root().join("tests/first_guesses")
}

/// What is wrong with a text in the place of a model's.
fn mistakes(path: &Path, text: String) -> Result<(), String> {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let main = SourceText { name: path.display().to_string(), text };
    let read = &mut |path: &str| std::fs::read_to_string(path).map_err(|error| error.to_string());
    let (options, directions) = (ModelOptions::default(), SensitivityDirections::None);
    compile(main, &options, &directions, read, &mut sources, &mut diagnostics)
        .map(|_| ())
        .map_err(|_| render::render(&diagnostics.sorted(), &sources, render::RenderStyle::Plain))
}

#[test]
fn models_from_a_description_are_sound() {
    for folder in ["one", "two"].map(|name| folder().join(name)) {
        let all = std::fs::read_dir(&folder).expect("the folder is there");
        let paths: Vec<PathBuf> =
            all.map(|entry| entry.expect("a readable folder").path()).collect();
        // A tank and a cell are parts of others.
        assert_eq!(paths.len(), 13);
        for path in paths {
            let text = std::fs::read_to_string(&path).expect("a model");
            mistakes(&path, text).unwrap_or_else(|mistakes| panic!("{mistakes}"));
        }
    }
}

#[test]
fn what_was_written_first_is_answered_by_what_stands_now() {
    for (name, stands, first, answer) in [
        ("one/pump_tank", "noise 1 [%]*q", "noise 1 [%]", "noise 1 [%]*abs(q)"),
        ("one/pump_tank", "noise 1 [%]*q", "noise 1%", "`5 [%]*abs(x)`"),
        (
            "one/three_tanks",
            "output overflows_1     = tank.n_over[1]",
            "output overflows = tank.n_over",
            "`output tank.n_over`",
        ),
        ("one/pack", "beyond extend", "linear", "`beyond extend`"),
        ("two/heat_pump", "[1] =\n", "[1] = (\n", "`= (source, sink, value)"),
    ] {
        let path = folder().join(name).with_extension("dgd");
        let text = std::fs::read_to_string(&path).expect("a model");
        assert!(text.contains(stands), "{name}: {stands}");
        let said = mistakes(&path, text.replacen(stands, first, 1)).expect_err("it is wrong");
        assert!(said.contains(answer), "{name}: {said}");
    }
}
