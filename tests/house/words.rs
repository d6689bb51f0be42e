//! How comments, messages and the manual read: marks of translated English are counted, and limited.
//!
//! A mark is a place to look, not a verdict: a few are correct English. So each limit is a count, and may only fall.

use std::fs;
use std::path::Path;

use crate::source::{CRATES, File, files, root, without_tests};

/// Packages that are not among the layers of [`CRATES`].
const OTHER_PACKAGES: [&str; 5] = ["bench", "fuzz", "tools/s3", "web/playground", "web/wasm"];
/// Crates beyond the common limits, with their marks in comments and their bare locals.
const EXCEPTIONS: [(&str, usize, usize); 1] = [("dgd-scratch", 25, 7)];
/// Marks in all string literals of the crates.
const IN_STRINGS: usize = 86;
/// Marks in the help of commands and options, which are comments of arguments and requests.
const IN_HELP: usize = 0;
/// Marks in all docstrings of the Python package.
const IN_DOCSTRINGS: usize = 0;
/// Marks in pages of the manual; pages that are not listed have none.
const IN_PAGES: [(&str, usize); 3] =
    [("docs/discovery.md", 13), ("docs/language.md", 1), ("docs/reference.md", 1)];
/// Pages that are generated from other texts.
const GENERATED: [&str; 2] = ["docs/files.md", "docs/models"];

/// Word sequences that are marks, with the alternatives for each word; `*` is any word.
const PHRASES: [&[&str]; 18] = [
    &["who|Who", "*"],
    &["whoever|Whoever|somebody|Somebody|nobody|Nobody"],
    &["go|goes", "with|together|along"],
    &["is|are|be", "told|said|had"],
    &["is|are|be", "given", "up"],
    &["so", "many|much"],
    &["how", "sure"],
    &["seldom|thereof|whence"],
    &["in", "the", "place", "of"],
    &["look|looks", "on"],
    &["lets", "go"],
    &["in", "theirs"],
    &["take|takes", "back"],
    &["stand|stands", "alone|behind"],
    &["know|knows|say|says|ask|asks|want|wants|tell|tells", "of|how|what|who|nothing|so|no"],
    &["The", "same", "with|of"],
    &["The", "same", "as", "if"],
    &["all", "else"],
];
/// Words before “what is” that make it a noun by a clause.
const PREPOSITIONS: &str = "of|by|from|with|to|and|in|on|is|are|for";
/// Words after “what” that make it a noun by a clause.
const AFTER_WHAT: &str =
    "is|was|are|were|has|have|the|a|an|it|they|all|each|some|one|comes|acts|holds|follows|goes";

/// Names that say nothing about a local variable.
const BARE: &str = "of|own|told|found|at|all|said|asked|given|seen|held|by|to";

/// Words and the gaps between them, in turn.
fn tokens(text: &str) -> Vec<&str> {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut tokens = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let end = rest.find(|c| is_word(c) != is_word(first)).unwrap_or(rest.len());
        tokens.push(&rest[..end]);
        rest = &rest[end..];
    }
    tokens
}

fn is_one_of(alternatives: &str, word: &str) -> bool {
    alternatives == "*" || alternatives.split('|').any(|alternative| alternative == word)
}

/// Whether the tokens begin with the words of a phrase, single spaces between them.
fn begins_with(tokens: &[&str], phrase: &[&str]) -> bool {
    phrase.iter().enumerate().all(|(k, alternatives)| {
        tokens.get(2 * k).is_some_and(|word| is_one_of(alternatives, word))
            && (k == 0 || tokens[2 * k - 1] == " ")
    })
}

/// “what is” and the like, at the start of a comment or sentence, or after a preposition.
fn is_noun_by_clause(before: &[&str], after: &[&str]) -> bool {
    begins_with(after, &["what|What", AFTER_WHAT])
        && match before {
            [.., word, " "] => is_one_of(PREPOSITIONS, word),
            ["// " | "/// " | "//! "] => true,
            [.., gap] => [". ", ": ", "; ", "( "].iter().any(|end| gap.ends_with(end)),
            [] => false,
        }
}

