//! `dgd completions`: shell completions, generated from the command-line definitions.

use clap::CommandFactory;

use crate::args::{Cli, CompletionsArgs};
use crate::console::Console;
use crate::failure::CommandError;

/// Prints the completions of a shell.
pub(crate) fn run(args: &CompletionsArgs, console: Console<'_>) -> Result<(), CommandError> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "dgd", &mut text);
    console.result(&String::from_utf8_lossy(&text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn help_shows_an_example_on_its_first_screen() {
        let mut command = Cli::command();
        command.build();
        for one in command.get_subcommands_mut().filter(|one| one.get_name() != "help") {
            let name = one.get_name().to_owned();
            let help = one.render_long_help().to_string();
            let screen: Vec<&str> = help.lines().take(24).collect();
            let example = |line: &&str| {
                let is_named = line.contains(&format!("`dgd {name}"))
                    || line.contains(&format!("| dgd {name}"));
                is_named || name == "lsp" && line.contains("\"lsp\"")
            };
            assert!(screen.iter().any(example), "{name}:\n{}", screen.join("\n"));
        }
    }
}
