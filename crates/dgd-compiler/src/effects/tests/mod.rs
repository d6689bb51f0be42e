//! Effects on one model, and the text of the changed model.

mod parts;

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::*;
use crate::diagnostics::{Diagnostics, render};
use crate::expr::ExprId;
use crate::model::{Model, ModelOptions, resolve};
use crate::source::{SourceMap, SourceText};
use crate::syntax::layout;
use crate::syntax::parse;
use crate::syntax::places::without_places;
use crate::syntax::print::print;

const TANK: &str = "\
/// A tank.
model tank

constant A [m^2] = 2   # weighed
input q_in [m^3/s]
parameter k [m^(5/2)/s] = 0.1
parameter c [m^3/s] = 0.5
state h [m] = 1
state v [m^3] = 0 fixed
function root(x [m]) = sqrt(x)
let out = k*root(h)
let net = q_in - out   # what stays

equation level: A*der(h) = net
equation total: der(v) = q_in
output h [cm]
output loss [m^3/s] = out
";

struct Run {
    sources: SourceMap,
    diagnostics: Diagnostics,
    model: Ast,
}

impl Run {
    fn new(text: &str) -> Run {
        let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
        let id = sources.add(SourceText { name: "model.dgd".into(), text: text.into() });
        let model = parse(id, &sources, &mut diagnostics).expect("the model can be read");
        Run { sources, diagnostics, model }
    }

    fn effect(&mut self, text: &str) -> Option<Effect> {
        let id = self.sources.add(SourceText { name: "effect.dgd".into(), text: text.into() });
        let ast = parse(id, &self.sources, &mut self.diagnostics).ok()?;
        Effect::read(ast, &mut self.diagnostics).ok()
    }

    fn apply(
        &mut self,
        effects: &[(&str, &[&str])],
        blending: EffectBlending,
    ) -> Option<ModelWithEffects> {
        // Applications of one effect come from one file.
        let mut read: BTreeMap<&str, Effect> = BTreeMap::new();
        for (text, _) in effects {
            if !read.contains_key(text) {
                read.extend(self.effect(text).map(|effect| (*text, effect)));
            }
        }
        self.diagnostics.check().ok()?;
        let name = |text: &&str| Name { text: (*text).to_owned(), span: self.model.items[0].span };
        let applications: Vec<EffectApplication<'_>> = effects
            .iter()
            .map(|(text, arguments)| EffectApplication {
                effect: &read[text],
                arguments: arguments.iter().map(name).collect(),
                span: read[text].name.span,
            })
            .collect();
        apply(std::slice::from_ref(&self.model), &applications, blending, &mut self.diagnostics)
            .ok()
    }

    fn resolve(&mut self, asts: &[Ast]) -> Option<Model> {
        resolve(asts, &ModelOptions::default(), &mut self.diagnostics).ok()
    }

    fn shown(&self) -> String {
        render::render(&self.diagnostics.sorted(), &self.sources, render::RenderStyle::Plain)
    }
}

/// Lines of a model that an effect adds or changes; checks that the model is valid and its text canonical.
fn changed_lines(effects: &[(&str, &[&str])], blending: EffectBlending) -> Vec<String> {
    let mut run = Run::new(TANK);
    let applied = run.apply(effects, blending).unwrap_or_else(|| panic!("{}", run.shown()));
    run.resolve(&applied.asts).unwrap_or_else(|| panic!("{}", run.shown()));
    let text = write(&run.model, &applied.asts[0], &applied.brought, &run.sources);

    let mut sources = SourceMap::default();
    let id = sources.add(SourceText { name: "written".into(), text: text.clone() });
    let again = parse(id, &sources, &mut Diagnostics::default()).expect("what is written is sound");
    assert_eq!(without_places(&again), without_places(&applied.asts[0]));
    assert_eq!(layout::format(id, &sources, &mut Diagnostics::default()).as_ref(), Ok(&text));
    // The model's own remarks are still there, once each.
    for remark in ["# weighed", "# what stays"] {
        assert_eq!(text.matches(remark).count(), 1, "{text}");
    }

    let before = write(&run.model, &run.model, &[], &run.sources);
    let is_new = |line: &&str| !line.is_empty() && !before.lines().any(|old| old == *line);
    text.lines().filter(is_new).map(str::to_owned).collect()
}

