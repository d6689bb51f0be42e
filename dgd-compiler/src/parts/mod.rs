//! Models inside models: `part pump: subsea_pump(c0 = 275 [m])`.
//!
//! A part is everything that its model declares, under names with the part's before them:
//! `pump.c0`. What the model calls an input is what the whole says it is, `pump.q = q_ssp`; what it
//! calls an output can be read. [`expand`] makes one tree of a model and its parts, in which every
//! node keeps its own place, so that no later stage knows of parts. `fold` takes a tree back to
//! what was written, as far as an effect has left its parts alone.
//!
//! | file | what it holds |
//! |---|---|
//! | `visible` | which models and libraries a file sees |
//! | `expansion` | from a file to its items, those of its parts in place |
//! | `instance` | from a model to one part: names, arguments, outputs |
//! | `several` | parts of which there are several: what differs gets an index |
//! | `indices` | what indices are called |
//! | `binding` | what inputs of parts are |
//! | `unknown` | names that a part's model reads and nobody declares |
//! | `tied` | values that are not numbers but tied to what the whole knows only later |
//! | `unbound` | inputs that the chosen variants do not read: left out |
//! | `fold` | back to what was written |

mod binding;
mod expansion;
mod fold;
mod indices;
mod instance;
mod several;
mod tied;
mod unbound;
mod unknown;
mod visible;

#[cfg(test)]
mod tests;

use std::borrow::Cow;

use crate::diagnostics::{Diagnostics, Reported};
use crate::source::Span;
use crate::syntax::ast::{Ast, ItemKind};
use crate::syntax::visit;
use expansion::Expansion;

pub(crate) use fold::fold;
pub(crate) use unbound::{has_unbound, leave_out_unbound, leave_out_unread_inputs};

/// A model without parts.
#[derive(Debug, Clone, PartialEq)]
pub struct Expanded<'a> {
    /// The model's tree, in which the items of parts stand where the parts were, then those of its
    /// libraries and of its parts' libraries.
    pub asts: Cow<'a, [Ast]>,
    /// The parts, and after each its own.
    pub parts: Vec<InnerModel>,
    /// How many items stand for each part of the model itself, in the order written.
    lengths: Vec<usize>,
}

/// A model that is part of another.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InnerModel {
    /// What the whole calls it: `pump`, or `well.pump`.
    pub name: String,
    /// The model's name.
    pub model: String,
    /// Doc comment of the part.
    pub doc: Vec<String>,
    /// Where the part that it is in says its name.
    pub span: Span,
}

/// Puts the items of parts in their places. `asts` are the tree of a model and those of all that it
/// imports; without parts among them nothing is copied.
///
/// # Errors
///
/// [`Reported`] where a part has no model or is given what its model does not have.
///
/// # Panics
///
/// If `asts` is empty: a compilation has a main file.
pub fn expand<'a>(
    asts: &'a [Ast],
    diagnostics: &mut Diagnostics,
) -> Result<Expanded<'a>, Reported> {
    if asts[1..].iter().all(|ast| ast.model.is_none()) && !has_parts(&asts[0]) {
        let (parts, lengths) = (Vec::new(), Vec::new());
        return Ok(Expanded { asts: Cow::Borrowed(asts), parts, lengths });
    }
    let mut own = Diagnostics::default();
    let expanded = Expansion::new(asts, &mut own).whole();
    for diagnostic in own.sorted() {
        diagnostics.error(diagnostic.clone());
    }
    own.check()?;
    expanded
}

/// Whether a file has parts, or bindings as if it had.
fn has_parts(ast: &Ast) -> bool {
    let mut any = false;
    visit::items(&ast.items, &mut |item| {
        any |= matches!(item.kind, ItemKind::Part { .. } | ItemKind::Binding { .. });
    });
    any
}
