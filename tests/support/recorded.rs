//! Data files as recordings of a model.

use std::path::Path;

use dgd_compiler::diagnostics::{Diagnostics, render};
use dgd_compiler::model::{self, DeclarationHeader};
use dgd_compiler::pipeline::CompiledStages;
use dgd_compiler::source::SourceMap;
use dgd_data::{read, select};
use dgd_identify::Recording;
use dgd_runtime::{InputColumn, Inputs, Interpolation};

fn of(d: &DeclarationHeader) -> select::DeclaredColumn<'_> {
    select::DeclaredColumn { name: &d.name, unit: &d.unit, place: None }
}

/// The columns of a file that a model knows, SI; a file without a time column has a row each second.
pub(crate) fn recorded(compiled: &CompiledStages, path: &Path) -> Recording {
    let (mut sources, mut diagnostics) = (SourceMap::default(), Diagnostics::default());
    let table = read(path, &mut sources, &mut diagnostics).expect("a table");
    let inputs: Vec<_> = compiled.dae.inputs.iter().map(|input| of(&input.declared)).collect();
    let outputs: Vec<_> = compiled.dae.outputs.iter().map(|output| of(&output.declared)).collect();
    let values = select::inputs(&table, &inputs, &mut diagnostics);
    let measured = select::measured(&table, &outputs, &mut diagnostics);
    let (Ok(values), Ok(measured)) = (values, measured) else {
        panic!("{}", render::render(&diagnostics.sorted(), &sources, render::RenderStyle::Plain))
    };
    let rows = || (0..table.len()).map(|row| row as f64).collect();
    let times: Vec<f64> = table.time.clone().unwrap_or_else(rows);
    let columns: Vec<InputColumn<'_>> = compiled
        .dae
        .inputs
        .iter()
        .zip(&values)
        .map(|(input, values)| InputColumn {
            name: &input.declared.name,
            interpolation: match input.interpolation {
                model::Interpolation::Hold => Interpolation::Hold,
                model::Interpolation::Linear => Interpolation::Linear,
            },
            values,
        })
        .collect();
    let inputs = Inputs::recorded(&times, &columns).expect("inputs");
    Recording::new(times, inputs, measured)
}
