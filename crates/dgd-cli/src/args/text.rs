//! Options of commands that read texts and compute nothing.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use clap_complete::Shell;
use dgd_work::{CheckRequest, ModelChoices};

/// Arguments of `lsp`.
#[derive(Debug, Args)]
pub(crate) struct LspArgs {
    /// Accepted and ignored, because many editors pass it
    #[arg(long, hide = true)]
    pub stdio: bool,
}

/// Arguments of `check`.
#[derive(Debug, Args)]
pub(crate) struct CheckArgs {
    #[command(flatten)]
    pub request: CheckRequest,
    /// Fix mistakes that have only one possible correction, such as `parameter R [ohm] = 1.2` for
    /// `parameter R = 1.2 [ohm]`
    #[arg(long)]
    pub fix: bool,
}

/// Arguments of `fmt`.
#[derive(Debug, Args)]
pub(crate) struct FmtArgs {
    /// Model files
    #[arg(required = true)]
    pub models: Vec<PathBuf>,
    /// Do not write files; fail if one is not formatted
    #[arg(long)]
    pub check: bool,
}

/// Arguments of `emit`.
#[derive(Debug, Args)]
pub(crate) struct EmitArgs {
    /// The model file
    pub model: PathBuf,
    /// Compiler stage to print
    #[arg(long, value_enum)]
    pub stage: CompilerStage,
    #[command(flatten)]
    pub choices: ModelChoices,
}

/// Stages of the compiler.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum CompilerStage {
    /// The parsed file
    Ast,
    /// Names, units and SI values
    Model,
    /// The system that is solved
    Dae,
    /// Operations in execution order
    Program,
    /// Generated Rust
    Rust,
    /// Equations, typeset
    Latex,
    /// A page of declarations and typeset equations
    Markdown,
}

/// Arguments of `explain`.
#[derive(Debug, Args)]
pub(crate) struct ExplainArgs {
    /// The code, such as E301
    pub code: String,
}

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// The shell
    #[arg(value_enum)]
    pub shell: Shell,
}

/// Arguments of `man`.
#[derive(Debug, Args)]
pub(crate) struct ManArgs {
    /// The folder; it is created if it does not exist
    pub folder: PathBuf,
}
