//! The contents of a model, for programs. Values are in the declared units.

use std::fmt::Write;

use dgd_compiler::dae::Dae;
use dgd_compiler::model::{Automaton, AutomatonOrigin, DeclarationHeader, Interpolation, Model};
use serde::Serialize;

use crate::error::Mistake;
use crate::output::columns::is_share;
use crate::output::provenance::Provenance;

/// The contents of a model.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct ModelDescription {
    /// Name of the model.
    pub model: String,
    /// Its documentation in the model text.
    pub doc: String,
    /// Constants.
    pub constants: Vec<ConstantDescription>,
    /// Inputs.
    pub inputs: Vec<InputDescription>,
    /// Sizes of arrays.
    pub sizes: Vec<SizeDescription>,
    /// Unknowns that are not elements of arrays.
    pub states: Vec<UnknownDescription>,
    /// Arrays of unknowns.
    pub arrays: Vec<ArrayDescription>,
    /// Parameters.
    pub parameters: Vec<ParameterDescription>,
    /// Outputs.
    pub outputs: Vec<OutputDescription>,
    /// Equations.
    pub equations: Vec<EquationDescription>,
    /// Variants, with the chosen choices.
    pub variants: Vec<VariantChoices>,
    /// Blocks of modes.
    pub modes: Vec<ModesDescription>,
    /// Models inside it.
    pub parts: Vec<PartDescription>,
    /// Events: the conditions and periods of `when` and `every`.
    pub whens: Vec<EventDescription>,
    /// Mistakes: always empty, because a model with mistakes is not described.
    pub diagnostics: Vec<Mistake>,
    /// Versions and digests of the inputs.
    pub provenance: Provenance,
    /// One line to print.
    #[serde(skip)]
    pub summary: String,
}

/// A constant.
#[derive(Debug, Clone, Serialize)]
pub struct ConstantDescription {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its documentation in the model text.
    pub doc: String,
    /// Its value.
    pub value: f64,
}

/// An input.
#[derive(Debug, Clone, Serialize)]
pub struct InputDescription {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its documentation in the model text.
    pub doc: String,
    /// Its value between samples: `hold` or `linear`.
    pub interpolation: &'static str,
}

/// The size of arrays.
#[derive(Debug, Clone, Serialize)]
pub struct SizeDescription {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: i64,
}

/// An unknown.
#[derive(Debug, Clone, Serialize)]
pub struct UnknownDescription {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its documentation in the model text.
    pub doc: String,
    /// Whether it is differential, with an initial value of its own.
    pub differential: bool,
    /// Its initial value, if that is a number.
    pub start: Option<f64>,
}

/// An array of unknowns.
#[derive(Debug, Clone, Serialize)]
pub struct ArrayDescription {
    /// Its name.
    pub name: String,
    /// Unit of its elements.
    pub unit: String,
    /// Its documentation in the model text.
    pub doc: String,
    /// First and last index.
    pub range: [i64; 2],
    /// Initial value of its elements, if that is a number.
    pub start: Option<f64>,
}

/// A parameter.
#[derive(Debug, Clone, Serialize)]
pub struct ParameterDescription {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its documentation in the model text.
    pub doc: String,
    /// Its value.
    pub value: f64,
    /// Lower and upper bound, if any.
    pub bounds: [Option<f64>; 2],
    /// Whether its logarithm is estimated.
    pub log: bool,
    /// Whether it is fixed unless a request frees it.
    pub fixed: bool,
}

/// An output, or an array of them.
#[derive(Debug, Clone, Serialize)]
pub struct OutputDescription {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its documentation in the model text.
    pub doc: String,
    /// Standard deviation of its noise, if declared.
    pub noise: Option<f64>,
    /// First and last index of an array.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range: Option<[i64; 2]>,
}

/// An equation, or a family of them.
#[derive(Debug, Clone, Serialize)]
pub struct EquationDescription {
    /// Its label.
    pub label: String,
    /// Its documentation in the model text.
    pub doc: String,
    /// First and last index of a family.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range: Option<[i64; 2]>,
}

/// A variant.
#[derive(Debug, Clone, Serialize)]
pub struct VariantChoices {
    /// Its name.
    pub name: String,
    /// Its choices.
    pub choices: Vec<String>,
    /// The chosen one.
    pub chosen: String,
}

/// A block of modes.
#[derive(Debug, Clone, Serialize)]
pub struct ModesDescription {
    /// Its name.
    pub name: String,
    /// Its documentation in the model text.
    pub doc: String,
    /// The initial mode.
    pub start: String,
    /// Its modes.
    pub modes: Vec<ModeDescription>,
    /// Transitions between the modes.
    pub transitions: Vec<TransitionDescription>,
}

