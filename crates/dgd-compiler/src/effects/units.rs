//! `[unit(y)]`: the unit of a template's argument.
//!
//! It is the unit of differences: `bar` for `bara`, and `K` for `°C` because an offset of 0 °C means no offset.

use super::Effect;
use crate::syntax::ast::{Ast, ClauseKind, EffectTarget, Expr, SlotKind, WrittenUnit};
use crate::syntax::visit::{units_of_expression_mut, units_of_item_mut};
use crate::units::catalogue::CATALOGUE;
use crate::units::{describe, parse_unit};

/// Visits every unit of an effect's items and clauses.
pub(super) fn each(ast: &Ast, visit: &mut dyn FnMut(&WrittenUnit)) {
    let mut visit_unit = |unit: &mut WrittenUnit| visit(unit);
    for item in &ast.items {
        units_of_item_mut(&mut item.clone(), &mut visit_unit);
    }
    for clause in ast.effect.iter().flat_map(|effect| &effect.clauses) {
        if let Some(expr) = expression_of(&clause.kind) {
            units_of_expression_mut(&mut expr.clone(), &mut visit_unit);
        }
    }
}

/// Whether an effect uses the unit of an equation or of a `let`, which the text need not declare.
pub(super) fn of_equations(effect: &Effect) -> bool {
    let EffectTarget::Template(slots) = &effect.target else { return false };
    let is_inferred = |name: &str| {
        let is_one = |kind: SlotKind| matches!(kind, SlotKind::Equation | SlotKind::Let);
        slots.iter().any(|slot| slot.name.text == name && is_one(slot.kind))
    };
    let mut is_found = false;
    each(&effect.ast, &mut |unit| {
        is_found |= arguments_in(&unit.text).into_iter().any(is_inferred);
    });
    is_found
}

/// The expression of a clause.
fn expression_of(clause: &ClauseKind) -> Option<&Expr> {
    match clause {
        ClauseKind::Kind(_) | ClauseKind::Form(_) => None,
        ClauseKind::Null { value: expr, .. }
        | ClauseKind::Replace { by: expr, .. }
        | ClauseKind::ReplaceOutput { by: expr, .. }
        | ClauseKind::Add { value: expr, .. } => Some(expr),
    }
}

/// The names whose units the text of a unit refers to.
pub(super) fn arguments_in(text: &str) -> Vec<&str> {
    let parts = text.split("unit(").skip(1);
    parts.filter_map(|part| part.split_once(')').map(|(name, _)| name.trim())).collect()
}

/// A unit's text with `unit(NAME)` replaced by the unit that `unit_of` gives for the name.
pub(super) fn opened(text: &str, unit_of: &dyn Fn(&str) -> Option<String>) -> String {
    let Some((before, rest)) = text.split_once("unit(") else {
        return text.to_owned();
    };
    let Some((name, behind)) = rest.split_once(')') else {
        return text.to_owned();
    };
    let symbol = difference(&unit_of(name.trim()).unwrap_or_else(|| "1".to_owned()));
    if before.is_empty() && behind.is_empty() {
        return symbol;
    }
    // A plain number does not change a product, unless a further divisor follows.
    let ends = behind.is_empty() || behind.starts_with(['/', ')']);
    if let Some(before) = before.strip_suffix('/').filter(|_| symbol == "1" && ends) {
        return format!("{before}{}", opened(behind, unit_of));
    }
    // kg/m*s in a product is one unit: (kg/m*s)/h.
    let is_simple = symbol.chars().all(char::is_alphanumeric);
    let symbol = if is_simple { symbol } else { format!("({symbol})") };
    format!("{before}{symbol}{}", opened(behind, unit_of))
}

/// The unit in which differences of a unit's values are measured.
fn difference(symbol: &str) -> String {
    match parse_unit(symbol) {
        Ok(unit) if unit.offset != 0.0 || unit.datum.is_some() => {
            let same = CATALOGUE.iter().find(|row| {
                let (up, down) = row.factor;
                row.dimension == unit.dimension
                    && row.offset == 0.0
                    && row.datum.is_none()
                    && (up / down).to_bits() == unit.factor.to_bits()
            });
            let spelling = same.and_then(|row| row.spellings().next()).map(str::to_owned);
            spelling.unwrap_or_else(|| describe(unit.dimension))
        }
        Ok(_) | Err(_) => symbol.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_arguments_are_those_of_differences() {
        let units = |name: &str| match name {
            "p" => Some("bara".to_owned()),
            "t" => Some("°C".to_owned()),
            "f" => Some("degF".to_owned()),
            "k" => Some("kg/m*s".to_owned()),
            "x" => Some("1".to_owned()),
            _ => None,
        };
        for (text, expected) in [
            ("lpm", "lpm"),
            ("unit(p)", "bar"),
            ("unit(t)", "K"),
            ("unit(f)", "°R"),
            ("unit(p)/h", "bar/h"),
            ("1/unit(k)", "1/(kg/m*s)"),
            ("unit(p)*unit( t )", "bar*K"),
            ("1/unit(x)", "1"),
            ("unit(p)/unit(x)", "bar"),
            ("unit(p)/unit(x)/s", "bar/s"),
            ("unit(p)/unit(x)*s", "bar/1*s"),
            ("unit(x)/unit(p)", "1/bar"),
            ("unit(p", "unit(p"),
        ] {
            assert_eq!(opened(text, &units), expected);
        }
        assert_eq!(arguments_in("unit(p)*unit( t )/s"), ["p", "t"]);
    }
}
