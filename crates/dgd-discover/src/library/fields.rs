//! Templates of mechanics, and their neutral twins of the same mathematics.
//!
//! `dry_friction` of a drug is a loss of zero order: a template of mechanics is for balances of forces and torques, and
//! its neutral twin for all others. So each place has one of the two.

use dgd_compiler::model::Model;
use dgd_compiler::units::{Dimension, Unit};

/// Templates of mechanics and their neutral twins, by name.
const TWINS: [[&str; 2]; 6] = [
    ["dry_friction", "zero_order_loss"],
    ["stribeck_friction", "falling_loss"],
    ["cubic_stiffness", "cubic_term"],
    ["quadratic_stiffness", "quadratic_term"],
    ["end_stop", "loss_beyond"],
    ["hysteresis", "loss_with_memory"],
];

/// Whether a template has the name of the field of its arguments, a state and an equation.
pub(super) fn is_of_the_field(template: &str, arguments: &[String], model: &Model) -> bool {
    let state_called = |name: &String| model.unknowns.iter().find(|own| own.declared.name == *name);
    if let Some(state) = arguments.first().and_then(state_called) {
        match template {
            "play" => return is_position(&state.declared.unit),
            "dead_band" => return !is_position(&state.declared.unit),
            _ => {}
        }
    }
    let Some(twins) = TWINS.iter().find(|twins| twins.contains(&template)) else { return true };
    let [state, equation] = arguments else { return true };
    let is_of_mechanics = template == twins[0];
    is_of_mechanics == is_mechanical(model, state, equation)
}

/// Whether a state is a position, a speed or a momentum in a balance of forces, torques or accelerations.
fn is_mechanical(model: &Model, state: &str, equation: &str) -> bool {
    let state = model.unknowns.iter().find(|unknown| unknown.declared.name == state);
    let equation = model.all_equations().find(|own| own.label == equation);
    let (Some(state), Some(equation)) = (state, equation) else { return false };
    let [acceleration, force, torque, angular_acceleration] =
        [[1, 0, -2], [1, 1, -2], [2, 1, -2], [0, 0, -2]].map(dimension);
    let [length, speed, momentum, rate] =
        [[1, 0, 0], [1, 0, -1], [1, 1, -1], [0, 0, -1]].map(dimension);
    let unit = &state.declared.unit;
    let is_one_of = |all: &[Dimension]| all.contains(&unit.dimension);
    let balance = equation.dimension;
    let turns = is_angle(unit) && is_one_of(&[Dimension::ONE, rate]);
    match balance {
        _ if balance == force || balance == acceleration => is_one_of(&[length, speed, momentum]),
        _ if balance == torque => turns || is_one_of(&[rate]),
        _ if balance == angular_acceleration => turns,
        _ => false,
    }
}

/// Whether a unit measures lengths or angles.
fn is_position(unit: &Unit) -> bool {
    let is_number = unit.dimension == Dimension::ONE;
    unit.dimension == dimension([1, 0, 0]) || (is_number && is_angle(unit))
}

/// Whether a unit measures angles, which are dimensionless.
fn is_angle(unit: &Unit) -> bool {
    let mut words = unit.symbol.split(|c: char| !c.is_alphabetic() && c != '°');
    words.any(|word| word.ends_with("rad") || ["deg", "°", "rev", "rpm"].contains(&word))
}

/// The dimension with these exponents of length, mass and time.
fn dimension([length, mass, time]: [i32; 3]) -> Dimension {
    Dimension::from_exponents([mass, length, time, 0, 0, 0, 0])
}