/// “is no X”, except “there is no X”, “is no longer X” and comparisons.
fn is_negated_noun(before: &[&str], after: &[&str]) -> bool {
    let is_comparison =
        |word: &str| word.ends_with("er") && word.chars().all(|c| c.is_ascii_lowercase());
    begins_with(after, &["is|are|was|were", "no", "*"])
        && !matches!(before, [.., "there" | "There", " "])
        && !is_one_of("longer|more|other", after[4])
        && !is_comparison(after[4])
}

/// A description that is no more than a preposition and a few words.
fn is_bare_phrase(line: &str) -> bool {
    let comment = line.strip_prefix("/// ").or_else(|| line.strip_prefix("//! "));
    comment.and_then(|text| text.strip_suffix('.')).is_some_and(|text| {
        let tokens = tokens(text);
        let is_plain = |token: &&str| *token == " " || token.starts_with(char::is_alphanumeric);
        (5..=13).contains(&tokens.len())
            && is_one_of("Of|For|By|With|From|To", tokens[0])
            && tokens.iter().all(is_plain)
    })
}

/// Whether a line reads like translated English.
fn is_marked(line: &str) -> bool {
    let line = line.trim();
    let tokens = tokens(line);
    let is_marked_at = |k: usize| {
        let (before, after) = tokens.split_at(k);
        PHRASES.iter().any(|phrase| begins_with(after, phrase))
            || is_noun_by_clause(before, after)
            || is_negated_noun(before, after)
    };
    is_bare_phrase(line) || (0..tokens.len()).any(is_marked_at)
}

/// The marked lines among numbered ones, as `place:line: text`.
fn marked<'a>(place: &str, lines: impl IntoIterator<Item = (usize, &'a str)>) -> Vec<String> {
    lines
        .into_iter()
        .filter(|(_, line)| is_marked(line))
        .map(|(k, line)| format!("{place}:{k}: {}", line.trim()))
        .collect()
}

fn numbered(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().enumerate().map(|(k, line)| (k + 1, line))
}

fn comments(text: &str) -> impl Iterator<Item = (usize, &str)> {
    numbered(text).filter(|(_, line)| line.trim_start().starts_with("//"))
}

/// The lines of all string literals of Rust code outside its tests.
fn literals(text: &str) -> Vec<(usize, &str)> {
    let text = without_tests(text);
    let mut found = Vec::new();
    let mut at = 0;
    while let Some(length) = text[at..].find(['"', '\'', '/']) {
        let start = at + length;
        let rest = &text[start..];
        at = start + 1;
        if rest.starts_with("//") {
            at = start + rest.find('\n').unwrap_or(rest.len());
        } else if let Some(behind) = rest.strip_prefix('\'') {
            // A character, whose quote may be escaped; a lifetime has no second quote nearby.
            let escaped = usize::from(behind.starts_with('\\'));
            let character = behind[escaped..].chars().next().map_or(0, char::len_utf8);
            if behind[escaped + character..].starts_with('\'') {
                at = start + 2 + escaped + character;
            }
        } else if let Some(behind) = rest.strip_prefix('"') {
            let fences = text[..start].bytes().rev().take_while(|byte| *byte == b'#').count();
            let is_raw = text[..start - fences].ends_with('r');
            let end = if is_raw {
                behind.find(&format!("\"{}", "#".repeat(fences)))
            } else {
                let mut is_escaped = false;
                behind.find(|c| {
                    let is_end = c == '"' && !is_escaped;
                    is_escaped = c == '\\' && !is_escaped;
                    is_end
                })
            };
            let end = end.unwrap_or(behind.len());
            let line = text[..start].matches('\n').count();
            found.extend(numbered(&behind[..end]).map(|(k, text)| (line + k, text)));
            at = start + end + 2;
        }
        at = at.min(text.len());
    }
    found
}

