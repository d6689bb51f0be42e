//! The whole compiler on one page: text → Ast → Model → Dae → Program → tokens.
//!
//! | stage | function | from | to |
//! |---|---|---|---|
//! | 1 | [`load`] | text, and what it imports | [`Ast`]s |
//! | 2 | [`resolve`] | `Ast`s | [`Model`]: names, units, SI |
//! | 3 | [`assemble`] | `Model` | [`Dae`]: M ẏ = f, matched, index 1 |
//! | 4 | [`lower`] | `Dae` | [`Program`]: derivatives, single assignment |
//! | 5 | [`crate::codegen::generate`] | `Program` | Rust tokens |

use crate::dae::{Dae, assemble};
use crate::diagnostics::{Diagnostics, Reported};
use crate::model::{Model, ModelOptions, resolve};
use crate::program::{Program, choose, lower};
use crate::source::{Source, Sources};
use crate::syntax::ast::Ast;

pub use crate::program::Directions;
pub use crate::syntax::imports::{Read, load};

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
    let directions = choose(&dae, directions, diagnostics)?;
    let program = lower(&dae, &directions);
    Ok(Compiled { asts, model, dae, program })
}
