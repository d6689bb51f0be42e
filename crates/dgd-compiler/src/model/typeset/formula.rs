//! A model's equations for typesetting: built from the syntax once, written by [`super::latex`] and [`super::mathml`].
//!
//! The equations are those of the file, in the author's order and with the author's grouping; the equations of the
//! chosen variants replace the variants. Brackets that a bar or an exponent makes superfluous are removed here, so that
//! writers have no choices left.

use crate::diagnostics::Diagnostics;
use crate::expr::display::number;
use crate::model::Model;
use crate::parts;
use crate::syntax::ast::{
    self, Ast, Attribute, AttributeKind, Comparison, Crossing, Expr, ExprKind, FactorSide,
    FormalArgument, Item, ItemKind, LoopCounter, Name, Reduction, ReductionOperation, Sign,
    StartRule, TableInterpolation, TablePoints, VariantChoice,
};

/// Only the first and the last points of larger tables are shown.
const MOST_POINTS: usize = 8;

/// A line of its own.
#[derive(Debug, Clone, PartialEq)]
pub enum FormulaLine {
    /// A definition, an equation or an output.
    Equation {
        /// Left of the equals sign.
        left: Formula,
        /// Right of it.
        right: Formula,
        /// The label of an equation.
        label: Option<String>,
    },
    /// The name of a mode, whose equations follow.
    Mode(String),
    /// A transition.
    Transition(FormulaTransition),
    /// A bound within which an unknown stays.
    Bound {
        /// The unknown.
        left: Formula,
        /// The side on which it lies.
        side: ast::BoundSide,
        /// The bound.
        right: Formula,
    },
}

/// A transition between modes.
#[derive(Debug, Clone, PartialEq)]
pub struct FormulaTransition {
    /// The mode that it leaves and the one that it enters; none for a `when`.
    pub modes: Option<[String; 2]>,
    /// When it occurs.
    pub occasion: TransitionOccasion,
    /// Unknowns that get a new value, and the values.
    pub resets: Vec<(Formula, Formula)>,
}

/// When a transition occurs.
#[derive(Debug, Clone, PartialEq)]
pub enum TransitionOccasion {
    /// When one of these left sides passes its right side in this direction.
    When(Vec<(Formula, Crossing, Formula)>),
    /// Periodically: the period, and the offset.
    Every(Formula, Option<Formula>),
}

/// A piece of mathematics.
#[derive(Debug, Clone, PartialEq)]
pub enum Formula {
    /// A name with its subscripts.
    Symbol(MathSymbol),
    /// A number.
    Number {
        /// Its digits, before the power of ten if there is one.
        digits: String,
        /// The power of ten.
        exponent: Option<String>,
        /// The unit after it, as written.
        unit: Option<String>,
    },
    /// Parts in a row.
    Row(Vec<Formula>),
    /// A sign between or before parts.
    Operator(MathOperator),
    /// Numerator and denominator.
    Fraction(Box<Formula>, Box<Formula>),
    /// A base with an exponent.
    Power(Box<Formula>, Box<Formula>),
    /// A square root.
    Root(Box<Formula>),
    /// Between a pair of delimiters.
    Fenced(Fence, Box<Formula>),
    /// A time derivative.
    Dot(MathSymbol),
    /// An element of an array, or its derivative, with its indices as a subscript.
    Indexed(Box<Formula>, Box<Formula>),
    /// A sum, a product or the like over indices.
    Over(Box<ReductionRange>),
    /// The upright name of a well-known function, with its subscript.
    Function(&'static str, Option<&'static str>),
    /// One value if a condition holds, otherwise another.
    Cases(Box<Cases>),
    /// Words between formulas.
    Words(&'static str),
}

/// A name in the style of papers: `h_r` is h with subscript r, `c0` is c with subscript 0.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MathSymbol {
    /// Letters on the base line.
    pub letters: String,
    /// Subscripts, left to right.
    pub subscripts: Vec<String>,
}

