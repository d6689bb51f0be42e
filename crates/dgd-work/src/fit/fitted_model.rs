//! The text of a fitted model: the original with estimates and settings substituted.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};

use dgd_compiler::model::Setting;
use dgd_compiler::pipeline::CompiledStages;
use dgd_compiler::source::{SourceMap, Span};
use dgd_compiler::syntax::edit::{ElementText, NewValue, element_of, list_of, with_values};
use dgd_compiler::syntax::layout;
use dgd_compiler::units::Unit;
use dgd_data::cell::push_number;
use dgd_identify::ParameterEstimate;
use dgd_runtime::Direction;

/// Digits of an estimate; the rest is far below the tolerance of any simulation.
const DIGITS: usize = 10;

/// File name of the fitted model: that of the model.
pub(crate) fn file_name(model: &Path) -> String {
    let name = model.file_name().unwrap_or_default();
    Path::new(name).with_extension("dgd").to_string_lossy().into_owned()
}

/// The result for programs.
pub(crate) const RESULT: &str = "result.json";

/// The page to read.
pub(crate) const REPORT: &str = "report.html";

/// Estimates over time.
pub(crate) const ESTIMATES: &str = "estimates.csv";

/// All files that a fit may write.
pub fn file_names(model: &Path) -> Vec<String> {
    let names = [RESULT, REPORT, ESTIMATES].map(str::to_owned);
    std::iter::once(file_name(model)).chain(names).collect()
}

/// The model file with fitted parameters, with `--set`, and with the initial values of the first recording where the
/// model has constants for them.
///
/// An initial value that the model computes from inputs or parameters stays a computation. Paths of imports are changed
/// to be relative to `folder`.
pub(crate) fn text(
    compiled: &CompiledStages,
    sources: &SourceMap,
    settings: &[Setting],
    estimates: &[ParameterEstimate],
    model: &Path,
    folder: &Path,
) -> String {
    let ast = &compiled.asts[0];
    let mut values: Vec<NewValue> = settings
        .iter()
        .filter(|setting| element_of(&setting.name.text).is_none())
        .filter_map(|setting| {
            let called = setting.name.text.clone();
            let name = declared(compiled, &called)?;
            Some(NewValue { name, called, text: sources.text(setting.value.span).to_owned() })
        })
        .collect();
    for estimate in estimates {
        values.extend(new_value(compiled, estimate));
    }
    values.extend(arrays(compiled, settings, estimates));
    let text = &sources.get(ast.source).text;
    let edited = with_values(ast, text, &values, |path| moved(path, model, folder));
    layout::like(ast.source, sources, edited)
}

/// Span of the declaration of something that can be set.
fn declared(compiled: &CompiledStages, name: &str) -> Option<Span> {
    let model = &compiled.model;
    let constants = model.constants.iter().map(|constant| &constant.declared);
    let parameters = model.parameters.iter().map(|parameter| &parameter.declared);
    let unknowns = model.unknowns.iter().map(|unknown| &unknown.declared);
    let arrays = model.arrays.iter().map(|array| &array.unknown.declared);
    let mut declarations = constants.chain(parameters).chain(unknowns).chain(arrays);
    let span = declarations.find(|declared| declared.name == name).map(|declared| declared.span);
    let mut sizes = model.sizes.iter().map(|(size, _)| size);
    span.or_else(|| sizes.find(|size| size.text == name).map(|size| size.span))
}

/// Span of the declaration of an array, whether an element has a new value, and all their values.
type ElementEdits = (Span, bool, Vec<ElementText>);

