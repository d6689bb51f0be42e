//! Traversals of the parts of a tree, for renaming, replacing and comparing.

use super::ast::{
    Attribute, AttributeKind, CrossingCondition, Expr, ExprKind, FormalArgument, Item, ItemKind,
    LocalLet, LoopCounter, Name, NumberRange, Reaction, Reduction, ResetClause, StartRule,
    TransitionClause, VariantChoice, WrittenUnit,
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
pub enum ExprRole<'a> {
    /// The value of a constant or a parameter, or an attribute.
    Declaration,
    /// The start value of an unknown, a side of a start equation, or the condition of an initial mode.
    Start,
    /// The value of a `let`, or a number of a table.
    Let(&'a Name),
    /// The body of a function, or one of its `let`s, with the function's local names.
    Body(&'a Name, &'a [FormalArgument]),
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
pub enum ItemPart<'a> {
    /// A name that is declared.
    Declares(Namespace, &'a mut Name),
    /// An unknown that a transition resets, or that a saturation bounds.
    Resets(&'a mut Name),
    /// A unit that is declared.
    Unit(&'a mut Option<WrittenUnit>),
    /// An expression.
    Expr(ExprRole<'a>, &'a mut Expr),
}

/// Visits the parts of an item, and of nested items, in the order written.
///
/// The order is the same for two items that differ only in names, units and expressions.
pub fn parts_mut(item: &mut Item, visit: &mut dyn FnMut(ItemPart<'_>)) {
    match &mut item.kind {
        ItemKind::Import { .. } | ItemKind::Start(StartRule::Steady) => {}
        ItemKind::Start(StartRule::Equation { label, left, right }) => {
            visit(ItemPart::Declares(Namespace::Equation, label));
            visit(ItemPart::Expr(ExprRole::Start, left));
            visit(ItemPart::Expr(ExprRole::Start, right));
        }
        ItemKind::Constant { name, unit, value } => {
            declared(name, unit, visit);
            visit(ItemPart::Expr(ExprRole::Declaration, value));
        }
        ItemKind::Parameter { name, unit, value, attributes: all } => {
            declared(name, unit, visit);
            visit(ItemPart::Expr(ExprRole::Declaration, value));
            attributes(all, visit);
        }
        ItemKind::Input { name, unit, attributes: all } => {
            declared(name, unit, visit);
            attributes(all, visit);
        }
        ItemKind::Unknown { name, unit, start, attributes: all, .. } => {
            declared(name, unit, visit);
            if let Some(start) = start {
                visit(ItemPart::Expr(ExprRole::Start, start));
            }
            attributes(all, visit);
        }
        ItemKind::Unit { value, .. } => visit(ItemPart::Expr(ExprRole::Declaration, value)),
        ItemKind::Size { name, value } => {
            visit(ItemPart::Declares(Namespace::Value, name));
            visit(ItemPart::Expr(ExprRole::Declaration, value));
        }
        ItemKind::Array { declared, name, axes, unit, start, attributes: all } => {
            visit(ItemPart::Declares(Namespace::Value, name));
            for axis in axes {
                ends(&mut axis.range, visit);
            }
            visit(ItemPart::Unit(unit));
            if let Some(start) = start {
                let role =
                    if declared.is_unknown() { ExprRole::Start } else { ExprRole::Declaration };
                visit(ItemPart::Expr(role, start));
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
            visit(ItemPart::Expr(ExprRole::Let(name), value));
        }
        ItemKind::Function { name, arguments, lets, body } => {
            visit(ItemPart::Declares(Namespace::Value, name));
            for argument in arguments.iter_mut() {
                visit(ItemPart::Unit(&mut argument.unit));
            }
            let locals = locals(arguments, lets);
            for local in lets {
                visit(ItemPart::Unit(&mut local.unit));
                visit(ItemPart::Expr(ExprRole::Body(name, &locals), &mut local.value));
            }
            visit(ItemPart::Expr(ExprRole::Body(name, &locals), body));
        }
        ItemKind::Table { name, arguments, unit, points, attributes: all } => {
            visit(ItemPart::Declares(Namespace::Value, name));
            for argument in arguments.iter_mut() {
                visit(ItemPart::Unit(&mut argument.unit));
            }
            visit(ItemPart::Unit(unit));
            for number in points.expressions_mut() {
                visit(ItemPart::Expr(ExprRole::Let(name), number));
            }
            attributes(all, visit);
        }
        ItemKind::Output { name, unit, value, attributes: all } => {
            // Its noise reads it by its current name.
            let reader = name.clone();
            visit(ItemPart::Declares(Namespace::Output, name));
            visit(ItemPart::Unit(unit));
            if let Some(value) = value {
                visit(ItemPart::Expr(ExprRole::Output(name), value));
            }
            for attribute in all {
                if let AttributeKind::Noise(size) = &mut attribute.kind {
                    visit(ItemPart::Expr(ExprRole::Noise(&reader), size));
                }
            }
        }
        ItemKind::Equation { label, left, right, attributes: all } => {
            visit(ItemPart::Declares(Namespace::Equation, label));
            visit(ItemPart::Expr(ExprRole::Left(label), left));
            visit(ItemPart::Expr(ExprRole::Right(label), right));
            attributes(all, visit);
        }
        ItemKind::Variant { name, choices } => {
            visit(ItemPart::Declares(Namespace::Variant, name));
            items_of_choices(choices, visit);
        }
        ItemKind::Modes { name, modes, transitions, starts } => {
            visit(ItemPart::Declares(Namespace::Modes, name));
            items_of_choices(modes, visit);
            for TransitionClause { conditions, resets, .. } in transitions {
                reaction(conditions, resets, visit);
            }
            for condition in starts.iter_mut().filter_map(|start| start.condition.as_mut()) {
                visit(ItemPart::Expr(ExprRole::Start, condition));
            }
        }
        ItemKind::Part { name, axes, arguments, .. } => {
            visit(ItemPart::Declares(Namespace::Part, name));
            for axis in axes {
                ends(&mut axis.range, visit);
            }
            for argument in arguments {
                visit(ItemPart::Expr(ExprRole::Declaration, &mut argument.value));
            }
        }
        ItemKind::Binding { input, indices, value } => {
            declarations(indices, visit);
            visit(ItemPart::Expr(ExprRole::Let(input), value));
        }
        ItemKind::When(Reaction { conditions, resets }) => reaction(conditions, resets, visit),
        ItemKind::Every { period, offset, resets } => {
            visit(ItemPart::Expr(ExprRole::Transition, period));
            if let Some(offset) = offset {
                visit(ItemPart::Expr(ExprRole::Transition, offset));
            }
            reaction(&mut [], resets, visit);
        }
        ItemKind::Saturate { name, indices, bound, .. } => {
            visit(ItemPart::Resets(name));
            declarations(indices, visit);
            visit(ItemPart::Expr(ExprRole::Transition, bound));
        }
    }
}

fn declared(name: &mut Name, unit: &mut Option<WrittenUnit>, visit: &mut dyn FnMut(ItemPart<'_>)) {
    visit(ItemPart::Declares(Namespace::Value, name));
    visit(ItemPart::Unit(unit));
}

fn attributes(all: &mut [Attribute], visit: &mut dyn FnMut(ItemPart<'_>)) {
    for attribute in all {
        for expr in attribute_expressions_mut(attribute) {
            visit(ItemPart::Expr(ExprRole::Declaration, expr));
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
fn declarations(all: &mut [Expr], visit: &mut dyn FnMut(ItemPart<'_>)) {
    for expr in all {
        visit(ItemPart::Expr(ExprRole::Declaration, expr));
    }
}

fn ends(range: &mut NumberRange, visit: &mut dyn FnMut(ItemPart<'_>)) {
    visit(ItemPart::Expr(ExprRole::Declaration, &mut range.lower));
    visit(ItemPart::Expr(ExprRole::Declaration, &mut range.upper));
}

fn items_of_choices(choices: &mut [VariantChoice], visit: &mut dyn FnMut(ItemPart<'_>)) {
    for item in choices.iter_mut().flat_map(|choice| &mut choice.items) {
        parts_mut(item, visit);
    }
}

/// The local names of a function: its arguments and its `let`s.
pub fn locals(arguments: &[FormalArgument], lets: &[LocalLet]) -> Vec<FormalArgument> {
    let of_let = |local: &LocalLet| FormalArgument { name: local.name.clone(), unit: None };
    arguments.iter().cloned().chain(lets.iter().map(of_let)).collect()
}

/// The sides of conditions, and their resets.
fn reaction(
    conditions: &mut [CrossingCondition],
    resets: &mut [ResetClause],
    visit: &mut dyn FnMut(ItemPart<'_>),
) {
    for CrossingCondition { left, right, .. } in conditions {
        visit(ItemPart::Expr(ExprRole::Transition, left));
        visit(ItemPart::Expr(ExprRole::Transition, right));
    }
    for reset in resets {
        visit(ItemPart::Resets(&mut reset.name));
        declarations(&mut reset.indices, visit);
        visit(ItemPart::Expr(ExprRole::Transition, &mut reset.value));
    }
}

/// Visits every unit of an item, including those of its numbers.
pub fn units_of_item_mut(item: &mut Item, visit: &mut dyn FnMut(&mut WrittenUnit)) {
    parts_mut(item, &mut |part| match part {
        ItemPart::Declares(..) | ItemPart::Resets(_) => {}
        ItemPart::Unit(unit) => unit.iter_mut().for_each(&mut *visit),
        ItemPart::Expr(_, expr) => units_of_expression_mut(expr, visit),
    });
}

/// Visits the units of an expression's numbers.
pub fn units_of_expression_mut(expr: &mut Expr, visit: &mut dyn FnMut(&mut WrittenUnit)) {
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
            let ends = counters.iter_mut().flat_map(|LoopCounter { range, .. }| {
                let NumberRange { lower, upper, .. } = range;
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
