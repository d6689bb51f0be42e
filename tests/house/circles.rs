//! No circle of more than two files within a crate.
//!
//! A file uses another if it imports or names an item that the other defines, whichever module re-exports it, or calls
//! a method of a type from an `impl` block there. The path of a module, as in `use super::text`, is no use by itself.

use std::collections::{BTreeMap, BTreeSet};

use crate::source::{CRATES, File, code, files, is_name, words};

/// Crates with circles left. This list may only shrink.
const NOT_YET: [&str; 6] =
    ["dgd-runtime", "dgd-identify", "dgd-data", "dgd-work", "dgd-job", "dgd-cli"];
/// Two files may use each other, such as a type and the parser that makes it.
const LARGEST_CIRCLE: usize = 2;

type ModulePath = Vec<String>;

/// A name that a file imports; the path of a glob ends in `*`.
struct Import {
    path: Vec<String>,
    name: String,
    is_public: bool,
}

/// What a file defines and names, outside its unit tests.
#[derive(Default)]
struct FileCode {
    label: String,
    defined: BTreeSet<String>,
    imports: Vec<Import>,
    /// Paths of two names or more in code.
    paths: BTreeSet<Vec<String>>,
    /// All names in code.
    names: BTreeSet<String>,
    /// Types and their functions in `impl` blocks of this file.
    methods: BTreeSet<(String, String)>,
    /// Types and their functions that `impl` blocks of this file call on `self` or `Self`.
    called: BTreeSet<(String, String)>,
    /// Child modules that only tests have.
    test_modules: BTreeSet<String>,
}

/// The position behind the bracket that closes the one at `open`.
fn behind_closing(tokens: &[&str], open: usize) -> usize {
    let mut depth = 0;
    for (k, token) in tokens.iter().enumerate().skip(open) {
        match *token {
            "{" | "(" | "[" => depth += 1,
            "}" | ")" | "]" => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return k + 1;
        }
    }
    tokens.len()
}

/// The position behind the item at `start`, whose attributes come first.
fn behind_item(tokens: &[&str], start: usize) -> usize {
    let mut k = start;
    while k < tokens.len() {
        match tokens[k] {
            "{" => return behind_closing(tokens, k),
            ";" => return k + 1,
            "(" | "[" => k = behind_closing(tokens, k),
            _ => k += 1,
        }
    }
    k
}

/// Reads a tree of imports at `start` into `found`; returns the position behind it.
fn read_imports(
    tokens: &[&str],
    start: usize,
    base: &[String],
    found: &mut Vec<(Vec<String>, String)>,
) -> usize {
    let (mut path, mut k) = (base.to_vec(), start);
    let mut alias = None;
    while k < tokens.len() {
        match tokens[k] {
            "{" => {
                k += 1;
                while tokens.get(k).is_some_and(|token| *token != "}") {
                    k = read_imports(tokens, k, &path, found);
                    k += usize::from(tokens.get(k) == Some(&","));
                }
                return k + 1;
            }
            "as" => {
                alias = tokens.get(k + 1).map(|name| (*name).to_owned());
                k += 1;
            }
            "self" if !path.is_empty() && path != ["super"] && k > 0 => {}
            token if token == "*" || is_name(token) => path.push(token.to_owned()),
            "::" => {}
            _ => break,
        }
        k += 1;
    }
    if let Some(name) = alias.or_else(|| path.last().cloned()) {
        found.push((path, name));
    }
    k
}

/// The type of an `impl` block whose header starts at `start`, whether the block is of a trait, and the position of
/// its body.
fn read_impl(tokens: &[&str], start: usize) -> Option<(String, bool, usize)> {
    let body = start + tokens[start..].iter().position(|token| *token == "{")?;
    let end = tokens[start..body].iter().position(|token| *token == "where");
    let end = end.map_or(body, |end| start + end);
    let (mut depth, mut name, mut is_of_trait) = (0, None, false);
    for k in start..end {
        match tokens[k] {
            "<" => depth += 1,
            ">" if tokens[k - 1] != "-" => depth -= 1,
            "for" if depth == 0 => (name, is_of_trait) = (None, true),
            token if depth == 0 && is_name(token) => name = Some(token),
            _ => {}
        }
    }
    Some((name?.to_owned(), is_of_trait, body))
}

