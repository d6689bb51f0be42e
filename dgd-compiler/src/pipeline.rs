//! The whole compiler on one page: text → Ast → Model → Dae → Program → tokens.
//!
//! | stage | function | from | to |
//! |---|---|---|---|
//! | 1 | [`load`] | text, and what it imports | [`Ast`]s |
//! | 2 | [`resolve`] | `Ast`s | [`Model`]: names, units, SI |
//! | 3 | [`assemble`] | `Model` | [`Dae`]: M ẏ = f, matched, index 1 |
//! | 4 | [`lower`] | `Dae` | [`Program`]: derivatives, single assignment |
//! | 5 | [`crate::codegen::generate`] | `Program` | Rust tokens |

use std::collections::BTreeMap;

use crate::dae::{Dae, Unknown, assemble};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, Reported, suggestion};
use crate::model::{Model, ModelOptions, resolve};
use crate::program::{Direction, Program, lower};
use crate::source::{Source, SourceId, Sources};
use crate::syntax::ast::{Ast, ItemKind, Name};
use crate::syntax::parse;

/// How the names of files end that are imported: no other is looked at, so that a model cannot show what is
/// not its own.
const ENDING: &str = ".dgd";

/// Reads an imported file: path in, text or the reason why not out. The reason quotes nothing of the file.
pub type Read<'a> = dyn FnMut(&str) -> Result<String, String> + 'a;

/// What a program has sensitivities to.
#[derive(Debug, Clone, Default)]
pub enum Directions {
    /// None: only states and outputs.
    #[default]
    None,
    /// All parameters.
    All,
    /// These parameters, and the start values of these states.
    Named(Vec<Name>),
    /// What a fit estimates.
    Estimated {
        /// These parameters; all that are not `fixed` where no parameter is named. Start values of
        /// these states, beside those that are not `fixed`.
        free: Vec<Name>,
        /// None of these, parameters and states.
        fixed: Vec<Name>,
    },
    /// What a filter tracks: parameters as in a fit, and all unknowns that are states in some mode, those
    /// that are `fixed` too.
    Tracked {
        /// These parameters; all that are not `fixed` where no parameter is named.
        free: Vec<Name>,
        /// None of these parameters.
        fixed: Vec<Name>,
    },
}

/// What every stage made.
#[derive(Debug, Clone)]
pub struct Compiled {
    /// The model file's tree first, then those of its imports, as they were read.
    pub asts: Vec<Ast>,
    /// Names, units and SI values.
    pub model: Model,
    /// The system to be solved.
    pub dae: Dae,
    /// Ready to run.
    pub program: Program,
}

/// Runs stages 1 to 4.
///
/// # Errors
///
/// [`Reported`]: what is wrong is in `diagnostics`, its places in `sources`.
pub fn compile(
    main: Source,
    options: &ModelOptions,
    directions: &Directions,
    read: &mut Read<'_>,
    sources: &mut Sources,
    diagnostics: &mut Diagnostics,
) -> Result<Compiled, Reported> {
    let asts = load(main, read, sources, diagnostics)?;
    compile_asts(asts, options, directions, diagnostics)
}

/// Runs stages 2 to 4: on a model's tree and those of its libraries, to which effects may have been
/// applied.
///
/// # Errors
///
/// [`Reported`]: what is wrong is in `diagnostics`.
pub fn compile_asts(
    asts: Vec<Ast>,
    options: &ModelOptions,
    directions: &Directions,
    diagnostics: &mut Diagnostics,
) -> Result<Compiled, Reported> {
    let model = resolve(&asts, options, diagnostics)?;
    let dae = assemble(&model, diagnostics)?;
    let chosen = chosen(&dae, directions, diagnostics)?;
    let program = lower(&dae, &chosen);
    Ok(Compiled { asts, model, dae, program })
}

