//! Trees without their places, so that two texts can be compared.

use super::ast::{
    ArrayAxis, Ast, Attribute, AttributeKind, ClauseKind, CrossingCondition, EffectClause,
    EffectHeader, EffectTarget, Expr, ExprKind, FormalArgument, Item, ItemKind, LocalLet,
    LoopCounter, ModelHeader, Name, NumberRange, PartArgument, Reaction, Reduction, ResetClause,
    StartMode, StartRule, TablePoint, TablePoints, TemplateSlot, TransitionClause, VariantChoice,
    WrittenUnit,
};
use crate::source::{SourceId, Span};

/// The tree with every place set to zero.
#[must_use]
pub fn without_places(ast: &Ast) -> Ast {
    let header = |model: &ModelHeader| ModelHeader {
        doc: model.doc.clone(),
        name: placeless_name(&model.name),
    };
    Ast {
        source: SourceId::default(),
        model: ast.model.as_ref().map(header),
        effect: ast.effect.as_ref().map(placeless_effect),
        items: ast.items.iter().map(placeless_item).collect(),
        imports: Vec::new(),
    }
}

fn placeless_effect(effect: &EffectHeader) -> EffectHeader {
    let target = match &effect.target {
        EffectTarget::Model(model) => EffectTarget::Model(placeless_name(model)),
        EffectTarget::Template(slots) => {
            let slot = |slot: &TemplateSlot| TemplateSlot {
                name: placeless_name(&slot.name),
                kind: slot.kind,
                unit: placeless_unit(slot.unit.as_ref()),
            };
            EffectTarget::Template(slots.iter().map(slot).collect())
        }
    };
    EffectHeader {
        doc: effect.doc.clone(),
        name: placeless_name(&effect.name),
        target,
        clauses: effect.clauses.iter().map(placeless_clause).collect(),
    }
}

fn placeless_clause(clause: &EffectClause) -> EffectClause {
    let kind = match &clause.kind {
        ClauseKind::Kind(kind) => ClauseKind::Kind(*kind),
        ClauseKind::Form(form) => ClauseKind::Form(placeless_name(form)),
        ClauseKind::Null { name, value } => {
            ClauseKind::Null { name: placeless_name(name), value: placeless(value) }
        }
        ClauseKind::Replace { name, arguments, equation, by } => ClauseKind::Replace {
            name: placeless_name(name),
            arguments: arguments.iter().map(placeless_name).collect(),
            equation: equation.as_ref().map(placeless_name),
            by: placeless(by),
        },
        ClauseKind::ReplaceOutput { output, by } => {
            ClauseKind::ReplaceOutput { output: placeless_name(output), by: placeless(by) }
        }
        ClauseKind::Add { value, equation } => {
            ClauseKind::Add { value: placeless(value), equation: placeless_name(equation) }
        }
    };
    EffectClause { span: Span::default(), doc: clause.doc.clone(), kind }
}

fn placeless_name(name: &Name) -> Name {
    Name { text: name.text.clone(), span: Span::default() }
}

fn placeless_unit(unit: Option<&WrittenUnit>) -> Option<WrittenUnit> {
    unit.map(|unit| WrittenUnit::new(Span::default(), unit.text.clone()))
}

fn placeless_attribute(attribute: &Attribute) -> Attribute {
    let optional = |expr: &Option<Expr>| expr.as_ref().map(placeless);
    let kind = match &attribute.kind {
        AttributeKind::Bounds(lower, upper) => {
            AttributeKind::Bounds(optional(lower), optional(upper))
        }
        AttributeKind::Nominal(size) => AttributeKind::Nominal(placeless(size)),
        AttributeKind::Prior(law, first, second) => {
            AttributeKind::Prior(*law, placeless(first), placeless(second))
        }
        AttributeKind::Noise(std) => AttributeKind::Noise(placeless(std)),
        AttributeKind::History(value) => AttributeKind::History(placeless(value)),
        AttributeKind::Log => AttributeKind::Log,
        AttributeKind::Fixed => AttributeKind::Fixed,
        AttributeKind::Guess => AttributeKind::Guess,
        AttributeKind::Hold => AttributeKind::Hold,
        AttributeKind::Linear => AttributeKind::Linear,
        AttributeKind::Exact => AttributeKind::Exact,
        AttributeKind::Shape(shape) => AttributeKind::Shape(*shape),
        AttributeKind::Beyond(beyond) => AttributeKind::Beyond(*beyond),
        AttributeKind::Smooth(std) => AttributeKind::Smooth(placeless(std)),
    };
    Attribute { span: Span::default(), kind }
}

