//! Outputs of arrays: rows of elements, or each element by itself if their noise is more than a number.

use super::each::{MOST_WRITTEN_OUT, too_many};
use super::rows::name_of_row;
use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::Symbol;
use crate::model::check_units::{ExprDimension, unit_of};
use crate::model::density::reading::{NoisyOutput, OutputNoise};
use crate::model::expression::TypedExpr;
use crate::model::item::unit_read;
use crate::model::resolver::ModelResolver;
use crate::model::scope::{NameDefinition, ScopeEntry};
use crate::model::{DeclarationHeader, Output, OutputArray};
use crate::syntax::ast::{Attribute, Item, Name, WrittenUnit};
use crate::units::Unit;

/// Limit on the elements of an array that is an output: each has a name, a unit and a column.
const MOST_OUTPUTS: u32 = 2_000_000;

impl<'a> ModelResolver<'a> {
    /// `output p [bar]` of an array `p`.
    pub(in crate::model) fn output_array(
        &mut self,
        item: &Item,
        name: &'a Name,
        unit: Option<&'a WrittenUnit>,
        attributes: &'a [Attribute],
        diagnostics: &mut Diagnostics,
    ) -> Result<(), ErrorReported> {
        let written_unit = unit.map(|unit| unit_of(Some(unit), diagnostics)).transpose()?;
        let entry = self.lowering.scope.names.get(name.text.as_str()).cloned();
        let Some(ScopeEntry { definition: NameDefinition::Array { index, .. }, span, unit }) =
            entry
        else {
            unreachable!("asked before");
        };
        let declared = unit.unwrap_or_else(|| Ok(Unit::one()))?;
        let unit = unit_read(name, written_unit, &declared, span, diagnostics)?;
        let place = self.lowering.scope.arrays[index].clone()?;
        if place.count() > MOST_OUTPUTS {
            let message = format!(
                "`{}` is an output for {} elements; there can be {MOST_OUTPUTS}",
                name.text,
                place.count()
            );
            return Err(diagnostics.error(
                Diagnostic::new(Code::NotAKnownWholeNumber, name.span, message)
                    .about(&name.text)
                    .help("name the elements that are wanted: `output last = x[N]`"),
            ));
        }
        let named = |output_name: String| DeclarationHeader {
            name: output_name,
            span: name.span,
            unit: unit.clone(),
            doc: item.doc.clone(),
        };
        let noise_of = |resolver: &mut Self, k: u32, diagnostics: &mut Diagnostics| {
            let value = resolver.lowering.graph.symbol(Symbol::Element(place.first + k));
            let typed = TypedExpr { id: value, dim: ExprDimension::Of(unit.dimension) };
            let read = NoisyOutput { name: &name.text, value: typed, unit: unit.clone() };
            Ok((value, resolver.noise(&read, attributes, diagnostics)?))
        };
        let noise = match noise_of(self, 0, diagnostics)?.1 {
            OutputNoise::Silent => None,
            OutputNoise::Known(noise) => Some(noise),
            OutputNoise::Formula(_) => {
                let count = place.shape.count().unwrap_or(u32::MAX);
                if count > MOST_WRITTEN_OUT {
                    return Err(diagnostics.error(too_many(item, count)));
                }
                for k in 0..count {
                    let (value, noise) = noise_of(self, k, diagnostics)?;
                    if let OutputNoise::Formula(formula) = noise {
                        self.formulas.push((self.model.outputs.len(), formula));
                    }
                    let declared = named(format!("{}{}", name.text, place.shape.brackets(k)));
                    self.model.outputs.push(Output { declared, value, noise: None });
                }
                return Ok(());
            }
        };
        let shape = place.shape;
        let mut before = 0;
        for place in &self.lowering.scope.arrays[..index] {
            before += place.as_ref().map_err(|reported| *reported)?.shape.rows() as usize;
        }
        for row in 0..shape.rows() {
            let declared = named(name_of_row(name, &shape, row * shape.row().count));
            let output = OutputArray { declared, array: before + row as usize, noise };
            self.model.output_arrays.push(output);
        }
        Ok(())
    }
}
