//! Stage 1: from text to [`Ast`](ast::Ast).

pub mod ast;
pub mod edit;
pub mod imports;
pub mod layout;
pub(crate) mod local;
pub mod own_units;
mod parse;
pub mod places;
pub mod print;
pub(crate) mod rename;
pub mod table_files;
pub mod visit;

#[cfg(test)]
mod tests;

pub use parse::lexical::{Token, TokenKind, tokens};
pub use parse::{UnreadableItem, parse, parse_setting, parse_what_is_sound, parse_with_holes};
