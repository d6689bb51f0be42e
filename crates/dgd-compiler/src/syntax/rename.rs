//! Renames declarations and reads in items when an effect or a part gets its names in the model.

use std::collections::BTreeMap;

use super::ast::{Expr, ExprKind, Item, Name};
use super::visit::{self, ExprRole, ItemPart, Namespace};

/// Old names, each with its new one.
#[derive(Debug, Default)]
pub(crate) struct Renaming {
    map: BTreeMap<(Namespace, String), String>,
}

impl Renaming {
    /// Renames `old` to `new`.
    pub(crate) fn insert(&mut self, namespace: Namespace, old: String, new: String) {
        self.map.insert((namespace, old), new);
    }

    /// Whether a name has a new one.
    pub(crate) fn contains(&self, namespace: Namespace, old: &str) -> bool {
        self.map.contains_key(&(namespace, old.to_owned()))
    }

    /// Renames one name.
    pub(crate) fn rename(&self, namespace: Namespace, name: &mut Name) {
        if let Some(new) = self.map.get(&(namespace, name.text.clone())) {
            name.text.clone_from(new);
        }
    }

    /// Renames the names that an expression reads and calls, except names that are hidden by arguments.
    pub(crate) fn rename_in(&self, expr: &mut Expr, hidden: &[&str]) {
        let renamed = |name: &str| {
            let is_hidden = hidden.contains(&name);
            self.map.get(&(Namespace::Value, name.to_owned())).filter(|_| !is_hidden)
        };
        match &mut expr.kind {
            ExprKind::Name(name) => {
                if let Some(new) = renamed(name) {
                    name.clone_from(new);
                }
            }
            ExprKind::Call { function, .. } => {
                if let Some(new) = renamed(&function.text) {
                    function.text.clone_from(new);
                }
            }
            _ => {}
        }
        for operand in visit::operands_mut(expr) {
            self.rename_in(operand, hidden);
        }
    }

    /// Renames the names that an item declares, reads and calls.
    pub(crate) fn rename_item(&self, item: &mut Item) {
        visit::parts_mut(item, &mut |part| match part {
            ItemPart::Declares(namespace, name) => self.rename(namespace, name),
            ItemPart::Resets(name) => self.rename(Namespace::Value, name),
            ItemPart::Unit(_) => {}
            ItemPart::Expr(ExprRole::Body(_, arguments), expr) => {
                let hidden: Vec<&str> = arguments.iter().map(|a| a.name.text.as_str()).collect();
                self.rename_in(expr, &hidden);
            }
            ItemPart::Expr(ExprRole::Noise(own), expr) => {
                self.rename_in(expr, &[own.text.as_str()]);
                if let Some(new) = self.map.get(&(Namespace::Output, own.text.clone())) {
                    rename_name(expr, &own.text, new);
                }
            }
            ItemPart::Expr(_, expr) => self.rename_in(expr, &[]),
        });
    }
}

/// Renames a name that an expression reads.
fn rename_name(expr: &mut Expr, old: &str, new: &str) {
    if let ExprKind::Name(name) = &mut expr.kind
        && name == old
    {
        new.clone_into(name);
    }
    for operand in visit::operands_mut(expr) {
        rename_name(operand, old, new);
    }
}
