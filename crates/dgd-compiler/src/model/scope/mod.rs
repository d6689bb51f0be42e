//! The names of a model: what they are, and where.
//!
//! | file | contents |
//! |---|---|
//! | `define` | collects the names that the items declare |
//! | `names` | the names that an expression reads |
//! | `order` | the order in which constants and `let`s are evaluated |
//! | `whole` | sizes, the ends of ranges, and indices |
//! | `shape` | arrays of several indices as one list |
//! | `place`, `place_arrays` | arrays and their positions, and ranges of loops |

mod define;
mod names;
mod order;
mod place;
mod place_arrays;
mod shape;
mod whole;

use std::collections::BTreeMap;

use super::check_units::UnitSpelling;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::Symbol;
use crate::source::Span;
use crate::syntax::ast::{
    ArrayKind, Attribute, AttributeKind, Expr, FormalArgument, LocalLet, Name, TablePoints,
    WrittenUnit,
};
use crate::units::{Dimension, Unit};
use names::names_in;

pub(super) use order::in_order;
pub(super) use place::{ArrayPlace, LetArray, Vector};
pub(super) use shape::{ArrayShape, brackets};
pub(super) use whole::{
    AffineInteger, IndexExtent, LoopIndex, NamedSizes, extent_within, open_index, whole,
};

/// The definition of a name; numbers are positions among those of its kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::model) enum NameDefinition {
    Time,
    Pi,
    Constant(u32),
    Parameter(u32),
    Input(u32),
    Unknown {
        index: u32,
        state: bool,
    },
    /// A size; its value is in [`ModelScope::sizes`].
    Size,
    /// An array of unknowns; its position is in [`ModelScope::arrays`].
    Array {
        index: usize,
        state: bool,
    },
    /// An array of constants, parameters or inputs, in [`ModelScope::vectors`].
    Vector(usize),
    /// A `let` of a loop, in [`ModelScope::let_arrays`].
    LetArray(usize),
    Let(usize),
    Function(usize),
    /// A table, in [`ModelScope::tables`].
    Table(usize),
}

impl NameDefinition {
    /// Its noun in messages.
    pub(in crate::model) fn noun(self) -> &'static str {
        match self {
            NameDefinition::Time => "the time",
            NameDefinition::Pi => "a number",
            NameDefinition::Constant(_) => "a constant",
            NameDefinition::Parameter(_) => "a parameter",
            NameDefinition::Input(_) => "an input",
            NameDefinition::Unknown { state: true, .. } => "a state",
            NameDefinition::Unknown { state: false, .. } => "an `unknown`",
            NameDefinition::Size => "a size",
            NameDefinition::Array { .. }
            | NameDefinition::Vector(_)
            | NameDefinition::LetArray(_) => "an array",
            NameDefinition::Let(_) => "a `let`",
            NameDefinition::Function(_) => "a function",
            NameDefinition::Table(_) => "a table",
        }
    }
}

/// A name, its definition and its place.
#[derive(Debug, Clone)]
pub(in crate::model) struct ScopeEntry {
    pub(in crate::model) definition: NameDefinition,
    pub(in crate::model) span: Span,
    /// Its unit, if it was declared with one.
    pub(in crate::model) unit: Option<Result<Unit, ErrorReported>>,
}

/// A function as declared.
#[derive(Debug, Clone, Copy)]
pub(in crate::model) struct FunctionDeclaration<'a> {
    pub(in crate::model) name: &'a str,
    pub(in crate::model) arguments: &'a [FormalArgument],
    pub(in crate::model) lets: &'a [LocalLet],
    pub(in crate::model) body: &'a Expr,
}

impl<'a> FunctionDeclaration<'a> {
    /// Names that its text reads and calls, except its own.
    pub(in crate::model) fn names(&self) -> Vec<&'a str> {
        let mut names = Vec::new();
        for local in self.lets {
            names_in(&local.value, &mut names);
        }
        names_in(self.body, &mut names);
        let locals =
            self.arguments.iter().map(|a| &a.name).chain(self.lets.iter().map(|l| &l.name));
        let local_names: Vec<&str> = locals.map(|name| name.text.as_str()).collect();
        names.retain(|name| !local_names.contains(name));
        names
    }
}

/// A table as declared.
#[derive(Debug, Clone, Copy)]
pub(in crate::model) struct TableDeclaration<'a> {
    pub(in crate::model) name: &'a Name,
    pub(in crate::model) arguments: &'a [FormalArgument],
    pub(in crate::model) unit: Option<&'a WrittenUnit>,
    pub(in crate::model) points: &'a TablePoints,
    pub(in crate::model) attributes: &'a [Attribute],
}

impl<'a> TableDeclaration<'a> {
    /// Its `smooth` clause, with its place.
    pub(in crate::model) fn smooth(&self) -> Option<(&'a Expr, Span)> {
        self.attributes.iter().find_map(|attribute| match &attribute.kind {
            AttributeKind::Smooth(std) => Some((std, attribute.span)),
            _ => None,
        })
    }

    /// Names in its numbers.
    pub(in crate::model) fn names(&self) -> Vec<&'a str> {
        let mut names = Vec::new();
        let smooth = self.smooth().map(|(std, _)| std);
        for number in self.points.expressions().into_iter().chain(smooth) {
            names_in(number, &mut names);
        }
        names
    }
}

