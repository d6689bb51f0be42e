//! The values that an equation reads, for messages about equations that have no value.

use std::fmt;

use dgd_signature::number::{short, with_unit};

use crate::solved::SolvableSystem;
use crate::system::{EvaluationPoint, Pattern, Storage, Unit};

/// Maximum number of values in a message.
const MOST_SHOWN: usize = 5;

/// A value that an equation reads.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadValue {
    /// Its name.
    pub name: String,
    /// Its value, in its declared unit.
    pub value: f64,
    /// Its declared unit.
    pub unit: String,
}

impl ReadValue {
    fn new(name: &str, si: f64, unit: &Unit) -> Self {
        ReadValue { name: name.to_owned(), value: unit.from_si(si), unit: unit.symbol.to_string() }
    }
}

impl fmt::Display for ReadValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ReadValue { name, value, unit } = self;
        write!(f, "`{name}` = {}", with_unit(short(*value, 6), unit))
    }
}

/// `, with x = 1 m and y = 2 m`; empty if nothing is read.
pub(crate) struct WithReadings<'a>(pub(crate) &'a [ReadValue]);

impl fmt::Display for WithReadings<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, reading) in self.0.iter().take(MOST_SHOWN).enumerate() {
            write!(f, "{} {reading}", if k == 0 { ", with" } else { "," })?;
        }
        match self.0.len().checked_sub(MOST_SHOWN) {
            None | Some(0) => Ok(()),
            Some(more) => write!(f, " and {more} more"),
        }
    }
}

/// The unknowns, inputs and parameters that row `row` of f reads at a point; if derivatives with respect to some of
/// them are not finite, only those.
pub(crate) fn readings<S: SolvableSystem>(
    system: &S,
    at: EvaluationPoint<'_>,
    row: usize,
) -> Vec<ReadValue> {
    let signature = system.signature();
    let n = signature.unknowns.len();
    let (mut f, mut dfdt) = (S::Vector::zeros(n), S::Vector::zeros(n));
    let mut by_y = S::Jacobian::zeros(signature.jacobian.len());
    let still = S::Inputs::zeros(signature.n_u());
    system.linearize(at, still.as_ref(), f.as_mut(), by_y.as_mut(), dfdt.as_mut());
    let mut by_u = vec![0.0; signature.input_jacobian.len()];
    system.input_jacobian(at, &mut by_u);
    let mut by_p = vec![0.0; signature.parameter_jacobian.len()];
    system.parameter_jacobian(at, &mut by_p);

    let in_row = |pattern: &Pattern, values: &[f64]| -> Vec<(usize, f64)> {
        let entries = pattern.positions().zip(values);
        entries.filter(|((r, _), _)| *r == row).map(|((_, c), value)| (c, *value)).collect()
    };
    let mut readings: Vec<(ReadValue, bool)> = Vec::new();
    for (i, slope) in in_row(&signature.jacobian, by_y.as_ref()) {
        let unknown = signature.unknowns.get(i);
        readings.push((ReadValue::new(&unknown.name, at.y[i], &unknown.unit), slope.is_finite()));
    }
    for (i, slope) in in_row(&signature.input_jacobian, &by_u) {
        // Delayed inputs and slopes of inputs follow from other values, and are left out.
        if let Some(input) = signature.inputs.get(i) {
            readings.push((ReadValue::new(&input.name, at.u[i], &input.unit), slope.is_finite()));
        }
    }
    for (i, slope) in in_row(&signature.parameter_jacobian, &by_p) {
        let parameter = &signature.parameters[i];
        readings
            .push((ReadValue::new(&parameter.name, at.p[i], &parameter.unit), slope.is_finite()));
    }
    let has_culprit = readings.iter().any(|(_, is_finite)| !is_finite);
    readings
        .into_iter()
        .filter(|(_, is_finite)| !(has_culprit && *is_finite))
        .map(|(reading, _)| reading)
        .collect()
}
