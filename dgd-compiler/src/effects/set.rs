//! Writing values, such as fitted ones, into a tree.

use std::fmt;

use crate::syntax::ast::{Ast, Expr, ExprKind, ItemKind};
use crate::syntax::visit;

/// Why a value cannot be written into a model.
#[derive(Debug, Clone, PartialEq)]
pub enum SetError {
    /// The model declares no constant, parameter or unknown of this name.
    NotDeclared {
        /// The name.
        name: String,
    },
    /// The value is infinite or no number.
    NotFinite {
        /// The name.
        name: String,
        /// The value.
        value: f64,
    },
}

impl fmt::Display for SetError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SetError::NotDeclared { name } => {
                write!(f, "the model declares no value that is called `{name}`")
            }
            SetError::NotFinite { name, value } => {
                write!(f, "`{name}` cannot be {value}, which is no finite number")
            }
        }
    }
}

impl std::error::Error for SetError {}

/// Gives constants, parameters and start values of unknowns new values, each in its declared unit.
///
/// The shortest number is written that is read back as the same value. Round values before where
/// fewer digits are meant. [`super::write`] makes a text of the result.
///
/// # Errors
///
/// [`SetError`], and then nothing has changed.
pub fn set_values(ast: &mut Ast, values: &[(String, f64)]) -> Result<(), SetError> {
    let mut changed = ast.items.clone();
    for (name, value) in values {
        if !value.is_finite() {
            return Err(SetError::NotFinite { name: name.clone(), value: *value });
        }
        let mut is_declared = false;
        visit::items_mut(&mut changed, &mut |item| match &mut item.kind {
            ItemKind::Constant { name: own, value: old, .. }
            | ItemKind::Parameter { name: own, value: old, .. }
                if own.text == *name =>
            {
                is_declared = true;
                old.kind = number(*value, old);
            }
            ItemKind::Unknown { name: own, start, .. } if own.text == *name => {
                is_declared = true;
                let mut new = start.take().unwrap_or_else(|| Expr {
                    span: own.span,
                    kind: ExprKind::Name(String::new()),
                });
                new.kind = number(*value, &new);
                *start = Some(new);
            }
            _ => {}
        });
        if !is_declared {
            return Err(SetError::NotDeclared { name: name.clone() });
        }
    }
    ast.items = changed;
    Ok(())
}

/// A number as it is written, `-3` with its sign outside.
fn number(value: f64, at: &Expr) -> ExprKind {
    let size = value.abs();
    let text = if size == 0.0 || (1e-4..1e7).contains(&size) {
        format!("{size}")
    } else {
        format!("{size:e}")
    };
    let kind = ExprKind::Number { value: size, text, unit: None };
    if value.is_sign_negative() && size > 0.0 {
        ExprKind::Negate(Box::new(Expr { span: at.span, kind }))
    } else {
        kind
    }
}