fn effect(kind: &str, rest: &str) -> String {
    format!("effect e on tank\nkind {kind}\n{rest}\n")
}

/// Changed lines of one applied effect, with runs of blanks removed.
fn applied(kind: &str, rest: &str) -> Vec<String> {
    let text = effect(kind, rest);
    let lines = changed_lines(&[(&text, &[])], EffectBlending::Applied);
    lines.iter().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect()
}

fn codes(effects: &[(&str, &[&str])]) -> String {
    let mut run = Run::new(TANK);
    if let Some(applied) = run.apply(effects, EffectBlending::Applied) {
        run.resolve(&applied.asts);
    }
    let codes: Vec<String> =
        run.diagnostics.sorted().iter().map(|diagnostic| diagnostic.code.to_string()).collect();
    codes.join(" ")
}

#[test]
fn what_an_effect_brings_stands_under_its_name_and_the_lines_of_its_doc() {
    let text = format!(
        "/// Water seeps through the wall,\n/// slowly.\n{}",
        effect("plant", "constant seep [m^3/s] = 1e-6\nadd -seep to level")
    );
    let mut run = Run::new(TANK);
    let applied = run
        .apply(&[(&text, &[])], EffectBlending::Applied)
        .unwrap_or_else(|| panic!("{}", run.shown()));
    let written = write(&run.model, &applied.asts[0], &applied.brought, &run.sources);
    let remark = "\n\n# e\n# Water seeps through the wall,\n# slowly.\nconstant seep ";
    assert!(written.contains(remark), "{written}");
}

#[test]
fn a_name_is_replaced_wherever_the_model_uses_it() {
    assert_eq!(
        applied("plant", "replace q_in by 0.9*q_in"),
        ["let net = 0.9*q_in - out # what stays", "equation total: der(v) = 0.9*q_in"]
    );
    // The output of its name reads an unknown; its derivative stays.
    assert_eq!(
        applied("plant", "replace h by h + 1 [m]"),
        ["let out = k*root(h + 1 [m])", "output h [cm] = h + 1 [m]"]
    );
    assert_eq!(applied("plant", "replace k by 2*k"), ["let out = 2*k*root(h)"]);
    assert_eq!(
        applied("plant", "replace root(y) by root(2*y)^2/root(1 [m])"),
        ["let out = k*(root(2*h)^2/root(1 [m]))"]
    );
    assert_eq!(
        applied("plant", "function other(x [m]) = 2*sqrt(x)\nreplace root by other"),
        ["let out = k*other(h)", "# e", "function other(x [m]) = 2*sqrt(x)"]
    );
    assert_eq!(
        applied("plant", "replace out by out - c"),
        ["let net = q_in - (out - c) # what stays", "output loss [m^3/s] = out - c"]
    );
}

#[test]
fn within_an_equation_what_leads_to_the_name_is_opened() {
    assert_eq!(
        applied("plant", "replace q_in in level by 2*q_in"),
        ["equation level: A*der(h) = 2*q_in - out"]
    );
    assert_eq!(
        applied("plant", "replace h in level by 2*h"),
        ["equation level: A*der(h) = q_in - k*root(2*h)"]
    );
}

#[test]
fn outputs_and_equations_change() {
    assert_eq!(applied("sensor", "replace output h by 1.1*h"), ["output h [cm] = 1.1*h"]);
    assert_eq!(
        applied("sensor", "replace output loss by loss + c"),
        ["output loss [m^3/s] = out + c"]
    );
    assert_eq!(
        applied("plant", "add -c to level\nadd c - 2*c to total"),
        ["equation level: A*der(h) = net - c", "equation total: der(v) = q_in + c - 2*c"]
    );
}

#[test]
fn no_plus_stands_before_a_minus_that_an_effect_brings() {
    assert_eq!(
        applied("plant", "add -k*root(h) to level\nadd c - -2*c to total"),
        ["equation level: A*der(h) = net - k*root(h)", "equation total: der(v) = q_in + c + 2*c"]
    );
    assert_eq!(
        applied("plant", "replace out by -out"),
        ["let net = q_in + out # what stays", "output loss [m^3/s] = -out"]
    );
    // A product that is subtracted twice.
    assert_eq!(
        applied("plant", "replace out by -2*out\nadd -(-c) to level"),
        [
            "let net = q_in + 2*out # what stays",
            "equation level: A*der(h) = net - (-c)",
            "output loss [m^3/s] = -2*out"
        ]
    );
}

