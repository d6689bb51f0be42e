//! A model while its items are resolved.

use std::collections::BTreeMap;

use super::density::reading::DensityFormula;
use super::expression::{ExprLowering, NumberReading, OpenArguments, TypedExpr};
use super::scope::NameDefinition;
use super::{DeclarationHeader, Input, Model, Parameter};
use crate::diagnostics::{Diagnostics, ErrorReported};
use crate::syntax::ast::{Expr, Item, Name};
use crate::units::Unit;

pub(in crate::model) struct ModelResolver<'a> {
    pub(in crate::model) lowering: ExprLowering<'a>,
    pub(in crate::model) settings: BTreeMap<&'a str, &'a Expr>,
    /// Position of the next loop.
    pub(in crate::model) next_loop: usize,
    /// Formulas of noise, by position of the output.
    pub(in crate::model) formulas: Vec<(usize, DensityFormula)>,
    /// Parameters and inputs that are elements of arrays: they follow the others.
    pub(in crate::model) elements: (Vec<Parameter>, Vec<Input>),
    pub(in crate::model) model: Model,
}

impl<'a> ModelResolver<'a> {
    /// The start value set from outside, or else the declared one.
    pub(in crate::model) fn start_of(
        &self,
        name: &Name,
        declared: Option<&'a Expr>,
    ) -> Option<&'a Expr> {
        self.settings.get(name.text.as_str()).copied().or(declared)
    }

    /// The position of an array of constants, parameters or inputs.
    pub(in crate::model) fn vector(
        &self,
        name: &Name,
        diagnostics: &mut Diagnostics,
    ) -> Result<usize, ErrorReported> {
        let entry = self.lowering.scope.names.get(name.text.as_str());
        match entry.map(|entry| entry.definition) {
            Some(NameDefinition::Vector(vector)) => Ok(vector),
            // A duplicate declaration of a name has been reported.
            _ => diagnostics.check().map(|()| unreachable!("arrays are collected")),
        }
    }

    pub(in crate::model) fn declared(
        &self,
        item: &Item,
        name: &Name,
    ) -> Result<DeclarationHeader, ErrorReported> {
        let entry = self.lowering.scope.names.get(name.text.as_str());
        // A duplicate declaration of a name has been reported; the unit of the first would mislead.
        let unit = entry.and_then(|entry| entry.unit.clone());
        Ok(DeclarationHeader {
            name: name.text.clone(),
            span: name.span,
            unit: unit.unwrap_or_else(|| Ok(Unit::one()))?,
            doc: item.doc.clone(),
        })
    }

    /// A declared value: plain numbers are in the declared unit, anything else must have its dimension.
    pub(in crate::model) fn in_unit(
        &mut self,
        expr: &'a Expr,
        unit: &Unit,
        reading: NumberReading,
        diagnostics: &mut Diagnostics,
    ) -> Result<TypedExpr, ErrorReported> {
        self.lowering.in_unit(expr, unit, reading, &OpenArguments::new(), diagnostics)
    }
}
