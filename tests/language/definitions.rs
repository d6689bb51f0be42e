//! What a file defines for itself: units, and functions with `let`s.

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::effects::{
    Effect, EffectApplication, EffectBlending, ModelWithEffects, apply, write,
};
use dgd_compiler::model::{ModelOptions, Setting};
use dgd_compiler::pipeline::{CompiledStages, SensitivityDirections, compile_asts, load};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::{layout, parse, parse_setting};
use dgd_execute::InterpretedSystem;
use dgd_runtime::{Inputs, Options, Problem, System, observe, simulate};

use crate::support::name;

/// Files by name; the first is the model.
type Files<'a> = &'a [(&'a str, &'a str)];

fn loaded(files: Files<'_>, settings: &[&str]) -> Result<(CompiledStages, SourceMap), String> {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let shown = |diagnostics: &Diagnostics, sources: &SourceMap| {
        render::render(&diagnostics.sorted(), sources, render::RenderStyle::Plain)
    };
    let (name, text) = files[0];
    let main = SourceText { name: name.to_owned(), text: text.to_owned() };
    let mut read = |path: &str| {
        let found = files.iter().find(|(name, _)| *name == path);
        found.map(|(_, text)| (*text).to_owned()).ok_or_else(|| "it is not there".to_owned())
    };
    let Ok(asts) = load(main, &mut read, &mut sources, &mut diagnostics) else {
        return Err(shown(&diagnostics, &sources));
    };
    let mut options = ModelOptions::default();
    for text in settings {
        let source = SourceText { name: "--set".to_owned(), text: (*text).to_owned() };
        let id = sources.add(source);
        let (name, value) = parse_setting(id, &sources, &mut diagnostics)
            .map_err(|_| shown(&diagnostics, &sources))?;
        options.settings.push(Setting { name, value });
    }
    match compile_asts(asts, &options, &SensitivityDirections::All, &mut diagnostics) {
        Ok(compiled) => Ok((compiled, sources)),
        Err(_) => Err(shown(&diagnostics, &sources)),
    }
}

fn compiled(files: Files<'_>) -> CompiledStages {
    loaded(files, &[]).unwrap_or_else(|mistakes| panic!("{mistakes}")).0
}

/// The outputs at the start.
fn outputs(compiled: CompiledStages) -> Vec<f64> {
    let system = InterpretedSystem::new(compiled.program);
    let p: Vec<f64> = system.signature().parameters.iter().map(|p| p.value).collect();
    let inputs = Inputs::none();
    let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
    let solution = simulate(&problem, &[0.0], &Options::default()).expect("a run");
    observe(&problem, &solution).w(0).to_vec()
}

const PUMP: &str = "model pump
unit stroke = 0.118 [l]
parameter v [stroke/min] = 40
state filled [stroke] = 2
equation level: der(filled) = v
output filled
output rate [lpm] = v
";

#[test]
fn a_declared_unit_is_a_number_of_another() {
    let (compiled, sources) = loaded(&[("pump.dgd", PUMP)], &["filled=3 [stroke]"]).expect("sound");
    let signature = &compiled.program.signature;
    let parameter = &signature.parameters[0];
    assert_eq!(&*parameter.unit.symbol, "stroke/min");
    assert!((parameter.value / (40.0 * 0.118e-3 / 60.0) - 1.0).abs() < 1e-15);
    assert_eq!(sources.units.len(), 1);
    assert_eq!(
        (sources.units[0].symbol.as_str(), sources.units[0].unit.as_str()),
        ("stroke", "m^3")
    );
    let found = outputs(compiled);
    assert!((found[0] / (3.0 * 0.118e-3) - 1.0).abs() < 1e-15, "{found:?}");
}

