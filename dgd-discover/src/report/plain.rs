//! Reports plain causes.

use dgd_runtime::Unit;

use super::discovery::{ParameterValue, PlainCause, PlainCauses, PlainKind};
use crate::fit::Fitted;
use crate::plain::{Cause, Causes, Suspicion};

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
    let Suspicion::Number(number) = &cause.suspicion;
    let own = fitted.estimates.iter().find(|e| e.recording.is_none() && e.name == number.name);
    let value = own.map_or(number.declared, |own| own.value);
    let std = own.and_then(|own| own.std);
    let (factor, offset) = (number.unit.factor, number.unit.offset);
    let unit = Unit { symbol: number.unit.symbol.clone().into(), factor, offset };
    PlainCause {
        kind: if number.is_constant { PlainKind::Constant } else { PlainKind::Parameter },
        name: number.name.clone(),
        declared: number.declared,
        value: ParameterValue { name: number.name.clone(), unit, value, std, std_model: None },
        meant_in: number.meant_in(value, std).map(|unit| unit.symbol),
    }
}
