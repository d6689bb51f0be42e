//! Lowers parsed expressions to the graph, with their dimensions.

use std::collections::BTreeMap;

use super::arrays::whole::{LoopIndex, open_index};
use super::check_units::{ExprDimension, LocatedDimension, UnitSpelling, quotient_for_derivative};
use super::define::{FunctionDeclaration, ModelScope, NameDefinition, TableDeclaration};
use super::resolve::NumberReading;
use super::tables::ResolvedTable;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::intrinsics::{INTRINSICS, IntrinsicId};
use crate::expr::{ExprGraph, ExprId, Node, Symbol};
use crate::source::Span;
use crate::syntax::ast::{
    Expr, ExprKind, FactorSide, FormalArgument, LocalLet, Name, ReductionOperation, Sign,
    WrittenUnit,
};
use crate::units::{Dimension, Unit};

/// Limit on the nesting of function calls, including brackets.
const DEEPEST: usize = 512;

/// Limit on the expanded calls of a model's own functions.
const MOST_CALLS: usize = 200_000;

/// Limit on the operations that sums and loops are written out to: later stages need some hundred bytes for each.
const MOST_WRITTEN: usize = 2_000_000;

/// An expression in the graph and its dimension.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct TypedExpr {
    pub(super) id: ExprId,
    pub(super) dim: ExprDimension,
}

impl TypedExpr {
    pub(super) fn locate(self, span: Span) -> LocatedDimension {
        LocatedDimension { dim: self.dim, span }
    }
}

/// The arguments of an open function by name.
pub(super) type OpenArguments<'a> = BTreeMap<&'a str, TypedExpr>;

/// Lowers expressions into a graph.
pub(super) struct ExprLowering<'a> {
    pub(super) scope: ModelScope<'a>,
    pub(super) graph: ExprGraph,
    /// `let`s evaluated so far; an error proves that a failed one was reported.
    pub(super) lets: BTreeMap<&'a str, Result<TypedExpr, ErrorReported>>,
    /// Values of constants evaluated so far, by position.
    pub(super) constants: BTreeMap<u32, f64>,
    /// Tables read so far, by position.
    pub(super) tables: BTreeMap<usize, Result<ResolvedTable, ErrorReported>>,
    /// Results of calls, so that equal calls are expanded once.
    pub(super) calls: BTreeMap<(&'a str, Vec<TypedExpr>), Result<TypedExpr, ErrorReported>>,
    /// Functions being expanded, innermost last.
    pub(super) open: Vec<&'a str>,
    /// Proof that too many calls have been reported, which happens once.
    exhausted: Option<ErrorReported>,
    depth: usize,
    /// Expressions lowered so far, counted as often as sums and loops write them out.
    written: usize,
    /// Terms of the sum that is being written out, including those of nested sums.
    pub(super) terms: usize,
    pub(super) within_reduction: bool,
    /// The open indices, innermost last; one of these may move.
    pub(super) indices: Vec<LoopIndex<'a>>,
    /// Whether an element that moves by more than one has been read.
    pub(super) strided: bool,
    /// Dimensions of expressions by place, if requested.
    pub(super) dimensions: Option<BTreeMap<Span, Dimension>>,
    /// `let`s of loops, by name and indices.
    pub(super) opened_lets:
        BTreeMap<(&'a str, Vec<LoopIndex<'a>>), Result<TypedExpr, ErrorReported>>,
}

impl<'a> ExprLowering<'a> {
    pub(super) fn new(scope: ModelScope<'a>) -> Self {
        ExprLowering {
            scope,
            graph: ExprGraph::default(),
            lets: BTreeMap::new(),
            constants: BTreeMap::new(),
            tables: BTreeMap::new(),
            calls: BTreeMap::new(),
            open: Vec::new(),
            exhausted: None,
            depth: 0,
            written: 0,
            terms: 0,
            within_reduction: false,
            indices: Vec::new(),
            strided: false,
            dimensions: None,
            opened_lets: BTreeMap::new(),
        }
    }

