//! From [`Ast`] back to text.
//!
//! The text is plain and complete; [`super::layout`] aligns it. Printing a parsed tree and parsing the text gives the
//! same tree, apart from places. Trees from other sources get the parentheses they need.

use std::fmt::Write as _;

use super::ast::{
    ArrayAxis, Ast, Attribute, AttributeKind, BoundSide, ClauseKind, Comparison, CrossingCondition,
    EffectClause, EffectHeader, EffectTarget, Expr, ExprKind, FactorSide, FormalArgument, Item,
    ItemKind, LocalLet, LoopCounter, Name, NumberRange, PartArgument, Reaction, Reduction,
    ResetClause, Sign, SlotKind, StartMode, StartRule, TablePoints, TemplateSlot, TransitionClause,
    VariantChoice, WrittenUnit,
};
use super::parse::lexical::RESERVED;

/// The text of a file.
pub fn print(ast: &Ast) -> String {
    let mut printer = Printer { out: String::new(), depth: 0 };
    if let Some(model) = &ast.model {
        printer.doc(&model.doc);
        printer.line(&format!("model {}", model.name.text));
    }
    if let Some(effect) = &ast.effect {
        printer.effect(effect, &ast.items);
    } else {
        printer.items(&ast.items);
    }
    printer.out
}

/// The text of an item, without layout.
pub fn print_item(item: &Item) -> String {
    let mut printer = Printer { out: String::new(), depth: 0 };
    printer.items(std::slice::from_ref(item));
    printer.out
}

/// The text of an expression.
pub fn print_expression(expr: &Expr) -> String {
    let mut out = String::new();
    expression(&mut out, expr, PrintPrecedence::Or, TrailingPosition::Last);
    out
}

/// The text of an `every` up to its resets.
pub fn print_every(period: &Expr, offset: Option<&Expr>) -> String {
    let period = print_expression(period);
    let offset = offset.map(|offset| format!(" offset {}", print_expression(offset)));
    format!("every {period}{}", offset.unwrap_or_default())
}

/// Adds the parentheses needed to read a tree's text back as the same tree. A sum that begins with a sum needs none and
/// is merged with it, and so is a product.
pub fn parenthesise(expr: &mut Expr) {
    parenthesise_at(expr, PrintPrecedence::Or, TrailingPosition::Last);
}

/// Adds the parentheses that [`expression`] would write.
fn parenthesise_at(expr: &mut Expr, least: PrintPrecedence, position: TrailingPosition) {
    let reaches_on = matches!(expr.kind, ExprKind::If(..)) && position == TrailingPosition::Inner;
    if binding(&expr.kind) < least || reaches_on {
        parenthesise(expr);
        let inner = Expr { span: expr.span, kind: ExprKind::Name(String::new()) };
        let inner = std::mem::replace(expr, inner);
        expr.kind = ExprKind::Group(Box::new(inner));
        return;
    }
    match &mut expr.kind {
        ExprKind::Number { .. } | ExprKind::Name(_) => {}
        ExprKind::Call { arguments, .. } => arguments.iter_mut().for_each(parenthesise),
        ExprKind::Element(array, index) => {
            parenthesise_at(array, PrintPrecedence::Operand, TrailingPosition::Inner);
            parenthesise(index);
        }
        ExprKind::Reduce(reduction) => {
            parenthesise(&mut reduction.body);
            for LoopCounter { range, .. } in &mut reduction.counters {
                parenthesise(&mut range.lower);
                parenthesise(&mut range.upper);
            }
        }
        ExprKind::List(values) => values.iter_mut().for_each(parenthesise),
        ExprKind::Group(inner) => parenthesise(inner),
        ExprKind::Negate(operand) => parenthesise_at(operand, PrintPrecedence::Sign, position),
        ExprKind::Not(operand) => parenthesise_at(operand, PrintPrecedence::Not, position),
        ExprKind::Sum(terms) => {
            while let Some((_, Expr { kind: ExprKind::Sum(first), .. })) = terms.first_mut() {
                let first = std::mem::take(first);
                terms.splice(..1, first);
            }
            parenthesise_list(
                terms.iter_mut().map(|(_, term)| term),
                PrintPrecedence::Product,
                position,
            );
        }
        ExprKind::Product(factors) => {
            while let Some((_, Expr { kind: ExprKind::Product(first), .. })) = factors.first_mut() {
                let first = std::mem::take(first);
                factors.splice(..1, first);
            }
            parenthesise_list(factors.iter_mut().map(|(_, f)| f), PrintPrecedence::Sign, position);
        }
        ExprKind::And(all) => parenthesise_list(all.iter_mut(), PrintPrecedence::Not, position),
        ExprKind::Or(all) => parenthesise_list(all.iter_mut(), PrintPrecedence::And, position),
        ExprKind::Power(base, exponent) => {
            parenthesise_at(base, PrintPrecedence::Operand, TrailingPosition::Inner);
            parenthesise_at(exponent, PrintPrecedence::Sign, position);
        }
        ExprKind::Compare(_, left, right) => {
            parenthesise_at(left, PrintPrecedence::Sum, TrailingPosition::Inner);
            parenthesise_at(right, PrintPrecedence::Sum, position);
        }
        ExprKind::If(condition, yes, no) => {
            parenthesise(condition);
            parenthesise(yes);
            parenthesise_at(no, PrintPrecedence::Or, position);
        }
    }
}

