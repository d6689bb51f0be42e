//! Many members at once: what each gives is its own, and what `simulate` gives.

use dgd_execute::LoadedSystem;
use dgd_runtime::ensemble::{
    Ensemble, EnsembleQuantities, Member, OwnedTrajectory, reduce, simulate,
};
use dgd_runtime::{
    Failure, InputColumn, Inputs, Interpolation, Options, Problem, SolvableSystem, System,
    find_method, observe,
};

use crate::generated;
use crate::support::{Noise, native};

/// Loaded: lanes of a generated model are compiled for each, and those of one tell as much as those of all.
fn bench_two_state(variants: &[(&str, &str)]) -> LoadedSystem {
    native("models/bench_two_state.dgd", variants)
}

type Outcome = Result<OwnedTrajectory, Failure>;

/// Declared parameters, each moved by up to a tenth.
fn parameter_sets(system: &impl SolvableSystem, count: usize) -> Vec<Vec<f64>> {
    let mut noise = Noise::new(7);
    let parameters = &system.signature().parameters;
    let set = |_| parameters.iter().map(|p| p.value * (1.0 + 0.1 * noise.next())).collect();
    (0..count).map(set).collect()
}

/// Inputs that jump, or go on in straight lines, every 37 s.
fn inputs(system: &impl SolvableSystem) -> Inputs {
    let mut noise = Noise::new(11);
    let times: Vec<f64> = (0..12).map(|k| 37.0 * f64::from(k)).collect();
    let signature = system.signature();
    let samples: Vec<Vec<f64>> = (signature.inputs.iter())
        .map(|input| {
            // In per cent and litres a minute, or of the order of one.
            let size = if input.unit.factor == 1.0 { 0.8 } else { 80.0 * input.unit.factor };
            times.iter().map(|_| size * (1.0 + 0.1 * noise.next())).collect()
        })
        .collect();
    let columns = signature.inputs.iter().zip(&samples);
    let columns: Vec<InputColumn<'_>> = columns
        .map(|(input, values)| InputColumn {
            name: &input.name,
            interpolation: input.interpolation,
            values,
        })
        .collect();
    Inputs::recorded(&times, &columns).expect("sound samples")
}

fn seconds(until: u32) -> Vec<f64> {
    (0..=until).map(f64::from).collect()
}

fn members<'a>(sets: &'a [Vec<f64>], inputs: &'a Inputs) -> Vec<Member<'a>> {
    sets.iter().map(|p| Member { p, inputs, start: &[] }).collect()
}

