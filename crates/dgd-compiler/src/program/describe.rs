//! Dae → its signature for solvers, and its description for readers.

use std::collections::BTreeMap;

use dgd_signature::arrays::{Array, Arrays, Family, OutputArray, with_arrays};
use dgd_signature::{
    Automaton, DelayedUnknown, Direction, Discrete, Features, Formulas, Input, List, Output,
    Parameter, Pattern, Signature, StartEquation, Transition, Unit, Unknown,
};

use super::conserved::conserved;
use super::formulas::formulas;
use super::functions::{RUNS, ResultKind};
use super::{ProgramFunction, ProgramSource, QuantityDescription, UnknownRow};
use crate::dae::{self, Dae};
use crate::model::DeclarationHeader;
use crate::units;

/// Names, sizes, units, defaults and sparsity, and the event functions as data.
pub(super) fn signature(
    dae: &Dae,
    directions: &[Direction],
    patterns: &BTreeMap<ResultKind, Pattern>,
    events: &ProgramFunction,
) -> Signature {
    let mut single =
        Signature { conserved: conserved(dae).into(), ..of_single(dae, directions, patterns) };
    single.discrete.event_formulas = formulas(events);
    if dae.arrays.is_empty() {
        return single;
    }
    let families = dae.families.iter().map(|family| Family {
        count: family.count as usize,
        differential: family.differential,
        equation: family.equation.clone().into(),
        lower: family.lower,
    });
    let arrays = dae.arrays.iter().map(|array| Array {
        name: array.name.clone().into(),
        lower: array.lower,
        count: array.count as usize,
        unit: unit(&array.unit),
        nominal: array.nominal,
    });
    let runs = |kind| patterns.get(&kind).map_or(List::Borrowed(&[][..]), |of| of.runs.clone());
    let added = Arrays {
        arrays: arrays.collect(),
        families: families.collect(),
        outputs: output_arrays(dae).into(),
        runs: RUNS.map(runs),
    };
    with_arrays(single, &added)
}

/// Outputs for each element of an array.
pub(super) fn output_arrays(dae: &Dae) -> Vec<OutputArray> {
    let array = |array: &dae::DaeOutputArray| OutputArray {
        name: array.declared.name.clone().into(),
        lower: array.lower,
        count: array.count as usize,
        unit: unit(&array.declared.unit),
        noise: array.noise,
    };
    dae.output_arrays.iter().map(array).collect()
}

/// Features that the model may use.
pub(super) fn features(dae: &Dae, signature: &Signature) -> Features {
    Features {
        events: !dae.automata.is_empty() || !dae.time_conditions.is_empty(),
        past: !dae.delayed_inputs.is_empty() || !dae.delayed_unknowns.is_empty(),
        algebraic: dae
            .unknowns
            .iter()
            .any(|unknown| by_mode(dae, unknown) || !unknown.differential)
            || dae.families.iter().any(|family| !family.differential),
        conserved: !signature.conserved.is_empty(),
    }
}

/// Whether an unknown is differential in some modes and algebraic in others.
fn by_mode(dae: &Dae, unknown: &dae::DaeUnknown) -> bool {
    dae.graph.value(unknown.mass).is_none()
}

/// Parts of the model's text that are not in the signature.
pub(super) fn source(dae: &Dae) -> ProgramSource {
    let declared = |declared: &DeclarationHeader| described(&declared.doc, &declared.unit);
    let row = |unknown: &dae::DaeUnknown| UnknownRow {
        by_mode: by_mode(dae, unknown),
        span: unknown.span,
    };
    ProgramSource {
        doc: dae.doc.clone(),
        unknowns: dae.unknowns.iter().map(|x| described(&x.doc, &x.unit)).collect(),
        rows: dae.unknowns.iter().map(row).collect(),
        arrays: dae.arrays.iter().map(|array| described(&array.doc, &array.unit)).collect(),
        families: dae.families.iter().map(|family| family.span).collect(),
        parameters: dae.parameters.iter().map(|p| declared(&p.declared)).collect(),
        inputs: dae.inputs.iter().map(|input| declared(&input.declared)).collect(),
        outputs: dae.outputs.iter().map(|output| declared(&output.declared)).collect(),
        output_arrays: dae.output_arrays.iter().map(|array| declared(&array.declared)).collect(),
    }
}

fn described(doc: &[String], unit: &units::Unit) -> QuantityDescription {
    QuantityDescription { doc: doc.to_vec(), dimension: unit.dimension }
}

