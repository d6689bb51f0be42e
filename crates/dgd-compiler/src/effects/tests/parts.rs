//! Parts of a model that an effect changes.

use crate::effects::{Effect, EffectApplication, EffectBlending, ModelWithEffects, apply, write};
use crate::model::{ModelOptions, resolve, text as model_text};
use crate::source::SourceText;
use crate::syntax::parse;
use crate::tank::{TANK, TankCompilation};

/// The text of a model after applying an effect; checks that it agrees with the changed trees.
fn written(files: &[(&str, &str)], effect: &str) -> String {
    let mut run = TankCompilation::new(files);
    let id = run.sources.add(SourceText { name: "effect.dgd".into(), text: effect.into() });
    let effect = parse(id, &run.sources, &mut run.diagnostics)
        .and_then(|ast| Effect::read(ast, &mut run.diagnostics));
    let effect = effect.unwrap_or_else(|_| panic!("{}", run.shown()));
    let application =
        EffectApplication { effect: &effect, arguments: Vec::new(), span: effect.name.span };
    let applied = apply(&run.asts, &[application], EffectBlending::Applied, &mut run.diagnostics);
    let ModelWithEffects { asts, brought } = applied.unwrap_or_else(|_| panic!("{}", run.shown()));
    let text = write(&run.asts[0], &asts[0], &brought, &run.sources);
    let resolved = resolve(&asts, &ModelOptions::default(), &mut run.diagnostics);
    let resolved = resolved.unwrap_or_else(|_| panic!("{}", run.shown()));
    let mut again: Vec<(&str, &str)> = files.to_vec();
    again[0].1 = &text;
    let model = TankCompilation::new(&again).model();
    assert_eq!(model_text::write(&model), model_text::write(&resolved));
    text
}

const POND: &str = "\
model pond
import \"tank.dgd\"
input rain [m^3/s]   # all of it
/// The upper one.
part one: tank
/// The lower one.
part two: tank(a = 0.03)   /// wider
one.q_in = rain
two.q_in = one.q_out   # nothing is lost
let both = one.h + two.h
";

#[test]
fn an_effect_on_the_whole_leaves_its_parts_as_they_were_written() {
    let files = [("pond.dgd", POND), ("tank.dgd", TANK)];
    let effect = "effect loss on pond\nkind plant\nparameter k = 0.1\n\
                  replace rain by (1 - k)*rain\n";
    let expected = POND.replace("one.q_in = rain", "one.q_in = (1 - k)*rain");
    let text = written(&files, effect);
    assert!(text.starts_with(&expected), "{text}");
    assert!(text.ends_with("\n# loss\nparameter k = 0.1\n"), "{text}");
}

#[test]
fn a_part_that_an_effect_changes_is_written_out() {
    let files = [("pond.dgd", POND), ("tank.dgd", TANK)];
    let effect =
        "effect leak on pond\nkind plant\nparameter k [m^3/s] = 0.1\nadd -k to two.level\n";
    let text = written(&files, effect);
    let expected = "\
model pond
import \"tank.dgd\"
input rain [m^3/s]   # all of it
/// The upper one.
part one: tank
# The lower one.
# part two: tank(a = 0.03)
constant two.g [m/s^2] = 9.81
constant two.A [m^2]   = 2
constant two.V [m^3]   = 3 [m]*two.A
parameter two.a [m^2] = 0.03  in 0 ..
state two.h [m] = 1
function two.speed(depth [m]) = sqrt(2*two.g*depth)
let two.q_out = two.a*two.speed(two.h)
equation two.level: two.A*der(two.h) = two.q_in - two.q_out - k
let two.p [bar] = 1000 [kg/m^3]*two.g*two.h
# wider
one.q_in = rain
let two.q_in [m^3/s] = one.q_out   # nothing is lost
let both = one.h + two.h

# leak
parameter k [m^3/s] = 0.1
";
    let squeezed = |text: &str| {
        let lines: Vec<String> = text
            .lines()
            .map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "))
            .collect();
        lines.join("\n")
    };
    assert_eq!(squeezed(&text), squeezed(expected), "{text}");
}

#[test]
fn what_only_parts_see_is_written_out_with_them() {
    let law = "constant k = 2\nfunction twice(x) = k*x\n";
    let pump = "model pump\nimport \"law.dgd\"\nstate x = 1\nequation e: der(x) = twice(x)/1 [s]\n";
    let main = "model pond\nimport \"pump.dgd\"\npart one: pump\npart two: pump\n";
    let files = [("pond.dgd", main), ("law.dgd", law), ("pump.dgd", pump)];
    let effect = "effect more on pond\nkind plant\nreplace law.k by law.k + 1\n";
    let text = written(&files, effect);
    assert!(text.contains("function law.twice(x) = (law.k + 1)*x"), "{text}");
    assert!(!text.contains("\npart") && !text.contains("import"), "{text}");
    let effect = "effect more on pond\nkind plant\nadd 1 [1/s] to one.e\n";
    let text = written(&files, effect);
    assert!(!text.contains("\npart") && !text.contains("import"), "{text}");
}
