//! A model with resolved names, checked units and values in SI.

mod arrays;
mod check_units;
mod choose;
mod density;
mod expression;
mod item;
mod modes;
mod options;
mod resolve;
mod resolver;
mod scope;
mod start;
pub mod text;
pub mod typeset;

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use crate::expr::{ExprGraph, ExprId, Symbol};
use crate::source::Span;
use crate::units::{Dimension, Unit, describe, parse_unit};

pub use crate::syntax::ast::{BoundSide, Name};
pub use dgd_signature::{Crossing, Density, Interpolation, PriorDensity};

pub use crate::parts::InnerModel;
pub use options::{ModelOptions, Setting};
pub use resolve::{resolve, resolve_noting};

/// `resolve` guarantees that
///
/// - every name is a position in one of the lists below,
/// - every expression has a dimension and every equation balances,
/// - functions are expanded, the chosen variants' items are in place, imports are merged,
/// - values are in SI; expressions are as written, not simplified.
#[derive(Debug, Clone, Default)]
pub struct Model {
    /// Its name.
    pub name: String,
    /// Doc comment above it.
    pub doc: Vec<String>,
    /// All expressions.
    pub graph: ExprGraph,
    /// `constant`s.
    pub constants: Vec<Constant>,
    /// `parameter`s.
    pub parameters: Vec<Parameter>,
    /// Smoothness of tables: densities of their parameters, from `smooth`.
    pub smoothness: Vec<Smoothness>,
    /// `input`s.
    pub inputs: Vec<Input>,
    /// `state`s and `unknown`s.
    pub unknowns: Vec<Unknown>,
    /// Arrays of `state`s and `unknown`s.
    pub arrays: Vec<Array>,
    /// `size`s and their values.
    pub sizes: Vec<(Name, i64)>,
    /// `let`s, ordered so that each needs only earlier ones.
    pub lets: Vec<Let>,
    /// `output`s, then those that compute standard deviations.
    pub outputs: Vec<Output>,
    /// Distributions of the readings for which `noise` is more than a number.
    pub densities: Vec<Density>,
    /// `output`s that read an array, element by element.
    pub output_arrays: Vec<OutputArray>,
    /// `equation`s that hold in every mode.
    pub equations: Vec<Equation>,
    /// Equations of loops, which hold for each index.
    pub families: Vec<Family>,
    /// `modes` and `when`s.
    pub automata: Vec<Automaton>,
    /// `saturate`.
    pub saturations: Vec<Saturation>,
    /// Place of the clause by which runs start at rest, if there is one.
    pub starts_at_rest: Option<Span>,
    /// Equations that hold at the start in addition to the others.
    pub start_equations: Vec<Equation>,
    /// `variant`s and the choices made.
    pub variants: Vec<Variant>,
    /// `part`s and nested parts; their items are in the lists above.
    pub parts: Vec<InnerModel>,
}

/// Common properties of declarations.
#[derive(Debug, Clone, PartialEq)]
pub struct DeclarationHeader {
    /// Its name.
    pub name: String,
    /// Place of the name.
    pub span: Span,
    /// Its unit.
    pub unit: Unit,
    /// Doc comment.
    pub doc: Vec<String>,
}

/// A `constant`.
#[derive(Debug, Clone)]
pub struct Constant {
    /// Name, place, unit, doc.
    pub declared: DeclarationHeader,
    /// Value, SI.
    pub value: f64,
}

/// A `parameter`.
#[derive(Debug, Clone)]
pub struct Parameter {
    /// Name, place, unit, doc.
    pub declared: DeclarationHeader,
    /// Value, SI.
    pub value: f64,
    /// Lower bound, SI; minus infinity if unbounded.
    pub lower: f64,
    /// Upper bound, SI; infinity if unbounded.
    pub upper: f64,
    /// The logarithm is estimated.
    pub log: bool,
    /// Not estimated unless requested.
    pub fixed: bool,
    /// Size for scaling, SI.
    pub nominal: Option<f64>,
    /// Its prior, SI.
    pub prior: Option<PriorDensity>,
}