/// The arrays of constants and parameters with new values of elements: all their current values.
fn arrays(
    compiled: &CompiledStages,
    settings: &[Setting],
    estimates: &[ParameterEstimate],
) -> Vec<NewValue> {
    let constants = compiled.model.constants.iter().map(|c| (&c.declared, c.value, None));
    let parameters = compiled.dae.parameters.iter().enumerate().map(|(i, parameter)| {
        let is_it = |e: &&ParameterEstimate| e.of == Direction::Parameter(i);
        (&parameter.declared, parameter.value, estimates.iter().find(is_it))
    });
    let mut arrays: BTreeMap<&str, ElementEdits> = BTreeMap::new();
    for (declared, value, estimate) in constants.chain(parameters) {
        let Some((of, indices)) = element_of(&declared.name) else { continue };
        let is_set = |setting: &Setting| {
            let name = setting.name.text.as_str();
            name == of || element_of(name).is_some_and(|(array, _)| array == of)
        };
        let text = match estimate {
            Some(e) if e.at_bound.is_none() => rounded(e.value, &declared.unit),
            Some(e) => exact(e.value, &declared.unit),
            None => exact(value, &declared.unit),
        };
        let (_, changed, values) = arrays.entry(of).or_insert((declared.span, false, Vec::new()));
        *changed |= estimate.is_some() || settings.iter().any(is_set);
        values.push((indices, text));
    }
    let changed = arrays.into_iter().filter(|(_, (_, changed, _))| *changed);
    let value = |(of, (name, _, values)): (&str, ElementEdits)| NewValue {
        name,
        called: of.to_owned(),
        text: list_of(&values),
    };
    changed.map(value).collect()
}

fn new_value(compiled: &CompiledStages, estimate: &ParameterEstimate) -> Option<NewValue> {
    let (name, called, unit) = match estimate.of {
        Direction::Parameter(i) => {
            let declared = &compiled.dae.parameters[i].declared;
            if element_of(&declared.name).is_some() {
                // It is written with the other elements of its array.
                return None;
            }
            (declared.span, &declared.name, &declared.unit)
        }
        Direction::Start(i) => {
            let unknown = &compiled.dae.unknowns[i];
            // A computed initial value, or one of another recording, does not belong in the model.
            if estimate.recording != Some(0) || compiled.dae.graph.value(unknown.start).is_none() {
                return None;
            }
            (declared(compiled, &unknown.name)?, &unknown.name, &unknown.unit)
        }
    };
    let text = if estimate.at_bound.is_some() {
        exact(estimate.value, unit)
    } else {
        rounded(estimate.value, unit)
    };
    Some(NewValue { name, called: called.clone(), text })
}

/// A value in its unit, to [`DIGITS`] digits; exact if those would round it to nothing.
fn rounded(si: f64, unit: &Unit) -> String {
    let value = unit.from_si(si);
    match format!("{value:.*e}", DIGITS - 1).parse::<f64>() {
        Ok(rounded) => number(rounded),
        Err(_) => number(value),
    }
}

/// A value in its unit that reads back as exactly the same number, so that it does not overstep a bound.
fn exact(si: f64, unit: &Unit) -> String {
    let value = unit.from_si(si);
    let rounded = format!("{value:.*e}", DIGITS - 1).parse::<f64>().ok();
    let around = [Some(value), Some(value.next_down()), Some(value.next_up())];
    let read_back = |value: &f64| unit.to_si(*value) == si;
    number(rounded.into_iter().chain(around.into_iter().flatten()).find(read_back).unwrap_or(value))
}

/// Writes large numbers with an exponent.
fn number(value: f64) -> String {
    if value.abs() >= 1e6 {
        return format!("{value:e}");
    }
    let mut text = String::new();
    push_number(&mut text, value);
    text
}

/// The path of an import relative to another folder; `None` if it cannot be determined.
fn moved(path: &str, model: &Path, folder: &Path) -> Option<String> {
    let library = model.parent()?.join(path).canonicalize().ok()?;
    // The folder may not exist yet.
    let folder = match folder.canonicalize() {
        Ok(folder) => folder,
        Err(_) => absolute_parent(folder)?.join(folder.file_name()?),
    };
    let common = library
        .components()
        .zip(folder.components())
        .take_while(|(library, folder)| library == folder)
        .count();
    let up = folder.components().skip(common).map(|_| Component::ParentDir);
    let path: PathBuf = up.chain(library.components().skip(common)).collect();
    Some(path.to_str()?.replace(std::path::MAIN_SEPARATOR, "/"))
}

fn absolute_parent(folder: &Path) -> Option<PathBuf> {
    match folder.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.canonicalize().ok(),
        _ => std::env::current_dir().ok(),
    }
}