impl FileCode {
    fn read(label: String, text: &str) -> FileCode {
        let code = code(text);
        let tokens = words(&code);
        let mut file = FileCode { label, ..FileCode::default() };
        // The bodies of `impl` blocks around a position: type, whether of a trait, depth, end.
        let mut block: Option<(String, bool, usize, usize)> = None;
        let (mut depth, mut k) = (0, 0);
        while k < tokens.len() {
            if block.as_ref().is_some_and(|(.., end)| k >= *end) {
                block = None;
            }
            let token = tokens[k];
            if tokens[k..].starts_with(&["#", "[", "cfg", "(", "test", ")", "]"]) {
                let end = behind_item(&tokens, k + 7);
                if let Some(of) = tokens[k + 7..end].iter().position(|token| *token == "mod") {
                    file.test_modules.insert(tokens[k + 8 + of].to_owned());
                }
                k = end;
                continue;
            }
            match token {
                "{" => depth += 1,
                "}" => depth -= 1,
                "use" if k == 0 || matches!(tokens[k - 1], "}" | "{" | ";" | "]" | "pub" | ")") => {
                    let mut found = Vec::new();
                    let is_public = k > 0 && matches!(tokens[k - 1], "pub" | ")");
                    k = read_imports(&tokens, k + 1, &[], &mut found);
                    let import = |(path, name)| Import { path, name, is_public };
                    file.imports.extend(found.into_iter().map(import));
                    continue;
                }
                "impl" if k == 0 || matches!(tokens[k - 1], "}" | ";" | "]" | "unsafe") => {
                    if let Some((name, is_of_trait, body)) = read_impl(&tokens, k + 1) {
                        block = Some((name, is_of_trait, depth + 1, behind_closing(&tokens, body)));
                    }
                }
                // The name of a module is no use of an item with that name.
                "mod" => k += 1,
                "fn" | "const" | "struct" | "enum" | "trait" | "type" | "static" | "union"
                | "macro_rules" => {
                    let name = tokens[k + 1..].iter().find(|token| is_name(token));
                    let name = name.map(|name| (*name).to_owned()).unwrap_or_default();
                    match &block {
                        _ if depth == 0 => {
                            file.defined.insert(name);
                        }
                        Some((of, false, inner, _)) if depth == *inner => {
                            file.methods.insert((of.clone(), name));
                        }
                        _ => {}
                    }
                }
                _ if is_name(token) => {
                    file.names.insert(token.to_owned());
                    let mut path = vec![token.to_owned()];
                    while tokens.get(k + 1) == Some(&"::")
                        && tokens.get(k + 2).is_some_and(|token| is_name(token))
                    {
                        path.push(tokens[k + 2].to_owned());
                        k += 2;
                    }
                    let called = match path.as_slice() {
                        [own, name, ..] if own == "Self" => Some(name.as_str()),
                        [own] if own == "self" => match tokens.get(k + 1..k + 4) {
                            Some([".", name, "(" | "::"]) => Some(*name),
                            _ => None,
                        },
                        _ => None,
                    };
                    if let (Some((of, ..)), Some(name)) = (&block, called) {
                        file.called.insert((of.clone(), name.to_owned()));
                    }
                    if path.len() > 1 {
                        file.paths.insert(path);
                    }
                }
                _ => {}
            }
            k += 1;
        }
        file
    }
}

/// The files of a crate by the paths of their modules.
struct CrateCode(BTreeMap<ModulePath, FileCode>);

/// Which files use which, and the names that they use.
type FileUses = BTreeMap<ModulePath, BTreeMap<ModulePath, BTreeSet<String>>>;

impl CrateCode {
    fn read(files: &[File]) -> CrateCode {
        let has_library = files.iter().any(|file| file.path == ["lib"]);
        let is_product = |file: &&File| {
            !file.path.iter().any(|part| part == "tests") && !(has_library && file.path == ["main"])
        };
        let read =
            |file: &File| (file.module().to_vec(), FileCode::read(file.path.join("/"), &file.text));
        let mut all: BTreeMap<_, _> = files.iter().filter(is_product).map(read).collect();
        let only_tests: Vec<ModulePath> = all
            .iter()
            .flat_map(|(module, file)| {
                file.test_modules.iter().map(|child| [module.as_slice(), &[child.clone()]].concat())
            })
            .collect();
        all.retain(|module, _| !only_tests.iter().any(|test| module.starts_with(test)));
        CrateCode(all)
    }