/// The effect of a table's `smooth` on its values, at one of its points: Σ weight · parameter is normal.
#[derive(Debug, Clone, PartialEq)]
pub struct Smoothness {
    /// Name of the table.
    pub table: String,
    /// Positions of parameters, ascending, and their weights in SI.
    pub weights: Vec<(u32, f64)>,
    /// Mean of the sum, SI.
    pub mean: f64,
    /// Its standard deviation, SI.
    pub std: f64,
}

/// An `input`.
#[derive(Debug, Clone)]
pub struct Input {
    /// Name, place, unit, doc.
    pub declared: DeclarationHeader,
    /// Interpolation between samples.
    pub interpolation: Interpolation,
}

/// A `state` or `unknown`.
#[derive(Debug, Clone)]
pub struct Unknown {
    /// Name, place, unit, doc.
    pub declared: DeclarationHeader,
    /// Whether it was declared `state`, so that its derivative may be used.
    pub state: bool,
    /// Start value, or guess if it turns out to be algebraic: of parameters and inputs.
    pub start: ExprId,
    /// Whether its start value is excluded from estimation.
    pub fixed: bool,
    /// Whether a start equation determines its start value.
    pub guess: bool,
    /// Size for tolerances, SI.
    pub nominal: Option<f64>,
    /// Its history before the start, in terms of time and parameters; `None` means its start value.
    pub history: Option<ExprId>,
    /// Its process noise, if declared.
    pub noise: Option<ProcessNoise>,
}

/// Process noise of a state: r in dx = f dt + r dβ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ProcessNoise {
    /// A constant, SI.
    Known(f64),
    /// The parameter at this position.
    Parameter(u32),
}

/// An array of `state`s or `unknown`s. Its start value holds for each element: in it,
/// [`crate::expr::Symbol::Counter`] is the element's distance from the first.
#[derive(Debug, Clone)]
pub struct Array {
    /// Common properties of its elements.
    pub unknown: Unknown,
    /// Index of its first element.
    pub lower: i64,
    /// Position of its first element among those of all arrays.
    pub first: u32,
    /// Number of elements.
    pub count: u32,
}

/// An equation for each index of a loop.
#[derive(Debug, Clone)]
pub struct Family {
    /// The equation; swept elements and the counter move with the index.
    pub equation: Equation,
    /// Name of the index.
    pub index: String,
    /// First index.
    pub lower: i64,
    /// Number of equations, at least two.
    pub count: u32,
}

/// A `let`.
#[derive(Debug, Clone)]
pub struct Let {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: ExprId,
    /// Its dimension.
    pub dimension: Dimension,
}

/// An `output`.
#[derive(Debug, Clone)]
pub struct Output {
    /// Name, place, unit, doc.
    pub declared: DeclarationHeader,
    /// Its value.
    pub value: ExprId,
    /// Standard deviation of the sensor's white noise, SI.
    pub noise: Option<f64>,
}

/// An `output` for each element of an array.
#[derive(Debug, Clone)]
pub struct OutputArray {
    /// Name, place, unit, doc.
    pub declared: DeclarationHeader,
    /// Position of the array.
    pub array: usize,
    /// Standard deviation of the sensors' white noise, SI.
    pub noise: Option<f64>,
}

/// An `equation`: left = right.
#[derive(Debug, Clone)]
pub struct Equation {
    /// Its label.
    pub label: String,
    /// The whole equation's place.
    pub span: Span,
    /// Doc comment.
    pub doc: Vec<String>,
    /// Left side.
    pub left: ExprId,
    /// Right side.
    pub right: ExprId,
    /// Dimension of both sides.
    pub dimension: Dimension,
    /// Whether it is declared to lack no term.
    pub is_exact: bool,
}

/// The item that an automaton comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AutomatonOrigin {
    /// A `modes` block.
    Modes,
    /// A `when`: one mode without equations, and a transition from it to itself for each of its conditions.
    When,
    /// An `every`: one mode without equations, and a transition from it to itself.
    Every,
}

