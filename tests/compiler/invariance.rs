//! What must not matter: printing, the order of items, the units of declarations.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use dgd_compiler::dae::assemble;
use dgd_compiler::diagnostics::Diagnostics;
use dgd_compiler::model::{ModelOptions, resolve};
use dgd_compiler::pipeline::load;
use dgd_compiler::program::{Direction, lower};
use dgd_compiler::source::{SourceMap, SourceText};
use dgd_compiler::syntax::ast::{Ast, AttributeKind, Expr, ExprKind, Item, ItemKind, WrittenUnit};
use dgd_compiler::syntax::{parse, places, print};
use dgd_compiler::units::parse_unit;
use dgd_execute::InterpretedSystem;
use dgd_runtime::{EvaluationPoint, Inputs, Options, Problem, System, discrete_numbers, simulate};

use crate::golden::files;
use crate::support::{Noise, input_values, model_files, root};

fn parsed(name: &str, text: &str) -> Option<Ast> {
    let mut sources = SourceMap::default();
    let id = sources.add(SourceText { name: name.to_owned(), text: text.to_owned() });
    parse(id, &sources, &mut Diagnostics::default()).ok()
}

#[test]
fn what_is_printed_is_read_as_the_same() {
    let folders = ["models", "models/lib", "tests/golden/fail", "tests/golden/data"];
    let mut paths: Vec<PathBuf> =
        folders.iter().flat_map(|folder| files(&root().join(folder), "dgd")).collect();
    for case in ["arrays", "ode", "dae_with_variant", "functions_and_import", "modes", "effects"] {
        paths.push(root().join("tests/golden/pass").join(case).join("model.dgd"));
    }
    for path in paths {
        let text = fs::read_to_string(&path).expect("a file of the repository");
        let name = path.display().to_string();
        let Some(ast) = parsed(&name, &text) else { continue };
        let again = parsed(&name, &print::print(&ast)).expect("what is printed parses");
        assert_eq!(places::without_places(&again), places::without_places(&ast), "{name}");
    }
}

fn trees(path: &Path) -> Vec<Ast> {
    let text = fs::read_to_string(path).expect("a model file");
    let main = SourceText { name: path.display().to_string(), text };
    let mut read = |path: &str| fs::read_to_string(path).map_err(|error| error.to_string());
    load(main, &mut read, &mut SourceMap::default(), &mut Diagnostics::default())
        .expect("the repository's models parse")
}

fn interpreted(asts: &[Ast]) -> InterpretedSystem {
    let mut diagnostics = Diagnostics::default();
    let dae = resolve(asts, &ModelOptions::default(), &mut diagnostics)
        .and_then(|model| assemble(&model, &mut diagnostics))
        .unwrap_or_else(|_| panic!("{:?}", diagnostics.sorted()));
    let all: Vec<_> = (0..dae.parameters.len()).map(Direction::Parameter).collect();
    InterpretedSystem::new(lower(&dae, &all))
}

/// Right-hand sides, by their equations, outputs, and ∂f/∂p near the start, in SI. Every number is
/// found by its name, and changed a little so that nothing vanishes by accident.
fn values(system: &InterpretedSystem) -> BTreeMap<String, f64> {
    let signature = system.signature();
    let near = |name: &str, value: f64| {
        let seed = name
            .bytes()
            .fold(0_u64, |seed, byte| seed.wrapping_mul(31).wrapping_add(u64::from(byte)));
        value * (1.0 + 0.01 * Noise::new(seed).next())
    };
    let p: Vec<f64> = signature.parameters.iter().map(|x| near(&x.name, x.value)).collect();
    let u = input_values(signature, |name, _| near(name, 0.02), |name, _| near(name, 0.001));
    let mut y = vec![0.0; signature.unknowns.len()];
    let z = discrete_numbers(system, &p, 0.0);
    system.start(EvaluationPoint { t: 0.0, y: &[], u: &u, p: &p, z: &z }, &mut y);
    // Shares are counted in the order of the file: they are told apart by their switches.
    let equations = signature.equations.iter().map(|equation| without_numbers(equation.as_ref()));
    for ((value, unknown), equation) in y.iter_mut().zip(signature.unknowns.iter()).zip(equations) {
        let name = if unknown.name.starts_with("share(") { &equation } else { &*unknown.name };
        *value = near(name, *value + 0.01);
    }
    let at = EvaluationPoint { t: 0.5, y: &y, u: &u, p: &p, z: &z };

    let mut values = BTreeMap::new();
    let mut f = vec![0.0; y.len()];
    system.rhs(at, &mut f);
    let rows: Vec<String> = (signature.unknowns.iter().zip(signature.equations.iter()))
        .map(|(unknown, equation)| {
            if unknown.differential {
                format!("der({})", unknown.name)
            } else {
                format!("equation {}", without_numbers(equation.as_ref()))
            }
        })
        .collect();
    values.extend(rows.iter().cloned().zip(f));

    let mut w = vec![0.0; signature.outputs.len()];
    system.outputs(at, &mut w);
    values.extend(signature.outputs.iter().map(|x| format!("output {}", x.name)).zip(w));

    let pattern = &signature.parameter_jacobian;
    let mut dfdp = vec![0.0; pattern.len()];
    system.parameter_jacobian(at, &mut dfdp);
    for ((row, column), value) in pattern.positions().zip(dfdp) {
        values.insert(format!("{} to {}", rows[row], signature.parameters[column].name), value);
    }
    values
}