    /// An expression that is a number.
    pub(super) fn value(
        &mut self,
        expr: &'a Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        self.lower(expr, &OpenArguments::new(), diagnostics)
    }

    /// The value of an expression of constants; `None` if it reads anything else.
    pub(super) fn number(&self, id: ExprId) -> Option<f64> {
        if let Node::Constant(bits) = self.graph.node(id) {
            return Some(f64::from_bits(bits));
        }
        let known = |symbol: &Symbol| matches!(symbol, Symbol::Constant(i) if self.constants.contains_key(i));
        self.graph.symbols(id).iter().all(known).then(|| {
            self.graph.evaluate(id, &|symbol| match symbol {
                Symbol::Constant(i) => self.constants[&i],
                _ => f64::NAN,
            })
        })
    }

    pub(super) fn lower(
        &mut self,
        expr: &'a Expr,
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        self.depth += 1;
        self.written += 1;
        let result = if self.depth > DEEPEST {
            Err(diagnostics.error(
                Diagnostic::new(Code::ModelTooLarge, expr.span, "expressions nest too deep here")
                    .help("give inner parts a `let` of their own"),
            ))
        } else {
            self.lower_kind(expr, arguments, diagnostics)
        };
        self.depth -= 1;
        if let (Some(dimensions), Ok(typed)) = (&mut self.dimensions, result) {
            dimensions.insert(expr.span, typed.dim.dimension());
        }
        result
    }

    /// Refuses to write out more at this place if the model would become too large.
    pub(super) fn verify_size(
        &self,
        place: Span,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        if self.written <= MOST_WRITTEN {
            return Ok(());
        }
        if let Some(said) = diagnostics.said(Code::ModelTooLarge, place) {
            return Err(said);
        }
        let message = format!(
            "the sums and loops of this model write out more than {MOST_WRITTEN} operations"
        );
        Err(diagnostics.error(Diagnostic::new(Code::ModelTooLarge, place, message).help(
            "add up in a loop: `equation add[i]: total[i] = total[i-1] + …`, of an array of `unknown`s",
        )))
    }

    fn lower_kind(
        &mut self,
        expr: &'a Expr,
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let span = expr.span;
        match &expr.kind {
            ExprKind::Number { value, unit, .. } => {
                self.literal(*value, unit.as_ref(), diagnostics)
            }
            ExprKind::Name(name) => self.name(name, span, arguments, diagnostics),
            ExprKind::Call { function, arguments: list } => {
                self.call(function, list, span, arguments, diagnostics)
            }
            ExprKind::Element(array, index) => {
                self.element(array, index, false, arguments, diagnostics)
            }
            ExprKind::Reduce(reduction) => self.reduction(reduction, span, arguments, diagnostics),
            ExprKind::List(_) => Err(diagnostics.error(
                Diagnostic::new(
                    Code::ValueCount,
                    span,
                    "a list of values stands only for an array",
                )
                .help("write one value here"),
            )),
            ExprKind::Group(inner) => self.lower(inner, arguments, diagnostics),
            ExprKind::Negate(inner) => {
                // −5 °C is the temperature −5 °C, not minus 278.15 K.
                if let ExprKind::Number { value, unit, .. } = &inner.kind {
                    return self.literal(-value, unit.as_ref(), diagnostics);
                }
                let inner = self.lower(inner, arguments, diagnostics)?;
                Ok(TypedExpr { id: self.graph.intern(Node::Negate(inner.id)), dim: inner.dim })
            }
            ExprKind::Sum(terms) => self.sum(terms, arguments, diagnostics),
            ExprKind::Product(factors) => self.product(factors, arguments, diagnostics),
            ExprKind::Power(base, exponent) => {
                let base_typed = self.lower(base, arguments, diagnostics);
                let exponent_typed = self.lower(exponent, arguments, diagnostics);
                let (b, e) = (base_typed?, exponent_typed?);
                let value = self.number(e.id);
                let dim = self
                    .scope
                    .spelling
                    .power(b.locate(base.span), e.locate(exponent.span), value, span)
                    .map_err(|diagnostic| diagnostics.error(diagnostic))?;
                let id = self.graph.intern(Node::Call2(IntrinsicId::named("^"), b.id, e.id));
                Ok(TypedExpr { id, dim })
            }
            ExprKind::If(condition, then, otherwise) => {
                let condition = self.condition(condition, arguments, diagnostics);
                let a = self.lower(then, arguments, diagnostics);
                let b = self.lower(otherwise, arguments, diagnostics);
                let (condition, a, b) = (condition?, a?, b?);
                let dim = self
                    .scope
                    .spelling
                    .same("choose between", a.locate(then.span), b.locate(otherwise.span))
                    .map_err(|diagnostic| diagnostics.error(diagnostic))?;
                Ok(TypedExpr { id: self.graph.intern(Node::Select(condition, a.id, b.id)), dim })
            }
            ExprKind::Compare(..) | ExprKind::And(_) | ExprKind::Or(_) | ExprKind::Not(_) => {
                Err(diagnostics.error(
                    Diagnostic::new(
                        Code::ConditionAsNumber,
                        span,
                        "a number is needed here, not a condition",
                    )
                    .help("write `if condition then 1 else 0` to make a number of it"),
                ))
            }
        }
    }

