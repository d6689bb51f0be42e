//! Every method on models of the repository: what it costs, that it comes to the same, and that it
//! does not allocate as it steps.
//!
//! `tests/work.txt` holds the work: `UPDATE_GOLDEN=1 cargo test --test compiler work` writes it anew.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System as Allocator};
use std::cell::Cell;
use std::fmt::Write;

use dgd_execute::LoadedSystem;
use dgd_runtime::{
    Direction, InputColumn, Inputs, METHODS, Method, MethodKind, Options, Problem, Solution,
    SolvableSystem, System, simulate, simulate_with_sensitivities,
};

use crate::golden::Goldens;
use crate::inline;
use crate::support::{interpreted, native, root};

/// Counts the allocations of each thread.
struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: everything is handed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        unsafe { Allocator.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { Allocator.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A run of a model.
struct Case {
    model: &'static str,
    variants: &'static [(&'static str, &'static str)],
    /// Values of parameters, SI, that are not the model's own.
    set: &'static [(&'static str, f64)],
    /// Samples of the inputs, SI, the same times for all.
    samples: &'static [f64],
    inputs: &'static [&'static [f64]],
    times: &'static [f64],
}

const CASES: &[Case] = &[
    Case {
        model: "predator_prey",
        variants: &[],
        set: &[],
        samples: &[],
        inputs: &[],
        times: &[0.0, 2e6, 1e7],
    },
    Case {
        model: "robertson",
        variants: &[("form", "dae")],
        set: &[],
        samples: &[],
        inputs: &[],
        times: &[0.0, 4.0, 400.0],
    },
    // Held inputs that jump, without and with an algebraic unknown.
    Case {
        model: "pump_speed_step",
        variants: &[],
        set: &[],
        samples: &[0.0, 300.0, 900.0, 1500.0],
        inputs: &[&[9.09, 10.0, 10.0, 9.5], &[0.02, 0.02, 0.025, 0.025]],
        times: &[0.0, 310.0, 1500.0],
    },
    Case {
        model: "pump_speed_step",
        variants: &[("flow", "static")],
        set: &[],
        samples: &[0.0, 300.0, 900.0, 1500.0],
        inputs: &[&[9.09, 10.0, 10.0, 9.5], &[0.02, 0.02, 0.025, 0.025]],
        times: &[0.0, 310.0, 1500.0],
    },
    // Modes of which unknowns are algebraic or not, a reset, and a condition on time.
    Case {
        model: "tank_with_weir",
        variants: &[],
        set: &[],
        samples: &[0.0, 900.0, 1800.0, 7200.0],
        inputs: &[&[0.0012, 0.0018, 0.0, 0.0]],
        times: &[0.0, 800.0, 1700.0, 3000.0, 7200.0],
    },
    // A switch along which the solution slides, a saturation, and a reset.
    Case {
        model: "dragged_load",
        variants: &[],
        set: &[("melt", 0.1)],
        samples: &[0.0, 4.0],
        inputs: &[&[0.2, 0.2]],
        times: &[0.0, 1.0, 4.0],
    },
    // Index reduction, with states that are selected anew on the way.
    Case {
        model: "pendulum_cartesian",
        variants: &[],
        set: &[],
        samples: &[],
        inputs: &[],
        times: &[0.0, 0.7, 3.0],
    },
    // Arrays. Waves that hardly fade keep errors, so that the run is short.
    Case {
        model: "transmission_line",
        variants: &[],
        set: &[],
        samples: &[0.0, 1.0, 2.0],
        inputs: &[&[0.03, 0.035, 0.035], &[10e5, 10e5, 10e5]],
        times: &[0.0, 0.8, 2.0],
    },
];

/// A case made ready.
struct Ready<S> {
    name: String,
    system: S,
    p: Vec<f64>,
    inputs: Inputs,
    times: &'static [f64],
}

impl Ready<LoadedSystem> {
    /// The case as machine code.
    fn new(case: &Case) -> Self {
        Self::of(native(&format!("models/{}.dgd", case.model), case.variants), case)
    }
}