/// The two branches of an `if`.
#[derive(Debug, Clone, PartialEq)]
pub struct Cases {
    /// The value if the condition holds.
    pub then: Formula,
    /// The condition.
    pub condition: Formula,
    /// The value otherwise.
    pub otherwise: Formula,
}

/// A reduction of a formula over indices.
#[derive(Debug, Clone, PartialEq)]
pub struct ReductionRange {
    /// A sum, a product or another reduction.
    pub kind: ReductionOperation,
    /// The indices, each with its first and last value.
    pub counters: Vec<[Formula; 3]>,
    /// The formula.
    pub body: Formula,
}

/// Pairs of delimiters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fence {
    /// Round brackets as high as their content.
    Round,
    /// Round brackets around the arguments of a definition.
    Arguments,
    /// Vertical bars.
    Bars,
    /// Bars with feet: rounding down.
    Floor,
    /// Bars with heads: rounding up.
    Ceiling,
}

/// Signs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MathOperator {
    /// + between terms
    Plus,
    /// − between terms
    Minus,
    /// − in front of a term
    Negative,
    /// The multiplication without a sign.
    Times,
    /// Between arguments.
    Comma,
    /// =
    Equal,
    /// <
    Less,
    /// ≤
    LessEqual,
    /// >
    Greater,
    /// ≥
    GreaterEqual,
    /// ∧
    And,
    /// ∨
    Or,
    /// ¬
    Not,
}

/// A line with its documentation.
#[derive(Debug, Clone, PartialEq)]
pub struct DocumentedLine {
    /// The line.
    pub line: FormulaLine,
    /// Doc comment of its item.
    pub doc: Vec<String>,
    /// Whether the item is an `output`.
    pub is_output: bool,
    /// The indices of its loop, each with its first and last value.
    pub counters: Vec<[Formula; 3]>,
}

/// The lines of a model: libraries first, then the model file.
pub fn lines(asts: &[Ast], model: &Model) -> Vec<FormulaLine> {
    documented(asts, model).into_iter().map(|documented| documented.line).collect()
}

/// The lines of a model with their documentation.
pub fn documented(asts: &[Ast], model: &Model) -> Vec<DocumentedLine> {
    // The model was made from these trees, so they expand without errors.
    let expanded = parts::expand(asts, &mut Diagnostics::default());
    let mut lines = Vec::new();
    for ast in expanded.iter().flat_map(|expanded| expanded.asts.iter()).rev() {
        for_each_item(&ast.items, model, &mut |item| collect(item, model, &mut lines));
    }
    lines
}

/// Visits items; a variant is replaced by the items of its choice.
pub(super) fn for_each_item<'a>(
    items: &'a [Item],
    model: &Model,
    visit: &mut impl FnMut(&'a Item),
) {
    for item in items {
        if let ItemKind::Variant { name, choices } = &item.kind {
            let chosen = model.variants.iter().find(|v| v.name == name.text);
            let is_chosen =
                |choice: &&VariantChoice| chosen.is_some_and(|v| v.choice() == choice.name.text);
            if let Some(choice) = choices.iter().find(is_chosen) {
                for_each_item(&choice.items, model, visit);
            }
        } else {
            visit(item);
        }
    }
}

