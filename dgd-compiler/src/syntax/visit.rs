//! Walking over what a tree consists of, written once for all who rename, replace or compare.

use super::ast::{Argument, AttributeKind, Expr, ExprKind, Item, ItemKind, Name, Reaction, Unit};

/// Names of one set differ from each other; those of two sets need not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Namespace {
    /// What expressions can read or call.
    Value,
    /// Outputs.
    Output,
    /// Labels of equations.
    Equation,
    /// Variants.
    Variant,
    /// `modes` blocks.
    Modes,
    /// Parts.
    Part,
}

/// Where an expression stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place<'a> {
    /// The value of a constant or a parameter, or an attribute.
    Declaration,
    /// The start value of an unknown, or the condition of a mode to start in.
    Start,
    /// The value of a `let`.
    Let(&'a Name),
    /// The body of a function with these arguments.
    Body(&'a Name, &'a [Argument]),
    /// What an output reads.
    Output(&'a Name),
    /// The left side of an equation.
    Left(&'a Name),
    /// The right side of an equation.
    Right(&'a Name),
    /// The condition of a transition, the value of a reset, or the bound of a saturation.
    Transition,
}

/// A part of an item.
#[derive(Debug)]
pub enum Part<'a> {
    /// A name that is declared.
    Declares(Namespace, &'a mut Name),
    /// An unknown that a transition resets, or that a saturation bounds.
    Resets(&'a mut Name),
    /// A unit that is declared.
    Unit(&'a mut Option<Unit>),
    /// An expression.
    Expr(Place<'a>, &'a mut Expr),
}

/// Visits the parts of an item, and of the items within it, in the order written.
///
/// The parts of two items that differ in names, units and expressions only are met in one order.
pub fn parts_mut(item: &mut Item, visit: &mut dyn FnMut(Part<'_>)) {
    let attribute = |kind: &mut AttributeKind, visit: &mut dyn FnMut(Part<'_>)| {
        let expressions: Vec<&mut Expr> = match kind {
            AttributeKind::Bounds(lower, upper) => lower.iter_mut().chain(upper).collect(),
            AttributeKind::Nominal(size)
            | AttributeKind::Noise(size)
            | AttributeKind::History(size) => vec![size],
            AttributeKind::PriorNormal(mean, std) => vec![mean, std],
            AttributeKind::Log
            | AttributeKind::Fixed
            | AttributeKind::Hold
            | AttributeKind::Linear => Vec::new(),
        };
        for expr in expressions {
            visit(Part::Expr(Place::Declaration, expr));
        }
    };
    match &mut item.kind {
        ItemKind::Import { .. } => {}
        ItemKind::Constant { name, unit, value } => {
            visit(Part::Declares(Namespace::Value, name));
            visit(Part::Unit(unit));
            visit(Part::Expr(Place::Declaration, value));
        }
        ItemKind::Parameter { name, unit, value, attributes } => {
            visit(Part::Declares(Namespace::Value, name));
            visit(Part::Unit(unit));
            visit(Part::Expr(Place::Declaration, value));
            for a in attributes {
                attribute(&mut a.kind, visit);
            }
        }
        ItemKind::Input { name, unit, attributes } => {
            visit(Part::Declares(Namespace::Value, name));
            visit(Part::Unit(unit));
            for a in attributes {
                attribute(&mut a.kind, visit);
            }
        }
        ItemKind::Unknown { name, unit, start, attributes, .. } => {
            visit(Part::Declares(Namespace::Value, name));
            visit(Part::Unit(unit));
            if let Some(start) = start {
                visit(Part::Expr(Place::Start, start));
            }
            for a in attributes {
                attribute(&mut a.kind, visit);
            }
        }
        ItemKind::Size { name, value } => {
            visit(Part::Declares(Namespace::Value, name));
            visit(Part::Expr(Place::Declaration, value));
        }
        ItemKind::Array { name, range, unit, start, attributes, .. } => {
            visit(Part::Declares(Namespace::Value, name));
            visit(Part::Expr(Place::Declaration, &mut range.lower));
            visit(Part::Expr(Place::Declaration, &mut range.upper));
            visit(Part::Unit(unit));
            if let Some(start) = start {
                visit(Part::Expr(Place::Start, start));
            }
            for a in attributes {
                attribute(&mut a.kind, visit);
            }
        }
        ItemKind::For { range, items, .. } => {
            visit(Part::Expr(Place::Declaration, &mut range.lower));
            visit(Part::Expr(Place::Declaration, &mut range.upper));
            for item in items {
                parts_mut(item, visit);
            }
        }
        ItemKind::Let { name, unit, value } => {
            visit(Part::Declares(Namespace::Value, name));
            visit(Part::Unit(unit));
            visit(Part::Expr(Place::Let(name), value));
        }
        ItemKind::Function { name, arguments, body } => {
            visit(Part::Declares(Namespace::Value, name));
            for argument in arguments.iter_mut() {
                visit(Part::Unit(&mut argument.unit));
            }
            visit(Part::Expr(Place::Body(name, arguments), body));
        }
        ItemKind::Output { name, unit, value, attributes } => {
            visit(Part::Declares(Namespace::Output, name));
            visit(Part::Unit(unit));
            if let Some(value) = value {
                visit(Part::Expr(Place::Output(name), value));
            }
            for a in attributes {
                attribute(&mut a.kind, visit);
            }
        }
        ItemKind::Equation { label, left, right } => {
            visit(Part::Declares(Namespace::Equation, label));
            visit(Part::Expr(Place::Left(label), left));
            visit(Part::Expr(Place::Right(label), right));
        }
        ItemKind::Variant { name, choices } => {
            visit(Part::Declares(Namespace::Variant, name));
            for item in choices.iter_mut().flat_map(|choice| &mut choice.items) {
                parts_mut(item, visit);
            }
        }
        ItemKind::Modes { name, modes, transitions, starts } => {
            visit(Part::Declares(Namespace::Modes, name));
            for item in modes.iter_mut().flat_map(|mode| &mut mode.items) {
                parts_mut(item, visit);
            }
            for transition in transitions {
                visit(Part::Expr(Place::Transition, &mut transition.left));
                visit(Part::Expr(Place::Transition, &mut transition.right));
                for reset in &mut transition.resets {
                    visit(Part::Resets(&mut reset.name));
                    visit(Part::Expr(Place::Transition, &mut reset.value));
                }
            }
            for condition in starts.iter_mut().filter_map(|start| start.condition.as_mut()) {
                visit(Part::Expr(Place::Start, condition));
            }
        }
        ItemKind::Part { name, arguments, .. } => {
            visit(Part::Declares(Namespace::Part, name));
            for argument in arguments {
                visit(Part::Expr(Place::Declaration, &mut argument.value));
            }
        }
        ItemKind::Binding { input, value } => visit(Part::Expr(Place::Let(input), value)),
        ItemKind::When(Reaction { left, right, resets, .. }) => {
            visit(Part::Expr(Place::Transition, left));
            visit(Part::Expr(Place::Transition, right));
            for reset in resets {
                visit(Part::Resets(&mut reset.name));
                visit(Part::Expr(Place::Transition, &mut reset.value));
            }
        }
        ItemKind::Saturate { name, bound, .. } => {
            visit(Part::Resets(name));
            visit(Part::Expr(Place::Transition, bound));
        }
    }
}

/// Visits the items and those within them, each before what it holds.
pub fn items_mut(items: &mut [Item], visit: &mut dyn FnMut(&mut Item)) {
    for item in items {
        visit(item);
        if let ItemKind::Variant { choices, .. } | ItemKind::Modes { modes: choices, .. } =
            &mut item.kind
        {
            for choice in choices {
                items_mut(&mut choice.items, visit);
            }
        }
        if let ItemKind::For { items, .. } = &mut item.kind {
            items_mut(items, visit);
        }
    }
}

/// Visits the items and those within them, each before what it holds.
pub fn items<'a>(all: &'a [Item], visit: &mut dyn FnMut(&'a Item)) {
    for item in all {
        visit(item);
        if let ItemKind::Variant { choices, .. } | ItemKind::Modes { modes: choices, .. } =
            &item.kind
        {
            for choice in choices {
                items(&choice.items, visit);
            }
        }
        if let ItemKind::For { items: held, .. } = &item.kind {
            items(held, visit);
        }
    }
}

/// The operands of an expression.
pub fn operands(expr: &Expr) -> Vec<&Expr> {
    match &expr.kind {
        ExprKind::Number { .. } | ExprKind::Name(_) => Vec::new(),
        ExprKind::Call { arguments: all, .. } | ExprKind::And(all) | ExprKind::Or(all) => {
            all.iter().collect()
        }
        ExprKind::Group(a) | ExprKind::Negate(a) | ExprKind::Not(a) => vec![a],
        ExprKind::Sum(terms) => terms.iter().map(|(_, term)| term).collect(),
        ExprKind::Product(factors) => factors.iter().map(|(_, factor)| factor).collect(),
        ExprKind::Element(a, b) | ExprKind::Power(a, b) | ExprKind::Compare(_, a, b) => vec![a, b],
        ExprKind::If(a, b, c) => vec![a, b, c],
    }
}

/// The operands of an expression, to be changed.
pub fn operands_mut(expr: &mut Expr) -> Vec<&mut Expr> {
    match &mut expr.kind {
        ExprKind::Number { .. } | ExprKind::Name(_) => Vec::new(),
        ExprKind::Call { arguments: all, .. } | ExprKind::And(all) | ExprKind::Or(all) => {
            all.iter_mut().collect()
        }
        ExprKind::Group(a) | ExprKind::Negate(a) | ExprKind::Not(a) => vec![a],
        ExprKind::Sum(terms) => terms.iter_mut().map(|(_, term)| term).collect(),
        ExprKind::Product(factors) => factors.iter_mut().map(|(_, factor)| factor).collect(),
        ExprKind::Element(a, b) | ExprKind::Power(a, b) | ExprKind::Compare(_, a, b) => vec![a, b],
        ExprKind::If(a, b, c) => vec![a, b, c],
    }
}