/// A `modes` block, with equations for each mode, or a `when` or an `every`.
#[derive(Debug, Clone)]
pub struct Automaton {
    /// The item that it comes from.
    pub origin: AutomatonOrigin,
    /// Its name; of a `when` its condition as written, of an `every` its period and offset.
    pub name: String,
    /// Doc comment.
    pub doc: Vec<String>,
    /// Modes, in the order written.
    pub modes: Vec<Mode>,
    /// The initial mode if no condition selects another.
    pub start: usize,
    /// Its transitions, then the conditions that select the initial mode.
    pub transitions: Vec<Transition>,
    /// The first time and the period of an `every`: of parameters.
    pub period: Option<[ExprId; 2]>,
}

impl Automaton {
    /// Description in messages of the reader of an expression in its transitions.
    pub fn reader(&self) -> String {
        match self.origin {
            AutomatonOrigin::Modes => format!("a transition of `{}`", self.name),
            AutomatonOrigin::When => "`when`".to_owned(),
            AutomatonOrigin::Every => "`every`".to_owned(),
        }
    }
}

/// A mode of an [`Automaton`].
#[derive(Debug, Clone)]
pub struct Mode {
    /// Its name.
    pub name: String,
    /// Doc comment.
    pub doc: Vec<String>,
    /// Equations that hold in this mode, in addition to those of the model.
    pub equations: Vec<Equation>,
}

/// A transition between modes, when `left` passes `right`.
#[derive(Debug, Clone)]
pub struct Transition {
    /// Its place.
    pub span: Span,
    /// Position of the mode that it leaves; `None` at the start of a run.
    pub from: Option<usize>,
    /// Position of the mode that it enters.
    pub to: usize,
    /// The watched expression; for a start condition, 1 if it holds and −1 otherwise.
    pub left: ExprId,
    /// Direction in which it passes `right`.
    pub crossing: Crossing,
    /// The expression that it is compared with.
    pub right: ExprId,
    /// Unknowns that it resets, with their new values.
    pub resets: Vec<Reset>,
}

/// A new value that a transition gives to an unknown.
#[derive(Debug, Clone)]
pub struct Reset {
    /// Its place.
    pub span: Span,
    /// The unknown, or the element of an array.
    pub unknown: Symbol,
    /// Its new value.
    pub value: ExprId,
}

/// A bound within which an unknown stays even if its equation would take it beyond.
#[derive(Debug, Clone)]
pub struct Saturation {
    /// The whole item's place.
    pub span: Span,
    /// The unknown, or the element of an array.
    pub unknown: Symbol,
    /// The side of the unknown on which the bound lies.
    pub side: BoundSide,
    /// The bound: of parameters, inputs and time.
    pub bound: ExprId,
}

/// A `variant` and the choice made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Variant {
    /// Its name.
    pub name: String,
    /// The possible choices, in the order written, the default first; a choice is impossible if it would read an
    /// unbound input of a part.
    pub choices: Vec<String>,
    /// Position of the choice made.
    pub chosen: usize,
}

impl Variant {
    /// The name of the choice made.
    pub fn choice(&self) -> &str {
        self.choices.get(self.chosen).map_or("", String::as_str)
    }
}

impl Model {
    /// The coherent SI unit of a dimension, in the model's spelling: a torque is in N*m, not in J, if an input, an
    /// output, an unknown or a parameter is.
    pub fn spelling(&self, dimension: Dimension) -> String {
        let mut units = self.declared_units();
        let is_same = |unit: &&Unit| {
            unit.dimension == dimension
                && unit.factor == 1.0
                && unit.offset == 0.0
                && unit.datum.is_none()
        };
        let declared = units.find(is_same).map(|unit| unit.symbol.clone());
        declared.or_else(|| self.composed(dimension)).unwrap_or_else(|| describe(dimension))
    }