    /// A path that a module names, from the crate's root; `None` for one of another crate.
    fn absolute(&self, module: &[String], path: &[String]) -> Option<ModulePath> {
        let (first, rest) = path.split_first()?;
        let mut base = match first.as_str() {
            "crate" => return Some(rest.to_vec()),
            "super" => module[..module.len().checked_sub(1)?].to_vec(),
            "self" => module.to_vec(),
            _ => {
                let child = [module, path].concat();
                return self.0.contains_key(&child[..=module.len()]).then_some(child);
            }
        };
        let ups = rest.iter().take_while(|part| *part == "super").count();
        base.truncate(base.len().checked_sub(ups)?);
        base.extend_from_slice(&rest[ups..]);
        Some(base)
    }

    /// The file that defines what a path from the root names, and whether that is the file's module as a whole.
    fn defining(&self, path: &[String], passed: &[ModulePath]) -> Option<(ModulePath, bool)> {
        let len = (0..=path.len()).rev().find(|len| self.0.contains_key(&path[..*len]))?;
        let (module, rest) = path.split_at(len);
        let whole = (module.to_vec(), true);
        let Some(item) = rest.first().filter(|item| *item != "*") else {
            return Some(whole);
        };
        let file = &self.0[module];
        if file.defined.contains(item) || passed.iter().any(|other| other == path) {
            return Some((module.to_vec(), false));
        }
        let passed = [passed, &[path.to_vec()]].concat();
        if let Some(import) = file.imports.iter().find(|import| import.name == *item) {
            let target = self.absolute(module, &import.path)?;
            return self.defining(&[&target, &rest[1..]].concat(), &passed);
        }
        let globs = file.imports.iter().filter(|import| import.name == "*");
        let from_globs = globs.filter_map(|import| {
            let target = self.absolute(module, &import.path[..import.path.len() - 1])?;
            let found = self.defining(&[&target, rest].concat(), &passed)?;
            self.0[&found.0].defined.contains(item).then_some(found)
        });
        Some(from_globs.last().unwrap_or((module.to_vec(), false)))
    }

    fn uses(&self) -> FileUses {
        let mut spread: BTreeMap<&(String, String), Vec<&ModulePath>> = BTreeMap::new();
        for (module, file) in &self.0 {
            for method in &file.methods {
                spread.entry(method).or_default().push(module);
            }
        }
        let mut all = FileUses::new();
        for (module, file) in &self.0 {
            let uses = all.entry(module.clone()).or_default();
            let mut add = |used: &ModulePath, name: String| {
                if used != module {
                    uses.entry(used.clone()).or_default().insert(name);
                }
            };
            let mut modules: BTreeMap<&str, ModulePath> = BTreeMap::new();
            for import in &file.imports {
                let Some(path) = self.absolute(module, &import.path) else { continue };
                match self.defining(&path, &[]) {
                    Some((_, true)) if import.name != "*" => {
                        modules.insert(&import.name, path);
                    }
                    // A re-export is a use if the file needs the name, too.
                    Some((used, _)) if !import.is_public || file.names.contains(&import.name) => {
                        add(&used, import.name.clone());
                    }
                    _ => {}
                }
            }
            for path in &file.paths {
                let full = match modules.get(path[0].as_str()) {
                    Some(base) => Some([base, &path[1..]].concat()),
                    None => self.absolute(module, path),
                };
                if let Some((used, false)) = full.and_then(|full| self.defining(&full, &[])) {
                    add(&used, path.join("::"));
                }
            }
            let named = file.paths.iter().flat_map(|path| path.windows(2));
            let named = named.map(|pair| (pair[0].clone(), pair[1].clone()));
            for call in named.chain(file.called.iter().cloned()) {
                for used in spread.get(&call).into_iter().flatten() {
                    if !file.methods.contains(&call) {
                        add(used, format!("{}::{}", call.0, call.1));
                    }
                }
            }
        }
        all
    }

