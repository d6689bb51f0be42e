//! `dgd completions` and `dgd man`: shell completions and man pages, generated from the command-line definitions.

use std::fs;
use std::io;

use clap::CommandFactory;
use clap_mangen::Man;
use dgd_data::files::write_whole;

use crate::args::{Cli, CompletionsArgs, ManArgs};
use crate::console::Console;
use crate::failure::CommandError;

pub(crate) fn completions(
    args: &CompletionsArgs,
    console: Console<'_>,
) -> Result<(), CommandError> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "dgd", &mut text);
    console.result(&String::from_utf8_lossy(&text))
}

pub(crate) fn man(args: &ManArgs, console: Console<'_>) -> Result<(), CommandError> {
    let folder = &args.folder;
    let failed = |error: io::Error| {
        CommandError::Found(format!("cannot write into `{}`: {error}", folder.display()))
    };
    fs::create_dir_all(folder).map_err(failed)?;
    let pages = pages().map_err(failed)?;
    for (name, page) in &pages {
        write_whole(&folder.join(name), |out| out.write_all(page))?;
    }
    console.remark(&format!("wrote {} pages into {}", pages.len(), folder.display()));
    Ok(())
}

/// The page of `dgd`, and one for each command.
fn pages() -> io::Result<Vec<(String, Vec<u8>)>> {
    let mut command = Cli::command();
    command.build();
    let main = ("dgd".to_owned(), command.clone());
    let visible = command.get_subcommands().filter(|one| !one.is_hide_set());
    let others = visible.map(|one| (format!("dgd-{}", one.get_name()), one.clone()));
    let page = |(name, command): (String, clap::Command)| {
        let mut page = Vec::new();
        Man::new(command).title(name.to_uppercase()).render(&mut page)?;
        Ok((format!("{name}.1"), page))
    };
    std::iter::once(main).chain(others).map(page).collect()
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

    #[test]
    fn every_command_has_a_page() {
        let pages = pages().expect("written into memory");
        let names: Vec<&str> = pages.iter().map(|(name, _)| name.as_str()).collect();
        for name in ["dgd.1", "dgd-simulate.1", "dgd-discover.1", "dgd-new.1"] {
            assert!(names.contains(&name), "{names:?}");
        }
        for (name, page) in &pages {
            let text = String::from_utf8_lossy(page);
            assert!(text.contains(".SH SYNOPSIS") && text.contains(".TH "), "{name}");
        }
    }
}