/// The lines between triple quotes.
fn docstrings(text: &str) -> Vec<(usize, &str)> {
    let mut line = 0;
    let mut found = Vec::new();
    for (k, part) in text.split("\"\"\"").enumerate() {
        if k % 2 == 1 {
            found.extend(numbered(part).map(|(k, text)| (line + k, text)));
        }
        line += part.matches('\n').count();
    }
    found
}

/// The lines of a page outside its examples.
fn prose(text: &str) -> Vec<(usize, &str)> {
    let mut is_example = false;
    let mut found = Vec::new();
    for (k, line) in numbered(text) {
        if line.trim_start().starts_with("```") {
            is_example = !is_example;
        } else if !is_example {
            found.push((k, line));
        }
    }
    found
}

fn is_bare_local(line: &str) -> bool {
    let words: Vec<&str> = line.split_whitespace().collect();
    words.iter().enumerate().any(|(k, word)| {
        let name =
            words.get(k + 1).map(|next| if *next == "mut" { words.get(k + 2) } else { Some(next) });
        *word == "let"
            && name.flatten().is_some_and(|name| is_one_of(BARE, name.trim_end_matches([':', ';'])))
    })
}

/// Files with an ending below a folder, as paths from the root.
fn below(folder: &str, ending: &str) -> Vec<String> {
    fn walk(folder: &Path, ending: &str, found: &mut Vec<String>) {
        for entry in fs::read_dir(folder).expect("a folder of the workspace").flatten() {
            let path = entry.path();
            if path.is_dir() {
                walk(&path, ending, found);
            } else if path.extension().is_some_and(|own| own == ending) {
                let path = path.strip_prefix(root()).expect("a path below the root");
                found.push(path.to_string_lossy().replace('\\', "/"));
            }
        }
    }
    let mut found = Vec::new();
    walk(&root().join(folder), ending, &mut found);
    found.sort();
    found
}

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

fn path(name: &str, file: &File) -> String {
    let folder = if name == "dgd" { String::new() } else { format!("{name}/") };
    format!("{folder}src/{}.rs", file.path.join("/"))
}

/// A sentence about a count over its limit, with the marked lines.
fn over(what: &str, hits: &[String], limit: usize) -> Option<String> {
    (hits.len() > limit)
        .then(|| format!("{what}: {} marks, at most {limit}\n{}", hits.len(), hits.join("\n")))
}

fn packages() -> impl Iterator<Item = &'static str> {
    CRATES.into_iter().chain(OTHER_PACKAGES)
}

#[test]
fn comments_read_like_english() {
    let wrong = packages().filter_map(|name| {
        let files = files(name);
        let n_lines: usize = files.iter().map(|file| comments(&file.text).count()).sum();
        let hits: Vec<String> =
            files.iter().flat_map(|file| marked(&path(name, file), comments(&file.text))).collect();
        let common = if n_lines < 200 { 3 } else { n_lines * 3 / 200 };
        let exception = EXCEPTIONS.iter().find(|(exception, ..)| *exception == name);
        over(name, &hits, exception.map_or(common, |(_, marks, _)| *marks))
    });
    let wrong: Vec<String> = wrong.collect();
    assert!(wrong.is_empty(), "comments of\n{}", wrong.join("\n"));
}

#[test]
fn local_variables_have_names_that_say_something() {
    let wrong = packages().filter_map(|name| {
        let files = files(name);
        let code: Vec<_> =
            files.iter().map(|file| (path(name, file), without_tests(&file.text))).collect();
        let n_lines: usize = code.iter().map(|(_, text)| text.lines().count()).sum();
        let hits: Vec<String> = code
            .iter()
            .flat_map(|(path, text)| {
                let bare = numbered(text).filter(|(_, line)| is_bare_local(line));
                bare.map(move |(k, line)| format!("{path}:{k}: {}", line.trim()))
            })
            .collect();
        let common = (n_lines * 6).div_ceil(10_000);
        let exception = EXCEPTIONS.iter().find(|(exception, ..)| *exception == name);
        over(name, &hits, exception.map_or(common, |(.., locals)| *locals))
    });
    let wrong: Vec<String> = wrong.collect();
    assert!(wrong.is_empty(), "local variables of\n{}", wrong.join("\n"));
}