/// The lines of one item.
fn collect(item: &Item, model: &Model, lines: &mut Vec<DocumentedLine>) {
    let mut push = |line| {
        let is_output = matches!(item.kind, ItemKind::Output { .. });
        lines.push(DocumentedLine { line, doc: item.doc.clone(), is_output, counters: Vec::new() });
    };
    match &item.kind {
        ItemKind::Output { name, value: Some(value), .. } => {
            let (left, right) =
                (Formula::Symbol(MathSymbol::from_name(&name.text)), expression(value));
            push(FormulaLine::Equation { left, right, label: None });
        }
        ItemKind::Function { name, arguments, lets, body } => {
            let left = called(name, arguments);
            push(FormulaLine::Equation { left, right: with_lets(body, lets), label: None });
        }
        ItemKind::Table { name, arguments, points, attributes, .. } => {
            let (left, right) =
                (called(name, arguments), through(arguments.len(), points, attributes));
            push(FormulaLine::Equation { left, right, label: None });
        }
        ItemKind::Modes { modes, transitions, .. } => {
            for (k, mode) in modes.iter().enumerate() {
                // The documentation of the block is written once, that of a mode with the mode.
                let doc =
                    if k == 0 { [&item.doc[..], &mode.doc].concat() } else { mode.doc.clone() };
                let line = FormulaLine::Mode(mode.name.text.clone());
                lines.push(DocumentedLine { line, doc, is_output: false, counters: Vec::new() });
                for_each_item(&mode.items, model, &mut |item| collect(item, model, lines));
            }
            let undocumented = |line| DocumentedLine {
                line,
                doc: Vec::new(),
                is_output: false,
                counters: Vec::new(),
            };
            lines.extend(transitions.iter().map(transition).map(undocumented));
        }
        ItemKind::For { counters, items } => {
            let ends: Vec<[Formula; 3]> = counters.iter().map(ends_of).collect();
            for item in items {
                let Some(line) = of_loop(counters, item) else { continue };
                let (doc, counters) = (item.doc.clone(), ends.clone());
                lines.push(DocumentedLine { line, doc, is_output: false, counters });
            }
        }
        ItemKind::Let { .. }
        | ItemKind::Equation { .. }
        | ItemKind::Start(StartRule::Equation { .. })
        | ItemKind::When(_)
        | ItemKind::Every { .. }
        | ItemKind::Saturate { .. } => of_loop(&[], item).into_iter().for_each(push),
        ItemKind::Import { .. }
        | ItemKind::Start(StartRule::Steady)
        | ItemKind::Constant { .. }
        | ItemKind::Parameter { .. }
        | ItemKind::Input { .. }
        | ItemKind::Unknown { .. }
        | ItemKind::Output { .. }
        | ItemKind::Part { .. }
        | ItemKind::Binding { .. }
        | ItemKind::Size { .. }
        | ItemKind::Unit { .. }
        | ItemKind::Array { .. }
        | ItemKind::Variant { .. } => {}
    }
}

/// An index with its first and last value.
fn ends_of(counter: &LoopCounter) -> [Formula; 3] {
    let LoopCounter { index, range } = counter;
    let symbol = Formula::Symbol(MathSymbol::from_name(&index.text));
    [symbol, expression(&range.lower), expression(&range.upper)]
}

/// The array of an element, and the element's indices.
fn element<'e>(array: &'e Expr, index: &'e Expr) -> (&'e Expr, Vec<&'e Expr>) {
    let mut indices = vec![index];
    let mut base = array;
    while let ExprKind::Element(array, index) = &base.kind {
        indices.insert(0, index);
        base = array;
    }
    (base, indices)
}

/// A formula with its indices as one subscript.
fn indexed(of: Formula, indices: &[&Expr]) -> Formula {
    let indices = separated(indices.iter().map(|index| expression(index)), MathOperator::Comma);
    Formula::Indexed(Box::new(of), Box::new(indices))
}

/// An element of an array, or a name without indices.
fn element_named(name: &Name, indices: &[Expr]) -> Formula {
    let name = Formula::Symbol(MathSymbol::from_name(&name.text));
    if indices.is_empty() { name } else { indexed(name, &indices.iter().collect::<Vec<_>>()) }
}

