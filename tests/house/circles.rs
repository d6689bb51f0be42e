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

/// An `impl` block.
struct ImplBlock {
    of: String,
    is_of_trait: bool,
    /// Position of its opening brace, and the one behind its end.
    body: usize,
    end: usize,
}

impl ImplBlock {
    /// Reads the block whose header starts at `start`; `None` if it is of no named type.
    fn read(tokens: &[&str], start: usize) -> Option<ImplBlock> {
        let body = start + tokens[start..].iter().position(|token| *token == "{")?;
        let header_end = tokens[start..body].iter().position(|token| *token == "where");
        let header_end = header_end.map_or(body, |end| start + end);
        let (mut depth, mut of, mut is_of_trait) = (0, None, false);
        for k in start..header_end {
            match tokens[k] {
                "<" => depth += 1,
                ">" if tokens[k - 1] != "-" => depth -= 1,
                "for" if depth == 0 => (of, is_of_trait) = (None, true),
                token if depth == 0 && is_name(token) => of = Some(token),
                _ => {}
            }
        }
        let end = behind_closing(tokens, body);
        Some(ImplBlock { of: of?.to_owned(), is_of_trait, body, end })
    }
}

/// The path `a::b::c` at `start`, or the single name there.
fn path_at(tokens: &[&str], start: usize) -> Vec<String> {
    let mut path = vec![tokens[start].to_owned()];
    let mut k = start + 1;
    while let Some(["::", name]) = tokens.get(k..k + 2)
        && is_name(name)
    {
        path.push((*name).to_owned());
        k += 2;
    }
    path
}

impl FileCode {
    fn read(label: String, text: &str) -> FileCode {
        let code = code(text);
        let tokens = words(&code);
        let mut file = FileCode { label, ..FileCode::default() };
        let mut block: Option<ImplBlock> = None;
        let (mut depth, mut k) = (0, 0);
        while k < tokens.len() {
            block = block.filter(|block| k < block.end);
            let begins = |after: &[&str]| k == 0 || after.contains(&tokens[k - 1]);
            if tokens[k..].starts_with(&["#", "[", "cfg", "(", "test", ")", "]"]) {
                k = file.skip_test(&tokens, k + 7);
                continue;
            }
            match tokens[k] {
                "{" => depth += 1,
                "}" => depth -= 1,
                "use" if begins(&["}", "{", ";", "]", "pub", ")"]) => {
                    let is_public = k > 0 && matches!(tokens[k - 1], "pub" | ")");
                    let mut found = Vec::new();
                    k = read_imports(&tokens, k + 1, &[], &mut found);
                    let import = |(path, name)| Import { path, name, is_public };
                    file.imports.extend(found.into_iter().map(import));
                    continue;
                }
                "impl" if begins(&["}", ";", "]", "unsafe"]) => {
                    block = ImplBlock::read(&tokens, k + 1);
                }
                // The name of a module is no use of an item with that name.
                "mod" => k += 1,
                "fn" | "const" | "struct" | "enum" | "trait" | "type" | "static" | "union"
                | "macro_rules" => {
                    let name = tokens[k + 1..].iter().find(|token| is_name(token));
                    let name = name.map(|name| (*name).to_owned()).unwrap_or_default();
                    match &block {
                        _ if depth == 0 => drop(file.defined.insert(name)),
                        Some(block) if depth == 1 && !block.is_of_trait && k > block.body => {
                            file.methods.insert((block.of.clone(), name));
                        }
                        _ => {}
                    }
                }
                token if is_name(token) => {
                    let path = path_at(&tokens, k);
                    let called = match (token, tokens.get(k + 1..k + 4)) {
                        ("Self", _) => path.get(1).map(String::as_str),
                        ("self", Some([".", name, "(" | "::"])) => Some(*name),
                        _ => None,
                    };
                    if let (Some(block), Some(name)) = (&block, called) {
                        file.called.insert((block.of.clone(), name.to_owned()));
                    }
                    file.names.insert(token.to_owned());
                    k += 2 * (path.len() - 1);
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

    /// Skips the item at `start`, which only tests have; returns the position behind it.
    fn skip_test(&mut self, tokens: &[&str], start: usize) -> usize {
        let end = behind_item(tokens, start);
        let module = tokens[start..end].iter().position(|token| *token == "mod");
        let name = module.and_then(|module| tokens.get(start + module + 1));
        self.test_modules.extend(name.map(|name| (*name).to_owned()));
        end
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
            !(file.path.iter().any(|part| part == "tests") || has_library && file.path == ["main"])
        };
        let read =
            |file: &File| (file.module().to_vec(), FileCode::read(file.path.join("/"), &file.text));
        let mut all: BTreeMap<_, _> = files.iter().filter(is_product).map(read).collect();
        let only_tests: Vec<ModulePath> = all
            .iter()
            .flat_map(|(module, file)| {
                file.test_modules
                    .iter()
                    .map(|child| [module.as_slice(), std::slice::from_ref(child)].concat())
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
        let mut from_globs = globs.filter_map(|import| {
            let target = self.absolute(module, &import.path[..import.path.len() - 1])?;
            let found = self.defining(&[&target, rest].concat(), &passed)?;
            self.0[&found.0].defined.contains(item).then_some(found)
        });
        Some(from_globs.next_back().unwrap_or((module.to_vec(), false)))
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
