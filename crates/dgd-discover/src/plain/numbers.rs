//! Numbers of a model's text that may be wrong: constants, and parameters that are not estimated.

use std::collections::BTreeSet;

use dgd_compiler::model::Model;
use dgd_compiler::syntax::ast::{Attribute, AttributeKind, Expr, ExprKind, Item, ItemKind, Name};
use dgd_compiler::syntax::visit;
use dgd_compiler::units::{Unit, mistaken, parse_unit};

use super::{SuspectModel, Suspicion};
use crate::fit::FittedStructure;
use crate::library::BaseModel;

/// A number of the model's text.
#[derive(Debug, Clone)]
pub(crate) struct ModelNumber {
    /// Its name.
    pub(crate) name: String,
    pub(crate) is_constant: bool,
    /// Its value in the text or by `--set`, SI.
    pub(crate) declared: f64,
    pub(crate) unit: Unit,
}

/// Constants of nature, and properties of water and air, by their SI value; rounded ones count, too.
const WELL_KNOWN: [(f64, &str); 15] = [
    (9.806_65, "m/s^2"),
    (8.314_462_618, "J/(mol*K)"),
    (96_485.332_12, "C/mol"),
    (6.022_140_76e23, "1/mol"),
    (1.380_649e-23, "J/K"),
    (1.602_176_634e-19, "C"),
    (5.670_374_419e-8, "W/(m^2*K^4)"),
    (299_792_458.0, "m/s"),
    (273.15, "K"),
    (101_325.0, "Pa"),
    (1000.0, "kg/m^3"),
    (4184.0, "J/(kg*K)"),
    (4.18e6, "J/(m^3*K)"),
    (287.05, "J/(kg*K)"),
    (1005.0, "J/(kg*K)"),
];
/// Relative deviation of a rounded one.
const ROUNDED: f64 = 0.004;

impl ModelNumber {
    /// Whether it is a constant of nature or a property of water or air, which is wrong in few models.
    pub(super) fn is_well_known(&self) -> bool {
        WELL_KNOWN.iter().any(|(value, unit)| {
            let is_alike = parse_unit(unit).is_ok_and(|unit| unit.dimension == self.unit.dimension);
            is_alike && (self.declared / value - 1.0).abs() < ROUNDED
        })
    }

    /// Whether a fit estimates it.
    pub(super) fn is_estimated(&self, fitted: &FittedStructure) -> bool {
        let mut estimates = fitted.estimates.iter().filter(|one| one.recording.is_none());
        estimates.any(|one| one.name == self.name)
    }

    /// Values that it would have in SI if the number was meant in another unit.
    pub(super) fn in_other_units(&self) -> impl Iterator<Item = f64> {
        let number = self.unit.from_si(self.declared);
        mistaken(&self.unit).into_iter().map(move |other| other.to_si(number))
    }

    /// Values with another power of ten.
    pub(super) fn with_other_powers(&self) -> impl Iterator<Item = f64> {
        /// Maximum number of places by which a decimal point has moved.
        const PLACES: i32 = 3;
        let powers = (-PLACES..=PLACES).filter(|power| *power != 0);
        powers.map(move |power| self.declared * 10_f64.powi(power))
    }

    /// The unit in which the number of the text is right, given its estimate and the standard deviation of that, SI.
    pub(crate) fn meant_in(&self, value: f64, std: Option<f64>) -> Option<Unit> {
        /// Minimum ratio of units that can be distinguished.
        const APART: f64 = 1.5;
        let ratio = value / self.declared;
        let spread = std.map_or(f64::NAN, |std| (std / value).abs());
        if spread.is_nan() || spread > 0.1 || (1.0 / APART..APART).contains(&ratio) {
            return None;
        }
        // To the accuracy of the estimate, and to that of a rounded number.
        let within = (3.0 * spread).max(0.005);
        let number = self.unit.from_si(self.declared);
        let off = |unit: &Unit| (unit.to_si(number) / value - 1.0).abs();
        mistaken(&self.unit).into_iter().find(|unit| off(unit) < within)
    }
}

