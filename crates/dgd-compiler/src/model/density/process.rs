//! `noise` of a state: its process noise.
//!
//! ```text
//!   dx = f dt + r dβ      β: Brownian motion;  r in the unit of x over the root of a second
//! ```

use crate::diagnostics::{Code, Diagnostic, Diagnostics, ErrorReported};
use crate::expr::{Node, Symbol};
use crate::model::ProcessNoise;
use crate::model::expression::{NumberReading, OpenArguments};
use crate::model::resolver::ModelResolver;
use crate::syntax::ast::Expr;
use crate::units::{Unit, parse_unit};

impl<'a> ModelResolver<'a> {
    /// The process noise of a state in this unit: a number, or a parameter.
    pub(in crate::model) fn process_noise(
        &mut self,
        expr: &'a Expr,
        unit: &Unit,
        diagnostics: &mut Diagnostics,
    ) -> Result<ProcessNoise, ErrorReported> {
        let rate = rate_of(unit).map_err(|symbol| {
            let message = format!("the exponents of `{symbol}` are too large");
            diagnostics.error(Diagnostic::new(Code::UnitsOfSides, expr.span, message))
        })?;
        let typed = self.lowering.in_unit(
            expr,
            &rate,
            NumberReading::Size,
            &OpenArguments::new(),
            diagnostics,
        )?;
        if let Node::Symbol(Symbol::Parameter(i)) = self.lowering.graph.node(typed.id) {
            return Ok(ProcessNoise::Parameter(i));
        }
        match self.lowering.number(typed.id) {
            Some(value) if value >= 0.0 && value.is_finite() => Ok(ProcessNoise::Known(value)),
            Some(_) => {
                let message = "the noise of a state must be zero or above";
                Err(diagnostics.error(Diagnostic::new(Code::SizeNotPositive, expr.span, message)))
            }
            None => {
                let message =
                    "the noise of a state is a number or a parameter, and this is a formula";
                Err(diagnostics.error(
                    Diagnostic::new(Code::ValueNotConstant, expr.span, message)
                        .help(format!("declare a parameter in `{}`", rate.symbol)),
                ))
            }
        }
    }
}

/// The unit of process noise: that of the quantity over the root of a second.
fn rate_of(unit: &Unit) -> Result<Unit, String> {
    let differences = unit.of_differences();
    let second = parse_unit("s^(1/2)").map_err(|_| "s^(1/2)".to_owned())?.dimension;
    let symbol = format!("{}/s^(1/2)", differences.symbol);
    let dimension = differences.dimension.divide(second).ok_or_else(|| symbol.clone())?;
    Ok(Unit { symbol, dimension, ..differences })
}