/// A mode.
#[derive(Debug, Clone, Serialize)]
pub struct ModeDescription {
    /// Its name.
    pub name: String,
    /// Its documentation in the model text.
    pub doc: String,
    /// Labels of the equations that hold in this mode only.
    pub equations: Vec<String>,
}

/// A transition between modes.
#[derive(Debug, Clone, Serialize)]
pub struct TransitionDescription {
    /// The mode that is left.
    pub from: String,
    /// The mode that is entered.
    pub to: String,
}

/// A model inside a model.
#[derive(Debug, Clone, Serialize)]
pub struct PartDescription {
    /// Its name in the outer model.
    pub name: String,
    /// Name of its model.
    pub model: String,
    /// Its documentation in the model text.
    pub doc: String,
}

/// An event.
#[derive(Debug, Clone, Serialize)]
pub struct EventDescription {
    /// The condition; for an `every`, that word and its period.
    pub condition: String,
    /// Its documentation in the model text.
    pub doc: String,
}

impl ModelDescription {
    /// Describes a sound model; `path` is the name of its file.
    pub(crate) fn describe(path: &str, model: &Model, dae: &Dae, provenance: Provenance) -> Self {
        let blocks = model.automata.iter().filter(|a| a.origin == AutomatonOrigin::Modes);
        let whens = model.automata.iter().filter(|a| a.origin != AutomatonOrigin::Modes);
        ModelDescription {
            summary: summary(path, model, dae),
            model: model.name.clone(),
            doc: text(&model.doc),
            constants: constants(model),
            inputs: inputs(model),
            sizes: (model.sizes.iter())
                .map(|(name, value)| SizeDescription { name: name.text.clone(), value: *value })
                .collect(),
            states: states(dae),
            arrays: arrays(dae),
            parameters: parameters(model),
            outputs: outputs(model, dae),
            equations: equations(model),
            variants: (model.variants.iter())
                .map(|variant| VariantChoices {
                    name: variant.name.clone(),
                    choices: variant.choices.clone(),
                    chosen: variant.choices[variant.chosen].clone(),
                })
                .collect(),
            modes: blocks.map(modes).collect(),
            parts: (model.parts.iter())
                .map(|part| PartDescription {
                    name: part.name.clone(),
                    model: part.model.clone(),
                    doc: text(&part.doc),
                })
                .collect(),
            whens: whens
                .map(|automaton| EventDescription {
                    condition: match automaton.origin {
                        AutomatonOrigin::Every => format!("every {}", automaton.name),
                        AutomatonOrigin::When | AutomatonOrigin::Modes => automaton.name.clone(),
                    },
                    doc: text(&automaton.doc),
                })
                .collect(),
            diagnostics: Vec::new(),
            provenance,
        }
    }
}

fn text(doc: &[String]) -> String {
    doc.join("\n")
}

/// Name, unit and documentation of a declaration.
fn head(declared: &DeclarationHeader) -> (String, String, String) {
    (declared.name.clone(), declared.unit.symbol.clone(), text(&declared.doc))
}

/// First and last index of `count` elements.
fn range(lower: i64, count: u32) -> [i64; 2] {
    [lower, lower + i64::from(count) - 1]
}

fn constants(model: &Model) -> Vec<ConstantDescription> {
    let one = |constant: &dgd_compiler::model::Constant| {
        let (name, unit, doc) = head(&constant.declared);
        ConstantDescription {
            name,
            unit,
            doc,
            value: constant.declared.unit.from_si(constant.value),
        }
    };
    model.constants.iter().map(one).collect()
}

fn inputs(model: &Model) -> Vec<InputDescription> {
    let one = |input: &dgd_compiler::model::Input| {
        let (name, unit, doc) = head(&input.declared);
        let interpolation = match input.interpolation {
            Interpolation::Hold => "hold",
            Interpolation::Linear => "linear",
        };
        InputDescription { name, unit, doc, interpolation }
    };
    model.inputs.iter().map(one).collect()
}

fn states(dae: &Dae) -> Vec<UnknownDescription> {
    let unknowns = dae.unknowns.iter().filter(|unknown| !is_share(&unknown.name));
    unknowns
        .map(|unknown| UnknownDescription {
            name: unknown.name.clone(),
            unit: unknown.unit.symbol.clone(),
            doc: text(&unknown.doc),
            differential: unknown.differential,
            start: dae.graph.value(unknown.start).map(|si| unknown.unit.from_si(si)),
        })
        .collect()
}