fn placeless_item(item: &Item) -> Item {
    let attributes = |all: &[Attribute]| all.iter().map(placeless_attribute).collect();
    let kind = match &item.kind {
        ItemKind::Import { path, .. } => {
            ItemKind::Import { path: path.clone(), path_span: Span::default() }
        }
        ItemKind::Constant { name, unit, value } => ItemKind::Constant {
            name: placeless_name(name),
            unit: placeless_unit(unit.as_ref()),
            value: placeless(value),
        },
        ItemKind::Parameter { name, unit, value, attributes: all } => ItemKind::Parameter {
            name: placeless_name(name),
            unit: placeless_unit(unit.as_ref()),
            value: placeless(value),
            attributes: attributes(all),
        },
        ItemKind::Input { name, unit, attributes: all } => ItemKind::Input {
            name: placeless_name(name),
            unit: placeless_unit(unit.as_ref()),
            attributes: attributes(all),
        },
        ItemKind::Unknown { declared, name, unit, start, attributes: all } => ItemKind::Unknown {
            declared: *declared,
            name: placeless_name(name),
            unit: placeless_unit(unit.as_ref()),
            start: start.as_ref().map(placeless),
            attributes: attributes(all),
        },
        ItemKind::Unit { name, value } => {
            ItemKind::Unit { name: placeless_name(name), value: placeless(value) }
        }
        ItemKind::Size { name, value } => {
            ItemKind::Size { name: placeless_name(name), value: placeless(value) }
        }
        ItemKind::Array { declared, name, axes, unit, start, attributes: all } => ItemKind::Array {
            declared: *declared,
            name: placeless_name(name),
            axes: axes.iter().map(placeless_axis).collect(),
            unit: placeless_unit(unit.as_ref()),
            start: start.as_ref().map(placeless),
            attributes: attributes(all),
        },
        ItemKind::For { counters, items } => ItemKind::For {
            counters: counters.iter().map(placeless_counter).collect(),
            items: items.iter().map(placeless_item).collect(),
        },
        ItemKind::Let { name, unit, value } => ItemKind::Let {
            name: placeless_name(name),
            unit: placeless_unit(unit.as_ref()),
            value: placeless(value),
        },
        ItemKind::Function { name, arguments, lets, body } => ItemKind::Function {
            name: placeless_name(name),
            arguments: placeless_arguments(arguments),
            lets: lets
                .iter()
                .map(|local| LocalLet {
                    name: placeless_name(&local.name),
                    unit: placeless_unit(local.unit.as_ref()),
                    value: placeless(&local.value),
                })
                .collect(),
            body: placeless(body),
        },
        ItemKind::Table { name, arguments, unit, points, attributes: all } => ItemKind::Table {
            name: placeless_name(name),
            arguments: placeless_arguments(arguments),
            unit: placeless_unit(unit.as_ref()),
            points: placeless_points(points),
            attributes: attributes(all),
        },
        ItemKind::Output { name, unit, value, attributes: all } => ItemKind::Output {
            name: placeless_name(name),
            unit: placeless_unit(unit.as_ref()),
            value: value.as_ref().map(placeless),
            attributes: attributes(all),
        },
        ItemKind::Equation { label, left, right, attributes: all } => ItemKind::Equation {
            label: placeless_name(label),
            left: placeless(left),
            right: placeless(right),
            attributes: attributes(all),
        },
        ItemKind::Variant { name, choices } => ItemKind::Variant {
            name: placeless_name(name),
            choices: choices.iter().map(placeless_choice).collect(),
        },
        ItemKind::Modes { name, modes, transitions, starts } => ItemKind::Modes {
            name: placeless_name(name),
            modes: modes.iter().map(placeless_choice).collect(),
            transitions: transitions.iter().map(placeless_transition).collect(),
            starts: starts.iter().map(placeless_start).collect(),
        },
        ItemKind::Part { name, axes, model, arguments } => ItemKind::Part {
            name: placeless_name(name),
            axes: axes.iter().map(placeless_axis).collect(),
            model: placeless_name(model),
            arguments: arguments
                .iter()
                .map(|PartArgument { name, value }| PartArgument {
                    name: placeless_name(name),
                    value: placeless(value),
                })
                .collect(),
        },
        ItemKind::Binding { input, indices, value } => ItemKind::Binding {
            input: placeless_name(input),
            indices: indices.iter().map(placeless).collect(),
            value: placeless(value),
        },
        ItemKind::When(Reaction { conditions, resets }) => ItemKind::When(Reaction {
            conditions: conditions.iter().map(placeless_condition).collect(),
            resets: resets.iter().map(placeless_reset).collect(),
        }),
        ItemKind::Every { period, offset, resets } => ItemKind::Every {
            period: placeless(period),
            offset: offset.as_ref().map(placeless),
            resets: resets.iter().map(placeless_reset).collect(),
        },
        ItemKind::Start(StartRule::Steady) => ItemKind::Start(StartRule::Steady),
        ItemKind::Start(StartRule::Equation { label, left, right }) => {
            ItemKind::Start(StartRule::Equation {
                label: placeless_name(label),
                left: placeless(left),
                right: placeless(right),
            })
        }
        ItemKind::Saturate { name, indices, side, bound } => ItemKind::Saturate {
            name: placeless_name(name),
            indices: indices.iter().map(placeless).collect(),
            side: *side,
            bound: placeless(bound),
        },
    };
    Item { span: Span::default(), doc: item.doc.clone(), kind }
}

