//! Values and points in the units of a table, for messages.

use dgd_signature::number::with_unit;

use crate::expr::display::number;
use crate::model::scope::TableDeclaration;
use crate::syntax::ast::FormalArgument;
use crate::units::Unit;

/// An SI value in another unit.
pub(super) fn in_unit(value: f64, unit: &Unit) -> String {
    with_unit(plain(value, unit), &unit.symbol)
}

/// [`in_unit`] without the unit, and without the rounding error of the conversion.
pub(super) fn plain(value: f64, unit: &Unit) -> String {
    let in_unit = (value - unit.offset) / unit.factor;
    number(format!("{in_unit:.12e}").parse().unwrap_or(in_unit))
}

/// `q = 1200 lpm, w = 40 %`
pub(super) fn place_of(table: TableDeclaration<'_>, units: &[Unit], at: &[f64]) -> String {
    let named = table.arguments.iter().zip(units).zip(at);
    let one = |((argument, unit), x): ((&FormalArgument, &Unit), &f64)| {
        format!("{} = {}", argument.name.text, in_unit(*x, unit))
    };
    named.map(one).collect::<Vec<_>>().join(", ")
}