/// All names of a model.
#[derive(Debug, Clone)]
pub(in crate::model) struct ModelScope<'a> {
    pub(in crate::model) names: BTreeMap<&'a str, ScopeEntry>,
    pub(in crate::model) functions: Vec<FunctionDeclaration<'a>>,
    pub(in crate::model) tables: Vec<TableDeclaration<'a>>,
    /// Filled in once settings are known, like the lists below.
    pub(in crate::model) sizes: NamedSizes<'a>,
    pub(in crate::model) arrays: Vec<Result<ArrayPlace<'a>, ErrorReported>>,
    pub(in crate::model) loops: Vec<Result<ArrayShape, ErrorReported>>,
    pub(in crate::model) let_arrays: Vec<LetArray<'a>>,
    /// Arrays of constants, parameters and inputs.
    pub(in crate::model) vectors: Vec<Vector<'a>>,
    /// Constants, parameters and inputs outside arrays; the elements of arrays follow them.
    pub(in crate::model) n_scalars: [u32; 3],
    /// Outputs have a namespace of their own: an output may have the name of its unknown.
    pub(in crate::model) outputs: BTreeMap<&'a str, Span>,
    /// The dimension of time.
    pub(in crate::model) second: Dimension,
    /// How units are spelt in messages.
    pub(in crate::model) spelling: UnitSpelling,
}

impl<'a> ModelScope<'a> {
    /// The dimension of a name declared with a unit.
    pub(in crate::model) fn dimension(&self, name: &str) -> Result<Dimension, ErrorReported> {
        match self.names.get(name).and_then(|entry| entry.unit.as_ref()) {
            Some(Ok(unit)) => Ok(unit.dimension),
            Some(Err(reported)) => Err(*reported),
            None => unreachable!("`{name}` is declared with a unit"),
        }
    }

    /// Whether a symbol is a state, or an element of an array of states.
    pub(in crate::model) fn is_state(&self, symbol: Symbol) -> bool {
        let holds = |array: &Result<ArrayPlace<'_>, ErrorReported>, i: u32| {
            array.as_ref().is_ok_and(|a| (a.first..a.first + a.count()).contains(&i))
        };
        self.names.values().any(|entry| match (entry.definition, symbol) {
            (NameDefinition::Unknown { index, state }, Symbol::Unknown(i)) => state && index == i,
            (NameDefinition::Array { index, state }, Symbol::Element(i)) => {
                state && self.arrays.get(index).is_some_and(|array| holds(array, i))
            }
            _ => false,
        })
    }

    pub(in crate::model) fn function_names(&self) -> impl Iterator<Item = &'a str> + '_ {
        let tables = self.tables.iter().map(|table| table.name.text.as_str());
        self.functions.iter().map(|function| function.name).chain(tables)
    }

    /// Name of a symbol; `None` for a constant because other symbols are named first.
    pub(in crate::model) fn quoted_name(&self, symbol: Symbol) -> Option<String> {
        let element = self.quoted_element(symbol);
        element.or_else(|| self.quoted_scalar(symbol))
    }

    fn quoted_scalar(&self, symbol: Symbol) -> Option<String> {
        self.names.iter().find_map(|(name, entry)| {
            let same = match (entry.definition, symbol) {
                (NameDefinition::Time, Symbol::Time) => true,
                (NameDefinition::Parameter(i), Symbol::Parameter(j))
                | (NameDefinition::Input(i), Symbol::Input(j)) => i == j,
                (
                    NameDefinition::Unknown { index, .. },
                    Symbol::Unknown(j) | Symbol::Derivative(j),
                ) => index == j,
                _ => false,
            };
            same.then(|| format!("`{name}`"))
        })
    }

    /// Checks that an index has a name of its own.
    pub(in crate::model) fn verify_index(&self, index: &Name, diagnostics: &mut Diagnostics) {
        let Some(earlier) = self.names.get(index.text.as_str()) else { return };
        let message =
            format!("the index `{}` has the name of {}", index.text, earlier.definition.noun());
        let diagnostic =
            Diagnostic::new(Code::DuplicateName, index.span, message).about(&index.text);
        let is_built_in = matches!(earlier.definition, NameDefinition::Time | NameDefinition::Pi);
        diagnostics.error(if is_built_in {
            diagnostic.help("choose another name")
        } else {
            diagnostic.label(earlier.span, "declared here").help("choose another name")
        });
    }

    /// Name of an element, in quotes; of one that moves with a loop, the first.
    pub(in crate::model) fn quoted_element(&self, symbol: Symbol) -> Option<String> {
        let of_vector = |kind: ArrayKind, i: u32| {
            let places = self.vectors.iter().filter(|vector| vector.kind == kind);
            places.flat_map(|vector| &vector.place).find_map(|place| place.element(i))
        };
        match symbol {
            Symbol::Element(i)
            | Symbol::Swept(i)
            | Symbol::ElementRate(i)
            | Symbol::SweptRate(i) => {
                self.arrays.iter().flatten().find_map(|place| place.element(i))
            }
            Symbol::Parameter(i) | Symbol::SweptParameter(i, _) => {
                of_vector(ArrayKind::Parameter, i)
            }
            Symbol::Input(i) | Symbol::SweptInput(i, _) => of_vector(ArrayKind::Input, i),
            _ => None,
        }
    }
}
