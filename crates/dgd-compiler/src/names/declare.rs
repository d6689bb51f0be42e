//! Collects the names that the items of a file declare. Declarations of one name in several choices of a variant are
//! one symbol.

use std::collections::BTreeMap;

use super::{FileScope, NameTable, NameUse, SymbolId, SymbolKind};
use crate::syntax::ast::{
    ArrayKind, Ast, EffectTarget, Item, ItemKind, Name, StartRule, UnknownKind, VariantChoice,
};

/// The namespace of a scope that a name belongs to.
type NameSet = fn(&mut FileScope) -> &mut BTreeMap<String, SymbolId>;

impl NameTable {
    /// Collects the declarations of a file.
    pub(super) fn declare(&mut self, ast: &Ast) {
        let mut scope = FileScope::default();
        if let Some(header) = &ast.model {
            let name = &header.name;
            scope.model = Some(self.add(&name.text, SymbolKind::Model, name.span));
        }
        if let Some(header) = &ast.effect {
            self.add(&header.name.text, SymbolKind::Effect, header.name.span);
            if let EffectTarget::Template(slots) = &header.target {
                for slot in slots {
                    self.declare_in(&mut scope, |s| &mut s.slots, &slot.name, SymbolKind::Argument);
                }
            }
        }
        self.declare_items(&ast.items, &mut scope);
        // The name of an output without a value is also the name that it reads.
        self.declare_outputs(&ast.items, &mut scope);
        self.scopes.insert(ast.source, scope);
    }

    fn declare_items(&mut self, items: &[Item], scope: &mut FileScope) {
        for item in items {
            let (name, kind) = match &item.kind {
                ItemKind::Constant { name, .. } => (name, SymbolKind::Constant),
                ItemKind::Parameter { name, .. } => (name, SymbolKind::Parameter),
                ItemKind::Input { name, .. } => (name, SymbolKind::Input),
                ItemKind::Unknown { declared, name, .. } => match declared {
                    UnknownKind::State => (name, SymbolKind::State),
                    UnknownKind::Unknown | UnknownKind::Held => (name, SymbolKind::Unknown),
                },
                ItemKind::Array { declared, name, .. } => match declared {
                    ArrayKind::Constant => (name, SymbolKind::Constant),
                    ArrayKind::Parameter => (name, SymbolKind::Parameter),
                    ArrayKind::Input => (name, SymbolKind::Input),
                    ArrayKind::State => (name, SymbolKind::State),
                    ArrayKind::Unknown | ArrayKind::Held => (name, SymbolKind::Unknown),
                },
                ItemKind::Size { name, .. } => (name, SymbolKind::Size),
                ItemKind::Let { name, .. } => (name, SymbolKind::Let),
                ItemKind::Function { name, .. } | ItemKind::Table { name, .. } => {
                    (name, SymbolKind::Function)
                }
                ItemKind::Equation { label, .. }
                | ItemKind::Start(StartRule::Equation { label, .. }) => {
                    self.declare_in(scope, |s| &mut s.equations, label, SymbolKind::Equation);
                    continue;
                }
                ItemKind::Variant { name, choices } => {
                    self.declare_in(scope, |s| &mut s.variants, name, SymbolKind::Variant);
                    self.declare_choices(name, choices, SymbolKind::Choice, scope);
                    continue;
                }
                ItemKind::Modes { name, modes, .. } => {
                    self.declare_in(scope, |s| &mut s.modes, name, SymbolKind::Modes);
                    self.declare_choices(name, modes, SymbolKind::Mode, scope);
                    continue;
                }
                ItemKind::Part { name, model, .. } => {
                    self.declare_part(scope, name, model);
                    continue;
                }
                ItemKind::For { items, .. } => {
                    self.declare_items(items, scope);
                    continue;
                }
                ItemKind::Import { .. }
                | ItemKind::Output { .. }
                | ItemKind::Binding { .. }
                | ItemKind::When(_)
                | ItemKind::Every { .. }
                | ItemKind::Unit { .. }
                | ItemKind::Start(StartRule::Steady)
                | ItemKind::Saturate { .. } => continue,
            };
            self.declare_in(scope, |s| &mut s.values, name, kind);
        }
    }

    fn declare_outputs(&mut self, items: &[Item], scope: &mut FileScope) {
        for item in items {
            match &item.kind {
                ItemKind::Output { name, value: Some(_), .. } => {
                    self.declare_in(scope, |s| &mut s.outputs, name, SymbolKind::Output);
                }
                ItemKind::Variant { choices, .. } => {
                    for choice in choices {
                        self.declare_outputs(&choice.items, scope);
                    }
                }
                _ => {}
            }
        }
    }

    fn declare_choices(
        &mut self,
        of: &Name,
        choices: &[VariantChoice],
        kind: SymbolKind,
        scope: &mut FileScope,
    ) {
        for VariantChoice { name, items, .. } in choices {
            let key = (of.text.clone(), name.text.clone());
            if let Some(&symbol) = scope.choices.get(&key) {
                self.again(symbol, name);
            } else {
                let symbol = self.add(&name.text, kind, name.span);
                scope.choices.insert(key, symbol);
            }
            self.declare_items(items, scope);
        }
    }

    fn declare_part(&mut self, scope: &mut FileScope, name: &Name, model: &Name) {
        if let Some(&(symbol, _)) = scope.parts.get(&name.text) {
            self.again(symbol, name);
        } else {
            let symbol = self.add(&name.text, SymbolKind::Part, name.span);
            scope.parts.insert(name.text.clone(), (symbol, model.text.clone()));
        }
    }

    fn declare_in(&mut self, scope: &mut FileScope, set: NameSet, name: &Name, kind: SymbolKind) {
        if let Some(&symbol) = set(scope).get(&name.text) {
            self.again(symbol, name);
        } else {
            let symbol = self.add(&name.text, kind, name.span);
            set(scope).insert(name.text.clone(), symbol);
        }
    }

    /// Adds another declaration of a symbol.
    fn again(&mut self, symbol: SymbolId, name: &Name) {
        self.uses.push(NameUse { span: name.span, symbol, declares: true });
    }
}
