//! The man pages: of `dgd`, and one for each command.

use std::fs;
use std::io;

use clap::CommandFactory;
use clap_mangen::Man;
use dgd_data::files::write_whole;

use crate::args::{Cli, ManArgs};
use crate::console::Console;
use crate::failure::CommandError;

/// Writes the pages into a folder.
pub(crate) fn run(args: &ManArgs, console: Console<'_>) -> Result<(), CommandError> {
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