#[test]
fn libraries_give_their_units_and_parts_keep_theirs() {
    // A joint is 9.5 m here, and 12 m in the part.
    let main = "model whole
import \"lengths.dgd\"
import \"string.dgd\"
unit stand = 3 [joint]
parameter L [stand] = 2
part s: string
state x [m] = L
equation x: der(x) = 0 [m/s]
output x [joint]
output s.length
output ratio = s.length/1 [joint]
";
    let library = "unit joint = 9.5 [m]\nconstant tool [joint] = 1\n";
    let part = "model string
unit joint = 12 [m]
parameter n [joint] = 5
state length [joint] = n
equation length: der(length) = 0 [m/s]
";
    let files = [("whole.dgd", main), ("lengths.dgd", library), ("string.dgd", part)];
    let found = outputs(compiled(&files));
    for (found, expected) in found.iter().zip([57.0, 60.0, 60.0 / 9.5]) {
        assert!((found / expected - 1.0).abs() < 1e-14, "{found} {expected}");
    }
    // What the library has the part does not see.
    let part = "model string\nstate length [joint] = 5\nequation length: der(length) = 0 [m/s]\n";
    let files = [("whole.dgd", main), ("lengths.dgd", library), ("string.dgd", part)];
    let mistakes = loaded(&files, &[]).expect_err("a unit that is not known");
    assert!(
        mistakes.contains("E305") && mistakes.contains("there is no unit `joint`"),
        "{mistakes}"
    );
}

#[test]
fn an_effect_uses_the_units_of_its_model_and_its_text_has_them() {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let main = SourceText { name: "pump.dgd".to_owned(), text: PUMP.to_owned() };
    let mut read = |_: &str| Err("nothing".to_owned());
    let asts = load(main, &mut read, &mut sources, &mut diagnostics).expect("a model");
    let text = "effect leak on pump\nkind plant\nparameter lost [stroke/min] = 2\nnull lost = 0\n\
                function half(q) = {\n  let twice = 2*q\n  twice/4\n}\nadd -half(lost) to level\n";
    let id = sources.add(SourceText { name: "leak.dgd".to_owned(), text: text.to_owned() });
    let ast = parse(id, &sources, &mut diagnostics).expect("an effect");
    let effect = Effect::read(ast, &mut diagnostics).expect("an effect");
    let application =
        EffectApplication { effect: &effect, arguments: Vec::new(), span: effect.name.span };
    let ModelWithEffects { asts: changed, brought } =
        apply(&asts, &[application], EffectBlending::Applied, &mut diagnostics).expect("applied");
    let written = write(&asts[0], &changed[0], &brought, &sources);
    assert!(
        written.contains("unit stroke = 0.118 [l]") && written.contains("let twice"),
        "{written}"
    );
    let again = compiled(&[("pump.dgd", &written)]);
    let lost = again.program.signature.parameters.iter().find(|p| p.name == "lost").expect("it");
    assert!((lost.value / (2.0 * 0.118e-3 / 60.0) - 1.0).abs() < 1e-15);
    assert_eq!(name("lost").text, "lost");
}

#[test]
fn what_replaces_a_use_within_a_function_opens_its_lets() {
    let text = "model tank
state h [m] = 2
parameter k = 3
function drop(x [m]) = {
  let twice [m] = 2*x
  let both = twice + k*x
  both*both
}
equation level: der(h) = -drop(h)/1 [m*s]
output rate [m/s] = -drop(h)/1 [m*s]
";
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let main = SourceText { name: "tank.dgd".to_owned(), text: text.to_owned() };
    let mut read = |_: &str| Err("nothing".to_owned());
    let asts = load(main, &mut read, &mut sources, &mut diagnostics).expect("a model");
    let effect = "effect worn on tank\nkind plant\nparameter more = 1\nnull more = 0\nreplace k in level by k + more\n";
    let id = sources.add(SourceText { name: "worn.dgd".to_owned(), text: effect.to_owned() });
    let effect =
        Effect::read(parse(id, &sources, &mut diagnostics).expect("an effect"), &mut diagnostics)
            .expect("an effect");
    let application =
        EffectApplication { effect: &effect, arguments: Vec::new(), span: effect.name.span };
    let applied =
        apply(&asts, &[application], EffectBlending::Applied, &mut diagnostics).expect("applied");
    let compiled = compile_asts(
        applied.asts,
        &ModelOptions::default(),
        &SensitivityDirections::All,
        &mut diagnostics,
    )
    .expect("sound");
    let system = InterpretedSystem::new(compiled.program);
    let (p, y) = ([3.0, 1.0], [2.0]);
    let at = dgd_runtime::EvaluationPoint { t: 0.0, y: &y, u: &[], p: &p, z: &[] };
    let (mut f, mut w) = ([0.0], [0.0]);
    system.rhs(at, &mut f);
    system.outputs(at, &mut w);
    // (2 h + (k + 1) h)² in the equation, (2 h + k h)² elsewhere.
    assert_eq!((f[0], w[0]), (-144.0, -100.0));
}