/// The description without arrays.
fn of_single(
    dae: &Dae,
    directions: &[Direction],
    patterns: &BTreeMap<ResultKind, Pattern>,
) -> Signature {
    let pattern = |kind| {
        let of_single =
            |pattern: &Pattern| Pattern { runs: List::Borrowed(&[]), ..pattern.clone() };
        patterns.get(&kind).map_or(Pattern::EMPTY, of_single)
    };
    let unknown = |unknown: &dae::DaeUnknown| Unknown {
        name: unknown.name.clone().into(),
        unit: unit(&unknown.unit),
        nominal: unknown.nominal,
        differential: unknown.differential,
    };
    let delayed_unknown = |of: &dae::DaeDelayedUnknown| DelayedUnknown {
        unknown: dae::position(of.unknown),
        delay: of.delay,
        varies: of.varies,
        has_history: dae.history(dae::position(of.unknown)).is_some(),
    };
    let delay = |delay: &dae::Delay| delay.text.clone().into();
    Signature {
        name: dae.name.clone().into(),
        unknowns: dae.unknowns.iter().map(unknown).collect(),
        equations: dae.unknowns.iter().map(|x| x.equation.clone().into()).collect(),
        parameters: dae.parameters.iter().map(parameter).collect(),
        inputs: dae
            .inputs
            .iter()
            .map(|input| Input {
                name: input.declared.name.clone().into(),
                unit: unit(&input.declared.unit),
                interpolation: input.interpolation,
            })
            .collect(),
        delays: dae.delays.iter().map(delay).collect(),
        varying_delays: dae.varying_delays.iter().map(delay).collect(),
        delayed_inputs: dae.delayed_inputs.clone().into(),
        delayed_unknowns: dae.delayed_unknowns.iter().map(delayed_unknown).collect(),
        differentiated_inputs: dae.differentiated_inputs.clone().into(),
        outputs: dae
            .outputs
            .iter()
            .map(|output| Output {
                name: output.declared.name.clone().into(),
                unit: unit(&output.declared.unit),
                noise: output.noise,
                delay: output.delay,
            })
            .collect(),
        densities: dae.densities.clone().into(),
        directions: directions.to_vec().into(),
        jacobian: pattern(ResultKind::Jacobian),
        sensitivity_jacobian: pattern(ResultKind::Dgdy),
        parameter_jacobian: pattern(ResultKind::ParameterJacobian),
        input_jacobian: pattern(ResultKind::InputJacobian),
        output_jacobians: [ResultKind::Dwdy, ResultKind::Dwdu, ResultKind::Dwdp].map(pattern),
        discrete: Discrete {
            automata: dae.automata.iter().map(automaton).collect(),
            n_time_conditions: dae.time_conditions.len(),
            clocks: dae.clocks.clone().into(),
            event_formulas: Formulas::NONE,
            event_jacobian: pattern(ResultKind::EventJacobian),
            event_directions: pattern(ResultKind::EventDirections),
            reset_jacobian: pattern(ResultKind::ResetJacobian),
            reset_directions: pattern(ResultKind::ResetDirections),
            by_mode: (0..dae.unknowns.len()).filter(|i| by_mode(dae, &dae.unknowns[*i])).collect(),
            jump_jacobian: pattern(ResultKind::JumpJacobian),
            unlocated: dae.unlocated.iter().map(|label| label.clone().into()).collect(),
        },
        starts_at_rest: dae.starts_at_rest,
        start_equations: dae
            .start_equations
            .iter()
            .map(|equation| StartEquation {
                name: equation.name.clone().into(),
                unknown: equation.unknown,
            })
            .collect(),
        conserved: List::Borrowed(&[]),
    }
}

fn parameter(parameter: &crate::model::Parameter) -> Parameter {
    Parameter {
        name: parameter.declared.name.clone().into(),
        unit: unit(&parameter.declared.unit),
        value: parameter.value,
        lower: parameter.lower,
        upper: parameter.upper,
        nominal: parameter.nominal,
        log: parameter.log,
        fixed: parameter.fixed,
    }
}

fn automaton(automaton: &dae::DaeAutomaton) -> Automaton {
    let transition = |transition: &dae::DaeTransition| Transition {
        from: transition.from,
        to: transition.to,
        crossing: transition.crossing,
        trigger: transition.trigger,
        resets: transition.resets.iter().map(|(unknown, _)| dae::position(*unknown)).collect(),
    };
    Automaton {
        name: automaton.name.clone().into(),
        kind: automaton.kind,
        modes: automaton.modes.iter().map(|mode| mode.clone().into()).collect(),
        start: automaton.start,
        transitions: automaton.transitions.iter().map(transition).collect(),
    }
}

fn unit(unit: &units::Unit) -> Unit {
    Unit { symbol: unit.symbol.clone().into(), factor: unit.factor, offset: unit.offset }
}