fn run<S: SolvableSystem + Clone + Send>(
    system: &S,
    members: &[Member<'_>],
    times: &[f64],
    options: &Options,
    threads: usize,
) -> Vec<Outcome> {
    simulate(&Ensemble { system, members }, times, options, threads)
}

fn method(name: &str) -> Options {
    Options { method: find_method(name).expect("a method"), ..Options::default() }
}

#[test]
fn a_member_does_not_depend_on_its_neighbours_its_place_or_the_threads() {
    fn verify<S: SolvableSystem + Clone + Send>(system: &S, name: &str) {
        let (inputs, times) = (inputs(system), seconds(300));
        let sets = parameter_sets(system, 21);
        let members = members(&sets, &inputs);
        let options = method(name);
        let one = run(system, &members, &times, &options, 1);
        assert!(one.iter().all(Result::is_ok), "{name}");
        for threads in [2, 3, 40] {
            assert_eq!(run(system, &members, &times, &options, threads), one, "{name} {threads}");
        }
        let mut backwards = members.clone();
        backwards.reverse();
        let mut reversed = run(system, &backwards, &times, &options, 2);
        reversed.reverse();
        assert_eq!(reversed, one, "{name}");
        for k in [0, 13, 20] {
            let alone = run(system, &members[k..=k], &times, &options, 1);
            assert_eq!(alone, one[k..=k], "{name} {k}");
        }
    }
    verify(&generated::mud_circulation::dynamic_flow::Model, "rodas5p");
    verify(&generated::mud_circulation::dynamic_flow::Model, "tsit5");
    verify(&generated::mud_circulation::static_flow::Model, "rodas5p");
    verify(&generated::mud_circulation::dynamic_flow::Model, "bdf");
}

/// The largest difference of unknowns and outputs, in units of the largest value of each.
fn distance(
    a: &OwnedTrajectory,
    b: &OwnedTrajectory,
    times: &[f64],
    system: &impl SolvableSystem,
) -> f64 {
    let (a, b) = (a.to_trajectory(times), b.to_trajectory(times));
    let signature = system.signature();
    let unknowns = (0..signature.unknowns.len()).map(|i| (a.unknown(i), b.unknown(i)));
    let outputs = (0..signature.outputs.len()).map(|i| (a.output(i), b.output(i)));
    unknowns
        .chain(outputs)
        .map(|(a, b)| {
            let size = b.iter().fold(0.0_f64, |size, b| size.max(b.abs()));
            a.iter().zip(b).fold(0.0_f64, |far, (a, b)| far.max((a - b).abs())) / size
        })
        .fold(0.0, f64::max)
}

/// One member by the integrator itself, quantity by quantity.
fn alone(
    system: &impl SolvableSystem,
    member: &Member<'_>,
    times: &[f64],
    options: &Options,
) -> OwnedTrajectory {
    let problem = Problem { system, p: member.p, inputs: member.inputs, start: member.start };
    let solution = dgd_runtime::simulate(&problem, times, options).expect("a run to the end");
    let observed = observe(&problem, &solution);
    let by_quantity = |values: &[f64]| -> Vec<f64> {
        let width = values.len() / times.len();
        (0..width).flat_map(|i| values.iter().skip(i).step_by(width).copied()).collect()
    };
    OwnedTrajectory::new(by_quantity(&solution.y), by_quantity(&observed.w), solution.statistics)
}

#[test]
fn lanes_are_as_near_to_the_solution_as_the_integrator() {
    fn verify<S: SolvableSystem + Clone + Send>(
        system: &S,
        times: &[f64],
        inputs: &Inputs,
        name: &str,
    ) {
        let sets = parameter_sets(system, 11);
        let members = members(&sets, inputs);
        let options = method(name);
        let sharp = Options { rtol: 1e-11, atol: 1e-11, ..options };
        let outcomes = run(system, &members, times, &options, 1);
        let (mut of_lanes, mut of_integrator) = (0.0_f64, 0.0_f64);
        for (member, outcome) in members.iter().zip(&outcomes) {
            let outcome = outcome.as_ref().expect("a run to the end");
            let exact = alone(system, member, times, &sharp);
            let single = alone(system, member, times, &options);
            of_lanes = of_lanes.max(distance(outcome, &exact, times, system));
            of_integrator = of_integrator.max(distance(&single, &exact, times, system));
        }
        // Equal rules with other rounding; a step that is just accepted here may be just rejected there.
        assert!(of_lanes <= 2.0 * of_integrator + 1e-9, "{name}: {of_lanes} {of_integrator}");
    }
    let times = seconds(400);
    for name in ["rodas5p", "tsit5"] {
        let bench = bench_two_state(&[]);
        verify(&bench, &times, &inputs(&bench), name);
        verify(
            &generated::mud_circulation::dynamic_flow::Model,
            &times,
            &inputs(&generated::mud_circulation::dynamic_flow::Model),
            name,
        );
    }
    let bench = bench_two_state(&[("flow", "static")]);
    verify(&bench, &times, &inputs(&bench), "rodas5p");
    verify(
        &generated::mud_circulation::static_flow::Model,
        &times,
        &inputs(&generated::mud_circulation::static_flow::Model),
        "rodas5p",
    );
    // Rates from 0.04 to 3e7 1/s, and pivots away from the diagonal.
    let decades: Vec<f64> = [0.0].into_iter().chain((-4..6).map(|k| 10_f64.powi(k))).collect();
    verify(&native("models/robertson.dgd", &[]), &decades, &Inputs::none(), "rodas5p");
}

#[test]
fn both_sides_of_a_jump_are_given_where_a_time_is_asked_for_twice() {
    let system = bench_two_state(&[("flow", "static")]);
    let column =
        InputColumn { name: "w", interpolation: Interpolation::Hold, values: &[0.8, 0.88] };
    let inputs = Inputs::recorded(&[0.0, 100.0], &[column]).expect("sound samples");
    let sets = parameter_sets(&system, 9);
    let members = members(&sets, &inputs);
    let asked: [&[f64]; 4] = [
        &[0.0, 50.0, 100.0, 100.0, 150.0],
        &[0.0, 100.0, 100.0],
        &[0.0, 100.0],
        // Replicates.
        &[0.0, 100.0, 100.0, 100.0, 150.0],
    ];
    for times in asked {
        let outcomes = run(&system, &members, times, &Options::default(), 1);
        for (member, outcome) in members.iter().zip(&outcomes) {
            let outcome = outcome.as_ref().expect("a run to the end");
            let single = alone(&system, member, times, &Options::default());
            assert!(distance(outcome, &single, times, &system) < 1e-6, "{times:?}");
        }
    }
}

#[test]
fn generated_and_loaded_models_give_the_same_bits() {
    let loaded = native("models/mud_circulation.dgd", &[("flow", "static")]);
    let system = generated::mud_circulation::static_flow::Model;
    let (inputs, times) = (inputs(&system), seconds(120));
    let sets = parameter_sets(&system, 9);
    let members = members(&sets, &inputs);
    let generated = run(&system, &members, &times, &Options::default(), 1);
    assert_eq!(run(&loaded, &members, &times, &Options::default(), 2), generated);
}

#[test]
fn what_has_no_lanes_is_run_by_the_integrator() {
    fn verify<S: SolvableSystem + Clone + Send>(system: &S, inputs: &Inputs, options: &Options) {
        let times = seconds(60);
        let sets = parameter_sets(system, 5);
        let members = members(&sets, inputs);
        let outcomes = run(system, &members, &times, options, 2);
        for (member, outcome) in members.iter().zip(outcomes) {
            assert_eq!(outcome, Ok(alone(system, member, &times, options)));
        }
    }
    let constant = |system: &dyn Fn() -> usize| Inputs::constant(&vec![1e-3; system()]);
    let weir = native("models/tank_with_weir.dgd", &[]);
    verify(&weir, &constant(&|| weir.signature().inputs.len()), &Options::default());
    let delayed = native("models/delayed_sensor.dgd", &[]);
    verify(&delayed, &constant(&|| delayed.signature().inputs.len()), &Options::default());
    let mud = generated::mud_circulation::dynamic_flow::Model;
    verify(&mud, &inputs(&mud), &method("kencarp4"));
}

#[test]
fn sensitivities_are_those_of_the_integrator() {
    let system = bench_two_state(&[]);
    let (inputs, times) = (inputs(&system), seconds(50));
    let sets = parameter_sets(&system, 3);
    let members = members(&sets, &inputs);
    let ensemble = Ensemble { system: &system, members: &members };
    let options = Options::default();
    let by_members =
        reduce(&ensemble, &times, &options, EnsembleQuantities::Sensitivities, 2, |k, outcome| {
            let outcome = outcome.expect("a run to the end");
            (k, outcome.sensitivity(3).to_vec(), outcome.output_sensitivity(0).to_vec())
        });
    for (k, (number, s, dw)) in by_members.into_iter().enumerate() {
        let problem = members[k].to_problem(&system);
        let solution =
            dgd_runtime::simulate_with_sensitivities(&problem, &times, &options).unwrap();
        let observed = observe(&problem, &solution);
        let at_times =
            |value: &dyn Fn(usize) -> f64| (0..times.len()).map(value).collect::<Vec<_>>();
        assert_eq!(number, k);
        assert_eq!(s, at_times(&|row| solution.s(row)[3]));
        assert_eq!(dw, at_times(&|row| observed.dw(row)[0]));
    }
}

#[test]
fn a_member_that_fails_says_why_and_stops_no_other() {
    let system = bench_two_state(&[]);
    let (inputs, times) = (inputs(&system), seconds(100));
    let mut sets = parameter_sets(&system, 12);
    let sound = run(&system, &members(&sets, &inputs), &times, &Options::default(), 1);
    // M = 0: the slope of the flow is not finite.
    sets[5][0] = 0.0;
    let late = Inputs::recorded(
        &[50.0, 60.0],
        &[InputColumn { name: "w", interpolation: Interpolation::Hold, values: &[0.8, 0.8] }],
    );
    let late = late.expect("sound samples");
    let mut members = members(&sets, &inputs);
    members[9].inputs = &late;
    let outcomes = run(&system, &members, &times, &Options::default(), 2);
    for (k, (outcome, sound)) in outcomes.iter().zip(&sound).enumerate() {
        match (k, outcome) {
            (5, Err(failure)) => assert!(failure.error.to_string().contains("line"), "{failure:?}"),
            (9, Err(failure)) => assert!(failure.error.to_string().contains("50"), "{failure:?}"),
            _ => assert_eq!(outcome, sound, "{k}"),
        }
    }
    // A request without sense is refused for each member.
    let options = Options { rtol: -1.0, ..Options::default() };
    assert!(run(&system, &members, &times, &options, 1).iter().all(Result::is_err));
    let few = Options { max_steps: 3, ..Options::default() };
    assert!(run(&system, &members, &times, &few, 1).iter().all(Result::is_err));
}

#[test]
fn nothing_and_single_times_are_no_special_cases() {
    let system = generated::mud_circulation::static_flow::Model;
    let inputs = inputs(&system);
    let sets = parameter_sets(&system, 3);
    let members = members(&sets, &inputs);
    assert!(run(&system, &[], &seconds(10), &Options::default(), 2).is_empty());
    for times in [vec![], vec![5.0]] {
        let outcomes = run(&system, &members, &times, &Options::default(), 2);
        assert!(outcomes.iter().all(Result::is_ok));
    }
    let start = [(0, 60.0)];
    let moved = Member { start: &start, ..members[0] };
    let outcome = &run(&system, &[moved], &[5.0], &Options::default(), 1)[0];
    assert_eq!(outcome.as_ref().unwrap().to_trajectory(&[5.0]).unknown(0), [60.0]);
}

/// The ensemble of the benchmark (`bench/peers`): CVODES and others agree to seven digits.
#[test]
fn the_mean_level_of_ten_thousand_sets_is_that_of_other_solvers() {
    let system = bench_two_state(&[]);
    let column =
        InputColumn { name: "w", interpolation: Interpolation::Hold, values: &[0.8, 0.88] };
    let inputs = Inputs::recorded(&[0.0, 100.0], &[column]).expect("sound samples");
    let mut state: u64 = 12345;
    let sets: Vec<Vec<f64>> = (0..10_000)
        .map(|_| {
            let moved = |p: &dgd_runtime::Parameter| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                let unit = (state >> 11) as f64 / 9_007_199_254_740_992.0;
                p.value * (1.0 + 0.1 * (2.0 * unit - 1.0))
            };
            system.signature().parameters.iter().map(moved).collect()
        })
        .collect();
    let members = members(&sets, &inputs);
    let times = seconds(1000);
    let ensemble = Ensemble { system: &system, members: &members };
    let options = Options { rtol: 1e-6, atol: 1e-8, ..Options::default() };
    let sums = reduce(&ensemble, &times, &options, EnsembleQuantities::Values, 2, |_, outcome| {
        outcome.expect("a run to the end").unknown(0).iter().sum::<f64>()
    });
    let mean = sums.iter().sum::<f64>() / (sets.len() * times.len()) as f64;
    // Known to half of its last digit, and errors of the order of rtol · h, of both signs.
    assert!((mean - 47.268_515).abs() < 5e-7 + 1e-6, "{mean}");
}