/// An item of a loop, once, with the loop's indices.
fn of_loop(counters: &[LoopCounter], item: &Item) -> Option<FormulaLine> {
    let indexed = |label: &Name| {
        counters.iter().fold(label.text.clone(), |label, c| label + "[" + &c.index.text + "]")
    };
    let line = match &item.kind {
        ItemKind::Let { name, value, .. } => {
            let index = |c: &LoopCounter| Expr {
                span: c.index.span,
                kind: ExprKind::Name(c.index.text.clone()),
            };
            let indices: Vec<Expr> = counters.iter().map(index).collect();
            let left = element_named(name, &indices);
            FormulaLine::Equation { left, right: expression(value), label: None }
        }
        ItemKind::Equation { label, left, right, .. } => {
            let (left, right) = (expression(left), expression(right));
            FormulaLine::Equation { left, right, label: Some(indexed(label)) }
        }
        ItemKind::Start(StartRule::Equation { label, left, right }) => {
            let (left, right) = (expression(left), expression(right));
            let label = Some(indexed(label) + ", at the start");
            FormulaLine::Equation { left, right, label }
        }
        ItemKind::When(reaction) => when(reaction),
        ItemKind::Every { period, offset, resets } => FormulaLine::Transition(FormulaTransition {
            modes: None,
            occasion: TransitionOccasion::Every(
                expression(period),
                offset.as_ref().map(expression),
            ),
            resets: resets_of(resets),
        }),
        ItemKind::Saturate { name, indices, side, bound } => {
            let left = element_named(name, indices);
            FormulaLine::Bound { left, side: *side, right: expression(bound) }
        }
        _ => return None,
    };
    Some(line)
}

fn transition(transition: &ast::TransitionClause) -> FormulaLine {
    FormulaLine::Transition(FormulaTransition {
        modes: Some([&transition.from, &transition.to].map(|mode| mode.text.clone())),
        occasion: occasion(&transition.conditions),
        resets: resets_of(&transition.resets),
    })
}

fn when(reaction: &ast::Reaction) -> FormulaLine {
    FormulaLine::Transition(FormulaTransition {
        modes: None,
        occasion: occasion(&reaction.conditions),
        resets: resets_of(&reaction.resets),
    })
}

fn occasion(conditions: &[ast::CrossingCondition]) -> TransitionOccasion {
    let one = |condition: &ast::CrossingCondition| {
        (expression(&condition.left), condition.crossing, expression(&condition.right))
    };
    TransitionOccasion::When(conditions.iter().map(one).collect())
}

/// The left side of the definition of a function or a table.
fn called(name: &Name, arguments: &[FormalArgument]) -> Formula {
    let symbol = |name: &Name| Formula::Symbol(MathSymbol::from_name(&name.text));
    let arguments = separated(arguments.iter().map(|a| symbol(&a.name)), MathOperator::Comma);
    Formula::Row(vec![symbol(name), Formula::Fenced(Fence::Arguments, Box::new(arguments))])
}

/// The points of a table, or some of many, and its interpolation.
fn through(n_arguments: usize, points: &TablePoints, attributes: &[Attribute]) -> Formula {
    let shape = attributes.iter().find_map(|attribute| match attribute.kind {
        AttributeKind::Linear => Some(TableInterpolation::Linear),
        AttributeKind::Shape(shape) => Some(shape),
        _ => None,
    });
    let default =
        if n_arguments == 1 { TableInterpolation::Pchip } else { TableInterpolation::Linear };
    let words = match (shape.unwrap_or(default), n_arguments) {
        (TableInterpolation::Linear, 1) => "lines through",
        (TableInterpolation::Linear, _) => "bilinear through",
        (TableInterpolation::Pchip, _) => "monotone cubics through",
        (TableInterpolation::Natural | TableInterpolation::Cubic, _) => "a natural spline through",
    };
    let numbers: Vec<Vec<&Expr>> = match points {
        TablePoints::Written(points) | TablePoints::File { rows: Some(Ok(points)), .. } => {
            points.iter().map(|p| p.numbers.iter().collect()).collect()
        }
        TablePoints::Columns([x, y]) => {
            let value = |k: usize| y.get(k).or(y.last());
            x.iter().enumerate().map(|(k, x)| [x].into_iter().chain(value(k)).collect()).collect()
        }
        TablePoints::File { .. } => Vec::new(),
    };
    let point = |numbers: &Vec<&Expr>| {
        round(separated(numbers.iter().map(|number| expression(number)), MathOperator::Comma))
    };
    let mut shown: Vec<Formula> = numbers.iter().take(MOST_POINTS).map(point).collect();
    if let Some(last) = numbers.last().filter(|_| numbers.len() > MOST_POINTS) {
        shown.truncate(MOST_POINTS - 2);
        shown.extend([Formula::Words("…"), point(last)]);
    }
    Formula::Row(vec![Formula::Words(words), separated(shown.into_iter(), MathOperator::Comma)])
}