const POND: &str = "\
/// A pond.   # weighed
model pond

input q_in [m^2/s]        # for each metre of shore
parameter k [m/s] = 0.1
parameter crest [m] = 2
state h [m] = 1
modes bank {
  filling { equation balance: 1 [m] * der(h) = q_in - k*h }
  full { equation standing: h = crest }
  filling -> full when h rises above crest { reset h = crest }
}
output h [m]
";

/// Lines of the pond that an effect changes; checks that the text is valid and can be read again.
fn changed_pond(text: &str, arguments: &[&str]) -> Vec<String> {
    let mut run = Run::new(POND);
    let applied = run
        .apply(&[(text, arguments)], EffectBlending::Applied)
        .unwrap_or_else(|| panic!("{}", run.shown()));
    run.resolve(&applied.asts).unwrap_or_else(|| panic!("{}", run.shown()));
    let text = write(&run.model, &applied.asts[0], &applied.brought, &run.sources);
    let mut sources = SourceMap::default();
    let id = sources.add(SourceText { name: "written".into(), text: text.clone() });
    let again = parse(id, &sources, &mut Diagnostics::default()).expect("what is written is sound");
    assert_eq!(without_places(&again), without_places(&applied.asts[0]));
    let before = write(&run.model, &run.model, &[], &run.sources);
    let is_new = |line: &&str| !line.is_empty() && !before.lines().any(|old| old == *line);
    text.lines().filter(is_new).map(|line| line.trim().to_owned()).collect()
}

#[test]
fn equations_transitions_and_resets_of_modes_change() {
    let plant = |rest: &str| changed_pond(&format!("effect e on pond\nkind plant\n{rest}\n"), &[]);
    assert_eq!(
        plant("replace crest by 2*crest"),
        [
            "full    { equation standing: h = 2*crest }",
            "filling -> full when h rises above 2*crest { reset h = 2*crest }",
        ]
    );
    assert_eq!(
        plant("replace k in balance by 2*k\nadd -0.1 [m] to standing"),
        [
            "filling { equation balance: 1 [m] * der(h) = q_in - 2*k*h }",
            "full    { equation standing: h = crest - 0.1 [m] }",
        ]
    );
}

#[test]
fn events_and_bounds_that_a_template_brings_have_its_names() {
    let sampled = "effect sampled(y: output)\nkind sensor\nparameter period [s] = 5\n\
        parameter top [unit(y)] = 3\nstate seen [unit(y)] = 1\nstate since [s] = 0\n\
        equation seen: der(seen) = 0\nequation since: der(since) = 1\n\
        when since rises above period {\n  reset seen = y\n  reset since = 0\n}\n\
        saturate seen <= top\nreplace output y by seen\n";
    assert_eq!(
        changed_pond(sampled, &["h"]),
        [
            "output h [m] = seen_h",
            "# sampled(h)",
            "parameter period_h [s] = 5",
            "parameter top_h    [m] = 3",
            "state seen_h  [m] = 1",
            "state since_h [s] = 0",
            "equation seen_h:  der(seen_h) = 0",
            "equation since_h: der(since_h) = 1",
            "when since_h rises above period_h {",
            "reset seen_h = h",
            "reset since_h = 0",
            "saturate seen_h <= top_h",
        ]
    );
}

#[test]
fn modes_that_a_template_brings_have_its_names() {
    let sticking = "effect sticking(y: output)\nkind sensor\nparameter band [unit(y)] = 0.1\n\
        state seen [unit(y)] = 1\n\
        modes gauge {\n  free { equation gauge: 1 [s]*der(seen) = y - seen }\n\
        stuck { equation gauge: der(seen) = 0 }\n\
        free -> stuck when y - seen falls below band\n\
        stuck -> free when y - seen rises above 2*band { reset seen = y - band }\n}\n\
        replace output y by seen\n";
    assert_eq!(
        changed_pond(sticking, &["h"]),
        [
            "output h [m] = seen_h",
            "# sticking(h)",
            "parameter band_h [m] = 0.1",
            "state seen_h [m] = 1",
            "modes gauge_h {",
            "free {",
            "equation gauge_h: 1 [s]*der(seen_h) = h - seen_h",
            "}",
            "stuck {",
            "equation gauge_h: der(seen_h) = 0",
            "}",
            "free -> stuck when h - seen_h falls below band_h",
            "stuck -> free when h - seen_h rises above 2*band_h {",
            "reset seen_h = h - band_h",
            "}",
        ]
    );
}

