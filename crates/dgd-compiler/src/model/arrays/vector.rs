//! Arrays of constants, parameters and inputs: each element has a position among those of its kind, and a name of its
//! own.

use super::rows::open_axes;
use crate::diagnostics::{Diagnostics, ErrorReported};
use crate::model::expression::NumberReading;
use crate::model::resolver::ModelResolver;
use crate::model::scope::Vector;
use crate::model::{Constant, DeclarationHeader, Input, Interpolation, Parameter};
use crate::syntax::ast::{Attribute, AttributeKind, Expr, Item};

impl<'a> ModelResolver<'a> {
    /// The name, unit and expression of each element, one after another.
    fn each_element<T>(
        &mut self,
        item: &Item,
        vector: usize,
        diagnostics: &mut Diagnostics,
        mut make: impl FnMut(
            &mut Self,
            DeclarationHeader,
            Option<&'a Expr>,
            &mut Diagnostics,
        ) -> Result<T, ErrorReported>,
    ) -> Result<Vec<T>, ErrorReported> {
        let Vector { name, axes, value, place, .. } = self.lowering.scope.vectors[vector].clone();
        let place = place?;
        let declared = self.declared(item, name)?;
        let value = self.settings.get(name.text.as_str()).copied().or(value);
        if let Some(value) = value {
            place.shape.verify_list(&name.text, value, diagnostics)?;
        }
        let mut elements = Vec::new();
        for offset in 0..place.count() {
            let element_name = format!("{}{}", name.text, place.shape.brackets(offset));
            let set = self.settings.get(element_name.as_str()).copied();
            let value = set.or(value.map(|value| place.shape.value_at(value, offset)));
            self.lowering.indices = open_axes(axes, &place.shape.indices(offset));
            let declared = DeclarationHeader { name: element_name, ..declared.clone() };
            let made = make(self, declared, value, diagnostics);
            self.lowering.indices.clear();
            // The next would fail in the same way.
            elements.push(made?);
        }
        Ok(elements)
    }

    pub(in crate::model) fn constants_of(
        &mut self,
        item: &Item,
        vector: usize,
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<Constant>, ErrorReported> {
        self.each_element(item, vector, diagnostics, |this, declared, value, diagnostics| {
            let value = value.unwrap_or_else(|| unreachable!("the parser asks for a value"));
            let value =
                this.lowering.known(value, &declared.unit, NumberReading::Value, diagnostics)?;
            Ok(Constant { declared, value })
        })
    }

    pub(in crate::model) fn parameters_of(
        &mut self,
        item: &Item,
        vector: usize,
        attributes: &'a [Attribute],
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<Parameter>, ErrorReported> {
        self.each_element(item, vector, diagnostics, |this, declared, value, diagnostics| {
            let value = value.unwrap_or_else(|| unreachable!("the parser asks for a value"));
            this.parameter(declared, value, attributes, diagnostics)
        })
    }

    pub(in crate::model) fn inputs_of(
        &mut self,
        item: &Item,
        vector: usize,
        attributes: &[Attribute],
        diagnostics: &mut Diagnostics,
    ) -> Result<Vec<Input>, ErrorReported> {
        let linear = attributes.iter().any(|a| a.kind == AttributeKind::Linear);
        let interpolation = if linear { Interpolation::Linear } else { Interpolation::Hold };
        self.each_element(item, vector, diagnostics, |_, declared, _, _| {
            Ok(Input { declared, interpolation })
        })
    }
}
