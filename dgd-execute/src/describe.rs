//! A program's lists as the runtime's signature.

use dgd_compiler::program::{self, Program, RUNS, ResultKind};
use dgd_compiler::units;
use dgd_runtime::arrays::{Array, Arrays, Family, OutputArray, Run, with_arrays};
use dgd_runtime::system::{
    Automaton, AutomatonKind, Crossing, DelayedInput, DelayedUnknown, DifferentiatedInput,
    Direction, Discrete, Input, Interpolation, Output, Parameter, Pattern, Signature, Text,
    Transition, Trigger, Unit, Unknown,
};

pub(crate) fn signature(program: &Program) -> Signature {
    let single = of_single(program);
    if program.arrays.is_empty() {
        return single;
    }
    let families = program.families.iter().map(|family| Family {
        count: family.count as usize,
        differential: family.differential,
        equation: text(&family.equation),
        lower: family.lower,
    });
    let arrays = program.arrays.iter().map(|array| Array {
        name: text(&array.name),
        lower: array.lower,
        count: array.count as usize,
        unit: unit(&array.unit),
        nominal: array.nominal,
    });
    let run = |run: &program::Run| Run {
        row: run.row,
        column: run.column,
        diagonal: run.diagonal,
        count: run.count as usize,
    };
    let outputs = program.output_arrays.iter().map(|array| OutputArray {
        name: text(&array.name),
        lower: array.lower,
        count: array.count as usize,
        unit: unit(&array.unit),
        noise: array.noise,
    });
    let runs = RUNS.map(|kind| program.runs.get(&kind).into_iter().flatten().map(run).collect());
    let added = Arrays {
        arrays: arrays.collect(),
        families: families.collect(),
        outputs: outputs.collect(),
        runs,
    };
    with_arrays(single, &added)
}

/// The description without arrays.
fn of_single(program: &Program) -> Signature {
    let pattern = |kind| pattern(program, kind);
    Signature {
        name: text(&program.name),
        unknowns: program
            .unknowns
            .iter()
            .map(|unknown| Unknown {
                name: text(&unknown.name),
                unit: unit(&unknown.unit),
                nominal: unknown.nominal,
                differential: unknown.differential,
            })
            .collect(),
        equations: program.unknowns.iter().map(|unknown| text(&unknown.equation)).collect(),
        parameters: program
            .parameters
            .iter()
            .map(|parameter| Parameter {
                name: text(&parameter.declared.name),
                unit: unit(&parameter.declared.unit),
                value: parameter.value,
                lower: parameter.lower,
                upper: parameter.upper,
                nominal: parameter.nominal,
                log: parameter.log,
                fixed: parameter.fixed,
            })
            .collect(),
        inputs: program
            .inputs
            .iter()
            .map(|input| Input {
                name: text(&input.declared.name),
                unit: unit(&input.declared.unit),
                interpolation: match input.interpolation {
                    program::Interpolation::Hold => Interpolation::Hold,
                    program::Interpolation::Linear => Interpolation::Linear,
                },
            })
            .collect(),
        delays: program.delays.iter().map(|delay| text(delay)).collect(),
        varying_delays: program.varying_delays.iter().map(|delay| text(delay)).collect(),
        delayed_inputs: program
            .delayed_inputs
            .iter()
            .map(|delayed| DelayedInput { input: delayed.input, delay: delayed.delay })
            .collect(),
        delayed_unknowns: program
            .delayed_unknowns
            .iter()
            .map(|delayed| DelayedUnknown {
                unknown: delayed.unknown,
                delay: delayed.delay,
                varies: delayed.varies,
                has_history: delayed.has_history,
            })
            .collect(),
        differentiated_inputs: program
            .differentiated_inputs
            .iter()
            .map(|differentiated| DifferentiatedInput {
                input: differentiated.input,
                equation: text(&differentiated.equation),
            })
            .collect(),
        outputs: program
            .outputs
            .iter()
            .map(|output| Output {
                name: text(&output.name),
                unit: unit(&output.unit),
                noise: output.noise,
                delay: output.delay,
            })
            .collect(),
        directions: program
            .directions
            .iter()
            .map(|direction| match *direction {
                program::Direction::Parameter(i) => Direction::Parameter(i),
                program::Direction::Start(i) => Direction::Start(i),
            })
            .collect(),
        jacobian: pattern(ResultKind::Jacobian),
        sensitivity_jacobian: pattern(ResultKind::Dgdy),
        parameter_jacobian: pattern(ResultKind::ParameterJacobian),
        input_jacobian: pattern(ResultKind::InputJacobian),
        output_jacobians: [ResultKind::Dwdy, ResultKind::Dwdu, ResultKind::Dwdp].map(pattern),
        discrete: Discrete {
            automata: program.automata.iter().map(automaton).collect(),
            n_time_conditions: program.n_time_conditions,
            event_jacobian: pattern(ResultKind::EventJacobian),
            reset_jacobian: pattern(ResultKind::ResetJacobian),
        },
    }
}

fn automaton(automaton: &program::Automaton) -> Automaton {
    let transition = |transition: &program::Transition| Transition {
        from: transition.from,
        to: transition.to,
        crossing: match transition.crossing {
            program::Crossing::Rises => Crossing::Rises,
            program::Crossing::Falls => Crossing::Falls,
        },
        trigger: match transition.trigger {
            program::Trigger::Edge => Trigger::Edge,
            program::Trigger::Level => Trigger::Level,
            program::Trigger::Entry => Trigger::Entry,
            program::Trigger::Start => Trigger::Start,
        },
        resets: transition.resets.clone().into(),
    };
    Automaton {
        kind: match automaton.kind {
            program::AutomatonKind::Modes => AutomatonKind::Modes,
            program::AutomatonKind::When => AutomatonKind::When,
            program::AutomatonKind::Saturation => AutomatonKind::Saturation,
            program::AutomatonKind::States => AutomatonKind::States,
            program::AutomatonKind::Switch => AutomatonKind::Switch,
            program::AutomatonKind::Corner => AutomatonKind::Corner,
        },
        name: text(&automaton.name),
        modes: automaton.modes.iter().map(|mode| text(mode)).collect(),
        start: automaton.start,
        transitions: automaton.transitions.iter().map(transition).collect(),
    }
}

fn text(text: &str) -> Text {
    Text::Owned(text.to_owned())
}

fn unit(unit: &units::Unit) -> Unit {
    Unit { symbol: text(&unit.symbol), factor: unit.factor, offset: unit.offset }
}

fn pattern(program: &Program, kind: ResultKind) -> Pattern {
    Pattern::of(program.patterns.get(&kind).map_or(&[][..], Vec::as_slice))
}
