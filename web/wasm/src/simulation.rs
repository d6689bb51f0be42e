//! A simulation with all sensitivities: its events, and samples of all quantities.

use dgd_compiler::pipeline::SensitivityDirections;
use dgd_compiler::source::SourceMap;
use dgd_execute::{Engine, LoadedSystem};
use dgd_runtime::{
    Direction, Inputs, Options, Problem, Signature, Solution, System, find_method, observe,
    simulate_with_sensitivities,
};

use crate::lines::{CLOSE, Lines};
use crate::table::Table;
use crate::texts::compiled;

/// What to simulate.
#[derive(Debug)]
pub(crate) struct Simulation {
    /// Its file below `models`.
    pub(crate) model: &'static str,
    /// Choices other than the first.
    pub(crate) variants: &'static [(&'static str, &'static str)],
    /// Inputs in the units that the model declares, as a [`Table`] reads them.
    pub(crate) inputs: &'static str,
    /// End of the run, s.
    pub(crate) until: f64,
    pub(crate) method: &'static str,
    /// Whether to compare outputs, unless they are zero up to rounding or to errors of the run.
    pub(crate) observed: bool,
    /// Relative tolerance, with respect to the largest number of a quantity.
    pub(crate) close: f64,
}

/// The defaults of most cases.
pub(crate) const USUAL: Simulation = Simulation {
    model: "",
    variants: &[],
    inputs: "",
    until: 0.0,
    method: "rodas5p",
    observed: true,
    close: CLOSE,
};

/// Intervals between samples.
const STRETCHES: usize = 20;
const TOLERANCE: f64 = 1e-8;

impl Simulation {
    pub(crate) fn add_to(&self, lines: &mut Lines) {
        let (mut sources, all) = (SourceMap::default(), SensitivityDirections::All);
        let compiled = compiled(self.model, self.variants, &all, &mut sources);
        let system = LoadedSystem::with_engine(compiled.program, Engine::Interpreter);
        let signature = system.signature();
        let p: Vec<f64> = signature.parameters.iter().map(|parameter| parameter.value).collect();
        let inputs = match self.inputs {
            "" => Inputs::none(),
            text => Table::read(text, f64::INFINITY).inputs(signature),
        };
        let method = find_method(self.method).expect("a method");
        let options = Options { rtol: TOLERANCE, atol: TOLERANCE, method, ..Options::default() };
        let times: Vec<f64> =
            (0..=STRETCHES).map(|k| self.until * k as f64 / STRETCHES as f64).collect();
        let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
        let solution = simulate_with_sensitivities(&problem, &times, &options)
            .unwrap_or_else(|failure| panic!("{}: {failure}", self.model));
        lines.hold_to(self.close);
        add_events(&solution, lines);
        add_samples(&system, &solution, lines);
        if self.observed {
            add_outputs(&problem, &solution, lines);
        }
    }
}

fn add_events(solution: &Solution, lines: &mut Lines) {
    for event in &solution.events {
        let transition = format!("{}: {} -> {}", event.automaton, event.from, event.to);
        lines.text("event", &transition);
    }
    lines.numbers("times of events", solution.events.iter().map(|event| event.t));
    for undefined in &solution.undefined {
        lines.text("undefined", &format!("{:?} in {}", undefined.cause, undefined.equation));
        lines.numbers("undefined since", [undefined.from]);
    }
}

fn add_samples(system: &LoadedSystem, solution: &Solution, lines: &mut Lines) {
    let signature = system.signature();
    let samples = 0..solution.len();
    for (i, unknown) in signature.unknowns.iter().enumerate() {
        let values: Vec<f64> = samples.clone().map(|k| solution.y(k)[i]).collect();
        lines.numbers(&unknown.name, values.iter().copied());
        for j in 0..solution.n_s {
            let slopes = samples.clone().map(|k| solution.s(k)[j * solution.n + i]);
            add_sensitivity(signature, (&unknown.name, &values), j, slopes.collect(), lines);
        }
    }
}

fn add_outputs(problem: &Problem<'_, LoadedSystem>, solution: &Solution, lines: &mut Lines) {
    let signature = problem.system.signature();
    let observed = observe(problem, solution);
    let samples = 0..solution.len();
    for (i, output) in signature.outputs.iter().enumerate() {
        let what = format!("output {}", output.name);
        let values: Vec<f64> = samples.clone().map(|k| observed.w(k)[i]).collect();
        lines.numbers(&what, values.iter().copied());
        for j in 0..observed.n_s {
            let slopes = samples.clone().map(|k| observed.dw(k)[j * observed.n_w + i]);
            add_sensitivity(signature, (&what, &values), j, slopes.collect(), lines);
        }
    }
}

/// Samples of a sensitivity; for one that is zero up to rounding and errors of the run, only that fact is added.
fn add_sensitivity(
    signature: &Signature,
    (of, values): (&str, &[f64]),
    direction: usize,
    slopes: Vec<f64>,
    lines: &mut Lines,
) {
    let what = format!("d({of})/d({})", signature.direction_name(direction));
    let size = match signature.directions[direction] {
        Direction::Parameter(i) => signature.parameters[i].value,
        Direction::Start(i) => signature.unknowns.get(i).nominal.unwrap_or(0.0),
    };
    let size = if size == 0.0 { signature.direction_unit(direction).factor } else { size };
    if largest(&slopes) * size.abs() <= TOLERANCE * largest(values) {
        lines.text(&what, "zero");
    } else {
        lines.numbers(&what, slopes);
    }
}

/// The largest magnitude of some numbers; infinity if any is NaN.
fn largest(numbers: &[f64]) -> f64 {
    let sizes = numbers.iter().map(|x| if x.is_nan() { f64::INFINITY } else { x.abs() });
    sizes.fold(0.0, f64::max)
}
