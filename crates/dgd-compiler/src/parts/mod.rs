//! Models inside models: `part pump: subsea_pump(c0 = 275 [m])`.
//!
//! A part contains every declaration of its model, with the part's name in front: `pump.c0`. The whole binds the inputs
//! of the part's model, `pump.q = q_ssp`, and can read its outputs. [`expand`] makes one tree of a model and its parts,
//! in which every node keeps its own place, so that later stages need no notion of parts. `fold` turns a tree back into
//! source form, as far as effects have not changed its parts.
//!
//! | file | contents |
//! |---|---|
//! | `flat_model`, `expanded` | a model without parts: the whole, and under the names of its own file |
//! | `visible` | models and libraries that a file sees |
//! | `written` | parts and bindings as a file has them |
//! | `names` | names that items declare and expressions read |
//! | `expansion` | expands a file into its items, including those of its parts |
//! | `instance` | instantiates a part: names, arguments, outputs |
//! | `several` | arrays of parts: varying items get an index |
//! | `indices` | names of indices |
//! | `binding` | bindings of the inputs of parts |
//! | `unknown` | undeclared names in a part's model |
//! | `tied` | values tied to quantities that are not constant |
//! | `unbound` | removes inputs that the chosen variants do not read |
//! | `fold` | back to source form |

mod binding;
mod expanded;
mod expansion;
mod flat_model;
mod fold;
mod indices;
mod instance;
mod names;
mod several;
mod tied;
mod unbound;
mod unknown;
mod visible;
mod written;

#[cfg(test)]
mod tests;

use std::borrow::Cow;

use crate::diagnostics::{Diagnostics, ErrorReported};
use crate::syntax::ast::{Ast, ItemKind};
use crate::syntax::visit;
use expansion::PartExpansion;

pub use flat_model::{FlatModel, InnerModel};
pub(crate) use fold::fold;
pub(crate) use unbound::{has_unbound, leave_out_unbound, leave_out_unread_inputs};

/// Replaces parts by their items. `asts` are the tree of a model and those of all its imports; if there are no parts,
/// nothing is copied.
///
/// # Errors
///
/// [`ErrorReported`] if a part has no model or gets an argument that its model does not have.
///
/// # Panics
///
/// If `asts` is empty: a compilation has a main file.
pub fn expand<'a>(
    asts: &'a [Ast],
    diagnostics: &mut Diagnostics,
) -> Result<FlatModel<'a>, ErrorReported> {
    if asts[1..].iter().all(|ast| ast.model.is_none()) && !has_parts(&asts[0]) {
        let (parts, lengths) = (Vec::new(), Vec::new());
        return Ok(FlatModel { asts: Cow::Borrowed(asts), parts, lengths });
    }
    let mut own = Diagnostics::default();
    let expanded = PartExpansion::new(asts, &mut own).whole();
    for diagnostic in own.sorted() {
        diagnostics.error(diagnostic.clone());
    }
    own.check()?;
    expanded
}

/// Whether a file has parts, or bindings of parts.
fn has_parts(ast: &Ast) -> bool {
    let mut any = false;
    visit::items(&ast.items, &mut |item| {
        any |= matches!(item.kind, ItemKind::Part { .. } | ItemKind::Binding { .. });
    });
    any
}
