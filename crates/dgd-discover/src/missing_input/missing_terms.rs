//! A model with an unknown input in every equation that is not `exact`, added to every parameter and input, and in
//! every output.
//!
//! ```text
//!   equation i:  left = right + d_i        output j:  w_j = … + d_j
//!   parameter k: p_k + d_k for p_k         input l:   u_l + d_l for u_l
//! ```
//!
//! Equations of several modes with one label and one dimension share one unknown input. A parameter or an input that no
//! equation or output reads has none.
//!
//! Inputs are added to the resolved model, before derivatives are solved for, so that d_i is missing from the
//! right-hand side *as the user wrote it*, in the unit of its two sides: `A*der(h) = q` takes a d in m³/s whatever the
//! system's row becomes. The effect of d on rows and outputs is then given by the generated ∂f/∂u and ∂w/∂u, which are
//! exact even where outputs read derivatives.

use std::collections::{BTreeSet, HashMap};

use dgd_compiler::dae::assemble;
use dgd_compiler::diagnostics::{Diagnostics, ErrorReported};
use dgd_compiler::expr::{ExprGraph, ExprId, Symbol};
use dgd_compiler::model::{DeclarationHeader, Input, Interpolation, Model};
use dgd_compiler::program::lower;
use dgd_compiler::source::Span;
use dgd_compiler::units::{Dimension, Unit, describe};
use dgd_execute::{Engine, LoadedSystem};

use crate::library::OutputScales;

/// A place at which something can be missing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MissingPlace {
    /// An equation, a parameter, an input or an output.
    pub kind: PlaceKind,
    /// The equation's label, or the name of the parameter, input or output.
    pub name: String,
    /// Unit of the missing term there, in SI base units.
    pub unit: String,
}

/// Kind of a [`MissingPlace`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlaceKind {
    /// Missing physics: a term of the equation's right-hand side.
    Equation,
    /// A parameter that changes: its deviation from its value.
    Parameter,
    /// A wrong input: the true minus the recorded value.
    Input,
    /// A sensor error: the reading minus the true value.
    Output,
}

impl MissingPlace {
    /// Name of the place in a result: `sensor NAME` for an output, otherwise its name.
    pub fn called(&self) -> String {
        match self.kind {
            PlaceKind::Equation | PlaceKind::Parameter | PlaceKind::Input => self.name.clone(),
            PlaceKind::Output => format!("sensor {}", self.name),
        }
    }
}

/// A place that cannot be examined.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ClosedPlace {
    /// The place.
    pub place: MissingPlace,
    /// The reason.
    pub reason: String,
}

/// Why an equation cannot be examined.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum NoSuchTerm {
    /// No equation has this label.
    NoEquation,
    /// It is declared exact.
    Exact,
    /// The model with an unknown input there does not compile, with the reason.
    Closed(String),
}

/// A model with an unknown input added to every output, parameter and input, and a further term in every equation that
/// is not declared exact.
///
/// Unknowns, parameters and outputs are those of the model, in its order. The inputs are the model's, followed by one
/// for each of `places`, which is zero in the original model.
#[derive(Debug, Clone)]
pub struct MissingTerms {
    system: LoadedSystem,
    places: Vec<MissingPlace>,
    closed: Vec<ClosedPlace>,
}

impl MissingTerms {
    /// Opens all places of a model. A place stays closed if its equation would have to be differentiated: a missing
    /// input is piecewise constant and has no slope.
    ///
    /// # Errors
    ///
    /// [`ErrorReported`] if the model itself does not compile.
    pub fn new(
        model: &Model,
        engine: Engine,
        diagnostics: &mut Diagnostics,
    ) -> Result<Self, ErrorReported> {
        Self::scaled(model, &OutputScales::default(), engine, diagnostics)
    }

