//! A formula is guessed, and only that, for a discrepancy without a named effect.

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::ModelOptions;
use dgd_compiler::pipeline::{CompiledStages, SensitivityDirections, compile_asts, load};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_discover::{
    BaseModel, Discovery, DiscoveryOptions, FormulaGuess, OutputScales, Verdict, discover,
    templates as known_templates,
};
use dgd_execute::{Engine, LoadedSystem};
use dgd_identify::journal::NoJournal;
use dgd_identify::{NoMonitor, Recording};
use dgd_runtime::{InputColumn, Inputs, Options, Problem, System, observe, simulate};

use crate::support::{Normal, model_text};

/// A compiled model, or its errors.
fn compiled(text: &str, sources: &mut SourceMap) -> Result<CompiledStages, String> {
    let mut diagnostics = Diagnostics::default();
    let source = SourceText { name: "guessed.dgd".to_owned(), text: text.to_owned() };
    let mut nothing = |path: &str| Err(format!("{path} is not read here"));
    let asts = load(source, &mut nothing, sources, &mut diagnostics);
    let compiled = asts.and_then(|asts| {
        diagnostics.check()?;
        compile_asts(asts, &ModelOptions::default(), &SensitivityDirections::None, &mut diagnostics)
    });
    compiled.map_err(|_| render::render(&diagnostics.sorted(), sources, render::RenderStyle::Plain))
}

/// Inputs by name in declared units, and readings, at these times.
struct Samples {
    times: Vec<f64>,
    inputs: Vec<Vec<f64>>,
    /// Readings, SI.
    measured: Vec<Vec<f64>>,
}

fn inputs(system: &LoadedSystem, times: &[f64], declared: &[Vec<f64>]) -> Inputs {
    let in_si: Vec<Vec<f64>> = (system.signature().inputs.iter().zip(declared))
        .map(|(input, values)| values.iter().map(|value| value * input.unit.factor).collect())
        .collect();
    let columns: Vec<InputColumn<'_>> = (system.signature().inputs.iter().zip(&in_si))
        .map(|(input, values)| InputColumn {
            name: &input.name,
            interpolation: input.interpolation,
            values,
        })
        .collect();
    Inputs::recorded(times, &columns).expect("sound inputs")
}

/// The discovery from one recording, with another as validation data.
fn found(text: &str, pair: &[Samples; 2], with_templates: bool) -> Discovery {
    let mut sources = SourceMap::default();
    let compiled = compiled(text, &mut sources).unwrap_or_else(|error| panic!("{error}"));
    let system = LoadedSystem::new(compiled.program.clone());
    let mut diagnostics = Diagnostics::default();
    let mut templates = known_templates(&mut sources, &mut diagnostics).expect("their texts");
    if !with_templates {
        templates.clear();
    }
    let base = BaseModel {
        asts: compiled.asts.clone(),
        options: ModelOptions::default(),
        free: Vec::new(),
        fix: Vec::new(),
        engine: Engine::Auto,
        scales: OutputScales::default(),
    };
    let [train, valid] = pair.each_ref().map(|samples| {
        let measured = samples.measured.iter().cloned().map(Some).collect();
        let inputs = inputs(&system, &samples.times, &samples.inputs);
        [Recording::new(samples.times.clone(), inputs, measured)]
    });
    let request = DiscoveryOptions {
        base: &base,
        library: &[],
        templates: &templates,
        sources: &sources,
        train: (&train, &["train".to_owned()]),
        valid: (&valid, &["valid".to_owned()]),
        options: Options { rtol: 1e-6, atol: 1e-6, ..Options::default() },
        is_method_named: false,
        threads: 2,
        seed: 1,
        budget: None,
        journal: &NoJournal,
        watch: &NoMonitor,
    };
    discover(&request, &mut diagnostics).unwrap_or_else(|error| panic!("{error}"))
}