    /// The coherent SI unit of a dimension, composed like the units of the model: if friction is in N*m*s/rad, a torque
    /// is in N*m, and the rate of a state in W is in W/s.
    fn composed(&self, dimension: Dimension) -> Option<String> {
        let is_it = |symbol: &String| {
            parse_unit(symbol).is_ok_and(|unit| {
                unit.dimension == dimension && unit.factor == 1.0 && unit.offset == 0.0
            })
        };
        let mut products = self.declared_units().flat_map(|unit| {
            let above = unit.symbol.split('/').next().unwrap_or_default();
            let ends = above.match_indices('*').map(|(at, _)| at).chain([above.len()]);
            ends.skip(1).map(|end| above[..end].to_owned()).collect::<Vec<_>>()
        });
        if let Some(product) = products.find(&is_it) {
            return Some(product);
        }
        // A unit with a name is clearer than a rate.
        if describe(dimension).chars().all(char::is_alphanumeric) {
            return None;
        }
        let of_unknowns =
            self.unknowns.iter().map(|unknown| unknown.declared.unit.of_differences());
        let mut rates = of_unknowns.map(|unit| {
            let is_simple = !unit.symbol.contains('/');
            if is_simple { format!("{}/s", unit.symbol) } else { format!("({})/s", unit.symbol) }
        });
        rates.find(is_it)
    }

    /// The most readable unit for differences of this dimension: that of the first quantity with that dimension.
    pub fn familiar(&self, dimension: Dimension) -> Unit {
        let mut units = self.declared_units().map(Unit::of_differences);
        let fits = |unit: &Unit| unit.dimension == dimension && unit.offset == 0.0;
        let named = units.find(fits).or_else(|| parse_unit(&self.spelling(dimension)).ok());
        named.unwrap_or_else(|| Unit { symbol: describe(dimension), dimension, ..Unit::one() })
    }

    /// Units of the quantities that users read and write: inputs, outputs, unknowns, parameters, in this order.
    fn declared_units(&self) -> impl Iterator<Item = &Unit> {
        let declared = (self.inputs.iter().map(|input| &input.declared))
            .chain(self.outputs.iter().map(|output| &output.declared))
            .chain(self.unknowns.iter().map(|unknown| &unknown.declared))
            .chain(self.parameters.iter().map(|parameter| &parameter.declared));
        declared.map(|declared| &declared.unit)
    }

    /// All equations: those that always hold, then those of the modes, block by block.
    pub fn all_equations(&self) -> impl Iterator<Item = &Equation> {
        let modes = self.automata.iter().flat_map(|automaton| &automaton.modes);
        self.equations.iter().chain(modes.flat_map(|mode| &mode.equations))
    }

    /// All equations, then those of loops.
    pub fn equations_and_loops(&self) -> impl Iterator<Item = &Equation> {
        self.all_equations().chain(self.families.iter().map(|family| &family.equation))
    }

    /// Name of an unknown or an element.
    ///
    /// # Panics
    ///
    /// If it is neither.
    pub fn unknown_name(&self, symbol: Symbol) -> String {
        match symbol {
            Symbol::Unknown(i) => self.unknowns[i as usize].declared.name.clone(),
            Symbol::Element(i) => self.element_name(i),
            _ => unreachable!("neither an unknown nor an element"),
        }
    }

    /// The process noise of a state or element of this name, if declared.
    pub fn process_noise(&self, state: &str) -> Option<ProcessNoise> {
        let single = self.unknowns.iter().find(|unknown| unknown.declared.name == state);
        let of_array = || {
            let (array, _) = state.rsplit_once('[')?;
            let array = self.arrays.iter().find(|row| row.unknown.declared.name == array)?;
            Some(&array.unknown)
        };
        single.or_else(of_array)?.noise
    }

    /// Name of the element at this position among those of all arrays.
    ///
    /// # Panics
    ///
    /// If the model has no element at this position.
    pub fn element_name(&self, position: u32) -> String {
        let array = self.array_of(position);
        let index = array.lower + i64::from(position - array.first);
        format!("{}[{index}]", array.unknown.declared.name)
    }

    /// The array, or the row of one, that holds the element at this position among those of all arrays.
    ///
    /// # Panics
    ///
    /// If the model has no element at this position.
    pub fn array_of(&self, position: u32) -> &Array {
        let after = self.arrays.partition_point(|array| array.first <= position);
        &self.arrays[after - 1]
    }

    /// The model's names of expressions: its `let`s.
    pub fn let_names(&self) -> BTreeMap<ExprId, String> {
        self.lets.iter().map(|l| (l.value, l.name.clone())).collect()
    }
}
