//! The static description of a generated model.

use proc_macro2::{Literal, TokenStream};
use quote::quote;

use super::{index, number};
use crate::program::{
    AutomatonKind, Crossing, Direction, Interpolation, Program, RUNS, ResultKind, Transition,
    Trigger,
};
use crate::units::Unit;

pub(super) fn signature(program: &Program) -> TokenStream {
    let name = &program.name;
    let unknowns = program.unknowns.iter().map(|unknown| {
        let name = &unknown.name;
        let unit = unit(&unknown.unit);
        let nominal = optional(unknown.nominal);
        let differential = unknown.differential;
        quote! {
            ::dgd::__runtime::system::Unknown {
                name: Text::Borrowed(#name),
                unit: #unit,
                nominal: #nominal,
                differential: #differential,
            }
        }
    });
    let equations = program.unknowns.iter().map(|unknown| {
        let label = &unknown.equation;
        quote!(Text::Borrowed(#label))
    });
    let parameters = program.parameters.iter().map(|parameter| {
        let name = &parameter.declared.name;
        let unit = unit(&parameter.declared.unit);
        let [value, lower, upper] = [parameter.value, parameter.lower, parameter.upper].map(number);
        let nominal = optional(parameter.nominal);
        let (log, fixed) = (parameter.log, parameter.fixed);
        quote! {
            ::dgd::__runtime::system::Parameter {
                name: Text::Borrowed(#name),
                unit: #unit,
                value: #value,
                lower: #lower,
                upper: #upper,
                nominal: #nominal,
                log: #log,
                fixed: #fixed,
            }
        }
    });
    let inputs = program.inputs.iter().map(|input| {
        let name = &input.declared.name;
        let unit = unit(&input.declared.unit);
        let interpolation = match input.interpolation {
            Interpolation::Hold => quote!(::dgd::__runtime::system::Interpolation::Hold),
            Interpolation::Linear => quote!(::dgd::__runtime::system::Interpolation::Linear),
        };
        quote! {
            ::dgd::__runtime::system::Input {
                name: Text::Borrowed(#name),
                unit: #unit,
                interpolation: #interpolation,
            }
        }
    });
    let outputs = program.outputs.iter().map(|output| {
        let name = &output.name;
        let unit = unit(&output.unit);
        let noise = optional(output.noise);
        let delay = match output.delay {
            None => quote!(::core::option::Option::None),
            Some(delay) => {
                let delay = index(delay);
                quote!(::core::option::Option::Some(#delay))
            }
        };
        quote! {
            ::dgd::__runtime::system::Output {
                name: Text::Borrowed(#name),
                unit: #unit,
                noise: #noise,
                delay: #delay,
            }
        }
    });
    let delays = program.delays.iter().map(|text| quote!(Text::Borrowed(#text)));
    let varying_delays = program.varying_delays.iter().map(|text| quote!(Text::Borrowed(#text)));
    let delayed_inputs = program.delayed_inputs.iter().map(|delayed| {
        let (input, delay) = (index(delayed.input), index(delayed.delay));
        quote!(::dgd::__runtime::system::DelayedInput { input: #input, delay: #delay })
    });
    let delayed_unknowns = program.delayed_unknowns.iter().map(|delayed| {
        let (unknown, delay) = (index(delayed.unknown), index(delayed.delay));
        let (varies, has_history) = (delayed.varies, delayed.has_history);
        quote! {
            ::dgd::__runtime::system::DelayedUnknown {
                unknown: #unknown,
                delay: #delay,
                varies: #varies,
                has_history: #has_history,
            }
        }
    });
    let directions = program.directions.iter().map(|direction| match *direction {
        Direction::Parameter(i) => {
            let i = index(i);
            quote!(::dgd::__runtime::system::Direction::Parameter(#i))
        }
        Direction::Start(i) => {
            let i = index(i);
            quote!(::dgd::__runtime::system::Direction::Start(#i))
        }
    });
    let pattern = |kind| pattern(program, kind);
    let jacobian = pattern(ResultKind::Jacobian);
    let dgdy = pattern(ResultKind::Dgdy);
    let parameter_jacobian = pattern(ResultKind::ParameterJacobian);
    let input_jacobian = pattern(ResultKind::InputJacobian);
    let output_jacobians = [ResultKind::Dwdy, ResultKind::Dwdu, ResultKind::Dwdp].map(pattern);
    let discrete = discrete(program);
    let differentiated = program.differentiated_inputs.iter().map(|differentiated| {
        let (input, equation) = (index(differentiated.input), &differentiated.equation);
        quote! {
            ::dgd::__runtime::system::DifferentiatedInput {
                input: #input,
                equation: Text::Borrowed(#equation),
            }
        }
    });
    let signature = quote! {
        ::dgd::__runtime::Signature {
            name: Text::Borrowed(#name),
            unknowns: ::dgd::__runtime::arrays::Unknowns::single(&[#(#unknowns),*]),
            equations: ::dgd::__runtime::arrays::Labels::single(&[#(#equations),*]),
            parameters: List::Borrowed(&[#(#parameters),*]),
            inputs: List::Borrowed(&[#(#inputs),*]),
            delays: List::Borrowed(&[#(#delays),*]),
            varying_delays: List::Borrowed(&[#(#varying_delays),*]),
            delayed_inputs: List::Borrowed(&[#(#delayed_inputs),*]),
            delayed_unknowns: List::Borrowed(&[#(#delayed_unknowns),*]),
            differentiated_inputs: List::Borrowed(&[#(#differentiated),*]),
            outputs: List::Borrowed(&[#(#outputs),*]),
            directions: List::Borrowed(&[#(#directions),*]),
            jacobian: #jacobian,
            sensitivity_jacobian: #dgdy,
            parameter_jacobian: #parameter_jacobian,
            input_jacobian: #input_jacobian,
            output_jacobians: [#(#output_jacobians),*],
            discrete: #discrete,
        }
    };
    let (of, value) = if program.arrays.is_empty() {
        (quote!(::dgd::__runtime::Signature), signature)
    } else {
        let added = arrays(program);
        (
            quote!(::dgd::__runtime::codegen::Lazy<::dgd::__runtime::Signature>),
            quote!(::dgd::__runtime::codegen::Lazy::new(|| {
                ::dgd::__runtime::arrays::with_arrays(#signature, &#added)
            })),
        )
    };
    quote! {
        use ::dgd::__runtime::system::{List, Text};

        static SIGNATURE: #of = #value;
    }
}

/// What arrays add to the description.
fn arrays(program: &Program) -> TokenStream {
    let arrays = program.arrays.iter().map(|array| {
        let (name, lower) = (&array.name, Literal::i64_unsuffixed(array.lower));
        let (count, unit) = (index(array.count as usize), unit(&array.unit));
        let nominal = optional(array.nominal);
        quote! {
            ::dgd::__runtime::arrays::Array {
                name: Text::Borrowed(#name),
                lower: #lower,
                count: #count,
                unit: #unit,
                nominal: #nominal,
            }
        }
    });
    let families = program.families.iter().map(|family| {
        let (count, differential) = (index(family.count as usize), family.differential);
        let equation = &family.equation;
        let lower = match family.lower {
            None => quote!(::core::option::Option::None),
            Some(lower) => {
                let lower = Literal::i64_unsuffixed(lower);
                quote!(::core::option::Option::Some(#lower))
            }
        };
        quote! {
            ::dgd::__runtime::arrays::Family {
                count: #count,
                differential: #differential,
                equation: Text::Borrowed(#equation),
                lower: #lower,
            }
        }
    });
    let outputs = program.output_arrays.iter().map(|array| {
        let (name, lower) = (&array.name, Literal::i64_unsuffixed(array.lower));
        let (count, unit, noise) =
            (index(array.count as usize), unit(&array.unit), optional(array.noise));
        quote! {
            ::dgd::__runtime::arrays::OutputArray {
                name: Text::Borrowed(#name),
                lower: #lower,
                count: #count,
                unit: #unit,
                noise: #noise,
            }
        }
    });
    let runs = RUNS.map(|kind| {
        let runs = program.runs.get(&kind).into_iter().flatten().map(|run| {
            let (row, column) = (index(run.row), index(run.column));
            let (diagonal, count) = (run.diagonal, index(run.count as usize));
            quote! {
                ::dgd::__runtime::arrays::Run {
                    row: #row,
                    column: #column,
                    diagonal: #diagonal,
                    count: #count,
                }
            }
        });
        quote!(List::Borrowed(&[#(#runs),*]))
    });
    quote! {
        ::dgd::__runtime::arrays::Arrays {
            arrays: List::Borrowed(&[#(#arrays),*]),
            families: List::Borrowed(&[#(#families),*]),
            outputs: List::Borrowed(&[#(#outputs),*]),
            runs: [#(#runs),*],
        }
    }
}

fn discrete(program: &Program) -> TokenStream {
    if program.n_discrete() == 0 {
        return quote!(::dgd::__runtime::system::Discrete::NONE);
    }
    let automata = program.automata.iter().map(|automaton| {
        let (name, modes, start) = (&automaton.name, &automaton.modes, index(automaton.start));
        let transitions = automaton.transitions.iter().map(transition);
        let kind = match automaton.kind {
            AutomatonKind::Modes => quote!(::dgd::__runtime::system::AutomatonKind::Modes),
            AutomatonKind::When => quote!(::dgd::__runtime::system::AutomatonKind::When),
            AutomatonKind::Saturation => {
                quote!(::dgd::__runtime::system::AutomatonKind::Saturation)
            }
            AutomatonKind::States => quote!(::dgd::__runtime::system::AutomatonKind::States),
            AutomatonKind::Switch => quote!(::dgd::__runtime::system::AutomatonKind::Switch),
            AutomatonKind::Corner => quote!(::dgd::__runtime::system::AutomatonKind::Corner),
        };
        quote! {
            ::dgd::__runtime::system::Automaton {
                kind: #kind,
                name: Text::Borrowed(#name),
                modes: List::Borrowed(&[#(Text::Borrowed(#modes)),*]),
                start: #start,
                transitions: List::Borrowed(&[#(#transitions),*]),
            }
        }
    });
    let n_time_conditions = index(program.n_time_conditions);
    let event_jacobian = pattern(program, ResultKind::EventJacobian);
    let reset_jacobian = pattern(program, ResultKind::ResetJacobian);
    quote! {
        ::dgd::__runtime::system::Discrete {
            automata: List::Borrowed(&[#(#automata),*]),
            n_time_conditions: #n_time_conditions,
            event_jacobian: #event_jacobian,
            reset_jacobian: #reset_jacobian,
        }
    }
}

fn transition(transition: &Transition) -> TokenStream {
    let (from, to) = (index(transition.from), index(transition.to));
    let crossing = match transition.crossing {
        Crossing::Rises => quote!(::dgd::__runtime::system::Crossing::Rises),
        Crossing::Falls => quote!(::dgd::__runtime::system::Crossing::Falls),
    };
    let trigger = match transition.trigger {
        Trigger::Edge => quote!(::dgd::__runtime::system::Trigger::Edge),
        Trigger::Level => quote!(::dgd::__runtime::system::Trigger::Level),
        Trigger::Entry => quote!(::dgd::__runtime::system::Trigger::Entry),
        Trigger::Start => quote!(::dgd::__runtime::system::Trigger::Start),
    };
    let resets = transition.resets.iter().map(|unknown| index(*unknown));
    quote! {
        ::dgd::__runtime::system::Transition {
            from: #from,
            to: #to,
            crossing: #crossing,
            trigger: #trigger,
            resets: List::Borrowed(&[#(#resets),*]),
        }
    }
}

fn unit(unit: &Unit) -> TokenStream {
    let symbol = &unit.symbol;
    let (factor, offset) = (number(unit.factor), number(unit.offset));
    quote! {
        ::dgd::__runtime::system::Unit {
            symbol: Text::Borrowed(#symbol),
            factor: #factor,
            offset: #offset,
        }
    }
}

fn optional(value: Option<f64>) -> TokenStream {
    let Some(value) = value else { return quote!(::core::option::Option::None) };
    let value = number(value);
    quote!(::core::option::Option::Some(#value))
}

fn pattern(program: &Program, kind: ResultKind) -> TokenStream {
    let places = program.patterns.get(&kind).map_or(&[][..], Vec::as_slice);
    let rows = places.iter().map(|(row, _)| index(*row));
    let columns = places.iter().map(|(_, column)| index(*column));
    quote! {
        ::dgd::__runtime::system::Pattern::single(&[#(#rows),*], &[#(#columns),*])
    }
}
