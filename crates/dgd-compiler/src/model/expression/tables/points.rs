//! The points of a table in SI, in order, and their errors.

use super::super::{ExprLowering, OpenArguments, not_finite};
use super::shown::place_of;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::{ExprId, Symbol};
use crate::model::scope::{NameDefinition, TableDeclaration};
use crate::source::Span;
use crate::syntax::ast::{
    ArrayKind, AttributeKind, Expr, ExprKind, TableExtrapolation, TablePoints,
};
use crate::units::Unit;

/// A point with its arguments in SI.
pub(in crate::model::expression) struct SiPoint {
    pub(in crate::model::expression) at: Vec<f64>,
    pub(in crate::model::expression) value: ExprId,
    pub(in crate::model::expression) span: Span,
    /// Its position among the points as written.
    pub(in crate::model::expression) place: usize,
}

/// Points with one argument that are not a step.
struct RepeatedPoints {
    what: &'static str,
    help: &'static str,
    /// Places of the last and of the first.
    spans: (Span, Span),
}

impl<'a> ExprLowering<'a> {
    /// Orders points by ascending arguments; those of a step stay in the order written.
    pub(in crate::model::expression) fn in_order(
        &self,
        table: TableDeclaration<'a>,
        units: &[Unit],
        mut points: Vec<SiPoint>,
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<SiPoint>, ErrorReported> {
        let in_order = |a: &SiPoint, b: &SiPoint| {
            a.at.iter()
                .zip(&b.at)
                .fold(std::cmp::Ordering::Equal, |order, (a, b)| order.then(a.total_cmp(b)))
        };
        // In descending order, a step is met from above.
        if points.windows(2).all(|pair| in_order(&pair[0], &pair[1]).is_ge()) {
            points.reverse();
        }
        points.sort_by(in_order);
        let mut repeated = None;
        for here in points.chunk_by(|a, b| a.at == b.at) {
            let is_end = here[0].at == points[0].at || here[0].at == points[points.len() - 1].at;
            if let Some(fault) = self.too_many_at_one_place(table, here, is_end) {
                let (second, first) = fault.spans;
                let place = place_of(table, units, &here[0].at);
                let message = format!("`{}` has {} at {place}", table.name.text, fault.what);
                repeated = Some(
                    diagnostics.error(
                        Diagnostic::new(Code::InvalidTablePoints, second, message)
                            .about(&table.name.text)
                            .label(first, "the other one")
                            .help(fault.help),
                    ),
                );
            }
        }
        repeated.map_or(Ok(points), Err)
    }

    /// The first group of too many points with equal arguments: a table of one argument may have two, which are a step.
    fn too_many_at_one_place(
        &self,
        table: TableDeclaration<'a>,
        points: &[SiPoint],
        is_end: bool,
    ) -> Option<RepeatedPoints> {
        let goes_on = table.attributes.iter().any(|attribute| {
            matches!(
                attribute.kind,
                AttributeKind::Beyond(TableExtrapolation::Hold | TableExtrapolation::Extend)
            )
        });
        let (what, help) = match points {
            [] | [_] => return None,
            [_, _] if table.arguments.len() > 1 => {
                ("two points", "leave one of them out; a table of two arguments does not jump")
            }
            [a, b] if a.place.abs_diff(b.place) > 1 => {
                ("two points", "leave one of them out; those of a step follow each other")
            }
            [_, _] if is_end && !goes_on => (
                "two points",
                "leave one of them out, or say `beyond hold`: a table has no step at its end",
            ),
            [a, b] => {
                let known = [a, b].map(|point| self.number(point.value));
                if known[0].is_none() || known[0] != known[1] {
                    return None;
                }
                ("the same point twice", "leave one of them out; a step has two values")
            }
            _ => ("more than two points", "a step has two, the values before and after it"),
        };
        let mut spans: Vec<Span> = points.iter().map(|point| point.span).collect();
        spans.sort_unstable();
        let (first, last) = (spans[0], spans[spans.len() - 1]);
        Some(RepeatedPoints { what, help, spans: (last, first) })
    }

    /// The element that is a value, for an array with as many elements as the table has points.
    pub(in crate::model::expression) fn ordinate_of_array(
        &mut self,
        array: &'a Expr,
        k: u32,
        table: TableDeclaration<'a>,
        unit: &Unit,
        diagnostics: &mut Diagnostics,
    ) -> Result<ExprId, ErrorReported> {
        let ExprKind::Name(name) = &array.kind else {
            unreachable!("the parser takes a list or a name");
        };
        let n = table.points.expressions().len() - 1;
        let entry = self.scope.names.get(name.as_str()).map(|entry| entry.definition);
        let refuse = |message: String, help: &str, diagnostics: &mut Diagnostics| {
            // Once, not for each point.
            let known_error = diagnostics.said(Code::ValueCount, array.span);
            Err(known_error.unwrap_or_else(|| {
                diagnostics.error(
                    Diagnostic::new(Code::ValueCount, array.span, message).about(name).help(help),
                )
            }))
        };
        let Some(NameDefinition::Vector(vector)) = entry else {
            if entry.is_none() {
                let none = OpenArguments::new();
                return Err(self.unknown_name(name, array.span, &none, diagnostics));
            }
            let message = format!("`{name}` is not an array of constants or parameters");
            return refuse(message, "write the values: `= (…, …)`", diagnostics);
        };
        let vector = &self.scope.vectors[vector];
        let (kind, place) = (vector.kind, vector.place.clone()?);
        if place.count() as usize != n || place.shape.axes().len() != 1 {
            let message = format!(
                "`{}` has {n} abscissae, and `{name}` has {} elements",
                table.name.text,
                place.count()
            );
            return refuse(message, "let the array have one for each", diagnostics);
        }
        let dimension = self.scope.dimension(name)?;
        if dimension != unit.dimension {
            let spelling = &self.scope.spelling;
            let message = format!(
                "the values of `{}` are declared in `{}`, but `{name}` is {}",
                table.name.text,
                unit.symbol,
                spelling.being(dimension)
            );
            let known_error = diagnostics.said(Code::UnitsOfSides, array.span);
            return Err(known_error.unwrap_or_else(|| {
                diagnostics.error(
                    Diagnostic::new(Code::UnitsOfSides, array.span, message)
                        .about(&table.name.text)
                        .about(name),
                )
            }));
        }
        let position = place.first + k;
        let symbol = match kind {
            ArrayKind::Constant => Symbol::Constant(position),
            ArrayKind::Parameter => Symbol::Parameter(position),
            ArrayKind::Input | ArrayKind::State | ArrayKind::Unknown | ArrayKind::Held => {
                let message = format!("a table is the same at all times, but `{name}` is an input");
                return refuse(message, "use constants or parameters", diagnostics);
            }
        };
        Ok(self.graph.symbol(symbol))
    }

    /// Checks that a value is finite, and the same at all times.
    pub(in crate::model::expression) fn verify_ordinate(
        &self,
        value: ExprId,
        expr: &Expr,
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        let is_fixed =
            |symbol: Symbol| matches!(symbol, Symbol::Constant(_) | Symbol::Parameter(_));
        if !self.graph.symbols(value).into_iter().all(is_fixed) {
            let culprit = self.first_unknown(value, |symbol| !is_fixed(symbol));
            let message =
                format!("a table is the same at all times, but this depends on {culprit}");
            return Err(diagnostics.error(
                Diagnostic::new(Code::ValueNotConstant, expr.span, message)
                    .help("values of a table are made of numbers, constants and parameters"),
            ));
        }
        match self.number(value) {
            Some(number) if !number.is_finite() => {
                Err(diagnostics.error(not_finite(number, expr.span)))
            }
            _ => Ok(()),
        }
    }
}

/// The value of a point.
#[derive(Debug, Clone, Copy)]
pub(in crate::model::expression) enum Ordinate<'a> {
    Of(&'a Expr),
    /// The element at this distance from the first of the named array.
    Element(&'a Expr, u32),
}

/// Arguments, value and place of each point.
pub(in crate::model::expression) type WrittenPoints<'a> = (Vec<&'a Expr>, Ordinate<'a>, Span);

pub(in crate::model::expression) fn written<'a>(
    table: TableDeclaration<'a>,
    diagnostics: &mut Diagnostics,
) -> Result<Vec<WrittenPoints<'a>>, ErrorReported> {
    let points = match table.points {
        TablePoints::Columns([x, y]) => {
            if let [array] = &y[..]
                && x.len() > 1
            {
                let element =
                    |(k, x): (u32, &'a Expr)| (vec![x], Ordinate::Element(array, k), x.span);
                return Ok((0..).zip(x).map(element).collect());
            }
            return Ok(x.iter().zip(y).map(|(x, y)| (vec![x], Ordinate::Of(y), y.span)).collect());
        }
        TablePoints::Written(points) | TablePoints::File { rows: Some(Ok(points)), .. } => points,
        TablePoints::File { rows: Some(Err(reported)), .. } => return Err(*reported),
        TablePoints::File { path, path_span, rows: None } => {
            let message = format!("`{path}` is not read here");
            return Err(diagnostics.error(
                Diagnostic::new(Code::UnusableImport, *path_span, message)
                    .about(path)
                    .help("a table of an effect has its points written out"),
            ));
        }
    };
    let of_point = |numbers: &'a [Expr]| numbers.split_last();
    let spans = points.iter().filter_map(|point| {
        let (value, at) = of_point(&point.numbers)?;
        Some((at.iter().collect(), Ordinate::Of(value), point.span))
    });
    Ok(spans.collect())
}
