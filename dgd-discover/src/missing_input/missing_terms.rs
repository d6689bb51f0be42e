//! A model with room for what is missing: an unknown input in every output and in every equation that is not `exact`.
//!
//! ```text
//!   equation i:  left = right + d_i        output j:  w_j = … + d_j
//! ```
//!
//! Equations of several modes that bear one label and measure the same share one unknown input.
//!
//! This is done to the resolved model, before derivatives are solved for, so that d_i is what the
//! right-hand side *as the user wrote it* would have needed, in the unit of its two sides:
//! `A*der(h) = q` takes a d in m³/s whatever the system's row becomes. How d acts on rows and outputs
//! is then the generated ∂f/∂u and ∂w/∂u, exact where outputs read derivatives, too.

use dgd_compiler::dae::assemble;
use dgd_compiler::diagnostics::{Diagnostics, Reported};
use dgd_compiler::expr::{ExprId, Graph, Symbol};
use dgd_compiler::model::{Declared, Input, Interpolation, Model};
use dgd_compiler::program::lower;
use dgd_compiler::source::Span;
use dgd_compiler::units::{Dimension, Unit, describe};
use dgd_execute::{Engine, Loaded};

/// Where something can be missing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// An equation or an output.
    pub kind: PlaceKind,
    /// The equation's label or the output's name.
    pub name: String,
    /// Unit of what is missing there, of SI base units.
    pub unit: String,
}

/// Kind of a [`Place`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlaceKind {
    /// Missing physics: a term of the equation's right-hand side.
    Equation,
    /// A sensor's error: what it reads more than there is.
    Output,
}

/// A model in which every output has an unknown input, and every equation that is not declared exact.
///
/// Unknowns, parameters and outputs are those of the model, in its order. The inputs are the model's
/// and behind them one for each of `places`, zero in the model as it was given.
#[derive(Debug, Clone)]
pub struct MissingTerms {
    system: Loaded,
    places: Vec<Place>,
}

impl MissingTerms {
    /// Gives every equation that is not exact, then every output, an unknown input.
    ///
    /// # Errors
    ///
    /// [`Reported`] where the model itself makes no system.
    pub fn new(
        model: &Model,
        engine: Engine,
        diagnostics: &mut Diagnostics,
    ) -> Result<Self, Reported> {
        let base = model;
        let mut model = base.clone();
        let mut places = Vec::new();
        let (graph, inputs) = (&mut model.graph, &mut model.inputs);
        let modes = model.automata.iter_mut().flat_map(|automaton| &mut automaton.modes);
        let of_modes = modes.flat_map(|mode| &mut mode.equations);
        let mut given: Vec<(Place, ExprId)> = Vec::new();
        let all = model.equations.iter_mut().chain(of_modes);
        for equation in all.filter(|equation| !equation.is_exact) {
            let place = place(base, PlaceKind::Equation, &equation.label, equation.dimension);
            let earlier = given.iter().find(|(other, _)| *other == place).map(|(_, d)| *d);
            let d = earlier.unwrap_or_else(|| {
                let d = unknown_input(graph, inputs, &equation.label, equation.dimension);
                given.push((place, d));
                d
            });
            equation.right = graph.add(equation.right, d);
        }
        places.extend(given.into_iter().map(|(place, _)| place));
        for output in &mut model.outputs {
            let Declared { name, unit, .. } = &output.declared;
            let d = unknown_input(graph, inputs, name, unit.dimension);
            output.value = graph.add(output.value, d);
            places.push(place(base, PlaceKind::Output, name, unit.dimension));
        }
        let dae = assemble(&model, diagnostics)?;
        Ok(MissingTerms { system: Loaded::with_engine(lower(&dae, &[]), engine), places })
    }

    /// The model with its unknown inputs.
    pub fn system(&self) -> &Loaded {
        &self.system
    }

    /// What the unknown inputs are, in their order.
    pub fn places(&self) -> &[Place] {
        &self.places
    }
}

/// Adds an input, and returns it as an expression. Its name is that of no input a user can declare.
fn unknown_input(
    graph: &mut Graph,
    inputs: &mut Vec<Input>,
    of: &str,
    dimension: Dimension,
) -> ExprId {
    let position = u32::try_from(inputs.len()).unwrap_or(u32::MAX);
    inputs.push(Input {
        declared: Declared {
            name: format!("missing({of})"),
            span: Span::default(),
            unit: Unit { symbol: describe(dimension), dimension, ..Unit::one() },
            doc: Vec::new(),
        },
        interpolation: Interpolation::Hold,
    });
    graph.symbol(Symbol::Input(position))
}

fn place(base: &Model, kind: PlaceKind, name: &str, dimension: Dimension) -> Place {
    Place { kind, name: name.to_owned(), unit: base.spelling(dimension) }
}