fn placeless_arguments(arguments: &[FormalArgument]) -> Vec<FormalArgument> {
    let placeless = |a: &FormalArgument| FormalArgument {
        name: placeless_name(&a.name),
        unit: placeless_unit(a.unit.as_ref()),
    };
    arguments.iter().map(placeless).collect()
}

fn placeless_points(points: &TablePoints) -> TablePoints {
    let placeless_numbers = |numbers: &[Expr]| numbers.iter().map(placeless).collect();
    match points {
        TablePoints::Written(points) => {
            let point = |p: &TablePoint| TablePoint {
                span: Span::default(),
                numbers: placeless_numbers(&p.numbers),
            };
            TablePoints::Written(points.iter().map(point).collect())
        }
        TablePoints::Columns(columns) => {
            TablePoints::Columns([placeless_numbers(&columns[0]), placeless_numbers(&columns[1])])
        }
        TablePoints::File { path, .. } => {
            TablePoints::File { path: path.clone(), path_span: Span::default(), rows: None }
        }
    }
}

fn placeless_axis(axis: &ArrayAxis) -> ArrayAxis {
    let index = axis.index.as_ref().map(placeless_name);
    ArrayAxis { index, range: placeless_range(&axis.range) }
}

fn placeless_range(range: &NumberRange) -> NumberRange {
    let (lower, upper) = (placeless(&range.lower), placeless(&range.upper));
    NumberRange { span: Span::default(), lower, upper }
}

fn placeless_choice(choice: &VariantChoice) -> VariantChoice {
    VariantChoice {
        doc: choice.doc.clone(),
        name: placeless_name(&choice.name),
        items: choice.items.iter().map(placeless_item).collect(),
    }
}

fn placeless_reset(reset: &ResetClause) -> ResetClause {
    ResetClause {
        span: Span::default(),
        name: placeless_name(&reset.name),
        indices: reset.indices.iter().map(placeless).collect(),
        value: placeless(&reset.value),
    }
}

fn placeless_condition(condition: &CrossingCondition) -> CrossingCondition {
    CrossingCondition {
        left: placeless(&condition.left),
        crossing: condition.crossing,
        right: placeless(&condition.right),
    }
}

fn placeless_start(start: &StartMode) -> StartMode {
    StartMode {
        mode: placeless_name(&start.mode),
        condition: start.condition.as_ref().map(placeless),
    }
}

fn placeless_transition(transition: &TransitionClause) -> TransitionClause {
    TransitionClause {
        span: Span::default(),
        doc: transition.doc.clone(),
        from: placeless_name(&transition.from),
        to: placeless_name(&transition.to),
        conditions: transition.conditions.iter().map(placeless_condition).collect(),
        resets: transition.resets.iter().map(placeless_reset).collect(),
    }
}

fn placeless_counter(LoopCounter { index, range }: &LoopCounter) -> LoopCounter {
    LoopCounter { index: placeless_name(index), range: placeless_range(range) }
}

fn placeless(expr: &Expr) -> Expr {
    let boxed = |expr: &Expr| Box::new(placeless(expr));
    let kind = match &expr.kind {
        ExprKind::Number { value, text, unit } => ExprKind::Number {
            value: *value,
            text: text.clone(),
            unit: placeless_unit(unit.as_ref()),
        },
        ExprKind::Name(name) => ExprKind::Name(name.clone()),
        ExprKind::Call { function, arguments } => ExprKind::Call {
            function: placeless_name(function),
            arguments: arguments.iter().map(placeless).collect(),
        },
        ExprKind::Element(array, index) => ExprKind::Element(boxed(array), boxed(index)),
        ExprKind::Reduce(reduction) => {
            let Reduction { kind, word: _, body, counters } = &**reduction;
            ExprKind::Reduce(Box::new(Reduction {
                kind: *kind,
                word: Span::default(),
                body: placeless(body),
                counters: counters.iter().map(placeless_counter).collect(),
            }))
        }
        ExprKind::List(values) => ExprKind::List(values.iter().map(placeless).collect()),
        ExprKind::Group(inner) => ExprKind::Group(boxed(inner)),
        ExprKind::Negate(operand) => ExprKind::Negate(boxed(operand)),
        ExprKind::Sum(terms) => {
            ExprKind::Sum(terms.iter().map(|(sign, term)| (*sign, placeless(term))).collect())
        }
        ExprKind::Product(factors) => ExprKind::Product(
            factors.iter().map(|(sign, factor)| (*sign, placeless(factor))).collect(),
        ),
        ExprKind::Power(base, exponent) => ExprKind::Power(boxed(base), boxed(exponent)),
        ExprKind::If(condition, yes, no) => ExprKind::If(boxed(condition), boxed(yes), boxed(no)),
        ExprKind::Compare(sign, left, right) => ExprKind::Compare(*sign, boxed(left), boxed(right)),
        ExprKind::And(all) => ExprKind::And(all.iter().map(placeless).collect()),
        ExprKind::Or(all) => ExprKind::Or(all.iter().map(placeless).collect()),
        ExprKind::Not(operand) => ExprKind::Not(boxed(operand)),
    };
    Expr { span: Span::default(), kind }
}