#[test]
fn functions_with_lets_have_the_value_of_their_formula() {
    let text = "model m
parameter a = 1.5
state x = 1
function poly(x [1], c) = {
  # Horner's scheme.
  let one = c*x + 2    /// the inner
  let two [1] = one*x - 1
  two*x + a
}
equation x: der(x) = 0 [1/s]
output p = poly(x + 0.5, 3)
output q = poly(2, poly(1, 1))
";
    let value = |x: f64, c: f64| ((c * x + 2.0) * x - 1.0) * x + 1.5;
    assert_eq!(
        outputs(compiled(&[("m.dgd", text)])),
        [value(1.5, 3.0), value(2.0, value(1.0, 1.0))]
    );
}

#[test]
fn names_of_a_model_win_over_functions_that_came_later() {
    let text = "model m
parameter erf = 3
state floor = 2
function clamp(x) = 10*x
function mod(a, b) = a + b
constant c [m] = round(2.4)
equation x: der(floor) = 0 [1/s]
output p = clamp(erf) + mod(floor, 1) + c/1 [m]
";
    assert_eq!(outputs(compiled(&[("m.dgd", text)])), [35.0]);
    // A value of the model's own function is not a plain number in the declared unit.
    let text = "model m\nfunction round(x) = 2*x\nconstant c [m] = round(2.4)\n";
    let mistakes = loaded(&[("m.dgd", text)], &[]).expect_err("a plain number for a length");
    assert!(mistakes.contains("E302"), "{mistakes}");
    // Those that were there before do not give way.
    let mistakes = loaded(&[("m.dgd", "model m\nfunction tanh(x) = x\n")], &[]).expect_err("taken");
    assert!(mistakes.contains("E202"), "{mistakes}");
}

#[test]
fn new_items_are_laid_out_and_stay_so() {
    let text = "model m
unit   stroke=0.118 [l]
held u [%]=50
state x=1
function f(a ,b [m])={
let c=a*a
   let long_name [m]=b
-c*long_name+(c -1)*b
}
function g(x) = {
let y = sqrt(x)
sqrt(y)/2 - y
}
equation x: der(x)=0 [1/s]
every   10 [s]   {
reset u=60
}
when x rises above 1   or x falls below -1 { reset x=0 }
";
    let expected = "model m
unit stroke = 0.118 [l]
held u [%] = 50
state x = 1
function f(a, b [m]) = {
  let c             = a*a
  let long_name [m] = b
  -c*long_name + (c - 1)*b
}
function g(x) = {
  let y = sqrt(x)
  sqrt(y)/2 - y
}
equation x: der(x) = 0 [1/s]
every 10 [s] {
  reset u = 60
}
when x rises above 1 or x falls below -1 { reset x = 0 }
";
    let laid_out = |text: &str| {
        let mut sources = SourceMap::default();
        let id = sources.add(SourceText { name: "m.dgd".to_owned(), text: text.to_owned() });
        layout::format(id, &sources, &mut Diagnostics::default()).expect("tokens")
    };
    assert_eq!(laid_out(text), expected);
    assert_eq!(laid_out(expected), expected);
}