impl<S: SolvableSystem> Ready<S> {
    fn of(system: S, case: &Case) -> Self {
        let signature = system.signature();
        let columns: Vec<InputColumn<'_>> = signature
            .inputs
            .iter()
            .zip(case.inputs)
            .map(|(input, values)| InputColumn {
                name: &input.name,
                interpolation: input.interpolation,
                values,
            })
            .collect();
        let inputs = if columns.is_empty() {
            Inputs::none()
        } else {
            Inputs::recorded(case.samples, &columns).expect("sound inputs")
        };
        let mut p: Vec<f64> =
            signature.parameters.iter().map(|parameter| parameter.value).collect();
        for (name, value) in case.set {
            let parameter = signature.parameters.iter().position(|p| p.name == *name);
            p[parameter.expect("a parameter of the model")] = *value;
        }
        let mut name = case.model.to_owned();
        for (_, choice) in case.variants {
            let _ = write!(name, " {choice}");
        }
        Self { name, system, p, inputs, times: case.times }
    }

    fn run(&self, method: &'static Method, tolerance: f64) -> Solution {
        let problem =
            Problem { system: &self.system, p: &self.p, inputs: &self.inputs, start: &[] };
        let options = Options { rtol: tolerance, atol: tolerance, method, ..Options::default() };
        let solution = simulate_with_sensitivities(&problem, self.times, &options);
        solution.unwrap_or_else(|failure| panic!("{}, {}: {failure}", self.name, method.name))
    }

    fn run_without_sensitivities(&self, method: &'static Method, tolerance: f64) -> Solution {
        let problem =
            Problem { system: &self.system, p: &self.p, inputs: &self.inputs, start: &[] };
        let options = Options { rtol: tolerance, atol: tolerance, method, ..Options::default() };
        let solution = simulate(&problem, self.times, &options);
        solution.unwrap_or_else(|failure| panic!("{}, {}: {failure}", self.name, method.name))
    }

    /// Explicit methods are for models without algebraic unknowns that are not stiff, and Taylor
    /// series for those that have some.
    fn suits(&self, method: &Method) -> bool {
        match method.kind {
            MethodKind::Taylor(_) => self.system.taylor_series().is_ok(),
            kind => {
                let unknowns = &self.system.signature().unknowns;
                kind.is_implicit() || unknowns.iter().all(|unknown| unknown.differential)
            }
        }
    }
}

fn cases() -> impl Iterator<Item = (Ready<LoadedSystem>, &'static Method)> {
    CASES.iter().flat_map(|case| {
        METHODS.iter().filter_map(move |method| {
            let ready = Ready::new(case);
            ready.suits(method).then_some((ready, method))
        })
    })
}

#[test]
fn the_work_is_what_it_was() {
    let mut text = format!(
        "{:<24} {:<9} {:>6} {:>6} {:>8} {:>7} {:>7} {:>6} {:>6}\n",
        "model", "method", "rtol", "steps", "rejected", "f", "J", "LU", "events"
    );
    for (ready, method) in cases() {
        for tolerance in [1e-4, 1e-8] {
            let solution = ready.run(method, tolerance);
            let s = solution.statistics;
            let _ = writeln!(
                text,
                "{:<24} {:<9} {tolerance:>6.0e} {:>6} {:>8} {:>7} {:>7} {:>6} {:>6}",
                ready.name,
                method.name,
                s.steps,
                s.rejected,
                s.evaluations,
                s.linearizations,
                s.factorisations,
                solution.events.len()
            );
        }
    }
    let mut goldens = Goldens::default();
    goldens.compare(&root().join("tests/work.txt"), &text);
    goldens.finish();
}

