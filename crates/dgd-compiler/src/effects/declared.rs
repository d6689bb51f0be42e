//! The declarations of a model that effects need, before any name is resolved.

use std::collections::BTreeMap;

use crate::model::Model;
use crate::source::Span;
use crate::syntax::ast::{Ast, ItemKind, Name, SlotKind, UnknownKind, WrittenUnit};
use crate::syntax::visit::{self, Namespace};
use crate::units::Dimension;

/// A name that is declared.
#[derive(Debug, Clone)]
pub(super) struct DeclaredName {
    /// Place of its first declaration.
    pub(super) span: Span,
    /// Its kind, if a template can have a slot of that kind.
    pub(super) kind: Option<SlotKind>,
    /// Its unit.
    pub(super) unit: Option<WrittenUnit>,
}

/// Names, by namespace.
#[derive(Debug, Clone, Default)]
pub(super) struct NameDeclarations {
    names: BTreeMap<(Namespace, String), DeclaredName>,
}

impl NameDeclarations {
    /// Collects the declarations of a model, its libraries and all its variants.
    pub(super) fn collect(asts: &[Ast]) -> NameDeclarations {
        let mut declarations = NameDeclarations::default();
        for ast in asts {
            visit::items(&ast.items, &mut |item| {
                let (namespace, name, unit, kind) = match &item.kind {
                    ItemKind::Import { .. }
                    | ItemKind::For { .. }
                    | ItemKind::Part { .. }
                    | ItemKind::Binding { .. }
                    | ItemKind::When(_)
                    | ItemKind::Every { .. }
                    | ItemKind::Unit { .. }
                    | ItemKind::Start(_)
                    | ItemKind::Saturate { .. } => return,
                    ItemKind::Let { name, unit, .. } => {
                        (Namespace::Value, name, unit.clone(), Some(SlotKind::Let))
                    }
                    ItemKind::Constant { name, unit, .. } | ItemKind::Array { name, unit, .. } => {
                        (Namespace::Value, name, unit.clone(), None)
                    }
                    ItemKind::Function { name, .. }
                    | ItemKind::Table { name, .. }
                    | ItemKind::Size { name, .. } => (Namespace::Value, name, None, None),
                    ItemKind::Parameter { name, unit, .. } => {
                        (Namespace::Value, name, unit.clone(), Some(SlotKind::Parameter))
                    }
                    ItemKind::Input { name, unit, .. } => {
                        (Namespace::Value, name, unit.clone(), Some(SlotKind::Input))
                    }
                    ItemKind::Unknown { declared, name, unit, .. } => {
                        let kind = match declared {
                            UnknownKind::State => SlotKind::State,
                            UnknownKind::Unknown | UnknownKind::Held => SlotKind::Quantity,
                        };
                        (Namespace::Value, name, unit.clone(), Some(kind))
                    }
                    ItemKind::Output { name, unit, .. } => {
                        (Namespace::Output, name, unit.clone(), Some(SlotKind::Output))
                    }
                    ItemKind::Equation { label, .. } => {
                        (Namespace::Equation, label, None, Some(SlotKind::Equation))
                    }
                    ItemKind::Variant { name, .. } => (Namespace::Variant, name, None, None),
                    ItemKind::Modes { name, .. } => (Namespace::Modes, name, None, None),
                };
                let declared = DeclaredName { span: name.span, kind, unit };
                declarations.names.entry((namespace, name.text.clone())).or_insert(declared);
            });
        }
        declarations
    }

    /// Gives each equation the unit of its terms in the model, and a `let` without a unit that of an unknown or of its
    /// rate with the same dimension; otherwise its SI unit in the model's spelling.
    pub(super) fn give_units(&mut self, model: &Model) {
        let second = Dimension::from_exponents([0, 0, 1, 0, 0, 0, 0]);
        let measured = |dimension: Dimension| {
            let units = || model.unknowns.iter().map(|unknown| &unknown.declared.unit);
            let same = units().find(|unit| unit.dimension == dimension);
            let rate = || units().find(|unit| dimension.times(second) == Some(unit.dimension));
            same.map(|unit| unit.symbol.clone())
                .or_else(|| rate().map(|unit| format!("({})/s", unit.symbol)))
        };
        let equations = model
            .all_equations()
            .map(|own| ((Namespace::Equation, own.label.clone()), own.dimension));
        let lets = model.lets.iter();
        let lets = lets.map(|own| ((Namespace::Value, own.name.clone()), own.dimension));
        for (key, dimension) in equations.chain(lets) {
            if let Some(declared) = self.names.get_mut(&key) {
                let text = measured(dimension);
                let text = text.unwrap_or_else(|| model.spelling(dimension));
                declared.unit.get_or_insert(WrittenUnit::new(declared.span, text));
            }
        }
    }

    /// The declaration of a name.
    pub(super) fn get(&self, namespace: Namespace, name: &str) -> Option<&DeclaredName> {
        self.names.get(&(namespace, name.to_owned()))
    }

    /// Adds a name; `Err` is the place of its earlier declaration.
    pub(super) fn insert(&mut self, namespace: Namespace, name: &Name) -> Result<(), Span> {
        let key = (namespace, name.text.clone());
        if let Some(earlier) = self.names.get(&key) {
            return Err(earlier.span);
        }
        self.names.insert(key, DeclaredName { span: name.span, kind: None, unit: None });
        Ok(())
    }

    /// All names of a namespace.
    pub(super) fn names_in(&self, namespace: Namespace) -> impl Iterator<Item = &str> {
        let keys = self.names.keys().filter(move |(of, _)| *of == namespace);
        keys.map(|(_, name)| name.as_str())
    }

    /// The unit of a quantity; an output without one has that of its unknown.
    pub(super) fn unit(&self, namespace: Namespace, name: &str) -> Option<&WrittenUnit> {
        let unit = self.get(namespace, name)?.unit.as_ref();
        unit.or_else(|| match namespace {
            Namespace::Output => self.get(Namespace::Value, name)?.unit.as_ref(),
            Namespace::Value
            | Namespace::Equation
            | Namespace::Variant
            | Namespace::Modes
            | Namespace::Part => None,
        })
    }
}

/// The namespace of a template's argument.
pub(super) fn namespace_of(kind: SlotKind) -> Namespace {
    match kind {
        SlotKind::Output => Namespace::Output,
        SlotKind::Equation => Namespace::Equation,
        SlotKind::Input
        | SlotKind::State
        | SlotKind::Parameter
        | SlotKind::Quantity
        | SlotKind::Let => Namespace::Value,
    }
}

/// The noun for a kind of argument in messages.
pub(super) fn noun(kind: SlotKind) -> &'static str {
    match kind {
        SlotKind::Input => "an input",
        SlotKind::Output => "an output",
        SlotKind::State => "a state",
        SlotKind::Equation => "an equation",
        SlotKind::Parameter => "a parameter",
        SlotKind::Quantity => "an input, a state or an unknown",
        SlotKind::Let => "a `let`",
    }
}
