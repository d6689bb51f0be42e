//! Runaway parameters: estimates far from the initial guess that the data no longer determines.

use dgd_compiler::argument::{Argument, Spelling};
use dgd_compiler::sentence;
use dgd_identify::ParameterEstimate;
use dgd_runtime::{Parameter, Unit};

use crate::output::table::exact;

/// A runaway parameter has changed by more than this factor.
const FAR: f64 = 100.0;

/// Relative standard deviation above which the data does not determine a parameter.
const UNCERTAIN: f64 = 0.5;

/// Digits of a declared value; unit conversions leave rounding in the fifteenth.
const DECLARED: usize = 14;

/// A sentence about a runaway parameter with bounds that would contain it; `None` for others.
pub(super) fn line(
    parameter: &Parameter,
    estimate: &ParameterEstimate,
    unit: &Unit,
    spelling: Spelling,
) -> Option<String> {
    let began = if parameter.value == 0.0 { parameter.nominal? } else { parameter.value };
    let ratio = (estimate.value / began).abs();
    let is_far = ratio > FAR || ratio < 1.0 / FAR && parameter.value != 0.0;
    let is_uncertain = estimate.std.is_none_or(|std| std >= UNCERTAIN * estimate.value.abs());
    if !is_far || !is_uncertain || estimate.at_bound.is_some() || unit.offset != 0.0 {
        return None;
    }
    let (name, symbol) = (&parameter.name, &unit.symbol);
    let shown = |si: f64| exact(unit.from_si(si), 2);
    // Users copy this line, so it has their own value.
    let declared = exact(unit.from_si(parameter.value), DECLARED);
    let (low, high) = match parameter.value {
        value if value > 0.0 => (value / 10.0, value * 10.0),
        value if value < 0.0 => (value * 10.0, value / 10.0),
        _ => (-10.0 * began.abs(), 10.0 * began.abs()),
    };
    let words = sentence![
        format!(
            "`{name}` ran from {declared} to {} {symbol}, where the data says little about it: give it bounds, as in \
             `parameter {name} [{symbol}] = {declared}  in {} .. {}`, or hold it with ",
            shown(estimate.value),
            shown(low),
            shown(high)
        ),
        Argument::Fix.with(name),
        ".\n"
    ];
    Some(words.spelled(spelling))
}

#[cfg(test)]
mod tests {
    use dgd_compiler::argument::neutral;
    use dgd_runtime::Direction;

    use super::*;

    #[test]
    fn only_far_and_uncertain_ones_ran_away() {
        let unit = Unit { symbol: "mH".into(), factor: 1e-3, offset: 0.0 };
        let parameter = Parameter {
            name: "L".into(),
            unit: unit.clone(),
            value: 2.35e-3,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            nominal: None,
            log: false,
            fixed: false,
        };
        let sentence = |value: f64, std: Option<f64>| {
            let estimate = ParameterEstimate {
                name: "L".to_owned(),
                of: Direction::Parameter(0),
                recording: None,
                value,
                std,
                at_bound: None,
            };
            line(&parameter, &estimate, &unit, neutral)
        };
        assert_eq!(sentence(3e-3, None), None);
        assert_eq!(sentence(0.9, Some(0.01)), None);
        let text = sentence(0.9, Some(0.8)).expect("it ran away");
        assert!(text.contains("from 2.35 to 900 mH"), "{text}");
        assert!(text.contains("`parameter L [mH] = 2.35  in 0.24 .. 24`"), "{text}");
        assert!(text.ends_with("or hold it with `fix = L`.\n"), "{text}");
    }
}