    fn literal(
        &mut self,
        value: f64,
        unit: Option<&'a WrittenUnit>,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let (value, dim) = match unit {
            None if value == 0.0 => (0.0, ExprDimension::Zero),
            None => (value, ExprDimension::ONE),
            Some(written) => {
                let unit = unit_of(Some(written), diagnostics)?;
                (unit.to_si(value), ExprDimension::Of(unit.dimension))
            }
        };
        Ok(TypedExpr { id: self.graph.constant(value), dim })
    }

    fn sum(
        &mut self,
        terms: &'a [(Sign, Expr)],
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let mut sum: Option<Result<(TypedExpr, Span), ErrorReported>> = None;
        for (sign, term) in terms {
            let typed = self.lower(term, arguments, diagnostics);
            sum = Some(match (sum, typed) {
                (None, typed) => typed.map(|typed| (typed, term.span)),
                (Some(Err(reported)), _) | (Some(Ok(_)), Err(reported)) => Err(reported),
                (Some(Ok((total, total_span))), Ok(typed)) => {
                    let doing = if *sign == Sign::Plus { "add" } else { "subtract" };
                    self.scope
                        .spelling
                        .same(doing, total.locate(total_span), typed.locate(term.span))
                        .map_err(|diagnostic| diagnostics.error(diagnostic))
                        .map(|dim| {
                            let node = match sign {
                                Sign::Plus => Node::Add(total.id, typed.id),
                                Sign::Minus => Node::Subtract(total.id, typed.id),
                            };
                            let id = self.graph.intern(node);
                            (TypedExpr { id, dim }, total_span.join(term.span))
                        })
                }
            });
        }
        let sum = sum.unwrap_or_else(|| unreachable!("a sum has terms"));
        sum.map(|(typed, _)| typed)
    }

    fn product(
        &mut self,
        factors: &'a [(FactorSide, Expr)],
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let is_known = |name: &str| {
            arguments.contains_key(name)
                || self.scope.names.contains_key(name)
                || open_index(&self.indices, name).is_some()
        };
        if let Some(mistake) = quotient_for_derivative(factors, &self.scope, &is_known) {
            return Err(diagnostics.error(mistake));
        }
        let mut product: Option<Result<TypedExpr, ErrorReported>> = None;
        for (factor, expr) in factors {
            let typed = self.lower(expr, arguments, diagnostics);
            product = Some(match (product, typed) {
                (None, typed) => typed,
                (Some(Err(reported)), _) | (Some(Ok(_)), Err(reported)) => Err(reported),
                (Some(Ok(total)), Ok(typed)) => {
                    let over = *factor == FactorSide::Over;
                    UnitSpelling::product(total.dim, typed.dim, over, expr.span)
                        .map_err(|diagnostic| diagnostics.error(diagnostic))
                        .map(|dim| {
                            let node = match factor {
                                FactorSide::Times => Node::Multiply(total.id, typed.id),
                                FactorSide::Over => Node::Divide(total.id, typed.id),
                            };
                            TypedExpr { id: self.graph.intern(node), dim }
                        })
                }
            });
        }
        product.unwrap_or_else(|| unreachable!("a product has factors"))
    }

    /// A condition outside of functions.
    pub(super) fn truth(
        &mut self,
        expr: &'a Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<ExprId, ErrorReported> {
        self.condition(expr, &OpenArguments::new(), diagnostics)
    }

    fn condition(
        &mut self,
        expr: &'a Expr,
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<ExprId, ErrorReported> {
        let mut chain = |this: &mut Self, parts: &'a [Expr], join: fn(ExprId, ExprId) -> Node| {
            let mut joined: Option<Result<ExprId, ErrorReported>> = None;
            for part in parts {
                let part = this.condition(part, arguments, diagnostics);
                joined = Some(match (joined, part) {
                    (None, part) => part,
                    (Some(Ok(a)), Ok(b)) => Ok(this.graph.intern(join(a, b))),
                    (Some(Err(reported)), _) | (_, Err(reported)) => Err(reported),
                });
            }
            joined.unwrap_or_else(|| unreachable!("a chain has parts"))
        };
        match &expr.kind {
            ExprKind::And(parts) => chain(self, parts, Node::And),
            ExprKind::Or(parts) => chain(self, parts, Node::Or),
            ExprKind::Not(inner) => {
                let inner = self.condition(inner, arguments, diagnostics)?;
                Ok(self.graph.intern(Node::Not(inner)))
            }
            ExprKind::Group(inner) => self.condition(inner, arguments, diagnostics),
            ExprKind::Compare(comparison, left, right) => {
                let a = self.lower(left, arguments, diagnostics);
                let b = self.lower(right, arguments, diagnostics);
                let (a, b) = (a?, b?);
                self.scope
                    .spelling
                    .same("compare", a.locate(left.span), b.locate(right.span))
                    .map_err(|diagnostic| diagnostics.error(diagnostic))?;
                Ok(self.graph.intern(Node::Compare(*comparison, a.id, b.id)))
            }
            ExprKind::Number { .. }
            | ExprKind::Name(_)
            | ExprKind::Call { .. }
            | ExprKind::Element(..)
            | ExprKind::Reduce(_)
            | ExprKind::List(_)
            | ExprKind::Negate(_)
            | ExprKind::Sum(_)
            | ExprKind::Product(_)
            | ExprKind::Power(..)
            | ExprKind::If(..) => Err(diagnostics.error(
                Diagnostic::new(
                    Code::ConditionAsNumber,
                    expr.span,
                    "a condition is needed here, not a number",
                )
                .help("compare it with something, such as `> 0`"),
            )),
        }
    }

    fn name(
        &mut self,
        name: &'a str,
        span: Span,
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        if let Some(typed) = arguments.get(name) {
            return Ok(*typed);
        }
        if let Some(index) = open_index(&self.indices, name) {
            return Ok(self.index_value(index));
        }
        let Some(entry) = self.scope.names.get(name) else {
            return Err(self.unknown_name(name, span, arguments, diagnostics));
        };
        let (symbol, unit) = match entry.definition {
            NameDefinition::Time => (Symbol::Time, self.scope.second),
            NameDefinition::Pi => {
                let id = self.graph.constant(std::f64::consts::PI);
                return Ok(TypedExpr { id, dim: ExprDimension::ONE });
            }
            NameDefinition::Let(_) => {
                return self.lets.get(name).copied().unwrap_or_else(|| {
                    unreachable!("`let`s are done in an order in which each needs earlier ones")
                });
            }
            NameDefinition::Function(_) | NameDefinition::Table(_) => {
                let noun = entry.definition.noun();
                return Err(diagnostics.error(
                    Diagnostic::new(Code::MisusedName, span, format!("`{name}` is {noun}"))
                        .about(&name)
                        .help(format!("call it: `{name}(…)`")),
                ));
            }
            NameDefinition::Size => {
                let size = self.scope.sizes.get(name).copied();
                let size = size.unwrap_or_else(|| unreachable!("sizes are worked out first"))?;
                return Ok(TypedExpr {
                    id: self.graph.constant(size as f64),
                    dim: ExprDimension::ONE,
                });
            }
            NameDefinition::Array { .. }
            | NameDefinition::Vector(_)
            | NameDefinition::LetArray(_) => {
                return Err(diagnostics.error(
                    Diagnostic::new(Code::ArrayAsNumber, span, format!("`{name}` is an array"))
                        .about(&name)
                        .label(entry.span, "declared here")
                        .help(format!("say which element: `{name}[…]`")),
                ));
            }
            NameDefinition::Constant(i) => (Symbol::Constant(i), self.scope.dimension(name)?),
            NameDefinition::Parameter(i) => (Symbol::Parameter(i), self.scope.dimension(name)?),
            NameDefinition::Input(i) => (Symbol::Input(i), self.scope.dimension(name)?),
            NameDefinition::Unknown { index, .. } => {
                (Symbol::Unknown(index), self.scope.dimension(name)?)
            }
        };
        Ok(TypedExpr { id: self.graph.symbol(symbol), dim: ExprDimension::Of(unit) })
    }

    pub(super) fn unknown_name(
        &self,
        name: &str,
        span: Span,
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> ErrorReported {
        if let Some(place) = self.scope.outputs.get(name) {
            return diagnostics.error(
                Diagnostic::new(
                    Code::MisusedName,
                    span,
                    format!("`{name}` is an output, which cannot be read inside the model"),
                )
                .about(&name)
                .label(*place, "declared here")
                .help("give what it reads a `let`, and use that in both places"),
            );
        }
        // For names that a function reads from outside, the error is reported at the function.
        let known_error = [Code::UnknownName, Code::CircularDefinition]
            .into_iter()
            .find_map(|code| diagnostics.said(code, span));
        if let Some(known_error) = known_error {
            return known_error;
        }
        let candidates = arguments.keys().copied().chain(self.scope.names.keys().copied());
        let near = || diagnostics.suggestion(name, candidates);
        let mut diagnostic =
            Diagnostic::new(Code::UnknownName, span, format!("nothing is called `{name}`"))
                .about(&name);
        if name == "delay" || IntrinsicId::find(name).is_some() {
            diagnostic.code = Code::MisusedName;
            diagnostic.message = format!("`{name}` is a function");
            diagnostic.help = Some(format!("call it: `{name}(…)`").into());
        } else if let Some(near) = near() {
            diagnostic.help = Some(format!("did you mean `{near}`?").into());
        }
        diagnostics.error(diagnostic)
    }

    fn call(
        &mut self,
        function: &'a Name,
        list: &'a [Expr],
        span: Span,
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let name = function.text.as_str();
        if name == "der" {
            return self.derivative(list, span, diagnostics);
        }
        if name == "delay" {
            return self.delay(list, span, arguments, diagnostics);
        }
        let is_known = self.scope.names.contains_key(name) || IntrinsicId::find(name).is_some();
        if !is_known && ReductionOperation::ALL.iter().any(|(word, _)| *word == name) {
            let array = match list {
                [Expr { kind: ExprKind::Name(array), .. }] => array,
                _ => "x",
            };
            return Err(diagnostics.error(
                Diagnostic::new(
                    Code::UnknownFunction,
                    function.span,
                    format!("`{name}` goes over indices"),
                )
                .about(&name)
                .help(format!("say over which: `{name}({array}[i] for i in 1..N)`")),
            ));
        }
        let mut typed = Vec::with_capacity(list.len());
        let mut failed = None;
        for argument in list {
            match self.lower(argument, arguments, diagnostics) {
                Ok(one) => typed.push(one),
                Err(reported) => failed = Some(reported),
            }
        }
        let wrong_number = |expected: usize, diagnostics: &mut Diagnostics| {
            let noun = if expected == 1 { "argument" } else { "arguments" };
            diagnostics.error(
                Diagnostic::new(
                    Code::ArgumentCount,
                    span,
                    format!("`{name}` takes {expected} {noun}, not {}", list.len()),
                )
                .about(&name),
            )
        };
        let definition = self.scope.names.get(name).map(|entry| (entry.definition, entry.span));
        match definition {
            Some((NameDefinition::Function(index), place)) => {
                let declared = self.scope.functions[index];
                if declared.arguments.len() != list.len() {
                    return Err(wrong_number(declared.arguments.len(), diagnostics));
                }
                failed.map_or(Ok(()), Err)?;
                let spans: Vec<Span> = list.iter().map(|argument| argument.span).collect();
                let passed = CallArguments { typed, spans, call: span, place };
                self.open_function(declared, passed, diagnostics)
            }
            Some((NameDefinition::Table(index), place)) => {
                let TableDeclaration { name, arguments, .. } = self.scope.tables[index];
                if arguments.len() != list.len() {
                    return Err(wrong_number(arguments.len(), diagnostics));
                }
                failed.map_or(Ok(()), Err)?;
                let spans: Vec<Span> = list.iter().map(|argument| argument.span).collect();
                let passed = CallArguments { typed, spans, call: span, place };
                let mut taken = Vec::with_capacity(arguments.len());
                for argument in arguments {
                    taken.push((
                        &argument.name,
                        Some(unit_of(argument.unit.as_ref(), diagnostics)?),
                    ));
                }
                let bound = self.bind(&name.text, &taken, &passed, diagnostics)?;
                self.look_up(index, &bound, &passed.spans, diagnostics)
            }
            Some((_, place)) => Err(diagnostics.error(
                Diagnostic::new(
                    Code::MisusedName,
                    function.span,
                    format!("`{name}` is not a function"),
                )
                .about(&name)
                .label(place, "declared here")
                .help(format!("write `{name} * (…)` for a product")),
            )),
            None => {
                let Some(intrinsic) = IntrinsicId::find(name) else {
                    if let Some(said) = diagnostics.said(Code::UnknownFunction, function.span) {
                        return Err(said);
                    }
                    let known = INTRINSICS.iter().map(|i| i.name);
                    let of_model = self.scope.function_names();
                    let mut diagnostic = Diagnostic::new(
                        Code::UnknownFunction,
                        function.span,
                        format!("there is no function `{name}`"),
                    )
                    .about(&name);
                    let known = known.chain(of_model).chain(["der", "delay"]);
                    if let Some(near) = diagnostics.suggestion(name, known) {
                        diagnostic.help = Some(format!("did you mean `{near}`?").into());
                    }
                    return Err(diagnostics.error(diagnostic));
                };
                let arity = intrinsic.get().definition.arity();
                if arity != list.len() {
                    return Err(wrong_number(arity, diagnostics));
                }
                failed.map_or(Ok(()), Err)?;
                let dims: Vec<LocatedDimension> =
                    typed.iter().zip(list).map(|(t, e)| t.locate(e.span)).collect();
                let dim = self
                    .scope
                    .spelling
                    .call(name, intrinsic.get().unit_rule, &dims, span)
                    .map_err(|diagnostic| diagnostics.error(diagnostic))?;
                let ids: Vec<ExprId> = typed.iter().map(|t| t.id).collect();
                Ok(TypedExpr { id: self.graph.intern_call(intrinsic, &ids), dim })
            }
        }
    }

    fn open_function(
        &mut self,
        function: FunctionDeclaration<'a>,
        passed: CallArguments,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let FunctionDeclaration { name, arguments: declared, .. } = function;
        if self.open.contains(&name) {
            let chain = self.open.join("` → `");
            return Err(diagnostics.error(
                Diagnostic::new(
                    Code::CircularDefinition,
                    passed.call,
                    format!("the function `{name}` calls itself: `{chain}` → `{name}`"),
                )
                .about(&name)
                .help("a call stands for the function's body, which cannot hold the same call"),
            ));
        }
        let mut taken = Vec::with_capacity(declared.len());
        for FormalArgument { name, unit } in declared {
            let unit = unit.as_ref().map(|unit| unit_of(Some(unit), diagnostics)).transpose()?;
            taken.push((name, unit));
        }
        let values = self.bind(name, &taken, &passed, diagnostics)?;
        let names = declared.iter().map(|argument| argument.name.text.as_str());
        let bound: OpenArguments<'a> = names.zip(values).collect();
        let key = (name, passed.typed);
        if let Some(result) = self.calls.get(&key) {
            return *result;
        }
        if self.calls.len() >= MOST_CALLS {
            let reported = self.exhausted.get_or_insert_with(|| {
                diagnostics.error(
                    Diagnostic::new(
                        Code::ModelTooLarge,
                        passed.call,
                        "the model opens too many calls",
                    )
                    .label(passed.place, format!("`{name}` multiplies when it is opened"))
                    .help("name repeated parts with `let`, and give functions fewer calls"),
                )
            });
            return Err(*reported);
        }
        self.open.push(name);
        // A function does not see the indices of loops.
        let outer = std::mem::take(&mut self.indices);
        let result = self.value_of(function, bound, diagnostics);
        self.indices = outer;
        self.open.pop();
        self.calls.insert(key, result);
        result
    }

    /// Binds arguments of a function or a table, checking those with a unit.
    fn bind(
        &self,
        called: &str,
        arguments: &[(&Name, Option<Unit>)],
        passed: &CallArguments,
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<TypedExpr>, ErrorReported> {
        let mut bound = Vec::with_capacity(passed.typed.len());
        let bindings = arguments.iter().zip(&passed.typed).zip(&passed.spans);
        for (((argument, unit), typed), span) in bindings {
            let mut typed = *typed;
            if let Some(unit) = unit {
                let wanted = ExprDimension::Of(unit.dimension);
                if typed.dim.unify(wanted).is_none() {
                    let dimension = typed.dim.dimension();
                    return Err(diagnostics.error(
                        Diagnostic::new(
                            Code::UnitsOfSides,
                            *span,
                            format!(
                                "`{called}` takes `{}` in `{}`, not {}",
                                argument.text,
                                unit.symbol,
                                self.scope.spelling.being(dimension)
                            ),
                        )
                        .about(&called)
                        .about(&argument.text)
                        .here(self.scope.spelling.this_is(dimension))
                        .label(argument.span, format!("declared in `{}`", unit.symbol)),
                    ));
                }
                typed.dim = wanted;
            }
            bound.push(typed);
        }
        Ok(bound)
    }

    /// Expands a function whose arguments all have units, to find errors in its body.
    pub(super) fn check_function(
        &mut self,
        function: FunctionDeclaration<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        let mut bound = OpenArguments::new();
        for (i, argument) in function.arguments.iter().enumerate() {
            let unit = unit_of(argument.unit.as_ref(), diagnostics)?;
            // Any symbol will do: only its dimension is used.
            let id = self.graph.symbol(Symbol::Input(u32::MAX - i as u32));
            bound.insert(
                &argument.name.text,
                TypedExpr { id, dim: ExprDimension::Of(unit.dimension) },
            );
        }
        self.open.push(function.name);
        let result = self.value_of(function, bound, diagnostics);
        self.open.pop();
        result.map(|_| ())
    }

    /// The value of a function with these arguments: its `let`s one after another, then its body.
    fn value_of(
        &mut self,
        function: FunctionDeclaration<'a>,
        mut bound: OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        for LocalLet { name, unit, value } in function.lets {
            let typed = match unit {
                None => self.lower(value, &bound, diagnostics)?,
                Some(unit) => {
                    let unit = unit_of(Some(unit), diagnostics)?;
                    self.in_unit(value, &unit, NumberReading::Value, &bound, diagnostics)?
                }
            };
            bound.insert(name.text.as_str(), typed);
        }
        self.lower(function.body, &bound, diagnostics)
    }

    fn derivative(
        &mut self,
        list: &'a [Expr],
        span: Span,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let mut only = match list {
            [only] => Some(only),
            _ => None,
        };
        while let Some(Expr { kind: ExprKind::Group(inner), .. }) = only {
            only = Some(inner);
        }
        if let Some(Expr { kind: ExprKind::Element(array, index), .. }) = only {
            return self.element(array, index, true, &OpenArguments::new(), diagnostics);
        }
        let Some(Expr { kind: ExprKind::Name(name), span: name_span }) = only else {
            return Err(diagnostics.error(
                Diagnostic::new(Code::NoDerivative, span, "`der` takes the name of one state")
                    .help(
                        "the derivative of an expression follows from those of its states; a second derivative \
                         is that of a state which equals the first, as in `equation v: der(x) = v`",
                    ),
            ));
        };
        let entry = self.scope.names.get(name.as_str());
        match entry.map(|entry| (entry.definition, entry.span)) {
            Some((NameDefinition::Unknown { index, state: true }, _)) => {
                let unit = self.scope.dimension(name)?;
                let rate = unit.divide(self.scope.second).unwrap_or(Dimension::ONE);
                let id = self.graph.symbol(Symbol::Derivative(index));
                Ok(TypedExpr { id, dim: ExprDimension::Of(rate) })
            }
            Some((definition, place)) => {
                let what = definition.noun();
                Err(diagnostics.error(
                    Diagnostic::new(
                        Code::NoDerivative,
                        *name_span,
                        format!("`{name}` is {what}, not a state"),
                    )
                    .about(&name)
                    .label(place, "declared here")
                    .help("only what is declared `state` has a derivative"),
                ))
            }
            None => Err(self.unknown_name(name, *name_span, &OpenArguments::new(), diagnostics)),
        }
    }
}

/// The arguments of a call.
struct CallArguments {
    typed: Vec<TypedExpr>,
    spans: Vec<Span>,
    call: Span,
    /// Where the function is declared.
    place: Span,
}

/// The unit between brackets; a plain number without one.
pub(super) fn unit_of(
    written: Option<&WrittenUnit>,
    diagnostics: &mut Diagnostics,
) -> Result<Unit, ErrorReported> {
    let Some(written) = written else {
        return Ok(Unit::one());
    };
    written.read().map_err(|error| diagnostics.error(error.locate(&written.text, written.span)))
}

/// Whether a declared value consists of plain numbers, and so is in the declared unit. Functions declared by the model,
/// `is_own`, may read anything.
pub(super) fn is_plain(expr: &Expr, is_own: &dyn Fn(&str) -> bool) -> bool {
    let is_plain = |expr: &Expr| is_plain(expr, is_own);
    match &expr.kind {
        ExprKind::Number { unit, .. } => unit.is_none(),
        ExprKind::Name(name) => name == "pi",
        ExprKind::Call { function, arguments } => {
            let is_known = IntrinsicId::find(&function.text).is_some() && !is_own(&function.text);
            is_known && arguments.iter().all(is_plain)
        }
        ExprKind::Group(inner) | ExprKind::Negate(inner) | ExprKind::Not(inner) => is_plain(inner),
        ExprKind::Sum(terms) => terms.iter().all(|(_, term)| is_plain(term)),
        ExprKind::Product(factors) => factors.iter().all(|(_, factor)| is_plain(factor)),
        ExprKind::Power(base, exponent) => is_plain(base) && is_plain(exponent),
        ExprKind::If(condition, holds, fails) => {
            [condition, holds, fails].into_iter().all(|part| is_plain(part.as_ref()))
        }
        ExprKind::Compare(_, left, right) => is_plain(left) && is_plain(right),
        ExprKind::And(parts) | ExprKind::Or(parts) => parts.iter().all(is_plain),
        ExprKind::List(values) => values.iter().all(is_plain),
        ExprKind::Element(..) | ExprKind::Reduce(_) => false,
    }
}
