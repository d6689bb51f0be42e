//! Reports plain causes.

use dgd_runtime::Unit;

use super::discovery::{ParameterValue, PlainCause, PlainCauses, PlainKind};
use crate::fit::Fitted;
use crate::plain::{Cause, Causes, Fault, Number, Suspicion, between};

/// Plain causes; the first has the values of its last fit.
pub(crate) fn plain_causes(causes: &Causes, last: &Fitted) -> PlainCauses {
    let fitted = std::iter::once(last).chain(causes.all.iter().skip(1).map(|one| &one.fitted));
    let all = causes.all.iter().zip(fitted);
    PlainCauses {
        causes: all.map(|(cause, fitted)| reported(cause, fitted)).collect(),
        effects: causes.effects.clone(),
    }
}

fn reported(cause: &Cause, fitted: &Fitted) -> PlainCause {
    let named = |kind: PlainKind, name: &str| PlainCause {
        kind,
        name: name.to_owned(),
        with: None,
        declared: None,
        value: None,
        unit: None,
        meant_in: None,
    };
    match &cause.suspicion {
        Suspicion::Number(number) => of_number(number, fitted),
        Suspicion::Column(Fault::Unit { name, unit, meant_in }) => PlainCause {
            unit: Some(unit.symbol.clone()),
            meant_in: Some(meant_in.symbol.clone()),
            ..named(PlainKind::Unit, name)
        },
        Suspicion::Column(Fault::Exchanged([name, other])) => {
            PlainCause { with: Some(other.clone()), ..named(PlainKind::Exchanged, name) }
        }
        Suspicion::Column(Fault::Between { name, is }) => PlainCause {
            meant_in: Some(between(*is).to_owned()),
            ..named(PlainKind::Interpolation, name)
        },
        Suspicion::Column(Fault::Clock { meant_in }) => PlainCause {
            unit: Some("s".to_owned()),
            meant_in: Some(meant_in.symbol.clone()),
            ..named(PlainKind::Clock, "time")
        },
    }
}

fn of_number(number: &Number, fitted: &Fitted) -> PlainCause {
    let own = fitted.estimates.iter().find(|e| e.recording.is_none() && e.name == number.name);
    let value = own.map_or(number.declared, |own| own.value);
    let std = own.and_then(|own| own.std);
    let (factor, offset) = (number.unit.factor, number.unit.offset);
    let unit = Unit { symbol: number.unit.symbol.clone().into(), factor, offset };
    let name = number.name.clone();
    PlainCause {
        kind: if number.is_constant { PlainKind::Constant } else { PlainKind::Parameter },
        name: name.clone(),
        with: None,
        declared: Some(number.declared),
        value: Some(ParameterValue { name, unit, value, std, std_model: None }),
        unit: Some(number.unit.symbol.clone()),
        meant_in: number.meant_in(value, std).map(|unit| unit.symbol),
    }
}