    /// The circles that are too large, each as the files in it with what they use of each other.
    fn circles(&self) -> Vec<String> {
        let uses = self.uses();
        let reached: BTreeMap<&ModulePath, BTreeSet<&ModulePath>> =
            uses.keys().map(|start| (start, reachable(&uses, start))).collect();
        let mut circles = Vec::new();
        for (start, from_start) in &reached {
            let circle: Vec<&ModulePath> =
                from_start.iter().copied().filter(|other| reached[other].contains(start)).collect();
            // The circle is told at its first file.
            if circle.len() > LARGEST_CIRCLE && circle.first() == Some(start) {
                let lines = circle.iter().map(|user| {
                    let used = uses[*user].iter().filter(|(used, _)| circle.contains(used));
                    let used = used.map(|(used, names)| {
                        let names: Vec<&str> = names.iter().map(String::as_str).collect();
                        format!("{} ({})", self.0[used].label, names.join(", "))
                    });
                    format!("    {} → {}", self.0[*user].label, used.collect::<Vec<_>>().join(", "))
                });
                circles.push(lines.collect::<Vec<_>>().join("\n"));
            }
        }
        circles
    }
}

fn reachable<'a>(uses: &'a FileUses, start: &'a ModulePath) -> BTreeSet<&'a ModulePath> {
    let mut reached = BTreeSet::new();
    let mut next = vec![start];
    while let Some(file) = next.pop() {
        for used in uses[file].keys() {
            if reached.insert(used) {
                next.push(used);
            }
        }
    }
    reached
}

#[test]
fn files_do_not_use_each_other_in_circles() {
    let mut wrong = Vec::new();
    for name in CRATES {
        let circles = CrateCode::read(&files(name)).circles();
        let is_listed = NOT_YET.contains(&name);
        assert!(!is_listed || !circles.is_empty(), "{name} has no circles: take it off the list");
        if !is_listed {
            wrong.extend(circles.iter().map(|circle| format!("{name}:\n{circle}")));
        }
    }
    assert!(wrong.is_empty(), "files in circles:\n{}", wrong.join("\n"));
}

/// The circles among made-up files.
fn circles(files: &[(&str, &str)]) -> Vec<String> {
    let file = |(path, text): &(&str, &str)| File {
        path: path.split('/').map(str::to_owned).collect(),
        text: (*text).to_owned(),
    };
    CrateCode::read(&files.iter().map(file).collect::<Vec<_>>()).circles()
}

#[test]
fn a_circle_through_a_group_and_a_re_export_is_found() {
    let found = circles(&[
        ("lib", "mod a; mod b; mod c;\npub use c::C;"),
        ("a", "use crate::b::{self, inner::{B, D}};\npub(crate) struct A;"),
        ("b/mod", "pub(crate) mod inner;"),
        ("b/inner", "use crate::{C, text};\npub(crate) struct B;"),
        ("c", "pub struct C { a: super::a::A }"),
    ]);
    let expected = "    a → b/inner (B, D)\n    b/inner → c (C)\n    c → a (super::a::A)";
    assert_eq!(found, [expected]);
}

#[test]
fn a_pair_a_module_and_unit_tests_are_accepted() {
    let found = circles(&[
        ("lib", "mod a; mod b; mod c;\npub use a::A;\n#[cfg(test)]\nmod fixture;"),
        ("a", "use crate::b;\n// crate::c::C\npub struct A(b::B, &'static str);"),
        (
            "b",
            "use super::a::A;\nuse crate::c;\npub(crate) struct B;\nfn f() { g(\"crate::c::C\") }",
        ),
        ("c", "use crate::A;\nstruct C;\n#[cfg(test)]\npub(crate) mod tests { use crate::b::B; }"),
        ("fixture", "use crate::c::C;"),
    ]);
    assert_eq!(found, [""; 0]);
}

#[test]
fn blocks_of_one_type_that_call_each_other_are_seen() {
    let found = circles(&[
        ("lib", "mod a; mod b; mod c;"),
        ("a", "pub struct A;\nimpl A { fn first(&self) { self.second() + self.third } }"),
        ("b", "use crate::a::A;\nimpl A { fn second(&self) { Self::third() } }"),
        (
            "c",
            "use crate::a::A;\nimpl<T> From<T> for A { fn from() -> A { A } }\nimpl A { fn third() {} }",
        ),
    ]);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].starts_with("    a → b (A::second)\n"), "{found:?}");
}