fn parenthesise_list<'a>(
    operands: impl ExactSizeIterator<Item = &'a mut Expr>,
    least: PrintPrecedence,
    position: TrailingPosition,
) {
    let last = operands.len().saturating_sub(1);
    for (i, operand) in operands.enumerate() {
        let position = if i == last { position } else { TrailingPosition::Inner };
        parenthesise_at(operand, least, position);
    }
}

/// Precedence of operators, loosest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum PrintPrecedence {
    Or,
    And,
    Not,
    Compare,
    Sum,
    Product,
    Sign,
    Power,
    Operand,
}

/// Whether the expression continues after a part: an `if` extends as far as possible, and needs parentheses in that
/// case.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum TrailingPosition {
    Inner,
    Last,
}

fn binding(kind: &ExprKind) -> PrintPrecedence {
    match kind {
        ExprKind::Number { .. }
        | ExprKind::Name(_)
        | ExprKind::Call { .. }
        | ExprKind::Element(..)
        | ExprKind::Reduce(_)
        | ExprKind::List(_)
        | ExprKind::Group(_)
        | ExprKind::If(..) => PrintPrecedence::Operand,
        ExprKind::Negate(_) => PrintPrecedence::Sign,
        ExprKind::Sum(_) => PrintPrecedence::Sum,
        ExprKind::Product(_) => PrintPrecedence::Product,
        ExprKind::Power(..) => PrintPrecedence::Power,
        ExprKind::Compare(..) => PrintPrecedence::Compare,
        ExprKind::And(_) => PrintPrecedence::And,
        ExprKind::Or(_) => PrintPrecedence::Or,
        ExprKind::Not(_) => PrintPrecedence::Not,
    }
}

/// `(a, b)`
fn values_between(out: &mut String, values: &[Expr]) {
    out.push('(');
    for (i, value) in values.iter().enumerate() {
        out.push_str(if i == 0 { "" } else { ", " });
        expression(out, value, PrintPrecedence::Or, TrailingPosition::Last);
    }
    out.push(')');
}

/// `i in 1..N, j in 1..M`
fn print_counters(counters: &[LoopCounter]) -> String {
    let print = |LoopCounter { index, range }: &LoopCounter| {
        format!("{} in {}", index.text, print_range(range))
    };
    counters.iter().map(print).collect::<Vec<_>>().join(", ")
}