/// The label of an equation; the name of a switch is its text, whose numbers may be rounded otherwise.
fn without_numbers(equation: &str) -> String {
    let is_switch = equation.starts_with("switch ");
    equation.replace(|c: char| is_switch && "0123456789.".contains(c), "")
}

/// Equal but for rounding, `tolerance` of the largest value of the model.
#[track_caller]
fn compare(path: &Path, a: &BTreeMap<String, f64>, b: &BTreeMap<String, f64>, tolerance: f64) {
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>(), "{}", path.display());
    for (name, a) in a {
        let b = b[name];
        let both_undefined = a.is_nan() && b.is_nan();
        let close = (a - b).abs() <= tolerance * a.abs().max(b.abs()).max(1e-3);
        assert!(close || both_undefined, "{}: {name}: {a} and {b}", path.display());
    }
}

/// Another order of the items, blocks included. Unknowns stay in theirs: of those that a constraint
/// ties together the first are states.
fn shuffled(items: &mut [Item], noise: &mut Noise) {
    let is_unknown = |item: &&Item| matches!(item.kind, ItemKind::Unknown { .. });
    let in_order: Vec<Item> = items.iter().filter(is_unknown).cloned().collect();
    for last in (1..items.len()).rev() {
        let other = ((0.5 + 0.5 * noise.next()) * (last + 1) as f64) as usize;
        items.swap(last, other);
    }
    let unknowns = items.iter_mut().filter(|item| is_unknown(&&**item));
    for (item, first) in unknowns.zip(in_order) {
        *item = first;
    }
    for item in items {
        let (ItemKind::Variant { choices, .. } | ItemKind::Modes { modes: choices, .. }) =
            &mut item.kind
        else {
            continue;
        };
        for choice in choices {
            shuffled(&mut choice.items, noise);
        }
    }
}

#[test]
fn the_order_of_items_does_not_matter() {
    let mut noise = Noise::new(3);
    for path in model_files() {
        let asts = trees(&path);
        let expected = values(&interpreted(&asts));
        for _ in 0..5 {
            let mut other = asts.clone();
            for ast in &mut other {
                shuffled(&mut ast.items, &mut noise);
            }
            // Sums may be taken in another order: a few roundings, enlarged where terms cancel.
            compare(&path, &expected, &values(&interpreted(&other)), 1e-10);
        }
    }
}

/// A unit of the same kind: feet for metres and so on.
fn imperial(unit: &str) -> String {
    let mut out = String::new();
    let mut word = String::new();
    for letter in unit.chars().chain([' ']) {
        if letter.is_alphabetic() {
            word.push(letter);
            continue;
        }
        let other = match word.as_str() {
            "m" => "ft",
            "s" => "min",
            "kg" => "lb",
            "Pa" | "bar" => "psi",
            "lpm" => "m^3/d",
            same => same,
        };
        out.push_str(other);
        word.clear();
        out.push(letter);
    }
    out.trim_end().to_owned()
}