/// All numbers that may be wrong, in the order of the text.
pub(super) fn suspects(
    base: &BaseModel,
    model: &Model,
    fitted: &FittedStructure,
) -> Vec<SuspectModel> {
    let numbers = all(base, model).into_iter();
    let unestimated = numbers.filter(|number| !number.is_estimated(fitted));
    unestimated
        .map(|number| SuspectModel {
            position: 0,
            base: Some(estimating(base, &number)),
            suspicion: Suspicion::Number(number),
            changed: None,
        })
        .collect()
}

/// Constants that are plain numbers, and parameters, in the order of the text.
pub(super) fn all(base: &BaseModel, model: &Model) -> Vec<ModelNumber> {
    let mut numbers = Vec::new();
    visit::items(&base.asts[0].items, &mut |item| {
        numbers.extend(match &item.kind {
            ItemKind::Constant { name, value, .. } if is_number(value) => of_constant(model, name),
            ItemKind::Parameter { name, value, .. } if is_number(value) => {
                of_parameter(base, model, name)
            }
            _ => None,
        });
    });
    numbers
}

fn of_constant(model: &Model, name: &Name) -> Option<ModelNumber> {
    let constant = model.constants.iter().find(|own| own.declared.name == name.text)?;
    let (name, unit, declared) =
        (name.text.clone(), constant.declared.unit.clone(), constant.value);
    Some(ModelNumber { name, is_constant: true, declared, unit })
}

/// A parameter, unless the user fixed it.
fn of_parameter(base: &BaseModel, model: &Model, name: &Name) -> Option<ModelNumber> {
    let parameter = model.parameters.iter().find(|own| own.declared.name == name.text)?;
    if base.fix.contains(&name.text) {
        return None;
    }
    let (name, unit, declared) =
        (name.text.clone(), parameter.declared.unit.clone(), parameter.value);
    Some(ModelNumber { name, is_constant: false, declared, unit })
}

/// The model with a number estimated.
fn estimating(base: &BaseModel, number: &ModelNumber) -> BaseModel {
    let mut base = as_parameter(base, number);
    visit::items_mut(&mut base.asts[0].items, &mut |item| {
        if let ItemKind::Parameter { name, attributes, .. } = &mut item.kind
            && name.text == number.name
        {
            attributes.retain(|attribute| attribute.kind != AttributeKind::Fixed);
        }
    });
    if !base.free.is_empty() {
        base.free.push(number.name.clone());
    }
    base
}

/// The model with a constant as a parameter.
pub(super) fn as_parameter(base: &BaseModel, number: &ModelNumber) -> BaseModel {
    let mut base = base.clone();
    if !number.is_constant {
        return base;
    }
    let items = &mut base.asts[0].items;
    let others = dependants(items, &number.name);
    visit::items_mut(items, &mut |item| {
        if let ItemKind::Constant { name, unit, value } = &item.kind {
            let (name, unit, value) = (name.clone(), unit.clone(), value.clone());
            if name.text == number.name {
                // Its sign is not in doubt.
                let log = AttributeKind::Log;
                let log = Attribute { span: value.span, kind: log };
                let attributes = if number.declared > 0.0 { vec![log] } else { Vec::new() };
                item.kind = ItemKind::Parameter { name, unit, value, attributes };
            } else if others.contains(&name.text) {
                item.kind = ItemKind::Let { name, unit, value };
            }
        }
    });
    base
}

/// Constants that are computed from another one.
fn dependants(items: &[Item], name: &str) -> BTreeSet<String> {
    let mut dependants = BTreeSet::from([name.to_owned()]);
    loop {
        let before = dependants.len();
        visit::items(items, &mut |item| {
            if let ItemKind::Constant { name, value, .. } = &item.kind
                && dependants.iter().any(|known| reads(value, known))
            {
                dependants.insert(name.text.clone());
            }
        });
        if dependants.len() == before {
            dependants.remove(name);
            return dependants;
        }
    }
}

fn reads(expr: &Expr, name: &str) -> bool {
    matches!(&expr.kind, ExprKind::Name(own) if own == name)
        || visit::operands(expr).into_iter().any(|operand| reads(operand, name))
}

/// Whether a value is a plain number.
fn is_number(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Number { .. } => true,
        ExprKind::Negate(inner) | ExprKind::Group(inner) => is_number(inner),
        _ => false,
    }
}
