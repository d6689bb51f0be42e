//! Turns points into curves.

use super::super::ExprLowering;
use super::super::resolved_table::TableTerm;
use super::points::SiPoint;
use super::shown::{in_unit, place_of, plain};
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::curve::interpolate::through;
use crate::expr::curve::{CurveId, TableCurve};
use crate::model::scope::TableDeclaration;
use crate::syntax::ast::{AttributeKind, TableExtrapolation, TableInterpolation};
use crate::units::Unit;

/// Slopes that differ by this little differ by rounding only.
const SAME_SLOPE: f64 = 1e-12;

impl<'a> ExprLowering<'a> {
    /// The terms of a table of one argument.
    pub(super) fn curve(
        &self,
        table: TableDeclaration<'a>,
        maker: &CurveMaker<'_>,
        points: &[SiPoint],
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<TableTerm>, ErrorReported> {
        let x: Vec<f64> = points.iter().map(|point| point.at[0]).collect();
        let mut places = x.clone();
        places.dedup();
        verify_count(table, 0, &places, points, diagnostics)?;
        let shape = shape_of(table).unwrap_or(TableInterpolation::Pchip);
        let is_fitted = |point: &SiPoint| self.number(point.value).is_none();
        let fitted: Vec<usize> = (0..points.len()).filter(|k| is_fitted(&points[*k])).collect();
        if let (TableInterpolation::Pchip, Some(first)) = (shape, fitted.first()) {
            let name = self.first_unknown(points[*first].value, |_| true);
            let message =
                format!("`pchip` needs values that are known, and this one depends on {name}");
            return Err(diagnostics.error(
                Diagnostic::new(Code::InvalidTablePoints, points[*first].span, message).help(format!(
                    "a table of parameters is `linear` or `natural`: write one of them behind the points of `{}`",
                    table.name.text
                )),
            ));
        }
        let mut terms = Vec::new();
        let mut push = |first, ordinate| terms.push(TableTerm { first, second: None, ordinate });
        if fitted.len() < points.len() {
            let y: Vec<f64> = points.iter().map(|point| known(self, point)).collect();
            let whole = if fitted.is_empty() { CurveRole::Whole } else { CurveRole::Term };
            push(maker.curve(0, shape, table.name.text.clone(), (&x, &y), whole), None);
        }
        for k in fitted {
            let name = format!("{}[{}]", table.name.text, k + 1);
            let unit = unit_vector(x.len(), k);
            let curve = maker.curve(0, shape, name, (&x, &unit), CurveRole::Term);
            push(curve, Some(points[k].value));
        }
        Ok(terms)
    }

    /// The terms of a grid: one for each coordinate of the shorter axis.
    pub(super) fn grid(
        &self,
        table: TableDeclaration<'a>,
        maker: &CurveMaker<'_>,
        points: &[SiPoint],
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<TableTerm>, ErrorReported> {
        let axes = [0, 1].map(|axis| {
            let mut places: Vec<f64> = points.iter().map(|point| point.at[axis]).collect();
            places.sort_by(f64::total_cmp);
            places.dedup();
            places
        });
        for (axis, places) in axes.iter().enumerate() {
            verify_count(table, axis, places, points, diagnostics)?;
        }
        let [x, y] = &axes;
        self.verify_grid(table, maker, &axes, points, diagnostics)?;
        let shape = match shape_of(table) {
            Some(TableInterpolation::Pchip) => {
                let message = format!("the grid `{}` is `linear` or `cubic`", table.name.text);
                return Err(diagnostics.error(
                    Diagnostic::new(Code::InvalidTablePoints, table.name.span, message)
                        .about(&table.name.text)
                        .help("`pchip` goes through the points of one argument"),
                ));
            }
            other => other.unwrap_or(TableInterpolation::Linear),
        };
        // Points are ordered by x, then by y.
        let value = |i: usize, j: usize| known(self, &points[i * y.len() + j]);
        let name = &table.name.text;
        let mut terms = Vec::new();
        let by_second = y.len() <= x.len();
        for k in 0..if by_second { y.len() } else { x.len() } {
            let along = |axis: usize, values: &[f64], name: String| {
                maker.curve(axis, shape, name, (&axes[axis], values), CurveRole::Term)
            };
            let base = |axis: usize| {
                along(axis, &unit_vector(axes[axis].len(), k), format!("{name}[{}]", k + 1))
            };
            let (first, second) = if by_second {
                let row: Vec<f64> = (0..x.len()).map(|i| value(i, k)).collect();
                (along(0, &row, format!("{name}[, {}]", k + 1)), base(1))
            } else {
                let row: Vec<f64> = (0..y.len()).map(|j| value(k, j)).collect();
                (base(0), along(1, &row, format!("{name}[{}, ]", k + 1)))
            };
            terms.push(TableTerm { first, second: Some(second), ordinate: None });
        }
        Ok(terms)
    }

    /// Checks that every coordinate of one axis has a point at every coordinate of the other, with a known value.
    fn verify_grid(
        &self,
        table: TableDeclaration<'a>,
        maker: &CurveMaker<'_>,
        [x, y]: &[Vec<f64>; 2],
        points: &[SiPoint],
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        if let Some(point) = points.iter().find(|point| self.number(point.value).is_none()) {
            let name = self.first_unknown(point.value, |_| true);
            let message = format!("values of a grid are known, and this one depends on {name}");
            return Err(diagnostics.error(
                Diagnostic::new(Code::InvalidTablePoints, point.span, message)
                    .help("values that are fitted stand in a table of one argument"),
            ));
        }
        let mut rest = points;
        for at in x {
            for other in y {
                match rest.split_first() {
                    Some((point, behind)) if point.at == [*at, *other] => rest = behind,
                    _ => {
                        let place = place_of(table, maker.units, &[*at, *other]);
                        let message =
                            format!("the grid `{}` has no point at {place}", table.name.text);
                        let beside = points.iter().find(|point| point.at[0] == *at);
                        let span = beside.map_or(table.name.span, |point| point.span);
                        return Err(diagnostics.error(
                            Diagnostic::new(Code::InvalidTablePoints, span, message)
                                .about(&table.name.text)
                                .here("a point beside it")
                                .help("a grid has a point for each pair of its arguments"),
                        ));
                    }
                }
            }
        }
        Ok(())
    }
}

/// Checks that there are points at two coordinates at least.
fn verify_count(
    table: TableDeclaration<'_>,
    axis: usize,
    places: &[f64],
    points: &[SiPoint],
    diagnostics: &mut Diagnostics,
) -> Result<(), ErrorReported> {
    if places.len() >= 2 {
        return Ok(());
    }
    let span = points.first().map_or(table.name.span, |point| point.span);
    let name = &table.arguments[axis].name.text;
    let message = format!("the table `{}` has points at one `{name}` only", table.name.text);
    Err(diagnostics.error(
        Diagnostic::new(Code::InvalidTablePoints, span, message)
            .about(&table.name.text)
            .about(name)
            .help("it needs two at least; what is the same everywhere is a `constant`"),
    ))
}

fn unit_vector(n: usize, k: usize) -> Vec<f64> {
    (0..n).map(|i| if i == k { 1.0 } else { 0.0 }).collect()
}

fn shape_of(table: TableDeclaration<'_>) -> Option<TableInterpolation> {
    table.attributes.iter().find_map(|attribute| match attribute.kind {
        AttributeKind::Linear => Some(TableInterpolation::Linear),
        AttributeKind::Shape(shape) => Some(shape),
        _ => None,
    })
}

/// Whether a curve is the whole table, or one of several terms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CurveRole {
    Whole,
    Term,
}

/// Makes the curves of one table.
pub(super) struct CurveMaker<'a> {
    table: TableDeclaration<'a>,
    beyond: TableExtrapolation,
    pub(super) units: &'a [Unit],
}