/// The value of a function with a block: its last line, in which the names of the lines above are replaced.
fn with_lets(body: &Expr, lets: &[ast::LocalLet]) -> Formula {
    let mut row = vec![expression(body)];
    for (k, local) in lets.iter().enumerate() {
        row.push(if k == 0 {
            Formula::Words("where")
        } else {
            Formula::Operator(MathOperator::Comma)
        });
        row.push(Formula::Symbol(MathSymbol::from_name(&local.name.text)));
        row.push(Formula::Operator(MathOperator::Equal));
        row.push(expression(&local.value));
    }
    match row.pop() {
        Some(only) if row.is_empty() => only,
        last => {
            row.extend(last);
            Formula::Row(row)
        }
    }
}

fn resets_of(resets: &[ast::ResetClause]) -> Vec<(Formula, Formula)> {
    let one = |reset: &ast::ResetClause| {
        (element_named(&reset.name, &reset.indices), expression(&reset.value))
    };
    resets.iter().map(one).collect()
}

impl MathSymbol {
    /// Splits a name at its underscores and before the digits of its first part; the name of the part that owns it
    /// comes last.
    pub fn from_name(name: &str) -> MathSymbol {
        let (whole, name) = match name.rsplit_once('.') {
            Some((whole, name)) => (Some(whole), name),
            None => (None, name),
        };
        let mut parts = name.split('_');
        let first = parts.next().unwrap_or_default();
        let letters = first.trim_end_matches(|c: char| c.is_ascii_digit());
        let digits = &first[letters.len()..];
        let subscripts = (!digits.is_empty()).then_some(digits).into_iter().chain(parts);
        let subscripts =
            subscripts.chain(whole.into_iter().flat_map(|whole| whole.split(['.', '_'])));
        MathSymbol {
            letters: letters.to_owned(),
            subscripts: subscripts.map(str::to_owned).collect(),
        }
    }
}

/// The small and capital letters that are spelled out in names and drawn as one character.
pub(super) static GREEK: &[(&str, char)] = &[
    ("alpha", 'α'),
    ("beta", 'β'),
    ("gamma", 'γ'),
    ("delta", 'δ'),
    ("epsilon", 'ε'),
    ("zeta", 'ζ'),
    ("eta", 'η'),
    ("theta", 'θ'),
    ("kappa", 'κ'),
    ("lambda", 'λ'),
    ("mu", 'μ'),
    ("nu", 'ν'),
    ("xi", 'ξ'),
    ("pi", 'π'),
    ("rho", 'ρ'),
    ("sigma", 'σ'),
    ("tau", 'τ'),
    ("phi", 'φ'),
    ("chi", 'χ'),
    ("psi", 'ψ'),
    ("omega", 'ω'),
    ("Gamma", 'Γ'),
    ("Delta", 'Δ'),
    ("Theta", 'Θ'),
    ("Lambda", 'Λ'),
    ("Xi", 'Ξ'),
    ("Pi", 'Π'),
    ("Sigma", 'Σ'),
    ("Phi", 'Φ'),
    ("Psi", 'Ψ'),
    ("Omega", 'Ω'),
];

