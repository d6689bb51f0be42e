//! The condition that coincides with windows, in words and for programs.

use dgd_discover::{ConditionKind, FoundRegime, WindowCondition};
use dgd_runtime::Unit;

use super::result_json::number;
use crate::output::quantity::{of_differences, percent, probability, rounded, with_unit};
use crate::result::discover::ConditionEntry;

/// Digits of a threshold: any value between those inside and outside would do.
const DIGITS: i32 = 3;

/// As text: ``while `q` falls by more than 1.9 lpm per second, taken over 40 s: 94 % of the windows, 3 % of the rest``.
/// Names are between backticks.
pub(super) fn words(condition: &WindowCondition) -> String {
    let WindowCondition { share_inside, share_outside, p_value, shifts, .. } = condition;
    format!(
        "{}: {} of the windows, {} of the rest ({})",
        holds(condition),
        percent(*share_inside),
        percent(*share_outside),
        probability(*p_value, *shifts)
    )
}

/// The condition outside which the base model holds, as a sentence.
pub(super) fn regime(regime: &FoundRegime) -> String {
    let FoundRegime { condition, outside, inside, .. } = regime;
    format!(
        "Except {}, the model explains the recordings: it leaves {} times the noise variance there, and {} times while \
         the condition holds.",
        holds(condition),
        rounded(*outside, 2),
        rounded(*inside, 2),
    )
}

/// ``while `q` falls by more than 1.9 lpm per second, taken over 40 s``.
fn holds(condition: &WindowCondition) -> String {
    let WindowCondition { quantity, kind, .. } = condition;
    let holds = match kind {
        ConditionKind::Above => format!("is above {}", level(condition)),
        ConditionKind::Below => format!("is below {}", level(condition)),
        ConditionKind::Rising => format!("rises by more than {}", slope(condition)),
        ConditionKind::Falling => format!("falls by more than {}", slope(condition)),
        ConditionKind::Changing => format!("changes by more than {}", slope(condition)),
        ConditionKind::Mode(mode) => format!("is in the mode `{mode}`"),
    };
    format!("while `{quantity}` {holds}")
}

/// For programs.
pub(super) fn entry(condition: &WindowCondition) -> ConditionEntry {
    let (kind, mode) = match &condition.kind {
        ConditionKind::Above => ("above", None),
        ConditionKind::Below => ("below", None),
        ConditionKind::Rising => ("rising", None),
        ConditionKind::Falling => ("falling", None),
        ConditionKind::Changing => ("changing", None),
        ConditionKind::Mode(mode) => ("mode", Some(mode)),
    };
    let (threshold, unit) = threshold(condition);
    ConditionEntry {
        quantity: condition.quantity.clone(),
        kind: kind.to_owned(),
        mode: mode.cloned(),
        threshold: threshold.and_then(number),
        unit,
        over: condition.over.and_then(number),
        share_inside: number(condition.share_inside),
        share_outside: number(condition.share_outside),
        p_value: number(condition.p_value),
    }
}

/// The threshold in the unit of the quantity, or in that of its slope.
fn threshold(condition: &WindowCondition) -> (Option<f64>, String) {
    let WindowCondition { kind, threshold, unit, .. } = condition;
    match kind {
        ConditionKind::Above | ConditionKind::Below | ConditionKind::Mode(_) => {
            (threshold.map(|threshold| unit.from_si(threshold)), unit.symbol.to_string())
        }
        ConditionKind::Rising | ConditionKind::Falling | ConditionKind::Changing => {
            let Unit { symbol, factor, .. } = of_differences(unit);
            (threshold.map(|threshold| threshold / factor), format!("{symbol}/s"))
        }
    }
}

fn level(condition: &WindowCondition) -> String {
    let (threshold, unit) = threshold(condition);
    with_unit(rounded(threshold.unwrap_or(f64::NAN), DIGITS), &unit)
}

fn slope(condition: &WindowCondition) -> String {
    let (threshold, _) = threshold(condition);
    let unit = of_differences(&condition.unit);
    let each = with_unit(rounded(threshold.unwrap_or(f64::NAN), DIGITS), &unit.symbol);
    let over = rounded(condition.over.unwrap_or(f64::NAN), 2);
    format!("{each} per second, taken over {over} s")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn condition(kind: ConditionKind, threshold: Option<f64>, unit: Unit) -> WindowCondition {
        WindowCondition {
            quantity: "x".to_owned(),
            kind,
            threshold,
            unit,
            over: Some(40.0),
            share_inside: 0.943,
            share_outside: 0.031,
            p_value: 0.002,
            shifts: 499,
        }
    }

    fn unit(symbol: &'static str, factor: f64, offset: f64) -> Unit {
        Unit { symbol: symbol.into(), factor, offset }
    }

    #[test]
    fn levels_and_slopes_are_said_in_their_units() {
        let end = ": 94 % of the windows, 3 % of the rest (p ≤ 0.0020)";
        let flow = || unit("lpm", 1.0 / 60_000.0, 0.0);
        let warm = || unit("°C", 1.0, 273.15);
        let open = || ConditionKind::Mode("open".to_owned());
        for (kind, threshold, unit, said, number, symbol) in [
            (
                ConditionKind::Falling,
                Some(1.9 / 60_000.0),
                flow(),
                "falls by more than 1.90 lpm per second, taken over 40 s",
                Some(1.9),
                "lpm/s",
            ),
            (ConditionKind::Above, Some(293.15), warm(), "is above 20.0 °C", Some(20.0), "°C"),
            (
                ConditionKind::Rising,
                Some(0.5),
                warm(),
                "rises by more than 0.500 K per second, taken over 40 s",
                Some(0.5),
                "K/s",
            ),
            (open(), None, self::unit("1", 1.0, 0.0), "is in the mode `open`", None, "1"),
        ] {
            let condition = condition(kind, threshold, unit);
            assert_eq!(words(&condition), format!("while `x` {said}{end}"));
            let entry = entry(&condition);
            assert_eq!(entry.unit, symbol);
            match number {
                Some(number) => {
                    let written = entry.threshold.expect("a number");
                    assert!((written - number).abs() < 1e-9, "{written}");
                }
                None => {
                    assert_eq!((entry.threshold, entry.mode.as_deref()), (None, Some("open")));
                }
            }
        }
    }
}
