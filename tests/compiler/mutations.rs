//! Texts that no one would write: the compiler says what is wrong with them and never panics.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{SensitivityDirections, compile};
use dgd_compiler::source::{SourceMap, SourceText};

use crate::golden::files;
use crate::support::{Noise, root};

/// Mutants of each text.
const MUTANTS: usize = 30;

/// A text cut into words, numbers, blanks and single signs.
fn pieces(text: &str) -> Vec<&str> {
    let class = |letter: char| match letter {
        ' ' => 0,
        letter if letter.is_alphanumeric() || letter == '_' || letter == '.' => 1,
        _ => 2,
    };
    let mut pieces = Vec::new();
    let mut start = 0;
    let mut letters = text.char_indices().peekable();
    while let Some((_, letter)) = letters.next() {
        let end = letters.peek().map_or(text.len(), |(at, _)| *at);
        let goes_on = letters.peek().is_some_and(|(_, next)| class(*next) == class(letter));
        if !goes_on || class(letter) == 2 {
            pieces.push(&text[start..end]);
            start = end;
        }
    }
    pieces
}

fn below(noise: &mut Noise, n: usize) -> usize {
    ((0.5 + 0.5 * noise.next()) * n as f64) as usize
}

/// Deletes, doubles, swaps or replaces some pieces; what replaces comes from any of the texts.
fn mutant(own: &[&str], foreign: &[&str], noise: &mut Noise) -> String {
    let mut pieces: Vec<String> = own.iter().map(|piece| (*piece).to_owned()).collect();
    for _ in 0..=below(noise, 3) {
        if pieces.is_empty() {
            break;
        }
        let (at, other) = (below(noise, pieces.len()), below(noise, pieces.len()));
        match below(noise, 5) {
            0 => drop(pieces.remove(at)),
            1 => pieces.insert(other, pieces[at].clone()),
            2 => pieces.swap(at, other),
            3 => foreign[below(noise, foreign.len())].clone_into(&mut pieces[at]),
            _ => {
                let letter = char::from_u32(below(noise, 0x3000) as u32).unwrap_or('?');
                pieces[at] = letter.to_string();
            }
        }
    }
    pieces.concat()
}

fn texts() -> Vec<(PathBuf, String)> {
    let folders = [
        "models",
        "models/lib",
        "models/parts",
        "tests/parts",
        "tests/golden/fail",
        "tests/golden/data",
        "dgd-macros/rustc/tests/ui",
    ];
    let mut paths: Vec<PathBuf> =
        folders.iter().flat_map(|folder| files(&root().join(folder), "dgd")).collect();
    for case in ["arrays", "ode", "dae_with_variant", "functions_and_import", "parts"] {
        paths.extend(files(&root().join("tests/golden/pass").join(case), "dgd"));
    }
    let read = |path: PathBuf| {
        let text = fs::read_to_string(&path).expect("a file of the repository");
        (path, text)
    };
    // Long generated files show nothing more than short ones.
    paths.into_iter().map(read).filter(|(_, text)| text.len() < 5000).collect()
}

/// Compiles the mutants of one text; how many of them are sound.
fn sound_mutants(k: usize, path: &Path, text: &str, foreign: &[&str]) -> usize {
    let (own, mut noise, mut sound) = (pieces(text), Noise::new(7 + k as u64), 0);
    for _ in 0..MUTANTS {
        let main = SourceText {
            name: path.display().to_string(),
            text: mutant(&own, foreign, &mut noise),
        };
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let compiled = compile(
            main.clone(),
            &ModelOptions::default(),
            &SensitivityDirections::All,
            &mut |path| fs::read_to_string(path).map_err(|error| error.to_string()),
            &mut sources,
            &mut diagnostics,
        );
        let mistakes = diagnostics.sorted();
        assert_eq!(compiled.is_err(), !mistakes.is_empty(), "{}", main.text);
        for mistake in &mistakes {
            assert!(!mistake.message.is_empty(), "{}", main.text);
        }
        let rendered = render::render(&mistakes, &sources, render::RenderStyle::Plain);
        assert_eq!(rendered.is_empty(), mistakes.is_empty(), "{}", main.text);
        sound += usize::from(compiled.is_ok());
    }
    sound
}

#[test]
fn mutants_compile_or_are_explained() {
    let texts = texts();
    let foreign: Vec<&str> = texts.iter().flat_map(|(_, text)| pieces(text)).collect();
    let next = AtomicUsize::new(0);
    let work = || {
        let mut sound = 0;
        while let Some((k, (path, text))) = {
            let k = next.fetch_add(1, Ordering::Relaxed);
            texts.get(k).map(|text| (k, text))
        } {
            sound += sound_mutants(k, path, text, &foreign);
        }
        sound
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let sound: usize = std::thread::scope(|scope| {
        let all: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        all.into_iter().map(|one| one.join().expect("no mutant panics")).sum()
    });
    // Small changes leave some models sound, so that all stages have been reached.
    assert!(sound > texts.len() / 2, "{sound} of {} texts", MUTANTS * texts.len());
}