impl<'a> CurveMaker<'a> {
    pub(super) fn new(table: TableDeclaration<'a>, units: &'a [Unit]) -> Self {
        let beyond = table.attributes.iter().find_map(|attribute| match attribute.kind {
            AttributeKind::Beyond(beyond) => Some(beyond),
            _ => None,
        });
        Self { table, beyond: beyond.unwrap_or(TableExtrapolation::Refuse), units }
    }

    /// The curve through these points of an axis. If it is one of several terms, every knot counts as one at which the
    /// slope jumps.
    fn curve(
        &self,
        axis: usize,
        shape: TableInterpolation,
        name: String,
        (x, y): (&[f64], &[f64]),
        part: CurveRole,
    ) -> CurveId {
        let curve = through(shape, self.beyond, x, y);
        let steps: Vec<f64> =
            x.windows(2).filter(|pair| pair[0] == pair[1]).map(|pair| pair[0]).collect();
        let knots = &curve.knots;
        let n = knots.len();
        let jumps = |k: usize| {
            if steps.contains(&knots[k]) {
                return true;
            }
            let may_jump = if k == 0 || k == n - 1 {
                self.beyond == TableExtrapolation::Hold
            } else {
                shape == TableInterpolation::Linear
            };
            if part == CurveRole::Term {
                return may_jump;
            }
            let [_, c1, c2, c3] = curve.pieces[k];
            let d = if k == 0 { 0.0 } else { knots[k] - knots[k - 1] };
            let (left, right) = (c1 + d * (2.0 * c2 + d * 3.0 * c3), curve.pieces[k + 1][1]);
            may_jump && (left - right).abs() > SAME_SLOPE * left.abs().max(right.abs())
        };
        let kinks: Vec<f64> = (0..n).filter(|k| jumps(*k)).map(|k| knots[k]).collect();
        let smooth = match shape {
            _ if !steps.is_empty() => -1,
            _ if !kinks.is_empty() => 0,
            TableInterpolation::Linear => 3,
            TableInterpolation::Pchip => 1,
            TableInterpolation::Natural | TableInterpolation::Cubic => 2,
        };
        let ends = [knots[0], knots[n - 1]];
        let limit = (self.beyond == TableExtrapolation::Refuse).then(|| self.limit(axis, ends));
        CurveId::store(TableCurve { name, curve, smooth, kinks, ends, limit })
    }

    /// The message when the argument leaves the table.
    fn limit(&self, axis: usize, [low, high]: [f64; 2]) -> String {
        let unit = &self.units[axis];
        let (low, high) = (plain(low, unit), in_unit(high, unit));
        let (table, argument) = (&self.table.name.text, &self.table.arguments[axis].name.text);
        format!("`{argument}` leaves the table `{table}`, which goes from {low} to {high}")
    }
}

/// Known ordinates; zero for the others.
fn known(lowering: &ExprLowering<'_>, point: &SiPoint) -> f64 {
    lowering.number(point.value).unwrap_or(0.0)
}