#[test]
fn messages_and_help_read_like_english() {
    let mut strings = Vec::new();
    for name in CRATES {
        for file in files(name).iter().filter(|file| !file.path.iter().any(|part| part == "tests"))
        {
            strings.extend(marked(&path(name, file), literals(&file.text)));
        }
    }
    let mut help = Vec::new();
    for folder in ["crates/dgd-cli/src/args", "crates/dgd-work/src/request"] {
        for path in below(folder, "rs") {
            help.extend(marked(&path, comments(&read(&path))));
        }
    }
    let mut documented = Vec::new();
    for path in below("crates/dgd-python/python", "py") {
        documented.extend(marked(&path, docstrings(&read(&path))));
    }
    let wrong: Vec<String> = [
        over("string literals", &strings, IN_STRINGS),
        over("help", &help, IN_HELP),
        over("docstrings", &documented, IN_DOCSTRINGS),
    ]
    .into_iter()
    .flatten()
    .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_manual_reads_like_english() {
    let mut pages = below("docs", "md");
    pages.retain(|page| !GENERATED.iter().any(|generated| page.starts_with(generated)));
    let others = [
        "README.md",
        "ARCHITECTURE.md",
        "examples/data/field/README.md",
        "fuzz/README.md",
        "bench/peers/README.md",
    ];
    pages.extend(others.map(str::to_owned));
    pages.extend(below("editors", "md"));
    let wrong = pages.iter().filter_map(|page| {
        let text = read(page);
        let limit = IN_PAGES.iter().find(|(name, _)| name == page).map_or(0, |(_, limit)| *limit);
        over(page, &marked(page, prose(&text)), limit)
    });
    let wrong: Vec<String> = wrong.collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_map_and_the_decisions_are_short() {
    let mut long = Vec::new();
    for (page, limit) in below("docs/decisions", "md")
        .into_iter()
        .map(|page| (page, 8_000))
        .chain([("ARCHITECTURE.md".to_owned(), 12_288)])
    {
        let length = read(&page).len();
        if length > limit {
            long.push(format!("{page}: {length} bytes, at most {limit}"));
        }
    }
    assert!(long.is_empty(), "{}", long.join("\n"));
}

#[test]
fn a_bad_sentence_is_seen_and_a_good_one_is_not() {
    let bad = [
        "/// Who looks on, and may stop it.",
        "/// What is read late.",
        "/// Of a fit.",
        "// It is made of what is left.",
        "errors of `w` are no white noise",
        "a loss that goes with the square of a state",
        "that is said, too: nobody checks it",
        "a result knows nothing of its model",
        "this happens seldom",
    ];
    for line in bad {
        assert!(is_marked(line), "{line}");
    }
    let good = [
        "/// Progress and cancellation.",
        "/// Delayed terms; there is no other delay.",
        "/// For a fit, the residuals of all outputs.",
        "the test is no longer needed, and is no larger than before",
        "a quadratic loss that opposes the state",
        "`whose` sum is what we expect",
    ];
    for line in good {
        assert!(!is_marked(line), "{line}");
    }
    let text = "let own = 'x'; // nobody\nf(\"seldom\", '\"', r#\"a \" nobody\"#);\n#[cfg(test)]\nmod tests { f(\"seldom\") }";
    assert_eq!(literals(text), [(2, "seldom"), (2, "a \" nobody")]);
    assert_eq!(docstrings("a\n\"\"\"b\nc\"\"\" d"), [(2, "b"), (3, "c")]);
    assert_eq!(prose("a\n```\nb\n```\nc"), [(1, "a"), (5, "c")]);
    assert!(is_bare_local("    let mut of = 1;") && is_bare_local("let own: f64 = 1.0;"));
    assert!(!is_bare_local("let offset = of;") && !is_bare_local("let of_use = 1;"));
}
