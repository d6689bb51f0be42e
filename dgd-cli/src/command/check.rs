//! `dgd check`: syntax, names, units and structure, in every variant.

use std::fmt::Write;
use std::path::Path;

use dgd_compiler::dae::{Dae, assemble};
use dgd_compiler::diagnostics::{Diagnostics, Reported};
use dgd_compiler::effects::Effect;
use dgd_compiler::model::{
    Automaton, AutomatonKind, Declared, Interpolation, Model, Variant, resolve,
};
use dgd_compiler::pipeline::Directions;
use serde_json::{Value, json};

use crate::args::{CheckArgs, Choices};
use crate::console::Console;
use crate::effects::{model_of, parsed};
use crate::failure::CommandError;
use crate::load::Compilation;

pub(crate) fn run(args: &CheckArgs, console: Console<'_>) -> Result<(), CommandError> {
    let Some(effect) = effect(&args.model)? else {
        return check(&args.model, &args.choices, console);
    };
    let Some(model) = model_of(&args.model, &effect) else {
        let (path, name) = (args.model.display(), effect.full_name());
        console.remark(&format!("{path}: effect `{name}` is sound by itself"));
        return Ok(());
    };
    // With the effect as one more that is applied.
    let mut choices = args.choices.clone();
    choices.apply.push(args.model.display().to_string());
    check(&model, &choices, console)
}

/// The effect in a file; nothing where the file holds a model.
fn effect(path: &Path) -> Result<Option<Effect>, CommandError> {
    let mut compilation = Compilation::default();
    let (sources, diagnostics) = (&mut compilation.sources, &mut compilation.diagnostics);
    let read = match parsed(path, sources, diagnostics)? {
        Ok(ast) if ast.effect.is_none() => return Ok(None),
        Ok(ast) => Effect::read(ast, diagnostics),
        Err(reported) => Err(reported),
    };
    match read {
        Ok(effect) => Ok(Some(effect)),
        Err(reported) => Err(compilation.fail(reported)),
    }
}

/// Checks a model with the effects that are applied to it.
fn check(path: &Path, choices: &Choices, console: Console<'_>) -> Result<(), CommandError> {
    let mut compilation = Compilation::default();
    let options = compilation.options(choices)?;
    let compiled = match compilation.compile(path, &choices.apply, &options, &Directions::None)? {
        Ok((compiled, _)) => compiled,
        Err(reported) => return Err(compilation.fail(reported)),
    };

    // What was not chosen must be sound too, one choice at a time.
    for Variant { name, choices, chosen } in &compiled.model.variants {
        if options.variants.iter().any(|(variant, _)| variant.text == *name) {
            continue;
        }
        for (_, choice) in choices.iter().enumerate().filter(|(i, _)| i != chosen) {
            let mut other = options.clone();
            let variant = compilation.name("--variant", name);
            other.variants.push((variant, compilation.name("--variant", choice)));
            let mut own = Diagnostics::default();
            // Mistakes are collected: one choice's say nothing about the next.
            let _: Result<_, Reported> = resolve(&compiled.asts, &other, &mut own)
                .and_then(|model| assemble(&model, &mut own));
            for diagnostic in own.sorted() {
                compilation.diagnostics.error(diagnostic.clone());
            }
        }
    }
    if let Err(reported) = compilation.diagnostics.check() {
        return Err(compilation.fail(reported));
    }

    console.spare(&compilation.sources)?;
    if console.writes_json() {
        return console.json(&describe(&compiled.model, &compiled.dae));
    }
    if console.out().is_none() {
        console.remark(&summary(&path.display().to_string(), &compiled.model, &compiled.dae));
        return Ok(());
    }
    console.result(&summary(&path.display().to_string(), &compiled.model, &compiled.dae))
}

/// One line for people: what is in the model.
fn summary(path: &str, model: &Model, dae: &Dae) -> String {
    let of_families = dae.families.iter().filter(|family| family.differential);
    let differential = dae.unknowns.iter().filter(|unknown| unknown.differential).count()
        + of_families.map(|family| family.count as usize).sum::<usize>();
    let of_arrays = dae.output_arrays.iter().map(|array| array.count as usize);
    let counts = [
        (differential, "state"),
        (dae.n() - differential, "algebraic unknown"),
        (model.inputs.len(), "input"),
        (model.parameters.len(), "parameter"),
        (model.outputs.len() + of_arrays.sum::<usize>(), "output"),
    ];
    let mut text = format!("{path}: model `{}` is sound: ", model.name);
    let parts: Vec<String> = counts
        .iter()
        .filter(|(n, _)| *n > 0)
        .map(|(n, noun)| format!("{n} {noun}{}", if *n == 1 { "" } else { "s" }))
        .collect();
    text.push_str(&parts.join(", "));
    for part in &model.parts {
        let _ = write!(text, "; part {}: {}", part.name, part.model);
    }
    for variant in &model.variants {
        let choices: Vec<&str> = variant.choices.iter().map(String::as_str).collect();
        let _ = write!(text, "; variant {} = {}", variant.name, choices.join(" | "));
    }
    for automaton in &model.automata {
        if automaton.kind == AutomatonKind::When {
            let _ = write!(text, "; when {}", automaton.name);
            continue;
        }
        let modes: Vec<&str> = automaton.modes.iter().map(|mode| mode.name.as_str()).collect();
        let _ = write!(text, "; modes {} = {}", automaton.name, modes.join(" | "));
    }
    text.push('\n');
    text.trim_end().to_owned()
}