/// Parses a file and, once each, the libraries and models that it imports directly or through
/// others.
///
/// A path is relative to the file that names it.
///
/// # Errors
///
/// [`Reported`] where a file has syntax errors, or cannot be read or imported.
pub fn load(
    main: Source,
    read: &mut Read<'_>,
    sources: &mut Sources,
    diagnostics: &mut Diagnostics,
) -> Result<Vec<Ast>, Reported> {
    let mut known = BTreeMap::new();
    let path = normalise(&main.name);
    let main = sources.add(main);
    known.insert(path, main);
    let mut asts = vec![parse(main, sources, diagnostics)?];
    let mut next = 0;
    while let Some(ast) = asts.get(next) {
        let source = ast.source;
        let mut found = Vec::new();
        let imports: Vec<_> = ast
            .items
            .iter()
            .filter_map(|item| match &item.kind {
                ItemKind::Import { path, path_span } => Some((path.clone(), *path_span)),
                _ => None,
            })
            .collect();
        for (path, span) in imports {
            let name = beside(sources, source, &path);
            if let Some(id) = known.get(&name) {
                if *id == source {
                    let message = format!("`{path}` is this file itself");
                    diagnostics.error(Diagnostic::new(Code::E208, span, message));
                }
                found.push(*id);
                continue;
            }
            if !name.ends_with(ENDING) {
                let message =
                    format!("cannot import `{path}`: its name does not end in `{ENDING}`");
                diagnostics.error(Diagnostic::new(Code::E208, span, message));
                continue;
            }
            let text = match read(&name) {
                Ok(text) => text,
                Err(reason) => {
                    let message = format!("cannot read `{name}`: {reason}");
                    diagnostics.error(Diagnostic::new(Code::E208, span, message));
                    continue;
                }
            };
            let id = sources.add(Source { name: name.clone(), text });
            known.insert(name, id);
            found.push(id);
            let Ok(ast) = parse(id, sources, diagnostics) else { continue };
            if let Some(effect) = &ast.effect {
                let name = &effect.name.text;
                let message = format!("`{path}` is an effect, `{name}`, not a library or a model");
                diagnostics.error(
                    Diagnostic::new(Code::E208, span, message)
                        .help("an effect is taken into a model with `--apply`"),
                );
                continue;
            }
            if ast.model.is_none() {
                verify_library(&ast, diagnostics);
            }
            asts.push(ast);
        }
        asts[next].imports = found;
        next += 1;
    }
    diagnostics.check()?;
    Ok(asts)
}

/// A library declares nothing that belongs to one model.
fn verify_library(ast: &Ast, diagnostics: &mut Diagnostics) {
    for item in &ast.items {
        match item.kind {
            ItemKind::Import { .. }
            | ItemKind::Constant { .. }
            | ItemKind::Let { .. }
            | ItemKind::Function { .. } => {}
            ItemKind::Size { .. }
            | ItemKind::Array { .. }
            | ItemKind::For { .. }
            | ItemKind::Parameter { .. }
            | ItemKind::Input { .. }
            | ItemKind::Unknown { .. }
            | ItemKind::Output { .. }
            | ItemKind::Equation { .. }
            | ItemKind::Modes { .. }
            | ItemKind::Variant { .. }
            | ItemKind::Part { .. }
            | ItemKind::Binding { .. }
            | ItemKind::When(_)
            | ItemKind::Saturate { .. } => {
                diagnostics.error(
                    Diagnostic::new(Code::E208, item.span, "this cannot stand in a library")
                        .help("a library has constants, `let`s and functions; a model file begins with `model NAME`"),
                );
            }
        }
    }
}

/// The path of an import as seen from where the importing file lies.
fn beside(sources: &Sources, source: SourceId, path: &str) -> String {
    let folder = sources.get(source).name.rsplit_once('/').map_or("", |(folder, _)| folder);
    if folder.is_empty() || path.starts_with('/') {
        normalise(path)
    } else {
        normalise(&format!("{folder}/{path}"))
    }
}