#[test]
fn sensors_see_what_was_read_before_and_inputs_reach_everything() {
    let lag = "effect lag on tank\nkind plant\nstate q_lag [m^3/s] = q_in\nequation lag: 5 [s]*der(q_lag) = q_in - q_lag\nreplace q_in by q_lag\n";
    let gain = "effect gain on tank\nkind input\nparameter gain [1] = 1\nnull gain = 1\nreplace q_in by gain*q_in\n";
    let offset = effect("sensor", "replace output loss by loss + c");
    let twice = "effect twice on tank\nkind sensor\nreplace output loss by 2*loss\n";
    let lines = changed_lines(
        &[(gain, &[]), (&offset, &[]), (twice, &[]), (lag, &[])],
        EffectBlending::Applied,
    );
    assert_eq!(
        lines,
        [
            "let net = q_lag - out   # what stays",
            "equation total: der(v) = q_lag",
            "output loss [m^3/s] = 2*(out + c)",
            "# gain",
            "parameter gain [1] = 1",
            "# lag",
            "state q_lag [m^3/s] = gain*q_in",
            "equation lag: 5 [s]*der(q_lag) = gain*q_in - q_lag",
        ]
    );
}

#[test]
fn templates_bring_names_and_units_of_their_arguments() {
    let template = "/// Reads too much.\neffect offset(y: output)\nkind sensor\nparameter b [unit(y)] = 0 in -1 .. 1  /// too much\nnull b = 0\nreplace output y by y + b\n";
    let lines =
        changed_lines(&[(template, &["h"]), (template, &["loss"])], EffectBlending::Applied);
    assert_eq!(
        lines,
        [
            "output h    [cm]    = h + b_h",
            "output loss [m^3/s] = out + b_loss",
            "# offset(h)",
            "# Reads too much.",
            "parameter b_h [cm] = 0  in -1 .. 1  /// too much",
            "# offset(loss)",
            "# Reads too much.",
            "parameter b_loss [m^3/s] = 0  in -1 .. 1  /// too much",
        ]
    );
}

#[test]
fn a_template_on_several_names_stacks_on_each_alone() {
    let template = "effect varies(p: parameter, x: quantity)\nkind plant\nparameter slope [1/unit(x)] = 0\nnull slope = 0\nreplace p by p*(1 + slope*x)\n";
    let effects: Vec<(&str, &[&str])> =
        vec![(template, &["k", "h"]), (template, &["c", "h"]), (template, &["k", "q_in"])];
    let mut run = Run::new(&TANK.replace("q_in - out", "q_in - out - c"));
    let applied =
        run.apply(&effects, EffectBlending::Null).unwrap_or_else(|| panic!("{}", run.shown()));
    let text = write(&run.model, &applied.asts[0], &applied.brought, &run.sources);
    assert!(
        text.contains("let out = k*(1 + slope_k_h*h)*(1 + slope_k_q_in*q_in)*root(h)"),
        "{text}"
    );
    assert!(text.contains("let net = q_in - out - c*(1 + slope_c_h*h) "), "{text}");
}

#[test]
fn a_torque_is_in_the_unit_that_the_model_writes() {
    for (input, expected) in [("N*m", "N*m"), ("J", "J"), ("kN*m", "J")] {
        let mut run = Run::new(&format!(
            "model drive\ninput torque [{input}]\nparameter J [kg*m^2] = 1\nstate w [rad/s] = 0\n\
             equation motor: J*der(w) = torque\n"
        ));
        let asts = [run.model.clone()];
        let model = run.resolve(&asts).expect("a sound model");
        assert_eq!(model.spelling(model.equations[0].dimension), expected, "{input}");
        let effect = "effect friction(e: equation)\nkind plant\nparameter size [unit(e)] = 0\n\
                      null size = 0\nadd -size to e\n";
        let applied = run.apply(&[(effect, &["motor"])], EffectBlending::Applied);
        let applied = applied.expect("it fits");
        let text = print(&applied.asts[0]);
        assert!(text.contains(&format!("[{expected}] = 0")), "{text}");
    }
}

