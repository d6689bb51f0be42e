//! What expressions stand for others: calls of functions, `let`s of loops, reductions and tables.
//!
//! Their texts are lowered at each use, so that this file and `lower` use each other.

use super::arguments::CallArguments;
use super::delay::wrong_count;
use super::resolved_table::ResolvedTable;
use super::tables::{Ordinate, SiPoint, verify_one_argument, written};
use super::{ExprLowering, NumberReading, OpenArguments, TypedExpr};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::intrinsics::IntrinsicId;
use crate::expr::{ExprId, Symbol};
use crate::model::check_units::{ExprDimension, unit_of};
use crate::model::scope::{
    FunctionDeclaration, IndexExtent, LetArray, LoopIndex, NameDefinition, TableDeclaration,
    extent_within,
};
use crate::source::Span;
use crate::syntax::ast::{
    Expr, ExprKind, FormalArgument, LocalLet, LoopCounter, Name, Reduction, ReductionOperation,
    TablePoints,
};
use crate::units::Unit;

/// Limit on the expanded calls of a model's own functions.
const MOST_CALLS: usize = 200_000;

impl<'a> ExprLowering<'a> {
    /// A call of a function or a table.
    pub(super) fn call(
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
            let [x, tau] = list else {
                return Err(diagnostics.error(wrong_count(list.len(), span)));
            };
            let x = self.lower(x, arguments, diagnostics);
            let by = self.lower(tau, arguments, diagnostics);
            return self.delayed(x?, by?, tau.span, diagnostics);
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
                .about(name)
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
                .about(name),
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
                let table = self.table(index, diagnostics)?;
                self.look_up(index, &table, &bound, &passed.spans, diagnostics)
            }
            Some((_, place)) => Err(diagnostics.error(
                Diagnostic::new(
                    Code::MisusedName,
                    function.span,
                    format!("`{name}` is not a function"),
                )
                .about(name)
                .label(place, "declared here")
                .help(format!("write `{name} * (…)` for a product")),
            )),
            None => {
                let Some(intrinsic) = IntrinsicId::find(name) else {
                    return Err(self.unknown_function(function, diagnostics));
                };
                let arity = intrinsic.get().definition.arity();
                if arity != list.len() {
                    return Err(wrong_number(arity, diagnostics));
                }
                failed.map_or(Ok(()), Err)?;
                let typed = typed.iter().zip(list).map(|(typed, expr)| (*typed, expr.span));
                self.intrinsic(intrinsic, &typed.collect::<Vec<_>>(), span, diagnostics)
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
                .about(name)
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

    /// Expands a function whose arguments all have units, to find errors in its body.
    pub(in crate::model) fn check_function(
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

    /// The expression of a `let` of a loop for an index.
    pub(in crate::model) fn open_let(
        &mut self,
        array: &LetArray<'a>,
        at: Vec<LoopIndex<'a>>,
        span: Span,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let key = (array.name, at.clone());
        if let Some(done) = self.opened_lets.get(&key) {
            return *done;
        }
        if self.open.contains(&array.name) {
            let message = format!("`{}` depends on itself", array.name);
            return Err(diagnostics.error(
                Diagnostic::new(Code::CircularDefinition, span, message)
                    .about(array.name)
                    .help("an unknown that equations determine can depend on its neighbours"),
            ));
        }
        self.open.push(array.name);
        let outer = std::mem::replace(&mut self.indices, at);
        let result = match array.unit {
            None => self.value(array.value, diagnostics),
            Some(unit) => unit_of(Some(unit), diagnostics).and_then(|unit| {
                let none = OpenArguments::new();
                self.in_unit(array.value, &unit, NumberReading::Value, &none, diagnostics)
            }),
        };
        self.indices = outer;
        self.open.pop();
        self.opened_lets.insert(key, result);
        result
    }

    /// A reduction over indices.
    pub(super) fn reduction(
        &mut self,
        reduction: &'a Reduction,
        span: Span,
        arguments: &OpenArguments<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        let mut terms = Vec::new();
        let open = self.indices.len();
        let is_outermost = !std::mem::replace(&mut self.within_reduction, true);
        if is_outermost {
            self.terms = 0;
        }
        let done = self.terms(reduction, &reduction.counters, arguments, &mut terms, diagnostics);
        self.indices.truncate(open);
        self.within_reduction = !is_outermost;
        done?;
        self.reduced(reduction, &terms, span, diagnostics)
    }

    /// The values for all indices, the last varying fastest.
    fn terms(
        &mut self,
        reduction: &'a Reduction,
        counters: &'a [LoopCounter],
        arguments: &OpenArguments<'a>,
        terms: &mut Vec<TypedExpr>,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        let Some((LoopCounter { index, range }, inner)) = counters.split_first() else {
            self.count_term(reduction, terms.len(), diagnostics)?;
            self.verify_size(reduction.body.span, diagnostics)?;
            terms.push(self.lower(&reduction.body, arguments, diagnostics)?);
            return Ok(());
        };
        self.verify_free(index, arguments, diagnostics)?;
        let IndexExtent { lower, count } =
            extent_within(range, &self.scope.sizes, &self.indices, diagnostics)?;
        let open = self.indices.len();
        for passage in 0..i64::from(count) {
            self.indices.truncate(open);
            self.indices.push(LoopIndex { name: &index.text, first: lower + passage, count: 1 });
            self.terms(reduction, inner, arguments, terms, diagnostics)?;
        }
        self.indices.truncate(open);
        Ok(())
    }

    /// The curves of a table, which are made once.
    pub(in crate::model) fn table(
        &mut self,
        index: usize,
        diagnostics: &mut Diagnostics,
    ) -> Result<ResolvedTable, ErrorReported> {
        if let Some(done) = self.tables.get(&index) {
            return done.clone();
        }
        let table = self.scope.tables[index];
        let done = self.resolve_table(table, diagnostics);
        self.tables.insert(index, done.clone());
        done
    }

    fn resolve_table(
        &mut self,
        table: TableDeclaration<'a>,
        diagnostics: &mut Diagnostics,
    ) -> Result<ResolvedTable, ErrorReported> {
        let units = table.arguments.iter().map(|argument| argument.unit.as_ref());
        let units: Vec<Result<Unit, ErrorReported>> =
            units.chain([table.unit]).map(|unit| unit_of(unit, diagnostics)).collect();
        let mut units: Vec<Unit> = units.into_iter().collect::<Result<_, _>>()?;
        let of_values = units.pop().unwrap_or_else(Unit::one);
        let points = self.points(table, &units, &of_values, diagnostics)?;
        let points = self.in_order(table, &units, points, diagnostics)?;
        let terms = self.terms_of_table(table, &units, &points, diagnostics)?;
        let smoothness = match table.smooth() {
            None => Vec::new(),
            Some((std, span)) => {
                verify_one_argument(table, span, diagnostics)?;
                let what = "standard deviation of `smooth`";
                let std = self.positive(std, &of_values, what, diagnostics)?;
                self.smoothness(table, &points, (std, span), diagnostics)?
            }
        };
        Ok(ResolvedTable { terms, dimension: of_values.dimension, smoothness })
    }

    /// The points of a table in SI, in the order written.
    fn points(
        &mut self,
        table: TableDeclaration<'a>,
        units: &[Unit],
        of_values: &Unit,
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<SiPoint>, ErrorReported> {
        let written = written(table, diagnostics)?;
        let is_file = matches!(table.points, TablePoints::File { .. });
        let mut failed = None;
        let mut points = Vec::with_capacity(written.len());
        for (place, (at, value, span)) in written.into_iter().enumerate() {
            let arguments: Result<Vec<f64>, ErrorReported> = at
                .iter()
                .zip(units)
                // Removes the sign of zero.
                .map(|(&x, unit)| Ok(self.known(x, unit, NumberReading::Value, diagnostics)? + 0.0))
                .collect();
            let value = match value {
                Ordinate::Of(value) => self.ordinate(value, of_values, diagnostics),
                Ordinate::Element(array, k) => {
                    self.ordinate_of_array(array, k, table, of_values, diagnostics)
                }
            };
            match (arguments, value) {
                (Ok(arguments), Ok(value)) => {
                    points.push(SiPoint { at: arguments, value, span, place });
                }
                (Err(reported), _) | (_, Err(reported)) => failed = Some(reported),
            }
            // A wrong unit in a header applies to every row.
            if is_file && failed.is_some() {
                break;
            }
        }
        failed.map_or(Ok(points), Err)
    }

    fn ordinate(
        &mut self,
        expr: &'a Expr,
        unit: &Unit,
        diagnostics: &mut Diagnostics,
    ) -> Result<ExprId, ErrorReported> {
        let none = OpenArguments::new();
        let typed = self.in_unit(expr, unit, NumberReading::Value, &none, diagnostics)?;
        self.verify_ordinate(typed.id, expr, diagnostics)?;
        Ok(typed.id)
    }
}
