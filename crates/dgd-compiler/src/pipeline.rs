//! The whole compiler on one page: text → Ast → Model → Dae → Program → tokens.
//!
//! | stage | function | from | to |
//! |---|---|---|---|
//! | 1 | [`load`] | text and its imports | [`Ast`]s |
//! | 2 | [`resolve`] | `Ast`s | [`Model`]: names, units, SI |
//! | 3 | [`assemble`] | `Model` | [`Dae`]: M ẏ = f, matched, index 1 |
//! | 4 | [`lower`] | `Dae` | [`Program`]: derivatives, single assignment |
//! | 5 | [`crate::codegen::generate`] | `Program` | Rust tokens |

use crate::dae::{Dae, assemble};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::model::{Model, ModelOptions, resolve};
use crate::program::{Program, choose, lower};
use crate::source::{SourceMap, SourceText, Span};
use crate::syntax::UnreadableItem;
use crate::syntax::ast::Ast;
use crate::syntax::imports::{self, LoadedFiles};
use crate::syntax::own_units;

pub use crate::program::SensitivityDirections;
pub use crate::syntax::imports::ReadImport;

/// The result of every stage.
#[derive(Debug, Clone)]
pub struct CompiledStages {
    /// The model file's tree first, then those of its imports, as they were read.
    pub asts: Vec<Ast>,
    /// Names, units and SI values.
    pub model: Model,
    /// The system to be solved.
    pub dae: Dae,
    /// Ready to run.
    pub program: Program,
}

/// Parses a file and, once each, the libraries and models that it imports directly or through others.
///
/// An unreadable item hides only itself: errors of the others, such as names and units, are reported together with it,
/// for the first choice of each variant.
///
/// # Errors
///
/// [`ErrorReported`] if a file has syntax errors, or cannot be read or imported.
pub fn load(
    main: SourceText,
    read: &mut ReadImport<'_>,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<Vec<Ast>, ErrorReported> {
    let mut problems = Diagnostics::default();
    let LoadedFiles { asts, holes } = imports::load(vec![main], read, sources, &mut problems);
    let units = own_units::declared(&asts);
    if !units.is_empty() {
        sources.units = units;
    }
    let result = problems.check();
    if result.is_err() && asts[0].model.is_some() {
        further_mistakes(&asts, &holes, &ModelOptions::default(), &mut problems);
    }
    for diagnostic in problems.sorted() {
        diagnostics.error(diagnostic.clone());
    }
    diagnostics.check()?;
    result.map(|()| asts)
}

/// Reports errors in the valid items of a model with holes, without errors that may only follow from the holes.
pub fn further_mistakes(
    asts: &[Ast],
    holes: &[UnreadableItem],
    options: &ModelOptions,
    diagnostics: &mut Diagnostics,
) {
    let mut further = Diagnostics::default();
    // The model is useless: it lacks the declarations in the holes.
    let _: Result<Model, ErrorReported> = resolve(asts, options, &mut further);
    for mistake in further.sorted() {
        if !holes.iter().any(|hole| follows_from(mistake, hole)) {
            diagnostics.error(mistake.clone());
        }
    }
}

/// Whether an error may only be due to an item that could not be read.
fn follows_from(mistake: &Diagnostic, hole: &UnreadableItem) -> bool {
    let is_about_names = matches!(
        mistake.code,
        Code::UnknownName
            | Code::UnknownFunction
            | Code::MisusedName
            | Code::NoDerivative
            | Code::UnboundInput
    );
    let names_it = |name: &String| {
        // A part's name is the first word of the names of its contents.
        let is_it = |about: &String| {
            about
                .strip_prefix(name.as_str())
                .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        mistake.about.iter().any(is_it)
    };
    let is_within = |span: Span| {
        span.source == hole.span.source
            && hole.span.start <= span.start
            && span.end <= hole.span.end
    };
    hole.hides_all && is_about_names
        || hole.names.iter().any(names_it)
        || mistake.labels.iter().any(|label| is_within(label.span))
}

/// Runs stages 1 to 4.
///
/// # Errors
///
/// [`ErrorReported`]: the errors are in `diagnostics`, with places in `sources`.
pub fn compile(
    main: SourceText,
    options: &ModelOptions,
    directions: &SensitivityDirections,
    read: &mut ReadImport<'_>,
    sources: &mut SourceMap,
    diagnostics: &mut Diagnostics,
) -> Result<CompiledStages, ErrorReported> {
    let asts = load(main, read, sources, diagnostics)?;
    compile_asts(asts, options, directions, diagnostics)
}

/// Runs stages 2 to 4 on a model's tree and those of its libraries, possibly after applying effects.
///
/// # Errors
///
/// [`ErrorReported`]: the errors are in `diagnostics`.
pub fn compile_asts(
    asts: Vec<Ast>,
    options: &ModelOptions,
    directions: &SensitivityDirections,
    diagnostics: &mut Diagnostics,
) -> Result<CompiledStages, ErrorReported> {
    let model = resolve(&asts, options, diagnostics)?;
    let dae = assemble(&model, diagnostics)?;
    let directions = choose(&dae, directions, diagnostics)?;
    let program = lower(&dae, &directions);
    Ok(CompiledStages { asts, model, dae, program })
}