/// Writes an expression, in parentheses unless it binds at least this tightly.
fn expression(out: &mut String, expr: &Expr, least: PrintPrecedence, position: TrailingPosition) {
    let reaches_on = matches!(expr.kind, ExprKind::If(..)) && position == TrailingPosition::Inner;
    if binding(&expr.kind) < least || reaches_on {
        out.push('(');
        expression(out, expr, PrintPrecedence::Or, TrailingPosition::Last);
        out.push(')');
        return;
    }
    match &expr.kind {
        ExprKind::Number { text, unit, .. } => {
            out.push_str(text);
            if let Some(unit) = unit {
                let _ = write!(out, " [{}]", unit.text);
            }
        }
        ExprKind::Name(name) => out.push_str(name),
        ExprKind::Call { function, arguments } => {
            out.push_str(&function.text);
            values_between(out, arguments);
        }
        ExprKind::List(values) => values_between(out, values),
        ExprKind::Reduce(reduction) => {
            let Reduction { kind, body, counters, .. } = &**reduction;
            let _ = write!(out, "{}(", kind.word());
            expression(out, body, PrintPrecedence::Or, TrailingPosition::Last);
            let _ = write!(out, " for {})", print_counters(counters));
        }
        ExprKind::Element(array, index) => {
            expression(out, array, PrintPrecedence::Operand, TrailingPosition::Inner);
            let _ = write!(out, "[{}]", print_index(index));
        }
        ExprKind::Group(inner) => {
            out.push('(');
            expression(out, inner, PrintPrecedence::Or, TrailingPosition::Last);
            out.push(')');
        }
        ExprKind::Negate(operand) => {
            out.push('-');
            expression(out, operand, PrintPrecedence::Sign, position);
        }
        ExprKind::Not(operand) => {
            out.push_str("not ");
            expression(out, operand, PrintPrecedence::Not, position);
        }
        ExprKind::Sum(terms) => {
            let sign = |sign: &Sign| match sign {
                Sign::Plus => " + ",
                Sign::Minus => " - ",
            };
            let terms = terms.iter().map(|(s, term)| (sign(s), term));
            list(out, terms, PrintPrecedence::Product, position);
        }
        ExprKind::Product(factors) => {
            let sign = |factor: &FactorSide| match factor {
                FactorSide::Times => "*",
                FactorSide::Over => "/",
            };
            let factors = factors.iter().map(|(f, factor)| (sign(f), factor));
            list(out, factors, PrintPrecedence::Sign, position);
        }
        ExprKind::And(all) => {
            list(out, all.iter().map(|operand| (" and ", operand)), PrintPrecedence::Not, position);
        }
        ExprKind::Or(all) => {
            list(out, all.iter().map(|operand| (" or ", operand)), PrintPrecedence::And, position);
        }
        ExprKind::Power(base, exponent) => {
            expression(out, base, PrintPrecedence::Operand, TrailingPosition::Inner);
            out.push('^');
            expression(out, exponent, PrintPrecedence::Sign, position);
        }
        ExprKind::Compare(comparison, left, right) => {
            expression(out, left, PrintPrecedence::Sum, TrailingPosition::Inner);
            out.push_str(match comparison {
                Comparison::Less => " < ",
                Comparison::LessEqual => " <= ",
                Comparison::Greater => " > ",
                Comparison::GreaterEqual => " >= ",
            });
            expression(out, right, PrintPrecedence::Sum, position);
        }
        ExprKind::If(condition, yes, no) => {
            out.push_str("if ");
            expression(out, condition, PrintPrecedence::Or, TrailingPosition::Last);
            out.push_str(" then ");
            expression(out, yes, PrintPrecedence::Or, TrailingPosition::Last);
            out.push_str(" else ");
            expression(out, no, PrintPrecedence::Or, position);
        }
    }
}

/// Operands with the signs before them, except that of the first.
fn list<'a>(
    out: &mut String,
    operands: impl ExactSizeIterator<Item = (&'static str, &'a Expr)>,
    least: PrintPrecedence,
    position: TrailingPosition,
) {
    let last = operands.len().saturating_sub(1);
    for (i, (sign, operand)) in operands.enumerate() {
        if i > 0 {
            out.push_str(sign);
        }
        let position = if i == last { position } else { TrailingPosition::Inner };
        expression(out, operand, least, position);
    }
}

struct Printer {
    out: String,
    depth: usize,
}

impl Printer {
    fn line(&mut self, text: &str) {
        self.out.push_str(&"  ".repeat(self.depth));
        self.out.push_str(text);
        self.out.push('\n');
    }

    fn doc(&mut self, lines: &[String]) {
        for line in lines {
            self.line(format!("/// {line}").trim_end());
        }
    }

    fn items(&mut self, items: &[Item]) {
        for item in items {
            self.doc(&item.doc);
            self.item(&item.kind);
        }
    }

    /// The items of a loop, each with the loop's index after its name.
    fn items_of_loop(&mut self, counters: &[LoopCounter], items: &[Item]) {
        for item in items {
            let mut indexed = item.kind.clone();
            if let Some(name) = indexed.name_with_indices_mut() {
                for LoopCounter { index, .. } in counters {
                    let _ = write!(name.text, "[{}]", index.text);
                }
            }
            self.doc(&item.doc);
            self.item(&indexed);
        }
    }