#[test]
fn units_are_put_together_as_the_model_does() {
    let spelling = |declared: &str, state: &str, rate: &str| {
        let text = format!(
            "model m\n{declared}\nstate x [{state}] = 1\nequation e: {rate}*der(x) = {rate} [{state}/s]\n"
        );
        let mut run = Run::new(&text);
        let asts = [run.model.clone()];
        let model = run.resolve(&asts).unwrap_or_else(|| panic!("{}", run.shown()));
        model.spelling(model.equations[0].dimension)
    };
    assert_eq!(spelling("", "W", "1"), "W/s");
    assert_eq!(spelling("", "J", "1"), "W");
    assert_eq!(spelling("parameter b [N*m*s/rad] = 1", "N*m*s", "1"), "N*m");
    assert_eq!(spelling("", "kg*m", "1"), "kg*m/s");
}

#[test]
fn a_term_is_read_in_the_unit_of_the_first_quantity_that_measures_the_same() {
    let of = |declared: &str| {
        let text =
            format!("model m\n{declared}\nstate V [m^3] = 1\nequation e: der(V) = 1 [m^3/s]\n");
        let mut run = Run::new(&text);
        let asts = [run.model.clone()];
        let model = run.resolve(&asts).unwrap_or_else(|| panic!("{}", run.shown()));
        let unit = model.familiar(model.equations[0].dimension);
        (unit.symbol, unit.factor * 60_000.0, unit.offset)
    };
    assert_eq!(of("input q [lpm] hold\ninput r [L/s] hold").0, "lpm");
    let (symbol, factor, offset) = of("parameter q [L/s] = 1");
    assert!(symbol == "L/s" && (factor - 60.0).abs() < 1e-9 && offset == 0.0, "{symbol} {factor}");
    let (symbol, factor, _) = of("constant q [lpm] = 1");
    assert!(symbol == "m^3/s" && (factor - 60_000.0).abs() < 1e-6, "{symbol} {factor}");
}

#[test]
fn templates_are_bound_by_kind_and_dimension() {
    let mut run = Run::new(TANK);
    let asts = [run.model.clone()];
    let model = run.resolve(&asts).expect("a sound model");
    for (slots, expected) in [
        ("(y: output)", "h loss"),
        ("(y: output [m])", "h"),
        ("(y: input [lpm])", "q_in"),
        ("(y: input [Pa])", ""),
        ("(y: state)", "h v"),
        ("(y: parameter [m^3/s])", "c"),
        ("(y: equation [m^3/s])", "level total"),
        ("(a: state, b: state)", "h,v v,h"),
        (" on tank", ""),
    ] {
        let text = format!("effect e{slots}\nkind plant\nreplace k by 2*k\n");
        let effect = run.effect(&text).unwrap_or_else(|| panic!("{}", run.shown()));
        let lists = bind(&effect, &model);
        let shown: Vec<String> = lists.iter().map(|list| list.join(",")).collect();
        assert_eq!(shown.join(" "), expected, "{slots}");
        assert_eq!(
            lists.len(),
            if slots == " on tank" { 1 } else { expected.split_whitespace().count() }
        );
    }
}

#[test]
fn templates_leave_exact_equations_alone() {
    let mut run = Run::new(
        "model cart\ninput F [N]\nstate x [m] = 0\nstate v [m/s] = 0\n\
         equation speed: der(x) = v exact\nequation force: 2 [kg]*der(v) = F\noutput x\n",
    );
    let asts = [run.model.clone()];
    let model = run.resolve(&asts).expect("a sound model");
    let text = "effect e(x: state, e: equation)\nkind plant\nadd x/1 [s] to e\n";
    let effect = run.effect(text).unwrap_or_else(|| panic!("{}", run.shown()));
    let lists: Vec<String> = bind(&effect, &model).iter().map(|list| list.join(",")).collect();
    assert_eq!(lists, ["x,force", "v,force"]);
}