/// All methods come to what Rodas5P gives with a tolerance of 1e-11, whose own error is below it.
#[test]
fn all_methods_come_to_the_same() {
    let tolerance = 1e-8;
    // Errors that add up over some hundred steps; see `dgd-runtime/tests/stiff.rs`.
    let most = 300.0 * tolerance;
    for (ready, method) in cases() {
        let expected = ready.run(&METHODS[0], 1e-11);
        let found = ready.run(method, tolerance);
        let signature = ready.system.signature();
        let unknowns = &signature.unknowns;
        let n = unknowns.len();
        // In units of the largest number of each unknown, and of each of its sensitivities, or of the
        // nominal ones where they are larger.
        let scale = |values: &[f64], len: usize, i: usize| {
            values.iter().skip(i).step_by(len).fold(0.0_f64, |most, v| most.max(v.abs()))
        };
        let verify = |what: &str, found: &[f64], numbers: &[f64], len: usize| {
            for (k, (f, e)) in found.iter().zip(numbers).enumerate() {
                let i = k % len % n;
                // As the solver: sizes of S are those of the unknown over those of the parameter.
                let over = match (what, signature.directions.get(k % len / n)) {
                    ("S", Some(Direction::Parameter(j))) => ready.p[*j].abs(),
                    _ => 1.0,
                };
                let nominal = unknowns.nominal(i).unwrap_or(expected.y[i]).abs() / over;
                let size = scale(numbers, len, k % len).max(nominal);
                let unknown = unknowns.name(i);
                let error = (f - e).abs();
                assert!(
                    error <= most * size,
                    "{}, {}: {what} {unknown} errs by {error:e} of {size:e}",
                    ready.name,
                    method.name
                );
            }
        };
        assert_eq!(found.events.len(), expected.events.len(), "{}", ready.name);
        verify("y", &found.y, &expected.y, n);
        verify("S", &found.s, &expected.s, n * expected.n_s);
    }
}

/// As machine code, with the number of unknowns as a constant where there are few, and interpreted.
#[test]
fn all_back_ends_take_the_same_steps_to_the_same_bits() {
    for case in CASES {
        let native = Ready::new(case);
        let path = format!("models/{}.dgd", case.model);
        let interpreted = Ready::of(interpreted(&path, case.variants), case);
        for method in METHODS.iter().filter(|method| native.suits(method)) {
            let label = format!("{}, {}", native.name, method.name);
            // Undefined sensitivities are NaN, which equals nothing.
            let text = |solution: Solution| format!("{solution:?}");
            let expected = text(interpreted.run(method, 1e-5));
            assert!(text(native.run(method, 1e-5)) == expected, "{label}");
            let expected = text(interpreted.run_without_sensitivities(method, 1e-5));
            assert!(text(native.run_without_sensitivities(method, 1e-5)) == expected, "{label}");
        }
    }
}

#[test]
fn the_number_of_allocations_does_not_depend_on_the_number_of_steps() {
    let count = |run: &dyn Fn() -> Solution| {
        let before = COUNT.get();
        let solution = run();
        (COUNT.get() - before, solution.statistics.steps)
    };
    for (ready, method) in cases() {
        let name = format!("{}, {}", ready.name, method.name);
        let (few, some_steps) = count(&|| ready.run(method, 1e-4));
        let (many, more_steps) = count(&|| ready.run(method, 1e-8));
        // Taylor series go to a higher order instead.
        assert_ne!(more_steps, some_steps, "{name}");
        assert_eq!(few, many, "{name}");
        let (few, _) = count(&|| ready.run_without_sensitivities(method, 1e-4));
        let (many, _) = count(&|| ready.run_without_sensitivities(method, 1e-8));
        assert_eq!(few, many, "{name}, without sensitivities");
    }
}

/// Past states are kept in two lists. Each moves when it has doubled.
#[test]
fn the_past_of_delays_grows_by_doubling() {
    let system = inline::system(
        "
model decay
parameter k   [1/s] = 1
parameter tau [s]   = 2
state u [1] = 1
equation decay: der(u) = -k*delay(u, tau)
",
    );
    let (name, inputs) = ("decay".to_owned(), Inputs::none());
    let ready = Ready { name, system, p: vec![1.0, 2.0], inputs, times: &[0.0, 7.0, 20.0] };
    for method in METHODS.iter().filter(|method| ready.suits(method)) {
        let count = |tolerance: f64| {
            let before = COUNT.get();
            let solution = ready.run(method, tolerance);
            (COUNT.get() - before, solution.statistics.steps)
        };
        let ((few, some_steps), (many, more_steps)) = (count(1e-4), count(1e-10));
        assert!(more_steps > 4 * some_steps, "{}: {some_steps}, {more_steps}", method.name);
        let doublings = (more_steps / some_steps).ilog2() as usize + 1;
        assert!(few < many, "{}: {few}, {many}", method.name);
        assert!(many <= few + 2 * doublings, "{}: {few}, {many}", method.name);
    }
}