    /// An effect in the usual order: its description, its items, its changes.
    fn effect(&mut self, effect: &EffectHeader, items: &[Item]) {
        self.doc(&effect.doc);
        let target = match &effect.target {
            EffectTarget::Model(model) => format!(" on {}", model.text),
            EffectTarget::Template(slots) => {
                let slots: Vec<String> = slots.iter().map(print_slot).collect();
                format!("({})", slots.join(", "))
            }
        };
        self.line(&format!("effect {}{target}", effect.name.text));
        let is_about_itself = |clause: &&EffectClause| {
            matches!(clause.kind, ClauseKind::Kind(_) | ClauseKind::Form(_))
        };
        // The order of clauses is kept; if both kinds alternate, all come first.
        let n_first = effect.clauses.iter().take_while(is_about_itself).count();
        let (first, last) = effect.clauses.split_at(n_first);
        for clause in first {
            self.clause(clause);
        }
        self.items(items);
        for clause in last {
            self.clause(clause);
        }
    }

    fn clause(&mut self, clause: &EffectClause) {
        self.doc(&clause.doc);
        let text = match &clause.kind {
            ClauseKind::Kind(kind) => format!("kind {}", kind.word()),
            ClauseKind::Form(form) => format!("form {}", form.text),
            ClauseKind::Null { name, value } => {
                format!("null {} = {}", name.text, print_expression(value))
            }
            ClauseKind::Replace { name, arguments, equation, by } => {
                let names: Vec<&str> = arguments.iter().map(|name| name.text.as_str()).collect();
                let arguments = if names.is_empty() {
                    String::new()
                } else {
                    format!("({})", names.join(", "))
                };
                let place = equation
                    .as_ref()
                    .map_or_else(String::new, |label| format!(" in {}", label.text));
                format!("replace {}{arguments}{place} by {}", name.text, print_expression(by))
            }
            ClauseKind::ReplaceOutput { output, by } => {
                format!("replace output {} by {}", output.text, print_expression(by))
            }
            ClauseKind::Add { value, equation } => {
                format!("add {} to {}", print_expression(value), equation.text)
            }
        };
        self.line(&text);
    }

    fn item(&mut self, kind: &ItemKind) {
        match kind {
            ItemKind::Import { path, .. } => self.line(&format!("import \"{path}\"")),
            ItemKind::Constant { name, unit, value } => {
                self.declaration("constant", name, unit.as_ref(), Some(value), &[]);
            }
            ItemKind::Parameter { name, unit, value, attributes } => {
                self.declaration("parameter", name, unit.as_ref(), Some(value), attributes);
            }
            ItemKind::Input { name, unit, attributes } => {
                self.declaration("input", name, unit.as_ref(), None, attributes);
            }
            ItemKind::Unknown { declared, name, unit, start, attributes } => {
                self.declaration(declared.word(), name, unit.as_ref(), start.as_ref(), attributes);
            }
            ItemKind::Unit { name, value } => {
                self.declaration("unit", name, None, Some(value), &[]);
            }
            ItemKind::Size { name, value } => {
                self.declaration("size", name, None, Some(value), &[]);
            }
            ItemKind::Array { declared, name, axes, unit, start, attributes } => {
                let keyword = declared.word();
                let name = Name { text: name.text.clone() + &print_axes(axes), span: name.span };
                self.declaration(keyword, &name, unit.as_ref(), start.as_ref(), attributes);
            }
            ItemKind::For { counters, items } => {
                self.line(&format!("for {} {{", print_counters(counters)));
                self.depth += 1;
                self.items_of_loop(counters, items);
                self.depth -= 1;
                self.line("}");
            }
            ItemKind::Let { name, unit, value } => {
                self.declaration("let", name, unit.as_ref(), Some(value), &[]);
            }
            ItemKind::Output { name, unit, value, attributes } => {
                self.declaration("output", name, unit.as_ref(), value.as_ref(), attributes);
            }
            ItemKind::Function { name, arguments, lets, body } => {
                let body = print_expression(body);
                let head = format!("function {}({}) =", name.text, print_arguments(arguments));
                if lets.is_empty() {
                    self.line(&format!("{head} {body}"));
                    return;
                }
                self.line(&format!("{head} {{"));
                self.depth += 1;
                for LocalLet { name, unit, value } in lets {
                    self.declaration("let", name, unit.as_ref(), Some(value), &[]);
                }
                self.line(&body);
                self.depth -= 1;
                self.line("}");
            }
            ItemKind::Table { name, arguments, unit, points, attributes } => {
                let head = format!("table {}({})", name.text, print_arguments(arguments));
                let unit = brackets(unit.as_ref());
                let (points, attributes) = (print_points(points), print_attributes(attributes));
                self.line(&format!("{head}{unit} {points}{attributes}"));
            }
            ItemKind::Equation { label, left, right, attributes } => {
                let (left, right) = (print_expression(left), print_expression(right));
                let attributes = print_attributes(attributes);
                self.line(&format!("equation {}: {left} = {right}{attributes}", label.text));
            }
            ItemKind::Variant { name, choices } => {
                self.line(&format!("variant {} {{", name.text));
                self.depth += 1;
                self.choices(choices);
                self.depth -= 1;
                self.line("}");
            }
            ItemKind::Modes { name, modes, transitions, starts } => {
                self.line(&format!("modes {} {{", name.text));
                self.depth += 1;
                self.choices(modes);
                for transition in transitions {
                    self.transition(transition);
                }
                for StartMode { mode, condition } in starts {
                    let condition = condition.as_ref().map(print_expression);
                    let condition = condition.map_or(String::new(), |text| format!(" if {text}"));
                    self.line(&format!("start {}{condition}", mode.text));
                }
                self.depth -= 1;
                self.line("}");
            }
            ItemKind::Part { name, axes, model, arguments } => {
                let argument = |PartArgument { name, value }: &PartArgument| {
                    format!("{} = {}", name.text, print_expression(value))
                };
                let arguments: Vec<String> = arguments.iter().map(argument).collect();
                let list = match arguments.as_slice() {
                    [] => String::new(),
                    all => format!("({})", all.join(", ")),
                };
                let axes = print_axes(axes);
                self.line(&format!("part {}{axes}: {}{list}", name.text, model.text));
            }
            ItemKind::Binding { input, indices, value } => {
                let input = print_element(input, indices);
                self.line(&format!("{input} = {}", print_expression(value)));
            }
            ItemKind::When(reaction) => {
                self.reaction(&format!("when {}", print_condition(reaction)), &reaction.resets);
            }
            ItemKind::Every { period, offset, resets } => {
                self.reaction(&print_every(period, offset.as_ref()), resets);
            }
            ItemKind::Start(StartRule::Steady) => self.line("start steady"),
            ItemKind::Start(StartRule::Equation { label, left, right }) => {
                let [left, right] = [left, right].map(print_expression);
                self.line(&format!("start equation {}: {left} = {right}", label.text));
            }
            ItemKind::Saturate { name, indices, side, bound } => {
                let sign = match side {
                    BoundSide::Lower => ">=",
                    BoundSide::Upper => "<=",
                };
                let name = print_element(name, indices);
                self.line(&format!("saturate {name} {sign} {}", print_expression(bound)));
            }
        }
    }

