//! `dgd emit`: any stage of the compiler in readable form.

use std::path::Path;

use dgd_compiler::codegen;
use dgd_compiler::dae::text as dae_text;
use dgd_compiler::model::typeset::{latex, markdown};
use dgd_compiler::model::{Model, text as model_text};
use dgd_compiler::pipeline::SensitivityDirections;
use dgd_compiler::syntax::print;
use dgd_work::load;

use crate::args::{CompilerStage, EmitArgs};
use crate::console::Console;
use crate::failure::CommandError;

pub(crate) fn run(args: &EmitArgs, console: Console<'_>) -> Result<(), CommandError> {
    let loaded =
        load(&args.model, &args.choices.request(), &SensitivityDirections::All, console.session())?;
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
        CompilerStage::Rust => {
            let name = &compiled.program.signature.name;
            let tokens = codegen::generate(&compiled.program, name, &loaded.sources);
            let file = syn::parse2(tokens).map_err(|error| {
                CommandError::Computation(format!("the generated Rust does not parse: {error}"))
            })?;
            prettyplease::unparse(&file)
        }
        CompilerStage::Latex => latex::write(&compiled.asts, &compiled.model),
        CompilerStage::Markdown => {
            let commands = run_commands(&args.model, &compiled.model);
            markdown::write(&compiled.asts, &compiled.model, &commands)
        }
    };
    console.result(&text)
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