/// What a program wants to know about a model. Values are in the declared unit.
fn describe(model: &Model, dae: &Dae) -> Value {
    let finite = |declared: &Declared, si: f64| si.is_finite().then(|| declared.unit.from_si(si));
    let head = |declared: &Declared| {
        json!({
            "name": declared.name,
            "unit": declared.unit.symbol,
            "doc": declared.doc.join("\n"),
        })
    };
    let with = |mut base: Value, more: Value| {
        if let (Some(base), Value::Object(more)) = (base.as_object_mut(), more) {
            base.extend(more);
        }
        base
    };
    let inputs: Vec<Value> = model
        .inputs
        .iter()
        .map(|input| {
            let interpolation = match input.interpolation {
                Interpolation::Hold => "hold",
                Interpolation::Linear => "linear",
            };
            with(head(&input.declared), json!({ "interpolation": interpolation }))
        })
        .collect();
    let states: Vec<Value> = dae
        .unknowns
        .iter()
        .map(|unknown| {
            let start = dae.graph.value(unknown.start).map(|si| unknown.unit.from_si(si));
            json!({
                "name": unknown.name,
                "unit": unknown.unit.symbol,
                "doc": unknown.doc.join("\n"),
                "differential": unknown.differential,
                "start": start,
            })
        })
        .collect();
    let arrays: Vec<Value> = dae
        .arrays
        .iter()
        .map(|array| {
            let start = dae.graph.value(array.start).map(|si| array.unit.from_si(si));
            let upper = array.lower + i64::from(array.count) - 1;
            json!({
                "name": array.name,
                "unit": array.unit.symbol,
                "doc": array.doc.join("\n"),
                "range": [array.lower, upper],
                "start": start,
            })
        })
        .collect();
    let sizes: Vec<Value> = model
        .sizes
        .iter()
        .map(|(name, value)| json!({ "name": name.text, "value": value }))
        .collect();
    let parameters: Vec<Value> = model
        .parameters
        .iter()
        .map(|parameter| {
            let declared = &parameter.declared;
            with(
                head(declared),
                json!({
                    "value": declared.unit.from_si(parameter.value),
                    "bounds": [finite(declared, parameter.lower), finite(declared, parameter.upper)],
                    "log": parameter.log,
                    "fixed": parameter.fixed,
                }),
            )
        })
        .collect();
    let constants: Vec<Value> = model
        .constants
        .iter()
        .map(|constant| {
            let value = constant.declared.unit.from_si(constant.value);
            with(head(&constant.declared), json!({ "value": value }))
        })
        .collect();
    let outputs: Vec<Value> = model
        .outputs
        .iter()
        .map(|output| {
            let noise = output.noise.map(|si| si / output.declared.unit.factor);
            with(head(&output.declared), json!({ "noise": noise }))
        })
        .chain(dae.output_arrays.iter().map(|array| {
            let noise = array.noise.map(|si| si / array.declared.unit.factor);
            let upper = array.lower + i64::from(array.count) - 1;
            let range = [array.lower, upper];
            with(head(&array.declared), json!({ "noise": noise, "range": range }))
        }))
        .collect();
    let equations: Vec<Value> = model
        .equations
        .iter()
        .map(|equation| json!({ "label": equation.label, "doc": equation.doc.join("\n") }))
        .chain(model.families.iter().map(|family| {
            let upper = family.lower + i64::from(family.count) - 1;
            let doc = family.equation.doc.join("\n");
            json!({ "label": family.equation.label, "doc": doc, "range": [family.lower, upper] })
        }))
        .collect();
    let variants: Vec<Value> = model
        .variants
        .iter()
        .map(|variant| {
            json!({
                "name": variant.name,
                "choices": variant.choices,
                "chosen": variant.choices[variant.chosen],
            })
        })
        .collect();
    let parts: Vec<Value> = model
        .parts
        .iter()
        .map(|part| json!({ "name": part.name, "model": part.model, "doc": part.doc.join("\n") }))
        .collect();
    let blocks = model.automata.iter().filter(|a| a.kind == AutomatonKind::Modes);
    let modes: Vec<Value> = blocks.map(describe_modes).collect();
    let whens: Vec<Value> = model
        .automata
        .iter()
        .filter(|automaton| automaton.kind == AutomatonKind::When)
        .map(|automaton| json!({ "condition": automaton.name, "doc": automaton.doc.join("\n") }))
        .collect();
    json!({
        "model": model.name,
        "doc": model.doc.join("\n"),
        "constants": constants,
        "inputs": inputs,
        "sizes": sizes,
        "states": states,
        "arrays": arrays,
        "parameters": parameters,
        "outputs": outputs,
        "equations": equations,
        "variants": variants,
        "modes": modes,
        "parts": parts,
        "whens": whens,
        "diagnostics": [],
    })
}

fn describe_modes(automaton: &Automaton) -> Value {
    let name = |mode: usize| &automaton.modes[mode].name;
    let modes: Vec<Value> = automaton
        .modes
        .iter()
        .map(|mode| {
            let equations: Vec<&str> = mode.equations.iter().map(|e| e.label.as_str()).collect();
            json!({ "name": mode.name, "doc": mode.doc.join("\n"), "equations": equations })
        })
        .collect();
    let transitions: Vec<Value> = automaton
        .transitions
        .iter()
        .filter_map(|transition| {
            Some(json!({ "from": name(transition.from?), "to": name(transition.to) }))
        })
        .collect();
    json!({
        "name": automaton.name,
        "doc": automaton.doc.join("\n"),
        "start": name(automaton.start),
        "modes": modes,
        "transitions": transitions,
    })
}
