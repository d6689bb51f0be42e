//! Stepping does not allocate.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System as Allocator};
use std::cell::Cell;
use std::num::NonZeroU32;

use dgd_runtime::{
    InputColumn, Inputs, Interpolation, METHODS, Method, MethodKind, Options, PerSample, Problem,
    SolvableSystem, Steps, simulate_with_sensitivities,
};

use crate::support::problems::{Relaxation, RelaxationStacked, RobertsonDae, RobertsonDaeStacked};
use crate::support::{Heaped, parameters};

/// Counts the allocations of each thread.
struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: everything is passed on to the system's allocator.
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

/// Number of allocations, and of steps.
fn work(system: &impl SolvableSystem, method: &'static Method, tolerance: f64) -> (usize, usize) {
    let p = parameters::<RobertsonDae>();
    let inputs = Inputs::none();
    let problem = Problem { system, p: &p, inputs: &inputs, start: &[] };
    let options = Options { rtol: tolerance, atol: tolerance, method, ..Options::default() };
    let before = COUNT.get();
    let solution = simulate_with_sensitivities(&problem, &[0.0, 20.0, 40.0], &options).unwrap();
    (COUNT.get() - before, solution.statistics.steps)
}

#[test]
fn the_number_of_allocations_does_not_depend_on_the_number_of_steps() {
    fn compare(system: &impl SolvableSystem) {
        let implicit = METHODS.iter().filter(|m| m.kind.is_implicit());
        for method in implicit {
            let (few, some_steps) = work(system, method, 1e-4);
            let (many, more_steps) = work(system, method, 1e-8);
            assert!(more_steps > 2 * some_steps, "{}", method.name);
            assert_eq!(few, many, "{}", method.name);
        }
    }
    compare(&RobertsonDaeStacked::of::<RobertsonDae>());
    compare(&Heaped::of::<RobertsonDae>());
}

#[test]
fn equal_steps_do_not_allocate() {
    fn work(system: &impl SolvableSystem, method: &'static Method, n: u32) -> usize {
        let p = parameters::<Relaxation>();
        let times: Vec<f64> = (0..200).map(f64::from).collect();
        let values: Vec<f64> = times.iter().map(|t| t.sin()).collect();
        let column = InputColumn { name: "u", interpolation: Interpolation::Hold, values: &values };
        let inputs = Inputs::recorded(&times, &[column]).unwrap();
        let problem = Problem { system, p: &p, inputs: &inputs, start: &[] };
        let steps = Steps::PerSample(PerSample::Exactly(NonZeroU32::new(n).unwrap()));
        let options = Options { method, steps, ..Options::default() };
        let before = COUNT.get();
        let solution = simulate_with_sensitivities(&problem, &times, &options).unwrap();
        assert_eq!(solution.statistics.steps, 199 * n as usize);
        COUNT.get() - before
    }
    for method in METHODS {
        if matches!(method.kind, MethodKind::Rosenbrock(_) | MethodKind::Explicit(_)) {
            let (stacked, heaped) =
                (RelaxationStacked::of::<Relaxation>(), Heaped::of::<Relaxation>());
            assert_eq!(work(&stacked, method, 1), work(&stacked, method, 5), "{}", method.name);
            let few = work(&heaped, method, 1);
            assert_eq!(few, work(&heaped, method, 5), "{}", method.name);
            // Segments do not allocate either: there are 199.
            assert!(few < 199, "{}: {few}", method.name);
        }
    }
}