    fn choices(&mut self, choices: &[VariantChoice]) {
        for choice in choices {
            self.doc(&choice.doc);
            self.line(&format!("{} {{", choice.name.text));
            self.depth += 1;
            self.items(&choice.items);
            self.depth -= 1;
            self.line("}");
        }
    }

    fn transition(&mut self, transition: &TransitionClause) {
        let TransitionClause { doc, from, to, conditions, resets, .. } = transition;
        self.doc(doc);
        let head = format!("{} -> {} when {}", from.text, to.text, print_conditions(conditions));
        self.reaction(&head, resets);
    }

    /// An event, and its resets.
    fn reaction(&mut self, head: &str, resets: &[ResetClause]) {
        if resets.is_empty() {
            self.line(head);
            return;
        }
        self.line(&format!("{head} {{"));
        self.depth += 1;
        for ResetClause { name, indices, value, .. } in resets {
            let name = print_element(name, indices);
            self.line(&format!("reset {name} = {}", print_expression(value)));
        }
        self.depth -= 1;
        self.line("}");
    }

    fn declaration(
        &mut self,
        keyword: &str,
        name: &Name,
        unit: Option<&WrittenUnit>,
        value: Option<&Expr>,
        attributes: &[Attribute],
    ) {
        let mut text = format!("{keyword} {}{}", name.text, brackets(unit));
        if let Some(value) = value {
            text += " = ";
            text += &print_expression(value);
        }
        text += &print_attributes(attributes);
        self.line(&text);
    }
}

fn print_arguments(arguments: &[FormalArgument]) -> String {
    let argument = |argument: &FormalArgument| {
        format!("{}{}", argument.name.text, brackets(argument.unit.as_ref()))
    };
    arguments.iter().map(argument).collect::<Vec<_>>().join(", ")
}

