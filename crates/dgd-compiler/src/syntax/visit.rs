//! Traversals of the parts of a tree, for renaming, replacing and comparing.

use super::ast::{
    Argument, Attribute, AttributeKind, Choice, Condition, Counter, Expr, ExprKind, Item, ItemKind,
    LocalLet, Name, Range, Reaction, Reduction, Reset, StartRule, Transition, Unit,
};

/// Names of one namespace differ from each other; those of two need not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Namespace {
    /// Names that expressions can read or call.
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

/// The role of an expression in its item.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Role<'a> {
    /// The value of a constant or a parameter, or an attribute.
    Declaration,
    /// The start value of an unknown, a side of a start equation, or the condition of an initial mode.
    Start,
    /// The value of a `let`, or a number of a table.
    Let(&'a Name),
    /// The body of a function, or one of its `let`s, with the function's local names.
    Body(&'a Name, &'a [Argument]),
    /// The value of an output.
    Output(&'a Name),
    /// The noise of an output, which it may read by its own name.
    Noise(&'a Name),
    /// The left side of an equation.
    Left(&'a Name),
    /// The right side of an equation.
    Right(&'a Name),
    /// The condition of a transition, a period, the value of a reset, or the bound of a saturation.
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
    Expr(Role<'a>, &'a mut Expr),
}

/// Visits the parts of an item, and of nested items, in the order written.
///
/// The order is the same for two items that differ only in names, units and expressions.
pub fn parts_mut(item: &mut Item, visit: &mut dyn FnMut(Part<'_>)) {
    match &mut item.kind {
        ItemKind::Import { .. } | ItemKind::Start(StartRule::Steady) => {}
        ItemKind::Start(StartRule::Equation { label, left, right }) => {
            visit(Part::Declares(Namespace::Equation, label));
            visit(Part::Expr(Role::Start, left));
            visit(Part::Expr(Role::Start, right));
        }
        ItemKind::Constant { name, unit, value } => {
            declared(name, unit, visit);
            visit(Part::Expr(Role::Declaration, value));
        }
        ItemKind::Parameter { name, unit, value, attributes: all } => {
            declared(name, unit, visit);
            visit(Part::Expr(Role::Declaration, value));
            attributes(all, visit);
        }
        ItemKind::Input { name, unit, attributes: all } => {
            declared(name, unit, visit);
            attributes(all, visit);
        }
        ItemKind::Unknown { name, unit, start, attributes: all, .. } => {
            declared(name, unit, visit);
            if let Some(start) = start {
                visit(Part::Expr(Role::Start, start));
            }
            attributes(all, visit);
        }
        ItemKind::Unit { value, .. } => visit(Part::Expr(Role::Declaration, value)),
        ItemKind::Size { name, value } => {
            visit(Part::Declares(Namespace::Value, name));
            visit(Part::Expr(Role::Declaration, value));
        }
        ItemKind::Array { declared, name, axes, unit, start, attributes: all } => {
            visit(Part::Declares(Namespace::Value, name));
            for axis in axes {
                ends(&mut axis.range, visit);
            }
            visit(Part::Unit(unit));
            if let Some(start) = start {
                let role = if declared.is_unknown() { Role::Start } else { Role::Declaration };
                visit(Part::Expr(role, start));
            }
            attributes(all, visit);
        }
        ItemKind::For { counters, items } => {
            for counter in counters {
                ends(&mut counter.range, visit);
            }
            for item in items {
                parts_mut(item, visit);
            }
        }
        ItemKind::Let { name, unit, value } => {
            declared(name, unit, visit);
            visit(Part::Expr(Role::Let(name), value));
        }
        ItemKind::Function { name, arguments, lets, body } => {
            visit(Part::Declares(Namespace::Value, name));
            for argument in arguments.iter_mut() {
                visit(Part::Unit(&mut argument.unit));
            }
            let locals = locals(arguments, lets);
            for local in lets {
                visit(Part::Unit(&mut local.unit));
                visit(Part::Expr(Role::Body(name, &locals), &mut local.value));
            }
            visit(Part::Expr(Role::Body(name, &locals), body));
        }
        ItemKind::Table { name, arguments, unit, points, attributes: all } => {
            visit(Part::Declares(Namespace::Value, name));
            for argument in arguments.iter_mut() {
                visit(Part::Unit(&mut argument.unit));
            }
            visit(Part::Unit(unit));
            for number in points.expressions_mut() {
                visit(Part::Expr(Role::Let(name), number));
            }
            attributes(all, visit);
        }
        ItemKind::Output { name, unit, value, attributes: all } => {
            // Its noise reads it by its current name.
            let reader = name.clone();
            visit(Part::Declares(Namespace::Output, name));
            visit(Part::Unit(unit));
            if let Some(value) = value {
                visit(Part::Expr(Role::Output(name), value));
            }
            for attribute in all {
                if let AttributeKind::Noise(size) = &mut attribute.kind {
                    visit(Part::Expr(Role::Noise(&reader), size));
                }
            }
        }
        ItemKind::Equation { label, left, right, attributes: all } => {
            visit(Part::Declares(Namespace::Equation, label));
            visit(Part::Expr(Role::Left(label), left));
            visit(Part::Expr(Role::Right(label), right));
            attributes(all, visit);
        }
        ItemKind::Variant { name, choices } => {
            visit(Part::Declares(Namespace::Variant, name));
            items_of_choices(choices, visit);
        }
        ItemKind::Modes { name, modes, transitions, starts } => {
            visit(Part::Declares(Namespace::Modes, name));
            items_of_choices(modes, visit);
            for Transition { conditions, resets, .. } in transitions {
                reaction(conditions, resets, visit);
            }
            for condition in starts.iter_mut().filter_map(|start| start.condition.as_mut()) {
                visit(Part::Expr(Role::Start, condition));
            }
        }
        ItemKind::Part { name, axes, arguments, .. } => {
            visit(Part::Declares(Namespace::Part, name));
            for axis in axes {
                ends(&mut axis.range, visit);
            }
            for argument in arguments {
                visit(Part::Expr(Role::Declaration, &mut argument.value));
            }
        }
        ItemKind::Binding { input, indices, value } => {
            declarations(indices, visit);
            visit(Part::Expr(Role::Let(input), value));
        }
        ItemKind::When(Reaction { conditions, resets }) => reaction(conditions, resets, visit),
        ItemKind::Every { period, offset, resets } => {
            visit(Part::Expr(Role::Transition, period));
            if let Some(offset) = offset {
                visit(Part::Expr(Role::Transition, offset));
            }
            reaction(&mut [], resets, visit);
        }
        ItemKind::Saturate { name, indices, bound, .. } => {
            visit(Part::Resets(name));
            declarations(indices, visit);
            visit(Part::Expr(Role::Transition, bound));
        }
    }
}

fn declared(name: &mut Name, unit: &mut Option<Unit>, visit: &mut dyn FnMut(Part<'_>)) {
    visit(Part::Declares(Namespace::Value, name));
    visit(Part::Unit(unit));
}

fn attributes(all: &mut [Attribute], visit: &mut dyn FnMut(Part<'_>)) {
    for attribute in all {
        for expr in attribute_expressions_mut(attribute) {
            visit(Part::Expr(Role::Declaration, expr));
        }
    }
}

/// The expressions of an attribute.
pub fn attribute_expressions(attribute: &Attribute) -> Vec<&Expr> {
    match &attribute.kind {
        AttributeKind::Bounds(lower, upper) => lower.iter().chain(upper).collect(),
        AttributeKind::Nominal(size)
        | AttributeKind::Noise(size)
        | AttributeKind::History(size)
        | AttributeKind::Smooth(size) => vec![size],
        AttributeKind::Prior(_, mean, std) => vec![mean, std],
        AttributeKind::Log
        | AttributeKind::Fixed
        | AttributeKind::Guess
        | AttributeKind::Hold
        | AttributeKind::Linear
        | AttributeKind::Exact
        | AttributeKind::Shape(_)
        | AttributeKind::Beyond(_) => Vec::new(),
    }
}

/// The expressions of an attribute, mutable.
pub fn attribute_expressions_mut(attribute: &mut Attribute) -> Vec<&mut Expr> {
    match &mut attribute.kind {
        AttributeKind::Bounds(lower, upper) => lower.iter_mut().chain(upper).collect(),
        AttributeKind::Nominal(size)
        | AttributeKind::Noise(size)
        | AttributeKind::History(size)
        | AttributeKind::Smooth(size) => vec![size],
        AttributeKind::Prior(_, mean, std) => vec![mean, std],
        AttributeKind::Log
        | AttributeKind::Fixed
        | AttributeKind::Guess
        | AttributeKind::Hold
        | AttributeKind::Linear
        | AttributeKind::Exact
        | AttributeKind::Shape(_)
        | AttributeKind::Beyond(_) => Vec::new(),
    }
}

/// Index expressions, which are constant.
fn declarations(all: &mut [Expr], visit: &mut dyn FnMut(Part<'_>)) {
    for expr in all {
        visit(Part::Expr(Role::Declaration, expr));
    }
}

fn ends(range: &mut Range, visit: &mut dyn FnMut(Part<'_>)) {
    visit(Part::Expr(Role::Declaration, &mut range.lower));
    visit(Part::Expr(Role::Declaration, &mut range.upper));
}

fn items_of_choices(choices: &mut [Choice], visit: &mut dyn FnMut(Part<'_>)) {
    for item in choices.iter_mut().flat_map(|choice| &mut choice.items) {
        parts_mut(item, visit);
    }
}

/// The local names of a function: its arguments and its `let`s.
pub fn locals(arguments: &[Argument], lets: &[LocalLet]) -> Vec<Argument> {
    let of_let = |local: &LocalLet| Argument { name: local.name.clone(), unit: None };
    arguments.iter().cloned().chain(lets.iter().map(of_let)).collect()
}

/// The sides of conditions, and their resets.
fn reaction(conditions: &mut [Condition], resets: &mut [Reset], visit: &mut dyn FnMut(Part<'_>)) {
    for Condition { left, right, .. } in conditions {
        visit(Part::Expr(Role::Transition, left));
        visit(Part::Expr(Role::Transition, right));
    }
    for reset in resets {
        visit(Part::Resets(&mut reset.name));
        declarations(&mut reset.indices, visit);
        visit(Part::Expr(Role::Transition, &mut reset.value));
    }
}

/// Visits every unit of an item, including those of its numbers.
pub fn units_of_item_mut(item: &mut Item, visit: &mut dyn FnMut(&mut Unit)) {
    parts_mut(item, &mut |part| match part {
        Part::Declares(..) | Part::Resets(_) => {}
        Part::Unit(unit) => unit.iter_mut().for_each(&mut *visit),
        Part::Expr(_, expr) => units_of_expression_mut(expr, visit),
    });
}

/// Visits the units of an expression's numbers.
pub fn units_of_expression_mut(expr: &mut Expr, visit: &mut dyn FnMut(&mut Unit)) {
    if let ExprKind::Number { unit: Some(unit), .. } = &mut expr.kind {
        visit(unit);
    }
    for operand in operands_mut(expr) {
        units_of_expression_mut(operand, visit);
    }
}

/// Visits items and nested items, each before its content.
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

/// Visits items and nested items, each before its content.
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
        ExprKind::Call { arguments: all, .. }
        | ExprKind::And(all)
        | ExprKind::Or(all)
        | ExprKind::List(all) => all.iter().collect(),
        ExprKind::Reduce(reduction) => {
            let ranges = reduction.counters.iter().map(|counter| &counter.range);
            let ends = ranges.flat_map(|range| [&range.lower, &range.upper]);
            std::iter::once(&reduction.body).chain(ends).collect()
        }
        ExprKind::Group(a) | ExprKind::Negate(a) | ExprKind::Not(a) => vec![a],
        ExprKind::Sum(terms) => terms.iter().map(|(_, term)| term).collect(),
        ExprKind::Product(factors) => factors.iter().map(|(_, factor)| factor).collect(),
        ExprKind::Element(a, b) | ExprKind::Power(a, b) | ExprKind::Compare(_, a, b) => vec![a, b],
        ExprKind::If(a, b, c) => vec![a, b, c],
    }
}

/// The operands of an expression, mutable.
pub fn operands_mut(expr: &mut Expr) -> Vec<&mut Expr> {
    match &mut expr.kind {
        ExprKind::Number { .. } | ExprKind::Name(_) => Vec::new(),
        ExprKind::Call { arguments: all, .. }
        | ExprKind::And(all)
        | ExprKind::Or(all)
        | ExprKind::List(all) => all.iter_mut().collect(),
        ExprKind::Reduce(reduction) => {
            let Reduction { body, counters, .. } = &mut **reduction;
            let ends = counters.iter_mut().flat_map(|Counter { range, .. }| {
                let Range { lower, upper, .. } = range;
                [lower, upper]
            });
            std::iter::once(body).chain(ends).collect()
        }
        ExprKind::Group(a) | ExprKind::Negate(a) | ExprKind::Not(a) => vec![a],
        ExprKind::Sum(terms) => terms.iter_mut().map(|(_, term)| term).collect(),
        ExprKind::Product(factors) => factors.iter_mut().map(|(_, factor)| factor).collect(),
        ExprKind::Element(a, b) | ExprKind::Power(a, b) | ExprKind::Compare(_, a, b) => vec![a, b],
        ExprKind::If(a, b, c) => vec![a, b, c],
    }
}
