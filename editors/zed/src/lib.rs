//! Starts `dgd lsp` for `.dgd` files in Zed.

use zed_extension_api::{
    register_extension, Command, Extension, LanguageServerId, Result, Worktree,
};

struct Dgd;

impl Extension for Dgd {
    fn new() -> Self {
        Self
    }

    fn language_server_command(&mut self, _id: &LanguageServerId, worktree: &Worktree) -> Result<Command> {
        let command = worktree.which("dgd");
        let command = command.ok_or("`dgd` is not in PATH; `cargo install --path crates/dgd-cli --features full` puts it there")?;
        Ok(Command { command, args: vec!["lsp".to_owned()], env: worktree.shell_env() })
    }
}

register_extension!(Dgd);