/// Values of the right-hand sides' graphs at some point, with all parameters as declared.
fn values(model: &Model) -> Vec<f64> {
    let at = |id: ExprId| {
        model.graph.evaluate(id, &|symbol| match symbol {
            crate::expr::Symbol::Constant(i) => model.constants[i as usize].value,
            crate::expr::Symbol::Parameter(i) => model.parameters[i as usize].value,
            crate::expr::Symbol::Unknown(i) => 0.7 + f64::from(i),
            _ => 0.3,
        })
    };
    let sides = model.equations.iter().take(2).flat_map(|equation| [equation.left, equation.right]);
    sides.chain(model.outputs.iter().map(|output| output.value)).map(at).collect()
}

#[test]
fn effects_vanish_at_their_null_and_stack() {
    let gain = "effect gain on tank\nkind plant\nparameter gain [1] = 3\nnull gain = 1\nreplace q_in by gain*q_in\n";
    let other =
        "effect other on tank\nkind plant\nparameter gain [1] = 3\nreplace q_in by gain*q_in^2/c\n";
    let sensor = "effect reading(y: output)\nkind sensor\nreplace output y by 2*y\n";
    let leak = "effect leak on tank\nkind plant\nadd -c to level\n";
    let mut run = Run::new(TANK);
    let base = [run.model.clone()];
    let base = run.resolve(&base).expect("a sound model");
    let effects: [(&str, &[&str]); 4] = [(gain, &[]), (other, &[]), (sensor, &["h"]), (leak, &[])];
    let applied =
        run.apply(&effects, EffectBlending::Null).unwrap_or_else(|| panic!("{}", run.shown()));
    let model = run.resolve(&applied.asts).unwrap_or_else(|| panic!("{}", run.shown()));
    assert_eq!(values(&model), values(&base));
    let names = |i: usize| {
        let AddedItems { parameters, null, blend, .. } = &applied.brought[i];
        (parameters.join(","), null.join(","), blend.clone())
    };
    assert_eq!(names(0), ("gain".into(), "gain".into(), None));
    assert_eq!(names(1), ("gain_other".into(), String::new(), Some("blend_other".into())));
    assert_eq!(names(2), (String::new(), String::new(), Some("blend_reading_h".into())));
    assert_eq!(names(3).2, Some("blend_leak".into()));
}

#[test]
fn what_does_not_fit_is_refused() {
    let plant = |rest: &str| effect("plant", rest);
    for (text, arguments, expected) in [
        ("effect e on pond\nkind plant\nreplace k by 2*k\n".to_owned(), &[][..], "E212"),
        ("effect e(y: output)\nkind sensor\nreplace output y by 2*y\n".to_owned(), &[], "E212"),
        (
            "effect e(y: output)\nkind sensor\nreplace output y by 2*y\n".to_owned(),
            &["q_in"],
            "E212",
        ),
        ("effect e(y: state [s])\nkind sensor\nreplace y by 2*y\n".to_owned(), &["h"], "E212"),
        (
            "effect e(y: equation)\nkind plant\nlet a = 1 [unit(z)]\nadd a to y\n".to_owned(),
            &["level"],
            "E305",
        ),
        ("effect e on tank\nreplace k by 2*k\n".to_owned(), &[], "E213"),
        (plant("kind sensor\nreplace k by 2*k"), &[], "E213"),
        (plant("parameter a [1] = 1"), &[], "E213"),
        (plant("replace k by 2*k\nnull a = 1"), &[], "E201"),
        (plant("replace kk by 2*k"), &[], "E201"),
        (plant("replace k in leve by 2*k"), &[], "E201"),
        (plant("replace k in total by 2*k"), &[], "E212"),
        (plant("replace A by 2*A"), &[], ""),
        // Its derivative does not count as a use.
        (plant("replace v by 2*v"), &[], "E212"),
        (plant("replace output los by 2"), &[], "E201"),
        (plant("add c to levels"), &[], "E201"),
        (plant("parameter k [1] = 1\nadd c to level"), &[], "E202"),
        (plant("replace root by 2"), &[], "E204"),
        (plant("import \"a.dgd\"\nadd c to level"), &[], "E208"),
        // Unit errors are found in the effect.
        (plant("add k to level"), &[], "E301"),
        (plant("replace output h by 2*h^2"), &[], "E302"),
    ] {
        assert_eq!(codes(&[(&text, arguments)]), expected, "{text}");
    }
}