/// Multiplies a value that is a plain number; `None` where it is something else without a unit.
fn scaled(expr: &mut Expr, factor: f64) -> Option<()> {
    match &mut expr.kind {
        ExprKind::Number { unit: Some(_), .. } => {}
        ExprKind::Number { value, .. } => *value *= factor,
        ExprKind::Negate(inner) => scaled(inner, factor)?,
        _ => return None,
    }
    Some(())
}

/// The item declared in another unit, with its numbers converted; `None` where that takes more.
fn converted(item: &Item) -> Option<Item> {
    let mut item = item.clone();
    let (unit, value, attributes) = match &mut item.kind {
        ItemKind::Constant { unit, value, .. } => (unit, Some(value), &mut Vec::new()),
        ItemKind::Parameter { unit, value, attributes, .. } => (unit, Some(value), attributes),
        ItemKind::Unknown { unit, start, attributes, .. } => (unit, start.as_mut(), attributes),
        ItemKind::Input { unit, attributes, .. } => (unit, None, attributes),
        _ => return None,
    };
    let written = unit.as_ref()?;
    let other = imperial(&written.text);
    let (old, new) = (parse_unit(&written.text).ok()?, parse_unit(&other).ok()?);
    if old.offset != 0.0 || new.offset != 0.0 {
        return None;
    }
    let factor = old.factor / new.factor;
    if let Some(value) = value {
        scaled(value, factor)?;
    }
    for attribute in attributes {
        match &mut attribute.kind {
            AttributeKind::Bounds(lower, upper) => {
                for bound in [lower, upper].into_iter().flatten() {
                    scaled(bound, factor)?;
                }
            }
            AttributeKind::Nominal(size)
            | AttributeKind::Noise(size)
            | AttributeKind::History(size)
            | AttributeKind::Smooth(size) => scaled(size, factor)?,
            AttributeKind::Prior(_, mean, std) => {
                scaled(mean, factor)?;
                scaled(std, factor)?;
            }
            AttributeKind::Log
            | AttributeKind::Fixed
            | AttributeKind::Guess
            | AttributeKind::Hold
            | AttributeKind::Linear
            | AttributeKind::Exact
            | AttributeKind::Shape(_)
            | AttributeKind::Beyond(_) => {}
        }
    }
    *unit = Some(WrittenUnit::new(written.span, other));
    Some(item)
}

/// The model with imperial declarations, and how many there are.
fn rescaled(asts: &[Ast]) -> (Vec<Ast>, usize) {
    let mut other = asts.to_vec();
    let mut count = 0;
    for item in &mut other[0].items {
        if let Some(converted) = converted(item) {
            count += usize::from(converted.kind != item.kind);
            *item = converted;
        }
    }
    (other, count)
}

#[test]
fn the_units_of_declarations_do_not_matter() {
    let mut count = 0;
    for path in model_files() {
        let asts = trees(&path);
        let (other, converted) = rescaled(&asts);
        count += converted;
        // A conversion rounds twice; cancelling terms enlarge that.
        compare(&path, &values(&interpreted(&asts)), &values(&interpreted(&other)), 1e-10);
    }
    assert!(count > 50, "{count} declarations");
}

#[test]
fn the_units_of_declarations_leave_the_solution_alone() {
    let asts = trees(&root().join("models/mud_circulation.dgd"));
    // w_ssp, q_boost, q_tf in SI
    let inputs = Inputs::constant(&[0.53, 1850.0 / 60_000.0, 290.0 / 60_000.0]);
    let solve = |asts: &[Ast]| {
        let system = interpreted(asts);
        let p: Vec<f64> = system.signature().parameters.iter().map(|x| x.value).collect();
        let problem = Problem { system: &system, p: &p, inputs: &inputs, start: &[] };
        let solution = simulate(&problem, &[0.0, 100.0, 1000.0], &Options::default());
        let solution = solution.expect("it is smooth");
        (0..solution.len()).flat_map(|k| solution.y(k).to_vec()).collect::<Vec<_>>()
    };
    let (other, _) = rescaled(&asts);
    for (a, b) in solve(&asts).iter().zip(solve(&other)) {
        // Steps are chosen by sizes in SI, so that both runs take the same but for rounding.
        assert!((a - b).abs() <= 1e-9 * a.abs(), "{a} and {b}");
    }
}