/// A tank whose second outlet the model does not have.
const TANK: &str = "/// A tank with a pump and two outlets.
model tank

input q_in    [L/min] linear    /// pump
input opening [%]     linear    /// valve of the second outlet

parameter area [m^2]               = 0.5  fixed
parameter k    [L/(min*m^(1/2))]   = 30   in 1 .. 500, log    /// first outlet

state h [m] = 1

equation level: area*der(h) = q_in - k*sqrt(h)

output h [m]  noise 0.002 [m]
";

/// Coefficient of the second outlet, in L/min at 1 m and fully open; and of the first.
const SECOND: f64 = 25.0;
const FIRST: f64 = 40.0;

fn between(random: &mut Normal, low: f64, high: f64) -> f64 {
    low + (high - low) * random.uniform()
}

/// A quantity that stays at random levels and ramps from one to the next.
fn ramps(random: &mut Normal, n: usize, low: f64, high: f64) -> Vec<f64> {
    let mut values = Vec::new();
    let mut level = f64::midpoint(low, high);
    while values.len() < n {
        let rest = between(random, 40.0, 160.0) as usize;
        values.extend(std::iter::repeat_n(level, rest));
        let (next, steps) = (between(random, low, high), between(random, 10.0, 40.0) as usize);
        values.extend((0..steps).map(|k| level + (next - level) * k as f64 / steps as f64));
        level = next;
    }
    values.truncate(n);
    values
}

/// Readings every two seconds of a tank, simulated with small steps and none of this project's solvers.
fn tank(seed: u64) -> Samples {
    let n = 1500;
    let mut random = Normal::new(seed);
    let inflow = ramps(&mut random, n, 40.0, 80.0);
    let opening = ramps(&mut random, n, 0.0, 100.0);
    let times: Vec<f64> = (0..n).map(|k| 2.0 * k as f64).collect();
    let (mut h, mut read) = (1.2_f64, Vec::new());
    for k in 0..n {
        read.push(h + 0.002 * random.next());
        let next = (k + 1).min(n - 1);
        for step in 0..200 {
            let share = (f64::from(step) + 0.5) / 200.0;
            let at = |values: &[f64]| values[k] + share * (values[next] - values[k]);
            let rate = |h: f64| {
                let out = FIRST * h.sqrt() + SECOND * at(&opening) / 100.0 * h.sqrt();
                (at(&inflow) - out) / 60_000.0 / 0.5
            };
            h += 0.01 * rate(h + 0.005 * rate(h));
        }
    }
    Samples { times, inputs: vec![inflow, opening], measured: vec![read] }
}

/// The guess at a place.
#[track_caller]
fn guess_at<'a>(discovery: &'a Discovery, place: &str) -> &'a FormulaGuess {
    let found = discovery.unexplained.iter().find(|one| one.target == place).expect("the place");
    found.guess.as_ref().unwrap_or_else(|| panic!("a guess in {place}"))
}

/// The printed formula is valid on the right-hand side of an equation, but only with its units.
#[track_caller]
fn fits_the_equation(text: &str, equation: &str, formula: &str) {
    let with = |formula: &str| {
        let changed = text.replace(equation, &format!("{equation} + ({formula})"));
        assert_ne!(changed, text, "the equation is in the model");
        changed
    };
    let compiles = |text: &str| compiled(text, &mut SourceMap::default()).map(|_| ());
    assert_eq!(compiles(&with(formula)), Ok(()), "{formula}");
    let other = formula.replace('[', "[s*");
    assert_ne!(other, formula, "its coefficient has a unit");
    assert!(compiles(&with(&other)).is_err_and(|error| error.contains("E3")), "{other}");
}