#[test]
fn an_effect_can_bring_outputs_and_change_nothing_else() {
    let more = "output twice [m] = 2*h  noise 1 [cm]\nparameter unused [1] = 1";
    let text = effect("sensor", more);
    for blending in [EffectBlending::Applied, EffectBlending::Null] {
        let lines = changed_lines(&[(&text, &[])], blending);
        assert_eq!(
            lines,
            ["# e", "output twice [m] = 2*h  noise 1 [cm]", "parameter unused [1] = 1"]
        );
    }
    // Of another unknown, and an independent one.
    assert_eq!(codes(&[(&effect("plant", "state x = 1\nequation e: der(x) = -x/1 [s]"), &[])]), "");
    assert_eq!(codes(&[(&effect("plant", "saturate h >= 0"), &[])]), "");
    assert_eq!(codes(&[(&effect("plant", "let twice = 2*h"), &[])]), "E213");
}

#[test]
fn two_plant_effects_on_one_use_exclude_each_other() {
    let one = effect("plant", "replace q_in in level by 2*q_in");
    let other = "effect o on tank\nkind plant\nreplace q_in by 3*q_in\n";
    assert_eq!(codes(&[(&one, &[]), (other, &[])]), "E214");
    assert_eq!(codes(&[(other, &[]), (&one, &[])]), "E214");
    let elsewhere = "effect o on tank\nkind plant\nreplace q_in in total by 3*q_in\n";
    assert_eq!(codes(&[(&one, &[]), (elsewhere, &[])]), "");
}

#[test]
fn what_one_plant_effect_brings_another_can_replace_in_either_order() {
    let lag = effect(
        "plant",
        "state q_late [m^3/s] = q_in\nequation lag: 5 [s]*der(q_late) = q_in - q_late\nreplace q_in by q_late",
    );
    let loss = effect("plant", "replace out by out + 0.1*q_in");
    let given: [[(&str, &[&str]); 2]; 2] =
        [[(&lag, &[]), (&loss, &[])], [(&loss, &[]), (&lag, &[])]];
    for order in given {
        let lines = changed_lines(&order, EffectBlending::Applied);
        // The loss reads the delayed flow, the lag itself the actual flow.
        assert!(lines.iter().any(|line| line.contains("0.1*q_late")), "{lines:#?}");
        assert!(lines.iter().any(|line| line.contains("= q_in - q_late")), "{lines:#?}");
    }
}

#[test]
fn wrong_units_are_shown_in_the_effect() {
    let mut run = Run::new(TANK);
    let text = effect("plant", "add k to level");
    let applied = run.apply(&[(&text, &[])], EffectBlending::Applied).expect("names are right");
    assert!(run.resolve(&applied.asts).is_none());
    assert!(run.shown().contains("effect.dgd:3:5"), "{}", run.shown());
}

#[test]
fn trees_that_branch_too_much_are_refused() {
    let mut text = "model m\ninput u [1]\nlet a0 = u\n".to_owned();
    for i in 1..40 {
        let _ = writeln!(text, "let a{i} = a{j} + a{j}*a{j}", j = i - 1);
    }
    text += "unknown x [1]\nequation e: x = a39\n";
    let mut run = Run::new(&text);
    let effect = "effect e on m\nkind plant\nreplace u in e by 2*u\n";
    assert!(run.apply(&[(effect, &[])], EffectBlending::Applied).is_none());
    assert!(run.shown().contains("E211"), "{}", run.shown());
}

#[test]
fn printing_an_effect_and_reading_it_again_gives_the_same() {
    let text = "/// Doc.\neffect e(y: output [Pa], q: equation, p: parameter)\nkind sensor\nform first\nparameter a [unit(y)/s] = 0 in -1 .. 1\nvariant v { x { let b = a } z { let b = 2*a } }\n/// At nothing.\nnull a = 0\nreplace output y by y + b*time\nreplace f(x, y) in q by -x\nadd (p) to q\n";
    let read = |text: &str| {
        let mut run = Run::new("model m");
        let id = run.sources.add(SourceText { name: "e".into(), text: text.into() });
        parse(id, &run.sources, &mut run.diagnostics).unwrap_or_else(|_| panic!("{}", run.shown()))
    };
    let ast = read(text);
    assert_eq!(ast.effect.as_ref().map(|effect| effect.clauses.len()), Some(6));
    assert_eq!(without_places(&read(&print(&ast))), without_places(&ast));
}