/// The points of a table, from its `=` or `at` on.
fn print_points(points: &TablePoints) -> String {
    let list = |numbers: &[Expr]| {
        let numbers: Vec<String> = numbers.iter().map(print_expression).collect();
        format!("({})", numbers.join(", "))
    };
    match points {
        TablePoints::Written(points) => {
            let points: Vec<String> = points.iter().map(|point| list(&point.numbers)).collect();
            format!("= {}", points.join(", "))
        }
        TablePoints::Columns([abscissae, ordinates]) => match &ordinates[..] {
            [array] if abscissae.len() > 1 => {
                format!("at {} = {}", list(abscissae), print_expression(array))
            }
            _ => format!("at {} = {}", list(abscissae), list(ordinates)),
        },
        TablePoints::File { path, .. } => format!("from \"{path}\""),
    }
}

/// Attributes with a leading blank, as they follow a declaration or an equation.
fn print_attributes(attributes: &[Attribute]) -> String {
    let words: Vec<String> = attributes.iter().map(|a| print_attribute(&a.kind)).collect();
    if words.is_empty() { String::new() } else { format!(" {}", words.join(", ")) }
}

/// `x falls below e`, or several conditions joined by `or`.
pub(crate) fn print_condition(reaction: &Reaction) -> String {
    print_conditions(&reaction.conditions)
}

fn print_conditions(all: &[CrossingCondition]) -> String {
    let side = |expr: &Expr| {
        let mut out = String::new();
        expression(&mut out, expr, PrintPrecedence::Sum, TrailingPosition::Inner);
        out
    };
    let one = |CrossingCondition { left, crossing, right }: &CrossingCondition| {
        format!("{} {} {}", side(left), crossing.words(), side(right))
    };
    all.iter().map(one).collect::<Vec<_>>().join(" or ")
}

/// An index in brackets, without unnecessary blanks.
fn print_index(index: &Expr) -> String {
    let text = print_expression(index);
    if text.split(' ').any(|piece| RESERVED.contains(&piece)) {
        text
    } else {
        text.replace(' ', "")
    }
}

/// `[1..N]` or `[i in 1..N]` for each axis.
fn print_axes(axes: &[ArrayAxis]) -> String {
    let of_one = |ArrayAxis { index, range }: &ArrayAxis| {
        let index = index.as_ref().map(|index| format!("{} in ", index.text)).unwrap_or_default();
        format!("[{index}{}]", print_range(range))
    };
    axes.iter().map(of_one).collect()
}

/// `h` or `h[i - 1]`
fn print_element(name: &Name, indices: &[Expr]) -> String {
    let of_one = |index| format!("[{}]", print_index(index));
    let indices: String = indices.iter().map(of_one).collect();
    name.text.clone() + &indices
}

fn print_range(range: &NumberRange) -> String {
    format!("{}..{}", print_index(&range.lower), print_index(&range.upper))
}

fn brackets(unit: Option<&WrittenUnit>) -> String {
    unit.map_or_else(String::new, |unit| format!(" [{}]", unit.text))
}

fn print_slot(slot: &TemplateSlot) -> String {
    let kind =
        SlotKind::ALL.iter().find(|(_, kind)| *kind == slot.kind).map_or("", |(word, _)| word);
    format!("{}: {kind}{}", slot.name.text, brackets(slot.unit.as_ref()))
}

fn print_attribute(kind: &AttributeKind) -> String {
    match kind {
        AttributeKind::Bounds(lower, upper) => {
            let bound =
                |bound: &Option<Expr>| bound.as_ref().map_or_else(String::new, print_expression);
            let text = format!("in {} .. {}", bound(lower), bound(upper));
            text.replace("in  ..", "in ..").trim_end().to_owned()
        }
        AttributeKind::Log => "log".to_owned(),
        AttributeKind::Fixed => "fixed".to_owned(),
        AttributeKind::Guess => "guess".to_owned(),
        AttributeKind::Nominal(size) => format!("nominal {}", print_expression(size)),
        AttributeKind::Prior(law, first, second) => format!(
            "prior {}({}, {})",
            law.word(),
            print_expression(first),
            print_expression(second)
        ),
        AttributeKind::Hold => "hold".to_owned(),
        AttributeKind::Linear => "linear".to_owned(),
        AttributeKind::Noise(std) => format!("noise {}", print_expression(std)),
        AttributeKind::History(value) => format!("history {}", print_expression(value)),
        AttributeKind::Exact => "exact".to_owned(),
        AttributeKind::Shape(shape) => shape.word().to_owned(),
        AttributeKind::Beyond(beyond) => format!("beyond {}", beyond.word()),
        AttributeKind::Smooth(std) => format!("smooth {}", print_expression(std)),
    }
}
