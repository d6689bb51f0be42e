//! Declared values of symbols, for choices that have to be made before a run.

use crate::expr::{ExprGraph, ExprId, Symbol};
use crate::model::Model;

/// Declared values of parameters, and initial values of unknowns.
#[derive(Clone)]
pub(super) struct TypicalValues {
    parameters: Vec<f64>,
    starts: Vec<f64>,
}

impl TypicalValues {
    pub(super) fn from_model(model: &Model, graph: &ExprGraph, starts: &[ExprId]) -> Self {
        let parameters = model.parameters.iter().map(|parameter| parameter.value).collect();
        let mut typical = TypicalValues { parameters, starts: Vec::new() };
        let values = starts.iter().map(|start| graph.evaluate(*start, &|s| typical.value(s)));
        typical.starts = values.collect();
        typical
    }

    /// The initial value; NaN if it is unknown beforehand.
    pub(super) fn value(&self, symbol: Symbol) -> f64 {
        let value = match symbol {
            Symbol::Parameter(i) | Symbol::SweptParameter(i, _) => self.parameters.get(i as usize),
            Symbol::Unknown(i) => self.starts.get(i as usize),
            Symbol::Time => Some(&0.0),
            Symbol::Constant(_)
            | Symbol::Input(_)
            | Symbol::InputSlope(_)
            | Symbol::SweptInput(..)
            | Symbol::SweptInputSlope(..)
            | Symbol::Derivative(_)
            | Symbol::Sensitivity(_)
            | Symbol::Delayed(_)
            | Symbol::DelayedUnknown(_)
            | Symbol::Element(_)
            | Symbol::Swept(_)
            | Symbol::ElementRate(_)
            | Symbol::SweptRate(_)
            | Symbol::SweptSensitivity(_)
            | Symbol::Counter
            | Symbol::Past(..)
            | Symbol::Discrete(_) => None,
        };
        value.copied().unwrap_or(f64::NAN)
    }
}
