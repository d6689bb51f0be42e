//! An item with a syntax error hides only itself: random errors in every model of the repository.

use std::fs;
use std::path::{Path, PathBuf};

use dgd_compiler::dae::assemble;
use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::model::{ModelOptions, resolve};
use dgd_compiler::pipeline::load;
use dgd_compiler::source::{SourceId, SourceMap, SourceText};

/// A random number generator (Marsaglia 2003, xorshift64).
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n as u64) as usize
    }
}

/// A diagnostic: its code, and its line in the model's own file.
type Found = (String, Option<usize>);

fn found(path: &Path, text: &str) -> Vec<Found> {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let main = SourceText { name: path.display().to_string(), text: text.to_owned() };
    let mut read = |path: &str| fs::read_to_string(path).map_err(|error| error.to_string());
    if let Ok(asts) = load(main, &mut read, &mut sources, &mut diagnostics) {
        let _ = resolve(&asts, &ModelOptions::default(), &mut diagnostics)
            .and_then(|model| assemble(&model, &mut diagnostics));
    }
    let line = |span| sources.line_column(span).0;
    let place = |span: dgd_compiler::source::Span| (span.source == SourceId(0)).then(|| line(span));
    let all = diagnostics.sorted();
    all.iter().map(|one| (one.code.to_string(), place(one.labels[0].span))).collect()
}

/// The models, with their texts.
fn models() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models");
    let mut all = Vec::new();
    for folder in [root.clone(), root.join("parts"), root.join("test_set")] {
        for entry in fs::read_dir(folder).expect("a folder of models") {
            let path = entry.expect("an entry").path();
            if path.extension().is_some_and(|ending| ending == "dgd") {
                let text = fs::read_to_string(&path).expect("a model");
                all.push((path, text));
            }
        }
    }
    all.sort();
    all
}

/// The part of a line that is not a comment.
fn code(line: &str) -> &str {
    let end = line.find('#').into_iter().chain(line.find("///")).min().unwrap_or(line.len());
    line[..end].trim_end()
}

/// The line with an error that no parser accepts; `None` if the line has no place for it.
fn unreadable(line: &str, random: &mut Random) -> Option<String> {
    let code = code(line);
    let places: Vec<usize> = code.char_indices().map(|(at, _)| at).collect();
    let without = |c: char| code.find(c).map(|at| format!("{}{}", &code[..at], &code[at + 1..]));
    match random.below(8) {
        0 => {
            let at = places[random.below(places.len())];
            Some(format!("{}§{}", &code[..at], &code[at..]))
        }
        1 => without('='),
        2 => without(')'),
        3 => without('('),
        4 => without(']'),
        5 => code.find('=').map(|at| format!("{}= * {}", &code[..at], &code[at + 1..])),
        6 => without(['{', '}'][random.below(2)]),
        _ => {
            let start = code.len() - code.trim_start().len();
            Some(format!("{}x{}", &code[..start], &code[start..]))
        }
    }
}

/// The line with a wrong name, a wrong unit, or another syntax error.
fn wrong(line: &str, random: &mut Random) -> Option<String> {
    let code = code(line);
    match random.below(3) {
        0 => {
            let value = code.find('=')? + 1;
            let letters: Vec<usize> = code[value..]
                .char_indices()
                .filter(|(_, c)| c.is_alphabetic())
                .map(|(at, _)| value + at)
                .collect();
            let at = *letters.get(random.below(letters.len().max(1)))?;
            Some(format!("{}qzx{}", &code[..at], &code[at..]))
        }
        1 => {
            let (open, close) = (code.find(" [")? + 1, code.find(']')?);
            (open < close).then(|| format!("{}[kg^3/A]{}", &code[..open], &code[close + 1..]))
        }
        _ => unreadable(line, random),
    }
}

fn with_line(lines: &[&str], at: usize, line: &str) -> String {
    let mut changed: Vec<&str> = lines.to_vec();
    changed[at] = line;
    changed.join("\n") + "\n"
}

#[test]
fn a_mistake_of_syntax_hides_few_others_and_makes_up_none() {
    let (mut n_pairs, mut n_found, mut missed) = (0, 0, Vec::new());
    let mut made_up = Vec::new();
    for (path, text) in models() {
        // A seed for each model, so that a new model does not change the others.
        let name = path.file_name().expect("a name").to_string_lossy();
        let mut random = Random(name.bytes().fold(0x5eed_1234_9876, |seed, byte| {
            (seed ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        }));
        let lines: Vec<&str> = text.lines().collect();
        let items: Vec<usize> =
            (0..lines.len()).filter(|&i| !code(lines[i]).trim().is_empty()).collect();
        for _ in 0..40 {
            let (first, second) =
                (items[random.below(items.len())], items[random.below(items.len())]);
            let Some(broken) = unreadable(lines[first], &mut random) else { continue };
            let Some(mistake) = wrong(lines[second], &mut random) else { continue };
            let first_alone = found(&path, &with_line(&lines, first, &broken));
            let is_syntax = |(code, _): &Found| code.starts_with("E1");
            if first == second || !first_alone.iter().any(is_syntax) {
                continue;
            }
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            if let Some(other) = first_alone.iter().find(|found| !is_syntax(found)) {
                made_up.push(format!("{name}:{}: `{broken}` gives {other:?}", first + 1));
            }
            // If several places conflict in a second error, each reports it.
            let second_alone = found(&path, &with_line(&lines, second, &mistake));
            let mut both: Vec<&str> = lines.clone();
            both[first] = &broken;
            both[second] = &mistake;
            let with_both = found(&path, &(both.join("\n") + "\n"));
            if second_alone.is_empty() {
                continue;
            }
            n_pairs += 1;
            let is_seen = |one: &Found| with_both.contains(one) && !first_alone.contains(one);
            if second_alone.iter().any(is_seen) {
                n_found += 1;
            } else {
                missed.push(format!(
                    "{name}: {}: `{broken}` hides {}: `{mistake}`",
                    first + 1,
                    second + 1
                ));
            }
        }
    }
    println!("{n_found} of {n_pairs} second mistakes were found; missed:\n{}", missed.join("\n"));
    println!("made up:\n{}", made_up.join("\n"));
    assert!(n_pairs > 400, "{n_pairs}");
    assert!(n_found * 10 >= n_pairs * 9, "{n_found} of {n_pairs}:\n{}", missed.join("\n"));
    assert!(made_up.is_empty(), "{}", made_up.join("\n"));
}