/// Without `.` and without what `..` takes back.
fn normalise(path: &str) -> String {
    let mut parts: Vec<&str> = Vec::new();
    for part in path.split('/') {
        match (part, parts.last()) {
            (".", _) => {}
            ("..", Some(last)) if *last != ".." && !last.is_empty() => {
                parts.pop();
            }
            _ => parts.push(part),
        }
    }
    parts.join("/")
}

/// The chosen directions, each once.
fn chosen(
    dae: &Dae,
    directions: &Directions,
    diagnostics: &mut Diagnostics,
) -> Result<Vec<Direction>, Reported> {
    let chosen = match directions {
        Directions::None => Vec::new(),
        Directions::All => (0..dae.parameters.len()).map(Direction::Parameter).collect(),
        Directions::Named(names) => named(dae, names, diagnostics),
        Directions::Estimated { free, fixed } | Directions::Tracked { free, fixed } => {
            let tracked = matches!(directions, Directions::Tracked { .. });
            let free = named(dae, free, diagnostics);
            let fixed = named(dae, fixed, diagnostics);
            let asked = free.iter().any(|of| matches!(of, Direction::Parameter(_)));
            let parameters = dae.parameters.iter().enumerate().map(|(i, parameter)| {
                let of = Direction::Parameter(i);
                (of, if asked { free.contains(&of) } else { !parameter.fixed })
            });
            // A filter also carries what is differential in other modes than it starts in.
            let somewhere = |x: &Unknown| tracked && dae.graph.value(x.mass) != Some(0.0);
            let states = dae.unknowns.iter().enumerate();
            let states = states.filter(|(_, x)| x.differential || somewhere(x));
            let starts = states.map(|(i, state)| {
                let of = Direction::Start(i);
                (of, tracked || !state.fixed || free.contains(&of))
            });
            let kept = |of: &Direction| tracked && matches!(of, Direction::Start(_));
            parameters
                .chain(starts)
                .filter(|(of, wanted)| *wanted && (kept(of) || !fixed.contains(of)))
                .map(|(of, _)| of)
                .collect()
        }
    };
    diagnostics.check()?;
    Ok(chosen)
}

/// Parameters, and start values of states, by name.
fn named(dae: &Dae, names: &[Name], diagnostics: &mut Diagnostics) -> Vec<Direction> {
    let parameter = |name: &str| dae.parameters.iter().position(|p| p.declared.name == name);
    let state = |name: &str| dae.unknowns.iter().position(|x| x.differential && x.name == name);
    let mut chosen = Vec::with_capacity(names.len());
    for Name { text, span } in names {
        let found = parameter(text).map(Direction::Parameter);
        match found.or_else(|| state(text).map(Direction::Start)) {
            Some(direction) if !chosen.contains(&direction) => chosen.push(direction),
            Some(_) => {}
            None => {
                let parameters = dae.parameters.iter().map(|p| p.declared.name.as_str());
                let states =
                    dae.unknowns.iter().filter(|x| x.differential).map(|x| x.name.as_str());
                let known: Vec<&str> = parameters.chain(states).collect();
                let help = match suggestion(text, known.iter().copied()) {
                    Some(near) => format!("did you mean `{near}`?"),
                    None if known.is_empty() => "this model has no parameters".to_owned(),
                    None => format!("there is `{}`", known.join("`, `")),
                };
                let message = format!("there is no parameter and no state `{text}`");
                diagnostics.error(Diagnostic::new(Code::E201, *span, message).help(help));
            }
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::normalise;

    #[test]
    fn paths_are_taken_as_a_file_system_would() {
        assert_eq!(normalise("models/./lib/../lib/friction.dgd"), "models/lib/friction.dgd");
        assert_eq!(normalise("../a/../../b"), "../../b");
        assert_eq!(normalise("/a/../b"), "/b");
    }
}
