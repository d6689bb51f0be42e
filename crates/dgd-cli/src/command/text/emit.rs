//! `dgd emit`: any stage of the compiler in readable form.

use std::path::Path;

#[cfg(feature = "emit")]
use dgd_compiler::codegen;
use dgd_compiler::dae::text as dae_text;
use dgd_compiler::model::typeset::{latex, markdown};
use dgd_compiler::model::{Model, text as model_text};
use dgd_compiler::pipeline::SensitivityDirections;
use dgd_compiler::program::Program;
use dgd_compiler::source::SourceMap;
use dgd_compiler::syntax::print;
use dgd_work::load;

use crate::args::{CompilerStage, EmitArgs};
use crate::console::Console;
use crate::failure::CommandError;

pub(crate) fn run(args: &EmitArgs, console: Console<'_>) -> Result<(), CommandError> {
    let loaded = load(&args.model, &args.choices, &SensitivityDirections::All, console.session())?;
    console.spare(&loaded.sources)?;
    let compiled = &loaded.compiled;
    let text = match args.stage {
        CompilerStage::Ast => match &loaded.changed {
            Some(changed) => changed.text(&loaded.sources),
            // Imports stay in their own files, and the printed text can be read back beside them.
            None => print::print(&compiled.asts[0]),
        },
        CompilerStage::Model => model_text::write(&compiled.model),
        CompilerStage::Dae => dae_text::write(&compiled.dae),
        CompilerStage::Program => compiled.program.to_string(),
        CompilerStage::Rust => rust(&compiled.program, &loaded.sources)?,
        CompilerStage::Latex => latex::write(&compiled.asts, &compiled.model),
        CompilerStage::Markdown => {
            let commands = run_commands(&args.model, &compiled.model);
            markdown::write(&compiled.asts, &compiled.model, &commands)
        }
    };
    console.result(&text)
}

/// The generated Rust.
#[cfg(feature = "emit")]
fn rust(program: &Program, sources: &SourceMap) -> Result<String, CommandError> {
    let tokens = codegen::generate(program, &program.signature.name, sources);
    let file = syn::parse2(tokens).map_err(|error| {
        CommandError::Computation(format!("the generated Rust does not parse: {error}"))
    })?;
    Ok(prettyplease::unparse(&file))
}

/// Refuses: this build does not format Rust.
#[cfg(not(feature = "emit"))]
fn rust(_: &Program, _: &SourceMap) -> Result<String, CommandError> {
    Err(CommandError::not_built(
        "`emit --stage rust`",
        "`--stage program` lists the same operations",
    ))
}

/// Command lines that run the model in this file.
pub fn run_commands(path: &Path, model: &Model) -> [String; 2] {
    let path = path.display();
    let name = &model.name;
    let (simulated, data) =
        if model.inputs.is_empty() { ("--until T", "") } else { ("--data FILE", " --data FILE") };
    [
        format!("dgd simulate {path} {simulated} --plot {name}.svg"),
        format!("dgd linearize {path}{data} --at steady"),
    ]
}
