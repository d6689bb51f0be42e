//! Conserved quantities at a steady state, as text and JSON.

use std::fmt::Write as _;

use dgd_runtime::linearize::{ConservedCombination, StateSpace};
use dgd_runtime::{Signature, Unit};

use crate::output::columns::quotient;
use crate::output::quantity::{of_differences, with_unit};
use crate::output::table::significant;
use crate::result::linearize::{ConservedEntry, ConservedTerm};

/// Significant digits of printed values.
const DIGITS: usize = 6;
/// Terms of a combination that are printed.
const MOST_TERMS: usize = 8;
/// Tolerance for parallel rows and equal values.
const SAME: f64 = 1e-6;

/// A combination of states that the equations conserve, in declared units.
#[derive(Debug, Clone)]
pub(crate) struct ConservedQuantity {
    named_by: String,
    unit: Unit,
    value: f64,
    at_start: f64,
    /// Name, coefficient and its unit.
    terms: Vec<(String, f64, String)>,
    whatever_inputs: bool,
    is_linear: bool,
    /// An output that equals it up to a factor and a constant, and its value with its unit.
    output: Option<(String, String)>,
}

/// The conserved quantities in declared units.
pub(crate) fn described(
    signature: &Signature,
    system: &StateSpace,
    conserved: &[ConservedCombination],
) -> Vec<ConservedQuantity> {
    let with_output = |own| ConservedQuantity {
        output: output(signature, system, own),
        ..ConservedQuantity::new(signature, own)
    };
    conserved.iter().map(with_output).collect()
}

/// A combination and its value, in declared units.
pub(crate) fn combination(signature: &Signature, own: &ConservedCombination) -> (String, String) {
    let combination = ConservedQuantity::new(signature, own);
    let value = significant(combination.value, DIGITS);
    let value = if combination.unit.symbol == "1" {
        value
    } else {
        format!("{value} {}", combination.unit.symbol)
    };
    (combination.formula(), value)
}

impl ConservedQuantity {
    fn new(signature: &Signature, own: &ConservedCombination) -> Self {
        let unit = of_differences(signature.unknowns.unit(own.named_by));
        let term = |(state, c): &(usize, f64)| {
            let difference = of_differences(signature.unknowns.unit(*state));
            let per = quotient(&unit, &difference);
            let is_own = *state == own.named_by || unit.symbol == difference.symbol;
            let symbol = if is_own { "1".to_owned() } else { per.symbol.to_string() };
            (signature.unknowns.name(*state).into_owned(), c / per.factor, symbol)
        };
        // The state that names the combination comes first.
        let mut terms: Vec<&(usize, f64)> = own.terms.iter().collect();
        terms.sort_by_key(|(state, _)| *state != own.named_by);
        ConservedQuantity {
            named_by: signature.unknowns.name(own.named_by).into_owned(),
            value: own.value / unit.factor,
            at_start: own.at_start / unit.factor,
            terms: terms.into_iter().map(term).collect(),
            whatever_inputs: own.whatever_inputs,
            is_linear: own.is_linear,
            output: None,
            unit,
        }
    }

    /// The combination: `pit - 0.185 m^3/m * h`.
    pub(crate) fn formula(&self) -> String {
        let mut text = String::new();
        for (k, (name, c, unit)) in self.terms.iter().take(MOST_TERMS).enumerate() {
            text.push_str(match (k, *c < 0.0) {
                (0, false) => "",
                (0, true) => "-",
                (_, false) => " + ",
                (_, true) => " - ",
            });
            let size = c.abs();
            if unit != "1" {
                let _ = write!(text, "{} {unit} * ", significant(size, DIGITS));
            } else if (size - 1.0).abs() > 1e-12 {
                let _ = write!(text, "{} * ", significant(size, DIGITS));
            }
            text.push_str(name);
        }
        if self.terms.len() > MOST_TERMS {
            let _ = write!(text, " + … ({} more terms)", self.terms.len() - MOST_TERMS);
        }
        text
    }

    /// The label of its pole at zero.
    pub(crate) fn pole(&self) -> String {
        format!("conserved ({})", self.named_by)
    }

    pub(crate) fn push_text(&self, text: &mut String) {
        let quantity = |value: f64| with_unit(value, &self.unit.symbol);
        let by_inputs = if self.whatever_inputs { "" } else { " with these inputs" };
        let _ = if self.is_linear {
            writeln!(text, "\nconserved{by_inputs}: {}", self.formula())
        } else {
            writeln!(
                text,
                "\nsomething is conserved{by_inputs} that is not linear in the states; close to this point it is\n  {}",
                self.formula()
            )
        };
        if let Some((output, value)) = &self.output {
            let _ = writeln!(text, "  measured by the output `{output}`, {value}");
        }
        let value = quantity(self.value);
        let _ = if !self.is_linear {
            writeln!(text, "  the steady state is where a run from the start values comes to rest")
        } else if self.is_as_at_start() {
            writeln!(text, "  held at its value at the start, {value}")
        } else {
            writeln!(
                text,
                "  held at its value where a run comes to rest, {value}; it was {} at the start, which other modes on \
                 the way did not conserve",
                quantity(self.at_start)
            )
        };
    }

    fn is_as_at_start(&self) -> bool {
        let size = self.value.abs().max(self.at_start.abs());
        (self.value - self.at_start).abs() <= SAME * size
    }

    pub(crate) fn entry(&self) -> ConservedEntry {
        let terms = self.terms.iter().map(|(state, coefficient, unit)| ConservedTerm {
            state: state.clone(),
            coefficient: *coefficient,
            unit: unit.clone(),
        });
        ConservedEntry {
            named_by: self.named_by.clone(),
            combination: self.formula(),
            unit: self.unit.symbol.to_string(),
            value: self.value,
            at_start: self.at_start,
            terms: terms.collect(),
            whatever_inputs: self.whatever_inputs,
            linear: self.is_linear,
            output: self.output.as_ref().map(|(name, _)| name.clone()),
        }
    }
}

/// The first output whose derivatives by the states are a multiple of the combination, and that does not depend on
/// inputs.
fn output(
    signature: &Signature,
    system: &StateSpace,
    own: &ConservedCombination,
) -> Option<(String, String)> {
    let wanted = |column: usize| {
        let unknown = system.states[column];
        own.terms.iter().find(|(state, _)| *state == unknown).map_or(0.0, |(_, c)| *c)
    };
    let name = system.states.binary_search(&own.named_by).ok()?;
    let is_alike = |row: usize| {
        let factor = system.c[(row, name)];
        let departs = |column: usize| {
            let (found, expected) = (system.c[(row, column)], factor * wanted(column));
            (found - expected).abs() > SAME * expected.abs().max(found.abs())
        };
        factor != 0.0
            && system.d.row(row).iter().all(|d| *d == 0.0)
            && !(0..system.states.len()).any(departs)
    };
    let row = (0..system.c.nrows()).find(|row| is_alike(*row))?;
    let output = &signature.outputs[row];
    let value = significant(output.unit.from_si(system.w[row]), DIGITS);
    let value = with_unit(value, &output.unit.symbol);
    Some((output.name.to_string(), value))
}