#[test]
fn a_second_outlet_of_a_tank_is_a_law_on_validation_data_only() {
    let pair = [tank(1), tank(2)];
    let discovery = found(TANK, &pair, false);
    assert_eq!(discovery.verdict, Verdict::Law, "{}", discovery.reason);
    let law = discovery.law.as_ref().expect("a law");
    let [term] = law.terms.as_slice() else { panic!("{:?}", law.terms) };
    assert_eq!(term.target, "level");
    assert!(term.formula.ends_with("* opening*sqrt(h)"), "{}", term.formula);
    // −25 L/min at 1 m and fully open.
    let size = term.coefficients[0].value * 60_000.0;
    assert!((size / -SECOND - 1.0).abs() < 0.03, "{size}: {}", term.formula);
    fits_the_equation(TANK, "q_in - k*sqrt(h)", &term.formula);
    assert!(discovery.corrected.contains("opening*sqrt(h)"), "{}", discovery.corrected);
}

/// A recording of the circulation model with `more` added to an equation.
fn circulation(equation: &str, more: &str, seed: u64) -> Samples {
    let base = model_text("mud_circulation");
    let text = base.replace(equation, &format!("{equation} {more}"));
    assert_ne!(text, base, "the equation is in the model");
    let compiled = compiled(&text, &mut SourceMap::default());
    let system = LoadedSystem::new(compiled.unwrap_or_else(|error| panic!("{error}")).program);
    let signature = system.signature();
    let n = 1200;
    let random = &mut Normal::new(seed);
    let own = vec![
        ramps(random, n, 44.0, 58.0),
        ramps(random, n, 1200.0, 1900.0),
        ramps(random, n, 50.0, 450.0),
    ];
    let times: Vec<f64> = (0..n).map(|k| 2.0 * k as f64).collect();
    let p: Vec<f64> = signature.parameters.iter().map(|parameter| parameter.value).collect();
    let recorded = inputs(&system, &times, &own);
    let problem = Problem { system: &system, p: &p, inputs: &recorded, start: &[] };
    let solution = simulate(&problem, &times, &Options::default()).expect("a run");
    let w = observe(&problem, &solution).w;
    let n_w = signature.outputs.len();
    let read = signature.outputs.iter().enumerate().map(|(i, output)| {
        let noise = output.noise.expect("it is declared");
        (0..n).map(|k| w[k * n_w + i] + noise * random.next()).collect()
    });
    let measured = read.collect();
    Samples { times, inputs: own, measured }
}

/// The discovery from such recordings without known effects.
fn circulation_without_effects(equation: &str, more: &str) -> Discovery {
    let pair = [1, 2].map(|seed| circulation(equation, more, seed));
    found(&model_text("mud_circulation"), &pair, false)
}

#[test]
fn a_pressure_that_goes_with_two_quantities_of_a_return_line_is_guessed() {
    let equation = "M * der(q_ssp) = net";
    let discovery = circulation_without_effects(equation, "- 1e8 [Pa*s/m^3]*w_ssp*q_tf");
    assert_eq!(discovery.unexplained[0].target, "return_line");
    let guess = guess_at(&discovery, "return_line");
    let [term] = guess.terms.as_slice() else { panic!("{}", guess.formula) };
    assert_eq!(term.factor, "* w_ssp*q_tf", "{}", guess.formula);
    assert!((term.coefficient / -1e8 - 1.0).abs() < 0.05, "{}", guess.formula);
    // The unit is that of a parameter of the same dimension.
    assert_eq!(term.unit.symbol, "Pa*s/m^3");
    fits_the_equation(&model_text("mud_circulation"), equation, &guess.formula);
}

#[test]
fn what_goes_with_nothing_that_the_model_has_is_not_guessed() {
    let equation = "= q_ssp - q_boost - q_tf";
    let discovery = circulation_without_effects(equation, "+ 2e-3 [m^3/s]*sin(time/23 [s])");
    assert_eq!(discovery.verdict, Verdict::Unexplained, "{}", discovery.reason);
    assert!(discovery.unexplained[0].guess.is_none(), "{:?}", discovery.unexplained[0].guess);
}