    /// Opens all places of a model whose outputs are in these scales, as are the errors of sensors.
    pub(crate) fn scaled(
        model: &Model,
        scales: &OutputScales,
        engine: Engine,
        diagnostics: &mut Diagnostics,
    ) -> Result<Self, ErrorReported> {
        let model = &scales.declared(model.clone());
        let all_places = places(model);
        let open = |some: &[MissingPlace], diagnostics: &mut Diagnostics| {
            let opened = scales.applied(opened(model, some));
            assemble(&opened, diagnostics).map(|dae| lower(&dae, &[]))
        };
        if let Ok(program) = open(&all_places, &mut Diagnostics::default()) {
            let system = LoadedSystem::with_engine(program, engine);
            return Ok(MissingTerms { system, places: all_places, closed: Vec::new() });
        }
        let (mut places, mut closed) = (Vec::new(), Vec::new());
        for place in all_places {
            let mut place_diagnostics = Diagnostics::default();
            if open(std::slice::from_ref(&place), &mut place_diagnostics).is_ok() {
                places.push(place);
            } else {
                let first =
                    place_diagnostics.sorted().first().map(|diagnostic| diagnostic.message.clone());
                closed.push(ClosedPlace { place, reason: first.unwrap_or_default() });
            }
        }
        let system = LoadedSystem::with_engine(open(&places, diagnostics)?, engine);
        Ok(MissingTerms { system, places, closed })
    }

    /// Opens only the places of one equation, by its label: one for each unit among equations with this label.
    ///
    /// # Errors
    ///
    /// [`NoSuchTerm`]: no equation has this label, all such equations are exact, or one would have to be
    /// differentiated.
    pub fn of_equation(model: &Model, label: &str, engine: Engine) -> Result<Self, NoSuchTerm> {
        let mut named = model.all_equations().filter(|equation| equation.label == label).peekable();
        if named.peek().is_none() {
            return Err(NoSuchTerm::NoEquation);
        }
        if named.all(|equation| equation.is_exact) {
            return Err(NoSuchTerm::Exact);
        }
        let is_of_equation =
            |place: &MissingPlace| place.kind == PlaceKind::Equation && place.name == label;
        let places: Vec<MissingPlace> = places(model).into_iter().filter(is_of_equation).collect();
        let mut diagnostics = Diagnostics::default();
        let program =
            assemble(&opened(model, &places), &mut diagnostics).map(|dae| lower(&dae, &[]));
        let Ok(program) = program else {
            let first = diagnostics.sorted().first().map(|one| one.message.clone());
            return Err(NoSuchTerm::Closed(first.unwrap_or_default()));
        };
        let system = LoadedSystem::with_engine(program, engine);
        Ok(MissingTerms { system, places, closed: Vec::new() })
    }

    /// The model with its unknown inputs.
    pub fn system(&self) -> &LoadedSystem {
        &self.system
    }

    /// The places of the unknown inputs, in order.
    pub fn places(&self) -> &[MissingPlace] {
        &self.places
    }

    /// Places without an unknown input, with the reasons.
    pub fn closed(&self) -> &[ClosedPlace] {
        &self.closed
    }
}

/// All places of a model: equations, parameters, inputs, outputs, each in the model's order.
fn places(model: &Model) -> Vec<MissingPlace> {
    let place = |kind: PlaceKind, name: &str, dimension: Dimension| MissingPlace {
        kind,
        name: name.to_owned(),
        unit: model.spelling(dimension),
    };
    let mut places: Vec<MissingPlace> = Vec::new();
    for equation in model.all_equations().filter(|equation| !equation.is_exact) {
        let of_equation = place(PlaceKind::Equation, &equation.label, equation.dimension);
        if !places.contains(&of_equation) {
            places.push(of_equation);
        }
    }
    let equations = model.all_equations().flat_map(|equation| [equation.left, equation.right]);
    let roots = equations.chain(model.outputs.iter().map(|output| output.value));
    let read: BTreeSet<Symbol> = roots.flat_map(|root| model.graph.symbols(root)).collect();
    let is_read = |symbol: fn(u32) -> Symbol, i: usize| {
        u32::try_from(i).is_ok_and(|i| read.contains(&symbol(i)))
    };
    for (i, parameter) in model.parameters.iter().enumerate() {
        if is_read(Symbol::Parameter, i) {
            let DeclarationHeader { name, unit, .. } = &parameter.declared;
            places.push(place(PlaceKind::Parameter, name, unit.dimension));
        }
    }
    for (i, input) in model.inputs.iter().enumerate() {
        if is_read(Symbol::Input, i) {
            let DeclarationHeader { name, unit, .. } = &input.declared;
            places.push(place(PlaceKind::Input, name, unit.dimension));
        }
    }
    for output in &model.outputs {
        let DeclarationHeader { name, unit, .. } = &output.declared;
        places.push(place(PlaceKind::Output, name, unit.dimension));
    }
    places
}

