//! Reports plain causes.

use dgd_compiler::units;
use dgd_runtime::Unit;

use super::discovery::{
    ParameterValue, PlainCause, PlainCauses, PlainKind, RecordingsValue, StuckSince,
};
use crate::fit::FittedStructure;
use crate::plain::{
    AnsweringCauses, ColumnFault, DifferingValue, FittedSuspicion, HeldStart, ModelNumber, RATE,
    RecordingGroups, StuckColumn, Suspicion, between,
};

/// Plain causes, the first with the values of its last fit. `names` are those of training and validation recordings.
pub(crate) fn plain_causes(
    causes: &AnsweringCauses,
    last: &FittedStructure,
    names: [&[String]; 2],
) -> PlainCauses {
    let fitted = std::iter::once(last).chain(causes.all.iter().skip(1).map(|one| &one.fitted));
    let pairs = causes.all.iter().zip(fitted);
    PlainCauses {
        causes: pairs.map(|(cause, fitted)| reported(cause, fitted, names)).collect(),
        effects: causes.effects.clone(),
    }
}

fn named(kind: PlainKind, name: &str) -> PlainCause {
    PlainCause {
        kind,
        name: name.to_owned(),
        with: None,
        declared: None,
        value: None,
        unit: None,
        meant_in: None,
        values: Vec::new(),
        since: Vec::new(),
    }
}

fn reported(
    cause: &FittedSuspicion,
    fitted: &FittedStructure,
    names: [&[String]; 2],
) -> PlainCause {
    match &cause.suspicion {
        Suspicion::Number(number) => of_number(number, fitted),
        Suspicion::Start(held) => of_start(held, fitted, names),
        Suspicion::Rate => of_clock(fitted),
        Suspicion::Recordings(difference) => of_recordings(difference, fitted, names),
        Suspicion::Column(ColumnFault::Unit { name, unit, meant_in }) => PlainCause {
            unit: Some(unit.symbol.clone()),
            meant_in: Some(meant_in.symbol.clone()),
            ..named(PlainKind::Unit, name)
        },
        Suspicion::Column(ColumnFault::Exchanged([name, other])) => {
            PlainCause { with: Some(other.clone()), ..named(PlainKind::Exchanged, name) }
        }
        Suspicion::Column(ColumnFault::Between { name, is }) => PlainCause {
            meant_in: Some(between(*is).to_owned()),
            ..named(PlainKind::Interpolation, name)
        },
        Suspicion::Column(ColumnFault::Stuck { name, unit, since, .. }) => {
            let stuck_since = |one: &StuckColumn| StuckSince {
                recording: names[usize::from(one.is_held_out)][one.recording].clone(),
                time: one.time,
                value: valued(name, unit, one.value, None),
            };
            PlainCause {
                unit: Some(unit.symbol.clone()),
                since: since.iter().map(stuck_since).collect(),
                ..named(PlainKind::Stuck, name)
            }
        }
        Suspicion::Column(ColumnFault::Clock { meant_in }) => PlainCause {
            unit: Some("s".to_owned()),
            meant_in: Some(meant_in.symbol.clone()),
            ..named(PlainKind::Clock, "time")
        },
    }
}

fn of_number(number: &ModelNumber, fitted: &FittedStructure) -> PlainCause {
    let estimate = fitted.estimates.iter().find(|e| e.recording.is_none() && e.name == number.name);
    let value = estimate.map_or(number.declared, |estimate| estimate.value);
    let std = estimate.and_then(|estimate| estimate.std);
    let kind = if number.is_constant { PlainKind::Constant } else { PlainKind::Parameter };
    PlainCause {
        declared: Some(number.declared),
        value: Some(valued(&number.name, &number.unit, value, std)),
        unit: Some(number.unit.symbol.clone()),
        meant_in: number.meant_in(value, std).map(|unit| unit.symbol),
        ..named(kind, &number.name)
    }
}

fn of_start(held: &HeldStart, fitted: &FittedStructure, names: [&[String]; 2]) -> PlainCause {
    let values = held.values(fitted).into_iter().map(|(recording, value, std)| RecordingsValue {
        recordings: vec![names[0][recording].clone()],
        held_out: Vec::new(),
        value: valued(&held.state, &held.unit, value, std),
    });
    let (unit, values) = (Some(held.unit.symbol.clone()), values.collect());
    PlainCause { unit, values, ..named(PlainKind::Start, &held.state) }
}

fn of_clock(fitted: &FittedStructure) -> PlainCause {
    let estimate = fitted.estimates.iter().find(|e| e.recording.is_none() && e.name == RATE);
    let unit = units::Unit::one();
    let value = estimate.map(|estimate| valued("clock", &unit, estimate.value, estimate.std));
    PlainCause {
        declared: Some(1.0),
        value,
        unit: Some(unit.symbol),
        ..named(PlainKind::Clock, "time")
    }
}

fn valued(name: &str, unit: &units::Unit, value: f64, std: Option<f64>) -> ParameterValue {
    let (factor, offset) = (unit.factor, unit.offset);
    let unit = Unit { symbol: unit.symbol.clone().into(), factor, offset };
    ParameterValue { name: name.to_owned(), unit, value, std, std_model: None }
}

fn of_recordings(
    difference: &RecordingGroups,
    fitted: &FittedStructure,
    names: [&[String]; 2],
) -> PlainCause {
    let (kind, name, unit) = match &difference.own {
        DifferingValue::Number(number, _) => {
            (PlainKind::DiffersNumber, &*number.name, number.unit.clone())
        }
        DifferingValue::Offset(output, unit) => {
            (PlainKind::DiffersOffset, &**output, unit.of_differences())
        }
        DifferingValue::Clock => (PlainKind::DiffersClock, "time", units::Unit::one()),
    };
    let members = |groups: &[usize], names: &[String], group: usize| -> Vec<String> {
        let both = groups.iter().zip(names).filter(|(own, _)| **own == group);
        both.map(|(_, name)| name.clone()).collect()
    };
    let values = difference.values(fitted).into_iter().enumerate();
    let values = values.map(|(group, (value, std))| RecordingsValue {
        recordings: members(&difference.train, names[0], group),
        held_out: members(&difference.valid, names[1], group),
        value: valued(name, &unit, value, std),
    });
    let values = values.collect();
    PlainCause { unit: Some(unit.symbol.clone()), values, ..named(kind, name) }
}