fn arrays(dae: &Dae) -> Vec<ArrayDescription> {
    let arrays = dae.arrays.iter();
    arrays
        .map(|array| ArrayDescription {
            name: array.name.clone(),
            unit: array.unit.symbol.clone(),
            doc: text(&array.doc),
            range: range(array.lower, array.count),
            start: dae.graph.value(array.start).map(|si| array.unit.from_si(si)),
        })
        .collect()
}

fn parameters(model: &Model) -> Vec<ParameterDescription> {
    let parameters = model.parameters.iter();
    parameters
        .map(|parameter| {
            let declared = &parameter.declared;
            let finite = |si: f64| si.is_finite().then(|| declared.unit.from_si(si));
            let (name, unit, doc) = head(declared);
            ParameterDescription {
                name,
                unit,
                doc,
                value: declared.unit.from_si(parameter.value),
                bounds: [finite(parameter.lower), finite(parameter.upper)],
                log: parameter.log,
                fixed: parameter.fixed,
            }
        })
        .collect()
}

fn outputs(model: &Model, dae: &Dae) -> Vec<OutputDescription> {
    let single = model.outputs.iter().map(|output| {
        let (name, unit, doc) = head(&output.declared);
        let noise = output.noise.map(|si| si / output.declared.unit.factor);
        OutputDescription { name, unit, doc, noise, range: None }
    });
    let arrays = dae.output_arrays.iter().map(|array| {
        let (name, unit, doc) = head(&array.declared);
        let noise = array.noise.map(|si| si / array.declared.unit.factor);
        OutputDescription { name, unit, doc, noise, range: Some(range(array.lower, array.count)) }
    });
    single.chain(arrays).collect()
}

fn equations(model: &Model) -> Vec<EquationDescription> {
    let single = model.equations.iter().map(|equation| EquationDescription {
        label: equation.label.clone(),
        doc: text(&equation.doc),
        range: None,
    });
    let families = model.families.iter().map(|family| EquationDescription {
        label: family.equation.label.clone(),
        doc: text(&family.equation.doc),
        range: Some(range(family.lower, family.count)),
    });
    single.chain(families).collect()
}

fn modes(automaton: &Automaton) -> ModesDescription {
    let name = |mode: usize| automaton.modes[mode].name.clone();
    let modes = automaton.modes.iter();
    let modes = modes.map(|mode| ModeDescription {
        name: mode.name.clone(),
        doc: text(&mode.doc),
        equations: mode.equations.iter().map(|equation| equation.label.clone()).collect(),
    });
    let transitions = automaton.transitions.iter().filter_map(|transition| {
        Some(TransitionDescription { from: name(transition.from?), to: name(transition.to) })
    });
    ModesDescription {
        name: automaton.name.clone(),
        doc: text(&automaton.doc),
        start: name(automaton.start),
        modes: modes.collect(),
        transitions: transitions.collect(),
    }
}

/// The contents of the model in one line.
fn summary(path: &str, model: &Model, dae: &Dae) -> String {
    let of_families = dae.families.iter().filter(|family| family.differential);
    let differential = dae.unknowns.iter().filter(|unknown| unknown.differential).count()
        + of_families.map(|family| family.count as usize).sum::<usize>();
    let shares = dae.unknowns.iter().filter(|unknown| is_share(&unknown.name)).count();
    let of_arrays = dae.output_arrays.iter().map(|array| array.count as usize);
    let counts = [
        (differential, "state"),
        (dae.n() - differential - shares, "algebraic unknown"),
        (model.inputs.len(), "input"),
        (model.parameters.len(), "parameter"),
        (model.outputs.len() - model.densities.len() + of_arrays.sum::<usize>(), "output"),
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
    // The first automaton of a loop stands for all of them.
    let of_one_item = |a: &Automaton, b: &Automaton| {
        a.origin != AutomatonOrigin::Modes && a.transitions[0].span == b.transitions[0].span
    };
    for alike in model.automata.chunk_by(of_one_item) {
        let automaton = &alike[0];
        let word = match automaton.origin {
            AutomatonOrigin::Modes => None,
            AutomatonOrigin::When => Some("when"),
            AutomatonOrigin::Every => Some("every"),
        };
        if let Some(word) = word {
            let _ = write!(text, "; event `{word} {}`", automaton.name);
            if alike.len() > 1 {
                let _ = write!(text, " and {} more like it", alike.len() - 1);
            }
            continue;
        }
        let modes: Vec<&str> = automaton.modes.iter().map(|mode| mode.name.as_str()).collect();
        let _ = write!(text, "; modes {} = {}", automaton.name, modes.join(" | "));
    }
    text.push('\n');
    text.trim_end().to_owned()
}