pub(super) fn expression(expr: &Expr) -> Formula {
    match &expr.kind {
        ExprKind::Number { value, unit, .. } => {
            let digits = number(*value);
            let (digits, exponent) = match digits.split_once('e') {
                Some((mantissa, exponent)) => (mantissa.to_owned(), Some(exponent.to_owned())),
                None => (digits, None),
            };
            Formula::Number { digits, exponent, unit: unit.as_ref().map(|unit| unit.text.clone()) }
        }
        ExprKind::Name(name) if name == "time" => Formula::Symbol(MathSymbol::from_name("t")),
        ExprKind::Name(name) => Formula::Symbol(MathSymbol::from_name(name)),
        ExprKind::Call { function, arguments } => call(&function.text, arguments),
        ExprKind::Element(array, index) => {
            let (array, indices) = element(array, index);
            indexed(expression(array), &indices)
        }
        ExprKind::List(values) => {
            round(separated(values.iter().map(expression), MathOperator::Comma))
        }
        ExprKind::Reduce(reduction) => {
            let Reduction { kind, body, counters, .. } = &**reduction;
            let reads_on = is_sum(body) || matches!(body.kind, ExprKind::Compare(..));
            let body = if reads_on { round(expression(body)) } else { expression(body) };
            let counters = counters.iter().map(ends_of).collect();
            Formula::Over(Box::new(ReductionRange { kind: *kind, counters, body }))
        }
        ExprKind::Group(inner) => round(expression(inner)),
        ExprKind::Negate(inner) if is_sum(inner) => {
            before(MathOperator::Negative, round(expression(inner)))
        }
        ExprKind::Negate(inner) => before(MathOperator::Negative, expression(inner)),
        ExprKind::Sum(terms) => {
            let mut row = Vec::with_capacity(2 * terms.len());
            for (i, (sign, term)) in terms.iter().enumerate() {
                match (i, sign) {
                    (0, Sign::Plus) => {}
                    (0, Sign::Minus) => row.push(Formula::Operator(MathOperator::Negative)),
                    (_, Sign::Plus) => row.push(Formula::Operator(MathOperator::Plus)),
                    (_, Sign::Minus) => row.push(Formula::Operator(MathOperator::Minus)),
                }
                row.push(expression(term));
            }
            Formula::Row(row)
        }
        ExprKind::Product(factors) => product(factors),
        ExprKind::Power(base, exponent) => {
            Formula::Power(Box::new(expression(base)), Box::new(expression(bare(exponent))))
        }
        ExprKind::If(condition, then, otherwise) => Formula::Cases(Box::new(Cases {
            then: expression(then),
            condition: expression(condition),
            otherwise: expression(otherwise),
        })),
        ExprKind::Compare(comparison, left, right) => {
            let sign = match comparison {
                Comparison::Less => MathOperator::Less,
                Comparison::LessEqual => MathOperator::LessEqual,
                Comparison::Greater => MathOperator::Greater,
                Comparison::GreaterEqual => MathOperator::GreaterEqual,
            };
            Formula::Row(vec![expression(left), Formula::Operator(sign), expression(right)])
        }
        ExprKind::And(parts) => separated(parts.iter().map(expression), MathOperator::And),
        ExprKind::Or(parts) => separated(parts.iter().map(expression), MathOperator::Or),
        ExprKind::Not(inner) => before(MathOperator::Not, expression(inner)),
    }
}

/// Whether an expression needs brackets next to a tighter operator.
fn is_sum(expr: &Expr) -> bool {
    matches!(expr.kind, ExprKind::Sum(_) | ExprKind::Negate(_) | ExprKind::If(..))
}

/// Factors before the first division, and those multiplied later, are above the bar.
fn product(factors: &[(FactorSide, Expr)]) -> Formula {
    let is_quotient = factors.iter().any(|(factor, _)| *factor == FactorSide::Over);
    let side = |wanted: FactorSide| {
        let parts: Vec<&Expr> =
            factors.iter().filter(|(factor, _)| *factor == wanted).map(|(_, e)| e).collect();
        match parts[..] {
            // A lone factor needs no brackets next to a bar.
            [only] if is_quotient => expression(bare(only)),
            _ => separated(parts.into_iter().map(expression), MathOperator::Times),
        }
    };
    if is_quotient {
        Formula::Fraction(Box::new(side(FactorSide::Times)), Box::new(side(FactorSide::Over)))
    } else {
        side(FactorSide::Times)
    }
}