/// A model with an unknown input at each of some places, after its own inputs and in the order of the places.
fn opened(base: &Model, places: &[MissingPlace]) -> Model {
    let mut model = base.clone();
    let first = model.inputs.len();
    let mut behind: HashMap<Symbol, ExprId> = HashMap::new();
    let mut unknown_inputs: Vec<ExprId> = Vec::new();
    for place in places {
        let position = |mut names: Box<dyn Iterator<Item = &DeclarationHeader> + '_>| {
            let index = names.position(|declared| declared.name == place.name);
            index.and_then(|i| u32::try_from(i).ok())
        };
        let (symbol, dimension) = match place.kind {
            PlaceKind::Parameter => {
                let i = position(Box::new(base.parameters.iter().map(|p| &p.declared)));
                let unit = i.map(|i| &base.parameters[i as usize].declared.unit);
                (i.map(Symbol::Parameter), unit.map(|unit| unit.dimension))
            }
            PlaceKind::Input => {
                let i = position(Box::new(base.inputs.iter().map(|input| &input.declared)));
                let unit = i.map(|i| &base.inputs[i as usize].declared.unit);
                (i.map(Symbol::Input), unit.map(|unit| unit.dimension))
            }
            PlaceKind::Equation => {
                let mut equations = base.all_equations();
                let matching = equations
                    .find(|e| e.label == place.name && base.spelling(e.dimension) == place.unit);
                (None, matching.map(|equation| equation.dimension))
            }
            PlaceKind::Output => {
                let i = position(Box::new(base.outputs.iter().map(|output| &output.declared)));
                (None, i.map(|i| base.outputs[i as usize].declared.unit.dimension))
            }
        };
        let dimension = dimension.unwrap_or(Dimension::ONE);
        let d = unknown_input(&mut model.graph, &mut model.inputs, &place.called(), dimension);
        unknown_inputs.push(d);
        if let Some(symbol) = symbol {
            let original = model.graph.symbol(symbol);
            let sum = model.graph.add(original, d);
            behind.insert(symbol, sum);
        }
    }
    debug_assert_eq!(model.inputs.len(), first + places.len(), "an input for each place");

    let added = |kind: PlaceKind, name: &str, unit: &str| {
        let is_own =
            |place: &&MissingPlace| place.kind == kind && place.name == name && place.unit == unit;
        places.iter().zip(&unknown_inputs).find(|(place, _)| is_own(place)).map(|(_, d)| *d)
    };
    let graph = &mut model.graph;
    let shifted = |graph: &mut ExprGraph, root: ExprId| {
        graph.substitute(root, |symbol| behind.get(&symbol).copied())
    };
    let modes = model.automata.iter_mut().flat_map(|automaton| &mut automaton.modes);
    let of_modes = modes.flat_map(|mode| &mut mode.equations);
    for equation in model.equations.iter_mut().chain(of_modes) {
        equation.left = shifted(graph, equation.left);
        equation.right = shifted(graph, equation.right);
        let unit = base.spelling(equation.dimension);
        let d = if equation.is_exact {
            None
        } else {
            added(PlaceKind::Equation, &equation.label, &unit)
        };
        if let Some(d) = d {
            equation.right = graph.add(equation.right, d);
        }
    }
    for family in &mut model.families {
        family.equation.left = shifted(graph, family.equation.left);
        family.equation.right = shifted(graph, family.equation.right);
    }
    for output in &mut model.outputs {
        output.value = shifted(graph, output.value);
        let DeclarationHeader { name, unit, .. } = &output.declared;
        if let Some(d) = added(PlaceKind::Output, name, &base.spelling(unit.dimension)) {
            output.value = graph.add(output.value, d);
        }
    }
    model
}

/// Adds an input, and returns it as an expression. Its name is one that no user can declare.
fn unknown_input(
    graph: &mut ExprGraph,
    inputs: &mut Vec<Input>,
    of: &str,
    dimension: Dimension,
) -> ExprId {
    let position = u32::try_from(inputs.len()).unwrap_or(u32::MAX);
    inputs.push(Input {
        declared: DeclarationHeader {
            name: format!("missing({of})"),
            span: Span::default(),
            unit: Unit { symbol: describe(dimension), dimension, ..Unit::one() },
            doc: Vec::new(),
        },
        interpolation: Interpolation::Hold,
    });
    graph.symbol(Symbol::Input(position))
}
