//! The signature of a generated model as a constant.
//!
//! Every item is the literal of the value of the same name in `dgd-signature`.

use dgd_signature::arrays::{Array, Family, OutputArray, PatternRun};
use dgd_signature::{
    Automaton, Clock, DelayedInput, DelayedUnknown, Density, DifferentiatedInput, Direction,
    Discrete, Distribution, ExactTicks, Formulas, Input, Operation, Output, Parameter, Pattern,
    Signature, StartEquation, Transition, Unit, Unknown,
};
use proc_macro2::{Ident, Literal, Span, TokenStream};
use quote::quote;

use super::curves;
use super::literals::{index, number};
use crate::program::{self, FunctionKind, Program, RUNS};

pub(super) fn signature(program: &Program) -> TokenStream {
    let Signature {
        name,
        unknowns,
        equations,
        parameters,
        inputs,
        delays,
        varying_delays,
        delayed_inputs,
        delayed_unknowns,
        differentiated_inputs,
        outputs: _,
        densities,
        directions,
        jacobian,
        sensitivity_jacobian,
        parameter_jacobian,
        input_jacobian,
        output_jacobians,
        discrete: modes,
        starts_at_rest,
        start_equations,
        conserved,
    } = &program.signature;
    let equations = &equations.single;
    let unknowns = unknowns.single.iter().map(unknown);
    let parameters = parameters.iter().map(parameter);
    let inputs = inputs.iter().map(input);
    let outputs = program.single_outputs().iter().map(output);
    let densities = densities.iter().map(density);
    let delayed_inputs = delayed_inputs.iter().map(delayed_input);
    let delayed_unknowns = delayed_unknowns.iter().map(delayed_unknown);
    let differentiated_inputs = differentiated_inputs.iter().map(differentiated_input);
    let directions = directions.iter().map(|of| direction(*of));
    let [jacobian, dgdy, parameter_jacobian, input_jacobian] =
        [jacobian, sensitivity_jacobian, parameter_jacobian, input_jacobian].map(pattern);
    let output_jacobians = output_jacobians.iter().map(pattern);
    let discrete = discrete(modes, program);
    let start_equations = start_equations.iter().map(|StartEquation { name, unknown }| {
        quote!(StartEquation { name: Text::Borrowed(#name), unknown: #unknown })
    });
    let conserved = conserved.iter().map(|sum| {
        let terms = sum.terms.iter().map(|(unknown, share)| {
            let (unknown, share) = (index(*unknown), number(*share));
            quote!((#unknown, #share))
        });
        quote!(Conserved { terms: List::Borrowed(&[#(#terms),*]) })
    });
    let signature = quote! {
        Signature {
            name: Text::Borrowed(#name),
            unknowns: Unknowns::single(&[#(#unknowns),*]),
            equations: Labels::single(&[#(Text::Borrowed(#equations)),*]),
            parameters: List::Borrowed(&[#(#parameters),*]),
            inputs: List::Borrowed(&[#(#inputs),*]),
            delays: List::Borrowed(&[#(Text::Borrowed(#delays)),*]),
            varying_delays: List::Borrowed(&[#(Text::Borrowed(#varying_delays)),*]),
            delayed_inputs: List::Borrowed(&[#(#delayed_inputs),*]),
            delayed_unknowns: List::Borrowed(&[#(#delayed_unknowns),*]),
            differentiated_inputs: List::Borrowed(&[#(#differentiated_inputs),*]),
            outputs: List::Borrowed(&[#(#outputs),*]),
            densities: List::Borrowed(&[#(#densities),*]),
            directions: List::Borrowed(&[#(#directions),*]),
            jacobian: #jacobian,
            sensitivity_jacobian: #dgdy,
            parameter_jacobian: #parameter_jacobian,
            input_jacobian: #input_jacobian,
            output_jacobians: [#(#output_jacobians),*],
            discrete: #discrete,
            starts_at_rest: #starts_at_rest,
            start_equations: List::Borrowed(&[#(#start_equations),*]),
            conserved: List::Borrowed(&[#(#conserved),*]),
        }
    };
    let (of, value) = if program.signature.unknowns.arrays.is_empty() {
        (quote!(::dgd::__runtime::signature::Signature), signature)
    } else {
        let added = arrays(program);
        (
            quote!(::dgd::__runtime::codegen::Lazy<::dgd::__runtime::signature::Signature>),
            quote!(::dgd::__runtime::codegen::Lazy::new(|| with_arrays(#signature, &#added))),
        )
    };
    // In a block because `Inputs` and `Unknowns` are also types of the module.
    quote! {
        static SIGNATURE: #of = {
            #[allow(unused_imports)]
            use ::dgd::__runtime::signature::{arrays::*, *};
            #value
        };
    }
}

fn unknown(of: &Unknown) -> TokenStream {
    let Unknown { name, unit: declared, nominal, differential } = of;
    let (unit, nominal) = (unit(declared), optional(*nominal));
    quote! {
        Unknown {
            name: Text::Borrowed(#name),
            unit: #unit,
            nominal: #nominal,
            differential: #differential,
        }
    }
}

fn parameter(of: &Parameter) -> TokenStream {
    let Parameter { name, unit: declared, value, lower, upper, nominal, log, fixed } = of;
    let (unit, nominal) = (unit(declared), optional(*nominal));
    let [value, lower, upper] = [*value, *lower, *upper].map(number);
    quote! {
        Parameter {
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
}

fn input(of: &Input) -> TokenStream {
    let Input { name, unit: declared, interpolation } = of;
    let (unit, interpolation) = (unit(declared), ident(interpolation.ident()));
    quote! {
        Input {
            name: Text::Borrowed(#name),
            unit: #unit,
            interpolation: Interpolation::#interpolation,
        }
    }
}

fn output(of: &Output) -> TokenStream {
    let Output { name, unit: declared, noise, delay } = of;
    let (unit, noise) = (unit(declared), optional(*noise));
    let delay = option(delay.map(index));
    quote! {
        Output {
            name: Text::Borrowed(#name),
            unit: #unit,
            noise: #noise,
            delay: #delay,
        }
    }
}

fn density(of: &Density) -> TokenStream {
    let [output, deviation] = [of.output, of.deviation].map(index);
    let distribution = match of.distribution {
        Distribution::Normal => quote!(Distribution::Normal),
        Distribution::LogNormal => quote!(Distribution::LogNormal),
        Distribution::Student { freedom } => {
            let freedom = number(freedom);
            quote!(Distribution::Student { freedom: #freedom })
        }
    };
    quote! {
        Density { output: #output, deviation: #deviation, distribution: #distribution }
    }
}

fn delayed_input(of: &DelayedInput) -> TokenStream {
    let [input, delay] = [of.input, of.delay].map(index);
    quote!(DelayedInput { input: #input, delay: #delay })
}

fn delayed_unknown(of: &DelayedUnknown) -> TokenStream {
    let DelayedUnknown { unknown, delay, varies, has_history } = *of;
    let [unknown, delay] = [unknown, delay].map(index);
    quote! {
        DelayedUnknown {
            unknown: #unknown,
            delay: #delay,
            varies: #varies,
            has_history: #has_history,
        }
    }
}

fn differentiated_input(of: &DifferentiatedInput) -> TokenStream {
    let (input, equation) = (index(of.input), &of.equation);
    quote!(DifferentiatedInput { input: #input, equation: Text::Borrowed(#equation) })
}

fn direction(of: Direction) -> TokenStream {
    match of {
        Direction::Parameter(i) => {
            let i = index(i);
            quote!(Direction::Parameter(#i))
        }
        Direction::Start(i) => {
            let i = index(i);
            quote!(Direction::Start(#i))
        }
    }
}

/// The description of the arrays.
fn arrays(program: &Program) -> TokenStream {
    let unknowns = &program.signature.unknowns;
    let arrays = unknowns.arrays.iter().map(|array| {
        let Array { name, lower, count, unit: declared, nominal } = array;
        let (lower, count) = (Literal::i64_unsuffixed(*lower), index(*count));
        let (unit, nominal) = (unit(declared), optional(*nominal));
        quote! {
            Array {
                name: Text::Borrowed(#name),
                lower: #lower,
                count: #count,
                unit: #unit,
                nominal: #nominal,
            }
        }
    });
    let families = unknowns.families.iter().map(|family| {
        let Family { count, differential, equation, lower } = family;
        let (count, lower) = (index(*count), option(lower.map(Literal::i64_unsuffixed)));
        quote! {
            Family {
                count: #count,
                differential: #differential,
                equation: Text::Borrowed(#equation),
                lower: #lower,
            }
        }
    });
    let outputs = program.output_arrays.iter().map(|array| {
        let OutputArray { name, lower, count, unit: declared, noise } = array;
        let (lower, count) = (Literal::i64_unsuffixed(*lower), index(*count));
        let (unit, noise) = (unit(declared), optional(*noise));
        quote! {
            OutputArray {
                name: Text::Borrowed(#name),
                lower: #lower,
                count: #count,
                unit: #unit,
                noise: #noise,
            }
        }
    });
    let runs = RUNS.map(|kind| {
        let runs = program.pattern(kind).into_iter().flat_map(|pattern| pattern.runs.iter());
        let runs = runs.map(|run| {
            let PatternRun { row, column, diagonal, count } = *run;
            let [row, column, count] = [row, column, count].map(index);
            quote! {
                PatternRun {
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
        Arrays {
            arrays: List::Borrowed(&[#(#arrays),*]),
            families: List::Borrowed(&[#(#families),*]),
            outputs: List::Borrowed(&[#(#outputs),*]),
            runs: [#(#runs),*],
        }
    }
}

fn discrete(of: &Discrete, program: &Program) -> TokenStream {
    if of.is_empty() && of.unlocated.is_empty() {
        return quote!(Discrete::NONE);
    }
    let automata = of.automata.iter().map(|automaton| {
        let Automaton { kind, name, modes, start, transitions } = automaton;
        let (kind, start) = (ident(kind.ident()), index(*start));
        let modes = modes.iter();
        let transitions = transitions.iter().map(transition);
        quote! {
            Automaton {
                kind: AutomatonKind::#kind,
                name: Text::Borrowed(#name),
                modes: List::Borrowed(&[#(Text::Borrowed(#modes)),*]),
                start: #start,
                transitions: List::Borrowed(&[#(#transitions),*]),
            }
        }
    });
    let n_time_conditions = index(of.n_time_conditions);
    let clocks = of.clocks.iter().map(|clock| {
        let Clock { condition, automaton, marks, follows, exact } = clock;
        let (condition, automaton) = (index(*condition), option(automaton.map(index)));
        let marks = marks.iter().map(|mark| number(*mark));
        let exact = option(exact.map(|ExactTicks { first, period, denominator }| {
            let [first, period, denominator] =
                [first, period, denominator].map(Literal::i64_unsuffixed);
            quote!(ExactTicks { first: #first, period: #period, denominator: #denominator })
        }));
        quote! {
            Clock {
                condition: #condition,
                automaton: #automaton,
                marks: List::Borrowed(&[#(#marks),*]),
                follows: #follows,
                exact: #exact,
            }
        }
    });
    let event_formulas = formulas(&of.event_formulas, program);
    let [event_jacobian, event_directions] =
        [&of.event_jacobian, &of.event_directions].map(pattern);
    let [reset_jacobian, reset_directions] =
        [&of.reset_jacobian, &of.reset_directions].map(pattern);
    let jump_jacobian = pattern(&of.jump_jacobian);
    let by_mode = of.by_mode.iter().map(|i| index(*i));
    let unlocated = of.unlocated.iter();
    quote! {
        Discrete {
            automata: List::Borrowed(&[#(#automata),*]),
            n_time_conditions: #n_time_conditions,
            clocks: List::Borrowed(&[#(#clocks),*]),
            event_formulas: #event_formulas,
            event_jacobian: #event_jacobian,
            event_directions: #event_directions,
            reset_jacobian: #reset_jacobian,
            reset_directions: #reset_directions,
            by_mode: List::Borrowed(&[#(#by_mode),*]),
            jump_jacobian: #jump_jacobian,
            unlocated: List::Borrowed(&[#(Text::Borrowed(#unlocated)),*]),
        }
    }
}

/// The event functions as data.
fn formulas(of: &Formulas, program: &Program) -> TokenStream {
    // Operation by operation, from the function that they were compiled into, which names the curves.
    let function = &program.function(FunctionKind::EventFunctions).body;
    let literal = |position: &u32| Literal::u32_unsuffixed(*position);
    let operations = of.operations.iter().zip(function).map(|(operation, own)| match operation {
        Operation::Constant(value) => {
            let value = number(*value);
            quote!(Constant(#value))
        }
        Operation::Time => quote!(Time),
        Operation::Call(name, a) => {
            let a = literal(a);
            quote!(Call(#name, #a))
        }
        Operation::Call2(name, a, b) => {
            let [a, b] = [a, b].map(literal);
            quote!(Call2(#name, #a, #b))
        }
        Operation::Curve(_, a) => {
            let program::ProgramOperation::Curve(curve, _) = own else {
                unreachable!("data and function have the same operations")
            };
            let (curve, a) = (curves::name(*curve), literal(a));
            quote!(Curve(&#curve, #a))
        }
        // The others hold only positions.
        Operation::Unknown(i)
        | Operation::Input(i)
        | Operation::Parameter(i)
        | Operation::Discrete(i)
        | Operation::Negate(i)
        | Operation::Not(i) => named(operation, &[i].map(literal)),
        Operation::Add(a, b)
        | Operation::Subtract(a, b)
        | Operation::Multiply(a, b)
        | Operation::Divide(a, b)
        | Operation::Above(a, b)
        | Operation::NotBelow(a, b)
        | Operation::And(a, b)
        | Operation::Or(a, b) => named(operation, &[a, b].map(literal)),
        Operation::Select(c, a, b) => named(operation, &[c, a, b].map(literal)),
    });
    let operations = operations.map(|operation| quote!(Operation::#operation));
    let results = of.results.iter().map(literal);
    quote! {
        Formulas {
            operations: List::Borrowed(&[#(#operations),*]),
            results: List::Borrowed(&[#(#results),*]),
        }
    }
}

fn named(operation: &Operation, positions: &[Literal]) -> TokenStream {
    let name = ident(operation.ident());
    quote!(#name(#(#positions),*))
}

fn transition(of: &Transition) -> TokenStream {
    let Transition { from, to, crossing, trigger, resets } = of;
    let [from, to] = [*from, *to].map(index);
    let (crossing, trigger) = (ident(crossing.ident()), ident(trigger.ident()));
    let resets = resets.iter().map(|unknown| index(*unknown));
    quote! {
        Transition {
            from: #from,
            to: #to,
            crossing: Crossing::#crossing,
            trigger: Trigger::#trigger,
            resets: List::Borrowed(&[#(#resets),*]),
        }
    }
}

fn unit(of: &Unit) -> TokenStream {
    let (symbol, factor, offset) = (&of.symbol, number(of.factor), number(of.offset));
    quote!(Unit { symbol: Text::Borrowed(#symbol), factor: #factor, offset: #offset })
}

fn pattern(of: &Pattern) -> TokenStream {
    let rows = of.rows.iter().map(|row| index(*row));
    let columns = of.columns.iter().map(|column| index(*column));
    quote!(Pattern::single(&[#(#rows),*], &[#(#columns),*]))
}

fn ident(name: &str) -> Ident {
    Ident::new(name, Span::call_site())
}

fn optional(value: Option<f64>) -> TokenStream {
    option(value.map(number))
}

fn option(value: Option<impl quote::ToTokens>) -> TokenStream {
    match value {
        None => quote!(::core::option::Option::None),
        Some(value) => quote!(::core::option::Option::Some(#value)),
    }
}