/// The expression without brackets around the whole.
fn bare(expr: &Expr) -> &Expr {
    match &expr.kind {
        ExprKind::Group(inner) => bare(inner),
        _ => expr,
    }
}

/// Well-known functions with their typeset names.
static WELL_KNOWN: &[(&str, &str, Option<&str>)] = &[
    ("log", "ln", None),
    ("log10", "log", Some("10")),
    ("sin", "sin", None),
    ("cos", "cos", None),
    ("tan", "tan", None),
    ("exp", "exp", None),
    ("sinh", "sinh", None),
    ("cosh", "cosh", None),
    ("tanh", "tanh", None),
    ("min", "min", None),
    ("max", "max", None),
    ("asin", "asin", None),
    ("acos", "acos", None),
    ("atan", "atan", None),
    ("atan2", "atan2", None),
    ("sign", "sign", None),
    ("mod", "mod", None),
    ("round", "round", None),
    ("hypot", "hypot", None),
    ("complementary", "complementary", None),
    ("clamp", "clamp", None),
    ("smoothstep", "smoothstep", None),
    ("erf", "erf", None),
    ("erfc", "erfc", None),
    ("lgamma", "lgamma", None),
];

fn call(function: &str, arguments: &[Expr]) -> Formula {
    let list = separated(arguments.iter().map(expression), MathOperator::Comma);
    let name = match (function, arguments) {
        ("der", [Expr { kind: ExprKind::Name(name), .. }]) => {
            return Formula::Dot(MathSymbol::from_name(name));
        }
        ("der", [Expr { kind: ExprKind::Element(array, index), .. }])
            if matches!(element(array, index).0.kind, ExprKind::Name(_)) =>
        {
            let (array, indices) = element(array, index);
            let ExprKind::Name(name) = &array.kind else { unreachable!("asked above") };
            return indexed(Formula::Dot(MathSymbol::from_name(name)), &indices);
        }
        ("delay", [x, tau]) => return delayed(x, tau),
        ("sqrt", _) => return Formula::Root(Box::new(list)),
        ("abs", _) => return Formula::Fenced(Fence::Bars, Box::new(list)),
        ("floor", [_]) => return Formula::Fenced(Fence::Floor, Box::new(list)),
        ("ceil", [_]) => return Formula::Fenced(Fence::Ceiling, Box::new(list)),
        _ => match WELL_KNOWN.iter().find(|(spelling, ..)| *spelling == function) {
            Some((_, name, foot)) => Formula::Function(name, *foot),
            None => Formula::Symbol(MathSymbol::from_name(function)),
        },
    };
    Formula::Row(vec![name, round(list)])
}

/// x(t − τ), with brackets around an x that is not a name.
fn delayed(x: &Expr, tau: &Expr) -> Formula {
    let (x, tau) = (bare(x), bare(tau));
    let base = match x.kind {
        ExprKind::Name(_) => expression(x),
        _ => round(expression(x)),
    };
    let lag = if is_sum(tau) { round(expression(tau)) } else { expression(tau) };
    let t = Formula::Symbol(MathSymbol::from_name("t"));
    Formula::Row(vec![
        base,
        round(Formula::Row(vec![t, Formula::Operator(MathOperator::Minus), lag])),
    ])
}

fn round(inner: Formula) -> Formula {
    Formula::Fenced(Fence::Round, Box::new(inner))
}

fn before(sign: MathOperator, part: Formula) -> Formula {
    Formula::Row(vec![Formula::Operator(sign), part])
}

/// Parts separated by a sign; a single part stays as it is.
fn separated(parts: impl Iterator<Item = Formula>, sign: MathOperator) -> Formula {
    let mut row = Vec::new();
    for part in parts {
        if !row.is_empty() {
            row.push(Formula::Operator(sign));
        }
        row.push(part);
    }
    match row.pop() {
        Some(only) if row.is_empty() => only,
        last => {
            row.extend(last);
            Formula::Row(row)
        }
    }
}
